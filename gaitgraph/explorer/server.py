"""The server: routes, what they answer, and how it is run on the loopback address."""

from __future__ import annotations

import json
import secrets
import socket
import sys
import threading
import time
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from gaitgraph import __version__
from gaitgraph.errors import GaitgraphError, InputError, needs_extra, shown
from gaitgraph.explorer.guards import Guard, TooLarge, TooSlow, error_bytes
from gaitgraph.explorer.jobs import LONGEST, Job, Stopped, run_job
from gaitgraph.explorer.state import DEFAULTS, LIMITS, RANGES, checked_object, state_of

if TYPE_CHECKING:
    from asyncio import TimerHandle
    from collections.abc import Awaitable, Callable, Iterable

    from starlette.requests import Request
    from starlette.responses import Response

__all__ = ["Listening", "application"]

ADDRESS = "127.0.0.1"
_PAGE = Path(__file__).parent / "page"
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    "": "text/plain; charset=utf-8",
}
"""Of the files that the page is made of; licences have no suffix."""

_MOST_DIGITS = 400  # no float has more before its point
_HEAD_SECONDS = 10.0
_MOST_CONNECTIONS = 400

_API: dict[str, int] = {
    "api/plan": LIMITS["request_bytes"],
    "api/diagram": LIMITS["request_bytes"],
    "api/map": LIMITS["request_bytes"],
    "api/download": LIMITS["request_bytes"],
    "api/table": LIMITS["table_bytes"],
}


def page_files() -> dict[str, tuple[Path, str]]:
    """Return the files of the page by the name under which each is asked for, with its media type."""
    return {
        path.relative_to(_PAGE).as_posix(): (path, _TYPES[path.suffix])
        for path in sorted(_PAGE.rglob("*"))
        if path.is_file() and path.suffix in _TYPES
    }


def application(token: str, port: int) -> Any:
    """Return the ASGI application.

    Parameters
    ----------
    token
        The first part of every path.
    port
        Where it will listen: Host and Origin must name it.

    Raises
    ------
    MissingExtra
        If starlette is not installed.
    """
    try:
        from starlette.applications import Starlette
        from starlette.middleware.trustedhost import TrustedHostMiddleware
        from starlette.routing import Route
    except ImportError as error:
        raise needs_extra("starlette", "the explorer", "explore") from error

    files = page_files()

    async def page(request: Request) -> Response:
        return _file(files, request.path_params.get("name", "index.html"))

    async def setup(_: Request) -> Response:
        return _json(setup_answer())

    routes = [
        Route(f"/{token}/", page),
        Route(f"/{token}/page/{{name:path}}", page),
        Route(f"/{token}/api/setup", setup),
        Route(f"/{token}/api/plan", _asked(_plan), methods=["POST"]),
        Route(f"/{token}/api/diagram", _asked(_diagram), methods=["POST"]),
        Route(f"/{token}/api/map", _asked(_map), methods=["POST"]),
        Route(f"/{token}/api/table", _asked(_table, kind="application/octet-stream"), methods=["POST"]),
        Route(f"/{token}/api/download", _asked(_download), methods=["POST"]),
    ]
    app = Starlette(routes=routes, exception_handlers={404: _refused, 405: _refused})
    app.router.redirect_slashes = False
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=[ADDRESS, "localhost"], www_redirect=False)
    return Guard(app, token=token, port=port, most_bytes=_API)


async def _refused(request: Request, error: Exception) -> Response:
    headers = getattr(error, "headers", None) or {}
    if "Allow" not in headers:
        return _error(404, "no such page")
    methods = ", ".join(sorted(headers["Allow"].split(", ")))
    answer = _error(405, f"method: {shown(request.method)}; allowed is {methods}")
    answer.headers["Allow"] = methods
    return answer


def _error(status: int, message: str) -> Response:
    from starlette.responses import Response

    return Response(error_bytes(message), status, media_type="application/json")


def _json(content: Any) -> Response:
    from starlette.responses import Response

    body = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":")).encode()
    return Response(body, media_type="application/json")


def _file(files: dict[str, tuple[Path, str]], name: str) -> Response:
    from starlette.responses import Response

    if name not in files:
        return _error(404, f"no such page: {shown(name)}")
    path, media_type = files[name]
    return Response(path.read_bytes(), media_type=media_type)


def _asked(work: Callable[[Request, bytes, Job], Any], kind: str = "application/json") -> Callable[..., Awaitable[Any]]:
    """Return the handler of a POST: reads the body, works in a thread, and turns every error into one line."""

    async def handle(request: Request) -> Response:
        from starlette.requests import ClientDisconnect
        from starlette.responses import Response

        stated = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if stated != kind:
            return _error(415, f"Content-Type: {shown(stated)}; allowed is {kind}")
        try:
            body = await request.body()
            answer = await _while_waited_for(request, lambda job: work(request, body, job))
        except ClientDisconnect:  # nobody reads this
            return _error(400, "the client left before its question was whole")
        except TooSlow as error:
            answer = _error(408, str(error))
            answer.headers["Connection"] = "close"  # what is left of the body is not read
            return answer
        except TooLarge as error:
            return _error(413, str(error))
        except Stopped as error:
            return _error(503, str(error))
        except GaitgraphError as error:
            return _error(400, str(error))
        except MemoryError:
            return _error(503, "not enough memory for this; allowed are fewer waypoints, polygons, samples or rows")
        except Exception as error:
            told = " ".join(f"{type(error).__name__}: {error}".split())
            print(f"gaitgraph: {request.url.path.rpartition('/')[2]}: {told}", file=sys.stderr)
            return _error(500, f"the server could not answer this ({told}); it goes on")
        return answer if isinstance(answer, Response) else _json(answer)

    return handle


async def _while_waited_for(request: Request, work: Callable[[Job], Any]) -> Any:
    """Run work in a thread, and tell it to stop when the client goes away."""
    import asyncio

    job = Job(LONGEST)
    working = asyncio.ensure_future(run_job(work, job))

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        job.gone.set()

    watching = asyncio.ensure_future(watch())
    try:
        return await working
    finally:
        watching.cancel()
        working.cancel()


def _content(body: bytes) -> Any:
    try:
        return json.loads(
            body, parse_constant=_no_constant, parse_int=_whole_number, object_pairs_hook=_object_of_single_names
        )
    except InputError:
        raise
    except RecursionError as error:
        raise InputError("request: nested too deeply; allowed is an object") from error
    except ValueError as error:
        raise InputError(f"request: it is not JSON ({str(error).splitlines()[0]}); allowed is an object") from error


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _whole_number(digits: str) -> int:
    if len(digits) > _MOST_DIGITS:
        raise InputError(f"request: a number of {len(digits)} digits; allowed are {_MOST_DIGITS} at most")
    return int(digits)


def _object_of_single_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{shown(twice)}: given {names.count(twice)} times in one object; allowed is once")
    return found


def _plan(_: Request, body: bytes, job: Job) -> Any:
    from gaitgraph.explorer.answers import plan_answer

    start = time.perf_counter()
    answer = plan_answer(state_of(_content(body)), job.go_on)
    return {**answer, "server_ms": round(1e3 * (time.perf_counter() - start), 3)}


def _diagram(_: Request, body: bytes, job: Job) -> Any:
    from gaitgraph.explorer.answers import diagram_answer

    return diagram_answer(state_of(_content(body)), job.go_on)


def _map(_: Request, body: bytes, job: Job) -> Any:
    from gaitgraph.explorer.maps import map_answer

    return map_answer(_content(body), job.go_on)


def _table(request: Request, body: bytes, job: Job) -> Any:
    from gaitgraph.explorer.tables import table_answer

    return table_answer(request.query_params.get("name", ""), body, job.go_on)


def _download(_: Request, body: bytes, job: Job) -> Any:
    from starlette.responses import Response

    from gaitgraph.explorer.tables import file_answer

    asked = checked_object(_content(body), ("state", "suffix"))
    name, content = file_answer(state_of(asked.get("state", {})), asked.get("suffix", ".csv"), job.go_on)
    disposition = f"attachment; filename={quote(name)}"
    return Response(content, media_type="application/octet-stream", headers={"content-disposition": disposition})


@cache
def setup_answer() -> dict[str, Any]:
    """Return what the page offers: choices, presets, formats, limits, the empty state and the paper's gaits."""
    from gaitgraph.explorer.maps import SHADINGS
    from gaitgraph.explorer.tables import formats_answer
    from gaitgraph.planning.request import CHOICES
    from gaitgraph.timing.timed_gait import LAWS
    from gaitgraph.vehicle import preset_names, vehicle_named

    return {
        "version": __version__,
        "presets": [{"name": name, "drag_ratio": vehicle_named(name).drag_ratio} for name in preset_names()],
        "laws": list(LAWS),
        "objectives": list(CHOICES["objective"]),
        "colors": list(CHOICES["color"]),
        "signs": list(CHOICES["sign"]),
        "methods": list(CHOICES["method"]),
        "objectives_of": _objectives_of(CHOICES["method"], CHOICES["objective"]),
        "shadings": list(SHADINGS),
        "formats": formats_answer(),
        "defaults": DEFAULTS,
        "limits": LIMITS,
        "ranges": {name: asdict(one) | {"allowed": one.allowed} for name, one in RANGES.items()},
        "paper_gaits": _paper_gaits(),
    }


def _objectives_of(methods: Iterable[str], objectives: Iterable[str]) -> dict[str, list[str]]:
    """Return the objectives that go with each method: those that a request does not refuse."""
    found: dict[str, list[str]] = {method: [] for method in methods}
    for method, objective in product(found, objectives):
        with suppress(InputError):
            state_of({"method": method, "objective": objective})
            found[method].append(objective)
    return found


def _paper_gaits() -> list[dict[str, Any]]:
    """Return the four gaits of the paper's Section 5."""
    from gaitgraph.gait.paper_gaits import PAPER_GAITS, paper_gait
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.vehicle import PAPER

    found = {number: paper_gait(number, PAPER, coefficients_of()) for number in PAPER_GAITS}
    return [
        {
            "name": f"Gait {number}",
            "color": gait.color,
            "sign": "positive" if gait.R[0] > 0 else "negative",
            "waypoints": gait.alpha[:, :2].tolist(),
        }
        for number, gait in found.items()
    ]


class Listening:
    """A server that listens already, on the loopback address alone.

    Parameters
    ----------
    port
        Where; 0 for a free one.
    head_seconds
        A connection on which no whole head of a request has come for so long is closed.

    Raises
    ------
    InputError
        If the port is taken or not allowed.
    MissingExtra
        If starlette or uvicorn are not installed.
    """

    def __init__(self, port: int = 0, *, head_seconds: float = _HEAD_SECONDS) -> None:
        try:
            import uvicorn
        except ImportError as error:
            raise needs_extra("uvicorn", "the explorer", "explore") from error
        self.token = secrets.token_urlsafe(16)
        self._socket = _bound(port)
        self.port = int(self._socket.getsockname()[1])
        try:
            app = application(self.token, self.port)
        except InputError:
            self.close()
            raise
        config = uvicorn.Config(
            app,
            log_config=None,
            log_level="critical",
            access_log=False,
            server_header=False,
            lifespan="off",
            http=_protocol(head_seconds),
            ws="none",
            loop="asyncio",
            limit_concurrency=_MOST_CONNECTIONS,
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)

    @property
    def address(self) -> str:
        """The whole address, with the token."""
        return f"http://{ADDRESS}:{self.port}/{self.token}/"

    def run(self) -> None:
        """Serve until interrupted."""
        threading.Thread(target=_warm, daemon=True, name="gaitgraph warming").start()
        self._server.run(sockets=[self._socket])

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()


def _protocol(head_seconds: float) -> Any:
    """Return uvicorn's protocol, made to close connections on which nobody asks.

    uvicorn waits for a first head without end, and each byte after an answer puts its own deadline off: some hundred
    silent connections would keep everybody else out, whether or not they know the token.
    """
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class Protocol(H11Protocol):
        waiting: TimerHandle | None = None

        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.wait()

        def connection_lost(self, exc: Exception | None) -> None:
            self.wait(False)
            super().connection_lost(exc)

        def handle_events(self) -> None:
            before = self.cycle
            super().handle_events()
            if self.cycle is not before:  # a head is whole
                self.wait(False)

        def on_response_complete(self) -> None:
            self.wait()
            super().on_response_complete()

        def wait(self, again: bool = True) -> None:
            if self.waiting is not None:
                self.waiting.cancel()
            self.waiting = self.loop.call_later(head_seconds, self.transport.close) if again else None

    return Protocol


def _warm() -> None:
    """Do once what the first click would wait for: load modules, and prepare the regions of the paper's vehicle."""
    from gaitgraph.explorer.answers import diagram_answer, plan_answer
    from gaitgraph.explorer.maps import map_answer

    setup_answer()
    for waypoints in ([[0.6, -0.6]], [[0.5, 0.5]]):  # the first can be planned, the second is told the nearest
        state = state_of({"waypoints": waypoints})
        plan_answer(state)
        diagram_answer(state)
    for sheet in ("red", "blue"):
        map_answer({"sheet": sheet, "shading": "R"})


def _bound(port: int) -> socket.socket:
    # asyncio sends small packets at once only where the protocol is stated: else every answer waits 40 ms for its body.
    made = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((ADDRESS, port))
        made.listen(128)
    except (OSError, OverflowError) as error:
        made.close()
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"--port: {port}: {reason}; allowed is a port that is free, or 0 for any") from error
    return made
