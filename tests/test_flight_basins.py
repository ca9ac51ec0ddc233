"""Basins: from where gaits settle in flight, beside the sign of their determinant, and the command basin."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import InputError
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

PAGE = Path(__file__).parent.parent / "docs" / "guide" / "flight.md"
SHARE = (PAPER.mass or 0.0) * PAPER.gravity / 4
FOUR_SHARES: dict[str, Any] = {"thrust_limit": 4 * SHARE}


def timed_gait(number: int = 3) -> TimedGait:
    return gait_of_paper(number).parametrize(1.0)


def basin_of(timed: TimedGait, eta: float = 1.0, **options: Any) -> Basin:
    return basins_of(timed, bias=eta, **options)[0]


def test_a_row_of_the_page_is_flown_again() -> None:
    """Of gait 4 with a limit of four shares and η = 0.8; the other rows take as long and test no more."""
    cells = re.search(r"\| Gait 4 \| 4 \| 0.8 \| (.*) \|", PAGE.read_text())
    settings = FlightSettings(**FOUR_SHARES)
    basin = basin_of(timed_gait(4), 0.8, settings=settings, resolution=9)
    lost, gained = basin.cases["inside_lost"], basin.cases["outside_settled"]
    found = [basin.inside.sum(), basin.settled.sum(), lost, gained]
    assert cells is not None
    assert [int(cell) for cell in cells[1].split(" | ")] == found
    assert sum(basin.cases.values()) == 9 * 9


def test_a_red_gait_settles_from_everywhere_without_a_thrust_limit() -> None:
    parts: list[float] = []
    basin = basin_of(timed_gait(), resolution=3, progress=parts.append)
    assert parts == sorted(parts)
    assert (parts[0], parts[-1], len(parts) > 10) == (0.0, 1.0, True)
    assert basin.cases == dict(zip(CASES, (9, 0, 0, 0), strict=True))
    assert basin.outcomes == {"settled": 9}
    assert 100 < basin.peak_share.max() < 200  # which no rotor has
    assert basin.seconds.max() < 0.7
    assert f"with {basin.peak_share.max():.3g} times" in str(basin)
    assert not basin.warnings


def test_attitudes_beyond_a_singular_one_are_lost_at_each_moment_of_take_off() -> None:
    """Level flight has the other sign of the determinant, so it is zero somewhere between."""
    basin = basin_of(timed_gait(), 0.8, resolution=4, begins=2)
    assert not basin.same_side.all()
    assert not (basin.outcome == 0)[~basin.same_side].any()
    assert basin.same_side[:, basin.inside].all()
    assert basin.warnings
    settles = basin.outcome == 0
    last, peak = basin.seconds[settles].max(), basin.peak_share[settles].max()
    assert f"after {last:.2f} s at most, with {peak:.3g} times" in str(basin)
    assert basin.begins.tolist() == [0.0, 0.5]
    np.testing.assert_array_equal(basin.settled, settles[0] & settles[1])
    np.testing.assert_array_equal(basin.worst == 0, basin.settled)
    assert basin.settled.sum() < settles[1].sum()
    # A row of the table: the second moment, the fourth roll, the second pitch.
    table = table_of_basins([basin, basin])
    row = {name: table[name][16 + 3 * 4 + 1] for name in table.columns}
    assert len(table) == 64
    assert (row["eta"], row["begin"]) == (0.8, 0.5)
    degrees = np.degrees([row["roll"], row["pitch"]])
    assert degrees == pytest.approx([80, -80 / 3])
    assert row["outcome"] == OUTCOMES[basin.outcome[1, 3, 1]]


LAGGING = PAPER.replace(rotor_lag=0.02, rotor_inertia=1e-6)
SPINNING = PAPER.replace(rotor_inertia=1e-2)
ROUGH = {"wind": (2.0, -1.0, 0.5), "gust": 0.5, "attitude_noise": 0.002}
SLOW: dict[str, Any] = {"control_rate": 200.0, "step": 2.5e-3, "attitude_damping": 14.0}
SLOW |= {"servo_lag": 0.01, "arms": "served"}
SWINGING = {"attitude_stiffness": 3000.0, "attitude_damping": 30.0, "floor": 0.27}


@pytest.mark.parametrize(
    ("vehicle", "number", "eta", "settings", "outcomes"),
    [
        (PAPER, 4, 0.8, FOUR_SHARES, "settled, near singular"),
        (PAPER, 3, 0.8, ROUGH, "settled, near singular"),
        (PAPER, 3, 0.9, SLOW, "settled, near singular"),
        (PAPER, 4, 0.9, SWINGING, "near singular"),
        (LAGGING, 3, 1.0, {"duration": 1.2}, "settled"),
        (PAPER.replace(mass=1e20), 3, 1.0, {}, "tumbling"),
        (SPINNING, 3, 1.0, {}, "tumbling, near singular, sign change"),
    ],
)
def test_flights_side_by_side_end_as_single_ones_do(
    vehicle: Any, number: int, eta: float, settings: Any, outcomes: str
) -> None:
    """Alone, a flight takes its whole duration, and the controller computes plain numbers."""
    timed = flown_by(timed_gait(number), vehicle)
    chosen = FlightSettings(**{"duration": 2.0, **settings})
    basin = basin_of(timed, eta, settings=chosen, resolution=3, anyway=True)
    assert basin.outcomes.keys() == {*outcomes.split(", ")}
    flown = timed if eta == 1 else biased_timed_gait(timed, eta)
    simulation = Simulation(repeated(flown), basin.settings)
    for i, j in ((0, 0), (0, 1), (1, 1), (2, 2)):
        attitude = float(basin.angles[i]), float(basin.angles[j])
        flight = simulation.run(attitude)
        end = flight.settling_time if flight.settled else flight.flown
        assert flight.outcome == OUTCOMES[basin.outcome[0, i, j]]
        assert basin.seconds[0, i, j] == end
        # A flight that settles ends after a period at least, a whole one may ask for more later.
        thrusts = np.abs(flight.thrusts) * 4 / (vehicle.mass * vehicle.gravity)
        first = thrusts[flight.column("t") <= 1.0 + 1e-9].max(initial=0.0)
        peak = basin.peak_share[0, i, j]
        assert first * (1 - 2e-4) <= peak <= thrusts.max(initial=0.0) * (1 + 2e-4)


def test_threads_change_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = FlightSettings(duration=2.0, **FOUR_SHARES)
    single = basin_of(timed_gait(4), 0.8, settings=settings, resolution=3)
    monkeypatch.setattr("gaitgraph.flight.engine._FLIGHTS_OF_A_THREAD", 4)
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    several = basin_of(timed_gait(4), 0.8, settings=settings, resolution=3)
    assert several.as_mapping() == single.as_mapping()


def test_gaits_that_physics_forbids_are_refused_and_fail_anyway() -> None:
    refused = basin_of(timed_gait(1), resolution=3)
    assert refused.outcomes == {"refused": 9}
    assert "undecided" in refused.refusal
    assert not refused.inside.any()
    flown = basin_of(timed_gait(1), resolution=3, anyway=True)
    assert (flown.refusal, flown.outcomes) == ("", {"near singular": 9})


def test_paced_gaits_are_flown_but_not_biased() -> None:
    limits = Limits(rate=5, acceleration=60)
    timed = least_period(timed_gait().gait, limits, rounding=0.1).timed
    assert timed is not None
    assert basin_of(timed, resolution=1).fraction == 1.0
    with pytest.raises(InputError) as caught:
        basin_of(timed, 0.8)
    assert caught.value.field == "law"


def test_the_command_reports_each_basin(run: Any, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(f"[flight]\nthrust_limit = {4 * SHARE}\n")
    options = ("basin", "gait3", "--bias", 0.8, "--resolution", 2)
    done = run(*options, "--settings", "s.toml", "--output", "basin.csv")
    assert (done.code, done.err) == (0, "")
    assert "Basin of the gait itself: 2 by 2 attitudes" in done.out
    assert "warning: max(|Rφ|, |Rθ|) = 0.71 at corner" in done.out
    assert len((tmp_path / "basin.csv").read_text().splitlines()) == 1 + 8
