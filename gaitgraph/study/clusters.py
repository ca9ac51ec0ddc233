"""Batches of cases on Dask: worker processes of this machine, or a cluster that is there already, by the same code.

The processes of this machine talk over the loopback address alone, encrypted with keys that live as long as they do:
whoever else works here cannot hand them work. They are started as processes of Dask's own command, so that a script
needs no ``if __name__ == "__main__"``, and end by themselves when this process is gone.
"""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys
import tempfile
from collections import deque
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import GaitgraphError, InputError, needs_extra, shown
from gaitgraph.study.cases import flown_batch, lost_row

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from gaitgraph.study.designs import Study

    Rows = list[dict[str, Any]]

__all__ = ["LOST", "Crew", "cluster_there", "flown_batches", "require_dask", "workers_here"]

LOST = "its process dies: tried alone, each worker that flew it was lost"
"""The reason in the row of a case that no worker survives."""

PATIENCE = 5.0
"""How long a scheduler may take to answer [s]."""

EMPTY = 60.0
"""How long a scheduler may be without workers [s]."""

_START = 120.0
_STARTS = 4  # of the workers of this machine: the first, and what stands in for those that end
_LOOK = 0.25  # between two looks at the workers [s]
_PAUSE = 0.01  # between two looks for an answer [s]
_LOST_ITS_WORKERS = "what is written stays, and the same command goes on from there"
_DEATHS = 2  # how many workers a task may lose before it is called off; one more ends it
_AHEAD = 2  # tasks for each thread: one flies, one waits
_LEAN = {
    # Nobody looks at the profile of a worker, and it costs each of them some percent.
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "500ms",
}
_QUIET = ("distributed", "tornado", "asyncio", "dask")


def require_dask() -> None:
    """Raise MissingExtra, saying what to install, if Dask is missing."""
    try:
        import distributed as _  # noqa: F401
    except ImportError as error:
        raise needs_extra("distributed", "a study on several processes", "study") from error


@contextmanager
def _quietly() -> Iterator[None]:
    """Keep what Dask logs off the terminal; levels are back afterwards."""
    # Some loggers have levels of their own; those that are made later take the level of the one above them.
    known = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _QUIET]
    loggers = [logging.getLogger(name) for name in dict.fromkeys([*_QUIET, *known])]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


@dataclass(frozen=True, slots=True, kw_only=True)
class Crew:
    """Workers, and who looks after them.

    Parameters
    ----------
    client
        A Dask client of their scheduler.
    tend
        Called now and then while answers are awaited, with whether there are workers; raises InputError when none can
        be expected any more.
    """

    client: Any
    tend: Callable[[bool], None]


@contextmanager
def workers_here(count: int) -> Iterator[Crew]:
    """Give so many worker processes of this machine, one thread each; they end with the context.

    The process that starts them and restarts those that die is started again, up to three times, if it dies itself.

    Raises
    ------
    MissingExtra
        If Dask, or cryptography, is not installed.
    InputError
        If no worker comes up.
    """
    require_dask()
    from distributed import Client, LocalCluster
    from distributed.security import Security

    try:
        security = Security.temporary()
    except ImportError as error:
        raise needs_extra("cryptography", "a study on several processes", "study") from error
    with ExitStack() as stack:
        stack.enter_context(_quietly())
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="gaitgraph-", ignore_cleanup_errors=True)))
        cluster = stack.enter_context(
            LocalCluster(
                n_workers=0,
                processes=True,
                host="127.0.0.1",
                security=security,
                silence_logs=logging.CRITICAL,
                dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False, "allowed_failures": _DEATHS},
            )
        )
        foreman = _Foreman(count, cluster.scheduler_address, security, folder)
        stack.callback(foreman.end)
        foreman.start()
        crew = Crew(client=stack.enter_context(Client(cluster, set_as_default=False)), tend=foreman.tend)
        _wait_for_one(crew.client, crew.tend)
        yield crew


class _Foreman:
    """Keeps the process alive that keeps the workers of this machine alive."""

    def __init__(self, count: int, address: str, security: Any, folder: Path) -> None:
        self._count, self._address, self._folder = count, address, folder
        self._flags: list[str] = []
        keys = {"ca-file": security.tls_ca_file, "cert": security.tls_worker_cert, "key": security.tls_worker_key}
        for name, content in keys.items():
            path = folder / name
            path.touch(mode=0o600)
            path.write_text(content)
            self._flags += [f"--tls-{name}", str(path)]
        self._process: subprocess.Popen[bytes] | None = None
        self._starts = 0
        self._seen = monotonic()

    def start(self) -> None:
        """Start worker processes as Dask's own command does; what they say is kept in a file."""
        self._starts += 1
        self._seen = monotonic()
        place = self._folder / f"workers-{self._starts}"
        place.mkdir()
        with (self._folder / "log").open("wb") as log:
            self._process = subprocess.Popen(  # noqa: S603
                [
                    *(sys.executable, "-m", "distributed.cli.dask_worker", self._address),
                    *("--nworkers", str(self._count), "--nthreads", "1", "--memory-limit", "0"),
                    *("--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"),
                    *("--local-directory", str(place), "--death-timeout", "10"),
                    *self._flags,
                ],
                cwd=place,
                env=os.environ | _LEAN | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # an interrupt at the terminal is ours: we end them
            )

    def tend(self, some: bool) -> None:
        """Start the process again if it is gone; InputError if that is of no use."""
        code = self._process.poll() if self._process is not None else None
        if code is None:
            if some:
                self._seen = monotonic()
            elif monotonic() - self._seen > _START:
                self._give_up(f"none for {_START:g} s")
        elif self._starts < _STARTS:
            self.start()
        else:
            how = f"signal {-code} ended it" if code < 0 else f"it ended with code {code}"
            said = _error_in((self._folder / "log").read_text(errors="replace"))
            self._give_up(f"the process that keeps them was started {_STARTS} times; {said or how}")

    def _give_up(self, why: str) -> None:
        raise InputError(
            f"workers: {why}; allowed is a machine that lets processes run and talk over 127.0.0.1, or --workers 0, "
            f"which starts none; {_LOST_ITS_WORKERS}"
        )

    def end(self) -> None:
        """End the process, and with it its workers."""
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _error_in(log: str) -> str:
    r"""Return the last error that a log tells, in one line; "" if it tells none.

    >>> _error_in("nanny - INFO - Closing\nOSError: [Errno 98] in use\nnanny - INFO - End.")
    'OSError: [Errno 98] in use'
    """
    told = [line for line in log.splitlines() if re.match(r"[\w.]*(?:Error|Exception): \S", line)]
    return shown(told[-1])[1:-1] if told else ""


def _wait_for_one(client: Any, tend: Callable[[bool], None]) -> None:
    """Return once a worker is there; the others join while it flies."""
    while True:
        with suppress(TimeoutError):
            client.wait_for_workers(1, timeout=_LOOK)
            return
        tend(False)


@contextmanager
def cluster_there(address: str, tell: Callable[[str], None] = lambda _: None) -> Iterator[Crew]:
    """Give the workers of the cluster at an address; the cluster stays when the context ends.

    Parameters
    ----------
    address
        Of the scheduler.
    tell
        Called with a few words when it has no workers.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    InputError
        If nothing answers there within :data:`PATIENCE`, or something that is no scheduler of Dask; from `tend` of the
        crew if there are no workers for :data:`EMPTY`.
    """
    require_dask()
    from distributed import Client

    allowed = "allowed is the address of a running Dask scheduler, such as tcp://10.0.0.5:8786"
    with ExitStack() as stack:
        stack.enter_context(_quietly())
        try:
            _knock(address)
            client = stack.enter_context(Client(address, timeout=PATIENCE, set_as_default=False))
        except (TimeoutError, OSError) as error:
            raise InputError(
                f"--scheduler: {shown(address)} does not answer within {PATIENCE:g} s; {allowed}"
            ) from error
        except Exception as error:  # what is no address, and what is no scheduler, ends in many ways
            raise InputError(f"--scheduler: {shown(address)} is no Dask scheduler; {allowed}") from error
        seen = monotonic()

        def tend(some: bool) -> None:
            nonlocal seen
            if some:
                seen = monotonic()
            elif monotonic() - seen > EMPTY:
                raise InputError(
                    f"--scheduler: {shown(address)} had no workers for {EMPTY:g} s; allowed is a cluster with workers; "
                    f"{_LOST_ITS_WORKERS}"
                )
            else:
                tell(f"waiting for workers of {address}")

        yield Crew(client=client, tend=tend)


def _knock(address: str) -> None:
    """Return once a Dask server has answered; a client waits for ever where one is connected and says nothing."""
    import asyncio
    from concurrent.futures import ThreadPoolExecutor

    from distributed.comm import connect
    from distributed.security import Security

    async def knock() -> None:
        arguments = Security().get_connection_args("client")
        comm = await asyncio.wait_for(connect(address, timeout=PATIENCE, **arguments), PATIENCE)
        comm.abort()

    with ThreadPoolExecutor(1) as pool:  # whoever calls may have an event loop of their own
        pool.submit(asyncio.run, knock()).result()


def flown_batches(
    crew: Crew, study: Study, batches: Iterable[int], versions: Mapping[str, str]
) -> Iterator[tuple[int, Rows]]:
    """Yield batches and their rows as they are flown, in any order.

    Dask hands the work of a worker that dies to others. The cases of a batch that several workers did not survive are
    flown one by one at the end, each with nothing beside it, and the one that kills its worker still is a row that
    says so.

    Raises
    ------
    InputError
        If a worker has other versions, or the cluster goes away, or has no workers and gets none.
    """
    text = study.text
    suspects: list[int] = []
    found: dict[int, Rows] = {}

    def taken(numbers: Sequence[int], rows: Rows | None) -> Iterator[tuple[int, Rows]]:
        """Take in the rows of some cases of one batch, and yield it if it is complete."""
        if rows is None:
            suspects.extend(numbers)
            return
        batch = numbers[0] // study.batch
        known = found.setdefault(batch, [])
        known += rows
        if len(known) == len(study.numbers(batch)):
            yield batch, sorted(found.pop(batch), key=lambda row: int(row["case"]))

    for numbers, rows in _answers(crew, text, map(study.numbers, batches), versions):
        yield from taken(numbers, rows)
    for number in sorted(suspects):
        for numbers, rows in _answers(crew, text, [range(number, number + 1)], versions):
            yield from taken(numbers, [lost_row(study.case(number), LOST)] if rows is None else rows)


def _answers(
    crew: Crew, text: str, tasks: Iterable[range], versions: Mapping[str, str]
) -> Iterator[tuple[range, Rows | None]]:
    """Yield the cases of each task and their rows, None if too many workers died of it, as they come."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    client = crew.client
    waiting = deque(tasks)
    flying: dict[Any, range] = {}
    answers = as_completed(loop=client.loop, raise_errors=False)

    def fill() -> int:
        """Hand over as many tasks as there is room for; return how many threads there are."""
        threads = _threads_of(client)
        while waiting and len(flying) < _AHEAD * max(threads, 1):
            numbers = waiting.popleft()
            future = client.submit(flown_batch, text, numbers, dict(versions), pure=False)
            flying[future] = numbers
            answers.add(future)
        return threads

    fill()
    while flying:
        look = monotonic() + _LOOK
        while not answers.has_ready():  # workers that are gone for good never answer
            sleep(_PAUSE)
            if monotonic() > look:
                crew.tend(fill() > 0)
                look = monotonic() + _LOOK
        future = next(answers)
        numbers = flying.pop(future)
        if future.status == "finished":
            yield numbers, future.result()
        elif future.status == "error" and isinstance(future.exception(), KilledWorker):
            yield numbers, None
        else:
            raise _problem_of(future)
        fill()


def _threads_of(client: Any) -> int:
    """Return how many threads fly; 0 if the scheduler cannot be asked: its futures tell that it is gone."""
    try:
        return sum(client.nthreads().values())
    except Exception:  # how a connection ends depends on where it is cut
        return 0


def _problem_of(future: Any) -> GaitgraphError:
    """Return what to raise for work that did not come back."""
    error = future.exception() if future.status == "error" else None
    if isinstance(error, GaitgraphError):
        return error
    if error is None:
        return InputError(f"--scheduler: it went away; {_LOST_ITS_WORKERS}; allowed is a cluster that lasts")
    why = shown(f"{type(error).__name__}: {error}")[1:-1]
    return InputError(
        f"--scheduler: a worker cannot run the study ({why}); allowed are workers with this gaitgraph and its extra "
        "study"
    )
