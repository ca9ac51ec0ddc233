"""Vehicles as others describe them: URDF and MJCF, through the physics engine, and parameters of PX4.

Each file is read as rotors of any geometry (:mod:`gaitgraph.invertibility.geometry`) and then, where they are four that
tilt, as the constants of a vehicle, with the places and spins that the file states, and axes unless they are those of
tilting arms. Body axes of URDF and MJCF are taken as x forward, y left, z up, as in ROS; those of PX4 are x forward, y right, z down.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from gaitgraph.errors import GaitgraphError, InputError, reworded, wrong
from gaitgraph.files import from_toml_file, text_of
from gaitgraph.flight.engine import engine_warnings, mujoco_library
from gaitgraph.invertibility.geometry import Geometry, geometry_from_mapping
from gaitgraph.vehicle import UNITS, Vehicle, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.invertibility.forms import FloatArray

_NEEDED = ("drag_to_thrust", "spins", "mass", "inertia")
_LIMITS = ("max_tilt", "max_tilt_rate", "max_thrust", "servo_lag", "rotor_lag")
_UNITS = {**UNITS, "spins": 'four of "clockwise" and "counterclockwise"'}
_ALIKE = 0.02  # rad by which the axes of tilting arms may differ from their own
_DIGITS = 6  # of a place in metres, more than frames are built to
_BESIDE = 1e-3  # m
_PX4 = re.compile(r"^[^#\n]*?\b(CA_(?:ROTOR|SV_TL)\w+)[ \t]*(\S*)", re.MULTILINE)
_COMPILER = {
    "fusestatic": "false",
    "balanceinertia": "true",
    "boundmass": "1e-12",
    "boundinertia": "1e-12",
}
_UP = np.array([0.0, 0.0, 1.0])
_COUNTED = "alpha1 to alpha4 are rotors {} of the file"
_MOST_TILT = 3.1415926  # below π with the digits that are printed [rad]


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """What a file states about a vehicle.

    `rotors` are as :func:`gaitgraph.invertibility.geometry.geometry_from_mapping` takes them, without `moment_ratio` if
    the file states none; `constants` those of a :class:`gaitgraph.vehicle.Vehicle`. `reasons` say why the paper's
    method does not fit, if it does not, `beside` which rotors are beside their tilt axes and taken as on them, and
    `notes` how rotors are counted.
    """

    rotors: list[dict[str, Any]]
    constants: dict[str, Any]
    reasons: tuple[str, ...]
    beside: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def missing(self) -> list[str]:
        """Names of the constants that the file does not state: of a vehicle, or of its rotors."""
        if not self.reasons:
            names = _NEEDED + _LIMITS
            return [name for name in names if name not in self.constants]
        if "moment_ratio" not in self.rotors[0]:
            return ["moment_ratio"]
        return []

    @property
    def geometry(self) -> Geometry:
        """The geometry; InputError if the file does not state the moment ratios."""
        if "moment_ratio" not in self.rotors[0]:
            rule = "the file must state the drag of its rotors; complete what gaitgraph vehicles --from prints"
            raise InputError(f"{rule}, got none for {self.constants['name']!r}")
        return geometry_from_mapping({"rotor": self.rotors})

    def as_toml(self) -> str:
        """Return a vehicle, or where the method does not fit its rotors, as TOML that ``--vehicle`` reads."""
        notes = self.reasons + self.beside + self.notes
        lines = [f"# {note}" for note in notes]
        for name, value in self.constants.items():
            if name == "name" or not self.reasons:
                lines.append(f"{name} = {json.dumps(value, ensure_ascii=False)}")
        for name in self.missing:
            unit = _UNITS.get(name, "m")
            lines.append(f"# {name} =  # {unit}, not in the file")
        if self.reasons:
            for rotor in self.rotors:
                lines += ["", "[[rotor]]"]
                for name, value in rotor.items():
                    lines.append(f"{name} = {json.dumps(value)}")
        return "\n".join(lines)


class _File(NamedTuple):
    """What a reader found: rotors, constants that do not depend on their order, tilt rates, and which are beside axes."""

    rotors: list[dict[str, Any]]
    constants: dict[str, Any]
    rates: list[float | None]  # largest tilt rate of each rotor [rad/s]
    beside: list[str]


def read_description(path: str | Path) -> Description:
    """Return what a URDF, MJCF or PX4 parameter file states about a vehicle.

    Raises FileProblem if it cannot be read, MissingExtra if mujoco is needed and not installed, and InputError, with
    the file, if it describes no rotors that tilt.
    """
    path = Path(path)
    text = text_of(path, "file")
    try:
        if re.search(r"<(robot|mujoco)\b", text):
            found = _read_model(path, text)
        elif "CA_ROTOR" in text:
            found = _read_px4(text)
        elif path.suffix.lower() == ".toml":
            found = _read_rotors(path)
        else:
            raise InputError(
                "it must be URDF (<robot>), MJCF (<mujoco>), parameters of PX4 (CA_ROTOR0_PX …) or rotors (.toml)"
            )
        for number, rotor in enumerate(found.rotors, start=1):
            low, high = rotor.get("tilt_range", (-1.0, 1.0))
            if not low < high:
                raise InputError(
                    f"the tilt range of rotor {number} must be two increasing angles, got {low:g}, {high:g}"
                )
    except GaitgraphError as error:
        raise reworded(error, f"file {str(path)!r}: {error.message}") from error
    constants = {"name": path.stem, **found.constants}
    reasons = _misfits(found.rotors)
    notes: list[str] = []
    if not reasons:
        more, notes = _four_arms(found.rotors, found.rates)
        constants = {"name": path.stem, **more, **found.constants}
    return Description(
        rotors=_tidy(found.rotors),
        constants=_tidy(constants),
        reasons=tuple(reasons),
        beside=tuple(found.beside),
        notes=tuple(notes),
    )


def vehicle_or_geometry(
    name: str, warn: Callable[[str], None] = lambda _: None
) -> Vehicle | Geometry:
    """Return the vehicle of a name or TOML file, or the geometry of a file with rotors: TOML, URDF, MJCF or PX4's.

    `warn` is called with a line for each rotor beside its tilt axis, and with one if the vehicle of
    :meth:`Description.as_toml` counts or signs tilt angles in another way than the file.
    """
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix in (".params", ".urdf", ".xml"):
        description = read_description(path)
        for note in description.beside:
            warn(note)
        if description.notes not in ((), (_COUNTED.format("1, 2, 3, 4"),)):
            warn(
                "tilt angles are counted and signed as in the file; in the vehicle of gaitgraph vehicles --from "
                f"{path.name}, {'; '.join(description.notes)}"
            )
        return description.geometry
    if suffix == ".toml" and "rotor" in from_toml_file(path, "vehicle", dict):
        return from_toml_file(path, "vehicle", geometry_from_mapping)
    return vehicle_named(name)


def _tidy(value: Any) -> Any:
    """Return plain values, numbers with twelve digits, also in lists and mappings."""
    if isinstance(value, dict):
        return {name: _tidy(part) for name, part in value.items()}
    if isinstance(value, str):
        return value
    if isinstance(value, list) or np.ndim(value):
        return [_tidy(part) for part in value]
    return round(float(f"{value:.12g}"), 15) + 0.0


def _number(name: str, text: str) -> float:
    """Return the number of a text; InputError with the name if it is none."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise wrong(name, "must be a finite number", text)
    return number


def _read_px4(text: str) -> _File:
    """Return the rotors of PX4 parameters; what is not stated has PX4's default (control_allocator/module.yaml).

    The thrust axis of a rotor that tilts is upright, whatever its own parameters are. At tilt angle a it is (sin a, 0,
    −cos a) in PX4's axes, turned about z by the tilt direction.
    """
    stated = {name: _number(name, value) for name, value in _PX4.findall(text)}
    count = int(stated.get("CA_ROTOR_COUNT", 0))
    if not 1 <= count <= 64:
        raise wrong("CA_ROTOR_COUNT", "must be the number of rotors", count)
    rotors = []
    for k in range(count):
        own = f"CA_ROTOR{k}_"
        x, y, z = (stated.get(f"{own}P{axis}", 0.0) for axis in "XYZ")
        ratio = stated.get(f"{own}KM", 0.05)
        rotor: dict[str, Any] = {"position": [x, -y, -z], "moment_ratio": ratio}
        servo = int(stated.get(f"{own}TILT", 0))
        if servo:
            tilt = f"CA_SV_TL{servo - 1}_"
            toward = math.radians(stated.get(f"{tilt}TD", 0.0))
            low, high = stated.get(f"{tilt}MINA", 0.0), stated.get(f"{tilt}MAXA", 90.0)
            rotor["tilt_axis"] = [math.sin(toward), math.cos(toward), 0.0]
            rotor["tilt_range"] = [math.radians(low), math.radians(high)]
        else:
            x, y = stated.get(f"{own}AX", 0.0), stated.get(f"{own}AY", 0.0)
            rotor["thrust_axis"] = [x, -y, -stated.get(f"{own}AZ", -1.0)]
        rotors.append(rotor)
    return _File(rotors, {}, [None] * count, [])


def _read_rotors(path: Path) -> _File:
    """Return the rotors of a TOML file with a list of them."""
    geometry = from_toml_file(path, "vehicle", geometry_from_mapping)
    columns = zip(
        geometry.position,
        geometry.moment_ratio,
        geometry.thrust_axis,
        geometry.tilt_axis,
        geometry.tilt_range,
        strict=True,
    )
    rotors = []
    for position, ratio, thrust, tilt, limits in columns:
        rotor: dict[str, Any] = {"position": position, "moment_ratio": ratio}
        rotor["thrust_axis"] = thrust
        if tilt.any():
            rotor["tilt_axis"] = tilt
        if np.isfinite(limits).all():
            rotor["tilt_range"] = limits
        rotors.append(rotor)
    return _File(rotors, {}, [None] * len(rotors), [])


def _read_model(path: Path, text: str) -> _File:
    """Return what a URDF or MJCF model states at its zero configuration."""
    mujoco = mujoco_library()
    robot = None
    try:
        with engine_warnings():
            if "</robot>" in text:
                robot = _plain_urdf(text)
                plain = ElementTree.tostring(robot, encoding="unicode")
                model = mujoco.MjModel.from_xml_string(plain)
            else:
                model = mujoco.MjModel.from_xml_path(str(path))
            data = mujoco.MjData(model)
            for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_crb):
                step(model, data)
    except (ValueError, ElementTree.ParseError) as error:
        hint = "; expand xacro first" if "xacro:" in text else ""
        reason = " ".join(str(error).split())
        raise InputError(
            f"the physics engine cannot read it ({reason}){hint}"
        ) from None
    for values in (data.xipos, data.xanchor, model.body_inertia, model.body_mass):
        if not (np.abs(values) <= 1e9).all():
            raise InputError("its numbers must be within ±1e9 (SI)")
    return _Model(mujoco, model, data, robot).read()


def _plain_urdf(text: str) -> ElementTree.Element:
    """Return URDF with links and joints alone; the physics engine needs no meshes for places and masses."""
    robot = ElementTree.fromstring(text)  # noqa: S314
    for parent in (robot, *robot.findall("link")):
        for child in list(parent):
            if child.tag in ("mujoco", "visual", "collision"):
                parent.remove(child)
    extension = ElementTree.SubElement(robot, "mujoco")
    ElementTree.SubElement(extension, "compiler", _COMPILER)
    return robot


class _Place(NamedTuple):
    """A rotor of a model: its body, where its thrust acts and where to, and its moment ratio, None if not stated."""

    body: int
    place: FloatArray
    thrust: FloatArray
    ratio: float | None


class _Model:
    """A model in the engine, and the URDF that it was read from, if it was.

    A rotor is an actuator at a site, whose gear has its thrust and drag; else a hinge that turns about body z; else the
    centre of mass of an arm. An arm is a body with a hinge across the thrust.
    """

    def __init__(
        self, mujoco: Any, model: Any, data: Any, robot: ElementTree.Element | None
    ) -> None:
        self.mujoco, self.model, self.data, self.robot = mujoco, model, data, robot
        is_hinge = model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)
        self.hinges = np.flatnonzero(is_hinge).tolist()

    def read(self) -> _File:
        """Return the rotors and what is known of the whole."""
        model, data = self.model, self.data
        places = self._places()
        root = int(model.body_rootid[places[0].body])
        center, turn = data.subtree_com[root], data.xmat[root].reshape(3, 3)
        rotors: list[dict[str, Any]] = []
        rates: list[float | None] = []
        beside, swings = list[str](), list[float]()
        for number, rotor_place in enumerate(places, start=1):
            thrust, place = rotor_place.thrust, rotor_place.place
            rotor: dict[str, Any] = {"thrust_axis": turn.T @ thrust}
            rate = None
            joint = self._tilting(rotor_place.body, thrust)
            if joint is not None:
                axis, anchor = data.xaxis[joint], data.xanchor[joint]
                rotor["tilt_axis"] = turn.T @ axis
                # A shift along the thrust has no moment.
                place = place - ((place - anchor) @ thrust) * thrust
                off = np.linalg.norm(np.cross(axis, place - anchor))
                if off > _BESIDE:
                    beside.append(
                        f"rotor {number} is {1e3 * off:.3g} mm beside its tilt axis: taken as on it"
                    )
                swings.append(float(model.dof_M0[model.jnt_dofadr[joint]]))
                tilt_range, rate = self._limits(joint)
                if tilt_range is not None:
                    rotor["tilt_range"] = tilt_range
            rotor["position"] = turn.T @ (place - center)
            if rotor_place.ratio is not None:
                rotor["moment_ratio"] = rotor_place.ratio
            rotors.append(rotor)
            rates.append(rate)
        return _File(rotors, self._constants(root, turn, swings), rates, beside)

    def _constants(
        self, root: int, turn: FloatArray, swings: list[float]
    ) -> dict[str, Any]:
        """Return what is known beside the rotors, the inertia at α = 0 about the centre of mass."""
        model = self.model
        inertia = self.data.crb[root, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
        constants = {
            "mass": model.body_subtreemass[root],
            "inertia": np.diag(turn.T @ inertia @ turn),
        }
        if swings:
            constants["arm_inertia"] = np.mean(swings)
        gravity = np.linalg.norm(model.opt.gravity)
        if gravity and self.robot is None:
            constants["gravity"] = gravity
        kinds = self.mujoco.mjtDyn
        filters = [int(kinds.mjDYN_FILTER), int(kinds.mjDYN_FILTEREXACT)]
        lags = model.actuator_dynprm[np.isin(model.actuator_dyntype, filters), 0]
        if lags.size:
            constants["rotor_lag"] = lags[0]
        return constants

    def _places(self) -> list[_Place]:
        """Return where the rotors are."""
        model, data = self.model, self.data
        at_site = int(self.mujoco.mjtTrn.mjTRN_SITE)
        places, turning, arms = list[_Place](), list[_Place](), list[_Place]()
        for k in np.flatnonzero(model.actuator_trntype == at_site):
            push, turning = model.actuator_gear[k].reshape(2, 3)
            site = model.actuator_trnid[k, 0]
            if push.any():
                thrust = data.site_xmat[site].reshape(3, 3) @ push
                thrust /= np.linalg.norm(push)
                ratio = -float(turning @ push / (push @ push))
                body = int(model.site_bodyid[site])
                places.append(_Place(body, data.site_xpos[site], thrust, ratio))
        for joint in self.hinges:
            body = int(model.jnt_bodyid[joint])
            if abs(data.xaxis[joint][2]) < 0.9:
                arms.append(_Place(body, data.subtree_com[body], _UP, None))
            else:
                turning.append(_Place(body, data.xanchor[joint], _UP, None))
        for rotors in (places, turning, arms):
            for rotor in rotors:
                if self._tilting(rotor.body, rotor.thrust) is not None:
                    return rotors
        raise InputError(
            "it must have arms, bodies with a hinge across the thrust of a rotor, got none"
        )

    def _tilting(self, body: int, thrust: FloatArray) -> int | None:
        """Return the nearest hinge across the thrust between a body and the root."""
        model, data = self.model, self.data
        while body:
            for joint in self.hinges:
                is_here = model.jnt_bodyid[joint] == body
                if is_here and abs(data.xaxis[joint] @ thrust) < 0.9:
                    return int(joint)
            body = int(model.body_parentid[body])
        return None

    def _limits(self, joint: int) -> tuple[list[float] | None, float | None]:
        """Return the tilt range of a joint [rad], and its largest rate [rad/s], None where they are not stated."""
        model = self.model
        if self.robot is None:
            if model.jnt_limited[joint]:
                return model.jnt_range[joint].tolist(), None
            return None, None
        name = self.mujoco.mj_id2name(model, int(self.mujoco.mjtObj.mjOBJ_JOINT), joint)
        limit = self.robot.find(f"joint[@name='{name}']/limit")
        if limit is None:
            return None, None
        stated = {}
        for key, text in limit.items():
            stated[key] = _number(f"limit {key} of joint {name!r}", text)
        rate = stated.get("velocity") or None  # some exporters write 0 for none
        if not {"lower", "upper"} <= stated.keys():
            return None, rate
        return [stated["lower"], stated["upper"]], rate


def _misfits(rotors: list[dict[str, Any]]) -> list[str]:
    """Return why the paper's method does not fit rotors."""
    reasons = []
    if len(rotors) != 4:
        noun = "rotor" if len(rotors) == 1 else "rotors"
        reasons.append(f"it has {len(rotors)} {noun}, not four")
    if not all("tilt_axis" in rotor for rotor in rotors):
        reasons.append("not every rotor tilts")
    return [f"The paper's method does not fit: {reason}." for reason in reasons]


def _four_arms(
    rotors: list[dict[str, Any]], rates: list[float | None]
) -> tuple[dict[str, Any], list[str]]:
    """Return constants of a vehicle from four rotors and their largest tilt rates, and how its angles are theirs."""
    # Rotors are counted counter-clockwise from the first.
    x, y, _ = np.transpose([rotor["position"] for rotor in rotors])
    angles = np.arctan2(y, x)
    order = np.argsort((angles - angles[0] + 1e-6) % math.tau, kind="stable")
    arms = [rotors[k] for k in order]
    notes = [_COUNTED.format(_numbers_of(order))]
    places = np.array([arm["position"] for arm in arms])
    constants: dict[str, Any] = {"rotor_positions": np.round(places, _DIGITS)}
    if all("moment_ratio" in arm for arm in arms):
        ratios = np.array([arm["moment_ratio"] for arm in arms])
        constants["drag_to_thrust"] = _one_or_four(np.abs(ratios))
        spins = np.where(ratios > 0, "counterclockwise", "clockwise")
        constants["spins"] = spins.tolist()
    outward = places * [1.0, 1.0, 0.0]
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    axes = np.array([arm["tilt_axis"] for arm in arms])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    inward = np.sum(axes * outward, axis=1) < -1e-9
    axes[inward] *= -1.0
    if np.abs(axes - outward).max() > _ALIKE:
        constants["tilt_axes"] = axes
    thrusts = np.array([arm.get("thrust_axis", _UP) for arm in arms])
    if np.abs(thrusts - _UP).max() > _ALIKE:
        constants["thrust_axes"] = thrusts
    if inward.any():
        which = _numbers_of(np.sort(order[inward]))
        notes.append(
            f"tilt axes of rotors {which} of the file point inward: their angles have the other sign there"
        )
    if any("tilt_range" in arm for arm in arms):
        ranges = np.array(
            [arm.get("tilt_range", [-_MOST_TILT, _MOST_TILT]) for arm in arms]
        )
        ranges[inward] = -ranges[inward, ::-1]
        low, high = np.clip(ranges, -_MOST_TILT, _MOST_TILT).T
        constants["max_tilt"] = _one_or_four(high)
        if np.abs(low + high).max() > 1e-9:
            constants["min_tilt"] = _one_or_four(low)
    if None not in rates:
        constants["max_tilt_rate"] = _one_or_four(np.array(rates)[order])
    return constants, notes


def _numbers_of(rotors: Any) -> str:
    return ", ".join(map(str, rotors + 1))


def _one_or_four(values: FloatArray) -> Any:
    """Return a constant of all arms, or four if they differ."""
    if np.ptp(values) > 1e-9:
        return values
    return values[0]
