"""Plans of vehicles that are not symmetric: regions, loops on their curved sheet, transitions, timing, files, flights."""

from __future__ import annotations

import json
import math
import re
import warnings
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.surface.curved import curved_sheet
from gaitgraph.surface.curved_region import sheet_region
from tests import samples
from tests.samples import loop_of

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.surface.sheets import Sign

PAIRED = ["clockwise", "clockwise", "counterclockwise", "counterclockwise"]
ODD = samples.ODD.replace(inertia=[0.02, 0.02, 0.03])
KINDS = samples.by_vehicle(samples.LEANING, samples.STANDING)  # beside ODD
SQUARE = [(-0.3, 0.3), (-0.6, 0.3), (-0.6, 0.6), (-0.3, 0.6)]


def flies(
    plane: np.ndarray, vehicle: gg.Vehicle, sign: str, floor: float
) -> np.ndarray:
    """Return whether points of the sheet fly, by the package's plain functions."""
    alpha = np.concatenate([plane, curved_sheet(vehicle).angles(*plane.T)], axis=1)
    R = level_determinant(alpha, coefficients_of(vehicle, "exact"))
    holds = (R > 0) == (sign == "positive")
    holds &= (hover_thrust_shares(alpha, vehicle) > 0).all(axis=1)
    holds &= least_singular_value(alpha, vehicle) >= floor
    if vehicle.thrust_share is not None:
        holds &= (hover_thrust_shares(alpha, vehicle) <= vehicle.thrust_share).all(
            axis=1
        )
    if vehicle.tilt_range is not None:
        low, high = np.array(vehicle.tilt_range).T
        holds &= ((alpha >= low) & (alpha <= high)).all(axis=1)
    return np.asarray(holds)


def loop_in_region(vehicle: gg.Vehicle) -> list[tuple[float, float]]:
    """Return three points of the region with R > 0, which straight lines join inside it."""
    region = sheet_region(vehicle)
    middle = region.components[0].representative_point()
    x, y = middle.x, middle.y
    size = 0.6 * middle.distance(region.inner.boundary) / math.sqrt(2)
    return [(x, y), (x + size, y), (x + size, y + size)]


@pytest.mark.parametrize("sign", ["positive", "negative"])
@KINDS
def test_a_region_is_proven_inside_and_outside(vehicle: gg.Vehicle, sign: Sign) -> None:
    limited = vehicle.replace(
        min_tilt=["-50deg", "-70deg", "-40deg", "-80deg"],
        max_tilt="60deg",
        mass=1.0,
        max_thrust=3.4,
    )
    plane = np.random.default_rng(9).uniform(-math.pi / 2, math.pi / 2, (10_000, 2))
    for body, floor in ((vehicle, 0.05), (limited, 0.3)):
        region = sheet_region(body, sign=sign, floor=floor, accuracy=0.02)
        holds = flies(plane, body, sign, floor)
        outside = ~shapely.contains_xy(region.outer, *plane.T)
        assert not (shapely.contains_xy(region.inner, *plane.T) & ~holds).any()
        assert not (holds & outside).any()
        assert region.outer.area - region.inner.area < 1.2
        for point in plane[outside][:9]:
            assert re.search(
                "must be|closer to the border", region.why_not(point) or ""
            )
        assert holds.any() or region.inner.is_empty


def test_the_region_of_a_symmetric_vehicle_is_that_of_its_plane() -> None:
    region = sheet_region(gg.PAPER)
    plane = gg.admissible_region(gg.PAPER, coefficients="exact", sign="positive")
    assert region.inner.difference(plane.outer.buffer(1e-9)).area < 1e-9
    assert plane.inner.difference(region.outer.buffer(1e-9)).area < 1e-9


@KINDS
def test_loops_fly_along_the_curve_and_its_chords(vehicle: gg.Vehicle) -> None:
    part = sheet_region(vehicle).components[0].buffer(-0.02)
    places = np.random.default_rng(9).uniform(-math.pi / 2, math.pi / 2, (200, 2))
    points = places[shapely.contains_xy(part, *places.T)][:3]
    plan = gg.plan_loop(points, vehicle=vehicle, sign="positive")
    assert plan.report.flyable
    alpha = plan.gait.alpha
    for point in points:
        assert np.abs(alpha[:, :2] - point).max(axis=1).min() < 1e-12
    shares = np.linspace(0, 1, 60)[:, None, None]
    chords = (alpha + shares * (plan.gait.ends - alpha)).reshape(-1, 4)
    assert least_singular_value(chords, vehicle).min() >= 0.05
    assert hover_thrust_shares(chords, vehicle).min() > 0
    off = chords[:, 2:] - curved_sheet(vehicle).angles(*chords[:, :2].T)
    assert np.abs(np.angle(np.exp(2j * off))).max() / 2 <= 1e-3
    assert flies(chords[:, :2], vehicle, "positive", 0.05).all()
    assert plan.loop is not None
    assert plan.loop.lower_bound is not None
    assert plan.loop.lower_bound <= plan.loop.length + 1e-12


def test_points_of_two_parts_and_outside_points_are_refused_with_numbers() -> None:
    apart = gg.plan_loop([(-0.3, 0.3), (0.6, -0.3)], vehicle=ODD)
    assert not apart
    assert "waypoint 2 (0.6000, -0.3000) has R = -12" in str(apart.reason)
    low = gg.plan_loop([(-0.3, 0.3), (0.1, 0.1)], vehicle=ODD, sign="positive")
    assert "hover thrusts must be positive, got -" in str(low.reason)
    assert low.refusals[0].nearest is not None
    # Above (0, 0) it is within the accuracy of its region, but beyond a fibre.
    leaning = gg.Vehicle(
        drag_to_thrust=0.02,
        rotor_positions=[[0.2, 0.2, 0], [-0.18, 0.2, 0], [-0.2, -0.2, 0], [0.2, -0.18, 0]],
        tilt_axes=[[1, 1, 0.2], [-1, 1, 0], [-1, -1, 0.2], [1, -1, 0]],
        thrust_axes=[[0.1, 0, 1], [0, 0, 1], [-0.1, 0, 1], [0, 0, 1]],
    )  # fmt: skip
    idle = gg.plan_loop([(0.0, 0.0), *SQUARE], vehicle=leaning, sign="positive")
    assert "hover thrusts must be positive, got -" in str(idle.reason)
    blue = gg.plan_loop([(-0.3, 0.3), (-0.5, 0.3)], vehicle=ODD, color="blue")
    assert "blue" in str(blue.reason)
    refused: dict[str, Any] = {
        "objective": "robust",
        "require": "valid",
        "servo_margin": 0.1,
    }
    for name, value in refused.items():
        with pytest.raises(gg.InputError, match="a vehicle that is not symmetric") as e:
            gg.plan_loop(SQUARE, vehicle=ODD, **{name: value})
        assert e.value.field == name


@pytest.mark.parametrize(
    "options", [{}, {"objective": "robust"}, {"servo_margin": "13deg"}]
)
def test_loops_on_the_grid_follow_the_sheet(options: Any) -> None:
    found = gg.plan_loop(SQUARE, vehicle=ODD, method="grid", **options)
    assert found.report.flyable
    alpha = found.gait.alpha
    for point in SQUARE:
        assert np.abs(alpha[:, :2] - point).max(axis=1).min() < 1e-12
    assert curved_sheet(ODD).distances_along(alpha, found.gait.ends).max() < 1.1e-3
    if options:
        assert loop_of(found).servo_margin.proven >= math.radians(12.9)
    shortest = gg.plan_loop(SQUARE, vehicle=ODD)
    assert shortest.loop is not None
    assert shortest.loop.length <= found.gait.length


def test_a_servo_margin_that_no_grid_keeps_is_refused() -> None:
    found = gg.plan_loop(SQUARE, vehicle=ODD, method="grid", servo_margin="30deg")
    assert "separated" in str(found.reason)


@KINDS
def test_cycles_fly_along_the_sheet(vehicle: gg.Vehicle) -> None:
    graph = gg.surface_graph("positive", vehicle=vehicle, divisions=12)
    for cycle in islice(gg.cycles(graph, require="flyable"), 5):
        assert (cycle.color, cycle.valid, cycle.flyable) == ("red", True, True)
        report = cycle.report
        assert report.flyable
        least = report["least_singular_value"].value
        assert least == pytest.approx(cycle.least_singular_value, abs=1e-4)
        assert cycle.reachable_from_hover == bool(report.reachable_from_hover)
        assert str(cycle).count("(") in (3, 4)


@KINDS
def test_a_gait_is_reachable_from_hover_where_a_flyable_path_is_proven(
    vehicle: gg.Vehicle,
) -> None:
    plan = gg.plan_loop(loop_in_region(vehicle), vehicle=vehicle, sign="positive")
    path = gg.transition("hover", plan.gait)
    flies_in = bool(path) and path.report.flyable
    assert plan.report.reachable_from_hover == (flies_in or None)
    assert ("not decided" in plan.report.reachability) == (not flies_in)
    assert f"hover: {'yes' if flies_in else 'unknown'}" in plan.report.verdict
    region = sheet_region(vehicle, sign="negative")
    if region.components:
        place = region.components[0].representative_point()
        posture = gg.lift([(place.x, place.y)], "red", vehicle=vehicle)
        assert posture.check().reachable_from_hover is False


def test_polygons_are_kept_out_of() -> None:
    block = [(-0.5, 0.2), (-0.4, 0.2), (-0.4, 0.35), (-0.5, 0.35)]
    free = gg.plan_loop(SQUARE[:2], vehicle=ODD)
    around = gg.plan_loop(SQUARE[:2], vehicle=ODD, keep_out=[block])
    assert around.report.flyable
    assert around.gait.length > free.gait.length + 0.01
    assert (
        not shapely.Polygon(block)
        .buffer(-1e-9)
        .intersects(shapely.LineString(around.gait.alpha[:, :2]))
    )


@pytest.mark.parametrize(
    ("suffix", "law", "vehicle"),
    [
        ("csv", "smooth", ODD),
        ("npz", "constant-speed", ODD),
        ("json", "smooth", ODD.replace(spins=PAIRED)),
    ],
)
def test_files_of_a_plan_are_judged_and_flown(
    suffix: str, law: Any, vehicle: gg.Vehicle, tmp_path: Path
) -> None:
    plan = gg.plan_loop(SQUARE, vehicle=vehicle, law=law, period=4.0)
    assert {*plan.warnings} <= {plan.report.reachability}
    path = tmp_path / f"odd.{suffix}"
    timed = plan.timed()
    timed.write(path)
    again = gg.timing.timed_gait_of(path)
    assert (type(again), again.law) == (type(timed), law)
    t = np.linspace(0, 4, 50)
    np.testing.assert_allclose(again.at(t).alpha, timed.at(t).alpha, atol=1e-12)
    assert gg.validate(path).flyable
    assert gg.fly(path).settled


@KINDS
def test_the_law_smooth_follows_the_sheet_and_rests_at_corners(
    vehicle: gg.Vehicle,
) -> None:
    sheet = curved_sheet(vehicle)
    corners = loop_in_region(vehicle)
    plan = gg.plan_loop(corners, vehicle=vehicle, sign="positive", period=3.0)
    timed = plan.timed()
    t, step = np.linspace(0, 3, 4001), 3 / 4000
    motion = timed.at(t)
    off = motion.alpha[:, 2:] - sheet.angles(*motion.alpha[:, :2].T)
    assert np.abs(np.angle(np.exp(2j * off))).max() / 2 < 1e-5
    slopes = np.diff(motion.alpha, axis=0) / step
    assert np.abs(slopes - (motion.rates[1:] + motion.rates[:-1]) / 2).max() < 1e-4
    at_rest = t[np.abs(motion.rates).max(axis=1) < 1e-3 * np.abs(motion.rates).max()]
    assert len(np.flatnonzero(np.diff(at_rest) > 0.1)) == 3
    for order, values in ((1, motion.rates), (2, motion.accelerations)):
        largest = np.abs(values).max(axis=0)
        peaks = timed.peaks(order)
        assert (peaks >= largest).all()
        assert (peaks <= 1.05 * largest + 1e-9).all()
    names = [check.name for check in plan.report.checks[-2:]]
    assert names == ["tilt_rate", "tilt_acceleration"]
    tight = vehicle.replace(max_tilt_acceleration=0.9 * timed.peaks(2).max())
    refused = gg.plan_loop(corners, vehicle=tight, sign="positive", period=3.0)
    assert "this law needs a period of at least 3.1" in str(refused.reason)


def test_a_certificate_proves_rates_along_the_sheet(run: Any, tmp_path: Path) -> None:
    vehicle = ODD.replace(max_tilt_rate=2.0, max_tilt_acceleration=12.0)
    timed = gg.plan_loop(SQUARE, vehicle=vehicle, period=2.0).timed()
    certified = gg.certify(timed)
    assert {
        "least_singular_value",
        "rate",
        "acceleration",
    } <= certified.intervals.keys()
    certified.write(tmp_path / "proof.json")
    timed.write(tmp_path / "odd.csv")
    assert run("verify", tmp_path / "proof.json", tmp_path / "odd.csv").code == 0


def test_attitudes_are_acceptable_on_the_sheet_and_not_on_the_plane() -> None:
    plan = gg.plan_loop(SQUARE, vehicle=ODD)
    plane = np.array(SQUARE)[:, [0, 1, 0, 1]]
    on_sheet, on_plane = (
        gg.robustness_of(gait, curves=0).as_mapping()["acceptable_fraction"]
        for gait in (plan.gait, gg.Gait(alpha=plane, vehicle=ODD))
    )
    assert on_sheet == pytest.approx(1.0, abs=1e-3)
    assert on_plane < 0.98


def test_the_command_plans_on_a_curved_sheet(run: Any, tmp_path: Path) -> None:
    constants = {
        name: ODD.as_mapping()[name] for name in ("drag_to_thrust", "rotor_positions")
    }
    lines = [f"{name} = {json.dumps(value)}" for name, value in constants.items()]
    (tmp_path / "own.toml").write_text("\n".join(lines), encoding="utf-8")
    places = [f"--waypoint={first},{second}" for first, second in SQUARE]
    options = ("--vehicle", "own.toml", "--json", "--output", "own.csv")
    answer = run("plan", *options, *places).json
    assert (answer["status"], answer["color"]) == ("planned", "red")
    assert (answer["types"], answer["flyable"]) == ([], True)
    assert run("validate", "own.csv").code == 0
    assert run("region", "--vehicle", "own.toml").code == 0
    limits: tuple[object, ...] = ("--max-rate", 2, "--max-acceleration", 9)
    assert run("pace", "own.csv", *limits, "--output", "fast.csv").code == 0
    assert run("transition", "hover", "own.csv").code == 0
    assert run("transition", "fast.csv", "own.csv").code == 0
    assert run("pace", "own.csv", *limits, "--rounding", 0.02).code == 0


def test_a_table_of_few_rows_says_how_far_its_chords_leave_the_sheet(
    tmp_path: Path,
) -> None:
    plan = gg.plan_loop(SQUARE, vehicle=ODD)
    with pytest.warns(gg.errors.FileWarning, match="5 rows leave the curved sheet"):
        plan.timed(samples=4).write(tmp_path / "few.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plan.timed().write(tmp_path / "odd.csv")


def test_a_region_of_squares_has_a_least_accuracy() -> None:
    with pytest.raises(gg.InputError, match="accuracy must be an angle from 0.001"):
        sheet_region(ODD, accuracy=1e-6)


def test_a_margin_that_no_curved_region_keeps_is_refused() -> None:
    """A region of any four rotors does not know servo margins: an answer without one would not be what was requested."""
    with pytest.raises(gg.errors.InputError) as caught:
        gg.location_of([(-0.4, 0.4)], vehicle=ODD, servo_margin="5deg")
    assert caught.value.field == "servo_margin"


@KINDS
def test_transitions_fly_along_the_sheet(vehicle: gg.Vehicle) -> None:
    body = vehicle.replace(max_tilt_rate=3.0, max_tilt_acceleration=20.0)
    part = sheet_region(body).components[0].buffer(-0.02)
    plane = np.random.default_rng(3).uniform(-math.pi / 2, math.pi / 2, (100, 2))
    points = plane[shapely.contains_xy(part, *plane.T)][:4].tolist()
    first, last = (
        gg.plan_loop(pair, vehicle=body, sign="positive", period=60.0).timed()
        for pair in (points[:2], points[2:])
    )
    answer = gg.transition(first, last)
    assert answer.report.flyable
    motion = answer.timed.at(np.linspace(0, answer.duration, 4001))
    np.testing.assert_array_equal(motion.alpha[0], first.alpha[0])
    np.testing.assert_array_equal(motion.alpha[-1], last.alpha[0])
    assert curved_sheet(vehicle).distances(motion.alpha).max() < 1e-4
    assert flies(motion.alpha[:, :2], vehicle, "positive", 0.05).all()
    assert np.abs(motion.rates).max() <= 3.0
    assert np.abs(motion.accelerations).max() <= 20.0
    assert np.abs(motion.rates[[0, -1]]).max() < 1e-9
    assert answer.length >= math.dist(points[0], points[2]) - 1e-12


def test_hover_is_entered_on_the_sheet_and_walls_are_proven(tmp_path: Path) -> None:
    gait = gg.plan_loop(SQUARE, vehicle=ODD, period=4.0).timed()
    entry = gg.transition("hover", gait.gait)
    assert not entry.path[0].any()
    assert entry.corners == (None, 0)
    assert gg.transition(gait.gait, "hover").corners[0] in (0, 16, 32, 48)
    flight = gg.mission(gait)
    alpha = flight.at(np.linspace(0, flight.period, 5001)).alpha
    assert curved_sheet(ODD).distances(alpha).max() < 1e-4
    flight.write(tmp_path / "flight.csv")
    assert gg.validate(tmp_path / "flight.csv").flyable
    other = gg.plan_loop([(0.4, -0.3), (0.5, -0.4)], vehicle=ODD, sign="negative")
    wall = gg.transition(gait, other.gait)
    assert wall.proof is not None
    assert wall.proof["R_end"] < 0 < wall.proof["R_start"]
    plane = np.array(SQUARE)[:, [0, 1, 0, 1]]
    beside = gg.transition("hover", gg.Gait(alpha=plane, vehicle=ODD))
    assert "rad off the curved sheet" in str(beside.reason)
    tilted = ODD.replace(tilt_axes=samples.LEANING.tilt_axes)
    at_rest = gg.transition("hover", "hover", vehicle=tilted).path[0]
    np.testing.assert_array_equal(at_rest[2:], curved_sheet(tilted).angles(0, 0))
    idle = gg.transition("hover", "hover", vehicle=samples.LEANING)
    assert "the start is not flyable: hover thrusts" in str(idle.reason)
    low = gg.transition("hover", gait, floor=0.5)
    assert "the start is not flyable: least singular value" in str(low.reason)


@pytest.mark.parametrize("jerk", [None, [300] * 4])
@KINDS
def test_least_periods_keep_limits_of_all_four_arms(
    vehicle: gg.Vehicle, jerk: Any, tmp_path: Path
) -> None:
    corners = loop_in_region(vehicle)
    gait = gg.plan_loop(corners, vehicle=vehicle, sign="positive").gait
    limits = gg.Limits(rate=[2, 1, 3, 2], acceleration=[9, 9, 6, 12], jerk=jerk)
    answer = gg.least_period(gait, limits)
    timed = answer.timed
    assert timed is not None
    t = np.linspace(0, timed.period, 20_001)
    motion = timed.at(t)
    assert curved_sheet(vehicle).distances(motion.alpha).max() < 1e-5
    values = [motion.rates, motion.accelerations, timed.derivative(t, 3)]
    shares = []
    for order, value in enumerate(values, start=1):
        limit = limits.of_joints(4)[order - 1]
        assert (np.abs(value) <= limit).all()
        assert (timed.peaks(order) >= np.abs(value).max(axis=0)).all()
        assert (timed.peaks(order) <= limit).all()
        shares.append(np.abs(value / limit).max(axis=1))
    at_limit = np.max(shares, axis=0) > 0.9
    if jerk is None:  # the fastest law is at some limit nearly always
        assert at_limit.mean() > 0.85
        assert not answer.note
    else:
        assert "by the law 'smooth'" in answer.note
        speed = np.abs(motion.rates).max(axis=1)
        starts = np.flatnonzero(np.diff(speed > 1e-3 * speed.max(), prepend=0) > 0)
        assert len(starts) == 3
        assert all(leg.any() for leg in np.split(at_limit, starts)[1:])
    assert 0 < answer.lower_bound <= timed.period
    timed.write(tmp_path / "fast.csv")
    again = gg.timing.timed_gait_of(tmp_path / "fast.csv")
    np.testing.assert_allclose(again.at(t).alpha, motion.alpha, atol=1e-12)
    assert not gg.paced(gait, limits, period=0.99 * timed.period)
    slow = gg.paced(tmp_path / "fast.csv", limits, period=2 * timed.period)
    assert slow.timed is not None
    np.testing.assert_allclose(2 * slow.timed.peaks(1), timed.peaks(1))


@KINDS
def test_corners_are_rounded_along_the_sheet(
    vehicle: gg.Vehicle, tmp_path: Path
) -> None:
    corners = loop_in_region(vehicle)
    gait = gg.plan_loop(corners, vehicle=vehicle, sign="positive").gait
    size = min(math.dist(corners[0], corners[1]) / 20, 0.01)
    limits = gg.Limits(rate=[2, 1, 3, 2], acceleration=[9, 9, 6, 12])
    answer = gg.least_period(gait, limits, rounding=size)
    timed = answer.timed
    assert timed is not None
    assert answer.rounding is not None
    assert answer.at_rest is not None
    assert timed.period < answer.at_rest
    t = np.linspace(0, timed.period, 20_001)
    motion = timed.at(t)
    assert curved_sheet(vehicle).distances(motion.alpha).max() < 1e-5
    run_along = shapely.LineString(motion.alpha[::20, :2])
    off = shapely.hausdorff_distance(shapely.LinearRing(corners), run_along)
    assert off == pytest.approx(answer.rounding.deviation, rel=0.01)
    limited = limits.of_joints(4)
    assert (np.abs(motion.rates) <= limited[0]).all()
    assert (np.abs(motion.accelerations) <= limited[1]).all()
    steps = np.diff(motion.rates, axis=0) / (t[1] - t[0])
    assert np.abs(steps - motion.accelerations[:-1]).max() < 1.0
    report = timed.check()
    assert report.flyable
    assert report.hover_thrusts is not None
    shares = hover_thrust_shares(motion.alpha, vehicle)
    assert report.hover_thrusts[0] <= shares.min()
    assert report.hover_thrusts[1] >= shares.max()
    np.testing.assert_allclose(
        report.hover_thrusts, [shares.min(), shares.max()], atol=1e-3
    )
    timed.write(tmp_path / "rounded.csv")
    again = gg.timing.timed_gait_of(tmp_path / "rounded.csv")
    np.testing.assert_allclose(again.at(t).alpha, motion.alpha, atol=1e-12)
    beside = gg.Gait(alpha=np.array(SQUARE)[:, [0, 1, 0, 1]], vehicle=vehicle)
    with pytest.raises(gg.InputError, match="must have rows along its curved sheet"):
        gg.least_period(beside, limits, rounding=size)


def test_rows_beside_a_sheet_are_corners_with_rests_of_all_four_arms() -> None:
    plane = np.array(SQUARE)[:, [0, 1, 0, 1]] * [1, 1, 1, 2]
    limits = gg.Limits(rate=1.0, acceleration=5.0)
    answer = gg.least_period(gg.Gait(alpha=plane, vehicle=ODD), limits)
    assert answer.timed is not None
    np.testing.assert_allclose(answer.timed.peaks(1), [1, 0.5, 1, 1], rtol=0.01)
    assert answer.period == pytest.approx(2 * (0.3 + 0.2) + 2 * (0.6 + 0.2), rel=0.01)


def test_a_report_says_whether_rows_are_on_the_sheet() -> None:
    on_it = gg.lift(SQUARE, "red", vehicle=ODD)
    moved = np.add(on_it.alpha, [0, 0, 0.05, 0])
    for alpha, expected in ((on_it.alpha, False), (moved, True)):
        warnings_of = gg.validate(gg.Gait(alpha=alpha, vehicle=ODD)).warnings
        told = any("0.05 rad off the curved sheet" in text for text in warnings_of)
        assert told is expected


def test_axes_that_are_stated_make_no_warning_of_a_plane() -> None:
    places = [[0.2, 0, 0], [0, 0.2, 0], [-0.2, 0, 0], [0, -0.2, 0]]
    axes = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]
    vehicle = gg.Vehicle(
        name="turned",
        drag_to_thrust=0.018,
        rotor_positions=places,
        tilt_axes=axes,
    )
    plan = gg.plan_loop([(-0.35, 0.7), (-0.7, 1.0), (-1.0, 0.7)], vehicle=vehicle)
    assert plan.report.flyable
    assert plan.report.notes == ()


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [1, 1, 0]])
def test_one_tilt_axis_for_all_rotors_is_refused(axis: list[float]) -> None:
    places = [[0.2, 0.15, 0], [-0.2, 0.15, 0], [-0.2, -0.15, 0], [0.2, -0.12, 0.02]]
    vehicle = gg.Vehicle(
        name="parallel",
        drag_to_thrust=0.018,
        rotor_positions=places,
        tilt_axes=[axis] * 4,
    )
    with pytest.raises(gg.InputError, match="^vehicle must make every moment"):
        gg.plan_loop([(-0.35, 0.7), (-0.7, 1.0)], vehicle=vehicle)
