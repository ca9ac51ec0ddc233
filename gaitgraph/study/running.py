"""Run a study: what is there is kept, what is missing is flown, and every batch is written when it is done."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError, shown
from gaitgraph.plots.axes import require_matplotlib
from gaitgraph.study.cases import OUTCOMES, flown_batch, versions
from gaitgraph.study.clusters import cluster_there, flown_batches, require_dask, workers_here
from gaitgraph.study.datasets import holds_study, opened_dataset, require_pyarrow
from gaitgraph.study.designs import FREE_CASES, FREE_SECONDS, Study, read_study, study_from_mapping
from gaitgraph.study.pages import page_of, reasons_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    Rows = list[dict[str, Any]]

__all__ = ["StudyRun", "check_size", "run_study", "time_text"]

MOST_WORKERS = 1024

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRun:
    """A study that is done.

    Parameters
    ----------
    study
        What was asked.
    folder
        Where its rows are: ``rows/part-….parquet``, and the page ``summary.html``.
    outcomes
        How many cases had each of :data:`gaitgraph.study.cases.OUTCOMES`.
    reasons
        Why cases did not settle, each with how many; numbers in a reason are those of the first such case.
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
        """Return what came of it as plain values, ready for JSON."""
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


def check_size(study: Study, workers: int) -> None:
    """Raise InputError if a study is so large that it should be asked for twice."""
    seconds = study.seconds(workers)
    if len(study) > FREE_CASES or seconds > FREE_SECONDS:
        raise InputError(
            f"study {study.name!r}: {len(study)} flights, about {time_text(seconds)} on {workers or 1} "
            f"process{'es' * (workers > 1)}; allowed without --yes (yes=True) are {FREE_CASES} flights and "
            f"{time_text(FREE_SECONDS)}"
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


def run_study(
    study: Study | str | Path | dict[str, Any],
    output: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    yes: bool = False,
    progress: Progress | None = None,
) -> StudyRun:
    """Plan, check and fly every case of a study, and write a row for each.

    Parameters
    ----------
    study
        A study, the name of its TOML file, or what :func:`gaitgraph.study.designs.study_from_mapping` takes.
    output
        The folder of its rows: a new one, or one of this very study, which is then gone on with.
    workers
        Processes of this machine; by default one for each core. 0 flies in this process, without Dask.
    scheduler
        The address of a Dask scheduler whose workers are taken instead.
    yes
        Run a study of more than 10,000 flights, or of more than an hour by estimate.
    progress
        Called with a few words now and then.

    Returns
    -------
    StudyRun

    Raises
    ------
    InputError
        If something asked for is not allowed, a scheduler does not answer, workers do not come up, or a part was taken
        away meanwhile.
    FileProblem, OutputExists
        If the folder is something else, of another study, in use, or cannot be written.
    MissingExtra
        If mujoco, pyarrow, matplotlib or Dask is not installed.

    Notes
    -----
    Interrupted or killed at any moment, the same call goes on: batches that are written stay, others are flown anew.
    Rows do not depend on the number of workers. That they are the same to the last digit on another kind of processor
    is not guaranteed.

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
    count = _checked_workers(workers, scheduler)
    if not yes:
        check_size(study, count)
    folder = Path(output)
    require_pyarrow()
    require_matplotlib()
    here = versions()
    if count:
        require_dask()
    tell = progress or (lambda _: None)
    if scheduler is not None and not holds_study(folder):
        with cluster_there(scheduler):  # an address that is wrong leaves no folder
            pass
    with opened_dataset(folder, study, here) as dataset:
        tell("reading what is there")
        kept = dataset.parts()
        missing = [batch for batch in range(study.batches) if batch not in kept]
        done = sum(len(study.numbers(batch)) for batch in kept)
        clock = _Clock(tell, done, len(study))
        flown = 0
        if missing:
            tell("starting workers" if count and scheduler is None else "asking the scheduler" if count else "flying")
            with _flying(study, missing, here, count, scheduler, tell) as batches:
                clock.start()
                for batch, rows in batches:
                    dataset.write(batch, rows)
                    flown += len(rows)
                    clock.add(len(rows))
        tell("drawing the summary")
        table = require_pyarrow().concat_tables((dataset.whole() if missing else kept).values())
        dataset.write_summary(page_of(study, table))
    counts = table["outcome"].to_pylist()
    return StudyRun(
        study=study,
        folder=folder,
        outcomes={name: counts.count(name) for name in OUTCOMES},
        reasons=reasons_of(table),
        flown=flown,
        table=table,
    )


def _checked_workers(workers: int | None, scheduler: str | None) -> int:
    """Return how many processes fly: 0 for this one; with a scheduler any positive number."""
    if scheduler is not None:
        if not isinstance(scheduler, str) or not scheduler.strip():
            raise InputError(f"--scheduler: {shown(scheduler)}; allowed is an address such as tcp://10.0.0.5:8786")
        if workers is not None:
            raise InputError(f"--workers: {shown(workers)} beside a scheduler; allowed is one of both")
        return 1
    if workers is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if isinstance(workers, bool) or not isinstance(workers, int) or not 0 <= workers <= MOST_WORKERS:
        raise InputError(f"--workers: {shown(workers)}; allowed is a whole number from 0 to {MOST_WORKERS}")
    return workers


@contextmanager
def _flying(
    study: Study, batches: list[int], here: Mapping[str, str], workers: int, scheduler: str | None, tell: Progress
) -> Iterator[Iterator[tuple[int, Rows]]]:
    """Give batches and their rows as they are flown."""
    if scheduler is not None:
        with cluster_there(scheduler, tell) as crew:
            yield flown_batches(crew, study, batches, here)
    elif workers:
        with workers_here(min(workers, len(batches))) as crew:
            yield flown_batches(crew, study, batches, here)
    else:
        yield ((batch, flown_batch(study.text, study.numbers(batch), here)) for batch in batches)


class _Clock:
    """Tells how much is done and how long the rest may take, by what this run has flown so far."""

    def __init__(self, tell: Progress, done: int, count: int) -> None:
        self._tell, self._begun, self._done, self._count = tell, done, done, count
        self._start = monotonic()

    def start(self) -> None:
        self._start = monotonic()
        self._say()

    def add(self, more: int) -> None:
        self._done += more
        self._say()

    def _say(self) -> None:
        words = f"{self._done} of {self._count} cases"
        flown = self._done - self._begun
        if flown and self._done < self._count:
            left = (monotonic() - self._start) * (self._count - self._done) / flown
            words += f", about {time_text(left)} left"
        self._tell(words)
