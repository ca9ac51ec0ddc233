"""How a gait is flown: for how long, from which attitude, with which gains, and against which troubles."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from gaitgraph.angles import angle_from_text, number_of
from gaitgraph.errors import InputError, did_you_mean, shown

__all__ = ["ARMS", "REFERENCES", "FlightSettings", "settings_from_mapping"]

REFERENCES = ("attitude", "hover", "step", "line", "circle")
"""What is followed: the level attitude alone, or places in the plane by way of the attitude."""

ARMS = ("served", "planned")
"""Where the controller takes the arms to be: where the servos bring them, or where they were told to go."""

MOST_STEPS = 1_000_000  # which take about 1.5 GB

_RANGES = {
    "duration": (1e-3, 1e4, "s"),
    "tolerance": (1e-9, 10.0, "rad and m"),
    "step": (1e-5, 0.02, "s"),
    "control_rate": (1.0, 1e5, "Hz"),
    "attitude_stiffness": (1e-6, 1e8, "1/s²"),
    "attitude_damping": (1e-6, 1e6, "1/s"),
    "altitude_stiffness": (1e-6, 1e8, "1/s²"),
    "altitude_damping": (1e-6, 1e6, "1/s"),
    "position_stiffness": (1e-6, 1e8, "1/s²"),
    "position_damping": (1e-6, 1e6, "1/s"),
    "floor": (0.0, 1.0, "dimensionless"),
    "size": (1e-6, 1e4, "m"),
    "lap": (1e-3, 1e4, "s"),
    "thrust_limit": (1e-9, 1e9, "N"),
    "servo_lag": (0.0, 1e3, "s"),
    "servo_rate": (1e-6, 1e9, "rad/s"),
    "attitude_noise": (0.0, 1.0, "rad"),
    "rate_noise": (0.0, 100.0, "rad/s"),
    "position_noise": (0.0, 100.0, "m"),
    "velocity_noise": (0.0, 100.0, "m/s"),
    "gust": (0.0, 100.0, "m/s"),
}
_OPTIONAL = frozenset({"duration", "thrust_limit", "servo_lag", "servo_rate"})
_WIND = 100.0
_SAMPLING = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSettings:
    """The settings of a flight; immutable, in SI units.

    Parameters
    ----------
    duration
        How long is flown [s]; by default 3 s where only the attitude is held, 8 s to hover and for a step, and 4 s
        more than `lap` for a line and a circle, but one period of the gait at least, and the whole of a course from
        hover. Where it ends before the period, the lap or the course does, the flight's warnings say so.
    tolerance
        A flight has settled once its errors stay within: of roll and pitch (where they are not used to reach a place)
        and yaw [rad], and of the place that is held [m].
    step
        Of the physics engine [s].
    control_rate
        How often thrusts are set [Hz]; a whole number of steps lies between.
    attitude_stiffness, attitude_damping
        Gains of roll, pitch and yaw after linearisation, kp [1/s²] and kd [1/s].
    altitude_stiffness, altitude_damping
        The same of altitude.
    position_stiffness, position_damping
        The same of x and y, for every reference but "attitude".
    reference
        One of :data:`REFERENCES`: "attitude" holds roll, pitch, yaw and altitude at zero and lets x and y drift;
        "hover" also holds x and y; "step" asks for x = `size` at once; "line" goes there and "circle" round a circle
        of radius `size`, both from rest to rest within `lap`.
    size
        Of the reference [m].
    lap
        Time from rest to rest of "line" and "circle" [s].
    saturation
        Whether thrusts are kept between zero and the limit; otherwise rotors push and pull as they are asked to.
    thrust_limit
        Of one rotor [N]; the vehicle's `max_thrust` by default, and none where that is not stated.
    servo_lag
        Time constant of the tilt servos [s]; the vehicle's by default, none (0) where it is not stated.
    servo_rate
        Largest tilt rate of the servos [rad/s]; the vehicle's `max_tilt_rate` by default.
    arms
        One of :data:`ARMS`. With "planned" a lag or a limited rate makes the controller take the arms to be elsewhere
        than they are.
    floor
        The flight stops when the least singular value of the scaled decoupling matrix may be below [dimensionless].
    attitude_noise, rate_noise, position_noise, velocity_noise
        Standard deviations of what the sensors err by [rad], [rad/s], [m], [m/s], drawn anew at every control step.
    wind
        Mean wind (x, y, z) [m/s], acting through the engine's fluid model on the box of equal inertia.
    gust
        Standard deviation of the wind in each direction, correlated over one second [m/s].
    seed
        Of noise and gusts.

    Raises
    ------
    InputError
        If a value is not allowed, or gains and rates make an unstable loop: the message says which.

    Examples
    --------
    >>> FlightSettings(attitude_damping=3000.0)
    Traceback (most recent call last):
    ...
    gaitgraph.errors.InputError: attitude_damping: 3000.0 is unstable at 1000 Hz; allowed is less than 1949.95 1/s, or
    a higher control_rate
    """

    duration: float | None = None
    tolerance: float = 0.02
    step: float = 1e-3
    control_rate: float = 1000.0
    attitude_stiffness: float = 100.0
    attitude_damping: float = 20.0
    altitude_stiffness: float = 100.0
    altitude_damping: float = 20.0
    position_stiffness: float = 2.25
    position_damping: float = 3.0
    reference: str = "attitude"
    size: float = 1.0
    lap: float = 6.0
    saturation: bool = True
    thrust_limit: float | None = None
    servo_lag: float | None = None
    servo_rate: float | None = None
    arms: str = "served"
    floor: float = 0.01
    attitude_noise: float = 0.0
    rate_noise: float = 0.0
    position_noise: float = 0.0
    velocity_noise: float = 0.0
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name, (low, high, unit) in _RANGES.items():
            value = getattr(self, name)
            if value is None and name in _OPTIONAL:
                continue
            number = _number(name, value)
            if not low <= number <= high:
                raise InputError(f"{name}: {shown(value)}; allowed is {low:g} to {high:g} ({unit})")
            object.__setattr__(self, name, number)
        for name, known in (("reference", REFERENCES), ("arms", ARMS)):
            value = getattr(self, name)
            if value not in known:
                hint = did_you_mean(value, list(known)) if isinstance(value, str) else ""
                raise InputError(f"{name}: {shown(value)}; allowed are {', '.join(known)}{hint}")
        if not isinstance(self.saturation, bool):
            raise InputError(f"saturation: {shown(self.saturation)}; allowed are true and false")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or not 0 <= self.seed < 1 << 64:
            raise InputError(f"seed: {shown(self.seed)}; allowed is a whole number from 0 to {(1 << 64) - 1}")
        object.__setattr__(self, "wind", _wind(self.wind))
        self._check_sampling()
        self._check_gains()

    @property
    def seconds(self) -> float:
        """How long is flown [s], but for the period of a gait or a course from hover that takes longer."""
        if self.duration is not None:
            return self.duration
        return {"attitude": 3.0, "hover": 8.0, "step": 8.0}.get(self.reference, self.lap + 4.0)

    @property
    def steps_per_control(self) -> int:
        """How many steps of the engine lie between two settings of the thrusts."""
        return round(1.0 / (self.control_rate * self.step))

    @property
    def is_calm(self) -> bool:
        """Whether there is neither wind nor gust, and so no air at all."""
        return self.gust == 0.0 and not any(self.wind)

    def replace(self, **changes: Any) -> FlightSettings:
        """Return settings with some values changed, checked again."""
        known = [field.name for field in fields(self)]
        for name in changes:
            if name not in known:
                hint = did_you_mean(name, known)
                raise InputError(f"{name}: no setting of a flight{hint or '; allowed are ' + ', '.join(known)}")
        return replace(self, **changes)

    def as_mapping(self) -> dict[str, Any]:
        """Return the settings as plain values; :func:`settings_from_mapping` reads them back."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: list(v) if isinstance(v, tuple) else v for name, v in values.items() if v is not None}

    def _check_sampling(self) -> None:
        between = 1.0 / (self.control_rate * self.step)
        if between < 1.0 - _SAMPLING or abs(between - round(between)) > _SAMPLING * between:
            raise InputError(
                f"control_rate: {self.control_rate:g} Hz does not fit steps of {self.step:g} s; allowed is "
                f"{1 / self.step:g} Hz divided by a whole number"
            )
        if self.seconds / self.step > MOST_STEPS:
            name, seconds = ("lap", self.lap) if self.duration is None else ("duration", self.seconds)
            raise InputError(f"{name}: {seconds:g} s; allowed is {MOST_STEPS} steps of {self.step:g} s at most")

    def _check_gains(self) -> None:
        """Refuse gains that are unstable: sampled double integrators, and x, y around roll and pitch."""
        interval = 1.0 / self.control_rate
        for loop in ("attitude", "altitude"):
            stiffness, damping = getattr(self, f"{loop}_stiffness"), getattr(self, f"{loop}_damping")
            # Held over n steps of the engine the double integrator moves by c·h²·a, c = (1 + 1/n)/2, so the poles
            # are those of z² − (2 − kd·h − c·kp·h²)·z + 1 − kd·h + (1 − c)·kp·h²; inside |z| < 1 by a margin. It is
            # asked for c = 1/2, which is thrusts held exactly, and c = 1, and so of every c between: what is stable
            # is no matter of the engine's step.
            least = 1.025 * stiffness * interval / 2.0
            largest = 0.975 * (2.0 / interval - stiffness * interval / 2.0)
            stiffest = 1.95 / interval**2  # where the least damping is the largest
            if stiffness >= stiffest:
                raise InputError(
                    f"{loop}_stiffness: {stiffness!r} is unstable at {self.control_rate:g} Hz; allowed is less than "
                    f"{stiffest:g} 1/s², or a higher control_rate"
                )
            if damping >= largest:
                raise InputError(
                    f"{loop}_damping: {damping!r} is unstable at {self.control_rate:g} Hz; allowed is less than "
                    f"{largest:g} 1/s, or a higher control_rate"
                )
            if damping <= least:
                raise InputError(
                    f"{loop}_damping: {damping!r} is unstable at {self.control_rate:g} Hz with {loop}_stiffness "
                    f"{stiffness!r}; allowed is more than {least:g} 1/s"
                )
        if self.reference == "attitude":
            return
        kp, kd = self.attitude_stiffness, self.attitude_damping
        gains = np.array([kp * self.position_stiffness, kp * self.position_damping, kp, kd])
        if not np.all(np.roots([1.0, *gains[::-1]]).real < 0):
            raise InputError(
                f"position_damping: {self.position_damping!r} with position_stiffness {self.position_stiffness!r} is "
                f"unstable around attitude gains of {kp!r} and {kd!r}; allowed are gains that make roll and pitch "
                "faster than x and y"
            )
        # From lean to place it is four integrators in a row, whose input is held between two settings of the thrusts.
        # Poles δ of differences over the interval are stable where |1 + h·δ| < 1.
        taylor = np.cumprod(interval / np.arange(1, 5)) / interval
        differences = sum(np.diag(np.full(4 - k, taylor[k - 1]), k) for k in range(1, 4)) - np.outer(
            taylor[::-1], gains
        )
        poles = np.linalg.eigvals(differences)
        if not np.all(2 * poles.real + interval * np.abs(poles) ** 2 < 0):
            raise InputError(
                f"control_rate: {self.control_rate:g} Hz is too slow for position_stiffness "
                f"{self.position_stiffness!r} and position_damping {self.position_damping!r}, which make an unstable "
                "loop; allowed is a higher control_rate, or smaller gains"
            )


def settings_from_mapping(content: Any) -> FlightSettings:
    """Return the settings that a table describes, as in a study's ``[flight]``.

    Parameters
    ----------
    content
        Names of :class:`FlightSettings` to values; angles may be texts such as "2deg".

    Raises
    ------
    InputError
        If a name is unknown or a value is not allowed.

    Examples
    --------
    >>> settings_from_mapping({"duration": 2, "attitude_noise": "0.5deg"}).attitude_noise
    0.008726646259971648
    """
    if not isinstance(content, dict) or not all(isinstance(name, str) for name in content):
        raise InputError(f"flight: {shown(content)}; allowed is a table of settings by name")
    return FlightSettings().replace(**content)


def _number(name: str, value: object) -> float:
    if isinstance(value, str) and name in ("attitude_noise", "rate_noise", "servo_rate"):
        return angle_from_text(value, name)
    return number_of(value)


def _wind(wind: Any) -> tuple[float, float, float]:
    if isinstance(wind, (list, tuple, np.ndarray)) and len(wind) in (2, 3):
        parts = [number_of(part) for part in wind] + [0.0] * (3 - len(wind))
        if all(math.isfinite(part) and abs(part) <= _WIND for part in parts):
            return parts[0], parts[1], parts[2]
    raise InputError(f"wind: {shown(wind)}; allowed are two or three numbers, each up to {_WIND:g} (m/s)")
