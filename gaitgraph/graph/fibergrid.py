"""The fibres over the grid: nodes on them and on the lines where they meet the red sheet, and the steps between.

The free angles of a fibre take the values of the grid. Its diagonal is the line where it meets the red sheet: the nodes
there are red, and shared. On the red side they are joined like any node that is off the grid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import level_determinant, noise_of
from gaitgraph.surface.fibers import FREE_ANGLES, fiber_points
from gaitgraph.surface.sheets import FIBERS, FIRST, SECOND, family_codes, family_distances, family_types

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.invertibility.matrices import Coefficients

__all__ = ["FiberNodes", "fiber_edges", "fiber_nodes"]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]

_SAME = 1e-9
_ROUND_OFF = 1e-12
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


@dataclass(frozen=True, slots=True, kw_only=True)
class FiberNodes:
    """Nodes beside those of the sheets' grid: on the lines, and on the fibres.

    Parameters
    ----------
    alpha, codes, types, R
        Tilt angles (N, 4) [rad]; +1 on the lines, 2 and 3 on the fibres (N,); types (N, 2); equation (6) (N,).
    ids
        ``("line1", j, "red")`` and ``("line2", i, "red")`` on the lines; ``(j, k, "fiber1")`` with α2, α4 and
        ``(i, k, "fiber2")`` with α1, α3 on the grid; ``("on", k, color)`` for the k-th waypoint off it.
    """

    alpha: FloatArray
    codes: npt.NDArray[np.int8]
    types: npt.NDArray[np.int8]
    R: FloatArray
    ids: list[tuple[Any, ...]]

    def chosen(self, keep: npt.NDArray[np.bool_]) -> FiberNodes:
        """Return some of the nodes."""
        return FiberNodes(
            alpha=self.alpha[keep],
            codes=self.codes[keep],
            types=self.types[keep],
            R=self.R[keep],
            ids=[name for name, kept in zip(self.ids, keep.tolist(), strict=True) if kept],
        )


def fiber_nodes(
    axis: FloatArray,
    wanted: float,
    coefficients: Coefficients,
    crossing_tolerance: float,
    waypoints: Sequence[tuple[Sequence[float], str]] = (),
) -> FiberNodes:
    """Return the nodes of the fibres and of their lines with R of a sign.

    Parameters
    ----------
    axis
        The values of the grid, the ends of the range included [rad]; nodes are on the others.
    wanted
        The sign of R, +1 or −1.
    coefficients, crossing_tolerance
        Of the surfaces, and of the types on the lines.
    waypoints
        Further points of fibres, each four angles [rad] and "fiber1" or "fiber2".

    Notes
    -----
    If a line falls on a value of the grid, the red nodes there are its nodes, and none are added on it.
    """
    inner = axis[1:-1]
    count = np.arange(1, len(inner) + 1)
    first, second = (part.ravel() for part in np.meshgrid(count, count, indexing="ij"))
    alpha, ids = [], []
    for number, fiber in enumerate(FIBERS, start=1):
        level = coefficients.delta if fiber == FIBERS[0] else -coefficients.delta
        if np.abs(inner - level).min() > _SAME:
            alpha.append(fiber_points(fiber, np.column_stack([inner, inner]), coefficients))
            ids += [(f"line{number}", j, "red") for j in count.tolist()]
        apart = first != second
        alpha.append(fiber_points(fiber, np.column_stack([axis[first], axis[second]])[apart], coefficients))
        ids += [(j, k, fiber) for j, k in zip(first[apart].tolist(), second[apart].tolist(), strict=True)]
    seen: list[Sequence[float]] = []
    for point, fiber in waypoints:
        free = np.asarray(point, dtype=float)[list(FREE_ANGLES[fiber])]
        on_grid = np.abs(free[:, None] - inner).min(axis=1).max() <= _SAME
        if on_grid or any(np.abs(np.subtract(point, other)).max() <= _SAME for other in seen):
            continue
        seen.append(point)
        alpha.append(np.asarray(point, dtype=float)[None])
        ids.append(("on", len(seen) - 1, fiber))
    angles = np.concatenate(alpha)
    codes = family_codes([name[2] for name in ids])
    value = np.asarray(level_determinant(angles, coefficients))
    types = np.column_stack(family_types(angles, codes, coefficients, crossing_tolerance))
    nodes = FiberNodes(alpha=angles, codes=codes, types=types, R=value, ids=ids)
    return nodes.chosen(wanted * value > noise_of(coefficients))


def fiber_edges(
    alpha: FloatArray,
    codes: npt.NDArray[np.int8],
    ids: Sequence[tuple[Any, ...]],
    axis: FloatArray,
    coefficients: Coefficients,
) -> IndexArray:
    """Return the steps that the fibres and their lines add to those of the sheets, as node indices, shape (E, 2).

    On a fibre they join nodes at most one grid step apart in both free angles, the line's own among them; from a line,
    red nodes at most one step apart in α1 and α2. All of them stay on the fibre, or on the red sheet.

    Parameters
    ----------
    alpha, codes, ids
        All nodes: tilt angles (N, 4) [rad], families (N,) and ids.
    axis
        The values of the grid [rad].
    coefficients
        Of the surfaces.
    """
    index = {name: k for k, name in enumerate(ids)}
    step = float(axis[1] - axis[0]) + _ROUND_OFF
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    distances = family_distances(alpha, coefficients)
    red = codes == 1
    for number, (code, fiber) in enumerate(zip((FIRST, SECOND), FIBERS, strict=True), start=1):
        free = list(FREE_ANGLES[fiber])
        # Of red points only those on the line, not where an arm is shifted by π.
        on_line = red & (distances[:, code] <= _SAME) & (np.abs(alpha[:, 2:] - alpha[:, :2]).max(axis=1) <= _SAME)
        grid = _grid_of(ids, index, fiber, f"line{number}", on_line, len(axis))
        for down, right in _STEPS:
            shifted = np.roll(grid, (-down, -right), axis=(0, 1))[1:-1, 1:-1]
            here = grid[1:-1, 1:-1]
            both = (here >= 0) & (shifted >= 0)
            pairs.append(np.column_stack([here[both], shifted[both]]))
        members = np.flatnonzero((codes == code) | on_line)
        listed = np.zeros(len(alpha), dtype=bool)
        listed[grid[grid >= 0]] = True
        for node in members[~listed[members]].tolist():
            apart = np.abs(alpha[members][:, free] - alpha[node, free]).max(axis=1)
            near = members[(apart <= step) & (members != node)]
            pairs.append(np.column_stack([near, np.full(len(near), node)]))
        pairs.append(_red_steps(alpha, ids, index, f"line{number}", axis, step))
    edge = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    return np.asarray(edge[edge[:, 0] != edge[:, 1]])


def _grid_of(
    ids: Sequence[tuple[Any, ...]],
    index: dict[Any, int],
    fiber: str,
    line: str,
    on_line: npt.NDArray[np.bool_],
    size: int,
) -> IndexArray:
    """Return the node at each pair of grid indices of a fibre's free angles, −1 where there is none."""
    grid = np.full((size, size), -1)
    for name, node in index.items():
        if name[2] == fiber and name[0] != "on":
            grid[name[0], name[1]] = node
        elif name[0] == line:
            grid[name[1], name[1]] = node
    for node in np.flatnonzero(on_line).tolist():
        name = ids[node]
        if isinstance(name[0], int):  # a line on a value of the grid
            j = name[1] if fiber == FIBERS[0] else name[0]
            grid[j, j] = node
    return grid


def _red_steps(
    alpha: FloatArray,
    ids: Sequence[tuple[Any, ...]],
    index: dict[Any, int],
    line: str,
    axis: FloatArray,
    step: float,
) -> IndexArray:
    """Return the steps between the nodes of a line and red nodes of the grid, of waypoints and of the other line."""
    loose = np.array([k for k, name in enumerate(ids) if _is_loose_and_red(name, alpha[k])], dtype=np.int64)
    found: list[tuple[int, int]] = []
    for name, node in index.items():
        if name[0] != line:
            continue
        cell = [int(np.searchsorted(axis, angle)) for angle in alpha[node, :2]]
        for i in range(cell[0] - 2, cell[0] + 2):
            for j in range(cell[1] - 2, cell[1] + 2):
                other = index.get((i, j, "red"))
                if other is not None and np.abs(alpha[other, :2] - alpha[node, :2]).max() <= step:
                    found.append((node, other))
        near = loose[np.abs(alpha[loose, :2] - alpha[node, :2]).max(axis=1) <= step]
        found += [(node, other) for other in near.tolist() if other != node]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _is_loose_and_red(name: tuple[Any, ...], alpha: FloatArray) -> bool:
    """Return whether a node is red and off the grid: on a line, or above a waypoint."""
    on_line = name[0] in ("line1", "line2")
    return on_line or (name[0] == "w" and float(np.abs(alpha[2:] - alpha[:2]).max()) <= _SAME)
