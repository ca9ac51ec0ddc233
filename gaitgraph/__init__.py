"""Plan gaits of a tilt-rotor that keep its decoupling matrix invertible.

The names below are loaded when they are first used, so that importing the package costs nothing::

    import gaitgraph as gg

    plan = gg.plan_loop([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    gait = plan.gait
    gait.parametrize(period=1.0).write("gait3.csv")

The modules, each of which imports only from those before it, tell the method in order: errors, angles, files, vehicle,
invertibility, surface, fibers, unfolding, coloring, palettes, paintings, regions, segments, areas, visibility, gait,
margins, attitudes, reports, stretches, rules, checks, timing, curves, pacing, fibergrid, graph, contract, loads,
search, compact, requests, obstacles, summary, plans, sketches, showing, gridloops, anyangle, whereabouts, fiberloops,
planning, ways, enumeration, circuits, simplecycles, catalog, tables, joints, scenes, formats, writing, reading,
frames, validation, completing, exchange, transitions, optimal, retargeting, robustness, drawing, plots, figures,
flight, study, watching, explorer, cli.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from gaitgraph.angles import angle_from_text
    from gaitgraph.areas import Region, admissible_region
    from gaitgraph.attitudes import AcceptableAttitudes, SingularCurve, acceptable_attitudes, singular_curve
    from gaitgraph.circuits import Cycle, Cycles, cycles
    from gaitgraph.coloring import types_may_be_adjacent
    from gaitgraph.compact.bits import CompactGraph, compact_graph
    from gaitgraph.compact.walks import CompactWalk, compact_loop, compact_walk
    from gaitgraph.contract import validate_graph
    from gaitgraph.curves.curve import Curve, curve_through
    from gaitgraph.curves.rounding import Rounding, rounded
    from gaitgraph.errors import (
        ContractError,
        FileProblem,
        GaitgraphError,
        Infeasible,
        InputError,
        MissingConstant,
        MissingExtra,
        OutputExists,
    )
    from gaitgraph.exchange import Exported, export, export_file, gait_of, request_of_file
    from gaitgraph.fibers import fiber_points
    from gaitgraph.flight.basins import Basin, basin_of, basins_of
    from gaitgraph.flight.courses import Course, from_hover
    from gaitgraph.flight.records import Flight
    from gaitgraph.flight.settings import FlightSettings
    from gaitgraph.flight.simulation import fly
    from gaitgraph.formats.options import FormatOptions
    from gaitgraph.frames import table_from_frame
    from gaitgraph.gait import Gait, lift, lift_to_fiber, vertices
    from gaitgraph.graph import surface_graph
    from gaitgraph.invertibility import (
        Coefficients,
        coefficients_of,
        control_force_matrix,
        control_moment_matrix,
        decoupling_matrix,
        determinant,
        hover_thrust_shares,
        least_singular_value,
        level_determinant,
        pitch_sensitivity,
        roll_sensitivity,
        zero_moment_direction,
    )
    from gaitgraph.joints.files import joint_map_from_mapping, joint_map_named
    from gaitgraph.joints.inverse import table_from_joints
    from gaitgraph.joints.joint import Joint
    from gaitgraph.joints.maps import JointMap, mapped_table
    from gaitgraph.margins import (
        attitude_sensitivities,
        least_singular_value_within,
        nearest_singular_attitude,
        tilt_margin,
    )
    from gaitgraph.optimal.optima import OptimalGait, Optimality
    from gaitgraph.optimal.optimum import optimal_gait
    from gaitgraph.pacing.limits import Limits
    from gaitgraph.pacing.pace import Pacing, least_period, paced
    from gaitgraph.pacing.pacedgait import PacedGait
    from gaitgraph.pacing.servos import ServoResponse, servo_response
    from gaitgraph.paintings import Coloring, Colorings, colorings
    from gaitgraph.palettes import ColoringObstacle
    from gaitgraph.planning import plan_loop
    from gaitgraph.plans import Plan
    from gaitgraph.reading import read_table
    from gaitgraph.reports import Check, Report
    from gaitgraph.requests import PlanRequest
    from gaitgraph.retargeting.nearest import retarget
    from gaitgraph.retargeting.retargeted import Retargeted
    from gaitgraph.robustness import Robustness, RobustnessReport, robustness_of
    from gaitgraph.scenes import Scene, scene_of
    from gaitgraph.simplecycles import NoCycle, SimpleCycle, simple_cycle
    from gaitgraph.study import Study, read_study, run_study
    from gaitgraph.surface import root_arrays, roots, sheet_grid
    from gaitgraph.tables import Table
    from gaitgraph.timing import TimedGait, parametrize
    from gaitgraph.transitions import Transition, transition
    from gaitgraph.unfolding import shortest_leg_across
    from gaitgraph.validation import validate
    from gaitgraph.vehicle import PAPER, Vehicle, preset_names, vehicle_from_mapping, vehicle_named
    from gaitgraph.visibility import ShortestPaths
    from gaitgraph.whereabouts import whereabouts_of
    from gaitgraph.writing import write_tables

_HOMES = {
    "angles": ("angle_from_text",),
    "areas": ("Region", "admissible_region"),
    "attitudes": ("AcceptableAttitudes", "SingularCurve", "acceptable_attitudes", "singular_curve"),
    "circuits": ("Cycle", "Cycles", "cycles"),
    "coloring": ("types_may_be_adjacent",),
    "compact.bits": ("CompactGraph", "compact_graph"),
    "compact.walks": ("CompactWalk", "compact_loop", "compact_walk"),
    "contract": ("validate_graph",),
    "curves.curve": ("Curve", "curve_through"),
    "curves.rounding": ("Rounding", "rounded"),
    "errors": (
        "ContractError",
        "FileProblem",
        "GaitgraphError",
        "Infeasible",
        "InputError",
        "MissingConstant",
        "MissingExtra",
        "OutputExists",
    ),
    "exchange": ("Exported", "export", "export_file", "gait_of", "request_of_file"),
    "fibers": ("fiber_points",),
    "flight.basins": ("Basin", "basin_of", "basins_of"),
    "flight.courses": ("Course", "from_hover"),
    "flight.records": ("Flight",),
    "flight.settings": ("FlightSettings",),
    "flight.simulation": ("fly",),
    "formats.options": ("FormatOptions",),
    "frames": ("table_from_frame",),
    "gait": ("Gait", "lift", "lift_to_fiber", "vertices"),
    "graph": ("surface_graph",),
    "invertibility": (
        "Coefficients",
        "coefficients_of",
        "control_force_matrix",
        "control_moment_matrix",
        "decoupling_matrix",
        "determinant",
        "hover_thrust_shares",
        "least_singular_value",
        "level_determinant",
        "pitch_sensitivity",
        "roll_sensitivity",
        "zero_moment_direction",
    ),
    "joints.files": ("joint_map_from_mapping", "joint_map_named"),
    "joints.inverse": ("table_from_joints",),
    "joints.joint": ("Joint",),
    "joints.maps": ("JointMap", "mapped_table"),
    "margins": ("attitude_sensitivities", "least_singular_value_within", "nearest_singular_attitude", "tilt_margin"),
    "optimal.optima": ("OptimalGait", "Optimality"),
    "optimal.optimum": ("optimal_gait",),
    "pacing.limits": ("Limits",),
    "pacing.pace": ("Pacing", "least_period", "paced"),
    "pacing.pacedgait": ("PacedGait",),
    "pacing.servos": ("ServoResponse", "servo_response"),
    "paintings": ("Coloring", "Colorings", "colorings"),
    "palettes": ("ColoringObstacle",),
    "planning": ("plan_loop",),
    "plans": ("Plan",),
    "reading": ("read_table",),
    "reports": ("Check", "Report"),
    "requests": ("PlanRequest",),
    "retargeting.nearest": ("retarget",),
    "retargeting.retargeted": ("Retargeted",),
    "robustness": ("Robustness", "RobustnessReport", "robustness_of"),
    "scenes": ("Scene", "scene_of"),
    "simplecycles": ("NoCycle", "SimpleCycle", "simple_cycle"),
    "study": ("Study", "read_study", "run_study"),
    "surface": ("root_arrays", "roots", "sheet_grid"),
    "tables": ("Table",),
    "timing": ("TimedGait", "parametrize"),
    "transitions": ("Transition", "transition"),
    "unfolding": ("shortest_leg_across",),
    "validation": ("validate",),
    "vehicle": ("PAPER", "Vehicle", "preset_names", "vehicle_from_mapping", "vehicle_named"),
    "visibility": ("ShortestPaths",),
    "whereabouts": ("whereabouts_of",),
    "writing": ("write_tables",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "PAPER",
    "AcceptableAttitudes",
    "Basin",
    "Check",
    "Coefficients",
    "Coloring",
    "ColoringObstacle",
    "Colorings",
    "CompactGraph",
    "CompactWalk",
    "ContractError",
    "Course",
    "Curve",
    "Cycle",
    "Cycles",
    "Exported",
    "FileProblem",
    "Flight",
    "FlightSettings",
    "FormatOptions",
    "Gait",
    "GaitgraphError",
    "Infeasible",
    "InputError",
    "Joint",
    "JointMap",
    "Limits",
    "MissingConstant",
    "MissingExtra",
    "NoCycle",
    "OptimalGait",
    "Optimality",
    "OutputExists",
    "PacedGait",
    "Pacing",
    "Plan",
    "PlanRequest",
    "Region",
    "Report",
    "Retargeted",
    "Robustness",
    "RobustnessReport",
    "Rounding",
    "Scene",
    "ServoResponse",
    "ShortestPaths",
    "SimpleCycle",
    "SingularCurve",
    "Study",
    "Table",
    "TimedGait",
    "Transition",
    "Vehicle",
    "__version__",
    "acceptable_attitudes",
    "admissible_region",
    "angle_from_text",
    "attitude_sensitivities",
    "basin_of",
    "basins_of",
    "coefficients_of",
    "colorings",
    "compact_graph",
    "compact_loop",
    "compact_walk",
    "control_force_matrix",
    "control_moment_matrix",
    "curve_through",
    "cycles",
    "decoupling_matrix",
    "determinant",
    "export",
    "export_file",
    "fiber_points",
    "fly",
    "from_hover",
    "gait_of",
    "hover_thrust_shares",
    "joint_map_from_mapping",
    "joint_map_named",
    "least_period",
    "least_singular_value",
    "least_singular_value_within",
    "level_determinant",
    "lift",
    "lift_to_fiber",
    "mapped_table",
    "nearest_singular_attitude",
    "optimal_gait",
    "paced",
    "parametrize",
    "pitch_sensitivity",
    "plan_loop",
    "preset_names",
    "read_study",
    "read_table",
    "request_of_file",
    "retarget",
    "robustness_of",
    "roll_sensitivity",
    "root_arrays",
    "roots",
    "rounded",
    "run_study",
    "scene_of",
    "servo_response",
    "sheet_grid",
    "shortest_leg_across",
    "simple_cycle",
    "singular_curve",
    "surface_graph",
    "table_from_frame",
    "table_from_joints",
    "tilt_margin",
    "transition",
    "types_may_be_adjacent",
    "validate",
    "validate_graph",
    "vehicle_from_mapping",
    "vehicle_named",
    "vertices",
    "whereabouts_of",
    "write_tables",
    "zero_moment_direction",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'gaitgraph' has no attribute {name!r}")
    value = getattr(import_module(f"gaitgraph.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
