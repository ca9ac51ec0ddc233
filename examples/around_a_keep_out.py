"""
Around a keep-out
=================

The shortest loop is straight wherever it can be, and bends only at corners of obstacles. Here two polygons in the plane
of tilt angles are forbidden. The paper's grid has eight directions. The any-angle method plans straight lines in every
direction, and states a lower bound of the length of any loop.
"""

import matplotlib.pyplot as plt
import numpy as np

import gaitgraph as gg
from gaitgraph import plots

waypoints = [(-1.2, 0.2), (-0.4, 0.3), (-0.2, 1.2), (-1.1, 1.2)]
cable = [(-0.9, 0.0), (-0.75, 0.0), (-0.7, 0.5), (-0.85, 0.6)]
post = [(-0.5, 0.6), (-0.2, 0.65), (-0.15, 0.85), (-0.45, 0.9)]

# %%
# Both methods keep out of the polygons along the whole loop, not only at corners. Touching them is allowed.

exact = gg.plan_loop(waypoints, color="red", keep_out=[cable, post])
grid = gg.plan_loop(
    waypoints, color="red", keep_out=[cable, post], method="grid", divisions=32
)
for name, plan in (("exact", exact), ("grid", grid)):
    print(
        f"{name}: {plan.gait.length:.4f} rad, {len(plan.gait.alpha)} corners, flyable {plan.report.flyable}"
    )
assert exact.loop is not None
print(
    f"no loop through these waypoints in this order is shorter than {exact.loop.lower_bound:.4f} rad"
)

# %%
# With a wall across the region there is no loop, and the refusal states which waypoints are separated, and by what.

wall = [(-1.6, 0.65), (1.6, 0.65), (1.6, 0.75), (-1.6, 0.75)]
print(gg.plan_loop(waypoints, color="red", sign="positive", keep_out=[wall]).reason)

# %%
# The loops over the map of the least singular value.

ax = plots.singular_value_map()
for polygon in (cable, post):
    ax.fill(*np.transpose(polygon), facecolor="none", edgecolor="white", hatch="///")
for plan, style in ((grid, "--"), (exact, "-")):
    ax.plot(
        *np.vstack([plan.gait.alpha, plan.gait.alpha[:1]])[:, :2].T,
        style,
        color="white",
    )
ax.plot(*np.transpose(waypoints), "o", color="white", markersize=4)
ax.set(xlim=(-np.pi / 2, 0.4), ylim=(-0.4, np.pi / 2))
plt.gcf().set_size_inches(6.4, 5.2)
