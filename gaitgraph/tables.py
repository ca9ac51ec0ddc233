"""Gait tables, and their files: CSV and JSON, written whole or not at all; :mod:`gaitgraph.reading` reads them.

A table has the columns ``t, alpha1, alpha2, alpha3, alpha4`` (s, rad), then ``color, types, R``, then
``alpha1_rate`` … (rad/s) and ``alpha1_acceleration`` … (rad/s²). Somebody else's table needs only alpha1 to
alpha4, or alpha1, alpha2 and color, in any order, with or without t, closed or to be closed; degrees are taken
from columns named ``alpha1_deg`` and so on. Unknown columns are passed over.
"""

from __future__ import annotations

import io
import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph import __version__
from gaitgraph.angles import number_of
from gaitgraph.errors import FileProblem, GaitgraphError, InputError, OutputExists, shown
from gaitgraph.files import target_of, write_whole
from gaitgraph.invertibility import Coefficients, Kind, coefficients_of
from gaitgraph.surface import DEFAULT_CROSSING_TOLERANCE
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from gaitgraph.timing import TimedGait

__all__ = ["Table", "check_outputs", "known_suffix", "setting_of", "table_of", "write_tables", "writer_for"]

FloatArray = npt.NDArray[np.float64]

FORMAT = "gaitgraph gait table"
ANGLES = ("alpha1", "alpha2", "alpha3", "alpha4")
RATES = tuple(f"{name}_rate" for name in ANGLES)
ACCELERATIONS = tuple(f"{name}_acceleration" for name in ANGLES)
DEGREES = {f"{name}_deg": name for name in ANGLES}
TEXTS = ("color", "types")
CLOSED_GAP = 1e-9
"""A last row this near to the first [rad] is the first again."""

ORDER = ("t", *ANGLES, "color", "types", "R", *RATES, *ACCELERATIONS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows of a gait: equally long columns by name, in the order of the module's docstring.

    Parameters
    ----------
    columns
        Arrays of floats (radians, seconds), and tuples of texts for `color` and `types`.
    about
        What made the table: vehicle, coefficients, period, law and so on; plain values.
    rounding
        What its angles may be off by because they are printed with few digits [rad]; 0 if that is not known.
    """

    columns: dict[str, Any]
    about: dict[str, Any] = field(default_factory=dict)
    rounding: float = 0.0

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]

    @property
    def alpha(self) -> FloatArray:
        """The four tilt angles of each row, shape (n, 4) [rad]."""
        return np.column_stack([self.columns[name] for name in ANGLES])


def setting_of(
    table: Table, vehicle: Vehicle | None = None, coefficients: Kind | None = None
) -> tuple[Vehicle, Coefficients, float]:
    """Return vehicle, coefficients and crossing tolerance: as asked for, else as the table says, else the defaults."""
    about = table.about
    if vehicle is None:
        stated = about.get("vehicle", PAPER.name)
        vehicle = vehicle_named(stated) if isinstance(stated, str) else vehicle_from_mapping(stated)
        coefficients = coefficients or about.get("coefficients")
    tolerance = about.get("crossing_tolerance", DEFAULT_CROSSING_TOLERANCE)
    if not 0 <= number_of(tolerance) < math.inf:
        raise InputError(f"crossing_tolerance: {shown(tolerance)}; allowed is a number ≥ 0 (rad)")
    return vehicle, coefficients_of(vehicle, coefficients), float(tolerance)


def table_of(timed: TimedGait, about: Mapping[str, Any] | None = None) -> Table:
    """Return the table of a timed gait, and what made it.

    >>> from gaitgraph.gait import lift
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=4))
    >>> len(table), list(table.columns)[:6]
    (5, ['t', 'alpha1', 'alpha2', 'alpha3', 'alpha4', 'color'])
    """
    gait = timed.gait
    made = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
        "crossing_tolerance": gait.crossing_tolerance,
        "period": timed.period,
        "law": timed.law,
        **(about or {}),
    }
    return Table(columns=timed.columns(), about=made)


def _plain(values: Any) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _csv_bytes(table: Table) -> bytes:
    import csv

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(zip(*(_plain(values) for values in table.columns.values()), strict=True))
    return text.getvalue().encode()


def _json_bytes(table: Table) -> bytes:
    head = {"format": FORMAT, "version": __version__, "about": table.about}
    lines = [f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in head.items()]
    columns = [
        f"    {json.dumps(name)}: {json.dumps(_plain(values), allow_nan=False)}"
        for name, values in table.columns.items()
    ]
    lines.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


_WRITERS: dict[str, Callable[[Table], bytes]] = {".csv": _csv_bytes, ".json": _json_bytes}


def known_suffix(path: str | Path, what: str) -> str:
    """Return the suffix of a gait table's file, or raise InputError if it is not known; `what` is for the message."""
    suffix = Path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(f"{what}: {str(path)!r}; allowed are the suffixes {', '.join(_WRITERS)}")
    return suffix


def writer_for(path: str | Path) -> Callable[[Table], bytes]:
    """Return what turns a table into the bytes of a file, by its suffix.

    Raises
    ------
    InputError
        If the suffix is not known.
    """
    return _WRITERS[known_suffix(path, "output")]


def check_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any work is done if an output has a wrong suffix, is named twice, exists or is a folder."""
    seen: set[Path] = set()
    for path in map(Path, paths):
        writer_for(path)
        try:
            resolved, folder = target_of(path), path.parent
            if resolved in seen:
                raise InputError(f"output: {str(path)!r} is named twice; allowed is once")
            seen.add(resolved)
            if path.is_dir():
                raise OutputExists(f"output: {str(path)!r} is a folder; allowed is a file")
            if resolved.exists() and not resolved.is_file():
                raise OutputExists(f"output: {str(path)!r} is no regular file; allowed is a file")
            if os.path.lexists(path) and not force:
                raise OutputExists(f"output: {str(path)!r} exists; allowed is a new file, or --force (force=True)")
            if not folder.is_dir():
                what = "is no folder" if folder.exists() else "does not exist"
                raise FileProblem(f"output: folder {str(folder)!r} {what}; allowed is an existing folder")
            path.exists()  # a name that the file system refuses is refused here
        except GaitgraphError:
            raise
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise FileProblem(f"output: cannot write {shown(str(path))}: {reason}") from error


def write_tables(table: Table, paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write a table to files, each whole or not at all; the format follows from the suffix.

    Parameters
    ----------
    table
        What to write.
    paths
        Files ending in .csv or .json.
    force
        Overwrite files that exist.

    Raises
    ------
    OutputExists
        If a file exists and `force` is not set; then none is written.
    FileProblem
        If a file cannot be written; the old one, if any, is whole.
    InputError
        If a suffix is not known or a file is named twice.
    """
    check_outputs(paths, force=force)
    write_whole([(Path(path), writer_for(path)(table)) for path in paths], force=force)
