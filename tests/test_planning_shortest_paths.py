"""Shortest paths around polygons, against a visibility graph built edge by edge with shapely and networkx."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from gaitgraph.errors import InputError
from gaitgraph.planning.shortest_paths import ShortestPaths
from tests.samples import visibility_graph


def length_of(path: Any) -> float:
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def check_as_the_full_graph(region: Any, points: list[tuple[float, float]]) -> None:
    corners = {(x, y) for x, y in shapely.get_coordinates(region).tolist()}
    graph = visibility_graph(region, corners | set(points))
    paths, shell = ShortestPaths(region), region.buffer(1e-9)
    for a, b in combinations(points, 2):
        path = paths.path(a, b)
        if not nx.has_path(graph, a, b):
            assert path is None
            continue
        expected = nx.dijkstra_path_length(graph, a, b, weight="length")
        assert path is not None
        assert length_of(path) == pytest.approx(expected, abs=1e-11)
        np.testing.assert_array_equal(path[[0, -1]], [a, b])
        assert shell.covers(shapely.LineString(path))
        assert length_of(paths.path(b, a)) == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize("seed", range(8))
def test_among_random_polygons(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1.5, 1.5, (9, 1, 2)) + rng.uniform(-0.8, 0.8, (9, 3, 2))
    triangles = shapely.convex_hull(shapely.multipoints(corners))
    region = shapely.box(-1.5, -1.5, 1.5, 1.5) - shapely.union_all(triangles)
    strewn = rng.uniform(-1.5, 1.5, (40, 2))
    inside = strewn[shapely.contains_xy(region, *strewn.T)][:6].tolist()
    points = inside + shapely.get_coordinates(region)[:3].tolist()
    check_as_the_full_graph(region, [(x, y) for x, y in points])


boxes_on_a_grid = st.lists(
    st.tuples(*[st.integers(0, 8)] * 2, *[st.integers(1, 3)] * 2),
    min_size=1,
    max_size=7,
)


STREWN = [(0.0, 0.0), (9.0, 9.0), (0.0, 9.0), (4.5, 2.0), (2.0, 7.5), (5.0, 5.0)]


@settings(max_examples=40, deadline=None)
@given(boxes_on_a_grid)
def test_among_boxes_that_touch_line_up_and_overlap(
    boxes: list[tuple[int, int, int, int]],
) -> None:
    """Whole numbers make corners collinear, borders shared and passages of no width."""
    filled = [shapely.box(x, y, x + w, y + h) for x, y, w, h in boxes]
    region = shapely.box(0, 0, 9, 9) - shapely.union_all(filled)
    points = [point for point in STREWN if region.covers(shapely.Point(point))]
    check_as_the_full_graph(region, points)


# A corner at which a hole, left between two polygons, touches their border; sides that cross; a corner on a side.
HARD: list[list[list[tuple[float, float]]]] = [
    [
        [(-0.45, 0.25), (-0.5, 0.2), (-0.6, 0.2), (-0.6, 0.1), (-0.4, 0.05)],
        [(-0.5, 0.25), (-0.45, 0.25), (-0.65, 0.35), (-0.65, 0.5), (-0.85, 0.25)],
    ],
    [[(-0.3, 1.1), (-0.8, 1.0), (-0.7, 0.7)], [(-1.3, 0.3), (-1.5, 0.0), (-0.9, -0.1)]],
    [[(-0.9, 0.3), (-0.3, 0.5), (-0.9, 0.9)], [(-0.8, 0.1), (-0.4, 0.1), (-0.6, 0.6)]],
    [[(-0.2, 0.2), (-0.5, 0.1), (-0.3, 0.0), (-0.3, 0.0)]],
]


@pytest.mark.parametrize("polygons", HARD)
def test_points_on_sides_by_rounding_inside_or_outside_go_around(polygons: Any) -> None:
    parts = [shapely.Polygon(polygon) for polygon in polygons]
    region = shapely.box(-1.57, -0.2, 0.2, 1.57) - shapely.union_all(parts)
    paths, rng = ShortestPaths(region), np.random.default_rng(1)
    points = [(0.1, 0.1)]
    for part in parts:
        for share in rng.uniform(size=4):
            point = part.exterior.interpolate(share, normalized=True)
            points.append((point.x, point.y))
    check_as_the_full_graph(region, list(filter(paths.contains, points)))


def test_parts_that_touch_in_a_corner_are_joined_there_and_others_are_not() -> None:
    for gap, joined in ((0.0, [(0.5, 0.0), (1.0, 1.0), (1.0, 2.0)]), (0.1, None)):
        parts = [shapely.box(0, 0, 1, 1), shapely.box(1 + gap, 1, 2, 2)]
        paths = ShortestPaths(shapely.MultiPolygon(parts))
        path = paths.path((0.5, 0.0), (1.0 + gap, 2.0))
        np.testing.assert_equal(path, joined)


def test_points_outside_have_no_path_and_points_on_the_border_have_one() -> None:
    paths = ShortestPaths(shapely.box(0, 0, 1, 1))
    assert paths.path((0.5, 0.5), (1.1, 0.5)) is None
    assert not paths.contains((1.0 + 2e-9, 0.5))
    third = (1.0 + 5e-10, 1 / 3)
    np.testing.assert_array_equal(paths.path((0.0, 0.7), third), [(0.0, 0.7), third])
    np.testing.assert_array_equal(paths.path(third, third), [third])
    assert ShortestPaths(shapely.Polygon()).path((0, 0), (0, 0)) is None
    assert not ShortestPaths(shapely.GeometryCollection()).contains((0.0, 0.0))
    with pytest.raises(InputError, match="must consist of polygons, got a Point"):
        ShortestPaths(shapely.Point(0.0, 0.0))


def test_points_of_a_side_with_a_corner_on_it_see_past_that_corner() -> None:
    """In decimals a corner on a side, and points of that side, are beside it by rounding."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        step = rng.integers(-40, 40, 2)
        middle, at = np.sort(rng.choice(np.arange(1, 10), 2, replace=False))
        first, between, last, goal, before = (
            (k * step + [3, 7]) / 1000 for k in (0, middle, 10, at, -3)
        )
        across = np.array([step[1], -step[0]])
        # From beyond the first corner, on the other side of the line.
        start = before + across / 300
        lengths = []
        for corners in ([first, between, last], [first, last]):
            obstacle = shapely.Polygon([*corners, last + across / 500])
            region = shapely.box(-1, -1, 1, 1) - obstacle
            lengths.append(length_of(ShortestPaths(region).path(start, goal)))
        assert lengths[0] == pytest.approx(lengths[1], abs=1e-12)
        assert lengths[0] >= math.dist(start, goal)
