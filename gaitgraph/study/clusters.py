"""Batches of cases on Dask: worker processes of this machine, or a cluster that is there already, by the same code.

The processes of this machine talk over the loopback address alone, encrypted with keys that live as long as they do:
whoever else works here cannot hand them work. They are started as processes of Dask's own command, so that a script
needs no ``if __name__ == "__main__"``, and end by themselves when this process is gone.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import tempfile
from collections import deque
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import GaitgraphError, InputError, needs_extra, shown
from gaitgraph.study.cases import flown_batch, lost_row

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from gaitgraph.study.designs import Study

    Rows = list[dict[str, Any]]

__all__ = ["LOST", "cluster_there", "flown_batches", "require_dask", "workers_here"]

LOST = "its process dies: tried alone, each worker that flew it was lost"
"""The reason in the row of a case that no worker survives."""

PATIENCE = 5.0
"""How long a scheduler may take to answer [s]."""

_START = 120.0
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
    loggers = [logging.getLogger(name) for name in _QUIET]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


@contextmanager
def workers_here(count: int) -> Iterator[Any]:
    """Give a Dask client of so many worker processes of this machine, one thread each; they end with the context.

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
        process = _started(count, cluster.scheduler_address, security, folder)
        stack.callback(_ended, process)
        client = stack.enter_context(Client(cluster, set_as_default=False))
        _wait_for_one(client, process, folder)
        yield client


def _started(count: int, address: str, security: Any, folder: Path) -> subprocess.Popen[bytes]:
    """Start worker processes as Dask's own command does; what they say is kept in a file."""
    keys = {"ca-file": security.tls_ca_file, "cert": security.tls_worker_cert, "key": security.tls_worker_key}
    flags = []
    for name, content in keys.items():
        path = folder / name
        path.touch(mode=0o600)
        path.write_text(content)
        flags += [f"--tls-{name}", str(path)]
    place = folder / "workers"
    place.mkdir()
    with (folder / "log").open("wb") as log:
        return subprocess.Popen(  # noqa: S603
            [
                *(sys.executable, "-m", "distributed.cli.dask_worker", address),
                *("--nworkers", str(count), "--nthreads", "1", "--memory-limit", "0"),
                *("--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"),
                *("--local-directory", str(place), "--death-timeout", "10"),
                *flags,
            ],
            cwd=place,
            env=os.environ | _LEAN | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # an interrupt at the terminal is ours: we end them
        )


def _ended(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(10.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _wait_for_one(client: Any, process: subprocess.Popen[bytes], folder: Path) -> None:
    """Return once a worker is there; the others join while it flies."""
    end = monotonic() + _START
    while True:
        with suppress(TimeoutError):
            client.wait_for_workers(1, timeout=0.25)
            return
        if process.poll() is not None or monotonic() > end:
            said = (folder / "log").read_text(errors="replace").strip().splitlines() or ["nothing was said"]
            raise InputError(
                f"workers: none came up ({shown(said[-1])[1:-1]}); allowed is a machine that lets processes talk over "
                "127.0.0.1, or --workers 0, which starts none"
            )


@contextmanager
def cluster_there(address: str) -> Iterator[Any]:
    """Give a Dask client of the cluster at an address; the cluster stays when the context ends.

    Raises
    ------
    MissingExtra
        If Dask is not installed.
    InputError
        If nothing answers there within :data:`PATIENCE`, or something that is no scheduler of Dask.
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
        yield client


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
    client: Any, study: Study, batches: Iterable[int], versions: Mapping[str, str]
) -> Iterator[tuple[int, Rows]]:
    """Yield batches and their rows as they are flown, in any order.

    Dask hands the work of a worker that dies to others. The cases of a batch that several workers did not survive are
    flown one by one at the end, each with nothing beside it, and the one that kills its worker still is a row that
    says so.

    Raises
    ------
    InputError
        If a worker has other versions, or the cluster goes away.
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

    for numbers, rows in _answers(client, text, map(study.numbers, batches), versions):
        yield from taken(numbers, rows)
    for number in sorted(suspects):
        for numbers, rows in _answers(client, text, [range(number, number + 1)], versions):
            yield from taken(numbers, [lost_row(study.case(number), LOST)] if rows is None else rows)


def _answers(
    client: Any, text: str, tasks: Iterable[range], versions: Mapping[str, str]
) -> Iterator[tuple[range, Rows | None]]:
    """Yield the cases of each task and their rows, None if too many workers died of it, as they come."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    waiting = deque(tasks)
    flying: dict[Any, range] = {}
    answers = as_completed(loop=client.loop, raise_errors=False)

    def fill() -> None:
        room = _AHEAD * max(sum(client.nthreads().values()), 1)
        while waiting and len(flying) < room:
            numbers = waiting.popleft()
            future = client.submit(flown_batch, text, numbers, dict(versions), pure=False)
            flying[future] = numbers
            answers.add(future)

    fill()
    while flying:
        future = next(answers)
        numbers = flying.pop(future)
        if future.status == "finished":
            yield numbers, future.result()
        elif future.status == "error" and isinstance(future.exception(), KilledWorker):
            yield numbers, None
        else:
            raise _problem_of(future)
        fill()


def _problem_of(future: Any) -> GaitgraphError:
    """Return what to raise for work that did not come back."""
    error = future.exception() if future.status == "error" else None
    if isinstance(error, GaitgraphError):
        return error
    if error is None:
        return InputError(
            "--scheduler: it went away; what is written stays, and the same command goes on from there; allowed is a "
            "cluster that lasts"
        )
    why = shown(f"{type(error).__name__}: {error}")[1:-1]
    return InputError(
        f"--scheduler: a worker cannot run the study ({why}); allowed are workers with this gaitgraph and its extra "
        "study"
    )
