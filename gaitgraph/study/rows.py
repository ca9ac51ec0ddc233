"""The rows of a study: what comes of each case, and the folder that keeps them.

A case that cannot be planned, is refused, does not settle or fails is a row too, with its reason. Rows hold nothing of
the clock, the machine or the process: the same case is the same row.

::

    study.json                 what the study is, resolved; its fingerprint; the versions that rows are made with
    rows/part-00000.parquet    cases 0 to B − 1, in order; written whole or not at all
    rows/part-00001.parquet    the next B, and so on; B follows from the number of cases
    summary.html               once all are there

What is in a part follows from the study alone, so parts have the same bytes whichever worker flew them.
"""

from __future__ import annotations

import io
import json
import math
import shutil
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from gaitgraph import __version__
from gaitgraph.angles import number_of
from gaitgraph.errors import FileProblem, GaitgraphError, Infeasible, InputError, OutputExists, needs_extra, shown
from gaitgraph.files import text_of, write_whole
from gaitgraph.flight.simulation import fly
from gaitgraph.study.design import Case, Study, study_from_mapping
from gaitgraph.timing.timed_gait import parametrize
from gaitgraph.vehicle import UNITS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from gaitgraph.gait.gait import Gait

    Row = dict[str, Any]

OUTCOMES = ("settled", "not settled", "refused", "no gait", "failed")
"""What may come of a case: it flew and settled, or not; it was not flown; there is nothing to fly; it broke off."""

MANIFEST = "study.json"
KEPT = "what is written stays, and the same command continues from there"

_HEAD = {"case": ("int64", ""), "vehicle": ("string", ""), "drag_ratio": ("double", "1")}
_GAIT = {
    "gait": ("string", ""),
    "eta": ("double", "1"),
    "period": ("double", "s"),
    "roll": ("double", "rad"),
    "pitch": ("double", "rad"),
    "outcome": ("string", ""),
    "reason": ("string", ""),
    "valid": ("bool", ""),
    "flyable": ("bool", ""),
    "reachable_from_hover": ("bool", ""),
    "gait_singular_value": ("double", "1"),
    "gait_tilt_rate": ("double", "rad/s"),
}
_FLIGHT = {
    "duration": "s",
    "settling_time": "s",
    "peak_tilt": "rad",
    "peak_thrust": "N",
    "peak_thrust_share": "1",
    "least_singular_value": "1",
    "saturated_fraction": "1",
    "energy": "J",
    "final_roll": "rad",
    "final_pitch": "rad",
    "drift": "m",
    "tracking_error": "m",
}
_KEY = b"gaitgraph"
_LONGEST_REASON = 500
_SCRATCH = ".gaitgraph-*.part"
_BEYOND = 1 << 40  # a byte that no manifest has: Windows lets nobody read a locked one


def columns_of(study: Study) -> dict[str, tuple[str, str]]:
    """Return the Arrow type and the unit of each column of a study's rows.

    A constant that varies in any of the vehicles has its column, empty for the others.
    """
    varied = {}
    for name in dict.fromkeys(name for model in study.models for name in model.varied if name != "drag_ratio"):
        unit = "rad" if name == "first_arm_angle" else UNITS.get(name, "").replace("²", "^2").replace("³", "^3")
        for column in _columns_of_constant(name):
            varied[column] = ("string" if name == "first_rotor_spin" else "double", unit)
    return _HEAD | varied | _GAIT | {name: ("double", unit) for name, unit in _FLIGHT.items()}


def _columns_of_constant(name: str) -> tuple[str, ...]:
    return ("inertia_x", "inertia_y", "inertia_z") if name == "inertia" else (name,)


def versions() -> dict[str, str]:
    """Return the versions of what rows depend on; MissingExtra if the engine is not installed."""
    try:
        return {"gaitgraph": __version__, "mujoco": version("mujoco")}
    except PackageNotFoundError as error:
        raise needs_extra("mujoco", "a study", "study") from error


def flown_batch(text: str, numbers: Sequence[int], expected: Mapping[str, str]) -> list[Row]:
    """Return the rows of some cases; this is what every worker runs.

    Parameters
    ----------
    text
        The study, as :attr:`gaitgraph.study.design.Study.text`.
    numbers
        Of the cases.
    expected
        The versions that rows are to be made with; InputError if the versions here are others.
    """
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
        numbers = {name: number_of(values[name]) for name in _FLIGHT}
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
        columns = _columns_of_constant(name)
        row |= zip(columns, value if len(columns) > 1 else (value,), strict=True)
    return row | {
        "gait": case.source.name,
        "eta": case.eta,
        "period": case.period,
        "roll": case.roll,
        "pitch": case.pitch,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """The folder of a study, open for one process."""

    folder: Path
    study: Study
    versions: Mapping[str, str]

    def path(self, batch: int) -> Path:
        """Return the file of a batch."""
        return self.folder / "rows" / f"part-{batch:05d}.parquet"

    def write(self, batch: int, rows: Sequence[Row]) -> None:
        """Write the rows of a batch, whole or not at all; FileProblem if the file system refuses."""
        import pyarrow as pa
        import pyarrow.parquet

        about = {
            "format": "gaitgraph study rows",
            "versions": dict(self.versions),
            "study": self.study.name,
            "fingerprint": self.study.fingerprint,
        }
        fields = [
            pa.field(name, pa.type_for_alias(kind), nullable=name != "case", metadata={"unit": unit} if unit else None)
            for name, (kind, unit) in columns_of(self.study).items()
        ]
        schema = pa.schema(fields, metadata={_KEY: json.dumps(about, allow_nan=False)})
        stream = io.BytesIO()
        pa.parquet.write_table(pa.Table.from_pylist(rows, schema=schema), stream, write_page_checksum=True)
        self.put(self.path(batch), stream.getvalue(), force=False)

    def put(self, path: Path, content: bytes, *, force: bool) -> None:
        """Write a file; a full disk says how to continue."""
        try:
            write_whole([(path, content)], force=force)
        except FileProblem as error:
            raise type(error)(f"{error}; {KEPT}") from error

    def missing(self) -> list[int]:
        """Return the batches that are not there, in order; InputError or FileProblem if a part is broken or foreign."""
        import pyarrow as pa
        import pyarrow.parquet

        paths = {self.path(batch).name: batch for batch in range(self.study.batches)}
        missing = set(paths.values())
        for path in sorted((self.folder / "rows").iterdir()):
            if path.name.startswith("."):  # of a file manager; readers of datasets pass it over too
                continue
            if path.name not in paths:
                raise OutputExists(f"{str(path)!r} is not part of this study; move it out of the folder rows")
            cure = "delete it, and the same command flies its cases again"
            batch = paths[path.name]
            try:
                table = pa.parquet.read_table(path, page_checksum_verification=True, partitioning=None)
                about = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
                cases = table["case"].to_pylist()
            except (pa.ArrowException, KeyError, MemoryError, OSError, OverflowError, TypeError, ValueError) as error:
                raise InputError(f"{str(path)!r} is not a whole Parquet file ({shown(str(error))}): {cure}") from error
            if about.get("fingerprint") != self.study.fingerprint or cases != list(self.study.numbers(batch)):
                raise OutputExists(f"{str(path)!r} does not hold these cases of this study: {cure}")
            missing.discard(batch)
        return sorted(missing)

    def table(self) -> Any:
        """Return all rows, a pyarrow table in the order of the cases; FileProblem if a part is gone."""
        import pyarrow.dataset

        paths = [self.path(batch) for batch in range(self.study.batches)]
        try:
            return pyarrow.dataset.dataset(paths, format="parquet").to_table()
        except OSError as error:
            raise FileProblem(f"a part was removed while the study ran ({error}); {KEPT}") from error


@contextmanager
def opened_dataset(folder: Path, study: Study, here: Mapping[str, str]) -> Iterator[Dataset]:
    """Open the folder of a study for this process alone.

    Parameters
    ----------
    folder
        A folder that does not exist or is empty, or one of this very study.
    study, here
        The study, and the versions that its rows are made with.

    Raises
    ------
    OutputExists
        If the folder is something else, or of another study, or another process writes there.
    FileProblem
        If the file system refuses.
    """
    about: dict[str, Any] = {
        "format": "gaitgraph study",
        "versions": dict(here),
        "fingerprint": study.fingerprint,
        "cases": len(study),
        "batch": study.batch,
        "study": study.as_mapping(),
    }
    text = json.dumps(about, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    manifest, rows = folder / MANIFEST, folder / "rows"
    try:
        if manifest.exists():
            found = json.loads(text_of(manifest, "study", "a study's manifest"))
            found = found if isinstance(found, dict) else {}
            differing = [name for name, value in json.loads(text).items() if found.get(name) != value]
            if differing:
                raise OutputExists(
                    f"output must be a new folder or one of this study, got {str(folder)!r}, whose study.json has "
                    f"another {', '.join(differing)}"
                )
        else:
            if folder.exists() and any(not path.match(_SCRATCH) for path in folder.iterdir()):
                raise OutputExists(f"output must be a new folder or one of this study, got {str(folder)!r} with files")
            folder.mkdir(exist_ok=True)
            write_whole([(manifest, text.encode())], force=False)
        stream = manifest.open("r+b")
    except (OSError, ValueError) as error:  # a name with a null character is a ValueError
        if isinstance(error, GaitgraphError):
            raise
        raise FileProblem(f"output must be a new folder, got {shown(str(folder))}: {error}") from error
    with stream:
        try:  # the operating system drops the lock when the process ends
            if sys.platform == "win32":
                import msvcrt

                stream.seek(_BEYOND)
                msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError) as error:  # the latter on Windows
            raise OutputExists(f"another process writes to {str(folder)!r}; run one at a time") from error
        rows.mkdir(exist_ok=True)
        for scratch in [*folder.glob(_SCRATCH), *rows.glob(_SCRATCH)]:  # of a process that was killed while it wrote
            shutil.rmtree(scratch, ignore_errors=True)
        yield Dataset(folder=folder, study=study, versions=here)
