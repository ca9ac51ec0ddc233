"""Curves: smooth, on their sheet, near their chords, checked between samples; and gaits with rounded corners."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings, strategies as st
from scipy.interpolate import CubicSpline

import gaitgraph as gg
from gaitgraph.invertibility import (
    hover_thrust_shares,
    pitch_sensitivity,
    roll_sensitivity,
)
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import least_singular_value, level_determinant
from gaitgraph.timing.curve import Curve, rounded

# shapely has no distances between points that are nearer than 1e-150.
angle = st.floats(-1.4, 1.4).map(lambda x: round(x, 12))
RING = [(0.8 + 0.4 * np.cos(t), -0.8 + 0.4 * np.sin(t)) for t in np.arange(8) * pi / 4]


def curve_through(
    plane: Any, color: str = "red", vehicle: gg.Vehicle = gg.PAPER
) -> Curve:
    """The closed cubic spline through points; its parameter is the length of the polygon through them."""
    closed = np.vstack([plane, plane[:1]])
    lengths = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    breaks = np.append(0.0, np.cumsum(lengths))
    return Curve(
        breaks=breaks,
        pieces=CubicSpline(breaks, closed, bc_type="periodic").c,
        color=color,
        vehicle=vehicle,
        coefficients=coefficients_of(vehicle),
    )


def sampled(curve: Curve, count: int = 4001) -> Any:
    return curve.at(np.linspace(0, curve.span, count))


def check_smooth(curve: Curve) -> None:
    """Angles and two derivatives go on through the breaks, and are derivatives of each other."""
    h = 1e-6 * curve.span
    for order in range(3):
        before, after = (curve.at(curve.breaks + shift, order) for shift in (-h, h))
        inside = curve.breaks[:-1] + np.linspace(0.01, 0.99, 99)[:, None] * np.diff(
            curve.breaks
        )
        steepest = np.abs(curve.at(inside, order + 1)).max()
        size = 1 + np.abs(curve.at(inside, order)).max()
        assert np.abs(after - before).max() <= 3 * h * steepest + 1e-9 * size


@settings(deadline=None, max_examples=20)
@given(
    loop=st.lists(st.tuples(angle, angle), min_size=3, max_size=7).filter(
        lambda loop: (
            np.linalg.norm(np.diff([*loop, loop[0]], axis=0), axis=1).min() > 1e-2
        )
    ),
    color=st.sampled_from(["red", "blue"]),
    tolerance=st.sampled_from([1e-2, 1e-3, 1e-5]),
)
def test_a_spline_is_smooth_on_its_sheet_and_near_its_chords(
    loop: Any, color: str, tolerance: float
) -> None:
    curve = curve_through(loop, color)
    check_smooth(curve)
    np.testing.assert_allclose(curve.at(curve.breaks[:-1])[:, :2], loop, atol=1e-12)
    s = np.linspace(0, 3 * curve.span, 100)
    np.testing.assert_allclose(curve.at(s), curve.at(np.mod(s, curve.span)), atol=1e-12)
    alpha = sampled(curve)
    assert np.abs(roll_sensitivity(alpha, curve.coefficients)).max() < 1e-12
    assert np.abs(pitch_sensitivity(alpha, curve.coefficients)).max() < 1e-12
    # No wrap: opposite angles change by as much as the first pair.
    step = np.abs(np.diff(alpha, axis=0))
    np.testing.assert_allclose(step[:, 2:], step[:, :2], atol=1e-12)
    length = np.linalg.norm(np.diff(alpha[:, :2], axis=0), axis=1).sum()
    assert curve.length == pytest.approx(length, rel=1e-4)
    turned = curve.at(curve.turning_points())
    assert (turned.max(axis=0) >= alpha.max(axis=0) - 1e-12).all()
    assert (turned.min(axis=0) <= alpha.min(axis=0) + 1e-12).all()
    assert np.ptp(turned, axis=0) == pytest.approx(np.ptp(alpha, axis=0), abs=1e-3)
    corners = curve.polyline(tolerance).alpha
    line = shapely.linearrings(corners[:, :2])
    away = shapely.distance(line, shapely.points(alpha[:, :2])).max()
    assert away <= tolerance * (1 + 1e-9) + 1e-14
    missed = shapely.distance(shapely.multipoints(corners[:, :2]), shapely.points(loop))
    assert missed.max() < 1e-12


@settings(deadline=None, max_examples=20)
@given(center=st.tuples(angle, angle), radius=st.floats(0.01, 0.5))
@example(center=(-1.25, 1.25), radius=0.25)  # R vanishes at ends of chords
def test_what_a_check_says_holds_on_a_dense_sampling(
    center: Any, radius: float
) -> None:
    """And what is taken off for the chords is no more than a few times their distance."""
    turn = np.arange(6) * pi / 3
    ring = center + radius * np.column_stack([np.cos(turn), 0.6 * np.sin(turn)])
    curve = curve_through(ring, vehicle=gg.PAPER.replace(max_tilt=1.3, max_thrust=4.0))
    alpha = sampled(curve)
    sigma = least_singular_value(alpha, curve.vehicle).min()
    R = np.asarray(level_determinant(alpha, curve.coefficients))
    shares = hover_thrust_shares(alpha, curve.vehicle)
    newtons = shares.max() * curve.vehicle.mass * curve.vehicle.gravity
    tilt = np.abs(alpha).max()
    for chord in (1e-5, 1e-4):
        report = curve.check(chord=chord)
        values: Any = {check.name: check.value for check in report.checks if check.ok}
        if "least_singular_value" in values:
            least = values["least_singular_value"]
            assert 0.05 <= least <= sigma + 1e-12
            assert sigma - 2.2 * chord - 2e-4 <= least
        else:
            assert sigma < 0.05 + 2.2 * chord + 1e-4
        if report["R_sign"].ok and report["R_sign"].decided:
            assert R.min() * R.max() > 0
            assert 0 <= np.abs(R).min() + 1e-12 - abs(values["R_sign"]) < 30 * chord
        if "hover_thrust" in values:
            assert 0 < values["hover_thrust"] <= shares.min() + 1e-12
            assert newtons <= values.get("thrust_limit", 4.0) + 1e-9 or newtons > 3.99
        assert ("tilt_range" in values) is bool(tilt <= 1.3) or abs(tilt - 1.3) < 1e-5
        assert (R > 0).all() or not report.reachable_from_hover


def test_a_curve_hovers_only_if_that_is_certain_between_its_chords() -> None:
    # The corners hover with positive thrusts; the spline swings across α1 = δ between them.
    delta = coefficients_of().delta
    corners = [(delta + 0.02, -1.2), (delta + 0.02, -0.4), (1.2, -0.8)]
    assert gg.lift(corners, "red").check()["hover_thrust"].ok
    assert not curve_through(corners).check()["hover_thrust"].ok
    shifted = np.add(RING, (delta + 5e-4 - 0.4, 0.0))
    near = curve_through(shifted)
    for chord in (1e-6, 1e-3, 5e-2):
        assert near.check(chord=chord)["hover_thrust"].ok is (chord == 1e-6)


# -- Rounded gaits


@settings(deadline=None, max_examples=30)
@given(
    loop=st.lists(st.tuples(angle, angle), min_size=1, max_size=6),
    tolerance=st.floats(1e-4, 0.5),
    color=st.sampled_from(["red", "blue"]),
)
def test_curve_and_polyline_are_within_the_tolerance_both_ways(
    loop: Any, tolerance: float, color: str
) -> None:
    gait = gg.lift(loop, color)
    rounding = rounded(gait, tolerance)
    check_smooth(rounding.curve)
    points = sampled(rounding.curve, 1501)[:, :2]
    line = shapely.linestrings(np.vstack([gait.alpha, gait.alpha[:1]])[:, :2])
    path = shapely.linestrings(points)
    # Corners nearer than 1e-5 rad to the one before count as the same.
    most = rounding.deviation + 3e-5
    assert rounding.deviation <= tolerance * (1 + 1e-12)
    assert shapely.distance(line, shapely.points(points)).max() <= most
    corners = shapely.points(gait.alpha[:, :2])
    spacing = np.linalg.norm(np.diff(points, axis=0), axis=1).max()
    assert shapely.distance(path, corners).max() <= most + spacing
    assert rounding.curve.length <= gait.length + 1e-9
    for corner in rounding.corners:
        assert corner.shrunk or corner.deviation in (0.0, pytest.approx(tolerance))
    # Blends share a segment, and one that is shrunk touches the next.
    leg = np.linalg.norm((rounding.gait.ends - rounding.gait.alpha)[:, :2], axis=1)
    reach = np.zeros(len(leg))
    for corner in rounding.corners:
        reach[corner.corner] = corner.reach
    left = leg - reach - np.roll(reach, -1)
    assert (left >= -1e-12).all()
    assert not rounding.merged or left.min() < 1e-12


@pytest.mark.parametrize("turn", [0.3, 1.0, pi / 2, 2.5, 3.1])
def test_a_corner_passes_at_the_stated_distance(turn: float) -> None:
    ahead = (0.5 * np.cos(turn), 0.5 * np.sin(turn))
    rounding = rounded(gg.lift([(-0.5, 0.0), (0.0, 0.0), ahead], "red"), 1e-3)
    (corner,) = (one for one in rounding.corners if one.corner == 1)
    assert corner.turn == pytest.approx(turn)
    nearest = np.linalg.norm(sampled(rounding.curve, 40_001)[:, :2], axis=1).min()
    assert nearest == pytest.approx(1e-3, rel=1e-3)


def test_turning_back_stays_on_the_line_and_reaches_the_tip() -> None:
    # A last corner where the first is, to 1e-5, is none.
    gait = gg.lift([(0.4, -1.2), (1.2, -0.4), (0.4 + 1e-6, -1.2)], "red")
    rounding = rounded(gait, 0.02)
    assert rounding.deviation == 0
    points = sampled(rounding.curve)[:, :2]
    np.testing.assert_allclose(points[:, 0] - points[:, 1], 1.6, atol=1e-12)
    turned = rounding.curve.at(rounding.curve.turning_points())[:, 0]
    np.testing.assert_allclose([turned.min(), turned.max()], [0.4, 1.2], atol=1e-15)
    # Forth once and back once.
    assert rounding.curve.length == pytest.approx(gait.length, abs=1e-5)


def test_straight_runs_need_no_blend_and_legs_are_shared() -> None:
    gait = gg.lift([(0.4, -0.4), (0.6, -0.4), (0.8, -0.4), (0.8, -1.2)], "red")
    rounding = rounded(gait, 1.0)
    assert (len(rounding.gait.alpha), rounding.merged) == (3, (0, 1, 2))
    assert "3 corners rounded" in str(rounding)
    # A small tolerance needs no shrinking.
    assert rounded(gait, 1e-5).as_mapping()["shrunk"] == []
