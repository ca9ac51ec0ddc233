"""Components of the red sheet, and the user's own polygons."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage
from scipy.integrate import quad

from gaitgraph.errors import InputError
from gaitgraph.invertibility.matrices import coefficients_of, level_determinant, level_determinant_resolution
from gaitgraph.invertibility.segment_bounds import least_level_determinant
from gaitgraph.surface.region import Zones
from gaitgraph.surface.sheets import HOVER_LABEL, red_label, separating_factor
from gaitgraph.vehicle import PAPER, Vehicle, vehicle_named
from tests.published import GAITS

FloatArray = npt.NDArray[np.float64]

HALF_PI = math.pi / 2
MIRRORED = PAPER.replace(name="mirrored", first_rotor_spin="counterclockwise")
VEHICLES = [PAPER, MIRRORED, vehicle_named("beetle_omni"), Vehicle(name="strong", drag_ratio=0.8)]
by_name = pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda vehicle: vehicle.name)

angle = st.floats(-HALF_PI, HALF_PI)
points = st.tuples(angle, angle)


def on_red(first: npt.ArrayLike, second: npt.ArrayLike) -> FloatArray:
    return np.stack(np.broadcast_arrays(first, second, first, second), axis=-1)


class TestRedLabel:
    @by_name
    def test_the_product_of_the_signs_is_the_sign_of_R(self, vehicle: Vehicle) -> None:
        numbers = coefficients_of(vehicle, "exact")
        first, second = np.random.default_rng(1).uniform(-HALF_PI, HALF_PI, (2, 5000))
        alpha = on_red(first, second)
        value = level_determinant(alpha, numbers)
        decided = np.abs(value) > 10 * level_determinant_resolution(alpha, numbers)
        assert decided.mean() > 0.999
        product = red_label(first, second, vehicle).prod(axis=-1)
        np.testing.assert_array_equal(product[decided], np.sign(value[decided]))

    @by_name
    def test_each_sign_is_that_of_its_factor(self, vehicle: Vehicle) -> None:
        kappa = vehicle.signed_drag_ratio
        delta = math.atan(kappa)
        for a1, a2 in np.random.default_rng(2).uniform(-1.4, 1.4, (300, 2)):
            # cos α1 and cos α2 are positive here, so that the curve may be written with tangents.
            above = (math.tan(a1) - math.tan(a2) < 2 * kappa) == (kappa > 0)
            expected = [math.cos(a1 - delta) > 0, math.cos(a2 + delta) > 0, above]
            assert red_label(a1, a2, vehicle).tolist() == [1 if positive else -1 for positive in expected]

    def test_seven_components_with_their_areas(self) -> None:
        kappa, delta = PAPER.drag_ratio, math.atan(PAPER.drag_ratio)
        line = delta - HALF_PI

        def below_the_curve(a1: float) -> float:
            return math.atan(math.tan(a1) - 2 * kappa) + HALF_PI

        # Beyond both lines; beyond one, below and above the curve; within both, below and above it. The plane is
        # symmetric in (α1, α2) → (−α2, −α1), which doubles what lies beyond one line.
        corner = delta**2
        tip = float(quad(below_the_curve, -HALF_PI, line)[0])
        strip = math.pi * delta - corner - tip
        below = float(quad(lambda a1: min(below_the_curve(a1), math.pi - delta), line, HALF_PI)[0])
        above = (math.pi - delta) ** 2 - below
        expected = {1: [tip, tip, corner, above], -1: [strip, strip, below]}
        assert expected[1] == pytest.approx([0.0135, 0.0135, 0.028, 4.46], rel=5e-3)
        assert expected[-1] == pytest.approx([0.485, 0.485, 4.38], rel=5e-3)

        count = 1600
        axis = (np.arange(count) + 0.5) / count * math.pi - HALF_PI
        label = red_label(axis[:, None], axis)
        code = (label > 0) @ [4, 2, 1]
        areas: dict[int, list[float]] = {1: [], -1: []}
        for number in range(8):
            here = code == number
            if here.any():
                # One label is one component: eight neighbours, since cusps are thinner than the raster.
                assert ndimage.label(here, structure=np.ones((3, 3)))[1] == 1
                sign = int(np.prod([1 if number & bit else -1 for bit in (4, 2, 1)]))
                areas[sign].append(float(here.mean()) * math.pi**2)
        for sign, sizes in expected.items():
            assert sorted(areas[sign]) == pytest.approx(sizes, rel=0.02)

    @pytest.mark.no_cover
    @by_name
    @settings(deadline=None, max_examples=60)
    @given(first=points, second=points)
    def test_points_joined_without_a_singular_matrix_have_one_label(
        self, vehicle: Vehicle, first: tuple[float, float], second: tuple[float, float]
    ) -> None:
        numbers = coefficients_of(vehicle, "exact")
        start, end = np.array([[*first, *first]]), np.array([[*second, *second]])
        sign = float(np.sign(level_determinant(start[0], numbers)))
        least = least_level_determinant(start, end, numbers, sign=sign, tolerance=1e-6).worst()
        a, b = (red_label(*point, vehicle).tolist() for point in (first, second))
        if least[0] > 1e-9:
            assert a == b
            assert separating_factor(first, second, vehicle) is None
        if a != b:
            assert least[0] <= 0
            assert separating_factor(first, second, vehicle) is not None

    @by_name
    def test_the_component_of_level_hover(self, vehicle: Vehicle) -> None:
        assert tuple(red_label(0.0, 0.0, vehicle).tolist()) == HOVER_LABEL == (1, 1, 1)

    def test_of_the_papers_red_gaits_only_the_fourth_can_be_reached_from_hover(self) -> None:
        for gait in GAITS:
            if gait.color == "red":
                labels = {tuple(red_label(*point).tolist()) for point in gait.angles}
                assert len(labels) == 1
                assert (labels == {HOVER_LABEL}) is gait.reachable is (gait.number == 4)
                assert math.prod(labels.pop()) == (1 if gait.sign == "positive" else -1)

    @settings(deadline=None, max_examples=60)
    @given(point=points)
    def test_mirrored_spins_are_mirrored_tilts(self, point: tuple[float, float]) -> None:
        a1, a2 = point
        assert red_label(a1, a2, MIRRORED).tolist() == red_label(-a1, -a2, PAPER).tolist()

    @pytest.mark.parametrize("shape", [(), (0,), (4,), (2, 3), (2, 1, 3)])
    def test_leading_axes_broadcast(self, shape: tuple[int, ...]) -> None:
        first, second = np.random.default_rng(3).uniform(-HALF_PI, HALF_PI, (2, *shape))
        label = red_label(first, second)
        assert label.shape == (*shape, 3)
        assert np.issubdtype(label.dtype, np.integer)
        for index in np.ndindex(*shape):
            assert label[index].tolist() == red_label(float(first[index]), float(second[index])).tolist()
        assert red_label(np.zeros((2, 1)), np.zeros(3)).shape == (2, 3, 3)


class TestSeparatingFactor:
    @by_name
    def test_it_names_what_lies_between_with_its_place(self, vehicle: Vehicle) -> None:
        kappa = vehicle.signed_drag_ratio
        delta = math.atan(kappa)
        sign = math.copysign(1.0, kappa)
        line1, line2 = delta - sign * HALF_PI, sign * HALF_PI - delta
        hover = (0.0, 0.0)
        across_the_curve = (sign * 1.2, -sign * 1.2)
        beyond_the_first_line = (line1 - sign * 0.01, 0.0)
        beyond_the_second_line = (0.0, line2 + sign * 0.01)

        text = separating_factor(hover, across_the_curve, vehicle)
        assert text == f"the curve tan α1 − tan α2 = 2κ = {2 * kappa:.4f}"
        text = separating_factor(hover, beyond_the_first_line, vehicle)
        assert text is not None
        assert "curve" not in text
        assert "the line α1 = " in text
        assert float(re.findall(r"α1 = (-?[\d.]+)", text)[0]) == pytest.approx(line1, abs=5e-5)
        text = separating_factor(hover, beyond_the_second_line, vehicle)
        assert text is not None
        assert float(re.findall(r"α2 = (-?[\d.]+)", text)[0]) == pytest.approx(line2, abs=5e-5)
        text = separating_factor(beyond_the_first_line, beyond_the_second_line, vehicle)
        assert text is not None
        assert text.count(" and ") == 1
        assert text.count("the line") == 2

    @settings(deadline=None, max_examples=100)
    @given(first=points, second=points)
    def test_it_does_not_depend_on_the_order(self, first: tuple[float, float], second: tuple[float, float]) -> None:
        assert separating_factor(first, second) == separating_factor(second, first)
        assert separating_factor(first, first) is None


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
BESIDE = [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0)]
HORSESHOE = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]


def inside(point: tuple[float, float], corners: list[tuple[float, float]]) -> bool:
    """Return whether a ray from the point crosses the boundary an odd number of times."""
    x, y = point
    odd = False
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            odd = not odd
    return odd


def boundary_distance(point: tuple[float, float], corners: list[tuple[float, float]]) -> float:
    p = np.array(point)
    distances = []
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        a, b = np.array(start), np.array(end)
        along = min(1.0, max(0.0, float((p - a) @ (b - a) / ((b - a) @ (b - a)))))
        distances.append(float(np.linalg.norm(a + along * (b - a) - p)))
    return min(distances)


@st.composite
def star_polygons(draw: st.DrawFn) -> list[tuple[float, float]]:
    """Return a simple polygon, as a rule not convex: corners around a center, in order."""
    count = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(0.2, 1.2), min_size=count, max_size=count))
    x, y = draw(st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
    turn = draw(st.floats(0, 1))
    corners = [
        (
            x + r * math.cos(2 * math.pi * (k + turn) / count),
            y + r * math.sin(2 * math.pi * (k + turn) / count),
        )
        for k, r in enumerate(radii)
    ]
    return corners[::-1] if draw(st.booleans()) else corners


class TestZones:
    def test_of_a_forbidden_polygon_the_interior_is_forbidden_and_the_boundary_is_not(self) -> None:
        zones = Zones(keep_out=[SQUARE])
        allowed = [(0, 0), (1, 1), (0.5, 0), (1, 0.5), (2, 2), (-0.1, 0.5), (0.5, 1.0)]
        forbidden = [(0.5, 0.5), (1e-6, 1e-6), (0.999999, 0.5)]
        assert zones.allow_points(allowed).all()
        assert not zones.allow_points(forbidden).any()

    @pytest.mark.parametrize("shift", [1e-8, 1e-10])
    def test_within_a_billionth_of_the_boundary_is_on_it(self, shift: float) -> None:
        inward = np.array([(shift, 0.5), (1 - shift, 0.5), (0.5, shift), (0.5, 1 - shift)])
        outward = np.array([(-shift, 0.5), (1 + shift, 0.5), (0.5, -shift), (0.5, 1 + shift)])
        on_it = shift < 1e-9
        assert (Zones(keep_out=[SQUARE]).allow_points(inward) == on_it).all()
        assert Zones(keep_out=[SQUARE]).allow_points(outward).all()
        assert (Zones(keep_in=[SQUARE]).allow_points(outward) == on_it).all()
        assert Zones(keep_in=[SQUARE]).allow_points(inward).all()

    @pytest.mark.parametrize(
        ("start", "end", "allowed"),
        [
            ((-1, 0.5), (2, 0.5), False),  # through
            ((-1, 0.5), (0, 0.5), True),  # up to the boundary
            ((-1, 0.5), (0.5, 0.5), False),  # into
            ((0, 0.5), (0.5, 0.5), False),  # from the boundary into
            ((0, 0.5), (0.5, 0), False),  # from boundary to boundary through a corner's inside
            ((0, 0), (1, 1), False),  # along the diagonal
            ((0, 0), (1, 0), True),  # along a side
            ((-1, 0), (2, 0), True),  # along a side and beyond it
            ((-1, 1), (1, -1), True),  # past a corner
            ((0.5, 0.5), (0.5, 0.5), False),  # no length, inside
            ((1, 0.5), (1, 0.5), True),  # no length, on the boundary
            ((2, 0), (2, 5), True),
        ],
    )
    def test_segments_against_a_forbidden_square(
        self, start: tuple[float, float], end: tuple[float, float], allowed: bool
    ) -> None:
        zones = Zones(keep_out=[SQUARE])
        assert zones.allow_segments([start], [end]).tolist() == [allowed]
        assert zones.allow_segments([end], [start]).tolist() == [allowed]

    def test_a_segment_across_the_mouth_of_a_horseshoe(self) -> None:
        # Both ends and all the corners of the forbidden polygon are clear of it; only the segment itself is not.
        starts, ends = [(-1, 2), (1.5, 4), (1.2, 2.5), (0, 3)], [(4, 2), (1.5, 1), (1.8, 2.5), (3, 3)]
        assert Zones(keep_out=[HORSESHOE]).allow_segments(starts, ends).tolist() == [False, True, True, True]
        assert Zones(keep_in=[HORSESHOE]).allow_segments(
            [(0.5, 2), (0.5, 0.5), (0.5, 2.5)], [(2.5, 2), (2.5, 0.5), (0.5, 0.5)]
        ).tolist() == [False, True, True]

    def test_a_loop_stays_in_the_union_of_the_permitted_polygons(self) -> None:
        zones = Zones(keep_in=[SQUARE, BESIDE])
        assert zones.allow_points([(0.5, 0.5), (1.5, 0.5), (1, 0.5), (2, 1), (2.1, 0.5), (0.5, -0.1)]).tolist() == [
            *[True] * 4,
            *[False] * 2,
        ]
        # Over the side that both share, which lies in neither's interior.
        assert zones.allow_segments([(0.5, 0.5), (0.5, 0.5)], [(1.5, 0.5), (2.5, 0.5)]).tolist() == [True, False]
        apart = Zones(keep_in=[SQUARE, [(2, 0), (3, 0), (3, 1), (2, 1)]])
        assert apart.allow_points([(0.5, 0.5), (2.5, 0.5)]).all()
        assert not apart.allow_segments([(0.5, 0.5)], [(2.5, 0.5)]).any()

    def test_permitted_and_forbidden_together(self) -> None:
        zones = Zones(
            keep_in=[[(-2, -2), (2, -2), (2, 2), (-2, 2)]], keep_out=[SQUARE, [(-1, -1), (-0.5, -1), (-1, -0.5)]]
        )
        assert zones.allow_points([(-0.1, 0.5), (0.5, 0.5), (3, 3), (-0.9, -0.9)]).tolist() == [
            True,
            False,
            False,
            False,
        ]
        assert zones.allow_segments(
            [(-1, 0.5), (-1, 1.5), (-1, 1.5)], [(1.5, 0.5), (1.5, 1.5), (2.5, 1.5)]
        ).tolist() == [
            False,
            True,
            False,
        ]

    def test_without_polygons_everything_is_allowed(self) -> None:
        for zones in (Zones(), Zones(keep_out=[], keep_in=()), Zones([], [])):
            assert zones.allow_points([(0, 0), (9, 9)]).all()
            assert zones.allow_segments([(0, 0)], [(9, 9)]).all()
            assert zones == Zones()

    def test_no_points_are_no_answers(self) -> None:
        zones = Zones(keep_in=[SQUARE], keep_out=[BESIDE])
        assert zones.allow_points(np.zeros((0, 2))).shape == (0,)
        assert zones.allow_segments(np.zeros((0, 2)), np.zeros((0, 2))).shape == (0,)

    @settings(deadline=None, max_examples=100)
    @given(corners=star_polygons(), queries=st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1))
    def test_any_polygon_against_counting_crossings(
        self, corners: list[tuple[float, float]], queries: list[tuple[float, float]]
    ) -> None:
        clear = [point for point in queries if boundary_distance(point, corners) > 1e-6]
        expected = [inside(point, corners) for point in clear]
        assert Zones(keep_in=[corners]).allow_points(clear).tolist() == expected
        assert Zones(keep_out=[corners]).allow_points(clear).tolist() == [not one for one in expected]
        # The boundary itself belongs to both.
        edge = [
            ((1 - s) * x0 + s * x1, (1 - s) * y0 + s * y1)
            for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True)
            for s in (0.0, 0.3, 0.5)
        ]
        assert Zones(keep_in=[corners]).allow_points(edge).all()
        assert Zones(keep_out=[corners]).allow_points(edge).all()

    @settings(deadline=None, max_examples=60)
    @given(
        corners=star_polygons(),
        start=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
        end=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    )
    def test_an_allowed_segment_has_only_allowed_points(
        self, corners: list[tuple[float, float]], start: tuple[float, float], end: tuple[float, float]
    ) -> None:
        along = np.linspace(0, 1, 101)[:, None]
        samples = np.array(start) + along * (np.array(end) - np.array(start))
        for zones in (Zones(keep_out=[corners]), Zones(keep_in=[corners])):
            if zones.allow_segments([start], [end])[0]:
                assert zones.allow_points(samples).all()
            # A forbidden point of keep_out forbids the segment, whichever way it is drawn.
            if not zones.allow_points(samples[[0, -1]]).all():
                assert not zones.allow_segments([end], [start])[0]

    def test_corners_may_be_texts_arrays_and_closed_twice(self) -> None:
        typed = Zones(keep_out=[[("0", "0"), ("pi/4", 0), ["45deg", "π/4"], (0, "0.5")]])
        assert typed.keep_out == (((0.0, 0.0), (math.pi / 4, 0.0), (math.pi / 4, math.pi / 4), (0.0, 0.5)),)
        assert Zones(keep_out=[np.array(SQUARE)]) == Zones(keep_out=[SQUARE])
        assert Zones(keep_out=[[*SQUARE, SQUARE[0]]]) == Zones(keep_out=(tuple(SQUARE),))
        assert Zones(keep_in=[SQUARE]) != Zones(keep_out=[SQUARE])

    def test_they_are_their_own(self) -> None:
        corners = [list(corner) for corner in SQUARE]
        zones = Zones(keep_out=[corners])
        corners[0][0] = -5.0
        assert zones.keep_out == (tuple(SQUARE),)
        assert zones.allow_points([(-1.0, 0.1)]).all()
        with pytest.raises(AttributeError):
            zones.keep_out = ()  # type: ignore[misc]

    @pytest.mark.parametrize("name", ["keep_out", "keep_in"])
    @pytest.mark.parametrize("value", [3, 1.5, "square", None, {}, {"a": SQUARE}, {1, 2}], ids=repr)
    def test_what_is_no_list_of_polygons_is_refused(self, name: str, value: Any) -> None:
        with pytest.raises(InputError) as caught:
            Zones(**{name: value})
        assert str(caught.value).startswith(f"{name}: {value!r}; allowed is a list of polygons")

    @pytest.mark.parametrize("name", ["keep_out", "keep_in"])
    @pytest.mark.parametrize(
        ("corners", "expected"),
        [
            (3, "3; allowed is a list of [alpha1, alpha2]"),
            ("square", "'square'; allowed is a list of"),
            (None, "None; allowed"),
            ({}, "{}; allowed"),
            ([], "0 different corners; allowed are three or more"),
            ([(0, 0)], "1 different corners"),
            ([(0, 0), (1, 0)], "2 different corners"),
            ([(0, 0), (1, 0), (0, 0), (1, 0)], "2 different corners"),
            ([(0, 0), (1, 0), (0.5,)], "corner (0.5,); allowed is [alpha1, alpha2]"),
            ([(0, 0), (1, 0), (0, 1, 2)], "corner (0, 1, 2)"),
            ([(0, 0), (1, 0), 3], "corner 3"),
            ([(0, 0), (1, 0), "ab"], "corner 'ab'"),
            ([0, 1, 2], "corner 0"),
            ([(0, 0), (1, 0), (0, "x")], "alpha2: 'x' is no angle"),
            ([(0, 0), (1, 0), ("1/2", 0)], "alpha1: '1/2' is no angle"),
            ([(0, 0), (1, 0), (0, math.nan)], "alpha2: nan is no angle"),
            ([(0, 0), (math.inf, 0), (0, 1)], "alpha1: inf is no angle"),
            ([(0, 0), (1, None), (0, 1)], "alpha2: None is no angle"),
            ([(0, 0), (1, True), (0, 1)], "alpha2: True is no angle"),
            ([(0, 0), (1, 1), (1, 0), (0, 1)], "allowed is a simple polygon"),  # a bow tie
            ([(0, 0), (2, 0), (1, 0), (1, 1)], "allowed is a simple polygon"),  # a side run back
            ([(0, 0), (1, 1), (2, 0), (2, 2), (1, 1), (0, 2)], "allowed is a simple polygon"),  # two that touch
            ([(0, 0), (1, 1), (2, 2)], "allowed is a"),  # all in line
            ([(0, 0), (1e-7, 0), (0, 1e-7)], "allowed is a polygon with an interior"),
        ],
    )
    def test_a_malformed_polygon_is_refused_with_its_number(self, name: str, corners: Any, expected: str) -> None:
        with pytest.raises(InputError) as caught:
            Zones(**{name: [SQUARE, corners, BESIDE]})
        message = str(caught.value)
        assert message.startswith(f"{name} polygon 2")
        assert expected in message
        assert "\n" not in message

    def test_the_first_malformed_one_is_counted_in_its_own_list(self) -> None:
        with pytest.raises(InputError, match=r"^keep_in polygon 1: 2 different corners"):
            Zones(keep_out=[SQUARE, BESIDE], keep_in=[[(0, 0), (1, 1)]])
        for number in (1, 2, 3):
            polygons: list[Any] = [SQUARE, SQUARE, SQUARE]
            polygons[number - 1] = [(0, 0)]
            with pytest.raises(InputError, match=f"^keep_out polygon {number}: "):
                Zones(keep_out=polygons)


def test_the_side_that_two_keep_outs_share_is_their_boundary() -> None:
    left, right = [(0, 0), (1, 0), (1, 1), (0, 1)], [(1, 0), (2, 0), (2, 1), (1, 1)]
    zones = Zones(keep_out=[left, right])
    assert zones.allow_points([[0.5, 0.5], [1.0, 0.5], [1.5, 0.5]]).tolist() == [False, True, False]
    assert zones.allow_segments([[1.0, 0.0]], [[1.0, 1.0]]).tolist() == [True]


@pytest.mark.parametrize("size", [1e8, 1e154])
def test_polygons_whose_border_rounding_would_lose_are_refused(size: float) -> None:
    square = [(-size, -size), (size, -size), (size, size), (-size, size)]
    with pytest.raises(InputError, match="keep_in polygon 1: corner .* allowed are angles up to"):
        Zones(keep_in=[square])
    large = [(-1e5, -1e5), (1e5, -1e5), (1e5, 1e5), (-1e5, 1e5)]
    assert Zones(keep_in=[large]).allow_points([[0.5, 0.5]]).all()
    assert not Zones(keep_out=[large]).allow_points([[0.5, 0.5]]).any()
