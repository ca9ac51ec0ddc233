"""Run a study on Dask: what is there is kept, what is missing is flown, and every batch is written when it is done.

A case that cannot be planned, is refused, does not settle or fails is a row too, with its reason.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import timedelta
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph import __version__
from gaitgraph.angles import whole_number
from gaitgraph.errors import GaitgraphError, Infeasible, InputError, needs_extra, shown
from gaitgraph.files import write_whole
from gaitgraph.flight.simulation import fly
from gaitgraph.plots.axes import require_matplotlib
from gaitgraph.study.dataset import FLIGHT, OUTCOMES, columns_of_constant, opened_dataset, page_of, reasons_of
from gaitgraph.study.design import Case, Study, read_study, study_from_mapping
from gaitgraph.timing.timed_gait import parametrize

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from gaitgraph.gait.gait import Gait

    Row = dict[str, Any]

_MOST_WORKERS = 1024
_FREE_CASES = 10_000  # more cases, or a longer estimate, are run only with `yes`
_FREE_SECONDS = 3600.0
_PATIENCE = 5.0  # s that a scheduler may take to answer
_EMPTY = 60.0  # s that a cluster may be without workers at the start
_DEATHS = 2  # how many workers a batch may lose before its cases are flown one by one
# An interrupt at the terminal reaches the workers too; this process ends them.
_NO_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRun:
    """A study that is done: its `folder`, and its `table`, a pyarrow table of all rows in the order of the cases.

    `outcomes` has the number of cases with each of :data:`gaitgraph.study.dataset.OUTCOMES`; `reasons` outcome, reason
    and count of those that did not settle, as worded in the first such case. This run added `flown` of the cases.
    """

    study: Study
    folder: Path
    outcomes: Mapping[str, int]
    reasons: tuple[tuple[str, str, int], ...]
    flown: int
    table: Any

    def as_mapping(self) -> dict[str, Any]:
        """Return the result as plain values, ready for JSON."""
        return {
            "study": self.study.name,
            "fingerprint": self.study.fingerprint,
            "folder": str(self.folder),
            "cases": len(self.study),
            "flown": self.flown,
            "kept": len(self.study) - self.flown,
            **{name.replace(" ", "_"): self.outcomes[name] for name in OUTCOMES},
            "reasons": [dict(zip(("outcome", "reason", "cases"), one, strict=True)) for one in self.reasons],
            "summary": str(self.folder / "summary.html"),
        }

    def __str__(self) -> str:
        count, kept = len(self.study), len(self.study) - self.flown
        lines = [f"Study {self.study.name}: {count} case{'s' * (count != 1)}" + f", {kept} of them kept" * (kept > 0)]
        lines += [f"  {name:<12} {self.outcomes[name]}" for name in OUTCOMES if self.outcomes[name]]
        lines += [f"  {count} × {outcome}: {why}" for outcome, why, count in self.reasons[:5]]
        return "\n".join([*lines, f"rows in {self.folder / 'rows'}, summary in {self.folder / 'summary.html'}"])


def run_study(
    study: Study | str | Path | dict[str, Any],
    output: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    yes: bool = False,
    progress: Callable[[str], None] | None = None,
) -> StudyRun:
    """Plan, check and fly every case of a study, and write a row for each.

    Parameters
    ----------
    study
        A study, the name of its TOML file, or what :func:`gaitgraph.study.design.study_from_mapping` takes.
    output
        The folder of its rows: a new one, or one of this very study, which is then continued.
    workers
        Processes of this machine; by default one for each core. 0 flies in this process, without Dask.
    scheduler
        The address of a Dask scheduler whose workers are used instead.
    yes
        Run a study of more than 10,000 flights, or of more than an hour by estimate.
    progress
        Called with a few words now and then.

    Raises
    ------
    InputError
        If something asked for is not allowed, a scheduler does not answer, or workers do not start.
    FileProblem, OutputExists
        If the folder is something else, of another study, in use, or cannot be written.
    MissingExtra
        If mujoco, pyarrow, matplotlib or Dask is not installed.

    Notes
    -----
    Interrupted or killed at any moment, the same call continues: batches that are written stay, others are flown anew.
    Rows do not depend on the number of workers. That they are the same to the last digit on another kind of processor
    is not guaranteed. A script that starts workers needs ``if __name__ == "__main__":``, as Python's own processes do.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> asked = {"name": "tiny", "gaits": ["gait1", "gait4"], "flight": {"duration": 1}}
    >>> with TemporaryDirectory() as folder:
    ...     run = run_study(asked, f"{folder}/tiny", workers=0)
    >>> run.outcomes["settled"], run.outcomes["refused"]
    (1, 1)
    """
    if isinstance(study, dict):
        study = study_from_mapping(study)
    elif not isinstance(study, Study):
        study = read_study(study)
    if scheduler is not None and workers is not None:
        raise InputError(f"--workers must not stand beside --scheduler, got {shown(workers)}")
    if workers is None:
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        workers = 1 if scheduler is not None else cores
    whole_number("--workers", workers, 0, _MOST_WORKERS)
    seconds = study.seconds / max(workers, 1)
    if not yes and (len(study) > _FREE_CASES or seconds > _FREE_SECONDS):
        takes, free = timedelta(seconds=round(seconds)), timedelta(seconds=_FREE_SECONDS)
        raise InputError(
            f"study {study.name!r} has {len(study)} flights, about {takes} with --workers {workers}; more than "
            f"{_FREE_CASES} flights or {free} need --yes (yes=True)"
        )
    require_matplotlib()
    try:
        import pyarrow as _  # noqa: F401
    except ImportError as error:
        raise needs_extra("pyarrow", "a study", "study") from error
    here, folder, say = versions(), Path(output), progress or (lambda _: None)
    with ExitStack() as stack:
        client = None
        if scheduler is not None:  # first, since a wrong address leaves no folder
            say("asking the scheduler")
            client = stack.enter_context(_client(0, scheduler))
        dataset = stack.enter_context(opened_dataset(folder, study, here))
        missing = dataset.missing()
        if missing and workers and client is None:
            say("starting workers")
            client = stack.enter_context(_client(min(workers, len(missing)), None))
        numbers = {batch: study.batches[batch] for batch in missing}
        todo, flown, start = sum(map(len, numbers.values())), 0, monotonic()
        say(f"{len(study) - todo} of {len(study)} cases")
        here_flown = ((batch, flown_batch(some, study, here)) for batch, some in numbers.items())
        for batch, rows in here_flown if client is None else _flown_on_dask(client, study, numbers, here):
            dataset.write(batch, rows)
            flown += len(rows)
            left = timedelta(seconds=round((monotonic() - start) * (todo - flown) / flown))
            say(f"{len(study) - todo + flown} of {len(study)} cases" + f", about {left} left" * (flown < todo))
        say("drawing the summary")
        table = dataset.table()
        write_whole([(folder / "summary.html", page_of(study, table).encode())], force=True)
    found = table["outcome"].to_pylist()
    outcomes = {name: found.count(name) for name in OUTCOMES}
    return StudyRun(study=study, folder=folder, outcomes=outcomes, reasons=reasons_of(table), flown=flown, table=table)


def versions() -> dict[str, str]:
    """Return the versions of what rows depend on; MissingExtra if the engine is not installed."""
    try:
        return {"gaitgraph": __version__, "mujoco": version("mujoco")}
    except PackageNotFoundError as error:
        raise needs_extra("mujoco", "a study", "study") from error


def flown_batch(numbers: Sequence[int], study: Study, expected: Mapping[str, str]) -> list[Row]:
    """Return the rows of some cases of a study; every worker runs this. InputError if its versions are not expected."""
    here = versions()
    for name, wanted in expected.items():
        if here.get(name) != wanted:
            raise InputError(f"workers must have {name} {wanted}, with which the study began, got {here.get(name)}")
    gaits: dict[str, Gait | GaitgraphError] = {}
    return [row_of(study.case(number), study, gaits) for number in numbers]


def row_of(case: Case, study: Study, gaits: dict[str, Gait | GaitgraphError]) -> Row:
    """Return the row of a case, whatever goes wrong in it; `gaits` keeps what was planned for the cases before."""
    row = _known_of(case)
    try:
        row["drag_ratio"] = case.vehicle.drag_ratio
        key = repr((case.model.base.name, case.varied, case.source.name))
        if key not in gaits:
            try:
                gaits[key] = case.source.gait(case.vehicle)
            except GaitgraphError as error:
                gaits[key] = error
        gait = gaits[key]
        if isinstance(gait, GaitgraphError):
            raise gait
        timed = parametrize(gait if case.eta == 1 else gait.biased(case.eta), case.period, law=case.source.law)
        report = timed.check()
        row |= {name: getattr(report, name) for name in ("valid", "flyable", "reachable_from_hover")}
        row["gait_singular_value"] = report["least_singular_value"].value
        row["gait_tilt_rate"] = report["tilt_rate"].value
        flight = fly(timed, attitude=(case.roll, case.pitch), settings=study.flight, anyway=study.anyway)
        values = flight.as_mapping()
        row |= {name: values[name] if math.isfinite(values[name] or 0.0) else None for name in FLIGHT}
        outcome = "settled" if flight.settled else "refused" if flight.refused else "not settled"
        reason = flight.reason
    except Exception as error:  # a case never ends the study
        outcome = "no gait" if isinstance(error, Infeasible) else "failed"
        reason = str(error) if isinstance(error, GaitgraphError) else f"{type(error).__name__}: {error}"
    return row | {"outcome": outcome, "reason": " ".join(reason.split())}


def _known_of(case: Case) -> Row:
    """Return what a row holds whatever comes of its case."""
    row: Row = {"case": case.number, "vehicle": case.model.base.name, "gait": case.source.name}
    for name, value in case.varied.items():
        row |= zip(columns_of_constant(name), value if isinstance(value, tuple) else (value,), strict=True)
    return row | {name: getattr(case, name) for name in ("eta", "period", "roll", "pitch")}


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """Give a Dask client: of so many processes of this machine, which end with it, or of the cluster at an address."""
    try:
        import cryptography as _  # noqa: F401 - Dask needs it for its keys
        from distributed import Client, LocalCluster
        from distributed.comm import connect
        from distributed.security import Security
    except ImportError as error:
        raise needs_extra("distributed", "a study on several processes", "study") from error
    with ExitStack() as stack:
        for logger in map(logging.getLogger, ("distributed", "tornado", "asyncio")):  # what Dask logs is ours to say
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL + 1)
        try:
            if scheduler is not None:
                # A client would wait for ever for a server that accepts the connection and says nothing.
                security = Security().get_connection_args("client")
                hello = asyncio.wait_for(connect(scheduler, timeout=_PATIENCE, **security), _PATIENCE)
                with ThreadPoolExecutor(1) as pool:  # this thread may have an event loop
                    pool.submit(asyncio.run, hello).result()
                client = stack.enter_context(Client(scheduler, timeout=_PATIENCE, set_as_default=False))
                client.wait_for_workers(1, timeout=_EMPTY)
            else:
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    memory_limit=0,
                    preload=[_NO_INTERRUPTS],
                    env={"MUJOCO_GL": "disable"},  # nothing is drawn; else mujoco looks for a display in a new process
                    security=True,
                    silence_logs=logging.CRITICAL + 1,
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False, "allowed_failures": _DEATHS},
                )
                client = stack.enter_context(Client(stack.enter_context(cluster), set_as_default=False))
        except Exception as error:  # Dask raises different errors for a bad address, a silent host, a dead worker
            if scheduler is None:
                raise InputError(f"workers did not start ({_line(error)}); --workers 0 needs none") from error
            raise InputError(
                f"--scheduler must be the address of a running Dask scheduler with workers, got {shown(scheduler)} "
                f"({_line(error)})"
            ) from error
        yield client


def _flown_on_dask(
    client: Any, study: Study, numbers: Mapping[int, range], here: Mapping[str, str]
) -> Iterator[tuple[int, list[Row]]]:
    """Yield batches and their rows as they are flown, in any order; InputError if a worker cannot, or the cluster ends.

    Dask gives the work of a worker that dies to others. The cases of a batch that several workers did not survive are
    flown one by one at the end, and a case that still ends its worker has a row that says so.
    """
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    def submitted(some: Sequence[int]) -> Any:
        return client.submit(flown_batch, some, study, dict(here), pure=False)

    def rows_of(future: Any) -> Any:  # None where workers died
        try:
            return future.result()
        except KilledWorker:
            return None
        except GaitgraphError:
            raise
        except (Exception, CancelledError) as error:
            raise InputError(
                f"a worker cannot run the study ({_line(error)}); workers need this gaitgraph with its extra study"
            ) from error

    batch_of = {submitted(some): batch for batch, some in numbers.items()}
    lost = []
    for future in as_completed(list(batch_of), loop=client.loop):
        batch, rows = batch_of.pop(future), rows_of(future)
        if rows is not None:
            yield batch, rows
        else:
            lost.append(batch)
    died = {"outcome": "failed", "reason": "each worker that flew this case alone died"}
    for batch in sorted(lost):
        alone = [(number, rows_of(submitted([number]))) for number in numbers[batch]]
        yield batch, [rows[0] if rows else _known_of(study.case(number)) | died for number, rows in alone]


def _line(error: BaseException) -> str:
    return shown(f"{type(error).__name__}: {error}")[1:-1]
