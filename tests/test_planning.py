"""Plans: what loops keep, which loop is preferred, why there is none, and where waypoints and loops in files lie."""

from __future__ import annotations

import json
import math
import re
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.invertibility import (
    coefficients_of,
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
)
from gaitgraph.planning.request import colorings_of_file
from tests.published import GAITS
from tests.samples import MIRRORED, along, loop_of

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.planning.branch import Refusal

G1, _, G3, _ = GAITS
STRONG = gg.Vehicle(drag_ratio=0.4)
# Straight between these two the least singular value of STRONG dips under 0.9.
ACROSS = [("3pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
RED_BELOW: dict[str, Any] = {"color": "red", "sign": "negative"}
SADDLE = "1.2 1, -1 -1.2"
WALL = [(0.6, -0.6), (1.0, -0.6), (1.0, -0.2), (0.6, -0.2)]
FENCE = [(0.5, -2.0), (0.7, -2.0), (0.7, 2.0), (0.5, 2.0)]
# Squares of smaller differences may vanish in floating point.
angle = st.floats(-1.57, 1.57).map(lambda angle: round(angle, 12))
methods = pytest.mark.parametrize(
    "method",
    [{"method": "grid", "divisions": 12}, {"method": "exact"}],
    ids=["grid", "exact"],
)


def pairs(text: str) -> list[tuple[str, ...]]:
    """Return waypoints that are written as "0.5 -0.5, pi/8 0"."""
    return [tuple(pair.split()) for pair in text.split(", ")]


def short(loop: Any) -> str:
    """Return color and sign of a loop or a refusal as "red +"."""
    return f"{loop.color} {'+' if loop.sign == 'positive' else '-'}"


# -- What loops keep


@pytest.mark.no_cover
@settings(deadline=None, max_examples=10)
@given(
    points=st.lists(st.tuples(angle, angle), min_size=1, max_size=3),
    divisions=st.none() | st.integers(3, 20),
    vehicle=st.sampled_from([gg.PAPER, MIRRORED, STRONG]),
    objective=st.sampled_from(["shortest", "robust"]),
    reverse=st.booleans(),
)
def test_whatever_is_planned_holds_when_sampled(
    points: Any, divisions: Any, vehicle: Any, objective: Any, reverse: bool
) -> None:
    asked: Any = {"vehicle": vehicle, "objective": objective, "reverse": reverse}
    plan = gg.plan_loop(points, divisions=divisions, require="valid", **asked)
    json.dumps(plan.as_mapping(), allow_nan=False)
    if plan.loop is None:
        assert plan.refusals
        return
    gait, path = plan.gait, plan.loop.path.alpha[:, :2]
    passed = along(gait.alpha, 101)
    assert plan.report.valid
    assert (plan.reason is None) is plan.report.flyable
    told = plan.report.reachability in plan.warnings
    assert told is not plan.report.reachable_from_hover
    assert np.abs(roll_sensitivity(passed, gait.coefficients)).max() < 1e-10
    assert np.abs(pitch_sensitivity(passed, gait.coefficients)).max() < 1e-10
    R = level_determinant(passed, gait.coefficients)
    assert R.min() * R.max() > 0 or not plan.report["R_sign"].decided
    if plan.report.flyable:
        assert least_singular_value(passed, vehicle).min() >= 0.05
        assert hover_thrust_shares(passed, vehicle).min() > 0
    at = 0
    for point in plan.waypoints:  # passed in order; the grid takes 1e-9 for the same
        near = np.abs(path[at:] - point).max(axis=1) <= 1e-9
        at += int(near.argmax())
        assert near.any()
    order = plan.loop.order
    assert [plan.request.waypoints[k] for k in order] == list(plan.waypoints)
    run = [0, *range(len(order) - 1, 0, -1)] if reverse else range(len(order))
    assert list(order) == list(run)
    posture = len(set(plan.request.waypoints)) == 1
    assert str(plan).startswith("The plan is a single posture") is posture


def test_beyond_nine_waypoints_the_order_is_approximate() -> None:
    points = [(0.3 + 0.1 * k, -0.4 - 0.5 * (k % 2)) for k in range(10)]
    plan = gg.plan_loop(points, any_order=True, divisions=16)
    ordered = gg.plan_loop(points, divisions=16)
    assert loop_of(plan).length < loop_of(ordered).length
    assert sorted(loop_of(plan).order) == list(range(10))
    assert any("is approximate" in warning for warning in plan.warnings)
    nine = gg.plan_loop(points[:9], any_order=True, divisions=16)
    exact = [loop_of(each).order_exact for each in (plan, ordered, nine)]
    assert exact == [False, True, True]


# -- Which loop is preferred


@methods
def test_a_flyable_detour_beats_a_shorter_valid_loop(method: Any) -> None:
    asked: Any = {"floor": 0.9, "vehicle": STRONG, **method, **RED_BELOW}
    plan = gg.plan_loop(ACROSS, require="valid", **asked)
    (straight,) = plan.alternatives
    assert plan.report.flyable
    assert straight.report.valid
    assert straight.length == pytest.approx(pi / 2 * math.sqrt(2))
    assert straight.length < loop_of(plan).length
    for loop in (loop_of(plan), straight):
        least = least_singular_value(along(loop.gait.alpha, 501), STRONG).min()
        assert bool(least >= 0.9) is loop.report.flyable


def test_what_only_the_clock_forbids_beats_what_physics_forbids() -> None:
    slow = STRONG.replace(max_tilt_rate=0.1)
    asked: Any = {"floor": 0.9, "vehicle": slow, "require": "valid", **RED_BELOW}
    plan = gg.plan_loop(ACROSS, divisions=16, **asked)
    assert [check.name for check in plan.report.checks if not check.ok] == ["tilt_rate"]
    (shorter,) = plan.alternatives
    assert shorter.length < loop_of(plan).length


@methods
@pytest.mark.parametrize(
    ("text", "floor", "options", "order"),
    [
        ("-1.5 -0.3", 2.0, {}, "red -, blue +"),
        # On a side of the square red has both signs: flyable first, then R > 0.
        ("pi/2 -0.5", 0.05, {"color": "red"}, "red -, red +"),
        ("pi/2 0.5", 0.05, {"color": "red"}, "red +, red -"),
        # Where nothing flies blue is shorter, and red, which goes round the saddle, is farther from singular.
        (SADDLE, 2.0, {"sign": "negative"}, "blue -, red -"),
        (SADDLE, 2.0, {"sign": "negative", "objective": "robust"}, "red -, blue -"),
    ],
)
def test_flyable_then_the_objective_then_red_then_positive_is_first(
    text: str, floor: float, options: Any, order: str, method: Any
) -> None:
    plan = gg.plan_loop(pairs(text), require="valid", floor=floor, **method, **options)
    loops = [loop_of(plan), *plan.alternatives]
    # On a side of the square the exact method has one of both.
    assert order.startswith(", ".join(map(short, loops))) or "divisions" not in method
    assert {*map(short, loops)} <= {*order.split(", ")}


@methods
@pytest.mark.parametrize("second", [-0.5, 0.5])
def test_R_has_the_sign_that_is_asked_for(method: Any, second: float) -> None:
    """On a side of the square both signs have a root, with opposite rotors tilted alike or against each other."""
    for sign, wanted in (("positive", 1.0), ("negative", -1.0)):
        asked: Any = {"color": "red", "sign": sign, **method}
        for require in ("flyable", "valid"):
            plan = gg.plan_loop([(pi / 2, second)], require=require, **asked)
            assert not plan or (wanted * plan.gait.R > 0).all()


def test_a_loop_that_crosses_itself_is_pointed_out() -> None:
    crossing = [G3.waypoints[k] for k in (0, 2, 1, 3)]
    for any_order in (False, True):
        plan = gg.plan_loop(crossing, any_order=any_order)
        told = any("crosses itself" in text for text in plan.warnings)
        assert told is not any_order
        assert (loop_of(plan).length == pytest.approx(pi)) is any_order


SLOW = gg.PAPER.replace(max_tilt_rate=1.0)


# -- Why there is none

ON_LINE = coefficients_of(kind="exact").delta - pi / 2
EXACT = {"coefficients": "exact"}
BLUE_BELOW: dict[str, Any] = {"color": "blue", "sign": "negative"}
# The waypoints, what is asked, each refusal with its waypoints, and what is named as the obstacle.
REFUSED: list[tuple[str, dict[str, Any], str, str]] = [
    ("-0.5 0.5, -1.5 0.5", {}, "red + 2, blue + 1, red - 1, blue - 2", "R = "),
    ("0.5 -0.5, -0.5 0.5", EXACT, "red + 1, blue +, red - 2, blue -", "R = "),
    (f"{ON_LINE} 0.3", {"color": "red", **EXACT}, "red + 1, red - 1", "R = 0"),
    ("0.3 -0.9, 0.8 -0.4", {"keep_out": [WALL], **RED_BELOW}, "red - 2", "keep_out"),
    ("pi/2 -0.5", {"color": "red", "keep_in": [FENCE]}, "red + 1, red - 1", "keep_in"),
    ("-1.5 0.5, -1.5 0.5, 1.2 -0.6", RED_BELOW, "red - 1 2", f"α1 = {ON_LINE:.4f}"),
    ("1.2 -0.6, 1.1 -0.7, -1.5 0.5", RED_BELOW, "red - 2 3", f"α1 = {ON_LINE:.4f}"),
    ("1.2 -0.6, -1.5 0.5", {"vehicle": STRONG, **RED_BELOW}, "red - 1 2", "the curve"),
    # Blue has no walls but the fence; red would have the curve between these two.
    ("0.9 -0.3, -0.5 0.5", {"keep_out": [FENCE], **BLUE_BELOW}, "blue - 1 2", "keep_"),
]


def R_on_sheet(refusal: Refusal, point: tuple[float, float]) -> float:
    """Return R of equation (6) on a sheet, from the planes themselves, wrapped into ±π/2."""
    (a1, a2), delta = point, coefficients_of().delta
    a3, a4 = a1, a2
    if refusal.color == "blue":
        a3, a4 = 2 * delta - a1, -2 * delta - a2
        a3, a4 = (angle - pi * round(angle / pi) for angle in (a3, a4))
    return float(level_determinant([a1, a2, a3, a4], coefficients_of()))


@methods
@pytest.mark.parametrize(("text", "options", "refusals", "obstacle"), REFUSED)
def test_each_branch_without_a_loop_says_what_is_in_its_way(
    text: str, options: Any, refusals: str, obstacle: str, method: Any
) -> None:
    plan = gg.plan_loop(pairs(text), require="valid", **method, **options)
    assert (plan.status, bool(plan)) == ("infeasible", False)
    told = [" ".join([short(one), *map(str, one.waypoints)]) for one in plan.refusals]
    assert sorted(told) == sorted(refusals.split(", "))
    for refusal in plan.refusals:
        count = len(refusal.waypoints)
        assert refusal.kind == ("color", "waypoint", "separated")[count]
        assert refusal.message in str(plan.reason)
        assert obstacle in refusal.message
        for number in refusal.waypoints:
            assert str(number) in refusal.message
        if refusal.kind == "waypoint":
            point = plan.request.waypoints[refusal.waypoints[0] - 1]
            assert ("R = 0, " in refusal.message) is (obstacle == "R = 0")
            expected = abs(R_on_sheet(refusal, point))
            rough = 2e-3 if "coefficients" in options else 1e-12
            assert abs(refusal.R or 0.0) == pytest.approx(expected, abs=rough)
    merged = len(pairs(text)) > len(plan.waypoints)
    assert any("merged 1 waypoint" in text for text in plan.warnings) is merged
    for ask in (lambda: plan.gait, lambda: plan.report, plan.timed):
        with pytest.raises(gg.Infeasible):
            ask()


LOW = [("3pi/8", "3pi/8"), ("pi/8", "pi/8")]
NOT_FLYABLE: list[tuple[Any, dict[str, Any], str, str]] = [
    # What is in the way of each branch, and the loops that only obey the paper's rules.
    (LOW, {}, "waypoint waypoint", "red +, blue -"),
    (G1.waypoints, {}, "waypoint waypoint", "blue -"),
    (G3.waypoints, {"color": "blue"}, "color color", "blue -"),
    (G3.waypoints, {"color": "blue", **EXACT}, "color color", ""),
    (G3.waypoints, {"vehicle": SLOW}, "limit", "red -, blue -"),
    (G3.waypoints, {"floor": 0.6, **RED_BELOW}, "waypoint", "red -"),
]


@methods
@pytest.mark.parametrize(("points", "options", "kinds", "others"), NOT_FLYABLE)
def test_only_what_can_fly_is_handed_out_and_the_rest_is_an_alternative(
    points: Any, options: Any, kinds: str, others: str, method: Any
) -> None:
    asked: Any = {**method, **options}
    plan = gg.plan_loop(points, **asked)
    assert not plan
    assert " ".join(refusal.kind for refusal in plan.refusals) == kinds
    assert ", ".join(map(short, plan.alternatives)) == others
    for loop in plan.alternatives:
        assert not loop.report.flyable
        for check in loop.report.checks:
            name = check.name.replace("_", " ")
            assert (name in str(loop)) is (check.mark != "ok")
    valid = gg.plan_loop(points, **{"require": "valid", **asked})
    assert bool(valid) is bool(plan.advice) is bool(others)
    if others:
        np.testing.assert_array_equal(valid.gait.alpha, plan.alternatives[0].gait.alpha)


def outside(count: int) -> str:
    return ", ".join(f"1.2 {-0.1 - 0.001 * k}" for k in range(count))


@pytest.mark.parametrize(
    ("text", "options", "end"),
    [
        # The first waypoint lies in the other sign of R; two parts of one sign; a fence; not admissible together.
        ("0.589 -0.785, 0.9 -0.4, -1.374 1.374", {}, ""),
        ("-0.5 0.5, -1.5 1.5, -0.5 1.55", {"color": "red"}, ""),
        ("0.5 0.5, 0.6 -0.6", {"keep_out": [FENCE]}, ""),
        ("-1 1, 1 -1, 0.9 -0.9", {}, ""),
        # Of ten waypoints the nearest points of eight are told.
        (outside(8), RED_BELOW, "for waypoint 8"),
        (outside(10), RED_BELOW, "for waypoint 8, and 2 more"),
    ],
)
def test_the_first_refusal_has_the_least_moves_and_they_lead_to_a_gait(
    text: str, options: dict[str, Any], end: str
) -> None:
    plan = gg.plan_loop(pairs(text), **options)
    moves = [
        sum(map(math.dist, refusal.moved, plan.waypoints)) for refusal in plan.refusals
    ]
    assert moves[0] == min(moves) > 0
    first = plan.refusals[0]
    assert gg.plan_loop(first.moved, **options)
    assert first.message.endswith(end)


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"floor": 2.0}, "is at most 1.1710, below the floor 2"),
        ({"vehicle": gg.PAPER.replace(max_thrust=1.0)}, "rotors lift 4 N at most"),
    ],
)
def test_a_region_that_is_empty_says_why(options: Any, why: str) -> None:
    assert why in str(gg.plan_loop(G3.waypoints, **RED_BELOW, **options).reason)


# -- Where waypoints lie


def test_an_empty_region_tells_the_largest_servo_margin() -> None:
    location = gg.location_of([(-0.4, 0.4)], sign="negative", servo_margin="50deg")
    told = re.search(r"above about (\S+)°", location.regions[0].why_empty)
    assert told is not None
    largest = float(told[1])
    joined = [
        gg.admissible_region(sign="negative", servo_margin=math.radians(margin)).area
        for margin in (largest - 0.5, largest + 0.5)
    ]
    assert joined[0] > 0 == joined[1]


def test_a_waypoint_is_in_a_part_of_the_region_or_told_why_not() -> None:
    first: Any
    first, second = gg.location_of([(-0.4, 0.4), (0.5, 0.5)]).regions
    assert (first.sign, first.parts, first.joined) == ("positive", (1, None), False)
    assert [bool(reason) for reason in first.reasons] == [False, True]
    assert first.nearest == (None, pytest.approx((0.1671, 0.5), abs=1e-4))
    assert second.parts == (None, None)
    assert "waypoint 1 (-0.4000, 0.4000): in part 1\n" in str(first)
    assert str(first).endswith("no loop can join them")
    areas = [part["area"] for part in first.as_mapping()["parts"]]
    assert sum(areas) == pytest.approx(first.region.area)


def test_what_is_joined_can_be_planned_and_what_is_not_cannot() -> None:
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(25):
        points = [tuple(point) for point in rng.uniform(-1.5, 1.5, (2, 2)).tolist()]
        asked: Any = {"color": "red", "keep_out": [FENCE], "accuracy": 1e-3}
        joined = bool(gg.location_of(points, **asked))
        assert joined == bool(gg.plan_loop(points, **asked))
        seen.add(joined)
    assert seen == {True, False}


@pytest.mark.no_cover
def test_parts_that_touch_in_a_point_are_joined_there_and_planned_through() -> None:
    """Borders are allowed, so two keep-outs that touch leave a way of no width."""
    fence = [[(-1.2, 0.25), (-0.25, 0.25), (-0.25, 1.2), (-1.2, 1.2)]]
    below = [(-0.6, 0.25), (-0.6, 0.7), (-0.4, 0.5), (-0.4, 0.25)]
    points = [(-0.8, 0.75), (-0.35, 0.75)]
    for shift, touches in ((0.0, True), (1e-6, False)):
        above = [(-0.6, 0.7 - shift), (-0.6, 1.2), (-0.4, 1.2), (-0.4, 0.9)]
        zones: Any = {"keep_in": fence, "keep_out": [below, above], "sign": "positive"}
        assert bool(gg.location_of(points, **zones)) is touches
        for objective in ("shortest", "robust"):
            plan = gg.plan_loop(points, **{"objective": objective, **zones})
            assert bool(plan) is touches
            assert not plan or [-0.6, 0.7] in plan.gait.alpha[:, :2].tolist()


# -- Colourings of the loop in a file

RICH = [(pi / 16 * a, -pi / 16 * b) for a, b in [(1, 1), (2, 2), (3, 2), (1, 6)]]


def test_a_file_has_the_colourings_of_its_loop(tmp_path: Path) -> None:
    path = tmp_path / "gait.json"
    names = {"alpha1": [a for a, _ in RICH], "alpha2": [b for _, b in RICH]}
    request = {"waypoints": RICH, "samples": 20}
    plan = gg.plan_loop(G3.waypoints).as_mapping()
    none = gg.plan_loop([(0.5, -0.5), (-0.5, 0.5)], sign="negative").as_mapping()
    wide = {"crossing_tolerance": pi / 4}
    files: list[tuple[Any, Any, dict[str, Any], dict[str, Any]]] = [
        # The content, its loop, what is asked for, and what that means.
        ({name: [*row, row[0]] for name, row in names.items()}, RICH, {}, {}),
        (request, RICH, wide, wide),
        ({**request, "divisions": 4}, RICH, {}, {"crossing_tolerance": pi / 8}),
        (plan, G3.angles, EXACT, EXACT),
        (none, none["waypoints"], {}, {"sign": "negative"}),
    ]
    for content, loop, asked, meant in files:
        path.write_text(json.dumps(content))
        found, expected = colorings_of_file(path, **asked), gg.colorings(loop, **meant)
        assert list(found) == list(expected)
        assert (found.counts, found.refusals) == (expected.counts, expected.refusals)
    # A gait file states its vehicle and tolerance.
    gait = gg.lift(RICH, "red", vehicle=MIRRORED, crossing_tolerance=0.01)
    gait.parametrize(samples=4, law="equal-time").write(path, force=True)
    of_gait = gg.colorings(RICH, vehicle=MIRRORED, crossing_tolerance=0.01)
    assert list(colorings_of_file(path)) == list(of_gait)
    assert colorings_of_file(path) == gg.validate(path).listing


def test_waypoints_that_repeat_are_merged_around_the_seam_too() -> None:
    first, second, third, _ = G3.waypoints
    plan = gg.plan_loop([first, first, second, third, first])
    assert len(plan.waypoints) == 3
    assert any("merged 2 waypoints" in warning for warning in plan.warnings)
