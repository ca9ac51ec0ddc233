"""Shortest paths around polygons, against a visibility graph built edge by edge with shapely and networkx."""

from __future__ import annotations

import math
from itertools import combinations, pairwise
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from gaitgraph.planning.shortest_paths import ShortestPaths
from tests.samples import visibility_graph


def length_of(path: Any) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(path.tolist()))


def same_as_the_full_graph(region: Any, points: list[tuple[float, float]]) -> None:
    corners = {(x, y) for x, y in shapely.get_coordinates(region).tolist()}
    paths, graph = (
        ShortestPaths(region),
        visibility_graph(region, corners | set(points)),
    )
    shell = region.buffer(1e-9)
    for a, b in combinations(points, 2):
        found = paths.path(a, b)
        if not nx.has_path(graph, a, b):
            assert found is None
            continue
        expected = nx.dijkstra_path_length(graph, a, b, weight="length")
        assert found is not None
        assert length_of(found) == pytest.approx(expected, abs=1e-11)
        np.testing.assert_array_equal(found[[0, -1]], [a, b])
        assert len(found) < 2 or shell.covers(shapely.LineString(found))
        assert length_of(paths.path(b, a)) == pytest.approx(length_of(found), abs=1e-12)


def random_region(rng: np.random.Generator, number: int) -> Any:
    obstacles: list[Any] = []
    while len(obstacles) < number:
        center, radius = rng.uniform(-1.5, 1.5, 2), rng.uniform(0.1, 0.6)
        turns = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 7)))
        reach = radius * rng.uniform(0.3, 1.0, len(turns))
        polygon = shapely.Polygon(
            center + reach[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
        )
        if polygon.is_valid and polygon.area > 1e-3:
            obstacles.append(polygon)
    return shapely.box(-1.5, -1.5, 1.5, 1.5) - shapely.union_all(obstacles)


@pytest.mark.parametrize("seed", range(12))
def test_among_random_polygons(seed: int) -> None:
    rng = np.random.default_rng(seed)
    region = random_region(rng, 7)
    inside: list[tuple[float, float]] = []
    while len(inside) < 6:
        x, y = rng.uniform(-1.5, 1.5, 2).tolist()
        if region.contains(shapely.Point(x, y)):
            inside.append((x, y))
    corners = [tuple(corner) for corner in shapely.get_coordinates(region)[:3].tolist()]
    same_as_the_full_graph(region, [*inside, *corners])


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.integers(0, 8), st.integers(0, 8), st.integers(1, 3), st.integers(1, 3)
        ),
        min_size=1,
        max_size=7,
    )
)
def test_among_boxes_that_touch_line_up_and_overlap(
    boxes: list[tuple[int, int, int, int]],
) -> None:
    """Whole numbers make corners collinear, borders shared and passages of no width."""
    region = shapely.box(0, 0, 9, 9) - shapely.union_all(
        [shapely.box(x, y, x + w, y + h) for x, y, w, h in boxes]
    )
    points = [
        (x, y)
        for x, y in (
            (0.0, 0.0),
            (9.0, 9.0),
            (0.0, 9.0),
            (4.0, 4.0),
            (4.5, 2.0),
            (2.0, 7.5),
            (5.0, 5.0),
        )
        if region.covers(shapely.Point(x, y))
    ]
    same_as_the_full_graph(region, points)


def test_parts_that_touch_in_a_corner_are_joined_there_and_others_are_not() -> None:
    touching = shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(1, 1, 2, 2)])
    bent = [(0.5, 0.0), (1.0, 1.0), (1.0, 2.0)]
    np.testing.assert_array_equal(ShortestPaths(touching).path(bent[0], bent[-1]), bent)
    apart = shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(1.1, 1, 2, 2)])
    assert ShortestPaths(apart).path((0.5, 0.5), (1.5, 1.5)) is None


def test_points_outside_have_no_path_and_points_on_the_border_have_one() -> None:
    paths = ShortestPaths(shapely.box(0, 0, 1, 1))
    assert paths.path((0.5, 0.5), (1.1, 0.5)) is None
    assert not paths.contains((1.1, 0.5))
    third = (1.0 + 5e-10, 1 / 3)
    np.testing.assert_array_equal(paths.path((0.0, 0.7), third), [(0.0, 0.7), third])
    np.testing.assert_array_equal(paths.path(third, third), [third])
    assert ShortestPaths(shapely.Polygon()).path((0, 0), (0, 0)) is None


def test_points_of_a_side_with_a_corner_on_it_see_past_that_corner() -> None:
    # In decimals a corner on a side, and points of that side, are beside it by rounding.
    rng, around = np.random.default_rng(4), shapely.box(-1, -1, 1, 1)
    for _ in range(60):
        step, (middle, at) = (
            rng.integers(-40, 40, 2),
            np.sort(rng.choice(np.arange(1, 10), 2, replace=False)),
        )
        side = [(k * step + [3, 7]) / 1000 for k in (0, middle, 10, at, -3)]
        aside = side[2] + [step[1] / 500, -step[0] / 500]
        regions = (
            around - shapely.Polygon([*corners, aside])
            for corners in (side[:3], side[:3:2])
        )
        start = side[4] + [
            step[1] / 300,
            -step[0] / 300,
        ]  # beyond the first corner, on the other side of the line
        lengths = [
            length_of(ShortestPaths(region).path(start, side[3])) for region in regions
        ]
        assert lengths[0] == pytest.approx(lengths[1], abs=1e-12)


def test_each_bend_touches_the_border_and_turns_around_it() -> None:
    rng = np.random.default_rng(3)
    region = random_region(rng, 12)
    paths = ShortestPaths(region)
    corners = {tuple(corner) for corner in shapely.get_coordinates(region).tolist()}
    bends = 0
    for _ in range(60):
        found = paths.path(rng.uniform(-1.5, 1.5, 2), rng.uniform(-1.5, 1.5, 2))
        for before, bend, after in (
            zip(*(found[k:] for k in range(3)), strict=False)
            if found is not None
            else ()
        ):
            bends += 1
            assert tuple(bend) in corners
            # The shortcut past the bend leaves the region at once: the path is taut.
            step = 1e-6
            shortcut = [
                bend + step * (end - bend) / np.linalg.norm(end - bend)
                for end in (before, after)
            ]
            assert not region.covers(shapely.LineString(shortcut))
    assert bends > 20
