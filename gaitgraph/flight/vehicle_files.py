"""Vehicles as others describe them: URDF and MJCF, through the physics engine, and parameters of PX4.

Each file is read as rotors of any geometry (:mod:`gaitgraph.invertibility.geometry`) and then, where they are four
equal arms a quarter turn apart that tilt about themselves, as the constants of a vehicle that the paper's method fits.
Body axes of URDF and MJCF are taken as x forward, y left, z up, as in ROS; those of PX4 are x forward, y right, z down.
"""

from __future__ import annotations

import json
import math
import re
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from gaitgraph.errors import GaitgraphError, InputError, reworded
from gaitgraph.files import from_toml_file, text_of
from gaitgraph.flight.engine import engine_warnings, mujoco_library
from gaitgraph.invertibility.geometry import Geometry, geometry_from_mapping
from gaitgraph.vehicle import UNITS, Vehicle, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from gaitgraph.invertibility.forms import FloatArray

_NEEDED = ("drag_to_thrust", "first_rotor_spin", "mass", "inertia")
_LIMITS = ("max_tilt", "max_tilt_rate", "max_thrust", "servo_lag", "rotor_lag")
_UNITS = {**UNITS, "first_rotor_spin": '"clockwise" or "counterclockwise"'}
_ALIKE = 0.02  # allowed differences of arms, as a share of the arm's length, and in rad
_SQUARE = 1e-4  # the same of a square frame: what rounded numbers in a file explain
_PX4 = re.compile(r"^[^#\n]*?\b(CA_(?:ROTOR|SV_TL)\w+)[ \t]*(\S*)", re.MULTILINE)
_PLACES = ("PX", "PY", "PZ", "AX", "AY", "AZ")
_TILTS = {"MINA": 0.0, "MAXA": 90.0, "TD": 0.0}  # degrees
_COMPILER = {
    "fusestatic": "false",
    "balanceinertia": "true",
    "boundmass": "1e-12",
    "boundinertia": "1e-12",
}
_NOT_NEGATIVE = {"mass": ("value",), "inertia": ("ixx", "iyy", "izz")}
_NUMBERS = {
    **_NOT_NEGATIVE,
    "origin": ("xyz", "rpy"),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "velocity"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """What a file states about a vehicle.

    `rotors` are as :func:`gaitgraph.invertibility.geometry.geometry_from_mapping` takes them, without `moment_ratio` if
    the file states none; `constants` those of a :class:`gaitgraph.vehicle.Vehicle`. `reasons` say why the paper's
    method does not fit, if it does not, `beside` which rotors are beside their tilt axes and taken as on them, and
    `notes` how rotors are counted and what was left out.
    """

    rotors: list[dict[str, Any]]
    constants: dict[str, Any]
    reasons: tuple[str, ...]
    beside: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def missing(self) -> list[str]:
        """Names of the constants that the file does not state: of a vehicle, or of its rotors."""
        if self.reasons:
            return [] if "moment_ratio" in self.rotors[0] else ["moment_ratio"]
        return [name for name in (*_NEEDED, *_LIMITS) if name not in self.constants]

    @property
    def geometry(self) -> Geometry:
        """The geometry; InputError if the file does not state the moment ratios."""
        if "moment_ratio" not in self.rotors[0]:
            rule = "the file must state the drag of its rotors; complete what gaitgraph vehicles --from prints"
            raise InputError(f"{rule}, got none for {self.constants['name']!r}")
        return geometry_from_mapping({"rotor": self.rotors})

    def as_toml(self) -> str:
        """Return a vehicle, or where the method does not fit its rotors, as TOML that ``--vehicle`` reads."""
        lines = [f"# {note}" for note in (*self.reasons, *self.beside, *self.notes)]
        stated = {"name": self.constants["name"]} if self.reasons else self.constants
        lines += [
            f"{name} = {json.dumps(value, ensure_ascii=False)}"
            for name, value in stated.items()
        ]
        lines += [
            f"# {name} =  # {_UNITS.get(name, 'm')}, not in the file"
            for name in self.missing
        ]
        for rotor in self.rotors if self.reasons else ():
            lines += [
                "",
                "[[rotor]]",
                *(f"{name} = {json.dumps(value)}" for name, value in rotor.items()),
            ]
        return "\n".join(lines)


def read_description(path: str | Path) -> Description:
    """Return what a URDF, MJCF or PX4 parameter file states about a vehicle.

    Raises FileProblem if it cannot be read, MissingExtra if mujoco is needed and not installed, and InputError, with
    the file, if it describes no rotors that tilt, or parameters contradict each other.
    """
    path = Path(path)
    text = text_of(path, "file")
    try:
        if re.search(r"<(robot|mujoco)\b", text):
            rotors, constants, beside, notes = _of_model(path, text)
        elif "CA_ROTOR" in text:
            rotors, constants, beside, notes = _of_px4(text), {}, [], []
        else:
            raise InputError(
                "it must be URDF (<robot>), MJCF (<mujoco>) or parameters of PX4 (CA_ROTOR0_PX …)"
            )
        arms, reasons, order = _four_arms(rotors, constants.pop("max_tilt_rate", []))
        stated, rotors = (
            _tidy({"name": path.stem, **arms, **constants}),
            [_tidy(rotor) for rotor in rotors],
        )
        return Description(
            rotors=rotors,
            constants=stated,
            reasons=reasons,
            beside=tuple(beside),
            notes=(*notes, *order),
        )
    except GaitgraphError as error:
        raise reworded(error, f"file {str(path)!r}: {error.message}") from error


def vehicle_or_geometry(
    name: str, warn: Callable[[str], None] = lambda _: None
) -> Vehicle | Geometry:
    """Return the vehicle of a name or TOML file, or the geometry of a file with rotors: TOML, URDF, MJCF or PX4's.

    `warn` is called with a line for each rotor beside its tilt axis.
    """
    path = Path(name)
    if path.suffix.lower() in (".params", ".urdf", ".xml"):
        found = read_description(path)
        for note in found.beside:
            warn(note)
        return found.geometry
    if path.suffix.lower() == ".toml" and "rotor" in from_toml_file(
        path, "vehicle", dict
    ):
        return from_toml_file(path, "vehicle", geometry_from_mapping)
    return vehicle_named(name)


def _tidy(value: Any) -> Any:
    """Return numbers, also in lists and mappings, with twelve digits."""
    if isinstance(value, dict):
        return {name: _tidy(one) for name, one in value.items()}
    if isinstance(value, str):
        return value
    return (
        [_tidy(one) for one in value]
        if np.ndim(value)
        else round(float(f"{value:.12g}"), 15) + 0.0
    )


def _of_px4(text: str) -> list[dict[str, Any]]:
    """Return the rotors of PX4 parameters; what is not stated has PX4's default (control_allocator/module.yaml).

    The thrust axis of a rotor that tilts is upright, whatever its own parameters are. At tilt angle a it is (sin a, 0,
    −cos a) in PX4's axes, turned about z by the tilt direction.
    """
    stated: dict[str, float] = {}
    for name, value in _PX4.findall(text):
        number = _number(name, value, 1e3)
        if name.endswith(("COUNT", "TILT")) and not number.is_integer():
            raise InputError(f"{name} must be a whole number, got {value}")
        if stated.setdefault(name, number) != number:
            raise InputError(
                f"{name} must be stated once, got {stated[name]:g} and {number:g}"
            )
    count, tilts = (
        int(stated.get(name, 0)) for name in ("CA_ROTOR_COUNT", "CA_SV_TL_COUNT")
    )
    if not 1 <= count <= 64:
        raise InputError(f"CA_ROTOR_COUNT must be the number of rotors, got {count}")
    rotors = []
    for k in range(count):
        if not any(name.startswith(f"CA_ROTOR{k}_") for name in stated):
            raise InputError(
                f"CA_ROTOR_COUNT must be the number of rotors, got {count} without CA_ROTOR{k}_PX"
            )
        x, y, z, *axis = (
            stated.get(f"CA_ROTOR{k}_{part}", -1.0 if part == "AZ" else 0.0)
            for part in _PLACES
        )
        rotor: dict[str, Any] = {
            "position": [x, -y, -z],
            "moment_ratio": stated.get(f"CA_ROTOR{k}_KM", 0.05),
        }
        if servo := int(stated.get(f"CA_ROTOR{k}_TILT", 0)):
            if not 1 <= servo <= tilts:
                raise InputError(
                    f"CA_ROTOR{k}_TILT must be at most CA_SV_TL_COUNT = {tilts}, got {servo}"
                )
            prefix = f"CA_SV_TL{servo - 1}_"
            low, high, toward = (
                stated.get(prefix + name, value) for name, value in _TILTS.items()
            )
            if not low < high:
                raise InputError(
                    f"{prefix}MAXA must be above {prefix}MINA = {low:g}, got {high:g}"
                )
            for end, value in (("MINA", low), ("MAXA", high)):
                _number(f"{prefix}{end}", f"{value:g}", 180.0)
            turn = math.radians(toward)
            rotor["tilt_axis"] = [math.sin(turn), math.cos(turn), 0.0]
            rotor["tilt_range"] = [math.radians(low), math.radians(high)]
        else:
            rotor["thrust_axis"] = [axis[0], -axis[1], -axis[2]]
        rotors.append(rotor)
    return rotors


def _number(name: str, text: str, largest: float) -> float:
    """Return the number of a text; InputError with the name if it is none within ±largest."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not abs(number) <= largest:
        raise InputError(f"{name} must be a number within ±{largest:g}, got {text!r}")
    return number


@contextmanager
def _engine_reading(text: str, kind: type[Exception]) -> Iterator[None]:
    """Raise InputError in place of what the library of XML or the engine raises on a text that it cannot read."""
    try:
        yield
    except kind as error:
        hint = "; expand xacro first" if "xacro:" in text else ""
        raise InputError(
            f"the physics engine cannot read it ({' '.join(str(error).split())}){hint}"
        ) from None


def _urdf_for_engine(
    root: ElementTree.Element,
) -> tuple[str, dict[str, dict[str, float]]]:
    """Return URDF with links and joints alone, as the physics engine needs it, and the limits of joints by name.

    The engine needs no meshes for places and masses. InputError if a number is none, or a mass or a moment of inertia
    is negative.
    """
    limits = dict[str, dict[str, float]]()
    for parent in (root, *root.findall("link")):
        for child in [
            one for one in parent if one.tag in ("mujoco", "visual", "collision")
        ]:
            parent.remove(child)
    for part in [*root.findall("link"), *root.findall("joint")]:
        owner = f"{part.tag} {part.get('name')!r}"
        for element in part.iter():
            for name in _NUMBERS.get(element.tag, ()):
                words = element.get(name, "").split()
                numbers = [
                    _number(f"{element.tag} {name} of {owner}", word, 1e9)
                    for word in words
                ]
                if (
                    name in _NOT_NEGATIVE.get(element.tag, ())
                    and min(numbers, default=0.0) < 0
                ):
                    raise InputError(
                        f"{element.tag} {name} of {owner} must not be negative, got {words[0]}"
                    )
                if element.tag == "limit" and numbers:
                    limits.setdefault(part.get("name", ""), {})[name] = numbers[0]
    ElementTree.SubElement(
        ElementTree.SubElement(root, "mujoco"), "compiler", _COMPILER
    )
    return ElementTree.tostring(root, encoding="unicode"), limits


def _of_model(
    path: Path, text: str
) -> tuple[list[dict[str, Any]], dict[str, Any], list[str], list[str]]:
    """Return rotors of a URDF or MJCF model at its zero configuration, mass and inertia, rotors beside axes, and notes.

    A rotor is an actuator at a site, whose gear has its thrust and drag; else a hinge that turns about body z; else the
    centre of mass of an arm. An arm is a body with a hinge across the thrust.
    """
    mujoco, hinge = mujoco_library(), 3  # mjJNT_HINGE
    limits, urdf = dict[str, dict[str, float]](), "</robot>" in text
    prepared = text
    if urdf:
        with _engine_reading(text, ElementTree.ParseError):
            robot = ElementTree.fromstring(text)  # noqa: S314
        prepared, limits = _urdf_for_engine(robot)
    with engine_warnings(), _engine_reading(text, ValueError):
        if urdf:
            model = mujoco.MjModel.from_xml_string(prepared)
        else:
            model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_crb):
            step(model, data)
    used = (
        data.xipos,
        data.xanchor,
        model.body_inertia,
        model.body_mass,
        model.actuator_gear,
    )
    if not all((np.abs(one) <= 1e9).all() for one in used):
        raise InputError("its numbers must be within ±1e9 (SI)")
    hinges = [k for k in range(model.njnt) if model.jnt_type[k] == hinge]

    def tilting(body: int, thrust: FloatArray) -> int | None:
        """Return the nearest hinge across the thrust between a body and the root."""
        while body:
            for joint in hinges:
                if (
                    model.jnt_bodyid[joint] == body
                    and abs(data.xaxis[joint] @ thrust) < 0.9
                ):
                    return joint
            body = int(model.body_parentid[body])
        return None

    constants, aside, notes = dict[str, Any](), list[str](), list[str]()
    found: list[
        tuple[int, FloatArray, FloatArray, float | None]
    ] = []  # body, place, thrust axis, moment ratio
    for k in range(model.nu):
        site, (push, turning) = (
            int(model.actuator_trnid[k, 0]),
            model.actuator_gear[k].reshape(2, 3),
        )
        if model.actuator_trntype[k] == int(mujoco.mjtTrn.mjTRN_SITE) and push.any():
            along = data.site_xmat[site].reshape(3, 3) @ push / np.linalg.norm(push)
            drag = -float(turning @ push / (push @ push))
            found.append(
                (int(model.site_bodyid[site]), data.site_xpos[site], along, drag)
            )
            if model.actuator_dyntype[k] in (
                int(mujoco.mjtDyn.mjDYN_FILTER),
                int(mujoco.mjtDyn.mjDYN_FILTEREXACT),
            ):
                constants["rotor_lag"] = float(model.actuator_dynprm[k, 0])
    up = np.array([0.0, 0.0, 1.0])
    if not found:
        found = [
            (int(model.jnt_bodyid[k]), data.xanchor[k], up, None)
            for k in hinges
            if abs(data.xaxis[k][2]) >= 0.9
        ]
    if not any(tilting(body, thrust) is not None for body, _, thrust, _ in found):
        arms = {int(model.jnt_bodyid[k]) for k in hinges if abs(data.xaxis[k][2]) < 0.9}
        found = [(body, data.subtree_com[body], up, None) for body in sorted(arms)]
    if not found:
        raise InputError(
            "it must have arms, bodies with a hinge across the thrust of a rotor, got none"
        )
    root = int(model.body_rootid[found[0][0]])
    center, turn = data.subtree_com[root], data.xmat[root].reshape(3, 3)
    rotors: list[dict[str, Any]] = []
    swing, rates = list[float](), list[float]()
    for number, (body, place, push, ratio) in enumerate(found, start=1):
        rotor: dict[str, Any] = {"position": place - center, "thrust_axis": push}
        if (joint := tilting(body, push)) is not None:
            name = mujoco.mj_id2name(model, int(mujoco.mjtObj.mjOBJ_JOINT), joint)
            axis, off = data.xaxis[joint], place - data.xanchor[joint]
            rotor["position"] = (
                rotor["position"] - (off @ push) * push
            )  # a shift along the thrust has no moment
            beside = float(
                np.linalg.norm(off - (off @ push) * push - (off @ axis) * axis)
            )
            if beside > 1e-3:
                how_far = f"{1e3 * beside:.3g} mm beside its tilt axis"
                aside.append(f"rotor {number} is {how_far}: taken as on it")
            rotor["tilt_axis"] = axis
            swing.append(float(model.dof_M0[model.jnt_dofadr[joint]]))
            stated = limits.get(name, {})
            low, high = model.jnt_range[joint]
            if low > high or (
                low == high
                and (model.jnt_limited[joint] or {"lower", "upper"} <= stated.keys())
            ):
                raise InputError(
                    f"the range of joint {name!r} must be two increasing angles, got {low:g}, {high:g}"
                )
            if model.jnt_limited[joint]:
                rotor["tilt_range"] = [low, high]
            if stated.get("velocity", 1.0) <= 0:
                raise InputError(
                    f"limit velocity of joint {name!r} must be above 0, got {stated['velocity']:g}"
                )
            rates += [stated["velocity"]] if "velocity" in stated else []
        rotor = {
            name: value if name == "tilt_range" else turn.T @ value
            for name, value in rotor.items()
        }
        rotors.append(rotor if ratio is None else {**rotor, "moment_ratio": ratio})
    inertia = (
        turn.T @ data.crb[root, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]] @ turn
    )  # at α = 0, about the centre of mass
    constants |= {
        "mass": float(model.body_subtreemass[root]),
        "inertia": np.diag(inertia),
    }
    constants |= {"arm_inertia": np.mean(swing)} if swing else {}
    constants |= {"max_tilt_rate": rates} if rates else {}
    gravity = float(np.linalg.norm(model.opt.gravity))
    constants |= {"gravity": gravity} if gravity and not urdf else {}
    return rotors, constants, aside, notes


def _four_arms(
    rotors: list[dict[str, Any]], rates: list[float]
) -> tuple[dict[str, Any], tuple[str, ...], list[str]]:
    """Return constants of a vehicle, why the paper's method does not fit the rotors, and how its angles are theirs.

    `rates` are the largest tilt rates in the order of the rotors, where the file states them [rad/s].
    """
    count, up = (
        len(rotors),
        np.array([rotor.get("thrust_axis", [0, 0, 1])[2] for rotor in rotors]),
    )
    place, axis = (
        np.array([rotor.get(name, [0, 0, 0]) for rotor in rotors])
        for name in ("position", "tilt_axis")
    )
    length, angle = (
        np.hypot(place[:, 0], place[:, 1]),
        np.arctan2(place[:, 1], place[:, 0]),
    )
    order = np.argsort((angle - angle[0] + 1e-6) % (2 * math.pi))
    ratios, allowed = (
        [rotor.get("moment_ratio") for rotor in rotors],
        _ALIKE * length.mean(),
    )
    quarters = (angle[order] - np.arange(count) * math.pi / 2 - angle[0] + math.pi) % (
        2 * math.pi
    ) - math.pi
    inward = np.sum(axis[:, :2] * place[:, :2], axis=1) < 0
    across = np.abs(axis[:, 0] * place[:, 1] - axis[:, 1] * place[:, 0])
    leans = (across > allowed).any() or (np.abs(axis[:, 2]) > _ALIKE).any()
    problems = {
        f"it has {count} rotors, not four": count != 4,
        "not every rotor tilts": not axis.any(axis=1).all(),
        "not every rotor pushes straight up at α = 0": (up < 1 - _ALIKE).any(),
    }
    placed = place[order]
    half_turned = np.roll(placed, count // 2, axis=0) * [-1.0, -1.0, 1.0]
    signed = np.array([math.nan if one is None else one for one in ratios])[order] * (
        -1.0
    ) ** np.arange(count)
    opposite = np.roll(signed, count // 2)
    if count == 4:
        problems["opposite rotors are not at opposite places"] = (
            np.abs(placed - half_turned).max() > allowed
        )
    problems["its rotors do not tilt about their own arms"] = leans
    if count == 4:
        alike = np.abs(signed - opposite).max() <= _ALIKE * np.abs(signed).max()
        alternate = np.ptp(np.sign(signed)) == 0 and signed.any()
        problems[
            "its rotors do not turn alternately, opposite ones with one drag ratio"
        ] = not ((alternate and alike) or None in ratios)
    if reasons := [
        f"The paper's method does not fit: {problem}."
        for problem, holds in problems.items()
        if holds
    ]:
        return {}, tuple(reasons), []
    size = _SQUARE * length.mean()
    is_square = (
        np.ptp(length) <= size
        and np.ptp(place[:, 2]) <= size
        and np.abs(quarters).max() <= _SQUARE
    )
    constants: dict[str, Any] = {}
    if is_square:
        constants["arm_length"] = length.mean()
        constants["first_arm_angle"] = angle[0] + quarters.mean()
        if abs(height := place[:, 2].mean()) > 1e-9:
            constants["rotor_height"] = height
    else:
        constants["rotor_positions"] = ((placed + half_turned) / 2).tolist()
    if None not in ratios:
        drags = np.abs(signed + opposite) / 2
        one_for_all = np.ptp(drags) <= _SQUARE * drags.max()
        constants["drag_to_thrust"] = drags.mean() if one_for_all else drags
        constants["first_rotor_spin"] = (
            "counterclockwise" if signed[0] > 0 else "clockwise"
        )
    notes = [
        f"alpha1 to alpha4 are rotors {', '.join(str(k + 1) for k in order)} of the file"
    ]
    if inward.any():
        which = ", ".join(str(k + 1) for k in np.flatnonzero(inward))
        notes.append(
            f"tilt axes of rotors {which} of the file point inward: their angles have the other sign there"
        )
    ranges = np.array(
        [rotor.get("tilt_range", [-math.pi, math.pi]) for rotor in rotors]
    )
    if any("tilt_range" in rotor for rotor in rotors):
        notes += (
            ["tilt ranges beyond ±180° are cut to it"]
            if np.abs(ranges).max() > math.pi + 1e-3
            else []
        )
        for number in np.flatnonzero((ranges[:, 0] > 0) | (ranges[:, 1] < 0)) + 1:
            notes.append(
                f"the tilt range of rotor {number} of the file excludes hover (α = 0)"
            )
        low, high = np.clip(
            np.where(inward[:, None], -ranges[:, ::-1], ranges)[order],
            -math.pi,
            math.pi,
        ).T
        constants["max_tilt"] = _one_or_four(high)
        if np.abs(low + high).max() > 1e-9:
            constants["min_tilt"] = _one_or_four(low)
    if rates:
        constants["max_tilt_rate"] = (
            _one_or_four(np.array(rates)[order]) if len(rates) == count else min(rates)
        )
    return constants, (), notes


def _one_or_four(values: FloatArray) -> Any:
    return values if np.ptp(values) > 1e-9 else values[0]
