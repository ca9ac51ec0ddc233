"""The simple closed cycles of surface graphs, one after the other in order of length, and the shortest through stops.

A cycle passes three or more nodes, none of them twice. Cycles come in a total order: by length, compared as whole
multiples of 1e-12 rad, then by their nodes in canonical form. That form starts at the node that comes first in the
graph and goes on to the earlier of its two neighbours on the cycle; a cycle and its reverse are the same cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from gaitgraph.angles import number_of, text_from_angle
from gaitgraph.errors import ContractError, InputError, shown
from gaitgraph.graph.build import gait_along, vehicle_and_coefficients
from gaitgraph.graph.cycle_search import CycleSearch
from gaitgraph.graph.walks import MOST_ANY_ORDER, QUANTA_PER_RADIAN, Use, allowed_edges, quanta_of
from gaitgraph.surface.sheets import HOVER_LABEL, RELATION, Sign, red_label

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from gaitgraph.gait.gait import Gait
    from gaitgraph.graph.cycle_search import Item, Rows
    from gaitgraph.validation.report import Report

_ROUNDING = 1000  # quanta: what rounding its edges may add to a cycle


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One simple closed cycle with the verdict of its edges.

    Every cycle is two-color between its nodes; no clock is judged, neither tilt rates nor accelerations.

    Parameters
    ----------
    nodes
        Node ids in canonical order, the first not repeated.
    length
        Length in the (α1, α2) plane [rad], the sum of the edges, each to the next 1e-12.
    surface
        The graph as it was when the search began.
    """

    nodes: tuple[Any, ...]
    length: float
    surface: nx.Graph[Any] = field(repr=False, compare=False)

    @property
    def sign(self) -> Sign:
        """Sign of R: "positive" or "negative"."""
        sign: Sign = self.surface.graph["sign"]
        return sign

    @property
    def color(self) -> str:
        """The color of all nodes, "red" or "blue", or "mixed"."""
        colors = {self.surface.nodes[name]["color"] for name in self.nodes}
        return str(colors.pop()) if len(colors) == 1 else "mixed"

    @property
    def _edges(self) -> list[dict[str, Any]]:
        return [self.surface.edges[pair] for pair in pairwise((*self.nodes, self.nodes[0]))]

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
        """The least value of the edges, dimensionless; 0 with blue nodes or jumps."""
        return min(float(edge["least_singular_value"]) for edge in self._edges)

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
        path = self.path
        return {
            "color": self.color,
            "sign": self.sign,
            "path": path.alpha.tolist(),
            "types": [self.surface.nodes[name]["types"] for name in self.nodes],
            "colors": list(path.colors),
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
        self.surface = graph.copy()
        self.names = list(graph.nodes)
        self.index = {name: k for k, name in enumerate(self.names)}
        self.rows: Rows = [[] for _ in self.names]
        for first, second, edge in graph.edges(data=True):
            a, b = self.index[first], self.index[second]
            if a != b and allowed(edge):
                self.rows[a].append((b, quanta_of(edge["length"])))
                self.rows[b].append((a, quanta_of(edge["length"])))
        for row in self.rows:
            row.sort()

    def stops(self, value: object, any_order: bool) -> list[list[int]]:
        """Return stops as lists of numbers; InputError if they are no nodes of the graph, or too many."""
        stops: Any = value if isinstance(value, (list, tuple)) else [value]
        for stop in stops:
            nodes = stop if isinstance(stop, (list, tuple, set, frozenset)) and stop else [None]
            if not all(isinstance(node, Hashable) and node in self.index for node in nodes):
                raise InputError(f"stops must be a list of lists of nodes of the graph, got {shown(stop)}")
        if any_order and len(stops) > MOST_ANY_ORDER:
            raise InputError(f"any_order takes at most {MOST_ANY_ORDER} stops, got {len(stops)}")
        return [sorted({self.index[node] for node in stop}) for stop in stops]

    def blocks(self) -> list[set[int]]:
        """Return the two-connected parts with three or more nodes: each cycle lies in one of them."""
        whole: nx.Graph[int] = nx.Graph((k, other) for k, row in enumerate(self.rows) for other, _ in row if k < other)
        found: list[set[int]] = list(nx.biconnected_components(whole))  # type: ignore[arg-type]
        return [block for block in found if len(block) > 2]

    def rows_past(self, stops: Sequence[Sequence[int]], blocks: Sequence[set[int]]) -> Rows:
        """Return the edges of those two-connected parts that hold every stop."""
        held = [block for block in blocks if all(not block.isdisjoint(stop) for stop in stops)]
        return [
            sorted(entry for block in held if k in block for entry in row if entry[0] in block)
            for k, row in enumerate(self.rows)
        ]

    def cycle(self, item: Item) -> Cycle:
        """Return the cycle of an item of the search."""
        nodes = tuple(self.names[node] for node in item[1])
        return Cycle(nodes=nodes, length=item[0] / QUANTA_PER_RADIAN, surface=self.surface)


class Cycles(Iterator[Cycle]):
    """The simple closed cycles of one or more graphs, found while they are asked for; see :func:`cycles`.

    Of several graphs they come in order of length, ties from the earlier graph first. `found` is how many have been
    yielded; `bound`, `complete` and `steps` hold at any time, after an interruption too.
    """

    def __init__(self, sources: Iterable[tuple[_Numbered, CycleSearch]]) -> None:
        self.found = 0
        self.sources = list(sources)
        self._heads: list[Cycle | None] = [None] * len(self.sources)

    def look_ahead(self) -> None:
        """Find the next cycle of each graph without yielding it, which sharpens the bound."""
        for k, (numbered, search) in enumerate(self.sources):
            if self._heads[k] is None:
                self._heads[k] = next(map(numbered.cycle, search), None)

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
        known = zip(self._heads, self.sources, strict=True)
        return min((search.bound if head is None else head.length for head, (_, search) in known), default=math.inf)

    @property
    def complete(self) -> bool:
        """Whether every cycle within `max_length` has been yielded."""
        return all(search.complete for _, search in self.sources) and not any(self._heads)

    @property
    def steps(self) -> int:
        """How many nodes have been expanded."""
        return sum(search.steps for _, search in self.sources)

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
        A surface graph that keeps the contract of :mod:`gaitgraph.graph.build`; it is read at once.
    max_length
        No longer cycles [rad]; 1e-9 rad are allowed for rounding. None: no limit.
    use
        Which edges count: "flyable", "valid" (on one sheet, R of one sign) or "two_color" (all).
    through
        Stops, each a sequence of alternative nodes: only cycles that pass the stops in this cyclic order, in either
        direction. One node may serve several stops that follow each other.
    any_order
        Pass the stops, at most nine, in any order.
    effort
        Largest number of search steps; when they are spent the iterator stops, incomplete. None: no limit.
    progress
        Called with a line of text for each range of lengths that is done, and every 200 000 steps.

    Raises
    ------
    InputError, ContractError
        If an argument is malformed, or the graph's metadata are missing.

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
    numbered = _Numbered(graph, use)
    stops = numbered.stops(through, any_order)
    rows = numbered.rows_past(stops, numbered.blocks()) if stops else numbered.rows
    steps = _checked_effort(effort)
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

    No simple cycle through the stops is shorter than the `bound` [rad], infinite if there is none; `reason` says why
    there is no cycle, in one sentence.
    """

    cycle: Cycle | None = None
    bound: float = math.inf
    reason: str | None = None

    def __bool__(self) -> bool:
        return self.cycle is not None

    @property
    def exact(self) -> bool:
        """Whether the answer is proven: that the cycle is a shortest one, or that there is none."""
        return self.bound == (math.inf if self.cycle is None else self.cycle.length)


def simple_cycle(
    graph: nx.Graph[Any],
    stops: Sequence[Sequence[Any]],
    *,
    use: Use = "valid",
    any_order: bool = False,
    effort: int | None = 1_000_000,
) -> SimpleCycle:
    """Return the shortest simple cycle through stops, or the best one found and how much shorter one could be.

    The options are those of :func:`cycles`, with one or more `stops`. When the effort is spent the answer is the best
    cycle that was met, if any. Of several shortest cycles it is always the same one, by no rule. The problem is hard in
    general; a closed walk, which may pass a node twice, is found in any case:
    :func:`gaitgraph.graph.walks.closed_walk`.

    Examples
    --------
    >>> from gaitgraph.graph.build import surface_graph
    >>> there_and_back = [[(12, 4, "red")], [(12, 6, "red")]]
    >>> answer = simple_cycle(surface_graph("negative"), there_and_back)
    >>> answer.exact, len(answer.cycle.nodes), round(answer.cycle.length, 4)
    (True, 4, 0.9481)
    """
    numbered = _Numbered(graph, use)
    numbers = numbered.stops(stops, any_order)
    if not numbers:
        raise InputError("stops must be one or more, got none")
    blocks = numbered.blocks()
    rows = numbered.rows_past(numbers, blocks)
    search = CycleSearch(rows, stops=numbers, any_order=any_order, effort=_checked_effort(effort))
    if not any(rows):
        return SimpleCycle(reason=_why_apart(blocks, numbers))
    best = search.shortest() or min(search.held, default=None)
    if best is not None:
        cycle = numbered.cycle(best)
        return SimpleCycle(cycle=cycle, bound=min(cycle.length, search.bound))
    if search.complete:
        return SimpleCycle(reason="every closed walk through the stops passes some node twice")
    reason = f"none found in {search.steps} steps; if there is one it is at least {search.bound:.4f} rad long"
    return SimpleCycle(reason=reason, bound=search.bound)


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
