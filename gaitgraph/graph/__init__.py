"""The surfaces as a networkx graph: its contract, walks through stops, cycles in order of length."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.graph.build import (
        metadata_of as metadata_of,
        surface_graph as surface_graph,
        validate_graph as validate_graph,
    )
    from gaitgraph.graph.cycle_list import Cycle as Cycle, cycles as cycles
    from gaitgraph.graph.walks import (
        best_order as best_order,
        closed_walk as closed_walk,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.graph.build": ["metadata_of", "surface_graph", "validate_graph"],
            "gaitgraph.graph.cycle_list": ["Cycle", "cycles"],
            "gaitgraph.graph.walks": ["best_order", "closed_walk"],
        },
    )
