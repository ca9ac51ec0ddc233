"""Plots: surfaces, graphs, gaits, attitudes, flights, films, and the figures of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.plots.axes import plane_axes as plane_axes
    from gaitgraph.plots.figures import (
        FIGURES as FIGURES,
        write_figures as write_figures,
    )
    from gaitgraph.plots.films import write_films as write_films
    from gaitgraph.plots.flights import (
        plot_flight as plot_flight,
        write_basins as write_basins,
        write_flight as write_flight,
    )
    from gaitgraph.plots.gaits import (
        basin_map as basin_map,
        gait_loop as gait_loop,
        plot as plot,
        roll_pitch_diagram as roll_pitch_diagram,
    )
    from gaitgraph.plots.planes import (
        adjacency_rule as adjacency_rule,
        regions_map as regions_map,
        servo_margin_map as servo_margin_map,
        singular_value_map as singular_value_map,
        type_map as type_map,
    )
    from gaitgraph.plots.vehicles import (
        VehicleView as VehicleView,
        draw_vehicle as draw_vehicle,
        vehicle_figure as vehicle_figure,
        vehicle_view as vehicle_view,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.plots.axes": ["plane_axes"],
            "gaitgraph.plots.figures": ["FIGURES", "write_figures"],
            "gaitgraph.plots.films": ["write_films"],
            "gaitgraph.plots.flights": ["plot_flight", "write_basins", "write_flight"],
            "gaitgraph.plots.gaits": [
                "basin_map",
                "gait_loop",
                "plot",
                "roll_pitch_diagram",
            ],
            "gaitgraph.plots.planes": [
                "adjacency_rule",
                "regions_map",
                "servo_margin_map",
                "singular_value_map",
                "type_map",
            ],
            "gaitgraph.plots.vehicles": [
                "VehicleView",
                "draw_vehicle",
                "vehicle_figure",
                "vehicle_view",
            ],
        },
    )
