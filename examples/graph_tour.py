"""
A tour of the graph
===================

The surfaces as a plain networkx graph: inspect it, remove nodes, run any algorithm, and walk on the rest.
"""

from collections import Counter

import networkx as nx

import gaitgraph as gg
from gaitgraph import plots
from gaitgraph.graph.build import gait_along
from gaitgraph.graph.walks import ClosedWalk

# %%
# A node is a root with R < 0 above a point of the paper's grid. Its seven types are those of the paper's Figure 16.

graph = gg.surface_graph("negative")
print(f"{graph.number_of_nodes()} nodes, {graph.number_of_edges()} edges")
print(dict(Counter(types for _, types in graph.nodes(data="types"))))
print("012 006 red:", graph.nodes["012 006 red"])
plots.type_map("negative")

# %%
# An edge obeys Figure 15. Where it leaves the sheets it states the jump; no valid gait uses it.

jumps = [
    (a, b, data["jump"])
    for a, b, data in graph.edges(data=True)
    if not data["continuous"]
]
print(
    f"{len(jumps)} edges obey Figure 15 but jump, the least by {min(jump for *_, jump in jumps):.4f} rad"
)

# %%
# The flyable part is connected, and all red.

flyable = graph.edge_subgraph(
    [(a, b) for a, b, data in graph.edges(data=True) if data["flyable"]]
)
print(
    f"{nx.number_connected_components(flyable)} flyable component of {len(flyable)} nodes"
)
print({color for _, color in flyable.nodes(data="color")})

# %%
# Any algorithm of networkx runs on it: the shortest path between two nodes, by length.

print(nx.dijkstra_path(flyable, "012 002 red", "010 006 red", weight="length"))

# %%
# Remove nodes, check the contract, and find the shortest closed walk through others on the rest.

graph.remove_nodes_from(["012 006 red", "012 006 blue"])
gg.validate_graph(graph)
walk = gg.graph.closed_walk(
    graph, [["014 006 red"], ["010 006 red"], ["012 002 red"]], require="flyable"
)
assert isinstance(walk, ClosedWalk)  # otherwise it names the leg that blocks it
gait = gait_along(graph, walk.nodes).merged()
print(
    f"around the missing node: {gait.length:.3f} rad, flyable {gg.validate(gait).flyable}"
)

# %%
# As GraphML, GEXF, GML or node-link JSON the graph leaves Python, and what networkx reads keeps the contract.

text = "\n".join(nx.generate_graphml(graph))
again = nx.parse_graphml(text)
gg.validate_graph(again)
same = gg.graph.closed_walk(
    again, [["014 006 red"], ["010 006 red"], ["012 002 red"]], require="flyable"
)
print("the walk is the same:", same == walk)
