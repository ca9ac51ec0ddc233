"""Gait tables: named columns and their provenance; lifted, closed to gaits, and completed with computed columns.

A table has the columns ``t, alpha1, alpha2, alpha3, alpha4`` (s, rad), then ``color, types, R``, then ``alpha1_rate`` …
(rad/s), ``alpha1_acceleration`` … (rad/s²) and ``thrust1`` … (N), see :func:`hover_thrust_columns`. A user's table
needs only alpha1 to alpha4, or alpha1, alpha2 and color, in any order, with or without t, closed or to be closed.
:mod:`gaitgraph.io` reads and writes tables as files.

A last row that comes back to the first, as :func:`is_closed` says, closes a table, and its time ends the period.
Any other table is closed by a straight segment back to the first row, which takes one mean step of time.
"""

from __future__ import annotations

import json
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph import __version__, later
from gaitgraph.angles import angles_from, checked_number, number_of
from gaitgraph.arrays import check_unmasked, freeze_arrays, read_only
from gaitgraph.errors import FileWarning, InputError, check_kind, shown, wrong
from gaitgraph.gait.digits import Digits
from gaitgraph.gait.gait import points_on_sheets
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    level_determinant,
    level_determinant_resolution,
)
from gaitgraph.pictured import Pictured, pandas
from gaitgraph.surface.sheets import (
    color_codes,
    color_of,
    colors_along,
    text_from_types,
    types_at,
    types_contradict,
    types_from_text,
)
from gaitgraph.tolerances import (
    DEFAULT_CROSSING_TOLERANCE,
    DEFAULT_TOLERANCE,
    SAME_ANGLE,
)
from gaitgraph.vehicle import (
    PAPER,
    Each,
    Vehicle,
    VehicleLike,
    vehicle_in_gait_file,
    vehicle_named,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import IntArray

ANGLES = ("alpha1", "alpha2", "alpha3", "alpha4")
RATES = tuple(f"{name}_rate" for name in ANGLES)
ACCELERATIONS = tuple(f"{name}_acceleration" for name in ANGLES)
THRUSTS = tuple(f"thrust{k}" for k in range(1, 5))
"""The columns of hover thrust."""

RATE_UNITS = {"rate": "rad/s", "acceleration": "rad/s²", "jerk": "rad/s³"}
"""The derivatives of tilt angles that a vehicle may limit, and their units."""

RATE_CHECKS = tuple(f"tilt_{kind}" for kind in RATE_UNITS)
"""Names of the checks that need timing."""

TEXTS = ("color", "types")
ORDER = ("t", *ANGLES, "color", "types", "R", *RATES, *ACCELERATIONS, *THRUSTS)

FORMAT = "gaitgraph gait table"
"""The value of `format` in the provenance of a file."""


_SAME_PERIOD = 2e-3  # share by which a stated period may differ from the rounded one
_ULPS = 2e-15  # of times computed again, as a share of the latest one
_OF_GAITS = ("corners", "rounding", "law", "request")  # statements of a closed gait
_IN_UNITS = {
    "s": ("t", "begin", "seconds"),
    "rad": (*ANGLES, "roll", "pitch", "yaw", "roll_wanted", "pitch_wanted"),
    "rad/s": (*RATES, "body_rate_x", "body_rate_y", "body_rate_z"),
    "rad/s^2": ACCELERATIONS,
    "N": THRUSTS,
    "m": ("x", "y", "z", "x_wanted", "y_wanted", "z_wanted"),
    "m/s": ("x_rate", "y_rate", "z_rate"),
    "1": ("R", "saturated", "nearness", "eta", "peak_share", "acceptable", "same_side"),
}
"""The columns of gait tables, flights and basins, by their units."""
_UNITS = {name: unit for unit, names in _IN_UNITS.items() for name in names}
_DERIVED = {"": "", "_rate": "/s", "_acceleration": "/s^2"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table(Pictured):
    """Rows of a gait: equally long columns by name, in the order of the module's docstring.

    Parameters
    ----------
    columns
        Arrays of floats (radians, seconds), and tuples of texts for `color` and `types`.
    about
        What made the table: vehicle, coefficients, period, law and so on; plain values.
    digits
        The digits that its numbers were printed with, by column; full precision where there are none.
    notes
        Warnings about parts of its file or frame that are not used.
    """

    columns: dict[str, Any]
    about: dict[str, Any] = field(default_factory=dict)
    digits: dict[str, Digits] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    _motion: later.TimedGait | None = field(default=None, init=False, repr=False)

    @property
    def motion(self) -> later.TimedGait | None:
        """The timed gait whose samples the rows are, or None: see :func:`gaitgraph.timing.statement.checked`."""
        return self._motion

    def with_motion(self, motion: later.TimedGait) -> Table:
        """Return the table of samples of a motion; other rows or another provenance make a table without it."""
        table = replace(self)
        object.__setattr__(table, "_motion", motion)  # the record is frozen
        return table

    @property
    def joined_by_cubics(self) -> bool:
        """Whether rows are joined by cubics through their rates.

        They have rates, and accelerations other than zero or none at all.

        >>> columns = dict.fromkeys(("t", *ANGLES, *RATES), np.array([0.0, 1.0]))
        >>> Table(columns=columns).joined_by_cubics
        True
        """
        if len(self) < 2 or not all(name in self for name in ("t", *RATES)):
            return False
        if not all(name in self for name in ACCELERATIONS):
            return True
        return any(bool(self[name].any()) for name in ACCELERATIONS)

    def half_units(self, name: str) -> FloatArray:
        """Return half a unit of the last printed digit of each number of a column, in the column's unit.

        Of an angle that is lifted it is that of the angle from which it follows.
        """
        if name not in self and name in ANGLES:
            name = ANGLES[ANGLES.index(name) - 2]
        values: FloatArray = self.columns[name]
        return self.digits.get(name, Digits()).half_units(values)

    def __post_init__(self) -> None:
        check_kind("columns", self.columns, dict)
        check_kind("about", self.about, dict)
        for name, values in self.columns.items():
            if isinstance(values, np.ndarray):
                check_unmasked(values, name)
        repeats = self.about.get("repeats", True)
        if not isinstance(repeats, (bool, np.bool_)):
            raise wrong("repeats", "must be true or false", repeats)
        freeze_arrays(self)

    def __repr__(self) -> str:
        """Return one line without the numbers: rows, columns and what made the table."""
        return f"<Table: {', '.join(self._parts)}>"

    def __str__(self) -> str:
        lines = [f"Table: {', '.join(self._parts)}"]
        names = fill(", ".join(self.columns), 110, subsequent_indent="    ")
        lines.append(f"  columns: {names}")
        lines += [f"warning: {note}" for note in self.notes]
        return "\n".join(lines)

    @property
    def _parts(self) -> list[str]:
        about = self.about
        parts = [f"{len(self)} rows", f"{len(self.columns)} columns"]
        if isinstance(about.get("period"), float | int):
            parts.append(f"T = {about['period']:g} s")
        if isinstance(about.get("law"), str):
            parts.append(about["law"])
        name = about.get("vehicle")
        if isinstance(name, dict):
            name = name.get("name")
        if isinstance(name, str):
            parts.append(f"vehicle {shown(name)}")
        return parts

    @property
    def repeats(self) -> bool:
        """Whether the motion repeats after its last row; False for a path, run once from its first row to its last.

        ``about["repeats"]`` states it, in every format too.
        """
        return bool(self.about.get("repeats", True))

    @property
    def returns(self) -> bool:
        """Whether the motion repeats, and the last row is the first again, see :func:`is_closed`."""
        angles = [self[name] for name in ANGLES if name in self]
        return self.repeats and is_closed(np.array(angles).T)

    @property
    def limits(self) -> dict[str, Each]:
        """The limits that the table was made for: rate, acceleration, jerk [rad/s, …], four values of each; else none."""
        stated = self.about.get("limits", {})
        if not isinstance(stated, dict):
            raise wrong("limits", "must be an object of numbers", stated)
        limits: dict[str, Each] = {}
        for kind in RATE_UNITS.keys() & stated.keys():
            values = stated[kind]
            each = tuple(values) if isinstance(values, list) else (values,) * 4
            if len(each) != 4 or not min(map(number_of, each)) >= 0:
                raise wrong(
                    f"limits of {kind}",
                    "must be one or four numbers ≥ 0",
                    values,
                    field="limits",
                )
            limits[kind] = each
        return limits

    @property
    def rounding(self) -> float:
        """The largest error of its angles by the rounding of the servo table that they were read from [rad]; else 0.

        What the file states counts up to half a step of the positions in it.
        """
        stated = number_of(self.about.get("angle_rounding"))
        if not stated > 0:
            return 0.0
        half_step = 0.0
        for name in ANGLES:
            if name in self and self.digits.get(name, Digits()).steps:
                half_step = float(self.half_units(name).max(initial=half_step))
        return min(stated, half_step)

    def once(self) -> Table:
        """Return the table as a path that is run once, from its first row to its last.

        The rows and rates of a gait stay; what they were made from is a closed gait, and is left out.

        >>> Table(columns={"alpha1": [0.1, 0.2]}).once().repeats
        False
        """
        if not self.repeats:
            return self
        return replace(self, about=_without_gait(self.about) | {"repeats": False})

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]

    @property
    def alpha(self) -> FloatArray:
        """The four tilt angles of each row, shape (n, 4) [rad]."""
        return read_only(_side_by_side(self.columns, ANGLES))

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, in ASCII; "" for texts and unknown columns."""
        known = dict(_UNITS)
        servos = self.about.get("servos")
        if isinstance(servos, dict) and isinstance(servos.get("joint"), list):
            # A servo table: its map states them.
            known[str(servos.get("time", "t"))] = str(servos.get("time_unit", "s"))
            for joint in servos["joint"]:
                if isinstance(joint, dict):
                    unit = str(joint.get("unit", "rad"))
                    known[f"{joint.get('name')}_thrust"] = "N"
                    for end, per in _DERIVED.items():
                        known[f"{joint.get('column')}{end}"] = unit + per
        return {name: known.get(name, "") for name in self.columns}

    def to_pandas(self) -> Any:
        """Return the table as a pandas frame: floats, and categories for texts; its `attrs` state what made it."""
        pd = pandas()
        columns = dict(self.columns)
        for name in TEXTS:
            if name in self:
                columns[name] = pd.Series(list(self[name]), dtype="category")
        frame = pd.DataFrame(columns)
        frame.attrs["gaitgraph"] = provenance_of(self)
        return frame


def _without_gait(about: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a table states, but for what only one period of a closed gait is made from."""
    return {key: value for key, value in about.items() if key not in _OF_GAITS}


def _side_by_side(columns: Mapping[str, Any], names: Sequence[str]) -> FloatArray:
    return np.column_stack([columns[name] for name in names])


def surface_of(
    table: Table,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> tuple[Vehicle, Coefficients, float]:
    """Return vehicle, coefficients and crossing tolerance: as given, else as the table states, else the defaults."""
    about = table.about
    if vehicle is None:
        vehicle = vehicle_in_gait_file(about.get("vehicle", PAPER.name))
        if coefficients is None:
            coefficients = about.get("coefficients")
    vehicle = vehicle_named(vehicle)
    stated = about.get("crossing_tolerance", DEFAULT_CROSSING_TOLERANCE)
    tolerance = checked_number("crossing_tolerance", stated, "a number ≥ 0 (rad)")
    return vehicle, coefficients_of(vehicle, coefficients), tolerance


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
    except (RecursionError, ValueError):
        content = None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise wrong("made_by", "must be the JSON that gaitgraph writes", text)
    return checked_about(content.get("about"))


def checked_about(content: object) -> dict[str, Any]:
    """Return the provenance of a table; InputError unless it is plain JSON values."""
    if not isinstance(content, dict):
        raise wrong("about", "must be an object", content)
    try:
        json.dumps(content, allow_nan=False)
    except (RecursionError, TypeError, ValueError) as error:
        raise wrong("about", "must hold finite numbers and texts", content) from error
    return content


# -- From rows to a closed gait


def tilt_angles(table: Table, coefficients: Coefficients | None = None) -> FloatArray:
    """Return the four tilt angles of each row, shape (n, 4) [rad]; rows of alpha1, alpha2 and color are lifted.

    By default with the coefficients that the table states. Raises InputError if a row to lift is outside [−π/2, π/2]².
    """
    if "alpha3" in table:
        return table.alpha
    if coefficients is None:
        _, coefficients, _ = surface_of(table)
    return points_on_sheets(
        table["alpha1"], table["alpha2"], table["color"], coefficients
    )


def lifted_rows(
    table: Table, coefficients: Coefficients, tolerance: float = DEFAULT_TOLERANCE
) -> tuple[FloatArray, npt.NDArray[np.int8]]:
    """Return the tilt angles [rad] and the color of each row, as stated or by its place; 0 for none."""
    alpha = angles_from(tilt_angles(table, coefficients), "alpha")
    if "color" in table:
        return alpha, color_codes(table["color"])
    return alpha, colors_along(alpha, coefficients, tolerance)


def check_repeats(motion: object, name: str = "gait") -> None:
    """Raise InputError if a table or a timed motion is a path that is run once."""
    if not getattr(motion, "repeats", True):
        raise InputError(
            f"{name} must repeat, got a path that is run once, from its first row to its last",
            field=name,
        )


def even_times(table: Table) -> FloatArray:
    """Return the times of a table [s]; if they are evenly spaced times, rounded to their digits, then these, not rounded.

    They are even over the period that the table states, if it states as many samples and its last row is not more than
    0.2 % of it away, else from its first row to its last.

    >>> rounded = {"t": np.array([0.0, 0.333, 0.667, 1.0])}
    >>> even_times(Table(columns=rounded, digits={"t": Digits(decimals=3)})).tolist()[1] == 1 / 3
    True
    """
    t: FloatArray = table["t"]
    seconds = t[-1] - t[0]
    if table.about.get("samples") == len(t) - 1:
        period = table.about.get("period", seconds)
        if abs(period - seconds) <= _SAME_PERIOD * seconds:
            seconds = period
    step = seconds / max(len(t) - 1, 1)
    if not wrong_times(table, step).any():
        t = t[0] + np.arange(len(t)) * step
    return t


def wrong_times(table: Table, step: float) -> npt.NDArray[np.bool_]:
    """Return which times of a table are not a whole number of even steps [s] after the first, rounded to their digits."""
    t = table["t"]
    half_units = table.half_units("t")
    late = t - t[0] - np.arange(len(t)) * step
    allowed = half_units + _ULPS * np.abs(t).max()
    if t[0] != 0 and np.ptp(late) < 1.999 * half_units.max():  # it is rounded too
        allowed += half_units[0]
    return np.asarray(np.abs(late) > allowed)


def is_closed(alpha: FloatArray) -> bool:
    """Return whether the last of two or more rows of angles is the first again, to its digits; these two suffice.

    Every reader of tables uses this rule. A last row that is merely near the first is a point of its own.

    >>> is_closed(np.array([[0.4], [0.5], [0.4]])), is_closed(np.array([[0.4], [0.5], [0.401]]))
    (True, False)
    """
    return len(alpha) > 1 and bool(np.abs(alpha[0] - alpha[-1]).max() <= SAME_ANGLE)


def check_periods(table: Table, periods: int) -> None:
    """Raise InputError for several periods of a table that does not end where it starts, or is a path."""
    if periods > 1 and not table.returns:
        raise wrong(
            "periods",
            "must be 1 for a table that is run once, or does not end where it starts",
            periods,
        )


def repeated(table: Table, periods: int) -> Table:
    """Return some periods of a closed table with times, one after the other; the row between two is there once.

    Corners, law and request of one period are not stated for several. Raises InputError as :func:`check_periods`.

    >>> columns = {"t": np.array([0.0, 1.0, 2.0]), "alpha1": np.array([0.4, 0.9, 0.4])}
    >>> repeated(Table(columns=columns), 2)["t"].tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0]
    """
    check_periods(table, periods)
    t = table["t"]
    count = len(t) - 1
    rows = np.append(0, np.tile(np.arange(1, len(t)), periods))
    columns = _chosen_rows(table.columns, rows)
    columns["t"][1:] += np.repeat(np.arange(periods), count) * (t[-1] - t[0])
    about = _without_gait(table.about)
    for name in ("period", "samples"):
        if name in about:
            about[name] *= periods
    return replace(table, columns=columns, about=about)


def note_on_ends(alpha: FloatArray) -> str:
    """Return the warning for rows of angles that nearly close, else an empty text; the first and last two suffice.

    A measured period ends within its noise of the first row, which is far less than the step before. An open table ends
    one step earlier. If it comes to rest there, that step is shorter than the one before: 7 times if the distance to
    the end goes with τ³, up to 15 times with rounded angles, 15 times with τ⁴.
    """
    if len(alpha) < 2 or is_closed(alpha):
        return ""
    gap, step = np.abs(alpha[[0, -2]] - alpha[-1]).max(axis=1).tolist()
    if gap > DEFAULT_TOLERANCE or gap >= step / 16:
        return ""
    return (
        f"the last row is {gap:.2g} rad from the first, and counts as a point of its own; if it is the end of a measured "
        "period, give it the angles of the first"
    )


def warn_of_ends(table: Table, name: object = None) -> None:
    """Give the warning of :func:`note_on_ends` for a table that repeats, which names its file, `name`, if that is one."""
    angles = [table[angle] for angle in ANGLES if angle in table]
    note = note_on_ends(np.array(angles).T)
    if note and table.repeats:
        if isinstance(name, (str, Path)):
            note = f"gait file {str(name)!r}: {note}"
        warnings.warn(note, FileWarning, stacklevel=3)


def closing_time(start: float, end: float, rows: int) -> float:
    """Return the time at which an open table is back at its first row: one mean step after the last row [s]."""
    return end + (end - start) / max(rows - 1, 1)


def wrong_types(table: Table, codes: npt.NDArray[np.int8]) -> npt.NDArray[np.bool_]:
    """Return which rows state plane types that contradict their colors."""
    texts, number = np.unique(table["types"], return_inverse=True)
    types = np.array(list(map(types_from_text, texts.tolist())))
    return types_contradict(types[number], codes)


def colors_of(alpha: FloatArray, coefficients: Coefficients) -> tuple[str, ...]:
    """Return the color of the sheet that each point lies on, to within 2e-3 rad; none if one lies on none.

    >>> colors_of(np.array([[0.4, -0.4, 0.4, -0.4], [0.4, -0.4, 0.8, -0.4]]), coefficients_of(PAPER))
    ()
    """
    codes = colors_along(alpha, coefficients, DEFAULT_TOLERANCE)
    if not codes.all():
        return ()
    return tuple(map(color_of, codes.tolist()))


def accelerations_of(table: Table) -> FloatArray:
    """Return the accelerations of rows with rates, shape (n, 4) [rad/s²]: those stated, else slopes of the rates.

    At a row a slope is from the row before to the row after it, so that none is larger than that of every smooth motion
    with these rates; at the ends of an open table it is over one step. Times that are even to their digits count as even.
    """
    if all(name in table for name in ACCELERATIONS):
        return _side_by_side(table.columns, ACCELERATIONS)
    rates = _side_by_side(table.columns, RATES)
    change = np.diff(rates, axis=0)
    step = np.diff(even_times(table))[:, None]
    mode: Any = "wrap" if table.returns else "edge"
    changes = np.pad(change, [(1, 1), (0, 0)], mode)
    steps = np.pad(step, [(1, 1), (0, 0)], mode)
    return np.asarray((changes[:-1] + changes[1:]) / (steps[:-1] + steps[1:]))


def completed_table(
    table: Table,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
) -> Table:
    """Return a table of two rows or more completed: from t = 0, closed unless it is a path, with all columns.

    A stated column stays if all of its rows agree with the angles: R to within its digits, types with the color.
    Otherwise, or for another vehicle, it is computed. Rows without rates are joined by straight segments: their rates are
    those just after each row and their accelerations are zero. Rows with rates alone are joined by cubics and get no
    accelerations. `t` must be there.
    """
    body, numbers, crossing_tolerance = surface_of(table, vehicle, coefficients)
    is_own = vehicle is None and coefficients is None
    about = table.about | {"vehicle": body.as_mapping(), "coefficients": numbers.kind}
    if not is_own or not isinstance(about.get("request"), dict):
        about.pop("request", None)  # the request was for something else
    alpha, codes = lifted_rows(table, numbers)
    columns = table.columns | dict(zip(ANGLES, alpha.T, strict=True))
    columns["t"] = table["t"] - table["t"][0]
    R = np.asarray(level_determinant(alpha, numbers))
    allowed = 2 * level_determinant_resolution(alpha, numbers)
    if "R" not in table or (np.abs(table["R"] - R) > allowed).any():
        columns["R"] = R
    if not codes.all():
        columns.pop("types", None)
    else:
        columns["color"] = tuple(map(color_of, codes.tolist()))
        if "types" not in table or wrong_types(table, codes).any():
            third, fourth = types_at(alpha, codes, numbers, crossing_tolerance)
            columns["types"] = tuple(map(text_from_types, third, fourth))
    if table.repeats:
        columns = _closed(columns, is_closed(alpha))
    if not all(name in table for name in RATES):
        columns |= _slopes(columns, table.repeats)
    for name in THRUSTS:
        columns.pop(name, None)
    columns |= hover_thrust_columns(_side_by_side(columns, ANGLES), body)
    columns = {name: columns[name] for name in ORDER if name in columns}
    completed = Table(columns=columns, about=about)
    if table.motion is None or not is_own:
        return completed
    return completed.with_motion(table.motion)


def hover_thrust_columns(alpha: FloatArray, vehicle: Vehicle) -> dict[str, FloatArray]:
    """Return the thrust of each rotor in level hover at tilt angles of shape (n, 4), by column [N].

    There are none if the vehicle states no mass, or if a thrust is not positive in one of the rows: rotors only push.
    Off the gait surfaces a horizontal force remains, which is not included.
    """
    if vehicle.mass is None:
        return {}
    thrusts = vehicle.mass * vehicle.gravity * hover_thrust_shares(alpha, vehicle)
    if not (np.isfinite(thrusts) & (thrusts > 0.0)).all():
        return {}
    return dict(zip(THRUSTS, thrusts.T, strict=True))


def _chosen_rows(columns: Mapping[str, Any], rows: IntArray) -> dict[str, Any]:
    """Return some rows of columns, by their numbers from 0."""
    chosen: dict[str, Any] = {}
    for name, values in columns.items():
        if isinstance(values, np.ndarray):
            chosen[name] = values[rows]
        else:
            chosen[name] = tuple(values[row] for row in rows.tolist())
    return chosen


def _closed(columns: dict[str, Any], returned: bool) -> dict[str, Any]:
    """Return columns with the first row at the end, in place of a last row that repeats it."""
    t = columns["t"]
    rows = np.append(np.arange(len(t) - returned), 0)
    closed = _chosen_rows(columns, rows)
    closed["t"][-1] = t[-1] if returned else closing_time(0.0, t[-1], len(t))
    return closed


def _slopes(columns: dict[str, Any], repeats: bool) -> dict[str, FloatArray]:
    """Return the rates just after each row, and accelerations of zero, of rows that are joined by straight segments."""
    step = np.diff(columns["t"])[:, None]
    slopes = np.diff(_side_by_side(columns, ANGLES), axis=0) / step + 0.0
    last = slopes[:1] if repeats else slopes[-1:]
    rates = np.concatenate([slopes, last]).T
    made = dict(zip(RATES, rates, strict=True))
    made |= zip(ACCELERATIONS, np.zeros(rates.shape), strict=True)
    return made
