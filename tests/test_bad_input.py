"""Bad input: one base error, and one line that names the argument, what is allowed, and the value."""

from __future__ import annotations

import errno
import math
import pickle
import re
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.angles import angle_from_text
from gaitgraph.errors import FileProblem, InputError
from gaitgraph.files import naming_file
from gaitgraph.flight.basins import basins_of
from gaitgraph.flight.course import from_hover
from gaitgraph.flight.engine import Engine
from gaitgraph.flight.flight import FlightSettings, settings_from_mapping
from gaitgraph.flight.simulation import fly
from gaitgraph.gait.gait import Gait, lift, vertices
from gaitgraph.graph.build import surface_graph
from gaitgraph.graph.cycle_list import cycles
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.segment_bounds import least_singular_value_along
from gaitgraph.invertibility.tilt_margins import least_singular_value_within
from gaitgraph.io.formats import write_tables
from gaitgraph.optimization.retargeting import MOST_ROWS
from gaitgraph.robustness.attitudes import acceptable_attitudes, singular_curve
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.study.design import study_from_mapping
from gaitgraph.surface.admissible import (
    admissible_region,
    hover_region,
    sign_region,
    singular_value_region,
    thrust_region,
)
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import (
    PLANE_TYPES,
    root_arrays,
    roots,
    types_from_text,
)
from gaitgraph.timing.curve import rounded
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.servo_lag import servo_response
from gaitgraph.timing.time_optimal import least_period, paced
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.validation.validating import validate
from tests.published import GAITS
from tests.samples import EXACT

if TYPE_CHECKING:
    from pathlib import Path

NAN, INF = math.nan, math.inf
NAN_TABLE = gg.Table(columns={f"alpha{k}": np.array([0.1, NAN]) for k in range(1, 5)})
G3, G4 = (lift(GAITS[k].angles, "red") for k in (2, 3))
NO_NUMBERS: list[Any] = [
    NAN,
    INF,
    -1.0,
    1e300,
    True,
    "fast",
    [],
    1j,
    {},
    (1.0,),
    -(10**400),
]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
FORMS = "Gait, TimedGait, Plan, Table, data frame or (n, 4) array, or the path of a gait file"
LISTED: Any = ["a.csv"]
SMALL: dict[str, Any] = {
    "name": "small",
    "gaits": ["gait1"],
    "attitudes": {"roll": [0.0, 0.3], "pitch": [0.0, 0.2]},
}
TABLE, POINT = table_of(G3.parametrize(samples=4)), lift([(0.3, -0.3)], "red")
MIXED, EXACT_GAIT = (
    lift(GAITS[2].angles, ["red", "blue"] * 2),
    lift(GAITS[3].angles, "red", coefficients=EXACT),
)
ROUNDED = rounded(G3, 0.1)
plan = partial(gg.plan_loop, waypoints=GAITS[2].waypoints, method="grid")
optimal = partial(gg.optimal_gait, waypoints=[(0, 0)])
colorings = partial(gg.colorings, points=[(0.1, 0.2)])
cycles_of = partial(cycles, graph=surface_graph("negative", divisions=8))
least = partial(least_period, path=G3, limits=Limits(rate=6.0, acceleration=60.0))
transition = partial(gg.transition, start="hover", end=G4)
attitudes, curve_of = (
    partial(function, coefficients=EXACT)
    for function in (acceptable_attitudes, singular_curve)
)
within = partial(least_singular_value_within, alpha=[0.1] * 4)
TIMED, HEAVY = G3.parametrize(1.0), gg.Vehicle(drag_ratio=0.17, max_thrust=3.0)
basins = partial(basins_of, TIMED)
lag_of, clock = partial(servo_response, TIMED), lift([(0.1, 0.1)], "red").parametrize


def study(**changes: Any) -> Any:
    return study_from_mapping(SMALL | changes)


def flight(**values: Any) -> Any:
    return settings_from_mapping(values)


# A function, its arguments, and how its refusal begins; … stands for any text.
REFUSED: list[tuple[Any, dict[str, Any], str]] = [
    # gaits
    (
        Gait,
        {"alpha": np.zeros((0, 4))},
        "alpha must have the shape (n, 4) with n at least 1, got (0, 4)",
    ),
    (
        Gait,
        {"alpha": [[0, 0, 0, NAN]]},
        "alpha must be finite angles …, got nan",
    ),
    (
        validate,
        {"gait": NAN_TABLE},
        "row 2: alpha1 must be a finite number, …, got nan",
    ),
    (
        Gait,
        {"alpha": np.zeros((2, 4)), "colors": ("red",)},
        "colors must be one for each of the 2 corners, got 1",
    ),
    (
        Gait,
        {"alpha": np.zeros((1, 4)), "colors": ("green",)},
        "colors must be 'red', …, got …'green'",
    ),
    (
        Gait,
        {"alpha": np.zeros((1, 4)), "colors": (["red"],)},
        "colors must be 'red', …, got ",
    ),
    (
        lift,
        {"points": [], "colors": "red"},
        "points must have the shape (n, 2) with n at least 1",
    ),
    (lift, {"points": [(0.0, 0.0, 0.0)], "colors": "red"}, "points must … got (1, 3)"),
    (lift, {"points": [(2.0, 0.0)], "colors": "red"}, "alpha1 must be …, got 2.0"),
    (lift, {"points": [(0.0, NAN)], "colors": "red"}, "points must be …, got nan"),
    (
        lift,
        {"points": [("x", 0.0)], "colors": "red"},
        "points must be finite numbers in radians, or texts",
    ),
    (
        lift,
        {"points": [(0.0, 0.0)], "colors": ["red", "red"]},
        "…one for all or for each of the 1 points, got ",
    ),
    *(
        (lift, {"points": [(0.0, 0.0)], "colors": wrong}, f"…got {wrong!r}")
        for wrong in ("green", None, "fiber1")
    ),
    *(
        (POINT.biased, {"bias": eta}, "bias must be a number in (0, 1], got")
        for eta in (0.0, -0.5, 1.5, NAN, "x")
    ),
    *(
        (vertices, {"alpha": [[0] * 4], "tolerance": off}, "tolerance must be")
        for off in (-1.0, NAN, INF, "x")
    ),
    *(
        (G3.started_at, {"corner": k}, "corner must be a whole number from 0 to 3")
        for k in (1.5, True, -1, 4, "1")
    ),
    # the surface
    (
        roots,
        {"alpha1": 1.571, "alpha2": 0},
        "alpha1 must be within ±π/2 rad, got 1.571",
    ),
    (
        root_arrays,
        {"alpha1": [0.0, 0.1], "alpha2": [NAN, 0.0]},
        "…must be finite angles",
    ),
    (
        roots,
        {"alpha1": "x", "alpha2": 0.1},
        "alpha1 must be a finite number in radians, ",
    ),
    (
        roots,
        {"alpha1": 0.1, "alpha2": [0.1, 0.2]},
        "alpha2 must be a finite number in radians, ",
    ),
    (
        root_arrays,
        {"alpha1": ["x"], "alpha2": [0.0]},
        "alpha1 must be finite numbers in radians, … got ['x']",
    ),
    *(
        (
            root_arrays,
            {"alpha1": 0.1, "alpha2": 0.2, "crossing_tolerance": wrong},
            "crossing_tolerance must be a fini",
        )
        for wrong in (-1e-3, INF, NAN, True)
    ),
    (
        admissible_region,
        {"accuracy": 1e-10},
        "accuracy must be an angle from 1e-09 to 0.1000 rad, got 1e-10",
    ),
    (
        singular_value_region,
        {"floor": -0.1},
        "floor must be a finite number ≥ 0, got -0.1",
    ),
    (
        thrust_region,
        {"share": 0.0},
        "share must be a positive finite number (of m·g), got 0.0",
    ),
    (sign_region, {"sign": "up"}, "sign must be one of negative, positive, got 'up'"),
    (
        sign_region,
        {"sign": "positive", "color": "green"},
        "color must be one of red, blue, got 'green'",
    ),
    (
        admissible_region,
        {"require": "fun"},
        "require must be one of valid, flyable, got 'fun'",
    ),
    (admissible_region, {"floor": NAN}, "floor must be a finite number ≥ 0, got nan"),
    (
        hover_region().contains,
        {"points": [1.0, 2.0, 3.0]},
        "point must be … got [1.0, 2.0, 3.0]",
    ),
    (hover_region().component_of, {"point": "here"}, "point must be … got 'here'"),
    *(
        (colorings, {"points": no}, "points must have shape (n, 2) or (n, 4), n")
        for no in ([], [[0.1] * 3])
    ),
    (
        colorings,
        {"points": [("a", "b")]},
        "points must be finite numbers in radians, … got [('a', 'b')]",
    ),
    (colorings, {"points": [[0.0, NAN]]}, "…must be finite angles"),
    (
        colorings,
        {"sign": "negativ"},
        "sign must be one of …, got 'negativ'; did you mean 'negative'?",
    ),
    (
        colorings,
        {"crossing_tolerance": -0.1},
        "crossing_tolerance must be a finite number ≥ 0 (rad), got -0.1",
    ),
    *(
        (Zones, {name: [SQUARE, corners, SQUARE]}, f"{name} polygon 2…{message}")
        for name in ("keep_out", "keep_in")
        for corners, message in (
            ("square", "must be a list of corners [alpha1, alpha2], got 'square'"),
            (
                [(0, 0), (1, 0), (0.5,)],
                "must be a list of corners [alpha1, alpha2], got [(0, 0), (1, 0), (0.5,)]",
            ),
            (
                [(0, 0), (1, 0), (0, 0), (1, 0)],
                "must have three or more corners that are not on a line",
            ),
            (
                [(0, 0), (1e-7, 0), (0, 1e-7)],
                "must have three or more corners that are not on a line",
            ),
            ([(0, 0), (1, 0), (0, "x")], "alpha2 must be a finite number in radians"),
            (
                [(0, 0), (1, 0), (1e7, 1)],
                "alpha1 must be within ±π rad, got 10000000.0",
            ),
            (
                [(0, 0), (1, 1), (1, 0), (0, 1)],
                "must not cross or touch itself, got ",
            ),  # a bow tie
            (
                [(0, 0), (1, 1), (2, 0), (2, 2), (1, 1), (0, 2)],
                "must not cross or touch itself, got ",
            ),  # two that touch
        )
    ),
    (
        Zones,
        {"keep_in": "square"},
        "keep_in must be a list of polygons, each a list of …, got 'square'",
    ),
    # graphs
    *(
        (
            surface_graph,
            {"divisions": wrong},
            "divisions must be a whole number from 2 to 256, got ",
        )
        for wrong in (0, 1, -3, 1.5, "16", True, 100000)
    ),
    *(
        (surface_graph, {"waypoints": [wrong]}, "waypoint 1 …must be")
        for wrong in ((NAN, 0.0), (2.0, 0), (0, 0, 0))
    ),
    *(
        (surface_graph, {"floor": wrong}, "floor must be a finite number ≥ 0, got ")
        for wrong in (NAN, -1.0, "x")
    ),
    *(
        (cycles_of, {"max_length": wrong}, f"max_length must be … got {wrong}")
        for wrong in (-1, NAN, INF, True)
    ),
    (
        cycles_of,
        {"require": "fly"},
        "require must be one of flyable, valid, two_color, got 'fly'",
    ),
    # plans
    (plan, {"waypoints": []}, "waypoints must be …, got []"),
    (plan, {"waypoints": ()}, "waypoints must be …, got none"),
    (plan, {"waypoints": "0,0"}, "waypoints must be … got '0,0'"),
    (plan, {"keep_out": 5}, "keep_out must be a list of polygons, … got 5"),
    (plan, {"vehicle": None}, "vehicle must be … got None"),
    (plan, {"color": np.array(["red"])}, "color must be … got ['red']"),
    (plan, {"waypoints": [(0, 0, 0)]}, "waypoint 1 must be [alpha1, alpha2], got "),
    (
        plan,
        {"waypoints": [(0, 0), ("x", 0)]},
        "waypoint 2 alpha1 must be a finite number …, got 'x'",
    ),
    (
        plan,
        {"waypoints": [("100deg", 0)]},
        "waypoint 1 alpha1 must be within ±π/2 rad, got '100deg'",
    ),
    (
        partial(POINT.parametrize().write, LISTED),
        {},
        "output must be the path of a file, got ['a.csv']",
    ),
    # degrees without a unit
    (
        plan,
        {"waypoints": [(0, 30)]},
        "waypoint 1 alpha2 must be within ±π/2 rad, got 30; for degrees write '30deg'",
    ),
    (
        plan,
        {"waypoints": [("−30", 0)]},
        "waypoint 1 alpha1 must be …, got '−30'; for degrees write '−30deg'",
    ),
    (
        plan,
        {"keep_out": [[(30, -60), (40, -60), (40, -50)]]},
        "keep_out polygon 1 alpha1 …±π rad, got 30; for degrees",
    ),
    (
        plan,
        {"keep_in": [[(2, 2), (3, 2), (3, 3)]]},
        "keep_in polygon 1 must overlap the square of ±π/2 rad, got [(2",
    ),
    (
        plan,
        {"keep_out": [np.array([[2.5, 0], [30, 0], [30, 1]])]},
        "keep_out polygon 1 alpha1 …±π rad, got 30.0; for degrees",
    ),
    (
        plan,
        {"keep_in": [[np.array([2, 2.5]), np.array([3, 2]), (3, np.float64(2.75))]]},
        "keep_in polygon 1 must overlap …, got [[2.0, 2.5], [3, 2], (3, 2.75)]",
    ),
    (
        optimal,
        {"radius": 10},
        "radius must be an angle from 0 to π/2 rad, got 10; for degrees write '10deg'",
    ),
    (
        gg.retarget,
        {"source": [[0.0] * 4], "margin": 5.0},
        "margin must be …, got 5.0; for degrees write '5deg'",
    ),
    (
        validate,
        {"gait": POINT, "angle_rounding": 5},
        "angle_rounding must be …, got 5; for degrees write '5deg'",
    ),
    *(
        (gg.Vehicle, {"drag_to_thrust": 0.05, **more}, message)
        for more, message in (
            (
                {"arm_length": 0.25, "drag_ratio": 0.21},
                "drag_ratio must equal Km/(Kf·L) = 0.2 … got 0.21",
            ),
            (
                {"drag_coefficient": 4e-7, "thrust_coefficient": 5e-6},
                "drag_to_thrust must equal Km/Kf = 0.08 of … got 0.05",
            ),
            (
                {"drag_ratio": 0.99e-9},
                "drag_ratio must be between 1e-9 and 1e9 (dimensionless), got 9.9e-10",
            ),
            ({"drag_ratio": 1.01e9}, "drag_ratio must be between 1e-9 and 1e9"),
        )
    ),
    (
        coefficients_of,
        {"vehicle": "beetle_omni", "kind": "published"},
        "coefficients must be 'exact' …0.0599…0.168666",
    ),
    (
        coefficients_of,
        {"kind": "rounded"},
        "coefficients must be one of published, printed, exact, got 'rounded'",
    ),
    (
        lift([(0.9, -0.9)], "red", vehicle=HEAVY).check,
        {},
        "…no mass … which the check of the largest thrust needs",
    ),
    *(
        (
            types_from_text,
            {"label": label},
            f"types must be one of {', '.join(PLANE_TYPES)}, got ",
        )
        for label in (
            "(+,-)",
            "(-,+)",
            "(+,−)",
            "",
            "+,+",
            "(+)",
            "(+,+",
            "(+,+,+)",
            "(1,1)",
            "[+,+]",
            "(*,*)",
        )
    ),
    *(
        (types_from_text, {"label": label}, "types must be")
        for label in ("(*,+)", "(-,*)", 3, None, ("+", "+"))
    ),
    (
        gg.Vehicle,
        {"drag_ratio": 0.1, "max_tilt": 60},
        "max_tilt must be …, got 60.0; for degrees write '60deg'",
    ),
    (
        gg.Vehicle,
        {"drag_ratio": 0.1, "first_arm_angle": 45},
        "first_arm_angle must be …; for degrees write '45deg'",
    ),
    (within, {"tilt": 30}, "tilt must be …, got 30; for degrees write '30deg'"),
    (plan, {"waypoints": [(0, 0)] * 1001}, "waypoints must be at most 1000, got 1001"),
    (
        plan,
        {"color": "rad"},
        "color must be one of auto, red, blue, got 'rad'; did you mean 'red'",
    ),
    (plan, {"sign": 1}, "sign must be … got 1"),
    (plan, {"require": "fly"}, "require must be one of flyable, valid, got 'fly'"),
    (plan, {"law": "x"}, "law must be … got 'x'"),
    (plan, {"floor": NAN}, "floor must be a finite number ≥ 0, got nan"),
    (plan, {"reverse": 1}, "reverse must be true or false, got 1"),
    (transition, {"start": None}, "start must be a Gait, … got None"),
    (
        transition,
        {"vehicle": gg.PAPER},
        "vehicle must be None beside a gait, which has its own",
    ),
    (
        transition,
        {"end": "hover", "coefficients": "rough"},
        "coefficients must be one of published, printed, exact, got 'r",
    ),
    (
        transition,
        {"rate": 10, "samples": 10},
        "samples and rate must not both be given, got 10 and 10",
    ),
    (
        transition,
        {"samples": 5_000_001},
        "samples must give at most 5000000 samples, got 5000001",
    ),
    (
        transition,
        {"start": G3, "end": EXACT_GAIT},
        "end must be a gait for 'paper' (published coefficients), as the s",
    ),
    (
        transition,
        {"end": G3, "law": "fast"},
        "law must be one of smooth, constant-speed, equal-time, got 'fast'",
    ),
    (
        transition,
        {"end": G3, "floor": -0.1},
        "floor must be a finite number ≥ 0, got -0.1",
    ),
    *(
        (
            transition,
            {"duration": wrong},
            "duration must be between 1e-6 and 5e8 s, got ",
        )
        for wrong in (0, 0.99e-6, 5.01e8, NAN, "1", True)
    ),
    # optimization
    (optimal, {"waypoints": [(0, 0)] * 41}, "waypoints must be at most 40, got 41"),
    (
        optimal,
        {"radius": 6.3},
        "radius must be an angle from 0 to π/2 rad, got 6.3; for degrees write '6.3deg'",
    ),
    (
        optimal,
        {"radius": [0.1, 0.2]},
        "radius must be one for all waypoints or one for each of 1, got 2",
    ),
    (
        optimal,
        {"objective": "tilt_rate"},
        "objective must be one of singular_value, hover_reserve, servo_margin, got 'tilt_rate'",
    ),
    (
        optimal,
        {"sign": "both"},
        "sign must be one of auto, positive, negative, got 'both'",
    ),
    (optimal, {"floor": -1}, "floor must be a finite number ≥ 0, got -1"),
    (optimal, {"pieces": 7}, "pieces must be a whole number from 8 to 400, got 7"),
    (optimal, {"concession": 0}, "concession must be above 0 and at most 0.5, got 0"),
    (
        gg.retarget,
        {"source": [[0, 0, 0]]},
        "gait must be a Gait, … (n, 4) array, … got [[0, 0, 0]]",
    ),
    (
        gg.retarget,
        {"source": [[0, 0, 0, INF]]},
        "row 1: alpha4 must be a finite number, … got inf",
    ),
    (
        gg.retarget,
        {"source": np.zeros((MOST_ROWS + 1, 4))},
        "gait must have at most 200000 rows, got 200001",
    ),
    (
        gg.retarget,
        {"source": [[0, 0, 0, 0]], "margin": -1},
        "margin must be an angle from 0 to π/2 rad, got -1",
    ),
    (
        gg.retarget,
        {"source": [[0, 0, 0, 0]], "sign": "both"},
        "sign must be one of negative, positive, got 'both'",
    ),
    (gg.retarget, {"source": "no.csv"}, "gait file 'no.csv' cannot be read: "),
    # timing
    *(
        (clock, {"period": wrong}, f"period must be … got {wrong!r}")
        for wrong in (0.0, 0.999e-6, 1.001e9, NAN, "1")
    ),
    *(
        (clock, {"samples": wrong}, f"samples must be … got {wrong}")
        for wrong in (0, True, 10_000_001)
    ),
    *(
        (clock, {"rate": wrong}, f"rate must … got {wrong} Hz")
        for wrong in (-1.0, 10_000_001.0)
    ),
    (clock, {"rate": 1.0, "samples": 4}, "samples and rate must not both"),
    (clock, {"law": "smoth"}, "law must be … got 'smoth'…; did you mean 'smooth'"),
    (ROUNDED.curve.check, {"floor": -1.0}, "floor must be … got -1.0"),
    *(
        (rounded, {"gait": G3, "tolerance": size}, "tolerance must be")
        for size in (0.0, 0.9e-5, NAN, "big")
    ),
    *(
        (rounded, {"gait": wrong, "tolerance": 0.01}, "…color")
        for wrong in (G3.biased(0.8), MIXED)
    ),
    (Limits, {"rate": 1.0}, "limits must have an acceleration or a jerk, got neither"),
    *(
        (Limits, {"acceleration": bad}, f"acceleration must be … got {bad}")
        for bad in (-1.0, NAN, [1, 2])
    ),
    (least, {"path": 3}, "gait must be … got 3"),
    (
        least,
        {"path": ROUNDED.curve, "rounding": 0.1},
        "rounding must be None … got 0.1",
    ),
    (least, {"nodes": 5}, "nodes must be … got 5"),
    (least, {"limits": {"rate": 5}}, "limits must be … got {'rate': 5}"),
    (least, {"samples": 3, "rate": 5.0}, "samples and rate must not both"),
    (least, {"path": G3.biased(0.8)}, "…color"),
    (least, {"rounding": -1.0}, "tolerance must be … got -1.0"),
    (
        paced,
        {"path": G3, "limits": Limits(acceleration=60.0), "period": 0.0},
        "period must be … got 0.0",
    ),
    *(
        (lag_of, {"lag": lag}, "lag must be a positive")
        for lag in (0.0, -1.0, NAN, "slow", [0.1, 0.2], True)
    ),
    *(
        (
            lag_of,
            {"lag": lag},
            "lag must be from 0.00012… to 1e+06 s for the period 1 s",
        )
        for lag in (1e300, [0.1, 0.1, 2e6, 0.1], 3e-5)
    ),
    # flights and studies
    *(
        (flight, {name: wrong}, name)
        for name in FlightSettings().as_mapping().keys()
        - {"reference", "arms", "saturation", "seed", "wind"}
        for wrong in NO_NUMBERS
    ),
    (
        flight,
        {"atitude_noise": 0.1},
        "flight has no field 'atitude_noise'; did you mean 'attitude_noise'",
    ),
    (
        flight,
        {"tolerance": 10.1},
        "tolerance must be between 1e-09 and 10 (rad and m), got 10.1",
    ),
    (flight, {"gust": 100.01}, "gust must be between 0 and 100"),
    (
        flight,
        {"reference": "hoover"},
        "reference must be one of attitude, hover, step, line, circle, got 'hoover'; di",
    ),
    (flight, {"saturation": 1}, "saturation must be true or false, got 1"),
    (
        flight,
        {"seed": -1},
        "seed must be a whole number from 0 to 18446744073709551615, got -1",
    ),
    *(
        (flight, {"wind": wrong}, "wind must be two or three numbers")
        for wrong in ("12", (1, NAN))
    ),
    (flight, {"wind": (1, 2, 100.1)}, "wind …from -100 to 100"),
    (
        flight,
        {"control_rate": 300.0},
        "control_rate must be 1000 Hz divided by a whole number, for steps of 0.001 s, ",
    ),
    *(
        (
            FlightSettings,
            {f"{loop}_damping": damping, "control_rate": rate},
            f"{loop}_damping must be between {lowest}",
        )
        for loop in ("attitude", "altitude")
        for damping, rate, lowest in (
            (2100.0, 1000, "0.05125 and 1949.95 1/s to be"),
            (1e-3, 100, 0.5125),
            (0.6, 50, 1.025),
        )
    ),
    *(
        (
            FlightSettings,
            {f"{loop}_stiffness": 1.95e6, f"{loop}_damping": 999.0},
            f"{loop}_stiffness must be less than 1.95",
        )
        for loop in ("attitude", "altitude")
    ),
    *(
        (Engine, {"vehicle": gg.PAPER.replace(**changes)}, message)
        for changes, message in (
            (
                {"inertia": (1.0, 1.0, 3.0)},
                "…must be three positive moments … is not that of a rigid body",
            ),
            (
                {"arm_inertia": 1e-3},
                "…without 0.004 of each for four arms is not that of a rigid body",
            ),
            (
                {"inertia": (1e-10, 1e-10, 1e-10)},
                "mass, inertia and arm length must be in the range of the …mjMINVAL",
            ),
            (
                {"mass": 1e-18},
                "mass, inertia and arm length must be in the range of the physics engine, got those",
            ),
        )
    ),
    (fly, {"gait": 3}, "gait must be a Gait"),
    *(
        (fly, {"gait": TIMED, "attitude": at}, "attitude must be a roll")
        for at in ((0.1,), (4.0, 0.0), (0.0, 1.6))
    ),
    (
        from_hover,
        {"gait": G4.parametrize(), "periods": 0},
        "periods must be a whole number from 1 to 10000, got 0",
    ),
    (
        basins,
        {"resolution": 2.5},
        "resolution must be a whole number from 1 to 100000, got 2.5",
    ),
    (
        basins,
        {"resolution": 317},
        "resolution must make at most 100000 flights, got 301467",
    ),
    (basins, {"begins": 0}, "begins must be a whole number from 1 to 100000, got 0"),
    (
        basins,
        {"extent": "90deg"},
        "extent must be an angle above 0 and below pi/2, got '90deg'",
    ),
    (
        basins,
        {"settings": FlightSettings(duration=0.99)},
        "duration must be at least the gait's period, 1 s, got 0.99",
    ),
    (
        basins,
        {"settings": FlightSettings(reference="hover")},
        "reference must be attitude for a basin, got 'hover'",
    ),
    (
        basins,
        {"bias": [0.0]},
        "bias must be a number in (0, 1], got 0.0",
    ),
    (
        basins,
        {"bias": [0.8, 1.0, 0.8]},
        "bias must be different numbers in (0, 1], got [0.8, 1.0, 0.8]",
    ),
    (
        study,
        {"gait": ["gait3"]},
        "the study has no field 'gait'; did you mean 'gaits'?",
    ),
    (
        study,
        {"gaits": ["gait5"]},
        "gait 1: gait file must have one of the suffixes …, got 'gait5'",
    ),
    (
        study,
        {"gaits": [{"waypoints": [[0, 0]], "period": 2.0}]},
        "gait 1: it has no field 'period'; the fields are na",
    ),
    (
        study,
        {"gaits": [{"file": 3}]},
        "gait 1: gait file must have one of the suffixes …, got '3'",
    ),
    (
        study,
        {"vehicles": ["paper", "paper"]},
        "names of vehicles must be different values, one at least, got ['",
    ),
    (
        study,
        {"vehicles": [{"preset": "paper", "mass": {"to": 1}}]},
        "vehicle 1: mass must be a list, or a table with ",
    ),
    (study, {"biases": [0.8, 1.2]}, "biases must be a number in (0, 1], got 1.2"),
    (study, {"periods": 9e-7}, "periods must be between 1e-6 and 1e6 s, got 9e-07"),
    (
        study,
        {"periods": {"from": 2, "to": 2, "count": 2}},
        "periods must be a list, or a table with from below to",
    ),
    (
        study,
        {"periods": {"from": 1, "to": 2, "count": 1}},
        "periods.count must be a whole number from 2 to 1000000, g",
    ),
    (study, {"attitudes": {"roll": 3.15}}, "roll must be within ±π rad, got 3.15"),
    (study, {"attitudes": {"pitch": 1.6}}, "pitch must be within ±π/2 rad, got 1.6"),
    (
        study,
        {"flight": {"durations": 1}},
        "flight has no field 'durations'; did you mean 'duration'?",
    ),
    (
        study,
        {"sample": {"seed": 3}},
        "sample.kind must be grid, or random with a count and a seed, got {'seed': 3}",
    ),
    (
        study,
        {"sample": {"count": 2, "seed": -1}},
        "sample.seed must be a whole number from 0 to 184467440737095516",
    ),
    (
        study,
        {"anyway": "yes"},
        "anyway must be true or false, got 'yes'",
    ),
    (
        study,
        {
            "periods": {"from": 1, "to": 2, "count": 90000},
            "biases": {"from": 0.1, "to": 1, "count": 100},
        },
        "study 'small' must have at most 1000000 cases, got 36000000",
    ),
    # files
    (
        write_tables,
        {"table": TABLE, "paths": ["a.mcap"], "periods": 0},
        "periods must be a whole number from 1 to 100000, got 0",
    ),
    # validation and robustness
    (
        validate,
        {"gait": TABLE, "tolerance": -1},
        "tolerance must be a finite number ≥ 0, got -1",
    ),
    (
        validate,
        {"gait": G3, "floor": NAN},
        "floor must be a finite number ≥ 0, got nan",
    ),
    (
        validate,
        {"gait": G3, "angle_rounding": INF},
        "angle_rounding must be a finite number in radians, … got inf",
    ),
    (
        validate,
        {"gait": TABLE, "crossing_tolerance": "x"},
        "crossing_tolerance must be … got 'x'",
    ),
    (
        validate,
        {"gait": TABLE, "coefficients": "rough"},
        "coefficients must be one of published, printed, exact, got 'rough'",
    ),
    (validate, {"gait": 3}, f"gait must be a {FORMS}, got 3"),
    (
        gg.export,
        {"source": G3, "outputs": np.array(3.0)},
        "output must be the path of a file, got 3.0",
    ),
    (validate, {"gait": G3, "vehicle": gg.PAPER}, "vehicle must be None beside a gait"),
    *(
        (robustness_of, {"gait": POINT, name: value}, message)
        for name, wrong, message in (
            (
                "bias",
                (0, 1.5, NAN, [0.8, None]),
                "bias must be a number in (0, 1], got ",
            ),
            ("scale", (0, 1.0001), "scale must be a number in (0, 1], got "),
            (
                "tilt",
                (math.pi / 2, -0.1, NAN),
                "tilt must be at least 0 and less than π/2 rad, got ",
            ),
            ("tolerance", (0, INF), "tolerance must be a finite number above 0, got "),
            ("angle_rounding", (-1, INF), "angle_rounding must be … got "),
            (
                "curves",
                (-1, 10_001, 1.5),
                "curves must be a whole number from 0 to 10000, got ",
            ),
            (
                "coefficients",
                ("rough",),
                "coefficients must be one of published, printed, exact, got 'rough'",
            ),
        )
        for value in wrong
    ),
    (robustness_of, {"gait": [[0, 0, 0, 0, 0]]}, "gait must be a Gait"),
    (robustness_of, {"gait": "none.csv"}, "gait file …No such file"),
    (
        attitudes,
        {"alpha": [[0, 0, 0, 0], [0, INF, 0, 0]]},
        "alpha must be ",
    ),
    (attitudes, {"alpha": np.zeros((0, 4))}, "alpha must be "),
    (attitudes, {"alpha": [[0.0] * 3]}, "alpha must be "),
    *(
        (curve_of, {"alpha": wrong}, "alpha must be ")
        for wrong in ([NAN, 0, 0, 0], [0, 0, 0])
    ),
    *(
        (within, {"tilt": tilt}, "tilt must be at least 0 and less than π/2 rad, got ")
        for tilt in (-0.1, math.pi / 2, NAN, "95deg", True, np.array([0.1, 0.2]))
    ),
]


@pytest.mark.parametrize(
    ("function", "arguments", "message"), REFUSED, ids=range(len(REFUSED))
)
def test_bad_input_is_named_in_one_line(
    function: Any, arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises((FileProblem, InputError)) as caught:
        function(**arguments)
    assert re.match(".*".join(map(re.escape, message.split("…"))), str(caught.value))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "changed",
    [
        {"period": -1.0},
        {"period": math.nan},
        {"period": math.inf},
        {"law": "nonsense"},
        {"samples": 0},
        {"samples": 10**8},
        {"gait": "gait4"},
        {"gait": None},
    ],
)
def test_a_timed_gait_checks_its_gait_and_its_clock(changed: dict[str, Any]) -> None:
    gait = gg.lift([(0.4, -0.4), (0.8, -0.4), (0.8, -0.8)], "red")
    asked: dict[str, Any] = {"gait": gait, "period": 1.0, "law": "smooth", "samples": 4}
    with pytest.raises(InputError, match=f"^{next(iter(changed))} must be ") as caught:
        gg.TimedGait(**asked | changed)
    assert caught.value.field == next(iter(changed))


def test_a_linkage_holds_finite_angles() -> None:
    with pytest.raises(InputError, match="^linkage must be finite angles"):
        gg.Vehicle(drag_ratio=0.17, linkage=[[0, 0], [1, math.nan]])


ANGLES = [0.1, 0.2, 0.3, 0.4]
GEOMETRY = gg.invertibility.Geometry.of_vehicle(gg.PAPER)
NO_ANGLES: list[Any] = [NAN, -INF, 1e300, 10**400, "a", None, 1j, [0.1]]
TAKES_ALPHA: list[Any] = [
    gg.gait.vertices,
    gg.gait_of,
    gg.invertibility.control_force_matrix,
    gg.invertibility.control_moment_matrix,
    gg.invertibility.decoupling_matrix,
    gg.invertibility.hover_thrust_shares,
    gg.invertibility.least_singular_value,
    gg.invertibility.zero_moment_direction,
    gg.plots.vehicle_view,
    gg.robustness_of,
    gg.timing.servo_response,
    gg.validate,
    GEOMETRY.force_matrix,
    GEOMETRY.hover_thrusts,
    GEOMETRY.least_singular_value,
    within,
    *(
        partial(function, coefficients=EXACT)
        for function in (
            gg.invertibility.attitude_sensitivities,
            gg.invertibility.determinant,
            gg.invertibility.level_determinant,
            gg.invertibility.nearest_singular_attitude,
            gg.invertibility.pitch_sensitivity,
            gg.invertibility.roll_sensitivity,
            gg.invertibility.tilt_margin,
            gg.surface.sheet_distances,
            acceptable_attitudes,
        )
    ),
]


@pytest.mark.parametrize("function", TAKES_ALPHA)
def test_functions_of_tilt_angles_take_finite_angles(function: Any) -> None:
    keywords = getattr(function, "keywords", {})
    call = getattr(function, "func", function)
    keywords = {name: keywords[name] for name in keywords if name != "alpha"}
    if "tilt" in call.__code__.co_varnames[: call.__code__.co_argcount]:
        keywords["tilt"] = 0.3
    for wrong in NO_ANGLES:
        with pytest.raises(InputError) as caught:
            call([ANGLES, [0.1, wrong, 0.3, 0.4]], **keywords)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("function", "name"),
    [
        (partial(gg.invertibility.determinant, ANGLES, EXACT), "roll"),
        (partial(gg.invertibility.determinant, ANGLES, EXACT), "pitch"),
        (partial(gg.invertibility.decoupling_matrix, ANGLES), "roll"),
        (partial(gg.invertibility.decoupling_matrix, ANGLES), "pitch"),
        (partial(gg.invertibility.least_singular_value, ANGLES), "roll"),
        (partial(gg.invertibility.least_singular_value, ANGLES), "pitch"),
        (
            partial(gg.surface.sheet_angles, "red", alpha2=0.1, coefficients=EXACT),
            "alpha1",
        ),
        (partial(gg.surface.sheet_angles, "blue", 0.1, coefficients=EXACT), "alpha2"),
        (partial(gg.surface.red_label, alpha2=0.1), "alpha1"),
        (partial(gg.surface.red_label, 0.1), "alpha2"),
        (partial(gg.surface.root_arrays, alpha2=0.1), "alpha1"),
        (partial(gg.surface.root_arrays, 0.1), "alpha2"),
        (gg.angles.text_from_angle, "angle"),
        (gg.angles.wrapped, "angle"),
        (partial(gg.angles.distance_to_multiple, period=math.pi), "angle"),
        (partial(GEOMETRY.least_singular_value_along, ends=[ANGLES]), "starts"),
        (partial(GEOMETRY.least_hover_thrust_along, starts=[ANGLES]), "ends"),
        (partial(least_singular_value_along, starts=[ANGLES]), "ends"),
        (partial(gg.plots.vehicle_view, ANGLES), "view"),
        (partial(optimal, waypoints=[(0, 0), (1, 0)]), "radius"),
        (partial(servo_response, TIMED), "lag"),
        (partial(Limits, acceleration=60.0), "rate"),
    ],
)
@pytest.mark.parametrize("wrong", [NAN, INF, "a", [0.1, [0.2]], [NAN, 0.1], {}])
def test_other_angles_are_finite_too(function: Any, name: str, wrong: Any) -> None:
    with pytest.raises(InputError, match=f"^{name} must be ") as caught:
        function(**{name: wrong})
    assert caught.value.field == name


@pytest.mark.parametrize("wrong", [NAN, -1e-9, "a", [0.1], None])
def test_errors_of_angles_are_angles(wrong: Any) -> None:
    for function, name in (
        (partial(gg.invertibility.tilt_margin, ANGLES, EXACT), "angle_rounding"),
        (partial(acceptable_attitudes, [ANGLES], EXACT), "angle_rounding"),
        (partial(singular_curve, ANGLES, EXACT), "angle_rounding"),
        (partial(Gait, alpha=[ANGLES]), "crossing_tolerance"),
    ):
        with pytest.raises(InputError, match=f"^{name} must be ") as caught:
            function(**{name: wrong})
        assert caught.value.field == name


def test_an_error_names_its_file_once() -> None:
    with (
        pytest.raises(InputError) as caught,
        naming_file("a.toml", "request file"),
        naming_file("a.toml"),
    ):
        raise InputError("gait files must be shorter", field="gait")
    assert str(caught.value) == "gait file 'a.toml': gait files must be shorter"
    assert (caught.value.path, caught.value.field) == ("a.toml", "gait")


def test_texts_are_angles_in_every_function() -> None:
    texts = [["pi/8", "0.1", "22.5deg", 0.1]]
    numbers = [[math.pi / 8, 0.1, math.pi / 8, 0.1]]
    functions: list[Any] = [
        gg.invertibility.hover_thrust_shares,
        gg.invertibility.decoupling_matrix,
        partial(gg.surface.sheet_distances, coefficients=EXACT),
    ]
    for function in functions:
        np.testing.assert_allclose(function(texts), function(numbers), atol=1e-15)
    np.testing.assert_array_equal(gg.surface.red_label("pi/8", 0.1), [1, 1, 1])


@pytest.mark.parametrize("points", [np.zeros((0, 4)), [], [[0.1, 0.2]]])
def test_there_is_no_least_value_along_no_segments(points: Any) -> None:
    for function in (
        least_singular_value_along,
        GEOMETRY.least_singular_value_along,
        GEOMETRY.least_hover_thrust_along,
    ):
        with pytest.raises(InputError, match=r"^starts must have the shape \(m, 4\)"):
            function(points, points)
    with pytest.raises(InputError, match="^ends must be as many as starts, 2, got 1"):
        least_singular_value_along([ANGLES] * 2, [ANGLES])


@pytest.mark.parametrize("points", [np.array(0.3), np.array(None, dtype=object)])
def test_an_array_without_dimensions_is_no_list(points: Any) -> None:
    functions: list[tuple[Any, str]] = [
        (gg.plan_loop, "waypoints"),
        (optimal, "waypoints"),
        (partial(gg.plan_loop, [(0, 0)]), "keep_out"),
        (partial(fly, TIMED), "attitude"),
    ]
    for function, name in functions:
        with pytest.raises(InputError, match=f"^{name} must be "):
            function(**{name: points})


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"alpha1": [], "alpha2": [], "alpha3": [], "alpha4": []},
            "it must have at least one row",
        ),
        ({"alpha1": [0.1]}, "columns must have equally many rows"),
        ({"t": 0.1}, "columns must have equally many rows"),
        ({"alpha1": [0.1, None]}, "row 2: alpha1 must be a finite number"),
        ({"alpha1": ["a", 0.1]}, "row 1: alpha1 must be a finite number"),
        ({"alpha1": [[0.1], [0.1]]}, "row 1: alpha1 must be a finite number"),
        ({"t": [0.0, 0.0]}, "row 2: t must be at least"),
        ({"t": ["a", "b"]}, "row 1: t must be a finite number"),
        ({"color": ["red", "green"]}, "row 2: color must be one of"),
        ({"color": ["red"]}, "columns must have equally many rows"),
        ({"types": ["red", "green"]}, "row 1: types must be"),
    ],
)
def test_a_table_made_by_hand_obeys_the_rules_of_a_file(
    changed: dict[str, Any], message: str
) -> None:
    columns = {f"alpha{k}": [0.1, 0.2] for k in range(1, 5)}
    table = gg.Table(columns=columns | changed)
    for function in (gg.validate, gg.gait_of, gg.timing.timed_gait_of, gg.Table.plot):
        with pytest.raises(InputError, match=f"^{re.escape(message)}"):
            function(table)


def test_lists_are_columns_too() -> None:
    columns = {f"alpha{k}": [0.1, 0.2, 0.1] for k in range(1, 5)} | {"t": [0, 1, 2]}
    arrays = {name: np.array(values, dtype=float) for name, values in columns.items()}
    assert str(gg.validate(gg.Table(columns=columns))) == str(
        gg.validate(gg.Table(columns=arrays))
    )


def test_a_table_without_columns_has_no_rows_and_no_picture() -> None:
    table = gg.Table(columns={})
    assert len(table) == 0
    assert "<img" not in table._repr_html_()


def test_validate_refuses_a_table_without_rows() -> None:
    with pytest.raises(InputError, match="must be"):
        gg.validate(np.empty((0, 4)))


def test_masked_values_are_called_so_in_messages() -> None:
    masked = np.ma.masked_array([0.1, 0.2], mask=[True, False])
    for value in (masked[0], np.ma.masked_array(0.1, mask=True)):
        with pytest.raises(InputError, match="got masked$"):
            angle_from_text(value)


def test_long_doubles_are_plain_numbers_in_messages() -> None:
    function: Any = optimal
    with pytest.raises(InputError, match=r"^radius must be .* got \[\[2\.5\]\]$"):
        function(radius=[np.array([[2.5]], dtype=np.longdouble)])


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"period": 0}, "period"),
        ({"law": "x"}, "law"),
        ({"vehicle": "none"}, "vehicle"),
        ({"color": 1}, "color"),
        ({"require": "x"}, "require"),
        ({"floor": NAN}, "floor"),
        ({"accuracy": 0}, "accuracy"),
        ({"reverse": 1}, "reverse"),
        ({"waypoints": [(0, 30)]}, "waypoints"),
        ({"keep_out": [[(30, 1), (2, 2), (1, 3)]]}, "keep_out"),
        ({"keep_in": 1}, "keep_in"),
    ],
)
def test_an_error_about_a_field_of_a_request_has_its_name(
    changed: dict[str, Any], field: str
) -> None:
    with pytest.raises(InputError) as caught:
        gg.plan_loop(**{"waypoints": [(0.4, -0.4)]} | changed)
    assert caught.value.field == field
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.field, str(again)) == (field, str(caught.value))


def test_the_name_of_a_preset_is_a_vehicle_wherever_one_is_taken() -> None:
    padova, angles = gg.vehicle_named("padova"), [0.3, -0.2, 0.1, 0.4]
    for name in ("decoupling_matrix", "least_singular_value", "hover_thrust_shares"):
        function = getattr(gg.invertibility, name)
        assert (function(angles, "padova") == function(angles, padova)).all()
    with pytest.raises(InputError, match="padova"):
        gg.invertibility.decoupling_matrix(angles, "padua")
    assert gg.plots.type_map(vehicle="padova", coefficients="exact").texts


ROWS = np.array([[0.4, -0.4], [0.8, -0.4], [0.8, -0.8]])
MASKED = np.ma.array(ROWS, mask=[[False, False], [False, True], [False, False]])
MASKED_ROWS = np.ma.hstack([MASKED, MASKED])
HIDDEN = MASKED[:, 1]
SERVOS = gg.io.servo_map_from_mapping({"preset": "x_frame"})


@pytest.mark.parametrize(
    "given",
    [
        lambda: gg.lift(MASKED, "red"),
        lambda: gg.lift(list(MASKED), "red"),
        lambda: gg.colorings(MASKED),
        lambda: gg.Gait(alpha=MASKED_ROWS),
        lambda: gg.validate(MASKED_ROWS),
        lambda: gg.validate([list(row) for row in MASKED_ROWS]),
        lambda: gg.gait_of(tuple(MASKED_ROWS)),
        lambda: gg.gait_of({"alpha1": ROWS[:, 0], "alpha2": HIDDEN, "color": "red"}),
        lambda: gg.gait_of(
            {"alpha1": ROWS[:, 0], "alpha2": list(HIDDEN), "color": "red"}
        ),
        lambda: gg.gait_of(
            {
                "alpha1": ROWS[:, 0],
                "alpha2": ROWS[:, 1],
                "color": np.ma.array(["red"] * 3, mask=HIDDEN.mask),
            }
        ),
        lambda: gg.validation.validate_geometry(
            MASKED_ROWS, gg.invertibility.Geometry.of_vehicle("paper")
        ),
        lambda: gg.invertibility.least_singular_value(MASKED_ROWS),
        lambda: gg.invertibility.least_singular_value([0, 0, 0, 0], pitch=HIDDEN),
        lambda: gg.invertibility.decoupling_matrix([0, 0, 0, 0], roll=HIDDEN),
        lambda: gg.surface.sheet_angles("blue", HIDDEN, 0.1),
        lambda: gg.surface.root_arrays(0.1, HIDDEN),
        lambda: gg.surface.sheet_distances(MASKED_ROWS),
        lambda: gg.surface.red_label(HIDDEN, 0.1),
        lambda: gg.admissible_region().contains(MASKED),
        lambda: gg.lift(ROWS, "red").parametrize().at(HIDDEN),
        lambda: gg.io.tilts_from_joints(
            {joint.column: HIDDEN for joint in SERVOS.joints}, SERVOS
        ),
    ],
)
def test_masked_values_are_refused_with_their_row(given: Any) -> None:
    with pytest.raises(InputError, match="no masked values, got one in row 2"):
        given()


@pytest.mark.parametrize("masked", [np.ma.masked, np.ma.array(0.4, mask=True)])
def test_a_masked_number_is_none(masked: Any) -> None:
    for point in ([masked, -0.4], [0.4, masked]):
        for given in (
            lambda point=point: gg.plan_loop([(0.8, -0.8), point]),
            lambda point=point: Zones(keep_out=[[(0, 0), (1, 0), point]]),
            lambda point=point: gg.roots(*point),
        ):
            with pytest.raises(InputError, match="alpha. must be .*, got masked"):
                given()
    for wrong in (
        lambda: gg.PAPER.replace(mass=masked),
        lambda: G3.parametrize(masked),
        lambda: G3.parametrize(samples=masked),
        lambda: gg.validate(G3, floor=masked),
    ):
        with pytest.raises(InputError, match="must be .*, got masked"):
            wrong()


def test_a_mask_that_hides_nothing_is_no_mask() -> None:
    rows = np.ma.array(np.hstack([ROWS, ROWS]), mask=False)
    plain = gg.validate(rows.data)
    assert gg.validate(rows).checks == plain.checks
    assert (
        gg.validate(np.ma.array(rows, mask=np.zeros((3, 4), dtype=bool))).checks
        == plain.checks
    )


def test_errors_carry_field_row_value_and_path(tmp_path: Path) -> None:
    path = tmp_path / "gait.csv"
    path.write_text("t,alpha1,alpha2,alpha3,alpha4\n0,0.4,-0.4,0.4,-0.4\n1,0.4,x,0,0\n")
    with pytest.raises(gg.InputError, match="row 2: alpha2 must be") as refused:
        gg.read_table(path)
    error = refused.value
    assert (error.field, error.row, error.value) == ("alpha2", 2, "x")
    assert error.path == str(path)
    path.write_text("alpha1,alpha2,alpha3,alpha4\n0.4,-0.4,0.4,-0.4\n4.5,0,0,0\n")
    with pytest.raises(gg.InputError) as refused:
        gg.read_table(path)
    error = refused.value
    assert (error.field, error.row, error.value) == ("alpha1", 2, 4.5)
    with pytest.raises(gg.InputError) as refused:
        gg.plan_loop([(0.1, 0.2)], period=-1)
    assert refused.value.field == "period"


def test_problems_of_files_keep_what_the_system_says(tmp_path: Path) -> None:
    path = str(tmp_path / "none.csv")
    with pytest.raises(FileProblem) as refused:
        gg.read_table(path)
    assert refused.value.errno == errno.ENOENT
    assert refused.value.filename == refused.value.path == path
    with pytest.raises(FileProblem) as refused:
        write_tables(gg.timing.table_of("gait4"), [f"{'a' * 300}.csv"])
    assert refused.value.errno == errno.ENAMETOOLONG
