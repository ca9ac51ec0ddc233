"""Tilt margins and the worst attitude within a tilt, against brute force over attitudes and directions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from scipy.optimize import brentq

import gaitgraph as gg
from gaitgraph.errors import InputError
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.branch_and_bound import Least
from gaitgraph.invertibility.matrices import (
    Coefficients,
    body_vertical,
    coefficients_of,
    determinant,
    least_singular_value,
    level_determinant,
    scaled_decoupling_matrix,
)
from gaitgraph.invertibility.tilt_margins import (
    LeastMargin,
    attitude_sensitivities,
    least_singular_value_within,
    least_tilt_margin,
    nearest_singular_attitude,
    sensitivity_deviations,
    singular_everywhere,
    tilt_margin,
)
from gaitgraph.vehicle import Vehicle
from tests.published import GAITS, PublishedGait

if TYPE_CHECKING:
    from collections.abc import Callable

FloatArray = npt.NDArray[np.float64]

EXACT, PUBLISHED = coefficients_of(kind="exact"), coefficients_of()
SHAPES = hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)
ANGLE = st.floats(-1.6, 1.6)
VEHICLES = st.builds(
    Vehicle,
    drag_ratio=st.floats(0.01, 3.0),
    first_arm_angle=st.sampled_from([0.0, math.pi / 4, 1.0, -2.0]),
    first_rotor_spin=st.sampled_from(["clockwise", "counterclockwise"]),
)


def some_vehicle(random: np.random.Generator) -> Vehicle:
    return Vehicle(
        drag_ratio=float(np.exp(random.uniform(math.log(0.01), math.log(3.0)))),
        first_arm_angle=float(random.choice([0.0, math.pi / 4, 1.0, -2.0])),
        first_rotor_spin="clockwise" if random.random() < 0.5 else "counterclockwise",
    )


def attitude_of(up: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.arctan2(up[..., 1], up[..., 2]), -np.arcsin(np.clip(up[..., 0], -1.0, 1.0))


def cap(tilt: float, rings: int, spokes: int) -> tuple[FloatArray, FloatArray]:
    """Return (roll, pitch) of attitudes all over the cap of a tilt, its rim with them."""
    m, z = np.linspace(0.0, tilt, rings)[:, None], np.linspace(0.0, 2 * math.pi, spokes)[None]
    return attitude_of(np.stack([np.sin(m) * np.cos(z), np.sin(m) * np.sin(z), np.cos(m) + 0 * z], axis=-1))


def closed(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    return points, np.roll(points, -1, axis=0)


def along(points: FloatArray, count: int) -> FloatArray:
    starts, ends = closed(points)
    s = np.linspace(0.0, 1.0, count)[:, None, None]
    return np.asarray((starts + s * (ends - starts)).reshape(-1, 4))


def place(points: FloatArray, found: LeastMargin) -> FloatArray:
    starts, ends = closed(points)
    return np.asarray(starts[found.segment] + found.fraction * (ends - starts)[found.segment])


class TestShapes:
    """Leading axes broadcast, and one row's answer does not depend on the others."""

    @settings(deadline=None, max_examples=30)
    @given(shape=SHAPES, seed=st.integers(0, 100))
    def test_every_row_as_if_alone(self, shape: tuple[int, ...], seed: int) -> None:
        alpha = np.random.default_rng(seed).uniform(-1.6, 1.6, (*shape, 4))
        value, attitude = least_singular_value_within(alpha, 0.4)
        answers: dict[str, tuple[Any, Callable[[FloatArray], Any], tuple[int, ...]]] = {
            "margin": (tilt_margin(alpha, EXACT), lambda row: tilt_margin(row, EXACT), ()),
            "v": (attitude_sensitivities(alpha, EXACT), lambda row: attitude_sensitivities(row, EXACT), (3,)),
            "nearest": (
                nearest_singular_attitude(alpha, EXACT),
                lambda row: nearest_singular_attitude(row, EXACT),
                (2,),
            ),
            "everywhere": (singular_everywhere(alpha, EXACT), lambda row: singular_everywhere(row, EXACT), ()),
            "value": (value, lambda row: least_singular_value_within(row, 0.4)[0], ()),
            "attitude": (attitude, lambda row: least_singular_value_within(row, 0.4)[1], (2,)),
        }
        for name, (found, alone, tail) in answers.items():
            assert np.shape(found) == (*shape, *tail), name
            for index in np.ndindex(*shape):
                np.testing.assert_allclose(found[index], alone(alpha[index]), atol=1e-9, err_msg=name)

    def test_more_rows_than_a_block(self) -> None:
        alpha = np.random.default_rng(0).uniform(-1.6, 1.6, (20_001, 4))
        margin = tilt_margin(alpha, EXACT)
        np.testing.assert_array_equal(margin[::1999], tilt_margin(alpha[::1999], EXACT))

    @pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
    def test_what_is_not_finite_has_no_answer_and_spoils_no_other(self, wrong: float) -> None:
        good = [0.3, -0.2, 0.1, 0.5]
        rows = np.array([[wrong, 0, 0, 0], good, [0, 0, 0, wrong]])
        alone, at = least_singular_value_within(good, 0.3)
        margin, nearest = tilt_margin(rows, EXACT), nearest_singular_attitude(rows, EXACT)
        value, attitude = least_singular_value_within(rows, 0.3)
        assert np.isnan([*margin[[0, 2]], *nearest[[0, 2]].ravel(), *value[[0, 2]], *attitude[[0, 2]].ravel()]).all()
        assert not singular_everywhere(rows, EXACT).any()
        assert margin[1] == pytest.approx(tilt_margin(good, EXACT), abs=1e-15)
        assert value[1] == pytest.approx(alone, abs=1e-15)
        np.testing.assert_allclose(attitude[1], at, atol=1e-9)

    @pytest.mark.parametrize("shape", [(), (3,), (8,), (4, 2)])
    def test_wrong_shapes_are_told(self, shape: tuple[int, ...]) -> None:
        alpha = np.zeros(shape)
        for call in (
            lambda: tilt_margin(alpha, EXACT),
            lambda: nearest_singular_attitude(alpha, EXACT),
            lambda: singular_everywhere(alpha, EXACT),
            lambda: attitude_sensitivities(alpha, EXACT),
            lambda: least_singular_value_within(alpha, 0.3),
        ):
            with pytest.raises(InputError, match=r"allowed is \(\.\.\., 4\)"):
                call()


class TestTiltMargin:
    """The closed form, against the determinant of forces and torques over tilts and directions."""

    def test_against_brute_force_over_tilts_and_directions(self) -> None:
        """Below the margin the determinant keeps its sign in every direction; just above, it loses it in one."""
        random = np.random.default_rng(1)
        for _ in range(60):
            vehicle = some_vehicle(random)
            alpha = random.uniform(-1.6, 1.6, 4)
            margin = float(tilt_margin(alpha, coefficients_of(vehicle, "exact")))
            below = np.linalg.det(scaled_decoupling_matrix(alpha, vehicle, *cap(margin - 1e-6, 40, 181)))
            assert below.min() * below.max() > 0
            if margin < math.pi / 2 - 2e-3:
                above = np.linalg.det(scaled_decoupling_matrix(alpha, vehicle, *cap(margin + 1e-3, 2, 3601)))
                assert above.min() * above.max() < 0

    @settings(deadline=None, max_examples=150)
    @given(alpha=st.tuples(ANGLE, ANGLE, ANGLE, ANGLE), vehicle=VEHICLES)
    def test_the_nearest_singular_attitude_is_singular_and_that_far_away(
        self, alpha: tuple[float, ...], vehicle: Vehicle
    ) -> None:
        exact = coefficients_of(vehicle, "exact")
        size = float(np.linalg.norm(attitude_sensitivities(alpha, exact)))
        roll, pitch = nearest_singular_attitude(alpha, exact)
        if math.isnan(roll):  # red, blue, or so near to them that floating point does not tell
            assert math.isnan(tilt_margin(alpha, exact)) or math.sin(tilt_margin(alpha, exact)) > 1 - 1e-8
            return
        margin = float(tilt_margin(alpha, exact))
        loss = 1e-8 if math.isnan(margin) else max(math.cos(margin), 1e-8)  # what an angle near ±π/2 carries
        assert abs(determinant(alpha, exact, roll, pitch)) <= 1e-14 * max(size, 1 / vehicle.drag_ratio) / loss
        if not math.isnan(margin):
            assert math.acos(min(body_vertical(roll, pitch)[2], 1.0)) == pytest.approx(margin, abs=3e-8)

    @settings(deadline=None, max_examples=100)
    @given(alpha=st.tuples(ANGLE, ANGLE, ANGLE, ANGLE), ratio=st.floats(0.01, 3.0), turn=st.floats(-3.0, 3.0))
    def test_turned_arms_and_mirrored_spin(self, alpha: tuple[float, ...], ratio: float, turn: float) -> None:
        """Turned arms turn v and nothing else; a mirrored vehicle with negated angles is as robust."""
        plain = coefficients_of(Vehicle(drag_ratio=ratio), "exact")
        turned = coefficients_of(Vehicle(drag_ratio=ratio, first_arm_angle=turn), "exact")
        mirrored = coefficients_of(Vehicle(drag_ratio=ratio, first_rotor_spin="counterclockwise"), "exact")
        c, s = math.cos(turn), math.sin(turn)
        v = attitude_sensitivities(alpha, plain)
        size = 1e-13 * (1 + float(np.abs(v).max()) + 1 / ratio)
        np.testing.assert_allclose(
            attitude_sensitivities(alpha, turned), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ v, atol=size
        )
        assert tilt_margin(alpha, turned) == pytest.approx(tilt_margin(alpha, plain), abs=1e-12, nan_ok=True)
        if np.linalg.norm(v) > 1e-6:
            assert tilt_margin(-np.array(alpha), mirrored) == pytest.approx(tilt_margin(alpha, plain), abs=1e-6)

    def test_formula_1_is_v_times_the_vertical(self) -> None:
        random = np.random.default_rng(2)
        alpha, (roll, pitch) = random.uniform(-2, 2, (50, 4)), random.uniform(-1.5, 1.5, (2, 50))
        for numbers in (EXACT, PUBLISHED, coefficients_of(some_vehicle(random), "exact")):
            product = np.sum(attitude_sensitivities(alpha, numbers) * body_vertical(roll, pitch), axis=-1)
            np.testing.assert_allclose(product, determinant(alpha, numbers, roll, pitch), rtol=1e-10, atol=1e-10)

    @settings(deadline=None, max_examples=100)
    @given(a=st.tuples(ANGLE, ANGLE), vehicle=VEHICLES)
    def test_ninety_degrees_on_red_and_none_on_blue(self, a: tuple[float, float], vehicle: Vehicle) -> None:
        exact = coefficients_of(vehicle, "exact")
        red = np.array([*a, *a])
        margin = tilt_margin(red, exact)
        assert margin == math.pi / 2 or singular_everywhere(red, exact)
        assert np.isnan(nearest_singular_attitude(red, exact)).all()
        blue = np.array([*a, 2 * exact.delta - a[0], -2 * exact.delta - a[1]])
        assert singular_everywhere(blue, exact)
        assert math.isnan(tilt_margin(blue, exact))

    @pytest.mark.parametrize("gait", GAITS[:2], ids=lambda gait: f"gait{gait.number}")
    def test_printed_digits_of_blue_say_nothing(self, gait: PublishedGait) -> None:
        """Floating point makes up to 90° of noise out of rounded angles; their digits say what it is worth."""
        printed = np.column_stack([np.round(gait.angles, 3), gait.printed])
        assert np.isfinite(tilt_margin(printed, EXACT)).all()
        assert np.isnan(tilt_margin(printed, EXACT, angle_rounding=5e-4)).all()
        assert np.isnan(tilt_margin(lift(gait.angles, "blue").alpha, PUBLISHED)).all()
        # Biased, it is a configuration like any other.
        assert np.isfinite(tilt_margin(printed * [1, 1, 0.8, 0.8], EXACT, angle_rounding=5e-4)).all()
        assert np.isfinite(tilt_margin(lift(GAITS[2].angles, "red").alpha, EXACT, angle_rounding=5e-4)).all()


class TestLeastTiltMargin:
    """The bracket of the worst over a period."""

    @pytest.mark.parametrize(
        ("gait", "eta", "degrees"),
        [(2, 1.0, 90.0), (3, 1.0, 90.0), (2, 0.8, 74.46), (3, 0.8, 61.66), (1, 0.99, 41.74), (1, 0.8, 44.99)],
    )
    def test_of_the_four_gaits(self, gait: int, eta: float, degrees: float) -> None:
        alpha = lift(GAITS[gait].angles, GAITS[gait].color, coefficients=EXACT).alpha * [1, 1, eta, eta]
        found = least_tilt_margin(*closed(alpha), EXACT)
        assert math.degrees(found.upper) == pytest.approx(degrees, abs=5.1e-3)
        assert found.reason == ""
        assert found.lower <= found.upper <= found.lower + 1.01e-7

    def test_gait_1_biased_passes_a_singular_matrix(self) -> None:
        alpha = lift(GAITS[0].angles, "blue", coefficients=EXACT).alpha * [1, 1, 0.8, 0.8]
        found = least_tilt_margin(*closed(alpha), EXACT)
        assert (found.lower, found.upper, found.reason) == (0.0, 0.0, "R changes its sign")
        assert abs(level_determinant(place(alpha, found), EXACT)) < 1e-12

    @pytest.mark.parametrize("gait", GAITS[:2], ids=lambda gait: f"gait{gait.number}")
    @pytest.mark.parametrize("numbers", [EXACT, PUBLISHED], ids=["exact", "published"])
    def test_blue_has_none(self, gait: PublishedGait, numbers: Coefficients) -> None:
        alpha = lift(gait.angles, "blue", coefficients=numbers).alpha
        found = least_tilt_margin(*closed(alpha), numbers)
        assert not found.exists
        assert math.isnan(found.lower)
        assert "singular at every attitude" in found.reason
        # With exact coefficients it is the rounding of δ that says so.
        assert not least_tilt_margin(*closed(alpha), EXACT, angle_rounding=numbers.sheet_rounding).exists

    def test_one_blue_segment_is_enough(self) -> None:
        blue = lift([(0.4, 0.5), (0.6, 0.5)], "blue", coefficients=EXACT).alpha
        points = np.vstack([blue[0] + [0.1, 0.2, 0.0, 0.1], blue])
        found = least_tilt_margin(*closed(points), EXACT)
        assert not found.exists
        assert found.segment == 1

    def test_against_dense_sampling(self) -> None:
        """Never above what is met, never below what the bracket says, and met where it says."""
        random = np.random.default_rng(3)
        kinds = set()
        for number in range(90):
            vehicle = some_vehicle(random)
            exact = coefficients_of(vehicle, "exact")
            size = random.choice([0.02, 0.2, 1.0, 3.0])
            points = random.uniform(-1.6, 1.6, 4) + random.uniform(-size, size, (random.integers(1, 7), 4))
            if number % 3 == 0:
                points[:, 2:] = points[:, :2] * random.choice([0.8, 0.99, 1.0])
            found = least_tilt_margin(*closed(points), exact)
            alpha = along(points, 1500)
            R, dense = level_determinant(alpha, exact), tilt_margin(alpha, exact)
            if R.min() * R.max() < 0:
                assert (found.lower, found.upper, found.reason) == (0.0, 0.0, "R changes its sign")
                assert abs(level_determinant(place(points, found), exact)) <= 1e-12 * np.abs(R).max()
                kinds.add("zero")
            else:
                assert found.lower <= np.nanmin(dense) + 1e-12
                assert found.upper <= np.nanmin(dense) + 1e-7
                assert found.upper - found.lower <= 1.01e-7
                assert tilt_margin(place(points, found), exact) == pytest.approx(found.upper, abs=1e-12)
                kinds.add("red" if found.upper == math.pi / 2 else "between")
        assert kinds == {"zero", "red", "between"}

    @settings(deadline=None, max_examples=25)
    @given(seed=st.integers(0, 10_000))
    def test_the_way_it_is_told_makes_no_difference(self, seed: int) -> None:
        """Backwards, from another corner, cut finer: the same margin."""
        random = np.random.default_rng(seed)
        points = random.uniform(-1, 1, 4) + random.uniform(-0.4, 0.4, (random.integers(2, 6), 4))
        finer = np.vstack([points, (points + np.roll(points, -1, axis=0)) / 2]).reshape(2, -1, 4).swapaxes(0, 1)
        least = least_tilt_margin(*closed(points), EXACT)
        for other in (points[::-1], np.roll(points, 1, axis=0), finer.reshape(-1, 4)):
            found = least_tilt_margin(*closed(other), EXACT)
            assert found.upper == pytest.approx(least.upper, abs=2e-7)
            assert found.reason == least.reason

    @pytest.mark.parametrize("eta", [1.0, 0.9, 0.5])
    def test_a_scaled_red_gait_keeps_ninety_degrees(self, eta: float) -> None:
        for gait in GAITS[2:]:
            found = least_tilt_margin(*closed(lift(gait.angles, "red").alpha * eta), EXACT)
            assert found.upper == math.pi / 2
            assert found.lower >= math.pi / 2 - 1.01e-7

    def test_a_point_is_a_gait(self) -> None:
        point = np.array([[0.1, 0.2, 0.3, 0.4]])
        found = least_tilt_margin(point, point, EXACT)
        assert found.lower == found.upper == pytest.approx(tilt_margin(point[0], EXACT), abs=1e-12)
        blue = lift([(0.4, 0.5)], "blue", coefficients=EXACT).alpha
        assert not least_tilt_margin(blue, blue, EXACT).exists

    def test_a_red_loop_through_zero_says_where(self) -> None:
        corners = np.array([[0.3, -0.3], [0.3, 0.6], [-0.5, 0.6], [-0.5, -0.3]])
        points = np.hstack([corners, corners])
        found = least_tilt_margin(*closed(points), EXACT)
        assert (found.upper, found.reason) == (0.0, "R changes its sign")
        assert abs(level_determinant(place(points, found), EXACT)) < 1e-12
        assert singular_everywhere(place(points, found), EXACT)

    def test_a_loop_that_only_touches_zero(self) -> None:
        """On red v vanishes with R, off it v does not: the reason says which."""
        border = EXACT.delta - math.pi / 2
        corners = np.array([[border, 0.5], [border + 0.5, 0.5], [border + 0.5, 0.9]])
        red = np.hstack([corners, corners])
        assert (np.abs(level_determinant(red[1:], EXACT)) > 1).all()
        found = least_tilt_margin(*closed(red), EXACT)
        assert (found.upper, found.segment, found.fraction) == (0.0, 0, 0.0)
        assert "every attitude there" in found.reason
        zero = brentq(lambda x: float(level_determinant([x, -0.4, 0.5, 0.3], EXACT)), 0.0, 0.3, xtol=1e-16)
        off = np.array([[zero, -0.4, 0.5, 0.3]] * 3) + np.array([[0.0, 0, 0, 0], [0.1, 0, 0, 0], [0.2, 0.02, 0, 0]])
        found = least_tilt_margin(*closed(off), EXACT)
        assert found.upper < 1e-12
        assert "every attitude" not in found.reason
        assert abs(level_determinant(place(off, found), EXACT)) < 1e-12

    @pytest.mark.parametrize(
        ("starts", "ends", "options"),
        [
            ([[math.nan, 0, 0, 0]], [[0, 0, 0, 0]], {}),
            ([[0, 0, 0, 0]], [[0, 0, 0, math.inf]], {}),
            (np.zeros((0, 4)), np.zeros((0, 4)), {}),
            (np.zeros((2, 4)), np.ones((1, 4)), {}),
            (np.zeros((2, 3)), np.ones((2, 3)), {}),
            *(([[0, 0, 0, 0]], [[0, 0, 0, 1]], {"tolerance": wrong}) for wrong in (0, -1, math.nan, math.inf, "x")),
        ],
    )
    def test_wrong_input_is_told(self, starts: Any, ends: Any, options: dict[str, Any]) -> None:
        with pytest.raises(InputError, match="allowed"):
            least_tilt_margin(starts, ends, EXACT, **options)


class TestBetweenSamples:
    """What the brackets rest on."""

    def test_v_strays_from_its_chords_by_no_more_than_is_said(self) -> None:
        random = np.random.default_rng(4)
        s = np.linspace(0.0, 1.0, 65)[:, None, None]
        for size in (1e-3, 0.1, 1.0, 4.0):
            exact = coefficients_of(some_vehicle(random), "exact")
            starts = random.uniform(-2, 2, (80, 4))
            ends = starts + random.uniform(-size, size, (80, 4))
            starts[:20, 2:], ends[:20, 2:] = starts[:20, :2], ends[:20, :2]
            v = attitude_sensitivities(starts + s * (ends - starts), exact)
            off = v - (v[0] + s * (v[-1] - v[0]))
            across, level = sensitivity_deviations(starts, ends, exact)
            slack = 1e-12 * (1 + np.abs(v).max())
            assert (np.hypot(off[..., 0], off[..., 1]).max(axis=0) <= across + slack).all()
            assert (np.abs(off[..., 2]).max(axis=0) <= level + slack).all()
            assert (across[:20] < 1e-12 * (1 + np.abs(v).max())).all()

    def test_the_worst_of_many_is_the_least(self) -> None:
        least = Least(lower=np.array([0.3, 0.1]), upper=np.array([0.4, 0.2]), fraction=np.array([0.5, 0.25]))
        assert least.worst() == (0.1, 0.2, 1, 0.25)


class TestLeastSingularValueWithin:
    """The worst attitude within a tilt, against sampling of all of them."""

    def test_against_sampling_of_the_whole_cap(self) -> None:
        """Attained where it says, exactly on the rim, and no attitude of the cap, inside it too, is worse."""
        random = np.random.default_rng(5)
        open_ = 0
        for number in range(80):
            vehicle = some_vehicle(random)
            alpha = random.uniform(-1.6, 1.6, 4)
            if number % 2:
                alpha[2:] = alpha[:2] + random.normal(0, random.choice([0.0, 1e-9, 1e-3]), 2)
            if number % 10 == 0:
                alpha = random.choice([-0.5, 0.0, 1.2], 4)  # singular values that coincide
            tilt = float(random.choice([0.0, 1e-6, 0.01, 0.3, 1.0, 1.5]))
            value, attitude = least_singular_value_within(alpha, tilt, vehicle)
            found, up = float(least_singular_value(alpha, vehicle, *attitude)), body_vertical(*attitude)
            dense = least_singular_value(alpha, vehicle, *cap(tilt, 21, 241))
            if tilt_margin(alpha, coefficients_of(vehicle, "exact")) > tilt:
                open_ += 1
                assert value == pytest.approx(found, abs=1e-12)
                assert math.hypot(up[0], up[1]) == pytest.approx(math.sin(tilt), abs=1e-12)
                assert value <= dense.min() + 1e-12
                assert value >= dense.min() - 0.02  # the sampling is that coarse
            else:
                assert value == 0.0
                assert found < 1e-9
                assert math.acos(min(up[2], 1.0)) <= tilt + 1e-9
        assert 30 < open_ < 75

    @settings(deadline=None, max_examples=60)
    @given(alpha=st.tuples(ANGLE, ANGLE, ANGLE, ANGLE), tilts=st.tuples(st.floats(0, 1.57), st.floats(0, 1.57)))
    def test_more_tilt_is_never_better(self, alpha: tuple[float, ...], tilts: tuple[float, float]) -> None:
        near, far = (least_singular_value_within(alpha, tilt)[0] for tilt in sorted(tilts))
        assert far <= near * (1 + 1e-12)
        assert near <= float(least_singular_value(alpha)) * (1 + 1e-12)

    def test_turned_arms_turn_the_attitude(self) -> None:
        alpha = np.array([0.3, -0.2, 0.1, 0.5])
        turned = Vehicle(drag_ratio=0.2, first_arm_angle=math.pi / 2)
        value, attitude = least_singular_value_within(alpha, 0.5, Vehicle(drag_ratio=0.2))
        other, at = least_singular_value_within(alpha, 0.5, turned)
        assert other == pytest.approx(value, abs=1e-12)
        x, y, z = body_vertical(*attitude)
        np.testing.assert_allclose(body_vertical(*at), [-y, x, z], atol=1e-7)

    def test_level_it_is_the_least_singular_value(self) -> None:
        alpha = np.random.default_rng(6).uniform(-1.5, 1.5, (40, 4))
        np.testing.assert_allclose(least_singular_value_within(alpha, 0.0)[0], least_singular_value(alpha), atol=1e-12)

    @pytest.mark.parametrize("tilt", [-0.1, math.pi / 2, math.nan, math.inf, "x", True, np.array([0.1, 0.2])])
    def test_wrong_tilts_are_told(self, tilt: Any) -> None:
        with pytest.raises(InputError, match=r"tilt: .*allowed is an angle from 0 up to"):
            least_singular_value_within([0.3, -0.2, 0.1, 0.5], tilt)


def test_a_mirrored_spin_of_the_paper() -> None:
    mirrored = gg.PAPER.replace(first_rotor_spin="counterclockwise")
    alpha = -lift(GAITS[3].angles, "red").biased(0.8).alpha
    found = least_tilt_margin(*closed(alpha), coefficients_of(mirrored, "exact"))
    assert math.degrees(found.upper) == pytest.approx(61.66, abs=5e-3)


def test_touching_zero_is_no_change_of_sign() -> None:
    """On the line β2 = 0 and the curve R = 0 a red gait may touch R = 0 to within rounding of either sign."""
    kappa = gg.PAPER.drag_ratio
    alpha2 = np.arctan(np.tan(0.3) - 2 * kappa)
    rows = np.array([[0.3, alpha2 + off, 0.3, alpha2 + off] for off in (0.0, 0.2, 0.4)])
    found = least_tilt_margin(rows, np.roll(rows, -1, axis=0), EXACT)
    assert (found.upper, found.segment) == (0.0, 0)
    assert "not beside" in found.reason


def test_an_undecided_place_is_no_zero() -> None:
    """The printed Gait 2 biased by 0.99: three digits do not tell v from zero at one corner."""
    plane, printed = np.array(GAITS[1].angles), np.array(GAITS[1].printed)
    rows = np.column_stack([plane, 0.99 * printed])
    found = least_tilt_margin(rows, np.roll(rows, -1, axis=0), EXACT, angle_rounding=5e-4)
    assert not found.exists
    assert math.degrees(least_tilt_margin(rows, np.roll(rows, -1, axis=0), EXACT).upper) == pytest.approx(
        41.74, abs=5e-3
    )


@pytest.mark.parametrize("numbers", [EXACT, PUBLISHED], ids=["exact", "published"])
def test_the_margin_is_that_of_v(numbers: gg.Coefficients) -> None:
    """The margin has sums of its own for speed: they are those of equations (4) to (6)."""
    alpha = np.random.default_rng(11).uniform(-math.pi, math.pi, (2000, 4))
    v = attitude_sensitivities(alpha, numbers)
    sine = np.abs(v[:, 2]) / np.linalg.norm(v, axis=1)
    np.testing.assert_allclose(np.sin(tilt_margin(alpha, numbers)), sine, rtol=0, atol=1e-12)
