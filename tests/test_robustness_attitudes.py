"""Singular curves and acceptable attitudes, against rasters of the determinant of forces and torques."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from scipy import ndimage
from scipy.optimize import brentq, nnls

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
    _may_leave,
    _rays_between,
    acceptable_attitudes,
    singular_curve,
)
from gaitgraph.vehicle import PAPER, Vehicle
from tests.samples import (
    EVERY_KIND,
    EXACT,
    HALF_PI,
    along,
    by_vehicle,
    random_tilts,
    random_vehicle,
)

FloatArray = npt.NDArray[np.float64]

BLUE = lift([(0.4, 0.5), (0.6, 0.5)], "blue", coefficients=EXACT).alpha
STRAY = 1e-6
"""How far straight sides may stray from the curves, as the documentation says [rad]."""


def R_beside_zero(x: float) -> float:
    return float(level_determinant([x, -0.4, 0.5, 0.3], EXACT))


ON_ZERO = float(brentq(R_beside_zero, 0.0, 0.3, xtol=1e-16))
"""α1 at which R vanishes off the surfaces."""


def extremes_at(
    alpha: FloatArray, vehicle: Vehicle, roll: FloatArray, pitch: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest scaled determinant of forces and torques over all rows at each attitude.

    It is linear in the vertical, so three attitudes of each row determine it: level, roll π/2 and pitch −π/2.
    """
    parts = [
        np.linalg.det(scaled_decoupling_matrix(alpha, vehicle, *axis))
        for axis in ((0.0, -HALF_PI), (HALF_PI, 0.0), (0.0, 0.0))
    ]
    normals = np.transpose(parts) / np.linalg.norm(parts, axis=0)[:, None]
    verticals = body_vertical(roll.ravel(), pitch.ravel()).T
    values = [
        part @ verticals for part in np.array_split(normals, 1 + len(alpha) // 256)
    ]
    least = np.min([value.min(axis=0) for value in values], axis=0)
    largest = np.max([value.max(axis=0) for value in values], axis=0)
    return least.reshape(roll.shape), largest.reshape(roll.shape)


def check(
    points: Any, vehicle: Vehicle, count: int = 41, samples: int = 80
) -> AcceptableAttitudes:
    """Compare the acceptable attitudes with a raster over a densely sampled period."""
    points = np.asarray(points)
    answer = acceptable_attitudes(points, coefficients_of(vehicle, "exact"))
    check_shape(answer)
    alpha = points if len(points) == 1 else along(points, samples)
    axis = (np.arange(count) + 0.5) / count * math.pi - HALF_PI
    roll, pitch = np.meshgrid(axis, axis, indexing="ij")
    least, largest = extremes_at(alpha, vehicle, roll, pitch)
    inside = shapely.contains_xy(answer.polygon, roll, pitch)
    # Never unsafe, neither on the raster nor at the very corners of the outline.
    assert not (inside & (least < -1e-9) & (largest > 1e-9)).any()
    if not answer.polygon.is_empty:
        outline = shapely.get_coordinates(answer.polygon).T
        low, high = extremes_at(alpha, vehicle, *outline)
        assert max(low.min(), -high.max()) > -3 * STRAY
    # Every acceptable cell around level is in it, but for those that its border can cut.
    middle = (count // 2, count // 2)
    side = least > 0 if least[middle] > 0 else largest < 0
    labels, _ = ndimage.label(side)
    around = (labels == labels[middle]) & side[middle]
    block = np.ones((3, 3), dtype=bool)
    deep = ndimage.binary_erosion(around, structure=block, border_value=1)
    assert not (deep & ~inside).any()
    assert answer.error <= answer.tolerance
    assert (around & ~inside).mean() <= answer.error + 4 / count**2 + 1e-3
    return answer


def check_shape(answer: AcceptableAttitudes) -> None:
    """The polygon is valid and inside the diagram; if it is empty there is a reason."""
    assert isinstance(answer.polygon, shapely.Polygon)
    assert answer.polygon.is_valid
    is_empty = answer.polygon.is_empty
    assert is_empty or np.abs(answer.polygon.bounds).max() <= HALF_PI + 1e-15
    assert (answer.reason == "") == (not is_empty)


# -- Singular curves


@by_vehicle(*EVERY_KIND)
def test_points_of_a_curve_are_singular_and_reach_the_border(vehicle: Vehicle) -> None:
    exact = coefficients_of(vehicle, "exact")
    rounded = np.round(random_tilts(2, 4, reach=1.6) / (math.pi / 8)) * math.pi / 8
    for alpha in np.concatenate([random_tilts(1, 6, reach=1.6), rounded]):
        curve = singular_curve(alpha, exact)
        if curve.kind != "curve":
            continue
        points = curve.points(20_001)
        assert points.shape == (20_001, 2)
        size = np.linalg.norm(curve.normal)
        assert np.abs(determinant(alpha, exact, *points.T)).max() <= 3e-8 * size
        ends = np.abs(points[[0, -1]]).max(axis=1)
        np.testing.assert_allclose(ends, HALF_PI, atol=1e-7)
        assert np.abs(points).max() <= HALF_PI + 1e-15
        nearest = np.arccos(body_vertical(*points.T)[:, 2]).min()
        assert nearest == pytest.approx(tilt_margin(alpha, exact), abs=2e-4)


def test_special_kinds_of_curves() -> None:
    none = singular_curve([0.4, -1.1, 0.4, -1.1], EXACT)
    assert (none.kind, none.points().shape) == ("none", (0, 2))
    everywhere = singular_curve(BLUE[0], EXACT)
    assert (everywhere.kind, everywhere.normal.flags.writeable) == ("everywhere", False)
    printed = np.round(BLUE[0], 3)
    assert singular_curve(printed, EXACT).kind == "curve"
    assert singular_curve(printed, EXACT, angle_rounding=5e-4).kind == "everywhere"
    # Rθ = 0: a roll at every pitch. Rφ = 0: symmetrical in roll. R = 0: through (0, 0).
    points = singular_curve([0.5, -0.3, 0.2, -0.3], EXACT).points(7)
    np.testing.assert_allclose(points[:, 0], points[0, 0], atol=1e-12)
    np.testing.assert_allclose(np.sort(points[[0, -1], 1]), [-HALF_PI, HALF_PI])
    even = singular_curve([0.5, -0.3, 0.5, 0.2], EXACT).points(11)
    np.testing.assert_allclose(even, even[::-1] * [-1, 1], atol=1e-12)
    through = singular_curve([ON_ZERO, -0.4, 0.5, 0.3], EXACT).points(1001)
    assert shapely.LineString(through).distance(shapely.Point(0, 0)) < 1e-5


# -- Acceptable attitudes


def test_v_along_a_segment_is_in_the_cone_of_its_rays_and_the_upright_one() -> None:
    starts = random_tilts(3, 60, reach=1.5)
    ends = starts + random_tilts(4, 60, reach=0.4)
    signs = np.sign(level_determinant(starts, EXACT))[:, None]
    first, middle, last = (
        signs * attitude_sensitivities(starts + share * (ends - starts), EXACT)
        for share in (0.0, 0.5, 1.0)
    )
    between = _rays_between(first, last, starts, ends, EXACT)
    for *both, rays, v in zip(first, last, between, middle, strict=True):
        _, off = nnls(np.transpose([[0.0, 0.0, 1.0], *both, *rays]), v)
        assert off < 1e-9


def test_pieces_that_leave_a_cone_of_many_rays_are_found() -> None:
    """Parabolas from a ray of it along the next side, and back into it."""
    random = np.random.default_rng(5)
    turns = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    cone = np.column_stack([np.cos(turns), np.sin(turns), np.ones(200)])
    normals = np.cross(cone, np.roll(cone, -1, axis=0)).T
    start = random.integers(0, 200, 2000)
    first, last = cone[start], cone[start - random.integers(0, 100, 2000)]
    last[:, :2] *= random.uniform(0.3, 1.0, (2000, 1))
    side = np.roll(cone, -1, axis=0)[start] - first
    middle = first + random.uniform(0, 8, (2000, 1)) * side
    middle += random.normal(0, 3e-3, (2000, 3))
    may_leave = _may_leave(cone, first, last, middle[:, None])
    for s in np.linspace(0, 1, 41):
        v = (1 - s) ** 2 * first + 2 * s * (1 - s) * middle + s**2 * last
        assert ((v @ normals).min(axis=1)[~may_leave] > -1e-9).all()
    assert may_leave.mean() < 0.95


def random_gait(random: np.random.Generator) -> FloatArray:
    size = random.choice([0.01, 0.1, 0.5, 1.5])
    steps = random.uniform(-size, size, (random.integers(1, 9), 4))
    points = random.uniform(-1.6, 1.6, 4) + steps
    if random.random() < 0.4:
        points[:, 2:] = points[:, :2] * random.choice([0.8, 0.99, 1.0])
        points[:, 2:] += random.normal(0, 1e-3, 2)
    if random.random() < 0.2:
        points = np.round(points / (math.pi / 8)) * math.pi / 8
    return np.asarray(points)


def test_random_gaits_of_random_vehicles() -> None:
    random = np.random.default_rng(6)
    vehicles = [*(random_vehicle(random) for _ in range(7)), *EVERY_KIND[3:]]
    answers = [check(random_gait(random), vehicle) for vehicle in vehicles]
    assert {answer.polygon.is_empty for answer in answers} == {False, True}


@pytest.mark.parametrize("seed", [0, 18, 31, 325, 395])
def test_fractions_are_sums_over_columns(seed: int) -> None:
    """At each roll v·n > 0 bounds tan(pitch) by a quotient; of odd seeds Rθ is rounding."""
    random = np.random.default_rng(seed)
    exact, points = (
        coefficients_of(random_vehicle(random), "exact"),
        random_gait(random),
    )
    if seed % 2:
        points[:, 3] = points[:, 1]
    answer = acceptable_attitudes(points, exact)
    check_shape(answer)
    x, y, z = attitude_sensitivities(along(points, 50), exact).T[:, :, None]
    x = np.where(x == 0.0, 1e-300, x)
    sign = np.sign(z[0])
    roll = (np.arange(10_000) + 0.5) / 10_000 * math.pi - HALF_PI
    with np.errstate(over="ignore"):
        pitch = np.arctan((y * np.sin(roll) + z * np.cos(roll)) / x)
    high = np.where(sign * x > 0, pitch, HALF_PI).min(axis=0)
    low = np.where(sign * x < 0, pitch, -HALF_PI).max(axis=0)
    fraction = np.maximum(high - low, 0.0).mean() / math.pi
    assert answer.fraction == pytest.approx(fraction, abs=1.2e-4)


RED = [[1.2, -1.2, 1.2, -1.2], [1.2, -0.4, 1.2, -0.4], [0.4, -0.4, 0.4, -0.4]]
HARD_CASES: dict[str, tuple[Any, tuple[float, float, Any]]] = {
    # The ring of a region that reaches the border touched itself there by rounding, and all of it was lost.
    "ring": (
        [
            [-1.5109237703820417, -1.163933957744355, -1.4958145326782213, -1.1522946181669116],
            [-1.322623235567825, -0.951551007434327, -1.3093970032121467, -0.9420354973599837],
            [-1.818443440800639, -1.1824737775558196, -1.8002590063926325, -1.1706490397802614],
        ],
        (0.12263930119874794, 1.0, "counterclockwise"),
    ),
    # A hull in the plane of points 1e-18 apart was not convex.
    "hull": (
        [
            [1.704005836836286, 1.3058137266297392, 1.686965778467923, 1.2927555893634417],
            [1.694097841911573, 0.8308274339571864, 1.6771568634924574, 0.8225191596176146],
        ],
        (0.6280422182549084, 1.0, "counterclockwise"),
    ),
    # R comes so near to zero that from the vertical all else is within rounding.
    "near zero": (
        [
            [0.5617594623969073, -0.49113628779131696, 0.32910051819346364, 0.9611222134697702],
            [0.36477029692885365, -0.3718951824718173, 0.4045655126153911, -0.2278249466637868],
        ],
        (0.012362194942045284, -2.0, "clockwise"),
    ),
    # All v are in one plane but for rounding, and Qhull lost one of both ends.
    "line": (
        [
            [-1.3561032954993943, 0.20851614292986043, -1.3561032954993941, 0.9258227613637499],
            [-0.7340200547401995, -0.21269552974295386, -0.7340200547401997, 0.03704985715723069],
            [-0.8527532924891374, -0.4049288921475107, -0.8527532924891374, 0.1751112096708824],
        ],
        (PAPER.drag_ratio, 0.0, "clockwise"),
    ),
    "gait 3 biased by 0.5": (np.array(RED) * [1, 1, 0.5, 0.5], (PAPER.drag_ratio, 0.0, "clockwise")),
}  # fmt: skip


@pytest.mark.parametrize("case", HARD_CASES)
def test_hard_cases(case: str) -> None:
    points, (kappa, turn, spin) = HARD_CASES[case]
    vehicle = Vehicle(drag_ratio=kappa, first_arm_angle=turn, first_rotor_spin=spin)
    check(points, vehicle, samples=200)


def test_a_point_is_cut_by_its_curve_and_level_flight_by_none() -> None:
    oblique = [0.4, -1.1, 0.3, -0.9]
    answer = check([oblique], PAPER)
    # Nothing is sampled: the error is that of straight sides alone.
    assert answer.error == pytest.approx(STRAY * answer.polygon.length / math.pi**2)
    curve = shapely.LineString(singular_curve(oblique, EXACT).points(3001))
    assert answer.polygon.exterior.distance(curve) < 1e-5
    assert check(np.zeros((1, 4)), PAPER).fraction == 1.0


def test_where_only_roll_counts_the_region_is_a_rectangle() -> None:
    """With α4 = α2, Rθ vanishes; at pitch ±π/2 the vertical is one for all rolls, and each side has its own."""
    random = np.random.default_rng(3)
    sides = set()
    for number in range(16):
        steps = random.uniform(-0.4, 0.4, (1 + number % 4, 4))
        points = random.uniform(-1.2, 1.2, 4) * [1, 1, 0, 0] + steps
        points[:, 2] += points[:, 0]
        points[:, 3] = points[:, 1]
        tolerance = random.choice([1e-3, 1e-6])
        answer = acceptable_attitudes(points, EXACT, tolerance=tolerance)
        check_shape(answer)
        if answer.polygon.is_empty:
            continue
        _, across, level = attitude_sensitivities(along(points, 400), EXACT).T
        lean = np.arctan(across / level)
        low, high = max(lean.max(), 0.0), min(lean.min(), 0.0)
        box = shapely.box(low - HALF_PI, -HALF_PI, high + HALF_PI, HALF_PI)
        assert answer.polygon.difference(box).area < 1e-5
        missing = box.difference(answer.polygon).area
        assert missing <= answer.error * math.pi**2 + 1e-5
        sides.add((low > 0, high < 0))
    assert len(sides) == 3


def beside_zero(off: float) -> FloatArray:
    steps = np.array([[0.0, 0, 0, 0], [0.1, 0, 0, 0], [0.2, 0.02, 0, 0]])
    return np.asarray(np.array([ON_ZERO + off, -0.4, 0.5, 0.3]) + steps)


@pytest.mark.parametrize("off", [1e-3, 1e-12])
def test_however_near_a_gait_comes_to_zero_what_is_called_acceptable_is(
    off: float,
) -> None:
    answer = check(beside_zero(off), PAPER)
    assert answer.fraction == pytest.approx(0.494, abs=5e-3)


NEAR = np.array([[0.1, 0.2, 0.3, 0.4], [0.2, 0.3, 0.1, 0.1]])


def test_the_error_bounds_what_is_missing_and_converges() -> None:
    answers = [
        acceptable_attitudes(NEAR, EXACT, tolerance=tolerance)
        for tolerance in (1e-1, 1e-3, 1e-5)
    ]
    best = answers[-1]
    back = acceptable_attitudes(NEAR[::-1], EXACT, tolerance=1e-3)
    assert abs(back.fraction - best.fraction) <= back.error + best.error
    for answer in answers:
        assert answer.met
        missing = best.fraction - answer.fraction
        assert -2 * STRAY <= missing <= answer.error + best.error
        assert answer.polygon.difference(best.polygon).area < 2e-5
    unmet = acceptable_attitudes(NEAR, EXACT, tolerance=1e-300)
    assert not unmet.met
    assert 0 < unmet.error < 1e-5
    assert unmet.fraction == pytest.approx(best.fraction, abs=1e-5)


AWAY = BLUE[0] + 0.5 * np.array([0, 0, 1, -1])
PRINTED = np.round(BLUE, 3)


@pytest.mark.parametrize(
    ("points", "rounding", "reason"),
    [
        ([*BLUE, BLUE[1] + 0.2], 0.0, "singular at every attitude"),
        # A corner where v = 0, or cannot be told from zero, is where R changes its sign.
        ([BLUE[0], AWAY], 0.0, "R changes its sign"),
        ([PRINTED[0], AWAY], 5e-4, "R changes its sign"),
        (PRINTED, 5e-4, "singular at every attitude"),
        # A red loop through zero: v is up or down all along.
        ([[0.3, -0.3] * 2, [0.3, 0.6] * 2, [-0.5, 0.6] * 2], 0.0, "R changes its sign"),
    ],
)
def test_why_nothing_is_acceptable(points: Any, rounding: float, reason: str) -> None:
    answer = acceptable_attitudes(np.array(points), EXACT, angle_rounding=rounding)
    assert answer.polygon.is_empty
    assert reason in answer.reason
