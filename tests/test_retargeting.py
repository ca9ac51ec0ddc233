"""Retargeting: nearest by brute force, unchanged where it may be, inside between rows, and answers that are no."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely

from gaitgraph.errors import Infeasible
from gaitgraph.gait.gait import lift
from gaitgraph.gait.given import given_gait
from gaitgraph.optimization import retargeting
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import table_from

# Its answers have a table here, which types cannot know.
retarget: Any = retargeting.retarget
FLYABLE = [(0.4, -1.2), (0.5, -0.5), (1.2, -0.4)]
RED = lift(FLYABLE, "red")


def wave(seed: int, count: int = 24) -> np.ndarray:
    """Return a smooth closed motion of four angles with phases of its own, as of four legs."""
    rng = np.random.default_rng(seed)
    turn = 2 * math.pi * np.arange(count)[:, None] / count + rng.uniform(0, 7, 4)
    return rng.uniform(-0.3, 0.3, 4) + rng.uniform(0.35, 0.7, 4) * np.sin(turn)


def line_of(answer: Any) -> shapely.LineString:
    plane = answer.table.alpha[:, :2]
    return shapely.LineString(np.vstack([plane, plane[:1]]))


@pytest.mark.parametrize("sign", [None, "positive", "negative"])
@pytest.mark.parametrize("seed", range(3))
def test_rows_go_to_the_nearest_place_of_the_nearest_component(
    seed: int, sign: Any
) -> None:
    rows = wave(seed)
    answer = retarget(rows, sign=sign)
    assert (answer.status, answer.after.flyable) == ("retargeted", True)
    new = answer.table.alpha[answer.rows]
    moved = np.linalg.norm(new - rows, axis=1)
    np.testing.assert_allclose(answer.moved, moved, atol=1e-15)
    # In four dimensions, to every point of a grid of each component.
    parts = admissible_region(PAPER, sign=sign).components
    grid = np.stack(np.meshgrid(*[np.linspace(-1.57, 1.57, 300)] * 2), -1).reshape(
        -1, 2
    )
    sums = []
    for part in parts:
        inside = grid[shapely.contains_xy(part, *grid.T)]
        border = shapely.get_coordinates(shapely.segmentize(part, 0.005))
        points = np.vstack([inside, border])[:, [0, 1, 0, 1]]
        away = np.linalg.norm(points - rows[:, None], axis=2).min(axis=1)
        sums.append(away.sum())
        if part.distance(shapely.Point(new[0, :2])) < 1e-9:
            assert (moved <= away + 1e-9).all()
            np.testing.assert_allclose(moved, away, atol=1e-2)
    assert answer.total == pytest.approx(min(sums), rel=1e-3)
    np.testing.assert_allclose(answer.alternatives, sorted(sums), rtol=1e-3)
    assert answer.rms == pytest.approx(np.sqrt((moved**2).mean()))
    assert answer.largest == (moved.max(), moved.argmax() + 1)


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_retargeting_twice_changes_nothing_more(margin: float) -> None:
    once = retarget(wave(1), margin=margin)
    again = retarget(once.table, margin=margin)
    assert (again.table.alpha == once.table.alpha).all()
    assert (again.status, again.total) == ("unchanged", 0)
    assert again.unchanged == len(once.table)
    borders = [part.boundary for part in admissible_region(PAPER).components]
    away = shapely.distance(shapely.union_all(borders), line_of(once))
    assert away >= margin - 1e-9


@pytest.mark.parametrize(
    "source",
    [
        table_of(RED.parametrize(2.0, samples=30)),
        lift([(0.6, -0.6)], "red"),
        np.array([[-0.3, 0.4, -0.3, 0.4], [-0.9, 0.4, -0.9, 0.4]]),
        {"alpha1": [0.4, 0.4, 1.2], "alpha2": [-1.2, -0.4, -0.4], "color": "red"},
    ],
)
def test_flyable_gaits_come_back_bit_by_bit(source: Any) -> None:
    answer = retarget(source)
    assert (answer.status, answer.added, answer.reason) == ("unchanged", 0, None)
    alpha = given_gait(source).rows.gait.alpha
    assert (answer.table.alpha[: len(alpha)] == alpha).all()


def test_paths_between_rows_bend_around_what_is_forbidden() -> None:
    block = [(-0.7, 0.5), (-0.5, 0.5), (-0.5, 0.9), (-0.7, 0.9)]
    rows = [[-1.0, 0.7, -1.0, 0.7], [-0.2, 0.7, -0.2, 0.7]]
    answer = retarget(table_from(rows, t=[0.5, 2.0]), keep_out=[block])
    assert (answer.unchanged, answer.added, answer.total) == (2, 4, 0)
    assert answer.as_mapping()["new_rows"] == [1, 4]
    line = line_of(answer)
    assert not shapely.crosses(line, shapely.Polygon(block).buffer(-1e-9))
    assert line.length == pytest.approx(2 * (2 * math.hypot(0.3, 0.2) + 0.2), abs=1e-9)
    # An added row has its time by its share of the length.
    steps = np.linalg.norm(np.diff(line.coords, axis=0), axis=1)
    times = 0.5 + 3 * np.append(0, np.cumsum(steps[:-1])) / line.length
    np.testing.assert_allclose(answer.table["t"], times)


def test_times_stay_and_rates_are_judged() -> None:
    t = np.linspace(0.0, 1.4, 8)
    table = table_from(wave(3, count=8), t=t)
    slow = PAPER.replace(max_tilt_rate=0.01)
    answer = retarget(table, vehicle=slow, sign="positive")
    assert (answer.table["t"][answer.rows] == t).all()
    assert not answer.after["tilt_rate"].ok
    assert f"after:  {answer.after.verdict}" in str(answer).splitlines()


@pytest.mark.parametrize("keep", [0.5, 0.2])
def test_a_gait_that_would_stand_still_moves_if_a_share_is_kept(keep: float) -> None:
    """All of blue is nearest to one posture; the same loop of (α1, α2) on red, made smaller, moves."""
    blue = lift(FLYABLE, "blue")
    still, answer = retarget(blue), retarget(blue, keep=keep)
    delta = math.atan(PAPER.drag_ratio)  # where both sheets meet
    assert np.abs(still.table.alpha[:, :2] - [delta, -delta]).max() < 0.1
    assert still.gait.length == pytest.approx(0.0, abs=1e-9)
    assert still.advice == "to keep half of the motion, use keep=0.5"
    assert str(still).startswith("The nearest flyable gait stands still; ")
    assert repr(still) == f"<Retargeted: {str(still).splitlines()[0]}>"
    if keep < 0.5:
        assert str(answer).startswith("The nearest flyable gait keeps 20 % of the ")
    assert answer.after.flyable
    assert (answer.share, answer.advice) == (pytest.approx(keep), None)
    # No other place for the same loop is nearer: shifted towards the nearest posture it leaves the region.
    plane = answer.table.alpha[:, :2]
    shift = 1e-4 * (still.table.alpha[0, :2] - plane.mean(axis=0))
    assert not lift(plane + shift, "red").check().flyable


def test_whole_turns_are_taken_off_with_a_warning() -> None:
    rows = RED.alpha.copy()
    rows[1, 3] += 2 * math.pi  # which rounding does not touch
    closing = rows[0] - [0, 0, 2 * math.pi, 0]
    answer = retarget([*rows, closing])
    assert (answer.status, answer.unchanged, answer.added) == ("retargeted", 2, 0)
    expected = [*RED.alpha, RED.alpha[0]]
    np.testing.assert_allclose(answer.table.alpha, expected, atol=1e-15)
    assert answer.warnings == ("took whole turns off α3 or α4 in 2 rows",)
    rows[:, 2] -= math.pi  # half a turn is far
    assert retarget(rows).moved.min() > math.pi / math.sqrt(2) - 1e-9


def test_limits_of_the_vehicle_count_and_mirrored_spin_mirrors_the_answer() -> None:
    limited = Vehicle(drag_ratio=0.17, mass=0.4, max_thrust=1.06, max_tilt=0.5)
    here = retarget(wave(0), vehicle=limited, sign="positive")
    assert here.after.flyable
    assert np.abs(here.table.alpha).max() <= 0.5
    mirrored = limited.replace(first_rotor_spin="counterclockwise")
    there = retarget(-wave(0), vehicle=mirrored, sign="positive")
    np.testing.assert_allclose(there.table.alpha, -here.table.alpha, atol=3e-6)


WHOLE = [(-1.6, -1.6), (1.6, -1.6), (1.6, 1.6), (-1.6, 1.6)]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"floor": 1.3}, "of this vehicle is at most 1.1710"),
        ({"keep_out": [WHOLE]}, "no tilt angles meet all conditions"),
        ({"margin": 1.5}, "use a smaller margin"),
        (
            {"keep": 1.0, "keep_in": [[(-0.1, 0.3), (0.1, 0.3), (0.1, 0.5)]]},
            "100 % of the motion fits nowhere",
        ),
    ],
)
def test_why_there_is_none(options: dict[str, Any], told: str) -> None:
    none = retarget(wave(1), **options)
    plain = none.as_mapping()
    assert (bool(none), none.status, plain["path"]) == (False, "infeasible", [])
    assert told in str(none)
    assert repr(none) == "<Retargeted: infeasible>"
    assert not plain["flyable"]
    for name in ("gait", "total", "largest"):
        with pytest.raises(Infeasible):
            getattr(none, name)
