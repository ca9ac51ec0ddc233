"""Does a graph keep the written contract of :mod:`gaitgraph.graph`? Everything stated is computed again."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from gaitgraph.coloring import types_may_be_adjacent
from gaitgraph.errors import ContractError, InputError
from gaitgraph.graph import CONTRACT, checked_divisions, edge_quantities, grid_axis, vehicle_and_coefficients
from gaitgraph.invertibility import Coefficients, level_determinant, pitch_sensitivity, roll_sensitivity
from gaitgraph.surface import COLORS, text_from_types, types_of

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle

__all__ = ["validate_graph"]

_METADATA = ("contract", "divisions", "step", "sign", "coefficients", "vehicle", "crossing_tolerance", "floor")
_NODE = ("alpha1", "alpha2", "alpha3", "alpha4", "types", "color", "R", "cell")
_EDGE = ("length", "jump", "continuous", "keeps_sign", "least_singular_value", "flyable")


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
    >>> from gaitgraph.graph import surface_graph
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
        axis = grid_axis(meta["divisions"]).tolist()
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
    expected = edge_quantities(
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
    if not _close(data["least_singular_value"], float(expected["least_singular_value"][0]), 2e-5):
        value = float(expected["least_singular_value"][0])
        raise refuse(f"least_singular_value is {data['least_singular_value']!r}, computed is {value!r}")
