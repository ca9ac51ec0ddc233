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
UNIT = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
AROUND = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]
OUT, IN = Zones(keep_out=[SQUARE]), Zones(keep_in=[SQUARE])


@pytest.mark.parametrize("shift", [1e-8, 1e-10])
def test_within_a_billionth_of_the_boundary_is_on_it(shift: float) -> None:
    inward = np.array([(shift, 0.5), (1 - shift, 0.5), (0.5, shift), (0.5, 1 - shift)])
    outward = inward + 2 * (inward - 0.5 > 0.4) * shift - 2 * (inward < 0.4) * shift
    on_it = shift < 1e-9
    assert (OUT.allow_points(inward) == on_it).all()
    assert OUT.allow_points(outward).all()
    assert (IN.allow_points(outward) == on_it).all()
    assert IN.allow_points(inward).all()


BOTH = Zones(keep_in=[AROUND], keep_out=[SQUARE])


@pytest.mark.parametrize(
    ("zones", "start", "end", "allowed"),
    [
        (OUT, (-1, 0.5), (2, 0.5), False),  # through
        (OUT, (-1, 0.5), (0, 0.5), True),  # up to the boundary
        (OUT, (0, 0.5), (0.5, 0), False),  # from boundary to boundary, inside
        (OUT, (-1, 0), (2, 0), True),  # along a side and beyond it
        (OUT, (-1, 1), (1, -1), True),  # past a corner
        (OUT, (0.5, 0.5), (0.5, 0.5), False),  # no length, inside
        (OUT, (1, 0.5), (1, 0.5), True),  # no length, on the boundary
        (Zones(keep_in=[SQUARE, BESIDE]), (0.5, 0.5), (1.5, 0.5), True),
        (Zones(keep_in=[SQUARE, BESIDE]), (0.5, 0.5), (2.5, 0.5), False),
        (Zones(keep_out=[SQUARE, BESIDE]), (1, 0), (1, 1), True),  # between the two
        (BOTH, (-1, 0.5), (1.5, 0.5), False),
        (BOTH, (-1, 1.5), (1.5, 1.5), True),
        (BOTH, (-1, 1.5), (2.5, 1.5), False),
        (Zones(), (0, 0), (9, 9), True),
    ],
)
def test_segments_against_polygons(
    zones: Zones, start: Any, end: Any, allowed: bool
) -> None:
    assert zones.allow_segments([start], [end]).tolist() == [allowed]
    assert zones.allow_segments([end], [start]).tolist() == [allowed]
    if start == end or zones == Zones():
        assert zones.allow_points([end]).tolist() == [allowed]


def test_no_points_give_no_answers() -> None:
    assert BOTH.allow_points(np.zeros((0, 2))).shape == (0,)
    assert BOTH.allow_segments(*np.zeros((2, 0, 2))).shape == (0,)


def test_a_keep_out_beside_the_square_forbids_nothing_and_is_named() -> None:
    beside = [(2, 2), (3, 2), (3, 3)]
    (note,) = Zones(keep_out=[SQUARE, beside]).notes
    assert note.startswith("keep_out polygon 2 forbids nothing")
    loop = [(0.4, -0.4), (0.8, -0.4), (0.8, -0.8)]
    plan = gg.plan_loop(loop, keep_out=[beside])
    np.testing.assert_array_equal(plan.gait.alpha, gg.plan_loop(loop).gait.alpha)
    retargeted = gg.retarget(plan.gait, keep_out=[beside])
    for warnings in (plan.warnings, retargeted.warnings):
        assert any("forbids nothing" in text for text in warnings)


def test_corners_may_be_texts_arrays_and_closed_twice_and_are_copied() -> None:
    typed = Zones(keep_out=[[("0", "0"), ("pi/4", 0), ["45deg", "π/4"]]])
    quarter = math.pi / 4
    assert typed.keep_out == (((0.0, 0.0), (quarter, 0.0), (quarter, quarter)),)
    corners = np.array([*SQUARE, SQUARE[0]])
    zones = Zones(keep_out=[corners])
    corners[0][0] = -5.0
    assert zones == OUT != IN
    assert hash(zones) == hash(OUT)


def test_the_region_of_zones_is_exact() -> None:
    hole = [(0.0, 0.0), (0.3, 0.1), (0.2, 0.4), (-0.1, 0.3)]
    region = zones_region(Zones(keep_out=[hole], keep_in=[UNIT]))
    starts, ends = np.array(hole), np.roll(hole, -1, axis=0)
    for share in (0.0, 0.3, 0.77):
        assert region.contains((1 - share) * starts + share * ends).all()
    assert region.why_not([0.1, 0.2]) == "inside keep_out polygon 1"
    assert region.why_not([1.2, 0.0]) == "outside the keep_in polygons"
    assert region.contains([[1.0, 1.0], [1.0, 1.0 + 1e-9]]).tolist() == [True, False]
    assert set(hole) <= set(map(tuple, shapely.get_coordinates(region.inner).tolist()))
    assert region.accuracy == 0.0
    assert region.inner.equals(region.outer)
