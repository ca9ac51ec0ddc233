"""Guards of the explorer: who may ask, how large and slow a request may be, and how long work on it may take."""

from __future__ import annotations

import asyncio
import secrets
import threading
import time
from typing import TYPE_CHECKING, Any, TypeVar

from gaitgraph.errors import GaitgraphError, shown

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, MutableMapping

    from starlette.requests import Request

    Message = MutableMapping[str, Any]
    App = Callable[[Message, Callable[[], Awaitable[Message]], Callable[[Message], Awaitable[None]]], Awaitable[None]]

Answer = TypeVar("Answer")

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
"""On every answer: nothing is loaded from elsewhere, framed, sniffed, or kept."""

LONGEST_BODY = 60.0  # s until a body must be complete
LONGEST_WORK = 20.0  # s of work on one request
AT_ONCE = 2  # requests that are worked on at the same time


class Refused(GaitgraphError):
    """A request was refused or given up, with the HTTP status of its answer."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class Guard:
    """ASGI middleware that refuses requests without the token or from another origin, and adds :data:`HEADERS`.

    The token is the first part of every path, the port that of the page's own origin; `refuse` makes a response.
    """

    def __init__(self, app: App, *, token: str, port: int, refuse: Callable[[int, str], App]) -> None:
        self.app, self.token, self.refuse = app, token.encode(), refuse
        self.origins = [f"http://{name}:{port}" for name in ("127.0.0.1", "localhost")]

    async def __call__(self, scope: Message, receive: Any, send: Any) -> None:
        """Refuse a request, or pass it on."""
        if scope["type"] != "http":
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = [(name.encode(), value.encode()) for name, value in HEADERS.items()]
                message = {**message, "headers": [*message.get("headers", ()), *own]}
            await send(message)

        app, origins = self.app, [value.decode("latin-1") for name, value in scope["headers"] if name == b"origin"]
        first, slash, _ = scope["path"].removeprefix("/").partition("/")
        if not (slash and secrets.compare_digest(first.encode(), self.token)):
            app = self.refuse(404, "no such page; open the whole address that 'gaitgraph explore' printed")
        elif any(origin not in self.origins for origin in origins):
            app = self.refuse(403, f"Origin must be {' or '.join(self.origins)}, got {shown(', '.join(origins))}")
        await app(scope, receive, send_with_headers)


async def body_of(request: Request, most: int) -> bytes:
    """Return the body of a request; Refused if it has more bytes than `most`, or does not come to its end."""
    body = bytearray()
    try:
        async with asyncio.timeout(LONGEST_BODY):
            async for piece in request.stream():
                body += piece
                if len(body) > most:
                    raise Refused(413, f"a body must have at most {most} bytes")
    except TimeoutError as error:
        raise Refused(408, f"a body must be complete within {LONGEST_BODY:g} s") from error
    return bytes(body)


class Job:
    """Stops work: :meth:`check` is its progress callback, and `gone` is set when the client has left."""

    def __init__(self) -> None:
        self.gone = threading.Event()
        self._end = time.monotonic() + LONGEST_WORK

    def check(self, *_: Any) -> None:
        """Raise Refused if the client has left or the time is over; arguments are ignored."""
        if self.gone.is_set():
            raise Refused(503, "the client has left")
        if time.monotonic() > self._end:
            raise Refused(
                503,
                f"it took longer than {LONGEST_WORK:g} s; use fewer waypoints, polygons or rows, or the command line",
            )

    def run(self, work: Callable[[Job], Answer]) -> Answer:
        """Return the answer of the work, or raise Refused if it came too late."""
        self._end = time.monotonic() + LONGEST_WORK
        self.check()
        answer = work(self)
        self.check()  # the work may have taken long without calling it
        return answer


async def answer_in_thread(request: Request, slots: asyncio.Semaphore, work: Callable[[Job], Answer]) -> Answer:
    """Run work in a thread while a slot is free, and stop it when the client leaves."""
    job = Job()

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        job.gone.set()

    watching = asyncio.ensure_future(watch())
    try:
        async with slots:
            return await asyncio.to_thread(job.run, work)
    finally:
        job.gone.set()
        watching.cancel()
