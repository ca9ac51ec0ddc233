"""Rounded gaits: as near to the polyline as stated, smooth, on the sheet; tips, straight runs and crowded corners."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.timing.curve import rounded
from tests.published import GAITS

angle = st.floats(-1.4, 1.4)
loops = st.lists(st.tuples(angle, angle), min_size=1, max_size=6)
tolerances = st.floats(1e-4, 0.5)


def distances(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distance of points from a closed polyline."""
    step = np.roll(corners, -1, axis=0) - corners
    size = np.maximum((step**2).sum(axis=1), 1e-300)
    along = np.clip(((points[:, None] - corners) * step).sum(axis=2) / size, 0, 1)
    return np.asarray(np.linalg.norm(corners + along[..., None] * step - points[:, None], axis=2).min(axis=1))


@settings(deadline=None, max_examples=30)
@given(loop=loops, tolerance=tolerances, color=st.sampled_from(["red", "blue"]))
def test_curve_and_polyline_are_within_the_tolerance_both_ways(
    loop: list[tuple[float, float]], tolerance: float, color: str
) -> None:
    gait = lift(loop, color)
    rounding = rounded(gait, tolerance)
    curve = rounding.curve  # which refuses jumps of its first two derivatives
    corners = np.array(gait.alpha[:, :2])
    points = curve.at(np.linspace(0, curve.span, 1501))[:, :2]
    assert rounding.deviation <= tolerance * (1 + 1e-12)
    # Corners nearer than 1e-5 rad to the one before count as the same.
    assert distances(points, corners).max() <= rounding.deviation + 3e-5
    spacing = np.linalg.norm(np.diff(points, axis=0), axis=1).max()
    assert distances(corners, points).max() <= rounding.deviation + spacing + 3e-5
    assert curve.length <= gait.length + 1e-9
    for corner in rounding.corners:
        # The deviation of a corner is that of the middle of its blend.
        nearest = np.linalg.norm(points - rounding.gait.alpha[corner.corner, :2], axis=1).min()
        assert nearest <= corner.deviation + spacing
        assert corner.shrunk or corner.deviation in (0.0, pytest.approx(tolerance))


def test_a_corner_passes_at_the_stated_distance() -> None:
    for turn in (0.3, 1.0, pi / 2, 2.5, 3.1):
        legs = np.array([[-0.5, 0.0], [0.0, 0.0], [0.5 * np.cos(turn), 0.5 * np.sin(turn)]])
        rounding = rounded(lift(legs, "red"), 1e-3)
        corner = next(one for one in rounding.corners if one.corner == 1)
        assert corner.turn == pytest.approx(turn)
        points = rounding.curve.at(np.linspace(0, rounding.curve.span, 40_001))[:, :2]
        assert np.linalg.norm(points, axis=1).min() == pytest.approx(1e-3, rel=1e-3)


def test_turning_back_stays_on_the_line_and_reaches_the_tip() -> None:
    gait = lift([(0.4, -1.2), (1.2, -0.4)], "red")
    rounding = rounded(gait, 0.02)
    assert rounding.deviation == 0
    assert [corner.turn for corner in rounding.corners] == [pytest.approx(pi)] * 2
    s = np.linspace(0, rounding.curve.span, 10_001)
    points = rounding.curve.at(s)[:, :2]
    np.testing.assert_allclose(points[:, 0] - points[:, 1], 1.6, atol=1e-12)
    low, high = rounding.curve.extremes()
    np.testing.assert_allclose([low[0], high[0]], [0.4, 1.2], atol=1e-15)
    # Forth once and back once, at rest in the parameter only at the tips.
    assert rounding.curve.length == pytest.approx(gait.length)
    speed = np.linalg.norm(rounding.curve.at(s, 1)[:, :2], axis=1)
    assert (speed < 1e-3).sum() <= 8


def test_straight_runs_need_no_blend_and_legs_are_shared() -> None:
    gait = lift([(0.4, -0.4), (0.6, -0.4), (0.8, -0.4), (0.8, -1.2)], "red")
    rounding = rounded(gait, 1.0)
    assert (len(rounding.gait.alpha), rounding.merged) == (3, (0, 1, 2))
    assert "shrunk to share a leg" in str(rounding)
    leg = np.linalg.norm((rounding.gait.ends - rounding.gait.alpha)[:, :2], axis=1)
    reach = np.array([corner.reach for corner in rounding.corners])
    left = leg - reach - np.roll(reach, -1)
    assert (left >= -1e-12 * leg).all()
    assert left.min() < 1e-12
    # A small tolerance needs no shrinking.
    assert rounded(gait, 1e-3).merged == ()


def test_bad_input_is_refused() -> None:
    gait = lift(GAITS[2].angles, "red")
    for tolerance in (0.0, 0.9e-5, float("nan"), "big"):
        with pytest.raises(gg.InputError, match="tolerance"):
            rounded(gait, tolerance)
    for other in (gait.biased(0.8), lift(GAITS[2].angles, ["red", "blue", "red", "blue"])):
        with pytest.raises(gg.InputError, match="color"):
            rounded(other, 0.01)
    assert rounded(gait, 1e-5).as_mapping()["shrunk"] == []
