"""All simple closed cycles of a surface graph, one after the other in order of length.

A cycle passes three or more nodes, none of them twice. Cycles come in a total order: by length, compared as whole
multiples of 1e-12 rad, then by their nodes in canonical form. That form starts at the node that comes first in the
graph and goes on to the earlier of its two neighbours on the cycle; a cycle and its reverse are the same cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import networkx as nx
import numpy as np

from gaitgraph.angles import number_of, text_from_angle
from gaitgraph.errors import ContractError, InputError, shown
from gaitgraph.gait.gait import Gait
from gaitgraph.graph.build import vehicle_and_coefficients
from gaitgraph.graph.enumeration import Enumeration
from gaitgraph.graph.walks import MOST_ANY_ORDER, QUANTA_PER_RADIAN, Use, allowed_edges, quanta_of
from gaitgraph.surface.sheets import HOVER_LABEL, red_label

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.graph.enumeration import Item
    from gaitgraph.graph.lengths_ahead import Rows
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Vehicle

__all__ = ["Cycle", "Cycles", "Ground", "checked_effort", "cycles"]

_ROUNDING = 1000  # quanta: what rounding its edges may add to a cycle
_RADIANS_APART = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class _Surface:
    """What a graph said of itself and its nodes when the search began; shared by the cycles that it finds."""

    nodes: dict[Hashable, dict[str, Any]]
    home: frozenset[Hashable]
    sign: Literal["positive", "negative"]
    vehicle: Vehicle
    coefficients: Coefficients
    crossing_tolerance: float
    floor: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One simple closed cycle with the verdict of its edges.

    Parameters
    ----------
    nodes
        Node ids in canonical order, the first not repeated.
    sign
        Sign of R: "positive" or "negative".
    length
        Length in the (α1, α2) plane [rad], the sum of the edges, each to the next 1e-12.
    valid
        Whether every edge is continuous and keeps the sign of R.
    flyable
        Whether every edge is flyable, with the graph's floor.
    least_singular_value
        The least value of the edges, dimensionless; 0 with blue nodes or jumps.
    color
        "red", "blue" or "mixed".
    surface
        What the graph said of its nodes.

    Notes
    -----
    The verdict costs nothing, and :attr:`report` checks the gait anew. Every cycle is two-color between its
    nodes; no clock is judged, neither tilt rates nor accelerations.
    """

    nodes: tuple[Any, ...]
    sign: Literal["positive", "negative"]
    length: float
    valid: bool
    flyable: bool
    least_singular_value: float
    color: Literal["red", "blue", "mixed"]
    surface: _Surface = field(repr=False, compare=False)

    @property
    def path(self) -> Gait:
        """The gait through all nodes."""
        surface = self.surface
        data = [surface.nodes[name] for name in self.nodes]
        return Gait(
            alpha=np.array([[node["alpha1"], node["alpha2"], node["alpha3"], node["alpha4"]] for node in data]),
            colors=tuple(node["color"] for node in data),
            vehicle=surface.vehicle,
            coefficients=surface.coefficients,
            crossing_tolerance=surface.crossing_tolerance,
        )

    @property
    def report(self) -> Report:
        """All checks of the gait with straight runs merged, with the graph's floor; milliseconds."""
        return self.path.merged().check(floor=self.surface.floor)

    @property
    def reachable_from_hover(self) -> bool:
        """Whether the cycle is valid, red, with R > 0, in the component of α = 0 on the red sheet."""
        return self.valid and self.sign == "positive" and self.surface.home.issuperset(self.nodes)

    def __str__(self) -> str:
        verdict = "flyable" if self.flyable else "valid" if self.valid else "not valid"
        corners = self.path.merged().alpha[:, :2].tolist()
        way = " ".join(f"({text_from_angle(a)}, {text_from_angle(b)})" for a, b in corners)
        relation = "R > 0" if self.sign == "positive" else "R < 0"
        return f"{self.length:.4f} rad  {relation}  {self.color:<5}  {verdict:<9}  {way}"

    def as_mapping(self) -> dict[str, Any]:
        """Return the cycle as plain values, ready for JSON."""
        data = [self.surface.nodes[name] for name in self.nodes]
        return {
            "color": self.color,
            "sign": self.sign,
            "path": [[node["alpha1"], node["alpha2"], node["alpha3"], node["alpha4"]] for node in data],
            "types": [node["types"] for node in data],
            "colors": [node["color"] for node in data],
            "length": self.length,
            "valid": self.valid,
            "two_color": True,
            "flyable": self.flyable,
            "reachable_from_hover": self.reachable_from_hover,
            "least_singular_value": self.least_singular_value,
        }


class Ground:
    """The usable part of a graph in whole numbers: a node is its position in the graph, a length is in quanta."""

    def __init__(self, graph: nx.Graph[Any], use: object) -> None:
        if not isinstance(graph, nx.Graph):
            raise InputError(f"graph: {shown(graph)}; allowed is a networkx.Graph of gaitgraph.surface_graph")
        allowed = allowed_edges(use)
        vehicle, coefficients = vehicle_and_coefficients(graph)
        for key in ("sign", "crossing_tolerance", "floor"):
            if key not in graph.graph:
                raise ContractError(f"graph metadata: {key!r} is missing")
        self.use = use
        self.names = list(graph.nodes)
        self.index = {name: k for k, name in enumerate(self.names)}
        self.rows: Rows = [[] for _ in self.names]
        self.facts: list[dict[int, tuple[int, float]]] = [{} for _ in self.names]
        for first, second, edge in graph.edges(data=True):
            a, b = self.index[first], self.index[second]
            if a != b and allowed(edge):
                grade = 2 if edge["flyable"] else int(edge["continuous"] and edge["keeps_sign"])
                for k, other in ((a, b), (b, a)):
                    self.rows[k].append((other, quanta_of(edge["length"])))
                    self.facts[k][other] = grade, edge["least_singular_value"]
        for row in self.rows:
            row.sort()
        nodes = {name: dict(data) for name, data in graph.nodes(data=True)}
        self.red = [data["color"] == "red" for data in nodes.values()]
        self.surface = _Surface(
            nodes=nodes,
            home=_home(nodes, vehicle),
            sign=graph.graph["sign"],
            vehicle=vehicle,
            coefficients=coefficients,
            crossing_tolerance=graph.graph["crossing_tolerance"],
            floor=graph.graph["floor"],
        )

    def stops(self, value: object, name: str, any_order: object) -> list[list[int]]:
        """Return stops as lists of numbers; InputError if they are no nodes of the graph, or too many."""
        if not isinstance(any_order, bool):
            raise InputError(f"any_order: {shown(any_order)}; allowed are True and False")
        if not isinstance(value, (list, tuple)):
            raise InputError(f"{name}: {shown(value)}; allowed is a list of stops, each a list of nodes")
        out = []
        for number, stop in enumerate(value, start=1):
            if not isinstance(stop, (list, tuple, set, frozenset)) or not stop:
                raise InputError(f"{name}: stop {number} is {shown(stop)}; allowed is a list of one or more nodes")
            for node in stop:
                if not isinstance(node, Hashable) or node not in self.index:
                    raise InputError(f"{name}: stop {number} has {shown(node)}; allowed are nodes of the graph")
            out.append(sorted({self.index[node] for node in stop}))
        if any_order and len(out) > MOST_ANY_ORDER:
            raise InputError(f"any_order: {len(out)} stops; allowed are {MOST_ANY_ORDER} at most")
        return out

    def blocks(self) -> list[set[int]]:
        """Return the two-connected parts with three or more nodes: each cycle lies in one of them."""
        whole: nx.Graph[int] = nx.Graph()
        whole.add_edges_from((k, other) for k, row in enumerate(self.rows) for other, _ in row if k < other)
        found: list[set[int]] = list(nx.biconnected_components(whole))  # type: ignore[arg-type]
        return [block for block in found if len(block) > 2]

    def rows_past(self, stops: Sequence[Sequence[int]]) -> Rows:
        """Return the edges of those two-connected parts that hold every stop."""
        rows: Rows = [[] for _ in self.rows]
        for block in self.blocks():
            if all(not block.isdisjoint(stop) for stop in stops):
                for k in block:
                    rows[k] += [entry for entry in self.rows[k] if entry[0] in block]
        for row in rows:
            row.sort()
        return rows

    def cycle(self, item: Item) -> Cycle:
        """Return the cycle of an item of the enumeration."""
        length, path = item
        facts, names, grade, least = self.facts, self.names, 2, math.inf
        before = path[-1]
        for node in path:
            fact = facts[before][node]
            grade, least = min(grade, fact[0]), min(least, fact[1])
            before = node
        reds = sum([self.red[node] for node in path])
        return Cycle(
            nodes=tuple([names[node] for node in path]),
            sign=self.surface.sign,
            length=length / QUANTA_PER_RADIAN,
            valid=grade > 0,
            flyable=grade == 2,
            least_singular_value=least,
            color="mixed" if 0 < reds < len(path) else "red" if reds else "blue",
            surface=self.surface,
        )


def _home(nodes: dict[Hashable, dict[str, Any]], vehicle: Vehicle) -> frozenset[Hashable]:
    """Return the nodes in the component of α = 0 on the red sheet, which ordinary hover can reach."""
    alpha = np.array([[data[f"alpha{k}"] for k in range(1, 5)] for data in nodes.values()]).reshape(-1, 4)
    there = (red_label(alpha[:, 0], alpha[:, 1], vehicle) == HOVER_LABEL).all(axis=1)
    there &= (np.abs(alpha[:, 2:] - alpha[:, :2]) <= _RADIANS_APART).all(axis=1)
    return frozenset(
        name for name, at in zip(nodes, there.tolist(), strict=True) if at and nodes[name]["color"] == "red"
    )


class Cycles(Iterator[Cycle]):
    """The simple closed cycles of a graph, found while they are asked for; see :func:`cycles`.

    `bound`, `complete` and `steps` are true at any time, after an interruption too.
    """

    def __init__(self, ground: Ground, search: Enumeration) -> None:
        self._search = search
        self._stream = map(ground.cycle, search)

    def __iter__(self) -> Cycles:
        return self

    def __next__(self) -> Cycle:
        return next(self._stream)

    @property
    def bound(self) -> float:
        """Every cycle shorter than this has been yielded [rad]; infinite when there are no more cycles at all."""
        return self._search.bound

    @property
    def complete(self) -> bool:
        """Whether every cycle within `max_length` has been yielded."""
        return self._search.complete

    @property
    def steps(self) -> int:
        """How many nodes have been expanded."""
        return self._search.steps


def cycles(
    graph: nx.Graph[Any],
    *,
    max_length: float | None = None,
    use: Use = "valid",
    through: Sequence[Sequence[Any]] = (),
    any_order: bool = False,
    effort: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Cycles:
    """Return a lazy iterator over the simple closed cycles of a surface graph, in order of length, each once.

    Parameters
    ----------
    graph
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`; it is read at once, and what is done to
        it later changes nothing.
    max_length
        No longer cycles [rad]; 1e-9 rad are allowed for rounding. None: no limit.
    use
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    through
        Stops, each a sequence of alternative nodes: only cycles that pass the stops in this cyclic order, one way
        round or the other. One node may serve several stops that follow each other.
    any_order
        Pass the stops, at most nine, in any order.
    effort
        Largest number of search steps (nodes expanded); when they are spent the iterator stops and `complete` is
        False. None: no limit.
    progress
        Called with a line of text for each range of lengths that is done, and every 200 000 steps.

    Returns
    -------
    Cycles
        The iterator, with `bound`, `complete` and `steps`.

    Raises
    ------
    InputError
        If an argument is malformed.
    ContractError
        If the graph's metadata are missing.

    Notes
    -----
    The number of cycles grows exponentially with their length, and so does the time; memory does not. Not
    guaranteed is that the next cycle comes soon: stops in an awkward order may have none, and to prove that is hard.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> found = cycles(surface_graph("negative"), max_length=0.7)
    >>> first = next(found)
    >>> first.nodes, round(first.length, 4), first.color
    (((2, 1, 'red'), (3, 1, 'red'), (3, 2, 'red')), 0.6704, 'red')
    >>> 1 + sum(1 for _ in found), found.complete
    (965, True)
    """
    most = None
    if max_length is not None:
        if not 0 <= number_of(max_length) < math.inf:
            raise InputError(f"max_length: {shown(max_length)}; allowed is a finite number ≥ 0 (rad), or None")
        most = quanta_of(float(max_length)) + _ROUNDING
    if progress is not None and not callable(progress):
        raise InputError(f"progress: {shown(progress)}; allowed is a function of one text, or None")
    steps = checked_effort(effort)
    ground = Ground(graph, use)
    stops = ground.stops(through, "through", any_order)
    rows = ground.rows_past(stops) if stops else ground.rows
    search = Enumeration(rows, stops=stops, any_order=any_order, most=most, effort=steps, progress=progress)
    return Cycles(ground, search)


def checked_effort(effort: object) -> int | None:
    """Return a largest number of steps, or raise InputError."""
    if effort is None:
        return None
    whole = isinstance(effort, (int, np.integer)) and not isinstance(effort, bool)
    if not whole or not effort >= 1:  # type: ignore[operator]
        raise InputError(f"effort: {shown(effort)}; allowed is a whole number ≥ 1, or None")
    return int(effort)  # type: ignore[call-overload, no-any-return]
