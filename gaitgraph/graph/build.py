"""The gait surfaces as a graph: roots are nodes, steps between neighbouring roots are edges.

The graph is a plain :class:`networkx.Graph` with a written contract, enforced by
:func:`gaitgraph.graph.contract.validate_graph`:

Graph metadata (``graph.graph``)
    ``contract``  "gaitgraph surface graph 1";
    ``divisions``  pieces n into which [−π/2, π/2] is cut; ``step``  π/n [rad];
    ``sign``  "positive" or "negative", the sign of R of every node;
    ``coefficients``  "published" or "exact"; ``vehicle``  the vehicle's constants as a plain mapping;
    ``crossing_tolerance``  distance from a crossing line within which a type is `?` [rad];
    ``floor``  least singular value that a flyable edge keeps;
    ``sheets``  "all" if the fibres are in it; absent if it holds red and blue alone.
Node ids
    ``(i, j, color)`` for the root of that color at the interior grid node α1 = −π/2 + iπ/n, α2 = −π/2 + jπ/n,
    0 < i, j < n; ``("w", k, m)`` for the m-th node at the k-th waypoint off the grid that has nodes.
    With the fibres also ``(j, k, "fiber1")`` for α1 = α3 = δ and (α2, α4) on the grid, ``(i, k, "fiber2")`` for
    α2 = α4 = −δ and (α1, α3) on the grid; ``("line1", j, "red")`` and ``("line2", i, "red")`` where these meet the red
    sheet, at (δ, α2) and at (α1, −δ); ``("on", k, color)`` for the k-th waypoint on a fibre off its grid.
Node attributes
    ``alpha1`` … ``alpha4`` [rad]; ``types``, e.g. "(+,?)"; ``color``, "red" or "blue", "fiber1" or "fiber2";
    ``R``, equation (6); ``cell``, (i, j) or None; on fibres and lines None.
Edges
    between nodes at most one step apart in both α1 and α2 (the eight neighbours and the same cell), where
    Figure 15 allows the two types. With the fibres also between nodes of one fibre at most one step apart in both of
    its free angles, the red ones on its line among them; nodes on a line have no edges to blue. A fibre's types, (?,*)
    and (*,?), may be beside any.
Edge attributes
    ``length`` in the (α1, α2) plane [rad];
    ``jump``, by how much (α3, α4) leave a continuous motion [rad], 0 for an edge that stays on its sheet;
    ``continuous``, whether jump is 0; ``keeps_sign``, whether R keeps its sign along the whole edge;
    ``least_singular_value``, the least value along the whole edge, exact physics, to within 1e-5 on red; 0 on blue,
    where it is less than that, and on jumps, where nothing is claimed;
    ``flyable``, whether the edge is continuous, keeps the sign of R and meets the physics along its whole length;
    never on a fibre, where a pair of rotors idles in hover.
    With the fibres also ``travel``, the length in four dimensions over √2 [rad], which is ``length`` for an edge that
    stays on a sheet; ``least_singular_value`` on a fibre is to within 1e-4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import networkx as nx
import numpy as np
import numpy.typing as npt

from gaitgraph.errors import ContractError, InputError, shown
from gaitgraph.graph.fibergrid import fiber_edges, fiber_nodes
from gaitgraph.invertibility.determinant_bounds import least_level_determinant
from gaitgraph.invertibility.matrices import Coefficients, coefficients_of, noise_of
from gaitgraph.invertibility.singular_value_bounds import keeps_singular_value_above, least_singular_value_along
from gaitgraph.invertibility.thrust_bounds import thrust_shares_along, thrusts_push_up
from gaitgraph.surface.adjacency import neighbors_allowed, text_from_types
from gaitgraph.surface.closed_form_roots import root_arrays, sheet_grid
from gaitgraph.surface.fibers import point_on_family, travel_of
from gaitgraph.surface.sheets import COLORS, FIBERS, checked_plane_angles, family_jumps, family_of
from gaitgraph.validation.report import DEFAULT_FLOOR
from gaitgraph.validation.rules import jumps
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from gaitgraph.surface.region import Zones

__all__ = [
    "CONTRACT",
    "SurfaceArrays",
    "grid_axis",
    "nodes_above",
    "surface_arrays",
    "surface_graph",
    "vehicle_and_coefficients",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IndexArray = npt.NDArray[np.int64]
Sign = Literal["positive", "negative"]
Sheets = Literal["planes", "all"]

CONTRACT = "gaitgraph surface graph 1"
DEFAULT_DIVISIONS = 16
MOST_DIVISIONS = 1024

_SAME = 1e-12
WAYPOINT_SNAP = 1e-9
"""A waypoint this near to a grid node [rad] is that node."""
_SINGULAR_VALUE_TOLERANCE = 1e-5
_ON_FIBER_TOLERANCE = 1e-4
_JUMP = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceArrays:
    """The same graph as arrays: N nodes and E edges, in the order of the networkx graph.

    Parameters
    ----------
    alpha, red, types, R, cell
        Nodes: tilt angles (N, 4) [rad], whether red (N,), types as +1, 0, −1 (N, 2), equation (6) (N,), grid
        indices (N, 2), −1 for waypoints and for nodes on fibres and lines.
    codes
        Nodes: families, +1 red, −1 blue, 2 the first fibre, 3 the second (N,).
    ids
        Node ids, length N.
    edge, length, travel, jump, keeps_sign, least_singular_value, flyable
        Edges: node indices (E, 2), the smaller first, sorted; attributes of shape (E,).
    """

    alpha: FloatArray
    red: BoolArray
    codes: npt.NDArray[np.int8]
    types: npt.NDArray[np.int8]
    R: FloatArray
    cell: IndexArray
    ids: list[tuple[Any, ...]]
    edge: IndexArray
    length: FloatArray
    travel: FloatArray
    jump: FloatArray
    keeps_sign: BoolArray
    least_singular_value: FloatArray
    flyable: BoolArray


def checked_divisions(divisions: object) -> int:
    """Return a number of divisions, or raise InputError."""
    whole = isinstance(divisions, (int, np.integer)) and not isinstance(divisions, bool)
    if not whole or not 2 <= divisions <= MOST_DIVISIONS:  # type: ignore[operator]
        raise InputError(f"divisions: {shown(divisions)}; allowed is a whole number from 2 to {MOST_DIVISIONS}")
    return int(divisions)  # type: ignore[call-overload, no-any-return]


def grid_axis(divisions: int = DEFAULT_DIVISIONS) -> FloatArray:
    """Return the n + 1 values −π/2 + iπ/n of a grid axis, ends included [rad].

    >>> grid_axis(4).round(4).tolist()
    [-1.5708, -0.7854, 0.0, 0.7854, 1.5708]
    """
    return (2 * np.arange(divisions + 1) - divisions) * math.pi / (2 * divisions)


def surface_arrays(
    sign: Sign = "negative",
    divisions: int = DEFAULT_DIVISIONS,
    *,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    waypoints: Sequence[Sequence[float]] | npt.ArrayLike = (),
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
    sheets: Sheets = "planes",
) -> SurfaceArrays:
    """Return the surface graph as arrays; parameters as for :func:`surface_graph`."""
    divisions = checked_divisions(divisions)
    if sign not in ("positive", "negative"):
        raise InputError(f"sign: {shown(sign)}; allowed are 'positive' and 'negative'")
    if not isinstance(sheets, str) or sheets not in ("planes", "all"):
        raise InputError(f"sheets: {shown(sheets)}; allowed are 'planes' and 'all'")
    coefficients = coefficients or coefficients_of(vehicle)
    wanted = 1.0 if sign == "positive" else -1.0
    axis, reach = grid_axis(divisions), math.pi / (2 * divisions)
    waypoints, on_fibers = _sorted_waypoints(waypoints, coefficients) if sheets == "all" else (waypoints, [])
    nodes = [_grid_nodes(axis, wanted, coefficients, reach)]
    nodes.append(waypoint_nodes(axis, waypoints, wanted, coefficients, reach))
    alpha, red, types, value, cell = (np.concatenate(parts) for parts in zip(*nodes, strict=True))
    if zones is not None and len(alpha):
        allowed = zones.allow_points(alpha[:, :2])
        alpha, red, types, value, cell = (part[allowed] for part in (alpha, red, types, value, cell))
    ids = _ids(alpha, red, cell)
    edge = _edges(alpha, red, types, cell, divisions)
    codes = np.where(red, 1, -1).astype(np.int8)
    if sheets == "all":
        more = fiber_nodes(axis, wanted, coefficients, reach, on_fibers)
        if zones is not None and len(more.alpha):
            more = more.chosen(zones.allow_points(more.alpha[:, :2]))
        alpha, codes, types, value = (
            np.concatenate(pair)
            for pair in ((alpha, more.alpha), (codes, more.codes), (types, more.types), (value, more.R))
        )
        red, cell = codes == 1, np.vstack([cell, np.full((len(more.alpha), 2), -1)])
        ids += more.ids
        edge = np.unique(np.concatenate([edge, fiber_edges(alpha, codes, ids, axis, coefficients)]), axis=0)
    if zones is not None and len(edge):
        edge = edge[zones.allow_segments(alpha[edge[:, 0], :2], alpha[edge[:, 1], :2])]
    quantities = edge_quantities(alpha, red, edge, wanted, vehicle, coefficients, floor, codes=codes)
    return SurfaceArrays(
        alpha=alpha, red=red, codes=codes, types=types, R=value, cell=cell, ids=ids, edge=edge, **quantities
    )


def _sorted_waypoints(waypoints: Any, coefficients: Coefficients) -> tuple[list[Any], list[Any]]:
    """Return the waypoints (α1, α2), and those of four angles that are on a fibre, each with its color."""
    plane: list[Any] = []
    on_fibers: list[Any] = []
    for point in waypoints:
        if len(point) == 2:
            plane.append(tuple(point))
            continue
        angles, color = point_on_family(point, coefficients, tolerance=WAYPOINT_SNAP, name="waypoints")
        if color in FIBERS:
            on_fibers.append((angles, color))
        else:
            plane.append(angles[:2])
    return plane, on_fibers


def _grid_nodes(axis: FloatArray, wanted: float, coefficients: Coefficients, reach: float) -> tuple[Any, ...]:
    inner = axis[1:-1]
    parts = []
    for color in COLORS:
        if color == "blue" and coefficients.kind == "exact":
            continue  # R = 0 there: floating-point noise is not a sign
        sheet = sheet_grid(color, inner, inner, coefficients, crossing_tolerance=reach)
        r, s = np.nonzero(wanted * sheet.R > noise_of(coefficients))
        i, j = sheet.row[r], sheet.column[s]
        alpha = np.column_stack([inner[i], inner[j], sheet.alpha3[r], sheet.alpha4[s]])
        types = np.column_stack([sheet.types3[r], sheet.types4[s]])
        red = np.full(len(r), color == "red")
        parts.append((alpha, red, types, sheet.R[r, s], np.column_stack([i, j]) + 1))
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))


def waypoint_nodes(
    axis: FloatArray, waypoints: Any, wanted: float, coefficients: Coefficients, reach: float
) -> tuple[Any, ...]:
    """Return the nodes above waypoints off the grid as arrays: alpha, on red, types, R and cell, which is −1.

    Of waypoints within 1e-9 rad of each other one serves.
    """
    plane = np.asarray(waypoints, dtype=float).reshape(-1, 2)
    checked_plane_angles(plane[:, 0], plane[:, 1])
    away = np.abs(plane[:, :, None] - axis[1:-1]).min(axis=2).max(axis=1)
    plane = plane[away > WAYPOINT_SNAP]
    same = np.abs(plane[:, None] - plane).max(axis=2) <= WAYPOINT_SNAP
    if len(plane):
        plane = plane[same.argmax(axis=1) == np.arange(len(plane))]
    found = root_arrays(plane[:, 0], plane[:, 1], coefficients, crossing_tolerance=reach)
    usable = wanted * np.nan_to_num(found.R) > noise_of(coefficients)
    if coefficients.kind == "exact":
        usable &= found.sheet > 0
    point, root = np.nonzero(usable)
    cell = np.full((len(point), 2), -1)
    return (
        found.alpha[point, root],
        found.sheet[point, root] > 0,
        found.types[point, root],
        found.R[point, root],
        cell,
    )


def _ids(alpha: FloatArray, red: BoolArray, cell: IndexArray) -> list[tuple[Any, ...]]:
    ids: list[tuple[Any, ...]] = []
    seen: dict[tuple[float, float], list[int]] = {}
    for angles, is_red, (i, j) in zip(alpha[:, :2].tolist(), red.tolist(), cell.tolist(), strict=True):
        if i >= 0:
            ids.append((i, j, "red" if is_red else "blue"))
        else:
            number = seen.setdefault((angles[0], angles[1]), [len(seen), 0])
            ids.append(("w", number[0], number[1]))
            number[1] += 1
    return ids


def _edges(
    alpha: FloatArray, red: BoolArray, types: npt.NDArray[np.int8], cell: IndexArray, divisions: int
) -> IndexArray:
    on_grid = cell[:, 0] >= 0
    index = np.full((2, divisions + 1, divisions + 1), -1)
    grid = np.nonzero(on_grid)[0]
    index[red[grid].astype(int), cell[grid, 0], cell[grid, 1]] = grid
    pairs = []
    inner = slice(1, divisions)
    for di, dj in ((0, 0), (0, 1), (1, 0), (1, 1), (1, -1)):
        shifted = np.roll(index, (-di, -dj), axis=(1, 2))[:, inner, inner]
        for first in range(2):
            for second in range(2):
                if (di, dj) == (0, 0) and first >= second:
                    continue
                a, b = index[first, inner, inner], shifted[second]
                both = (a >= 0) & (b >= 0)
                pairs.append(np.column_stack([a[both], b[both]]))
    step = math.pi / divisions
    for w in np.nonzero(~on_grid)[0]:
        near = np.nonzero(np.abs(alpha[:w, :2] - alpha[w, :2]).max(axis=1) <= step + _SAME)[0]
        pairs.append(np.column_stack([near, np.full(len(near), w)]))
    edge = np.sort(np.concatenate(pairs), axis=1)
    a, b = edge.T
    edge = edge[neighbors_allowed((types[a, 0], types[a, 1]), (types[b, 0], types[b, 1]))]
    return np.asarray(edge[np.lexsort((edge[:, 1], edge[:, 0]))])


def edge_quantities(
    alpha: FloatArray,
    red: BoolArray,
    edge: IndexArray,
    wanted: float,
    vehicle: Vehicle,
    coefficients: Coefficients,
    floor: float,
    *,
    codes: npt.NDArray[np.int8] | None = None,
) -> dict[str, Any]:
    """Return the edge attributes of :class:`SurfaceArrays`; `wanted` is the sign of R, +1 or −1.

    `codes` are the families of the nodes, if some are on fibres.
    """
    a, b = edge.T
    starts, ends = alpha[a], alpha[b]
    jump = jumps(starts, ends, red[a], red[b], coefficients)
    fibered = np.zeros(len(edge), dtype=bool) if codes is None else (codes[a] > 1) | (codes[b] > 1)
    if codes is not None and fibered.any():
        left = family_jumps(starts[fibered], ends[fibered], codes[a][fibered], codes[b][fibered], coefficients)
        jump[fibered] = np.where(left > _JUMP, left, 0.0)
    keeps_sign = np.zeros(len(edge), dtype=bool)
    singular = np.zeros(len(edge))
    flyable = np.zeros(len(edge), dtype=bool)
    if len(edge):
        noise = noise_of(coefficients)
        least = least_level_determinant(starts, ends, coefficients, sign=wanted, tolerance=0.0, floor=noise, each=True)
        keeps_sign = least.lower >= noise
    smooth = red[a] & red[b] & (jump == 0) & keeps_sign
    if smooth.any():
        p, q = starts[smooth], ends[smooth]
        bracket = least_singular_value_along(p, q, vehicle, tolerance=_SINGULAR_VALUE_TOLERANCE, each=True)
        singular[smooth] = bracket.upper
        flies = bracket.lower >= floor
        close = ~flies & (bracket.upper >= floor)
        if close.any():
            flies[close] = keeps_singular_value_above(p[close], q[close], floor, vehicle)
        flies &= thrusts_push_up(p, q, vehicle)
        if vehicle.max_tilt is not None:
            flies &= np.maximum(np.abs(p), np.abs(q)).max(axis=1) <= vehicle.max_tilt + _SAME
        if vehicle.max_thrust is not None and flies.any():
            mass, gravity = vehicle.require("mass", "gravity", purpose="the limit of the largest thrust")
            share = vehicle.max_thrust / (mass * gravity)
            _, _, largest = thrust_shares_along(p[flies], q[flies], vehicle, each=True)
            flies[flies] = -largest.lower <= share
        flyable[smooth] = flies
    along = fibered & (jump == 0) & keeps_sign
    if along.any():
        singular[along] = least_singular_value_along(
            starts[along], ends[along], vehicle, tolerance=_ON_FIBER_TOLERANCE, each=True
        ).upper
    length = np.linalg.norm((ends - starts)[:, :2], axis=1)
    return {
        "length": length,
        # On a sheet both are the same but for rounding, which ties between paths would feel.
        "travel": np.where(fibered | (jump > 0), travel_of(starts, ends), length),
        "jump": jump,
        "keeps_sign": keeps_sign,
        "least_singular_value": singular,
        "flyable": flyable,
    }


def surface_graph(
    sign: Sign = "negative",
    divisions: int = DEFAULT_DIVISIONS,
    *,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    waypoints: Sequence[Sequence[float]] | npt.ArrayLike = (),
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
    sheets: Sheets = "planes",
) -> nx.Graph[Any]:
    """Return the graph of the gait surfaces for one sign of R; its contract is the module's.

    Parameters
    ----------
    sign
        "positive" or "negative": roots with the other sign of R are left out (Proposition 1).
    divisions
        Pieces into which [−π/2, π/2] is cut; 16 in the paper.
    vehicle, coefficients
        By default the paper's vehicle with its published coefficients. With exact coefficients there are no
        blue nodes, since R = 0 there.
    waypoints
        Further points (α1, α2), shape (k, 2) [rad]; those off the grid, by more than 1e-9 rad, become nodes of their
        own.
    zones
        The user's keep-out and keep-in polygons; nodes and edges that break them are left out.
    floor
        Least singular value that a flyable edge keeps, dimensionless.
    sheets
        "planes": the red and the blue sheet. "all": the two fibres too, which with the red sheet are the complete set
        of solutions with R ≠ 0 in exact physics. Then waypoints may be four angles, on a sheet or a fibre to within
        1e-9 rad; see :func:`gaitgraph.surface.fibers.point_on_family`.

    Examples
    --------
    >>> graph = surface_graph("negative")
    >>> graph.number_of_nodes(), graph.nodes[14, 2, "red"]["types"]
    (294, '(+,+)')
    >>> complete = surface_graph("negative", sheets="all")
    >>> complete.nodes[4, 6, "fiber1"]["types"], ("line1", 4, "red") in complete
    ('(?,*)', True)
    """
    coefficients = coefficients or coefficients_of(vehicle)
    arrays = surface_arrays(
        sign,
        divisions,
        vehicle=vehicle,
        coefficients=coefficients,
        waypoints=waypoints,
        zones=zones,
        floor=floor,
        sheets=sheets,
    )
    graph: nx.Graph[Any] = nx.Graph(
        contract=CONTRACT,
        divisions=int(divisions),
        step=math.pi / divisions,
        sign=sign,
        coefficients=coefficients.kind,
        vehicle=vehicle.as_mapping(),
        crossing_tolerance=math.pi / (2 * divisions),
        floor=float(floor),
    )
    if sheets == "all":
        graph.graph["sheets"] = "all"
    _fill(graph, arrays, travels=sheets == "all")
    return graph


def _fill(graph: nx.Graph[Any], arrays: SurfaceArrays, *, travels: bool) -> None:
    """Add the nodes and edges of arrays to a graph, in their order; with the attribute `travel` or without."""
    labels = [text_from_types(*pair) for pair in arrays.types.tolist()]
    rows = zip(arrays.ids, arrays.alpha.tolist(), labels, arrays.R.tolist(), arrays.codes.tolist(), strict=True)
    for name, (a1, a2, a3, a4), types, value, code in rows:
        graph.add_node(
            name,
            alpha1=a1,
            alpha2=a2,
            alpha3=a3,
            alpha4=a4,
            types=types,
            color=family_of(code),
            R=value,
            cell=(name[0], name[1]) if abs(code) == 1 and isinstance(name[0], int) else None,
        )
    ids = arrays.ids
    columns = (
        arrays.edge.tolist(),
        arrays.length.tolist(),
        arrays.jump.tolist(),
        arrays.keeps_sign.tolist(),
        arrays.least_singular_value.tolist(),
        arrays.flyable.tolist(),
    )
    graph.add_edges_from(
        (
            ids[a],
            ids[b],
            {
                "length": length,
                "jump": jump,
                "continuous": jump == 0,
                "keeps_sign": keeps,
                "least_singular_value": singular,
                "flyable": flies,
            },
        )
        for (a, b), length, jump, keeps, singular, flies in zip(*columns, strict=True)
    )
    if travels:
        for (a, b), travel in zip(arrays.edge.tolist(), arrays.travel.tolist(), strict=True):
            graph.edges[ids[a], ids[b]]["travel"] = travel


def nodes_above(graph: nx.Graph[Any], waypoints: Iterable[Sequence[float]]) -> list[list[Any]]:
    """Return the nodes above each waypoint (α1, α2), or at each one of four angles, to within 1e-9 rad."""
    nodes = list(graph.nodes)
    alpha = np.array([[data[f"alpha{k}"] for k in range(1, 5)] for _, data in graph.nodes(data=True)]).reshape(-1, 4)
    out = []
    for point in waypoints:
        near = np.nonzero(np.abs(alpha[:, : len(point)] - np.array(point)).max(axis=1) <= WAYPOINT_SNAP)[0]
        out.append([nodes[k] for k in near])
    return out


def vehicle_and_coefficients(graph: nx.Graph[Any]) -> tuple[Vehicle, Coefficients]:
    """Return what a surface graph was built for, from its metadata."""
    for key in ("vehicle", "coefficients"):
        if key not in graph.graph:
            raise ContractError(f"graph metadata: {key!r} is missing")
    vehicle = vehicle_from_mapping(graph.graph["vehicle"])
    return vehicle, coefficients_of(vehicle, graph.graph["coefficients"])
