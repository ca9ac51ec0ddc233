"""Servos that differ: ranges, rates, lags and linkages of each arm, from the vehicle to plans, checks and flights."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.angles import angle_from_text
from gaitgraph.certificates import certify, check as certificate_check
from gaitgraph.flight.course import arm_response, servo_response as stepped_response
from gaitgraph.gait.table import Table
from gaitgraph.graph.edges import segments_fly
from gaitgraph.invertibility.geometry import Geometry
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.io.servo_map import clipped_rows, mapped_table, servo_map_from_mapping
from gaitgraph.surface import admissible_region
from gaitgraph.timing.limits import limits_of
from gaitgraph.timing.servo_lag import servo_response
from gaitgraph.timing.time_optimal import least_period
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.vehicle import PAPER, linked, vehicle_from_mapping, vehicle_named

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


def test_how_four_are_stated(tmp_path: Path) -> None:
    expected = [[-math.pi / 3, 0.9], [-0.9, math.radians(70)], [-1.3, 0.6], [-0.7, 1.1]]
    np.testing.assert_allclose(
        np.array(MINE.tilt_range), np.array(expected), rtol=1e-15
    )
    curved = MINE.replace(linkage=[CURVE, FALLING, CURVE, [[3, 1], [-3, -1]]])
    narrowed = [
        [-math.radians(50), 0.9],
        [-0.9, math.radians(70)],
        [-math.radians(50), 0.6],
        [-0.7, 1.0],
    ]
    np.testing.assert_allclose(
        np.array(curved.tilt_range), np.array(narrowed), rtol=1e-15
    )
    for one in (MINE, curved, PAPER.replace(linkage=CURVE)):
        stated = one.as_mapping()
        assert vehicle_from_mapping(json.loads(json.dumps(stated))) == one
        toml = "\n".join(
            f"{name} = {json.dumps(value)}" for name, value in stated.items()
        )
        (tmp_path / "mine.toml").write_text(toml)
        assert vehicle_named(tmp_path / "mine.toml") == one
        assert hash(one) == hash(vehicle_from_mapping(stated))
        named = [line for line in str(one).splitlines()[1:] if line[2] != " "]
    assert len(named) == len(stated) - 1  # all but the name
    # Four that are equal are one, to the last byte.
    for name, value in {
        "max_tilt": 1.2,
        "min_tilt": -0.3,
        "max_tilt_jerk": 9.0,
        "servo_lag": 0.1,
    }.items():
        more = {"max_tilt": 1.3} if name == "min_tilt" else {}
        assert repr(PAPER.replace(**more, **{name: [value] * 4})) == repr(
            PAPER.replace(**more, **{name: value})
        )
    assert repr(PAPER.replace(linkage=[CURVE] * 4)) == repr(
        PAPER.replace(linkage=CURVE[::-1])
    )
    assert (
        PAPER.replace(max_tilt=1.2, min_tilt=-1.2).tilt_range
        == PAPER.replace(max_tilt=1.2).tilt_range
    )
    np.testing.assert_array_equal(Geometry.of_vehicle(MINE).tilt_range, MINE.tilt_range)


BAD: list[tuple[dict[str, Any], str]] = [
    (
        {"max_tilt": [1, 1, 1]},
        "max_tilt must be one for all arms or four, one for each, got [1, 1, 1]",
    ),
    (
        {"servo_lag": []},
        "servo_lag must be one for all arms or four, one for each, got []",
    ),
    (
        {"max_tilt_rate": [1, 2, 3, "x"]},
        "max_tilt_rate must be a finite number in radians, or a text",
    ),
    (
        {"max_tilt_rate": [1, 2, 3, -4]},
        "max_tilt_rate must be a positive finite number (rad/s), got -4",
    ),
    (
        {"max_tilt": [1, 1, 1, -1]},
        "max_tilt must be a positive finite number (rad), got -1",
    ),
    (
        {"max_tilt": 1, "min_tilt": [-1, 60, 0, 0]},
        "min_tilt must be within ±π rad, got 60; for degrees write '60deg'",
    ),
    ({"min_tilt": -1}, "max_tilt must be stated (rad) beside min_tilt, got none"),
    (
        {"max_tilt": 1, "min_tilt": [0, 0, 1.5, 0]},
        "min_tilt must be below max_tilt, both within the linkage of the arm",
    ),
    (
        {"max_tilt": 1, "linkage": [[0, 1.1], [1, 2]]},
        "the linkage of the arm, got 1.1 to 1 rad for arm 1",
    ),
    (
        {"linkage": [[0, 0]]},
        "linkage must be two or more pairs of a servo and a tilt angle (rad), got [[0, 0]]",
    ),
    ({"linkage": 3}, "linkage must be two or more pairs"),
    ({"linkage": [[0, 0], [1, math.inf]]}, "linkage must be finite angles"),
    ({"linkage": {}}, "linkage must be finite numbers in radians"),
    ({"linkage": [[0, 0, 0], [1, 1, 1]]}, "linkage must be two or more pairs"),
    (
        {"linkage": [[0, 0], [1, 1], [2, 0.5]]},
        "linkage must be monotone: tilt angles that all rise, or all fall",
    ),
    ({"linkage": [[0, 0], [1, 1], [1, 2]]}, "linkage must be monotone"),
    ({"linkage": [[0], [1, 2]]}, "linkage must be finite numbers in radians"),
    ({"linkage": [[0, 0], [1, "one"]]}, "linkage must be finite numbers in radians"),
    (
        {"linkage": [CURVE] * 3},
        "linkage must be one for all arms or four, one for each, got [",
    ),
    ({"linkage": [CURVE, CURVE, CURVE, [[0, 0]]]}, "linkage must be two or more pairs"),
]


@pytest.mark.parametrize(("stated", "message"), BAD)
def test_what_is_refused_in_one_line(stated: dict[str, Any], message: str) -> None:
    with pytest.raises(gg.errors.InputError) as caught:
        PAPER.replace(**stated)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_ranges_without_hover_are_a_warning(run: Any) -> None:
    Path("lean.toml").write_text(
        'preset = "paper"\nmin_tilt = [-1.2, 0.2, -1.2, 0.1]\nmax_tilt = 1.2\n'
    )
    line = "arm 2 tilts from 11.46° to 68.75°, so hover (α = 0) is excluded"
    assert f"warning: {line}" in run("vehicles", "lean.toml").err
    lean = vehicle_named("lean.toml")
    report = gg.lift(CORNERS, "red", vehicle=lean).check()
    assert report.flyable
    assert (report.warnings[0], report.reachable_from_hover, len(report.warnings)) == (
        line,
        False,
        2,
    )
    assert (
        line
        in gg.validate(
            gg.lift(CORNERS, "red", vehicle=lean).alpha, vehicle=lean
        ).warnings
    )
    assert "arm 2" in str(
        gg.transition("hover", gg.lift(CORNERS, "red", vehicle=lean)).reason
    )
    assert not MINE.warnings


def test_the_region_is_where_single_points_pass_the_check() -> None:
    region = admissible_region(MINE)
    some = np.random.default_rng(3).uniform(-1.4, 1.4, (150, 2))
    alpha = np.hstack([some, some])
    allowed = segments_fly(alpha, alpha, 0.05, MINE)
    assert 0.1 < allowed.mean() < 0.5
    for point, flies in zip(some.tolist(), allowed.tolist(), strict=True):
        report = gg.lift([point], "red", vehicle=MINE).check()
        assert report.flyable == flies == (region.why_not(tuple(point)) is None)
        low, high = np.array(MINE.tilt_range).T
        assert report["tilt_range"].ok == bool(
            ((low <= [*point, *point]) & ([*point, *point] <= high)).all()
        )
    assert "tilt α2 = α4 must be within -40.1° and 63°, got 65.9°" in str(
        region.why_not((-0.5, 1.15))
    )
    none = PAPER.replace(min_tilt=[-1, -1, 0.5, -1], max_tilt=[0.4, 1, 1, 1])
    assert not admissible_region(none).components


def test_plans_obey_each_arm() -> None:
    plan = gg.plan_loop(CORNERS, vehicle=MINE, period=2.0)
    assert plan
    table = table_of(plan.timed())
    assert gg.validate(table).flyable
    for name, change, words in (
        (
            "tilt_range",
            {"min_tilt": [-0.75, -0.9, -1.3, -0.7]},
            "tilt -45.84° of arm 1 at corner 1",
        ),
        (
            "tilt_range",
            {"max_tilt": [0.9, 1.1, 0.6, 0.5]},
            "tilt 45.84° of arm 4 at corner 2",
        ),
        (
            "tilt_rate",
            {"max_tilt_rate": [9, 8, 0.5, 6.5]},
            "(α3), limit 0.5: this law needs a period of",
        ),
        (
            "tilt_acceleration",
            {"max_tilt_acceleration": [90, 80, 70, 0.5]},
            "(α4), limit 0.5: this law needs",
        ),
    ):
        less = MINE.replace(**change)
        report = replace(
            plan.timed(), gait=replace(plan.timed().gait, vehicle=less)
        ).check()
        assert [check.name for check in report.checks if not check.ok] == [name]
        assert words in report[name].message
        rows = (
            gg.validate(table.alpha, vehicle=less)
            if name == "tilt_range"
            else gg.validate(table, vehicle=less)
        )
        assert not rows[name].ok
        assert words.partition(" at ")[0].partition(",")[0] in rows[name].message
        if name == "tilt_range":
            assert not gg.plan_loop(CORNERS, vehicle=less)
    # The least period, and the transition's duration, are those of the slower of opposite servos.
    slower = PAPER.replace(
        max_tilt_rate=[7.0, 6.5, 9.0, 8.0],
        max_tilt_acceleration=[70.0, 65.0, 90.0, 80.0],
    )
    alike = PAPER.replace(
        max_tilt_rate=[7.0, 6.5, 7.0, 6.5],
        max_tilt_acceleration=[70.0, 65.0, 70.0, 65.0],
    )
    periods = [
        least_period(plan.gait, limits_of(one)).period for one in (MINE, slower, alike)
    ]
    assert periods == [periods[0]] * 3
    slow = MINE.replace(max_tilt_rate=[9.0, 8.0, 0.1, 6.5])
    entry = gg.transition("hover", replace(plan.gait, vehicle=slow))
    assert entry
    assert entry.timed.peak_rates[2] == pytest.approx(0.1, rel=0.01)
    moved = gg.retarget(gg.lift([(-1.1, 0.3), (-0.3, 1.3)], "red"), vehicle=MINE)
    assert moved.after is not None
    assert moved.after.flyable
    assert moved.table.alpha[:, 0].min() == pytest.approx(-math.pi / 3)  # type: ignore[union-attr]


def test_a_certificate_claims_the_limits_of_each_arm() -> None:
    loop = [(-0.8, 0.2), (-0.2, 0.6), (-0.6, 0.5)]
    tight = {
        "max_tilt_rate": [9.0, 8.0, 7.0, 6.0],
        "min_tilt": [-0.8, -0.9, -1.3, -0.7],
        "max_tilt": [0.9, 1.2, 0.6, 0.6],
    }
    text = certify(
        gg.lift(loop, "red", vehicle=PAPER.replace(**tight)).parametrize(2.0)
    ).text
    assert certificate_check.check(text)["proved"]
    claims = json.loads(text)["claims"]
    low, high = (
        [float(Fraction(one)) for one in claims["tilt"][end]]
        for end in ("at_least", "at_most")
    )
    assert low[0] == pytest.approx(-0.8, abs=1e-8)
    assert low[0] > low[2]  # arm 3 may go on, so its claim has room
    assert high[3] == pytest.approx(0.6, abs=1e-8)
    assert high[1] > high[3]


# -- Linkages

CURVED = PAPER.replace(linkage=[CURVE, FALLING, CURVE, CURVE])


def test_a_linkage_is_linear_between_its_points_in_both_directions() -> None:
    for linkage in CURVED.linkages:
        assert linkage is not None
        servo, tilt = np.array(sorted(linkage)).T
        wanted = np.linspace(servo[0], servo[-1], 301)
        found, slope = linked(linkage, wanted)
        np.testing.assert_allclose(found, np.interp(wanted, servo, tilt), atol=1e-15)
        back, inverse = linked(linkage, found, to_servo=True)
        np.testing.assert_allclose(back, wanted, atol=1e-14)
        inner = np.abs(wanted[:, None] - servo).min(axis=1) > 1e-9
        np.testing.assert_allclose((slope * inverse)[inner], 1.0, rtol=1e-12)
        np.testing.assert_allclose(
            slope[inner], np.gradient(found, wanted)[inner], rtol=0.7
        )


@pytest.mark.parametrize(
    "name", ["one.csv", "one.json", "one.npz", "one.mcap", "one.h"]
)
@pytest.mark.parametrize(
    "unit", [{}, {"unit": "deg"}, {"unit": "us", "us_per_rad": 300}]
)
def test_servo_angles_are_written_and_read_back(
    tmp_path: Path, name: str, unit: dict[str, Any]
) -> None:
    servos = servo_map_from_mapping(
        {"preset": "paper", "sign": -1, "zero": "5deg", **unit}
    )
    table = table_of(
        gg.lift(CORNERS, "red", vehicle=CURVED).parametrize(2.0, samples=50)
    )
    write_tables(table, [tmp_path / name], servos=servos)
    for k, (linkage, joint) in enumerate(
        zip(CURVED.linkages, servos.joints, strict=True)
    ):
        servo, tilt = np.array(sorted(linkage or (), key=lambda pair: pair[1])).T
        expected = joint.value_of(np.interp(table.alpha[:, k], tilt, servo))
        written = mapped_table(table, servos).columns[joint.column]
        half = 0.05 if "us_per_rad" in unit else 0.0  # pulses are rounded to 0.1 µs
        np.testing.assert_allclose(written, expected, rtol=1e-12, atol=half + 1e-12)
    if name == "one.h":
        text = (tmp_path / name).read_text()
        first = (
            (tmp_path / name)
            .read_text()
            .partition("_angle[50][4] = {")[2]
            .partition("},")[0]
        )
        radians = mapped_table(table, servos.in_radians()).columns
        found = [float(one.strip(" {\n}f")) for one in first.split(",")]
        np.testing.assert_allclose(
            found, [radians[f"alpha{k}"][0] for k in range(1, 5)], rtol=1e-6
        )
        assert "Between rows the angles change evenly" in text
        return
    again = read_table(tmp_path / name)
    assert again.rounding < 3e-4
    np.testing.assert_allclose(
        again.alpha, table.alpha, rtol=0, atol=again.rounding + 1e-12
    )
    assert (again.rounding > 0) == ("us_per_rad" in unit and name != "one.mcap")
    if not unit.get("us_per_rad"):
        for column in ("alpha2_rate", "alpha3_acceleration"):
            np.testing.assert_allclose(
                again[column], table[column], rtol=1e-9, atol=1e-9
            )
    report = gg.validate(tmp_path / name)
    assert report.flyable
    assert not report.warnings


def test_a_log_of_servo_angles_is_read_through_the_linkage_of_the_vehicle(
    tmp_path: Path,
) -> None:
    angles = {"tilt1": "60deg", "tilt2": "20deg", "tilt3": "-60deg", "tilt4": "-30deg"}
    row = ",".join(str(angle_from_text(one)) for one in angles.values())
    (tmp_path / "log.csv").write_text(f"{','.join(angles)}\n{row}\n{row}\n")
    vehicle = PAPER.replace(linkage=CURVE, first_arm_angle="45deg")
    joints = servo_map_from_mapping({"preset": "x_frame"})
    found = next(
        iter([export(tmp_path / "log.csv", [], vehicle=vehicle, joints=joints).table])
    )
    # Joints 1 to 4 turn rotors 4, 2, 1, 3.
    np.testing.assert_allclose(
        np.degrees(found.alpha[0]), [-50.0, 15.0, -25.0, 70.0], atol=1e-9
    )


def test_tilts_beyond_a_linkage_are_refused_or_clipped() -> None:
    table = Table(
        columns={f"alpha{k}": np.array([0.1, -1.2]) for k in range(1, 5)}, about={}
    )
    table = replace(table, about={"vehicle": PAPER.replace(linkage=CURVE).as_mapping()})
    with pytest.raises(
        gg.errors.InputError,
        match=r"row 2: joint 'alpha1' must be between -1.0472 and 1.0472 rad",
    ):
        mapped_table(table, servo_map_from_mapping({}))
    clips = servo_map_from_mapping({"clip": True})
    assert clipped_rows(table, clips) == {f"alpha{k}": 1 for k in range(1, 5)}
    assert mapped_table(table, clips).columns["alpha1"][1] == -math.pi / 3


# -- Flight


def test_servos_of_a_flight_lag_by_their_own_time() -> None:
    timed = gg.lift(CORNERS, "red", vehicle=MINE).parametrize(1.0)
    settled, step = servo_response(timed), 1e-4
    np.testing.assert_array_equal(settled.lag, OWN["servo_lag"])
    t = np.arange(30_000) * step
    command = timed.at(t).alpha
    actual = arm_response(command, MINE, step, lag=MINE.servo_lag or 0.0)
    last = slice(20_000, None)
    expected = np.column_stack(
        [np.interp(t[last] % 1.0, settled.t, one) for one in settled.error.T]
    )
    np.testing.assert_allclose((command - actual)[last], expected, atol=1e-5)
    assert np.ptp(settled.peak) > 0.02
    # A servo behind a linkage: its own angle lags, and its rate is that of the axis over the smallest slope.
    curved = arm_response(command, CURVED, step, lag=0.05, rate=(9.0, 1.0, 9.0, 0.5))
    for k, linkage in enumerate(CURVED.linkages):
        servo, tilt = np.array(sorted(linkage or (), key=lambda pair: pair[1])).T
        least = np.abs(np.diff(tilt) / np.diff(servo)).min()
        wanted = np.interp(command[:, k], tilt, servo)
        followed = stepped_response(
            wanted[:, None], step, lag=0.05, rate=(9.0, 1.0, 9.0, 0.5)[k] / least
        )[:, 0]
        order = np.argsort(servo)
        np.testing.assert_allclose(
            curved[:, k], np.interp(followed, servo[order], tilt[order]), atol=1e-9
        )
    straight = PAPER.replace(linkage=[[-2, -1.9], [2, 1.9]])
    np.testing.assert_allclose(
        arm_response(command, straight, step, lag=0.05, rate=0.8),
        arm_response(command, PAPER, step, lag=0.05, rate=0.8),
        atol=1e-12,
    )


def test_a_flight_uses_the_servos_of_the_vehicle() -> None:
    pytest.importorskip("mujoco")
    timed = gg.lift(CORNERS, "red", vehicle=MINE).parametrize(1.0)
    settings = gg.flight.FlightSettings(duration=1.5, arms="served")
    flight = gg.fly(timed, settings=settings)
    assert flight.settled
    rows = round(0.5 / (flight.column("t")[1] - flight.column("t")[0]))
    expected = servo_response(timed).actual
    late = slice(2 * rows, None)
    for k in range(4):
        wanted = np.interp(
            flight.column("t")[late] % 1.0, servo_response(timed).t, expected[:, k]
        )
        np.testing.assert_allclose(flight.alpha[late, k], wanted, atol=2e-3)
    refused = gg.fly(
        gg.lift(
            CORNERS, "red", vehicle=MINE.replace(max_tilt_rate=[9, 8, 7, 0.1])
        ).parametrize(1.0)
    )
    assert "(α4), limit 0.1" in str(refused.reason)
