"""Curves: smooth, on their sheet, near their chords, checked between samples; and gaits with rounded corners."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import Form
from gaitgraph.invertibility.matrices import least_singular_value, level_determinant
from gaitgraph.surface.blocks import yaw_block
from gaitgraph.timing.curve import Curve, rounded
from gaitgraph.timing.polynomials import derivative_of, values_of

angle = st.floats(-1.4, 1.4)
points = st.lists(st.tuples(angle, angle), min_size=3, max_size=7, unique=True).filter(
    lambda loop: np.linalg.norm(np.diff([*loop, loop[0]], axis=0), axis=1).min() > 1e-3
)
RING = [(0.8 + 0.4 * np.cos(t), -0.8 + 0.4 * np.sin(t)) for t in np.arange(8) * pi / 4]


def curve_through(
    plane: npt.ArrayLike, color: str = "red", vehicle: gg.Vehicle = gg.PAPER
) -> Curve:
    """The closed cubic spline through points; its parameter is the length of the polygon through them."""
    closed = np.vstack([plane, np.asarray(plane)[:1]])
    breaks = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))]
    )
    pieces = CubicSpline(breaks, closed, bc_type="periodic").c
    return Curve(
        breaks=breaks,
        pieces=pieces,
        color=color,
        vehicle=vehicle,
        coefficients=coefficients_of(vehicle),
    )


@settings(deadline=None, max_examples=20)
@given(
    loop=points,
    color=st.sampled_from(["red", "blue"]),
    tolerance=st.sampled_from([1e-2, 1e-3, 1e-5]),
)
def test_a_spline_is_smooth_on_its_sheet_and_near_its_chords(
    loop: list[tuple[float, float]], color: str, tolerance: float
) -> None:
    curve = curve_through(loop, color)
    np.testing.assert_allclose(curve.at(curve.breaks[:-1])[:, :2], loop, atol=1e-12)
    h = 1e-7 * curve.span
    for order in range(3):
        before, after = (
            curve.at(curve.breaks - h, order),
            curve.at(curve.breaks + h, order),
        )
        higher = derivative_of(curve.pieces, order + 1)
        size = max(
            np.abs(higher[-1]).max(),
            np.abs(values_of(higher, np.diff(curve.breaks))).max(),
        )
        assert np.abs(before - after).max() <= 4 * h * size + 1e-9
    s = np.linspace(0, 3 * curve.span, 100)
    np.testing.assert_allclose(curve.at(s), curve.at(np.mod(s, curve.span)), atol=1e-12)
    alpha = curve.at(np.linspace(0, curve.span, 5001))
    assert (
        np.abs(gg.invertibility.roll_sensitivity(alpha, curve.coefficients)).max()
        < 1e-12
    )
    assert (
        np.abs(gg.invertibility.pitch_sensitivity(alpha, curve.coefficients)).max()
        < 1e-12
    )
    # No wrap: opposite angles change by as much as the first pair.
    step = np.diff(alpha, axis=0)
    np.testing.assert_allclose(np.abs(step[:, 2:]), np.abs(step[:, :2]), atol=1e-12)
    turned = curve.at(curve.turning_points())
    for found, sampled, sense in (
        (turned.min(0), alpha.min(0), -1),
        (turned.max(0), alpha.max(0), 1),
    ):
        assert (sense * (found - sampled) >= -1e-12).all()
        np.testing.assert_allclose(sampled, found, atol=1e-3)
    gait = curve.polyline(tolerance)
    assert gait.length <= curve.length + 1e-9
    assert (
        distances(alpha[::10, :2], gait.alpha[:, :2]).max()
        <= tolerance * (1 + 1e-9) + 1e-14
    )
    s = curve.breaks[:-1]
    assert (
        np.abs(curve.at(s)[:, None] - gait.alpha).max(axis=2).min(axis=1) < 1e-12
    ).all()  # corners at all breaks


def test_a_ring_has_its_length() -> None:
    curve = curve_through(RING)
    chords = np.linalg.norm(
        np.diff(curve.at(np.linspace(0, curve.span, 20_001)), axis=0), axis=1
    ).sum()
    assert curve.length * sqrt(2) == pytest.approx(chords, rel=1e-6)


@settings(deadline=None, max_examples=20)
@given(
    center=st.tuples(angle, angle),
    radius=st.floats(0.01, 0.5),
    sign=st.sampled_from([1.0, -1.0]),
)
def test_what_a_check_says_holds_on_a_dense_sampling(
    center: tuple[float, float], radius: float, sign: float
) -> None:
    turn = sign * np.arange(6) * pi / 3
    ring = np.column_stack(
        [center[0] + radius * np.cos(turn), center[1] + 0.6 * radius * np.sin(turn)]
    )
    curve = curve_through(ring, vehicle=gg.PAPER.replace(max_tilt=1.3, max_thrust=4.0))
    report = curve.check(chord=1e-5)
    alpha = curve.at(np.linspace(0, curve.span, 4001))
    sigma = least_singular_value(alpha, curve.vehicle).min()
    values = np.asarray(level_determinant(alpha, curve.coefficients))
    shares = gg.invertibility.hover_thrust_shares(alpha, curve.vehicle)
    if report["least_singular_value"].ok:
        assert 0.05 <= report["least_singular_value"].value <= sigma + 1e-12  # type: ignore[operator]
        assert report["least_singular_value"].value >= sigma - 1e-3
    else:
        assert sigma < 0.05 + 1e-4
    if report["R_sign"].ok and report["R_sign"].decided:
        assert (np.sign(values) == np.sign(values[0])).all()
        assert abs(report["R_sign"].value) <= np.abs(values).min() + 1e-12  # type: ignore[arg-type]
    if report["hover_thrust"].ok:
        assert 0 < report["hover_thrust"].value <= shares.min() + 1e-12  # type: ignore[operator]
    if report["hover_thrust"].ok and report["thrust_limit"].ok:
        newtons = shares.max() * curve.vehicle.mass * curve.vehicle.gravity
        assert newtons <= report["thrust_limit"].value + 1e-9  # type: ignore[operator]
        assert report["thrust_limit"].value <= 4.0  # type: ignore[operator]
    assert (
        report["tilt_range"].ok == (np.abs(alpha).max() <= 1.3)
        or abs(np.abs(alpha).max() - 1.3) < 1e-5
    )
    if report.reachable_from_hover:
        assert (values > 0).all()


def test_a_curve_hovers_only_if_that_is_certain_between_its_chords() -> None:
    # The corners hover with positive thrusts; the spline swings across α1 = δ between them.
    delta = gg.invertibility.coefficients_of().delta
    corners = [(delta + 0.02, -1.2), (delta + 0.02, -0.4), (1.2, -0.8)]
    assert gg.lift(corners, "red").check()["hover_thrust"].ok
    assert not curve_through(corners).check()["hover_thrust"].ok
    near = curve_through(np.array(RING) + np.array([delta + 5e-4 - min(RING)[0], 0.0]))
    for chord in (1e-6, 1e-3, 5e-2):
        check = near.check(chord=chord)["hover_thrust"]
        assert (check.ok, "may have to idle" in check.message) == (
            chord == 1e-6,
            chord > 1e-6,
        )


@pytest.mark.parametrize(
    "curve", [rounded(gg.lift([(0.9, -0.7)], "red"), 0.1).curve, curve_through(RING)]
)
@pytest.mark.parametrize("chord", [1e-3, 1e-4])
def test_what_is_taken_off_for_the_chords_is_as_documented(
    curve: Curve, chord: float
) -> None:
    report, gait, kappa = (
        curve.check(chord=chord),
        curve.polyline(chord),
        gg.PAPER.drag_ratio,
    )
    along = gait.alpha + np.linspace(0, 1, 9)[:, None, None] * (gait.ends - gait.alpha)
    sigma, shares = (
        least_singular_value(along),
        gg.invertibility.hover_thrust_shares(along),
    )
    assert report["least_singular_value"].value == pytest.approx(
        sigma.min() - sqrt(4 + 2 * kappa**2) * chord, abs=2e-6
    )
    # The four angles move by 2√2·chord in sum, and R by no more than its size times that.
    of = curve.coefficients
    slack = sqrt(8) * float(of.form.size[2]) * chord
    least = np.abs(level_determinant(along, of)).min() - slack
    assert abs(report["R_sign"].value or 0) == pytest.approx(least, abs=2e-5)
    # Shares are m/(2D), with yaw torques m and D = m₁f₂ − f₁m₂, each of bounded slope.
    yaw = [kappa * np.cos(along[..., 0]) - np.sin(along[..., 0])]
    yaw.append(kappa * np.cos(along[..., 1]) + np.sin(along[..., 1]))
    lift = np.abs(yaw[0] * np.cos(along[..., 1]) + yaw[1] * np.cos(along[..., 0])).min()
    moved = (
        sqrt(2)
        * float(Form(yaw_block(gg.PAPER).form[:, :, None, None, None]).size[0])
        * chord
    )
    off = sqrt(1 + kappa**2) * chord / (2 * (lift - moved))
    high = (shares.max() + off) * lift / (lift - moved)
    low = shares.min() * lift / (lift + moved) - off
    assert report["hover_thrust"].value == pytest.approx(low, abs=1e-5)
    assert (
        f"hover thrusts {low:.3f} to {high:.3f} of m·g"
        in report["hover_thrust"].message
    )


# -- Rounded gaits


def distances(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distance of points from a closed polyline."""
    step = np.roll(corners, -1, axis=0) - corners
    size = np.maximum((step**2).sum(axis=1), 1e-300)
    along = np.clip(((points[:, None] - corners) * step).sum(axis=2) / size, 0, 1)
    return np.asarray(
        np.linalg.norm(corners + along[..., None] * step - points[:, None], axis=2).min(
            axis=1
        )
    )


@settings(deadline=None, max_examples=30)
@given(
    loop=st.lists(st.tuples(angle, angle), min_size=1, max_size=6),
    tolerance=st.floats(1e-4, 0.5),
    color=st.sampled_from(["red", "blue"]),
)
def test_curve_and_polyline_are_within_the_tolerance_both_ways(
    loop: list[tuple[float, float]], tolerance: float, color: str
) -> None:
    gait = gg.lift(loop, color)
    rounding = rounded(gait, tolerance)
    curve = rounding.curve
    for order in range(3):
        derivative = derivative_of(curve.pieces, order)
        ends = values_of(derivative, np.diff(curve.breaks))
        largest = values_of(
            np.abs(derivative), np.diff(curve.breaks)
        ).max()  # round-off is relative to terms of a sum
        assert np.abs(np.roll(ends, 1, axis=0) - derivative[-1]).max() <= 1e-8 * max(
            largest, 1e-300
        )
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
        nearest = np.linalg.norm(
            points - rounding.gait.alpha[corner.corner, :2], axis=1
        ).min()
        assert nearest <= corner.deviation + spacing
        assert corner.shrunk or corner.deviation in (0.0, pytest.approx(tolerance))


def test_a_corner_passes_at_the_stated_distance() -> None:
    for turn in (0.3, 1.0, pi / 2, 2.5, 3.1):
        legs = np.array(
            [[-0.5, 0.0], [0.0, 0.0], [0.5 * np.cos(turn), 0.5 * np.sin(turn)]]
        )
        rounding = rounded(gg.lift(legs, "red"), 1e-3)
        corner = next(one for one in rounding.corners if one.corner == 1)
        assert corner.turn == pytest.approx(turn)
        points = rounding.curve.at(np.linspace(0, rounding.curve.span, 40_001))[:, :2]
        assert np.linalg.norm(points, axis=1).min() == pytest.approx(1e-3, rel=1e-3)


def test_turning_back_stays_on_the_line_and_reaches_the_tip() -> None:
    gait = gg.lift([(0.4, -1.2), (1.2, -0.4)], "red")
    rounding = rounded(gait, 0.02)
    assert rounding.deviation == 0
    assert [corner.turn for corner in rounding.corners] == [pytest.approx(pi)] * 2
    s = np.linspace(0, rounding.curve.span, 10_001)
    points = rounding.curve.at(s)[:, :2]
    np.testing.assert_allclose(points[:, 0] - points[:, 1], 1.6, atol=1e-12)
    turned = rounding.curve.at(rounding.curve.turning_points())[:, 0]
    np.testing.assert_allclose([turned.min(), turned.max()], [0.4, 1.2], atol=1e-15)
    # Forth once and back once, at rest in the parameter only at the tips.
    assert rounding.curve.length == pytest.approx(gait.length)
    speed = np.linalg.norm(rounding.curve.at(s, 1)[:, :2], axis=1)
    assert (speed < 1e-3).sum() <= 8


def test_straight_runs_need_no_blend_and_legs_are_shared() -> None:
    gait = gg.lift([(0.4, -0.4), (0.6, -0.4), (0.8, -0.4), (0.8, -1.2)], "red")
    rounding = rounded(gait, 1.0)
    assert (len(rounding.gait.alpha), rounding.merged) == (3, (0, 1, 2))
    assert "shrunk to share a leg" in str(rounding)
    leg = np.linalg.norm((rounding.gait.ends - rounding.gait.alpha)[:, :2], axis=1)
    reach = np.array([corner.reach for corner in rounding.corners])
    left = leg - reach - np.roll(reach, -1)
    assert (left >= -1e-12 * leg).all()
    assert left.min() < 1e-12
    # A small tolerance needs no shrinking.
    assert rounded(gait, 1e-5).as_mapping()["shrunk"] == []
