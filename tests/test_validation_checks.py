"""The checks of valid and flyable, the report, what can be reached from hover, and what was not judged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.optimize import brentq

import gaitgraph as gg
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    level_determinant_resolution,
)
from gaitgraph.surface.sheets import sheet_distances
from gaitgraph.timing.laws import LAWS
from gaitgraph.validation.judged import Segments
from gaitgraph.validation.report import Check, Report, State
from tests.published import GAITS
from tests.samples import EXACT, PUBLISHED, along, points_of, table_from

if TYPE_CHECKING:
    from gaitgraph.vehicle import Spin

STEP, DELTA = np.pi / 16, PUBLISHED.delta


# The report


def test_a_report_prints_every_check_and_what_is_beside_them() -> None:
    states = {"two_color": State.HOLDS, "R_sign": State.UNDECIDED}
    states["hover_thrust"] = State.BROKEN
    report = Report(
        checks=tuple(
            Check(name=name, state=state, message=f"about {name}")
            for name, state in states.items()
        ),
        reachability="not decided here",
        notes=("row 3 is odd",),
        unlimited=("thrust_limit", "tilt_range", "tilt_rate"),
        hover_power=1.25,
        hover_power_over="time",
    )
    assert str(report).splitlines() == [
        "Flyable: no. Obeys the paper's rules: yes. Reachable from hover: unknown. "
        "No limit stated of thrust, tilt angle, tilt rate.",
        "  ok  two color             about two_color",
        "  ??  R sign                about R_sign",
        "  NO  hover thrust          about hover_thrust",
        "  --  hover power           1.250 times that of level hover (momentum theory, mean over time)",
        "  --  reachable from hover  not decided here",
        "warning: row 3 is odd",
    ]
    assert report.reason == "about hover_thrust"
    assert report.warnings == ("about R_sign", "row 3 is odd")
    with pytest.raises(KeyError, match="nothing"):
        report["nothing"]


CROSSING = [(STEP, -STEP), (2 * STEP, -STEP)]


# The rules of the paper


JUMP = 2 * (0.3 + DELTA)


@pytest.mark.parametrize(
    ("points", "colors", "value", "limit", "cause"),
    [
        ([(-1.3, 0.4), (-1.1, 0.4)], ["blue"] * 2, np.pi, 2e-3, "wraps by π or leaves"),
        (CROSSING, ["blue", "red"], 2 * (STEP - DELTA), 1e-9, "changes color"),
        ([(DELTA, -DELTA), (-1.5, 0.3)], ["red", "blue"], JUMP, 1e-9, "changes color"),
    ],
)
def test_jumps_are_measured(
    points: Any, colors: Any, value: float, limit: float, cause: str
) -> None:
    check = lift(points, colors).check()["continuous"]
    assert (check.ok, check.limit) == (False, limit)
    assert check.value == pytest.approx(value, abs=1e-12)
    told = f"jumps by {value:.4f} rad (limit {limit:g}) after corner 1 "
    assert told in check.message
    assert f"where it {cause}" in check.message


@pytest.mark.parametrize(
    ("off", "value", "limit"), [(1e-3, 1e-4, 1e-9), (0.1, 0.1, 2e-3)]
)
def test_a_small_change_of_color_counts_more_than_larger_deviations_within_tolerance(
    off: float, value: float, limit: float
) -> None:
    points = [(DELTA + 5e-5, -DELTA - 5e-5), (0.4, -0.4), (0.4, -0.3)]
    gait = lift(points, ["blue", "red", "red"])
    moved = gait.alpha + np.outer([0, 0, 1], [0, 0, off, 0])
    check = Gait(alpha=moved, colors=gait.colors).check()["continuous"]
    assert check.value == pytest.approx(value, rel=1e-6)
    assert (check.ok, check.limit) == (False, limit)


@pytest.mark.parametrize(("lies", "colored"), [("red", "blue"), ("blue", "red")])
@pytest.mark.parametrize("off", [0.0, 0.1])
def test_a_corner_off_the_sheet_of_its_color_is_named(
    lies: str, colored: str, off: float
) -> None:
    """It lies on the other sheet, or on neither."""
    alpha = lift([(0.5, -0.7)], lies).alpha + np.array([0, 0, off, 0])
    check = Gait(alpha=alpha, colors=(colored,)).check()["continuous"]
    distance = np.abs(alpha - lift([(0.5, -0.7)], colored).alpha).max()
    assert (check.ok, check.limit) == (False, 2e-3)
    assert check.value == pytest.approx(distance, rel=1e-12)
    assert f"is colored {colored} but lies off that sheet" in check.message
    assert (f", on the {lies} one" in check.message) is (off == 0.0)
    assert check.follows_from == ("on_surface" if off else None)


@pytest.mark.parametrize("factor", [1.0, 1 - 1e-9])
def test_a_value_at_its_tolerance_is_within_it(factor: float) -> None:
    """A blue row beside blue, as far as the tolerance, is on blue; so is the rounding that is inferred."""
    ok = factor == 1.0
    alpha = lift([(0.5, -0.7)], "blue").alpha + np.array([0, 0, 2.0**-9, 0])
    moved = Gait(alpha=alpha, colors=("blue",))
    tolerance = float(sheet_distances(alpha, moved.coefficients)[0, 1]) * factor
    report = moved.check(tolerance=tolerance)
    assert report["continuous"].ok is ok
    assert ("rank two on blue" in report["hover_thrust"].message) is ok
    exact = moved.check(tolerance=tolerance, angle_rounding=0.0)
    assert (report["R_sign"].limit != exact["R_sign"].limit) is ok


def test_a_place_on_a_chord_is_a_fraction_of_the_way_to_the_next_corner() -> None:
    segments = Segments(
        alpha=np.zeros((4, 4)),
        color=np.zeros(4, np.int8),
        number=np.array([1, 1, 2, 3]),
        noun="corner",
        within=np.array([0.0, 0.5, 0.0, 0.0]),
    )
    places = [segments.place(chord, 0.5) for chord in range(3)]
    told = [(place.point, place.fraction) for place in places]
    assert told == [(0, 0.25), (0, 0.75), (1, 0.5)]


@pytest.mark.parametrize("seed", [1, 33, 39, 57])
def test_the_first_pair_that_may_not_be_adjacent_is_named(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.uniform(-1, 1, 2) + random.uniform(-0.5, 0.5, (9, 2))
    gait = lift(points, random.choice(["red", "blue"], 9, p=[0.8, 0.2]).tolist())
    following = [*gait.types[1:], gait.types[0]]
    pairs = zip(gait.types, following, strict=True)
    wrong = [not gg.surface.types_may_be_adjacent(*pair) for pair in pairs]
    check = gait.check()["two_color"]
    assert check.ok is not any(wrong)
    assert check.ok or (check.where or {})["segment"] == wrong.index(True)


# The sign of R


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("height", [3e-7, -3e-7, 2e-8, -2e-8])
def test_the_sign_of_R_between_corners_is_decided_below_the_tolerance_of_the_search(
    sign: float, height: float
) -> None:
    """Out and back along a chord beside the curve R = 0, moved so far that its least R nearly vanishes."""
    a2 = np.array([-0.5, 0.1])
    a1 = np.arctan(2 * gg.PAPER.drag_ratio + np.tan(a2))

    def chord(shift: float) -> Gait:
        return lift(np.column_stack([a1 + shift, a2]), "red", coefficients=EXACT)

    def excess(shift: float) -> float:
        start, end = chord(shift).alpha[:, None]
        points = points_of(start, end, 20001)
        return float((sign * level_determinant(points, EXACT)).min()) - height

    check = chord(brentq(excess, -0.2, 0.2, xtol=1e-15)).check()["R_sign"]
    assert (check.decided, check.ok) == (True, height > 0)
    if check.ok:
        assert check.value == pytest.approx(sign * height, abs=1e-6)
        assert f"{'>' if sign > 0 else '<'} 0 along the whole" in check.message


@pytest.mark.parametrize(
    ("kind", "state"),
    [
        ("published", State.UNDECIDED),
        ("printed", State.HOLDS),
        ("exact", State.BROKEN),
    ],
)
@pytest.mark.parametrize("turn", range(4))
def test_of_blue_the_digits_of_the_coefficients_decide_the_sign_and_nothing_else(
    turn: int, kind: Any, state: State
) -> None:
    points = np.roll(GAITS[1].angles, turn, axis=0)
    report = lift(points, "blue", coefficients=kind).check()
    assert report["R_sign"].state is state
    assert report.valid is (kind != "exact")
    for name in ("least_singular_value", "hover_thrust"):
        assert report[name].broken
        assert report[name].message.endswith(("use red", "in exact physics"))
    assert report.reachable_from_hover is False
    # One blue corner is enough.
    colors: Any = np.roll(["blue", "red", "red", "red"], turn).tolist()
    mixed = lift(points, colors, coefficients=kind).check()
    assert "rank two on blue" in mixed["hover_thrust"].message


def test_rounding_is_inferred_as_far_as_the_tolerance_unless_it_is_given() -> None:
    gait = lift(GAITS[3].angles, "red")

    def limit(moved: Any, rounding: float | None) -> Any:
        other = Gait(alpha=gait.alpha + moved, colors=gait.colors)
        return other.check(angle_rounding=rounding)["R_sign"].limit

    printed = [0, 0, 3e-4, -7e-4]
    assert limit(printed, None) == pytest.approx(limit(printed, 7e-4), rel=1e-9)
    assert limit(printed, None) > limit(printed, 3e-4) > limit(printed, 0.0)
    bent = np.outer([0, 1, 0, 0], [0, 0, 0, 0.1])
    assert limit(bent, None) == limit(bent, 0.0)
    carried = level_determinant_resolution(gait.alpha, PUBLISHED, 5e-4).max()
    assert carried * (1 - 1e-9) <= limit([0, 0, 0, 0], 5e-4) < 4 * carried


# Physics


@pytest.mark.parametrize("apart", [2e-6, 4e-5, -2e-6, -4e-5])
@pytest.mark.parametrize("ratio", [gg.PAPER.drag_ratio, 0.05])
def test_a_floor_within_the_bracket_of_the_least_singular_value_is_decided(
    ratio: float, apart: float
) -> None:
    """Off the sheets the bracket is about 1e-4 wide; the comparison with the floor is decided to within 1e-6."""
    vehicle = gg.Vehicle(drag_ratio=ratio)
    gait = lift(GAITS[2].angles, "red", vehicle=vehicle).biased(0.8)
    least = float(least_singular_value(along(gait.alpha, 4001), vehicle).min())
    check = gait.check(floor=least - apart)["least_singular_value"]
    assert check.ok is (apart > 0)


def test_no_rotor_may_lean_beyond_a_quarter_turn_whatever_its_thrust() -> None:
    alpha = np.array([[0.4, -2.0, 0.4, -2.0]])
    assert hover_thrust_shares(alpha).min() > 0.1
    assert not Gait(alpha=alpha).check()["hover_thrust"].ok


def test_thrusts_that_vanish_between_corners_or_at_one_or_are_no_numbers() -> None:
    between = lift([(-0.896, 1.14), (-1.12, 1.512)], "red").check()["hover_thrust"]
    assert (between.ok, between.value) == (False, None)
    angle = (between.where or {})["alpha"][1]
    assert np.cos(angle + EXACT.delta) == pytest.approx(0, abs=1e-9)
    idle = np.array([[1, -1, 1, -1]] * 2) * EXACT.delta + np.outer([0, 1], [0, 0, 1, 0])
    at_row = gg.validate(idle)["hover_thrust"]
    assert "not positive (least 0 of m·g) at row 1" in at_row.message
    # Exactly where no thrusts carry the weight.
    first = [-0.21748872218123916, -0.2263425738234366, 0.22679332348172546]
    second = [0.14146998656354937, 0.1323386938841839, -0.13216538526306307]
    rows = [[*first, 0.2170379725229503]] * 2 + [[*second, -0.1416432951846702]]
    vehicle = gg.PAPER.replace(
        drag_ratio=0.004652334215179169, first_arm_angle=-0.9750201267805285
    )
    with np.errstate(invalid="ignore"):
        report = gg.validate(Gait(alpha=rows, vehicle=vehicle), tolerance=1e-3)
    assert not report["hover_thrust"].ok
    # At a corner of the square; warnings of numpy are errors in the tests.
    corner = lift([(np.pi / 2, -np.pi / 2), (0.8, -0.7)], "red")
    assert not corner.check().flyable


@pytest.mark.parametrize(
    ("limit", "ok"),
    [(0.25, False), (0.3, True), (0.3 - 0.9e-9, True), (0.3 - 1.1e-9, False)],
)
def test_tilts_on_both_sides_of_the_limit(limit: float, ok: bool) -> None:
    vehicle = gg.PAPER.replace(max_tilt=limit)
    gait = lift([(0.2, -0.1), (0.2, -0.3)], "red", vehicle=vehicle)
    check = gait.check()["tilt_range"]
    assert (check.ok, check.value, check.limit) == (ok, 0.3, limit)
    assert check.where is not None
    assert check.where["segment"] == 1


@pytest.mark.parametrize("seed", range(20))
def test_the_tilt_nearest_to_an_end_of_its_own_range_is_named(seed: int) -> None:
    random = np.random.default_rng(seed)
    alpha = random.uniform(-1, 1, (5, 4))
    low, high = random.uniform([[-2], [0]], [[0], [2]], (2, 4))
    stated: dict[str, Any] = {"min_tilt": low.tolist(), "max_tilt": high.tolist()}
    vehicle = gg.PAPER.replace(**stated)
    check = Gait(alpha=alpha, vehicle=vehicle).check()["tilt_range"]
    room = np.minimum(alpha - low, high - alpha)
    row, arm = divmod(int(room.argmin()), 4)
    value = alpha[row, arm]
    limit = min(low[arm], high[arm], key=lambda end: abs(end - value))
    assert (check.ok, check.value, check.limit) == (room.min() >= 0, value, limit)


@pytest.mark.parametrize("excess", [1e-3, -1e-3])
def test_the_largest_thrust_is_compared_with_the_limit(excess: float) -> None:
    shares = hover_thrust_shares(lift(GAITS[2].angles, "red").alpha)
    newtons = float(shares.max()) * 0.429 * 9.8
    vehicle = gg.PAPER.replace(max_thrust=newtons - excess)
    check = lift(GAITS[2].angles, "red", vehicle=vehicle).check()["thrust_limit"]
    assert check.ok is (excess < 0)
    assert check.value == pytest.approx(newtons, abs=1e-4)
    assert (check.where or {})["segment"] == shares.max(axis=1).argmax()


# Reachability from hover


BORDER = float(np.arctan(gg.PAPER.drag_ratio))


@pytest.mark.parametrize(
    ("points", "home"),
    [
        (GAITS[3].angles, True),
        (GAITS[2].angles, False),
        ([(-0.9, 0.9)], True),
        ([(-1.55, 1.5)], False),  # small components in the corner of the square
        ([(-1.5, 1.55)], False),
        ([(-0.4, 0.4), (BORDER - 1e-15, -BORDER), (-0.4, 0.2)], False),  # R = 0
    ],
)
@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
def test_the_component_of_hover_is_reached_on_its_part_of_red_alone(
    points: Any, home: bool, spin: Spin
) -> None:
    vehicle = gg.PAPER.replace(first_rotor_spin=spin)
    mirror = 1 if spin == "clockwise" else -1
    gait = lift(mirror * np.array(points), "red", vehicle=vehicle)
    assert gait.check().reachable_from_hover is home
    # An opposite arm turned by π is on red too, but on another part of it.
    for turned in ((np.pi, 0), (0, np.pi), (np.pi, np.pi), (0, 0.01)):
        alpha = gait.alpha + np.array([0, 0, *turned])
        moved = Gait(alpha=alpha, colors=gait.colors, vehicle=vehicle)
        assert not moved.check().reachable_from_hover


def at_shares(alpha: Any, places: Any) -> Any:
    """Return points of a polyline, evenly spaced along the places of its corners."""
    even = (np.arange(100_001) + 0.5) / 100_001 * places[-1]
    return np.column_stack([np.interp(even, places, column) for column in alpha.T])


def test_reachability_uses_exact_coefficients() -> None:
    """R is 1e-5, far more than floating point makes of zero, and far less than three printed digits carry."""

    def excess(first: float) -> float:
        return float(level_determinant([first, -0.2] * 2, EXACT)) - 1e-5

    a1 = brentq(excess, -0.2, np.arctan(2 * gg.PAPER.drag_ratio + np.tan(-0.2)))
    report = lift([(a1, -0.2)], "red").check()
    assert not report["R_sign"].decided
    assert report.reachable_from_hover is True
    assert lift([(a1 + 1e-4, -0.2)], "red").check().reachable_from_hover is False
    # Certain at the second corner alone.
    assert not lift([(a1, -0.2), (0.0, -0.2)], "red").check()["R_sign"].decided


# What was not judged

LIMITS: dict[str, Any] = {
    "thrust_limit": {"max_thrust": 9.0},
    "tilt_range": {"max_tilt": 1.5},
    "tilt_rate": {"max_tilt_rate": 99.0},
    "tilt_acceleration": {"max_tilt_acceleration": 9999.0},
}
LOOP = [(-0.8, 0.8), (-0.8, 0.4), (-0.4, 0.4)]


@pytest.mark.parametrize("name", LIMITS)
def test_conditions_without_a_limit_are_named(name: str) -> None:
    others = [other for other in LIMITS if other != name]
    for names, left in ([name], others), (others, [name]), ([], list(LIMITS)):
        stated = {key: value for limit in names for key, value in LIMITS[limit].items()}
        vehicle = gg.PAPER.replace(**stated)
        report = gg.validate(lift(LOOP, "red", vehicle=vehicle).parametrize())
        assert report.flyable
        assert report.not_judged == tuple(left)


def test_more_than_half_of_the_weight_on_a_rotor_is_told() -> None:
    def notes(angle: float, **limits: Any) -> list[str]:
        vehicle = gg.PAPER.replace(**limits)
        report = gg.validate(lift([(angle, -angle)], "red", vehicle=vehicle))
        return [note for note in report.warnings if "of m·g" in note]

    half = brentq(
        lambda angle: hover_thrust_shares([angle, -angle] * 2).max() - 0.5, 0.7, 1.4
    )
    share = hover_thrust_shares([half + 0.1, -half - 0.1] * 2).max()
    assert notes(half - 1e-6) == notes(half + 0.1, max_thrust=9.0) == []
    assert [f"up to {share:.3g} of m·g" in note for note in notes(half + 0.1)] == [True]


# The mean power in hover


def mean_power(points: Any, vehicle: Any = gg.PAPER) -> float:
    """The mean of f^1.5 over its value in level hover, where each rotor has a quarter."""
    shares = hover_thrust_shares(points, vehicle)
    return float((shares**1.5).sum(axis=-1).mean() / (4 * 0.25**1.5))


@pytest.mark.parametrize("vehicle", ["paper", "beetle_omni"])
@pytest.mark.parametrize("law", LAWS)
def test_hover_power_is_the_mean_of_dense_samples(vehicle: str, law: Any) -> None:
    timed = lift(LOOP, "red", vehicle=vehicle).parametrize(3.0, law=law)
    middles = (np.arange(50_001) + 0.5) / 50_001 * 3.0
    report = gg.validate(timed)
    expected = mean_power(timed.at(middles).alpha, timed.gait.vehicle)
    assert report.hover_power == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("count", [2, 1500])
def test_hover_power_of_rows_is_that_of_the_rows_as_joined(count: int) -> None:
    """In time if they have times, else by length; also after a step that is short, and of many short steps."""
    corners = along(lift(LOOP, "red").alpha, count)
    corners = np.vstack([corners, corners[:1]])
    near = corners[0] + 1e-3 * (corners[1] - corners[0])
    rows = np.insert(corners, 1, near, axis=0)
    rows = rows[np.append(True, np.diff(rows, axis=0).any(axis=1))]
    t = np.random.default_rng(4).uniform(0.5, 1.5, len(rows)).cumsum()
    length = np.append(0.0, np.linalg.norm(np.diff(rows, axis=0), axis=1).cumsum())
    for form, places, over in (
        (table_from(rows, t=t), t - t[0], "time"),
        (table_from(rows), length, "length"),
        (lift(LOOP, "red"), length, "length"),
    ):
        report = gg.validate(form)
        expected = mean_power(at_shares(rows, places))
        assert report.hover_power == pytest.approx(expected, rel=1e-5)
        assert report.hover_power_over == over


def test_hover_power_of_hover_is_one_and_does_not_exist_where_a_rotor_would_pull() -> (
    None
):
    for height in (0.0, 0.03):
        vehicle = gg.PAPER.replace(rotor_height=height)
        hover = lift([(0.0, 0.0)], "red", vehicle=vehicle)
        assert gg.validate(hover).hover_power == pytest.approx(1.0)
    for color in ("blue", "red"):
        gait = lift([(0.4, 0.4), (0.9, 0.4)], color)
        for form in (gait, gait.parametrize()):
            assert gg.validate(form).hover_power is None


@pytest.mark.parametrize(("off", "tolerance"), [(0.03, 0.5), (0.06, 0.9)])
def test_physics_does_not_depend_on_the_tolerance(off: float, tolerance: float) -> None:
    """Rows beside blue are not on it, however large the tolerance is."""
    vehicle = gg.Vehicle(arm_length=0.2, drag_to_thrust=0.03, mass=1.0)
    line = np.arctan(vehicle.drag_ratio)
    first, second = np.array([[-0.4, -0.45], [0.5, 0.6]])
    opposite = [2 * line - first + off, -2 * line - second - off]
    alpha = np.stack([first, second, *opposite], axis=1)
    strict, wide = (
        gg.validate(alpha, vehicle=vehicle, tolerance=one) for one in (0.01, tolerance)
    )
    for name in ("least_singular_value", "hover_thrust"):
        assert wide[name].ok is strict[name].ok
        assert wide[name].value == pytest.approx(strict[name].value, rel=1e-3)
    assert "whole blue sheet" not in wide["R_sign"].message


def test_a_rotor_that_idles_has_the_share_zero() -> None:
    """β1 + β3 = 0 along the whole table."""
    line = 2 * np.arctan(gg.PAPER.drag_ratio)
    rows = [[0.95, 1.473, line - 0.95, -np.pi / 2], [1.0, 1.2, line - 1.0, -1.2]]
    check = gg.validate(np.array(rows))["hover_thrust"]
    assert (check.ok, check.value) == (False, 0.0)
