"""
Plan a gait
===========

Four waypoints of the (α1, α2) plane become a closed gait, Gait 3 of the paper, and the gait becomes a table.
"""

import gaitgraph as gg
from gaitgraph import plots

# %%
# Waypoints are numbers in radians or texts such as "3pi/8" and "67.5deg". The loop passes them in order and comes
# back to the first. The answer prints its corners, its verdict, and each check.

plan = gg.plan_loop(
    [("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
)
print(plan)

# %%
# A plan is falsy when there is no loop, and states the reason. Only reading its gait raises Infeasible.

gait = plan.gait
print(gait.color, gait.types, f"{gait.length:.4f} rad")

# %%
# The loop among the regions of the red sheet. It lies on the side of R < 0; hover, the cross, is on the other.

plots.gait_loop(gait, ax=plots.regions_map())

# %%
# Other loops through the same waypoints are alternatives, with their own verdicts.

for other in plan.alternatives:
    print(
        other.color,
        other.sign,
        "valid" if other.report.valid else "not valid",
        "·",
        other.report.reason,
    )

# %%
# A timing law maps time to position along it. The vertices are those that the paper prints, equations (16) to (19).

timed = gait.parametrize(period=1.0, rate=50)
print(timed.vertices().round(3))
print(f"largest tilt rate {timed.peak_rates.max():.2f} rad/s, {len(timed.t)} rows")

# %%
# Files are written whole or not at all. Without ``force`` a file that exists is refused.

timed.write("gait3.csv", "gait3.json", force=True)
table = gg.read_table("gait3.csv")
print(len(table), "rows from", table["t"][0], "to", table["t"][-1], "s")
