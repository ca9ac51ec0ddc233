"""The simple closed cycles of surface graphs, one after the other in order of length.

A cycle passes three or more nodes, none of them twice. Cycles come in a total order: by length, or own cost, compared as
whole multiples of 1e-12, then by their nodes in canonical form. That form starts at the node that comes first in the
graph and continues with the earlier of its two neighbours on the cycle; a cycle and its reverse are the same cycle.

A cycle is an edge and a simple path from its end back to its start. With the edges in order and each path over later
edges only, each cycle belongs to its first edge, and is found once. networkx yields the paths of each edge in order of
length, by Yen's algorithm; the lists of all edges are merged.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from heapq import merge
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, Any, ClassVar, cast

from gaitgraph.angles import checked_number, text_from_angle
from gaitgraph.gait.gait import vertices
from gaitgraph.graph.build import gait_along, metadata_of, vehicle_and_coefficients
from gaitgraph.graph.walks import (
    MOST_LENGTH,
    QUANTA_PER_RADIAN,
    ClosedWalk,
    EdgeRequirement,
    Weight,
    allowed_edges,
    quanta_of,
    usable_graph,
)
from gaitgraph.surface.curved_region import reached_from_hover
from gaitgraph.surface.red_components import HOVER_LABEL, red_label
from gaitgraph.surface.sheets import RELATION, Sign

if TYPE_CHECKING:
    from collections.abc import Iterator

    import networkx as nx

    from gaitgraph.gait.gait import Gait

_ROUNDING = 1000  # quanta: what rounding its edges may add to a cycle


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle(ClosedWalk):
    """A simple closed cycle, its nodes in canonical order, with the verdict of its edges.

    Every cycle is two-color between its nodes; tilt rates and accelerations are not judged. The length is the sum of
    the edges, each rounded to 1e-12 rad; `surface` is the graph as it was when the search began.
    """

    not_stated: ClassVar[str] = "graph is not in it"

    surface: nx.Graph[Any] = field(repr=False, compare=False)

    def _constructed_from(self) -> dict[str, Any]:
        """Return all fields but the graph."""
        return {"nodes": self.nodes, "length": self.length, "cost": self.cost}

    @property
    def sign(self) -> Sign:
        """Sign of R: "positive" or "negative"."""
        return cast("Sign", metadata_of(self.surface)["sign"])

    @property
    def color(self) -> str:
        """The color of all nodes, "red" or "blue", or "mixed"; "red" on a curved sheet, the rows of which have none."""
        return self.path.color or "red"

    @property
    def _edges(self) -> list[dict[str, Any]]:
        closed = self.nodes + self.nodes[:1]
        return [self.surface.edges[pair] for pair in pairwise(closed)]

    @property
    def valid(self) -> bool:
        """Whether every edge is continuous and keeps the sign of R."""
        return all(edge["continuous"] and edge["keeps_sign"] for edge in self._edges)

    @property
    def flyable(self) -> bool:
        """Whether every edge is flyable, with the graph's floor."""
        return all(edge["flyable"] for edge in self._edges)

    @property
    def least_singular_value(self) -> float:
        """The least value along the edges, dimensionless; 0 with blue nodes or jumps."""
        return min(float(edge["least_singular_value"]) for edge in self._edges)

    @property
    def path(self) -> Gait:
        """The gait through all nodes."""
        return gait_along(self.surface, self.nodes)

    @property
    def reachable_from_hover(self) -> bool:
        """Whether the cycle is valid, red, with R > 0, in the component of α = 0 on the red sheet.

        On a curved sheet: whether a flyable path is found that joins it to hover.
        """
        if not self.valid or self.color != "red" or self.sign != "positive":
            return False
        vehicle, _ = vehicle_and_coefficients(self.surface)
        alpha = self.path.alpha
        if vehicle.asymmetry is not None:
            floor = metadata_of(self.surface)["floor"]
            return reached_from_hover(alpha[:, :2], vehicle, floor)[0] is True
        labels = red_label(alpha[:, 0], alpha[:, 1], vehicle)
        return bool((labels == HOVER_LABEL).all())

    def __str__(self) -> str:
        verdict = "not valid"
        if self.valid:
            verdict = "valid"
        if self.flyable:
            verdict = "flyable"
        path = self.path.merged().alpha
        if not self.path.colors:  # a curved sheet has rows between corners
            path = vertices(path[:, [0, 1, 0, 1]])
        text = f"{self.length:.4f} rad  {RELATION[self.sign]}  {self.color:<5}  {verdict:<9} "
        for first, second, _, _ in path.tolist():
            text += f" ({text_from_angle(first)}, {text_from_angle(second)})"
        return text

    def as_mapping(self) -> dict[str, Any]:
        """Return the cycle as plain values, ready for JSON."""
        path = self.path
        return {
            "color": self.color,
            "sign": self.sign,
            "path": path.alpha.tolist(),
            "types": list(path.types),
            "colors": list(path.colors),
            "length": self.length,
            "valid": self.valid,
            "two_color": True,
            "flyable": self.flyable,
            "reachable_from_hover": self.reachable_from_hover,
            "least_singular_value": self.least_singular_value,
        }


def cycles(
    graph: nx.Graph[Any],
    *,
    max_length: float | None = None,
    require: EdgeRequirement = "valid",
    weight: Weight | None = None,
) -> Iterator[Cycle]:
    """Return a lazy iterator over the simple closed cycles of a surface graph, in order of length, each once.

    Parameters
    ----------
    graph
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`, of which a copy is searched;
        ContractError if its metadata are missing.
    max_length
        Length of the longest cycles [rad], with 1e-9 rad for rounding; with a weight their largest cost. None: no limit.
    require
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    weight
        Own cost of an edge, by which cycles are ordered instead of their length; see
        :func:`gaitgraph.graph.walks.closed_walk`.

    Notes
    -----
    The first cycle takes one search for each edge, a tenth of a second on the paper's grid; each further one a search
    for each of its nodes. The paths found are kept. Cycles of one cost are brought into order before the first is
    returned, which does not end in practice where many edges cost nothing. The number of cycles grows exponentially
    with their length. The shortest closed walk through given nodes is found by
    :func:`gaitgraph.graph.walks.closed_walk`.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> found = cycles(surface_graph("negative"), max_length=0.7)
    >>> first = next(found)
    >>> first.nodes, round(first.length, 4), first.color
    (('002 001 red', '003 001 red', '003 002 red'), 0.6704, 'red')
    >>> 1 + sum(1 for _ in found)
    965
    """
    metadata_of(graph)  # a graph without it is refused here
    most = math.inf
    if max_length is not None:
        longest = checked_number(
            "max_length",
            max_length,
            "a number from 0 to 1e12 (rad) or None",
            most=MOST_LENGTH,
        )
        most = quanta_of(longest) + _ROUNDING
    surface = graph.copy()
    usable = usable_graph(surface, allowed_edges(require), weight)
    return _cycles_up_to(most, surface, usable)


def _cycles_up_to(
    most: float, surface: nx.Graph[Any], usable: nx.Graph[Any]
) -> Iterator[Cycle]:
    """Yield the cycles of a graph up to a cost [quanta]."""
    import networkx as nx

    number = {name: k for k, name in enumerate(surface)}
    edges: Any = usable.edges(data="rank")
    through = [
        _paths_back(usable, first, second, rank) for first, second, rank in edges
    ]
    for cost, _, paths in merge(*through):
        if cost > most:
            return
        for path in sorted(paths, key=lambda path: [number[name] for name in path]):
            # The path leads from the second node of the cycle to the first.
            length = nx.path_weight(usable, path[-1:] + path, "length")
            yield Cycle(
                nodes=tuple(path[-1:] + path[:-1]),
                length=length / QUANTA_PER_RADIAN,
                cost=cost / QUANTA_PER_RADIAN,
                surface=surface,
            )


def _paths_back(
    usable: nx.Graph[Any], first: Any, second: Any, rank: int
) -> Iterator[tuple[int, int, Iterator[list[Any]]]]:
    """Yield the cycles whose first edge is a given one: costs in rising order, the rank, and the paths that close it.

    An edge starts at its earlier node, and edges rank in the order of their nodes. So among equal costs the rank puts
    cycles in canonical order.
    """
    import networkx as nx

    def cost_of_later(_first: Any, _second: Any, edge: Any) -> int | None:
        if edge["rank"] <= rank:
            return None  # networkx leaves the edge out
        return int(edge["cost"])

    def cost_of_cycle(path: list[Any]) -> int:
        return int(nx.path_weight(usable, [first, *path], "cost"))

    paths = nx.shortest_simple_paths(usable, second, first, weight=cost_of_later)
    with suppress(nx.NetworkXNoPath):
        for cost, ties in groupby(paths, key=cost_of_cycle):
            yield cost, rank, ties
