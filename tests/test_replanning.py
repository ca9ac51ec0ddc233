"""Planning again in flight: paths around new keep-outs as short as in a plan, their bounds, their timing."""

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
    least_singular_value,
    scaled_decoupling_matrix,
)
from gaitgraph.planning import Replan, Replanner, ShortestPaths
from tests.samples import points_of, replan_requests

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
    vehicle, shares = replanner.vehicle, []
    requests = replan_requests(replanner.region, np.random.default_rng(7), 8)
    for alpha, stops, keep_out in requests:
        answer = check_shortest(replanner, alpha[:2], stops, keep_out)
        if not answer:
            continue
        # The least singular value is proven, and near to what is sampled.
        ends = path_of(answer)
        points = points_of(ends[:-1], ends[1:], 300).reshape(-1, 2)[:, [0, 1, 0, 1]]
        values = least_singular_value(points, vehicle)
        worst = scaled_decoupling_matrix(points[values.argmin()], vehicle)
        with mpmath.workdps(30):
            exact = min(mpmath.svd(mpmath.matrix(worst), compute_uv=False))
        bound = answer.least_singular_value
        assert replanner.floor <= bound <= min(values.min() + 1e-12, exact)
        shares.append(bound / values.min())
        # The approach and the loop are flown at one speed.
        approach = shapely.LineString(answer.approach.repeat(2, axis=0)).length
        around = shapely.LinearRing(answer.loop).length
        expected = around * answer.duration
        assert approach * answer.period == pytest.approx(expected, abs=1e-9)
        assert gg.validate(answer.timed.gait, floor=replanner.floor).flyable
        assert answer.entry.check(floor=replanner.floor).flyable
        turn = answer.entry.at(answer.duration).alpha[:2]
        np.testing.assert_allclose(turn, answer.loop[0], atol=1e-9)
    assert len(shares) > 3
    assert min(shares) > 0.95


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
    speeds = np.linalg.norm(motion.rates, axis=1)
    assert speeds == pytest.approx(speeds.max(), rel=1e-9)
    # Arms 2 and 4 are the slowest along these sides; no rate exceeds its limit by rounding.
    rates = np.abs(np.diff(motion.alpha, axis=0) / seconds[1])
    assert rates.max(axis=0) == pytest.approx([1.0] * 4, rel=1e-9)
    assert (np.abs(motion.rates).max(axis=0) <= [2.0, 1.0, 2.0, 1.0]).all()
    later = answer.at(answer.duration + 3 * answer.period)
    np.testing.assert_allclose(later.alpha, motion.alpha[-1], atol=1e-9)
    for rate, slower in ((50.0, 1), (0.25, 4)):  # the vehicle's limits hold too
        other = Replanner(vehicle, sign="positive", rate=rate).replan(here, AROUND)
        assert other.period == pytest.approx(slower * answer.period)
    third = gg.PAPER.replace(max_tilt_rate=[3.0, 4.0, 2.0, 4.0])
    twice = Replanner(third, sign="positive").replan(here, AROUND)
    assert 2 * twice.period == pytest.approx(answer.period)


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
TWICE = [-0.5, 0.3, -0.5, 0.3]


# -- Refusals

WALL = box(-2.0, 0.5, 0.5, 0.7)
EVERYWHERE = box(-2.0, -2.0, 2.0, 2.0)


@pytest.mark.parametrize(
    ("asked", "changes", "reason"),
    [
        ({}, {"alpha": [*TWICE[:3], 0.31]}, "present angles are 0.01 rad off red"),
        ({}, {"alpha": [-0.6, 0.6] * 2, "keep_out": [BOX]}, "inside a new keep_out"),
        ({}, {"alpha": [0.5] * 4}, "the present angles (0.5000, 0.5000): hover"),
        ({}, {"waypoints": [*AROUND, (0.8, -0.8)]}, "waypoint 5 (0.8000, -0.8000): R"),
        ({}, {"keep_out": [WALL]}, "waypoint 1 and waypoint 2 are separated by keep"),
        ({}, {"keep_out": [EVERYWHERE]}, "no point is admissible"),
        ({"floor": 5.0}, {}, "no point is admissible"),
        ({"sign": "auto"}, {"waypoints": [(0.8, -0.8)]}, "separated by the curve tan"),
    ],
)
def test_refusals_say_why(asked: Any, changes: Any, reason: str) -> None:
    call = {"alpha": TWICE, "waypoints": AROUND, "keep_out": [], **changes}
    answer = prepared(**asked).replan(**call)
    assert not answer
    assert reason in str(answer.reason)
    assert answer.least_singular_value == 0
    with pytest.raises(gg.Infeasible):
        _ = answer.timed


@pytest.mark.parametrize(
    ("name", "asked", "changes"),
    [
        ("vehicle", {"vehicle": gg.PAPER.replace(max_tilt_jerk=30.0)}, {}),
        ("alpha", {}, {"alpha": HERE}),
        ("alpha", {}, {"alpha": [4.0] * 4}),
        ("waypoints", {}, {"waypoints": []}),
        ("keep_out", {}, {"keep_out": [[(0, 0), (1, 1)]]}),
    ],
)
def test_bad_input_is_named(name: str, asked: Any, changes: Any) -> None:
    with pytest.raises(gg.InputError, match=f"^{name} "):
        prepared(**asked).replan(**{"alpha": TWICE, "waypoints": AROUND, **changes})


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
