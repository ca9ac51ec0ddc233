"""The physical constants of a tilt-rotor.

Rotor *i* tilts by αᵢ from upright about the horizontal line from the centre of mass towards it, unless axes of its own are
stated. Body axes: x forward, y left, z up. Rotors 2, 3, 4 follow rotor 1 counter-clockwise seen from above; opposite
rotors turn in the same sense, neighbours do not, unless the spin of each is stated.

A vehicle is *symmetric* if a half turn about body z maps it to itself, and it has no axes and spins of its own: opposite
rotors at equal distances and heights, with equal drag. Its sheets are planes; four equal arms a quarter turn apart are
the short way to write the most common of them. The *drag ratio* of a rotor is κ = Km/(Kf·L), of its own distance L from
body z. Mirroring every spin replaces κ by −κ, which mirrors every surface and region in the origin of the (α1, α2) plane.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache, partial
from pathlib import Path
from typing import IO, Any, Literal, get_args

from gaitgraph.angles import (
    angle_from_text,
    angle_within,
    angles_from,
    number_of,
    text_from_angle,
)
from gaitgraph.arrays import read_only
from gaitgraph.errors import (
    InputError,
    MissingConstant,
    check_fields,
    checked_choice,
    did_you_mean,
    inside,
    of_field,
    shown,
    wrong,
)
from gaitgraph.files import from_toml_file, is_stream, table_from_toml
from gaitgraph.pictured import Pictured
from gaitgraph.texts import table_lines

__all__ = [
    "PAPER",
    "Vehicle",
    "VehicleLike",
    "preset_names",
    "vehicle_from_mapping",
    "vehicle_named",
]

Spin = Literal["clockwise", "counterclockwise"]
Angle = float | str  # [rad], or a text such as "45deg"

UNITS = {
    "mass": "kg", "gravity": "m/s²", "arm_length": "m", "thrust_coefficient": "N s²/rad²",
    "drag_coefficient": "N m s²/rad²", "drag_to_thrust": "m", "drag_ratio": "dimensionless", "inertia": "kg m²",
    "max_tilt": "rad", "min_tilt": "rad", "max_tilt_rate": "rad/s", "max_tilt_acceleration": "rad/s²",
    "max_tilt_jerk": "rad/s³", "max_thrust": "N", "servo_lag": "s", "linkage": "rad", "rotor_lag": "s",
    "rotor_height": "m", "rotor_positions": "m", "arm_inertia": "kg m²", "rotor_inertia": "kg m²",
}  # fmt: skip
_TILTS = ("max_tilt", "min_tilt")
_ANGLES = ("max_tilt_rate", "max_tilt_acceleration", "max_tilt_jerk")
_LEAST_TURN, _LARGEST_TURN = 1e-6, 1e6  # between two points of a linkage [rad]
_ROUNDING = 1e-12  # of an angle at a corner of a linkage [rad]
_LONG_ARM = 3.0  # in metres for each cube root of a kilogram; of flying vehicles it is about 0.25
_LIKELY_ARM = 3.0  # the cube root of an unknown mass
_EACH = (*_TILTS, *_ANGLES, "servo_lag", "linkage", "drag_to_thrust")
_DRAGS = ("drag_coefficient", "drag_to_thrust", "drag_ratio")
_OF_EQUAL_ARMS = ("arm_length", "first_arm_angle", "rotor_height")
_ALIKE = 1e-9  # share of the arm length by which two places may differ and count as one
_FAR = 1e3  # m
_NONE = (
    1e-9  # what rounding leaves of a force, a moment or a determinant, in arm lengths
)

Each = float | tuple[float, ...]
"""A constant of all arms, or four of which some differ."""
Place = tuple[float, float, float]
"""A point (x, y, z) in body axes from the centre of mass [m]."""
Linkage = tuple[tuple[float, float], ...]
"""Servo angles and the tilt angles that they make, pairs [rad], the tilt angles increasing."""


def __dir__() -> list[str]:
    return [*__all__]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, init=False)
class Vehicle(Pictured):
    """The constants of one tilt-rotor; immutable, in SI units.

    Unknown constants are None. The drag ratio must be known: give Kf, Km and the arm length, or Km/Kf and the arm
    length, or κ itself.

    Parameters
    ----------
    mass, gravity
        Mass m [kg], and gravitational acceleration g [m/s²].
    arm_length
        Horizontal distance L from the centre of mass to each rotor [m]; of `rotor_positions` it is the mean.
    thrust_coefficient, drag_coefficient
        Kf [N s²/rad²] and Km [N m s²/rad²]: thrust and drag torque per squared rotor speed.
    drag_to_thrust, drag_ratio
        Km/Kf [m], one or four, and κ = Km/(Kf·L), dimensionless, positive; of four its mean. See `drag_ratios`.
    inertia
        Principal moments (Ix, Iy, Iz) about the body axes [kg m²].
    first_arm_angle
        Angle of the first arm from body x, positive towards y [rad].
    first_rotor_spin
        Spin of rotor 1 seen from above: "clockwise" (as in the paper) or "counterclockwise".
    max_tilt, min_tilt
        Largest and least αᵢ that the arms allow, from upright [rad]; `min_tilt` is −`max_tilt` if it is not stated: a
        servo with a whole range of 110° has a `max_tilt` of "55deg".
    max_tilt_rate, max_tilt_acceleration, max_tilt_jerk
        Largest |derivatives| of αᵢ, of the tilt axis whatever its linkage [rad/s], [rad/s²], [rad/s³].
    max_thrust
        Largest thrust of one rotor [N].
    servo_lag
        Time constant of the tilt servos as first-order lags [s].
    servo_feedback
        Whether the tilt servos report their angles, so that a controller knows them while they lag. Hobby servos do not.
    linkage
        Pairs (servo angle, tilt angle) from which a servo turns an arm [rad], at least two, linear between them, or
        four such tables; None where the servo is on the tilt axis. Tilt angles must all rise, or all fall, with the
        servo's. The tilt range ends where the linkage does.
    rotor_lag
        Time constant of the rotors' thrusts as first-order lags [s]; flight alone uses it.
    rotor_height
        Height h of the rotors above the centre of mass, along body z [m]; negative below, at most ten arm lengths.
    rotor_positions
        Instead of `arm_length`, `first_arm_angle` and `rotor_height`: the places (x, y, z) of the four rotors from the
        centre of mass, counter-clockwise seen from above [m]. The three are then derived from it: means, and the angle
        of rotor 1. Four equal arms a quarter turn apart are written by the three: `rotor_positions` is then None.
    tilt_axes, thrust_axes
        Four directions (x, y, z) of any length: the axis about which each rotor tilts, right-handed and outward, by
        default the horizontal line towards it; and where it thrusts at zero tilt, by default body z. The part of it
        along the tilt axis is left out. None where all are the default ones.
    spins
        Instead of `first_rotor_spin`: the spin of each rotor, seen from where it thrusts to. None where neighbours alternate.
    arm_inertia, rotor_inertia
        Moment of inertia of one tilting arm with its rotor about its tilt axis, part of `inertia`, and of one rotor
        about its spin axis [kg m²].

    Limits of tilts and derivatives, `servo_lag` and `linkage` are one for all arms or a list of four. Angles may be
    texts such as "45deg".

    Raises
    ------
    InputError
        If a value is not as stated above, a tilt range is empty, constants contradict each other or leave κ open, or
        rotors with axes or spins of their own cannot lift, make a moment about some axis, or both at once.

    Examples
    --------
    >>> round(Vehicle(drag_to_thrust=0.0165, arm_length=0.2754).drag_ratio, 4)
    0.0599
    """

    name: str = "unnamed"
    mass: float | None = None
    gravity: float = 9.80665
    arm_length: float | None = None
    thrust_coefficient: float | None = None
    drag_coefficient: float | None = None
    drag_to_thrust: Each | None = None
    drag_ratio: float
    inertia: tuple[float, float, float] | None = None
    first_arm_angle: float = 0.0
    first_rotor_spin: Spin = "clockwise"
    max_tilt: Each | None = None
    min_tilt: Each | None = None
    max_tilt_rate: Each | None = None
    max_tilt_acceleration: Each | None = None
    max_tilt_jerk: Each | None = None
    max_thrust: float | None = None
    servo_lag: Each | None = None
    servo_feedback: bool = False
    linkage: Linkage | tuple[Linkage, ...] | None = None
    rotor_lag: float | None = None
    rotor_height: float = 0.0
    rotor_positions: tuple[Place, ...] | None = None
    tilt_axes: tuple[Place, ...] | None = None
    thrust_axes: tuple[Place, ...] | None = None
    spins: tuple[Spin, ...] | None = None
    arm_inertia: float | None = None
    rotor_inertia: float | None = None

    def __init__(self, **constants: Any) -> None:
        _check_arms_are_equal(constants)
        check_fields("vehicle", constants, _FIELDS)
        stated: dict[str, Any] = _DEFAULTS | constants
        _read_positions(stated)
        _read_axes(stated)
        _read_words(stated)
        _read_spins(stated, constants.get("first_rotor_spin"))
        _read_numbers(stated)
        _derive_drag_ratio(stated)
        _read_height(stated)
        for field, value in stated.items():
            object.__setattr__(self, field, value)  # the record is frozen
        _check_axes(self)
        for arm, (least, most) in enumerate(self.tilt_range or (), start=1):
            if not least < most:
                raise wrong(
                    "min_tilt",
                    "must be below max_tilt, both within the linkage of the arm",
                    least,
                    got=f"{least:g} to {most:g} rad for arm {arm}",
                )

    @property
    def tilt_range(self) -> tuple[tuple[float, float], ...] | None:
        """The least and the largest tilt angle of each arm, by its limits and its linkage [rad]; None if not stated."""
        if self.max_tilt is None and self.linkage is None:
            return None
        high = four_of(math.inf if self.max_tilt is None else self.max_tilt)
        if self.min_tilt is None:
            low = tuple(-most for most in high)
        else:
            low = four_of(self.min_tilt)
        ends = [
            (table[0][1], table[-1][1]) if table else (-math.inf, math.inf)
            for table in self.linkages
        ]
        return tuple(
            (max(a, c), min(b, d)) for a, b, (c, d) in zip(low, high, ends, strict=True)
        )

    @property
    def linkages(self) -> tuple[Linkage | None, ...]:
        """The linkage of each arm, or four times None."""
        tables: Any = self.linkage
        return tables if tables and isinstance(tables[0][0], tuple) else (tables,) * 4

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line for each arm whose tilt range excludes hover, and one for arms that are hardly in metres."""
        usual = _LIKELY_ARM if self.mass is None else self.mass ** (1 / 3)
        if self.arm_length is None or self.arm_length <= _LONG_ARM * usual:
            return self.hover_exclusions
        name, stated = "arm_length", f"{self.arm_length:g}"
        in_metres = f"{self.arm_length / 1000:g}"
        if self.rotor_positions is not None:
            first = self.rotor_positions[0]
            name, stated = "rotor_positions", f"{_text([*first])} of rotor 1"
            in_metres = _text([part / 1000 for part in first])
        of_mass = "" if self.mass is None else f" with a mass of {self.mass:g} kg"
        line = f"{name} = {stated}{of_mass}: it is in metres; if this is in mm, write {in_metres}"
        return (*self.hover_exclusions, line)

    @property
    def hover_exclusions(self) -> tuple[str, ...]:
        """A line for each arm whose tilt range excludes hover."""
        return tuple(
            f"arm {arm} tilts from {math.degrees(low):.4g}° to {math.degrees(high):.4g}°, so hover (α = 0) is excluded"
            for arm, (low, high) in enumerate(self.tilt_range or (), start=1)
            if not low <= 0 <= high
        )

    @property
    def signed_drag_ratio(self) -> float:
        """κ, negative if the spins are mirrored against the paper's, as the formulas use it."""
        if self.first_rotor_spin == "clockwise":
            return self.drag_ratio
        return -self.drag_ratio

    @property
    def height_ratio(self) -> float:
        """H = h/L, the rotor height in arm lengths, as the formulas use it; 0 at the height of the centre of mass."""
        if self.rotor_height and self.arm_length:
            return self.rotor_height / self.arm_length
        return 0.0

    @property
    def scaled_positions(self) -> tuple[Place, ...]:
        """The places of the rotors from the centre of mass, in units of the arm length."""
        if self.rotor_positions is not None:
            length: Any = self.arm_length
            return tuple(
                (x / length, y / length, z / length) for x, y, z in self.rotor_positions
            )
        height = self.height_ratio
        return tuple((math.cos(arm), math.sin(arm), height) for arm in self.arm_angles)

    @property
    def arm_lengths(self) -> tuple[float | None, ...]:
        """The horizontal distance of each rotor from the centre of mass [m]."""
        if self.rotor_positions is None:
            return (self.arm_length,) * 4
        return tuple(math.hypot(x, y) for x, y, _ in self.rotor_positions)

    @property
    def rotor_heights(self) -> tuple[float, ...]:
        """The height of each rotor above the centre of mass [m]."""
        if self.rotor_positions is None:
            return (self.rotor_height,) * 4
        return tuple(z for _, _, z in self.rotor_positions)

    @property
    def heights_in_words(self) -> str:
        """The heights of the rotors, such as "0.02 m" or "0.02 and 0 m"."""
        heights = dict.fromkeys(f"{height:g}" for height in self.rotor_heights)
        return f"{' and '.join(heights)} m"

    @property
    def arm_angles(self) -> tuple[float, ...]:
        """The angle of each arm from body x [rad]."""
        if self.rotor_positions is None:
            return tuple(self.first_arm_angle + k * math.pi / 2 for k in range(4))
        return tuple(math.atan2(y, x) for x, y, _ in self.rotor_positions)

    @property
    def axes(self) -> tuple[Any, Any]:
        """The tilt axis of each rotor, outward, and where it thrusts at zero tilt: unit vectors, arrays of shape (4, 3)."""
        import numpy as np

        tilt = np.array(self.scaled_positions) * [1.0, 1.0, 0.0]
        if self.tilt_axes is not None:
            tilt = np.array(self.tilt_axes)
        tilt /= np.linalg.norm(tilt, axis=1, keepdims=True)
        thrust = np.tile([0.0, 0.0, 1.0], (4, 1))
        if self.thrust_axes is not None:
            thrust = np.array(self.thrust_axes)
            thrust /= np.linalg.norm(thrust, axis=1, keepdims=True)
        thrust -= np.sum(tilt * thrust, axis=1, keepdims=True) * tilt
        thrust /= np.linalg.norm(thrust, axis=1, keepdims=True)
        return read_only(tilt), read_only(thrust)

    @property
    def has_own_axes(self) -> bool:
        """Whether a rotor tilts about another axis, or thrusts elsewhere at zero tilt, than by default."""
        return self.tilt_axes is not None or self.thrust_axes is not None

    @property
    def spin_signs(self) -> tuple[int, ...]:
        """+1 for each rotor that turns counterclockwise seen from where it thrusts to, −1 for a clockwise one."""
        if self.spins is not None:
            return tuple(1 if spin == "counterclockwise" else -1 for spin in self.spins)
        first = 1 if self.first_rotor_spin == "counterclockwise" else -1
        return first, -first, first, -first

    @property
    def scaled_drags(self) -> tuple[float, ...]:
        """Km/(Kf·L) of each rotor, with L the arm length, the mean of all."""
        if not isinstance(self.drag_to_thrust, tuple):
            return (self.drag_ratio,) * 4
        length: Any = self.arm_length
        return tuple(drag / length for drag in self.drag_to_thrust)

    @property
    def has_raised_rotors(self) -> bool:
        """Whether a rotor is above or below the centre of mass."""
        return any(self.rotor_heights)

    @property
    def asymmetry(self) -> str | None:
        """Which pair of opposite rotors a half turn about body z does not map to itself, and why; None if symmetric.

        Spins that do not alternate, and axes that are not the default ones, are named first.
        """
        if self.spins is not None:
            return f"spins {', '.join(self.spins)}"
        if self.has_own_axes:
            return "tilt_axes or thrust_axes of its own"
        if self.rotor_positions is None and not isinstance(self.drag_to_thrust, tuple):
            return None
        drags = self.scaled_drags
        for i, k in ((0, 2), (1, 3)):
            pair = f"rotors {i + 1} and {k + 1}"
            if not math.isclose(drags[i], drags[k], rel_tol=_ALIKE):
                values = four_of(self.drag_to_thrust)
                return (
                    f"{pair} with a drag_to_thrust of {values[i]:g} and {values[k]:g} m"
                )
            (x, y, z), (u, v, w) = self.scaled_positions[i], self.scaled_positions[k]
            if max(abs(x + u), abs(y + v), abs(z - w)) > _ALIKE:
                places = self.rotor_positions or self.scaled_positions
                here, there = (
                    ", ".join(f"{value:.12g}" for value in places[rotor])
                    for rotor in (i, k)
                )
                return f"{pair} at ({here}) and ({there}) m"
        return None

    @property
    def carries_published_coefficients(self) -> bool:
        """Whether formula (1) with the paper's four-digit coefficients holds for this vehicle."""
        same_kappa = math.isclose(
            self.signed_drag_ratio, PAPER.signed_drag_ratio, rel_tol=1e-9
        )
        return (
            same_kappa
            and self.first_arm_angle == PAPER.first_arm_angle
            and not self.has_raised_rotors
            and self.rotor_positions is None
            and self.spins is None
            and not self.has_own_axes
            and not isinstance(self.drag_to_thrust, tuple)
        )

    @property
    def thrust_share(self) -> float | None:
        """The largest thrust of one rotor in units of m·g, None if not stated; MissingConstant without a mass."""
        if self.max_thrust is None:
            return None
        mass, gravity = self.require(
            "mass", "gravity", purpose="the limit of the largest thrust"
        )
        return float(self.max_thrust / (mass * gravity))

    def require(self, *names: str, purpose: str) -> tuple[Any, ...]:
        """Return the named constants, or raise MissingConstant for the first that is None; `purpose` needs it."""
        for name in names:
            if getattr(self, name) is None:
                raise MissingConstant(
                    f"vehicle {self.name!r} states no {name} ({UNITS[name]}), which {purpose} needs",
                    field=f"vehicle.{name}",
                )
        return tuple(getattr(self, name) for name in names)

    def replace(self, **changes: Any) -> Vehicle:
        """Return a vehicle with some constants changed; what was derived from them is derived again.

        Constants of equal arms do not replace `rotor_positions`, unless that is set to None.

        >>> PAPER.replace(max_tilt_rate=6.0).carries_published_coefficients
        True
        """
        new: dict[str, Any] = {
            **{name: getattr(self, name) for name in _FIELDS},
            **changes,
        }
        if new["rotor_positions"] is not None:
            for name in _OF_EQUAL_ARMS:
                if name in changes:
                    raise wrong(
                        name, "must be omitted beside rotor_positions", changes[name]
                    )
            new |= {name: _DEFAULTS[name] for name in _OF_EQUAL_ARMS}
        if new["spins"] is not None and "first_rotor_spin" not in changes:
            del new["first_rotor_spin"]
        known = {name for name, value in new.items() if value is not None}
        # A new value replaces what it would follow from; what follows from it is derived again.
        if "drag_ratio" in changes:
            new |= {"drag_to_thrust": None, "drag_coefficient": None, **changes}
        elif "drag_to_thrust" in changes:
            new |= {"drag_coefficient": None, "drag_ratio": None, **changes}
        else:
            if known >= {"thrust_coefficient", "drag_coefficient"}:
                new["drag_to_thrust"] = None
                known.add("drag_to_thrust")
            if "drag_to_thrust" in known and known & {"arm_length", "rotor_positions"}:
                new["drag_ratio"] = None
        return Vehicle(**new)

    def _constructed_from(self) -> dict[str, Any]:
        return self.as_mapping()

    def as_mapping(self) -> dict[str, Any]:
        """Return the stated constants as plain values, in a fixed order; read back by vehicle_from_mapping."""
        values = {name: _plain(getattr(self, name)) for name in _FIELDS}
        # Not said: rotors at the height of the centre of mass, servos that do not report.
        values["rotor_height"] = self.rotor_height or None
        if self.rotor_positions is not None:  # these follow from it
            values |= dict.fromkeys(_OF_EQUAL_ARMS)
        if self.spins is not None:
            values["first_rotor_spin"] = None
        values["servo_feedback"] = self.servo_feedback or None
        return {name: value for name, value in values.items() if value is not None}

    def __repr__(self) -> str:
        if self == globals().get("PAPER"):  # short in signatures
            return "PAPER"
        return f"Vehicle({', '.join(f'{name}={value!r}' for name, value in self.as_mapping().items())})"

    def __str__(self) -> str:
        rows = []
        for name, value in self.as_mapping().items():
            if name in ("first_arm_angle", *_TILTS) and not isinstance(value, list):
                text = f"{text_from_angle(value)} rad = {math.degrees(value):.6g}°"
            else:
                parts = value if isinstance(value, list) else [value]
                text = ", ".join(_text(part) for part in parts)
                text += f" {UNITS.get(name, '').removeprefix('dimensionless')}"
            if name != "name":
                rows.append((name.replace("_", " "), text.rstrip()))
        head = f"Vehicle {self.name}: κ = {self.drag_ratio:.6g}"
        return "\n".join([head, *table_lines(rows)])


_DEFAULTS = {
    field.name: None if field.default is MISSING else field.default
    for field in fields(Vehicle)
}
_FIELDS = list(_DEFAULTS)


def four_of(value: Any) -> tuple[Any, ...]:
    """Return a constant of each arm: four that are stated, or one four times."""
    return value if isinstance(value, tuple) else (value,) * 4


def tighter_of(limit: Each | None, demanded: Each | None) -> Each | None:
    """Return the lower limit of each arm: that of a vehicle, or one that a table or a motion was made for.

    >>> tighter_of(6.0, (7.0, 5.0, 7.0, 7.0)), tighter_of(None, 5.0)
    ((6.0, 5.0, 6.0, 6.0), 5.0)
    """
    if limit is None or demanded is None:
        return demanded if limit is None else limit
    if not isinstance(limit, tuple) and not isinstance(demanded, tuple):
        return min(limit, demanded)
    return tuple(map(min, four_of(limit), four_of(demanded)))


def lowest_limits(limits: Iterable[Mapping[str, Any]]) -> dict[str, Each]:
    """Return the lowest of limits of rates, accelerations and jerks by kind: numbers, or four of them.

    >>> lowest_limits([{"rate": 7.0, "jerk": 900.0}, {"rate": 5.0}])
    {'rate': 5.0, 'jerk': 900.0}
    """
    lowest: dict[str, Any] = {}
    for stated in limits:
        for kind, limit in stated.items():
            each = tuple(limit) if isinstance(limit, list) else limit
            lowest[kind] = tighter_of(lowest.get(kind), each)
    return lowest


def vehicle_within(vehicle: Vehicle, limits: Mapping[str, Any]) -> Vehicle:
    """Return a vehicle whose limits of rates, accelerations and jerks are the lower of its own and of some others."""
    lowest: dict[str, Any] = {}
    for kind, limit in limits.items():
        name = f"max_tilt_{kind}"
        lowest[name] = tighter_of(getattr(vehicle, name), limit)
    return vehicle.replace(**lowest)


def scale_of(limit: Each | None) -> Any:
    """Return by what sizes of four joints are compared: their limits where these differ, shape (4,), else 1."""
    import numpy as np

    if not isinstance(limit, tuple):
        return 1.0
    return np.maximum(
        limit, 1e-300
    )  # a joint that stands still may have a limit of zero


def linkage_of(name: str, pairs: object) -> Linkage:
    """Return pairs (servo angle, tilt angle), numbers [rad] or texts, in order; InputError unless it is monotone.

    >>> linkage_of("linkage", [("40deg", 0.5), (0.0, 0.0)])
    ((0.0, 0.0), (0.6981317007977318, 0.5))
    """
    table = angles_from(pairs, name)
    if table.ndim != 2 or len(table) < 2 or table.shape[1] != 2:
        raise wrong(
            name, "must be two or more pairs of a servo and a tilt angle (rad)", pairs
        )
    table = table[table[:, 1].argsort()]
    turns, rises = (table[1:] - table[:-1]).T
    one_way = turns * (1 if turns[0] > 0 else -1)
    if not (
        _LEAST_TURN <= min(*one_way, *rises) <= max(*one_way, *rises) <= _LARGEST_TURN
    ):
        rule = "monotone: tilt angles that all rise, or all fall, with the servo angle"
        raise wrong(name, f"must be {rule}", pairs)
    return tuple(map(tuple, table.tolist()))


def linked(linkage: Linkage, angles: Any, *, to_servo: bool = False) -> tuple[Any, Any]:
    """Return tilt angles of servo angles, arrays of any shape [rad], or the reverse, and the slopes there.

    Beyond the ends the outer pieces go on, so that the two directions are inverse; at a corner the slope is that above.

    >>> tilt, slope = linked(((0.0, 0.0), (1.0, 0.5), (2.0, 2.0)), 1.5)
    >>> float(tilt), float(slope), float(linked(((0.0, 0.0), (1.0, 0.5), (2.0, 2.0)), tilt, to_servo=True)[0])
    (1.25, 1.5, 1.5)
    """
    import numpy as np
    from scipy.interpolate import make_interp_spline

    servo, tilt = np.array(linkage).T
    known, wanted = (tilt, servo) if to_servo else (servo, tilt)
    order = known.argsort()
    line = make_interp_spline(known[order], wanted[order], k=1)
    return line(angles), line.derivative()(np.asarray(angles) + _ROUNDING)


def _check_arms_are_equal(constants: Mapping[str, Any]) -> None:
    """Raise InputError if constants of equal arms are lists, or arms are described by other names than positions."""
    for name, value in constants.items():
        is_of_each = isinstance(value, (list, tuple)) and len(value) > 1
        if name in ("arm_lengths", "arm_angles") or (
            name in _OF_EQUAL_ARMS and is_of_each
        ):
            rule = "be equal and a quarter turn apart, with one arm_length (m) and one first_arm_angle (rad)"
            raise wrong(
                "arms",
                f"must {rule}, or be stated as rotor_positions (m)",
                value,
                got=f"{name} = {shown(value)}",
                field=name,
            )


def _read_positions(stated: dict[str, Any]) -> None:
    """Check `rotor_positions` and derive the constants of equal arms from it; drop it where the arms are equal."""
    positions = stated["rotor_positions"]
    if positions is None:
        return
    beside = [name for name in _OF_EQUAL_ARMS if stated[name] != _DEFAULTS[name]]
    if beside:
        raise wrong(
            beside[0], "must be omitted beside rotor_positions", stated[beside[0]]
        )
    rule = f"four places (x, y, z) within ±{_FAR:g} m"
    places = _four_vectors("rotor_positions", positions, rule)
    lengths = [math.hypot(x, y) for x, y, _ in places]
    length = sum(lengths) / 4
    for rotor, distance in enumerate(lengths, start=1):
        if not distance > max(1e-6, 1e-3 * length):
            raise wrong(
                "rotor_positions",
                "must be away from body z",
                places[rotor - 1],
                f" for rotor {rotor}",
            )
    angles = [math.atan2(y, x) for x, y, _ in places]
    turns = [(angles[(k + 1) % 4] - angles[k]) % (2 * math.pi) for k in range(4)]
    if not math.isclose(sum(turns), 2 * math.pi) or min(turns) < 1e-3:
        degrees = ", ".join(f"{math.degrees(angle):.4g}°" for angle in angles)
        raise InputError(
            f"rotor_positions must be counter-clockwise seen from above, got rotors at {degrees}",
            field="rotor_positions",
        )
    heights = [z for _, _, z in places]
    if max(map(abs, heights)) > 10 * length:
        raise wrong(
            "rotor_positions",
            f"must be within ten arm lengths ({10 * length:g} m) of height",
            positions,
        )
    stated["arm_length"] = length
    stated["first_arm_angle"] = angles[0]
    stated["rotor_height"] = sum(heights) / 4
    alike = _ALIKE * length
    is_equal = (
        max(lengths) - min(lengths) <= alike
        and max(heights) - min(heights) <= alike
        and all(abs(turn - math.pi / 2) <= _ALIKE for turn in turns)
    )
    stated["rotor_positions"] = None if is_equal else places


def _four_vectors(name: str, value: object, rule: str) -> tuple[Place, ...]:
    """Return four rows of three numbers within ±1000; InputError unless they are."""
    rows = _unarrayed(value)
    vectors: list[Any] = [
        tuple(number_of(part) for part in _unarrayed(row))
        for row in (rows if isinstance(rows, (list, tuple)) else ())
        if isinstance(_unarrayed(row), (list, tuple))
    ]
    has_shape = len(vectors) == 4 and all(len(vector) == 3 for vector in vectors)
    if not has_shape or not all(
        abs(part) <= _FAR for vector in vectors for part in vector
    ):
        raise wrong(name, f"must be {rule}", value)
    return tuple(vectors)


def _read_axes(stated: dict[str, Any]) -> None:
    """Check that `tilt_axes` and `thrust_axes` are four directions each."""
    for name, cannot in (("tilt_axes", "tilt"), ("thrust_axes", "thrust")):
        if stated[name] is None:
            continue
        axes = _four_vectors(
            name, stated[name], f"four directions (x, y, z) within ±{_FAR:g}"
        )
        for rotor, axis in enumerate(axes, start=1):
            if math.hypot(*axis) < 1e-6:
                raise wrong(
                    name,
                    "must be longer than 1e-6",
                    axis,
                    f" for rotor {rotor}, which then cannot {cannot}",
                )
        stated[name] = axes


def _read_spins(stated: dict[str, Any], first: object) -> None:
    """Check `spins`, of which the first is that of rotor 1; drop them where neighbours alternate."""
    spins = _unarrayed(stated["spins"])
    if spins is None:
        return
    if not isinstance(spins, (list, tuple)) or len(spins) != 4:
        rule = f"four words, {' or '.join(get_args(Spin))}"
        raise wrong("spins", f"must be {rule}", spins)
    for spin in spins:
        checked_choice("spins", spin, get_args(Spin))
    if first not in (None, spins[0]):
        raise wrong("first_rotor_spin", "must be omitted beside spins", first)
    alternate = spins[0] == spins[2] != spins[1] == spins[3]
    stated["first_rotor_spin"] = spins[0]
    stated["spins"] = None if alternate else tuple(spins)


def _read_words(stated: dict[str, Any]) -> None:
    """Check the name, the spin, and whether servos report their angles."""
    name, feedback = stated["name"], stated["servo_feedback"]
    if not isinstance(name, str) or not name or not name.isprintable():
        rule = "must be a printable, non-empty text"
        raise wrong("vehicle name", rule, name, field="name")
    checked_choice("first_rotor_spin", stated["first_rotor_spin"], get_args(Spin))
    if not isinstance(feedback, bool):
        raise wrong("servo_feedback", "must be true or false", feedback)


def _read_numbers(stated: dict[str, Any]) -> None:
    """Read all constants with a unit but the rotor height, and the angle of the first arm."""
    low = stated["min_tilt"]
    if low is not None and stated["max_tilt"] is None:
        raise wrong(
            "max_tilt",
            "must be stated (rad) beside min_tilt",
            None,
            f"; min_tilt is {shown(low)}",
            got="none",
        )
    convert: dict[str, Callable[[str, Any], Any]] = dict.fromkeys(UNITS, _positive)
    convert |= dict.fromkeys(_TILTS, partial(_tilt, signed=low is not None))
    convert |= {"linkage": linkage_of, "inertia": _inertia}
    for field in UNITS:
        is_read_elsewhere = field in ("rotor_height", "rotor_positions")
        is_omitted = stated[field] is None and field != "gravity"
        if not (is_read_elsewhere or is_omitted):
            with of_field(field):
                stated[field] = _each(field, stated[field], convert[field])
    stated["first_arm_angle"] = angle_within(
        stated["first_arm_angle"], "first_arm_angle", 2 * math.pi
    )


def _inertia(name: str, value: object) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise wrong(name, "must be three positive numbers (kg m²)", value)
    return tuple(_positive(name, part) for part in value)


def _derive_drag_ratio(stated: dict[str, Any]) -> None:
    """Derive Km/Kf and κ where the other constants determine them; InputError if they contradict it or leave κ open."""
    for field, formula, over, under in (
        ("drag_to_thrust", "Km/Kf", "drag_coefficient", "thrust_coefficient"),
        ("drag_ratio", "Km/(Kf·L)", "drag_to_thrust", "arm_length"),
    ):
        if stated[over] is None or stated[under] is None:
            continue
        derived, got = sum(four_of(stated[over])) / 4 / stated[under], stated[field]
        if got is None:
            # A quotient of extreme constants can overflow or vanish.
            stated[field] = _positive(field, derived)
        elif isinstance(got, tuple):
            raise wrong(
                "drag_coefficient",
                "must be omitted beside four drag_to_thrust",
                stated[over],
            )
        elif not math.isclose(got, derived, rel_tol=1e-6):
            rule = f"{formula} = {derived:.9g} of the other constants, or be omitted"
            raise wrong(field, f"must equal {rule}", got)
    ratio = stated["drag_ratio"]
    if ratio is None:
        raise InputError(
            "vehicle constants do not determine the drag ratio κ; state thrust_coefficient, "
            "drag_coefficient and arm_length, or drag_to_thrust and arm_length, or drag_ratio",
            field="drag_ratio",
        )
    if not 1e-9 <= ratio <= 1e9:
        raise wrong("drag_ratio", "must be between 1e-9 and 1e9 (dimensionless)", ratio)
    if isinstance(stated["drag_to_thrust"], tuple) and not stated["arm_length"]:
        raise InputError(
            "arm_length (m) or rotor_positions must be stated beside four drag_to_thrust, got none",
            field="arm_length",
        )


def _read_height(stated: dict[str, Any]) -> None:
    """Read the rotor height, which is at most ten arm lengths."""
    given = stated["rotor_height"]
    height, largest = number_of(given), 10 * (stated["arm_length"] or 0.0)
    if height and not largest:
        rule = "0 m without an arm_length"
        raise wrong("rotor_height", f"must be {rule}", given, "; state arm_length (m)")
    if not abs(height) <= largest * (1 + 1e-12):
        raise wrong(
            "rotor_height", f"must be within ±{largest:g} m, ten arm lengths", given
        )
    stated["rotor_height"] = height + 0.0  # -0.0 is 0.0


def _check_axes(vehicle: Vehicle) -> None:
    """Drop axes that are the default ones; InputError for a vehicle whose rotors do not control it at any tilt angles."""
    if vehicle.spins is None and not vehicle.has_own_axes:
        return
    import numpy as np

    outward = np.array(vehicle.scaled_positions) * [1.0, 1.0, 0.0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    upward = np.tile([0.0, 0.0, 1.0], (4, 1))
    stated_tilt = vehicle.tilt_axes or outward
    stated_thrust = vehicle.thrust_axes or upward
    across = np.cross(stated_tilt, stated_thrust)
    sizes = np.linalg.norm(stated_tilt, axis=1) * np.linalg.norm(stated_thrust, axis=1)
    is_parallel = np.linalg.norm(across, axis=1) < 1e-6 * sizes
    if is_parallel.any():
        rotor = int(is_parallel.argmax())
        name = "tilt_axes" if vehicle.thrust_axes is None else "thrust_axes"
        thrust, tilt = (
            _text([*map(float, axes[rotor])]) for axes in (stated_thrust, stated_tilt)
        )
        raise InputError(
            f"{name} must be such that tilting turns the thrust, got a thrust along {thrust} and a tilt about {tilt} "
            f"for rotor {rotor + 1}",
            field=name,
        )
    tilt_axes, thrust_axes = vehicle.axes
    if np.abs(tilt_axes - outward).max() <= _ALIKE:
        object.__setattr__(vehicle, "tilt_axes", None)  # the record is frozen
    # Body z without its part along the tilt axis is upright, and has nothing across both.
    sideways = np.sum(np.cross(tilt_axes, upward) * thrust_axes, axis=1)
    if np.abs(sideways).max() <= _ALIKE and thrust_axes[:, 2].min() > 0:
        object.__setattr__(vehicle, "thrust_axes", None)
    force, moment, _ = rotor_columns(
        vehicle.scaled_positions, vehicle.scaled_drags, vehicle.spin_signs, vehicle.axes
    )
    lifts = np.maximum(thrust_axes[:, 2], np.abs(sideways))
    if lifts.max() < _NONE:
        raise InputError(
            "vehicle must lift with tilts within ±90°, got thrust_axes with which no rotor thrusts upwards",
            field="vehicle",
        )
    about, sizes, _ = np.linalg.svd(np.concatenate([*moment], axis=1))
    if sizes[2] < _NONE * sizes[0]:
        axis = _text([float(part) + 0.0 for part in about[:, 2].round(6)])
        raise InputError(
            f"vehicle must make a moment about every axis, got none about {axis} at any tilt angles",
            field="vehicle",
        )
    columns = np.concatenate([moment, force[:, 2:]], axis=1)
    corners = np.array(np.meshgrid(*[[0, 1]] * 4)).reshape(4, -1)
    matrices = [
        [columns[rotor, :, corner[rotor]] for rotor in range(4)] for corner in corners.T
    ]
    # The determinant is linear in each (cos α, sin α): where it vanishes at all corners it does everywhere.
    if np.abs(np.linalg.det(matrices)).max() < _NONE:
        raise InputError(
            "vehicle must make lift and each moment without the others at some tilt angles, got none",
            field="vehicle",
        )


def rotor_columns(
    positions: Any, drags: Any, signs: Any, axes: tuple[Any, Any]
) -> tuple[Any, Any, Any]:
    """Return force, moment and drag torque of each rotor's input w at zero tilt and a quarter turn, shape (4, 3, 2).

    `positions` and `drags` are in arm lengths, `signs` those of the thrusts of w > 0, `axes` as in :attr:`Vehicle.axes`.
    """
    import numpy as np

    tilt, upright = axes
    thrust = np.stack([upright, np.cross(tilt, upright)], axis=-1)
    force = np.array(signs)[:, None, None] * thrust
    drag = np.array(drags)[:, None, None] * thrust
    moment = np.cross(np.array(positions)[:, :, None], force, axis=1) - drag
    return force, moment, drag


def _unarrayed(value: Any) -> Any:
    """Return an array of numbers as lists; anything else as it is."""
    return value.tolist() if getattr(value, "ndim", 0) else value


def _each(name: str, value: object, convert: Callable[[str, Any], Any]) -> Any:
    """Return one value, or four if they differ; a linkage is a list of lists itself."""
    value = inner = _unarrayed(value)
    for _ in range(2 if name == "linkage" else 0):
        inner = inner[0] if isinstance(inner, (list, tuple)) and inner else None
    if (
        name not in _EACH
        or not isinstance(value, (list, tuple))
        or not isinstance(inner, (list, tuple))
    ):
        return convert(name, value)
    if len(value) != 4:
        raise wrong(name, "must be one for all arms or four, one for each", value)
    parts = tuple(convert(name, part) for part in value)
    return parts if len(set(parts)) > 1 else parts[0]


def _tilt(name: str, value: object, *, signed: bool) -> float:
    if signed:
        return angle_within(value, name, math.pi)
    return angle_within(_positive(name, value), name, math.pi, least=0.0)


def _plain(value: Any) -> Any:
    """Return lists for tuples, inside too."""
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _text(value: Any) -> str:
    if isinstance(value, list):
        return f"({', '.join(map(_text, value))})"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:.6g}"


def _positive(name: str, value: object) -> float:
    is_angle = name in (*_TILTS, *_ANGLES) and isinstance(value, str)
    number = angle_from_text(value, name) if is_angle else number_of(value)
    if not 1e-30 <= number <= 1e30:
        reason = ""
        if name in _DRAGS and number == 0:
            reason = "; a rotor without drag has no yaw torque at zero tilt"
        raise wrong(
            name, f"must be a positive finite number ({UNITS[name]})", value, reason
        )
    return number


PAPER = Vehicle(
    name="paper",
    mass=0.429,
    gravity=9.8,
    arm_length=0.1785,
    thrust_coefficient=8.048e-6,
    drag_coefficient=2.423e-7,
    inertia=(2.24e-3, 2.99e-3, 4.80e-3),
)
"""The vehicle of Shen, Ma and Tsuchiya (2022), the default; κ = 0.168666. Its constants are those of an AR.Drone 2.0 as
they circulate in public models."""


VehicleLike = Vehicle | str | Path | Mapping[str, Any]
"""What may be given for a vehicle: see :func:`vehicle_named`."""


@cache
def _presets_of_others() -> list[Vehicle]:
    tables = table_from_toml(
        Path(__file__).with_name("presets.toml").read_text(encoding="utf-8")
    )
    return [Vehicle(name=name, **constants) for name, constants in tables.items()]


def _presets() -> Iterator[Vehicle]:
    """Yield the vehicles that come with the package, the default first; the others are read when they are needed."""
    yield PAPER
    yield from _presets_of_others()


def preset_names() -> list[str]:
    """Return the names of the vehicles that come with the package, the default first."""
    return [preset.name for preset in _presets()]


def vehicle_from_mapping(constants: dict[str, Any]) -> Vehicle:
    """Return the vehicle that a table of constants by name describes; an entry ``preset`` names one to start from.

    >>> vehicle_from_mapping({"preset": "paper", "max_tilt": "80deg"}).mass
    0.429
    """
    if isinstance(constants, dict) and "rotor" in constants:
        raise InputError(
            "vehicle must state its rotors by rotor_positions, tilt_axes, thrust_axes, drag_to_thrust and spins, got a "
            "list of rotors, which validate alone judges; of four that tilt gaitgraph vehicles --from FILE prints these",
            field="vehicle",
        )
    if isinstance(constants, dict):
        _check_arms_are_equal(constants)
    check_fields("vehicle", constants, ["preset", *_FIELDS])
    if "preset" not in constants:
        return Vehicle(**constants)
    preset: Any = constants["preset"]
    found = next(
        (one for one in _presets() if isinstance(preset, str) and one.name == preset),
        None,
    )
    if found is None:
        allowed = f"a preset ({', '.join(preset_names())}), a .toml file, a mapping of constants or a Vehicle"
        is_file = os.path.isfile(f"{preset}.toml")  # noqa: PTH113 - False for a name that no file can have
        if is_file:
            hint = f"; did you mean '{preset}.toml'?"
        else:
            hint = did_you_mean(preset, preset_names())
        raise wrong("vehicle", f"must be {allowed}", preset, hint)
    changes = {name: value for name, value in constants.items() if name != "preset"}
    if not changes:
        return found
    is_placed = found.rotor_positions is not None and "rotor_positions" not in changes
    for name in _OF_EQUAL_ARMS:
        if is_placed and name in changes:
            raise wrong(
                name,
                f"must be omitted beside the preset {preset!r}, which states rotor_positions",
                changes[name],
                "; state a vehicle of equal arms without a preset",
            )
    return found.replace(**{"name": f"{preset}, changed", **changes})


def vehicle_in_gait_file(stated: object) -> Vehicle:
    """Return the vehicle that a gait file or a table states: a preset by its name, or constants.

    InputError for anything else: a gait file names no other file, so that reading it opens no file but itself.

    >>> vehicle_in_gait_file("beetle_omni").name
    'beetle_omni'
    """
    preset = stated.get("preset", PAPER.name) if isinstance(stated, dict) else stated
    if preset not in preset_names():
        allowed = f"a preset ({', '.join(preset_names())}) or constants"
        hint = did_you_mean(preset, preset_names())
        if isinstance(preset, str) and preset.lower().endswith(".toml"):
            hint = "; a gait file names no other file"
        raise wrong("vehicle", f"must be {allowed}", preset, hint)
    return vehicle_named(stated)  # type: ignore[arg-type]


def vehicle_named(vehicle: VehicleLike | IO[Any]) -> Vehicle:
    """Return a preset by name, the vehicle in a TOML file, that of a mapping of constants, or a Vehicle as it is.

    The file, or an open stream, holds the field names of :class:`Vehicle`, at the top level or in a ``[vehicle]`` table. Raises InputError
    or FileProblem if the name is unknown, or the file cannot be read or holds something else.
    """
    if isinstance(vehicle, Vehicle):
        return vehicle
    if isinstance(vehicle, Mapping):
        with inside("vehicle"):
            return vehicle_from_mapping(dict(vehicle))
    if is_stream(vehicle):
        return from_toml_file(vehicle, "vehicle", vehicle_from_mapping)
    if not isinstance(vehicle, Path) and not str(vehicle).lower().endswith(".toml"):
        if str(vehicle).lower().endswith((".urdf", ".xml", ".params")):
            raise InputError(
                f"vehicle must be a .toml file, which gaitgraph vehicles --from {vehicle} prints, got {shown(vehicle)}",
                field="vehicle",
                value=vehicle,
            )
        return vehicle_from_mapping({"preset": vehicle})
    path = Path(vehicle)

    def make(stated: dict[str, Any]) -> Vehicle:
        return vehicle_from_mapping(
            stated if "preset" in stated else {"name": path.stem, **stated}
        )

    return from_toml_file(path, "vehicle", make)
