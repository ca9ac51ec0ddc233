"""
List closed cycles
==================

Closed cycles of the surface graph: the shortest in a region, and the shortest simple one through waypoints.
"""

from itertools import islice

import gaitgraph as gg
from gaitgraph import plots
from gaitgraph.graph.build import nodes_above

square = [("pi/8", "-3pi/8"), ("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8")]
waypoints = [[gg.angles.angle_from_text(text) for text in point] for point in square]

# %%
# The graph of a region, R < 0. Cycles come one by one, the shortest first, each with its verdict.

region = gg.surface_graph("negative", zones=gg.surface.Zones(keep_in=[square]))
found = gg.cycles(region, use="flyable", max_length=0.8)
ax = plots.singular_value_map()
for cycle in islice(found, 3):
    print(cycle)
    plots.gait_loop(cycle.path, ax=ax)

# %%
# Count the rest. ``complete`` states whether the search found all of them before its effort ran out.

print(f"{3 + sum(1 for _ in found)} flyable cycles up to 0.8 rad in the square, all of them: {found.complete}")

# %%
# The shortest cycle through given nodes in any order, none passed twice. The bound tells whether it is proven.

graph = gg.surface_graph("negative")
found = gg.cycles(graph, through=nodes_above(graph, waypoints), any_order=True, shortest=True, effort=1_000_000)
for cycle in found:
    proven = cycle.length <= found.bound
    print(f"through its corners, in any order: {cycle.length:.4f} rad, proven shortest: {proven}")
    print(f"flyable {cycle.report.flyable}, by the whole report")
    plots.gait_loop(cycle.path, ax=plots.singular_value_map())
