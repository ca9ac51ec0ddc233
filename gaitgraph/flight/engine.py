"""A tilt-rotor in the physics engine MuJoCo: a free body, four arms on tilting hinges, four rotors at their ends.

Body axes and signs are those of :mod:`gaitgraph.vehicle`. Thrust pushes along the tilted rotor axis, and the rotor's
drag torques the body about the same axis against its spin; neither has a moment about the hinge, so that arms which
are held take nothing of them. Servos hold the hinges by stiff position actuators.
"""

from __future__ import annotations

import math
import os
from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, needs_extra, shown
from gaitgraph.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["Engine", "engine_of", "mjcf_of", "mujoco_library", "without_log"]

FloatArray = npt.NDArray[np.float64]

_LIGHT = 1e-6  # of the vehicle's least moment of inertia, for arms that state none
_STIFF = 0.3  # natural frequency of the servos' hold on the hinges, per step of the engine
_BOX = 0.05  # size of the arms' box of equal inertia, of the arm's length
_MOST_ARM_MASS = 0.02  # of the vehicle's mass
_AIR = ' density="1.225" viscosity="1.8e-5"'
_LEAST_INERTIA = 1e-9  # kg m²; the engine takes no body of less than 1e-15, and arms have a millionth

_STEPS = (1e-6, 1.0)  # s

_NEEDED = ("mass", "inertia", "arm_length")


def mujoco_library() -> Any:
    """Return the module mujoco, or raise MissingExtra."""
    try:
        import mujoco
    except ImportError as error:
        raise needs_extra("mujoco", "flight in a physics engine", "sim") from error
    except (AttributeError, OSError, RuntimeError) as error:  # it loads OpenGL as MUJOCO_GL says
        way = os.environ.get("MUJOCO_GL", "")
        try:
            os.environ["MUJOCO_GL"] = "disable"  # flight needs no OpenGL; what renders says itself that it cannot
            import mujoco
        except (AttributeError, OSError, RuntimeError):
            told = f"mujoco: it does not load with MUJOCO_GL={shown(way)}; allowed is what works, or none"
            raise InputError(told) from error
        finally:
            os.environ["MUJOCO_GL"] = way
    return mujoco


_SILENCE = Lock()
_before: list[Any] = []  # what took the engine's warnings before, once for every flight that is under way
_listeners: dict[int, list[str]] = {}


@contextmanager
def without_log() -> Iterator[list[str]]:
    """Take the warnings of all engines into a list; otherwise they write a file in the working folder.

    What took warnings before takes them again once the last flight of the process is over.
    """
    mujoco = mujoco_library()
    heard: list[str] = []
    with _SILENCE:
        _before.append(_before[0] if _before else mujoco.get_mju_user_warning())
        _listeners[id(heard)] = heard
        mujoco.set_mju_user_warning(_hear)
    try:
        yield heard
    finally:
        with _SILENCE:
            del _listeners[id(heard)]
            before = _before.pop()
            if not _before:
                mujoco.set_mju_user_warning(before)


def _hear(text: str) -> None:
    for heard in tuple(_listeners.values()):
        heard.append(text)


class Engine:
    """A vehicle in the engine: its model, its state, and where in them things are.

    Attributes
    ----------
    model, data
        `mujoco.MjModel` and `mujoco.MjData`. ``qpos`` holds position, quaternion (w, x, y, z) and the four tilt
        angles; ``qvel`` the velocity in the world, the angular velocity in the body, and the tilt rates; ``ctrl`` four
        thrusts [N] along the tilted axes, then four servo commands [rad].
    vehicle
        What it was built from.
    """

    __slots__ = ("_warnings", "data", "model", "mujoco", "vehicle")

    def __init__(self, vehicle: Vehicle, *, step: float = 1e-3, air: bool = False) -> None:
        self.mujoco = mujoco_library()
        self.vehicle = vehicle
        text = mjcf_of(vehicle, step=step, air=air)
        try:
            self.model = self.mujoco.MjModel.from_xml_string(text)
        except ValueError as error:  # constants of extreme sizes
            said = " ".join(str(error).split())
            raise InputError(
                f"vehicle {vehicle.name!r}: the physics engine does not take its constants ({said}); allowed are mass, "
                "inertia and arm length that fit each other"
            ) from None
        self.data = self.mujoco.MjData(self.model)
        kinds = self.mujoco.mjtWarning
        bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC, kinds.mjWARN_BADCTRL)
        self._warnings = tuple(self.data.warning[int(kind)] for kind in bad)

    @property
    def gave_up(self) -> bool:
        """Whether a thrust or a motion was beyond 1e10 (SI) since :meth:`place`: what came next means nothing."""
        return any(warning.number for warning in self._warnings)

    def place(
        self, alpha: npt.ArrayLike, *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0, rates: npt.ArrayLike = 0
    ) -> None:
        """Put the vehicle at rest at the origin, at an attitude [rad]; tilt angles [rad], tilt rates [rad/s]."""
        data = self.data
        self.mujoco.mj_resetData(self.model, data)
        data.qpos[:3] = 0.0
        data.qpos[3:7] = quaternion_of(roll, pitch, yaw)
        data.qpos[7:] = alpha
        data.qvel[6:] = rates
        data.ctrl[4:] = alpha
        self.mujoco.mj_forward(self.model, data)

    def servo_commands(self, alpha: FloatArray) -> FloatArray:
        """Return what the servos are told at every step, so that the hinges are at given angles after each.

        Parameters
        ----------
        alpha
            Angles at the steps, the first one among them, shape (n + 1, 4) [rad].

        Returns
        -------
        array of shape (n, 4)
            [rad]. The engine's integrator, implicit in the servos' damping, makes of them just these angles, but for
            what the body's angular acceleration ω̇ does to an arm: it lags by up to about |ω̇|·step²/0.09 [rad], which
            is 0.3 mrad at 30 rad/s² and 1 ms.
        """
        moved = np.diff(alpha, axis=0)
        before = np.concatenate([moved[:1], moved[:-1]])
        return np.asarray(alpha[:-1] + ((1.0 + 2.0 * _STIFF) * moved - before) / _STIFF**2)

    def wrench(self) -> FloatArray:
        """Return the force (body axes) [N] and the torque [N m] that the rotors put on the vehicle, shape (6,)."""
        turned = np.empty(9)
        self.mujoco.mju_quat2Mat(turned, self.data.qpos[3:7])
        applied = self.data.qfrc_actuator
        return np.concatenate([turned.reshape(3, 3).T @ applied[:3], applied[3:6]])


def engine_of(vehicle: Vehicle, *, step: float = 1e-3, air: bool = False) -> Engine:
    """Return a vehicle in the physics engine.

    Parameters
    ----------
    vehicle
        With mass, inertia and arm length.
    step
        Of the engine's integrator (implicit in velocities), 1e-6 to 1 [s].
    air
        Whether there is air, for wind.

    Raises
    ------
    MissingConstant
        If the vehicle lacks a constant that motion depends on.
    InputError
        If its moments of inertia cannot be those of a rigid body, or a value is not allowed.
    MissingExtra
        If mujoco is not installed.

    Notes
    -----
    Arms without a stated inertia have a millionth of the vehicle's, so that they do not move the body; stated ones
    are taken out of the body's, which is then the same in all about upright arms. An arm's inertia counts alike about
    all its axes. A flat body, whose largest moment is the sum of the others, loses four millionths of the least moment
    about that axis, for what is left without the arms is to be a rigid body too.
    """
    return Engine(vehicle, step=step, air=air)


def _check_arguments(vehicle: Any, step: Any, air: Any) -> None:
    if not isinstance(vehicle, Vehicle):
        raise InputError(f"vehicle: {shown(vehicle)}; allowed is a Vehicle")
    if not _STEPS[0] <= number_of(step) <= _STEPS[1]:
        raise InputError(f"step: {shown(step)}; allowed is a number of seconds from {_STEPS[0]:g} to {_STEPS[1]:g}")
    if not isinstance(air, bool):
        raise InputError(f"air: {shown(air)}; allowed are True and False")


def _is_rigid(moments: Sequence[float]) -> bool:
    return min(moments) > 0.0 and sum(moments) >= 2.0 * max(moments) * (1.0 - 1e-9)


def quaternion_of(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the unit quaternion (w, x, y, z) of z–y–x Euler angles [rad]."""
    (cr, cp, cy), (sr, sp, sy) = (
        [function(angle / 2) for angle in (roll, pitch, yaw)] for function in (math.cos, math.sin)
    )
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def mjcf_of(vehicle: Vehicle, *, step: float = 1e-3, air: bool = False) -> str:
    """Return a vehicle as the engine's own model format (MJCF); parameters and errors as for :func:`engine_of`.

    >>> from gaitgraph.vehicle import PAPER
    >>> mjcf_of(PAPER).count('<joint name="tilt')
    4
    """
    _check_arguments(vehicle, step, air)
    step = float(step)
    mass, inertia, length = vehicle.require(*_NEEDED, purpose="flight")
    arm = vehicle.arm_inertia if vehicle.arm_inertia is not None else _LIGHT * min(inertia)
    arm_mass = min(arm / (_BOX * length) ** 2, _MOST_ARM_MASS * mass)
    body = [moment - 4.0 * arm for moment in inertia]
    if vehicle.arm_inertia is None and _is_rigid(inertia):
        largest = max(range(3), key=body.__getitem__)
        body[largest] = min(body[largest], sum(body[:largest] + body[largest + 1 :]))
    if not _is_rigid(body):
        said = f"; four arms take {4 * arm:.4g} of each" if vehicle.arm_inertia is not None else ""
        raise InputError(
            f"inertia: {list(inertia)} of vehicle {vehicle.name!r} is not that of a rigid body{said}; allowed are "
            "three positive moments (kg m²), none of them more than the sum of the others"
        )
    if min(inertia) < _LEAST_INERTIA:
        raise InputError(
            f"inertia: {list(inertia)} of vehicle {vehicle.name!r} is too small for the physics engine; allowed is "
            f"{_LEAST_INERTIA:g} (kg m²) and more"
        )
    stiffness = arm * (_STIFF / step) ** 2
    damping = 2.0 * arm * _STIFF / step
    drag = vehicle.drag_ratio * length
    spin = -1.0 if vehicle.first_rotor_spin == "clockwise" else 1.0
    arms, thrusts, servos = [], [], []
    for k in range(4):
        azimuth = vehicle.first_arm_angle + k * math.pi / 2
        half = azimuth / 2
        turning = spin if k % 2 == 0 else -spin
        tone = "0.85 0.3 0.25 1" if k == 0 else "0.25 0.35 0.45 1"
        arms.append(
            f'   <body name="arm{k + 1}" quat="{math.cos(half)!r} 0 0 {math.sin(half)!r}">\n'
            f'    <inertial pos="0 0 0" mass="{arm_mass!r}" diaginertia="{arm!r} {arm!r} {arm!r}"/>\n'
            f'    <joint name="tilt{k + 1}" type="hinge" axis="1 0 0"/>\n'
            f'    <site name="rotor{k + 1}" pos="{length!r} 0 0" size="{0.01 * length!r}"/>\n'
            f'    <geom class="seen" type="capsule" fromto="{0.15 * length!r} 0 0 {length!r} 0 0" '
            f'size="{0.035 * length!r}" rgba="{tone}"/>\n'
            f'    <geom class="seen" type="cylinder" pos="{length!r} 0 {0.12 * length!r}" '
            f'size="{0.55 * length!r} {0.012 * length!r}" rgba="{tone.removesuffix("1")}0.45"/>\n'
            f'    <geom class="seen" type="cylinder" pos="{length!r} 0 {0.06 * length!r}" '
            f'size="{0.07 * length!r} {0.08 * length!r}" rgba="{tone}"/>\n'
            "   </body>"
        )
        thrusts.append(f'  <general name="thrust{k + 1}" site="rotor{k + 1}" gear="0 0 1 0 0 {-turning * drag!r}"/>')
        servos.append(f'  <position name="servo{k + 1}" joint="tilt{k + 1}" kp="{stiffness!r}" kv="{damping!r}"/>')
    base = [
        f'<geom class="seen" type="cylinder" size="{0.2 * length!r} {0.07 * length!r}" rgba="0.9 0.9 0.92 1"/>',
        f'<geom class="seen" type="capsule" fromto="{0.15 * length!r} 0 0 {0.32 * length!r} 0 0" '
        f'size="{0.03 * length!r}" rgba="0.95 0.75 0.2 1"/>',
    ]
    physics = f'timestep="{step!r}" gravity="0 0 {-vehicle.gravity!r}" integrator="implicitfast"{_AIR if air else ""}'
    moments = " ".join(repr(moment) for moment in body)
    lines = [
        '<mujoco model="tilt-rotor">',
        ' <compiler angle="radian" autolimits="true"/>',
        f" <option {physics}>",
        '  <flag contact="disable" constraint="disable"/>',
        " </option>",
        ' <visual><headlight ambient="0.45 0.45 0.45"/><global offwidth="1280" offheight="960"/></visual>',
        ' <default><default class="seen"><geom contype="0" conaffinity="0" mass="0" group="1"/></default></default>',
        " <asset>",
        '  <texture name="sky" type="skybox" builtin="gradient" rgb1="0.93 0.95 0.98" rgb2="0.72 0.8 0.9" '
        'width="64" height="64"/>',
        '  <texture name="grid" type="2d" builtin="checker" rgb1="0.84 0.86 0.88" rgb2="0.78 0.8 0.83" '
        'width="256" height="256"/>',
        '  <material name="grid" texture="grid" texrepeat="1 1" texuniform="true"/>',
        " </asset>",
        " <worldbody>",
        '  <light pos="0 0 6" dir="0.2 0.2 -1" directional="true"/>',
        f'  <geom class="seen" name="floor" type="plane" pos="0 0 {-8 * length!r}" size="0 0 1" material="grid"/>',
        '  <body name="vehicle">',
        '   <freejoint name="base"/>',
        f'   <inertial pos="0 0 0" mass="{mass - 4 * arm_mass!r}" diaginertia="{moments}"/>',
        *(f"   {line}" for line in base),
        *arms,
        "  </body>",
        " </worldbody>",
        " <actuator>",
        *thrusts,
        *servos,
        " </actuator>",
        "</mujoco>",
    ]
    return "\n".join(lines) + "\n"
