"""The surfaces as a networkx graph: its contract, walks through stops, cycles in order of length."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.graph.build import surface_graph as surface_graph
    from gaitgraph.graph.contract import validate_graph as validate_graph
    from gaitgraph.graph.cycle_list import Cycle as Cycle, Cycles as Cycles, cycles as cycles
    from gaitgraph.graph.simple_cycles import (
        NoCycle as NoCycle,
        SimpleCycle as SimpleCycle,
        simple_cycle as simple_cycle,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)
