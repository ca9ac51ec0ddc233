"""Tilt margins and the worst attitude within a tilt, against brute force over attitudes and directions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import brentq

from gaitgraph.errors import InputError
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import Coefficients, coefficients_of
from gaitgraph.invertibility.matrices import (
    attitude_of,
    attitude_sensitivities,
    body_vertical,
    determinant,
    least_singular_value,
    level_determinant,
    scaled_decoupling_matrix,
)
from gaitgraph.invertibility.tilt_margins import (
    LeastMargin,
    least_singular_value_within,
    least_singular_value_within_bound,
    least_tilt_margin,
    nearest_singular_attitude,
    sensitivity_deviations,
    singular_everywhere,
    tilt_margin,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.published import GAITS
from tests.samples import (
    EXACT,
    PUBLISHED,
    along,
    by_kind,
    closed,
    on_blue,
    on_red,
    points_of,
    random_tilts,
    random_vehicle,
)
from tests.test_invertibility_matrices import FUNCTIONS

FloatArray = npt.NDArray[np.float64]

GOOD = [0.3, -0.2, 0.1, 0.5]


def cap(tilt: float, rings: int, spokes: int) -> FloatArray:
    """Return (roll, pitch) of attitudes all over the cap of a tilt, its rim included, shape (2, rings, spokes)."""
    m, z = (
        np.linspace(0.0, tilt, rings)[:, None],
        np.linspace(0.0, 2 * math.pi, spokes)[None],
    )
    up = np.stack(
        [np.sin(m) * np.cos(z), np.sin(m) * np.sin(z), np.cos(m) + 0 * z], axis=-1
    )
    return np.moveaxis(attitude_of(up), -1, 0)


def around(corners: FloatArray) -> FloatArray:
    return np.append(corners, corners[:1], axis=0)


def location(corners: FloatArray, found: LeastMargin) -> FloatArray:
    starts, ends = closed(corners)
    return np.asarray(
        starts[found.segment] + found.fraction * (ends - starts)[found.segment]
    )


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
def test_rows_that_are_not_finite_are_refused(function: Any, wrong: float) -> None:
    with pytest.raises(InputError, match="^alpha must be finite angles"):
        function(np.array([[wrong, 0, 0, 0], GOOD]))


class TestTiltMargin:
    """The closed form, against the determinant of forces and torques over tilts and directions."""

    def test_against_brute_force_over_tilts_and_directions(self) -> None:
        """Below the margin the determinant keeps its sign in every direction; just above, it loses it in one."""
        random = np.random.default_rng(1)
        for _ in range(25):
            vehicle = random_vehicle(random)
            alpha = random.uniform(-1.6, 1.6, 4)
            margin = float(tilt_margin(alpha, coefficients_of(vehicle, "exact")))
            below = np.linalg.det(
                scaled_decoupling_matrix(alpha, vehicle, *cap(margin - 1e-6, 20, 91))
            )
            assert below.min() * below.max() > 0
            if margin < math.pi / 2 - 2e-3:
                above = np.linalg.det(
                    scaled_decoupling_matrix(
                        alpha, vehicle, *cap(margin + 1e-3, 2, 1801)
                    )
                )
                assert above.min() * above.max() < 0

    def test_it_is_that_of_v_and_its_attitude_is_singular_and_that_far_away(
        self,
    ) -> None:
        random = np.random.default_rng(2)
        for numbers in (
            EXACT,
            PUBLISHED,
            *(coefficients_of(random_vehicle(random), "exact") for _ in range(8)),
        ):
            alpha, roll, pitch = (
                random_tilts(3, 400),
                *random.uniform(-1.5, 1.5, (2, 400)),
            )
            v, margin = (
                attitude_sensitivities(alpha, numbers),
                tilt_margin(alpha, numbers),
            )
            size = np.linalg.norm(v, axis=1)
            product = np.sum(v * body_vertical(roll, pitch), axis=-1)
            np.testing.assert_allclose(
                product,
                determinant(alpha, numbers, roll, pitch),
                rtol=1e-10,
                atol=1e-10,
            )
            np.testing.assert_allclose(
                np.sin(margin), np.abs(v[:, 2]) / size, rtol=0, atol=1e-12
            )
            nearest = nearest_singular_attitude(alpha, numbers).T
            assert (np.abs(determinant(alpha, numbers, *nearest)) <= 1e-12 * size).all()
            np.testing.assert_allclose(
                body_vertical(*nearest)[:, 2], np.cos(margin), atol=1e-12
            )

    def test_ninety_degrees_on_red_and_none_on_blue(self) -> None:
        random = np.random.default_rng(6)
        for _ in range(10):
            exact = coefficients_of(random_vehicle(random), "exact")
            first, second = random.uniform(-1.6, 1.6, (2, 50))
            red, blue = on_red(first, second), on_blue(first, second, exact.delta)
            assert (tilt_margin(red, exact) == math.pi / 2).all()
            assert singular_everywhere(blue, exact).all()
            assert np.isnan(tilt_margin(blue, exact)).all()
            for alpha in (red, blue):
                assert np.isnan(nearest_singular_attitude(alpha, exact)).all()

    def test_turned_arms_and_mirrored_spin(self) -> None:
        """Turned arms turn v and nothing else; a mirrored vehicle with negated angles is as robust."""
        alpha = random_tilts(5, 50, reach=1.6)
        for ratio, turn in ((0.01, 2.0), (PAPER.drag_ratio, -0.7), (3.0, 1.1)):
            vehicle = Vehicle(drag_ratio=ratio)
            plain, turned, mirrored = (
                coefficients_of(vehicle.replace(**options), "exact")
                for options in (
                    {},
                    {"first_arm_angle": turn},
                    {"first_rotor_spin": "counterclockwise"},
                )
            )
            v, c, s = (
                attitude_sensitivities(alpha, plain),
                math.cos(turn),
                math.sin(turn),
            )
            rotated = v @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
            np.testing.assert_allclose(
                attitude_sensitivities(alpha, turned), rotated, atol=1e-12 / ratio
            )
            np.testing.assert_allclose(
                tilt_margin(-alpha, mirrored), tilt_margin(alpha, plain), atol=1e-9
            )

    def test_printed_digits_of_blue_give_no_margin(self) -> None:
        """Rounded angles give margins of up to 90° that are only noise; with the stated rounding there is none."""
        for gait in GAITS[:2]:
            printed = np.column_stack([np.round(gait.angles, 3), gait.printed])
            assert np.isfinite(tilt_margin(printed, EXACT)).all()
            assert np.isnan(tilt_margin(printed, EXACT, angle_rounding=5e-4)).all()
            assert np.isnan(
                tilt_margin(lift(gait.angles, "blue").alpha, PUBLISHED)
            ).all()
            # Biased, it is a configuration like any other.
            assert np.isfinite(
                tilt_margin(printed * [1, 1, 0.8, 0.8], EXACT, angle_rounding=5e-4)
            ).all()
        assert np.isfinite(
            tilt_margin(lift(GAITS[2].angles, "red").alpha, EXACT, angle_rounding=5e-4)
        ).all()

    def test_rounding_hides_v_on_blue_and_not_far_beyond(self) -> None:
        random, rounding = np.random.default_rng(9), 5e-4
        a1, a2 = random.uniform(-1.2, 1.2, (2, 500))
        blue = on_blue(a1, a2, EXACT.delta)
        move = random.uniform(-1, 1, (500, 4))
        move /= np.abs(move).max(axis=1, keepdims=True)
        near = singular_everywhere(
            blue + rounding * move, EXACT, angle_rounding=rounding
        )
        assert near.all()
        far = blue + 10 * rounding * move
        found = singular_everywhere(far, EXACT, angle_rounding=rounding)
        assert found.mean() < 0.05


class TestLeastTiltMargin:
    @pytest.mark.parametrize(
        ("gait", "eta", "degrees"),
        [
            (2, 1.0, 90.0),
            (3, 1.0, 90.0),
            (2, 0.8, 74.46),
            (3, 0.8, 61.66),
            (1, 0.99, 41.74),
            (1, 0.8, 44.99),
        ],
    )
    def test_of_the_four_gaits(
        self, gait: int, eta: float, degrees: float, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(
            "gaitgraph.invertibility.segment_bounds._MOST_POINTS", 100_000
        )  # no more are needed
        alpha = lift(
            GAITS[gait].angles, GAITS[gait].color, coefficients=EXACT
        ).alpha * [1, 1, eta, eta]
        found = least_tilt_margin(around(alpha), EXACT)
        assert math.degrees(found.upper) == pytest.approx(degrees, abs=5.1e-3)
        assert found.reason == ""
        assert found.lower <= found.upper <= found.lower + 1.01e-7

    def test_gait_1_biased_passes_a_singular_matrix(self) -> None:
        alpha = lift(GAITS[0].angles, "blue", coefficients=EXACT).alpha * [
            1,
            1,
            0.8,
            0.8,
        ]
        found = least_tilt_margin(around(alpha), EXACT)
        assert (found.lower, found.upper, found.reason) == (
            0.0,
            0.0,
            "R changes its sign",
        )
        assert abs(level_determinant(location(alpha, found), EXACT)) < 1e-12

    @by_kind
    def test_blue_has_none(self, numbers: Coefficients) -> None:
        for gait in GAITS[:2]:
            alpha = lift(gait.angles, "blue", coefficients=numbers).alpha
            found = least_tilt_margin(around(alpha), numbers)
            assert not found.exists
            assert math.isnan(found.lower)
            assert "singular at every attitude" in found.reason
        # One blue segment is enough, a blue point too.
        points = np.vstack([alpha[0] + [0.1, 0.2, 0.0, 0.1], alpha[:2]])
        found = least_tilt_margin(around(points), numbers)
        assert (found.exists, found.segment) == (False, 1)
        assert not least_tilt_margin(alpha[[0, 0]], numbers).exists

    def test_against_dense_sampling(self) -> None:
        """Never above what is met, never below what the bracket says, and met where it says."""
        random = np.random.default_rng(3)
        kinds = set()
        for number in range(40):
            exact = coefficients_of(random_vehicle(random), "exact")
            size = random.choice([0.02, 0.2, 1.0, 3.0])
            points = random.uniform(-1.6, 1.6, 4) + random.uniform(
                -size, size, (random.integers(1, 7), 4)
            )
            if number % 3 == 0:
                points[:, 2:] = points[:, :2] * random.choice([0.8, 0.99, 1.0])
            found = least_tilt_margin(around(points), exact)
            alpha = along(points, 600)
            R, dense = level_determinant(alpha, exact), tilt_margin(alpha, exact)
            if R.min() * R.max() < 0:
                assert (found.lower, found.upper, found.reason) == (
                    0.0,
                    0.0,
                    "R changes its sign",
                )
                assert (
                    abs(level_determinant(location(points, found), exact))
                    <= 1e-12 * np.abs(R).max()
                )
                kinds.add("zero")
            else:
                assert found.lower <= np.nanmin(dense) + 1e-12
                assert found.upper <= np.nanmin(dense) + 1e-7
                assert found.upper - found.lower <= 1.01e-7
                assert tilt_margin(location(points, found), exact) == pytest.approx(
                    found.upper, abs=1e-12
                )
                kinds.add("red" if found.upper == math.pi / 2 else "between")
        assert kinds == {"zero", "red", "between"}

    def test_without_any_cut_the_bracket_holds(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("gaitgraph.invertibility.segment_bounds._MOST_POINTS", 0)
        starts, steps = random_tilts(7, 200, reach=1.5), random_tilts(8, 200, reach=0.3)
        dense = tilt_margin(points_of(starts, starts + steps, 101), EXACT).min(axis=1)
        lower = np.array(
            [
                least_tilt_margin([p, p + d], EXACT).lower
                for p, d in zip(starts, steps, strict=True)
            ]
        )
        assert (lower <= dense + 1e-12).all()
        assert lower.mean() > 0.85 * dense.mean()
        # On the surface no cut is needed: 10,000 rows of a random walk take a second.
        corners = np.random.default_rng(9).uniform([-0.9, 0.7], [-0.7, 0.9], (500, 2))[
            :, [0, 1, 0, 1]
        ]
        assert least_tilt_margin(around(corners), EXACT).lower == pytest.approx(
            math.pi / 2, abs=1e-12
        )

    def test_a_loop_that_only_touches_zero(self) -> None:
        """On red v vanishes with R, off it v does not: the reason says which."""
        border = EXACT.delta - math.pi / 2
        corners = np.array([[border, 0.5], [border + 0.5, 0.5], [border + 0.5, 0.9]])
        red = np.hstack([corners, corners])
        assert (np.abs(level_determinant(red[1:], EXACT)) > 1).all()
        found = least_tilt_margin(around(red), EXACT)
        assert (found.upper, found.segment, found.fraction) == (0.0, 0, 0.0)
        assert "every attitude, at this point only" in found.reason
        zero = brentq(
            lambda x: float(level_determinant([x, -0.4, 0.5, 0.3], EXACT)),
            0.0,
            0.3,
            xtol=1e-16,
        )
        off = np.array([[zero, -0.4, 0.5, 0.3]] * 3) + np.array(
            [[0.0, 0, 0, 0], [0.1, 0, 0, 0], [0.2, 0.02, 0, 0]]
        )
        found = least_tilt_margin(around(off), EXACT)
        assert found.upper < 1e-12
        assert "every attitude" not in found.reason
        assert abs(level_determinant(location(off, found), EXACT)) < 1e-12

    def test_v_strays_from_its_chords_by_no_more_than_is_said(self) -> None:
        random = np.random.default_rng(4)
        s = np.linspace(0.0, 1.0, 65)[:, None, None]
        for size in (1e-3, 0.1, 1.0, 4.0):
            exact = coefficients_of(random_vehicle(random), "exact")
            starts = random.uniform(-2, 2, (80, 4))
            ends = starts + random.uniform(-size, size, (80, 4))
            starts[:20, 2:], ends[:20, 2:] = starts[:20, :2], ends[:20, :2]
            v = attitude_sensitivities(starts + s * (ends - starts), exact)
            off = v - (v[0] + s * (v[-1] - v[0]))
            across, level = sensitivity_deviations(starts, ends, exact)
            slack = 1e-12 * (1 + np.abs(v).max())
            assert (
                np.hypot(off[..., 0], off[..., 1]).max(axis=0) <= across + slack
            ).all()
            assert (np.abs(off[..., 2]).max(axis=0) <= level + slack).all()
            assert (across[:20] < 1e-12 * (1 + np.abs(v).max())).all()


def test_against_sampling_of_the_whole_cap() -> None:
    """Attained where it says, exactly on the rim, and no attitude of the cap, inside it too, is worse."""
    random = np.random.default_rng(5)
    open_ = 0
    for number in range(40):
        vehicle = random_vehicle(random)
        alpha = random.uniform(-1.6, 1.6, 4)
        if number % 2:
            alpha[2:] = alpha[:2] + random.normal(
                0, random.choice([0.0, 1e-9, 1e-3]), 2
            )
        if number % 10 == 0:
            alpha = random.choice([-0.5, 0.0, 1.2], 4)  # singular values that coincide
        tilt = float(random.choice([0.0, 1e-6, 0.01, 0.3, 1.0, 1.5]))
        value, attitude = least_singular_value_within(alpha, tilt, vehicle)
        found, up = (
            float(least_singular_value(alpha, vehicle, *attitude)),
            body_vertical(*attitude),
        )
        dense = least_singular_value(alpha, vehicle, *cap(tilt, 11, 181))
        if tilt_margin(alpha, coefficients_of(vehicle, "exact")) > tilt:
            open_ += 1
            assert value == pytest.approx(found, abs=1e-12)
            assert math.hypot(up[0], up[1]) == pytest.approx(math.sin(tilt), abs=1e-12)
            assert value <= dense.min() + 1e-12
            assert value >= dense.min() - 0.02  # the sampling is that coarse
            assert (
                value - 1e-4
                < least_singular_value_within_bound(alpha[None], tilt, vehicle)[0]
                < value
            )
        else:
            assert value == 0.0
            assert found < 1e-9
            assert math.acos(min(up[2], 1.0)) <= tilt + 1e-9
    assert 20 < open_ < 40
