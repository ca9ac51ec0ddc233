"""The gait surfaces as a graph: roots are nodes, steps between neighbouring roots are edges.

The graph is a plain :class:`networkx.Graph` with a written contract, enforced by :func:`validate_graph`:

Graph metadata (``graph.graph``)
    ``contract``  "gaitgraph surface graph 1";
    ``divisions``  pieces n into which [−π/2, π/2] is cut; ``step``  π/n [rad];
    ``sign``  "positive" or "negative", the sign of R of every node;
    ``coefficients``  "published" or "exact"; ``vehicle``  the vehicle's constants as a plain mapping;
    ``crossing_tolerance``  distance from a crossing line within which a type is `?` [rad];
    ``floor``  least singular value that a flyable edge keeps.
Node ids
    ``(i, j, color)`` for the root of that color at the interior grid node α1 = −π/2 + iπ/n, α2 = −π/2 + jπ/n,
    0 < i, j < n; ``("w", k, m)`` for root m at the k-th waypoint that is off the grid.
Node attributes
    ``alpha1`` … ``alpha4`` [rad]; ``types``, e.g. "(+,?)"; ``color``, "red" or "blue"; ``R``, equation (6);
    ``cell``, (i, j) or None.
Edges
    between nodes at most one step apart in both α1 and α2 (the eight neighbours and the same cell), where
    Figure 15 allows the two types.
Edge attributes
    ``length`` in the (α1, α2) plane [rad];
    ``jump``, by how much (α3, α4) leave a continuous motion [rad], 0 for an edge that stays on its sheet;
    ``continuous``, whether jump is 0; ``keeps_sign``, whether R keeps its sign along the whole edge;
    ``least_singular_value``, a lower bound along the whole edge, exact physics, within 1e-3 of the least value
    on red (0 on blue and on jumps, where nothing better is claimed);
    ``flyable``, whether the edge is continuous, keeps the sign of R and meets the physics along its whole length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import networkx as nx
import numpy as np
import numpy.typing as npt

from gaitgraph.checks import DEFAULT_FLOOR, jumps
from gaitgraph.coloring import neighbors_allowed, types_may_be_adjacent
from gaitgraph.errors import ContractError, InputError
from gaitgraph.invertibility import (
    Coefficients,
    coefficients_of,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
)
from gaitgraph.regions import Zones
from gaitgraph.segments import (
    least_level_determinant,
    least_singular_value_along,
    thrust_shares_along,
    thrusts_push_up,
)
from gaitgraph.surface import COLORS, root_arrays, sheet_grid, text_from_types, types_of
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_from_mapping

__all__ = [
    "CONTRACT",
    "SurfaceArrays",
    "grid_axis",
    "surface_arrays",
    "surface_graph",
    "validate_graph",
    "vehicle_and_coefficients",
]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IndexArray = npt.NDArray[np.int64]
Sign = Literal["positive", "negative"]

CONTRACT = "gaitgraph surface graph 1"
DEFAULT_DIVISIONS = 16
MOST_DIVISIONS = 512

_SAME = 1e-12
_SINGULAR_VALUE_TOLERANCE = 1e-3
_METADATA = ("contract", "divisions", "step", "sign", "coefficients", "vehicle", "crossing_tolerance", "floor")
_NODE = ("alpha1", "alpha2", "alpha3", "alpha4", "types", "color", "R", "cell")
_EDGE = ("length", "jump", "continuous", "keeps_sign", "least_singular_value", "flyable")


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceArrays:
    """The same graph as arrays: N nodes and E edges, in the order of the networkx graph.

    Parameters
    ----------
    alpha, red, types, R, cell
        Nodes: tilt angles (N, 4) [rad], whether red (N,), types as +1, 0, −1 (N, 2), equation (6) (N,), grid
        indices (N, 2), −1 for waypoints.
    ids
        Node ids, length N.
    edge, length, jump, keeps_sign, least_singular_value, flyable
        Edges: node indices (E, 2), the smaller first, sorted; attributes of shape (E,).
    """

    alpha: FloatArray
    red: BoolArray
    types: npt.NDArray[np.int8]
    R: FloatArray
    cell: IndexArray
    ids: list[tuple[Any, ...]]
    edge: IndexArray
    length: FloatArray
    jump: FloatArray
    keeps_sign: BoolArray
    least_singular_value: FloatArray
    flyable: BoolArray


def checked_divisions(divisions: object) -> int:
    """Return a number of divisions, or raise InputError."""
    whole = isinstance(divisions, (int, np.integer)) and not isinstance(divisions, bool)
    if not whole or not 2 <= divisions <= MOST_DIVISIONS:  # type: ignore[operator]
        raise InputError(f"divisions: {divisions!r}; allowed is a whole number from 2 to {MOST_DIVISIONS}")
    return int(divisions)  # type: ignore[call-overload, no-any-return]


def grid_axis(divisions: int = DEFAULT_DIVISIONS) -> FloatArray:
    """Return the n + 1 values −π/2 + iπ/n of a grid axis, ends included [rad].

    >>> grid_axis(4).round(4).tolist()
    [-1.5708, -0.7854, 0.0, 0.7854, 1.5708]
    """
    return (2 * np.arange(divisions + 1) - divisions) * math.pi / (2 * divisions)


def _noise(coefficients: Coefficients) -> float:
    """Return the |R| that floating point alone can make out of zero."""
    return 64 * float(np.finfo(float).eps) * float(np.abs(coefficients.bilinear_form).sum())


def surface_arrays(
    sign: Sign = "negative",
    divisions: int = DEFAULT_DIVISIONS,
    *,
    vehicle: Vehicle = PAPER,
    coefficients: Coefficients | None = None,
    waypoints: Sequence[Sequence[float]] | npt.ArrayLike = (),
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
) -> SurfaceArrays:
    """Return the surface graph as arrays; parameters as for :func:`surface_graph`."""
    divisions = checked_divisions(divisions)
    if sign not in ("positive", "negative"):
        raise InputError(f"sign: {sign!r}; allowed are 'positive' and 'negative'")
    coefficients = coefficients or coefficients_of(vehicle)
    wanted = 1.0 if sign == "positive" else -1.0
    axis, reach = grid_axis(divisions), math.pi / (2 * divisions)
    nodes = [_grid_nodes(axis, wanted, coefficients, reach)]
    nodes.append(_waypoint_nodes(axis, waypoints, wanted, coefficients, reach))
    alpha, red, types, value, cell = (np.concatenate(parts) for parts in zip(*nodes, strict=True))
    if zones is not None and len(alpha):
        allowed = zones.allow_points(alpha[:, :2])
        alpha, red, types, value, cell = (part[allowed] for part in (alpha, red, types, value, cell))
    ids = _ids(alpha, red, cell)
    edge = _edges(alpha, red, types, cell, divisions)
    if zones is not None and len(edge):
        edge = edge[zones.allow_segments(alpha[edge[:, 0], :2], alpha[edge[:, 1], :2])]
    quantities = _edge_quantities(alpha, red, edge, wanted, vehicle, coefficients, floor)
    return SurfaceArrays(
        alpha=alpha, red=red, types=types, R=value, cell=cell, ids=ids, edge=edge, **quantities
    )


def _grid_nodes(axis: FloatArray, wanted: float, coefficients: Coefficients, reach: float) -> tuple[Any, ...]:
    inner = axis[1:-1]
    parts = []
    for color in COLORS:
        if color == "blue" and coefficients.kind == "exact":
            continue  # R = 0 there: floating-point noise is not a sign
        sheet = sheet_grid(color, inner, inner, coefficients, crossing_tolerance=reach)
        r, s = np.nonzero(wanted * sheet.R > _noise(coefficients))
        i, j = sheet.row[r], sheet.column[s]
        alpha = np.column_stack([inner[i], inner[j], sheet.alpha3[r], sheet.alpha4[s]])
        types = np.column_stack([sheet.types3[r], sheet.types4[s]])
        red = np.full(len(r), color == "red")
        parts.append((alpha, red, types, sheet.R[r, s], np.column_stack([i, j]) + 1))
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))


def _waypoint_nodes(
    axis: FloatArray, waypoints: Any, wanted: float, coefficients: Coefficients, reach: float
) -> tuple[Any, ...]:
    plane = np.asarray(waypoints, dtype=float).reshape(-1, 2)
    away = np.abs(plane[:, :, None] - axis[1:-1]).min(axis=2, initial=math.inf).max(axis=1, initial=0.0)
    plane = plane[away > _SAME]
    kept: list[Any] = []
    for point in plane:
        if not any(np.abs(point - other).max() <= _SAME for other in kept):
            kept.append(point)
    plane = np.array(kept).reshape(-1, 2)
    found = root_arrays(plane[:, 0], plane[:, 1], coefficients, crossing_tolerance=reach)
    usable = wanted * np.nan_to_num(found.R) > _noise(coefficients)
    if coefficients.kind == "exact":
        usable &= found.sheet > 0
    point, root = np.nonzero(usable)
    cell = np.full((len(point), 2), -1)
    return found.alpha[point, root], found.sheet[point, root] > 0, found.types[point, root], found.R[point, root], cell


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
        near = np.nonzero(np.abs(alpha[:w, :2] - alpha[w, :2]).max(axis=1, initial=0.0) <= step + _SAME)[0]
        pairs.append(np.column_stack([near, np.full(len(near), w)]))
    edge = np.concatenate(pairs) if pairs else np.zeros((0, 2), dtype=np.int64)
    edge = np.sort(edge, axis=1)
    a, b = edge.T
    edge = edge[neighbors_allowed((types[a, 0], types[a, 1]), (types[b, 0], types[b, 1]))]
    return np.asarray(edge[np.lexsort((edge[:, 1], edge[:, 0]))])


def _edge_quantities(
    alpha: FloatArray,
    red: BoolArray,
    edge: IndexArray,
    wanted: float,
    vehicle: Vehicle,
    coefficients: Coefficients,
    floor: float,
) -> dict[str, Any]:
    a, b = edge.T
    starts, ends = alpha[a], alpha[b]
    jump = jumps(starts, ends, red[a], red[b], coefficients)
    keeps_sign = np.zeros(len(edge), dtype=bool)
    singular = np.zeros(len(edge))
    flyable = np.zeros(len(edge), dtype=bool)
    if len(edge):
        noise = _noise(coefficients)
        least = least_level_determinant(starts, ends, coefficients, sign=wanted, floor=noise, each=True)
        keeps_sign = least.lower >= noise
    smooth = red[a] & red[b] & (jump == 0) & keeps_sign
    if smooth.any():
        p, q = starts[smooth], ends[smooth]
        bracket = least_singular_value_along(p, q, vehicle, tolerance=_SINGULAR_VALUE_TOLERANCE, each=True)
        singular[smooth] = bracket.lower
        flies = (bracket.lower >= floor) & thrusts_push_up(p, q, vehicle)
        if vehicle.max_tilt is not None:
            flies &= np.maximum(np.abs(p), np.abs(q)).max(axis=1) <= vehicle.max_tilt + _SAME
        if vehicle.max_thrust is not None and flies.any():
            vehicle.require("mass", "gravity", purpose="the limit of the largest thrust")
            assert vehicle.mass is not None
            assert vehicle.gravity is not None
            share = vehicle.max_thrust / (vehicle.mass * vehicle.gravity)
            _, _, largest = thrust_shares_along(p[flies], q[flies], vehicle, each=True)
            flies[flies] = -largest.lower <= share
        flyable[smooth] = flies
    return {
        "length": np.linalg.norm((ends - starts)[:, :2], axis=1),
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
        Further points (α1, α2), shape (k, 2) [rad]; those off the grid become nodes of their own.
    zones
        The user's keep-out and keep-in polygons; nodes and edges that break them are left out.
    floor
        Least singular value that a flyable edge keeps, dimensionless.

    Examples
    --------
    >>> graph = surface_graph("negative")
    >>> graph.number_of_nodes(), graph.nodes[14, 2, "red"]["types"]
    (294, '(+,+)')
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
    labels = [text_from_types(*pair) for pair in arrays.types.tolist()]
    rows = zip(arrays.ids, arrays.alpha.tolist(), labels, arrays.R.tolist(), arrays.red.tolist(), strict=True)
    for name, (a1, a2, a3, a4), types, value, red in rows:
        graph.add_node(
            name,
            alpha1=a1,
            alpha2=a2,
            alpha3=a3,
            alpha4=a4,
            types=types,
            color="red" if red else "blue",
            R=value,
            cell=None if name[0] == "w" else (name[0], name[1]),
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
    return graph


def vehicle_and_coefficients(graph: nx.Graph[Any]) -> tuple[Vehicle, Coefficients]:
    """Return what a surface graph was built for, from its metadata."""
    vehicle = vehicle_from_mapping(graph.graph["vehicle"])
    return vehicle, coefficients_of(vehicle, graph.graph["coefficients"])


def validate_graph(graph: nx.Graph[Any]) -> None:
    """Raise ContractError, naming the first thing that breaks it, unless a graph keeps the contract.

    Checked are metadata, ids, attributes and their types, that nodes are roots with the stated types and R, and
    that edges join neighbours that Figure 15 allows with the stated length, jump and flags. Not checked is that
    the graph is complete: nodes and edges may be removed.

    Raises
    ------
    ContractError
        If anything differs.

    Examples
    --------
    >>> graph = surface_graph(divisions=8)
    >>> graph.nodes[6, 2, "red"]["R"] = 1.0
    >>> validate_graph(graph)
    Traceback (most recent call last):
    ...
    gaitgraph.errors.ContractError: node (6, 2, 'red'): R is 1.0, computed is -6.7323
    """
    if type(graph) is not nx.Graph:
        raise ContractError(f"graph: {type(graph).__name__}; allowed is networkx.Graph")
    for key in _METADATA:
        if key not in graph.graph:
            raise ContractError(f"graph metadata: {key!r} is missing")
    meta = graph.graph
    if meta["contract"] != CONTRACT:
        raise ContractError(f"graph metadata: contract is {meta['contract']!r}; allowed is {CONTRACT!r}")
    try:
        divisions = checked_divisions(meta["divisions"])
        vehicle, coefficients = vehicle_and_coefficients(graph)
    except (InputError, TypeError) as error:
        raise ContractError(f"graph metadata: {error}") from error
    if meta["sign"] not in ("positive", "negative"):
        raise ContractError(f"graph metadata: sign is {meta['sign']!r}; allowed are 'positive' and 'negative'")
    for key, expected in (("step", math.pi / divisions), ("crossing_tolerance", math.pi / (2 * divisions))):
        if not _close(meta[key], expected):
            raise ContractError(f"graph metadata: {key} is {meta[key]!r}, computed is {expected!r}")
    for name, data in graph.nodes(data=True):
        _validate_node(name, data, meta, coefficients)
    for first, second, data in graph.edges(data=True):
        _validate_edge(graph, first, second, data, vehicle, coefficients)


def _close(stated: object, computed: float, tolerance: float = 1e-9) -> bool:
    number = isinstance(stated, (int, float)) and not isinstance(stated, bool)
    return number and abs(stated - computed) <= tolerance * max(1.0, abs(computed))  # type: ignore[operator]


def _validate_node(name: Any, data: dict[str, Any], meta: dict[str, Any], coefficients: Coefficients) -> None:
    def refuse(what: str) -> ContractError:
        return ContractError(f"node {name!r}: {what}")

    for key in _NODE:
        if key not in data:
            raise refuse(f"attribute {key!r} is missing")
    if data["color"] not in COLORS:
        raise refuse(f"color is {data['color']!r}; allowed are 'red' and 'blue'")
    if not isinstance(name, tuple) or len(name) != 3:
        raise refuse("its id is neither (i, j, color) nor ('w', k, m)")
    alpha = [data[f"alpha{k}"] for k in range(1, 5)]
    if not all(isinstance(angle, float) and abs(angle) <= math.pi / 2 for angle in alpha):
        raise refuse(f"tilt angles are {alpha!r}; allowed are floats in [−π/2, π/2]")
    if name[0] != "w":
        axis = grid_axis(meta["divisions"])
        inside = all(isinstance(k, int) and 0 < k < meta["divisions"] for k in name[:2])
        if not inside or data["cell"] != name[:2] or data["color"] != name[2]:
            raise refuse(f"its id disagrees with cell {data['cell']!r} and color {data['color']!r}")
        if not (_close(alpha[0], axis[name[0]]) and _close(alpha[1], axis[name[1]])):
            raise refuse(f"(alpha1, alpha2) is {tuple(alpha[:2])!r}, not its grid node")
    elif data["cell"] is not None:
        raise refuse(f"cell is {data['cell']!r}; allowed is None off the grid")
    scale = abs(coefficients.single) + 4
    for label, function in (("Rφ", roll_sensitivity), ("Rθ", pitch_sensitivity)):
        if abs(float(function(alpha, coefficients))) > 1e-9 * scale:
            raise refuse(f"{label} is {float(function(alpha, coefficients))!r}, not zero: it is no root")
    computed = float(level_determinant(alpha, coefficients))
    if not _close(data["R"], computed, 1e-9 * scale):
        raise refuse(f"R is {data['R']!r}, computed is {computed!r}")
    if (computed > 0) != (meta["sign"] == "positive"):
        raise refuse(f"R is {computed!r}, the graph's sign is {meta['sign']}")
    third, fourth = types_of(data["color"], alpha[0], alpha[1], coefficients, meta["crossing_tolerance"])
    expected = text_from_types(int(third), int(fourth))
    if data["types"] != expected:
        raise refuse(f"types are {data['types']!r}, computed are {expected!r}")


def _validate_edge(
    graph: nx.Graph[Any],
    first: Any,
    second: Any,
    data: dict[str, Any],
    vehicle: Vehicle,
    coefficients: Coefficients,
) -> None:
    def refuse(what: str) -> ContractError:
        return ContractError(f"edge {first!r} – {second!r}: {what}")

    for key in _EDGE:
        if key not in data:
            raise refuse(f"attribute {key!r} is missing")
    a, b = graph.nodes[first], graph.nodes[second]
    start, end = (np.array([[node[f"alpha{k}"] for k in range(1, 5)]]) for node in (a, b))
    if first == second or np.abs(end - start)[0, :2].max() > graph.graph["step"] + 1e-9:
        raise refuse("its nodes are not neighbours")
    if not types_may_be_adjacent(a["types"], b["types"]):
        raise refuse(f"Figure 15 forbids {a['types']} beside {b['types']}")
    red = (np.array([a["color"] == "red"]), np.array([b["color"] == "red"]))
    expected = _edge_quantities(
        np.vstack([start, end]),
        np.concatenate(red),
        np.array([[0, 1]]),
        1.0 if graph.graph["sign"] == "positive" else -1.0,
        vehicle,
        coefficients,
        graph.graph["floor"],
    )
    for key in ("length", "jump"):
        if not _close(data[key], float(expected[key][0])):
            raise refuse(f"{key} is {data[key]!r}, computed is {float(expected[key][0])!r}")
    expected["continuous"] = expected["jump"] == 0
    for key in ("continuous", "keeps_sign", "flyable"):
        if data[key] is not bool(expected[key][0]):
            raise refuse(f"{key} is {data[key]!r}, computed is {bool(expected[key][0])!r}")
    if not _close(data["least_singular_value"], float(expected["least_singular_value"][0]), 2e-3):
        value = float(expected["least_singular_value"][0])
        raise refuse(f"least_singular_value is {data['least_singular_value']!r}, computed is {value!r}")
