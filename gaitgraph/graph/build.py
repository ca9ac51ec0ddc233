"""The gait surfaces as a graph: roots are nodes, steps between neighbouring roots are edges.

The graph is a plain :class:`networkx.Graph` with a written contract, enforced by :func:`validate_graph`. Node ids are
texts and attributes are scalars, so networkx writes a graph as node-link JSON, GraphML, GEXF or GML, and what it reads
back keeps the contract. More attributes, such as readers add, do no harm.

Graph metadata (``graph.graph``)
    ``name``  a JSON object as one text, since GEXF keeps nothing else; :func:`metadata_of` reads it:
    ``contract``  "gaitgraph surface graph 1";
    ``sign``  "positive" or "negative", the sign of R of every node;
    ``divisions``  intervals n into which [−π/2, π/2] is cut; a step of the grid is π/n [rad], and a type is `?` within
    half a step of a crossing line;
    ``coefficients``  "published", "printed" or "exact"; ``floor``  least singular value that a flyable edge keeps;
    ``vehicle``  the vehicle's constants as a plain mapping.
Node ids
    "003 012 red" for the root of that color at the interior grid node α1 = −π/2 + 3π/n, α2 = −π/2 + 12π/n: both
    numbers in three digits, from 1 to n − 1;
    "w002 red 0" for the first red root, counted from 0, at the third of the waypoints off the grid that have nodes.
Node attributes
    ``alpha1`` … ``alpha4`` [rad]; ``types``, e.g. "(+,?)"; ``color``, "red" or "blue"; ``R``, equation (6).
    Of a vehicle that no half turn maps to itself the invertible root is "red", and ``types`` is left out: its sheet is
    curved, and has no planes.
Edges
    between nodes at most one step apart in both α1 and α2 (the eight neighbours and the same cell), where
    Figure 15 allows the two types.
Edge attributes
    ``length`` in the (α1, α2) plane [rad];
    ``jump``, by how much (α3, α4) leave a continuous motion [rad], 0 for an edge that stays on its sheet;
    ``continuous``, whether jump is 0; ``keeps_sign``, whether R keeps its sign along the whole edge;
    ``least_singular_value`` along the whole edge, exact physics, to within 1e-5 on red; 0 on blue, where it is below
    that, and on jumps;
    ``flyable``, whether the edge is continuous, keeps the sign of R and meets the physics along its whole length.
    An edge is a straight segment of the four angles. On a curved sheet it is a chord, which leaves the sheet between
    its ends, and ``jump`` is π where α3 or α4 wraps.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import (
    angle_within,
    checked_number,
    is_list,
    number_of,
    whole_number,
    wrapped,
)
from gaitgraph.errors import Advice, ContractError, InputError, checked_choice, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.invertibility import segment_bounds
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.surface.sheets import (
    neighbors_allowed,
    root_arrays,
    sheet_jumps,
    text_from_types,
)
from gaitgraph.tolerances import DEFAULT_FLOOR, ROUND_OFF, SAME_ANGLE
from gaitgraph.vehicle import (
    PAPER,
    Vehicle,
    VehicleLike,
    vehicle_from_mapping,
    vehicle_named,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import networkx as nx

    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.invertibility.matrices import BoolArray, IntArray
    from gaitgraph.surface.region import Zones
    from gaitgraph.surface.sheets import Sign

CONTRACT = "gaitgraph surface graph 1"
DEFAULT_DIVISIONS = 16
MOST_DIVISIONS = 256
"""Beyond this a graph of objects takes minutes and gigabytes; the any-angle method (`exact`) needs no grid."""
MOST_WAYPOINTS = 1000

_WAYPOINT = "w"  # begins the ids of nodes at waypoints
_SINGULAR_VALUE_TOLERANCE = 1e-5
_TOLERANCES = {"least_singular_value": 2e-5}


def checked_divisions(divisions: object) -> int:
    """Return a number of divisions, or raise InputError."""
    if number_of(divisions) > MOST_DIVISIONS:
        raise InputError(
            f"divisions must be a whole number from 2 to {MOST_DIVISIONS}, got {shown(divisions)}",
            field="divisions",
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
        got = "none" if isinstance(value, tuple) and not value else shown(value)
        raise InputError(
            f"waypoints must be a list of one or more [alpha1, alpha2] in [−π/2, π/2], got {got}",
            field="waypoints",
        )
    if len(value) > most:
        raise InputError(
            f"waypoints must be at most {most}, got {len(value)}", field="waypoints"
        )
    points = []
    for number, angles in enumerate(value, start=1):
        given = len(angles) if is_list(angles) else 0
        if given != 2:
            why = "; α3 and α4 follow from the color" if given == 4 else ""
            raise InputError(
                f"waypoint {number} must be [alpha1, alpha2], got {shown(angles)}{why}"
            )
        first = angle_within(angles[0], f"waypoint {number} alpha1")
        points.append((first, angle_within(angles[1], f"waypoint {number} alpha2")))
    return points


def grid_axis(divisions: int = DEFAULT_DIVISIONS) -> FloatArray:
    """Return the n + 1 values −π/2 + iπ/n of a grid axis, ends included [rad].

    >>> grid_axis(4).round(4).tolist()
    [-1.5708, -0.7854, 0.0, 0.7854, 1.5708]
    """
    return (2 * np.arange(divisions + 1) - divisions) * math.pi / (2 * divisions)


def surface_graph(
    sign: Sign = "negative",
    *,
    divisions: int = DEFAULT_DIVISIONS,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    waypoints: Sequence[Sequence[float | str]] | npt.ArrayLike = (),
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
) -> nx.Graph[Any]:
    """Return the graph of the gait surfaces for one sign of R, with the contract of :mod:`gaitgraph.graph.build`.

    Parameters
    ----------
    sign
        "positive" or "negative": roots with the other sign of R are left out (Proposition 1).
    divisions
        Intervals into which [−π/2, π/2] is cut, at most 256; 16 in the paper.
    vehicle, coefficients
        By default the paper's vehicle with its published coefficients. With exact coefficients there are no
        blue nodes: R = 0 there, or with a rotor height Rφ and Rθ are not 0.
    waypoints
        Further points (α1, α2), numbers [rad] or texts; those more than 1e-9 rad off the grid become nodes.
    zones
        The user's keep-out and keep-in polygons; nodes and edges that break them are left out.
    floor
        Least singular value floor of flyable edges, dimensionless.

    Examples
    --------
    >>> graph = surface_graph("negative")
    >>> graph.number_of_nodes(), graph.nodes["014 002 red"]["types"]
    (294, '(+,+)')
    """
    import networkx as nx

    divisions = checked_divisions(divisions)
    checked_choice("sign", sign, ("positive", "negative"))
    floor = checked_number("floor", floor)
    vehicle = vehicle_named(vehicle)
    coefficients = coefficients_of(vehicle, coefficients)
    wanted = 1.0 if sign == "positive" else -1.0
    crossing_tolerance = math.pi / (2 * divisions)
    alpha, red, types, R, cell = _nodes(
        divisions, waypoints, wanted, coefficients, crossing_tolerance
    )
    if zones is not None and len(alpha):
        allowed = zones.allow_points(alpha[:, :2])
        alpha, red, types, R, cell = (
            part[allowed] for part in (alpha, red, types, R, cell)
        )
    edge = _edges(alpha, red, types, cell, divisions)
    if zones is not None and len(edge):
        edge = edge[zones.allow_segments(alpha[edge[:, 0], :2], alpha[edge[:, 1], :2])]
    quantities = _edge_quantities(
        alpha, red, edge, wanted, vehicle, coefficients, floor
    )

    metadata = {
        "contract": CONTRACT,
        "sign": sign,
        "divisions": divisions,
        "coefficients": coefficients.kind,
        "floor": floor,
        "vehicle": vehicle.as_mapping(),
    }
    graph: nx.Graph[Any] = nx.Graph(name=json.dumps(metadata))
    ids: list[str] = []
    places: dict[tuple[float, float], int] = {}  # waypoints by their order
    copies: Counter[str] = Counter()
    for angles, pair, is_red, value, (i, j) in zip(
        alpha.tolist(),
        types.tolist(),
        red.tolist(),
        R.tolist(),
        cell.tolist(),
        strict=True,
    ):
        color = "red" if is_red else "blue"
        if i >= 0:
            name = f"{i:03} {j:03} {color}"
        else:
            number = places.setdefault((angles[0], angles[1]), len(places))
            at_waypoint = f"{_WAYPOINT}{number:03} {color}"
            name = f"{at_waypoint} {copies[at_waypoint]}"
            copies[at_waypoint] += 1
        ids.append(name)
        node = {f"alpha{k}": angle for k, angle in enumerate(angles, start=1)}
        if coefficients.rotors.asymmetry is None:
            node["types"] = text_from_types(*pair)
        graph.add_node(name, **node, color=color, R=value)
    columns = [column.tolist() for column in quantities.values()]
    for (a, b), *values in zip(edge.tolist(), *columns, strict=True):
        graph.add_edge(ids[a], ids[b], **dict(zip(quantities, values, strict=True)))
    return graph


def _nodes(
    divisions: int,
    waypoints: Any,
    wanted: float,
    coefficients: Coefficients,
    reach: float,
) -> tuple[Any, ...]:
    """Return the nodes as arrays: alpha (n, 4), on red (n,), types (n, 2), R (n,) and cell (n, 2), −1 off the grid.

    Those on the grid come first, red before blue. Waypoints within 1e-9 rad of each other, or of a grid node, count as
    one.
    """
    axis = grid_axis(divisions)[1:-1]
    given = np.array(checked_waypoints(waypoints, math.inf, least=0)).reshape(-1, 2)
    given = given[np.abs(given[:, :, None] - axis).min(axis=2).max(axis=1) > SAME_ANGLE]
    if len(given):
        same = np.abs(given[:, None] - given).max(axis=2) <= SAME_ANGLE
        given = given[same.argmax(axis=1) == np.arange(len(given))]
    cell = np.array([*product(range(1, divisions), repeat=2), *[(-1, -1)] * len(given)])
    plane = np.concatenate([axis[cell[: len(axis) ** 2] - 1], given])
    found = root_arrays(
        plane[:, 0], plane[:, 1], coefficients=coefficients, crossing_tolerance=reach
    )
    usable = wanted * np.nan_to_num(found.R) > noise_of(coefficients)
    if coefficients.kind == "exact":
        usable &= (
            found.sheet > 0
        )  # on blue R = 0 there: floating-point noise is not a sign
    point, root = np.nonzero(usable)
    off_grid, red = cell[point, 0] < 0, found.sheet[point, root] > 0
    order = np.lexsort((~red & ~off_grid, off_grid))
    point, root = point[order], root[order]
    return (
        found.alpha[point, root],
        red[order],
        found.types[point, root],
        found.R[point, root],
        cell[point],
    )


def _edges(
    alpha: FloatArray,
    red: BoolArray,
    types: npt.NDArray[np.int8],
    cell: IntArray,
    divisions: int,
) -> IntArray:
    """Return the edges as pairs of node numbers, shape (e, 2): the smaller first, sorted."""
    on_grid = cell[:, 0] >= 0
    index = np.full((2, divisions + 1, divisions + 1), -1)
    grid = np.nonzero(on_grid)[0]
    index[red[grid].astype(int), cell[grid, 0], cell[grid, 1]] = grid
    pairs = []
    inner = slice(1, divisions)
    for di, dj in ((0, 0), (0, 1), (1, 0), (1, 1), (1, -1)):
        shifted = np.roll(index, (-di, -dj), axis=(1, 2))[:, inner, inner]
        for first, second in product(range(2), repeat=2):
            if di or dj or first < second:
                a, b = index[first, inner, inner], shifted[second]
                both = (a >= 0) & (b >= 0)
                pairs.append(np.column_stack([a[both], b[both]]))
    # A waypoint is joined to every node within one step, the waypoints before it among them.
    step = math.pi / divisions
    for w in np.nonzero(~on_grid)[0]:
        near = np.nonzero(
            np.abs(alpha[:w, :2] - alpha[w, :2]).max(axis=1) <= step + ROUND_OFF
        )[0]
        pairs.append(np.column_stack([near, np.full(len(near), w)]))
    edge = np.sort(np.concatenate(pairs), axis=1)
    a, b = edge.T
    edge = edge[
        neighbors_allowed((types[a, 0], types[a, 1]), (types[b, 0], types[b, 1]))
    ]
    return np.asarray(edge[np.lexsort((edge[:, 1], edge[:, 0]))])


def _edge_quantities(
    alpha: FloatArray,
    red: BoolArray,
    edge: IntArray,
    wanted: float,
    vehicle: Vehicle,
    coefficients: Coefficients,
    floor: float,
) -> dict[str, npt.NDArray[Any]]:
    """Return the edge attributes of the contract as arrays of shape (e,), by name; `wanted` is the sign of R, ±1."""
    a, b = edge.T
    starts, ends = alpha[a], alpha[b]
    codes = np.where(red, np.int8(1), np.int8(-1))
    if coefficients.rotors.asymmetry is None:
        jump = sheet_jumps(starts, ends, codes[a], codes[b], coefficients)
    else:
        step = (ends - starts)[:, 2:]
        jump = np.round(np.abs(step - wrapped(step)), 12).max(axis=1, initial=0.0)
    keeps_sign, flyable = np.zeros((2, len(edge)), dtype=bool)
    singular = np.zeros(len(edge))
    if len(edge):
        noise = noise_of(coefficients)
        least = segment_bounds.least_level_determinant(
            starts,
            ends,
            coefficients,
            sign=wanted,
            tolerance=0.0,
            floor=noise,
            each=True,
        )
        keeps_sign = least.lower >= noise
    smooth = red[a] & red[b] & (jump == 0) & keeps_sign
    if smooth.any():
        p, q = starts[smooth], ends[smooth]
        least = segment_bounds.least_singular_value_along(
            p, q, vehicle, tolerance=_SINGULAR_VALUE_TOLERANCE, each=True
        )
        # Edges that have their least value in common differ by rounding.
        singular[smooth] = np.round(least.upper, 12)
        flyable[smooth] = segments_fly(p, q, floor, vehicle)
    return {
        "length": np.linalg.norm((ends - starts)[:, :2], axis=1),
        "jump": jump,
        "continuous": jump == 0,
        "keeps_sign": keeps_sign,
        "least_singular_value": singular,
        "flyable": flyable,
    }


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


def nodes_above(
    graph: nx.Graph[Any], waypoints: Iterable[Sequence[float]]
) -> list[list[Any]]:
    """Return the nodes above each waypoint (α1, α2), to within 1e-9 rad."""
    nodes = list(graph.nodes)
    plane = np.array(
        [[data["alpha1"], data["alpha2"]] for data in graph.nodes.values()]
    ).reshape(-1, 2)
    near = (
        np.flatnonzero(np.abs(plane - point).max(axis=1) <= SAME_ANGLE)
        for point in waypoints
    )
    return [[nodes[k] for k in above] for above in near]


def gait_along(graph: nx.Graph[Any], nodes: Sequence[Any]) -> Gait:
    """Return the closed gait through nodes of a surface graph, in order, the first not repeated."""
    vehicle, coefficients = vehicle_and_coefficients(graph)
    data = [graph.nodes[name] for name in nodes]
    return Gait(
        alpha=np.array([[node[f"alpha{k}"] for k in range(1, 5)] for node in data]),
        colors=tuple(node["color"] for node in data),
        vehicle=vehicle,
        coefficients=coefficients,
        crossing_tolerance=math.pi / (2 * metadata_of(graph)["divisions"]),
    )


def metadata_of(graph: nx.Graph[Any]) -> dict[str, Any]:
    """Return the metadata in the name of a surface graph, as plain values; ContractError if any are missing.

    >>> metadata_of(surface_graph("negative", divisions=8))["divisions"]
    8
    """
    if not isinstance(getattr(graph, "graph", None), dict):
        raise InputError(
            f"graph must be a networkx graph, as surface_graph returns, got {shown(graph)}"
        )
    text = graph.graph.get("name")
    try:
        metadata = json.loads(text)  # type: ignore[arg-type]
    except (RecursionError, TypeError, ValueError):
        metadata = None
    if not isinstance(metadata, dict):
        raise ContractError(
            f"graph metadata: name must be the JSON that surface_graph writes, got {shown(text)}"
        )
    for key in ("contract", "sign", "divisions", "coefficients", "floor", "vehicle"):
        if key not in metadata:
            raise ContractError(f"graph metadata: {key!r} is missing")
    return metadata


def vehicle_and_coefficients(graph: nx.Graph[Any]) -> tuple[Vehicle, Coefficients]:
    """Return the vehicle and coefficients in the metadata of a surface graph; ContractError if any are missing."""
    metadata = metadata_of(graph)
    vehicle = vehicle_from_mapping(metadata["vehicle"])
    return vehicle, coefficients_of(vehicle, metadata["coefficients"])


def validate_graph(graph: nx.Graph[Any]) -> None:
    """Raise ContractError, naming the first difference, unless a graph keeps the contract.

    The graph is made again from its metadata and waypoints: each node and edge must be in the new one, with the same
    attributes. The graph need not be complete: nodes and edges may be removed.

    >>> graph = surface_graph(divisions=8)
    >>> graph.nodes["006 002 red"]["R"] = 1.0
    >>> validate_graph(graph)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    gaitgraph.errors.ContractError: node '006 002 red': R must be -6.732..., got 1.0
    """
    import networkx as nx

    if type(graph) is not nx.Graph:
        raise ContractError(
            f"graph must be a networkx.Graph, got {type(graph).__name__}"
        )
    metadata = metadata_of(graph)
    off_grid = {
        name: data
        for name, data in graph.nodes(data=True)
        if str(name).startswith(_WAYPOINT)
    }
    try:
        vehicle, coefficients = vehicle_and_coefficients(graph)
        expected = surface_graph(
            metadata["sign"],
            divisions=metadata["divisions"],
            vehicle=vehicle,
            coefficients=coefficients,
            waypoints=[
                [number_of(data.get(key)) for key in ("alpha1", "alpha2")]
                for data in off_grid.values()
            ],
            floor=metadata["floor"],
        )
    except (InputError, TypeError) as error:
        raise ContractError(f"graph metadata or waypoints: {error}") from error
    _compare("graph metadata", metadata, metadata_of(expected))
    # The number of a waypoint depends on those that are left: its nodes are found by their place.
    at_waypoint = {
        _place(data): name
        for name, data in expected.nodes(data=True)
        if name.startswith(_WAYPOINT)
    }
    twins: dict[Any, Any] = {}
    for name, data in graph.nodes(data=True):
        twins[name] = at_waypoint.get(_place(data)) if name in off_grid else name
        if twins[name] not in expected:
            raise ContractError(
                f"node {name!r} must be a root at a grid node or waypoint, with the graph's sign of R"
            )
        _compare(f"node {name!r}", data, expected.nodes[twins[name]])
    for first, second, data in graph.edges(data=True):
        where = f"edge {first!r} – {second!r}"
        if not expected.has_edge(twins[first], twins[second]):
            raise ContractError(f"{where} must join neighbours that Figure 15 allows")
        _compare(where, data, expected.edges[twins[first], twins[second]])


def _place(data: dict[str, Any]) -> tuple[Any, ...]:
    return data.get("color"), *(
        round(number_of(data.get(f"alpha{k}")), 9) for k in range(1, 5)
    )


def _compare(where: str, stated: dict[str, Any], computed: dict[str, Any]) -> None:
    """Raise ContractError for the first attribute that is missing or differs from what is computed."""
    for key, value in computed.items():
        if key not in stated:
            raise ContractError(f"{where}: {key!r} is missing")
        # GML has no truth values: networkx writes True as 1.
        agrees = stated[key] == value
        if isinstance(value, float):
            tolerance = _TOLERANCES.get(key, 1e-9) * max(1.0, abs(value))
            agrees = abs(number_of(stated[key]) - value) <= tolerance
        if not agrees:
            raise ContractError(
                f"{where}: {key} must be {shown(value)}, got {shown(stated[key])}"
            )
