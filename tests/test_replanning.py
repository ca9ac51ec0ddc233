"""Planning again in flight: paths around new keep-outs, their lower bounds, their timing, their refusals."""

from __future__ import annotations

import gc
import re
import tracemalloc
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.matrices import (
    least_singular_value_on_red,
    scaled_decoupling_matrix,
)
from gaitgraph.planning import Replan, Replanner, ShortestPaths
from tests.samples import replan_requests

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray

AROUND = [(-0.3, 0.3), (-0.3, 0.9), (-0.9, 0.9), (-0.9, 0.3)]
HERE = [-0.5, 0.3, -0.5, 0.3]
WALL = [(-2.0, 0.5), (0.5, 0.5), (0.5, 0.7), (-2.0, 0.7)]
# Vehicles with and without curved borders, and with rotors above the centre of mass.
CASES = [
    ("paper", "positive", 0.05),
    ("paper", "negative", 0.3),
    ("gimbalrotor", "negative", 0.05),
]
TURNS = 2 * np.pi * np.arange(6) / 6
PLACES = [(x, y) for x in (-1.05, -0.75, -0.45, -0.15) for y in (0.25, 0.55, 0.85)]
HEXAGONS = [
    [(x + 0.09 * np.cos(turn), y + 0.09 * np.sin(turn)) for turn in TURNS]
    for x, y in PLACES
]


@pytest.fixture(scope="module")
def replanner() -> Replanner:
    return Replanner("paper", sign="positive", rate=3.0)


def path_of(found: Replan) -> FloatArray:
    return np.vstack([found.approach, found.loop[1:], found.loop[:1]])


@pytest.mark.parametrize(
    ("vehicle", "sign", "floor", "old"),
    [*((*case, []) for case in CASES), (*CASES[0], HEXAGONS)],
)
def test_random_requests(vehicle: str, sign: Any, floor: float, old: Any) -> None:
    replanner = Replanner(vehicle, sign=sign, floor=floor, rate=3.0, keep_out=old)
    shares = []
    for alpha, stops, keep_out in replan_requests(
        replanner.region, np.random.default_rng(7), 8
    ):
        forbidden = shapely.union_all(
            [shapely.Polygon(corners) for corners in keep_out]
        )
        free = replanner.region.inner.difference(forbidden)
        ends = [alpha[:2], *stops, stops[0]]
        found = replanner.replan(alpha, stops, keep_out=keep_out)
        if not found:
            assert not shapely.covers(free, shapely.points(ends)).all(), found.reason
            continue
        # Outside the keep-outs, and as short as paths in the region that is triangulated anew.
        path = path_of(found)
        line = shapely.LineString(path)
        assert line.intersection(forbidden.buffer(-1e-9)).is_empty
        assert line.difference(replanner.region.inner.buffer(1e-9)).is_empty
        anew = ShortestPaths(free)
        legs: list[Any] = [anew.path(a, b) for a, b in pairwise(ends)]
        assert line.length == pytest.approx(
            sum(shapely.LineString(leg).length for leg in legs), abs=1e-9
        )
        # The least singular value is proven, and near to what is sampled.
        points = np.concatenate(
            [a + np.linspace(0, 1, 300)[:, None] * (b - a) for a, b in pairwise(path)]
        )
        values = least_singular_value_on_red(
            points[:, 0], points[:, 1], replanner.vehicle
        )
        assert floor <= found.least_singular_value <= values.min() + 1e-12
        shares.append(found.least_singular_value / values.min())
        with mpmath.workdps(30):
            worst = points[values.argmin()][[0, 1, 0, 1]]
            exact = mpmath.svd(
                mpmath.matrix(scaled_decoupling_matrix(worst, replanner.vehicle)),
                compute_uv=False,
            )
            assert found.least_singular_value <= min(exact) * (1 + 1e-12)
        # Both parts fly.
        assert gg.validate(found.timed.gait, floor=floor).flyable
        assert found.entry.check(floor=floor).flyable
    assert min(shares) > 0.95
    assert len(shares) > 3


def test_as_short_as_a_plan(replanner: Replanner) -> None:
    for _, stops, keep_out in replan_requests(
        replanner.region, np.random.default_rng(3), 6
    ):
        plan = gg.plan_loop(stops, color="red", sign="positive", keep_out=keep_out)
        found = replanner.replan([*stops[0], *stops[0]], stops, keep_out=keep_out)
        assert bool(plan) == bool(found)
        if plan.loop is not None:
            assert found.approach.tolist() == [list(stops[0])]
            assert shapely.LinearRing(found.loop).length == pytest.approx(
                plan.loop.length, abs=1e-9
            )


def test_the_speed_is_constant_and_the_fastest_that_rates_allow() -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate=[3.0, 1.0, 2.0, 4.0])
    found = Replanner(vehicle, sign="positive").replan([-0.1, 0.8, -0.1, 0.8], AROUND)
    path = path_of(found)
    seconds = np.linspace(0, found.duration + found.period, 20_001)
    motion = found.at(seconds)
    angles = motion.alpha
    assert np.abs(angles[[0, -1]] - path[[0, -1]][:, [0, 1, 0, 1]]).max() < 1e-12
    rates = np.abs(np.diff(angles, axis=0) / np.diff(seconds)[:, None])
    assert np.abs(motion.rates).max(axis=0) == pytest.approx(rates.max(axis=0))
    assert not motion.accelerations.any()
    assert (rates.max(axis=0) <= np.array([2.0, 1.0, 2.0, 1.0]) * (1 + 1e-9)).all()
    assert rates.max(axis=0) == pytest.approx(
        [1.0] * 4, rel=1e-9
    )  # arms 2 and 4 are the slowest along these sides
    speeds = np.linalg.norm(rates, axis=1)
    assert np.median(speeds) == pytest.approx(speeds.max(), rel=1e-9)
    later = found.at(found.duration + 3 * found.period)
    assert later.alpha == pytest.approx(angles[-1], abs=1e-9)
    assert found.timed.check().flyable
    faster = Replanner(vehicle, sign="positive", rate=50.0).replan(
        [-0.1, 0.8, -0.1, 0.8], AROUND
    )
    assert faster.period == found.period  # the vehicle's limits hold too
    for wrong in (-0.1, "a", [[0.1], [0.2, 0.3]], [0.1, None]):
        wanted = f"t must be finite times of at least 0 s, got {wrong!r}"
        with pytest.raises(gg.errors.InputError, match=f"^{re.escape(wanted)}$"):
            found.at(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("sign", ["up", "both", None, 1])
def test_a_sign_is_one_of_three(sign: Any) -> None:
    with pytest.raises(
        gg.errors.InputError,
        match="^sign must be one of auto, positive, negative, got ",
    ):
        Replanner("padova", sign=sign)


def test_nothing_moves_or_nothing_to_approach(replanner: Replanner) -> None:
    at = [*AROUND[0], *AROUND[0]]
    posture = replanner.replan(at, [AROUND[0], AROUND[0]])
    assert (posture.duration, posture.period, posture.at(7.0).alpha.tolist()) == (
        0.0,
        0.0,
        at,
    )
    found = replanner.replan(np.array(at), np.array([*AROUND, AROUND[0]]))
    assert (len(found.approach), found.duration, found.loop.tolist()) == (
        1,
        0.0,
        [[*stop] for stop in AROUND],
    )
    assert (
        repr(found)
        == "<Replan: 0.000 s to the loop, 0.800 s around, least singular value at least 0.692>"
    )
    with pytest.raises(ValueError, match="read-only"):
        found.loop[0] = 0.0


def test_refusals_say_why(replanner: Replanner) -> None:
    box = [(-0.6, 0.2), (-0.4, 0.2), (-0.4, 0.4), (-0.6, 0.4)]
    for alpha, stops, keep_out, reason in (
        (
            [-0.5, 0.3, -0.5, 0.31],
            AROUND,
            [],
            "the present angles are 0.01 rad off red",
        ),
        (
            HERE,
            AROUND,
            [box],
            "the present angles (-0.5000, 0.3000): inside a new keep_out polygon; the nearest",
        ),
        (
            [0.5, 0.5] * 2,
            AROUND,
            [],
            "the present angles (0.5000, 0.5000): hover thrusts must be > 0",
        ),
        (
            HERE,
            [*AROUND, (0.8, -0.8)],
            [],
            "waypoint 5 (0.8000, -0.8000): R at level attitude must be",
        ),
        (
            HERE,
            AROUND,
            [WALL],
            "waypoint 1 and waypoint 2 are separated by keep_out or the border of the region",
        ),
    ):
        found = replanner.replan(alpha, stops, keep_out=keep_out)
        assert not found
        assert (found.reason or "").startswith(reason)
        assert repr(found).startswith(f"<Replan: none; {reason}")
        with pytest.raises(gg.errors.Infeasible, match="."):
            _ = found.timed
    everywhere = [[(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]]
    for one, keep_out in (
        (replanner, everywhere),
        (Replanner("paper", sign="positive", rate=1.0, floor=5.0), []),
    ):
        assert "no point is admissible" in (
            one.replan(HERE, AROUND, keep_out=keep_out).reason or ""
        )
    both = Replanner("paper", rate=1.0).replan(HERE, [(0.8, -0.8), (0.9, -0.6)])
    assert (both.reason or "").startswith(
        "the present angles and waypoint 1 are separated by the curve tan α1 − tan α2"
    )


def test_bad_input() -> None:
    with pytest.raises(gg.errors.MissingConstant, match="states no max_tilt_rate"):
        Replanner("paper")
    with pytest.raises(
        gg.InputError, match="vehicle must state no max_tilt_acceleration"
    ):
        Replanner({"preset": "padova", "max_tilt_acceleration": 30.0})
    replanner = Replanner("padova", sign="positive")
    for alpha, stops, keep_out, message in (
        ([0.1, 0.2], AROUND, [], "alpha must be four finite tilt angles"),
        ([1e300] * 4, AROUND, [], "alpha must be "),
        (HERE, [], [], "waypoints must be a list of one or more"),
        (
            HERE,
            AROUND,
            [[(0, 0), (1, 1)]],
            "keep_out polygon 1 must have three or more corners",
        ),
    ):
        with pytest.raises(gg.InputError, match=message):
            replanner.replan(alpha, stops, keep_out=keep_out)


def test_nothing_passes_between_keep_outs_that_share_a_side() -> None:
    halves = [
        [(-2.0, 0.5), (-0.6, 0.5), (-0.6, 0.7), (-2.0, 0.7)],
        [(-0.6, 0.5), (0.5, 0.5), (0.5, 0.7), (-0.6, 0.7)],
    ]
    stops = [(-0.6, 0.3), (-0.6, 0.9)]
    for before, after in (([], halves), (halves[:1], halves[1:])):
        found = Replanner("paper", sign="positive", rate=1.0, keep_out=before).replan(
            HERE, stops, keep_out=after
        )
        assert "separated" in (found.reason or "")
    inside = [
        [(-0.7, 0.2), (-0.5, 0.2), (-0.5, 1.0), (-0.7, 1.0)]
    ]  # a keep-out from border to border
    across = Replanner("paper", sign="positive", rate=1.0, keep_in=inside)
    wall = [(-0.7, 0.5), (-0.5, 0.5), (-0.5, 0.7), (-0.7, 0.7)]
    assert "separated" in (
        across.replan([-0.6, 0.3] * 2, [(-0.6, 0.9)], keep_out=[wall]).reason or ""
    )
    wall[1:3] = [(-0.55, 0.5), (-0.55, 0.7)]
    found = across.replan([-0.6, 0.3] * 2, [(-0.6, 0.9)], keep_out=[wall])
    assert found.approach.tolist() == [
        [-0.6, 0.3],
        [-0.55, 0.5],
        [-0.55, 0.7],
        [-0.6, 0.9],
    ]
    apart = [
        [(x - 0.01 * (x < -0.6), y) for x, y in halves[0]],
        [(max(x, -0.59), y) for x, y in halves[1]],
    ]
    assert Replanner("paper", sign="positive", rate=1.0).replan(
        HERE, stops, keep_out=apart
    )


def test_waypoints_on_corners_and_sides_of_keep_outs(replanner: Replanner) -> None:
    box = [(-0.7, 0.5), (-0.5, 0.5), (-0.5, 0.7), (-0.7, 0.7)]
    across = [(-0.7, 0.5), (-0.5, 0.7)]  # along the diagonal
    found = replanner.replan(
        [-0.7, 0.6, -0.7, 0.6], [*across, (-0.5, 0.55)], keep_out=[box]
    )
    assert shapely.LinearRing(found.loop).length == pytest.approx(0.8, abs=1e-12)
    assert len(found.loop) == 5


def test_a_keep_out_that_repeats_its_corners_is_passed_as_without(
    replanner: Replanner,
) -> None:
    box = [(-0.7, 0.5), (-0.5, 0.5), (-0.5, 0.7), (-0.7, 0.7)]
    found = [
        replanner.replan(
            [-0.6, 0.3, -0.6, 0.3],
            [(-0.6, 0.9)],
            keep_out=[np.repeat(box, times, axis=0)],
        )
        for times in (1, 2)
    ]
    np.testing.assert_array_equal(found[0].approach, found[1].approach)


def test_waypoints_on_slanted_sides(replanner: Replanner) -> None:
    # By rounding they are inside or outside; a path from side to side goes around, one along a side does not.
    rng = np.random.default_rng(1)
    corners = np.array([(-0.7, 0.5), (-0.45, 0.61), (-0.53, 0.73), (-0.66, 0.71)])
    forbidden, following = shapely.Polygon(corners), np.roll(corners, -1, axis=0)
    for _ in range(100):
        ends = (corners + rng.uniform(0.05, 0.95, (4, 1)) * (following - corners))[
            rng.permutation(4)[:3]
        ]
        found = replanner.replan(
            [*ends[0]] * 2, ends[[1, 2]], keep_out=[corners.tolist()]
        )
        line = shapely.LineString(path_of(found))
        assert line.intersection(forbidden.buffer(-1e-9)).is_empty
        anew = ShortestPaths(replanner.region.inner.difference(forbidden))
        legs: list[Any] = [
            anew.path(ends[a], ends[b]) for a, b in ((0, 1), (1, 2), (2, 1))
        ]
        assert line.length == pytest.approx(
            sum(shapely.LineString(leg).length for leg in legs), abs=1e-9
        )


PINCHED = [
    (-0.5, 0.25),
    (-0.45, 0.25),
    (-0.65, 0.35),
    (-0.65, 0.5),
    (-0.85, 0.25),
    (-0.85, 0.15),
    (-0.45, 0.15),
]
OLD = [(-0.8, 0.4), (-0.4, 0.4), (-0.4, 0.7), (-0.8, 0.7)]
SIDES = [
    # From sides of new keep-outs, by rounding inside or outside, past others.
    (
        (),
        [
            [(-0.3, 1.1), (-0.8, 1.0), (-0.7, 0.7)],
            [(-1.3, 0.3), (-1.5, 0.0), (-0.9, -0.1)],
        ],
        (-1.0, 0.4),
        (-0.6, 0.8),
    ),
    (
        (),
        [[(0.04, 0.48), (-0.07, 0.54), (-0.09, 0.64), (-0.19, 0.44)]],
        (-0.08, 0.59),
        (-0.104467, 0.611066),
    ),
    (
        (),
        [[(-0.2, 0.2), (-0.5, 0.1), (-0.3, 0.0), (-0.3, 0.0)]],
        (-0.2, 0.2),
        (-0.4, 0.05),
    ),
    # Along a side of an old one that a new one overlaps.
    (
        [OLD],
        [[(-0.9, 0.35), (-0.7, 0.35), (-0.7, 0.75), (-0.9, 0.75)]],
        (-0.45, 0.3),
        (-0.45, 0.8),
    ),
    # Past a corner at which a hole, left between two, touches their border.
    (
        [[(-0.45, 0.25), (-0.5, 0.2), (-0.6, 0.2), (-0.6, 0.1), (-0.4, 0.05)]],
        [PINCHED],
        (-0.35, 0.0),
        (-0.79, 0.73),
    ),
]


@pytest.mark.parametrize(("old", "new", "start", "end"), SIDES)
def test_along_sides_paths_are_the_shortest_too(
    old: Any, new: Any, start: Any, end: Any
) -> None:
    replanner = Replanner("paper", sign="positive", rate=3.0, keep_out=old)
    free = replanner.region.inner.difference(
        shapely.union_all([shapely.Polygon(one) for one in new])
    )
    found, shortest = (
        replanner.replan([*start, *start], [end], keep_out=new),
        ShortestPaths(free).path(start, end),
    )
    assert shortest is not None
    np.testing.assert_allclose(found.approach, shortest, atol=1e-12)


def test_nothing_crosses_a_polygon_that_crosses_the_side_of_another() -> None:
    box = np.array([(-0.56, 0.634), (-0.362, 0.666), (-0.394, 0.863), (-0.591, 0.832)])
    side = box[2] - box[1]
    places = ((0.4, -0.06), (0.4, 0.04), (0.6, 0.04), (0.6, -0.06))
    strip = np.array(
        [box[1] + share * side + np.array([out, 0.0]) for share, out in places]
    )
    forbidden = shapely.union_all(
        [shapely.Polygon(box), shapely.Polygon(strip)]
    ).buffer(-1e-9)
    replanner, rng = (
        Replanner("paper", sign="positive", rate=1.0),
        np.random.default_rng(2),
    )
    for low, high in zip(
        rng.uniform(0.05, 0.35, 40), rng.uniform(0.65, 0.95, 40), strict=True
    ):
        found = replanner.replan(
            [*(box[1] + low * side)] * 2, [box[1] + high * side], keep_out=[box, strip]
        )
        assert not shapely.LineString(path_of(found)).intersects(forbidden)


def test_corners_of_other_polygons_on_sides() -> None:
    # A corner of the second lies on a side of the first, where a path goes along; a waypoint on a cut side is outside.
    new = [
        [(-1, 0.225), (-0.625, 0.225), (-0.625, 1.1), (-1, 1.1)],
        [(-1, 0.35), (-0.75, 0.85), (-0.25, 0.35)],
    ]
    along = Replanner("paper", sign="positive", rate=1.0).replan(
        [-1.0, 0.1] * 2, [(-0.75, 1.1)], keep_out=new
    )
    assert along.approach.tolist() == [[-1.0, 0.1], [-1.0, 1.1], [-0.75, 1.1]]
    thirds = [
        [(-0.9, 0.3), (-0.3, 0.5), (-0.9, 0.9)],
        [(-0.8, 0.1), (-0.4, 0.1), (-0.6, 0.6)],
    ]
    cut = shapely.get_coordinates(
        shapely.union_all([shapely.Polygon(one) for one in thirds])
    ).tolist()
    for x, y in cut:
        assert Replanner("paper", sign="positive", rate=1.0).replan(
            [x, y, x, y], [(-0.1, 0.9)], keep_out=thirds
        )


def test_a_keep_out_behind_the_border_leaves_the_free_side_open() -> None:
    corridors: Any = [
        shapely.box(*one) for one in [(-1.1, 0.1, -0.8, 1.1), (-0.8, 0.8, -0.1, 1.1)]
    ]
    corridors += [shapely.box(-0.8, 0.1, -0.1, 0.4), shapely.box(-0.3, 0.4, -0.1, 0.8)]
    within: Any = [list(one.exterior.coords) for one in corridors]
    block = [
        (-0.5, 0.3),
        (-0.3, 0.3),
        (-0.3, 0.6),
        (-0.5, 0.6),
    ]  # partly in a corridor, partly in the hole
    loop = [(-0.51, 0.22), (-0.35, 0.9)]
    plan = gg.plan_loop(loop, keep_out=[block], keep_in=within, sign="positive")
    assert plan.loop
    for old, new in (([], [block]), ([block], [])):
        replanner = Replanner(
            "paper", sign="positive", rate=3.0, keep_in=within, keep_out=old
        )
        found = replanner.replan([*loop[0]] * 2, loop, keep_out=new)
        assert shapely.LinearRing(found.loop).length == pytest.approx(
            plan.loop.length, abs=1e-9
        )


def test_a_corner_that_two_keep_outs_share_is_a_passage(replanner: Replanner) -> None:
    walls = [
        shapely.box(*wall)
        for wall in [
            (-0.9, 0.4, -0.8, 0.9),
            (-0.9, 0.9, -0.4, 1.0),
            (-0.4, 0.4, -0.3, 0.9),
        ]
    ]
    room: Any = [
        list(wall.exterior.coords)
        for wall in [*walls, shapely.box(-0.8, 0.3, -0.4, 0.4)]
    ]
    triangles = [
        [(x, y), (x + 0.01, y), (x, y + 0.01)]
        for x in np.linspace(-0.3, -0.1, 7)
        for y in np.linspace(0.2, 0.4, 7)
    ]
    for end, length in (
        ((-0.6, 0.2), 0.6064495),
        ((-0.6, 0.3), 0.5828427),
    ):  # the second lies on a side
        for keep_out in (room, room + triangles):
            found = replanner.replan([-0.6, 0.6] * 2, [end], keep_out=keep_out)
            assert shapely.LineString(found.approach).length == pytest.approx(
                length, abs=1e-7
            )


@pytest.mark.slow
@pytest.mark.parametrize("old", [[], HEXAGONS])
def test_memory_does_not_grow(old: Any) -> None:
    replanner, sizes = Replanner("paper", sign="positive", rate=3.0, keep_out=old), []
    # numpy keeps freed small blocks, and other threads of the test run allocate too
    ours = [tracemalloc.Filter(True, "*/gaitgraph/*")]
    tracemalloc.start()
    for number, request in enumerate(
        replan_requests(replanner.region, np.random.default_rng(5), 1500), start=1
    ):
        alpha, stops, keep_out = request
        replanner.replan(alpha, stops, keep_out=keep_out)
        if number in (1000, 1500):  # after 1000 the corners seen are known
            gc.collect()
            kept = tracemalloc.take_snapshot().filter_traces(ours)
            sizes.append(sum(one.size for one in kept.statistics("filename")))
    tracemalloc.stop()
    assert sizes[1] - sizes[0] < 20_000  # 40 bytes a request, less than any object


def test_many_keep_outs_are_passed_as_few_are(replanner: Replanner) -> None:
    squares = [
        (x, y) for x in np.linspace(-0.95, -0.5, 10) for y in np.linspace(0.4, 0.9, 10)
    ]
    keep_out = [
        [(x, y), (x + 0.02, y), (x + 0.02, y + 0.02), (x, y + 0.02)] for x, y in squares
    ]
    found = replanner.replan(
        [-0.97, 0.3, -0.97, 0.3], [(-0.4, 0.95), (-0.97, 0.97)], keep_out=keep_out
    )
    within = shapely.union_all([shapely.Polygon(one).buffer(-1e-9) for one in keep_out])
    assert not shapely.LineString(path_of(found)).intersects(within)
    plan = gg.plan_loop(
        [(-0.97, 0.3), (-0.4, 0.95)],
        keep_out=keep_out,
        vehicle="paper",
        sign="positive",
    )
    assert plan.loop
    assert np.hypot(*np.diff(found.approach, axis=0).T).sum() == pytest.approx(
        plan.loop.length / 2, rel=1e-9
    )
