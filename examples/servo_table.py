"""
A table for the servos of an X frame
====================================

A gait has tilt angles about arms numbered as in the paper. This vehicle has motors numbered as in PX4 and ArduPilot,
one servo mounted the other way round, and takes pulse widths over milliseconds.
"""

import gaitgraph as gg

plan = gg.plan_loop(
    [("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
)
table = gg.timing.table_of(plan.gait.parametrize(period=2.0, samples=8))

# %%
# The map could stand in a TOML file for ``gaitgraph export --servos``. Motor 2 turns the other way.

servos = gg.io.servo_map_from_mapping(
    {
        "preset": "x_frame",
        "unit": "us",
        "us_per_rad": 400,
        "time": "time_ms",
        "time_unit": "ms",
        "joint": [
            {"name": "front_right"},
            {"name": "rear_left", "sign": -1},
            {"name": "front_left"},
            {"name": "rear_right"},
        ],
    }
)
mapped = gg.io.mapped_table(table, servos)
for name, values in mapped.columns.items():
    print(f"{name:>15}", *(f"{value:7.1f}" for value in values))

# %%
# Pulse widths are written to 0.1 µs. The file states its map, so that reading it gives tilt angles again, and it is judged
# like any gait file.

gg.io.write_tables(mapped, ["servos.csv"], force=True)
error = abs(gg.read_table("servos.csv").alpha - table.alpha).max()
print(f"read back to {error:.1e} rad; flyable {gg.validate('servos.csv').flyable}")
