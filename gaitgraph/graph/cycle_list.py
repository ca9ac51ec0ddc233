"""The simple closed cycles of surface graphs, one after the other in order of length, and the shortest through stops.

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
from gaitgraph.graph.build import gait_along, vehicle_and_coefficients
from gaitgraph.graph.cycle_search import CycleSearch, routed_cycle
from gaitgraph.graph.walks import MOST_ANY_ORDER, QUANTA_PER_RADIAN, Use, allowed_edges, best_order, quanta_of
from gaitgraph.surface.sheets import HOVER_LABEL, RELATION, Sign, red_label

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.gait.gait import Gait
    from gaitgraph.graph.cycle_search import Item, Rows
    from gaitgraph.validation.report import Report

_ROUNDING = 1000  # quanta: what rounding its edges may add to a cycle


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
        The nodes of the graph and its metadata, as they were when the search began.

    Notes
    -----
    The verdict costs nothing, and :attr:`report` checks the gait anew. Every cycle is two-color between its
    nodes; no clock is judged, neither tilt rates nor accelerations.
    """

    nodes: tuple[Any, ...]
    sign: Sign
    length: float
    valid: bool
    flyable: bool
    least_singular_value: float
    color: Literal["red", "blue", "mixed"]
    surface: nx.Graph[Any] = field(repr=False, compare=False)

    @property
    def path(self) -> Gait:
        """The gait through all nodes."""
        return gait_along(self.surface, self.nodes)

    @property
    def report(self) -> Report:
        """All checks of the gait with straight runs merged, with the graph's floor; milliseconds."""
        return self.path.merged().check(floor=self.surface.graph["floor"])

    @property
    def reachable_from_hover(self) -> bool:
        """Whether the cycle is valid, red, with R > 0, in the component of α = 0 on the red sheet."""
        alpha = self.path.alpha
        labels = red_label(alpha[:, 0], alpha[:, 1], vehicle_and_coefficients(self.surface)[0])
        return self.valid and self.color == "red" and self.sign == "positive" and bool((labels == HOVER_LABEL).all())

    def __str__(self) -> str:
        verdict = "flyable" if self.flyable else "valid" if self.valid else "not valid"
        corners = self.path.merged().alpha[:, :2].tolist()
        points = " ".join(f"({text_from_angle(a)}, {text_from_angle(b)})" for a, b in corners)
        return f"{self.length:.4f} rad  {RELATION[self.sign]}  {self.color:<5}  {verdict:<9}  {points}"

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


class _Numbered:
    """The usable part of a graph in whole numbers: a node is its position in the graph, a length is in quanta."""

    def __init__(self, graph: nx.Graph[Any], use: Use) -> None:
        if not isinstance(graph, nx.Graph):
            raise InputError(f"graph must be a networkx.Graph of gaitgraph.surface_graph, got {shown(graph)}")
        allowed = allowed_edges(use)
        vehicle_and_coefficients(graph)  # says what is missing
        for key in ("sign", "crossing_tolerance", "floor"):
            if key not in graph.graph:
                raise ContractError(f"graph metadata: {key!r} is missing")
        self.names = list(graph.nodes)
        self.index = {name: k for k, name in enumerate(self.names)}
        self.rows: Rows = [[] for _ in self.names]
        self._facts: list[dict[int, tuple[int, float]]] = [{} for _ in self.names]
        for first, second, edge in graph.edges(data=True):
            a, b = self.index[first], self.index[second]
            if a != b and allowed(edge):
                grade = 2 if edge["flyable"] else int(edge["continuous"] and edge["keeps_sign"])
                for k, other in ((a, b), (b, a)):
                    self.rows[k].append((other, quanta_of(edge["length"])))
                    self._facts[k][other] = grade, edge["least_singular_value"]
        for row in self.rows:
            row.sort()
        self.surface: nx.Graph[Any] = nx.Graph(**graph.graph)
        self.surface.add_nodes_from((name, dict(data)) for name, data in graph.nodes(data=True))
        self._red = [data["color"] == "red" for data in self.surface.nodes.values()]

    def stops(self, value: object, name: str, any_order: bool) -> list[list[int]]:
        """Return stops as lists of numbers; InputError if they are no nodes of the graph, or too many."""
        if not isinstance(value, (list, tuple)):
            raise InputError(f"{name} must be a list of stops, each a list of nodes, got {shown(value)}")
        out = []
        for number, stop in enumerate(value, start=1):
            if not isinstance(stop, (list, tuple, set, frozenset)) or not stop:
                raise InputError(f"{name}: stop {number} must be a list of one or more nodes, got {shown(stop)}")
            for node in stop:
                if not isinstance(node, Hashable) or node not in self.index:
                    raise InputError(f"{name}: stop {number} must have nodes of the graph, got {shown(node)}")
            out.append(sorted({self.index[node] for node in stop}))
        if any_order and len(out) > MOST_ANY_ORDER:
            raise InputError(f"any_order takes at most {MOST_ANY_ORDER} stops, got {len(out)}")
        return out

    def blocks(self) -> list[set[int]]:
        """Return the two-connected parts with three or more nodes: each cycle lies in one of them."""
        whole: nx.Graph[int] = nx.Graph()
        whole.add_edges_from((k, other) for k, row in enumerate(self.rows) for other, _ in row if k < other)
        found: list[set[int]] = list(nx.biconnected_components(whole))  # type: ignore[arg-type]
        return [block for block in found if len(block) > 2]

    def rows_past(self, stops: Sequence[Sequence[int]], blocks: Sequence[set[int]]) -> Rows:
        """Return the edges of those two-connected parts that hold every stop."""
        rows: Rows = [[] for _ in self.rows]
        for block in blocks:
            if all(not block.isdisjoint(stop) for stop in stops):
                for k in block:
                    rows[k] += [entry for entry in self.rows[k] if entry[0] in block]
        for row in rows:
            row.sort()
        return rows

    def cycle(self, item: Item) -> Cycle:
        """Return the cycle of an item of the search."""
        length, path = item
        facts, names, grade, least = self._facts, self.names, 2, math.inf
        before = path[-1]
        for node in path:
            fact = facts[before][node]
            grade, least = min(grade, fact[0]), min(least, fact[1])
            before = node
        reds = sum([self._red[node] for node in path])
        return Cycle(
            nodes=tuple([names[node] for node in path]),
            sign=self.surface.graph["sign"],
            length=length / QUANTA_PER_RADIAN,
            valid=grade > 0,
            flyable=grade == 2,
            least_singular_value=least,
            color="mixed" if 0 < reds < len(path) else "red" if reds else "blue",
            surface=self.surface,
        )


class Cycles(Iterator[Cycle]):
    """The simple closed cycles of one or more graphs, found while they are asked for; see :func:`cycles`.

    `found` is how many have been yielded; `bound`, `complete` and `steps` hold at any time, after an interruption too.
    """

    found = 0

    def __init__(self, sources: Sequence[tuple[_Numbered, CycleSearch]]) -> None:
        self._sources = list(sources)
        self._streams = [map(numbered.cycle, search) for numbered, search in sources]
        self._heads: list[Cycle | None] = [None] * len(sources)

    @classmethod
    def merged(cls, parts: Sequence[Cycles]) -> Cycles:
        """Return the cycles of several graphs, none begun, in order of length; ties go to the earlier graph."""
        return cls([source for part in parts for source in part._sources])

    def look_ahead(self) -> None:
        """Find the next cycle of each graph without yielding it, which sharpens the bound."""
        for k, stream in enumerate(self._streams):
            if self._heads[k] is None:
                self._heads[k] = next(stream, None)

    def __next__(self) -> Cycle:
        self.look_ahead()
        ready = [(head.length, k, head) for k, head in enumerate(self._heads) if head is not None]
        if not ready:
            raise StopIteration
        _, first, cycle = min(ready, key=lambda entry: entry[:2])
        self._heads[first] = None
        self.found += 1
        return cycle

    @property
    def bound(self) -> float:
        """Every cycle shorter than this has been yielded [rad]; infinite when there are no more cycles at all."""
        known = zip(self._heads, self._sources, strict=True)
        return min((search.bound if head is None else head.length for head, (_, search) in known), default=math.inf)

    @property
    def complete(self) -> bool:
        """Whether every cycle within `max_length` has been yielded."""
        return all(search.complete for _, search in self._sources) and not any(self._heads)

    @property
    def steps(self) -> int:
        """How many nodes have been expanded."""
        return sum(search.steps for _, search in self._sources)

    def __str__(self) -> str:
        head = f"{self.found} cycle{'s' * (self.found != 1)}"
        if self.complete:
            return f"{head}: all there are"
        return f"{head}; every cycle shorter than {self.bound:.4f} rad is among them"


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
            raise InputError(f"max_length must be a finite number ≥ 0 (rad) or None, got {shown(max_length)}")
        most = quanta_of(float(max_length)) + _ROUNDING
    steps = _checked_effort(effort)
    numbered = _Numbered(graph, use)
    stops = numbered.stops(through, "through", any_order)
    rows = numbered.rows_past(stops, numbered.blocks()) if stops else numbered.rows
    search = CycleSearch(rows, stops=stops, any_order=any_order, most=most, effort=steps, progress=progress)
    return Cycles([(numbered, search)])


def _checked_effort(effort: object) -> int | None:
    if effort is None:
        return None
    whole = isinstance(effort, (int, np.integer)) and not isinstance(effort, bool)
    if not whole or not effort >= 1:  # type: ignore[operator]
        raise InputError(f"effort must be a whole number ≥ 1 or None, got {shown(effort)}")
    return int(effort)  # type: ignore[call-overload, no-any-return]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimpleCycle:
    """The answer of :func:`simple_cycle`; truthy when there is a cycle.

    Parameters
    ----------
    cycle
        The cycle, or None.
    nodes
        Its nodes from the first stop on, in the direction in which it passes the stops.
    bound
        No simple cycle through the stops is shorter than this [rad]; infinite if there is none.
    exact
        Whether the answer is proven: that the cycle is a shortest one, or that there is none.
    reason
        Why there is no cycle, in one sentence; None if there is one.
    """

    cycle: Cycle | None = None
    nodes: tuple[Any, ...] = ()
    bound: float = math.inf
    exact: bool = True
    reason: str | None = None

    def __bool__(self) -> bool:
        return self.cycle is not None

    @property
    def gap(self) -> float:
        """By what part the cycle may be longer than the shortest one, length/bound − 1; 0 if exact."""
        if self.exact:
            return 0.0
        return math.inf if self.cycle is None or self.bound <= 0 else self.cycle.length / self.bound - 1


def simple_cycle(
    graph: nx.Graph[Any],
    stops: Sequence[Sequence[Any]],
    *,
    use: Use = "valid",
    any_order: bool = False,
    effort: int | None = 1_000_000,
) -> SimpleCycle:
    """Return the shortest simple cycle through stops, or the best one found and how much shorter one could be.

    Parameters
    ----------
    graph, use, any_order
        As for :func:`cycles`.
    stops
        One or more stops, each a sequence of alternative nodes, passed in this cyclic order one way round or the
        other.
    effort
        Largest number of search steps. When they are spent the answer is the best cycle of the search and of a
        heuristic, which routes the legs one after the other around the nodes in use, with each leg as the first.

    Returns
    -------
    SimpleCycle
        Of several shortest cycles always the same one, by no rule. Without a cycle it carries the reason.

    Raises
    ------
    InputError
        If an argument is malformed.

    Notes
    -----
    The problem is hard in general, and the heuristic may fail where a cycle exists. A closed walk, which may pass a
    node twice, is found in any case: :func:`gaitgraph.graph.walks.closed_walk`.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> there_and_back = [[(12, 4, "red")], [(12, 6, "red")]]
    >>> answer = simple_cycle(surface_graph("negative"), there_and_back)
    >>> answer.exact, len(answer.nodes), round(answer.cycle.length, 4)
    (True, 4, 0.9481)
    """
    steps = _checked_effort(effort)
    numbered = _Numbered(graph, use)
    numbers = numbered.stops(stops, "stops", any_order)
    if not numbers:
        raise InputError("stops must be one or more, got none")
    blocks = numbered.blocks()
    rows = numbered.rows_past(numbers, blocks)
    if not any(rows):
        return SimpleCycle(reason=_why_apart(blocks, numbers))
    search = CycleSearch(rows, stops=numbers, any_order=any_order, effort=steps)
    best = search.shortest()
    exact = best is not None
    if best is None and search.complete:
        return SimpleCycle(reason="every closed walk through the stops passes some node twice")
    if best is None:
        order = best_order(graph, [numbered.names[stop[0]] for stop in numbers], use=use) if any_order else None
        ordered = [numbers[k] for k in order.order] if order is not None else numbers
        candidates = [*search.held, routed_cycle(rows, ordered)]
        best = min((item for item in candidates if item is not None), default=None)
    if best is None:
        reason = f"none found in {search.steps} steps; if there is one it is at least {search.bound:.4f} rad long"
        return SimpleCycle(reason=reason, exact=False, bound=search.bound)
    cycle = numbered.cycle(best)
    exact = exact or cycle.length <= search.bound
    return SimpleCycle(
        cycle=cycle,
        nodes=tuple(numbered.names[node] for node in _from_first_stop(best[1], numbers, any_order)),
        bound=cycle.length if exact else search.bound,
        exact=exact,
    )


def _why_apart(blocks: list[set[int]], stops: Sequence[Sequence[int]]) -> str:
    """Return why no two-connected part of a graph holds every stop."""
    for number, stop in enumerate(stops, start=1):
        if all(block.isdisjoint(stop) for block in blocks):
            return f"stop {number} lies on no cycle"
    for number, stop in enumerate(stops, start=1):
        at = [block for block in blocks if not block.isdisjoint(stop)]
        for other, after in enumerate(stops[number:], start=number + 1):
            if all(block.isdisjoint(after) for block in at):
                return (
                    f"stops {number} and {other} are not joined, or only through a node that all paths between them "
                    "pass"
                )
    return "no two-connected part of the graph holds all stops"


def _from_first_stop(path: tuple[int, ...], stops: Sequence[Sequence[int]], any_order: bool) -> tuple[int, ...]:
    """Return a cycle from its first stop on, in the direction in which it passes the stops."""
    turned = path
    for nodes in (path, (path[0], *path[:0:-1])):
        for k in [k for k, node in enumerate(nodes) if node in stops[0]]:
            turned = (*nodes[k:], *nodes[:k])
            places = iter((*turned, turned[0]))
            here: int | None = next(places)
            for stop in stops:
                while here is not None and here not in stop:
                    here = next(places, None)
            if any_order or here is not None:
                return turned
    return turned
