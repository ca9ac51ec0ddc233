"""The record of a flight: its rows, its outcome, and what follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.gait.table import Table
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.io.formats import write_tables
from gaitgraph.timing.timed_gait import LAWS

if TYPE_CHECKING:
    from gaitgraph.flight.course import Course
    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

COLUMNS = (
    "t",
    *("x", "y", "z"),
    *("roll", "pitch", "yaw"),
    *("x_rate", "y_rate", "z_rate"),
    *("body_rate_x", "body_rate_y", "body_rate_z"),
    *("alpha1", "alpha2", "alpha3", "alpha4"),
    *("thrust1", "thrust2", "thrust3", "thrust4"),
    "saturated",
    "nearness",
    *("x_wanted", "y_wanted", "z_wanted"),
    *("roll_wanted", "pitch_wanted"),
)
"""What a row of a flight holds, in order; SI units and radians.

Positions, angles and rates are true ones; `nearness` is judged by the controller from its noisy measurements: a number
between half the least singular value of the scaled decoupling matrix and all of it.
"""

TABLES = (".csv", ".json", ".npz", ".mat", ".parquet")
"""Suffixes of the tables that flights are written to."""

Outcome = Literal["settled", "not settled", "near singular", "sign change", "tumbling", "upended", "refused"]

OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
"""How a flight may end.

"sign change" is that of the determinant; "tumbling" is any motion too fast or too far to be flight.
"""

_AT = {name: k for k, name in enumerate(COLUMNS)}
_HELD_AT_LEAST = 0.2  # s within tolerance before the end, or a tenth of the flight if that is less


@dataclass(frozen=True, slots=True)
class Flight:
    """One flight, and whether it settled. Truthy when it did.

    `attitude` is roll and pitch at the start [rad]. `rows` has one row a control step, columns as in :data:`COLUMNS`,
    none if the flight was refused; quantities of the rows are then None. `outcome` is one of :data:`OUTCOMES`; `reason`
    states why it did not settle, "" if it did. Errors stayed within tolerance since `settling_time` [s], None if it did
    not settle. `warnings` are what physics does not forbid, such as rows off the surfaces.
    """

    course: Course
    settings: FlightSettings
    attitude: tuple[float, float]
    rows: FloatArray = field(repr=False)
    outcome: Outcome
    reason: str
    settling_time: float | None
    warnings: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self.settled

    @property
    def settled(self) -> bool:
        """Whether the errors came within tolerance and stayed there to the end."""
        return self.outcome == "settled"

    @property
    def refused(self) -> bool:
        """Whether it was refused before take-off."""
        return self.outcome == "refused"

    @property
    def failed(self) -> bool:
        """Whether it ended early because it could not go on."""
        return self.outcome not in ("settled", "not settled", "refused")

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self.course.vehicle

    def column(self, name: str) -> FloatArray:
        """Return one of :data:`COLUMNS`, shape (n,)."""
        return self.rows[:, _AT[name]]

    @property
    def alpha(self) -> FloatArray:
        """The tilt angles, shape (n, 4) [rad]."""
        return self.rows[:, _AT["alpha1"] : _AT["alpha4"] + 1]

    @property
    def thrusts(self) -> FloatArray:
        """The thrusts along the tilted axes, shape (n, 4) [N]."""
        return self.rows[:, _AT["thrust1"] : _AT["thrust4"] + 1]

    @property
    def flown(self) -> float:
        """How long was flown [s]."""
        return float(self.rows[-1, 0]) if len(self.rows) else 0.0

    @property
    def least_singular_value(self) -> float | None:
        """The least singular value at the control steps, dimensionless."""
        roll, pitch = self.column("roll"), self.column("pitch")
        return float(least_singular_value(self.alpha, self.vehicle, roll, pitch).min()) if len(self.rows) else None

    @property
    def peak_tilt(self) -> float | None:
        """Largest angle between body z and the vertical [rad]."""
        upright = np.cos(self.column("roll")) * np.cos(self.column("pitch"))
        return float(np.arccos(np.clip(upright.min(), -1.0, 1.0))) if len(self.rows) else None

    @property
    def peak_thrust(self) -> float | None:
        """Largest thrust of a rotor [N]."""
        return float(np.abs(self.thrusts).max()) if len(self.rows) else None

    @property
    def peak_thrust_share(self) -> float | None:
        """Largest thrust of a rotor over a quarter of the weight."""
        (mass,) = self.vehicle.require("mass", purpose="a share of the weight")
        return None if self.peak_thrust is None else 4.0 * self.peak_thrust / (mass * self.vehicle.gravity)

    @property
    def saturated_fraction(self) -> float | None:
        """Part of the control steps at which a thrust was cut to its limits."""
        return float(self.column("saturated").mean()) if len(self.rows) else None

    @property
    def energy(self) -> float | None:
        """Work of the rotors against their drag [J]; None if the vehicle states no thrust coefficient."""
        coefficient, drag = self.vehicle.thrust_coefficient, self.vehicle.drag_to_thrust
        if coefficient is None or drag is None or len(self.rows) < 2:
            return None
        thrusts = np.abs(self.thrusts)
        power = np.sum(drag * thrusts * np.sqrt(thrusts / coefficient), axis=1)
        return float(np.sum(power[:-1] * np.diff(self.column("t"))))

    @property
    def drift(self) -> float | None:
        """Distance of the end from the start in the plane [m]."""
        return float(np.hypot(*self.rows[-1, 1:3])) if len(self.rows) else None

    @property
    def tracking_error(self) -> float | None:
        """Largest distance from the reference [m]; None where x and y are not held."""
        if not len(self.rows) or self.settings.reference == "attitude":
            return None
        at, to = (self.rows[:, _AT[name] : _AT[name] + 3] for name in ("x", "x_wanted"))
        return float(np.linalg.norm(at - to, axis=1).max())

    def as_mapping(self) -> dict[str, Any]:
        """Return the outcome and the numbers of the flight as plain values, ready for JSON; angles in radians."""
        roll, pitch = self.rows[-1, 4:6].tolist() if len(self.rows) else (None, None)
        numbers = (
            "settling_time", "peak_tilt", "peak_thrust", "peak_thrust_share", "least_singular_value",
            "saturated_fraction", "energy",
        )  # fmt: skip
        return {
            **{name: getattr(self, name) for name in ("settled", "reason", "refused", "outcome")},
            "warnings": list(self.warnings),
            "duration": self.flown,
            **{name: getattr(self, name) for name in numbers},
            "final_roll": roll,
            "final_pitch": pitch,
            "drift": self.drift,
            "tracking_error": self.tracking_error,
            "attitude": list(self.attitude),
        }

    def table(self) -> Table:
        """Return the flight as a table, one row a control step."""
        timed = self.course.timed
        about = about_table("fly", timed, self.settings)
        about["flight"]["attitude"] = list(self.attitude)
        if timed.gait.request:  # so that the gait can be planned again from the flight's file
            timing = {"period": timed.period, "law": timed.law} if timed.law in LAWS else {}
            about["request"] = {**timed.gait.request, **timing}
        return Table(columns={name: self.rows[:, k] for name, k in _AT.items()}, about=about)

    def write(self, *paths: str | Path, force: bool = False) -> None:
        """Write the table of the flight to files (:data:`TABLES`), each whole or not at all; no plots and films."""
        for path in paths:
            if Path(path).suffix.lower() not in TABLES:
                raise InputError(f"output must be a table of a flight ({', '.join(TABLES)}), got {str(path)!r}")
        if not len(self.rows):
            raise InputError("nothing was flown, so there is no table to write")
        write_tables(self.table(), paths, force=force)

    def __repr__(self) -> str:
        return f"<Flight: {self.flown:g} s, {self.reason or f'settled after {self.settling_time:.2f} s'}>"

    def __str__(self) -> str:
        roll, pitch = (f"{math.degrees(angle):.3g}°" for angle in self.attitude)
        head = f"Flight of {self.vehicle.name} from roll {roll}, pitch {pitch}"
        if self.refused:
            return f"{head}: {self.reason}"
        verdict = f"{'stopped' if self.failed else 'not settled'}: {self.reason}"
        if self.settled:
            verdict = f"settled after {self.settling_time:.2f} s of {self.flown:g} s"
        lines = [f"{head}: {verdict}"]
        if self.peak_tilt is not None:
            share = f"{self.peak_thrust_share:.3g} times a quarter of the weight"
            lines += [
                f"  peak tilt             {math.degrees(self.peak_tilt):.3g}°",
                f"  peak thrust           {self.peak_thrust:.4g} N, {share}",
                f"  least singular value  {self.least_singular_value:.3g} (stops below {self.settings.floor:g})",
                f"  saturated             {100 * (self.saturated_fraction or 0):.3g} % of the time",
            ]
            if self.energy is not None:
                lines.append(f"  energy                {self.energy:.4g} J into the air")
            off = "" if self.tracking_error is None else f", at most {self.tracking_error:.3g} m from the reference"
            lines.append(f"  place                 ends {self.drift:.3g} m from the start{off}")
        return "\n".join(lines)


def record_of(
    course: Course,
    settings: FlightSettings,
    attitude: tuple[float, float],
    *,
    rows: FloatArray | None = None,
    failure: tuple[Any, ...] = (),
    warnings: tuple[str, ...] = (),
) -> Flight:
    """Return the record of a flight: its rows, none if it was refused, and outcome and reason of a `failure`."""
    rows = np.empty((0, len(COLUMNS))) if rows is None else rows
    since, worst = settled_since(rows, settings)
    if failure:
        (outcome, reason), since = failure, None
    elif since is None:
        outcome, reason = "not settled", f"it did not settle within {rows[-1, 0]:g} s: {worst}"
    else:
        outcome, reason = "settled", ""
    return Flight(course, settings, attitude, rows, outcome, reason, since, warnings)


def about_table(made_by: str, timed: TimedGait, settings: FlightSettings) -> dict[str, Any]:
    """Return what a table of flights states of itself."""
    return {
        "made_by": made_by,
        "vehicle": timed.gait.vehicle.as_mapping(),
        "coefficients": timed.gait.coefficients.kind,
        "period": timed.period,
        "law": timed.law,
        "flight": settings.as_mapping(),
    }


def settled_since(rows: FloatArray, settings: FlightSettings) -> tuple[float | None, str]:
    """Return the time from which all errors stayed within tolerance [s], or None and the worst error at the end."""
    if not len(rows):
        return None, "nothing was flown"
    errors = {"altitude (m)": rows[:, _AT["z"]] - rows[:, _AT["z_wanted"]], "yaw (rad)": rows[:, _AT["yaw"]]}
    if settings.reference == "attitude":
        errors = {f"{name} (rad)": rows[:, _AT[name]] for name in ("roll", "pitch")} | errors
    else:
        errors = {f"{name} (m)": rows[:, _AT[name]] - rows[:, _AT[f"{name}_wanted"]] for name in "xy"} | errors
    outside = np.any([np.abs(error) > settings.tolerance for error in errors.values()], axis=0)
    last = int(np.flatnonzero(outside)[-1]) + 1 if outside.any() else 0
    t = rows[:, 0]
    held = min(_HELD_AT_LEAST, 0.1 * settings.seconds)
    if last < len(rows) and t[-1] - t[last] >= held - 1e-9:
        return float(t[last]), ""
    tail = t >= t[-1] - held
    worst = max(errors, key=lambda name: float(np.abs(errors[name][tail]).max()))
    return None, f"{worst} is still off by {np.abs(errors[worst][tail]).max():.3g}"
