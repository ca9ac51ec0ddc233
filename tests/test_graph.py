"""The surface graph: its contract, Figure 16's picture, jumps, edges that hold along their whole length."""

from __future__ import annotations

import itertools
import json
from functools import cache
from math import pi
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.graph.build import (
    metadata_of,
    surface_graph,
    vehicle_and_coefficients,
)
from gaitgraph.graph.nodes import grid_axis
from gaitgraph.graph.walks import best_order, closed_walk
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import least_singular_value, level_determinant
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import red_label, roots
from tests.samples import points_of

if TYPE_CHECKING:
    from pathlib import Path


def color_of(name: str) -> str:
    return name.split()[1 if name.startswith("w") else 2]


def cell_of(name: str) -> tuple[int, int]:
    """The numbers in the id of a node on the grid."""
    i, j, _ = name.split()
    return int(i), int(j)


def change(graph: nx.Graph[Any], **changes: Any) -> None:
    """Change some of the metadata."""
    graph.graph["name"] = json.dumps(metadata_of(graph) | changes)


@pytest.fixture(scope="module")
def negative() -> nx.Graph[Any]:
    return surface_graph("negative")


def brute_edges(graph: nx.Graph[Any]) -> set[frozenset[Any]]:
    """All pairs, the rule word by word: neighbouring cells, and no angle from + to −."""
    out = set()
    step = pi / metadata_of(graph)["divisions"] * (1 + 1e-9)
    for (a, first), (b, second) in itertools.combinations(graph.nodes(data=True), 2):
        near = all(abs(first[k] - second[k]) <= step for k in ("alpha1", "alpha2"))
        marks = zip(
            first["types"].strip("()").split(","),
            second["types"].strip("()").split(","),
            strict=True,
        )
        if near and not any(set(pair) == {"+", "-"} for pair in marks):
            out.add(frozenset((a, b)))
    return out


@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_edges_are_exactly_the_allowed_neighbours(sign: Any) -> None:
    # The last is one step away from the first, which is near enough.
    waypoints = [
        (0.91, -0.33),
        (0.95, -0.3),
        (1.5707, -0.4),
        (-0.2, 0.7),
        (0.91 - pi / 10, -0.33),
    ]
    graph = surface_graph(sign, divisions=10, waypoints=waypoints)
    assert {frozenset(edge) for edge in graph.edges} == brute_edges(graph)
    gg.validate_graph(graph)
    for divisions in range(2, 9):
        coarse = surface_graph(sign, divisions=divisions)
        assert {frozenset(edge) for edge in coarse.edges} == brute_edges(coarse)


def test_jumps(negative: nx.Graph[Any]) -> None:
    """Colors meet only at (?,?), 0.0585 rad apart or more; a wrap of blue at the border is π."""
    least = 2 * (pi / 16 - coefficients_of().delta)
    across = [
        edge
        for a, b, edge in negative.edges(data=True)
        if negative.nodes[a]["color"] != negative.nodes[b]["color"]
    ]
    assert not any(edge["continuous"] or edge["flyable"] for edge in across)
    assert min(edge["jump"] for edge in across) == pytest.approx(least)
    same_cell = negative.edges["009 007 red", "009 007 blue"]
    assert (same_cell["length"], same_cell["jump"]) == (0, pytest.approx(least))
    wraps = [
        {a, b}
        for a, b, edge in negative.edges(data=True)
        if not edge["continuous"] and edge not in across
    ]
    for pair in wraps:
        assert {color_of(name) for name in pair} == {"blue"}
        cells = [cell_of(name) for name in pair]
        assert 1 in {i for i, _ in cells} or 15 in {j for _, j in cells}


def surface_arrays(sign: Any, divisions: int = 16, **options: Any) -> SimpleNamespace:
    """Return a surface graph as arrays: nodes in their order, edges as pairs of node numbers."""
    graph = surface_graph(sign, divisions=divisions, **options)
    nodes, edges = list(graph.nodes.values()), list(graph.edges(data=True))
    index = {name: k for k, name in enumerate(graph)}
    names = ("length", "jump", "keeps_sign", "least_singular_value", "flyable")
    return SimpleNamespace(
        ids=list(graph),
        alpha=np.array([[node[f"alpha{k}"] for k in range(1, 5)] for node in nodes]),
        red=np.array([node["color"] == "red" for node in nodes]),
        R=np.array([node["R"] for node in nodes]),
        edge=np.array([[index[a], index[b]] for a, b, _ in edges]),
        **{name: np.array([data[name] for *_, data in edges]) for name in names},
    )


LIMITED = {
    "paper": gg.PAPER,
    "strong drag": gg.Vehicle(drag_ratio=0.4),
    "mirrored": gg.PAPER.replace(first_rotor_spin="counterclockwise"),
    "narrow": gg.PAPER.replace(max_tilt=pi / 3),
    "weak": gg.Vehicle(drag_ratio=0.3, mass=1.3, gravity=9.7, max_thrust=5.0),
    "weak and narrow": gg.Vehicle(
        drag_ratio=0.1, mass=2.0, gravity=9.81, max_thrust=8.0, max_tilt=1.2
    ),
}


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("name", "sign"),
    [
        *((name, "negative") for name in LIMITED),
        ("paper", "positive"),
        ("weak", "positive"),
    ],
)
def test_every_attribute_of_an_edge_is_what_sampling_shows(
    name: str, sign: Any
) -> None:
    vehicle = LIMITED[name]
    floor, numbers = 0.2, coefficients_of(vehicle)
    arrays = surface_arrays(sign, 12, vehicle=vehicle, floor=floor)
    pairs = arrays.edge.tolist()
    assert pairs == sorted(pairs)
    a, b = arrays.edge.T
    assert (a < b).all()
    start, end = arrays.alpha[a], arrays.alpha[b]
    np.testing.assert_allclose(
        arrays.length,
        np.hypot(end[:, 0] - start[:, 0], end[:, 1] - start[:, 1]),
        atol=1e-15,
    )
    # On one sheet α3 and α4 move as the planes say, or wrap by π; from sheet to sheet nothing is continuous.
    slope = np.where(arrays.red[a], 1.0, -1.0)[:, None]
    off = np.abs((end - start)[:, 2:] - slope * (end - start)[:, :2]).max(axis=1)
    same = arrays.red[a] == arrays.red[b]
    np.testing.assert_allclose(arrays.jump[same], off[same], atol=1e-12)
    assert set(np.round(arrays.jump[same] / pi, 9)) <= {0.0, 1.0}
    assert (arrays.jump[~same] > 0).all()
    smooth = arrays.red[a] & arrays.red[b] & arrays.keeps_sign & (off < 1e-9)
    assert smooth.any()
    assert not arrays.flyable[~smooth].any()
    assert not arrays.least_singular_value[~smooth].any()
    along = points_of(start[smooth], end[smooth], 201)
    R = (1 if sign == "positive" else -1) * level_determinant(along, numbers)
    assert R.min() > 0
    least = least_singular_value(along, vehicle).min(axis=1)
    shares = gg.invertibility.hover_thrust_shares(along, vehicle)
    margins = [least - floor, shares.min(axis=(1, 2)), np.full(len(least), 1.0)]
    if vehicle.max_thrust is not None:
        assert vehicle.mass is not None
        margins.append(
            1
            - shares.max(axis=(1, 2))
            * vehicle.mass
            * float(vehicle.gravity)
            / vehicle.max_thrust
        )
    margin = np.min(margins, axis=0)
    tilt = np.abs(along).max(axis=(1, 2))
    expected = (margin > 0) & (tilt <= (vehicle.tilt_range or [(-pi, pi)])[0][1] + 1e-9)
    decided = np.abs(margin) > 1e-3
    assert np.count_nonzero(decided) > 0.8 * len(decided)
    np.testing.assert_array_equal(arrays.flyable[smooth][decided], expected[decided])
    assert 0 < np.count_nonzero(expected) < len(expected)
    np.testing.assert_allclose(arrays.least_singular_value[smooth], least, atol=2e-4)
    if vehicle.max_tilt == pi / 3:
        assert (
            tilt[arrays.flyable[smooth]] > pi / 3 - 1e-9
        ).any()  # the limit itself is allowed, and is a node


@pytest.mark.parametrize(
    "vehicle", [gg.PAPER, gg.Vehicle(drag_ratio=0.4)], ids=lambda vehicle: vehicle.name
)
def test_a_floor_between_the_bounds_of_an_edge_is_decided(vehicle: gg.Vehicle) -> None:
    """Where an edge's least singular value is that of one of its ends it is known: so is the verdict, to 1e-6."""
    free = surface_arrays("negative", 12, vehicle=vehicle, floor=0.0)
    ends = least_singular_value(free.alpha[free.edge], vehicle).min(axis=1)
    start, end = free.alpha[free.edge.T]
    along = points_of(start, end, 101)
    inside = least_singular_value(along, vehicle)[:, 1:-1].min(axis=1)
    at_an_end = free.flyable & (
        ends < inside - 1e-4
    )  # rising from there, not dipping between two samples
    values = np.unique(np.round(ends[at_an_end], 12))
    assert len(values) >= 6
    for value in values[::9]:
        concerned = at_an_end & (np.abs(ends - value) < 1e-11)
        for shift, flies in ((-3e-6, True), (1e-8, False), (3e-6, False)):
            judged = surface_arrays(
                "negative", 12, vehicle=vehicle, floor=float(value) + shift
            )
            assert (judged.flyable[concerned] == flies).all()


@pytest.mark.parametrize("divisions", [8, 16])
def test_where_R_is_zero_but_for_rounding_there_is_no_node(divisions: int) -> None:
    """With δ one step, cos β1 or cos β2 is zero in exact arithmetic on a row and a column of nodes."""
    vehicle = gg.Vehicle(drag_ratio=float(np.tan(pi / divisions)))
    nodes: set[Any] = set()
    for sign in ("positive", "negative"):
        nodes |= {
            cell_of(name)
            for name in surface_graph(sign, divisions=divisions, vehicle=vehicle)
        }
    axis, delta = grid_axis(divisions), pi / divisions
    for i, j in itertools.product(range(1, divisions), repeat=2):
        a1, a2 = axis[i], axis[j]
        saddle = 2 * np.tan(delta) * np.cos(a1) * np.cos(a2) - np.sin(a1 - a2)
        factors = (np.cos(a1 - delta), np.cos(a2 + delta), saddle)
        assert ((i, j) in nodes) == (min(map(abs, factors)) > 1e-12)
    assert not {cell for cell in nodes if cell[0] == 1 or cell[1] == divisions - 1}


def test_an_edge_over_the_saddle_does_not_keep_its_sign() -> None:
    """Near a saddle, nodes of different components with R of one sign can be neighbours."""
    leaks = 0
    for n in (12, 20):
        for sign in ("positive", "negative"):
            arrays = surface_arrays(sign, n, coefficients=coefficients_of(kind="exact"))
            red = arrays.red[arrays.edge].all(axis=1)
            labels = red_label(arrays.alpha[:, 0], arrays.alpha[:, 1])
            crossing = (labels[arrays.edge[:, 0]] != labels[arrays.edge[:, 1]]).any(
                axis=1
            ) & red
            assert not arrays.keeps_sign[crossing].any()
            leaks += int(crossing.sum())
    assert leaks > 0


@pytest.mark.parametrize("kind", ["published", "exact"])
@pytest.mark.parametrize("sign", ["negative", "positive"])
def test_ids_count_waypoints_and_their_roots(sign: Any, kind: Any) -> None:
    """Roots of this sign at waypoints off the grid, counted for each color; with exact coefficients red ones alone."""
    numbers, wanted = coefficients_of(kind=kind), 1 if sign == "positive" else -1
    off_grid = [(-0.4, 0.3), (0.3, 1.1), (-0.4, 0.7), (-0.9, 0.3)]
    if sign == "negative":
        off_grid = [(b, a) for a, b in off_grid[1:]]
    elif kind == "published":
        # Blue lies at a corner of the square: besides red there is four times blue, twice with either sign.
        off_grid[0] = (2 * numbers.delta - pi / 2, pi / 2 - 2 * numbers.delta)
    waypoints = [off_grid[0], (pi / 16, 0.0), *off_grid[1:], off_grid[1]]
    if kind == "exact":
        waypoints.append(
            (0.7 * wanted, -0.7 * wanted)
        )  # red has the other sign there, and there is no blue
    arrays = surface_arrays(sign, coefficients=numbers, waypoints=waypoints)
    expected = []
    for k, point in enumerate(off_grid):
        copies = {"red": 0, "blue": 0}
        for root in roots(*point, coefficients=numbers):
            if wanted * root.R > 1e-12:
                name = f"w{k:03} {root.color} {copies[root.color]}"
                copies[root.color] += 1
                values = (*root.alpha, root.color == "red", root.R)
                expected.append((name, values))
    own = [position for position, name in enumerate(arrays.ids) if name[0] == "w"]
    assert [arrays.ids[position] for position in own] == [name for name, _ in expected]
    for position, (_, values) in zip(own, expected, strict=True):
        assert (*arrays.alpha[position].tolist(), bool(arrays.red[position])) == values[
            :-1
        ]
        assert arrays.R[position] == pytest.approx(values[-1], abs=1e-13)
    assert {int(name[1:4]) for name, _ in expected} == set(range(len(off_grid)))
    corner = (kind, sign) == ("published", "positive")
    assert any(name.endswith("blue 1") for name, _ in expected) is corner
    axis = grid_axis()
    for name, alpha in zip(arrays.ids, arrays.alpha, strict=True):
        if not name.startswith("w"):
            i, j = cell_of(name)
            assert alpha[:2].tolist() == [axis[i], axis[j]]


def test_waypoints_on_the_grid_add_nothing(negative: nx.Graph[Any]) -> None:
    axis = grid_axis()[1:-1]
    for off in (0.0, 0.9e-9):
        graph = surface_graph(
            "negative", waypoints=[(a + off, b - off) for a in axis for b in axis]
        )
        assert list(graph.nodes(data=True)) == list(negative.nodes(data=True))
        assert list(graph.edges(data=True)) == list(negative.edges(data=True))
    assert len(surface_graph("negative", waypoints=[(pi / 8 + 1.1e-9, -pi / 8)])) > len(
        negative
    )


@pytest.mark.parametrize("kind", ["published", "exact"])
def test_the_metadata_is_what_the_graph_was_built_with(kind: Any) -> None:
    vehicle = gg.PAPER.replace(first_arm_angle=0.3) if kind == "exact" else gg.PAPER
    numbers = coefficients_of(vehicle, kind)
    graph = surface_graph(
        "positive", divisions=7, vehicle=vehicle, coefficients=numbers, floor=0.9
    )
    metadata = metadata_of(graph)
    assert metadata == {
        "contract": "gaitgraph surface graph 1",
        "divisions": 7,
        "sign": "positive",
        "coefficients": kind,
        "vehicle": vehicle.as_mapping(),
        "floor": 0.9,
    }
    assert {*graph.graph} == {"name"}
    assert vehicle_and_coefficients(graph) == (vehicle, numbers)
    for key in metadata:
        rest = {name: value for name, value in metadata.items() if name != key}
        with pytest.raises(
            gg.errors.ContractError, match=f"^graph metadata: '{key}' is missing$"
        ):
            gg.cycles(nx.Graph(name=json.dumps(rest)))


def test_zones_cut_nodes_and_edges(negative: nx.Graph[Any]) -> None:
    with pytest.raises(gg.errors.ContractError, match="DiGraph"):
        gg.validate_graph(negative.to_directed())
    zones = Zones(
        keep_out=[[(0.6, -0.9), (0.95, -0.9), (0.95, -0.6), (0.6, -0.6)]],
        keep_in=[[(0, 0), (1.5, 0), (1.5, -1.5), (0, -1.5)]],
    )
    graph = surface_graph(zones=zones)
    gg.validate_graph(graph)
    for _, data in graph.nodes(data=True):
        assert 0 <= data["alpha1"] <= 1.5
        assert not (0.6 < data["alpha1"] < 0.95 and -0.9 < data["alpha2"] < -0.6)
    for a, b in graph.edges:
        middle = [
            (graph.nodes[a][k] + graph.nodes[b][k]) / 2 for k in ("alpha1", "alpha2")
        ]
        assert not (0.6 < middle[0] < 0.95 and -0.9 < middle[1] < -0.6)


FIRST, SECOND, FAR = "014 002 red", "014 003 red", "009 002 red"
BREAKAGES: list[tuple[str, Any]] = [
    (
        "contract must be 'gaitgraph surface graph 1', got 'x'",
        lambda graph: change(graph, contract="x"),
    ),
    ("divisions must be .* got 1.5", lambda graph: change(graph, divisions=1.5)),
    (
        "must be a root .* with the graph's sign of R",
        lambda graph: change(graph, sign="positive"),
    ),
    ("vehicle has no field", lambda graph: change(graph, vehicle={"x": 1})),
    (
        "floor must be a finite number ≥ 0, got 'x'",
        lambda graph: change(graph, floor="x"),
    ),
    ("name must be the JSON .*, got None", lambda graph: graph.graph.clear()),
    ("name must be the JSON", lambda graph: graph.graph.update(name="[1]")),
    ("'R' is missing", lambda graph: graph.nodes[FIRST].pop("R")),
    (
        "color must be 'red', got 'green'",
        lambda graph: graph.nodes[FIRST].update(color="green"),
    ),
    (
        "must be a root",
        lambda graph: nx.relabel_nodes(graph, {FIRST: "014 099 red"}, copy=False),
    ),
    (
        "must be a root",
        lambda graph: graph.add_node("w000 red 0", **graph.nodes[FIRST]),
    ),
    (
        "alpha1 must be 1.178.*, got 0.3",
        lambda graph: graph.nodes[FIRST].update(alpha1=0.3),
    ),
    (
        "got 1.178",
        lambda graph: graph.nodes[FIRST].update(
            alpha1=graph.nodes[FIRST]["alpha1"] + 1.3e-9
        ),
    ),
    ("R must be .*, got 'x'", lambda graph: graph.nodes[FIRST].update(R="x")),
    ("'jump' is missing", lambda graph: graph.edges[FIRST, SECOND].pop("jump")),
    (
        "keeps_sign must be True, got 'True'",
        lambda graph: graph.edges[FIRST, SECOND].update(keeps_sign="True"),
    ),
    (
        "flyable must be True, got False",
        lambda graph: graph.edges[FIRST, SECOND].update(flyable=False),
    ),
    (
        "singular_value must be .*, got 2.0",
        lambda graph: graph.edges[FIRST, SECOND].update(least_singular_value=2.0),
    ),
    *(
        (
            "must join neighbours",
            lambda graph, b=b: graph.add_edge(FIRST, b, **graph.edges[FIRST, SECOND]),
        )
        for b in (FAR, FIRST, "014 003 blue")
    ),
]


@pytest.mark.parametrize(("message", "break_it"), BREAKAGES)
def test_each_breach_of_the_contract_is_named(
    message: str, break_it: Any, negative: nx.Graph[Any]
) -> None:
    graph = negative.copy()
    break_it(graph)
    with pytest.raises(gg.errors.ContractError, match=message):
        gg.validate_graph(graph)


# Out of Python and back


def through_json(graph: nx.Graph[Any], path: Path) -> nx.Graph[Any]:
    path.write_text(json.dumps(nx.node_link_data(graph)), encoding="utf-8")
    return nx.node_link_graph(json.loads(path.read_text(encoding="utf-8")))


def through(write: Any, read: Any) -> Any:
    def there_and_back(graph: nx.Graph[Any], path: Path) -> nx.Graph[Any]:
        write(graph, path)
        back: nx.Graph[Any] = read(path)
        return back

    return there_and_back


FORMATS = {
    "node-link JSON": through_json,
    "GraphML": through(nx.write_graphml, nx.read_graphml),
    "GEXF": through(nx.write_gexf, nx.read_gexf),
    "GML": through(nx.write_gml, nx.read_gml),
}
EACH = gg.PAPER.replace(
    name="\"Élan\" <&> '4'", max_tilt=[1.5, 1.4, 1.5, 1.4], max_thrust=3.0
)
GRAPHS: dict[str, dict[str, Any]] = {
    "the paper's": {},
    "printed, positive": {"sign": "positive", "coefficients": "printed"},
    "waypoints": {"waypoints": [(0.5, -0.6), (1.2, -0.7), (-pi / 2, pi / 2)]},
    "another vehicle": {"vehicle": "beetle_omni", "floor": 0.07},
    "rotors above": {"vehicle": gg.PAPER.replace(rotor_height=0.03)},
    "limits of each arm": {"vehicle": EACH, "waypoints": [(0.5, -0.6)]},
}


@pytest.mark.filterwarnings("ignore:.*edges=:FutureWarning")  # networkx 3.4 and 3.5
@pytest.mark.parametrize(
    ("name", "form"),
    [
        *(("limits of each arm", form) for form in FORMATS),
        *((name, "GraphML") for name in GRAPHS if name != "limits of each arm"),
    ],
)
def test_the_graph_leaves_python_and_comes_back(
    name: str, form: str, tmp_path: Path
) -> None:
    graph = graph_without_a_node(name)
    back = FORMATS[form](graph, tmp_path / "graph")
    gg.validate_graph(back)
    assert metadata_of(back) == metadata_of(graph)
    assert vehicle_and_coefficients(back) == vehicle_and_coefficients(graph)
    assert list(back) == list(graph)
    assert sorted(back) == sorted(graph)
    for node, data in graph.nodes(data=True):
        assert data.items() <= back.nodes[node].items()
    for a, b, data in graph.edges(data=True):
        assert data.items() <= back.edges[a, b].items()
    if name == "limits of each arm":
        assert routes_of(back) == routes_of_graph(name)
    # A reader's graph is judged like any other.
    red = next(node for node in graph if " red" in node)
    back.nodes[red]["R"] = 1.0
    with pytest.raises(gg.errors.ContractError, match="R must be"):
        gg.validate_graph(back)


def cycles_of(graph: nx.Graph[Any], use: Any) -> list[Any]:
    """The first cycles with all that is said of them, and the verdicts of the first one's report."""
    found = list(itertools.islice(gg.cycles(graph, require=use), 20))
    told: list[Any] = [(cycle.nodes, str(cycle), cycle.as_mapping()) for cycle in found]
    return [*told, *(str(cycle.report) for cycle in found[:1])]


def walk_of(graph: nx.Graph[Any], stops: list[str], use: Any) -> list[Any]:
    walk = closed_walk(graph, [[stop] for stop in stops], require=use)
    robust = closed_walk(
        graph, [[stop] for stop in stops], require=use, objective="robust"
    )
    return [walk, robust, best_order(graph, stops, require=use)]


def routes_of(graph: nx.Graph[Any]) -> list[Any]:
    """The first cycles of each use, and walks through four red nodes."""
    red = [name for name in graph if " red" in name]
    stops = red[:: len(red) // 4]
    uses = ("flyable", "valid", "two_color")
    return [(cycles_of(graph, use), walk_of(graph, stops, use)) for use in uses]


@cache
def graph_without_a_node(name: str) -> nx.Graph[Any]:
    graph = surface_graph(divisions=8, **GRAPHS[name])
    graph.remove_node(sorted(graph)[0])
    return graph


@cache
def routes_of_graph(name: str) -> list[Any]:
    return routes_of(graph_without_a_node(name))


def test_ids_sort_like_the_numbers_in_them() -> None:
    strips = [
        [(-1.6, -0.65), (1.6, -0.65), (1.6, -0.55), (-1.6, -0.55)],
        [(0.55, -1.6), (0.65, -1.6), (0.65, 1.6), (0.55, 1.6)],
    ]
    waypoints = [(0.5, -0.61), (0.7, -0.62)]
    graph = surface_graph(
        divisions=101, waypoints=waypoints, zones=Zones(keep_in=strips)
    )
    on_grid = sorted(name for name in graph if not name.startswith("w"))
    assert on_grid == sorted(on_grid, key=lambda name: (*cell_of(name), color_of(name)))
    assert sorted(graph)[len(on_grid) :] == sorted({*graph} - {*on_grid})
