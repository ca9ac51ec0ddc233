"""The gait surfaces: sheets and roots, plane types, the Figure 15 rule, colourings, and regions of the (α1, α2) plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.surface.adjacency import types_may_be_adjacent as types_may_be_adjacent
    from gaitgraph.surface.admissible import admissible_region as admissible_region, why_empty as why_empty
    from gaitgraph.surface.color_choices import ColoringObstacle as ColoringObstacle
    from gaitgraph.surface.conditions import (
        hover_region as hover_region,
        singular_value_region as singular_value_region,
        thrust_region as thrust_region,
        tilt_region as tilt_region,
        zones_region as zones_region,
    )
    from gaitgraph.surface.fibers import fiber_points as fiber_points
    from gaitgraph.surface.loop_colorings import Coloring as Coloring, Colorings as Colorings, colorings as colorings
    from gaitgraph.surface.region import DEFAULT_ACCURACY as DEFAULT_ACCURACY, Condition as Condition, Region as Region
    from gaitgraph.surface.signs import (
        Sign as Sign,
        SignComponent as SignComponent,
        certain_determinant as certain_determinant,
        sign_components as sign_components,
        sign_region as sign_region,
    )
    from gaitgraph.surface.solutions import root_arrays as root_arrays, roots as roots, sheet_grid as sheet_grid
else:
    __getattr__, __dir__ = lazy_names(__name__)
