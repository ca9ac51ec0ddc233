r"""Where a gait may be: regions of the (α1, α2) plane as polygons, and what can be asked of them.

On a sheet a straight line in (α1, α2) is straight in all four angles, so a loop in the plane is a gait, and where it
may go is plane geometry. Straight borders are exact. Curved ones are known in closed form
(:mod:`gaitgraph.areas.outlines`) and followed by certified chords (:mod:`gaitgraph.areas.borders`); a :class:`Region`
holds two polygons: `inner`, which certainly lies in the region, and `outer`, which certainly encloses it.
"""

from __future__ import annotations

from gaitgraph.areas.admissible import admissible_region, why_empty
from gaitgraph.areas.conditions import (
    hover_region,
    singular_value_region,
    thrust_region,
    tilt_region,
    zones_region,
)
from gaitgraph.areas.region import DEFAULT_ACCURACY, Condition, Region
from gaitgraph.areas.signs import Sign, SignComponent, certain_determinant, sign_components, sign_region

__all__ = [
    "DEFAULT_ACCURACY",
    "Condition",
    "Region",
    "Sign",
    "SignComponent",
    "admissible_region",
    "certain_determinant",
    "hover_region",
    "sign_components",
    "sign_region",
    "singular_value_region",
    "thrust_region",
    "tilt_region",
    "why_empty",
    "zones_region",
]
