"""The graph is plain networkx: look at it, cut it, search it with any algorithm, and plan on what is left."""

from collections import Counter

import networkx as nx

import gaitgraph as gg

graph = gg.surface_graph("negative")
print(graph, dict(Counter(types for _, types in graph.nodes(data="types"))))

jumps = [(a, b, data["jump"]) for a, b, data in graph.edges(data=True) if not data["continuous"]]
print(f"{len(jumps)} edges obey Figure 15 but jump, the least by {min(jump for *_, jump in jumps):.4f} rad")

flyable = graph.edge_subgraph([(a, b) for a, b, data in graph.edges(data=True) if data["flyable"]])
print(f"{nx.number_connected_components(flyable)} flyable component of {len(flyable)} nodes")

graph.remove_nodes_from([(12, 6, "red"), (12, 6, "blue")])
gg.validate_graph(graph)
plan = gg.plan_loop([("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/4", "-3pi/8")], graph=graph)
print(f"around the missing node: {plan.gait.length:.3f} rad, flyable {plan.report.flyable}")
