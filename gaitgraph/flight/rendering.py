"""A flight as the engine renders it off-screen, in another process: what draws may end the process that it fails in."""

from __future__ import annotations

import io
import math
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.flight.engine import mjcf_of, mujoco_library, quaternion_of
from gaitgraph.plots.scenes import DEFAULT_VIEW

if TYPE_CHECKING:
    from gaitgraph.flight.records import Flight
    from gaitgraph.vehicle import Vehicle

__all__ = ["check_rendering", "rendered_frames"]

FloatArray = npt.NDArray[np.float64]

WIDTH, HEIGHT = 480, 360
_AWAY = 6.0  # arm lengths from the camera to the vehicle
_LONGEST = 300.0  # seconds
_CHILD = "from gaitgraph.flight.rendering import _render; _render()"


def check_rendering(vehicle: Vehicle) -> None:
    """Raise InputError if the engine cannot render here, and MissingExtra if mujoco is missing."""
    mujoco_library()
    upright = np.concatenate([np.zeros(3), quaternion_of(0.0, 0.0, 0.0), np.zeros(4)])
    _frames(vehicle, upright[None, :])


def rendered_frames(flight: Flight, times: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return pictures of a flight at some times [s], shape (n, 360, 480, 3), followed by the camera.

    The variable ``MUJOCO_GL`` says how, as for the engine; otherwise EGL and OSMesa are tried on Linux. The same flight
    gives the same pictures only on the same machine.

    Raises
    ------
    InputError
        If the engine cannot render here.
    """
    rows = np.clip(np.searchsorted(flight.column("t"), np.asarray(times) + 1e-12) - 1, 0, len(flight.rows) - 1)
    place = np.stack([flight.column(name)[rows] for name in "xyz"], axis=-1)
    angles = np.stack([flight.column(name)[rows] for name in ("roll", "pitch", "yaw")], axis=-1)
    tilts = np.stack([flight.column(f"alpha{k + 1}")[rows] for k in range(4)], axis=-1)
    turned = np.array([quaternion_of(*row) for row in angles.tolist()])
    return _frames(flight.vehicle, np.hstack([place, turned, tilts]))


def _frames(vehicle: Vehicle, states: FloatArray) -> npt.NDArray[np.uint8]:
    (length,) = vehicle.require("arm_length", purpose="a picture of flight")
    stream = io.BytesIO()
    np.savez(stream, model=np.array(mjcf_of(vehicle)), states=states, distance=_AWAY * length)
    known = os.environ.get("MUJOCO_GL")
    ways = [known] if known else ["egl", "osmesa"] if sys.platform.startswith("linux") else [""]
    size = (len(states), HEIGHT, WIDTH, 3)
    for way in ways:
        environment = os.environ | ({"MUJOCO_GL": way, "PYOPENGL_PLATFORM": way} if way in ("egl", "osmesa") else {})
        try:
            done = subprocess.run(  # noqa: S603
                [sys.executable, "-c", _CHILD],
                input=stream.getvalue(),
                capture_output=True,
                check=False,
                env=environment,
                timeout=_LONGEST,
            )
        except subprocess.TimeoutExpired:
            continue
        if not done.returncode and len(done.stdout) == math.prod(size):
            return np.frombuffer(done.stdout, dtype=np.uint8).reshape(size)
    raise InputError(
        f"film: the engine cannot render here ({', '.join(way or 'its own way' for way in ways)} tried); allowed is "
        "where OpenGL works, or a drawn film"
    )


def _render() -> None:
    """Read a model and states from standard input, and write pictures of them to standard output; the child's part."""
    mujoco: Any = mujoco_library()
    with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as told:
        model = mujoco.MjModel.from_xml_string(str(told["model"]))
        states, distance = told["states"], float(told["distance"])
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    azimuth, elevation = (math.degrees(angle) for angle in DEFAULT_VIEW)
    camera.azimuth, camera.elevation, camera.distance = azimuth + 180.0, -elevation, distance
    # Both lights together are too bright, and shadows on an endless floor are coarse.
    model.vis.headlight.ambient, model.vis.headlight.diffuse = [0.45] * 3, [0.4] * 3
    model.light_diffuse[:], model.light_specular[:] = 0.35, 0.0
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        for state in states:
            data.qpos[:] = state
            camera.lookat[:] = state[:3]
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
            sys.stdout.buffer.write(renderer.render().tobytes())
    sys.stdout.buffer.flush()
