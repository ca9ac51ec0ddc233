"""A tilt-rotor in the physics engine MuJoCo: its model and its state.

The model is a free body with four arms on tilting hinges and a rotor at the end of each. Body axes and signs are those
of :mod:`gaitgraph.vehicle`; hinges and rotors are at the rotor height, the centre of mass at the origin. Thrust acts
along the tilted rotor axis, and the rotor's drag torque about the same axis against its spin; neither has a moment
about the hinge. Stiff position actuators hold the hinges at the servo angles.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from copy import copy
from functools import cache, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import checked_number
from gaitgraph.errors import InputError, needs_extra, wrong
from gaitgraph.invertibility.matrices import thrust_signs
from gaitgraph.vehicle import vehicle_named

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle, VehicleLike

_LIGHT = 1e-6  # default inertia of an arm, as a share of the vehicle's least moment of inertia
_STIFF = 0.3  # natural frequency of the actuators that hold the hinges, per step of the engine
_BOX = 0.05  # size of an arm's box of equal inertia, as a share of the arm's length
_MOST_ARM_MASS = 0.02  # as a share of the vehicle's mass
_FLIGHTS_OF_A_THREAD = 64  # or more
START = 1.0  # s, the engine's time at the start of a flight


@cache
def mujoco_library() -> Any:
    """Return the module mujoco, or raise MissingExtra."""
    try:
        import mujoco
    except ImportError as error:
        raise needs_extra("mujoco", "flight in a physics engine", "sim") from error
    except (
        AttributeError,
        OSError,
        RuntimeError,
    ) as error:  # from loading the OpenGL of this variable
        raise InputError(
            f"mujoco does not load with MUJOCO_GL={os.environ.get('MUJOCO_GL')!r}; unset it"
        ) from error
    return mujoco


_lock = Lock()
_handlers: list[Any] = []  # the original one of warnings, for each flight in progress


@lru_cache(maxsize=8)
def _model_of(vehicle: Vehicle, step: float, air: bool) -> Any:
    """Return the model of a vehicle, of which each engine has a copy; errors as for :class:`Engine`."""
    text = mjcf_of(vehicle, step=step, air=air)
    try:
        return mujoco_library().MjModel.from_xml_string(text)
    except ValueError as error:  # constants of extreme sizes
        reason = " ".join(str(error).split())
        rule = "mass, inertia and arm length must be in the range of the physics engine"
        raise InputError(f"{rule}, got those of {vehicle.name!r} ({reason})") from None


@contextmanager
def engine_warnings() -> Iterator[None]:
    """Ignore the warnings of all engines, of which each would write a file into the working folder.

    The original handler of warnings is restored after the last flight of the process.
    """
    mujoco = mujoco_library()
    with _lock:
        _handlers.append(_handlers[0] if _handlers else mujoco.get_mju_user_warning())
        mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        with _lock:
            before = _handlers.pop()
            if not _handlers:
                mujoco.set_mju_user_warning(before)


class State(NamedTuple):
    """The states of many vehicles in the engine: arrays whose last axis is that of the vehicles [SI, rad]."""

    time: Any  # from START on; it starts again at zero where the engine gives up
    place: Any  # position, and quaternion (w, x, y, z)
    tilts: Any
    speed: Any  # velocity in the world, and angular velocity in the body
    tilt_rates: Any
    thrusts: Any  # that the rotors have reached; empty without a rotor lag


class Engine:
    """A vehicle in the physics engine, with the `step` of its integrator [s], and `air` where there is wind.

    Its `model` and `data` are `mujoco.MjModel` and `mujoco.MjData`. ``qpos`` holds position, quaternion (w, x, y, z)
    and the four tilt angles; ``qvel`` the velocity in the world, the angular velocity in the body, and the tilt rates;
    ``ctrl`` four thrusts [N] along the tilted axes, then four servo commands [rad]; ``act``, with a rotor lag, the
    thrusts that the rotors have reached [N].

    Raises MissingConstant if the vehicle states no mass, inertia or arm length, MissingExtra if mujoco is not
    installed, and InputError if its moments of inertia cannot be those of a rigid body.

    An arm without a stated inertia gets a millionth of the vehicle's, so that it does not move the body; the arms'
    inertia is subtracted from the body's. A flat body, whose largest moment is the sum of the others, loses four
    millionths of the least moment about that axis, since the body without the arms must be rigid too.
    """

    def __init__(
        self, vehicle: VehicleLike, *, step: float = 1e-3, air: bool = False
    ) -> None:
        vehicle = vehicle_named(vehicle)
        step = checked_number("step", step, "a positive number (s)", above=True)
        self.model = copy(_model_of(vehicle, step, air))
        self.data = self.mujoco.MjData(self.model)

    @property
    def mujoco(self) -> Any:
        """The module mujoco."""
        return mujoco_library()

    def place(
        self,
        alpha: npt.ArrayLike,
        *,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
        rates: npt.ArrayLike = 0.0,
    ) -> None:
        """Put the vehicle at rest at the origin, with an attitude [rad], tilt angles [rad] and tilt rates [rad/s]."""
        data = self.data
        self.mujoco.mj_resetData(self.model, data)
        data.time = START
        data.qpos[:3] = 0.0
        data.qpos[3:7] = quaternions(roll, pitch, yaw)
        data.qpos[7:] = alpha
        data.qvel[6:] = rates
        data.ctrl[4:] = alpha
        self.mujoco.mj_forward(self.model, data)

    @property
    def gave_up(self) -> bool:
        """Whether an acceleration exceeded 1e10 (SI) since :meth:`place`; later states are invalid."""
        return bool(self.data.time < START)

    @property
    def lags(self) -> bool:
        """Whether the rotors lag behind their commands."""
        return bool(self.model.na)

    def servo_commands(self, alpha: FloatArray) -> FloatArray:
        """Return the actuators' commands [rad], shape (n, 4), that put the hinges at angles of shape (n + 1, 4) [rad].

        The engine's integrator, implicit in the actuators' damping, then reaches these angles exactly, except that the
        body's angular acceleration ω̇ makes an arm lag by up to about |ω̇|·step²/0.09 [rad], 0.3 mrad at 30 rad/s² and
        1 ms.
        """
        moved = np.diff(alpha, axis=0)
        before = np.concatenate([moved[:1], moved[:-1]])
        return np.asarray(
            alpha[:-1] + ((1.0 + 2.0 * _STIFF) * moved - before) / _STIFF**2
        )


class Fleet:
    """Copies of a vehicle in an engine that fly side by side on all cores, from attitudes of shape (n, 2) [rad].

    What they do does not depend on the number of cores. Use it in a ``with`` statement, which ends its threads.
    """

    def __init__(self, engine: Engine, attitudes: FloatArray) -> None:
        from mujoco.rollout import Rollout

        data, model, kinds = engine.data, engine.model, engine.mujoco.mjtState
        state = np.concatenate([[data.time], data.qpos, data.qvel, data.act])
        self._model = model
        self._rows = np.tile(state, (len(attitudes), 1))
        self._rows[:, 4:8] = quaternions(*attitudes.T)
        self._inputs = kinds.mjSTATE_CTRL.value | kinds.mjSTATE_QFRC_APPLIED.value
        self._threads = max(
            min(os.cpu_count() or 1, len(attitudes) // _FLIGHTS_OF_A_THREAD), 1
        )
        self._copies = [engine.mujoco.MjData(model) for _ in range(self._threads)]
        self._pool = Rollout(nthread=self._threads if self._threads > 1 else 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def state(self) -> State:
        """Return the states of all, as a copy."""
        sizes = np.cumsum([1, 7, 4, 6, 4])
        time, *rest = np.split(np.ascontiguousarray(self._rows.T), sizes)
        return State(time[0], *rest)

    def spin_rotors(self, thrusts: FloatArray) -> None:
        """Let rotors with a lag have reached thrusts of shape (4, n) [N]."""
        self._rows[:, 22:] = thrusts.T

    def keep(self, going: npt.NDArray[np.bool_]) -> None:
        """Go on with some of the flights."""
        if not going.all():
            self._rows = self._rows[going]

    def advance(
        self, thrusts: FloatArray, hinges: FloatArray, torque: Any = None
    ) -> None:
        """Step with thrusts of shape (4, n) [N], servo commands of each step (m, 4) [rad], and torques (3, n) [N m]."""
        count, steps, model = len(self._rows), len(hinges), self._model
        inputs = np.zeros((count, steps, model.nu + model.nv))
        inputs[:, :, :4] = thrusts.T[:, None]
        inputs[:, :, 4 : model.nu] = hinges
        if torque is not None:
            turning = slice(model.nu + 3, model.nu + 6)  # after the forces on the body
            inputs[:, :, turning] = np.transpose(torque)[:, None]
        moved = np.empty((count, steps, self._rows.shape[1]))
        self._pool.rollout(
            [model] * count,
            self._copies,
            np.ascontiguousarray(self._rows),
            inputs,
            state=moved,
            control_spec=self._inputs,
            nstep=steps,
            skip_checks=True,
            chunk_size=max(count // (2 * self._threads), 1),
        )
        self._rows = moved[:, -1]


def quaternions(
    roll: npt.ArrayLike, pitch: npt.ArrayLike, yaw: npt.ArrayLike = 0.0
) -> FloatArray:
    """Return the unit quaternions (w, x, y, z) of z–y–x Euler angles [rad], along the last axis."""
    from scipy.spatial.transform import Rotation

    angles = np.stack(np.broadcast_arrays(yaw, pitch, roll), axis=-1)
    return np.roll(Rotation.from_euler("ZYX", angles).as_quat(), 1, axis=-1)


def mjcf_of(vehicle: Vehicle, *, step: float, air: bool) -> str:
    """Return a vehicle in the engine's model format (MJCF); parameters and errors as for :class:`Engine`."""
    mass, inertia, length = vehicle.require(
        "mass", "inertia", "arm_length", purpose="flight"
    )
    arm = vehicle.arm_inertia or _LIGHT * min(inertia)
    tilt_axes, thrust_axes = vehicle.axes
    rotors = length * np.array(vehicle.scaled_positions)
    # An arm's hinge is where its tilt axis is nearest to the centre.
    reaches = np.sum(rotors * tilt_axes, axis=1)
    hinges = rotors - reaches[:, None] * tilt_axes
    farthest = np.linalg.norm(hinges, axis=1).max()
    arm_mass = min(arm / ((_BOX * length) ** 2 + farthest**2), _MOST_ARM_MASS * mass)
    # The arms' mass is on their hinges. The body's is as far on the other side of the centre of mass as balances it.
    body_mass = mass - 4 * arm_mass
    center = -arm_mass * hinges.sum(axis=0) / body_mass
    moved = body_mass * _about_center(center)
    for hinge in hinges:
        moved = moved + arm_mass * _about_center(hinge)
    moments, axes = np.linalg.eigh(np.diag(inertia) - 4.0 * arm * np.eye(3) - moved)
    if vehicle.arm_inertia is None and _is_rigid(inertia):
        moments[2] = min(moments[2], moments[0] + moments[1])
    if not _is_rigid(moments):
        of_arms = ""
        if vehicle.arm_inertia is not None:
            of_arms = f" without {4 * arm:.4g} of each for four arms"
        rule = f"of vehicle {vehicle.name!r} must be that of a rigid body{of_arms}"
        wanted = "three positive moments (kg m²), each at most the sum of the others"
        raise wrong("inertia", f"{rule}: {wanted}", list(inertia))
    stiffness = arm * (_STIFF / step) ** 2
    damping = 2.0 * arm * _STIFF / step
    lag = ""
    if vehicle.rotor_lag is not None:
        lag = f' dyntype="filterexact" dynprm="{vehicle.rotor_lag!r}"'
    arms = thrusts = servos = ""
    for k, spin in enumerate(thrust_signs(vehicle).tolist()):
        drag = -spin * vehicle.scaled_drags[k] * length
        across = np.cross(thrust_axes[k], tilt_axes[k])
        tilt_range = ""
        if vehicle.tilt_range is not None:
            tilt_range = f' range="{_text_of(vehicle.tilt_range[k])}"'
        arms += f"""
   <body name="arm{k + 1}" pos="{_text_of(hinges[k])}" xyaxes="{_text_of([*tilt_axes[k], *across])}">
    <inertial pos="0 0 0" mass="{arm_mass}" diaginertia="{arm} {arm} {arm}"/>
    <joint name="tilt{k + 1}" type="hinge" axis="1 0 0"{tilt_range}/>
    <site name="rotor{k + 1}" pos="{reaches[k]} 0 0" size="{0.01 * length}"/>
   </body>"""
        thrusts += f"""
  <general name="thrust{k + 1}" site="rotor{k + 1}" gear="0 0 1 0 0 {drag}"{lag}/>"""
        servos += f"""
  <position name="servo{k + 1}" joint="tilt{k + 1}" kp="{stiffness}" kv="{damping}"/>"""
    medium = ' density="1.225" viscosity="1.8e-5"' if air else ""
    return f"""<mujoco model="tilt-rotor">
 <compiler angle="radian" autolimits="true"/>
 <option timestep="{step}" gravity="0 0 {-vehicle.gravity}" integrator="implicitfast"{medium}>
  <flag contact="disable" constraint="disable"/>
 </option>
 <worldbody>
  <body name="vehicle">
   <freejoint name="base"/>
   <inertial pos="{_text_of(center)}" xyaxes="{_text_of(axes.T[:2].ravel())}" mass="{body_mass}" diaginertia="{_text_of(moments)}"/>{arms}
  </body>
 </worldbody>
 <actuator>{thrusts}{servos}
 </actuator>
</mujoco>
"""


def _about_center(place: FloatArray) -> FloatArray:
    """Return the inertia of a unit mass at a place about the origin, shape (3, 3)."""
    return np.asarray(place @ place * np.eye(3) - np.outer(place, place))


def _text_of(values: Iterable[float]) -> str:
    return " ".join(str(float(value)) for value in values)


def _is_rigid(moments: Sequence[float] | FloatArray) -> bool:
    return min(moments) > 0.0 and sum(moments) >= 2.0 * max(moments) * (1.0 - 1e-9)
