"""Settings of a flight: duration, start, gains, limits, disturbances."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from gaitgraph.angles import angle_from_text, number_of, whole_number
from gaitgraph.errors import InputError, check_fields, checked_choice, shown

REFERENCES = ("attitude", "hover", "step", "line", "circle")
"""What is followed: the level attitude alone, or places in the plane as well."""

ARMS = ("served", "planned")
"""Which tilt angles the controller assumes: those that the servos reach, or the planned ones."""

_ANGLES = frozenset({"attitude_noise", "rate_noise", "servo_rate"})
_SAMPLING = 1e-6  # by which control steps may miss a whole number of engine steps, as a fraction


def _number(default: float | None, least: float, most: float, unit: str) -> Any:
    """Return the field of a number with its range; one without a default may be None."""
    return field(default=default, metadata={"range": (least, most, unit)})


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSettings:
    """The settings of a flight, immutable; InputError if a value or a loop's gains are not allowed.

    The units are SI and radians; the fields below state the range of each.

    Parameters
    ----------
    duration
        How long is flown; by default 3 s where only the attitude is held, 8 s to hover and for a step, and 4 s more
        than `lap` for a line and a circle, but at least one period of the gait, and the whole of a course from hover.
    tolerance
        A flight has settled once its errors stay within it: of roll and pitch (where they are not used to reach a
        place) and yaw, and of the place that is held.
    step, control_rate
        Time step of the engine, and rate of the controller, which acts every so many whole steps.
    attitude_stiffness, attitude_damping, altitude_stiffness, altitude_damping, position_stiffness, position_damping
        Gains kp and kd after linearisation: of roll, pitch and yaw; of altitude; and of x and y, which every reference
        but "attitude" holds.
    reference, size, lap
        One of :data:`REFERENCES`: "attitude" holds roll, pitch, yaw and altitude at zero and lets x and y drift;
        "hover" also holds x and y; "step" jumps to x = `size` at once; "line" moves there and "circle" along a
        circle of radius `size`, both from rest to rest within `lap`.
    saturation, thrust_limit
        Whether thrusts are kept between zero and the limit, by default the vehicle's `max_thrust`, if it states one.
    servo_lag, servo_rate
        Time constant and largest rate of the tilt servos; by default the vehicle's, if it states them.
    arms
        One of :data:`ARMS`. With "planned" a lag or a limited rate makes the controller assume wrong tilt angles.
    floor
        The flight stops when the least singular value of the scaled decoupling matrix may be below.
    attitude_noise, rate_noise, position_noise, velocity_noise
        Standard deviations of the sensors' errors, drawn anew at every control step.
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
    reference: str = "attitude"
    size: float = _number(1.0, 1e-6, 1e4, "m")
    lap: float = _number(6.0, 1e-3, 1e4, "s")
    saturation: bool = True
    thrust_limit: float | None = _number(None, 1e-9, 1e9, "N")
    servo_lag: float | None = _number(None, 0.0, 1e3, "s")
    servo_rate: float | None = _number(None, 1e-6, 1e9, "rad/s")
    arms: str = "served"
    floor: float = _number(0.01, 0.0, 1.0, "dimensionless")
    attitude_noise: float = _number(0.0, 0.0, 1.0, "rad")
    rate_noise: float = _number(0.0, 0.0, 100.0, "rad/s")
    position_noise: float = _number(0.0, 0.0, 100.0, "m")
    velocity_noise: float = _number(0.0, 0.0, 100.0, "m/s")
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: float = _number(0.0, 0.0, 100.0, "m/s")
    seed: int = 0

    def __post_init__(self) -> None:
        for one in fields(self):
            low, high, unit = one.metadata.get("range", (0.0, 0.0, ""))
            value = getattr(self, one.name)
            if unit and not (value is None and one.default is None) and not low <= number_of(value) <= high:
                raise InputError(f"{one.name} must be between {low:g} and {high:g} ({unit}), got {shown(value)}")
        checked_choice("reference", self.reference, REFERENCES)
        checked_choice("arms", self.arms, ARMS)
        if not isinstance(self.saturation, bool):
            raise InputError(f"saturation must be true or false, got {shown(self.saturation)}")
        whole_number("seed", self.seed, 0, (1 << 64) - 1)
        wind = self.wind if isinstance(self.wind, tuple) and len(self.wind) == 3 else (math.nan,)
        if not all(abs(number_of(part)) <= 100.0 for part in wind):
            raise InputError(f"wind must be two or three numbers from -100 to 100 (m/s), got {shown(self.wind)}")
        between = 1.0 / (self.control_rate * self.step)
        if between < 1.0 - _SAMPLING or abs(between - round(between)) > _SAMPLING * between:
            raise InputError(
                f"control_rate must be {1 / self.step:g} Hz divided by a whole number, for steps of {self.step:g} s, "
                f"got {self.control_rate:g} Hz"
            )
        self._check_gains()

    @property
    def seconds(self) -> float:
        """How long is flown [s], unless the period of a gait or a course from hover takes longer."""
        if self.duration is not None:
            return self.duration
        return {"attitude": 3.0, "hover": 8.0, "step": 8.0}.get(self.reference, self.lap + 4.0)

    @property
    def steps_per_control(self) -> int:
        """Number of engine steps in a control step."""
        return round(1.0 / (self.control_rate * self.step))

    @property
    def is_calm(self) -> bool:
        """Whether there is neither wind nor gust, and so no air at all."""
        return self.gust == 0.0 and not any(self.wind)

    def as_mapping(self) -> dict[str, Any]:
        """Return the settings as plain values; :func:`settings_from_mapping` reads them back."""
        stated = {one: getattr(self, one.name) for one in fields(self) if getattr(self, one.name) is not None}
        values = {one.name: float(value) if "range" in one.metadata else value for one, value in stated.items()}
        return values | {"wind": [float(part) for part in self.wind]}

    def _check_gains(self) -> None:
        """Refuse gains that are unstable: sampled double integrators, and x, y around roll and pitch."""
        interval = 1.0 / self.control_rate
        for loop in ("attitude", "altitude"):
            stiffness, damping = (float(getattr(self, f"{loop}_{gain}")) for gain in ("stiffness", "damping"))
            # With the input held over n steps of the engine the double integrator moves by c·h²·a, c = (1 + 1/n)/2, so
            # the poles are those of z² − (2 − kd·h − c·kp·h²)·z + 1 − kd·h + (1 − c)·kp·h²; inside |z| < 1 by a
            # margin for c = 1/2 (thrusts held exactly) and c = 1, and so for every c between: whatever the step.
            least = 1.025 * stiffness * interval / 2.0
            largest = 0.975 * (2.0 / interval - stiffness * interval / 2.0)
            stiffest = 1.95 / interval**2  # where the least damping is the largest
            wanted = f"to be stable at {self.control_rate:g} Hz"
            if stiffness >= stiffest:
                raise InputError(f"{loop}_stiffness must be less than {stiffest:g} 1/s² {wanted}, got {stiffness!r}")
            if not least < damping < largest:
                raise InputError(
                    f"{loop}_damping must be between {least:g} and {largest:g} 1/s {wanted} with {loop}_stiffness "
                    f"{stiffness!r}, got {damping!r}; or raise control_rate"
                )
        if self.reference == "attitude":
            return
        kp, kd = float(self.attitude_stiffness), float(self.attitude_damping)
        kp_x, kd_x = float(self.position_stiffness), float(self.position_damping)
        # From attitude to place it is four integrators in a row, whose input is held between two control steps. Poles
        # δ of differences over the interval are stable where |1 + h·δ| < 1.
        taylor = np.cumprod(interval / np.arange(1, 5)) / interval
        gains = [kp * kp_x, kp * kd_x, kp, kd]
        moved = sum(np.diag(np.full(4 - k, taylor[k - 1]), k) for k in range(1, 4))
        poles = np.linalg.eigvals(moved - np.outer(taylor[::-1], gains))
        if not np.all(2 * poles.real + interval * np.abs(poles) ** 2 < 0):
            raise InputError(
                f"position_damping must make x and y slower than roll and pitch: {kd_x!r} with position_stiffness "
                f"{kp_x!r} is unstable at {self.control_rate:g} Hz around attitude gains of {kp!r} and {kd!r}"
            )


def settings_from_mapping(content: Any) -> FlightSettings:
    """Return the settings in a table such as a study's ``[flight]``.

    Angles may be texts such as "2deg", `wind` may have two numbers. InputError if a name is unknown or a value is not
    allowed.

    >>> settings_from_mapping({"duration": 2, "attitude_noise": "0.5deg"}).attitude_noise
    0.008726646259971648
    """
    check_fields("flight", content, [field.name for field in fields(FlightSettings)])
    values = dict(content)
    for name, value in content.items():
        if name in _ANGLES and isinstance(value, str):
            values[name] = angle_from_text(value, name)
        elif name == "wind" and isinstance(value, (list, tuple)) and len(value) in (2, 3):
            values[name] = (*value, 0.0)[:3]
    return FlightSettings(**values)
