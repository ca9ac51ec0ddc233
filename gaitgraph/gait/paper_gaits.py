"""Gaits 1 to 4 of the paper's Section 5."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.gait.gait import Gait, lift
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from gaitgraph.invertibility.matrices import Coefficients

_AROUND_3 = ((6, -6), (6, -2), (2, -2), (2, -6))
# By number: the color, and the corners (α1, α2) in multiples of π/16.
_LOOPS = {
    1: ("blue", ((5, 2), (5, 6), (1, 6), (1, 2))),
    2: ("blue", _AROUND_3),
    3: ("red", _AROUND_3),
    4: ("red", ((-2, 2), (-2, 6), (-6, 6), (-6, 2))),
}
# (α3, α4) at those corners as the paper prints them [rad].
_PRINTED = {
    1: ((-0.648, -0.727), (-0.648, -1.512), (0.138, -1.512), (0.138, -0.727)),
    2: ((-0.844, 0.844), (-0.844, 0.059), (-0.059, 0.059), (-0.059, 0.844)),
    3: ((1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)),
    4: ((-0.393, 0.393), (-0.393, 1.178), (-1.178, 1.178), (-1.178, 0.393)),
}

PAPER_GAITS = tuple(_LOOPS)
"""The numbers of the gaits."""


def paper_gait(number: int, vehicle: Vehicle, coefficients: Coefficients) -> Gait:
    """Return Gait 1 to 4 for a vehicle; its loop is mirrored in the origin, as all regions are, if the spin is.

    >>> from gaitgraph.invertibility.matrices import coefficients_of
    >>> paper_gait(3, PAPER, coefficients_of()).alpha[0].round(3).tolist()
    [1.178, -1.178, 1.178, -1.178]
    """
    color, points = _LOOPS[number]
    side = 1 if vehicle.signed_drag_ratio > 0 else -1
    return lift(side * np.array(points) * (math.pi / 16), color, vehicle=vehicle, coefficients=coefficients)


def printed_gait(number: int, coefficients: Coefficients) -> Gait:
    """Return the polyline through a gait's vertices as printed, three decimals each, which is off the surfaces."""
    plane = np.array(_LOOPS[number][1]) * (math.pi / 16)
    return Gait(alpha=np.column_stack([plane, _PRINTED[number]]), vehicle=PAPER, coefficients=coefficients)
