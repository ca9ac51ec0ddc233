"""Servos that differ: ranges, rates, lags and linkages of each arm, from the vehicle to plans, checks and flights."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.angles import angle_from_text
from gaitgraph.flight.course import arm_response, servo_response as stepped_response
from gaitgraph.gait.table import ANGLES, Table
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.invertibility.segment_bounds import segments_fly
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.servo_map import clipped_table, mapped_table, servo_map_from_mapping
from gaitgraph.surface import admissible_region
from gaitgraph.timing.servo_lag import servo_response
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.vehicle import PAPER, vehicle_from_mapping, vehicle_named
from tests.samples import cases

if TYPE_CHECKING:
    from pathlib import Path

OWN: dict[str, Any] = {
    "min_tilt": ["-60deg", -0.9, -1.3, -0.7],
    "max_tilt": [0.9, "70deg", 0.6, 1.1],
    "max_tilt_rate": [9.0, 8.0, 7.0, 6.5],
    "max_tilt_acceleration": [90.0, 80.0, 70.0, 65.0],
    "servo_lag": [0.01, 0.02, 0.03, 0.04],
}
MINE = PAPER.replace(name="mine", **OWN)
CORNERS = [(-0.8, 0.2), (-0.2, 0.8), (-0.6, 0.5)]
CURVE = [["-60deg", "-50deg"], [0, 0], ["20deg", "15deg"], ["60deg", "70deg"]]
FALLING = [(servo, -tilt) for servo, tilt in ((-1.5, -1.3), (-0.2, 0.1), (1.2, 1.0))]
CURVED = PAPER.replace(linkage=[CURVE, FALLING, CURVE, CURVE])


# -- Stated


def test_ranges_of_each_arm_end_where_its_linkage_does() -> None:
    degrees = [[-60, math.degrees(0.9)], [math.degrees(-0.9), 70]]
    expected = [*np.radians(degrees).tolist(), [-1.3, 0.6], [-0.7, 1.1]]
    np.testing.assert_allclose(np.array(MINE.tilt_range), expected, rtol=1e-15)
    np.testing.assert_array_equal(Geometry.of_vehicle(MINE).tilt_range, MINE.tilt_range)
    curved = MINE.replace(linkage=[CURVE, FALLING, CURVE, [[3, 1], [-3, -1]]])
    expected[0][0] = expected[2][0] = math.radians(-50)
    expected[3][1] = 1.0
    np.testing.assert_allclose(np.array(curved.tilt_range), expected, rtol=1e-15)
    for vehicle in (MINE, curved, PAPER.replace(linkage=CURVE)):
        assert vehicle_from_mapping(vehicle.as_mapping()) == vehicle
    symmetric = PAPER.replace(max_tilt=1.2, min_tilt=-1.2)
    assert symmetric.tilt_range == PAPER.replace(max_tilt=1.2).tilt_range


@pytest.mark.parametrize(
    "stated",
    [{"max_tilt": 1.2}, {"max_tilt_jerk": 9.0}, {"servo_lag": 0.1}, {"linkage": CURVE}],
)
def test_four_that_are_equal_are_one(stated: dict[str, Any]) -> None:
    four = {name: [value] * 4 for name, value in stated.items()}
    assert repr(PAPER.replace(**four)) == repr(PAPER.replace(**stated))


@pytest.mark.parametrize(
    ("stated", "message"),
    cases("""
max_tilt=[1, 1, 1] | max_tilt must be one for all arms or four
servo_lag=[] | servo_lag must be one for all arms or four
max_tilt_rate=[1, 2, 3, "x"] | max_tilt_rate must be a finite number
max_tilt_rate=[1, 2, 3, -4] | max_tilt_rate must be a positive finite
max_tilt=[1, 1, 1, -1] | max_tilt must be a positive finite number
max_tilt=1, min_tilt=[-1, 60, 0, 0] | min_tilt must be within ±π rad
min_tilt=-1 | max_tilt must be stated
max_tilt=1, min_tilt=[0, 0, 1.5, 0] | min_tilt must be below max_tilt
max_tilt=1, linkage=[[0, 1.1], [1, 2]] | got 1.1 to 1 rad for arm 1
linkage=[[0, 0]] | linkage must be two or more pairs
linkage=3 | linkage must be two or more pairs
linkage=[[0, 0, 0], [1, 1, 1]] | linkage must be two or more pairs
linkage=[CURVE, CURVE, CURVE, [[0, 0]]] | linkage must be two or more pairs
linkage=[[0, 0], [1, math.inf]] | linkage must be finite angles
linkage={} | linkage must be finite numbers
linkage=[[0], [1, 2]] | linkage must be finite numbers
linkage=[[0, 0], [1, "one"]] | linkage must be finite numbers
linkage=[[0, 0], [1, 1], [2, 0.5]] | linkage must be monotone
linkage=[[0, 0], [1, 1], [1, 2]] | linkage must be monotone
linkage=[CURVE] * 3 | linkage must be one for all arms or four
"""),
)
def test_what_is_refused_in_one_line(stated: str, message: str) -> None:
    with pytest.raises(gg.errors.InputError) as caught:
        PAPER.replace(**eval(f"dict({stated})"))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_ranges_without_hover_are_a_warning(run: Any, tmp_path: Path) -> None:
    limits = "min_tilt = [-1.2, 0.2, -1.2, 0.1]\nmax_tilt = 1.2\n"
    (tmp_path / "lean.toml").write_text('preset = "paper"\n' + limits)
    line = "arm 2 tilts from 11.46° to 68.75°, so hover (α = 0) is excluded"
    assert f"warning: {line}" in run("vehicles", "lean.toml").err
    gait = gg.lift(CORNERS, "red", vehicle=vehicle_named(tmp_path / "lean.toml"))
    report = gait.check()
    assert (report.flyable, report.reachable_from_hover) == (True, False)
    assert (report.warnings[0], len(report.warnings)) == (line, 2)
    assert line in gg.validate(gait.alpha, vehicle=gait.vehicle).warnings
    assert "arm 2" in str(gg.transition("hover", gait).reason)
    assert not MINE.warnings


# -- Planned and judged


def test_the_region_is_where_single_points_pass_the_check() -> None:
    region = admissible_region(MINE)
    points = np.random.default_rng(3).uniform(-1.4, 1.4, (60, 2))
    alpha = np.hstack([points, points])
    low, high = np.array(MINE.tilt_range).T
    in_range = ((low <= alpha) & (alpha <= high)).all(axis=1)
    allowed = segments_fly(alpha, alpha, 0.05, MINE)
    assert 0.1 < allowed.mean() < 0.5
    for point, flies, fits in zip(points.tolist(), allowed, in_range, strict=True):
        report = gg.lift([point], "red", vehicle=MINE).check()
        assert report.flyable == flies == (region.why_not(tuple(point)) is None)
        assert report["tilt_range"].ok == fits
    reason = str(region.why_not((-0.5, 1.15)))
    assert "tilt α2 = α4 must be within -40.1° and 63°, got 65.9°" in reason
    none = PAPER.replace(min_tilt=[-1, -1, 0.5, -1], max_tilt=[0.4, 1, 1, 1])
    assert not admissible_region(none).components


@pytest.mark.parametrize(
    ("name", "change", "words"),
    cases("""
tilt_range | min_tilt=[-0.75, -0.9, -1.3, -0.7] | tilt -45.84° of arm 1
tilt_range | max_tilt=[0.9, 1.1, 0.6, 0.5] | tilt 45.84° of arm 4
tilt_rate | max_tilt_rate=[9, 8, 0.5, 6.5] | (α3), limit 0.5
tilt_acceleration | max_tilt_acceleration=[90, 80, 70, 0.5] | (α4), limit
"""),
)
def test_a_limit_of_one_arm_is_judged_by_itself(
    name: str, change: str, words: str
) -> None:
    timed = gg.plan_loop(CORNERS, vehicle=MINE, period=2.0).timed()
    assert gg.validate(table_of(timed)).flyable
    less = MINE.replace(**eval(f"dict({change})"))
    of_gait = replace(timed, gait=replace(timed.gait, vehicle=less)).check()
    for report in (of_gait, gg.validate(table_of(timed), vehicle=less)):
        assert [check.name for check in report.checks if not check.ok] == [name]
        assert words in report[name].message
    assert not gg.plan_loop(CORNERS, vehicle=less, period=2.0)


# -- Linkages


def points_of(linkage: Any) -> Any:
    """Return the servo and the tilt angles of a linkage, the tilt angles increasing."""
    return np.array(sorted(linkage or (), key=lambda pair: pair[1])).T


@pytest.mark.parametrize("name", ["one.csv", "one.npz", "one.mcap"])
@pytest.mark.parametrize(
    "unit", [{}, {"unit": "deg"}, {"unit": "us", "us_per_rad": 300}]
)
def test_servo_angles_are_written_and_read_back(
    tmp_path: Path, name: str, unit: dict[str, Any]
) -> None:
    stated = {"preset": "paper", "sign": -1, "zero": "5deg", **unit}
    servos = servo_map_from_mapping(stated)
    gait = gg.lift(CORNERS, "red", vehicle=CURVED)
    table = table_of(gait.parametrize(2.0, samples=50))
    write_tables(table, [tmp_path / name], servos=servos)
    half = 0.05 if "us_per_rad" in unit else 0.0  # pulses are rounded to 0.1 µs
    written = mapped_table(table, servos).columns
    joints = zip(CURVED.linkages, servos.joints, table.alpha.T, strict=True)
    for linkage, joint, alpha in joints:
        servo, tilt = points_of(linkage)
        expected = joint.value_of(np.interp(alpha, tilt, servo))
        assert written[joint.column] == pytest.approx(expected, abs=half + 1e-12)
    again = read_table(tmp_path / name)
    off = np.abs(again.alpha - table.alpha).max()
    assert off <= again.rounding + 1e-12 < 3e-4
    assert (again.rounding > 0) == (half > 0 and name != "one.mcap")
    if not half:
        rates = "alpha2_rate"
        np.testing.assert_allclose(again[rates], table[rates], rtol=1e-9, atol=1e-9)
    report = gg.validate(tmp_path / name)
    assert report.flyable
    assert not report.warnings


def test_a_c_header_holds_servo_angles(tmp_path: Path) -> None:
    servos = servo_map_from_mapping({"preset": "paper", "sign": -1, "zero": "5deg"})
    gait = gg.lift(CORNERS, "red", vehicle=CURVED)
    table = table_of(gait.parametrize(2.0, samples=50))
    write_tables(table, [tmp_path / "one.h"], servos=servos)
    text = (tmp_path / "one.h").read_text()
    first = text.partition("_angle[50][4] = {")[2].partition("},")[0]
    angles = [float(number.strip(" {\n}f")) for number in first.split(",")]
    radians = mapped_table(table, servos.in_radians()).columns
    expected = [radians[name][0] for name in ANGLES]
    np.testing.assert_allclose(angles, expected, rtol=1e-6)


def test_a_log_of_servo_angles_is_read_through_the_linkage_of_the_vehicle(
    tmp_path: Path,
) -> None:
    """Joints 1 to 4 of an X frame turn rotors 4, 2, 1, 3."""
    row = ",".join(
        str(angle_from_text(x)) for x in ("60deg", "20deg", "-60deg", "-30deg")
    )
    log = tmp_path / "log.csv"
    log.write_text(f"tilt1,tilt2,tilt3,tilt4\n{row}\n{row}\n")
    vehicle = PAPER.replace(linkage=CURVE, first_arm_angle="45deg")
    joints = servo_map_from_mapping({"preset": "x_frame"})
    table = export(log, [], vehicle=vehicle, joints=joints).table
    degrees = np.degrees(table.alpha[0])
    np.testing.assert_allclose(degrees, [-50.0, 15.0, -25.0, 70.0], atol=1e-9)


def test_tilts_beyond_a_linkage_are_refused_or_clipped() -> None:
    about = {"vehicle": PAPER.replace(linkage=CURVE).as_mapping()}
    columns = {name: np.array([0.1, -1.2]) for name in ANGLES}
    table = Table(columns=columns, about=about)
    message = r"row 2: joint 'alpha1' must be between -1.0472 and 1.0472 rad"
    with pytest.raises(gg.errors.InputError, match=message):
        mapped_table(table, servo_map_from_mapping({}))
    clips = servo_map_from_mapping({"clip": True})
    assert clipped_table(table, clips)[1] == dict.fromkeys(ANGLES, 1)
    assert mapped_table(table, clips).columns["alpha1"][1] == -math.pi / 3


# -- Flight


def test_a_servo_behind_a_linkage_lags_by_its_own_angle() -> None:
    """Its rate is that of the axis over the smallest slope."""
    timed = gg.lift(CORNERS, "red", vehicle=MINE).parametrize(1.0)
    command = timed.at(np.arange(20_000) * 1e-4).alpha
    rates = (9.0, 1.0, 9.0, 0.5)
    curved = arm_response(command, CURVED, 1e-4, lag=0.05, rate=rates)
    for k, linkage in enumerate(CURVED.linkages):
        servo, tilt = points_of(linkage)
        rate = rates[k] / np.abs(np.diff(tilt) / np.diff(servo)).min()
        wanted = np.interp(command[:, [k]], tilt, servo)
        followed = stepped_response(wanted, 1e-4, lag=0.05, rate=rate)[:, 0]
        order = np.argsort(servo)
        expected = np.interp(followed, servo[order], tilt[order])
        np.testing.assert_allclose(curved[:, k], expected, atol=1e-9)


def test_a_flight_uses_the_servos_of_the_vehicle() -> None:
    pytest.importorskip("mujoco")
    timed = gg.lift(CORNERS, "red", vehicle=MINE).parametrize(1.0)
    settings = gg.flight.FlightSettings(duration=1.5, arms="served")
    flight, response = gg.fly(timed, settings=settings), servo_response(timed)
    assert flight.settled
    t = flight.column("t")
    late = t > 1.0
    for k, actual in enumerate(response.actual.T):
        wanted = np.interp(t[late] % 1.0, response.t, actual)
        np.testing.assert_allclose(flight.alpha[late, k], wanted, atol=2e-3)
    slow = MINE.replace(max_tilt_rate=[9, 8, 7, 0.1])
    refused = gg.fly(gg.lift(CORNERS, "red", vehicle=slow).parametrize(1.0))
    assert "(α4), limit 0.1" in str(refused.reason)
