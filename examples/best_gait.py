"""
The best gait through discs
===========================

Often a loop needs to pass only near its waypoints. Among all loops that pass them within a radius, which one keeps the
decoupling matrix farthest from singular? And how much tilting does it need?
"""

import numpy as np

import gaitgraph as gg
from gaitgraph import plots

waypoints = [
    ("3pi/8", "-3pi/8"),
    ("3pi/8", "-pi/8"),
    ("pi/8", "-pi/8"),
    ("pi/8", "-3pi/8"),
]

# %%
# The worst case of the best loop through the waypoints themselves, and within 0.1 and 0.2 rad of them.
# The bound holds for every loop, whatever its form, so the value is optimal to within the gap.

found = {}
for radius in (0.0, 0.1, 0.2):
    found[radius] = gg.optimal_gait(waypoints, radius=radius, sign="negative")
    best = found[radius]
    print(
        f"radius {radius}: least singular value {best.value:.3f}, at most {best.bound:.3f}, {best.effort:.2f} rad²/s"
    )

# %%
# A calmer gait within 0.2 rad: a tenth of the best value is given up for less effort.

calm = gg.optimal_gait(waypoints, radius=0.2, sign="negative", concession=0.1)
print(
    f"conceding a tenth: least singular value {calm.value:.3f}, {calm.effort:.2f} rad²/s"
)

# %%
# The gaits are smooth curves, checked between samples, and come as tables too.

print(gg.validate(calm.table(samples=100)).flyable)

# %%
# Both on the map of the least singular value: the discs, and the loops that pass them.

ax = plots.singular_value_map()
for name, best in (
    ("most robust, 0.2 rad", found[0.2]),
    ("a tenth conceded, 0.2 rad", calm),
):
    ax.plot(*best.gait.alpha[:, :2].T, label=name)
for center, size in zip(found[0.2].waypoints, found[0.2].radius, strict=True):
    turn = np.linspace(0, 2 * np.pi, 73)
    ax.plot(
        center[0] + size * np.cos(turn),
        center[1] + size * np.sin(turn),
        color="black",
        linewidth=0.7,
    )
ax.legend(loc="upper left", fontsize="small")
