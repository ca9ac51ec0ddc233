"""A valid call of each public function and class that takes what users bring, by its name."""

from __future__ import annotations

import math
from typing import Any

import gaitgraph as gg
from gaitgraph.graph.build import surface_graph
from tests.samples import public_callables

LOOP = [(-0.8, 0.8), (-0.8, 0.4), (-0.4, 0.4)]
ROWS = [[a, b, a, b] for a, b in LOOP]
GAIT = gg.lift(LOOP, "red")
TIMED = GAIT.parametrize(1.0, law="equal-time", samples=9)
POINT = [0.1, 0.2, 0.3, 0.4]
LIMITS = gg.Limits(acceleration=40.0)
SHORT = gg.FlightSettings(duration=0.05)
GRAPH = surface_graph("positive", divisions=4)
SIMPLE = {"pieces": 8, "objective": "hover_reserve"}
GEOMETRY = gg.invertibility.Geometry.of_vehicle("paper")
TABLE = gg.timing.table_of(TIMED)
X_FRAME = gg.io.servo_map_named("x_frame")
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
ANGLES = {"alpha1": -0.3, "alpha2": 0.3}
ALPHA = {"alpha": POINT}
A_GAIT = {"gait": GAIT}
A_MATRIX = "control_force_matrix control_moment_matrix decoupling_matrix hover_power hover_thrust_shares least_singular_value zero_moment_direction attitude_sensitivities determinant level_determinant nearest_singular_attitude pitch_sensitivity roll_sensitivity tilt_margin"

CALLS: dict[str, dict[str, Any]] = {
    "FlightSettings": {},
    "Gait": {"alpha": ROWS},
    "Gait.biased": {"self": GAIT, "bias": 0.8},
    "Gait.check": {"self": GAIT},
    "Gait.parametrize": {"self": GAIT},
    "Gait.started_at": {"self": GAIT, "corner": 1},
    "Gait.vertices": {"self": GAIT},
    "Limits": {"acceleration": 40.0},
    "Table": {"columns": dict(TABLE.columns)},
    "TimedGait": {"gait": GAIT, "period": 1.0, "law": "smooth", "samples": 4},
    "TimedGait.at": {"self": TIMED, "t": 0.1},
    "TimedGait.peaks": {"self": TIMED, "order": 1},
    "TimedGait.with_period": {"self": TIMED, "period": 1.0},
    "Vehicle": {"drag_ratio": 0.17},
    "admissible_region": {"accuracy": 1e-3},
    "basins_of": {"gait": TIMED, "bias": 0.9, "resolution": 1},
    "certify": A_GAIT,
    "colorings": {"points": LOOP},
    "cycles": {"graph": GRAPH},
    "export": {"source": GAIT, "outputs": "a.csv", "period": 1.0, "force": True},
    "fly": {"gait": TIMED, "settings": SHORT},
    "gait_of": {"gait": ROWS},
    "least_period": {"path": GAIT, "limits": LIMITS, "nodes": 30},
    "lift": {"points": LOOP, "colors": "red"},
    "location_of": {"waypoints": LOOP},
    "mission": {"gait": TIMED},
    "optimal_gait": {"waypoints": LOOP[:1], **SIMPLE},
    "paced": {"path": GAIT, "limits": LIMITS, "period": 5.0, "nodes": 30},
    "plan_loop": {"waypoints": LOOP},
    "read_table": {"path": "there.csv"},
    "retarget": {"source": ROWS},
    "robustness_of": {"gait": ROWS, "curves": 0},
    "roots": ANGLES,
    "surface_graph": {"divisions": 4},
    "transition": {"start": "hover", "end": ROWS},
    "validate": {"gait": ROWS},
    "validate_graph": {"graph": GRAPH},
    "vehicle_named": {"vehicle": "paper"},
    "angles.angle_from_text": {"value": "1deg"},
    "angles.angles_from": {"values": ["1deg"]},
    "angles.distance_to_multiple": {"angle": 1.0, "period": math.pi},
    "angles.text_from_angle": {"angle": 1.0},
    "angles.wrapped": {"angle": 1.0},
    "certificates.verify": {"certificate": "proof.json"},
    "flight.Engine": {"vehicle": "beetle_omni"},
    "flight.from_hover": {"gait": "gait4"},
    "flight.settings_from_mapping": {"content": {}},
    "gait.vertices": {"alpha": ROWS},
    "graph.metadata_of": {"graph": GRAPH},
    **{f"invertibility.{name}": ALPHA for name in A_MATRIX.split()},
    "graph.closed_walk": {"graph": GRAPH, "stops": [["002 002 red"]]},
    "graph.best_order": {"graph": GRAPH, "stops": ["002 002 red"]},
    "invertibility.coefficients_of": {},
    "invertibility.least_singular_value_within": {"alpha": POINT, "tilt": 0.1},
    "io.Joint": {"name": "a", "column": "a", "rotor": 1},
    "io.mapped_table": {"table": TABLE, "servo_map": X_FRAME},
    "io.servo_map_from_mapping": {"stated": {}},
    "io.servo_map_named": {"servos": "x_frame"},
    "io.table_from_frame": {"frame": dict(TABLE.columns)},
    "io.write_tables": {"table": TABLE, "paths": ["a.csv"], "force": True},
    "planning.Replanner": {"rate": 5.0},
    "plots.gait_loop": A_GAIT,
    "plots.regions_map": {},
    "plots.roll_pitch_diagram": A_GAIT,
    "plots.singular_value_map": {},
    "plots.servo_margin_map": {},
    "plots.type_map": {},
    "plots.vehicle_figure": {},
    "plots.vehicle_view": ALPHA,
    "plots.write_figures": {
        "out": ".",
        "only": ["2"],
        "formats": ["svg"],
        "force": True,
    },
    "robustness.acceptable_attitudes": {"alpha": ROWS},
    "robustness.comparison_of": {"gaits": [ROWS, ROWS]},
    "robustness.drag_margin": {"points": ROWS},
    "robustness.servo_margin": {"points": ROWS},
    "robustness.singular_curve": {"alpha": POINT},
    "surface.Zones": {"keep_out": [SQUARE]},
    "surface.curved_sheet": {},
    "surface.hover_region": {},
    "surface.red_label": ANGLES,
    "surface.root_arrays": ANGLES,
    "surface.servo_margin_region": {"margin": 0.5, "sign": "positive"},
    "surface.sheet_angles": {"color": "blue", **ANGLES},
    "surface.sheet_distances": ALPHA,
    "surface.sign_region": {"sign": "positive", "accuracy": 1e-3},
    "surface.singular_value_region": {"floor": 0.1, "accuracy": 1e-3},
    "surface.thrust_region": {"share": 0.4, "accuracy": 1e-3},
    "surface.types_may_be_adjacent": {"first": "(+,+)", "second": "(-,-)"},
    "timing.played": {"gait": ROWS},
    "timing.rounded": {"gait": GAIT, "tolerance": 0.01},
    "timing.servo_response": {"gait": TIMED, "lag": 0.02},
    "timing.table_of": A_GAIT,
    "timing.timed_gait_of": {"gait": ROWS, "period": 1.0},
    "validation.validate_geometry": {"table": ROWS, "geometry": GEOMETRY},
    "vehicle.vehicle_from_mapping": {"constants": {"drag_ratio": 0.17}},
}
FUNCTIONS = dict(public_callables())
