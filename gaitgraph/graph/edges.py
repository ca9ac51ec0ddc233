"""Edges of the surface graph: neighbouring nodes that Figure 15 allows, and what holds along each edge."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import wrapped
from gaitgraph.invertibility import segment_bounds
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.surface.curved import LiftedChords, sheet_of
from gaitgraph.surface.sheets import neighbors_allowed, sheet_jumps
from gaitgraph.tolerances import ROUND_OFF, SAME_ANGLE

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.graph.nodes import Nodes
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import IntArray
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
    chords, jump = _chords_of(nodes, pairs, coefficients)
    least_R = _least_determinant(chords, len(pairs), wanted, coefficients)
    keeps_sign = least_R != 0
    least = np.zeros(len(pairs))
    flyable = np.zeros(len(pairs), dtype=bool)
    smooth = nodes.red[a] & nodes.red[b] & (jump == 0) & keeps_sign
    if smooth.any():
        of_smooth = smooth[chords.segment]
        first, last = chords.starts[of_smooth], chords.ends[of_smooth]
        segment = chords.segment[of_smooth]
        bounds = segment_bounds.least_singular_value_along(
            first, last, vehicle, tolerance=_SINGULAR_VALUE_TOLERANCE, each=True
        )
        # Edges that have their least value in common differ by rounding.
        values = np.round(bounds.upper, 12)
        least[smooth] = _least_of_edges(values, segment, len(pairs))[smooth]
        fly = segment_bounds.segments_fly(first, last, floor, vehicle)
        flyable[smooth] = _least_of_edges(fly, segment, len(pairs))[smooth] == 1
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
    middles = (starts + ends) / 2
    rotors = rotors_of(vehicle)
    if rotors.asymmetry is not None:
        on_sheet = sheet_of(rotors).angles(middles[:, 0], middles[:, 1])
        middles[:, 2:] += wrapped(on_sheet - middles[:, 2:])
    places = np.concatenate([starts, ends, middles])
    distinct, number = np.unique(np.round(places, 12), axis=0, return_inverse=True)
    margins = servo_margins_found(distinct, vehicle, floor)
    return np.asarray(margins[number].reshape(3, -1).min(axis=0))


def _chords_of(
    nodes: Nodes, pairs: IntArray, coefficients: Coefficients
) -> tuple[LiftedChords, FloatArray]:
    """Return what edges run along, chords of their sheet, and by how much (α3, α4) leave a continuous motion [rad].

    An edge on planes is one chord. On a curved sheet α3 or α4 may wrap, or turn by π at a fibre.
    """
    a, b = pairs.T
    starts, ends = nodes.alpha[a], nodes.alpha[b]
    rotors = coefficients.rotors
    if rotors.asymmetry is None:
        codes = np.where(nodes.red, np.int8(1), np.int8(-1))
        jump = sheet_jumps(starts, ends, codes[a], codes[b], coefficients)
        return LiftedChords(starts, ends, np.arange(len(pairs))), jump
    chords = sheet_of(rotors).chords(starts[:, :2], ends[:, :2])
    jump = np.full(len(pairs), math.pi)
    is_last = np.diff(chords.segment, append=len(pairs)) != 0
    edge = chords.segment[is_last]
    apart = np.abs(chords.ends[is_last] - ends[edge]).max(axis=1)
    jump[edge] = np.where(apart > SAME_ANGLE, np.round(apart, 12), 0.0)
    return chords, jump


def _least_of_edges(values: Any, segment: IntArray, count: int) -> FloatArray:
    """Return the least of the values of the chords of each edge, shape (count,); infinity without a chord."""
    least = np.full(count, math.inf)
    np.minimum.at(least, segment, values)
    return least


def _least_determinant(
    chords: LiftedChords, count: int, wanted: float, coefficients: Coefficients
) -> FloatArray:
    """Return the R nearest to 0 along each edge, 0 unless R has the wanted sign along the whole of it, shape (count,)."""
    starts, ends = chords.starts, chords.ends
    if not len(starts):
        return np.zeros(count)
    noise = noise_of(coefficients)
    bounded = segment_bounds.least_level_determinant(
        starts, ends, coefficients, sign=wanted, tolerance=0.0, floor=noise, each=True
    )
    keeps_sign = bounded.lower >= noise
    values = np.zeros(len(starts))
    if keeps_sign.any():
        exact = segment_bounds.least_level_determinant(
            starts[keeps_sign],
            ends[keeps_sign],
            coefficients,
            sign=wanted,
            tolerance=_DETERMINANT_TOLERANCE,
            each=True,
        )
        values[keeps_sign] = np.maximum(np.round(exact.upper, 12), noise)
    least = _least_of_edges(values, chords.segment, count)
    return wanted * np.where(np.isfinite(least), least, 0.0)
