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
    ``vehicle``  the vehicle's constants as a plain mapping; ``waypoints``  the points that were given [rad];
    ``servo_margins``  true if edges have their servo margins, else left out.
Node ids
    "003 012 red" for the root of that color at the interior grid node α1 = −π/2 + 3π/n, α2 = −π/2 + 12π/n: both
    numbers in three digits, from 1 to n − 1;
    "w002 red 0" for the first red root, counted from 0, at the third of the waypoints that are off the grid.
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
    ``R`` of the point of the whole edge where it is nearest to 0, to within 1e-4; 0 if R does not keep its sign;
    ``least_singular_value`` along the whole edge, exact physics, to within 1e-5 on red; 0 on blue, where it is below
    that, and on jumps;
    ``flyable``, whether the edge is continuous, keeps the sign of R and meets the physics along its whole length.
    ``servo_margin``, if asked for: the smallest error of the tilt angles that was found to break a condition of flight
    at the ends and in the middle of the edge [rad], to within 1e-6; 0 unless the edge is flyable. What a whole gait is
    proven to bear :func:`gaitgraph.robustness.servo_margin` returns.
    An edge is straight in the four angles. On a curved sheet it is straight in (α1, α2) alone and follows the sheet, by
    chords within 1e-3 rad of it, along which all attributes hold; ``jump`` is π where α3 or α4 wraps, or the edge meets
    a fibre.
"""

from __future__ import annotations

import json
import math
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import checked_floor, number_of
from gaitgraph.errors import (
    ContractError,
    InputError,
    check_kind,
    checked_choice,
    shown,
    wrong,
)
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.table import ANGLES
from gaitgraph.graph.edges import allowed_pairs, edge_attributes
from gaitgraph.graph.nodes import (
    DEFAULT_DIVISIONS,
    checked_divisions,
    checked_waypoints,
    roots_as_nodes,
)
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.surface.region import Zones
from gaitgraph.tolerances import DEFAULT_FLOOR, SAME_ANGLE
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
    import numpy.typing as npt

    from gaitgraph.surface.sheets import Sign

_angles_of = itemgetter(*ANGLES)
CONTRACT = "gaitgraph surface graph 1"
_METADATA = [
    "contract",
    "sign",
    "divisions",
    "coefficients",
    "floor",
    "vehicle",
    "waypoints",
]
_TOLERANCES = {"least_singular_value": 2e-5, "R": 2e-4, "servo_margin": 1e-6}


def surface_graph(
    sign: Sign = "negative",
    *,
    divisions: int = DEFAULT_DIVISIONS,
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    waypoints: Sequence[Sequence[float | str]] | npt.ArrayLike = (),
    zones: Zones | None = None,
    floor: float = DEFAULT_FLOOR,
    servo_margins: bool = False,
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
    servo_margins
        Whether edges have a `servo_margin`, which takes milliseconds for each of them.

    Examples
    --------
    >>> graph = surface_graph("negative")
    >>> graph.number_of_nodes(), graph.nodes["014 002 red"]["types"]
    (294, '(+,+)')
    """
    import networkx as nx

    divisions = checked_divisions(divisions)
    checked_choice("sign", sign, ("positive", "negative"))
    check_kind("zones", zones, Zones, type(None))
    floor = checked_floor(floor)
    vehicle = vehicle_named(vehicle)
    coefficients = coefficients_of(vehicle, coefficients)
    wanted = 1.0 if sign == "positive" else -1.0
    points = checked_waypoints(waypoints, math.inf, least=0)
    nodes = roots_as_nodes(divisions, points, wanted, coefficients, zones)
    pairs = allowed_pairs(nodes, divisions)
    if zones is not None and len(pairs):
        first, second = pairs.T
        pairs = pairs[zones.allow_segments(nodes.plane[first], nodes.plane[second])]
    columns = edge_attributes(
        nodes,
        pairs,
        wanted,
        vehicle,
        coefficients,
        floor,
        servo_margins=servo_margins,
    )

    metadata = {
        "contract": CONTRACT,
        "sign": sign,
        "divisions": divisions,
        "coefficients": coefficients.kind,
        "floor": floor,
        "vehicle": vehicle.as_mapping(),
        "waypoints": points,
    }
    if servo_margins:
        metadata["servo_margins"] = True
    graph: nx.Graph[Any] = nx.Graph(name=json.dumps(metadata))
    ids = list(nodes.ids())
    with_types = coefficients.rotors.asymmetry is None
    graph.add_nodes_from(zip(ids, nodes.attributes(with_types=with_types), strict=True))
    for number, (a, b) in enumerate(pairs.tolist()):
        edge = {name: column[number].item() for name, column in columns.items()}
        graph.add_edge(ids[a], ids[b], **edge)
    return graph


def nodes_above(
    graph: nx.Graph[Any], waypoints: Iterable[Sequence[float]]
) -> list[list[Any]]:
    """Return the nodes above each waypoint (α1, α2), to within 1e-9 rad."""
    nodes = list(graph.nodes)
    places = list(map(itemgetter("alpha1", "alpha2"), graph.nodes.values()))
    plane = np.reshape(places, (-1, 2))
    above = []
    for point in waypoints:
        near = np.flatnonzero(np.abs(plane - point).max(axis=1) <= SAME_ANGLE)
        above.append([nodes[k] for k in near])
    return above


def gait_along(graph: nx.Graph[Any], nodes: Sequence[Any]) -> Gait:
    """Return the closed gait through nodes of a surface graph, in order, the first not repeated.

    On a curved sheet there are rows between the nodes.
    """
    vehicle, coefficients = vehicle_and_coefficients(graph)
    data = [graph.nodes[name] for name in nodes]
    alpha = np.array(list(map(_angles_of, data)))
    if vehicle.asymmetry is not None:
        return lift(alpha[:, :2], "red", vehicle=vehicle)
    return Gait(
        alpha=alpha,
        colors=tuple(map(itemgetter("color"), data)),
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
        raise wrong(
            "graph", "must be a networkx graph, as surface_graph returns", graph
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
    for key in _METADATA:
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

    The graph is made again from its metadata: each node and edge must be in the new one, with the same
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
            f"graph must be a networkx.Graph, got {type(graph).__name__}",
            field="graph",
            value=graph,
        )
    metadata = metadata_of(graph)
    try:
        vehicle, coefficients = vehicle_and_coefficients(graph)
        expected = surface_graph(
            metadata["sign"],
            divisions=metadata["divisions"],
            vehicle=vehicle,
            coefficients=coefficients,
            waypoints=metadata["waypoints"],
            floor=metadata["floor"],
            servo_margins=metadata.get("servo_margins") is True,
        )
    except (InputError, TypeError) as error:
        raise ContractError(f"graph metadata: {error}") from error
    _compare("graph metadata", metadata, metadata_of(expected))
    for name, data in graph.nodes(data=True):
        if name not in expected:
            raise ContractError(
                f"node {name!r} must be a root at a grid node or waypoint, with the graph's sign of R"
            )
        _compare(f"node {name!r}", data, expected.nodes[name])
    for first, second, data in graph.edges(data=True):
        where = f"edge {first!r} – {second!r}"
        if not expected.has_edge(first, second):
            raise ContractError(f"{where} must join neighbours that Figure 15 allows")
        _compare(where, data, expected.edges[first, second])


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
