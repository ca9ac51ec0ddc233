"""Gait tables: named columns, and what made them. :mod:`gaitgraph.io.formats` has their files.

A table has the columns ``t, alpha1, alpha2, alpha3, alpha4`` (s, rad), then ``color, types, R``, then
``alpha1_rate`` … (rad/s) and ``alpha1_acceleration`` … (rad/s²). Somebody else's table needs only alpha1 to
alpha4, or alpha1, alpha2 and color, in any order, with or without t, closed or to be closed; degrees are taken
from columns named ``alpha1_deg`` and so on. Unknown columns are passed over.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph import __version__
from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import Coefficients, Kind, coefficients_of
from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE
from gaitgraph.timing.timed_gait import LAWS
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from gaitgraph.timing.timed_gait import TimedGait

__all__ = [
    "Table",
    "about_of_provenance",
    "about_told",
    "is_deep",
    "merged",
    "pieces_of",
    "provenance_of",
    "provenance_text",
    "setting_of",
    "table_of",
]

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

ROWS_OF_A_PIECE = 1 << 16
"""Long tables are made, written and read in pieces of so many rows."""

_DEEPEST = 100
_UNITS = {"t": "s", "R": "1"} | dict.fromkeys(ANGLES, "rad")
_UNITS |= dict.fromkeys(RATES, "rad/s") | dict.fromkeys(ACCELERATIONS, "rad/s^2")
# Of what a flight adds to the angles, see gaitgraph.flight.record.
_UNITS |= dict.fromkeys(("x", "y", "z", "x_wanted", "y_wanted", "z_wanted"), "m")
_UNITS |= dict.fromkeys(("roll", "pitch", "yaw", "roll_wanted", "pitch_wanted"), "rad")
_UNITS |= dict.fromkeys(("x_rate", "y_rate", "z_rate"), "m/s") | dict.fromkeys(("saturated", "nearness"), "1")
_UNITS |= {f"body_rate_{axis}": "rad/s" for axis in "xyz"} | {f"thrust{k}": "N" for k in range(1, 5)}
# Of a basin, see gaitgraph.flight.basins.
_UNITS |= {"begin": "s", "seconds": "s"} | dict.fromkeys(("eta", "peak_share", "acceptable", "same_side"), "1")
_DERIVED = {"": "", "_rate": "/s", "_acceleration": "/s^2"}


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

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, in ASCII; "" for texts and where it is not known."""
        mapped = _units_of_servos(self.about.get("servos"))
        return {name: mapped.get(name) or _UNITS.get(name, "") for name in self.columns}

    def rows(self, start: int, stop: int) -> Table:
        """Return some consecutive rows, counted from 0."""
        return replace(self, columns={name: values[start:stop] for name, values in self.columns.items()})

    def to_pandas(self) -> Any:
        """Return the table as a pandas frame; what made it is in its `attrs`.

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        from gaitgraph.io.frames import pandas_from_table

        return pandas_from_table(self)

    def to_polars(self) -> Any:
        """Return the table as a polars frame, which tells nothing of what made it.

        Raises
        ------
        MissingExtra
            If polars is not installed.
        """
        from gaitgraph.io.frames import polars_from_table

        return polars_from_table(self)


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


def _units_of_servos(servos: Any) -> dict[str, str]:
    """Return the units of the columns of a servo table, which its map tells."""
    if not isinstance(servos, dict) or not isinstance(servos.get("joint"), list):
        return {}
    units = {str(servos.get("time", "t")): str(servos.get("time_unit", "s"))}
    for joint in servos["joint"]:
        if isinstance(joint, dict):
            unit = str(joint.get("unit", "rad"))
            units |= {f"{joint.get('column')}{end}": unit + per for end, per in _DERIVED.items()}
    return units


def table_of(timed: TimedGait, about: Mapping[str, Any] | None = None) -> Table:
    """Return the table of a timed gait, and what made it.

    >>> from gaitgraph.gait.gait import lift
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=4))
    >>> len(table), list(table.columns)[:6]
    (5, ['t', 'alpha1', 'alpha2', 'alpha3', 'alpha4', 'color'])
    """
    return merged(pieces_of(timed, about))


def pieces_of(
    timed: TimedGait, about: Mapping[str, Any] | None = None, *, rows: int = ROWS_OF_A_PIECE
) -> Iterator[Table]:
    """Yield the table of a timed gait as consecutive pieces, so that any length fits in memory.

    Parameters
    ----------
    timed, about
        The gait, and what else is told of its making.
    rows
        Of a piece, at least 2; the last one may have one more.
    """
    gait = timed.gait
    made = {
        "vehicle": gait.vehicle.as_mapping(),
        "coefficients": gait.coefficients.kind,
        "crossing_tolerance": gait.crossing_tolerance,
        "period": timed.period,
        "law": timed.law,
        **({} if timed.law in LAWS else {"made_by": "pace"}),
        **({"request": _as_timed(timed)} if gait.request else {}),
        **(about or {}),
    }
    end = timed.samples + 1
    # No piece is one row alone: numpy rounds the product of a single row in another way.
    for start in range(0, end - 1, rows):
        stop = end if end - (start + rows) <= 1 else start + rows
        yield Table(columns=timed.columns(range(start, stop)), about=made)


def _as_timed(timed: TimedGait) -> dict[str, Any]:
    """Return the request of a planned gait with the clock that it got, if a request can ask for that one."""
    request = dict(timed.gait.request)
    if timed.law in LAWS:
        request |= {"period": timed.period, "law": timed.law, "samples": timed.samples}
    return request


def merged(pieces: Iterable[Table]) -> Table:
    """Return consecutive pieces of a table as one."""
    pieces = list(pieces)
    if len(pieces) == 1:
        return pieces[0]
    columns: dict[str, Any] = {}
    for name in pieces[0].columns:
        parts = [piece[name] for piece in pieces]
        texts = not isinstance(parts[0], np.ndarray)
        columns[name] = tuple(text for part in parts for text in part) if texts else np.concatenate(parts)
    return Table(columns=columns, about=pieces[0].about, rounding=pieces[0].rounding)


def provenance_of(table: Table) -> dict[str, Any]:
    """Return what a file of the table says of its making: format, version, and `about`, as plain values.

    >>> provenance_of(Table(columns={}, about={"period": 1.0}))["about"]
    {'period': 1.0}
    """
    return {"format": FORMAT, "version": __version__, "about": table.about}


def provenance_text(table: Table) -> str:
    """Return :func:`provenance_of` as one line of JSON, in ASCII, for formats that keep texts beside their columns."""
    return json.dumps(provenance_of(table), allow_nan=False)


def about_of_provenance(text: str) -> dict[str, Any]:
    """Return the `about` of a text that :func:`provenance_text` wrote.

    Raises
    ------
    InputError
        If it is not such a text.
    """
    try:
        content = json.loads(text)
        json.dumps(content, allow_nan=False)
    except (RecursionError, ValueError) as error:
        raise InputError("what made the file is not told as JSON; allowed is what gaitgraph wrote") from error
    if is_deep(content):
        raise InputError("what made the file is nested too deeply; allowed is what gaitgraph wrote")
    about = content.get("about") if isinstance(content, dict) and content.get("format") == FORMAT else None
    if not isinstance(about, dict):
        raise InputError("what made the file is not told by gaitgraph; allowed is what gaitgraph wrote")
    return about


def about_told(text: object) -> dict[str, Any]:
    """Return the `about` of a text where formats keep it, or nothing if the text is somebody else's.

    >>> about_told("measured on Monday")
    {}
    """
    return about_of_provenance(text) if isinstance(text, str) and FORMAT in text else {}


def is_deep(content: Any) -> bool:
    """Return whether plain values are nested deeper than what is written again without trouble.

    >>> is_deep([[1], {"a": 2}])
    False
    """
    level, depth = [content], 0
    while level and depth <= _DEEPEST:
        inner = [one for one in level if isinstance(one, (dict, list))]
        level = [value for one in inner for value in (one.values() if isinstance(one, dict) else one)]
        depth += 1
    return depth > _DEEPEST
