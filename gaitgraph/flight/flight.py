"""One flight: its settings and its record."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import IO, TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from gaitgraph import later
from gaitgraph.angles import (
    HALF_PI,
    angle_from_text,
    is_list,
    number_of,
    whole_number,
)
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import InputError, check_fields, checked_choice, wrong
from gaitgraph.files import is_stream, path_of
from gaitgraph.gait.table import Table
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import least_singular_value
from gaitgraph.pictured import Pictured
from gaitgraph.records import Record
from gaitgraph.texts import table_lines
from gaitgraph.timing.joining import Course
from gaitgraph.timing.laws import LAWS
from gaitgraph.vehicle import vehicle_named

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.vehicle import Vehicle, VehicleLike

Reference = Literal["attitude", "hover", "step", "line", "circle"]
Arms = Literal["served", "planned"]

REFERENCES: tuple[Reference, ...] = get_args(Reference)
"""What the controller holds: the level attitude alone, or a place in the plane as well."""

_ANGLES = frozenset({"attitude_noise", "rate_noise", "servo_rate"})
_SAMPLING = (
    1e-6  # relative tolerance for control steps being a whole number of engine steps
)


def _number(default: float | None, least: float, most: float, unit: str) -> Any:
    """Return the field of a number with its range; without a default it may be None."""
    return field(default=default, metadata={"range": (least, most, unit)})


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSettings(Record):
    """The settings of a flight, immutable, in SI units and radians; InputError outside the ranges of the fields below.

    Parameters
    ----------
    duration
        Time to fly; by default 3 s where only the attitude is held, 8 s to hover and for a step, and 4 s more than
        `lap` for a line and a circle, but at least one period of the gait, and the whole of a course from hover.
    tolerance
        A flight has settled once these errors stay below it: yaw, the place that is held, and roll and pitch unless
        they lean to reach a place.
    step, control_rate
        Time step of the engine, and rate of the controller, which acts after a whole number of steps.
    attitude_stiffness, attitude_damping, altitude_stiffness, altitude_damping, position_stiffness, position_damping
        Gains kp and kd after linearisation: of roll, pitch and yaw; of altitude; and of x and y, which every reference
        but "attitude" holds. Unstable gains raise InputError.
    reference, size, lap
        One of :data:`REFERENCES`: "attitude" holds roll, pitch, yaw and altitude at zero and lets x and y drift;
        "hover" also holds x and y; "step" jumps to x = `size` at once; "line" moves there and "circle" along a
        circle of radius `size`, both from rest to rest within `lap`.
    saturation, thrust_limit
        Whether thrusts are kept between zero and the limit, by default the vehicle's `max_thrust`, if it states one.
    servo_lag, servo_rate
        Time constant and largest rate of the tilt servos; by default the vehicle's, if it states them.
    servo_errors
        Constant errors of the four tilt angles, zeros that are off or play, which neither servos nor controller know [rad].
    arms
        Tilt angles that the controller assumes: "planned", which are wrong with a lag or a limited rate; or "served",
        those that the servos reach, by default only for a vehicle with `servo_feedback`.
    floor
        The flight stops when the least singular value of the scaled decoupling matrix may fall below this.
    attitude_noise, rate_noise, position_noise, velocity_noise
        Standard deviations of the sensors' errors, drawn at every control step.
    wind, gust, seed
        Mean wind (x, y, z) [m/s], acting through the engine's fluid model on the box of equal inertia; standard
        deviation of the wind in each direction, correlated over one second; seed of noise and gusts.

    Examples
    --------
    >>> FlightSettings(attitude_damping=3000.0)
    Traceback (most recent call last):
    ...
    gaitgraph.errors.InputError: attitude_damping must be between 0.05125 and 1949.95 1/s to be stable at 1000 Hz with
    attitude_stiffness 100.0, got 3000.0; or raise control_rate
    """

    duration: float | None = _number(None, 1e-3, 1e4, "s")
    tolerance: float = _number(0.02, 1e-9, 10.0, "rad and m")
    step: float = _number(1e-3, 1e-5, 0.02, "s")
    control_rate: float = _number(1000.0, 1.0, 1e5, "Hz")
    attitude_stiffness: float = _number(100.0, 1e-6, 1e8, "1/s²")
    attitude_damping: float = _number(20.0, 1e-6, 1e6, "1/s")
    altitude_stiffness: float = _number(100.0, 1e-6, 1e8, "1/s²")
    altitude_damping: float = _number(20.0, 1e-6, 1e6, "1/s")
    position_stiffness: float = _number(2.25, 1e-6, 1e8, "1/s²")
    position_damping: float = _number(3.0, 1e-6, 1e6, "1/s")
    reference: Reference = "attitude"
    size: float = _number(1.0, 1e-6, 1e4, "m")
    lap: float = _number(6.0, 1e-3, 1e4, "s")
    saturation: bool = True
    thrust_limit: float | None = _number(None, 1e-9, 1e9, "N")
    servo_lag: float | None = _number(None, 0.0, 1e3, "s")
    servo_rate: float | None = _number(None, 1e-6, 1e9, "rad/s")
    servo_errors: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    arms: Arms | None = None
    floor: float = _number(0.01, 0.0, 1.0, "dimensionless")
    attitude_noise: float = _number(0.0, 0.0, 1.0, "rad")
    rate_noise: float = _number(0.0, 0.0, 100.0, "rad/s")
    position_noise: float = _number(0.0, 0.0, 100.0, "m")
    velocity_noise: float = _number(0.0, 0.0, 100.0, "m/s")
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: float = _number(0.0, 0.0, 100.0, "m/s")
    seed: int = 0

    def __post_init__(self) -> None:
        for setting in fields(self):
            value = getattr(self, setting.name)
            if "range" not in setting.metadata or value is setting.default is None:
                continue
            low, high, unit = setting.metadata["range"]
            if not low <= number_of(value) <= high:
                rule = f"must be between {low:g} and {high:g} ({unit})"
                raise wrong(setting.name, rule, value)
            if not isinstance(value, (int, float)):
                object.__setattr__(self, setting.name, number_of(value))
        checked_choice("reference", self.reference, REFERENCES)
        if self.arms is not None:
            checked_choice("arms", self.arms, get_args(Arms))
        if not isinstance(self.saturation, bool):
            raise wrong("saturation", "must be true or false", self.saturation)
        seed = whole_number("seed", self.seed, 0, (1 << 64) - 1)
        object.__setattr__(self, "seed", seed)  # the record is frozen
        rule = "must be two or three numbers from -100 to 100 (m/s)"
        self._check_parts("wind", 3, 100.0, rule)
        rule = "must be four angles from -π/2 to π/2 (rad)"
        self._check_parts("servo_errors", 4, HALF_PI, rule)
        self._check_rate()
        self._check_gains()

    def _check_parts(self, name: str, count: int, most: float, rule: str) -> None:
        """Raise InputError unless a setting is so many numbers within ± `most`; make it a tuple."""
        values = getattr(self, name)
        if not is_list(values) or len(values) != count:
            raise wrong(name, rule, values)
        for value in values:
            if not abs(number_of(value)) <= most:
                raise wrong(name, rule, values)
        object.__setattr__(self, name, tuple(values))  # the record is frozen

    def _check_rate(self) -> None:
        """Raise InputError if a control step is not a whole number of steps of the engine."""
        steps = 1.0 / (self.control_rate * self.step)
        if steps < 1.0 - _SAMPLING or abs(steps - round(steps)) > _SAMPLING * steps:
            fitting = 1.0 / (self.control_rate * math.ceil(steps))
            raise InputError(
                f"control_rate must be {1 / self.step:g} Hz divided by a whole number, for steps of {self.step:g} s, "
                f"got {self.control_rate:g} Hz; with step {fitting:.9g} it fits",
                field="control_rate",
                value=self.control_rate,
            )

    @property
    def seconds(self) -> float:
        """Time to fly [s], unless the period of a gait or a course from hover takes longer."""
        if self.duration is not None:
            return self.duration
        if self.reference == "attitude":
            return 3.0
        if self.reference in ("hover", "step"):
            return 8.0
        return self.lap + 4.0

    def seconds_of(self, course: Course) -> float:
        """Return the time to fly a course [s]."""
        if self.duration is not None:
            return min(self.duration, course.duration)
        if math.isfinite(course.duration):
            return course.duration
        return max(self.seconds, course.moving_period)

    def arms_of(self, vehicle: VehicleLike) -> Arms:
        """Return which tilt angles the controller of a vehicle assumes.

        >>> FlightSettings().arms_of("paper"), FlightSettings().arms_of("beetle_omni")
        ('planned', 'served')
        """
        if self.arms is not None:
            return self.arms
        if vehicle_named(vehicle).servo_feedback:
            return "served"
        return "planned"

    @property
    def steps_per_control(self) -> int:
        """Number of engine steps in a control step."""
        return round(1.0 / (self.control_rate * self.step))

    @property
    def held(self) -> float:
        """Time within tolerance at the end after which a flight has settled [s]."""
        return min(_HELD_AT_LEAST, 0.1 * self.seconds)

    @property
    def is_calm(self) -> bool:
        """Whether there is neither wind nor gust; the engine then models no air."""
        return self.gust == 0.0 and not any(self.wind)

    def as_mapping(self) -> dict[str, Any]:
        """Return the settings as plain values; :func:`settings_from_mapping` reads them back."""
        values: dict[str, Any] = {}
        for setting in fields(self):
            value = getattr(self, setting.name)
            if isinstance(value, tuple):
                value = list(value)
            if value is not None:
                values[setting.name] = value
        return values

    def _check_gains(self) -> None:
        """Raise InputError for gains with which attitude or altitude, as sampled, or x and y are unstable."""
        interval = 1.0 / self.control_rate
        for loop in ("attitude", "altitude"):
            stiffness = getattr(self, f"{loop}_stiffness")
            damping = getattr(self, f"{loop}_damping")
            # With the input held over n steps of the engine the double integrator moves by c·h²·a, c = (1 + 1/n)/2, so
            # the poles are the roots of z² − (2 − kd·h − c·kp·h²)·z + 1 − kd·h + (1 − c)·kp·h². They are inside |z| < 1
            # by a margin for c = 1/2 (thrusts held exactly) and c = 1, hence for every c between: for every step.
            least = 1.025 * stiffness * interval / 2.0
            largest = 0.975 * (2.0 / interval - stiffness * interval / 2.0)
            stiffest = 1.95 / interval**2  # where the least damping is the largest
            wanted = f"to be stable at {self.control_rate:g} Hz"
            if stiffness >= stiffest:
                raise wrong(
                    f"{loop}_stiffness",
                    f"must be less than {stiffest:g} 1/s² {wanted}",
                    stiffness,
                )
            if not least < damping < largest:
                raise wrong(
                    f"{loop}_damping",
                    f"must be between {least:g} and {largest:g} 1/s {wanted} with {loop}_stiffness {stiffness}",
                    damping,
                    "; or raise control_rate",
                )
        if self.reference == "attitude":
            return
        kp, kd = self.attitude_stiffness, self.attitude_damping
        kp_x, kd_x = self.position_stiffness, self.position_damping
        # From attitude to place there are four integrators in series, with an input held between two control steps.
        # Poles δ of differences over the interval are stable where |1 + h·δ| < 1.
        taylor = np.cumprod(interval / np.arange(1, 5)) / interval
        gains = [kp * kp_x, kp * kd_x, kp, kd]
        moved = np.zeros((4, 4))
        for k in range(1, 4):
            moved += np.diag(np.full(4 - k, taylor[k - 1]), k)
        poles = np.linalg.eigvals(moved - np.outer(taylor[::-1], gains))
        if not np.all(2 * poles.real + interval * np.abs(poles) ** 2 < 0):
            raise InputError(
                f"position_damping must make x and y slower than roll and pitch: {kd_x} with position_stiffness "
                f"{kp_x} is unstable at {self.control_rate:g} Hz around attitude gains of {kp} and {kd}",
                field="position_damping",
                value=kd_x,
            )


def checked_settings(settings: object) -> FlightSettings:
    """Return settings, by default those of :class:`FlightSettings`; InputError for anything else."""
    if settings is None:
        return FlightSettings()
    if not isinstance(settings, FlightSettings):
        raise wrong("settings", "must be FlightSettings", settings)
    return settings


def settings_from_mapping(content: Any) -> FlightSettings:
    """Return the settings in a table such as a study's ``[flight]``; InputError if a name or a value is wrong.

    Angles may be texts such as "2deg", and `wind` two numbers. `servo_errors` are four angles.

    >>> settings_from_mapping({"duration": 2, "attitude_noise": "0.5deg"}).attitude_noise
    0.008726646259971648
    """
    check_fields("flight", content, [field.name for field in fields(FlightSettings)])
    values = dict(content)
    for name, value in content.items():
        if name in _ANGLES and isinstance(value, str):
            values[name] = angle_from_text(value, name)
        elif name == "servo_errors" and is_list(value):
            values[name] = [angle_from_text(error, name) for error in value]
        elif name == "wind" and is_list(value) and len(value) == 2:
            values[name] = [*value, 0.0]
    return FlightSettings(**values)


def reference_at(
    settings: FlightSettings, t: npt.ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return wanted places [m], velocities [m/s], accelerations [m/s²] at times of shape (n,), each of shape (n, 3)."""
    t = np.asarray(t, dtype=float)
    place, velocity, change = np.zeros((3, len(t), 3))
    share, rate, acceleration = LAWS["smooth"].motion(np.clip(t / settings.lap, 0, 1))
    rate, acceleration = rate / settings.lap, acceleration / settings.lap**2
    if settings.reference == "step":
        place[:, 0] = 1.0
    elif settings.reference == "line":
        place[:, 0], velocity[:, 0], change[:, 0] = share, rate, acceleration
    elif settings.reference == "circle":
        angle, turn, faster = math.tau * share, math.tau * rate, math.tau * acceleration
        sine, cosine = np.sin(angle), np.cos(angle)
        place[:, 0] = 1.0 - cosine
        place[:, 1] = sine
        velocity[:, 0] = turn * sine
        velocity[:, 1] = turn * cosine
        change[:, 0] = faster * sine + turn**2 * cosine
        change[:, 1] = faster * cosine - turn**2 * sine
    size = settings.size
    return size * place, size * velocity, size * change


COLUMNS = (
    "t", "x", "y", "z", "roll", "pitch", "yaw", "x_rate", "y_rate", "z_rate",
    "body_rate_x", "body_rate_y", "body_rate_z", "alpha1", "alpha2", "alpha3", "alpha4",
    "thrust1", "thrust2", "thrust3", "thrust4", "saturated", "nearness",
    "x_wanted", "y_wanted", "z_wanted", "roll_wanted", "pitch_wanted",
)  # fmt: skip
"""The columns of a flight, in order; SI units and radians.

Positions, angles and rates are true values; `nearness`, from the controller's noisy measurements, is between half the
least singular value of the scaled decoupling matrix and all of it.
"""

TABLES = (".csv", ".json", ".npz", ".mat", ".parquet")
"""Suffixes of the tables that flights are written to."""

Outcome = Literal[
    "settled",
    "not settled",
    "near singular",
    "sign change",
    "tumbling",
    "upended",
    "refused",
]

OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
"""How a flight may end.

"sign change" is that of the determinant; "tumbling" is a motion too fast or too far to be flight.
"""

_AT = {name: k for k, name in enumerate(COLUMNS)}
_REPORTED = (
    "settled", "reason", "gait_errors", "refused", "outcome", "warnings", "duration", "settling_time", "peak_tilt",
    "peak_thrust", "peak_thrust_share", "least_singular_value", "saturated_fraction", "energy",
    "final_roll", "final_pitch", "drift", "tracking_error", "attitude", "arms",
)  # fmt: skip
"""The names of a flight in JSON."""
_IN_WORDS = {
    "roll": "roll (rad)", "pitch": "pitch (rad)", "yaw": "yaw (rad)",
    "x": "x (m)", "y": "y (m)", "z": "altitude (m)",
}  # fmt: skip
_HELD_AT_LEAST = (
    0.2  # s within tolerance at the end, or a tenth of the flight if that is less
)


@dataclass(frozen=True, slots=True, eq=False)
class Flight(Pictured):
    """One flight; truthy when it settled.

    `attitude` is roll and pitch at the start [rad]. `rows` has a row for each control step, columns as in
    :data:`COLUMNS`; a refused flight has no rows, and quantities of the rows are then None. `outcome` is one of
    :data:`OUTCOMES`; `reason` states why it did not settle, "" if it did. Errors stayed within tolerance after
    `settling_time` [s], None if it did not settle. `warnings` are about what flies all the same, such as rows off the
    surfaces.
    """

    course: Course
    settings: FlightSettings
    attitude: tuple[float, float]
    rows: FloatArray = field(repr=False)
    outcome: Outcome
    reason: str
    settling_time: float | None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

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
        """Whether it was stopped early."""
        return self.outcome not in ("settled", "not settled", "refused")

    @property
    def verdict(self) -> str:
        """When it settled, or why it did not."""
        if self.settled or self.refused:
            return self.reason or f"settled after {self.settling_time:.2f} s"
        if self.failed:
            return f"stopped: {self.reason}"
        return f"not settled: {self.reason}"

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
        """Time flown [s]."""
        return float(self.rows[-1, 0]) if len(self.rows) else 0.0

    @property
    def least_singular_value(self) -> float | None:
        """The least singular value at the control steps, dimensionless."""
        if not len(self.rows):
            return None
        roll, pitch = self.column("roll"), self.column("pitch")
        return float(least_singular_value(self.alpha, self.vehicle, roll, pitch).min())

    @property
    def peak_tilt(self) -> float | None:
        """The largest angle between body z and the vertical [rad]."""
        if not len(self.rows):
            return None
        upright = np.cos(self.column("roll")) * np.cos(self.column("pitch"))
        return float(np.arccos(np.clip(upright.min(), -1.0, 1.0)))

    @property
    def peak_thrust(self) -> float | None:
        """The largest thrust of a rotor [N]."""
        return float(np.abs(self.thrusts).max()) if len(self.rows) else None

    @property
    def peak_thrust_share(self) -> float | None:
        """The largest thrust of a rotor over a quarter of the weight."""
        mass, gravity = self.vehicle.mass, self.vehicle.gravity
        if self.peak_thrust is None or mass is None:
            return None
        return 4.0 * self.peak_thrust / (mass * gravity)

    @property
    def saturated_fraction(self) -> float | None:
        """The part of the control steps at which a thrust is at its limits."""
        return float(self.column("saturated").mean()) if len(self.rows) else None

    @property
    def energy(self) -> float | None:
        """The energy of the rotors against their drag [J]; None without a thrust coefficient too."""
        coefficient = self.vehicle.thrust_coefficient
        drag = self.vehicle.drag_to_thrust
        if coefficient is None or drag is None or len(self.rows) < 2:
            return None
        thrusts = np.abs(self.thrusts)
        powers = np.array(drag) * thrusts * np.sqrt(thrusts / coefficient)
        return float(np.sum(powers.sum(axis=1)[:-1] * np.diff(self.column("t"))))

    @property
    def drift(self) -> float | None:
        """The distance of the end from the start in the plane [m]."""
        if not len(self.rows):
            return None
        return float(np.hypot(self.column("x")[-1], self.column("y")[-1]))

    @property
    def tracking_error(self) -> float | None:
        """The largest distance from the reference [m]; None where x and y are not held."""
        if not len(self.rows) or self.settings.reference == "attitude":
            return None
        errors = [error_of(self.rows, name) for name in "xyz"]
        return float(np.linalg.norm(errors, axis=0).max())

    @property
    def gait_errors(self) -> dict[str, float] | None:
        """The largest errors while the gait runs, hover and its transitions left out; None if it never ran.

        These are "attitude", of roll or pitch [rad], "yaw" [rad], and "altitude" [m].
        """
        begin, end = self.course.gait_times
        t = self.column("t")
        runs = (t >= begin) & (t <= end)
        if not runs.any():
            return None
        errors = {}
        for name in ("roll", "pitch", "yaw", "z"):
            errors[name] = float(np.abs(error_of(self.rows, name)[runs]).max())
        attitude = max(errors["roll"], errors["pitch"])
        return {"attitude": attitude, "yaw": errors["yaw"], "altitude": errors["z"]}

    def as_mapping(self) -> dict[str, Any]:
        """Return the outcome and the numbers of the flight as plain values, ready for JSON."""
        mapping: dict[str, Any] = {}
        for name in _REPORTED:
            mapping[name] = getattr(self, name, None)
        mapping["warnings"] = list(self.warnings)
        mapping["attitude"] = list(self.attitude)
        mapping["arms"] = self.settings.arms_of(self.vehicle)
        mapping["duration"] = self.flown
        if len(self.rows):
            mapping["final_roll"] = float(self.column("roll")[-1])
            mapping["final_pitch"] = float(self.column("pitch")[-1])
        return mapping

    def to_pandas(self) -> Any:
        """Return the table as a pandas frame; see :meth:`gaitgraph.gait.table.Table.to_pandas`."""
        return self.table.to_pandas()

    @property
    def table(self) -> Table:
        """The flight as a table with a row for each control step."""
        timed = self.course.timed
        about = about_table("fly", timed, self.settings)
        about["flight"]["attitude"] = list(self.attitude)
        if timed.gait.request:
            # So that the gait can be planned again from the flight's file.
            about["request"] = dict(timed.gait.request)
            if timed.law in LAWS:
                about["request"] |= {"period": timed.period, "law": timed.law}
        columns = dict(zip(COLUMNS, self.rows.T, strict=True))
        return Table(columns=columns, about=about)

    def write(
        self,
        *paths: str | Path | IO[Any],
        force: bool = False,
        format: str | None = None,
    ) -> None:
        """Write tables, plots and films of the flight; see :func:`gaitgraph.plots.flights.write_flight`.

        An open stream takes the table, in a `format` such as "csv".
        """
        if format is not None or any(map(is_stream, paths)):
            if not len(self.rows):
                raise InputError("a flight without rows has no table")
            later.write_tables(self.table, paths, format=format)
            return
        later.write_flight(
            self, [path_of(path, "output") for path in paths], force=force
        )

    def __repr__(self) -> str:
        return f"<Flight: {self.flown:g} s, {self.reason or self.verdict}>"

    def __str__(self) -> str:
        roll, pitch = np.degrees(self.attitude)
        start = f"from roll {roll:.3g}°, pitch {pitch:.3g}°"
        head = f"Flight of {self.vehicle.name} {start}: {self.verdict}"
        if self.settled:
            head += f" of {self.flown:g} s"
        rows = []
        errors = self.gait_errors
        if errors is not None:
            attitude, yaw, altitude = np.round(list(errors.values()), 4)
            text = f"attitude {attitude:g} rad, yaw {yaw:g} rad, altitude {altitude:g} m at most"
            rows.append(("errors of the gait", text))
        if self.peak_tilt is not None:
            share = f"{self.peak_thrust_share:.3g} times a quarter of the weight"
            least = (
                f"{self.least_singular_value:.3g} (stops below {self.settings.floor:g})"
            )
            saturated = f"{100 * (self.saturated_fraction or 0):.3g} % of the time"
            place = f"ends {self.drift:.3g} m from the start"
            if self.tracking_error is not None:
                place += f", at most {self.tracking_error:.3g} m from the reference"
            rows += [
                ("tilt angles", arms_text(self.settings, self.vehicle)),
                ("peak tilt", f"{math.degrees(self.peak_tilt):.3g}°"),
                ("peak thrust", f"{self.peak_thrust:.4g} N, {share}"),
                ("least singular value", least),
                ("saturated", saturated),
            ]
            if self.energy is not None:
                rows.append(("energy", f"{self.energy:.4g} J into the air"))
            rows.append(("place", place))
        return "\n".join([head, *table_lines(rows)])


def arms_text(settings: FlightSettings, vehicle: Vehicle) -> str:
    """Return which tilt angles the controller assumes, in words."""
    if settings.arms_of(vehicle) == "served":
        return "the controller knows those that the servos reach"
    return "the controller assumes the planned ones"


def record_of(
    course: Course,
    settings: FlightSettings,
    attitude: tuple[float, float],
    rows: FloatArray | None = None,
    failure: tuple[Outcome, str] | None = None,
    *,
    warnings: tuple[str, ...] = (),
) -> Flight:
    """Return the record of a flight from its rows, none if it was refused, and outcome and reason of a `failure`."""
    if rows is None:
        rows = np.empty((0, len(COLUMNS)))
    if failure is not None:
        outcome, reason = failure
        return Flight(course, settings, attitude, rows, outcome, reason, None, warnings)
    since, worst = settled_since(rows, settings)
    if since is None:
        outcome = "not settled"
        reason = f"it did not settle within {rows[-1, 0]:g} s: {worst}"
        return Flight(course, settings, attitude, rows, outcome, reason, None, warnings)
    return Flight(course, settings, attitude, rows, "settled", "", since, warnings)


def about_table(
    made_by: str, timed: TimedGait, settings: FlightSettings
) -> dict[str, Any]:
    """Return what a table of flights states about itself."""
    return {
        "made_by": made_by,
        "vehicle": timed.gait.vehicle.as_mapping(),
        "coefficients": timed.gait.coefficients.kind,
        "period": timed.period,
        "law": timed.law,
        "flight": {
            **settings.as_mapping(),
            "arms": settings.arms_of(timed.gait.vehicle),
        },
    }


def settled_since(
    rows: FloatArray, settings: FlightSettings
) -> tuple[float | None, str]:
    """Return the time after which all errors stayed within tolerance [s], or None and the worst error at the end."""
    names = ["roll", "pitch", "z", "yaw"]
    if settings.reference != "attitude":
        names[:2] = ["x", "y"]
    errors = np.abs([error_of(rows, name) for name in names])
    is_outside = (errors > settings.tolerance).any(axis=0)
    since = np.flatnonzero(np.append(True, is_outside))[-1]
    t = rows[:, 0]
    if since < len(rows) and t[-1] - t[since] >= settings.held - 1e-9:
        return float(t[since]), ""
    last = errors[:, t >= t[-1] - settings.held].max(axis=1)
    worst = int(last.argmax())
    return None, f"{_IN_WORDS[names[worst]]} is still off by {last[worst]:.3g}"


def error_of(rows: FloatArray, name: str) -> FloatArray:
    """Return the difference of a column of a flight and what is wanted of it, zero for yaw, shape (n,)."""
    value = rows[:, _AT[name]]
    if name == "yaw":
        return value
    return np.asarray(value - rows[:, _AT[f"{name}_wanted"]])
