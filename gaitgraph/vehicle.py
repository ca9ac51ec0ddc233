"""The physical constants of a tilt-rotor.

Four arms lie in the body's x–y plane, a quarter turn apart; arm *i* carries a rotor that tilts by αᵢ from upright
about the arm's outward axis. Body axes: x forward, y left, z up. Rotor 1 is on the first arm, rotors 2, 3, 4 follow
counter-clockwise seen from above; opposite rotors turn in the same sense, neighbours do not.

The gait surfaces depend only on the *drag ratio* κ = Km/(Kf·L) and the spin sense. Turning all arms about z moves
only the roll and pitch axes of the attitude diagrams. Mirroring every spin replaces κ by −κ, which mirrors every
surface and region in the origin of the (α1, α2) plane.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

from gaitgraph._lazy import Pictured
from gaitgraph.angles import angle_from_text, angle_within, number_of, text_from_angle
from gaitgraph.errors import InputError, MissingConstant, check_fields, checked_choice, did_you_mean, shown
from gaitgraph.files import from_toml_file

Spin = Literal["clockwise", "counterclockwise"]
Angle = float | str  # [rad], or a text such as "45deg"

UNITS = {
    "mass": "kg",
    "gravity": "m/s²",
    "arm_length": "m",
    "thrust_coefficient": "N s²/rad²",
    "drag_coefficient": "N m s²/rad²",
    "drag_to_thrust": "m",
    "drag_ratio": "dimensionless",
    "inertia": "kg m²",
    "max_tilt": "rad",
    "max_tilt_rate": "rad/s",
    "max_tilt_acceleration": "rad/s²",
    "max_tilt_jerk": "rad/s³",
    "max_thrust": "N",
    "servo_lag": "s",
    "arm_inertia": "kg m²",
    "rotor_inertia": "kg m²",
}
_ANGLES = ("first_arm_angle", "max_tilt", "max_tilt_rate", "max_tilt_acceleration", "max_tilt_jerk")


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
        Distance L from the centre of mass to each rotor [m].
    thrust_coefficient, drag_coefficient
        Kf [N s²/rad²] and Km [N m s²/rad²]: thrust and drag torque per squared rotor speed.
    drag_to_thrust, drag_ratio
        Km/Kf [m], and κ = Km/(Kf·L), dimensionless, positive.
    inertia
        Principal moments (Ix, Iy, Iz) about the body axes [kg m²].
    first_arm_angle
        Angle of the first arm from body x, positive towards y [rad].
    first_rotor_spin
        Spin of rotor 1 seen from above: "clockwise" (as in the paper) or "counterclockwise".
    max_tilt, max_tilt_rate, max_tilt_acceleration, max_tilt_jerk
        Largest |αᵢ| that the arms allow [rad], and of its derivatives [rad/s], [rad/s²], [rad/s³]. These angles and
        that of the first arm may be texts such as "45deg".
    max_thrust
        Largest thrust of one rotor [N].
    servo_lag
        Time constant of the tilt servos as first-order lags [s].
    arm_inertia, rotor_inertia
        Moment of inertia of one tilting arm with its rotor about its tilt axis, part of `inertia`, and of one rotor
        about its spin axis [kg m²].

    Raises
    ------
    InputError
        If a value is not a positive finite number (or angle), or if constants contradict each other or leave κ open.

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
    drag_to_thrust: float | None = None
    drag_ratio: float
    inertia: tuple[float, float, float] | None = None
    first_arm_angle: float = 0.0
    first_rotor_spin: Spin = "clockwise"
    max_tilt: float | None = None
    max_tilt_rate: float | None = None
    max_tilt_acceleration: float | None = None
    max_tilt_jerk: float | None = None
    max_thrust: float | None = None
    servo_lag: float | None = None
    arm_inertia: float | None = None
    rotor_inertia: float | None = None

    def __init__(self, **constants: Any) -> None:
        check_fields("vehicle", constants, _FIELDS)
        stated: dict[str, Any] = _DEFAULTS | constants
        if not isinstance(name := stated["name"], str) or not name or not name.isprintable():
            raise InputError(f"vehicle name must be a printable, non-empty text, got {shown(name)}")
        for field in UNITS:
            if field != "inertia" and (stated[field] is not None or field == "gravity"):
                stated[field] = _positive(field, stated[field])
        if (inertia := stated["inertia"]) is not None:
            if not isinstance(inertia, (list, tuple)) or len(inertia) != 3:
                raise InputError(f"inertia must be three positive numbers (kg m²), got {shown(inertia)}")
            stated["inertia"] = tuple(_positive("inertia", part) for part in inertia)
        stated["first_arm_angle"] = angle_within(stated["first_arm_angle"], "first_arm_angle", 2 * math.pi)
        if stated["max_tilt"] is not None:
            angle_within(stated["max_tilt"], "max_tilt", math.pi, least=0.0)
        checked_choice("first_rotor_spin", stated["first_rotor_spin"], get_args(Spin))
        for field, formula, over, under in (
            ("drag_to_thrust", "Km/Kf", "drag_coefficient", "thrust_coefficient"),
            ("drag_ratio", "Km/(Kf·L)", "drag_to_thrust", "arm_length"),
        ):
            if stated[over] is None or stated[under] is None:
                continue
            derived, got = stated[over] / stated[under], stated[field]
            if got is None:
                stated[field] = _positive(field, derived)  # a quotient of extreme constants can overflow or vanish
            elif not math.isclose(got, derived, rel_tol=1e-6):
                rule = f"{formula} = {derived!r} of the other constants, or be omitted"
                raise InputError(f"{field} must equal {rule}, got {got!r}")
        if stated["drag_ratio"] is None:
            raise InputError(
                "vehicle constants do not determine the drag ratio κ; state thrust_coefficient, "
                "drag_coefficient and arm_length, or drag_to_thrust and arm_length, or drag_ratio"
            )
        if not 1e-9 <= stated["drag_ratio"] <= 1e9:
            raise InputError(f"drag_ratio must be between 1e-9 and 1e9 (dimensionless), got {stated['drag_ratio']!r}")
        for field, value in stated.items():
            object.__setattr__(self, field, value)  # the record is frozen

    @property
    def signed_drag_ratio(self) -> float:
        """κ, negative if the spins are mirrored against the paper's, as the formulas use it."""
        return self.drag_ratio if self.first_rotor_spin == "clockwise" else -self.drag_ratio

    @property
    def carries_published_coefficients(self) -> bool:
        """Whether formula (1) with the paper's four-digit coefficients holds for this vehicle."""
        same_kappa = math.isclose(self.signed_drag_ratio, PAPER.signed_drag_ratio, rel_tol=1e-9)
        return same_kappa and self.first_arm_angle == PAPER.first_arm_angle

    @property
    def thrust_share(self) -> float | None:
        """The largest thrust of one rotor in units of m·g, None if not stated; MissingConstant without a mass."""
        if self.max_thrust is None:
            return None
        mass, gravity = self.require("mass", "gravity", purpose="the limit of the largest thrust")
        return float(self.max_thrust / (mass * gravity))

    def require(self, *names: str, purpose: str) -> tuple[Any, ...]:
        """Return the named constants, or raise MissingConstant for the first that is None; `purpose` needs it."""
        for name in names:
            if getattr(self, name) is None:
                raise MissingConstant(f"vehicle {self.name!r} states no {name} ({UNITS[name]}), which {purpose} needs")
        return tuple(getattr(self, name) for name in names)

    def replace(self, **changes: Any) -> Vehicle:
        """Return a vehicle with some constants changed; what was derived from them is derived again.

        >>> PAPER.replace(max_tilt_rate=6.0).carries_published_coefficients
        True
        """
        new: dict[str, Any] = {**{name: getattr(self, name) for name in _FIELDS}, **changes}
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
            if known >= {"arm_length", "drag_to_thrust"}:
                new["drag_ratio"] = None
        return Vehicle(**new)

    def as_mapping(self) -> dict[str, Any]:
        """Return the stated constants as plain values, in a fixed order; read back by vehicle_from_mapping."""
        values = {name: getattr(self, name) for name in _FIELDS}
        values["inertia"] = None if self.inertia is None else list(self.inertia)
        return {name: value for name, value in values.items() if value is not None}

    def as_short_mapping(self) -> dict[str, Any]:
        """Return constants that vehicle_from_mapping reads as this vehicle: those of a preset that differ, or all."""
        stated = self.as_mapping()
        for name, preset in _PRESETS.items():
            base = preset.as_mapping()
            short = {"preset": name} | {name: value for name, value in stated.items() if base.get(name) != value}
            if vehicle_from_mapping(short) == self:
                return short
        return stated

    def __repr__(self) -> str:
        return f"Vehicle({', '.join(f'{name}={value!r}' for name, value in self.as_mapping().items())})"

    def __str__(self) -> str:
        stated, lines = self.as_mapping(), [f"Vehicle {self.name}: κ = {self.drag_ratio:.6g}"]
        del stated["name"]
        for name, value in stated.items():
            if name in ("first_arm_angle", "max_tilt"):
                text = f"{text_from_angle(value)} rad = {math.degrees(value):.6g}°"
            else:
                parts = value if isinstance(value, list) else [value]
                text = ", ".join(part if isinstance(part, str) else f"{part:.6g}" for part in parts)
                text += f" {UNITS.get(name, '').removeprefix('dimensionless')}"
            lines.append(f"  {name.replace('_', ' '):<22} {text}".rstrip())
        return "\n".join(lines)


_DEFAULTS = {field.name: None if field.default is MISSING else field.default for field in fields(Vehicle)}
_FIELDS = list(_DEFAULTS)


def _positive(name: str, value: object) -> float:
    number = angle_from_text(value, name) if name in _ANGLES and isinstance(value, str) else number_of(value)
    if not 1e-30 <= number <= 1e30:
        raise InputError(f"{name} must be a positive finite number ({UNITS[name]}), got {shown(value)}")
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
"""The vehicle of Shen, Ma and Tsuchiya (2022), the default; κ = 0.168666."""


# beetle_omni: physical parameters as published in the JSK lab's robot configuration; its rotor 1 is front left and
# pushes the body clockwise.
_BEETLE = Vehicle(
    name="beetle_omni",
    mass=3.0386,
    gravity=9.798,
    arm_length=0.2754,
    drag_to_thrust=0.0165,
    inertia=(0.0627958, 0.0620796, 0.0948795),
    first_arm_angle=math.pi / 4,
    first_rotor_spin="counterclockwise",
    servo_lag=0.048,
)
_PRESETS = {vehicle.name: vehicle for vehicle in (PAPER, _BEETLE)}


VehicleLike = Vehicle | str | Path | Mapping[str, Any]
"""What may be given for a vehicle: see :func:`vehicle_named`."""


def preset_names() -> list[str]:
    """Return the names of the vehicles that come with the package, the default first."""
    return list(_PRESETS)


def vehicle_from_mapping(constants: dict[str, Any]) -> Vehicle:
    """Return the vehicle that a table of constants by name describes; an entry ``preset`` names one to start from.

    >>> vehicle_from_mapping({"preset": "paper", "max_tilt": "80deg"}).mass
    0.429
    """
    check_fields("vehicle", constants, ["preset", *_FIELDS])
    if "preset" not in constants:
        return Vehicle(**constants)
    preset: Any = constants["preset"]
    if not isinstance(preset, str) or preset not in _PRESETS:
        allowed = f"a preset ({', '.join(_PRESETS)}), a .toml file, a mapping of constants or a Vehicle"
        is_file = os.path.isfile(f"{preset}.toml")  # noqa: PTH113 - False for a name that no file can have
        hint = f"; did you mean '{preset}.toml'?" if is_file else did_you_mean(preset, preset_names())
        raise InputError(f"vehicle must be {allowed}, got {shown(preset)}{hint}")
    changes = {name: value for name, value in constants.items() if name != "preset"}
    return _PRESETS[preset].replace(**{"name": f"{preset}, changed", **changes}) if changes else _PRESETS[preset]


def vehicle_named(vehicle: VehicleLike) -> Vehicle:
    """Return a preset by name, the vehicle in a TOML file, that of a mapping of constants, or a Vehicle as it is.

    The file holds the field names of :class:`Vehicle`, at the top level or in a ``[vehicle]`` table. Raises InputError
    or FileProblem if the name is unknown, or the file cannot be read or holds something else.
    """
    if isinstance(vehicle, Vehicle):
        return vehicle
    if isinstance(vehicle, Mapping):
        return vehicle_from_mapping(dict(vehicle))
    if not isinstance(vehicle, Path) and not str(vehicle).lower().endswith(".toml"):
        return vehicle_from_mapping({"preset": vehicle})
    path = Path(vehicle)

    def make(stated: dict[str, Any]) -> Vehicle:
        return vehicle_from_mapping(stated if "preset" in stated else {"name": path.stem, **stated})

    return from_toml_file(path, "vehicle", make)
