"""Compact graphs against the networkx graph, edge by edge, and their walks against its closed walks."""

from __future__ import annotations

import dataclasses
import itertools
import math
import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.graph import compact_sweeps as sweeps
from gaitgraph.graph.build import grid_axis, nodes_above, surface_graph
from gaitgraph.graph.compact_bits import CompactGraph, checked_compact_divisions, compact_graph, loss_within
from gaitgraph.graph.compact_rasters import zone_raster
from gaitgraph.graph.compact_sweeps import FAR, engine_of, roads_of
from gaitgraph.graph.compact_walks import CompactWalk, compact_loop, compact_order, compact_walk, reachable_nodes
from gaitgraph.graph.loads import MOST_LOAD, loads_of, mean_load, red_load
from gaitgraph.graph.walks import Blocked, ClosedWalk, allowed_edges, best_order, closed_walk, quanta_of
from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value_on_red
from gaitgraph.surface.region import Zones

USES = ("flyable", "valid", "two_color")
SQUARE = np.pi / 8 * np.array([(3, -3), (3, -1), (1, -1), (1, -3)])
ENGINES = [
    "waves",
    pytest.param(
        "kernel", marks=pytest.mark.skipif(find_spec("numba") is None, reason="the extra fast is not installed")
    ),
]


def key(alpha: Any, color: str) -> Any:
    return (*np.round(alpha, 9).tolist(), color)


def networkx_key(graph: Any, name: Any) -> Any:
    data = graph.nodes[name]
    return key([data[f"alpha{k}"] for k in range(1, 5)], data["color"])


def compact_keys(graph: CompactGraph, nodes: Any) -> list[Any]:
    colors = ["red" if red else "blue" for red in graph.red(nodes)]
    return [key(alpha, color) for alpha, color in zip(graph.alpha(nodes), colors, strict=True)]


def assert_same_edges(sign: Any, divisions: int, use: Any, **asked: Any) -> int:
    """The verdict on every edge, and the nodes above every waypoint."""
    theirs, ours = surface_graph(sign, divisions, **asked), compact_graph(sign, divisions, use=use, **asked)
    counts = allowed_edges(use)
    expected = {
        frozenset((networkx_key(theirs, a), networkx_key(theirs, b)))
        for a, b, data in theirs.edges(data=True)
        if counts(data)
    }
    edge = ours.edges()
    found = list(map(frozenset, zip(compact_keys(ours, edge[:, 0]), compact_keys(ours, edge[:, 1]), strict=True)))
    assert len(set(found)) == len(found)
    assert set(found) == expected
    waypoints = asked.get("waypoints", ())
    for stop, names in zip(ours.stops, nodes_above(theirs, waypoints), strict=True):
        kept = {networkx_key(theirs, name) for name in names}
        if use == "flyable":
            kept = {one for one in kept if one[-1] == "red"}
        assert set(compact_keys(ours, np.array(stop, dtype=int))) == kept
    return len(found)


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("divisions", "use", "sign"),
    [
        *itertools.product((8, 16), USES, ("negative", "positive")),
        (64, "flyable", "positive"),
        (64, "valid", "negative"),
        (48, "two_color", "negative"),
    ],
)
def test_edges_are_those_of_the_networkx_graph(divisions: int, use: Any, sign: Any) -> None:
    assert assert_same_edges(sign, divisions, use, waypoints=[(0.91, -0.33), (-0.2, 0.7), (0.93, -0.3)]) > 0


def random_vehicle(rng: np.random.Generator, divisions: int) -> gg.Vehicle:
    """Any drag ratio, sometimes one that puts a crossing line on the grid; limits that bite."""
    ratio = float(10 ** rng.uniform(-2, 1))
    if rng.random() < 0.3:
        ratio = math.tan(math.pi * int(rng.integers(1, divisions)) / (2 * divisions))
    limits: dict[str, Any] = {}
    if rng.random() < 0.5:
        limits["max_tilt"] = float(rng.uniform(0.3, 1.6))
    if rng.random() < 0.5:
        limits["max_thrust"] = float(rng.uniform(0.26, 1.0) * 9.80665)
    spin: Any = rng.choice(["clockwise", "counterclockwise"])
    return dataclasses.replace(gg.Vehicle(mass=1.0, drag_ratio=ratio, first_rotor_spin=spin), **limits)


def random_zones(rng: np.random.Generator, number: int) -> Zones:
    outs = [(rng.uniform(-1.5, 1.5, 2) + rng.uniform(-0.5, 0.5, (3, 2))).tolist() for _ in range(number)]
    frame = [(-1.5, -1.5), (1.5, -1.5), (1.4, 1.4), (-1.4, 1.5)]
    return Zones(keep_out=outs, keep_in=[frame] if rng.random() < 0.3 else ())


@pytest.mark.no_cover
@pytest.mark.parametrize("seed", range(42))
def test_edges_of_any_vehicle_zones_and_floor(seed: int) -> None:
    rng = np.random.default_rng(seed)
    divisions = int(rng.integers(2, 26))
    waypoints = rng.uniform(-1.57, 1.57, (3, 2))
    waypoints[0] = (2 * rng.integers(1, divisions, 2) - divisions) * math.pi / (2 * divisions)
    waypoints[1, 0] = waypoints[0, 0]  # on one line of the grid
    assert_same_edges(
        str(rng.choice(["negative", "positive"])),
        divisions,
        USES[seed % 3],
        waypoints=waypoints,
        zones=random_zones(rng, 2) if rng.random() < 0.6 else None,
        vehicle=random_vehicle(rng, divisions) if rng.random() < 0.6 else gg.PAPER,
        floor=float(rng.choice([0.0, 0.01, 0.05, 0.3])),
    )


@pytest.mark.parametrize("seed", range(6))
def test_zones_by_raster_are_zones_node_by_node_and_step_by_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    zones, axis = random_zones(rng, 4), grid_axis(40)
    if seed == 0:  # sides along the lines of the grid, and beyond it
        zones = Zones(
            keep_out=[[(axis[10], axis[5]), (axis[20], axis[5]), (axis[20], axis[30])], [(2, 0), (3, 0), (2, 9)]]
        )
    allowed, near = zone_raster(zones, axis)
    place = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    np.testing.assert_array_equal(allowed, zones.allow_points(place.reshape(-1, 2)).reshape(allowed.shape))
    settled = allowed & ~near
    for di, dj in ((0, 1), (1, 0), (1, 1), (1, -1)):
        i, j = np.nonzero(settled[: 41 - di])
        inside = (j + dj >= 0) & (j + dj <= 40)
        i, j = i[inside], j[inside]
        both = settled[i + di, j + dj]
        assert both.any()
        assert zones.allow_segments(place[i, j][both], place[i + di, j + dj][both]).all()


def test_no_edge_loses_more_than_its_bound() -> None:
    """Steps of all sizes and directions, dense samples of the closed form between their ends."""
    rng = np.random.default_rng(0)
    tightest = 0.0
    for _ in range(200):
        vehicle = gg.Vehicle(drag_ratio=float(10 ** rng.uniform(-1.5, 0.5)))
        step = float(10 ** rng.uniform(-3, -0.3))
        start = rng.uniform(-1.5, 1.5, (60, 1, 2))
        turn = rng.integers(-1, 2, (60, 1, 2))
        along = start + step * turn * np.linspace(0, 1, 65)[None, :, None]
        value = least_singular_value_on_red(along[..., 0], along[..., 1], vehicle)
        ends = np.minimum(value[:, 0], value[:, -1])
        lost, bound = ends - value.min(axis=1), loss_within(step, ends, vehicle)
        assert (lost <= bound + 1e-12).all()
        tightest = max(tightest, float((lost / bound).max()))
    assert tightest > 0.05


def test_the_load_is_the_largest_hover_thrust() -> None:
    rng = np.random.default_rng(1)
    for kappa in (0.05, gg.PAPER.drag_ratio, 0.9, 4.0):
        for spin in ("clockwise", "counterclockwise"):
            vehicle = gg.Vehicle(drag_ratio=kappa, first_rotor_spin=spin)
            plane = rng.uniform(-1.5, 1.5, (500, 2))
            expected = np.abs(hover_thrust_shares(np.hstack([plane, plane]), vehicle)).max(axis=1)
            found = red_load(plane[:, 0], plane[:, 1], vehicle)
            np.testing.assert_allclose(found, np.minimum(expected, MOST_LOAD), rtol=1e-7)
            assert (found >= 0.25 - 1e-12).all()
    delta = math.atan(gg.PAPER.drag_ratio)
    assert red_load(delta, -delta).tolist() == MOST_LOAD  # red meets blue: no thrust at all
    fiber = [[delta, 0.4, delta, 0.2]]
    assert loads_of(fiber, ["fiber1"])[0] == pytest.approx(np.abs(hover_thrust_shares(fiber)).max())


def test_the_cost_of_thrust_tends_to_its_integral() -> None:
    """The trapezoidal sum on the grid, along one line, against quadrature: second order."""
    from scipy.integrate import quad

    start, end = np.array([-1.0, 0.3]), np.array([-0.2, 1.1])
    length = float(np.linalg.norm(end - start))
    exact = length * quad(lambda s: float(red_load(*(start + s * (end - start)))), 0, 1, points=[0.5], epsabs=1e-12)[0]
    errors = []
    for pieces in (8, 16, 32, 64):
        at = start + np.linspace(0, 1, pieces + 1)[:, None] * (end - start)
        load = red_load(at[:, 0], at[:, 1])
        errors.append(abs(length / pieces * mean_load(load[:-1], load[1:]).sum() - exact))
    assert errors[-1] < 1e-4
    assert all(after < 0.35 * before for before, after in itertools.pairwise(errors))


def width_of(graph: Any, nodes: Any) -> float:
    """The least width of a closed walk on the networkx graph."""
    steps = zip(nodes, (*nodes[1:], nodes[0]), strict=True)
    return float(min(graph.edges[step]["least_singular_value"] for step in steps))


def assert_same_walks(first: CompactWalk | Blocked, second: CompactWalk | Blocked) -> None:
    if isinstance(first, Blocked) or isinstance(second, Blocked):
        assert first == second
        return
    assert first.nodes.tolist() == second.nodes.tolist()
    assert (first.length, first.thrust, first.stops) == (second.length, second.thrust, second.stops)


@pytest.mark.no_cover
@pytest.mark.parametrize("seed", range(45))
def test_walks_are_as_long_as_those_on_the_networkx_graph(seed: int) -> None:
    rng = np.random.default_rng(seed)
    divisions = int(rng.integers(6, 24))
    objective: Any = ("shortest", "robust", "thrust")[seed % 3]
    use: Any = "valid" if objective == "robust" and seed % 2 else USES[seed // 3 % 3]
    if objective == "robust" and use == "two_color":
        use = "flyable"
    side = [(1, -1), (-1, 1), (1, -1), (-1, -1)][seed % 4]
    waypoints = rng.uniform(0.1, 1.4, (int(rng.integers(1, 5)), 2)) * side
    for k in np.flatnonzero(rng.random(len(waypoints)) < 0.5):
        waypoints[k] = (2 * rng.integers(1, divisions, 2) - divisions) * math.pi / (2 * divisions)
    asked: dict[str, Any] = {
        "waypoints": waypoints,
        "zones": random_zones(rng, 3) if seed % 5 == 0 else None,
        "vehicle": random_vehicle(rng, divisions) if seed % 4 == 3 else gg.PAPER,
        "floor": float(rng.choice([0.0, 0.05])),
    }
    sign: Any = "positive" if side == (-1, 1) else "negative"
    graph = surface_graph(sign, divisions, **asked)
    stops = nodes_above(graph, waypoints)
    if use == "flyable":
        stops = [[name for name in names if graph.nodes[name]["color"] == "red"] for names in stops]
    compact = compact_graph(sign, divisions, use=use, **asked)
    walk = compact_walk(compact, objective=objective, engine="waves")
    if find_spec("numba") is not None:
        assert_same_walks(walk, compact_walk(compact, objective=objective, engine="kernel"))
    if not all(stops):
        assert walk == Blocked(leg=[bool(names) for names in stops].index(False), rootless=True)
        return
    expected = closed_walk(graph, stops, use=use, objective=objective)
    if isinstance(expected, Blocked):
        assert walk == expected
        return
    assert isinstance(walk, CompactWalk)
    if objective == "thrust":
        assert walk.thrust == pytest.approx(expected.thrust, abs=1e-9)
    else:
        assert walk.length == pytest.approx(expected.length, abs=1e-12)
    for stop, start in zip(stops, walk.stops, strict=True):
        at = start % len(walk.nodes)
        assert key(walk.alpha[at], walk.colors[at]) in {networkx_key(graph, name) for name in stop}
    name_of = {networkx_key(graph, name): name for name in graph}
    names = [name_of[key(alpha, color)] for alpha, color in zip(walk.alpha, walk.colors, strict=True)]
    if len(names) == 1:
        assert walk.length == 0
        return
    edges = [graph.edges[a, b] for a, b in zip(names, (*names[1:], names[0]), strict=True)]
    assert all(allowed_edges(use)(edge) for edge in edges)
    assert walk.length == pytest.approx(sum(edge["length"] for edge in edges), abs=1e-9)
    if objective == "robust":
        assert width_of(graph, names) == width_of(graph, expected.nodes)


@pytest.mark.parametrize(("sign", "side"), [("negative", (1, -1)), ("positive", (-1, 1))])
@pytest.mark.parametrize("objective", ["shortest", "robust", "thrust"])
def test_walks_like_those_above_are_found(sign: Any, side: Any, objective: Any) -> None:
    """Not all of what is compared above is blocked."""
    found = compact_loop(np.abs(SQUARE) * side, sign=sign, divisions=24, objective=objective, engine="waves")
    assert isinstance(found, CompactWalk)


def test_both_sheets_and_the_way_between_them() -> None:
    """Colors meet at (?,?) only; the walk there and back changes color where the networkx walk may."""
    points = [(1.2, -0.9), (-0.6, 0.5)]
    graph = surface_graph("negative", 32, waypoints=points)
    expected = closed_walk(graph, nodes_above(graph, points), use="two_color")
    walk = compact_loop(points, sign="negative", divisions=32, use="two_color")
    assert isinstance(expected, ClosedWalk)
    assert isinstance(walk, CompactWalk)
    assert walk.length == pytest.approx(expected.length, abs=1e-12)
    assert set(walk.colors) >= {"blue"}
    red, blue = (
        compact_loop(points[:1], sign="negative", divisions=32, use="valid", colors=[c]) for c in ("red", "blue")
    )
    assert isinstance(red, CompactWalk)
    assert isinstance(blue, CompactWalk)
    assert (red.colors, blue.colors) == (("red",), ("blue",))


def kernels() -> list[Any]:
    """The kernel compiled, if numba is there, and the same code as plain Python."""
    return [sweeps.expand, *([sweeps._compiled()] if find_spec("numba") else [])]


@pytest.mark.parametrize("loaded", [False, True])
def test_the_kernel_finds_the_distances_of_the_waves(loaded: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    waypoints = [(1.2, -0.9), (0.3, -0.77), (-0.6, 0.5), (0.31, -0.76)]
    graph = compact_graph("negative", 24, use="two_color", waypoints=waypoints)
    roads = roads_of(graph, loaded=loaded, engine="waves")
    source, *targets = (nodes[0] for nodes in graph.stops)
    everywhere = roads.distances(source, [])
    assert (everywhere < FAR).sum() == reachable_nodes(graph, source)
    for kernel in kernels():
        monkeypatch.setattr(sweeps, "_compiled", lambda kernel=kernel: kernel)
        monkeypatch.setattr(sweeps, "_POPS", 50)  # in many pieces
        other = dataclasses.replace(roads, engine="kernel")
        np.testing.assert_array_equal(other.distances(source, []), everywhere)
        for target in targets:
            assert other.distances(source, [target])[target] == everywhere[target]
            assert roads.distances(source, [target])[target] == everywhere[target]


def test_bounds_never_exceed_distances() -> None:
    """Off the grid too, where edges are shorter than the octagonal norm of what they change."""
    rng = np.random.default_rng(3)
    graph = compact_graph("negative", 20, use="two_color", waypoints=rng.uniform(-1.4, 1.4, (12, 2)))
    roads = roads_of(graph, engine="waves")
    for source, *_ in (nodes for nodes in graph.stops if nodes):
        reached = roads.distances(source, [])
        known = np.flatnonzero(reached < FAR)
        assert (roads.bound(known, graph.plane(np.array(source))) <= reached[known]).all()


def test_lengths_of_steps_are_the_quanta_of_the_networkx_graph() -> None:
    for divisions in range(3, 1025):
        gaps = np.unique(np.diff(grid_axis(divisions)[1:-1]))
        step = math.pi / divisions
        assert {quanta_of(gap) for gap in gaps} == {quanta_of(step)}
        diagonals = np.linalg.norm(np.stack([*map(np.ravel, np.meshgrid(gaps, gaps))], axis=1), axis=1)
        assert {quanta_of(length) for length in diagonals} == {quanta_of(math.sqrt(2) * step)}


def octile(points: Any) -> float:
    change = np.abs(np.roll(points, -1, axis=0) - points)
    return float((change.max(axis=1) + (math.sqrt(2) - 1) * change.min(axis=1)).sum())


@pytest.mark.parametrize("engine", ENGINES)
def test_in_the_open_a_fine_grid_finds_the_octile_length_in_few_runs(engine: Any) -> None:
    points = math.pi / 16 * np.array([(2, -6), (6, -5), (3, -2)])
    walk = compact_loop(points, sign="negative", divisions=1024, engine=engine)
    assert isinstance(walk, CompactWalk)
    assert walk.length == pytest.approx(octile(points), abs=1e-8)
    step = np.roll(walk.alpha[:, :2], -1, axis=0) - walk.alpha[:, :2]
    turned = np.abs(step - np.roll(step, 1, axis=0)).max(axis=1) > 1e-9
    assert turned.sum() <= 6  # two runs a leg
    np.testing.assert_allclose(walk.alpha[list(walk.stops), :2], points, atol=1e-9)


def test_refining_the_grid_about_a_keep_out_only_shortens() -> None:
    """A grid holds all walks of one with half its divisions; the way about a corner tends to the octile shortest."""
    zones = Zones(keep_out=[[(0.6, -1.0), (1.0, -1.0), (0.8, -0.55)]])
    lengths = []
    for divisions in (64, 128, 256, 512):
        walk = compact_loop(SQUARE[[0, 2]], sign="negative", divisions=divisions, zones=zones, engine="waves")
        assert isinstance(walk, CompactWalk)
        starts, ends = walk.alpha[:, :2], np.roll(walk.alpha[:, :2], -1, axis=0)
        assert zones.allow_segments(starts, ends).all()
        lengths.append(walk.length)
    assert all(finer <= coarser + 1e-8 for coarser, finer in itertools.pairwise(lengths))
    assert lengths[-1] > octile(SQUARE[[0, 2]]) + 0.01


def test_objectives_win_at_what_they_promise() -> None:
    """On the way about the saddle and into the strip beyond it; each is strictly the best of the three at its own."""
    points = [(1.5, -1.5), (1.5, 1.1), (-1.2, -1.5)]
    graph = compact_graph("negative", 128, use="valid", waypoints=points, colors=["red"])
    objectives: tuple[Any, ...] = ("shortest", "robust", "thrust")
    shortest, robust, thrust = (compact_walk(graph, objective=one, engine="waves") for one in objectives)

    def measures(walk: Any) -> tuple[float, float, float]:
        ends = np.roll(walk.alpha, -1, axis=0)
        step = np.linalg.norm((ends - walk.alpha)[:, :2], axis=1)
        load = red_load(*walk.alpha[:, :2].T)
        width = least_singular_value_on_red(*walk.alpha[:, :2].T).min()
        return walk.length, -width, float((step * mean_load(load, np.roll(load, -1))).sum())

    found = np.array([measures(walk) for walk in (shortest, robust, thrust)])
    assert found.argmin(axis=0).tolist() == [0, 1, 2]
    assert found[0, 2] > found[2, 2] + 0.1
    assert isinstance(thrust, CompactWalk)
    assert thrust.thrust == pytest.approx(found[2, 2], abs=1e-9)


@pytest.mark.parametrize("number", [6, 12])
def test_orders_are_those_on_the_networkx_graph(number: int) -> None:
    rng = np.random.default_rng(number)
    points = (2 * rng.integers([9, 1], [15, 7], (number, 2)) - 16) * math.pi / 32
    graph, compact = surface_graph("negative", waypoints=points), compact_graph("negative", 16, waypoints=points)
    above = nodes_above(graph, points)
    named = [next(name for name in names if graph.nodes[name]["color"] == "red") for names in above]
    expected = best_order(graph, named, use="flyable")
    found = compact_order(compact, [nodes[0] for nodes in compact.stops], engine="waves")
    assert expected is not None
    assert found is not None
    assert (found.exact, found.method) == (expected.exact, expected.method)

    def length(order: tuple[int, ...]) -> float:
        walk = closed_walk(graph, [[named[k]] for k in order], use="flyable")
        assert isinstance(walk, ClosedWalk)
        return walk.length

    assert length(found.order) == pytest.approx(length(expected.order), abs=1e-12 if number < 10 else 0.5)


def test_progress_is_told_and_nothing_else_changes() -> None:
    lines: list[str] = []
    told = compact_loop(
        SQUARE, sign="negative", divisions=64, objective="robust", engine="waves", progress=lines.append
    )
    quiet = compact_loop(SQUARE, sign="negative", divisions=64, objective="robust", engine="waves")
    assert isinstance(told, CompactWalk)
    assert isinstance(quiet, CompactWalk)
    assert np.array_equal(told.nodes, quiet.nodes)
    assert lines[0].startswith("deciding the steps of the red sheet, R < 0, 64 divisions")
    assert "searching the best worst case" in lines
    assert lines[-1] == "searching the ways from stop 4"


@pytest.mark.parametrize("engine", ["waves", "kernel"])
def test_long_searches_tell_how_far_they_are_and_can_be_interrupted(engine: Any, monkeypatch: Any) -> None:
    """Whatever `progress` raises goes through, as an interrupt does."""
    monkeypatch.setattr(sweeps, "_TOLD", 1000)
    monkeypatch.setattr(sweeps, "_POPS", 1000)
    monkeypatch.setattr(sweeps, "_compiled", lambda: sweeps.expand)
    graph = compact_graph("negative", 64, use="valid", waypoints=[(1.2, -0.9)])
    roads = dataclasses.replace(roads_of(graph, engine="waves"), engine=engine)
    lines: list[str] = []
    roads.distances(graph.stops[0][0], [], lines.append)
    assert lines
    assert all(line.endswith(" nodes searched") for line in lines)

    def stop(line: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        roads.distances(graph.stops[0][0], [], stop)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"divisions": 4097}, "divisions: 4097; allowed is a whole number from 2 to 4096"),
        ({"divisions": 10**12}, "divisions: 1000000000000; allowed is a whole number from 2 to 4096, since"),
        ({"divisions": 1}, "divisions: 1; allowed is a whole number from 2 to 4096$"),
        ({"divisions": True}, "divisions: True; allowed is a whole number from 2 to 4096$"),
        ({"sign": "zero"}, "sign: 'zero'; allowed are 'positive' and 'negative'"),
        ({"use": "fly"}, "use: 'fly'; allowed are flyable, valid, two_color"),
        ({"objective": "long"}, "objective: 'long'; allowed are shortest, robust, thrust"),
        ({"objective": "robust", "use": "two_color"}, "objective: 'robust' with the use 'two_color'; allowed are the"),
        ({"engine": "steam"}, "engine: 'steam'; allowed are auto, waves, kernel"),
        ({"waypoints": [(2.0, 0.0)]}, "alpha1: 2.0 rad; allowed is −π/2 to π/2"),
        ({"waypoints": []}, "stops: none given; allowed is at least one"),
    ],
)
def test_bad_input_is_refused_in_one_line(asked: dict[str, Any], message: str) -> None:
    with pytest.raises(gg.InputError, match=message) as refused:
        compact_loop(**{"waypoints": SQUARE, "sign": "negative", "divisions": 16, **asked})
    assert "\n" not in str(refused.value)


def test_the_finest_grid_is_allowed() -> None:
    assert checked_compact_divisions(np.int64(4096)) == 4096


def test_an_engine_that_is_not_installed_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeps, "find_spec", lambda name: None)
    assert engine_of("auto") == "waves"
    with pytest.raises(gg.InputError, match=r"engine: 'kernel' needs the package numba; .* gaitgraph\[fast\]"):
        engine_of("kernel")


def test_stops_without_a_node_or_a_way_are_answers() -> None:
    assert compact_loop([(0.9, -0.4), (0.0, 0.0)], sign="negative", divisions=16) == Blocked(leg=1, rootless=True)
    wall = Zones(keep_out=[[(0.7, -1.6), (0.8, -1.6), (0.8, 1.6), (0.7, 1.6)]])
    assert compact_loop(SQUARE[[0, 2]], sign="negative", divisions=64, zones=wall) == Blocked(leg=0)
    graph = compact_graph("negative", 64, waypoints=SQUARE[[0, 2]], zones=wall)
    assert compact_order(graph, [nodes[0] for nodes in graph.stops]) is None


def test_robust_on_blue_is_the_shortest() -> None:
    """Every width is 0 there."""
    points = [(-0.6, 0.5), (-0.2, 0.9)]
    asked: dict[str, Any] = {"sign": "negative", "divisions": 32, "use": "valid", "colors": ["blue"]}
    shortest, robust = (compact_loop(points, objective=objective, **asked) for objective in ("shortest", "robust"))
    assert isinstance(shortest, CompactWalk)
    assert_same_walks(shortest, robust)
    assert shortest.length > 0


def test_planning_on_a_fine_grid_needs_little_memory() -> None:
    """At most 60 bytes a grid node and sheet beside the libraries, which is what a refusal counts with."""
    code = (
        "import resource\n"
        "from gaitgraph.graph.compact_walks import compact_loop\n"
        "def used(): return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "asked = dict(waypoints=[(1.4, -1.4), (-0.6, 0.5)], sign='negative', use='two_color', engine='waves')\n"
        "compact_loop(divisions=64, **asked)\n"
        "before = used()\n"
        "compact_loop(divisions=768, **asked)\n"
        "print(used() - before)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    scale = 1 if sys.platform == "darwin" else 1024
    assert int(done.stdout) * scale < 60 * 2 * 769**2
