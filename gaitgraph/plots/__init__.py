"""Pictures of surfaces, graphs, gaits and attitudes; each takes axes and returns them.

Every function draws on the axes `ax`, or on those of a new pyplot figure if there are none, and returns them. None
shows, saves, or changes a setting. Red squares and blue discs are the two sheets, unless a docstring says otherwise;
angles are in radians, with ticks at multiples of π.

The paper's "one of the roots" and "the other root" are in the order of its solver, which nobody knows. Here the roots
of a node are ordered by α3, then α4: the first root is the one with the smaller α3. Like the paper's, this order hops
between the planes.
"""

from __future__ import annotations

from gaitgraph.plots.basins import basin_map, basins_figure
from gaitgraph.plots.flights import flights_side_by_side, plot_flight
from gaitgraph.plots.gaits import at_face_value, axes_of_a_gait, gait_in_four_dimensions, roll_pitch_diagram
from gaitgraph.plots.regions import regions_map, singular_value_map
from gaitgraph.plots.roots import (
    InteriorRoots,
    interior_roots,
    level_determinants,
    root_angle,
    root_counts,
    signed_roots,
)
from gaitgraph.plots.types import adjacency_rule, gait_loop, type_map
from gaitgraph.plots.vehicles import vehicle_sketch

__all__ = [
    "InteriorRoots",
    "adjacency_rule",
    "at_face_value",
    "axes_of_a_gait",
    "basin_map",
    "basins_figure",
    "flights_side_by_side",
    "gait_in_four_dimensions",
    "gait_loop",
    "interior_roots",
    "level_determinants",
    "plot_flight",
    "regions_map",
    "roll_pitch_diagram",
    "root_angle",
    "root_counts",
    "signed_roots",
    "singular_value_map",
    "type_map",
    "vehicle_sketch",
]
