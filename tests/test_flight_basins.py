"""Basins: from where gaits settle in flight, beside the sign of their determinant, and the command basin."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
from gaitgraph.gait.gait import lift
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from gaitgraph.vehicle import PAPER
from tests.samples import flown_by, gait_of_paper

pytest.importorskip("mujoco")

from gaitgraph.flight.basins import CASES, Basin, basins_of, table_of_basins
from gaitgraph.flight.course import biased_timed_gait, repeated
from gaitgraph.flight.flight import OUTCOMES, FlightSettings
from gaitgraph.flight.simulation import Simulation

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

PAGE = (Path(__file__).parent.parent / "docs" / "guide" / "flight.md").read_text()
SHARE = (PAPER.mass or 0.0) * PAPER.gravity / 4


def timed_gait(number: int = 3) -> TimedGait:
    return gait_of_paper(number).parametrize(1.0)


def basin_of(timed: TimedGait, eta: float = 1.0, **options: Any) -> Basin:
    return basins_of(timed, bias=eta, **options)[0]


@pytest.fixture(scope="module")
def biased() -> Basin:
    return basin_of(timed_gait(), 0.8, resolution=4, begins=2)


# The rows of the page's first table: gait, thrust limit in shares, η, acceptable, settled, settled but not acceptable.
ROWS = re.findall(
    r"^\| Gait (\d) \| (\w+) \| ([\d.]+) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$",
    PAGE,
    re.M,
)


# One row is flown again here; the others take as long and test no more.
@pytest.mark.parametrize(
    "row", [row for row in ROWS if row[:3] == ("4", "4", "0.8")], ids="-".join
)
def test_the_numbers_of_the_page_are_flown_again(row: tuple[str, ...]) -> None:
    assert {row[:3] for row in ROWS} == {
        (g, limit, eta)
        for g in "34"
        for limit in ("none", "4")
        for eta in ("1", "0.9", "0.8")
    }
    basin = basin_of(
        timed_gait(4),
        0.8,
        settings=FlightSettings(thrust_limit=4 * SHARE),
        resolution=9,
    )
    cases = basin.cases
    assert (int(basin.inside.sum()), int(basin.settled.sum())) == (
        int(row[3]),
        int(row[4]),
    )
    assert (cases["inside_lost"], cases["outside_settled"]) == (
        int(row[5]),
        int(row[6]),
    )
    assert not (basin.outcome == 0)[~basin.same_side].any()


def test_a_red_gait_settles_from_everywhere_without_a_thrust_limit() -> None:
    parts: list[float] = []
    basin = basin_of(timed_gait(3), resolution=3, progress=parts.append)
    assert parts == sorted(parts)
    assert (parts[0], parts[-1]) == (0.0, 1.0)
    assert len(parts) > 10
    assert basin.fraction == basin.acceptable_fraction == 1.0
    assert basin.cases == dict(zip(CASES, (9, 0, 0, 0), strict=True))
    assert basin.outcomes == {"settled": 9}
    assert 100 < basin.peak_share.max() < 200  # which no rotor has
    assert basin.seconds.max() < 0.7
    assert not basin.warnings


def test_attitudes_on_the_other_side_of_the_singular_ones_at_take_off_are_lost(
    biased: Basin,
) -> None:
    """Level flight has the other sign of the determinant, so it is zero somewhere between."""
    assert 0 < (~biased.same_side).sum() < biased.same_side.size
    assert not (biased.outcome == 0)[~biased.same_side].any()
    # An attitude that is never singular is on the same side at all times.
    assert biased.same_side[:, biased.inside].all()
    assert biased.warnings


def test_moments_of_take_off_are_flown_one_by_one(biased: Basin) -> None:
    assert biased.begins.tolist() == [0.0, 0.5]
    assert biased.outcome.shape == (2, 4, 4)
    assert np.array_equal(biased.settled, (biased.outcome == 0).all(axis=0))
    assert biased.settled.sum() < (biased.outcome[1] == 0).sum()
    assert np.array_equal(biased.worst == 0, biased.settled)
    columns = biased.columns
    assert [len(values) for values in columns.values()] == [32] * len(columns)
    row = {
        name: values[16 + 3 * 4 + 1] for name, values in columns.items()
    }  # second moment, fourth roll, second pitch
    assert (row["eta"], row["begin"]) == (0.8, 0.5)
    assert (row["roll"], row["pitch"]) == pytest.approx(
        (math.radians(80), math.radians(-80 / 3))
    )
    assert row["outcome"] == OUTCOMES[biased.outcome[1, 3, 1]]
    assert len(table_of_basins([biased, biased])) == 64


FOUR = {"thrust_limit": 4 * SHARE}
LAGGING = PAPER.replace(rotor_lag=0.02, rotor_inertia=1e-6)
ROUGH = {"wind": (2.0, -1.0, 0.5), "gust": 0.5, "attitude_noise": 0.002}
SWINGING = {
    "attitude_stiffness": 3000.0,
    "attitude_damping": 30.0,
    "floor": 0.1,
    "tolerance": 0.05,
}
SLOW = {
    "control_rate": 200.0,
    "step": 2.5e-3,
    "servo_lag": 0.01,
    "arms": "served",
    "attitude_damping": 14.0,
}


@pytest.mark.parametrize(
    "case",
    [
        (PAPER, 4, 0.8, 1.0, FOUR, {"settled", "near singular"}),
        (PAPER, 3, 1.0, 2.0, FOUR, {"settled", "near singular", "sign change"}),
        (PAPER, 3, 0.8, 1.0, ROUGH, {"settled", "near singular"}),
        (PAPER, 3, 0.9, 2.0, SLOW, {"settled", "near singular"}),
        (PAPER, 4, 0.9, 1.5, SWINGING, {"settled", "near singular"}),
        (
            PAPER,
            4,
            0.9,
            1.5,
            {**SWINGING, "floor": 0.27},
            {"near singular"},
        ),  # in level flight too, but later
        (LAGGING, 3, 1.0, 1.0, {"duration": 1.5}, {"settled"}),
        (PAPER.replace(mass=1e20), 3, 1.0, 1.0, {}, {"tumbling"}),
        (
            PAPER.replace(rotor_inertia=1e-2),
            3,
            1.0,
            1.0,
            {},
            {"tumbling", "near singular", "sign change"},
        ),
    ],
)
def test_flights_side_by_side_end_as_whole_ones_do(case: Any) -> None:
    """Alone, a flight takes its whole duration, and the controller computes plain numbers."""
    vehicle, number, eta, period, changes, outcomes = case
    timed = flown_by(gait_of_paper(number).parametrize(period), vehicle)
    settings = FlightSettings(**changes)
    basin = basin_of(timed, eta, settings=settings, resolution=3, anyway=True)
    simulation = Simulation(
        repeated(timed if eta == 1 else biased_timed_gait(timed, eta)), basin.settings
    )
    for i, j in ((0, 0), (0, 1), (1, 1), (2, 0), (2, 2)):
        flight = simulation.run((float(basin.angles[i]), float(basin.angles[j])))
        assert flight.outcome == OUTCOMES[basin.outcome[0, i, j]]
        assert basin.seconds[0, i, j] == (
            flight.settling_time if flight.settled else flight.flown
        )
        # A flight that settles ends after a period at least, a whole one may ask for more later.
        thrusts = (
            np.abs(flight.thrusts).max(axis=1, initial=0.0)
            * 4
            / (vehicle.mass * vehicle.gravity)
        )
        first = thrusts[flight.column("t") <= period + 1e-9].max(initial=0.0)
        assert (
            first * (1 - 2e-4)
            <= basin.peak_share[0, i, j]
            <= thrusts.max(initial=0.0) * (1 + 2e-4)
        )
    assert basin.outcomes.keys() == outcomes


def test_threads_change_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    timed = timed_gait(4)
    asked: dict[str, Any] = {
        "settings": FlightSettings(thrust_limit=4 * SHARE),
        "resolution": 3,
    }
    basin = basin_of(timed, 0.8, **asked)
    monkeypatch.setattr("gaitgraph.flight.engine._FLIGHTS_OF_A_THREAD", 4)
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    again = basin_of(timed, 0.8, **asked)
    for name in ("outcome", "seconds", "peak_share"):
        np.testing.assert_array_equal(getattr(again, name), getattr(basin, name))


def test_thrusts_that_are_cut_later_keep_a_swinging_flight_from_settling() -> None:
    """Twice a swing the thrusts are those of hover, at half of it they are cut."""
    loop = [[0.9669, -0.7349], [0.9496, -0.4135], [0.8105, -0.482], [0.4596, -0.744]]
    gains: dict[str, Any] = {
        "attitude_stiffness": 1e5,
        "attitude_damping": 105,
        "altitude_stiffness": 1.82e5,
        "altitude_damping": 366,
    }
    limits: dict[str, Any] = {
        "tolerance": 0.05,
        "floor": 0.0,
        "servo_lag": 0.194,
        "arms": "served",
        "thrust_limit": 2.2,
    }
    settings = FlightSettings(
        **gains, **limits, duration=1.8, step=2.5e-4, control_rate=4000.0
    )
    simulation = Simulation(repeated(lift(loop, "red").parametrize(1.8)), settings)
    attitudes = np.array([[0.0, 0.1], [0.0, 0.2]])
    codes, seconds, _ = simulation.run_many(
        attitudes, until_settled=1.8, progress=lambda _: None
    )
    flights = [simulation.run((0.0, pitch)) for pitch in attitudes[:, 1].tolist()]
    assert [OUTCOMES[code] for code in codes] == [flight.outcome for flight in flights]
    assert [flight.settled for flight in flights] == [True, False]
    assert seconds[0] == flights[0].settling_time


def test_a_slow_loop_holds_a_tilt_that_needs_more_thrust_than_the_limit() -> None:
    # On red a tilt adds its square to the thrusts, and nothing of first order.
    loop = lift([[0.5, -0.5], [0.51, -0.5], [0.51, -0.51]], "red").parametrize(6.0)
    gains: dict[str, Any] = {"attitude_stiffness": 0.05, "attitude_damping": 0.1}
    settings = FlightSettings(
        **gains, tolerance=0.05, duration=6.0, thrust_limit=1.21814
    )
    simulation = Simulation(repeated(loop), settings)
    codes, _, _ = simulation.run_many(
        np.array([[0.03, 0.03]]), until_settled=6.0, progress=lambda _: None
    )
    assert OUTCOMES[codes[0]] == simulation.run((0.03, 0.03)).outcome == "not settled"


def test_gaits_that_physics_forbids_are_refused_and_fail_anyway() -> None:
    refused = basins_of(timed_gait(1), bias=(1.0, 0.8), resolution=3)
    assert [basin.outcomes for basin in refused] == [{"refused": 9}] * 2
    assert "undecided" in refused[0].refusal
    assert "R changes its sign" in refused[1].refusal
    assert not any(basin.settled.any() or basin.inside.any() for basin in refused)
    flown = basin_of(timed_gait(1), resolution=3, anyway=True)
    assert (flown.refusal, flown.outcomes) == ("", {"near singular": 9})
    assert "9 near singular" in str(flown)


def test_paced_gaits_are_flown_but_not_biased() -> None:
    timed = least_period(
        timed_gait(3).gait, Limits(rate=5, acceleration=60), rounding=0.1
    ).timed
    assert timed is not None
    assert basin_of(timed, resolution=1).fraction == 1.0
    with pytest.raises(InputError, match="^law must be one of .* for a bias"):
        basin_of(timed, 0.8)


def test_the_command_reports_each_basin(run: Any, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(f"[flight]\nthrust_limit = {4 * SHARE}\n")
    asked = ("--bias", 0.8, "--resolution", 2, "--settings", "s.toml")
    done = run("basin", "gait3", *asked, "--output", "basin.csv")
    assert (done.code, done.err) == (0, "")
    assert (
        "Basin of the gait itself: 2 by 2 attitudes, roll and pitch up to 80°: "
        in done.out
    )
    assert "warning: max(|Rφ|, |Rθ|) = 0.71 at corner" in done.out
    assert len((tmp_path / "basin.csv").read_text().splitlines()) == 1 + 8
    answer = run(
        "basin", "gait3", "--bias", 0.8, "--resolution", 1, "--json", "--begins", 2
    ).json
    gait, biased = answer["basins"]
    assert (gait["eta"], gait["period"], gait["warnings"]) == (1.0, 1.0, [])
    assert (sum(biased[case] for case in CASES), len(biased["flights"]["outcome"])) == (
        1,
        2,
    )
    (tmp_path / "none.toml").write_text(
        'waypoints = [["0.1", "0.1"], ["1.2", "-1.2"]]\ncolor = "red"\n'
    )
    none = run("basin", "none.toml", "--json")
    assert (none.code, none.json["status"]) == (1, "infeasible")
