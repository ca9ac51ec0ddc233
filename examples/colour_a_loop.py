"""
Colour a loop
=============

Every colouring of the paper's loops by the Two Color rule, of a loop that may change its color, and of one that has
none.
"""

from math import pi

import gaitgraph as gg
from gaitgraph import plots

loops = {
    "Gait 1": [
        (5 * pi / 16, pi / 8),
        (5 * pi / 16, 3 * pi / 8),
        (pi / 16, 3 * pi / 8),
        (pi / 16, pi / 8),
    ],
    "Gaits 2 and 3": [
        (3 * pi / 8, -3 * pi / 8),
        (3 * pi / 8, -pi / 8),
        (pi / 8, -pi / 8),
        (pi / 8, -3 * pi / 8),
    ],
    "Gait 4": [
        (-pi / 8, pi / 8),
        (-pi / 8, 3 * pi / 8),
        (-3 * pi / 8, 3 * pi / 8),
        (-3 * pi / 8, pi / 8),
    ],
    "where the planes cross": [
        (pi / 16, -pi / 16),
        (pi / 8, -pi / 8),
        (3 * pi / 16, -pi / 8),
    ],
}

# %%
# Which types may be neighbours, by Figure 15 of the paper. (?,?) may be a neighbour of all.

plots.adjacency_rule()

# %%
# A colouring chooses one root above each point, so that all have one sign of R and no angle steps from its + plane to
# its − plane. A change of color at a ``?`` obeys the rule, and jumps.

for name, loop in loops.items():
    found = gg.colorings(loop)
    print(f"{name}: {found.count}")
    for coloring in found:
        print(f"    {coloring}")

# %%
# Colourings are listed as they are asked for, and counted without being listed.

print(
    gg.colorings([(pi / 16, -pi / 16)] * 100).count,
    "for 100 points that are all (?,?): 2 to the power of 100",
)

# %%
# Blue has R > 0 left of α1 = 2δ − π/2, and red above the diagonal. So no color has R < 0 at both points; the refusal
# states them.

found = gg.colorings([(-1.55, 0.0), (-0.4, 0.4)], sign="negative")
print(found)
print(found.refusals["negative"].points, found.refusals["negative"].types)
