"""Optimization: smooth gaits with the best worst case, and the nearest flyable gait."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.optimization.optimize import (
        OptimalGait as OptimalGait,
        optimal_gait as optimal_gait,
    )
    from gaitgraph.optimization.retargeting import (
        Retargeted as Retargeted,
        retarget as retarget,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.optimization.optimize": ["OptimalGait", "optimal_gait"],
            "gaitgraph.optimization.retargeting": ["Retargeted", "retarget"],
        },
    )
