"""Gait tables: named columns, and what made them. :mod:`gaitgraph.io` reads and writes them as files.

A table has the columns ``t, alpha1, alpha2, alpha3, alpha4`` (s, rad), then ``color, types, R``, then
``alpha1_rate`` … (rad/s) and ``alpha1_acceleration`` … (rad/s²). A user's table needs only alpha1 to alpha4, or
alpha1, alpha2 and color, in any order, with or without t, closed or to be closed; degrees are taken from columns
named ``alpha1_deg`` and so on. Unknown columns are ignored.
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
from gaitgraph.errors import InputError, MissingExtra, shown
from gaitgraph.invertibility.matrices import Coefficients, Kind, coefficients_of
from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import ModuleType

FloatArray = npt.NDArray[np.float64]

ANGLES = ("alpha1", "alpha2", "alpha3", "alpha4")
RATES = tuple(f"{name}_rate" for name in ANGLES)
ACCELERATIONS = tuple(f"{name}_acceleration" for name in ANGLES)
DEGREES = {f"{name}_deg": name for name in ANGLES}
TEXTS = ("color", "types")
ORDER = ("t", *ANGLES, "color", "types", "R", *RATES, *ACCELERATIONS)

FORMAT = "gaitgraph gait table"
"""What the provenance in a file calls the file."""

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
        Half a unit of the last printed digit of its angles [rad]; 0 if that is not known.
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
        known = dict(_UNITS)
        servos = self.about.get("servos")
        if isinstance(servos, dict) and isinstance(servos.get("joint"), list):  # a servo table: its map states them
            known[str(servos.get("time", "t"))] = str(servos.get("time_unit", "s"))
            for joint in servos["joint"]:
                if isinstance(joint, dict):
                    unit = str(joint.get("unit", "rad"))
                    known |= {f"{joint.get('column')}{end}": unit + per for end, per in _DERIVED.items()}
        return {name: known.get(name, "") for name in self.columns}

    def rows(self, start: int, stop: int) -> Table:
        """Return some consecutive rows, counted from 0."""
        return replace(self, columns={name: values[start:stop] for name, values in self.columns.items()})

    def to_pandas(self) -> Any:
        """Return the table as a pandas frame: floats, and categories for texts; its `attrs` state what made it."""
        pandas = _library("pandas")
        texts = {name: pandas.Categorical(list(self.columns[name])) for name in TEXTS if name in self.columns}
        frame = pandas.DataFrame({**self.columns, **texts})
        frame.attrs["gaitgraph"] = provenance_of(self)
        return frame

    def to_polars(self) -> Any:
        """Return the table as a polars frame: floats, and categories for texts. What made it is not kept."""
        polars = _library("polars")
        texts = {
            name: polars.Series(list(self.columns[name]), dtype=polars.Categorical)
            for name in TEXTS
            if name in self.columns
        }
        return polars.DataFrame({**self.columns, **texts})


def _library(name: str) -> ModuleType:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtra(f"{name}: not installed, and to_{name} needs it: pip install {name}") from error


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


def setting_of(
    table: Table, vehicle: Vehicle | None = None, coefficients: Kind | None = None
) -> tuple[Vehicle, Coefficients, float]:
    """Return vehicle, coefficients and crossing tolerance: as given, else as the table states, else the defaults."""
    about = table.about
    if vehicle is None:
        stated = about.get("vehicle", PAPER.name)
        vehicle = vehicle_named(stated) if isinstance(stated, str) else vehicle_from_mapping(stated)
        coefficients = coefficients or about.get("coefficients")
    tolerance = about.get("crossing_tolerance", DEFAULT_CROSSING_TOLERANCE)
    if not 0 <= number_of(tolerance) < math.inf:
        raise InputError(f"crossing_tolerance must be a number ≥ 0 (rad), got {shown(tolerance)}")
    return vehicle, coefficients_of(vehicle, coefficients), float(tolerance)


def provenance_of(table: Table) -> dict[str, Any]:
    """Return what a file states about the making of its table, as plain values: format, version, and `about`."""
    return {"format": FORMAT, "version": __version__, "about": table.about}


def provenance_text(table: Table) -> str:
    """Return :func:`provenance_of` as one line of JSON, in ASCII, for formats that keep texts beside their columns."""
    return json.dumps(provenance_of(table), allow_nan=False)


def about_from_text(text: object, *, required: bool = False) -> dict[str, Any]:
    """Return the `about` of a text that :func:`provenance_text` wrote, or nothing if the text is from elsewhere.

    Raises InputError if the text names the format and is broken; with `required` also if it is from elsewhere.

    >>> about_from_text("measured on Monday")
    {}
    """
    if not isinstance(text, str) or (FORMAT not in text and not required):
        return {}
    try:
        content = json.loads(text)
    except (RecursionError, ValueError) as error:
        raise InputError("the provenance in the file is not JSON as gaitgraph writes it") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError("the provenance in the file was not written by gaitgraph")
    return checked_about(content.get("about"))


def checked_about(content: object) -> dict[str, Any]:
    """Return what made a table if it is plain values as JSON holds them, nested up to 100 levels; else InputError."""
    if not isinstance(content, dict):
        raise InputError(f"about must be an object, got {shown(content)}")
    level: list[Any] = [content]
    for _ in range(_DEEPEST):
        inner = [one for one in level if isinstance(one, (dict, list))]
        level = [value for one in inner for value in (one.values() if isinstance(one, dict) else one)]
    if level:
        raise InputError(f"about: it is nested too deeply, more than {_DEEPEST} levels")
    try:
        json.dumps(content, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"about must hold finite numbers and texts, got {shown(content)}") from error
    return content
