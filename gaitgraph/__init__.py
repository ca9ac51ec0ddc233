"""Plan gaits of a tilt-rotor that keep its decoupling matrix invertible.

The names below are loaded when they are first used, so that importing the package costs nothing::

    import gaitgraph as gg

    plan = gg.plan_loop([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
    gait = plan.gait
    gait.parametrize(period=1.0).write("gait3.csv")

The modules, each of which imports only from those before it, tell the method in order: errors, angles, files,
vehicle, invertibility, surface, coloring, palettes, paintings, regions, segments, gait, margins, attitudes, reports,
stretches, rules, checks, timing, graph, contract, search, requests, summary, plans, planning, ways, enumeration,
circuits, simplecycles, catalog, tables, reading, validation, exchange, transitions, robustness, drawing, plots,
figures, cli.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from gaitgraph.angles import angle_from_text
    from gaitgraph.attitudes import AcceptableAttitudes, SingularCurve, acceptable_attitudes, singular_curve
    from gaitgraph.circuits import Cycle, Cycles, cycles
    from gaitgraph.coloring import types_may_be_adjacent
    from gaitgraph.contract import validate_graph
    from gaitgraph.errors import (
        ContractError,
        FileProblem,
        GaitgraphError,
        Infeasible,
        InputError,
        MissingConstant,
        OutputExists,
    )
    from gaitgraph.exchange import gait_of
    from gaitgraph.gait import Gait, lift, vertices
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
    from gaitgraph.margins import (
        attitude_sensitivities,
        least_singular_value_within,
        nearest_singular_attitude,
        tilt_margin,
    )
    from gaitgraph.paintings import Coloring, Colorings, colorings
    from gaitgraph.palettes import ColoringObstacle
    from gaitgraph.planning import plan_loop
    from gaitgraph.plans import Plan
    from gaitgraph.reading import read_table
    from gaitgraph.reports import Check, Report
    from gaitgraph.requests import PlanRequest
    from gaitgraph.robustness import Robustness, RobustnessReport, robustness_of
    from gaitgraph.simplecycles import NoCycle, SimpleCycle, simple_cycle
    from gaitgraph.surface import root_arrays, roots, sheet_grid
    from gaitgraph.timing import TimedGait, parametrize
    from gaitgraph.transitions import Transition, transition
    from gaitgraph.validation import validate
    from gaitgraph.vehicle import PAPER, Vehicle, preset_names, vehicle_from_mapping, vehicle_named

_HOMES = {
    "angles": ("angle_from_text",),
    "attitudes": ("AcceptableAttitudes", "SingularCurve", "acceptable_attitudes", "singular_curve"),
    "coloring": ("types_may_be_adjacent",),
    "paintings": ("Coloring", "Colorings", "colorings"),
    "palettes": ("ColoringObstacle",),
    "contract": ("validate_graph",),
    "circuits": ("Cycle", "Cycles", "cycles"),
    "exchange": ("gait_of",),
    "errors": (
        "ContractError",
        "FileProblem",
        "GaitgraphError",
        "Infeasible",
        "InputError",
        "MissingConstant",
        "OutputExists",
    ),
    "gait": ("Gait", "lift", "vertices"),
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
    "margins": (
        "attitude_sensitivities",
        "least_singular_value_within",
        "nearest_singular_attitude",
        "tilt_margin",
    ),
    "planning": ("plan_loop",),
    "plans": ("Plan",),
    "reports": ("Check", "Report"),
    "requests": ("PlanRequest",),
    "robustness": ("Robustness", "RobustnessReport", "robustness_of"),
    "simplecycles": ("NoCycle", "SimpleCycle", "simple_cycle"),
    "surface": ("root_arrays", "roots", "sheet_grid"),
    "reading": ("read_table",),
    "timing": ("TimedGait", "parametrize"),
    "transitions": ("Transition", "transition"),
    "validation": ("validate",),
    "vehicle": ("PAPER", "Vehicle", "preset_names", "vehicle_from_mapping", "vehicle_named"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "PAPER",
    "AcceptableAttitudes",
    "Check",
    "Coefficients",
    "Coloring",
    "ColoringObstacle",
    "Colorings",
    "ContractError",
    "Cycle",
    "Cycles",
    "FileProblem",
    "Gait",
    "GaitgraphError",
    "Infeasible",
    "InputError",
    "MissingConstant",
    "NoCycle",
    "OutputExists",
    "Plan",
    "PlanRequest",
    "Report",
    "Robustness",
    "RobustnessReport",
    "SimpleCycle",
    "SingularCurve",
    "TimedGait",
    "Transition",
    "Vehicle",
    "__version__",
    "acceptable_attitudes",
    "angle_from_text",
    "attitude_sensitivities",
    "coefficients_of",
    "colorings",
    "control_force_matrix",
    "control_moment_matrix",
    "cycles",
    "decoupling_matrix",
    "determinant",
    "gait_of",
    "hover_thrust_shares",
    "least_singular_value",
    "least_singular_value_within",
    "level_determinant",
    "lift",
    "nearest_singular_attitude",
    "parametrize",
    "pitch_sensitivity",
    "plan_loop",
    "preset_names",
    "read_table",
    "robustness_of",
    "roll_sensitivity",
    "root_arrays",
    "roots",
    "sheet_grid",
    "simple_cycle",
    "singular_curve",
    "surface_graph",
    "tilt_margin",
    "transition",
    "types_may_be_adjacent",
    "validate",
    "validate_graph",
    "vehicle_from_mapping",
    "vehicle_named",
    "vertices",
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
