"""Run a study on Dask: what is there is kept, what is missing is flown, and every batch is written when it is done.

A case that cannot be planned, is refused, does not settle or fails is a row too, with its reason.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import os
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph import __version__
from gaitgraph.angles import number_of
from gaitgraph.errors import GaitgraphError, Infeasible, InputError, needs_extra, shown
from gaitgraph.flight.simulation import fly
from gaitgraph.plots.axes import require_matplotlib
from gaitgraph.study.dataset import (
    FLIGHT,
    KEPT,
    MANIFEST,
    OUTCOMES,
    columns_of_constant,
    opened_dataset,
    page_of,
    reasons_of,
)
from gaitgraph.study.design import Case, Study, read_study, study_from_mapping
from gaitgraph.timing.timed_gait import parametrize

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from gaitgraph.gait.gait import Gait

    Row = dict[str, Any]
    Batch = tuple[int, list[Row]]

MOST_WORKERS = 1024

FREE_CASES = 10_000
FREE_SECONDS = 3600.0
"""More cases, or a longer estimate, are run only with `yes`."""

PATIENCE = 5.0
"""How long a scheduler may take to answer [s]."""

EMPTY = 60.0
"""How long a cluster may be without workers at the start [s]."""

# An interrupt at the terminal reaches the workers too; this process ends them.
_NO_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
_LONGEST_REASON = 500
_IN_FLIGHT = 256  # batches that the scheduler holds at a time
_DEATHS = 2  # how many workers a batch may lose before its cases are flown one by one


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRun:
    """A study that is done.

    Parameters
    ----------
    study, folder
        What was asked, and where its rows and its page are.
    outcomes
        How many cases had each of :data:`gaitgraph.study.dataset.OUTCOMES`.
    reasons
        Outcome, reason and count of the cases that did not settle; a reason has the numbers of the first such case.
    flown
        How many cases this run added; the others were there.
    table
        All rows, a pyarrow table in the order of the cases.
    """

    study: Study
    folder: Path
    outcomes: Mapping[str, int]
    reasons: tuple[tuple[str, str, int], ...]
    flown: int
    table: Any

    @property
    def summary(self) -> Path:
        """The page that sums it up."""
        return self.folder / "summary.html"

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
            "reasons": [
                {"outcome": outcome, "reason": reason, "cases": count} for outcome, reason, count in self.reasons
            ],
            "summary": str(self.summary),
        }

    def __str__(self) -> str:
        count = len(self.study)
        kept = count - self.flown
        head = f"Study {self.study.name}: {count} case{'s' * (count != 1)}" + (f", {kept} of them kept" if kept else "")
        lines = [head, *(f"  {name:<12} {self.outcomes[name]}" for name in OUTCOMES if self.outcomes[name])]
        lines += [
            f"  {count} × {outcome}{', e.g.' if count > 1 else ''}: {reason}"
            for outcome, reason, count in self.reasons[:5]
        ]
        if len(self.reasons) > 5:
            lines.append(f"  and {len(self.reasons) - 5} more reasons")
        return "\n".join([*lines, f"rows in {self.folder / 'rows'}, summary in {self.summary}"])


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
    if scheduler is not None and (not isinstance(scheduler, str) or not scheduler.strip()):
        raise InputError(f"--scheduler must be an address such as tcp://10.0.0.5:8786, got {shown(scheduler)}")
    if scheduler is not None and workers is not None:
        raise InputError(f"--workers must not stand beside --scheduler, got {shown(workers)}")
    if workers is None:
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        workers = 1 if scheduler is not None else cores
    if isinstance(workers, bool) or not isinstance(workers, int) or not 0 <= workers <= MOST_WORKERS:
        raise InputError(f"--workers must be a whole number from 0 to {MOST_WORKERS}, got {shown(workers)}")
    if not yes:
        check_size(study, workers)
    require_matplotlib()
    try:
        import pyarrow as _  # noqa: F401
    except ImportError as error:
        raise needs_extra("pyarrow", "a study", "study") from error
    here = versions()
    say = progress or (lambda _: None)
    folder = Path(output)
    if scheduler is not None and not (folder / MANIFEST).exists():
        with _client(1, scheduler):  # a wrong address leaves no folder
            pass
    with opened_dataset(folder, study, here) as dataset, ExitStack() as stack:
        say("reading what is there")
        missing = dataset.missing()
        if missing and workers:
            say("asking the scheduler" if scheduler is not None else "starting workers")
            client = stack.enter_context(_client(min(workers, len(missing)), scheduler))
            batches = _flown_on_dask(client, study, missing, here)
        else:
            batches = ((batch, flown_batch(study.text, study.numbers(batch), here)) for batch in missing)
        flown, start = 0, monotonic()
        todo = sum(len(study.numbers(batch)) for batch in missing)
        say(f"{len(study) - todo} of {len(study)} cases")
        for batch, rows in batches:
            dataset.write(batch, rows)
            flown += len(rows)
            left = (monotonic() - start) * (todo - flown) / flown
            say(f"{len(study) - todo + flown} of {len(study)} cases" + f", about {time_text(left)} left" * (left > 0))
        say("drawing the summary")
        table = dataset.table()
        dataset.put(folder / "summary.html", page_of(study, table).encode(), force=True)
    counts = table["outcome"].to_pylist()
    return StudyRun(
        study=study,
        folder=folder,
        outcomes={name: counts.count(name) for name in OUTCOMES},
        reasons=reasons_of(table),
        flown=flown,
        table=table,
    )


def versions() -> dict[str, str]:
    """Return the versions of what rows depend on; MissingExtra if the engine is not installed."""
    try:
        return {"gaitgraph": __version__, "mujoco": version("mujoco")}
    except PackageNotFoundError as error:
        raise needs_extra("mujoco", "a study", "study") from error


def flown_batch(text: str, numbers: Sequence[int], expected: Mapping[str, str]) -> list[Row]:
    """Return the rows of some cases of a study; every worker runs this. InputError if its versions are not expected."""
    here = versions()
    for name, wanted in expected.items():
        if here.get(name) != wanted:
            raise InputError(f"workers must have {name} {wanted}, with which the study began, got {here.get(name)}")
    study = study_from_mapping(json.loads(text))
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
        row |= {
            "valid": report.valid,
            "flyable": report.flyable,
            "reachable_from_hover": report.reachable_from_hover,
            "gait_singular_value": report["least_singular_value"].value,
            "gait_tilt_rate": report["tilt_rate"].value,
        }
        flight = fly(timed, attitude=(case.roll, case.pitch), settings=study.flight, anyway=study.anyway)
        values = flight.as_mapping()
        numbers = {name: number_of(values[name]) for name in FLIGHT}
        row |= {name: number if math.isfinite(number) else None for name, number in numbers.items()}
        outcome, reason = ("settled" if flight.settled else "not settled"), flight.reason
        outcome = "refused" if flight.refused else outcome
    except Infeasible as error:
        outcome, reason = "no gait", str(error)
    except GaitgraphError as error:
        outcome, reason = "failed", str(error)
    except Exception as error:  # a case never ends the study
        outcome, reason = "failed", f"{type(error).__name__}: {error}"
    reason = " ".join(reason.split())
    reason = reason if len(reason) <= _LONGEST_REASON else reason[:_LONGEST_REASON] + "…"
    return row | {"outcome": outcome, "reason": reason}


def lost_row(case: Case) -> Row:
    """Return the row of a case that ended each process that flew it."""
    return _known_of(case) | {"outcome": "failed", "reason": "each worker that flew this case alone died"}


def _known_of(case: Case) -> Row:
    row: Row = {"case": case.number, "vehicle": case.model.base.name}
    for name, value in case.varied.items():
        columns = columns_of_constant(name)
        row |= zip(columns, value if len(columns) > 1 else (value,), strict=True)
    return row | {
        "gait": case.source.name,
        "eta": case.eta,
        "period": case.period,
        "roll": case.roll,
        "pitch": case.pitch,
    }


def check_size(study: Study, workers: int) -> None:
    """Raise InputError if a study is so large that it must be confirmed."""
    seconds = study.seconds(workers)
    if len(study) > FREE_CASES or seconds > FREE_SECONDS:
        raise InputError(
            f"study {study.name!r} has {len(study)} flights, about {time_text(seconds)} on {workers or 1} "
            f"process{'es' * (workers > 1)}; more than {FREE_CASES} flights or {time_text(FREE_SECONDS)} need --yes "
            "(yes=True)"
        )


def time_text(seconds: float) -> str:
    """Return a time in the unit that fits.

    >>> time_text(40), time_text(200), time_text(8000), time_text(1e6)
    ('40 s', '3 min', '2.2 h', '12 days')
    """
    if seconds < 100:
        return f"{max(round(seconds), 1)} s"
    if seconds < 5940:
        return f"{round(seconds / 60)} min"
    return f"{seconds / 3600:.1f} h" if seconds < 100 * 3600 else f"{round(seconds / 86400)} days"


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
    loggers = [logging.getLogger(name) for name in ("distributed", "tornado", "asyncio")]
    with ExitStack() as stack:
        for logger in loggers:  # what Dask logs is ours to say
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL + 1)
        try:
            if scheduler is not None:
                # A client would wait for ever for a server that accepts the connection and says nothing.
                security = Security().get_connection_args("client")
                hello = asyncio.wait_for(connect(scheduler, timeout=PATIENCE, **security), PATIENCE)
                with ThreadPoolExecutor(1) as pool:  # this thread may have an event loop
                    pool.submit(asyncio.run, hello).result()
                client = stack.enter_context(Client(scheduler, timeout=PATIENCE, set_as_default=False))
                client.wait_for_workers(1, timeout=EMPTY)
            else:
                cluster = stack.enter_context(
                    LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        memory_limit=0,
                        preload=[_NO_INTERRUPTS],
                        security=True,
                        silence_logs=logging.CRITICAL + 1,
                        dashboard_address="127.0.0.1:0",
                        scheduler_kwargs={"dashboard": False, "allowed_failures": _DEATHS},
                    )
                )
                client = stack.enter_context(Client(cluster, set_as_default=False))
        except Exception as error:  # Dask raises different errors for a bad address, a silent host, a dead worker
            if scheduler is None:
                raise InputError(f"workers did not start ({_line(error)}); --workers 0 needs none") from error
            raise InputError(
                f"--scheduler must be the address of a running Dask scheduler with workers, got {shown(scheduler)} "
                f"({_line(error)})"
            ) from error
        yield client


def _flown_on_dask(client: Any, study: Study, batches: Sequence[int], here: Mapping[str, str]) -> Iterator[Batch]:
    """Yield batches and their rows as they are flown, in any order; InputError if a worker cannot, or the cluster ends.

    Dask gives the work of a worker that dies to others. The cases of a batch that several workers did not survive are
    flown one by one at the end, and a case that still ends its worker has a row that says so.
    """
    from distributed import as_completed

    text, waiting = study.text, iter(batches)

    def submitted(numbers: Sequence[int]) -> Any:
        return client.submit(flown_batch, text, numbers, dict(here), pure=False)

    batch_of = {submitted(study.numbers(batch)): batch for batch in islice(waiting, _IN_FLIGHT)}
    answers = as_completed(batch_of, loop=client.loop)
    lost = []
    for future in answers:
        batch, rows = batch_of.pop(future), _rows_of(future)
        if rows is None:
            lost.append(batch)
        else:
            yield batch, rows
        for following in islice(waiting, 1):
            following_future = submitted(study.numbers(following))
            batch_of[following_future] = following
            answers.add(following_future)
    for batch in sorted(lost):
        alone = [(number, _rows_of(submitted([number]))) for number in study.numbers(batch)]
        yield batch, [lost_row(study.case(number)) if rows is None else rows[0] for number, rows in alone]


def _rows_of(future: Any) -> list[dict[str, Any]] | None:
    """Return what a worker flew, None if too many workers died of it."""
    from distributed.scheduler import KilledWorker

    try:
        rows: list[dict[str, Any]] = future.result()
    except KilledWorker:
        return None
    except GaitgraphError:
        raise
    except (Exception, CancelledError) as error:
        raise InputError(
            f"a worker cannot run the study ({_line(error)}); workers need this gaitgraph with its extra study; {KEPT}"
        ) from error
    return rows


def _line(error: BaseException) -> str:
    return shown(f"{type(error).__name__}: {error}")[1:-1]
