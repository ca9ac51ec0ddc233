"""The vehicle: the geometry of its drawings, one drawing, and Figure 1.

The projection is orthographic. Lengths on the screen are in arm lengths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from
from gaitgraph.arrays import freeze_arrays, read_only
from gaitgraph.errors import wrong
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import rotor_directions, thrust_signs
from gaitgraph.plots.axes import ROTOR_COLORS, axes_or_new, draw_arrow, draw_label
from gaitgraph.records import Record
from gaitgraph.vehicle import PAPER, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Positions of the viewer: azimuth from forward, positive to the left, and elevation [rad].
DEFAULT_VIEW = (math.radians(-152.0), math.radians(33.0))  # behind, right and above
FROM_ABOVE = (math.pi, math.pi / 2)  # forward is up
INK, LINE_GREY, PALE = "#23262b", "#767b85", "#dfe2e7"
_DISC, _STALK, _THRUST, _NOSE, _LABEL = 0.5, 0.1, 0.62, 0.34, 0.24  # in arm lengths
_AROUND = np.linspace(0.0, math.tau, 73)[:, None]  # the angles of a drawn circle


@dataclass(
    frozen=True,
    slots=True,
    kw_only=True,
    eq=False,
)
class VehicleView(Record):
    """A vehicle seen from one direction; positions are from its centre of mass, to the right and upwards."""

    centres: FloatArray  # (4, 2), of the discs, where the lines of thrust begin
    rims: FloatArray  # (4, 73, 2), from the outward side, towards a positive tilt
    tips: FloatArray  # (4, 2), ends of the lines of thrust
    facing: npt.NDArray[
        np.bool_
    ]  # (4,), whether the viewer sees the side of the thrust
    arms: FloatArray  # (4, 2), outer ends
    hub: FloatArray  # (2,), where the arms meet, at the rotors' height
    nose: FloatArray  # (2,), end of an arrow from the centre that points forward
    labels: FloatArray  # (4, 2), places of the rotors' numbers
    order: tuple[int, ...]  # rotors from the farthest to the nearest, counted from 0

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """The low and high corners of a rectangle that holds the vehicle at every tilt."""
        reach = max(_STALK + _THRUST, math.hypot(_STALK, _DISC))
        low = np.minimum(self.arms - reach, self.labels - _LABEL).min(axis=0)
        high = np.maximum(self.arms + reach, self.labels + _LABEL).max(axis=0)
        return read_only(low), read_only(high)


def screen_axes(view: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Return the directions right and up on the screen of a viewer at an azimuth and an elevation [rad]."""
    angles = angles_from(view, "view")
    if angles.shape != (2,):
        raise wrong("view", "must be an azimuth and an elevation (rad)", view)
    azimuth, elevation = angles.tolist()
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    viewer = np.array([math.cos(azimuth), math.sin(azimuth), 0.0]) * math.cos(elevation)
    viewer[2] = math.sin(elevation)
    return right, np.cross(viewer, right)


def vehicle_view(
    alpha: npt.ArrayLike,
    vehicle: VehicleLike = PAPER,
    *,
    view: tuple[float, float] = DEFAULT_VIEW,
    attitude: npt.ArrayLike | None = None,
    thrusts: npt.ArrayLike = 1.0,
) -> VehicleView:
    """Return the view of a vehicle at four tilt angles [rad].

    Of the `vehicle` only the places and the spins of its rotors matter. `view` is the viewer's azimuth and elevation,
    from −π/2 to π/2 [rad]; `attitude` the rotation from body axes to world axes, shape (3, 3), by default level.
    `thrusts`, shape (4,), are relative lengths of the lines of thrust, negative where a rotor pulls.

    >>> vehicle_view([0.0, 0.5, 0.0, 0.5], view=FROM_ABOVE).order
    (0, 1, 2, 3)
    """
    angles = angles_from(alpha, "alpha")
    if angles.shape != (4,):
        raise wrong("alpha", "must be four angles in radians", alpha)
    vehicle = vehicle_named(vehicle)
    turned = np.eye(3)
    if attitude is not None:
        turned = _numbers("attitude", attitude, (3, 3))
    length = np.broadcast_to(_numbers("thrusts", thrusts, (4,), ()), (4,))
    right, up = screen_axes(view)
    screen = turned.T @ np.stack([right, up], axis=-1)
    toward = turned.T @ np.cross(right, up)

    ends = np.array(vehicle.scaled_positions)
    outward, _ = vehicle.axes
    # The direction of each thrust at a level tilt is up, whatever the spin.
    thrust = (rotor_directions(angles, vehicle)[0] * thrust_signs(vehicle)).T
    along = np.cross(thrust, outward)
    centres = ends + _STALK * thrust
    circles = np.cos(_AROUND) * outward[:, None] + np.sin(_AROUND) * along[:, None]
    arms = ends @ screen
    hub = np.array([0.0, 0.0, vehicle.height_ratio]) @ screen
    # By the depth of the arms' ends, because discs do not reach each other; equal depths keep the order.
    order = np.argsort(np.round(ends @ toward, 9), kind="stable")
    return VehicleView(
        centres=centres @ screen,
        rims=(centres[:, None] + _DISC * circles) @ screen,
        tips=(centres + _THRUST * length[:, None] * thrust) @ screen,
        facing=(thrust @ toward > 0) ^ (length < 0),
        arms=arms,
        hub=hub,
        nose=_NOSE * screen[0],
        labels=hub + (1.0 + _DISC + _LABEL) * (arms - hub),
        order=tuple(order.tolist()),
    )


def _numbers(name: str, values: npt.ArrayLike, *shapes: tuple[int, ...]) -> FloatArray:
    """Return finite numbers of one of some shapes, or raise InputError."""
    try:
        numbers = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        numbers = np.full(1, np.nan)
    if numbers.shape not in shapes or not np.isfinite(numbers).all():
        raise wrong(name, f"must be finite numbers of shape {shapes[0]}", values)
    return numbers


def draw_vehicle(ax: Axes, seen: VehicleView) -> None:
    """Draw a view on axes of equal scales, in arm lengths; what is nearer is drawn later."""
    centre = (0.0, 0.0)
    for end in (*seen.arms, centre):
        _line(ax, seen.hub, end, 3.6)
    draw_arrow(
        ax,
        centre,
        seen.nose,
        INK,
        width=1.5,
        size=8,
        zorder=2,
    )
    _line(ax, centre, centre, 1.0, INK, marker="o", markersize=8.0)
    for rotor in seen.order:
        middle = seen.centres[rotor]
        arrow = partial(draw_arrow, ax, middle, seen.tips[rotor], INK, width=1.8)
        _line(ax, seen.arms[rotor], middle, 2.9)
        if not seen.facing[rotor]:
            arrow(zorder=2)
        _disc(ax, seen.rims[rotor], ROTOR_COLORS[rotor])
        _line(ax, middle, middle, 3.6, INK, marker="o")
        if seen.facing[rotor]:
            arrow(zorder=2)
    for number, (label, color) in enumerate(
        zip(seen.labels, ROTOR_COLORS, strict=True), start=1
    ):
        box = {"boxstyle": "circle,pad=0.25", "ec": "white", "fc": color}
        draw_label(
            ax, label, f"{number}", "white", bbox=box, fontsize=8.0, weight="bold"
        )


def show_whole(ax: Axes, seen: VehicleView) -> None:
    """Scale axes so that a vehicle fits, and hide their frame."""
    (left, bottom), (right, top) = seen.limits
    ax.set(
        xlim=(left, right),
        ylim=(bottom, top),
        aspect="equal",
    )
    ax.set_axis_off()


def _disc(ax: Axes, rim: FloatArray, color: str) -> None:
    ax.fill(
        *rim.T,
        facecolor=color,
        edgecolor=INK,
        linewidth=0.9,
        zorder=2,
    )


def _line(
    ax: Axes, start: Any, end: Any, width: float, color: str = LINE_GREY, **look: Any
) -> None:
    x, y = np.array([start, end]).T
    ax.plot(
        x,
        y,
        color=color,
        linewidth=width,
        zorder=2,
        **look,
    )


_GREY = "0.35"
_LEAN = "#b35900"  # of tilt angles and the leaning thrusts


def vehicle_figure(vehicle: VehicleLike = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw a vehicle from above, and one rotor from the tip of its arm: axes, spins, positive tilts (Figure 1)."""
    ax = axes_or_new(ax)
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set(xlim=(-2.75, 5.6), ylim=(-2.45, 2.3))
    seen = vehicle_view(np.zeros(4), vehicle, view=FROM_ABOVE)
    clockwise = thrust_signs(vehicle_named(vehicle)) < 0
    for arm in seen.arms:
        _line(ax, (0.0, 0.0), arm, 2.5, _GREY)
    for number, outward in enumerate(seen.arms, start=1):
        _disc(ax, seen.rims[number - 1], "0.94")
        # The direction of the thrust at a positive tilt.
        leaning = np.array([outward[1], -outward[0]])
        arc, spin = (200, 520), "ccw"
        if clockwise[number - 1]:
            arc, spin = (340, 20), "cw"
        _draw_arc(ax, outward, 0.8 * _DISC, arc, _GREY)
        draw_label(ax, outward, f"{number}\n{spin}")
        draw_arrow(ax, 1.5 * outward, 2.04 * outward, _GREY)
        draw_label(ax, 2.24 * outward, rf"$e_{number}$")
        start = outward + _DISC * leaning
        end = start + 0.5 * leaning
        draw_arrow(ax, start, end, _LEAN, width=1.8, gid=f"lean {number}")
        beyond = 0.5 + 0.42 * abs(leaning[0]) + 0.2 * abs(leaning[1])
        draw_label(ax, start + beyond * leaning, rf"$\alpha_{number}>0$", _LEAN)
    x, y = corner = -2.2, -2.2
    draw_arrow(ax, corner, (x, y + 0.75), "black")
    draw_arrow(ax, corner, (x - 0.5, y), "black")
    _draw_axis_out_of_the_page(ax, corner, 5.0)
    draw_label(ax, (x, y + 0.92), "$x$ forward")
    draw_label(ax, (x - 0.3, y - 0.2), "$y$ left")
    draw_label(ax, (x + 0.38, y), "$z$ up")
    _draw_from_the_tip(ax)
    return ax


def _draw_axis_out_of_the_page(ax: Axes, place: Any, size: float) -> None:
    _line(
        ax,
        place,
        place,
        0.8,
        "black",
        marker="o",
        markersize=size,
        mfc="white",
    )
    _line(ax, place, place, 0.8, "black", marker=".", markersize=size / 2)


def _draw_arc(
    ax: Axes, center: FloatArray, radius: float, arc: tuple[float, float], color: str
) -> None:
    """Draw an arrow along an arc from one angle to another [°]."""
    around = np.radians(np.linspace(*arc, 49))
    x, y = center[:, None] + radius * np.array([np.cos(around), np.sin(around)])
    ax.plot(
        x,
        y,
        color=color,
        linewidth=1.0,
        zorder=3,
    )
    draw_arrow(ax, (x[-2], y[-2]), (x[-1], y[-1]), color, width=0.0, size=7)


def _draw_from_the_tip(ax: Axes) -> None:
    """Draw a rotor with a positive tilt, seen from outside along its arm."""
    x, y = 4.2, -0.75
    hub = np.array([x, y])
    tilt = math.radians(32)
    lean = np.array([-math.sin(tilt), math.cos(tilt)])
    across = 0.6 * np.array([math.cos(tilt), math.sin(tilt)])
    middle = np.array([-math.sin(tilt / 2), math.cos(tilt / 2)])
    rotor = hub + 0.45 * lean
    _line(ax, hub, (x, y + 2.0), 0.8, _GREY, linestyle=(0, (4, 3)))
    draw_label(ax, (x + 0.1, y + 2.2), "$z$")
    _line(ax, hub, rotor, 2.0, _GREY)
    _line(ax, rotor - across, rotor + across, 3.0, _GREY)
    draw_arrow(ax, rotor, hub + 1.9 * lean, _LEAN, width=1.8)
    draw_label(ax, hub + 2.12 * lean, "thrust", _LEAN)
    _draw_arc(ax, hub, 1.3, (90, 90 + math.degrees(tilt)), _LEAN)
    draw_label(ax, hub + 1.52 * middle, r"$\alpha_i>0$", _LEAN)
    _draw_axis_out_of_the_page(ax, hub, 8.0)
    draw_label(ax, (x + 0.3, y - 0.02), "$e_i$")
    text = "rotor $i$ from the tip of its arm:\npositive tilts are right-handed\nabout the outward axis $e_i$"
    draw_label(ax, (x, y - 0.75), text)
