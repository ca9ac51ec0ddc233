"""The engine's own viewer: a flight again, as long as it took, where there is a screen."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.errors import InputError
from gaitgraph.flight.engine import engine_of, mujoco_library

if TYPE_CHECKING:
    from gaitgraph.flight.records import Flight

__all__ = ["check_screen", "show_flight"]

_FRAME = 1.0 / 60.0
_TRY = "import glfw, sys; sys.exit(0 if glfw.init() else 1)"


def check_screen() -> None:
    """Raise InputError if no window can be opened here, and MissingExtra if mujoco is missing.

    A window is tried in another process, because what draws may end the process that it fails in.
    """
    mujoco_library()
    advice = "allowed is where there is a screen; --output flight.gif shows the flight without one"
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(f"--view: no screen here, for neither DISPLAY nor WAYLAND_DISPLAY is set; {advice}")
    done = subprocess.run([sys.executable, "-c", _TRY], capture_output=True, check=False)  # noqa: S603
    if done.returncode:
        raise InputError(f"--view: no window can be opened here; {advice}")


def show_flight(flight: Flight) -> None:
    """Show a flight in the engine's viewer at its own pace, followed by the camera, until the window is closed.

    Raises
    ------
    InputError
        If the viewer cannot be opened.
    """
    from mujoco import viewer

    engine = engine_of(flight.vehicle)
    columns = [flight.column(name) for name in ("x", "y", "z", "roll", "pitch", "yaw")]
    tilts = np.stack([flight.column(f"alpha{k + 1}") for k in range(4)], axis=-1)
    times = flight.column("t")
    try:
        opened = viewer.launch_passive(engine.model, engine.data, show_left_ui=False, show_right_ui=False)
    except RuntimeError as error:  # on macOS it wants to be run by mjpython
        raise InputError(f"--view: the viewer does not open ({error}); allowed is where it does") from error
    with opened as window:
        window.cam.trackbodyid, window.cam.type = 1, engine.mujoco.mjtCamera.mjCAMERA_TRACKING
        window.cam.distance = 8.0 * (flight.vehicle.arm_length or 1.0)
        begin = time.monotonic()
        while window.is_running():
            row = min(int(np.searchsorted(times, time.monotonic() - begin)), len(times) - 1)
            x, y, z, roll, pitch, yaw = (float(column[row]) for column in columns)
            engine.place(tilts[row], roll=roll, pitch=pitch, yaw=yaw)
            engine.data.qpos[:3] = x, y, z
            engine.mujoco.mj_forward(engine.model, engine.data)
            window.sync()
            time.sleep(_FRAME)
