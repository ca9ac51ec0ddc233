"""The server of the page on the loopback address: its guards and limits, its routes, and how it runs."""

from __future__ import annotations

import asyncio
import math
import mimetypes
import secrets
import socket
import sys
import threading
import time
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from gaitgraph import __version__
from gaitgraph.errors import (
    GaitgraphError,
    needs_extra,
    shown,
    wrong,
)
from gaitgraph.explorer.map_query import SHADINGS, map_answer
from gaitgraph.explorer.queries import diagram_answer, plan_answer
from gaitgraph.explorer.state import DEFAULTS, RANGES, fields_of
from gaitgraph.explorer.table_query import file_answer, formats_answer, table_answer
from gaitgraph.explorer.words import CHOICES_IN_WORDS
from gaitgraph.files import value_from_json
from gaitgraph.gait.gait import PAPER_GAITS, paper_gait
from gaitgraph.invertibility.coefficients import KINDS, coefficients_of
from gaitgraph.planning.request import CHOICES
from gaitgraph.timing.laws import LAWS
from gaitgraph.vehicle import PAPER, Vehicle, preset_names, vehicle_named

try:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.exceptions import HTTPException
    from starlette.middleware import Middleware
    from starlette.middleware.base import BaseHTTPMiddleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.requests import ClientDisconnect, Request
    from starlette.responses import FileResponse, JSONResponse, Response
    from starlette.routing import Mount, Route
    from starlette.staticfiles import StaticFiles
except ImportError as error:
    raise needs_extra(
        (error.name or "starlette").partition(".")[0], "the explorer", "explore"
    ) from error

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from starlette.middleware.base import RequestResponseEndpoint
    from starlette.types import ASGIApp

    from gaitgraph.explorer.queries import Progress

    Work = Callable[[Request, bytes, Progress], Any]

ADDRESS = "127.0.0.1"
_PAGE = Path(__file__).parent / "page"
mimetypes.add_type("text/javascript", ".js")  # the system may give another type

HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}
"""The headers of every answer: nothing is loaded from elsewhere, framed, sniffed or cached."""

_BYTES = "application/octet-stream"
_KINDS = ("application/json", _BYTES)  # which a form of another page cannot send
LONGEST_WORK = 20.0  # time limit for the work on one request [s]
AT_ONCE = 2  # requests worked on at the same time
MOST_BYTES = 8 << 20  # of the body of a request


class Guard(BaseHTTPMiddleware):
    """Middleware that refuses paths without the token and other origins, and adds :data:`HEADERS`."""

    def __init__(self, app: ASGIApp, *, token: str, port: int) -> None:
        super().__init__(app)
        self.token = token.encode()
        self.origins = [f"http://{name}:{port}" for name in (ADDRESS, "localhost")]

    async def dispatch(
        self, request: Request, call_next: RequestResponseEndpoint
    ) -> Response:
        """Refuse a request or pass it on."""
        response = self._refusal_of(request)
        if response is None:
            response = await call_next(request)
        response.headers.update(HEADERS)
        return response

    def _refusal_of(self, request: Request) -> Response | None:
        first, slash, _ = request.url.path.removeprefix("/").partition("/")
        if not slash or not secrets.compare_digest(first.encode(), self.token):
            advice = "open the whole address that 'gaitgraph explore' printed"
            return _refusal(404, f"page not found; {advice}")
        origins = request.headers.getlist("origin")
        if any(origin not in self.origins for origin in origins):
            allowed = " or ".join(self.origins)
            got = shown(", ".join(origins))
            return _refusal(403, f"Origin must be {allowed}, got {got}")
        return None


def _refusal(
    status: int, message: str, headers: Mapping[str, str] | None = None
) -> Response:
    return JSONResponse({"error": " ".join(message.split())}, status, headers)


class Job:
    """The work on one request, which stops when the client disconnects or the time is over."""

    def __init__(self) -> None:
        self._is_gone = threading.Event()
        self._end = math.inf

    def check(self, *_: Any) -> None:
        """Raise HTTPException if the work is to stop; the progress function of long work."""
        if self._is_gone.is_set():
            raise HTTPException(503, "the client disconnected")
        if time.monotonic() > self._end:
            limit = f"the query took longer than {LONGEST_WORK:g} s"
            advice = "use fewer waypoints, polygons or rows, or the command line"
            raise HTTPException(503, f"{limit}; {advice}")

    def run(self, work: Work, request: Request, body: bytes) -> Any:
        """Return the answer to a request. The work may call `check` seldom, so it is called before and after."""
        self._end = time.monotonic() + LONGEST_WORK
        self.check()
        answer = work(request, body, self.check)
        self.check()
        return answer

    async def watch(self, request: Request) -> None:
        """Wait until the client disconnects."""
        message: Any = {"type": ""}
        while message["type"] != "http.disconnect":
            message = await request.receive()
        self.stop()

    def stop(self) -> None:
        """Let the work end at its next check."""
        self._is_gone.set()


async def body_of(request: Request) -> bytes:
    """Return the body of a request; HTTPException if it is too long."""
    body = bytearray()
    async for piece in request.stream():
        body += piece
        if len(body) > MOST_BYTES:
            close = {"Connection": "close"}  # the rest of the body is not read
            limit = f"the body of a request must have at most {MOST_BYTES} bytes"
            raise HTTPException(413, limit, close)
    return bytes(body)


def _of_json(answer: Callable[[Any, Progress], Any]) -> Work:
    """Return the work that answers the object in a body."""

    def work(_: Request, body: bytes, check: Progress) -> Any:
        content = value_from_json(body, "a query must be a JSON object")
        return answer(content, check)

    return work


def _table(request: Request, body: bytes, check: Progress) -> Any:
    return table_answer(request.query_params.get("name", ""), body, check)


def _download(query: Any, check: Progress) -> Response:
    name, content = file_answer(query, check)
    headers = {"content-disposition": f"attachment; filename={quote(name)}"}
    return Response(content, media_type=_BYTES, headers=headers)


def application(token: str, port: int, vehicle: Vehicle = PAPER) -> Starlette:
    """Return the ASGI application; its paths begin with the token, and its origin has the port."""
    slots = asyncio.Semaphore(AT_ONCE)

    def query(name: str, work: Work) -> Route:
        handler = _handler(work, slots)
        return Route(f"/{token}/api/{name}", handler, methods=["POST"])

    app = Starlette(
        routes=[
            Route(f"/{token}/", lambda _: FileResponse(_PAGE / "index.html")),
            Mount(f"/{token}/page", StaticFiles(directory=_PAGE)),
            Route(f"/{token}/api/setup", lambda _: JSONResponse(setup_answer(vehicle))),
            query("plan", _of_json(plan_answer)),
            query("diagram", _of_json(diagram_answer)),
            query("map", _of_json(map_answer)),
            query("download", _of_json(_download)),
            query("table", _table),
        ],
        middleware=[
            Middleware(Guard, token=token, port=port),
            Middleware(
                TrustedHostMiddleware,
                allowed_hosts=[ADDRESS, "localhost"],
                www_redirect=False,
            ),
        ],
        exception_handlers={HTTPException: _refused},
    )
    app.router.redirect_slashes = False
    return app


def _refused(_: Request, error: Any) -> Response:
    return _refusal(error.status_code, error.detail, error.headers)


def _handler(
    work: Work, slots: asyncio.Semaphore
) -> Callable[[Request], Awaitable[Response]]:
    """Return the handler of a POST request: read the body, work in a thread, answer every error in one line."""

    async def handle(request: Request) -> Response:
        stated = request.headers.get("content-type", "").partition(";")[0]
        stated = stated.strip().lower()
        if stated not in _KINDS:
            allowed = " or ".join(_KINDS)
            return _refusal(415, f"Content-Type must be {allowed}, got {shown(stated)}")
        job = Job()
        try:
            body = await body_of(request)
            watching = asyncio.ensure_future(job.watch(request))
            try:
                async with slots:
                    answer = await asyncio.to_thread(job.run, work, request, body)
            finally:
                job.stop()  # also when the server ends
                watching.cancel()
        except ClientDisconnect:  # nobody reads this
            return _refusal(400, "the client disconnected before its request was whole")
        except HTTPException:
            raise
        except GaitgraphError as error:
            return _refusal(400, str(error))
        except Exception as error:  # a bug of ours ends one request, not the server
            message = " ".join(f"{type(error).__name__}: {error}".split())
            name = request.url.path.rpartition("/")[2]
            print(f"gaitgraph: {name}: {message}", file=sys.stderr)
            return _refusal(500, f"internal error ({message}); the server continues")
        if isinstance(answer, Response):
            return answer
        return JSONResponse(answer)

    return handle


@cache
def setup_answer(vehicle: Vehicle = PAPER) -> dict[str, Any]:
    """Return the choices, vehicles, formats, limits, empty state and gaits of the paper for a page of a vehicle."""
    presets = [
        {"name": name, "vehicle": name, "drag_ratio": vehicle_named(name).drag_ratio}
        for name in preset_names()
    ]
    own = fields_of(vehicle)
    if isinstance(own["vehicle"], dict):
        presets.append({**own, "name": vehicle.name, "drag_ratio": vehicle.drag_ratio})
    choices = {f"{name}s": list(words) for name, words in CHOICES.items()}
    return {
        "version": __version__,
        "presets": presets,
        "laws": list(LAWS),
        **choices,
        "coefficients": list(KINDS),
        "shadings": list(SHADINGS),
        "formats": formats_answer(),
        "words": CHOICES_IN_WORDS,
        "defaults": DEFAULTS | own,
        "most_bytes": MOST_BYTES,
        "ranges": {name: asdict(allowed) for name, allowed in RANGES.items()},
        "paper_gaits": [_paper_gait(number) for number in PAPER_GAITS.values()],
    }


def _paper_gait(number: int) -> dict[str, Any]:
    """Return the name of a gait of the paper, and the state that plans it."""
    gait = paper_gait(number, PAPER, coefficients_of())
    return {
        "name": f"Gait {number}",
        "color": gait.color,
        "sign": "positive" if gait.R[0] > 0 else "negative",
        "require": "flyable" if gait.color == "red" else "valid",
        "waypoints": gait.alpha[:, :2].tolist(),
        "vehicle": PAPER.name,
        "drag_ratio": None,
    }


class Server:
    """A server that listens on the loopback address; port 0 is any free port. InputError if the port is taken.

    Its page begins with the vehicle.
    """

    def __init__(self, port: int = 0, vehicle: Vehicle = PAPER) -> None:
        token = secrets.token_urlsafe(16)
        # asyncio sends small packets at once only if the protocol is given; otherwise every answer is delayed by 40 ms.
        self._socket = socket.socket(
            socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP
        )
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind((ADDRESS, port))
            self._socket.listen(128)
        except OSError as error:
            self.close()
            raise wrong(
                "port", "must be a free port, or 0 for any", port, f": {error.strerror}"
            ) from error
        port = int(self._socket.getsockname()[1])
        self.address = f"http://{ADDRESS}:{port}/{token}/"  # with the token
        config = uvicorn.Config(
            application(token, port, vehicle),
            log_config=None,
            log_level="critical",
            access_log=False,
            server_header=False,
            lifespan="off",
            http="h11",
            ws="none",
            loop="asyncio",
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)

    def run(self) -> None:
        """Serve until interrupted."""
        threading.Thread(target=_warm_up, daemon=True, name="gaitgraph warm-up").start()
        self._server.run(sockets=[self._socket])

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def _warm_up() -> None:
    """Plan once and prepare the regions of the paper's vehicle, so that the first click is fast."""
    setup_answer()
    planned, refused = [0.6, -0.6], [0.5, 0.5]
    for waypoint in (planned, refused):
        state = {"waypoints": [waypoint]}
        plan_answer(state)
        diagram_answer(state)
    for sheet in ("red", "blue"):
        map_answer({"sheet": sheet, "shading": "R"})
