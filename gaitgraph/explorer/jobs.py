"""Work that a client waits for: a few pieces at a time, each given up when it takes too long or nobody waits."""

from __future__ import annotations

import asyncio
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from gaitgraph.errors import GaitgraphError

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["LONGEST", "Job", "Stopped", "run_job"]

Answer = TypeVar("Answer")

LONGEST = 20.0
"""Seconds that one piece of work may take."""

_AT_ONCE = 2
_LOOK = 0.1
_slots = threading.BoundedSemaphore(_AT_ONCE)


class Stopped(GaitgraphError):
    """Work was given up: it took too long, or nobody waits for it any more."""


class Job:
    """Tells work when to stop: :meth:`go_on` is handed to it as its progress callback.

    Parameters
    ----------
    seconds
        How long it may take.
    """

    def __init__(self, seconds: float = LONGEST) -> None:
        self.gone = threading.Event()
        self._seconds = seconds
        self._end = time.monotonic() + seconds

    def start(self) -> None:
        """Count the seconds from now."""
        self._end = time.monotonic() + self._seconds

    def go_on(self, *_: Any) -> None:
        """Raise Stopped if the client is gone or the time is over; takes and passes over what progress is told."""
        if self.gone.is_set():
            raise Stopped("nobody waits for this answer any more")
        if time.monotonic() > self._end:
            raise Stopped(f"took longer than {self._seconds:g} s; allowed are fewer waypoints, polygons or rows")


async def run_job(work: Callable[[Job], Answer], job: Job | None = None) -> Answer:
    """Run work in a thread of its own, at most two at once, and return its answer or raise its error.

    If the awaiting task is cancelled the job is told that nobody waits. The thread does not hold up the end of the
    process.
    """
    job = job or Job()
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Answer] = loop.create_future()

    def settle(answer: Any, error: BaseException | None) -> None:
        if done.cancelled():
            return
        if error is None:
            done.set_result(answer)
        else:
            done.set_exception(error)

    def run() -> None:
        answer, error = None, None
        try:
            while not _slots.acquire(timeout=_LOOK):
                job.go_on()
            try:
                job.start()
                job.go_on()
                answer = work(job)
                job.go_on()  # work that seldom asks may be over only long after the time was
            finally:
                _slots.release()
        except BaseException as problem:
            error = problem
        with suppress(RuntimeError):  # the server is closed already
            loop.call_soon_threadsafe(settle, answer, error)

    threading.Thread(target=run, daemon=True, name="gaitgraph job").start()
    try:
        return await done
    except asyncio.CancelledError:
        job.gone.set()
        raise
