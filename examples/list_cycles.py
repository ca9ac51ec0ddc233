"""
List closed cycles
==================

Closed cycles of the surface graph: the shortest in a region.
"""

from itertools import islice

import gaitgraph as gg
from gaitgraph import plots

square = [
    ("pi/8", "-3pi/8"),
    ("3pi/8", "-3pi/8"),
    ("3pi/8", "-pi/8"),
    ("pi/8", "-pi/8"),
]

# %%
# The graph of a region, R < 0. Cycles come one by one, the shortest first, each with its verdict.

region = gg.surface_graph("negative", zones=gg.surface.Zones(keep_in=[square]))
found = gg.cycles(region, require="flyable", max_length=0.8)
ax = plots.singular_value_map()
for cycle in islice(found, 3):
    print(cycle)
    plots.gait_loop(cycle.path, ax=ax)

# %%
# Count the rest.

print(f"{3 + sum(1 for _ in found)} flyable cycles up to 0.8 rad in the square")
