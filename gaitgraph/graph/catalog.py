"""Closed cycles for a request: inside a region, of one color or both, with either sign of R, through waypoints.

The surface graph holds one sign of R. A catalogue builds the graphs that a request speaks of and merges their cycles
into one total order: by length, R < 0 before R > 0 at the same length, then by the graph's own order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError, shown
from gaitgraph.graph.build import nodes_above, surface_graph
from gaitgraph.graph.cycle_list import Cycle, cycles
from gaitgraph.graph.simple_cycles import NoCycle, SimpleCycle, simple_cycle
from gaitgraph.graph.walks import MOST_ANY_ORDER, best_order
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.planning.request import PlanRequest
from gaitgraph.surface.sheets import RELATION, SIGNS

if TYPE_CHECKING:
    from collections.abc import Callable

    import networkx as nx

    from gaitgraph.graph.cycle_list import Cycles
    from gaitgraph.graph.walks import Use
    from gaitgraph.surface.sheets import Sign

__all__ = ["Catalog", "catalog"]


class Catalog(Iterator[Cycle]):
    """The cycles of a request, found while they are asked for; see :func:`catalog`."""

    def __init__(
        self,
        graphs: dict[Sign, nx.Graph[Any]],
        stops: dict[Sign, list[list[Any]]],
        missing: dict[Sign, str],
        notes: tuple[str, ...] = (),
        **asked: Any,
    ) -> None:
        self._graphs, self._stops, self._asked = graphs, stops, asked
        self.missing = missing
        self.notes = notes
        self._streams: list[Cycles] = [
            cycles(graphs[sign], through=stops[sign], **asked) for sign in SIGNS if sign in graphs
        ]
        self._heads: list[Cycle | None] | None = None
        self.found = 0

    def __iter__(self) -> Catalog:
        return self

    def __next__(self) -> Cycle:
        if self._heads is None:
            self._heads = [next(stream, None) for stream in self._streams]
        ready = [k for k, head in enumerate(self._heads) if head is not None]
        if not ready:
            raise StopIteration
        first = min(ready, key=self._length)
        cycle = self._heads[first]
        assert cycle is not None  # noqa: S101 - chosen among those that are there
        self._heads[first] = next(self._streams[first], None)
        self.found += 1
        return cycle

    def _length(self, k: int) -> float:
        head = self._heads[k] if self._heads is not None else None
        return self._streams[k].bound if head is None else head.length

    @property
    def bound(self) -> float:
        """Every cycle shorter than this has been yielded [rad]; infinite when there are no more."""
        return min((self._length(k) for k in range(len(self._streams))), default=math.inf)

    @property
    def complete(self) -> bool:
        """Whether every cycle has been yielded."""
        return all(stream.complete for stream in self._streams) and not any(self._heads or [])

    def told(self) -> str:
        """Return in one line how far the catalogue has come."""
        head = f"{self.found} cycle{'s' * (self.found != 1)}"
        if self.complete:
            return f"{head}: all there are"
        return f"{head}; every cycle shorter than {self.bound:.4f} rad is among them"

    def best(self, *, effort: int) -> tuple[Cycle | None, float, str]:
        """Return the best cycle through the waypoints that an effort finds, a bound of all lengths, and a reason.

        The cycle is None if none is found; otherwise the reason is empty, and the cycle is a shortest one if it is
        not longer than the bound [rad].

        Parameters
        ----------
        effort
            Largest number of search steps for each sign of R.
        """
        answers = {}
        for sign, graph in self._graphs.items():
            if not self._stops[sign]:
                continue
            asked = {name: self._asked[name] for name in ("use", "any_order")}
            answers[sign] = simple_cycle(graph, self._stops[sign], effort=effort, **asked)
        limit = self._asked["max_length"]
        bound = min((one.bound for one in answers.values()), default=math.inf)
        cycles_ = [one.cycle for one in answers.values() if isinstance(one, SimpleCycle)]
        if cycles_:
            shortest = min(cycles_, key=lambda cycle: cycle.length)
            if limit is None or shortest.length <= limit + 1e-9:
                return shortest, bound, ""
            return None, bound, f"within {limit:g} rad none was found; the best one has {shortest.length:.4f} rad"
        reasons = dict(self.missing)
        reasons |= {sign: one.reason for sign, one in answers.items() if isinstance(one, NoCycle)}
        if reasons:
            return None, bound, "; ".join(f"{RELATION[sign]}: {reason}" for sign, reason in sorted(reasons.items()))
        if not self.complete:
            return None, self.bound, f"none found so far; if there is one it is at least {self.bound:.4f} rad long"
        return None, math.inf, "the graph has none" + ("" if limit is None else f" within {limit:g} rad")


def catalog(
    request: PlanRequest,
    *,
    through: bool = True,
    max_length: float | None = None,
    use: Use = "valid",
    effort: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Catalog:
    """Return the simple closed cycles of a request as a lazy iterator, in a total order.

    Parameters
    ----------
    request
        Vehicle, coefficients, divisions, polygons, floor; sign and color, where "auto" is both. Its period, law,
        objective and direction play no part.
    through
        Whether the cycles pass the request's waypoints, in order or, with its `any_order`, in any order; more than nine
        in the order that Christofides' heuristic finds, which `notes` tells.
    max_length, use, effort, progress
        As for :func:`gaitgraph.graph.cycle_list.cycles`; the effort is for each sign of R.

    Raises
    ------
    InputError
        If a value is not allowed.

    Examples
    --------
    >>> from gaitgraph.planning.request import request_of
    >>> found = catalog(request_of([("pi/8", "-pi/8"), ("pi/4", "-pi/4")], color="red"))
    >>> cycle = next(found)
    >>> cycle.sign, len(cycle.nodes), round(cycle.length, 4), cycle.flyable
    ('negative', 5, 1.2257, True)
    """
    if not isinstance(request, PlanRequest):
        raise InputError(f"request: {shown(request)}; allowed is a PlanRequest")
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    any_order, notes = request.any_order and through, []
    heuristic = any_order and len(request.waypoints) > MOST_ANY_ORDER
    graphs: dict[Sign, nx.Graph[Any]] = {}
    stops: dict[Sign, list[list[Any]]] = {}
    missing: dict[Sign, str] = {}
    for sign in SIGNS:
        if request.sign not in ("auto", sign):
            continue
        if progress is not None:
            progress(f"building the graph of {request.divisions} divisions with {RELATION[sign]}")
        graph = surface_graph(
            sign,
            request.divisions,
            vehicle=request.vehicle,
            coefficients=coefficients,
            waypoints=request.waypoints if through else (),
            zones=request.zones,
            floor=request.floor,
        )
        if request.color != "auto":
            other = [name for name, data in graph.nodes(data=True) if data["color"] != request.color]
            graph.remove_nodes_from(other)
        served = nodes_above(graph, request.waypoints) if through else []
        lacking = [number for number, nodes in enumerate(served, start=1) if not nodes]
        if lacking:
            missing[sign] = (
                f"waypoint {lacking[0]} has no {_PAINT[request.color]}root with this sign of R in the region"
            )
        else:
            graphs[sign], stops[sign] = graph, served
            order = best_order(graph, [nodes[0] for nodes in served], use=use) if heuristic else None
            if order is not None:
                stops[sign] = [served[k] for k in order.order]
                method = f"order of {len(served)} waypoints by Christofides' heuristic (networkx)"
                notes.append(f"{RELATION[sign]}: {method}: only cycles in this order are listed")
    any_order = any_order and not heuristic
    asked = {"max_length": max_length, "use": use, "effort": effort, "progress": progress}
    return Catalog(graphs, stops, missing, any_order=any_order, notes=tuple(notes), **asked)


_PAINT = {"auto": "", "red": "red ", "blue": "blue "}
