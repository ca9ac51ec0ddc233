"""Transitions between hover and gaits: where they end, what they keep, and the proof of refusals."""

from __future__ import annotations

import json
import math
from math import pi
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.invertibility import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.surface.red_components import red_label
from gaitgraph.timing.laws import LAWS
from tests.published import GAITS
from tests.samples import EXACT, points_of

FloatArray = npt.NDArray[np.float64]
G1, G2, G3, G4 = (gg.lift(gait.angles, gait.color) for gait in GAITS)


def around(a1: float, a2: float, radius: float, corners: int = 4) -> gg.Gait:
    turn = (np.arange(corners) + 0.5) * (2 * pi / corners)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    return gg.lift([a1, a2] + radius * circle, "red")


def corners_of(end: Any) -> FloatArray:
    return np.zeros((1, 4)) if isinstance(end, str) else end.alpha


def check_flight(path: FloatArray, vehicle: gg.Vehicle, floor: float = 0.05) -> None:
    """Check the physics at points of a path, without any of the bounds that the planner uses."""
    points = points_of(path[:-1], path[1:]).reshape(-1, 4)
    exact = gg.invertibility.coefficients_of(vehicle, "exact")
    R = level_determinant(points, exact)
    assert R.min() * R.max() > 0
    assert least_singular_value(points, vehicle).min() >= floor - 1e-9
    assert hover_thrust_shares(points, vehicle).min() > 0
    np.testing.assert_array_equal(points[:, 2:], points[:, :2])


# -- Paths
# Its first corner is a little off the surface, as printed digits are.


MANY = around(-0.7, 0.7, 0.3, 37)


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ("hover", "hover"),
        ("hover", G4),
        (G4, "hover"),
        (G3, G3),
        (MANY, around(-0.8, 0.9, 0.2, 60)),  # more corners than are tried
        (around(1.2, -0.5, 0.05, 5), around(0.7, -1.0, 0.05, 3)),
    ],
)
def test_a_free_path_is_straight_between_the_nearest_corners(
    start: Any, end: Any
) -> None:
    path = gg.transition(start, end)
    assert (path.reason, path.proof, path.report.flyable) == (None, None, True)
    first, last = corners_of(start), corners_of(end)
    apart = np.linalg.norm(first[:, None, :2] - last[None, :, :2], axis=2)
    assert path.length == pytest.approx(apart.min(), abs=1e-12)
    leaves, joins = path.corners
    assert (leaves is None, joins is None) == (start == "hover", end == "hover")
    np.testing.assert_allclose(path.path[0], first[leaves or 0], atol=1e-12)
    np.testing.assert_allclose(path.path[-1], last[joins or 0], atol=1e-12)
    check_flight(path.path, gg.PAPER)
    assert bool(path.length) is ("nothing moves" not in str(path))


def test_a_path_begins_and_ends_at_the_gait_itself() -> None:
    """Also if its corner is a little off the surface, as printed digits are."""
    rows = [[-0.4, 0.4, -0.4003, 0.4003], [-1.2, 1.2, -1.2, 1.2]]
    path = gg.transition("hover", gg.Gait(alpha=rows, colors=("red",) * 2))
    np.testing.assert_allclose(path.path[-1], rows[0], atol=1e-9)


def test_a_bent_path_is_half_the_loop_through_its_ends_in_both_directions() -> None:
    # A little below the curve tan α1 − tan α2 = 2κ, where R < 0.
    kappa = gg.PAPER.drag_ratio
    points = [(x, math.atan(math.tan(x) - 2 * kappa) - 0.05) for x in (-0.45, 0.8)]
    first, last = (gg.lift([point], "red") for point in points)
    there, back = gg.transition(first, last), gg.transition(last, first)
    plan = gg.plan_loop(points, color="red", sign="negative", require="valid")
    assert plan.loop is not None
    assert there.length == pytest.approx(plan.loop.length / 2, abs=1e-9)
    assert there.length > math.dist(*points)
    np.testing.assert_array_equal(there.path, back.path[::-1])
    # It leaves the quadrants of positive thrusts, and says so.
    assert there.report.valid
    assert not there.report["hover_thrust"].ok
    assert there.reason == there.report.reason


angle = st.floats(-1.5, 1.5)


@settings(deadline=None, max_examples=30)
@given(
    kappa=st.floats(0.05, 1.0),
    start=st.tuples(angle, angle),
    end=st.tuples(st.floats(-1.2, 0.0), st.floats(0.0, 1.2)),
    floor=st.floats(0.0, 0.6),
)
def test_whatever_is_answered_holds_for_any_vehicle(
    kappa: float, start: Any, end: Any, floor: float
) -> None:
    vehicle = gg.Vehicle(drag_ratio=kappa)
    first, last = (gg.lift([point], "red", vehicle=vehicle) for point in (start, end))
    path = gg.transition(first, last, floor=floor)
    labels = [red_label(point[0], point[1], vehicle).tolist() for point in (start, end)]
    if not path:
        assert (path.proof is not None) == (first.R[0] * last.R[0] < 0)
        assert labels[0] != labels[1] or "not valid" in str(path.reason)
        return
    assert labels[0] == labels[1]
    if path.report.flyable:
        check_flight(path.path, vehicle, floor)
    # Unless the straight path would have done.
    straight = points_of(first.alpha, last.alpha)[0]
    sigma = least_singular_value(straight, vehicle).min()
    R = level_determinant(straight, first.coefficients) * np.sign(first.R[0])
    flies = sigma > floor + 1e-4 and R.min() > 1e-4
    if flies and hover_thrust_shares(straight, vehicle).min() > 1e-4:
        assert path.report.flyable
        assert len(path.path) == 2


def test_blue_to_blue_is_valid_and_not_flyable() -> None:
    for start, end in ((G1, G2), (G2, G1)):
        path = gg.transition(start, end)
        assert (path.report.valid, path.report.flyable) == (True, False)
        assert set(path.gait.colors) == {"blue"}
        assert "the whole blue sheet is singular" in str(path.reason)


# -- Refusals

BLUE = gg.lift(G2.alpha[:, :2], "blue", coefficients=EXACT)
MEETING = "the sheets meet in four points only"


SADDLE = gg.lift([(0.5, -0.5), (-0.5, 0.5)], "red")


OFF = gg.Gait(alpha=[[0.4, -0.4, 0.1, -0.2]], colors=("red",))


JUMPS = gg.lift(G3.alpha[:, :2], ["red", "blue", "red", "red"])


WRAPS = gg.lift([(-1.3, 0.2), (-1.1, 0.2)], "blue")


DIGITS = gg.lift([(-3 * pi / 8, 3 * pi / 8)], "blue")


# (−1.5, 1.5) has R > 0 in a small component of its own; where β1 and β2 reach ±π/2 together, R only touches 0.
SMALL = gg.lift([(-1.5, 1.5)], "red", coefficients=EXACT)
NOT_JOINED: list[tuple[Any, Any, str]] = [
    ("hover", G3, "passes a singular matrix"),
    (SADDLE, G3, "start is not valid: R changes"),
    ("hover", SADDLE, "end is not valid: R changes"),
    (OFF, G3, "max(|Rφ|"),
    (JUMPS, G3, "not be neighbours"),
    (WRAPS, G3, "where it wraps by π"),
    (BLUE, BLUE, "R = 0 on the whole blue sheet"),
    (G3, G2, MEETING),
    (G1, "hover", MEETING),
    (DIGITS, G2, "as far as rounded"),
    ("hover", SMALL, "separated by the line α1"),
]


@pytest.mark.parametrize(("start", "end", "told"), NOT_JOINED)
def test_ends_that_cannot_be_joined_are_refused_with_the_reason(
    start: Any, end: Any, told: str
) -> None:
    path = gg.transition(start, end)
    assert (bool(path), path.status) == (False, "infeasible")
    assert path.corners == (None, None)
    assert told in str(path.reason)
    for name in ("gait", "path", "report", "length", "timed", "table"):
        with pytest.raises(gg.Infeasible):
            getattr(path, name)
    if path.proof is not None:
        assert path.proof["statement"] in str(path)
    plain = json.loads(json.dumps(path.as_mapping(), allow_nan=False))
    assert (plain["status"], plain["path"], plain["length"]) == ("infeasible", [], None)


# -- Timing and limits


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("samples", "duration"), [(1, 2.0), (98, 1.0), (3, 1e-6)])
def test_the_table_is_the_path_once_at_its_law(
    law: Any, samples: int, duration: float
) -> None:
    path = gg.transition("hover", G4, law=law, samples=samples, duration=duration)
    table = path.table
    t = np.arange(samples + 1) * (duration / samples)
    np.testing.assert_allclose(table["t"], t, atol=1e-15)
    share = t / duration
    if law == "smooth":
        share = 10 * share**3 - 15 * share**4 + 6 * share**5
        assert np.abs(table["alpha1_rate"][[0, -1]]).max() * duration < 1e-12
    expected = share[:, None] * path.path[-1]
    np.testing.assert_allclose(table.alpha, expected, atol=1e-12)
    # The last row does not fly back.
    assert (table["alpha1_rate"] * path.path[-1, 0] * duration > -1e-12).all()
    plain = path.as_mapping()
    told = [plain[name] for name in ("duration", "law", "joins_corner", "path")]
    assert told == [duration, law, 1, path.path.tolist()]


# From hover to (−π/8, π/8) every angle turns by π/8. The minimum-jerk polynomial 10τ³ − 15τ⁴ + 6τ⁵ has the greatest
# slope 15/8, at τ = 1/2, and the greatest second derivative 10/√3.
RATE = 15 / 8 * (pi / 8)
ACCELERATION = 10 / math.sqrt(3) * (pi / 8)


@pytest.mark.parametrize(
    ("rate", "acceleration", "needed"),
    [
        (0.2, None, RATE / 0.2),
        (None, 0.5, math.sqrt(ACCELERATION / 0.5)),
        (0.3, 0.1, math.sqrt(ACCELERATION / 0.1)),
        (5.0, 50.0, 1.0),
        (None, None, 1.0),
    ],
)
def test_the_default_duration_is_what_the_limits_need(
    rate: float | None, acceleration: float | None, needed: float
) -> None:
    limited = gg.PAPER.replace(max_tilt_rate=rate, max_tilt_acceleration=acceleration)
    gait = gg.lift(G4.alpha[:, :2], "red", vehicle=limited)
    for start, end in (("hover", gait), (gait, "hover")):
        path = gg.transition(start, end)
        assert needed <= path.duration <= needed + 1.0001e-3  # whole milliseconds
        assert path.reason is None
        assert path.report["tilt_rate"].value == pytest.approx(RATE / path.duration)
        faster = gg.transition(start, end, duration=0.99 * needed)
        assert faster.report.flyable is (needed == 1)
        np.testing.assert_array_equal(faster.path, path.path)


@pytest.mark.parametrize(
    ("name", "limit"),
    [("tilt_range", {"max_tilt": 0.5}), ("thrust_limit", {"max_thrust": 1.0})],
)
def test_the_limits_of_the_vehicle_are_limits_of_the_way(
    name: str, limit: dict[str, float]
) -> None:
    wide = around(-0.9, 0.9, 0.3).alpha[:, :2]
    gait = gg.lift(wide, "red", vehicle=gg.PAPER.replace(**limit))
    path = gg.transition("hover", gait)
    assert path.report.valid
    assert not path.report[name].ok
    assert path.reason == path.report[name].message
