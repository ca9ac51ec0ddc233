"""Flights: repeatable, within limits, with the right outcome and record; courses and the checks before take-off."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
from gaitgraph.flight.course import from_hover, repeated
from gaitgraph.flight.flight import (
    COLUMNS,
    Flight,
    FlightSettings,
    settings_from_mapping,
)
from gaitgraph.flight.simulation import (
    Simulation,
    fly,
    gusts_of,
    gyroscopic_of,
    sensor_noise,
)
from gaitgraph.gait.gait import lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    control_moment_matrix,
    least_singular_value,
    thrust_signs,
)
from gaitgraph.timing.joining import Course, run_up
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from gaitgraph.validation.report import broken_rules
from gaitgraph.vehicle import PAPER, Vehicle
from tests.published import GAITS
from tests.samples import ASCENDING, BEETLE, HOVER, RED, flown_by, gait_of_paper

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.timing.laws import LawName
    from gaitgraph.timing.timed_gait import TimedGait

pytest.importorskip("mujoco")

ROUGH: dict[str, Any] = {
    "attitude_noise": 0.003, "rate_noise": 0.02, "position_noise": 0.01, "velocity_noise": 0.02,
    "wind": (2.0, -1.0, 0.5), "gust": 0.5, "servo_lag": 0.02, "servo_rate": 2.0,
}  # fmt: skip


def short(**changes: Any) -> FlightSettings:
    return FlightSettings(**{"duration": 0.3, **changes})


class TestDisturbances:
    def test_a_simulation_keeps_nothing_of_the_flights_before(self) -> None:
        simulation = Simulation(repeated(RED), short(**ROUGH))
        first = simulation.run((0.3, -0.2))
        other = Simulation(repeated(RED), short(seed=1, **ROUGH)).run((0.3, -0.2))
        assert not np.array_equal(first.rows, other.rows)
        simulation.run((-0.4, 0.1))
        np.testing.assert_array_equal(simulation.run((0.3, -0.2)).rows, first.rows)

    def test_noise_and_gusts_have_their_stated_sizes(self) -> None:
        noise = np.array(
            sensor_noise(short(attitude_noise=0.1, velocity_noise=2.0), 4000)
        )
        np.testing.assert_allclose(
            noise.std(axis=0), [0] * 3 + [0.1] * 3 + [2.0] * 3 + [0] * 3, rtol=0.05
        )
        gusts = gusts_of(short(wind=(5.0, 0.0, -1.0), gust=0.7, duration=400), 400_000)
        assert gusts is not None
        np.testing.assert_allclose(gusts.mean(axis=0), [5, 0, -1], atol=0.15)
        np.testing.assert_allclose(gusts.std(axis=0), 0.7, rtol=0.15)
        off = gusts[:, 0] - gusts[:, 0].mean()
        assert np.mean(off[1000:] * off[:-1000]) / off.var() == pytest.approx(
            math.exp(-1), abs=0.12
        )
        assert gusts_of(short(), 10) is None
        assert sensor_noise(short(), 10) is None

    @pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
    def test_spinning_rotors_have_a_gyroscopic_torque(self, spin: Any) -> None:
        """−ω × h of each arm, with h of the rotor along its tilted axis."""
        inertia, coefficient = 3e-5, PAPER.thrust_coefficient or 0.0
        vehicle = PAPER.replace(
            rotor_inertia=inertia, first_rotor_spin=spin, first_arm_angle=0.3
        )
        rng, torque_of = np.random.default_rng(9), gyroscopic_of(vehicle)
        assert torque_of is not None
        alpha, rates, omega, thrusts = (rng.normal(size=size) for size in (4, 4, 3, 4))
        torque = torque_of(
            alpha.tolist(), omega.tolist(), rates.tolist(), thrusts.tolist()
        )
        total = np.zeros(3)
        senses = np.array([-1, 1, -1, 1]) * (1 if spin == "clockwise" else -1)
        for k, arm in enumerate(vehicle.arm_angles):
            out = np.array([math.cos(arm), math.sin(arm), 0.0])
            axis = math.cos(alpha[k]) * np.array([0, 0, 1.0]) + math.sin(
                alpha[k]
            ) * np.cross(out, [0, 0, 1.0])
            speed = (
                senses[k]
                * np.sign(thrusts[k])
                * math.sqrt(abs(thrusts[k]) / coefficient)
            )
            total -= np.cross(omega + rates[k] * out, inertia * speed * axis)
        np.testing.assert_allclose(torque, total, rtol=1e-12, atol=1e-12)
        turned = fly(flown_by(RED, vehicle), settings=short(), anyway=True)
        plain = fly(
            flown_by(RED, vehicle.replace(rotor_inertia=None)),
            settings=short(),
            anyway=True,
        )
        assert 1e-6 < np.abs(turned.column("roll") - plain.column("roll")).max() < 0.05


@pytest.mark.parametrize("reports", [False, True])
@pytest.mark.parametrize("arms", [None, "served", "planned"])
def test_the_controller_knows_the_angles_of_servos_that_report_them(
    reports: bool, arms: Any
) -> None:
    vehicle = PAPER.replace(servo_lag=0.03, servo_feedback=reports)
    knows = reports if arms is None else arms == "served"
    timed = flown_by(RED, vehicle)
    flight = fly(timed, settings=short(duration=1.0, arms=arms), attitude=(0.0, 0.0))
    assert bool(np.abs(flight.column("yaw")).max() < 1e-3) == knows
    assert flight.as_mapping()["arms"] == ("served" if knows else "planned")
    assert flight.table.about["flight"]["arms"] == flight.as_mapping()["arms"]
    said = "knows those that the servos reach" if knows else "assumes the planned ones"
    assert f"  tilt angles           the controller {said}" in str(flight)


def test_errors_of_servos_are_known_to_nobody_and_lose_what_has_no_margin() -> None:
    size = math.radians(12)
    settings = FlightSettings(
        reference="hover", servo_errors=(-size, -size, -size, -size)
    )
    upright, leaning = (
        fly(
            lift([corner], "red").parametrize(1.0),
            settings=settings,
            attitude=(0.1, -0.1),
        )
        for corner in ((0.0, 0.0), (-0.6, 0.6))
    )
    np.testing.assert_allclose(upright.alpha, -size, atol=0.02)
    assert abs(upright.column("x")[-1]) + abs(upright.column("y")[-1]) > 5.0
    assert "yaw" in leaning.reason  # it holds its place; the controller has no integral
    assert abs(leaning.column("x")[-1]) < 0.05
    again = settings_from_mapping(settings.as_mapping())
    assert again == settings
    stated = settings_from_mapping({"servo_errors": ["-12deg", 0, "1deg", 0.1]})
    assert stated.servo_errors[0] == -size
    for wrong in ((0.1, 0.1), (2.0, 0.0, 0.0, 0.0), 0.1):
        with pytest.raises(InputError, match="servo_errors must be four angles"):
            FlightSettings(servo_errors=wrong)  # type: ignore[arg-type]


def test_a_controller_that_assumes_the_plan_errs_by_the_lag() -> None:
    lagging = {
        arms: Simulation(
            repeated(RED), short(servo_lag=0.0125, duration=1.5, arms=arms)
        )
        for arms in ("served", "planned")
    }
    flights = {arms: simulation.run((0.0, 0.0)) for arms, simulation in lagging.items()}
    assert flights["served"].settled
    np.testing.assert_array_equal(lagging["served"].actual, lagging["planned"].actual)
    # Held still, the yaw that the spring kp allows is the torque by which the plan's thrusts miss, over kp·Iz.
    planned = flights["planned"]
    inputs = (
        thrust_signs(PAPER)
        * planned.thrusts
        / PAPER.require("thrust_coefficient", purpose="inputs")[0]
    )
    missed = (control_moment_matrix(planned.alpha) @ inputs[..., None])[:, 2, 0]
    yaw = np.abs(missed).max() / (100.0 * PAPER.inertia[2])  # type: ignore[index]
    assert 0.02 < np.abs(planned.column("yaw")).max() < 2.0 * yaw
    assert not planned.settled
    assert "yaw" in planned.reason
    everywhere = least_singular_value(
        planned.alpha, PAPER, planned.column("roll"), planned.column("pitch")
    )
    assert planned.least_singular_value == pytest.approx(everywhere.min(), rel=1e-12)


class TestThrusts:
    def test_limits_are_kept_and_counted(self) -> None:
        weight = (PAPER.mass or 0.0) * PAPER.gravity
        flight = fly(
            RED, settings=short(thrust_limit=0.6 * weight, duration=0.5), anyway=True
        )
        assert flight.thrusts.min() >= 0.0
        assert flight.peak_thrust == pytest.approx(0.6 * weight)
        at_limit = (flight.thrusts <= 0.0) | (flight.thrusts >= 0.6 * weight)
        np.testing.assert_array_equal(
            flight.column("saturated") == 1, at_limit.any(axis=1)
        )
        assert flight.saturated_fraction == pytest.approx(at_limit.any(axis=1).mean())
        assert 0 < at_limit.any(axis=1).mean() < 1

    def test_the_limit_of_the_settings_counts_before_the_vehicles(self) -> None:
        strong = flown_by(RED, PAPER.replace(max_thrust=2.0))
        assert fly(strong, anyway=True, settings=short()).peak_thrust == 2.0
        assert (
            fly(strong, anyway=True, settings=short(thrust_limit=1.9)).peak_thrust
            == 1.9
        )
        free = fly(
            RED,
            settings=short(
                saturation=False, attitude_stiffness=2500.0, attitude_damping=100.0
            ),
        )
        assert (free.thrusts.min() < 0, free.saturated_fraction) == (True, 0)

    def test_they_change_at_the_control_rate_and_energy_counts_each(self) -> None:
        flight = fly(RED, settings=short(control_rate=100.0))
        np.testing.assert_allclose(np.diff(flight.column("t")), 0.01)
        assert len(flight.rows) == 31
        speed = np.sqrt(flight.thrusts / (PAPER.thrust_coefficient or 1.0))
        power = (PAPER.drag_coefficient or 0.0) * (speed**3).sum(axis=1)
        assert flight.energy == pytest.approx(0.01 * power[:-1].sum(), rel=1e-12)
        assert (
            fly(
                flown_by(HOVER, PAPER.replace(thrust_coefficient=None)),
                settings=short(),
            ).energy
            is None
        )


class TestOutcomes:
    """Each way to stop has an outcome and one line that states the reason."""

    @staticmethod
    def check(flight: Flight, outcome: str, reason: str) -> None:
        assert (flight.outcome, flight.settled, flight.failed) == (outcome, False, True)
        assert reason in flight.reason
        assert "\n" not in flight.reason
        assert flight.settling_time is None
        assert np.isfinite(flight.rows).all()

    def test_near_a_singularity(self) -> None:
        timed = flown_by(RED, PAPER.replace(drag_ratio=1.0))
        for floor in (0.01, 0.3):
            flight = fly(timed, settings=short(duration=1.0, floor=floor), anyway=True)
            self.check(flight, "near singular", f"and the floor is {floor:g}")
            # The last row is still allowed, and the next one, a millisecond later, was not.
            assert floor <= flight.column("nearness").min() < floor + 0.01

    @pytest.mark.parametrize(
        ("timed", "changes", "outcome", "reason"),
        [
            # Sensors that err by a radian have the vertical on the other side of the singular plane.
            (
                RED,
                {"attitude_noise": 1.0, "floor": 0.0},
                "sign change",
                "its determinant has changed sign",
            ),
            (
                flown_by(RED, PAPER.replace(rotor_inertia=1e-2)),
                {},
                "tumbling",
                "turns by more than 200 rad/s",
            ),
            (
                flown_by(HOVER, PAPER.replace(gravity=1e7)),
                {"thrust_limit": 1.0},
                "tumbling",
                "more than 100000 m from",
            ),
            (
                HOVER,
                {"attitude": (0.0, math.pi / 2 - 1e-4)},
                "upended",
                "nose points straight up or down at 0.000 s",
            ),
            (
                flown_by(HOVER, PAPER.replace(gravity=1e12)),
                {"thrust_limit": 1.0},
                "tumbling",
                "exceed the range of the physics engine",
            ),
        ],
    )
    def test_other_ends(
        self,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        timed: TimedGait,
        changes: Any,
        outcome: str,
        reason: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        attitude = changes.pop(
            "attitude", (0, 0) if len(timed.gait.alpha) == 1 else None
        )
        self.check(
            fly(timed, settings=short(**changes), attitude=attitude, anyway=True),
            outcome,
            reason,
        )
        assert list(tmp_path.iterdir()) == []  # no log of the engine


class TestRecord:
    def test_to_settle_is_to_come_within_tolerance_and_stay(self) -> None:
        flight = fly(RED, settings=short(duration=1.0))
        errors = np.stack(
            [np.abs(flight.column(name)) for name in ("roll", "pitch", "yaw", "z")]
        )
        inside: list[bool] = (errors.max(axis=0) <= 0.02).tolist()
        since = float(
            flight.column("t")[next(k for k in range(len(inside)) if all(inside[k:]))]
        )
        assert flight.settling_time == since
        assert 0.2 < since < 0.7
        assert not fly(RED, settings=short(duration=1.05 * since)).settled
        assert (
            fly(RED, settings=short(duration=round(since + 0.21, 3))).settling_time
            == since
        )
        slow = fly(RED, settings=short(duration=0.1))
        assert (slow.outcome, slow.failed) == ("not settled", False)
        assert "did not settle within 0.1 s: roll (rad) is still off by" in slow.reason

    @pytest.mark.parametrize(
        "changes", [{}, {"attitude_noise": 0.02, "floor": 0.0}, {"servo_lag": 0.1}]
    )
    @pytest.mark.parametrize("vehicle", [PAPER, BEETLE], ids=["paper", "beetle"])
    def test_the_least_singular_value_is_that_of_all_rows(
        self, vehicle: Vehicle, changes: dict[str, Any]
    ) -> None:
        flight = fly(flown_by(RED, vehicle), settings=short(**changes), anyway=True)
        each = least_singular_value(
            flight.alpha, vehicle, flight.column("roll"), flight.column("pitch")
        )
        assert flight.least_singular_value == float(each.min())
        if not changes.get("attitude_noise"):
            near = flight.column("nearness")
            assert (near <= each * (1 + 1e-3)).all()
            assert (near >= each / 2 * (1 - 1e-3)).all()

    def test_a_flight_that_ends_at_once_has_no_rows(self) -> None:
        blue = lift(
            GAITS[1].angles, "blue", coefficients=coefficients_of(PAPER, "exact")
        ).parametrize(1.0)
        flight = fly(blue, anyway=True)
        assert (len(flight.rows), flight.flown, flight.peak_thrust, flight.energy) == (
            0,
            0.0,
            None,
            None,
        )
        assert "nears singularity at 0.000 s" in str(flight)
        json.dumps(flight.as_mapping(), allow_nan=False)

    def test_tables_and_plots_are_written(self, tmp_path: Path) -> None:
        flight = fly(RED, settings=short(duration=0.05))
        assert list(flight.table.columns) == list(COLUMNS)
        flight.write(tmp_path / "flight.npz", tmp_path / "flight.svg")
        with np.load(tmp_path / "flight.npz") as archive:
            np.testing.assert_array_equal(archive["thrust3"], flight.column("thrust3"))
        assert (tmp_path / "flight.svg").read_bytes().startswith(b"<?xml")


@pytest.mark.parametrize(
    ("mass", "length", "ratio"), [(1e-3, 0.05, 0.01), (1e20, 1e3, 5.0)]
)
def test_extreme_vehicles_have_a_record(
    mass: float, length: float, ratio: float
) -> None:
    moments = (0.1 * mass * length**2, 0.12 * mass * length**2, 0.18 * mass * length**2)
    vehicle = Vehicle(
        name="extreme",
        mass=mass,
        arm_length=length,
        drag_ratio=ratio,
        inertia=moments,
        thrust_coefficient=1e-6,
    )
    for gait in (RED, HOVER):
        flight = fly(flown_by(gait, vehicle), settings=short(duration=0.1), anyway=True)
        json.dumps(flight.as_mapping(), allow_nan=False)
        assert np.isfinite(flight.rows).all()
        assert str(flight).count("\n") >= (5 if len(flight.rows) else 0)


class TestDuration:
    """A verdict is on the whole gait, or a warning names the part."""

    SLOW = RED.gait.parametrize(4.0)

    def test_a_period_is_flown_where_no_duration_is_stated(self) -> None:
        rough = FlightSettings(step=0.005, control_rate=200.0)
        assert fly(self.SLOW, settings=rough).flown == pytest.approx(4.0)
        assert fly(RED, settings=rough).flown == pytest.approx(3.0)
        # Every moment of a point is like the others.
        assert Simulation(repeated(HOVER.gait.parametrize(1e6)), rough).controls == 600
        assert (
            Simulation(
                repeated(RED.gait.parametrize(9.0)), replace(rough, reference="hover")
            ).controls
            == 1800
        )

    def test_a_part_has_a_warning(self) -> None:
        flight = fly(self.SLOW, settings=FlightSettings(duration=1.2))
        assert flight.settled
        assert flight.warnings == (
            "the flight of 1.2 s is 30 % of a period of 4 s: the rest of the gait is not tested",
        )
        circle = FlightSettings(duration=1.0, reference="circle", lap=2.0, size=0.1)
        course = course_of(ASCENDING, periods=1)
        for flown, settings, part in (
            (RED, circle, "the flight of 1 s is 50 % of a lap of 2 s"),
            (
                course,
                short(duration=0.5),
                "the flight of 0.5 s is 10 % of a course of 5 s",
            ),
        ):
            (warning,) = fly(flown, settings=settings).warnings
            assert warning.partition(":")[0] == part
        assert fly(HOVER, settings=short(duration=0.05)).warnings == ()

    def test_too_many_steps_and_too_few_are_refused(self) -> None:
        with pytest.raises(
            InputError,
            match=r"^duration must be at most 1000000 steps of 0.001 s, got 2000 s",
        ):
            fly(RED.gait.parametrize(2000.0))
        with pytest.raises(
            InputError,
            match=r"^duration must be at most 1000000 steps of 0.001 s, got 9004 s",
        ):
            fly(RED, settings=FlightSettings(reference="line", lap=9000.0))
        with pytest.raises(
            InputError,
            match=r"^period must be at least 20 steps of 0.001 s \(0.02 s\), got 0.019 s",
        ):
            fly(RED.gait.parametrize(0.019), anyway=True)
        assert (
            len(fly(RED.gait.parametrize(0.02), settings=short(duration=0.02)).rows)
            == 21
        )

    @pytest.mark.parametrize("changes", [{"servo_lag": 0.3}, {"servo_rate": 0.1}])
    def test_arms_that_do_not_follow_have_a_warning(
        self, changes: dict[str, Any]
    ) -> None:
        flight = fly(RED, settings=short(duration=1.0, **changes), anyway=True)
        (warning,) = [one for one in flight.warnings if "do not follow" in one]
        spans, planned = np.ptp(flight.alpha, axis=0), np.ptp(RED.gait.alpha, axis=0)
        numbers = re.search(
            r"arm (\d) swings by (\S+) of the planned (\S+) rad", warning
        )
        assert numbers is not None
        arm, swing, plan = int(numbers[1]) - 1, float(numbers[2]), float(numbers[3])
        assert (swing, plan) == pytest.approx((spans[arm], planned[arm]), rel=0.01)
        assert swing / plan == pytest.approx((spans / planned).min(), rel=0.01)
        assert fly(RED, settings=short(duration=1.0, servo_lag=0.01)).warnings == ()


class TestTakeOff:
    """Before take-off the limits of the flight are checked, not those of the vehicle."""

    def test_thrusts_and_tilt_rates(self) -> None:
        weak = flown_by(RED, PAPER.replace(max_thrust=1.5))
        assert (
            "largest hover thrust 2.75 N at corner 1 (1.178, "
            in fly(weak, settings=short()).reason
        )
        assert not fly(weak, settings=short(thrust_limit=9.0)).refused
        assert not fly(weak, settings=short(saturation=False)).refused
        assert "limit 1 N" in fly(weak, settings=short(thrust_limit=1.0)).reason
        slow = flown_by(RED, PAPER.replace(max_tilt_rate=1.0))
        assert "limit 1" in fly(slow, settings=short()).reason
        assert not fly(slow, settings=short(servo_rate=9.0)).refused
        assert "limit 2" in fly(RED, settings=short(servo_rate=2.0)).reason
        both = flown_by(RED, PAPER.replace(max_thrust=1.5, max_tilt_rate=1.0))
        for limit, one in zip(
            ("1.5 N", "1"),
            fly(both, settings=short(duration=0.02), anyway=True).warnings,
            strict=False,
        ):
            assert one.startswith("flown although it is not flyable: ")
            assert f"limit {limit}" in one

    def test_rotors_that_may_pull_need_no_positive_thrusts(self) -> None:
        pulling = replace(
            RED,
            gait=replace(RED.gait, alpha=np.array([[0.0, 0.0, 1.2, 0.0]]), colors=()),
        )
        assert "hover thrusts are not positive" in fly(pulling, settings=short()).reason
        free = fly(pulling, settings=short(saturation=False))
        assert not free.refused
        assert any("hover thrusts are not positive" in one for one in free.warnings)

    def test_physics_alone_refuses(self) -> None:
        """A biased gait is off the surfaces, which the paper forbids but physics does not."""
        biased = gait_of_paper(3).biased(0.8).parametrize(1.0)
        forbidden, warnings = broken_rules(biased.check())
        assert forbidden == []
        assert any("max(|Rφ|, |Rθ|) = 0.71" in warning for warning in warnings)
        flight = fly(biased)
        assert flight.settled
        assert flight.warnings == tuple(warnings)
        blue = fly(gait_of_paper(2).parametrize(1.0))
        assert (blue.refused, blue.reason.startswith("refused before take-off: ")) == (
            True,
            True,
        )


def course_of(timed: TimedGait, **options: Any) -> Course:
    found = from_hover(timed, **options)
    assert isinstance(found, Course), found
    # Angles and rates are continuous where the sections meet.
    begins = np.array([begin for begin, _, _ in found.sections[1:]])
    before, after = found.at(begins - 1e-9), found.at(begins + 1e-9)
    assert np.abs(after.alpha - before.alpha).max() < 1e-6
    if np.isfinite(timed.peaks(2)).all():  # whose rates do not jump at corners
        assert np.abs(after.rates - before.rates).max() < 1e-5
    return found


class TestCourse:
    @pytest.mark.parametrize(
        ("kind", "law", "periods"),
        [("published", "smooth", 1), ("exact", "constant-speed", 3)],
    )
    def test_its_length_and_the_gait_in_it(
        self, kind: Any, law: LawName, periods: int
    ) -> None:
        timed = gait_of_paper(4, kind).parametrize(1.3, law=law)
        course = course_of(timed, periods=periods)
        rests = law == "smooth"
        starts = run_up(timed)
        run = 0.0 if starts is None else starts.period
        parts = ["gait"] if rests else ["run-up", "gait", "run-down"]
        assert course.phases == ("hover", "entry", *parts, "exit", "hover")
        assert course.duration == pytest.approx(4 + periods * 1.3 + 2 * run)
        assert course.gait_times == pytest.approx((2, 2 + periods * 1.3 + 2 * run))
        assert np.abs(course.at(np.array([0.0, course.duration])).alpha).max() < 1e-12
        begin, joined, _ = course.sections[course.phases.index("gait")]
        t = np.linspace(0, periods * 1.3, 50, endpoint=False)
        assert (
            np.abs(course.at(begin + t).alpha - timed.at(t + joined).alpha).max()
            < 1e-12
        )

    @pytest.mark.parametrize(
        "kind", ["paced", "rounded", "hover itself", "off the surfaces"]
    )
    def test_gaits_of_every_kind_are_entered_and_left(self, kind: str) -> None:
        timed: Any = (
            HOVER
            if kind == "hover itself"
            else gait_of_paper(4).biased(0.8).parametrize(1.0)
        )
        if kind in ("paced", "rounded"):
            rounding: dict[str, Any] = {"rounding": 0.1} if kind == "rounded" else {}
            timed = least_period(
                gait_of_paper(4), Limits(rate=5, acceleration=60), **rounding
            ).timed
        course = course_of(timed, periods=1)
        flight = fly(course, settings=FlightSettings(control_rate=500.0))
        assert flight.settled, flight.reason
        assert flight.flown == pytest.approx(
            course.duration, abs=2e-3
        )  # all of it, where no duration is stated

    @pytest.mark.parametrize("hovers", [True, False])
    def test_errors_and_servos_are_those_while_the_gait_runs(
        self, hovers: bool
    ) -> None:
        timed = gait_of_paper(4).parametrize(1.0)
        settings = FlightSettings(servo_lag=0.3, arms="planned")
        course = course_of(timed) if hovers else repeated(timed)
        flight = fly(course, settings=settings, attitude=(0.1, 0.0))
        t = flight.column("t")
        runs = (t >= 2.0) & (t <= 4.0) if hovers else t >= 0.0
        errors = {
            "attitude": np.abs(flight.rows[runs][:, 4:6]).max(),
            "yaw": np.abs(flight.column("yaw")[runs]).max(),
            "altitude": np.abs(flight.column("z")[runs]).max(),
        }
        assert flight.gait_errors == pytest.approx(errors, abs=1e-12)
        assert flight.as_mapping()["gait_errors"] == flight.gait_errors
        assert (
            f"yaw {round(errors['yaw'], 4):g} rad, altitude {round(errors['altitude'], 4):g} m at most"
            in str(flight)
        )
        # The level start from hover is over before the gait runs; without it the start counts.
        assert (errors["attitude"] > 0.09) is not hovers
        (warning,) = [one for one in flight.warnings if "do not follow" in one]
        alone = fly(timed, settings=FlightSettings(servo_lag=0.3)).warnings
        assert warning.split(" of the ")[1] == alone[-1].split(" of the ")[1]
        swings = [
            float(one.split("swings by ")[1].split()[0]) for one in (warning, alone[-1])
        ]
        assert swings[0] == pytest.approx(swings[1], rel=0.02)

    def test_a_flight_that_never_runs_the_gait_has_no_errors_of_it(self) -> None:
        course = course_of(gait_of_paper(4).parametrize(1.0))
        flight = fly(course, settings=FlightSettings(duration=0.5))
        assert flight.gait_errors is None
        assert "errors of the gait" not in str(flight)
        assert fly(gait_of_paper(1).parametrize(1.0)).gait_errors is None

    def test_a_slow_vehicle_has_a_longer_entry(self) -> None:
        slow = PAPER.replace(name="slow", max_tilt_rate=0.5)
        course = course_of(gait_of_paper(4, "exact", slow).parametrize(20.0), periods=1)
        t = np.arange(0.0, course.duration, 0.01)
        assert (
            0.45
            < np.abs(np.diff(course.at(t).alpha, axis=0)).max() / 0.01
            <= 0.5 + 1e-6
        )

    @pytest.mark.parametrize("number", [1, 2, 3])
    def test_none_leads_from_hover_to_another_sign_of_r_or_to_blue(
        self, number: int
    ) -> None:
        off = from_hover(gait_of_paper(3).biased(0.8).parametrize(1.0))
        assert str(off).startswith(
            "no flyable path from hover: off the surfaces it is straight, and R changes its sign"
        )
        found = from_hover(
            gait_of_paper(number, "exact" if number < 3 else "published").parametrize(
                1.0
            )
        )
        assert isinstance(found, str)
        assert found.startswith("no flyable path from hover: ")
        assert ("R = +4 at the start and -5.559 at the end" in found) == (number == 3)


class TestSettings:
    def test_the_ends_of_a_range_are_allowed_and_defaults_are_those_of_the_help(
        self,
    ) -> None:
        assert not FlightSettings(tolerance=10.0, floor=0.0, gust=100.0).is_calm
        usual = FlightSettings()
        assert (
            usual.size,
            usual.lap,
            usual.position_stiffness,
            usual.position_damping,
        ) == (1.0, 6.0, 2.25, 3.0)

    def test_they_come_back_from_their_mapping(self) -> None:
        settings = FlightSettings(
            duration=3, reference="line", seed=2**64 - 1, saturation=False, **ROUGH
        )
        assert (
            settings_from_mapping(json.loads(json.dumps(settings.as_mapping())))
            == settings
        )
