"""The sheet of any four rotors: angles, derivatives, bounds along segments, borders, and rows dense enough for chords."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.invertibility.matrices import (
    attitude_sensitivities,
    hover_thrust_shares,
)
from gaitgraph.surface.curved import curved_sheet
from gaitgraph.surface.sheets import curved_roots
from tests.samples import LEANING, ODD, STANDING, by_vehicle

RNG = np.random.default_rng(8)
KINDS = by_vehicle(ODD, LEANING, STANDING)


def separation(first: np.ndarray, second: np.ndarray) -> float:
    """Return the largest difference of angles modulo π."""
    return float(np.abs(np.angle(np.exp(2j * (first - second)))).max() / 2)


@KINDS
def test_the_sheet_is_what_a_solver_finds_without_forms(vehicle: gg.Vehicle) -> None:
    """The thrusts that carry the weight of a rotated, not expanded, model, against the closed form."""
    geometry = Geometry.of_vehicle(vehicle)
    plane = RNG.uniform(-1.4, 1.4, (6, 2))
    expected = curved_sheet(vehicle).angles(*plane.T)

    def residual(unknown: np.ndarray, place: np.ndarray) -> np.ndarray:
        alpha = np.array([*place, *unknown[:2]])
        wrench = np.vstack(
            [geometry.moment_matrix(alpha), geometry.force_matrix(alpha)]
        )
        return np.asarray(wrench @ unknown[2:] - [0, 0, 0, 0, 0, 1.0])

    for place, angles in zip(plane, expected, strict=True):
        found = None
        for _ in range(60):
            start = np.concatenate([RNG.uniform(-1.5, 1.5, 2), RNG.uniform(-1, 1, 4)])
            solution = least_squares(
                residual, start, args=(place,), xtol=1e-15, ftol=1e-15, gtol=1e-15
            )
            if solution.cost < 1e-24:
                found = solution.x
                break
        assert found is not None
        assert separation(found[:2], angles) < 1e-6


@KINDS
def test_it_is_the_invertible_root_with_its_thrusts(vehicle: gg.Vehicle) -> None:
    plane = RNG.uniform(-1.5, 1.5, (50, 2))
    sheet = curved_sheet(vehicle)
    angles = sheet.angles(*plane.T)
    alpha = np.hstack([plane, angles])
    v = attitude_sensitivities(alpha, coefficients_of(vehicle, "exact"))
    assert np.abs(v[:, :2]).max() < 1e-11 * np.abs(v).max()
    shares = hover_thrust_shares(alpha, vehicle)
    np.testing.assert_allclose(
        sheet.hover_thrusts(*plane.T), shares, rtol=1e-6, atol=1e-8
    )

    # R is the product of the forms ρ and λ over the lengths of U3 and U4, up to one constant.
    u1, u2 = (np.stack([np.cos(x), np.sin(x)], axis=-1) for x in plane.T)
    lift, contact = sheet.factors_of_R(*plane.T)
    U = np.einsum("abkc,na,nb->nkc", sheet.opposite, u1, u2)
    factors = lift * contact / np.linalg.norm(U, axis=-1).prod(axis=-1)
    ratios = factors * np.prod(np.sign(U[:, :, 0]), axis=1) / v[:, 2]
    np.testing.assert_allclose(ratios, np.median(ratios), rtol=1e-5)


@KINDS
def test_derivatives_are_those_of_differences(vehicle: gg.Vehicle) -> None:
    sheet, step = curved_sheet(vehicle), 1e-5
    plane = RNG.uniform(-1.4, 1.4, (20, 2))
    slopes = sheet.slopes(*plane.T)
    bends = sheet.second_derivatives(*plane.T)
    for angle in (0, 1):
        move = step * np.eye(2)[angle]
        after, before = (plane + sign * move for sign in (1, -1))
        turn = sheet.angles(*after.T) - sheet.angles(*before.T)
        turn = np.angle(np.exp(2j * turn)) / 2
        np.testing.assert_allclose(
            turn / (2 * step), slopes[..., angle], rtol=1e-4, atol=1e-5
        )
        change = sheet.slopes(*after.T) - sheet.slopes(*before.T)
        np.testing.assert_allclose(
            change / (2 * step), bends[..., angle], rtol=1e-3, atol=1e-4
        )
    # The sign of ∂/∂α1 depends on α2 alone, that of ∂/∂α2 on α1 alone.
    grid = np.linspace(-1.4, 1.4, 30)
    signs = np.sign(sheet.slopes(grid[:, None], grid))
    assert (signs[..., 0] == signs[:1, :, :, 0]).all()
    assert (signs[..., 1] == signs[:, :1, :, 1]).all()
    np.testing.assert_allclose(bends, np.swapaxes(bends, -1, -2), rtol=1e-6, atol=1e-9)


@KINDS
def test_bounds_hold_along_segments_and_are_near(vehicle: gg.Vehicle) -> None:
    sheet = curved_sheet(vehicle)
    starts = RNG.uniform(-1.5, 1.5, (40, 2))
    ends = starts + RNG.normal(0, 0.02, (40, 2))
    steps = ends - starts
    rates, bends = sheet.bounds_along(starts, ends)
    points = starts[:, None] + np.linspace(0, 1, 401)[:, None] * steps[:, None]
    along = np.einsum(
        "mskv,mv->msk", sheet.slopes(points[..., 0], points[..., 1]), steps
    )
    second = sheet.second_derivatives(points[..., 0], points[..., 1])
    bent = np.einsum("mskvw,mv,mw->msk", second, steps, steps)
    assert (np.abs(along).max(axis=1) <= rates).all()
    assert (np.abs(bent).max(axis=1) <= bends).all()
    ratio = rates / np.abs(along).max(axis=1)
    assert np.median(ratio) < 1.1
    assert np.median(bends / np.abs(bent).max(axis=1)) < 2


@KINDS
def test_waves_are_what_half_turns_leave(vehicle: gg.Vehicle) -> None:
    """Of U in u1 and u2: a quarter turn of α1 with one of α2 leaves one wave and negates the other."""
    sheet = curved_sheet(vehicle)
    alpha1, alpha2 = np.linspace(0.0, np.pi, 400)[:, None], np.zeros((1, 2))
    quarter = np.pi / 2 * np.array([-1, 1])  # leaves that of α1 + α2, of α1 − α2
    here = sheet._directions(alpha1, alpha2)
    there = sheet._directions(alpha1 + np.pi / 2, alpha2 + quarter)
    sizes = np.linalg.norm(here + there, axis=-1).max(axis=0) / 2
    np.testing.assert_allclose(sheet.waves.T, sizes, rtol=1e-4)


@KINDS
def test_chords_of_rows_are_as_near_as_stated(vehicle: gg.Vehicle) -> None:
    sheet = curved_sheet(vehicle)
    corners = RNG.uniform(-1.2, 1.2, (4, 2))
    alpha, deviation = sheet.rows(corners)
    assert deviation <= 1e-3
    assert all(
        (np.abs(alpha[:, :2] - corner).max(axis=1) == 0).any() for corner in corners
    )
    assert np.abs(np.diff(alpha, axis=0)).max() < math.pi / 2
    shares = np.linspace(0, 1, 30)[:, None, None]
    chords = alpha[:-1] + shares * np.diff(alpha, axis=0)
    on_sheet = sheet.angles(chords[..., 0], chords[..., 1])
    assert separation(chords[..., 2:], on_sheet) <= deviation
    finer = sheet.rows(corners, 1e-5)
    assert finer.deviation <= 1e-5
    assert len(finer.alpha) > len(alpha)


def border(form: np.ndarray, alpha1: np.ndarray) -> np.ndarray:
    """Return the α2 at which a form in u1 and u2 is zero."""
    first, second = form.T @ np.array([np.cos(alpha1), np.sin(alpha1)])
    return np.asarray(np.arctan(-first / second))


@KINDS
def test_borders_are_where_angles_and_forms_say(vehicle: gg.Vehicle) -> None:
    sheet = curved_sheet(vehicle)
    first = RNG.uniform(-1.5, 1.5, 30)
    for rotor, tilt in ((3, 0.7), (4, -0.4), (3, math.pi / 2), (4, math.pi / 2)):
        second = border(sheet.tilt_border(rotor, tilt), first)
        angles = sheet.angles(first, second)[:, rotor - 3]
        assert separation(angles, np.full(30, tilt)) < 1e-9
    lifted = sheet.hover_thrusts(first, border(sheet.lift, first))
    assert np.abs(lifted).min(axis=1).max() > 1e6

    # Both roots meet where λ is zero.
    exact = coefficients_of(vehicle, "exact")
    for angle in first[:6]:

        def contact(second: float, first: float = angle) -> float:
            return float(sheet.factors_of_R(first, second)[1])

        grid = np.linspace(-math.pi / 2, math.pi / 2, 400)
        values = np.array([contact(x) for x in grid])
        for k in np.flatnonzero(values[1:] * values[:-1] < 0):
            zero = brentq(contact, grid[k], grid[k + 1], xtol=1e-14)
            red, singular = curved_roots(angle, zero, exact)
            assert separation(red, singular) < 1e-5


def test_the_sheet_of_a_symmetric_vehicle_is_its_plane() -> None:
    sheet = curved_sheet(gg.PAPER)
    delta = coefficients_of(gg.PAPER, "exact").delta
    plane = RNG.uniform(0.05, 0.9, (100, 2)) * RNG.choice([-1, 1], (100, 2))
    plane += [delta, -delta]  # beside the fibres
    assert separation(sheet.angles(*plane.T), plane) < 1e-12
    np.testing.assert_allclose(
        sheet.slopes(*plane.T), np.tile(np.eye(2), (100, 1, 1)), atol=1e-11
    )
    # λ is zero on the crossing lines and where β = ±π/2, on which rotors idle.
    for angle in (-delta, math.pi / 2 - delta):
        assert abs(sheet.factors_of_R(0.3, angle)[1]) < 1e-12
    with pytest.raises(gg.InputError, match="must not lead through a fibre"):
        sheet.rows([[delta - 0.1, 0.2], [delta + 0.1, 0.2]])
