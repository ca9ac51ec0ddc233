"""The surface graph: its nodes, its edges, its contract, and the formats in which it leaves Python."""

from __future__ import annotations

import itertools
import json
from collections import Counter
from math import pi
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.graph.build import (
    metadata_of,
    surface_graph,
    validate_graph,
    vehicle_and_coefficients,
)
from gaitgraph.graph.walks import closed_walk
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import roots
from gaitgraph.tolerances import DEFAULT_FLOOR
from tests.samples import PUBLISHED, points_of

if TYPE_CHECKING:
    from pathlib import Path

SIGNS = {"negative": -1, "positive": 1}
ANGLES = [f"alpha{k}" for k in range(1, 5)]
CORNER = (2 * PUBLISHED.delta - pi / 2, pi / 2 - 2 * PUBLISHED.delta)


@pytest.fixture(scope="module")
def negative() -> nx.Graph[Any]:
    return surface_graph("negative", divisions=8)


@pytest.mark.parametrize("sign", SIGNS)
@pytest.mark.parametrize(
    ("drag_ratio", "kind"),
    [
        (None, "published"),
        (None, "exact"),
        (np.tan(pi / 8), "exact"),  # cos β is zero, but for rounding, along grid lines
    ],
)
def test_nodes_are_the_roots_of_one_sign_above_grid_and_waypoints(
    sign: Any, drag_ratio: float | None, kind: Any
) -> None:
    vehicle = gg.Vehicle(drag_ratio=drag_ratio) if drag_ratio else gg.PAPER
    numbers = coefficients_of(vehicle, kind)
    # Above the corner there are four blue roots, two of either sign of R.
    off_grid = [CORNER, (0.3, -1.1), (-0.4, 0.7), (pi / 8 + 1.1e-9, -pi / 8)]
    on_grid = [(pi / 8 + 0.9e-9, -pi / 8), (0.0, 0.25 * pi)]
    graph = surface_graph(
        sign,
        divisions=8,
        vehicle=vehicle,
        coefficients=numbers,
        waypoints=[*off_grid, *on_grid, off_grid[1]],
    )
    axis = np.linspace(-pi / 2, pi / 2, 9)
    places = {
        f"{i:03} {j:03}": (axis[i], axis[j])
        for i, j in itertools.product(range(1, 8), repeat=2)
    }
    places |= {f"w{k:03}": point for k, point in enumerate(off_grid)}
    expected = {}
    for name, point in places.items():
        usable = [
            root
            for root in roots(*point, coefficients=numbers, crossing_tolerance=pi / 16)
            if SIGNS[sign] * root.R > 1e-12
        ]
        seen: Counter[str] = Counter()
        for root in usable:
            node = f"{name} {root.color}"
            if name.startswith("w"):
                node += f" {seen[root.color]}"
            seen[root.color] += 1
            expected[node] = (root.types, root.color, [*root.alpha, root.R])
    assert set(graph) == set(expected)
    for node, data in graph.nodes(data=True):
        types, color, values = expected[node]
        assert (data["types"], data["color"]) == (types, color)
        assert [data[key] for key in (*ANGLES, "R")] == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("divisions", [2, 5, 10])
@pytest.mark.parametrize("sign", SIGNS)
def test_edges_join_all_neighbours_that_change_no_sign_of_a_type(
    sign: Any, divisions: int
) -> None:
    step = pi / divisions
    # The last is exactly one step from the first.
    waypoints = [(0.91, -0.33), (1.5707, -0.4), (-0.2, 0.7), (0.91 - step, -0.33)]
    graph = surface_graph(sign, divisions=divisions, waypoints=waypoints)
    expected = []
    for (a, first), (b, second) in itertools.combinations(graph.nodes(data=True), 2):
        near = all(abs(first[key] - second[key]) <= step + 1e-12 for key in ANGLES[:2])
        marks = zip(first["types"], second["types"], strict=True)
        if near and not any({"+", "-"} == set(pair) for pair in marks):
            expected.append((a, b))
    assert list(graph.edges) == expected


WEAK = gg.Vehicle(drag_ratio=0.3, mass=1.3, gravity=9.7, max_thrust=5.0)
NARROW = gg.PAPER.replace(max_tilt=pi / 3, first_rotor_spin="counterclockwise")


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("vehicle", "sign", "divisions"),
    [
        (gg.PAPER, "negative", 12),
        (NARROW, "negative", 12),
        (WEAK, "negative", 12),
        (WEAK.replace(max_tilt=1.2), "positive", 12),
        (gg.PAPER, "positive", 20),  # edges lead over a saddle of R
    ],
)
def test_attributes_of_edges_are_what_sampling_shows(
    vehicle: gg.Vehicle, sign: Any, divisions: int
) -> None:
    floor = 0.2
    graph = surface_graph(sign, divisions=divisions, vehicle=vehicle, floor=floor)
    alpha = {
        name: [data[key] for key in ANGLES] for name, data in graph.nodes(data=True)
    }
    start, end = np.array([[alpha[a], alpha[b]] for a, b in graph.edges]).swapaxes(0, 1)
    red = np.array([["red" in a, "red" in b] for a, b in graph.edges])
    edges = [data for *_, data in graph.edges(data=True)]
    told = {name: np.array([edge[name] for edge in edges]) for name in edges[0]}
    step = end - start
    np.testing.assert_allclose(told["length"], np.hypot(*step.T[:2]), atol=1e-14)

    # On one sheet α3 and α4 move as the planes say, or wrap by π; from sheet to sheet they jump.
    same = red[:, 0] == red[:, 1]
    slope = np.where(red[:, :1], 1, -1)
    off = np.abs(step[:, 2:] - slope * step[:, :2]).max(axis=1)
    np.testing.assert_allclose(told["jump"][same], off[same], atol=1e-12)
    assert set(np.round(told["jump"][same] / pi, 9)) <= {0.0, 1.0}
    assert (told["jump"][~same] > 0).all()
    np.testing.assert_array_equal(told["continuous"], told["jump"] == 0)

    along = points_of(start, end, 201)
    R = level_determinant(along, coefficients_of(vehicle)) * SIGNS[sign]
    kept = told["keeps_sign"]
    nearest = R.min(axis=1)
    decided = np.abs(nearest) > 1e-3
    np.testing.assert_array_equal(kept[decided], nearest[decided] > 0)
    np.testing.assert_allclose(told["R"][kept], SIGNS[sign] * nearest[kept], atol=1e-3)
    assert not told["R"][~kept].any()

    smooth = red.all(axis=1) & kept & told["continuous"]
    least = np.where(smooth, least_singular_value(along, vehicle).min(axis=1), 0.0)
    np.testing.assert_allclose(told["least_singular_value"], least, atol=5e-4)
    shares = hover_thrust_shares(along, vehicle)
    margins = [least - floor, shares.min(axis=(1, 2))]
    if vehicle.thrust_share is not None:
        margins.append(vehicle.thrust_share - shares.max(axis=(1, 2)))
    margin = np.min(margins, axis=0)
    reach = vehicle.tilt_range[0][1] + 1e-9 if vehicle.tilt_range else pi
    expected = smooth & (margin > 0) & (np.abs(along).max(axis=(1, 2)) <= reach)
    decided = ~smooth | (np.abs(margin) > 1e-3)
    np.testing.assert_array_equal(told["flyable"][decided], expected[decided])
    assert 0 < np.count_nonzero(expected) < np.count_nonzero(smooth)


def test_edges_have_the_least_servo_margin_of_their_ends_and_middle() -> None:
    graph = surface_graph("positive", divisions=6, servo_margins=True)
    flyable = []
    for a, b, edge in graph.edges(data=True):
        if not edge["flyable"]:
            assert edge["servo_margin"] == 0.0
            continue
        ends = np.array([[graph.nodes[name][key] for key in ANGLES] for name in (a, b)])
        places = np.vstack([ends, ends.mean(axis=0)])
        margins = servo_margins_found(places, gg.PAPER, DEFAULT_FLOOR)
        assert edge["servo_margin"] == pytest.approx(margins.min(), abs=1e-6)
        flyable.append(edge)
    flyable[0]["servo_margin"] += 1e-3
    with pytest.raises(gg.errors.ContractError, match="servo_margin must be"):
        validate_graph(graph)


def test_zones_cut_nodes_and_edges() -> None:
    hole = [(0.6, -0.9), (0.95, -0.9), (0.95, -0.6), (0.6, -0.6)]
    quadrant = [(0, 0), (1.5, 0), (1.5, -1.5), (0, -1.5)]
    graph = surface_graph(zones=Zones(keep_out=[hole], keep_in=[quadrant]))
    validate_graph(graph)
    plane = {
        name: np.array([data["alpha1"], data["alpha2"]])
        for name, data in graph.nodes(data=True)
    }
    middles = [(plane[a] + plane[b]) / 2 for a, b in graph.edges]
    points = np.vstack([*plane.values(), *middles])
    assert ((points[:, 0] >= 0) & (points[:, 0] <= 1.5)).all()
    in_hole = (np.abs(points - [0.775, -0.75]) < [0.175, 0.15]).all(axis=1)
    assert not in_hole.any()


@pytest.mark.parametrize("kind", ["published", "exact"])
def test_the_metadata_is_what_the_graph_was_built_with(kind: Any) -> None:
    vehicle = gg.PAPER.replace(first_arm_angle=0.3) if kind == "exact" else gg.PAPER
    options: Any = {"vehicle": vehicle, "coefficients": kind}
    graph = surface_graph("positive", divisions=7, floor=0.9, **options)
    metadata = metadata_of(graph)
    assert metadata == {
        "contract": "gaitgraph surface graph 1",
        "divisions": 7,
        "sign": "positive",
        "coefficients": kind,
        "vehicle": vehicle.as_mapping(),
        "floor": 0.9,
        "waypoints": [],
    }
    numbers = coefficients_of(vehicle, kind)
    assert vehicle_and_coefficients(graph) == (vehicle, numbers)
    del metadata["floor"]
    with pytest.raises(gg.errors.ContractError, match="'floor' is missing"):
        metadata_of(nx.Graph(name=json.dumps(metadata)))


FIRST, SECOND = "007 001 red", "007 002 red"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"contract": "x"}, "contract must be 'gaitgraph surface graph 1', got 'x'"),
        ({"divisions": 1.5}, "divisions must be .* got 1.5"),
        ({"sign": "positive"}, "must be a root .* with the graph's sign of R"),
        ({"vehicle": {"x": 1}}, "vehicle has no field"),
        ({"floor": "x"}, "floor must be a number from 0 to 1e12, got 'x'"),
    ],
)
def test_metadata_that_are_wrong_are_named(
    change: dict[str, Any], message: str, negative: nx.Graph[Any]
) -> None:
    graph = negative.copy()
    graph.graph["name"] = json.dumps(metadata_of(graph) | change)
    with pytest.raises(gg.errors.ContractError, match=message):
        validate_graph(graph)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"R": None}, "'R' is missing"),
        ({"R": "x"}, "R must be .*, got 'x'"),
        ({"color": "green"}, "color must be 'red', got 'green'"),
        ({"alpha1": 3 * pi / 8 + 1.3e-9}, "alpha1 must be 1.178"),
        ({"jump": None}, "'jump' is missing"),
        ({"keeps_sign": "True"}, "keeps_sign must be True, got 'True'"),
        ({"flyable": False}, "flyable must be True, got False"),
        ({"least_singular_value": 2.0}, "singular_value must be .*, got 2.0"),
    ],
)
def test_attributes_that_are_wrong_are_named(
    changes: dict[str, Any], message: str, negative: nx.Graph[Any]
) -> None:
    graph = negative.copy()
    for name, value in changes.items():
        node, edge = graph.nodes[FIRST], graph.edges[FIRST, SECOND]
        attributes = node if name in node else edge
        attributes[name] = value
        if value is None:
            del attributes[name]
    with pytest.raises(gg.errors.ContractError, match=message):
        validate_graph(graph)


def test_graphs_with_other_nodes_or_edges_are_refused(
    negative: nx.Graph[Any],
) -> None:
    copied = negative.nodes[FIRST]
    wrong: list[tuple[str, Any]] = [
        ("must be a networkx.Graph", negative.to_directed()),
        ("name must be the JSON", nx.Graph(name="[1]")),
        ("must be a root", nx.relabel_nodes(negative, {FIRST: "007 099 red"})),
    ]
    at_grid = negative.copy()
    at_grid.add_node("w000 red 0", **copied)
    wrong.append(("must be a root", at_grid))
    for other in ("004 001 red", FIRST, "007 002 blue"):
        joined = negative.copy()
        joined.add_edge(FIRST, other, **negative.edges[FIRST, SECOND])
        wrong.append(("must join neighbours", joined))
    for message, graph in wrong:
        with pytest.raises(gg.errors.ContractError, match=message):
            validate_graph(graph)


EACH = gg.PAPER.replace(
    name="\"Élan\" <&> '4'", max_tilt=[1.5, 1.4, 1.5, 1.4], max_thrust=3.0
)
FORMATS: dict[str, tuple[Any, Any]] = {
    "GraphML": (nx.write_graphml, nx.read_graphml),
    "GEXF": (nx.write_gexf, nx.read_gexf),
    "GML": (nx.write_gml, nx.read_gml),
}


@pytest.mark.parametrize("form", ["JSON", *FORMATS])
@pytest.mark.filterwarnings("ignore:.*edges=:FutureWarning")  # networkx 3.4 and 3.5
def test_a_graph_leaves_python_and_comes_back(form: str, tmp_path: Path) -> None:
    waypoints = [(1.2, -0.7), (0.5, -0.6), (-pi / 2, pi / 2)]
    graph = surface_graph(divisions=8, waypoints=waypoints, vehicle=EACH)
    # The contract allows that nodes are missing; the other waypoints keep their names.
    graph.remove_nodes_from([name for name in graph if name.startswith("w000")])
    if form == "JSON":
        back = nx.node_link_graph(json.loads(json.dumps(nx.node_link_data(graph))))
    else:
        write, read = FORMATS[form]
        write(graph, tmp_path / "graph")
        back = read(tmp_path / "graph")
    validate_graph(back)
    assert metadata_of(back) == metadata_of(graph)
    assert list(back) == list(graph)
    for name, data in graph.nodes(data=True):
        assert data.items() <= back.nodes[name].items()
    for a, b, data in graph.edges(data=True):
        assert data.items() <= back.edges[a, b].items()
    red = [[name] for name in graph if "red" in name][::9]
    assert closed_walk(back, red) == closed_walk(graph, red)
