"""Plans of vehicles that are not symmetric: regions, loops on their curved sheet, transitions, timing, files, flights."""

from __future__ import annotations

import math
import warnings
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.angles import text_from_angle, wrapped
from gaitgraph.gait.table import ANGLES
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.surface import curved_region
from gaitgraph.surface.curved import curved_sheet
from gaitgraph.surface.curved_region import sheet_region
from tests import samples
from tests.samples import loop_of

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.surface.sheets import Sign

ODD = samples.ODD.replace(inertia=[0.02, 0.02, 0.03])
KINDS = samples.by_vehicle(samples.LEANING, samples.STANDING)  # beside ODD
SQUARE = [(-0.3, 0.3), (-0.6, 0.3), (-0.6, 0.6), (-0.3, 0.6)]
PLANE = np.array(SQUARE)[:, [0, 1, 0, 1]]  # beside the curved sheet


def flies(plane: Any, vehicle: gg.Vehicle, sign: str, floor: float) -> np.ndarray:
    """Return whether points of the sheet fly, by the package's plain functions."""
    alpha = np.concatenate([plane, curved_sheet(vehicle).angles(*plane.T)], axis=1)
    shares = hover_thrust_shares(alpha, vehicle)
    holds = (shares > 0).all(axis=1)
    if vehicle.thrust_share is not None:
        holds &= (shares <= vehicle.thrust_share).all(axis=1)
    R = level_determinant(alpha, coefficients_of(vehicle, "exact"))
    holds &= (R > 0) == (sign == "positive")
    holds &= least_singular_value(alpha, vehicle) >= floor
    if vehicle.tilt_range is not None:
        low, high = np.array(vehicle.tilt_range).T
        holds &= ((alpha >= low) & (alpha <= high)).all(axis=1)
    return np.asarray(holds)


def planned(vehicle: gg.Vehicle, **options: Any) -> Any:
    """Return the plan of four points of the region with R > 0, which straight lines join inside it."""
    return gg.plan_loop(
        loop_in_region(vehicle), vehicle=vehicle, sign="positive", **options
    )


def off_sheet(alpha: Any, vehicle: gg.Vehicle) -> float:
    return float(curved_sheet(vehicle).distances(alpha).max())


def loop_in_region(vehicle: gg.Vehicle) -> list[tuple[float, float]]:
    """Return four points of the region with R > 0, which straight lines join inside it."""
    region = sheet_region(vehicle)
    middle = region.components[0].representative_point()
    x, y = middle.x, middle.y
    size = 0.6 * middle.distance(region.inner.boundary) / math.sqrt(2)
    flat = (x + 0.4 * size, y + 0.6 * size)
    return [(x, y), (x + size, y), (x + size, y + size), flat]


@pytest.mark.parametrize("sign", ["positive", "negative"])
@KINDS
def test_a_region_is_proven_inside_and_outside(vehicle: gg.Vehicle, sign: Sign) -> None:
    low = ["-50deg", "-70deg", "-40deg", "-80deg"]
    limited = vehicle.replace(min_tilt=low, max_tilt="60deg", mass=1.0, max_thrust=3.4)
    plane = np.random.default_rng(9).uniform(-math.pi / 2, math.pi / 2, (10_000, 2))
    for body, floor in ((vehicle, 0.05), (limited, 0.3)):
        region = sheet_region(body, sign=sign, floor=floor, accuracy=0.02)
        holds = flies(plane, body, sign, floor)
        outside = ~shapely.contains_xy(region.outer, *plane.T)
        assert not (shapely.contains_xy(region.inner, *plane.T) & ~holds).any()
        assert not (holds & outside).any()
        assert region.outer.area - region.inner.area < 1.2
        for point, flown in zip(plane[:200], holds, strict=False):
            assert (region.conditions[0].broken_at(*point) is None) == flown
        assert holds.any() or region.inner.is_empty


@KINDS
@pytest.mark.parametrize("reach", [0.1, 0.01])
def test_bounds_of_changes_on_squares_hold_and_are_near(
    vehicle: gg.Vehicle, reach: float
) -> None:
    body = vehicle.replace(mass=1.0, max_thrust=3.4)
    conditions = curved_region._Conditions(body, 0.05)
    sheet, random = conditions.sheet, np.random.default_rng(9)
    centers = random.uniform(-1.5, 1.5, (200, 2))
    angles = sheet.angles(*centers.T)
    turns = sheet.changes_within(centers[:, 0], centers[:, 1], reach)
    values, changes = conditions._forms_on(centers, reach)
    shares = np.zeros_like(values)
    for _ in range(60):
        places = centers + reach * random.uniform(-1.5, 1.5, (200, 2)).clip(-1, 1)
        turned = wrapped(sheet.angles(*places.T) - angles)
        assert (np.abs(turned) <= turns + 1e-9).all()
        moved = np.abs(conditions._forms_on(places, 0.0)[0] - values)
        shares = np.maximum(shares, moved / changes)
    shares = shares[:, np.abs(values[0]) > changes[0]]
    assert shares.max() <= 1.0
    assert (shares.max(axis=1) > 0.7).all()


@KINDS
@pytest.mark.parametrize("low", [-1.5, [-1.5, -1.5, -0.5, -1.5]])
def test_small_squares_are_decided_for_all_of_their_places(
    vehicle: gg.Vehicle, low: Any
) -> None:
    body = vehicle.replace(min_tilt=low, max_tilt=1.4)
    conditions = curved_region._Conditions(body, 1e-3)
    random = np.random.default_rng(9)
    for reach in (0.2, 0.01):
        centers = random.uniform(-1.5, 1.5, (4000, 2))
        holds, fails, _ = conditions.decided(centers, reach)
        places = centers + reach * random.uniform(-1.5, 1.5, (4000, 2)).clip(-1, 1)
        flown = [flies(places, body, sign, 1e-3) for sign in ("positive", "negative")]
        assert np.any(flown, axis=0)[holds].all()
        assert not np.any(flown, axis=0)[fails].any()
    assert (holds | fails).mean() > 1 - 6 * reach


def test_the_region_of_a_symmetric_vehicle_is_that_of_its_plane() -> None:
    region = sheet_region(gg.PAPER)
    plane = gg.admissible_region(gg.PAPER, coefficients="exact", sign="positive")
    assert region.inner.difference(plane.outer.buffer(1e-9)).area < 1e-9
    assert plane.inner.difference(region.outer.buffer(1e-9)).area < 1e-9


def test_hover_that_cannot_fly_reaches_nothing() -> None:
    plane = np.array([[1.0, 0.0]])
    told = curved_region.reached_from_hover(plane, samples.LEANING, 0.05)
    assert told[0] is None
    assert (
        "hover on the sheet cannot fly: R at level attitude must be > 0, got -5.0"
        in told[1]
    )


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
    chords = samples.along(alpha, 60)
    assert least_singular_value(chords, vehicle).min() >= 0.05
    assert hover_thrust_shares(chords, vehicle).min() > 0
    assert off_sheet(chords, vehicle) <= 1e-3
    assert flies(chords[:, :2], vehicle, "positive", 0.05).all()
    assert (loop_of(plan).lower_bound or 0.0) <= loop_of(plan).length + 1e-12
    # A keep-out in the middle of it is gone around.
    wall = shapely.LineString(points[:2]).interpolate(0.5, normalized=True).buffer(0.02)
    corners = [[*wall.exterior.coords[:-1]]]
    around = gg.plan_loop(points, vehicle=vehicle, sign="positive", keep_out=corners)
    line = shapely.LinearRing(around.gait.alpha[:, :2])
    assert not shapely.Polygon(corners[0]).buffer(-1e-9).intersects(line)
    assert around.gait.length > plan.gait.length


@pytest.mark.parametrize(
    ("points", "options", "told"),
    [
        ([(-0.3, 0.3), (0.6, -0.3)], {}, "waypoint 2 (0.6000, -0.3000) has R = -12"),
        ([(-0.3, 0.3), (0.1, 0.1)], {"sign": "positive"}, "must be positive, got -"),
        ([(-0.3, 0.3), (-0.5, 0.3)], {"color": "blue"}, "blue"),
        (SQUARE, {"method": "grid", "servo_margin": "30deg"}, "separated"),
    ],
)
def test_points_of_two_parts_and_outside_points_are_refused_with_numbers(
    points: Any, options: Any, told: str
) -> None:
    plan = gg.plan_loop(points, vehicle=ODD, **options)
    assert not plan
    assert told in str(plan.reason)


def test_a_point_beyond_a_fibre_is_refused() -> None:
    """Above (0, 0) it is within the accuracy of its region."""
    leaning = gg.Vehicle(
        drag_to_thrust=0.02,
        rotor_positions=[[0.2, 0.2, 0], [-0.18, 0.2, 0], [-0.2, -0.2, 0], [0.2, -0.18, 0]],
        tilt_axes=[[1, 1, 0.2], [-1, 1, 0], [-1, -1, 0.2], [1, -1, 0]],
        thrust_axes=[[0.1, 0, 1], [0, 0, 1], [-0.1, 0, 1], [0, 0, 1]],
    )  # fmt: skip
    idle = gg.plan_loop([(0.0, 0.0), *SQUARE], vehicle=leaning, sign="positive")
    assert "hover thrusts must be positive, got -" in str(idle.reason)


@pytest.mark.parametrize(
    ("name", "ask"),
    [
        ("objective", lambda: gg.plan_loop(SQUARE, vehicle=ODD, objective="robust")),
        ("require", lambda: gg.plan_loop(SQUARE, vehicle=ODD, require="valid")),
        ("servo_margin", lambda: gg.plan_loop(SQUARE, vehicle=ODD, servo_margin=0.1)),
        ("servo_margin", lambda: gg.location_of(SQUARE, vehicle=ODD, servo_margin=0.1)),
        ("accuracy", lambda: sheet_region(ODD, accuracy=1e-6)),
    ],
)
def test_what_no_curved_region_answers_is_refused(name: str, ask: Any) -> None:
    with pytest.raises(gg.InputError) as refused:
        ask()
    assert refused.value.field == name


@pytest.mark.parametrize(
    "options", [{}, {"objective": "robust"}, {"servo_margin": "13deg"}]
)
def test_loops_on_the_grid_follow_the_sheet(options: Any) -> None:
    plan = gg.plan_loop(SQUARE, vehicle=ODD, method="grid", **options)
    assert plan.report.flyable
    alpha = plan.gait.alpha
    for point in SQUARE:
        assert np.abs(alpha[:, :2] - point).max(axis=1).min() < 1e-12
    assert curved_sheet(ODD).distances_along(alpha, plan.gait.ends).max() < 1.1e-3
    if options:
        assert loop_of(plan).servo_margin.proven >= math.radians(12.9)
    shortest = gg.plan_loop(SQUARE, vehicle=ODD)
    assert loop_of(shortest).length <= plan.gait.length


@KINDS
def test_cycles_fly_along_the_sheet(vehicle: gg.Vehicle) -> None:
    graph = gg.surface_graph("positive", vehicle=vehicle, divisions=12)
    for first, second, edge in graph.edges(data=True):
        nodes = graph.nodes[first], graph.nodes[second]
        start, end = np.array([[node[name] for name in ANGLES] for node in nodes])
        between = np.linspace(start[:2], end[:2], 2000)
        others = curved_sheet(vehicle).angles(*between.T)
        passed = np.unwrap(others, axis=0, period=math.pi)
        off = np.abs(passed[-1] - passed[0] - (end - start)[2:]).max()
        assert edge["jump"] == pytest.approx(off, abs=1e-9)
    for cycle in islice(gg.cycles(graph, require="flyable"), 5):
        report = cycle.path.merged().check()
        assert cycle.flyable
        assert report.flyable
        least = report["least_singular_value"].value
        assert least == pytest.approx(cycle.least_singular_value, abs=1e-4)
        assert cycle.reachable_from_hover == bool(report.reachable_from_hover)
        assert str(cycle).count("(") in (3, 4)
        assert "({}, {})".format(*map(text_from_angle, cycle.path.alpha[0])) in str(
            cycle
        )


@KINDS
def test_a_gait_is_reachable_from_hover_where_a_flyable_path_is_proven(
    vehicle: gg.Vehicle,
) -> None:
    plan = planned(vehicle)
    path = gg.transition("hover", plan.gait)
    flies_in = bool(path) and path.report.flyable
    assert plan.report.reachable_from_hover == (flies_in or None)
    assert ("not decided" in plan.report.reachability) == (not flies_in)
    region = sheet_region(vehicle, sign="negative")
    if region.components:
        place = region.components[0].representative_point()
        posture = gg.lift([(place.x, place.y)], "red", vehicle=vehicle)
        assert posture.check().reachable_from_hover is False


@KINDS
def test_the_law_smooth_follows_the_sheet_and_rests_at_corners(
    vehicle: gg.Vehicle, tmp_path: Path
) -> None:
    timed = planned(vehicle, period=3.0).timed()
    t, step = np.linspace(0, 3, 4001), 3 / 4000
    motion = timed.at(t)
    assert off_sheet(motion.alpha, vehicle) < 1e-5
    slopes = np.diff(motion.alpha, axis=0) / step
    assert np.abs(slopes - (motion.rates[1:] + motion.rates[:-1]) / 2).max() < 1e-4
    at_rest = t[np.abs(motion.rates).max(axis=1) < 1e-3 * np.abs(motion.rates).max()]
    assert len(np.flatnonzero(np.diff(at_rest) > 0.1)) == 4
    for order, values in ((1, motion.rates), (2, motion.accelerations)):
        largest = np.abs(values).max(axis=0)
        peaks = timed.peaks(order)
        assert (peaks >= largest).all()
        assert (peaks <= 1.05 * largest + 1e-9).all()
    tight = vehicle.replace(max_tilt_acceleration=0.9 * timed.peaks(2).max())
    refused = gg.plan_loop(loop_in_region(vehicle), vehicle=tight, sign="positive")
    assert "this law needs a period of at least 3.1" in str(refused.reason)
    check_file(timed, tmp_path)


def check_file(timed: Any, folder: Path) -> None:
    """Check that a file of a timed gait is flyable and the same motion."""
    timed.write(folder / "gait.npz")
    assert gg.validate(folder / "gait.npz").flyable
    again = gg.timing.timed_gait_of(folder / "gait.npz")
    assert (type(again), again.law) == (type(timed), timed.law)
    t = np.linspace(0, timed.period, 997)
    np.testing.assert_allclose(again.at(t).alpha, timed.at(t).alpha, atol=1e-12)


def test_a_certificate_proves_rates_along_the_sheet(run: Any, tmp_path: Path) -> None:
    vehicle = ODD.replace(max_tilt_rate=2.0, max_tilt_acceleration=12.0)
    timed = gg.plan_loop(SQUARE, vehicle=vehicle, period=2.0).timed()
    certified = gg.certify(timed)
    assert {"rate", "acceleration"} <= certified.intervals.keys()
    certified.write(tmp_path / "proof.json")
    timed.write(tmp_path / "odd.csv")
    assert run("verify", "proof.json", "odd.csv").code == 0


def test_attitudes_are_acceptable_on_the_sheet_and_not_on_the_plane() -> None:
    on_sheet, on_plane = (
        gg.robustness_of(gait, curves=0).as_mapping()["acceptable_fraction"]
        for gait in (
            gg.lift(SQUARE, "red", vehicle=ODD),
            gg.Gait(alpha=PLANE, vehicle=ODD),
        )
    )
    assert on_sheet == pytest.approx(1.0, abs=1e-3)
    assert on_plane < 0.98


def test_a_table_of_few_rows_says_how_far_its_chords_leave_the_sheet(
    tmp_path: Path,
) -> None:
    plan = gg.plan_loop(SQUARE, vehicle=ODD)
    with pytest.warns(gg.errors.FileWarning, match="5 rows leave the curved sheet"):
        plan.timed(samples=4).write(tmp_path / "few.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plan.timed().write(tmp_path / "odd.csv")


@KINDS
def test_transitions_fly_along_the_sheet(vehicle: gg.Vehicle) -> None:
    body = vehicle.replace(max_tilt_rate=3.0, max_tilt_acceleration=20.0)
    points = loop_in_region(body)
    first, last = (
        gg.plan_loop([point], vehicle=body, sign="positive").timed()
        for point in points[::2]
    )
    answer = gg.transition(first, last)
    assert answer.report.flyable
    motion = answer.timed.at(np.linspace(0, answer.duration, 4001))
    np.testing.assert_array_equal(motion.alpha[0], first.alpha[0])
    np.testing.assert_array_equal(motion.alpha[-1], last.alpha[0])
    assert off_sheet(motion.alpha, vehicle) < 1e-4
    assert flies(motion.alpha[:, :2], vehicle, "positive", 0.05).all()
    assert np.abs(motion.rates).max() <= 3.0
    assert np.abs(motion.accelerations).max() <= 20.0
    assert np.abs(motion.rates[[0, -1]]).max() < 1e-9
    assert answer.length >= math.dist(points[0], points[2]) - 1e-12


def test_hover_is_entered_on_the_sheet(tmp_path: Path) -> None:
    gait = gg.plan_loop(SQUARE, vehicle=ODD, period=4.0).timed()
    entry = gg.transition("hover", gait.gait)
    assert not entry.path[0].any()
    assert entry.corners == (None, 0)
    flight = gg.mission(gait)
    assert off_sheet(flight.at(np.linspace(0, flight.period, 5001)).alpha, ODD) < 1e-4
    flight.write(tmp_path / "flight.csv")
    assert gg.validate(tmp_path / "flight.csv").flyable
    tilted = ODD.replace(tilt_axes=samples.LEANING.tilt_axes)
    at_rest = gg.transition("hover", "hover", vehicle=tilted).path[0]
    np.testing.assert_array_equal(at_rest[2:], curved_sheet(tilted).angles(0, 0))


def test_ends_that_cannot_be_joined_are_refused_with_the_reason() -> None:
    gait = gg.lift(SQUARE, "red", vehicle=ODD)
    other = gg.lift([(0.4, -0.3), (0.5, -0.4)], "red", vehicle=ODD)
    wall = gg.transition(gait, other)
    assert wall.proof is not None
    assert wall.proof["R_end"] < 0 < wall.proof["R_start"]
    beside = gg.Gait(alpha=PLANE, vehicle=ODD)
    for refused, told in (
        (gg.transition("hover", beside), "rad off the curved sheet"),
        (
            gg.transition("hover", "hover", vehicle=samples.LEANING),
            "the start is not flyable: hover thrusts",
        ),
        (
            gg.transition("hover", gait, floor=0.5),
            "the start is not flyable: least singular value",
        ),
    ):
        assert told in str(refused.reason)


def check_limits(timed: Any, limits: gg.Limits) -> Any:
    """Check that a motion is on its sheet and within its limits, and return the largest share of a limit at each time."""
    t = np.linspace(0, timed.period, 20_001)
    assert off_sheet(timed.at(t).alpha, timed.gait.vehicle) < 1e-5
    shares = []
    for order, limit in enumerate(limits.of_joints(4), start=1):
        values = np.abs(timed.derivative(t, order))
        assert (values <= limit).all()
        assert (timed.peaks(order) >= values.max(axis=0)).all()
        assert (timed.peaks(order) <= limit).all()
        shares.append((values / limit).max(axis=1))
    return np.max(shares, axis=0)


@pytest.mark.parametrize("jerk", [None, [300] * 4])
@KINDS
def test_least_periods_keep_limits_of_all_four_arms(
    vehicle: gg.Vehicle, jerk: Any, tmp_path: Path
) -> None:
    gait = planned(vehicle).gait
    limits = gg.Limits(rate=[2, 1, 3, 2], acceleration=[9, 9, 6, 12], jerk=jerk)
    answer = gg.least_period(gait, limits)
    timed: Any = answer.timed
    at_limit = check_limits(timed, limits) > 0.9
    if jerk is None:  # the fastest law is at some limit nearly always
        assert at_limit.mean() > 0.85
        assert not answer.note
    else:
        assert "by the law 'smooth'" in answer.note
        rates = timed.at(np.linspace(0, timed.period, 20_001)).rates
        speed = np.abs(rates).max(axis=1)
        starts = np.flatnonzero(np.diff(speed > 1e-3 * speed.max(), prepend=0) > 0)
        assert [leg.any() for leg in np.split(at_limit, starts)[1:]] == [True] * 4
    assert 0 < answer.lower_bound <= timed.period
    check_file(timed, tmp_path)
    assert not gg.paced(gait, limits, period=0.99 * timed.period)
    slow: Any = gg.paced(tmp_path / "gait.npz", limits, period=2 * timed.period).timed
    np.testing.assert_allclose(2 * slow.peaks(1), timed.peaks(1))


@KINDS
def test_corners_are_rounded_along_the_sheet(
    vehicle: gg.Vehicle, tmp_path: Path
) -> None:
    gait = planned(vehicle).gait
    corners = loop_in_region(vehicle)
    size = min(math.dist(corners[0], corners[1]) / 20, 0.01)
    limits = gg.Limits(rate=[2, 1, 3, 2], acceleration=[9, 9, 6, 12])
    answer: Any = gg.least_period(gait, limits, rounding=size)
    timed: Any = answer.timed
    assert timed.period < answer.at_rest
    check_limits(timed, limits)
    t = np.linspace(0, timed.period, 20_001)
    motion = timed.at(t)
    run_along = shapely.LineString(motion.alpha[::20, :2])
    off = shapely.hausdorff_distance(shapely.LinearRing(corners), run_along)
    assert off == pytest.approx(answer.rounding.deviation, rel=0.01)
    steps = np.diff(motion.rates, axis=0) / (t[1] - t[0])
    assert np.abs(steps - motion.accelerations[:-1]).max() < 1.0
    report = timed.check()
    assert report.flyable
    shares = hover_thrust_shares(motion.alpha, vehicle)
    least, most = report.hover_thrusts
    assert shares.min() - 1e-3 <= least <= shares.min()
    assert shares.max() <= most <= shares.max() + 1e-3
    check_file(timed, tmp_path)
    with pytest.raises(gg.InputError, match="must have rows along its curved sheet"):
        gg.least_period(gg.Gait(alpha=PLANE, vehicle=vehicle), limits, rounding=size)


def test_rows_beside_a_sheet_are_corners_with_rests_of_all_four_arms() -> None:
    limits = gg.Limits(rate=1.0, acceleration=5.0)
    beside = gg.Gait(alpha=PLANE * [1, 1, 1, 2], vehicle=ODD)
    answer: Any = gg.least_period(beside, limits)
    np.testing.assert_allclose(answer.timed.peaks(1), [1, 0.5, 1, 1], rtol=0.01)
    assert answer.period == pytest.approx(2 * (0.3 + 0.2) + 2 * (0.6 + 0.2), rel=0.01)


def test_a_report_says_whether_rows_are_on_the_sheet() -> None:
    on_it = gg.lift(SQUARE, "red", vehicle=ODD).alpha
    for off in (0.0, 0.05):
        moved = gg.Gait(alpha=on_it + np.array([0, 0, off, 0]), vehicle=ODD)
        told = str(gg.validate(moved).warnings)
        assert ("0.05 rad off the curved sheet" in told) is bool(off)


@pytest.mark.parametrize("axis", [[1, 0, 0], [1, 1, 0]])
def test_one_tilt_axis_for_all_rotors_is_refused(axis: list[float]) -> None:
    vehicle = ODD.replace(tilt_axes=[axis] * 4)
    with pytest.raises(gg.InputError, match="^vehicle must make every moment"):
        gg.plan_loop([(-0.35, 0.7), (-0.7, 1.0)], vehicle=vehicle)
