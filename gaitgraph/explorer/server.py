"""The server of the page on the loopback address: its routes, what they answer, and how it runs."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import sys
import threading
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from gaitgraph import __version__
from gaitgraph.errors import GaitgraphError, InputError, needs_extra, shown
from gaitgraph.explorer.guards import AT_ONCE, Guard, Job, Refused, answer_in_thread, body_of
from gaitgraph.explorer.map_query import SHADINGS, map_answer
from gaitgraph.explorer.plan_query import (
    DEFAULTS,
    LIMITS,
    RANGES,
    checked_object,
    diagram_answer,
    plan_answer,
    state_of,
)
from gaitgraph.explorer.table_query import file_answer, formats_answer, table_answer
from gaitgraph.gait.gait import PAPER_GAITS, paper_gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.planning.request import CHOICES
from gaitgraph.timing.timed_gait import LAWS
from gaitgraph.vehicle import PAPER, preset_names, vehicle_named

try:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.requests import ClientDisconnect, Request
    from starlette.responses import JSONResponse, Response
    from starlette.routing import Route
except ImportError as error:
    raise needs_extra((error.name or "starlette").partition(".")[0], "the explorer", "explore") from error

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    Work = Callable[[Request, bytes, Job], Any]

ADDRESS = "127.0.0.1"
_PAGE = Path(__file__).parent / "page"
_TYPES = {  # by suffix; licences have none
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    "": "text/plain; charset=utf-8",
}
_MOST_CONNECTIONS = 400


def page_files() -> dict[str, tuple[Path, str]]:
    """Return the files of the page by their names in its addresses, each with its media type."""
    return {
        path.relative_to(_PAGE).as_posix(): (path, _TYPES[path.suffix])
        for path in sorted(_PAGE.rglob("*"))
        if path.is_file() and path.suffix in _TYPES
    }


def application(token: str, port: int) -> Starlette:
    """Return the ASGI application whose paths begin with a token and whose page has the origin of a port."""
    files, slots = page_files(), asyncio.Semaphore(AT_ONCE)

    async def page(request: Request) -> Response:
        name = request.path_params.get("name", "index.html")
        if name not in files:
            return _refusal(404, f"no such page: {shown(name)}")
        path, media_type = files[name]
        return Response(path.read_bytes(), media_type=media_type)

    def post(name: str, work: Work, most: int = LIMITS["request_bytes"], kind: str = "application/json") -> Route:
        handler = _handler(work, slots, most, kind)
        return Route(f"/{token}/api/{name}", handler, methods=["POST"])

    app = Starlette(
        routes=[
            Route(f"/{token}/", page),
            Route(f"/{token}/page/{{name:path}}", page),
            Route(f"/{token}/api/setup", lambda _: JSONResponse(setup_answer())),
            post("plan", lambda _, body, job: plan_answer(state_of(_content(body)), job.check)),
            post("diagram", lambda _, body, job: diagram_answer(state_of(_content(body)), job.check)),
            post("map", lambda _, body, job: map_answer(_content(body), job.check)),
            post("table", _table, LIMITS["table_bytes"], "application/octet-stream"),
            post("download", _download),
        ],
        middleware=[
            Middleware(Guard, token=token, port=port, refuse=_refusal),
            Middleware(TrustedHostMiddleware, allowed_hosts=[ADDRESS, "localhost"], www_redirect=False),
        ],
        exception_handlers={404: _no_route, 405: _no_route},
    )
    app.router.redirect_slashes = False
    return app


async def _no_route(request: Request, error: Exception) -> Response:
    headers = getattr(error, "headers", None) or {}
    if "Allow" not in headers:
        return _refusal(404, "no such page")
    methods = ", ".join(sorted(headers["Allow"].split(", ")))
    return _refusal(405, f"method must be {methods}, got {shown(request.method)}", {"Allow": methods})


def _refusal(status: int, message: str, headers: dict[str, str] | None = None) -> Response:
    return JSONResponse({"error": " ".join(message.split())}, status, headers)


def _handler(work: Work, slots: asyncio.Semaphore, most: int, kind: str) -> Callable[[Request], Awaitable[Response]]:
    """Return the handler of a POST: it reads the body, works in a thread, and turns every error into one line."""

    async def handle(request: Request) -> Response:
        stated = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if stated != kind:
            return _refusal(415, f"Content-Type must be {kind}, got {shown(stated)}")
        try:
            body = await body_of(request, most)
            answer = await answer_in_thread(request, slots, lambda job: work(request, body, job))
        except ClientDisconnect:  # nobody reads this
            return _refusal(400, "the client left before its request was complete")
        except Refused as error:
            close = {"Connection": "close"} if error.status in (408, 413) else None  # the rest of the body is not read
            return _refusal(error.status, str(error), close)
        except GaitgraphError as error:
            return _refusal(400, str(error))
        except MemoryError:
            return _refusal(503, "not enough memory; use fewer waypoints, polygons, samples or rows")
        except Exception as error:
            message = " ".join(f"{type(error).__name__}: {error}".split())
            print(f"gaitgraph: {request.url.path.rpartition('/')[2]}: {message}", file=sys.stderr)
            return _refusal(500, f"the server could not answer ({message}), and goes on")
        return answer if isinstance(answer, Response) else JSONResponse(answer)

    return handle


def _content(body: bytes) -> Any:
    try:
        return json.loads(body)
    except RecursionError as error:
        raise InputError("request is nested too deeply; it must be an object") from error
    except ValueError as error:
        raise InputError(f"request is not JSON ({str(error).splitlines()[0]}); it must be an object") from error


def _table(request: Request, body: bytes, job: Job) -> Any:
    return table_answer(request.query_params.get("name", ""), body, job.check)


def _download(_: Request, body: bytes, job: Job) -> Any:
    query = checked_object(_content(body), ("state", "suffix"))
    name, content = file_answer(state_of(query.get("state", {})), query.get("suffix", ".csv"), job.check)
    headers = {"content-disposition": f"attachment; filename={quote(name)}"}
    return Response(content, media_type="application/octet-stream", headers=headers)


@cache
def setup_answer() -> dict[str, Any]:
    """Return what the page offers: choices, presets, formats, limits, the empty state and the paper's gaits."""
    gaits = {number: paper_gait(number, PAPER, coefficients_of()) for number in PAPER_GAITS}
    return {
        "version": __version__,
        "presets": [{"name": name, "drag_ratio": vehicle_named(name).drag_ratio} for name in preset_names()],
        "laws": list(LAWS),
        "objectives": list(CHOICES["objective"]),
        "colors": list(CHOICES["color"]),
        "signs": list(CHOICES["sign"]),
        "methods": list(CHOICES["method"]),
        "objectives_of": {method: list(CHOICES["objective"]) for method in CHOICES["method"]},
        "shadings": list(SHADINGS),
        "formats": formats_answer(),
        "defaults": DEFAULTS,
        "limits": LIMITS,
        "ranges": {name: asdict(one) | {"allowed": one.allowed} for name, one in RANGES.items()},
        "paper_gaits": [
            {
                "name": f"Gait {number}",
                "color": gait.color,
                "sign": "positive" if gait.R[0] > 0 else "negative",
                "waypoints": gait.alpha[:, :2].tolist(),
            }
            for number, gait in gaits.items()
        ],
    }


class Server:
    """A server that listens already, on the loopback address alone; port 0 is a free one. InputError if it is taken."""

    def __init__(self, port: int = 0) -> None:
        self.token = secrets.token_urlsafe(16)
        # asyncio sends small packets at once only where the protocol is stated; else every answer waits 40 ms.
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind((ADDRESS, port))
            self._socket.listen(128)
        except (OSError, OverflowError) as error:
            self.close()
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"--port must be a free port, or 0 for any, got {port}: {reason}") from error
        self.port = int(self._socket.getsockname()[1])
        config = uvicorn.Config(
            application(self.token, self.port),
            log_config=None,
            log_level="critical",
            access_log=False,
            server_header=False,
            lifespan="off",
            http="h11",
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
        threading.Thread(target=_warm_up, daemon=True, name="gaitgraph warm-up").start()
        self._server.run(sockets=[self._socket])

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def _warm_up() -> None:
    """Plan once and prepare the regions of the paper's vehicle, so that the first click need not wait."""
    setup_answer()
    for waypoints in ([[0.6, -0.6]], [[0.5, 0.5]]):  # the first can be planned, the second has a nearest point
        state = state_of({"waypoints": waypoints})
        plan_answer(state)
        diagram_answer(state)
    for sheet in ("red", "blue"):
        map_answer({"sheet": sheet, "shading": "R"})
