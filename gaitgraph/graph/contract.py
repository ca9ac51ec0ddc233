"""Does a graph keep the written contract of :mod:`gaitgraph.graph.build`? Everything stated is computed again."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from gaitgraph.angles import number_of
from gaitgraph.errors import ContractError, InputError, shown
from gaitgraph.graph.build import CONTRACT, checked_divisions, edge_quantities, grid_axis, vehicle_and_coefficients
from gaitgraph.invertibility.matrices import Coefficients, level_determinant, pitch_sensitivity, roll_sensitivity
from gaitgraph.surface.adjacency import neighbors_allowed, text_from_types, types_from_text
from gaitgraph.surface.sheets import COLORS, types_of

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

_METADATA = ("contract", "divisions", "step", "sign", "coefficients", "vehicle", "crossing_tolerance", "floor")
_NODE = ("alpha1", "alpha2", "alpha3", "alpha4", "types", "color", "R", "cell")
_EDGE_TOLERANCES = {"length": 1e-9, "jump": 1e-9, "least_singular_value": 2e-5}


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
    >>> from gaitgraph.graph.build import surface_graph
    >>> graph = surface_graph(divisions=8)
    >>> graph.nodes[6, 2, "red"]["R"] = 1.0
    >>> validate_graph(graph)
    Traceback (most recent call last):
    ...
    gaitgraph.errors.ContractError: node (6, 2, 'red'): R is 1.0, computed is -6.7323
    """
    if type(graph) is not nx.Graph:
        raise ContractError(f"graph must be a networkx.Graph, got {type(graph).__name__}")
    for key in _METADATA:
        if key not in graph.graph:
            raise ContractError(f"graph metadata: {key!r} is missing")
    meta = graph.graph
    if meta["contract"] != CONTRACT:
        raise ContractError(f"graph metadata: contract must be {CONTRACT!r}, got {meta['contract']!r}")
    try:
        divisions = checked_divisions(meta["divisions"])
        vehicle, coefficients = vehicle_and_coefficients(graph)
    except (InputError, TypeError) as error:
        raise ContractError(f"graph metadata: {error}") from error
    if meta["sign"] not in ("positive", "negative"):
        raise ContractError(f"graph metadata: sign must be 'positive' or 'negative', got {meta['sign']!r}")
    for key, expected in (("step", math.pi / divisions), ("crossing_tolerance", math.pi / (2 * divisions))):
        if not _close(meta[key], expected):
            raise ContractError(f"graph metadata: {key} is {meta[key]!r}, computed is {expected!r}")
    if math.isnan(number_of(meta["floor"])):
        raise ContractError(f"graph metadata: floor must be a number, got {shown(meta['floor'])}")
    for name, data in graph.nodes(data=True):
        problem = _problem_of_node(name, data, meta, coefficients)
        if problem is not None:
            raise ContractError(f"node {name!r}: {problem}")
    if graph.number_of_edges():
        _validate_edges(graph, vehicle, coefficients)


def _close(stated: object, computed: float, tolerance: float = 1e-9) -> bool:
    number = isinstance(stated, (int, float)) and not isinstance(stated, bool)
    return number and abs(stated - computed) <= tolerance * max(1.0, abs(computed))  # type: ignore[operator]


def _problem_of_node(name: Any, data: dict[str, Any], meta: dict[str, Any], coefficients: Coefficients) -> str | None:
    """Return how a node breaks the contract, or None."""
    for key in _NODE:
        if key not in data:
            return f"attribute {key!r} is missing"
    if data["color"] not in COLORS:
        return f"color must be 'red' or 'blue', got {data['color']!r}"
    if not isinstance(name, tuple) or len(name) != 3:
        return "its id is neither (i, j, color) nor ('w', k, m)"
    alpha = [data[f"alpha{k}"] for k in range(1, 5)]
    if not all(isinstance(angle, float) and abs(angle) <= math.pi / 2 for angle in alpha):
        return f"tilt angles must be floats in [−π/2, π/2], got {alpha!r}"
    if name[0] != "w":
        axis = grid_axis(meta["divisions"]).tolist()
        inside = all(isinstance(k, int) and 0 < k < meta["divisions"] for k in name[:2])
        if not inside or data["cell"] != name[:2] or data["color"] != name[2]:
            return f"its id disagrees with cell {data['cell']!r} and color {data['color']!r}"
        if not (_close(alpha[0], axis[name[0]]) and _close(alpha[1], axis[name[1]])):
            return f"(alpha1, alpha2) is {tuple(alpha[:2])!r}, not its grid node"
    elif data["cell"] is not None:
        return f"cell must be None off the grid, got {data['cell']!r}"
    scale = abs(coefficients.single) + 4
    for label, function in (("Rφ", roll_sensitivity), ("Rθ", pitch_sensitivity)):
        if abs(float(function(alpha, coefficients))) > 1e-9 * scale:
            return f"{label} is {float(function(alpha, coefficients))!r}, not zero: it is no root"
    computed = float(level_determinant(alpha, coefficients))
    if not _close(data["R"], computed, 1e-9 * scale):
        return f"R is {data['R']!r}, computed is {computed!r}"
    if (computed > 0) != (meta["sign"] == "positive"):
        return f"R is {computed!r}, the graph's sign is {meta['sign']}"
    pair = types_of(data["color"], alpha[0], alpha[1], coefficients, meta["crossing_tolerance"])
    expected = text_from_types(int(pair[0]), int(pair[1]))
    if data["types"] != expected:
        return f"types are {data['types']!r}, computed are {expected!r}"
    return None


def _validate_edges(graph: nx.Graph[Any], vehicle: Vehicle, coefficients: Coefficients) -> None:
    edges = list(graph.edges(data=True))

    def refuse(k: int, what: str) -> ContractError:
        return ContractError(f"edge {edges[k][0]!r} – {edges[k][1]!r}: {what}")

    index = {name: k for k, name in enumerate(graph.nodes)}
    nodes = list(graph.nodes.values())
    alpha = np.array([[data[f"alpha{k}"] for k in range(1, 5)] for data in nodes])
    red = np.array([data["color"] == "red" for data in nodes])
    pairs = np.array([(index[first], index[second]) for first, second, _ in edges])
    a, b = pairs.T
    wanted = 1.0 if graph.graph["sign"] == "positive" else -1.0
    computed = edge_quantities(alpha, red, pairs, wanted, vehicle, coefficients, graph.graph["floor"])
    for k, (_, _, data) in enumerate(edges):
        for key in computed:
            if key not in data:
                raise refuse(k, f"attribute {key!r} is missing")
    apart = (np.abs(alpha[a] - alpha[b])[:, :2].max(axis=1) > graph.graph["step"] + 1e-9) | (a == b)
    if apart.any():
        raise refuse(int(np.argmax(apart)), "its nodes are not neighbours")
    codes = np.array([types_from_text(data["types"]) for data in nodes])
    forbidden = ~neighbors_allowed(tuple(codes[a].T), tuple(codes[b].T))
    if forbidden.any():
        k = int(np.argmax(forbidden))
        raise refuse(k, f"Figure 15 forbids {nodes[a[k]]['types']} beside {nodes[b[k]]['types']}")
    for key, values in computed.items():
        for k, (value, (_, _, data)) in enumerate(zip(values.tolist(), edges, strict=True)):
            tolerance = _EDGE_TOLERANCES.get(key)
            agrees = data[key] is value if tolerance is None else _close(data[key], value, tolerance)
            if not agrees:
                raise refuse(k, f"{key} is {data[key]!r}, computed is {value!r}")
