"""
Enter a gait from hover
=======================

The path from hover to Gait 4 as a table, and the proof that there is none to Gait 3.
"""

from math import pi

import gaitgraph as gg
from gaitgraph import plots

# %%
# In ordinary hover α = 0 and R = +4. A gait on the same side, in the same component of the red sheet, can be entered on
# the surface. The path is checked there and back, as a gait.

gait = gg.lift(
    [
        (-pi / 8, pi / 8),
        (-pi / 8, 3 * pi / 8),
        (-3 * pi / 8, 3 * pi / 8),
        (-3 * pi / 8, pi / 8),
    ],
    "red",
)
entry = gg.transition("hover", gait, duration=1.5, samples=150)
print(entry)

# %%
# It is a table like any other, from rest to rest, in one direction.

entry.write("entry.csv", force=True)
table = gg.read_table("entry.csv")
print(
    f"entry.csv: {len(table)} rows, to {table.alpha[-1].round(3)} at t = {table['t'][-1]:g} s"
)

# %%
# The gait continues from the corner where the path joins it.

corner = entry.corners[1] or 0
plots.gait_loop(entry.gait, ax=plots.gait_loop(gait, ax=plots.regions_map()))
print(
    "and on from there:",
    gait.started_at(corner).parametrize(period=2.0).alpha[0].round(3),
)

# %%
# Gait 3 has R < 0. No path leads there, on the surface or off it, level or tilted: the answer comes with its proof.

third = gg.lift(
    [
        (3 * pi / 8, -3 * pi / 8),
        (3 * pi / 8, -pi / 8),
        (pi / 8, -pi / 8),
        (pi / 8, -3 * pi / 8),
    ],
    "red",
)
refused = gg.transition("hover", third)
print(refused)
if refused.proof:
    print(refused.proof["statement"])
