"""What a request must be before anything looks at it: from this page, of a bounded size, with headers on its answer.

Plain ASGI, so that it costs nothing and needs no library.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import time
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import GaitgraphError, shown

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, MutableMapping

    Scope = MutableMapping[str, Any]
    Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
    Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
    App = Callable[[Scope, Receive, Send], Awaitable[None]]

__all__ = ["HEADERS", "LONGEST_BODY", "LONGEST_SILENCE", "Guard", "TooLarge", "TooSlow", "error_bytes"]

LONGEST_SILENCE = 10.0
"""Seconds that may pass without a further piece of a body."""

LONGEST_BODY = 60.0
"""Seconds in which a body must be whole."""

HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-store",
}
"""On every answer: nothing is loaded from elsewhere, framed, sniffed, or kept."""

_OWN_SITE = ("same-origin", "none")  # none: typed into the address bar


class TooLarge(GaitgraphError):
    """A body with more bytes than are taken; raised where the application reads it."""


class TooSlow(GaitgraphError):
    """A body that does not come to its end; raised where the application reads it."""


def error_bytes(message: str) -> bytes:
    """Return an error as the page reads it: one line under the name ``error``."""
    return json.dumps({"error": " ".join(message.split())}, ensure_ascii=False).encode()


class Guard:
    """Refuses what is not meant for this page before the application sees it.

    Parameters
    ----------
    app
        The application.
    token
        The first part of every path.
    port
        Where it listens, which a page's own origin names.
    most_bytes
        The largest body of each path below the token; of others no body is read at all.

    Notes
    -----
    A body must come within :data:`LONGEST_BODY` and without a pause of :data:`LONGEST_SILENCE`.
    """

    def __init__(self, app: App, *, token: str, port: int, most_bytes: dict[str, int]) -> None:
        self.app, self.token = app, token
        hosts = [f"{name}:{port}" for name in ("127.0.0.1", "localhost")]
        if port == 80:
            hosts += ["127.0.0.1", "localhost"]
        self.hosts = hosts
        self.origins = [f"http://{host}" for host in hosts]
        self.most_bytes = most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request, or hand it on."""
        if scope["type"] != "http":
            return

        async def with_headers(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                own = [(name.encode(), value.encode()) for name, value in HEADERS.items()]
                message = {**message, "headers": [*message.get("headers", ()), *own]}
            await send(message)

        headers = _headers_of(scope)
        path = self._path_below_token(scope["path"])
        refused = self._refusal(scope, headers, path)
        if refused is not None:
            await _answer(with_headers, *refused)
            return
        most, taken, whole = self.most_bytes.get(path or "", 0), 0, False
        end = time.monotonic() + LONGEST_BODY

        async def counted() -> MutableMapping[str, Any]:
            nonlocal taken, whole
            if whole:  # what comes now is that the client leaves, whenever that is
                return await receive()
            try:
                async with asyncio.timeout(min(LONGEST_SILENCE, end - time.monotonic())):
                    message = await receive()
            except TimeoutError as error:
                waited = f"{LONGEST_SILENCE:g} s of silence, {LONGEST_BODY:g} s in all"
                raise TooSlow(f"a body that does not come to its end; allowed are {waited}") from error
            whole = not message.get("more_body", False)
            taken += len(message.get("body", b""))
            if taken > most:
                raise TooLarge(_too_large(most))
            return message

        await self.app(scope, counted, with_headers)

    def _path_below_token(self, path: str) -> str | None:
        first, slash, rest = path.removeprefix("/").partition("/")
        known = secrets.compare_digest(first.encode(), self.token.encode())
        return rest if known and slash else None

    def _refusal(self, scope: Scope, headers: dict[str, list[str]], path: str | None) -> tuple[int, str] | None:
        hosts = headers.get("host", [])
        if len(hosts) != 1 or hosts[0].lower() not in self.hosts:
            return 400, f"Host: {shown(hosts[0] if hosts else 'none')}; allowed are {', '.join(self.hosts)}"
        if path is None:
            return 404, "no such page; allowed is the whole address that 'gaitgraph explore' printed"
        origins, sites = headers.get("origin", []), headers.get("sec-fetch-site", [])
        if origins and (len(origins) > 1 or origins[0] not in self.origins):
            return 403, f"Origin: {shown(origins[0])}, a page elsewhere; allowed are {', '.join(self.origins)}"
        navigates = scope["method"] == "GET" and headers.get("sec-fetch-mode") == ["navigate"] and path == ""
        if sites and not navigates and (len(sites) > 1 or sites[0] not in _OWN_SITE):
            return 403, "Sec-Fetch-Site: a page elsewhere; allowed is this page itself"
        stated = headers.get("content-length", ["0"])
        digits = all(text.isdecimal() and len(text) <= 20 for text in stated)
        if not digits or max(map(int, stated)) > self.most_bytes.get(path, 0):
            return 413, _too_large(self.most_bytes.get(path, 0))
        return None


def _too_large(most: int) -> str:
    if not most:
        return "a body where none belongs; allowed is none"
    return f"a body that is too large; allowed are {most} bytes"


def _headers_of(scope: Scope) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        found.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    return found


async def _answer(send: Send, status: int, message: str) -> None:
    body = error_bytes(message)
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    if status == 413:
        headers.append((b"connection", b"close"))  # what is left of the body is not read
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
