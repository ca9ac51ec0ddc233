"""Large grids: corner to corner over both sheets, against scipy's csgraph and networkx; what the finest needs."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import networkx as nx
import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from gaitgraph.graph.build import nodes_above, surface_graph
from gaitgraph.graph.compact_bits import CompactGraph, compact_graph
from gaitgraph.graph.compact_sweeps import FAR, roads_of
from gaitgraph.graph.compact_walks import compact_walk

DIVISIONS = 1024
SMALL = 192
CORNERS = [(-1.5, -1.5), (1.5, 1.1)]
AGAINST_CSGRAPH = "corner to corner at 1025 x 1025, two sheets, against bare scipy csgraph"
COMPILED = "corner to corner at 1025 x 1025, compiled, against bare scipy csgraph"
PER_NODE = "searching per node of the grid, against networkx"


@pytest.fixture(scope="module")
def graph() -> CompactGraph:
    return compact_graph("negative", DIVISIONS, use="two_color", waypoints=CORNERS)


def ends_of(graph: CompactGraph) -> tuple[int, int]:
    first, second = (nodes[-1] for nodes in graph.stops)
    return first, second


def there(graph: CompactGraph, engine: Any) -> int:
    source, target = ends_of(graph)
    return int(roads_of(graph, engine=engine).distances(source, [target])[target])


Edges = tuple[Any, Any]


@pytest.fixture(scope="module")
def edges(graph: CompactGraph) -> Edges:
    """The same edges and their lengths, decided and measured before the clock starts."""
    edge = graph.edges()
    return np.linalg.norm(graph.plane(edge[:, 1]) - graph.plane(edge[:, 0]), axis=1), edge.T.astype(np.int32)


def bare(graph: CompactGraph, edges: Edges) -> float:
    """The adjacency built the plain way from its edges, and searched."""
    source, target = ends_of(graph)
    matrix = csr_array(edges, shape=(graph.nodes, graph.nodes))
    return float(dijkstra(matrix, directed=False, indices=np.array([source]))[0, target])


@pytest.mark.benchmark(group=AGAINST_CSGRAPH)
def test_corner_to_corner_ours(benchmark: Any, graph: CompactGraph, edges: Edges) -> None:
    length = benchmark.pedantic(there, args=(graph, "waves"), rounds=5, warmup_rounds=1)
    assert length / 1e12 == pytest.approx(bare(graph, edges), abs=1e-8)


@pytest.mark.benchmark(group=AGAINST_CSGRAPH)
def test_corner_to_corner_csgraph(benchmark: Any, graph: CompactGraph, edges: Edges) -> None:
    assert benchmark.pedantic(bare, args=(graph, edges), rounds=5, warmup_rounds=1) > 3


@pytest.mark.benchmark(group=COMPILED)
@pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
def test_corner_to_corner_compiled_ours(benchmark: Any, graph: CompactGraph) -> None:
    length = benchmark.pedantic(there, args=(graph, "kernel"), rounds=5, warmup_rounds=1)
    assert length == there(graph, "waves")


@pytest.mark.benchmark(group=COMPILED)
@pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
def test_corner_to_corner_beside_compiled(benchmark: Any, graph: CompactGraph, edges: Edges) -> None:
    assert benchmark.pedantic(bare, args=(graph, edges), rounds=5, warmup_rounds=1) > 3


@pytest.mark.benchmark(group=PER_NODE)
def test_search_per_node_ours(benchmark: Any, graph: CompactGraph) -> None:
    benchmark.extra_info["items"] = DIVISIONS**2
    benchmark.pedantic(there, args=(graph, "waves"), rounds=5, warmup_rounds=1)


@pytest.mark.benchmark(group=PER_NODE)
def test_search_per_node_networkx(benchmark: Any) -> None:
    """Its own search on a grid that fits, which it holds already."""
    graph = surface_graph("negative", SMALL, waypoints=CORNERS)
    source, target = (names[-1] for names in nodes_above(graph, CORNERS))
    benchmark.extra_info["items"] = SMALL**2
    length, _ = benchmark.pedantic(
        lambda: nx.bidirectional_dijkstra(graph, source, target, weight="length"), rounds=3, warmup_rounds=1
    )
    compact = compact_graph("negative", SMALL, use="two_color", waypoints=CORNERS)
    assert there(compact, "waves") / 1e12 == pytest.approx(length, abs=1e-9)


@pytest.mark.parametrize("objective", ["shortest", "robust", "thrust"])
def test_the_finest_grid_needs_at_most_five_gigabytes(objective: str) -> None:
    """Deciding 4097 × 4097 nodes on two sheets, and a closed walk between far corners, in a process of its own."""
    use, points = (
        ("valid", [(1.5, -1.5), *CORNERS[1:], (-1.2, -1.5)]) if objective == "robust" else ("two_color", CORNERS)
    )
    code = (
        "import resource\n"
        "from gaitgraph.graph.compact_walks import compact_loop\n"
        f"walk = compact_loop({points}, sign='negative', divisions=4096, use={use!r}, objective={objective!r})\n"
        "print(walk.length, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    length, peak = done.stdout.split()
    print(f"{objective}: {float(length):.4f} rad, {int(peak) * 1024 / 1e9:.2f} GB")
    assert int(peak) * 1024 < 5e9


def test_what_is_compared_reaches_both_sheets(graph: CompactGraph) -> None:
    source, _ = ends_of(graph)
    reached = np.flatnonzero(roads_of(graph).distances(source, []) < FAR)
    assert 0.2 < graph.red(reached).mean() < 0.8
    assert len(reached) > DIVISIONS**2
    assert compact_walk(graph)
