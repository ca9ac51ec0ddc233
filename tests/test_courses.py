"""Courses: hover, a way in, a gait, and the way out; their angles never jump, and physics alone refuses them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
from gaitgraph.gait.gait import lift
from gaitgraph.gait.paper_gaits import paper_gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from gaitgraph.vehicle import PAPER, Vehicle

pytest.importorskip("mujoco")

from gaitgraph.flight.course import Course, from_hover, refusal_and_warnings, repeated
from gaitgraph.flight.settings import FlightSettings
from gaitgraph.flight.simulation import fly

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.timing.timed_gait import TimedGait

KINDS = ("published", "exact")
LAWS = ("smooth", "constant-speed", "equal-time")


def gait_of_paper(number: int, kind: Any = "published", vehicle: Vehicle = PAPER) -> Gait:
    return paper_gait(number, vehicle, coefficients_of(vehicle, kind))


def course_of(timed: TimedGait, **asked: Any) -> Course:
    found = from_hover(timed, **asked)
    assert isinstance(found, Course), found
    return found


def largest_jump(course: Course) -> float:
    """Return how far the angles are apart just before and just after the pieces of a course meet [rad]."""
    begins = np.array([begin for begin, _, _ in course.pieces[1:]])
    hair = 1e-9
    return float(np.abs(course.at(begins + hair) - course.at(begins - hair)).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("periods", "pause", "duration"), [(1, 0.0, None), (3, 0.2, 0.7), (2, 1.0, 4.0)])
def test_a_course_is_continuous_in_its_angles_and_as_long_as_its_parts(
    kind: Any, law: str, periods: int, pause: float, duration: float | None
) -> None:
    timed = gait_of_paper(4, kind).parametrize(1.3, law=law)
    course = course_of(timed, periods=periods, pause=pause, duration=duration)
    assert largest_jump(course) < 1e-7
    assert course.duration == pytest.approx(2 * (pause + (duration or 1.0)) + periods * 1.3)
    ends = course.at(np.array([0.0, course.duration]))
    assert np.abs(ends).max() < 1e-12
    # The gait is flown whole, so often as it was asked for.
    (begin,) = (piece[0] for piece, phase in zip(course.pieces, course.phases, strict=True) if phase == "gait")
    during = course.at(begin + np.linspace(0, periods * 1.3, 50, endpoint=False))
    assert (
        np.abs(during - timed.at(np.linspace(0, periods * 1.3, 50, endpoint=False) + course.pieces[2][1])[0]).max()
        < 1e-12
    )


def test_the_phases_of_a_course_are_told_at_any_time() -> None:
    course = course_of(gait_of_paper(4).parametrize(1.0), periods=2, pause=0.5)
    told = [course.phase_at(t) for t in (0.0, 0.6, 1.6, 3.4, 3.6, 4.6)]
    assert told == ["hover", "entry", "gait", "gait", "exit", "hover"]


@pytest.mark.parametrize(
    "timed",
    [
        pytest.param(lambda: least_period(gait_of_paper(4), Limits(rate=5, acceleration=60)).timed, id="paced"),
        pytest.param(
            lambda: least_period(gait_of_paper(4), Limits(rate=5, acceleration=60), rounding=0.1).timed, id="rounded"
        ),
        pytest.param(lambda: lift([(-0.5, 0.5)], "red").parametrize(2.0), id="a point"),
        pytest.param(lambda: lift([(0.0, 0.0)], "red").parametrize(1.0), id="hover itself"),
        pytest.param(lambda: gait_of_paper(4).biased(0.8).parametrize(1.0), id="off the surfaces"),
    ],
)
def test_gaits_of_every_kind_are_entered_and_left_without_a_jump(timed: Any) -> None:
    course = course_of(timed(), periods=1, pause=0.1)
    assert largest_jump(course) < 1e-6
    flight = fly(course, settings=FlightSettings(control_rate=500.0))
    assert flight.settled, flight.reason
    assert flight.flown == pytest.approx(course.duration, abs=2e-3)  # all of it, where no duration is stated


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("number", [1, 2, 3])
def test_no_course_leads_from_hover_to_another_sign_of_r_or_to_blue(number: int, kind: Any) -> None:
    """Level flight has a determinant in proportion to R, +4 in hover: at R < 0, and at R = 0, there is no way."""
    found = from_hover(gait_of_paper(number, kind).parametrize(1.0))
    assert isinstance(found, str)
    assert found.startswith("no flyable path from hover: ")
    assert ("R = +4 at the start and -5.559 at the end" in found) == (number == 3)


def test_off_the_surfaces_the_reason_is_that_of_the_straight_way() -> None:
    found = from_hover(gait_of_paper(3).biased(0.8).parametrize(1.0))
    assert isinstance(found, str)
    assert found.startswith(
        "no flyable path from hover: off the surfaces it is straight, and R changes its sign at (0.7"
    )
    assert isinstance(from_hover(gait_of_paper(4).biased(0.8).parametrize(1.0)), Course)


def test_the_sign_of_r_predicts_which_loops_are_reached() -> None:
    points = [(-0.4, 0.4), (0.1, -0.05), (-0.2, 0.3), (1.2, -1.2), (0.9, -0.6), (-1.2, 1.2)]
    reached: dict[bool, int] = {}
    for point in points:
        gait = lift([point], "red", coefficients=coefficients_of(PAPER, "exact"))
        assert gait.check().flyable
        reached[bool(gait.R[0] > 0)] = reached.get(bool(gait.R[0] > 0), 0) + 1
        assert isinstance(from_hover(gait.parametrize(1.0)), Course) == bool(gait.R[0] > 0), point
    assert reached == {True: 4, False: 2}


def test_what_is_forbidden_flies_anyway_and_ends_where_the_determinant_vanishes() -> None:
    course = course_of(gait_of_paper(3).parametrize(1.0), anyway=True)
    assert largest_jump(course) < 1e-7
    flight = fly(course, anyway=True)
    assert flight.failed
    assert flight.outcome in ("near singular", "sign change")
    assert course.phase_at(flight.flown) == "entry"
    # R changes its sign on the straight way at 0.49 of it; the flight ends just before.
    levels = [float(row) for row in _level_determinants(course, flight.flown)]
    assert levels[0] > 0
    assert abs(levels[1]) < 0.1 * levels[0]


def _level_determinants(course: Course, t: float) -> Any:
    from gaitgraph.invertibility.matrices import level_determinant

    return level_determinant(course.at(np.array([0.0, t])), coefficients_of(course.vehicle, "exact"))


def test_another_vehicle_has_its_own_ways() -> None:
    mirrored = PAPER.replace(name="mirrored", first_rotor_spin="counterclockwise")
    gait = gait_of_paper(4, "exact", mirrored)
    course = course_of(gait.parametrize(1.0))
    assert largest_jump(course) < 1e-7
    slow = PAPER.replace(name="slow", max_tilt_rate=0.5)
    course = course_of(gait_of_paper(4, "exact", slow).parametrize(20.0), periods=1)
    entry = course.pieces[2][0] - course.pieces[1][0]
    assert entry > 1.4  # s, for 0.39 rad at 0.5 rad/s with the smooth law's peak of 15/8
    t = np.arange(0.0, course.duration, 0.01)
    assert (np.abs(np.diff(course.at(t), axis=0)).max() / 0.01) <= 0.5 + 1e-6


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"periods": 0}, "periods: 0; allowed is a whole number from 1 to 10000"),
        ({"periods": True}, "periods: True; allowed is a whole number from 1 to 10000"),
        ({"periods": 2.0}, "periods: 2.0; allowed is a whole number from 1 to 10000"),
        ({"pause": -1.0}, "pause: -1.0; allowed is a number of seconds from 0 to 10000"),
        ({"pause": math.nan}, "pause: nan; allowed is a number of seconds from 0 to 10000"),
        ({"duration": 0.0}, "duration: 0.0; allowed is a finite number of seconds"),
    ],
)
def test_wrong_values_are_named(asked: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told.replace("(", r"\(")):
        from_hover(gait_of_paper(4).parametrize(1.0), **asked)


def test_a_course_that_takes_too_many_steps_is_refused_before_it_is_flown() -> None:
    course = course_of(gait_of_paper(4).parametrize(1.0), periods=9999)
    with pytest.raises(InputError, match=r"duration: 10003 s; allowed is 1000000 steps of 0.001 s at most"):
        fly(course)


def test_a_course_may_begin_at_any_moment_of_the_gait() -> None:
    timed = gait_of_paper(3).parametrize(2.0)
    t = np.linspace(0.0, 3.0, 7)
    assert np.array_equal(repeated(timed, begin=0.5).at(t), timed.at(t + 0.5)[0])


def test_physics_alone_refuses() -> None:
    """A biased gait is off the surfaces, which the paper forbids and physics does not; a singular one never flies."""
    biased = gait_of_paper(3).biased(0.8).parametrize(1.0)
    assert not biased.check().valid
    refusal, warnings = refusal_and_warnings(biased.check())
    assert refusal == ""
    assert any("max(|Rφ|, |Rθ|) = 0.71" in warning for warning in warnings)
    flight = fly(biased)
    assert flight.settled
    assert flight.warnings == warnings
    assert flight.as_mapping()["warnings"] == list(warnings)
    assert fly(gait_of_paper(3).parametrize(1.0), settings=FlightSettings(duration=1.0)).warnings == ()
    for number in (1, 2):
        flight = fly(gait_of_paper(number).parametrize(1.0))
        assert flight.refused
        assert flight.outcome == "refused"
        assert flight.reason.startswith("refused before take-off: ")
    slow = PAPER.replace(name="slow", max_tilt_rate=1.0)
    assert "peak 5.89 rad/s (α1), limit 1" in fly(gait_of_paper(3, "exact", slow).parametrize(1.0)).reason
