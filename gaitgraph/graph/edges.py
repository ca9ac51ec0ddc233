"""Edges of the surface graph: neighbouring nodes that Figure 15 allows, and what holds along each edge."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import wrapped
from gaitgraph.invertibility import segment_bounds
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.surface.sheets import neighbors_allowed, sheet_jumps
from gaitgraph.tolerances import ROUND_OFF

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.graph.nodes import Nodes
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray, IntArray
    from gaitgraph.vehicle import Vehicle

_SINGULAR_VALUE_TOLERANCE = 1e-5
_DETERMINANT_TOLERANCE = 1e-4


def allowed_pairs(nodes: Nodes, divisions: int) -> IntArray:
    """Return the pairs of nodes that edges join, by their numbers, shape (e, 2): the smaller first, sorted.

    Both α1 and α2 differ by at most one step of the grid, and the Two-Color theorem (Figure 15) allows the two types.
    """
    from scipy.spatial import cKDTree

    step = math.pi / divisions
    pairs = cKDTree(nodes.plane).query_pairs(
        step + ROUND_OFF, p=math.inf, output_type="ndarray"
    )
    a, b = pairs.T
    third, fourth = nodes.types.T
    allowed = neighbors_allowed((third[a], fourth[a]), (third[b], fourth[b]))
    pairs = pairs[allowed]
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])


def edge_attributes(
    nodes: Nodes,
    pairs: IntArray,
    wanted: float,
    vehicle: Vehicle,
    coefficients: Coefficients,
    floor: float,
    *,
    servo_margins: bool,
) -> dict[str, npt.NDArray[Any]]:
    """Return the edge attributes of the contract as arrays of shape (e,), by name; `wanted` is the sign of R, ±1."""
    a, b = pairs.T
    starts, ends = nodes.alpha[a], nodes.alpha[b]
    jump = _jumps(nodes, pairs, coefficients)
    least_R = _least_determinant(starts, ends, wanted, coefficients)
    keeps_sign = least_R != 0
    least = np.zeros(len(pairs))
    flyable = np.zeros(len(pairs), dtype=bool)
    smooth = nodes.red[a] & nodes.red[b] & (jump == 0) & keeps_sign
    if smooth.any():
        bounds = segment_bounds.least_singular_value_along(
            starts[smooth],
            ends[smooth],
            vehicle,
            tolerance=_SINGULAR_VALUE_TOLERANCE,
            each=True,
        )
        # Edges that have their least value in common differ by rounding.
        least[smooth] = np.round(bounds.upper, 12)
        flyable[smooth] = segments_fly(starts[smooth], ends[smooth], floor, vehicle)
    columns = {
        "length": np.linalg.norm((ends - starts)[:, :2], axis=1),
        "jump": jump,
        "continuous": jump == 0,
        "keeps_sign": keeps_sign,
        "R": least_R,
        "least_singular_value": least,
        "flyable": flyable,
    }
    if servo_margins:
        margins = np.zeros(len(pairs))
        if flyable.any():
            margins[flyable] = _servo_margins(
                starts[flyable], ends[flyable], vehicle, floor
            )
        columns["servo_margin"] = margins
    return columns


def _servo_margins(
    starts: FloatArray, ends: FloatArray, vehicle: Vehicle, floor: float
) -> FloatArray:
    """Return the servo margins that are found at the ends and in the middle of flyable edges, shape (m,) [rad]."""
    places = np.concatenate([starts, ends, (starts + ends) / 2])
    distinct, number = np.unique(np.round(places, 12), axis=0, return_inverse=True)
    margins = servo_margins_found(distinct, vehicle, floor)
    return np.asarray(margins[number].reshape(3, -1).min(axis=0))


def _jumps(nodes: Nodes, pairs: IntArray, coefficients: Coefficients) -> FloatArray:
    """Return by how much (α3, α4) leave a continuous motion along each edge [rad]."""
    a, b = pairs.T
    starts, ends = nodes.alpha[a], nodes.alpha[b]
    if coefficients.rotors.asymmetry is None:
        codes = np.where(nodes.red, np.int8(1), np.int8(-1))
        return sheet_jumps(starts, ends, codes[a], codes[b], coefficients)
    # On a curved sheet α3 and α4 may wrap.
    step = (ends - starts)[:, 2:]
    apart = np.abs(step - wrapped(step))
    return np.asarray(np.round(apart, 12).max(axis=1, initial=0.0))


def _least_determinant(
    starts: FloatArray, ends: FloatArray, wanted: float, coefficients: Coefficients
) -> FloatArray:
    """Return the R nearest to 0 along each edge, 0 unless R has the wanted sign along the whole of it, shape (e,)."""
    if not len(starts):
        return np.zeros(0)
    noise = noise_of(coefficients)
    bounded = segment_bounds.least_level_determinant(
        starts, ends, coefficients, sign=wanted, tolerance=0.0, floor=noise, each=True
    )
    keeps_sign = bounded.lower >= noise
    least = np.zeros(len(starts))
    if keeps_sign.any():
        exact = segment_bounds.least_level_determinant(
            starts[keeps_sign],
            ends[keeps_sign],
            coefficients,
            sign=wanted,
            tolerance=_DETERMINANT_TOLERANCE,
            each=True,
        )
        least[keeps_sign] = wanted * np.maximum(np.round(exact.upper, 12), noise)
    return least


def segments_fly(
    starts: FloatArray, ends: FloatArray, floor: float, vehicle: Vehicle
) -> BoolArray:
    """Return whether segments on red where R keeps its sign meet the physics along their whole length, shape (m,)."""
    flies = segment_bounds.thrusts_push_up(starts, ends, vehicle)
    if vehicle.tilt_range is not None:
        least, most = np.array(vehicle.tilt_range).T
        flies &= (np.minimum(starts, ends) >= least - ROUND_OFF).all(axis=1)
        flies &= (np.maximum(starts, ends) <= most + ROUND_OFF).all(axis=1)
    if flies.any():
        flies[flies] = segment_bounds.keeps_singular_value_above(
            starts[flies], ends[flies], floor, vehicle
        )
    share = vehicle.thrust_share
    if share is not None and flies.any():
        _, _, largest = segment_bounds.thrust_shares_along(
            starts[flies], ends[flies], vehicle, each=True
        )
        flies[flies] = -largest.lower <= share
    return flies
