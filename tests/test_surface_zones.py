"""The user's own polygons."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.surface.region import Zones, zones_region

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
BESIDE = [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)]


@pytest.mark.parametrize("shift", [1e-8, 1e-10])
def test_within_a_billionth_of_the_boundary_is_on_it(shift: float) -> None:
    inward = np.array([(shift, 0.5), (1 - shift, 0.5), (0.5, shift), (0.5, 1 - shift)])
    outward = np.array(
        [(-shift, 0.5), (1 + shift, 0.5), (0.5, -shift), (0.5, 1 + shift)]
    )
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
        (
            (0, 0.5),
            (0.5, 0),
            False,
        ),  # from boundary to boundary through a corner's inside
        ((-1, 0), (2, 0), True),  # along a side and beyond it
        ((-1, 1), (1, -1), True),  # past a corner
        ((0.5, 0.5), (0.5, 0.5), False),  # no length, inside
        ((1, 0.5), (1, 0.5), True),  # no length, on the boundary
    ],
)
def test_segments_against_a_forbidden_square(
    start: Any, end: Any, allowed: bool
) -> None:
    zones = Zones(keep_out=[SQUARE])
    assert zones.allow_segments([start], [end]).tolist() == [allowed]
    assert zones.allow_segments([end], [start]).tolist() == [allowed]


def test_a_keep_out_beside_the_square_forbids_nothing_and_is_named() -> None:
    beside = [(2, 2), (3, 2), (3, 3)]
    loop = [(0.4, -0.4), (0.8, -0.4), (0.8, -0.8)]
    (note,) = Zones(keep_out=[SQUARE, beside]).notes
    assert note.startswith("keep_out polygon 2 forbids nothing")
    asked: Any = {"keep_out": [beside]}
    plan, freely = gg.plan_loop(loop, **asked), gg.plan_loop(loop)
    assert (plan.gait.alpha == freely.gait.alpha).all()
    assert [one for one in plan.warnings if "forbids nothing" in one]
    assert "forbids nothing" in gg.retarget(plan.gait, **asked).warnings[0]
    optimal: Any = gg.optimal_gait(loop, objective="hover_reserve", **asked)
    assert "forbids nothing" in optimal.warnings[0]


def test_without_polygons_everything_is_allowed_and_no_points_give_no_answers() -> None:
    assert Zones().allow_points([(0, 0), (9, 9)]).all()
    assert Zones().allow_segments([(0, 0)], [(9, 9)]).all()
    zones = Zones(keep_in=[SQUARE], keep_out=[BESIDE])
    assert (
        zones.allow_points(np.zeros((0, 2))).shape
        == zones.allow_segments(*np.zeros((2, 0, 2))).shape
        == (0,)
    )


def test_several_polygons() -> None:
    # A side that two polygons share is allowed, whether both are permitted or both are forbidden.
    union, both = Zones(keep_in=[SQUARE, BESIDE]), Zones(keep_out=[SQUARE, BESIDE])
    assert union.allow_points(
        [(0.5, 0.5), (1.5, 0.5), (1, 0.5), (2.1, 0.5)]
    ).tolist() == [True] * 3 + [False]
    assert union.allow_segments(
        [(0.5, 0.5), (0.5, 0.5)], [(1.5, 0.5), (2.5, 0.5)]
    ).tolist() == [True, False]
    assert both.allow_points([[0.5, 0.5], [1.0, 0.5], [1.5, 0.5]]).tolist() == [
        False,
        True,
        False,
    ]
    mixed = Zones(keep_in=[[(-2, -2), (2, -2), (2, 2), (-2, 2)]], keep_out=[SQUARE])
    starts, ends = (
        [(-1, 0.5), (-1, 1.5), (-1, 1.5)],
        [(1.5, 0.5), (1.5, 1.5), (2.5, 1.5)],
    )
    assert mixed.allow_segments(starts, ends).tolist() == [False, True, False]


def test_corners_may_be_texts_arrays_and_closed_twice_and_are_copied() -> None:
    typed = Zones(keep_out=[[("0", "0"), ("pi/4", 0), ["45deg", "π/4"], (0, "0.5")]])
    assert typed.keep_out == (
        ((0.0, 0.0), (math.pi / 4, 0.0), (math.pi / 4, math.pi / 4), (0.0, 0.5)),
    )
    corners = np.array([*SQUARE, SQUARE[0]])
    zones = Zones(keep_out=[corners])
    corners[0][0] = -5.0
    assert zones.keep_out == (tuple(SQUARE),)
    assert zones == Zones(keep_out=[SQUARE])
    assert hash(zones) == hash(Zones(keep_out=(tuple(SQUARE),)))
    assert Zones(keep_in=[SQUARE]) != zones


def test_the_region_of_zones_is_exact() -> None:
    square = [(0.0, 0.0), (0.3, 0.1), (0.2, 0.4), (-0.1, 0.3)]
    region = zones_region(
        Zones(keep_out=[square], keep_in=[[(-1, -1), (1, -1), (1, 1), (-1, 1)]])
    )
    following = np.array(square[1:] + square[:1])
    assert region.contains(
        np.vstack(
            [(1 - t) * np.array(square) + t * following for t in (0.0, 0.3, 0.77)]
        )
    ).all()
    assert region.why_not([0.1, 0.2]) == "inside keep_out polygon 1"
    assert region.why_not([1.2, 0.0]) == "outside the keep_in polygons"
    assert region.contains([[1.0, 1.0], [1.0, 1.0 + 1e-9]]).tolist() == [True, False]
    assert set(square) <= {
        tuple(at) for at in shapely.get_coordinates(region.inner).tolist()
    }
    assert region.accuracy == 0.0
    assert region.inner.equals(region.outer)
    assert "exact borders" in str(region)
