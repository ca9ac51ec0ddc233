"""Nodes of the surface graph: the roots with one sign of R above the grid and the waypoints, with plane types.

Above each point (α1, α2) equations (7) and (8) have up to four roots (α3, α4) (:mod:`gaitgraph.surface.sheets`). Each has
a color, plane types and R; those whose R has the sign of the graph are its nodes (Proposition 1).
"""

from __future__ import annotations

import math
from collections import Counter
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_within, is_list, number_of, whole_number
from gaitgraph.errors import Advice, of_field, wrong
from gaitgraph.gait.table import ANGLES
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.surface.sheets import root_arrays, text_from_types
from gaitgraph.tolerances import SAME_ANGLE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray, IntArray
    from gaitgraph.surface.region import Zones

DEFAULT_DIVISIONS = 16
MOST_DIVISIONS = 256
"""Beyond this a graph of objects takes minutes and gigabytes; the any-angle method (`exact`) needs no grid."""
MOST_WAYPOINTS = 1000


class Nodes(NamedTuple):
    """The nodes of a graph as arrays; those on the grid come first, red before blue."""

    alpha: FloatArray  # (n, 4) [rad]
    red: BoolArray  # (n,)
    types: npt.NDArray[np.int8]  # (n, 2)
    R: FloatArray  # (n,)
    cell: IntArray  # (n, 2), numbers of the grid's lines; off the grid −1 and the waypoint's

    @property
    def plane(self) -> FloatArray:
        """The points (α1, α2), shape (n, 2) [rad]."""
        return self.alpha[:, :2]

    @property
    def colors(self) -> list[str]:
        """The color of each node."""
        return list(np.where(self.red, "red", "blue").tolist())

    def ids(self) -> Iterator[str]:
        """Yield the id of each node, as the contract of :mod:`gaitgraph.graph.build` has it."""
        copies: Counter[str] = Counter()
        for color, (i, j) in zip(self.colors, self.cell.tolist(), strict=True):
            if i >= 0:
                yield f"{i:03} {j:03} {color}"
                continue
            at_waypoint = f"w{j:03} {color}"
            yield f"{at_waypoint} {copies[at_waypoint]}"
            copies[at_waypoint] += 1

    def attributes(self, *, with_types: bool) -> Iterator[dict[str, Any]]:
        """Yield the attributes of each node; without types for a curved sheet, which has no planes."""
        for angles, types, color, R in zip(
            self.alpha.tolist(),
            self.types.tolist(),
            self.colors,
            self.R.tolist(),
            strict=True,
        ):
            node: dict[str, Any] = dict(zip(ANGLES, angles, strict=True))
            if with_types:
                node["types"] = text_from_types(*types)
            node["color"] = color
            node["R"] = R
            yield node


def roots_as_nodes(
    divisions: int,
    waypoints: Sequence[Sequence[float]],
    wanted: float,
    coefficients: Coefficients,
    zones: Zones | None,
) -> Nodes:
    """Return the roots above the interior of the grid and waypoints, R of one sign; `wanted` is that sign, ±1.

    A plane type is `?` within half a step of a crossing line.
    """
    axis = grid_axis(divisions)[1:-1]
    off_grid = _off_grid(waypoints, axis)
    on_grid = np.array(list(product(range(1, divisions), repeat=2)))
    plane = np.concatenate([axis[on_grid - 1], off_grid])
    numbers = np.column_stack([np.full(len(off_grid), -1), np.arange(len(off_grid))])
    cell = np.concatenate([on_grid, numbers])

    roots = root_arrays(
        plane[:, 0],
        plane[:, 1],
        coefficients=coefficients,
        crossing_tolerance=math.pi / (2 * divisions),
    )
    usable = wanted * np.nan_to_num(roots.R) > noise_of(coefficients)
    if coefficients.kind == "exact":
        # On blue R = 0 there: floating-point noise is not a sign.
        usable &= roots.sheet > 0
    if zones is not None:
        usable &= zones.allow_points(plane)[:, None]
    point, root = np.nonzero(usable)
    red = roots.sheet[point, root] > 0
    is_off = cell[point, 0] < 0
    order = np.lexsort((~red & ~is_off, is_off))
    point = point[order]
    root = root[order]
    return Nodes(
        alpha=roots.alpha[point, root],
        red=red[order],
        types=roots.types[point, root],
        R=roots.R[point, root],
        cell=cell[point],
    )


def _off_grid(waypoints: Sequence[Sequence[float]], axis: FloatArray) -> FloatArray:
    """Return the waypoints that are no grid nodes, shape (k, 2), one of those within 1e-9 rad of each other."""
    points: FloatArray = np.reshape(waypoints, (-1, 2))
    from_lines = np.abs(points[:, :, None] - axis).min(axis=2)
    points = points[from_lines.max(axis=1) > SAME_ANGLE]
    if not len(points):
        return points
    same = np.abs(points[:, None] - points).max(axis=2) <= SAME_ANGLE
    return np.asarray(points[same.argmax(axis=1) == np.arange(len(points))])


def grid_axis(divisions: int = DEFAULT_DIVISIONS) -> FloatArray:
    """Return the n + 1 values −π/2 + iπ/n of a grid axis, ends included [rad].

    >>> grid_axis(4).round(4).tolist()
    [-1.5708, -0.7854, 0.0, 0.7854, 1.5708]
    """
    return (2 * np.arange(divisions + 1) - divisions) * math.pi / (2 * divisions)


def checked_divisions(divisions: object) -> int:
    """Return a number of divisions, or raise InputError."""
    if number_of(divisions) > MOST_DIVISIONS:
        raise wrong(
            "divisions",
            f"must be a whole number from 2 to {MOST_DIVISIONS}",
            divisions,
            advice=Advice(
                "plan_loop(method='exact') needs no grid",
                "plan --method exact needs no grid",
            ),
        )
    return whole_number("divisions", divisions, 2, MOST_DIVISIONS)


def checked_waypoints(
    value: Any, most: float = MOST_WAYPOINTS, least: int = 1
) -> list[tuple[float, float]]:
    """Return waypoints as pairs of angles [rad]; InputError unless `least` to `most` are given, in [−π/2, π/2]²."""
    if not is_list(value) or len(value) < least:
        got = "none" if isinstance(value, tuple) and not value else ""
        raise wrong(
            "waypoints",
            "must be a list of one or more [alpha1, alpha2] in [−π/2, π/2]",
            value,
            got=got,
        )
    if len(value) > most:
        raise wrong("waypoints", f"must be at most {most}", len(value))
    points = []
    for number, angles in enumerate(value, start=1):
        with of_field("waypoints", row=number):
            if not is_list(angles) or len(angles) != 2:
                why = ""
                if is_list(angles) and len(angles) == 4:
                    why = "; α3 and α4 follow from the color"
                rule = "must be [alpha1, alpha2]"
                raise wrong(f"waypoint {number}", rule, angles, why)
            first = angle_within(angles[0], f"waypoint {number} alpha1")
            second = angle_within(angles[1], f"waypoint {number} alpha2")
        points.append((first, second))
    return points
