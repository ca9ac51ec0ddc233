"""Planning again in flight: paths around new keep-outs as short as in a region cut anew, their bounds, their timing."""

from __future__ import annotations

import gc
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


def box(x: float, y: float, right: float, top: float) -> list[tuple[float, float]]:
    return [(x, y), (right, y), (right, top), (x, top)]


AROUND = [(-0.3, 0.3), (-0.3, 0.9), (-0.9, 0.9), (-0.9, 0.3)]
HERE = (-0.5, 0.3)
BOX = box(-0.7, 0.5, -0.5, 0.7)
TURNS = 2 * np.pi * np.arange(6) / 6
HEXAGONS = [
    [(x + 0.09 * np.cos(turn), y + 0.09 * np.sin(turn)) for turn in TURNS]
    for x in (-1.05, -0.75, -0.45, -0.15)
    for y in (0.25, 0.55, 0.85)
]


def prepared(**asked: Any) -> Replanner:
    return Replanner(**{"vehicle": "paper", "sign": "positive", "rate": 3.0, **asked})


def path_of(answer: Replan) -> FloatArray:
    return np.vstack([answer.approach, answer.loop[1:], answer.loop[:1]])


def check_shortest(
    replanner: Replanner, here: Any, stops: Any, keep_out: Any
) -> Replan:
    """Compare an answer with paths in the region that is cut and searched anew, and return it."""
    answer = replanner.replan([*here, *here], stops, keep_out=keep_out)
    forbidden = shapely.union_all([shapely.Polygon(corners) for corners in keep_out])
    free = replanner.region.inner.difference(forbidden)
    ends = [here, *stops, stops[0]]
    legs = [ShortestPaths(free).path(a, b) for a, b in pairwise(ends)]
    known = [leg for leg in legs if leg is not None]
    assert bool(answer) is (len(known) == len(legs)), answer.reason
    if answer:
        line = shapely.LineString(path_of(answer).repeat(2, axis=0))
        assert line.intersection(forbidden.buffer(-1e-9)).is_empty
        assert line.difference(replanner.region.inner.buffer(1e-9)).is_empty
        lengths = [np.hypot(*np.diff(leg, axis=0).T).sum() for leg in known]
        assert line.length == pytest.approx(sum(lengths), abs=1e-9)
    return answer


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"keep_out": HEXAGONS},
        {"sign": "negative", "floor": 0.3},
        {"vehicle": "gimbalrotor", "sign": "negative"},  # rotors above the centre
    ],
)
def test_random_requests_are_answered_by_the_shortest_paths_and_they_fly(
    asked: dict[str, Any],
) -> None:
    replanner = prepared(**asked)
    shares = []
    for alpha, stops, keep_out in replan_requests(
        replanner.region, np.random.default_rng(7), 8
    ):
        answer = check_shortest(replanner, alpha[:2], stops, keep_out)
        if not answer:
            continue
        # The least singular value is proven, and near to what is sampled.
        points = np.concatenate(
            [
                np.linspace(a, b, 300)[:, [0, 1, 0, 1]]
                for a, b in pairwise(path_of(answer))
            ]
        )
        vehicle = replanner.vehicle
        values = least_singular_value_on_red(points[:, 0], points[:, 1], vehicle)
        worst = scaled_decoupling_matrix(points[values.argmin()], vehicle)
        with mpmath.workdps(30):
            exact = min(mpmath.svd(mpmath.matrix(worst), compute_uv=False))
        bound = answer.least_singular_value
        assert replanner.floor <= bound <= min(values.min() + 1e-12, exact)
        shares.append(bound / values.min())
        assert gg.validate(answer.timed.gait, floor=replanner.floor).flyable
        assert answer.entry.check(floor=replanner.floor).flyable
    assert len(shares) > 3
    assert min(shares) > 0.95


def test_a_loop_is_as_short_as_that_of_a_plan() -> None:
    replanner = prepared()
    for _, stops, keep_out in replan_requests(
        replanner.region, np.random.default_rng(3), 6
    ):
        plan = gg.plan_loop(stops, color="red", sign="positive", keep_out=keep_out)
        answer = replanner.replan([*stops[0]] * 2, stops, keep_out=keep_out)
        assert bool(plan) is bool(answer)
        if plan.loop is not None:
            assert answer.approach.tolist() == [list(stops[0])]
            length = shapely.LinearRing(answer.loop).length
            assert length == pytest.approx(plan.loop.length, abs=1e-9)


# -- Hard cases of polygons

HALVES = [
    box(-2.0, 0.5, -0.6, 0.7),
    box(-0.6, 0.5, 0.5, 0.7),
]
INSIDE = box(-0.7, 0.2, -0.5, 1.0)
OLD = box(-0.8, 0.4, -0.4, 0.7)
TOUCHED = [(-0.45, 0.25), (-0.5, 0.2), (-0.6, 0.2), (-0.6, 0.1), (-0.4, 0.05)]
PINCHED = [
    (-0.5, 0.25),
    (-0.45, 0.25),
    (-0.65, 0.35),
    (-0.65, 0.5),
    (-0.85, 0.25),
    (-0.85, 0.15),
    (-0.45, 0.15),
]
ROOM = [
    box(*wall)
    for wall in (
        (-0.9, 0.4, -0.8, 0.9),
        (-0.9, 0.9, -0.4, 1.0),
        (-0.4, 0.4, -0.3, 0.9),
        (-0.8, 0.3, -0.4, 0.4),
    )
]
FRAME = [
    box(*part)
    for part in (
        (-1.1, 0.1, -0.8, 1.1),
        (-0.8, 0.8, -0.1, 1.1),
        (-0.8, 0.1, -0.1, 0.4),
        (-0.3, 0.4, -0.1, 0.8),
    )
]
BLOCK = box(-0.5, 0.3, -0.3, 0.6)
SQUARES = [
    box(x, y, x + 0.02, y + 0.02)
    for x in np.linspace(-0.95, -0.5, 10)
    for y in np.linspace(0.4, 0.9, 10)
]
HARD: list[tuple[dict[str, Any], Any, Any, Any]] = [
    # What is known before, the polygons that are new, the present place, and the stops.
    # Nothing passes between keep-outs that share a side, old or new, or past one from border to border.
    ({}, HALVES, (-0.6, 0.3), [(-0.6, 0.9)]),
    ({"keep_out": HALVES[:1]}, HALVES[1:], (-0.6, 0.3), [(-0.6, 0.9)]),
    ({"keep_in": [INSIDE]}, [BOX], (-0.6, 0.3), [(-0.6, 0.9)]),
    (
        {"keep_in": [INSIDE]},
        [box(-0.7, 0.5, -0.55, 0.7)],
        (-0.6, 0.3),
        [(-0.6, 0.9)],
    ),
    # On corners and sides; corners that repeat.
    ({}, [BOX], (-0.7, 0.6), [(-0.7, 0.5), (-0.5, 0.7), (-0.5, 0.55)]),
    ({}, [np.repeat(BOX, 2, axis=0)], (-0.6, 0.3), [(-0.6, 0.9)]),
    # From sides of new keep-outs, by rounding inside or outside, past others.
    (
        {},
        [
            [(-0.3, 1.1), (-0.8, 1.0), (-0.7, 0.7)],
            [(-1.3, 0.3), (-1.5, 0.0), (-0.9, -0.1)],
        ],
        (-1.0, 0.4),
        [(-0.6, 0.8)],
    ),
    (
        {},
        [[(0.04, 0.48), (-0.07, 0.54), (-0.09, 0.64), (-0.19, 0.44)]],
        (-0.08, 0.59),
        [(-0.104467, 0.611066)],
    ),
    (
        {},
        [[(-0.2, 0.2), (-0.5, 0.1), (-0.3, 0.0), (-0.3, 0.0)]],
        (-0.2, 0.2),
        [(-0.4, 0.05)],
    ),
    # Along a side of an old one that a new one overlaps; past a corner at which a hole between two touches their border.
    (
        {"keep_out": [OLD]},
        [box(-0.9, 0.35, -0.7, 0.75)],
        (-0.45, 0.3),
        [(-0.45, 0.8)],
    ),
    ({"keep_out": [TOUCHED]}, [PINCHED], (-0.35, 0.0), [(-0.79, 0.73)]),
    # A corner of one on a side of another; a corner that two share is a passage.
    (
        {},
        [
            box(-1, 0.225, -0.625, 1.1),
            [(-1, 0.35), (-0.75, 0.85), (-0.25, 0.35)],
        ],
        (-1.0, 0.1),
        [(-0.75, 1.1)],
    ),
    ({}, ROOM, (-0.6, 0.6), [(-0.6, 0.2)]),
    ({}, ROOM, (-0.6, 0.6), [(-0.6, 0.3)]),
    # Partly in a corridor of keep_in, partly in its hole.
    ({"keep_in": FRAME}, [BLOCK], (-0.51, 0.22), [(-0.35, 0.9)]),
    ({"keep_in": FRAME, "keep_out": [BLOCK]}, [], (-0.51, 0.22), [(-0.35, 0.9)]),
    ({}, SQUARES, (-0.97, 0.3), [(-0.4, 0.95), (-0.97, 0.97)]),
]


@pytest.mark.parametrize(("asked", "new", "here", "stops"), HARD)
def test_so_are_hard_cases(asked: Any, new: Any, here: Any, stops: Any) -> None:
    check_shortest(prepared(**asked), here, stops, new)


def test_waypoints_on_slanted_sides_are_passed_around_the_keep_out() -> None:
    """By rounding they are inside or outside; a path along one side needs no detour."""
    replanner, rng = prepared(), np.random.default_rng(1)
    corners = np.array([(-0.7, 0.5), (-0.45, 0.61), (-0.53, 0.73), (-0.66, 0.71)])
    following = np.roll(corners, -1, axis=0)
    for _ in range(50):
        on_sides = corners + rng.uniform(0.05, 0.95, (4, 1)) * (following - corners)
        here, *stops = rng.permutation(on_sides)[:3].tolist()
        assert check_shortest(replanner, here, stops, [corners.tolist()])


# -- Timing


def test_the_speed_is_constant_and_the_fastest_that_rates_allow() -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate=[3.0, 1.0, 2.0, 4.0])
    here = [-0.1, 0.8, -0.1, 0.8]
    answer = Replanner(vehicle, sign="positive").replan(here, AROUND)
    path = path_of(answer)[:, [0, 1, 0, 1]]
    seconds = np.linspace(0, answer.duration + answer.period, 20_001)
    motion = answer.at(seconds)
    np.testing.assert_allclose(motion.alpha[[0, -1]], path[[0, -1]], atol=1e-12)
    assert not motion.accelerations.any()
    rates = np.abs(np.diff(motion.alpha, axis=0) / seconds[1])
    speeds = np.linalg.norm(motion.rates, axis=1)
    assert speeds == pytest.approx(speeds.max(), rel=1e-9)
    # Arms 2 and 4 are the slowest along these sides; no rate exceeds its limit by rounding.
    assert rates.max(axis=0) == pytest.approx([1.0] * 4, rel=1e-9)
    assert (np.abs(motion.rates).max(axis=0) <= [2.0, 1.0, 2.0, 1.0]).all()
    later = answer.at(answer.duration + 3 * answer.period)
    np.testing.assert_allclose(later.alpha, motion.alpha[-1], atol=1e-9)
    for rate, slower in ((50.0, 1), (0.25, 4)):  # the vehicle's limits hold too
        other = Replanner(vehicle, sign="positive", rate=rate).replan(here, AROUND)
        assert other.period == pytest.approx(slower * answer.period)


def test_nothing_moves_or_nothing_is_approached() -> None:
    replanner, at = prepared(), [*AROUND[0]] * 2
    posture = replanner.replan(at, AROUND[:1])
    assert (posture.duration, posture.period) == (0.0, 0.0)
    assert posture.at(7.0).alpha.tolist() == at
    answer = replanner.replan(np.array(at), np.array([*AROUND, AROUND[0]]))
    assert (len(answer.approach), answer.duration) == (1, 0.0)
    assert answer.loop.tolist() == [[*stop] for stop in AROUND]
    assert "0.800 s around, least singular value at least 0.692" in repr(answer)


# -- Refusals

WALL = box(-2.0, 0.5, 0.5, 0.7)
EVERYWHERE = box(-2.0, -2.0, 2.0, 2.0)


@pytest.mark.parametrize(
    ("asked", "alpha", "stops", "keep_out", "reason"),
    [
        ({}, (*HERE, -0.5, 0.31), AROUND, [], "present angles are 0.01 rad off red"),
        (
            {},
            (-0.6, 0.6) * 2,
            AROUND,
            [BOX],
            "inside a new keep_out polygon; the nearest",
        ),
        ({}, (0.5, 0.5) * 2, AROUND, [], "the present angles (0.5000, 0.5000): hover"),
        (
            {},
            HERE * 2,
            [*AROUND, (0.8, -0.8)],
            [],
            "waypoint 5 (0.8000, -0.8000): R at",
        ),
        (
            {},
            HERE * 2,
            AROUND,
            [WALL],
            "waypoint 1 and waypoint 2 are separated by keep",
        ),
        ({}, HERE * 2, AROUND, [EVERYWHERE], "no point is admissible"),
        ({"floor": 5.0}, HERE * 2, AROUND, [], "no point is admissible"),
        (
            {"sign": "auto"},
            HERE * 2,
            [(0.8, -0.8)],
            [],
            "separated by the curve tan α1",
        ),
    ],
)
def test_refusals_say_why(
    asked: Any, alpha: Any, stops: Any, keep_out: Any, reason: str
) -> None:
    answer = prepared(**asked).replan(alpha, stops, keep_out=keep_out)
    assert not answer
    assert reason in str(answer.reason)
    with pytest.raises(gg.Infeasible):
        _ = answer.timed


@pytest.mark.parametrize(
    ("asked", "alpha", "stops", "keep_out", "name"),
    [
        ({"sign": "up"}, HERE * 2, AROUND, [], "sign"),
        ({"rate": 0.0}, HERE * 2, AROUND, [], "rate"),
        (
            {"vehicle": gg.PAPER.replace(max_tilt_jerk=30.0)},
            HERE * 2,
            AROUND,
            [],
            "vehicle",
        ),
        ({}, HERE, AROUND, [], "alpha"),
        ({}, (4.0,) * 4, AROUND, [], "alpha"),
        ({}, HERE * 2, [], [], "waypoints"),
        ({}, HERE * 2, AROUND, [[(0, 0), (1, 1)]], "keep_out"),
    ],
)
def test_bad_input_is_named(
    asked: Any, alpha: Any, stops: Any, keep_out: Any, name: str
) -> None:
    with pytest.raises(gg.InputError, match=f"^{name} "):
        prepared(**asked).replan(alpha, stops, keep_out=keep_out)


def test_times_are_not_negative_and_a_rate_must_be_known() -> None:
    answer = prepared().replan(HERE * 2, AROUND)
    with pytest.raises(gg.InputError, match="^t must be finite times of at least 0 s"):
        answer.at(-0.1)
    with pytest.raises(gg.errors.MissingConstant, match="max_tilt_rate"):
        Replanner("paper")


@pytest.mark.slow
@pytest.mark.parametrize("old", [[], HEXAGONS])
def test_memory_does_not_grow(old: Any) -> None:
    replanner, sizes = prepared(keep_out=old), []
    # numpy keeps freed small blocks, and other threads of the test run allocate too
    ours = [tracemalloc.Filter(True, "*/gaitgraph/*")]
    tracemalloc.start()
    requests = replan_requests(replanner.region, np.random.default_rng(5), 1500)
    for number, (alpha, stops, keep_out) in enumerate(requests, start=1):
        replanner.replan(alpha, stops, keep_out=keep_out)
        if number in (1000, 1500):  # after 1000 the corners seen are known
            gc.collect()
            kept = tracemalloc.take_snapshot().filter_traces(ours)
            sizes.append(sum(one.size for one in kept.statistics("filename")))
    tracemalloc.stop()
    assert sizes[1] - sizes[0] < 20_000  # 40 bytes a request, less than any object
