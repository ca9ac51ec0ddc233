"""The server of the page on the loopback address: its guards and limits, its routes, and how it runs."""

from __future__ import annotations

import asyncio
import mimetypes
import secrets
import socket
import sys
import threading
import time
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from gaitgraph import __version__
from gaitgraph.errors import (
    GaitgraphError,
    InputError,
    check_fields,
    needs_extra,
    shown,
)
from gaitgraph.explorer import queries
from gaitgraph.explorer.table_query import file_answer, formats_answer, table_answer
from gaitgraph.files import value_from_json
from gaitgraph.gait.gait import PAPER_GAITS, paper_gait
from gaitgraph.invertibility.coefficients import KINDS, coefficients_of
from gaitgraph.planning.request import CHOICES
from gaitgraph.timing.laws import LAWS
from gaitgraph.vehicle import PAPER, preset_names, vehicle_named

try:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.exceptions import HTTPException
    from starlette.middleware import Middleware
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
    from collections.abc import Awaitable, Callable

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    Check = Callable[..., None]
    Work = Callable[[Request, bytes, Check], Any]

ADDRESS = "127.0.0.1"
_PAGE = Path(__file__).parent / "page"
mimetypes.add_type(
    "text/javascript", ".js"
)  # the table of the system may give another type
_MOST_CONNECTIONS = 400

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

_content = partial(value_from_json, wanted="a query must be a JSON object")

LONGEST_WORK = 20.0  # time limit for the work on one request [s]
AT_ONCE = 2  # requests worked on at the same time


class Guard:
    """ASGI middleware that refuses paths without the token and other origins, and adds :data:`HEADERS`."""

    def __init__(self, app: ASGIApp, *, token: str, port: int) -> None:
        self.app, self.token = app, token.encode()
        self.origins = [f"http://{name}:{port}" for name in ("127.0.0.1", "localhost")]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request or pass it on."""
        if scope["type"] != "http":
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = [
                    (name.encode(), value.encode()) for name, value in HEADERS.items()
                ]
                message = {**message, "headers": [*message.get("headers", ()), *own]}
            await send(message)

        app, origins = (
            self.app,
            [
                value.decode("latin-1")
                for name, value in scope["headers"]
                if name == b"origin"
            ],
        )
        first, slash, _ = scope["path"].removeprefix("/").partition("/")
        if not (slash and secrets.compare_digest(first.encode(), self.token)):
            app = _refusal(
                404,
                "page not found; open the whole address that 'gaitgraph explore' printed",
            )
        elif any(origin not in self.origins for origin in origins):
            app = _refusal(
                403,
                f"Origin must be {' or '.join(self.origins)}, got {shown(', '.join(origins))}",
            )
        await app(scope, receive, send_with_headers)


async def body_of(request: Request, most: int) -> bytes:
    """Return the body of a request; HTTPException if it has more than `most` bytes."""
    body = bytearray()
    async for piece in request.stream():
        body += piece
        if len(body) > most:
            close = {"Connection": "close"}  # the rest of the body is not read
            raise HTTPException(
                413, f"the body of a request must have at most {most} bytes", close
            )
    return bytes(body)


async def answer_in_thread(
    request: Request, slots: asyncio.Semaphore, work: Callable[[Check], Any]
) -> Any:
    """Run work in a thread when a slot is free; the work stops when the client disconnects or the time is over."""
    gone = threading.Event()

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        gone.set()

    def run() -> Any:
        end = time.monotonic() + LONGEST_WORK

        def check(*_: Any) -> None:
            if gone.is_set():
                raise HTTPException(503, "the client disconnected")
            if time.monotonic() > end:
                advice = "use fewer waypoints, polygons or rows, or the command line"
                raise HTTPException(
                    503, f"the query took longer than {LONGEST_WORK:g} s; {advice}"
                )

        check()
        answer = work(check)
        check()  # the work may not have called it for a while
        return answer

    watching = asyncio.ensure_future(watch())
    try:
        async with slots:
            return await asyncio.to_thread(run)
    finally:
        gone.set()
        watching.cancel()


def application(token: str, port: int) -> Starlette:
    """Return the ASGI application; its paths begin with the token, and its origin has the port."""
    slots = asyncio.Semaphore(AT_ONCE)

    def post(
        name: str,
        work: Work,
        size: str = "request_bytes",
        kind: str = "application/json",
    ) -> Route:
        handler = _handler(work, slots, queries.LIMITS[size], kind)
        return Route(f"/{token}/api/{name}", handler, methods=["POST"])

    app = Starlette(
        routes=[
            Route(f"/{token}/", lambda _: FileResponse(_PAGE / "index.html")),
            Mount(f"/{token}/page", StaticFiles(directory=_PAGE)),
            Route(f"/{token}/api/setup", lambda _: JSONResponse(setup_answer())),
            post(
                "plan",
                lambda _, body, check: queries.plan_answer(
                    queries.state_of(_content(body)), check
                ),
            ),
            post(
                "diagram",
                lambda _, body, check: queries.diagram_answer(
                    queries.state_of(_content(body)), check
                ),
            ),
            post(
                "map", lambda _, body, check: queries.map_answer(_content(body), check)
            ),
            post(
                "table",
                lambda request, body, check: table_answer(
                    request.query_params.get("name", ""), body, check
                ),
                "table_bytes",
                "application/octet-stream",
            ),
            post("download", _download),
        ],
        middleware=[
            Middleware(Guard, token=token, port=port),
            Middleware(
                TrustedHostMiddleware,
                allowed_hosts=[ADDRESS, "localhost"],
                www_redirect=False,
            ),
        ],
        exception_handlers={
            HTTPException: lambda _, error: _refusal(
                error.status_code, error.detail, error.headers
            )
        },
    )
    app.router.redirect_slashes = False
    return app


def _refusal(
    status: int, message: str, headers: dict[str, str] | None = None
) -> Response:
    return JSONResponse({"error": " ".join(message.split())}, status, headers)


def _handler(
    work: Work, slots: asyncio.Semaphore, most: int, kind: str
) -> Callable[[Request], Awaitable[Response]]:
    """Return the handler of a POST request: read the body, work in a thread, answer every error in one line."""

    async def handle(request: Request) -> Response:
        stated = (
            request.headers.get("content-type", "").partition(";")[0].strip().lower()
        )
        if stated != kind:
            return _refusal(415, f"Content-Type must be {kind}, got {shown(stated)}")
        try:
            body = await body_of(request, most)
            answer = await answer_in_thread(
                request, slots, lambda check: work(request, body, check)
            )
        except ClientDisconnect:  # nobody reads this
            return _refusal(
                400, "the client disconnected before its request was complete"
            )
        except HTTPException:
            raise
        except GaitgraphError as error:
            return _refusal(400, str(error))
        except MemoryError:
            return _refusal(
                503, "not enough memory; use fewer waypoints, polygons, samples or rows"
            )
        except Exception as error:  # a bug of ours ends one request, not the server
            message = " ".join(f"{type(error).__name__}: {error}".split())
            print(
                f"gaitgraph: {request.url.path.rpartition('/')[2]}: {message}",
                file=sys.stderr,
            )
            return _refusal(500, f"internal error ({message}); the server continues")
        return answer if isinstance(answer, Response) else JSONResponse(answer)

    return handle


def _download(_: Request, body: bytes, check: Check) -> Any:
    query = _content(body)
    check_fields("request", query, ("state", "suffix"))
    name, content = file_answer(
        queries.state_of(query.get("state", {})), query.get("suffix", ".csv"), check
    )
    headers = {"content-disposition": f"attachment; filename={quote(name)}"}
    return Response(content, media_type="application/octet-stream", headers=headers)


@cache
def setup_answer() -> dict[str, Any]:
    """Return the choices, presets, formats, limits, empty state and gaits of the paper for the page."""
    gaits = {
        f"Gait {number}": paper_gait(number, PAPER, coefficients_of())
        for number in PAPER_GAITS.values()
    }
    return {
        "version": __version__,
        "presets": [
            {"name": name, "drag_ratio": vehicle_named(name).drag_ratio}
            for name in preset_names()
        ],
        "laws": list(LAWS),
        **{
            f"{name}s": list(CHOICES[name])
            for name in ("objective", "color", "sign", "method", "require")
        },
        "coefficients": list(KINDS),
        "shadings": list(queries.SHADINGS),
        "formats": formats_answer(),
        "defaults": queries.DEFAULTS,
        "limits": queries.LIMITS,
        "ranges": {name: one._asdict() for name, one in queries.RANGES.items()},
        "paper_gaits": [
            {
                "name": name,
                "color": gait.color,
                "sign": "positive" if gait.R[0] > 0 else "negative",
                "require": "flyable" if gait.color == "red" else "valid",
                "waypoints": gait.alpha[:, :2].tolist(),
            }
            for name, gait in gaits.items()
        ],
    }


class Server:
    """A server that listens on the loopback address; port 0 is any free port. InputError if the port is taken."""

    def __init__(self, port: int = 0) -> None:
        token = secrets.token_urlsafe(16)
        # asyncio sends small packets at once only if the protocol is given; otherwise every answer is delayed by 40 ms.
        self._socket = socket.socket(
            socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP
        )
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind((ADDRESS, port))
            self._socket.listen(128)
        except (OSError, OverflowError) as error:
            self.close()
            reason = getattr(error, "strerror", None) or error
            raise InputError(
                f"port must be a free port, or 0 for any, got {port}: {reason}",
                field="port",
            ) from error
        port = int(self._socket.getsockname()[1])
        self.address = f"http://{ADDRESS}:{port}/{token}/"  # with the token
        config = uvicorn.Config(
            application(token, port),
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
    for waypoints in (
        [[0.6, -0.6]],
        [[0.5, 0.5]],
    ):  # the first can be planned; the second has no gait
        state = queries.state_of({"waypoints": waypoints})
        queries.plan_answer(state)
        queries.diagram_answer(state)
    for sheet in ("red", "blue"):
        queries.map_answer({"sheet": sheet, "shading": "R"})
