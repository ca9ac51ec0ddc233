"""What happened in a flight: its rows, its verdict, and what is told of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from gaitgraph.gait.table import Table
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.timing.timed_gait import LAWS

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.flight.courses import Course
    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.flight.simulation import Cockpit
    from gaitgraph.vehicle import Vehicle

__all__ = ["COLUMNS", "OUTCOMES", "Flight", "Outcome", "is_settled", "refused_flight"]

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

Positions, angles and rates are true ones; `nearness` is judged by the controller with what its sensors say: a number
between half the least singular value of the scaled decoupling matrix and all of it.
"""

Outcome = Literal["settled", "not settled", "near singular", "sign change", "tumbling", "upended", "refused"]

OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
"""How a flight may end, the one that is hoped for first.

"sign change" is that of the determinant; "tumbling" is any motion too fast or too far to be flight.
"""

_AT = {name: k for k, name in enumerate(COLUMNS)}
_HELD_AT_LEAST = 0.2  # s within tolerance before the end, or a tenth of the flight if that is less


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """One flight, and whether it settled. Truthy when it did.

    Parameters
    ----------
    course
        What the arms were told.
    settings
        How it was flown.
    attitude
        Roll and pitch at the start [rad].
    rows
        One row a control step, columns as in :data:`COLUMNS`; none if the flight was refused.
    reason
        Why it did not settle; "" if it did.
    refused
        Whether it was refused before take-off.
    failed
        Whether it ended early because it could not go on.
    settling_time
        Since when errors stayed within tolerance [s]; None if it did not settle.
    least_singular_value
        The least that was met at the control steps, dimensionless; None if nothing was flown.
    outcome
        One of :data:`OUTCOMES`.
    warnings
        What deserves attention although physics does not forbid it: what is off the surfaces.
    """

    course: Course
    settings: FlightSettings
    attitude: tuple[float, float]
    rows: FloatArray = field(repr=False)
    reason: str
    refused: bool
    failed: bool
    settling_time: float | None
    least_singular_value: float | None
    outcome: Outcome
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        rows: FloatArray,
        *,
        cockpit: Cockpit,
        attitude: tuple[float, float],
        ending: tuple[Outcome, str] | None,
    ) -> Flight:
        """Return the record of rows that were flown; `ending` is how and why it failed, if it did."""
        since, worst = _settled_since(rows, cockpit.settings)
        outcome: Outcome = "settled"
        reason = ""
        if ending is not None:
            outcome, reason = ending
        elif since is None:
            outcome, reason = "not settled", f"it did not settle within {rows[-1, 0]:g} s: {worst}"
        return cls(
            course=cockpit.course,
            settings=cockpit.settings,
            attitude=attitude,
            rows=rows,
            reason=reason,
            refused=False,
            failed=ending is not None,
            settling_time=None if ending else since,
            least_singular_value=_least_singular_value(rows, cockpit) if len(rows) else None,
            outcome=outcome,
        )

    def __bool__(self) -> bool:
        return self.settled

    @property
    def settled(self) -> bool:
        """Whether the errors came within tolerance and stayed there to the end."""
        return self.settling_time is not None

    @property
    def vehicle(self) -> Vehicle:
        """What flew."""
        return self.course.vehicle

    def column(self, name: str) -> FloatArray:
        """Return one of :data:`COLUMNS`, shape (n,)."""
        return self.rows[:, _AT[name]]

    @property
    def thrusts(self) -> FloatArray:
        """The thrusts along the tilted axes, shape (n, 4) [N]."""
        return self.rows[:, _AT["thrust1"] : _AT["thrust4"] + 1]

    @property
    def flown(self) -> float:
        """How long was flown [s]."""
        return float(self.rows[-1, 0]) if len(self.rows) else 0.0

    @property
    def peak_tilt(self) -> float | None:
        """Largest angle between body z and the vertical [rad]."""
        if not len(self.rows):
            return None
        lean = np.cos(self.column("roll")) * np.cos(self.column("pitch"))
        return float(np.arccos(np.clip(lean.min(), -1.0, 1.0)))

    @property
    def peak_thrust(self) -> float | None:
        """Largest thrust of a rotor [N]."""
        return float(np.abs(self.thrusts).max()) if len(self.rows) else None

    @property
    def peak_thrust_share(self) -> float | None:
        """Largest thrust of a rotor over a quarter of the weight."""
        (mass,) = self.vehicle.require("mass", purpose="a share of the weight")
        peak = self.peak_thrust
        return None if peak is None else 4.0 * peak / (mass * self.vehicle.gravity)

    @property
    def saturated_fraction(self) -> float | None:
        """Part of the control steps at which a thrust was cut to its limits."""
        return float(self.column("saturated").mean()) if len(self.rows) else None

    @property
    def energy(self) -> float | None:
        """What the rotors put into the air against their drag [J]; None if the vehicle states no thrust coefficient."""
        coefficient, drag = self.vehicle.thrust_coefficient, self.vehicle.drag_to_thrust
        if coefficient is None or drag is None or len(self.rows) < 2:
            return None
        thrusts = np.abs(self.thrusts)
        power = np.sum(drag * thrusts * np.sqrt(thrusts / coefficient), axis=1)
        return float(np.sum(power[:-1] * np.diff(self.column("t"))))

    @property
    def drift(self) -> float | None:
        """How far from the start in the plane it ended [m]."""
        return float(np.hypot(*self.rows[-1, 1:3])) if len(self.rows) else None

    @property
    def tracking_error(self) -> float | None:
        """Largest distance from the reference [m]; None where x and y are not held."""
        if not len(self.rows) or self.settings.reference == "attitude":
            return None
        at, to = (self.rows[:, _AT[name] : _AT[name] + 3] for name in ("x", "x_wanted"))
        return float(np.linalg.norm(at - to, axis=1).max())

    def as_mapping(self) -> dict[str, Any]:
        """Return the verdict and what was met as plain values, ready for JSON; angles in radians."""
        last = self.rows[-1] if len(self.rows) else None
        return {
            "settled": self.settled,
            "reason": self.reason,
            "refused": self.refused,
            "outcome": self.outcome,
            "warnings": list(self.warnings),
            "duration": self.flown,
            "settling_time": self.settling_time,
            "peak_tilt": self.peak_tilt,
            "peak_thrust": self.peak_thrust,
            "peak_thrust_share": self.peak_thrust_share,
            "least_singular_value": self.least_singular_value,
            "saturated_fraction": self.saturated_fraction,
            "energy": self.energy,
            "final_roll": None if last is None else float(last[_AT["roll"]]),
            "final_pitch": None if last is None else float(last[_AT["pitch"]]),
            "drift": self.drift,
            "tracking_error": self.tracking_error,
            "attitude": list(self.attitude),
        }

    def table(self) -> Table:
        """Return the flight as a table, one row a control step."""
        columns: dict[str, Any] = {name: self.rows[:, k] for name, k in _AT.items()}
        about = {
            "made_by": "fly",
            "vehicle": self.vehicle.as_mapping(),
            "coefficients": self.course.timed.gait.coefficients.kind,
            "period": self.course.timed.period,
            "law": self.course.timed.law,
            "flight": {**self.settings.as_mapping(), "attitude": list(self.attitude)},
        }
        timed = self.course.timed
        if timed.gait.request:  # so that the gait is planned again from the flight's file
            clock = {"period": timed.period, "law": timed.law} if timed.law in LAWS else {}
            about["request"] = {**timed.gait.request, **clock}
        return Table(columns=columns, about=about)

    def write(self, *paths: str | Path, force: bool = False) -> None:
        """Write tables, plots and films of the flight; see :func:`gaitgraph.flight.outputs.write_flight`."""
        from gaitgraph.flight.outputs import write_flight

        write_flight(self, paths, force=force)

    def __repr__(self) -> str:
        verdict = f"settled after {self.settling_time:.2f} s" if self.settled else self.reason
        return f"<Flight: {self.flown:g} s, {verdict}>"

    def __str__(self) -> str:
        roll, pitch = (f"{math.degrees(angle):.3g}°" for angle in self.attitude)
        head = f"Flight of {self.vehicle.name} from roll {roll}, pitch {pitch}"
        if self.refused:
            return f"{head}: {self.reason}"
        if self.settled:
            verdict = f"settled after {self.settling_time:.2f} s of {self.flown:g} s"
        else:
            verdict = f"{'stopped' if self.failed else 'not settled'}: {self.reason}"
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
            told = f"{self.drift:.3g} m from the start"
            if self.tracking_error is not None:
                told += f", at most {self.tracking_error:.3g} m from the reference"
            lines.append(f"  place                 ends {told}")
        return "\n".join(lines)


def refused_flight(course: Course, settings: FlightSettings, attitude: tuple[float, float], reason: str) -> Flight:
    """Return the record of a flight that was not begun."""
    return Flight(
        course=course,
        settings=settings,
        attitude=attitude,
        rows=np.empty((0, len(COLUMNS))),
        reason=reason,
        refused=True,
        failed=False,
        settling_time=None,
        least_singular_value=None,
        outcome="refused",
    )


def is_settled(rows: FloatArray, settings: FlightSettings) -> bool:
    """Return whether a flight that ended with these rows would have settled."""
    return _settled_since(rows, settings)[0] is not None


def _errors(rows: FloatArray, settings: FlightSettings) -> dict[str, FloatArray]:
    """Return the errors that count, by name with unit."""
    off = {
        "altitude (m)": rows[:, _AT["z"]] - rows[:, _AT["z_wanted"]],
        "yaw (rad)": rows[:, _AT["yaw"]],
    }
    if settings.reference == "attitude":
        return {"roll (rad)": rows[:, _AT["roll"]], "pitch (rad)": rows[:, _AT["pitch"]], **off}
    return {
        "x (m)": rows[:, _AT["x"]] - rows[:, _AT["x_wanted"]],
        "y (m)": rows[:, _AT["y"]] - rows[:, _AT["y_wanted"]],
        **off,
    }


def _settled_since(rows: FloatArray, settings: FlightSettings) -> tuple[float | None, str]:
    """Return when all errors came within tolerance to stay, or None and what was off at the end."""
    if not len(rows):
        return None, "nothing was flown"
    errors = _errors(rows, settings)
    outside = np.any([np.abs(error) > settings.tolerance for error in errors.values()], axis=0)
    last = int(np.flatnonzero(outside)[-1]) + 1 if outside.any() else 0
    t = rows[:, 0]
    held = min(_HELD_AT_LEAST, 0.1 * settings.seconds)
    if last < len(rows) and t[-1] - t[last] >= held - 1e-9:
        return float(t[last]), ""
    tail = t >= t[-1] - held
    worst = max(errors, key=lambda name: float(np.abs(errors[name][tail]).max()))
    return None, f"{worst} is still off by {np.abs(errors[worst][tail]).max():.3g}"


def _least_singular_value(rows: FloatArray, cockpit: Cockpit) -> float:
    """Return the least singular value that was met at the control steps."""
    near = rows[:, _AT["nearness"]]
    angles = [rows[:, _AT[name] : _AT[name] + width] for name, width in (("alpha1", 4), ("roll", 1), ("pitch", 1))]

    def exact(which: Any) -> FloatArray:
        alpha, roll, pitch = (part[which] for part in angles)
        return np.asarray(least_singular_value(alpha, cockpit.vehicle, roll[:, 0], pitch[:, 0]))

    if cockpit.settings.attitude_noise or cockpit.settings.arms == "planned":
        return float(exact(slice(None)).min())
    # The exact value is between `near` and twice that, so few rows can hold the least. The margin is for arms that are
    # not just where they were planned.
    known = float(exact([int(np.argmin(near))])[0])
    return float(exact((near <= 1.05 * known) | (near == near.min())).min())
