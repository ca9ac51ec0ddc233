"""The user's own polygons."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st

from gaitgraph.errors import InputError
from gaitgraph.surface.region import Zones, zones_region

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
BESIDE = [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)]

Corners = list[tuple[float, float]]


def inside(point: tuple[float, float], corners: Corners) -> bool:
    """Return whether a ray from the point crosses the boundary an odd number of times."""
    x, y = point
    odd = False
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            odd = not odd
    return odd


def boundary_distance(point: tuple[float, float], corners: Corners) -> float:
    p = np.array(point)
    distances = []
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        a, b = np.array(start), np.array(end)
        along = min(1.0, max(0.0, float((p - a) @ (b - a) / ((b - a) @ (b - a)))))
        distances.append(float(np.linalg.norm(a + along * (b - a) - p)))
    return min(distances)


@st.composite
def star_polygons(draw: st.DrawFn) -> Corners:
    """Return a simple polygon, as a rule not convex: corners around a center, in order."""
    radii = draw(st.lists(st.floats(0.2, 1.2), min_size=3, max_size=9))
    x, y = draw(st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
    turns = (np.arange(len(radii)) + draw(st.floats(0, 1))) * 2 * math.pi / len(radii)
    corners = [(x + r * math.cos(turn), y + r * math.sin(turn)) for r, turn in zip(radii, turns.tolist(), strict=True)]
    return corners[::-1] if draw(st.booleans()) else corners


somewhere = st.tuples(st.floats(-2, 2), st.floats(-2, 2))


@pytest.mark.parametrize("shift", [1e-8, 1e-10])
def test_within_a_billionth_of_the_boundary_is_on_it(shift: float) -> None:
    inward = np.array([(shift, 0.5), (1 - shift, 0.5), (0.5, shift), (0.5, 1 - shift)])
    outward = np.array([(-shift, 0.5), (1 + shift, 0.5), (0.5, -shift), (0.5, 1 + shift)])
    on_it = shift < 1e-9
    assert (Zones(keep_out=[SQUARE]).allow_points(inward) == on_it).all()
    assert Zones(keep_out=[SQUARE]).allow_points(outward).all()
    assert (Zones(keep_in=[SQUARE]).allow_points(outward) == on_it).all()
    assert Zones(keep_in=[SQUARE]).allow_points(inward).all()


@pytest.mark.parametrize(
    ("start", "end", "allowed"),
    [
        ((-1, 0.5), (2, 0.5), False),  # through
        ((-1, 0.5), (0, 0.5), True),  # up to the boundary
        ((0, 0.5), (0.5, 0), False),  # from boundary to boundary through a corner's inside
        ((-1, 0), (2, 0), True),  # along a side and beyond it
        ((-1, 1), (1, -1), True),  # past a corner
        ((0.5, 0.5), (0.5, 0.5), False),  # no length, inside
        ((1, 0.5), (1, 0.5), True),  # no length, on the boundary
    ],
)
def test_segments_against_a_forbidden_square(start: Any, end: Any, allowed: bool) -> None:
    zones = Zones(keep_out=[SQUARE])
    assert zones.allow_segments([start], [end]).tolist() == [allowed]
    assert zones.allow_segments([end], [start]).tolist() == [allowed]


def test_without_polygons_everything_is_allowed_and_no_points_are_no_answers() -> None:
    assert Zones().allow_points([(0, 0), (9, 9)]).all()
    assert Zones().allow_segments([(0, 0)], [(9, 9)]).all()
    zones = Zones(keep_in=[SQUARE], keep_out=[BESIDE])
    assert zones.allow_points(np.zeros((0, 2))).shape == zones.allow_segments(*np.zeros((2, 0, 2))).shape == (0,)


def test_several_polygons() -> None:
    # The side that two permitted polygons share lies in neither's interior, and is allowed; of two forbidden ones too.
    union, both = Zones(keep_in=[SQUARE, BESIDE]), Zones(keep_out=[SQUARE, BESIDE])
    assert union.allow_points([(0.5, 0.5), (1.5, 0.5), (1, 0.5), (2.1, 0.5)]).tolist() == [True] * 3 + [False]
    assert union.allow_segments([(0.5, 0.5), (0.5, 0.5)], [(1.5, 0.5), (2.5, 0.5)]).tolist() == [True, False]
    assert both.allow_points([[0.5, 0.5], [1.0, 0.5], [1.5, 0.5]]).tolist() == [False, True, False]
    mixed = Zones(keep_in=[[(-2, -2), (2, -2), (2, 2), (-2, 2)]], keep_out=[SQUARE])
    starts, ends = [(-1, 0.5), (-1, 1.5), (-1, 1.5)], [(1.5, 0.5), (1.5, 1.5), (2.5, 1.5)]
    assert mixed.allow_segments(starts, ends).tolist() == [False, True, False]


@settings(deadline=None, max_examples=60)
@given(corners=star_polygons(), queries=st.lists(somewhere, min_size=1), start=somewhere, end=somewhere)
def test_any_polygon_against_counting_crossings(corners: Corners, queries: Corners, start: Any, end: Any) -> None:
    keep_in, keep_out = Zones(keep_in=[corners]), Zones(keep_out=[corners])
    clear = [point for point in queries if boundary_distance(point, corners) > 1e-6]
    expected = [inside(point, corners) for point in clear]
    assert keep_in.allow_points(clear).tolist() == expected
    assert keep_out.allow_points(clear).tolist() == [not one for one in expected]
    # The boundary itself belongs to both.
    following = np.array([*corners[1:], corners[0]])
    edge = np.vstack([(1 - s) * np.array(corners) + s * following for s in (0.0, 0.3, 0.5)])
    assert keep_in.allow_points(edge).all()
    assert keep_out.allow_points(edge).all()
    # An allowed segment has allowed points only, and a forbidden end forbids it.
    samples = np.array(start) + np.linspace(0, 1, 101)[:, None] * (np.array(end) - np.array(start))
    for zones in (keep_in, keep_out):
        assert zones.allow_points(samples).all() or not zones.allow_segments([start], [end])[0]
        assert zones.allow_points(samples[[0, -1]]).all() or not zones.allow_segments([end], [start])[0]


def test_corners_may_be_texts_arrays_and_closed_twice_and_are_copied() -> None:
    typed = Zones(keep_out=[[("0", "0"), ("pi/4", 0), ["45deg", "π/4"], (0, "0.5")]])
    assert typed.keep_out == (((0.0, 0.0), (math.pi / 4, 0.0), (math.pi / 4, math.pi / 4), (0.0, 0.5)),)
    corners = np.array([*SQUARE, SQUARE[0]])
    zones = Zones(keep_out=[corners])
    corners[0][0] = -5.0
    assert zones.keep_out == (tuple(SQUARE),)
    assert zones == Zones(keep_out=[SQUARE])
    assert hash(zones) == hash(Zones(keep_out=(tuple(SQUARE),)))
    assert Zones(keep_in=[SQUARE]) != zones


def test_what_is_no_list_of_polygons_is_refused() -> None:
    with pytest.raises(InputError, match="^keep_in must be a list of polygons, each a list of .*, got 'square'"):
        Zones(keep_in="square")


@pytest.mark.parametrize("name", ["keep_out", "keep_in"])
@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        (3, "must be a list of corners [alpha1, alpha2], got 3"),
        ("square", "must be a list of corners [alpha1, alpha2], got 'square'"),
        ([(0, 0), (1, 0), (0.5,)], "must be a list of corners [alpha1, alpha2], got [(0, 0), (1, 0), (0.5,)]"),
        ([], "must have three or more corners that are not on a line, got []"),
        ([(0, 0), (1, 0), (0, 0), (1, 0)], "must have three or more corners that are not on a line"),
        ([(0, 0), (1, 1), (2, 2)], "must have three or more corners that are not on a line"),
        ([(0, 0), (1e-7, 0), (0, 1e-7)], "must have three or more corners that are not on a line"),
        ([(0, 0), (1, 0), (0, "x")], "alpha2 must be a finite number in radians"),
        ([(0, 0), (1, 0), (1e7, 1)], "must have angles up to 1e+06 rad, got [(0, 0), (1, 0), (10000000.0, 1)]"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "must be a simple polygon: "),  # a bow tie
        ([(0, 0), (1, 1), (2, 0), (2, 2), (1, 1), (0, 2)], "must be a simple polygon: "),  # two that touch
    ],
)
def test_a_malformed_polygon_is_refused_with_its_number(name: str, corners: Any, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        Zones(**{name: [SQUARE, corners, BESIDE]})
    message = str(caught.value)
    assert message.startswith(f"{name} polygon 2")
    assert expected in message
    assert "\n" not in message


def test_the_region_of_zones_is_exact() -> None:
    square = [(0.0, 0.0), (0.3, 0.1), (0.2, 0.4), (-0.1, 0.3)]
    region = zones_region(Zones(keep_out=[square], keep_in=[[(-1, -1), (1, -1), (1, 1), (-1, 1)]]))
    following = np.array(square[1:] + square[:1])
    assert region.contains(np.vstack([(1 - t) * np.array(square) + t * following for t in (0.0, 0.3, 0.77)])).all()
    assert region.why_not([0.1, 0.2]) == "inside keep_out polygon 1"
    assert region.why_not([1.2, 0.0]) == "outside the keep_in polygons"
    assert region.contains([[1.0, 1.0], [1.0, 1.0 + 1e-9]]).tolist() == [True, False]
    assert set(square) <= {tuple(at) for at in shapely.get_coordinates(region.inner).tolist()}
    assert region.accuracy == 0.0
    assert region.inner.equals(region.outer)
    assert "exact borders" in str(region)
