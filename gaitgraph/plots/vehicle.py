"""The vehicle with its arms, tilt axes and signs (Figure 1)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.plots.axes import axes_or_new, draw_arrow, draw_label
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from matplotlib.axes import Axes


__all__ = ["vehicle_sketch"]

FloatArray = npt.NDArray[np.float64]


def vehicle_sketch(vehicle: Vehicle = PAPER, *, ax: Axes | None = None) -> Axes:
    """Draw a vehicle from above, and one of its rotors from the tip of its arm: axes, spins, positive tilts (Figure 1).

    Parameters
    ----------
    vehicle
        Its `first_arm_angle` and `first_rotor_spin` are all that shows.
    ax
        Plane axes, which lose their frame; by default those of a new figure. The arrow of the lean of rotor 1 has
        "lean 1" as its ``gid``, and so on.
    """
    ax = axes_or_new(ax, size=(170, 92))
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set(xlim=(-2.75, 5.6), ylim=(-2.45, 2.3))
    _draw_from_above(ax, vehicle)
    _draw_from_the_tip(ax)
    return ax


_DISC = 0.42  # radius of a rotor in units of the arm's length
_LEAN = "#b35900"  # of tilts and what follows from them


def _draw_from_above(ax: Axes, vehicle: Vehicle) -> None:
    """Draw the vehicle from above, x up the page and y to the left."""
    from matplotlib.patches import Circle

    clockwise = vehicle.first_rotor_spin == "clockwise"
    for number in range(1, 5):
        arm = vehicle.first_arm_angle + (number - 1) * math.pi / 2
        outward = np.array([-math.sin(arm), math.cos(arm)])  # on the page, where body x is up and body y left
        leaning = np.array([math.cos(arm), math.sin(arm)])  # of the thrust, for a positive tilt
        turns_clockwise = clockwise == (number % 2 == 1)
        ax.plot(*np.array([0 * outward, (1 - _DISC) * outward]).T, color="0.35", linewidth=2.5, zorder=1)
        ax.add_patch(Circle(tuple(outward), _DISC, facecolor="0.94", edgecolor="0.35", linewidth=0.8, zorder=2))
        _draw_spin(ax, outward, turns_clockwise)
        draw_arrow(ax, (1 + _DISC) * outward, (1.62 + _DISC) * outward, "0.35")
        draw_label(ax, (1.82 + _DISC) * outward, rf"$e_{number}$")
        start = outward + _DISC * leaning
        draw_arrow(ax, start, start + 0.5 * leaning, _LEAN, width=1.8, gid=f"lean {number}")
        draw_label(
            ax, start + (0.5 + 0.42 * abs(leaning[0]) + 0.2 * abs(leaning[1])) * leaning, rf"$\alpha_{number}>0$", _LEAN
        )
        draw_label(ax, outward, f"{number}\n{'cw' if turns_clockwise else 'ccw'}")
    corner = np.array([-2.2, -2.2])
    draw_arrow(ax, corner, corner + np.array([0.0, 0.75]), "black")
    draw_arrow(ax, corner, corner + np.array([-0.5, 0.0]), "black")
    draw_label(ax, corner, "$x$ forward", offset=(0.0, 0.92))
    draw_label(ax, corner, "$y$ left", offset=(-0.3, -0.2))
    ax.plot(*corner, marker="o", markersize=5, markerfacecolor="white", markeredgecolor="black", zorder=4)
    ax.plot(*corner, marker=".", markersize=2.5, color="black", zorder=5)
    draw_label(ax, corner, "$z$ up", offset=(0.38, 0.0))


def _draw_spin(ax: Axes, center: FloatArray, clockwise: bool) -> None:
    """Draw an arrow around a rotor."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    arc = Path.arc(200, 520) if not clockwise else Path.arc(20, 340)
    vertices = np.asarray(arc.vertices)[:: -1 if clockwise else 1] * 0.8 * _DISC + center
    head = FancyArrowPatch(
        path=Path(vertices, arc.codes), arrowstyle="-|>", mutation_scale=7, color="0.35", linewidth=0.9, zorder=3
    )
    ax.add_patch(head)


def _draw_from_the_tip(ax: Axes) -> None:
    """Draw a rotor with a positive tilt, seen from outside along its arm."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    hub, tilt = np.array([4.2, -0.75]), math.radians(32)
    up, lean = np.array([0.0, 1.0]), np.array([-math.sin(tilt), math.cos(tilt)])
    across = np.array([math.cos(tilt), math.sin(tilt)])
    ax.plot(*np.array([hub, hub + 2.0 * up]).T, color="0.35", linewidth=0.8, linestyle=(0, (4, 3)))
    rotor = hub + 0.45 * lean
    ax.plot(*np.array([hub, rotor]).T, color="0.35", linewidth=2.0)
    ax.plot(*np.array([rotor - 0.6 * across, rotor + 0.6 * across]).T, color="0.35", linewidth=3.0)
    draw_arrow(ax, rotor, hub + 1.9 * lean, _LEAN, width=1.8)
    draw_label(ax, hub + 2.12 * lean, "thrust", _LEAN)
    arc = Path.arc(90, 90 + math.degrees(tilt))
    swing = FancyArrowPatch(
        path=Path(np.asarray(arc.vertices) * 1.3 + hub, arc.codes),
        arrowstyle="-|>",
        mutation_scale=8,
        color=_LEAN,
        shrinkA=0,
        shrinkB=0,
    )
    ax.add_patch(swing)
    middle = np.array([-math.sin(tilt / 2), math.cos(tilt / 2)])
    draw_label(ax, hub + 1.52 * middle, r"$\alpha_i>0$", _LEAN)
    ax.plot(*hub, marker="o", markersize=8, markerfacecolor="white", markeredgecolor="black", zorder=4)
    ax.plot(*hub, marker=".", markersize=4, color="black", zorder=5)
    draw_label(ax, hub, "$e_i$", offset=(0.3, -0.02))
    draw_label(ax, hub + 2.2 * up, "$z$", offset=(0.1, 0.0))
    draw_label(
        ax,
        hub - 0.75 * up,
        "rotor $i$ from the tip of its arm:\npositive tilts are right-handed\nabout the outward axis $e_i$",
    )
