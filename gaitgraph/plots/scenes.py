"""The tilting vehicle as a picture: where its arms, discs and thrusts lie on a screen, for any tilt angles.

The projection is orthographic. A rotor is a disc that tilts about its own arm, so its image is an ellipse: the unit
disc under an affine map, told as SVG does, (a, b, c, d, e, f) for x' = a·x + c·y + e, y' = b·x + d·y + f, in pixels
with y downwards. Whatever draws a scene needs no geometry of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import rotor_directions
from gaitgraph.vehicle import PAPER, Vehicle

__all__ = ["DEFAULT_VIEW", "ROTOR_COLORS", "Scene", "scene_of"]

FloatArray = npt.NDArray[np.float64]

ROTOR_COLORS = ("#e69f00", "#56b4e9", "#009e73", "#cc79a7")
"""Of rotors 1 to 4; told apart by colour-blind eyes, and of neither sheet."""

DEFAULT_VIEW = (math.radians(-152.0), math.radians(33.0))
"""Where the viewer stands: azimuth from forward, positive to the left, and elevation [rad]; behind, right, above."""

# In units of the arm's length.
_DISC = 0.5
_STALK = 0.1
_THRUST = 0.62
_NOSE = 0.34
_LABEL = 0.24


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A vehicle seen from one place, for n samples of its tilt angles; pixels, y downwards.

    Parameters
    ----------
    size
        Width and height of the picture [px]; all that is drawn lies inside, whatever the tilt.
    scale
        Pixels per arm's length.
    discs
        Images of the unit disc, shape (n, 4, 6): a, b, c, d, e, f of each rotor's affine map. The disc's x axis is
        the outward arm axis, its y axis turns with the tilt.
    thrusts
        Ends of the lines of thrust, shape (n, 4, 2), from the disc's centre (e, f) along the direction pushed to.
    facing
        Whether the viewer sees the side of the disc that the thrust leaves from, shape (n, 4).
    hub
        Image of the centre of mass, shape (2,).
    arms
        Outer ends of the arms, shape (4, 2).
    labels
        Places for the rotors' numbers, beyond the arms' ends, shape (4, 2).
    nose
        End of an arrow from the hub that points forward, shape (2,).
    order
        Rotors from the farthest to the nearest, counted from 0: draw them so.
    clockwise
        Whether each rotor turns clockwise seen from above.
    """

    size: tuple[float, float]
    scale: float
    discs: FloatArray
    thrusts: FloatArray
    facing: npt.NDArray[np.bool_]
    hub: FloatArray
    arms: FloatArray
    labels: FloatArray
    nose: FloatArray
    order: tuple[int, ...]
    clockwise: tuple[bool, ...]

    def __post_init__(self) -> None:
        for name in ("discs", "thrusts", "facing", "hub", "arms", "labels", "nose"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.discs)

    def as_mapping(self, decimals: int = 2) -> dict[str, Any]:
        """Return the scene as plain values, rounded to some decimals of a pixel; rotors in their own order.

        >>> scene_of([[0.0, 0.0, 0.0, 0.0]]).as_mapping()["order"]
        [0, 1, 3, 2]
        """
        discs, thrusts = _rounded(self.discs, decimals), _rounded(self.thrusts, decimals)
        hub, arms, labels = (_rounded(values, decimals) for values in (self.hub, self.arms, self.labels))
        return {
            "size": list(self.size),
            "frames": len(self),
            "order": list(self.order),
            "hub": hub.tolist(),
            "nose": _rounded(self.nose, decimals).tolist(),
            "rotors": [
                {
                    "disc": discs[:, k].tolist(),
                    "thrust": thrusts[:, k].tolist(),
                    "facing": self.facing[:, k].tolist(),
                    "arm": [*hub.tolist(), *arms[k].tolist()],
                    "label": labels[k].tolist(),
                    "clockwise": self.clockwise[k],
                    "color": ROTOR_COLORS[k],
                }
                for k in range(4)
            ],
        }


def _rounded(values: FloatArray, decimals: int) -> FloatArray:
    return np.asarray(np.round(values, decimals) + 0.0)  # a negative zero is written as zero


def scene_of(
    alpha: npt.ArrayLike,
    vehicle: Vehicle = PAPER,
    *,
    size: tuple[float, float] = (480.0, 360.0),
    view: tuple[float, float] = DEFAULT_VIEW,
) -> Scene:
    """Return what a vehicle looks like while it tilts.

    Parameters
    ----------
    alpha
        Tilt angles, shape (n, 4) or (4,) [rad].
    vehicle
        Its `first_arm_angle` and `first_rotor_spin` are all that shows.
    size
        Width and height of the picture [px].
    view
        Azimuth and elevation of the viewer [rad]; elevation from −π/2 to π/2. At π/2 the vehicle is seen from above,
        forward up the picture for an azimuth of π.

    Raises
    ------
    InputError
        If an angle is not finite, or a value is not allowed.

    Examples
    --------
    >>> scene = scene_of([[0.0, 0.5, 0.0, 0.5]], view=(math.pi, math.pi / 2), size=(300, 300))
    >>> scene.discs.shape, bool(scene.arms[0][1] < scene.hub[1])
    ((1, 4, 6), True)

    Notes
    -----
    Not guaranteed: that discs do not overlap. Rotors are ordered by the depth of their arms' ends, which is right for
    discs that reach no neighbour, as here; lines of thrust can pass before what they are behind.
    """
    angles = np.atleast_2d(np.asarray(alpha, dtype=float))
    if angles.ndim != 2 or angles.shape[1] != 4:
        raise InputError(f"alpha: an array of shape {np.shape(alpha)}; allowed is (n, 4)")
    if not np.isfinite(angles).all():
        raise InputError(f"alpha: {shown(float(angles[~np.isfinite(angles)][0]))}; allowed are finite angles (rad)")
    azimuth, elevation = _pair("view", view, "azimuth and elevation (rad), elevation within ±π/2")
    if abs(elevation) > math.pi / 2:
        raise InputError(f"view: elevation {elevation!r}; allowed is −π/2 to π/2 (rad)")
    width, height = _pair("size", size, "width and height, 16 to 10000 px")
    if not (16 <= width <= 10_000 and 16 <= height <= 10_000):
        raise InputError(f"size: {shown(size)}; allowed are width and height, 16 to 10000 px")

    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    viewer = np.array([math.cos(azimuth), math.sin(azimuth), 0.0]) * math.cos(elevation)
    viewer[2] = math.sin(elevation)
    screen = np.stack([right, -np.cross(viewer, right)])  # rows: to the right, downwards

    bearings = vehicle.first_arm_angle + np.arange(4) * (math.pi / 2)
    outward = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(4)], axis=-1)
    ends = outward @ screen.T
    hub, scale = _fitted(ends, (width, height))
    thrust = _thrust_directions(angles, vehicle)

    across = np.cross(thrust, outward)
    centre = outward + _STALK * thrust
    first = np.broadcast_to(_DISC * scale * ends, (len(angles), 4, 2))
    second = _DISC * scale * (across @ screen.T)
    middle = hub + scale * (centre @ screen.T)
    depth = outward @ viewer
    clockwise = vehicle.first_rotor_spin == "clockwise"
    return Scene(
        size=(width, height),
        scale=scale,
        discs=np.concatenate([first, second, middle], axis=-1),
        thrusts=hub + scale * ((centre + _THRUST * thrust) @ screen.T),
        facing=thrust @ viewer > 0,
        hub=hub,
        arms=hub + scale * ends,
        labels=hub + scale * (1.0 + _DISC + _LABEL) * ends,
        nose=hub + scale * _NOSE * screen[:, 0],
        # Equal depths, as in a view from above, keep the rotors' order whatever the last digits say.
        order=tuple(np.argsort(np.round(depth, 9), kind="stable").tolist()),
        clockwise=tuple(clockwise == (k % 2 == 0) for k in range(4)),
    )


def _thrust_directions(angles: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return the unit vectors along which the rotors push when they push away from the body, shape (n, 4, 3)."""
    directions, _ = rotor_directions(angles, vehicle)
    upright, _ = rotor_directions(np.zeros(4), vehicle)
    return np.swapaxes(directions * np.sign(upright[2]), -1, -2)


def _fitted(ends: FloatArray, size: tuple[float, float]) -> tuple[FloatArray, float]:
    """Return the hub's place and the scale [px] with which nothing leaves the picture at any tilt."""
    reach = max(_STALK + _THRUST, math.hypot(_STALK, _DISC))
    labels = (1.0 + _DISC + _LABEL) * ends
    around = np.concatenate([ends - reach, ends + reach, labels - _LABEL, labels + _LABEL])
    low, high = around.min(axis=0), around.max(axis=0)
    scale = float(min(np.array(size) / (high - low)))
    return np.array(size) / 2 - scale * (low + high) / 2, scale


def _pair(name: str, values: Any, allowed: str) -> tuple[float, float]:
    numbers = [number_of(value) for value in values] if isinstance(values, (tuple, list)) else []
    if len(numbers) != 2 or not all(map(math.isfinite, numbers)):
        raise InputError(f"{name}: {shown(values)}; allowed are {allowed}")
    return numbers[0], numbers[1]
