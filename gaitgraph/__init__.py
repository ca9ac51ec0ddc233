"""Plan gaits of a tilt-rotor that keep its decoupling matrix invertible.

Names are loaded when they are first used, so that importing the package costs nothing::

    import gaitgraph as gg

    plan = gg.plan_loop([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    gait = plan.gait
    gait.parametrize(period=1.0).write("gait3.csv")

Everything else is reached by its package: ``gg.surface.root_arrays``, ``gg.graph.surface_graph`` and so on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

__version__ = "0.1.0"

if TYPE_CHECKING:
    from gaitgraph import (
        angles as angles,
        certificates as certificates,
        errors as errors,
        explorer as explorer,
        flight as flight,
        gait as gait,
        graph as graph,
        invertibility as invertibility,
        io as io,
        optimization as optimization,
        planning as planning,
        plots as plots,
        robustness as robustness,
        study as study,
        surface as surface,
        timing as timing,
        validation as validation,
        vehicle as vehicle,
    )
    from gaitgraph.certificates.making import certify as certify
    from gaitgraph.errors import (
        GaitgraphError as GaitgraphError,
        Infeasible as Infeasible,
        InputError as InputError,
    )
    from gaitgraph.flight.basins import basins_of as basins_of
    from gaitgraph.flight.flight import FlightSettings as FlightSettings
    from gaitgraph.flight.simulation import fly as fly
    from gaitgraph.gait.gait import Gait as Gait, lift as lift
    from gaitgraph.gait.given import gait_of as gait_of
    from gaitgraph.gait.table import Table as Table
    from gaitgraph.graph.build import (
        surface_graph as surface_graph,
        validate_graph as validate_graph,
    )
    from gaitgraph.graph.cycle_list import cycles as cycles
    from gaitgraph.invertibility.coefficients import Coefficients as Coefficients
    from gaitgraph.io.exporting import export as export
    from gaitgraph.io.formats import read_table as read_table
    from gaitgraph.io.servo_map import ServoMap as ServoMap
    from gaitgraph.optimization.optimize import optimal_gait as optimal_gait
    from gaitgraph.optimization.retargeting import retarget as retarget
    from gaitgraph.planning.location import location_of as location_of
    from gaitgraph.planning.missions import mission as mission
    from gaitgraph.planning.planner import Plan as Plan, plan_loop as plan_loop
    from gaitgraph.planning.transitions import transition as transition
    from gaitgraph.robustness.biased import robustness_of as robustness_of
    from gaitgraph.study.running import run_study as run_study
    from gaitgraph.surface.admissible import admissible_region as admissible_region
    from gaitgraph.surface.loop_colorings import colorings as colorings
    from gaitgraph.surface.sheets import roots as roots
    from gaitgraph.timing.limits import Limits as Limits
    from gaitgraph.timing.time_optimal import (
        least_period as least_period,
        paced as paced,
    )
    from gaitgraph.timing.timed_gait import TimedGait as TimedGait
    from gaitgraph.validation.report import Report as Report
    from gaitgraph.validation.validating import validate as validate
    from gaitgraph.vehicle import (
        PAPER as PAPER,
        Vehicle as Vehicle,
        vehicle_named as vehicle_named,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph": [
                "angles",
                "certificates",
                "errors",
                "explorer",
                "flight",
                "gait",
                "graph",
                "invertibility",
                "io",
                "optimization",
                "planning",
                "plots",
                "robustness",
                "study",
                "surface",
                "timing",
                "validation",
                "vehicle",
            ],
            "gaitgraph.certificates.making": ["certify"],
            "gaitgraph.errors": ["GaitgraphError", "Infeasible", "InputError"],
            "gaitgraph.flight.basins": ["basins_of"],
            "gaitgraph.flight.flight": ["FlightSettings"],
            "gaitgraph.flight.simulation": ["fly"],
            "gaitgraph.gait.gait": ["Gait", "lift"],
            "gaitgraph.gait.given": ["gait_of"],
            "gaitgraph.gait.table": ["Table"],
            "gaitgraph.graph.build": ["surface_graph", "validate_graph"],
            "gaitgraph.graph.cycle_list": ["cycles"],
            "gaitgraph.invertibility.coefficients": ["Coefficients"],
            "gaitgraph.io.exporting": ["export"],
            "gaitgraph.io.formats": ["read_table"],
            "gaitgraph.io.servo_map": ["ServoMap"],
            "gaitgraph.optimization.optimize": ["optimal_gait"],
            "gaitgraph.optimization.retargeting": ["retarget"],
            "gaitgraph.planning.location": ["location_of"],
            "gaitgraph.planning.missions": ["mission"],
            "gaitgraph.planning.planner": ["Plan", "plan_loop"],
            "gaitgraph.planning.transitions": ["transition"],
            "gaitgraph.robustness.biased": ["robustness_of"],
            "gaitgraph.study.running": ["run_study"],
            "gaitgraph.surface.admissible": ["admissible_region"],
            "gaitgraph.surface.loop_colorings": ["colorings"],
            "gaitgraph.surface.sheets": ["roots"],
            "gaitgraph.timing.limits": ["Limits"],
            "gaitgraph.timing.time_optimal": ["least_period", "paced"],
            "gaitgraph.timing.timed_gait": ["TimedGait"],
            "gaitgraph.validation.report": ["Report"],
            "gaitgraph.validation.validating": ["validate"],
            "gaitgraph.vehicle": ["PAPER", "Vehicle", "vehicle_named"],
        },
    )
