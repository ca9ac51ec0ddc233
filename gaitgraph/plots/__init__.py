"""Plots: surfaces, graphs, gaits, attitudes, flights, films, and the figures of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.plots.basins import basin_map as basin_map, basins_figure as basins_figure
    from gaitgraph.plots.flights import flights_side_by_side as flights_side_by_side, plot_flight as plot_flight
    from gaitgraph.plots.gaits import (
        at_face_value as at_face_value,
        axes_of_a_gait as axes_of_a_gait,
        gait_in_four_dimensions as gait_in_four_dimensions,
        roll_pitch_diagram as roll_pitch_diagram,
    )
    from gaitgraph.plots.regions import regions_map as regions_map, singular_value_map as singular_value_map
    from gaitgraph.plots.root_maps import (
        InteriorRoots as InteriorRoots,
        interior_roots as interior_roots,
        level_determinants as level_determinants,
        root_angle as root_angle,
        root_counts as root_counts,
        signed_roots as signed_roots,
    )
    from gaitgraph.plots.scenes import Scene as Scene, scene_of as scene_of
    from gaitgraph.plots.type_maps import adjacency_rule as adjacency_rule, gait_loop as gait_loop, type_map as type_map
    from gaitgraph.plots.vehicle import vehicle_sketch as vehicle_sketch
else:
    __getattr__, __dir__ = lazy_names(__name__)
