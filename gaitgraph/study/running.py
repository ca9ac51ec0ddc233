"""Run a study on Dask: parts that are written are kept, the others are flown, each written when it is done.

The folder of a study::

    study.json                 the study with its fingerprint, and the versions that make the rows
    certificates/              one of each flyable gait, untimed, for each vehicle
    rows/part-00000.parquet    cases 0 to B − 1, in order; written whole or not at all
    rows/part-00001.parquet    the next B, and so on; B depends on the number of cases

Rows do not depend on the time, the machine or the process, so a part has the same bytes whichever worker flew it. A
case that cannot be planned, is refused, does not settle or fails has a row too, with its reason.
"""

from __future__ import annotations

import json
import logging
import math
import re
from collections import Counter
from concurrent.futures import CancelledError
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import timedelta
from importlib.metadata import PackageNotFoundError, version
from itertools import product
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph import __version__
from gaitgraph.angles import whole_number
from gaitgraph.certificates.making import certify
from gaitgraph.certificates.verifying import CERTIFICATE
from gaitgraph.errors import (
    Advice,
    FileProblem,
    GaitgraphError,
    Infeasible,
    InputError,
    OutputExists,
    needs_extra,
    shown,
    wrong,
)
from gaitgraph.files import write_whole
from gaitgraph.flight.simulation import fly
from gaitgraph.study.design import (
    FLIGHT,
    Case,
    Study,
    columns_of,
    read_study,
    study_from_mapping,
)
from gaitgraph.texts import table_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from gaitgraph.gait.gait import Gait

    Row = dict[str, Any]

OUTCOMES = ("settled", "not settled", "refused", "no gait", "failed")
"""The outcomes of a case: it flew and settled, or did not; it was refused; no gait was found; an error ended it."""

_MOST_WORKERS = 1024
_PATIENCE = 60.0  # s to wait for the first worker of a scheduler
# An interrupt at the terminal reaches the workers too; they ignore it, since this process ends them.
_NO_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRun:
    """The result of a study: its `folder`, and its `table`, a pyarrow table of all rows in the order of the cases.

    This run flew `flown` of the cases; the rows of the others were there.
    """

    study: Study
    folder: Path
    flown: int
    table: Any

    @property
    def outcomes(self) -> dict[str, int]:
        """The number of cases with each of :data:`OUTCOMES`."""
        counts = Counter(self.table["outcome"].to_pylist())
        return {name: counts[name] for name in OUTCOMES}

    def as_mapping(self) -> dict[str, Any]:
        """Return the result as plain values, ready for JSON."""
        counts = {name.replace(" ", "_"): n for name, n in self.outcomes.items()}
        return {
            "study": self.study.name,
            "fingerprint": self.study.fingerprint,
            "folder": str(self.folder),
            "cases": len(self.study),
            "flown": self.flown,
            "kept": len(self.study) - self.flown,
            **counts,
        }

    def __str__(self) -> str:
        cases = len(self.study)
        noun = "case" if cases == 1 else "cases"
        head = f"Study {self.study.name}: {cases} {noun}"
        if self.flown < cases:
            head += f", {cases - self.flown} of them kept"
        lines = [head]
        counts = [(name, str(n)) for name, n in self.outcomes.items() if n]
        lines += table_lines(counts)
        lines.append(f"rows with their reasons in {self.folder / 'rows'}")
        return "\n".join(lines)


def run_study(
    study: Study | str | Path | dict[str, Any],
    output: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> StudyRun:
    """Plan, check and fly every case of a study, and write a row for each.

    Parameters
    ----------
    study
        A study, the name of its TOML file, or a mapping for :func:`gaitgraph.study.design.study_from_mapping`.
    output
        The folder of its rows: a new one, or one of the same study, which is then continued.
    workers
        Processes on this machine; by default one for each core. 0 flies in this process, without Dask.
    scheduler
        The address of a running Dask scheduler, such as "tcp://host:8786"; its workers fly instead.
    progress
        Called with lines of text.

    Raises
    ------
    InputError, FileProblem, OutputExists
        If an argument is wrong, the scheduler does not answer, workers do not start, or an extra is missing; if the
        folder has other content, is of another study, or cannot be written.

    Notes
    -----
    After an interrupt or a crash the same call continues: written parts stay, the others are flown. Rows do not
    depend on the number of workers, but on another kind of processor their last digits may differ. A script that
    starts workers needs ``if __name__ == "__main__":``, as for Python's ``multiprocessing``.

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
    if workers is not None and scheduler is not None:
        raise wrong("workers", "must be left out beside a scheduler", workers)
    if workers is not None:
        workers = whole_number("workers", workers, 0, _MOST_WORKERS)
    try:
        import pyarrow as _  # noqa: F401
    except ImportError as error:
        raise needs_extra("pyarrow", "a study", "study") from error
    folder, say = Path(output), progress or (lambda _: None)
    _open_folder(folder, study)
    parts, missing = {}, {}
    for k, numbers in enumerate(study.batches):
        path = folder / "rows" / f"part-{k:05d}.parquet"
        parts[path] = numbers
        if not path.exists():
            missing[path] = numbers
    todo = sum(map(len, missing.values()))
    if missing:
        say("starting workers" if scheduler is None else "connecting to the scheduler")
        with _client(workers, scheduler) as client:
            _fly_parts(client, study, missing, folder, say)
    return StudyRun(
        study=study,
        folder=folder,
        flown=todo,
        table=_rows_of(parts),
    )


def _open_folder(folder: Path, study: Study) -> None:
    """Make the folder of a study, or see that it is of this study and of these versions."""
    about = {
        "versions": versions(),
        "fingerprint": study.fingerprint,
        "study": study.as_mapping(),
    }
    text = json.dumps(about, indent=1, ensure_ascii=False) + "\n"
    manifest = folder / "study.json"
    wanted = f"output must be a new folder or one of this study, got {str(folder)!r}"
    try:
        folder.mkdir(exist_ok=True)
        is_new = not any(folder.iterdir())
        is_same = manifest.exists() and manifest.read_bytes() == text.encode()
    except (OSError, ValueError) as error:  # a name with a null character
        raise FileProblem(f"{wanted}: {error}") from error
    if is_new:
        write_whole([(manifest, text.encode())], force=False)
    elif not is_same:
        raise OutputExists(
            f"{wanted} with other files, or of another study or other versions"
        )
    for name in ("certificates", "rows"):
        (folder / name).mkdir(exist_ok=True)


def versions() -> dict[str, str]:
    """Return the versions that rows depend on; MissingExtra if the engine is not installed."""
    try:
        return {"gaitgraph": __version__, "mujoco": version("mujoco")}
    except PackageNotFoundError as error:
        raise needs_extra("mujoco", "a study", "study") from error


def _client(workers: int | None, scheduler: str | None) -> Any:
    """Return a Dask client of a scheduler, or of new worker processes, which end with it; None without workers."""
    if workers == 0:
        return nullcontext()
    try:
        from distributed import Client

        if scheduler is None:
            return Client(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=0,
                preload=_NO_INTERRUPTS,
                # Otherwise mujoco looks for a display in a new process.
                env={"MUJOCO_GL": "disable"},
                security=True,
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        client = Client(scheduler)
        client.wait_for_workers(1, timeout=_PATIENCE)
        theirs = client.run(versions)
    except ImportError as error:
        raise needs_extra("distributed", "a study with workers", "study") from error
    except Exception as error:  # Dask raises different errors for a bad address, a silent host, a dead worker
        reason = shown(f"{type(error).__name__}: {error}")[1:-1]
        if scheduler is None:
            advice = "0 flies without them"
            raise InputError(
                f"workers did not start ({reason})",
                advice=Advice(f"workers={advice}", f"--workers {advice}"),
            ) from error
        raise wrong(
            "scheduler",
            "must be the address of a running Dask scheduler with workers",
            scheduler,
            f" ({reason})",
        ) from error
    for other in theirs.values():
        if other != versions():
            client.close()
            raise wrong(
                "workers",
                f"must have {versions()}, as this process has",
                other,
                got=f"{other}",
            )
    return client


def _fly_parts(
    client: Any,
    study: Study,
    missing: Mapping[Path, range],
    folder: Path,
    say: Callable[[str], None],
) -> None:
    """Fly the missing parts of a study and write each when it is done."""
    say("certifying the gaits")
    reasons = _certify(study, folder / "certificates")
    todo, flown, start = sum(map(len, missing.values())), 0, monotonic()
    say(f"{len(study) - todo} of {len(study)} cases")
    for path, rows in _flown_parts(client, study, missing):
        for row in rows:
            row["uncertified"] = reasons[row["vehicle"], row["gait"]]
        _write_part(path, rows, study)
        flown += len(rows)
        text = f"{len(study) - todo + flown} of {len(study)} cases"
        if flown < todo:
            seconds = (monotonic() - start) * (todo - flown) / flown
            text += f", about {timedelta(seconds=round(seconds))} left"
        say(text)


def _certify(study: Study, folder: Path) -> dict[tuple[str, str], str]:
    """Write a certificate of each gait for each vehicle, with the first of the constants that vary.

    Return why there is none, "" where there is one, by the names of the vehicle and the gait.
    """
    reasons = {}
    pairs = product(study.models, study.sources)
    for number, (model, source) in enumerate(pairs):
        key = model.base.name, source.name
        name = re.sub(r"[^\w-]+", "_", f"{number}_{source.name}_{model.base.name}")
        try:
            text = certify(source.gait(model.base)).text
        except GaitgraphError as error:
            reasons[key] = " ".join(str(error).split())
        else:
            reasons[key] = ""
            path = folder / f"{name[:100]}{CERTIFICATE}"
            write_whole([(path, text.encode())], force=True)
    return reasons


def _flown_parts(
    client: Any, study: Study, missing: Mapping[Path, range]
) -> Iterator[tuple[Path, list[Row]]]:
    """Yield parts and their rows, on Dask in any order; InputError if the scheduler ends.

    When a worker dies, Dask gives its parts to another. A part on which several workers died is flown case by case at
    the end, since the parts beside one that kills its worker die with it; a case on which they die again has failed.
    """
    if client is None:
        for path, numbers in missing.items():
            yield path, flown_batch(numbers, study)
        return
    from distributed import KilledWorker, as_completed

    address = client.scheduler.address
    futures = client.map(flown_batch, [*missing.values()], study=study, pure=False)
    path_of = dict(zip(futures, missing, strict=True))
    lost = []
    try:
        for future in as_completed(futures):
            path = path_of[future]
            try:
                yield path, future.result()
            except KilledWorker:
                lost.append(path)
            future.release()
        for path in lost:
            rows = [_flown_alone(client, study, number) for number in missing[path]]
            yield path, rows
    except (CancelledError, OSError) as error:  # what Dask raises then
        kept = "rows that are written are kept; run the same study again to continue"
        raise InputError(
            f"the Dask scheduler {address!r} is gone; {kept}", field="scheduler"
        ) from error


def _flown_alone(client: Any, study: Study, number: int) -> Row:
    """Return the row of one case, flown while nothing else is."""
    from distributed import KilledWorker

    try:
        (row,) = client.submit(flown_batch, [number], study=study, pure=False).result()
    except KilledWorker:
        row = study.case(number).known()
        row |= {
            "outcome": "failed",
            "reason": "each worker that flew this case alone died",
        }
    return row  # type: ignore[no-any-return]


def flown_batch(numbers: Sequence[int], study: Study) -> list[Row]:
    """Return the rows of some cases of a study; workers run this."""
    gaits: dict[str, Gait | GaitgraphError] = {}
    return [row_of(study.case(number), study, gaits) for number in numbers]


def row_of(case: Case, study: Study, gaits: dict[str, Gait | GaitgraphError]) -> Row:
    """Return the row of a case, also if it fails; `gaits` are the gaits and errors of the cases before."""
    row = case.known()
    try:
        row["outcome"], row["reason"] = _fly_case(case, study, gaits, row)
    except Infeasible as error:
        row |= {"outcome": "no gait", "reason": str(error)}
    except GaitgraphError as error:
        row |= {"outcome": "failed", "reason": str(error)}
    except Exception as error:  # an error of one case does not end the study
        row |= {"outcome": "failed", "reason": f"{type(error).__name__}: {error}"}
    row["reason"] = " ".join(row["reason"].split())
    return row


def _fly_case(
    case: Case, study: Study, gaits: dict[str, Gait | GaitgraphError], row: Row
) -> tuple[str, str]:
    """Fly a case, add what is known of it to its row, and return its outcome and reason."""
    vehicle = case.vehicle
    row["drag_ratio"] = vehicle.drag_ratio
    timed = (
        _gait_of(case, gaits)
        .biased(case.bias)
        .parametrize(case.period, law=case.source.law)
    )
    report = timed.check()
    for name in ("valid", "flyable", "reachable_from_hover"):
        row[name] = getattr(report, name)
    row["gait_singular_value"] = report["least_singular_value"].value
    row["gait_tilt_rate"] = report["tilt_rate"].value
    flight = fly(
        timed,
        attitude=(case.roll, case.pitch),
        settings=study.flight,
        anyway=study.anyway,
    )
    values = flight.as_mapping()
    for name in FLIGHT:
        if values[name] is not None and math.isfinite(values[name]):
            row[name] = values[name]
    outcome = "not settled"
    if flight.settled:
        outcome = "settled"
    elif flight.refused:
        outcome = "refused"
    return outcome, flight.reason


def _gait_of(case: Case, gaits: dict[str, Gait | GaitgraphError]) -> Gait:
    """Return the gait of a case for its vehicle, biased if it is; nothing is planned twice."""
    key = repr((case.model.base.name, case.varied, case.source.name))
    if key not in gaits:
        try:
            gaits[key] = case.source.gait(case.vehicle)
        except GaitgraphError as error:
            gaits[key] = error
    gait = gaits[key]
    if isinstance(gait, GaitgraphError):
        raise gait
    return gait


def _write_part(path: Path, rows: Sequence[Row], study: Study) -> None:
    """Write rows as a Parquet file, with the units of its columns."""
    import pyarrow as pa
    from pyarrow import parquet

    fields = []
    for name, unit in columns_of(study).items():
        if unit in ("int64", "string", "bool"):
            fields.append(pa.field(name, pa.type_for_alias(unit)))
        else:
            fields.append(pa.field(name, pa.float64(), metadata={"unit": unit}))
    about = {
        "versions": versions(),
        "study": study.name,
        "fingerprint": study.fingerprint,
    }
    schema = pa.schema(fields, metadata={"gaitgraph": json.dumps(about)})
    table = pa.Table.from_pylist(rows, schema=schema)

    def write(whole: Path) -> None:
        parquet.write_table(table, whole)

    write_whole([(path, write)], force=True)


def _rows_of(parts: Mapping[Path, range]) -> Any:
    """Return the rows of all parts, a pyarrow table."""
    import pyarrow as pa
    from pyarrow import dataset

    try:
        return dataset.dataset(list(parts), format="parquet").to_table()
    except (pa.ArrowException, OSError) as error:
        raise FileProblem(
            f"rows cannot be read: {error}; delete the part and run the same study again"
        ) from error
