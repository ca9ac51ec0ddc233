"""Planning: requests, any-angle loops, loops on the paper's grid, refusals with their reasons, transitions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.planning.location import location_of as location_of
    from gaitgraph.planning.missions import mission as mission
    from gaitgraph.planning.planner import Plan as Plan, plan_loop as plan_loop
    from gaitgraph.planning.replanning import Replan as Replan, Replanner as Replanner
    from gaitgraph.planning.request import (
        PlanRequest as PlanRequest,
        plan_request as plan_request,
    )
    from gaitgraph.planning.shortest_paths import ShortestPaths as ShortestPaths
    from gaitgraph.planning.transitions import (
        Transition as Transition,
        transition as transition,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.planning.location": ["location_of"],
            "gaitgraph.planning.missions": ["mission"],
            "gaitgraph.planning.planner": ["Plan", "plan_loop"],
            "gaitgraph.planning.replanning": ["Replan", "Replanner"],
            "gaitgraph.planning.request": ["PlanRequest", "plan_request"],
            "gaitgraph.planning.shortest_paths": ["ShortestPaths"],
            "gaitgraph.planning.transitions": ["Transition", "transition"],
        },
    )
