"""The surface graph without an object per node: eight bits a node say along which grid steps one may go.

It is the graph of :mod:`gaitgraph.graph.build` for one use, up to 4096 divisions: the same nodes, and of its edges those
that the use allows. Almost all of them are decided by arithmetic on whole rows of the grid at once:

- R keeps its sign along an edge if at both ends it exceeds an eighth of the bound of its second derivative;
- hover thrusts push up along an edge whose ends have the same signs of sin βᵢ and cos βᵢ, with sin β1·sin β2 < 0;
- the least singular value stays above a floor if at both ends it exceeds it by what it can lose between them;
- the largest thrust stays below a limit if at both ends it stays below it by what it can gain between them.

Where such a bound does not settle it, beside the borders, the edge is asked of the same function as in the graph, so
that both agree edge by edge. Edges that are no grid steps, at waypoints off the grid and between the sheets, are few
and kept as a list.

Node numbers
    The node of sheet s at the grid node (i, j), n divisions, is (s·(n + 1) + i)·(n + 1) + j; the nodes of the waypoints
    off the grid follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import WAYPOINT_SNAP, Sign, edge_quantities, grid_axis, waypoint_nodes
from gaitgraph.graph.compact_rasters import zone_raster
from gaitgraph.graph.loads import red_load
from gaitgraph.graph.walks import Use, allowed_edges
from gaitgraph.invertibility.determinant_bounds import level_determinant_curvature
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of, least_singular_value_on_red, noise_of
from gaitgraph.surface.adjacency import neighbors_allowed
from gaitgraph.surface.closed_form_roots import root_arrays, sheet_grid
from gaitgraph.surface.sheets import COLORS, Color, sheet_angles, types_of
from gaitgraph.validation.report import DEFAULT_FLOOR
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gaitgraph.surface.region import Zones

__all__ = ["MOST_COMPACT_DIVISIONS", "STEPS", "CompactGraph", "checked_compact_divisions", "compact_graph"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
ByteArray = npt.NDArray[np.uint8]
IndexArray = npt.NDArray[np.int64]

MOST_COMPACT_DIVISIONS = 4096

STEPS = ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1))
"""The grid step (Δi, Δj) of each bit; bit k + 4 is the way back of bit k."""

_FORWARD = 4
_ROWS = 256
"""Rows of the grid that are worked on at once: enough to be fast, few enough to be small."""
_ASKED = 1 << 16
_NEAR = 1e-9
_SAME = 1e-12
_SINGULAR_VALUE_DECIDED = 2e-6  # keeps_singular_value_above decides to within 1e-6
_THRUST_DECIDED = 2e-4  # edge_quantities brackets the largest thrust to within 1e-4
_BYTES_PER_NODE = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class CompactGraph:
    """A surface graph for one use, as arrays; made by :func:`compact_graph`.

    Parameters
    ----------
    sign, divisions, use, vehicle, coefficients, floor
        What it was made for.
    colors
        The sheets, in the order of their node numbers.
    bits
        For each node of the sheets, along which of the `STEPS` an edge leads, shape (sheets·(n + 1)²,).
    link
        Edges that are no grid steps: pairs of node numbers, the smaller first, sorted, shape (k, 2).
    extra
        Tilt angles of the nodes of waypoints off the grid, shape (w, 4) [rad].
    extra_red
        Whether these are on the red sheet, shape (w,).
    stops
        For each waypoint, the numbers of the nodes above it.
    """

    sign: Sign
    divisions: int
    use: Use
    vehicle: Vehicle
    coefficients: Coefficients
    floor: float
    colors: tuple[Color, ...]
    bits: ByteArray
    link: IndexArray
    extra: FloatArray
    extra_red: BoolArray
    stops: tuple[tuple[int, ...], ...]
    axis: FloatArray = field(repr=False)

    @property
    def nodes(self) -> int:
        """How many node numbers there are, used or not."""
        return len(self.bits) + len(self.extra)

    @property
    def step(self) -> float:
        """The grid's step [rad]."""
        return math.pi / self.divisions

    @property
    def offsets(self) -> IndexArray:
        """By how much a node's number changes along each of the `STEPS`, shape (8,)."""
        return np.array([i * (self.divisions + 1) + j for i, j in STEPS])

    def plane(self, nodes: npt.ArrayLike) -> FloatArray:
        """Return (α1, α2) of nodes, shape (..., 2) [rad]."""
        nodes = np.asarray(nodes)
        out = np.empty((*nodes.shape, 2))
        side = self.divisions + 1
        on_grid = nodes < len(self.bits)
        row, column = np.divmod(nodes[on_grid] % (side * side), side)
        out[on_grid, 0], out[on_grid, 1] = self.axis[row], self.axis[column]
        out[~on_grid] = self.extra[nodes[~on_grid] - len(self.bits), :2]
        return out

    def red(self, nodes: npt.ArrayLike) -> BoolArray:
        """Return whether nodes are on the red sheet, shape (...)."""
        nodes = np.asarray(nodes)
        out = np.empty(nodes.shape, dtype=bool)
        on_grid = nodes < len(self.bits)
        sheet_is_red = np.array([color == "red" for color in self.colors])
        out[on_grid] = sheet_is_red[nodes[on_grid] // (self.divisions + 1) ** 2]
        out[~on_grid] = self.extra_red[nodes[~on_grid] - len(self.bits)]
        return out

    def alpha(self, nodes: npt.ArrayLike) -> FloatArray:
        """Return the tilt angles of nodes, shape (..., 4) [rad]."""
        nodes = np.asarray(nodes)
        plane, red = self.plane(nodes), self.red(nodes)
        out = np.concatenate([plane, plane], axis=-1)
        for color, chosen in zip(COLORS, (red, ~red), strict=True):
            out[chosen, 2], out[chosen, 3] = sheet_angles(color, plane[chosen, 0], plane[chosen, 1], self.coefficients)
        out[nodes >= len(self.bits)] = self.extra[nodes[nodes >= len(self.bits)] - len(self.bits)]
        return out

    def edges(self) -> IndexArray:
        """Return all edges as pairs of node numbers, the smaller first, shape (e, 2)."""
        pairs = [self.link]
        for bit in range(_FORWARD):
            start = np.flatnonzero(self.bits & (1 << bit))
            pairs.append(np.column_stack([start, start + self.offsets[bit]]))
        return np.concatenate(pairs)


def checked_compact_divisions(divisions: object) -> int:
    """Return a number of divisions that a compact graph can have, or raise InputError.

    >>> checked_compact_divisions(4096)
    4096
    """
    whole = isinstance(divisions, (int, np.integer)) and not isinstance(divisions, bool)
    if not whole or not 2 <= divisions <= MOST_COMPACT_DIVISIONS:  # type: ignore[operator]
        needed = ""
        if whole and divisions > 2 * MOST_COMPACT_DIVISIONS:  # type: ignore[operator]
            size = 2 * float(divisions) ** 2 * _BYTES_PER_NODE / 2**30  # type: ignore[arg-type]
            needed = f", since so many would take about {size:.3g} GiB"
        raise InputError(
            f"divisions: {shown(divisions)}; allowed is a whole number from 2 to {MOST_COMPACT_DIVISIONS}{needed}"
        )
    return int(divisions)  # type: ignore[call-overload, no-any-return]


def compact_graph(
    sign: Sign = "negative",
    divisions: int = 1024,
    *,
    use: Use = "flyable",
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    waypoints: Sequence[Sequence[float]] | npt.ArrayLike = (),
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
    colors: Sequence[Color] = COLORS,
    progress: Callable[[str], None] | None = None,
) -> CompactGraph:
    """Return the surface graph for one sign of R and one use, as bits.

    Parameters
    ----------
    sign, vehicle, coefficients, waypoints, zones, floor
        As for :func:`gaitgraph.graph.build.surface_graph`.
    divisions
        Pieces into which [−π/2, π/2] is cut, at most 4096.
    use
        Which edges are kept: "flyable", "valid" or "two_color"; see :func:`gaitgraph.graph.walks.closed_walk`.
    colors
        The sheets wanted. Blue is left out where it has no edges: with exact coefficients, and if flyable.
    progress
        Called with a line of text before each step of the work.

    Raises
    ------
    InputError
        If an argument is not allowed.

    Examples
    --------
    >>> graph = compact_graph("negative", 16, use="two_color")
    >>> len(graph.edges())  # as the networkx graph
    1038
    """
    divisions = checked_compact_divisions(divisions)
    allowed_edges(use)
    if sign not in ("positive", "negative"):
        raise InputError(f"sign: {shown(sign)}; allowed are 'positive' and 'negative'")
    coefficients = coefficients or coefficients_of(vehicle)
    barren = use == "flyable" or coefficients.kind == "exact"
    sheets = tuple(color for color in COLORS if color in colors and not (color == "blue" and barren))
    axis = grid_axis(divisions)
    side = divisions + 1
    tell = progress or (lambda _: None)
    wanted = 1.0 if sign == "positive" else -1.0
    _, red, _, _, _ = extra = waypoint_nodes(axis, waypoints, wanted, coefficients, math.pi / (2 * divisions))
    chosen = np.array(["red" in sheets, "blue" in sheets])[np.where(red, 0, 1)]
    if zones is not None and len(red):
        chosen &= zones.allow_points(extra[0][:, :2])
    graph = CompactGraph(
        sign=sign,
        divisions=divisions,
        use=use,
        vehicle=vehicle,
        coefficients=coefficients,
        floor=float(floor),
        colors=sheets,
        bits=np.zeros(len(sheets) * side * side, dtype=np.uint8),
        link=np.zeros((0, 2), dtype=np.int64),
        extra=extra[0][chosen],
        extra_red=red[chosen],
        stops=(),
        axis=axis,
    )
    judge = _Judge(graph, wanted, zones)
    for number, color in enumerate(sheets):
        tell(f"deciding the steps of the {color} sheet, R {'>' if wanted > 0 else '<'} 0, {divisions} divisions")
        judge.fill(number, color)
    link = judge.links(extra[2][chosen])
    stops = tuple(_nodes_at(graph, judge, point) for point in np.asarray(waypoints, dtype=float).reshape(-1, 2))
    for array in (graph.bits, link, graph.extra, graph.extra_red):
        array.setflags(write=False)
    return _replaced(graph, link=link, stops=stops)


def _replaced(graph: CompactGraph, **changes: Any) -> CompactGraph:
    from dataclasses import replace

    return replace(graph, **changes)


def _nodes_at(graph: CompactGraph, judge: _Judge, point: FloatArray) -> tuple[int, ...]:
    """Return the nodes of the graph above a waypoint, on the grid or off it."""
    row, column = (int(np.abs(graph.axis - angle).argmin()) for angle in point)
    inner = 0 < row < graph.divisions and 0 < column < graph.divisions
    found = []
    place = np.array([graph.axis[row], graph.axis[column]])
    if inner and np.abs(place - point).max() <= WAYPOINT_SNAP:
        side = graph.divisions + 1
        for number, color in enumerate(graph.colors):
            if judge.exists(color, place):
                found.append((number * side + row) * side + column)
    near = np.abs(graph.extra[:, :2] - point).max(axis=1, initial=0.0) <= WAYPOINT_SNAP
    return (*found, *(len(graph.bits) + np.flatnonzero(near)).tolist())


class _Judge:
    """Decides the edges of one graph: most of them by rows, the others one by one."""

    def __init__(self, graph: CompactGraph, wanted: float, zones: Zones | None) -> None:
        self.graph, self.wanted, self.zones = graph, wanted, zones
        self.noise = noise_of(graph.coefficients)
        self.allowed: BoolArray | None = None
        self.near: BoolArray | None = None
        if zones is not None:
            self.allowed, self.near = zone_raster(zones, graph.axis)
        self.present: dict[str, BoolArray] = {}

    def exists(self, color: Color, place: FloatArray) -> bool:
        """Return whether the surface graph has a node of a color at a grid node (α1, α2)."""
        found = root_arrays(place[0], place[1], self.graph.coefficients)
        of_color = found.sheet == (1 if color == "red" else -1)
        rooted = (of_color & (self.wanted * np.nan_to_num(found.R) > self.noise)).any()
        return bool(rooted and (self.zones is None or self.zones.allow_points(place[None]).all()))

    def fill(self, number: int, color: Color) -> None:
        """Set the bits of one sheet."""
        graph = self.graph
        side = graph.divisions + 1
        possible = np.zeros((side, side), dtype=bool)
        unsure = np.zeros((side, side), dtype=bool)
        for start in range(1, graph.divisions, _ROWS):
            rows = slice(start, min(start + _ROWS, graph.divisions))
            possible[rows], unsure[rows] = self._nodes(color, rows)
        if self.allowed is not None and self.near is not None:
            possible &= self.allowed
            unsure = (unsure | self.near) & possible
        safe = possible & ~unsure
        whole = self._gaps(color)
        bits = graph.bits[number * side * side :][: side * side].reshape(side, side)
        ask: list[IndexArray] = []
        for bit, (di, dj) in enumerate(STEPS[:_FORWARD]):
            here = (slice(0, side - di), slice(max(0, -dj), side - max(0, dj)))
            there = (slice(di, side), slice(max(0, dj), side + min(0, dj)))
            free = safe[here] & safe[there]
            if di and not whole[0].all():
                free &= whole[0][:, None]
            if dj and not whole[1].all():
                free &= whole[1][None, :]
            bits[here] |= free.view(np.uint8) << bit
            bits[there] |= free.view(np.uint8) << (bit + _FORWARD)
            row, column = np.nonzero(unsure[here] | unsure[there])
            column = column + max(0, -dj)
            both = possible[row, column] & possible[row + di, column + dj]
            first = (number * side + row[both]) * side + column[both]
            ask.append(np.column_stack([first, first + di * side + dj, np.full(len(first), bit)]))
        asked = np.concatenate(ask)
        for start in range(0, len(asked), _ASKED):
            first, second, bit_of = asked[start : start + _ASKED].T
            passed = self.verdicts(first, second)
            np.bitwise_or.at(graph.bits, first[passed], (1 << bit_of[passed]).astype(np.uint8))
            np.bitwise_or.at(graph.bits, second[passed], (1 << (bit_of[passed] + _FORWARD)).astype(np.uint8))
        self.present[color] = possible

    def verdicts(self, first: IndexArray, second: IndexArray) -> BoolArray:
        """Return which edges the surface graph has and the use allows, asked one by one, shape (k,)."""
        graph = self.graph
        passed = np.ones(len(first), dtype=bool)
        ends = graph.alpha(first), graph.alpha(second)
        if self.zones is not None and len(first):
            passed = self.zones.allow_segments(ends[0][:, :2], ends[1][:, :2])
        if graph.use == "two_color" or not passed.any():
            return passed
        alpha = np.concatenate([ends[0][passed], ends[1][passed]])
        red = np.concatenate([graph.red(first[passed]), graph.red(second[passed])])
        edge = np.arange(len(alpha)).reshape(2, -1).T
        told = edge_quantities(alpha, red, edge, self.wanted, graph.vehicle, graph.coefficients, graph.floor)
        fits = told["flyable"] if graph.use == "flyable" else (told["jump"] == 0) & told["keeps_sign"]
        passed[passed] = fits
        return passed

    def _nodes(self, color: Color, rows: slice) -> tuple[BoolArray, BoolArray]:
        """Return which nodes of some rows may have edges, and which of them have edges that bounds do not settle."""
        graph, inner = self.graph, self.graph.axis[1:-1]
        a1, a2 = graph.axis[rows], graph.axis
        sheet = sheet_grid(color, a1, inner, graph.coefficients, crossing_tolerance=graph.step / 2)
        value = np.full((len(a1), len(a2)), -math.inf)
        value[sheet.row[:, None], sheet.column[None, :] + 1] = self.wanted * sheet.R
        possible = value > self.noise
        unsure = np.zeros_like(possible)
        if graph.use != "two_color":
            unsure = value < self.noise + self._curvature(color) / 8 + _SAME
        if graph.use == "flyable":
            self._fly(possible, unsure, a1, a2)
        return possible, unsure & possible

    def _curvature(self, color: Color) -> float:
        """Return a bound of |d²R/ds²| along the grid steps of a sheet, the same at all its nodes."""
        turn = 1.0 if color == "red" else -1.0
        third, fourth = sheet_angles(color, 0.0, 0.0, self.graph.coefficients)
        start = np.array([[0.0, 0.0, float(third), float(fourth)]])
        steps = self.graph.step * np.array([[i, j, turn * i, turn * j] for i, j in STEPS[:_FORWARD]])
        bound = level_determinant_curvature(np.repeat(start, _FORWARD, axis=0), steps, self.graph.coefficients)
        return float(bound.max()) * (1 + 1e-9)

    def _fly(self, possible: BoolArray, unsure: BoolArray, a1: FloatArray, a2: FloatArray) -> None:
        """Take in what flyable asks: thrusts that push up, the floor, the limits of the vehicle."""
        graph, step = self.graph, self.graph.step
        vehicle = graph.vehicle
        delta = math.atan(vehicle.signed_drag_ratio)
        b1, b2 = (a1 - delta)[:, None], (a2 + delta)[None, :]
        on_line = [np.minimum(np.abs(np.sin(b)), np.abs(np.cos(b))) < _NEAR for b in (b1, b2)]
        near = on_line[0] | on_line[1]
        possible &= near | (np.sin(b1) * np.sin(b2) < 0)
        least = least_singular_value_on_red(a1[:, None], a2[None, :], vehicle)
        possible &= least >= graph.floor - _NEAR
        unsure |= near | (least < graph.floor + loss_within(step, graph.floor, vehicle) + _SINGULAR_VALUE_DECIDED)
        if vehicle.max_tilt is not None:
            possible &= np.maximum(np.abs(a1)[:, None], np.abs(a2)[None, :]) <= vehicle.max_tilt + _SAME
        if vehicle.max_thrust is not None:
            mass, gravity = vehicle.require("mass", "gravity", purpose="the limit of the largest thrust")
            share = vehicle.max_thrust / (mass * gravity)
            load = red_load(a1[:, None], a2[None, :], vehicle)
            possible &= load <= share + _NEAR
            # Along an edge |sin βᵢ| is at most step²/8 above the line between its ends, and D at most step²/2 below it;
            # a quotient of two lines is largest at an end.
            largest = np.maximum(np.abs(np.sin(b1)), np.abs(np.sin(b2)))
            carried = largest / (2 * load) - step**2 / 2
            unsure |= (largest + step**2 / 8 > (share - _THRUST_DECIDED) * 2 * carried) | (carried <= 0)

    def _gaps(self, color: Color) -> tuple[BoolArray, BoolArray]:
        """Return across which gaps of α1, and of α2, safe nodes are joined, each of shape (n,)."""
        graph = self.graph
        whole = [np.ones(graph.divisions, dtype=bool) for _ in range(2)]
        if graph.use == "flyable":
            delta = math.atan(graph.vehicle.signed_drag_ratio)
            for k, beta in enumerate((graph.axis - delta, graph.axis + delta)):
                for wave in (np.sin(beta), np.cos(beta)):
                    whole[k] &= (wave[1:] > 0) == (wave[:-1] > 0)
        elif graph.use == "valid" and color == "blue":
            for k, angle in enumerate(sheet_angles(color, graph.axis, graph.axis, graph.coefficients)):
                whole[k] &= np.diff(angle) < 0  # α3 and α4 fall as α1 and α2 grow, unless they wrap by π
        return whole[0], whole[1]

    def links(self, extra_types: npt.NDArray[np.int8]) -> IndexArray:
        """Return the edges that are no grid steps: those of waypoints off the grid, and between the sheets."""
        graph = self.graph
        side, base = graph.divisions + 1, len(graph.bits)
        pairs: list[tuple[int, int]] = []
        reach = graph.step + _SAME
        for k, place in enumerate(graph.extra[:, :2]):
            near = [np.flatnonzero(np.abs(graph.axis - angle) <= reach).tolist() for angle in place]
            for number, color in enumerate(graph.colors):
                for i in near[0]:
                    pairs += [((number * side + i) * side + j, base + k) for j in near[1] if self.present[color][i, j]]
            others = np.abs(graph.extra[:k, :2] - place).max(axis=1, initial=0.0) <= reach
            pairs += [(base + int(other), base + k) for other in np.flatnonzero(others)]
        if len(graph.colors) == len(COLORS):
            pairs += self._between_sheets()
        pair = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        first, second = (self._types(nodes, extra_types) for nodes in pair.T)
        pair = pair[neighbors_allowed((first[:, 0], first[:, 1]), (second[:, 0], second[:, 1]))]
        pair = pair[self.verdicts(pair[:, 0], pair[:, 1])]
        return np.asarray(pair[np.lexsort((pair[:, 1], pair[:, 0]))])

    def _types(self, nodes: IndexArray, extra_types: npt.NDArray[np.int8]) -> npt.NDArray[np.int8]:
        graph = self.graph
        plane, red = graph.plane(nodes), graph.red(nodes)
        out = np.zeros((len(nodes), 2), dtype=np.int8)
        for color, chosen in zip(COLORS, (red, ~red), strict=True):
            a1, a2 = plane[chosen].T
            out[chosen] = np.column_stack(types_of(color, a1, a2, graph.coefficients, graph.step / 2))
        beside = nodes >= len(graph.bits)
        out[beside] = extra_types[nodes[beside] - len(graph.bits)]
        return out

    def _between_sheets(self) -> list[tuple[int, int]]:
        """Return the pairs of a red and a blue grid node, at most one step apart, that may be neighbours.

        One of the two must be `?` in α3, and one in α4: few columns and rows are.
        """
        graph = self.graph
        side = graph.divisions + 1
        kinds = types_of("red", graph.axis, graph.axis, graph.coefficients, graph.step / 2)
        rows, columns = (sorted({int(k) + d for k in np.flatnonzero(kind == 0) for d in (-1, 0, 1)}) for kind in kinds)
        pairs = []
        for i in rows:
            for j in columns:
                if not (0 < i < side and 0 < j < side and self.present["red"][i, j]):
                    continue
                for di, dj in ((0, 0), *STEPS):
                    k, m = i + di, j + dj
                    if 0 <= k < side and 0 <= m < side and self.present["blue"][k, m]:
                        pairs.append((i * side + j, (side + k) * side + m))
        return pairs


def loss_within(step: float, value: npt.ArrayLike, vehicle: Vehicle) -> FloatArray:
    """Return by how much, on the red sheet, the least singular value along a grid step can be below both its ends.

    Parameters
    ----------
    step
        The grid's step [rad]; the bound holds for all eight directions.
    value
        What both ends exceed, shape (...).

    Returns
    -------
    array of shape (...)
        A bound that falls as `value` grows.

    Notes
    -----
    No column of the matrix turns faster than √(2 + κ²) per radian, which alone bounds the loss by √(2 + κ²) times the
    step. The second bound: the least singular value is the least of |B·v| over unit vectors v, and |B·v|'' is at most
    |B'|²/|B·v| + |B''| in each of the blocks B into which the matrix splits on red. Along a diagonal step |B'| ≤
    2·√(2 + κ²)·step and |B''| ≤ 2·√(2 + κ²)·step²; half a step away |B·v| is at least `value` less the first bound. A
    function is above the lower of its ends less an eighth of the bound of its second derivative.

    Examples
    --------
    >>> loss_within(0.001, [0.05, 0.5], PAPER).round(7).tolist()
    [2.12e-05, 2.4e-06]
    """
    turning = math.sqrt(2.0 + vehicle.drag_ratio**2)
    value = np.asarray(value, dtype=float)
    first = turning * step
    left = value - first
    with np.errstate(divide="ignore"):
        second = np.where(left > 0, (2 * turning * step) ** 2 / np.where(left > 0, left, 1.0), math.inf)
    return np.asarray(np.minimum(first, (second + 2 * turning * step**2) / 8))
