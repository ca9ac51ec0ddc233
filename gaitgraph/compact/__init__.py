"""The surface graph on large grids, as bits without an object for each node, and closed walks on it.

The nodes, edges and verdicts are those of :mod:`gaitgraph.graph`, up to 4096 divisions.
"""
