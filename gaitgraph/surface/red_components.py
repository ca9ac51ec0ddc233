"""The components of R ≠ 0 on the red sheet.

On the red sheet R = 0 on two lines and one curve. Inside [−π/2, π/2]² the signs of the three factors label the seven
components that remain. Two points with different labels cannot be joined without a singular matrix. :func:`red_label`
does this for every vehicle that a half turn maps to itself.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from, wrapped
from gaitgraph.invertibility.forms import FloatArray, rotors_of
from gaitgraph.surface.blocks import roll_block, yaw_block
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Sequence

HOVER_LABEL = (1, 1, 1)
"""The label of the component of α = 0, which ordinary hover can reach."""


def red_label(
    alpha1: npt.ArrayLike, alpha2: npt.ArrayLike, vehicle: VehicleLike = PAPER
) -> npt.NDArray[np.int64]:
    """Return three signs that tell the components of R ≠ 0 on red apart, shape (..., 3); their product is that of R.

    They are (1, 1, 1) in the component of α = 0; a zero is singular. The third is positive on its side of D = 0. The
    product of the first two is positive on its side of P = 0; they are the signs of two factors where P has two, and
    otherwise the first tells components of equal signs apart (docs/theory.md, 10).

    >>> red_label(0.0, 0.0).tolist(), red_label(1.178, -0.393).tolist()
    ([1, 1, 1], [1, 1, -1])
    """
    vehicle = vehicle_named(vehicle)
    a1, a2 = angles_from(alpha1, "alpha1"), angles_from(alpha2, "alpha2")
    yaw, roll = _red_forms(vehicle)
    c1, s1, c2, s2 = np.cos(a1), np.sin(a1), np.cos(a2), np.sin(a2)
    side = (yaw[0, 0] * c1 + yaw[1, 0] * s1) * c2 + yaw[0, 1] * c1 * s2
    first = roll[0, 0] * c1 + roll[1, 0] * s1
    across = roll[0, 1] * c1 + roll[1, 1] * s1
    level = first * c2 + across * s2
    if roll_block(rotors_of(vehicle)).is_product:
        second = roll[0, 0] * c2 + roll[0, 1] * s2
    else:
        # In tan α1 and tan α2, P = 0 is a hyperbola. Two of the parts beside it are convex, on either side of the
        # vertical asymptote; D = 0, a line, can cut the third one, between the branches, in three.
        bend = float(np.linalg.det(roll))
        apart = math.copysign(1.0, roll[0, 1]) * across
        between = np.ones(apart.shape)
        middle = _chord_middle(yaw, roll)
        if middle is not None:
            x, y = middle
            chord = s1 * c2 + c1 * s2 - (x + y) * c1 * c2
            chord = chord * math.copysign(1.0, -(x + y))
            cut = side * yaw[0, 1] * (roll[0, 1] + roll[1, 1] * x) * roll[1, 1] < 0
            between = np.where(cut, chord, between)
        first = np.where(level * bend * roll[1, 1] < 0, apart, between)
        first = np.where(first < 0, -1.0, 1.0)
        second = level * first
    labels = np.stack(np.broadcast_arrays(first, second, side), axis=-1)
    return np.asarray(np.sign(labels).astype(np.int64))


def _red_forms(vehicle: Vehicle) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of D and P, with signs that make both positive at α = 0."""
    rotors = rotors_of(vehicle)
    yaw, roll = yaw_block(rotors).form, roll_block(rotors).form
    return yaw * math.copysign(1.0, yaw[0, 0]), roll * math.copysign(1.0, roll[0, 0])


def _chord_middle(yaw: FloatArray, roll: FloatArray) -> tuple[float, float] | None:
    """Return (tan α1, tan α2) between the points where D = 0 meets one branch of P = 0 twice, None if it does not."""
    slope, start = -yaw[1, 0] / yaw[0, 1], -yaw[0, 0] / yaw[0, 1]
    square = roll[1, 1] * slope
    linear = roll[1, 0] + roll[0, 1] * slope + roll[1, 1] * start
    meets = linear**2 > 4 * square * (roll[0, 0] + roll[0, 1] * start)
    if square == 0 or not meets or np.linalg.det(roll) < 0:
        return None
    x = float(-linear / (2 * square))
    return x, float(slope * x + start)


def separating_factor(
    first: Sequence[float], second: Sequence[float], vehicle: Vehicle = PAPER
) -> str | None:
    """Return what separates two points (α1, α2) of the red sheet with R ≠ 0, in words, or None."""
    a, b = (red_label(x, y, vehicle) for x, y in (first, second))
    names = dict.fromkeys(
        name for name, x, y in zip(_red_curves(vehicle), a, b, strict=True) if x != y
    )
    return " and ".join(names) or None


def home_in_words(vehicle: Vehicle) -> str:
    """Return on which side of D = 0 the component of α = 0 of the red sheet is, as a condition."""
    yaw, _ = _red_forms(vehicle)
    ratio, offset = -yaw[0, 1] / yaw[1, 0], -yaw[0, 0] / yaw[1, 0]
    factor = "" if math.isclose(ratio, 1.0) else f"{ratio:.4g} "
    return f"tan α1 − {factor}tan α2 {'<' if offset > 0 else '>'} {offset:.4f}"


def _red_curves(vehicle: Vehicle) -> tuple[str, str, str]:
    """Return in words where each sign of a label changes."""
    yaw, roll = _red_forms(vehicle)
    ratio, offset = -yaw[0, 1] / yaw[1, 0], -yaw[0, 0] / yaw[1, 0]
    equal_arms = vehicle.rotor_positions is None and len(set(vehicle.scaled_drags)) == 1
    saddle = f"the curve tan α1 − {ratio:.4g} tan α2 = {offset:.4f}"
    if equal_arms:
        saddle = f"the curve tan α1 − tan α2 = 2κ = {offset:.4f}"
    if roll_block(rotors_of(vehicle)).is_product:
        lines = [math.atan2(-roll[0, 0], part) for part in (roll[1, 0], roll[0, 1])]
        first, second = (f"the line α{k + 1} = {wrapped(lines[k]):.4f}" for k in (0, 1))
        if equal_arms:
            first, second = f"{first} (β1 = ∓π/2)", f"{second} (β2 = ±π/2)"
        return first, second, saddle
    terms = zip(
        roll.ravel()[[2, 1, 3]] / roll[0, 0],
        ("tan α1", "tan α2", "tan α1 tan α2"),
        strict=True,
    )
    sums = "".join(
        f" {'−' if number < 0 else '+'} {abs(number):.4g} {term}"
        for number, term in terms
    )
    curve = f"the curve 1{sums} = 0"
    if equal_arms:
        height = f"H = {vehicle.height_ratio:.4g}"
        curve = f"the curve (1 + κ tan α1)(1 − κ tan α2) = −H² tan α1 tan α2, {height}"
    return curve, curve, saddle
