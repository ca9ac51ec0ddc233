"""Singular curves and acceptable attitudes, against rasters of the determinant of forces and torques."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from scipy import ndimage
from scipy.optimize import brentq

from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    attitude_sensitivities,
    body_vertical,
    determinant,
    level_determinant,
    scaled_decoupling_matrix,
)
from gaitgraph.invertibility.tilt_margins import tilt_margin
from gaitgraph.robustness.attitudes import (
    AcceptableAttitudes,
    acceptable_attitudes,
    singular_curve,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.published import GAITS
from tests.samples import EXACT, HALF_PI, along, random_tilts, random_vehicle

FloatArray = npt.NDArray[np.float64]

BLUE = lift([(0.4, 0.5), (0.6, 0.5)], "blue", coefficients=EXACT).alpha
OBLIQUE = np.array([0.4, -1.1, 0.3, -0.9])
ON_ZERO = float(
    brentq(
        lambda x: float(level_determinant([x, -0.4, 0.5, 0.3], EXACT)),
        0.0,
        0.3,
        xtol=1e-16,
    )
)
"""α1 at which R vanishes off the surfaces."""
STRAY = 1e-6
"""How far straight sides may stray from the curves, as the documentation says [rad]."""


def raster(count: int) -> tuple[FloatArray, FloatArray]:
    """Return roll and pitch at the middles of count × count cells of the diagram."""
    axis = (np.arange(count) + 0.5) / count * math.pi - HALF_PI
    roll, pitch = np.meshgrid(axis, axis, indexing="ij")
    return roll, pitch


def range_of_formula_1(
    alpha: FloatArray, vehicle: Vehicle, roll: FloatArray, pitch: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest scaled determinant of forces and torques over all rows at each attitude.

    It is linear in the vertical, so three attitudes of each row determine it: level, roll π/2 and pitch −π/2.
    """
    axes = np.array([[0.0, -HALF_PI], [HALF_PI, 0.0], [0.0, 0.0]])
    parts = np.stack(
        [
            np.linalg.det(scaled_decoupling_matrix(alpha, vehicle, *axis))
            for axis in axes
        ],
        axis=-1,
    )
    parts /= np.linalg.norm(parts, axis=-1, keepdims=True)
    verticals = body_vertical(roll.ravel(), pitch.ravel()).T
    values = [part @ verticals for part in np.array_split(parts, 1 + len(parts) // 256)]
    least = np.min([value.min(axis=0) for value in values], axis=0)
    return least.reshape(roll.shape), np.max(
        [value.max(axis=0) for value in values], axis=0
    ).reshape(roll.shape)


def check(
    points: FloatArray, vehicle: Vehicle, count: int = 41, samples: int = 80
) -> AcceptableAttitudes:
    """Compare the acceptable attitudes with a raster over a densely sampled period."""
    found = acceptable_attitudes(points, coefficients_of(vehicle, "exact"))
    check_shapes(found)
    alpha = points if len(points) == 1 else along(points, samples)
    roll, pitch = raster(count)
    least, largest = range_of_formula_1(alpha, vehicle, roll, pitch)
    safe = (least > 0) | (largest < 0)
    inside = shapely.contains_xy(found.polygon, roll, pitch)
    # Never unsafe, neither on the raster nor at the very corners of the outline.
    assert not (inside & (least < -1e-9) & (largest > 1e-9)).any()
    if not found.polygon.is_empty:
        low, high = range_of_formula_1(
            alpha, vehicle, *shapely.get_coordinates(found.polygon).T
        )
        assert max(low.min(), -high.max()) > -3 * STRAY
    # Every acceptable cell around level is in it, but for those that its border can cut.
    middle = count // 2
    labels, _ = ndimage.label(safe & ((least > 0) == (least[middle, middle] > 0)))
    around = (labels == labels[middle, middle]) & safe[middle, middle]
    assert found.error <= found.tolerance
    deep = ndimage.binary_erosion(
        around, structure=np.ones((3, 3), dtype=bool), iterations=1, border_value=1
    )
    assert not (deep & ~inside).any()
    assert (around & ~inside).mean() <= found.error + 4 / count**2 + 1e-3
    return found


def check_shapes(found: AcceptableAttitudes) -> None:
    """The polygon is valid and inside the diagram; if it is empty there is a reason."""
    assert found.polygon.is_valid
    assert (
        found.polygon.is_empty or np.abs(found.polygon.bounds).max() <= HALF_PI + 1e-15
    )
    assert isinstance(found.polygon, shapely.Polygon)
    assert (found.reason == "") == (not found.polygon.is_empty)


def random_gait(random: np.random.Generator) -> FloatArray:
    size = random.choice([0.01, 0.1, 0.5, 1.5])
    points = random.uniform(-1.6, 1.6, 4) + random.uniform(
        -size, size, (random.integers(1, 9), 4)
    )
    if random.random() < 0.4:
        points[:, 2:] = points[:, :2] * random.choice([0.8, 0.99, 1.0]) + random.normal(
            0, 1e-3, 2
        )
    if random.random() < 0.2:
        points = np.round(points / (math.pi / 8)) * math.pi / 8
    return np.asarray(points)


NEAR = np.array([[0.1, 0.2, 0.3, 0.4], [0.2, 0.3, 0.1, 0.1]])
"""Corners of a gait that is acceptable somewhere around level."""
ON_A_LINE = np.array(
    [
        [
            -1.3561032954993943,
            0.20851614292986043,
            -1.3561032954993941,
            0.9258227613637499,
        ],
        [
            -0.7340200547401995,
            -0.21269552974295386,
            -0.7340200547401997,
            0.03704985715723069,
        ],
        [
            -0.8527532924891374,
            -0.4049288921475107,
            -0.8527532924891374,
            0.1751112096708824,
        ],
    ]
)
"""Corners with α3 = α1 but for rounding: all v are in one plane but for rounding, and Qhull lost one of both ends."""


class TestSingularCurve:
    def test_its_points_are_singular_and_reach_the_border(self) -> None:
        random = np.random.default_rng(0)
        for number in range(40):
            vehicle, alpha = random_vehicle(random), random.uniform(-1.6, 1.6, 4)
            if number % 4 == 0:
                alpha = np.round(alpha / (math.pi / 8)) * math.pi / 8
            exact, count = (
                coefficients_of(vehicle, "exact"),
                int(random.integers(2, 300)),
            )
            curve = singular_curve(alpha, exact)
            points = curve.points(count)
            if curve.kind == "curve":
                assert points.shape == (count, 2)
                assert np.abs(
                    determinant(alpha, exact, *points.T)
                ).max() <= 3e-8 * np.linalg.norm(curve.normal)
                np.testing.assert_allclose(
                    np.abs(points[[0, -1]]).max(axis=1), HALF_PI, atol=1e-7
                )
                assert np.abs(points).max() <= HALF_PI + 1e-15

    def test_its_point_nearest_to_upright_is_the_tilt_margin_away(self) -> None:
        for alpha in random_tilts(0, 12, reach=1.5):
            points = singular_curve(alpha, EXACT).points(20_001)
            nearest = np.arccos(body_vertical(*points.T)[:, 2]).min()
            assert nearest == pytest.approx(tilt_margin(alpha, EXACT), abs=1e-4)

    def test_special_kinds(self) -> None:
        none = singular_curve([0.4, -1.1, 0.4, -1.1], EXACT)
        assert (none.kind, none.points().shape) == ("none", (0, 2))
        assert (singular_curve(BLUE[0], EXACT).kind, none.normal.flags.writeable) == (
            "everywhere",
            False,
        )
        printed = np.round(BLUE[0], 3)
        assert singular_curve(printed, EXACT).kind == "curve"
        assert singular_curve(printed, EXACT, angle_rounding=5e-4).kind == "everywhere"
        # Rθ = 0: a roll at every pitch. Rφ = 0: symmetrical in roll.
        points = singular_curve([0.5, -0.3, 0.2, -0.3], EXACT).points(7)
        np.testing.assert_allclose(points[:, 0], points[0, 0], atol=1e-12)
        np.testing.assert_allclose(np.sort(points[[0, -1], 1]), [-HALF_PI, HALF_PI])
        even = singular_curve([0.5, -0.3, 0.5, 0.2], EXACT).points(11)
        np.testing.assert_allclose(even, even[::-1] * [-1, 1], atol=1e-12)
        # R = 0: the curve passes (0, 0).
        through = singular_curve([ON_ZERO, -0.4, 0.5, 0.3], EXACT)
        assert (
            shapely.LineString(through.points(1001)).distance(shapely.Point(0, 0))
            < 1e-5
        )


class TestAgainstARaster:
    """The region in closed form against formula (1) at every cell of a raster, over the period."""

    @pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
    def test_the_four_gaits(self, gait: Any) -> None:
        alpha = lift(gait.angles, gait.color, coefficients=EXACT).alpha
        unbiased = acceptable_attitudes(alpha, EXACT)
        check_shapes(unbiased)
        assert (unbiased.fraction, unbiased.error) == (
            1.0 if gait.color == "red" else 0.0,
            0.0,
        )
        assert ("singular at every attitude" in unbiased.reason) == (
            gait.color == "blue"
        )
        for eta in (0.99, 0.5):
            found = check(alpha * [1, 1, eta, eta], PAPER)
            if gait.number == 1:
                assert "R changes its sign" in found.reason
            else:
                assert found.fraction > 0.5

    def test_random_gaits_of_random_vehicles(self) -> None:
        met = set()
        random = np.random.default_rng(6)
        for _ in range(8):
            found = check(random_gait(random), random_vehicle(random))
            met.add(found.polygon.is_empty)
        assert met == {False, True}

    def test_a_point_is_cut_by_its_curve(self) -> None:
        found = check(OBLIQUE[None], PAPER)
        # Nothing is sampled: the error is that of straight sides alone.
        assert found.error == pytest.approx(STRAY * found.polygon.length / math.pi**2)
        curve = shapely.LineString(singular_curve(OBLIQUE, EXACT).points(3001))
        assert found.polygon.exterior.distance(curve) < 1e-5
        assert check(np.zeros((1, 4)), PAPER).fraction == 1.0

    def test_where_only_roll_counts_the_region_is_a_rectangle(self) -> None:
        """With α4 = α2, Rθ vanishes; at pitch ±π/2 the vertical is one for all rolls, and each side has its own."""
        random = np.random.default_rng(3)
        sides = set()
        for number in range(16):
            points = random.uniform(-1.2, 1.2, 4) * [1, 1, 0, 0] + random.uniform(
                -0.4, 0.4, (1 + number % 4, 4)
            )
            points[:, 2] += points[:, 0]
            points[:, 3] = points[:, 1]
            found = acceptable_attitudes(
                points, EXACT, tolerance=random.choice([1e-3, 1e-6])
            )
            check_shapes(found)
            if not found.polygon.is_empty:
                _, across, level = attitude_sensitivities(along(points, 400), EXACT).T
                low, high = np.clip(
                    [np.arctan(across / level).max(), np.arctan(across / level).min()],
                    [0, -9],
                    [9, 0],
                )
                rectangle = shapely.box(
                    low - HALF_PI, -HALF_PI, high + HALF_PI, HALF_PI
                )
                assert found.polygon.difference(rectangle).area < 1e-5
                assert (
                    rectangle.difference(found.polygon).area
                    <= found.error * math.pi**2 + 1e-5
                )
                sides.add((bool(low > 0), bool(high < 0)))
        assert len(sides) == 3

    @pytest.mark.parametrize(
        ("points", "constants"),
        [
            # The ring of a region that reaches the border touched itself there by rounding, and all of it was lost.
            (
                [
                    [
                        -1.5109237703820417,
                        -1.163933957744355,
                        -1.4958145326782213,
                        -1.1522946181669116,
                    ],
                    [
                        -1.322623235567825,
                        -0.951551007434327,
                        -1.3093970032121467,
                        -0.9420354973599837,
                    ],
                    [
                        -1.818443440800639,
                        -1.1824737775558196,
                        -1.8002590063926325,
                        -1.1706490397802614,
                    ],
                ],
                (0.12263930119874794, 1.0, "counterclockwise"),
            ),
            # A hull in the plane of points 1e-18 apart was not convex.
            (
                [
                    [
                        1.704005836836286,
                        1.3058137266297392,
                        1.686965778467923,
                        1.2927555893634417,
                    ],
                    [
                        1.694097841911573,
                        0.8308274339571864,
                        1.6771568634924574,
                        0.8225191596176146,
                    ],
                ],
                (0.6280422182549084, 1.0, "counterclockwise"),
            ),
            # R comes so near to zero that from the vertical all else is within rounding.
            (
                [
                    [
                        0.5617594623969073,
                        -0.49113628779131696,
                        0.32910051819346364,
                        0.9611222134697702,
                    ],
                    [
                        0.36477029692885365,
                        -0.3718951824718173,
                        0.4045655126153911,
                        -0.2278249466637868,
                    ],
                ],
                (0.012362194942045284, -2.0, "clockwise"),
            ),
        ],
        ids=["ring", "hull", "near-zero"],
    )
    def test_hard_cases(
        self, points: list[list[float]], constants: tuple[float, float, Any]
    ) -> None:
        ratio, turn, spin = constants
        check(
            np.array(points),
            Vehicle(drag_ratio=ratio, first_arm_angle=turn, first_rotor_spin=spin),
            samples=200,
        )

    @pytest.mark.parametrize("off", [1e-3, 1e-12])
    def test_R_near_zero(self, off: float) -> None:
        """However near a gait comes to R = 0, what is called acceptable is."""
        corners = np.array([[ON_ZERO + off, -0.4, 0.5, 0.3]] * 3)
        corners += np.array([[0.0, 0, 0, 0], [0.1, 0, 0, 0], [0.2, 0.02, 0, 0]])
        assert check(corners, PAPER).fraction == pytest.approx(0.494, abs=5e-3)


class TestError:
    """What the sampling of the period costs is stated, and shrinks as asked."""

    @pytest.mark.parametrize("corners", [NEAR, ON_A_LINE], ids=["near", "line"])
    def test_it_bounds_the_error_and_converges(self, corners: FloatArray) -> None:
        found = [
            acceptable_attitudes(corners, EXACT, tolerance=tolerance)
            for tolerance in (1e-1, 1e-3, 1e-5)
        ]
        best = found[-1]
        back = acceptable_attitudes(corners[::-1], EXACT, tolerance=1e-3)
        assert abs(back.fraction - best.fraction) <= back.error + best.error
        for one in found:
            assert one.met
            assert -2 * STRAY <= best.fraction - one.fraction <= one.error + best.error
            assert one.polygon.difference(best.polygon).area < 2e-5

    @pytest.mark.parametrize("tolerance", [1e-7, 1e-300])
    def test_an_unmet_tolerance_reports_its_error(self, tolerance: float) -> None:
        found = acceptable_attitudes(NEAR, EXACT, tolerance=tolerance)
        assert not found.met
        assert tolerance < found.error < 1e-5
        assert found.fraction == pytest.approx(0.944964, abs=1e-5)


class TestReasons:
    def test_blue(self) -> None:
        found = acceptable_attitudes(np.vstack([BLUE, BLUE[1] + 0.2]), EXACT)
        assert "singular at every attitude" in found.reason
        assert found.polygon.is_empty
        # A corner where v = 0 is where R changes its sign; one where v cannot be told from zero is more than that.
        away, printed = BLUE[0] + 0.5 * np.array([0, 0, 1, -1]), np.round(BLUE, 3)
        assert (
            "R changes its sign"
            in acceptable_attitudes(np.array([BLUE[0], away]), EXACT).reason
        )
        for corners in ([printed[0], away], [BLUE[0], away, printed[1], away + 0.1]):
            assert (
                "every attitude"
                in acceptable_attitudes(
                    np.array(corners), EXACT, angle_rounding=5e-4
                ).reason
            )

    def test_a_red_loop_through_zero(self) -> None:
        """Its v is up or down all along: nothing is left, or v = 0 there and every attitude is singular once."""
        corners = np.array([[0.3, -0.3], [0.3, 0.6], [-0.5, 0.6], [-0.5, -0.3]])
        found = acceptable_attitudes(np.hstack([corners, corners]), EXACT)
        assert found.polygon.is_empty
        assert "R changes its sign" in found.reason
