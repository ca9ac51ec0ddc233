"""Closed cycles of the surface graph: the shortest in a region, and the shortest simple one through waypoints."""

from itertools import islice

import gaitgraph as gg
from gaitgraph.graph import nodes_above
from gaitgraph.regions import Zones

square = [("pi/8", "-3pi/8"), ("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8")]
waypoints = [[gg.angle_from_text(text) for text in point] for point in square]

region = gg.surface_graph("negative", zones=Zones(keep_in=[square]))
found = gg.cycles(region, use="flyable", max_length=0.8)
for cycle in islice(found, 3):
    print(cycle)
print(f"{3 + sum(1 for _ in found)} flyable cycles up to 0.8 rad in the square, all of them: {found.complete}")

graph = gg.surface_graph("negative")
answer = gg.simple_cycle(graph, nodes_above(graph, waypoints), any_order=True)
if isinstance(answer, gg.SimpleCycle):
    print(f"through its corners, in any order: {answer.cycle.length:.4f} rad, proven shortest: {answer.exact}")
    print(f"flyable {answer.cycle.report.flyable}, by the whole report")
