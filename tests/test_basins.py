"""Basins: from where gaits settle in flight, beside what their determinant says, and the command that shows it."""

from __future__ import annotations

import io
import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from gaitgraph.cli import main
from gaitgraph.errors import InputError, MissingConstant, OutputExists
from gaitgraph.gait.paper_gaits import paper_gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.axes import COLOR_OF, GREY, picture_bytes
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from gaitgraph.vehicle import PAPER

pytest.importorskip("mujoco")

from gaitgraph.flight.basins import CASES, Basin, basin_of, basins_of, table_of_basins
from gaitgraph.flight.record import OUTCOMES
from gaitgraph.flight.settings import FlightSettings
from gaitgraph.plots.basins import _LOOKS, basin_map, basins_figure
from gaitgraph.plots.flight_outputs import write_basins

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE = (Path(__file__).parent.parent / "docs" / "basins.md").read_text()
assert PAPER.mass is not None
SHARE = PAPER.mass * PAPER.gravity / 4


@pytest.fixture(autouse=True)
def pictures_without_windows() -> Iterator[None]:
    plt.switch_backend("agg")
    yield
    plt.close("all")


def timed_gait(number: int = 3, period: float = 1.0, **changes: Any) -> Any:
    vehicle = PAPER.replace(**changes) if changes else PAPER
    return paper_gait(number, vehicle, coefficients_of(vehicle, "published")).parametrize(period)


@pytest.fixture(scope="module")
def biased() -> Basin:
    return basin_of(timed_gait(), eta=0.8, resolution=5, begins=2)


# The rows of the page's first table: gait, thrust limit in shares, η, acceptable, settled, settled but not acceptable.
ROWS = re.findall(r"^\| Gait (\d) \| (\w+) \| ([\d.]+) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$", PAGE, re.M)


FLOWN = (("3", "none", "0.8"), ("3", "4", "1"), ("4", "4", "0.8"))
"""Of them these are flown again here; the others take as long and say no more."""


def test_the_page_tells_of_both_red_gaits_their_biased_gaits_and_two_limits() -> None:
    told = {row[:3] for row in ROWS}
    assert told == {(gait, limit, eta) for gait in "34" for limit in ("none", "4") for eta in ("1", "0.9", "0.8")}


@pytest.mark.parametrize("row", [row for row in ROWS if row[:3] in FLOWN], ids="-".join)
def test_the_numbers_of_the_page_are_flown_again(row: tuple[str, ...]) -> None:
    gait, limit, eta, acceptable, settled, lost, gained = row
    settings = FlightSettings(thrust_limit=None if limit == "none" else float(limit) * SHARE)
    basin = basin_of(timed_gait(int(gait)), eta=float(eta), settings=settings, resolution=9)
    cases = basin.cases
    assert (int(basin.inside.sum()), int(basin.settled.sum())) == (int(acceptable), int(settled))
    assert (cases["inside_lost"], cases["outside_settled"]) == (int(lost), int(gained))
    assert not (basin.outcome == 0)[~basin.same_side].any()


def test_a_red_gait_settles_from_everywhere_with_thrust_without_limit() -> None:
    basin = basin_of(timed_gait(3), resolution=5)
    assert basin.fraction == basin.acceptable_fraction == 1.0
    assert basin.cases == dict(zip(CASES, (25, 0, 0, 0), strict=True))
    assert basin.outcomes == {"settled": 25}
    assert 100 < basin.peak_share.max() < 200  # which no rotor has
    assert basin.seconds.max() < 0.7
    assert not basin.warnings


def test_what_is_on_the_other_side_of_the_singular_attitudes_at_take_off_is_lost(biased: Basin) -> None:
    """Level flight has the other sign of the determinant, so on any way there it is zero."""
    assert 0 < (~biased.same_side).sum() < biased.same_side.size
    assert not (biased.outcome == 0)[~biased.same_side].any()
    # An attitude that is never singular is on the same side at all times.
    assert biased.same_side[:, biased.inside].all()
    assert biased.warnings


def test_moments_of_take_off_are_flown_one_by_one(biased: Basin) -> None:
    assert biased.begins.tolist() == [0.0, 0.5]
    assert biased.outcome.shape == (2, 5, 5)
    first = basin_of(timed_gait(), eta=0.8, resolution=5)
    assert np.array_equal(first.outcome[0], biased.outcome[0])
    assert np.array_equal(first.seconds[0], biased.seconds[0])  # the same flights, to the last bit
    assert np.array_equal(biased.settled, (biased.outcome == 0).all(axis=0))
    assert biased.settled.sum() < (biased.outcome[1] == 0).sum()
    assert np.array_equal(biased.worst == 0, biased.settled)
    columns = biased.columns()
    assert [len(values) for values in columns.values()] == [50] * len(columns)
    k = 25 + 3 * 5 + 1  # second moment, fourth roll, second pitch
    row = {name: values[k] for name, values in columns.items()}
    angles = np.radians([-80, -40, 0, 40, 80])
    assert (row["eta"], row["begin"]) == (0.8, 0.5)
    assert (row["roll"], row["pitch"]) == pytest.approx((angles[3], angles[1]))
    assert row["outcome"] == OUTCOMES[biased.outcome[1, 3, 1]]


def test_flights_that_end_once_settled_end_as_whole_ones_do() -> None:
    """A period has all moments of the gait, so that what has settled by then stays so."""
    timed = timed_gait(4)
    basin = basin_of(timed, eta=0.8, resolution=3, extent="60deg", settings=FlightSettings(thrust_limit=4 * SHARE))
    from gaitgraph.flight.course import repeated
    from gaitgraph.flight.gait_file import biased_timed_gait as biased_gait
    from gaitgraph.flight.simulation import Simulation

    simulation = Simulation(repeated(biased_gait(timed, 0.8)), basin.settings)
    for i, j in np.ndindex(3, 3):
        flight = simulation.run((float(basin.angles[i]), float(basin.angles[j])))
        assert flight.outcome == OUTCOMES[basin.outcome[0, i, j]]
        if flight.settled:
            assert flight.settling_time == basin.seconds[0, i, j]
            assert flight.peak_thrust_share == basin.peak_share[0, i, j]


def test_gaits_that_physics_forbids_are_refused_and_fail_anyway() -> None:
    refused = basins_of(timed_gait(1), biases=(1.0, 0.8), resolution=3)
    assert [basin.outcomes for basin in refused] == [{"refused": 9}] * 2
    assert "undecided" in refused[0].refusal
    assert "R changes its sign" in refused[1].refusal
    assert not any(basin.settled.any() or basin.inside.any() for basin in refused)
    assert "refused before take-off" in str(refused[0])
    flown = basin_of(timed_gait(1), resolution=3, anyway=True)
    assert flown.refusal == ""
    assert flown.outcomes == {"near singular": 9}
    assert "9 near singular" in str(flown)


def test_progress_comes_to_one_and_never_goes_back() -> None:
    seen: list[float] = []
    basins_of(timed_gait(), biases=(1.0, 0.9), resolution=2, extent=0.3, progress=seen.append)
    assert seen == sorted(seen)
    assert len(seen) == 8
    assert seen[-1] == 1.0


def test_laws_of_their_own_are_flown_but_not_biased() -> None:
    timed = least_period(timed_gait(3).gait, Limits(rate=5, acceleration=60), rounding=0.1).timed
    assert timed is not None
    assert basin_of(timed, resolution=2, extent=0.3).fraction == 1.0
    with pytest.raises(InputError, match="has no biased gait"):
        basin_of(timed, eta=0.8)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"resolution": 0}, "resolution: 0; allowed is a whole number from 1"),
        ({"resolution": 2.5}, "resolution: 2.5; allowed is a whole number"),
        ({"resolution": 1000}, "are 1000000 flights; allowed are 100000"),
        ({"begins": -1}, "begins: -1; allowed is a whole number from 1"),
        ({"extent": "90deg"}, "extent: '90deg'; allowed is an angle above 0 and below pi/2"),
        ({"extent": -0.1}, "extent: -0.1; allowed is an angle above 0"),
        ({"extent": math.nan}, "extent: nan"),
        ({"settings": FlightSettings(duration=0.5)}, "duration: 0.5 s; allowed is the gait's period, 1 s, or more"),
        ({"eta": 0.0}, "bias: 0.0; allowed is a number above 0, up to 1"),
        ({"eta": "x"}, "bias: 'x'; allowed is a number above 0"),
        ({"settings": FlightSettings(reference="hover")}, "reference: 'hover'; allowed for a basin is attitude"),
        ({"anyway": "yes"}, "anyway: 'yes'; allowed are True and False"),
    ],
)
def test_wrong_values_are_named(asked: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=re.escape(told)):
        basin_of(timed_gait(), **asked)


def test_biases_are_one_number_or_many_each_once() -> None:
    small: dict[str, Any] = {"resolution": 1}
    assert [basin.eta for basin in basins_of(timed_gait(), biases=0.8, **small)] == [0.8]
    assert [basin.eta for basin in basins_of(timed_gait(), biases=iter([1.0, 0.9]), **small)] == [1.0, 0.9]
    for biases, told in (
        ([], "biases: none; allowed is one or more"),
        ([0.8, 1.0, 0.8], "bias: 0.8 is there twice; allowed is each once"),
        ("0.8", "biases: '0.8'; allowed are numbers"),
        (None, "biases: None; allowed are numbers"),
    ):
        with pytest.raises(InputError, match=re.escape(told)):
            basins_of(timed_gait(), biases=biases, **small)  # type: ignore[arg-type]


def test_a_basin_warns_as_a_flight_does() -> None:
    basin = basin_of(timed_gait(), resolution=1, settings=FlightSettings(servo_lag=1.0))
    assert ["the servos do not follow" in one for one in basin.warnings] == [True]


def test_what_cannot_fly_at_all_is_refused() -> None:
    with pytest.raises(InputError, match="gait: .*; allowed is a timed gait"):
        basin_of(timed_gait().gait)
    with pytest.raises(MissingConstant, match="mass"):
        basin_of(timed_gait(mass=None))


def test_the_map_marks_each_outcome_with_a_shape_of_its_own(biased: Basin) -> None:
    assert tuple(_LOOKS) == OUTCOMES  # codes count them
    assert len({look["marker"] for look in _LOOKS.values()}) == len(OUTCOMES)
    ax = basin_map(biased, name="Gait 3")
    marks = {line.get_marker(): np.asarray(line.get_data()) for line in ax.lines if line.get_gid() == "outcome"}
    assert sum(places.shape[1] for places in marks.values()) == 25
    drawn = sorted(map(tuple, np.round(marks["o"].T, 9).tolist()))
    grid = [(i, j) for i, j in np.ndindex(5, 5) if biased.settled[i, j]]
    assert drawn == [tuple(np.round(biased.angles[[i, j]], 9).tolist()) for i, j in grid]
    assert "Gait 3" in ax.get_title()
    assert any(line.get_gid() == "acceptable" for line in ax.lines)
    with pytest.raises(InputError, match="basins: none"):
        basins_figure([])


def test_the_map_has_the_reports_numbers_and_the_sheets_color(biased: Basin) -> None:
    blue = basin_of(timed_gait(1), resolution=3)
    red = basin_of(timed_gait(3), resolution=2, extent=0.3)
    for basin, color in ((blue, COLOR_OF["blue"]), (red, COLOR_OF["red"]), (biased, GREY)):
        ax = basin_map(basin)
        lines = [line for line in ax.lines if line.get_gid() in ("acceptable", "singular")]
        assert {line.get_color() for line in lines} == {color}
        (border,) = [line for line in lines if line.get_gid() == "acceptable"]
        told = round(basin.acceptable_fraction * basin.inside.size)
        assert border.get_label() == f"acceptable: {told} of {basin.inside.size} attitudes"
    assert blue.acceptable_fraction == 0.0


def test_little_of_the_picture_is_empty(biased: Basin) -> None:
    for basins in ([biased], [biased] * 5):
        picture = plt.imread(io.BytesIO(picture_bytes(basins_figure(basins), "png")))
        drawn = np.flatnonzero((picture[..., :3] < 0.9).any(axis=(1, 2)))
        assert drawn[0] < 0.03 * len(picture)
        assert drawn[-1] > 0.95 * len(picture)


def test_files_hold_one_row_a_flight(biased: Basin, tmp_path: Path) -> None:
    import csv

    names = [tmp_path / f"basin.{suffix}" for suffix in ("csv", "json", "npz", "mat", "parquet", "svg")]
    write_basins([biased, biased], names)
    with names[0].open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 100
    assert [row["outcome"] for row in rows[:50]] == list(biased.columns()["outcome"])
    assert json.loads(names[1].read_text())["columns"]["seconds"][:50] == biased.columns()["seconds"].tolist()
    with np.load(names[2]) as arrays:
        assert np.array_equal(arrays["roll"][:50], biased.columns()["roll"])
    parquet = pytest.importorskip("pyarrow.parquet").read_table(names[4])
    assert parquet.column("outcome").to_pylist()[:50] == list(biased.columns()["outcome"])
    before = [name.read_bytes() for name in names]
    write_basins([biased, biased], names, force=True)
    assert [name.read_bytes() for name in names] == before
    assert len(table_of_basins([biased])) == 50
    with pytest.raises(OutputExists, match="exists"):
        write_basins([biased], names[:1])
    with pytest.raises(InputError, match=r"allowed for a basin are .csv"):
        write_basins([biased], [tmp_path / "basin.gif"])


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stopped:
        main([*arguments])
    return int(stopped.value.code or 0)


@pytest.fixture
def gait_file(tmp_path: Path) -> str:
    timed_gait(3).write(tmp_path / "gait3.csv")
    return str(tmp_path / "gait3.csv")


def test_the_command_tells_what_settled(gait_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "basin.csv"
    asked = ["basin", gait_file, "--bias", "0.8", "--resolution", "3", "--extent", "80deg"]
    assert run(*asked, "--output", str(table), "--thrust-limit", str(4 * SHARE)) == 0
    told = capsys.readouterr()
    assert told.err == ""
    assert "Basin of the gait itself: 3 by 3 attitudes, roll and pitch up to 80°: " in told.out
    assert "Basin of biased by 0.8" in told.out
    assert f"wrote {table}" in told.out
    assert told.out.count("warning: ") == 1
    assert "warning: biased by 0.8 it is off the surfaces: max(|Rφ|, |Rθ|) = 0.71, allowed 0.002\n" in told.out
    assert len(table.read_text().splitlines()) == 1 + 18
    assert run("basin", gait_file, "--bias", "0.8", "--resolution", "2", "--json", "--begins", "2") == 0
    answer = json.loads(capsys.readouterr().out)
    gait, biased = answer["basins"]
    assert (gait["eta"], gait["fraction"], gait["period"]) == (1.0, 1.0, 1.0)
    assert biased["acceptable_fraction"] < 1.0
    assert sum(biased[case] for case in CASES) == 4
    assert len(biased["flights"]["outcome"]) == 8
    assert answer["settings"]["control_rate"] == 1000.0
    assert gait["warnings"] == []
    assert len(biased["warnings"]) == 1
    rows = Path(gait_file).read_text().splitlines()
    Path(gait_file).write_text("\n".join([*rows[:20], *rows[30:]]))  # which leaves a jump
    assert run("basin", gait_file, "--resolution", "1", "--json") == 0
    (gait,) = json.loads(capsys.readouterr().out)["basins"]
    assert "times of the table are those of no law" in gait["warnings"][-1]


def test_the_command_refuses_blue_with_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    timed_gait(2).write(tmp_path / "gait2.csv")
    assert run("basin", str(tmp_path / "gait2.csv"), "--resolution", "3") == 1
    assert "refused before take-off: " in capsys.readouterr().out
    assert run("basin", str(tmp_path / "gait2.csv"), "--resolution", "3", "--anyway") == 0
    assert "0.0 % settled" in capsys.readouterr().out


def test_requests_and_the_gaits_of_the_paper_have_basins_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("basin", "gait4", "--resolution", "1", "--json", "--period", "0.5") == 0
    (basin,) = json.loads(capsys.readouterr().out)["basins"]
    assert (basin["period"], basin["outcomes"]) == (0.5, {"settled": 1})
    assert run("basin", "gait5", "--resolution", "1") == 2
    assert "'gait5'; allowed is a gait file, a request, or gait1, gait2, gait3, gait4" in capsys.readouterr().err
    request = tmp_path / "nothing.toml"
    request.write_text('waypoints = [["0.1", "0.1"], ["1.2", "-1.2"]]\ncolor = "red"\n')
    assert run("basin", str(request)) == 1
    assert capsys.readouterr().out.startswith("there is no gait to fly: ")
    assert run("basin", str(request), "--json") == 1
    assert json.loads(capsys.readouterr().out)["basins"] == []


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--resolution", "0"], "--resolution: 0"),
        (["--extent", "2"], "--extent: '2'; allowed is an angle above 0 and below pi/2"),
        (["--bias", "2"], "--bias: 2.0; allowed is a number above 0, up to 1"),
        (["--duration", "0.5"], "--duration: 0.5 s; allowed is the gait's period, 1 s, or more"),
        (["--attitude-damping", "3000"], "--attitude-damping: 3000.0 is unstable at 1000 Hz"),
        (["--thrust-limit", "-1"], "--thrust-limit: -1.0; allowed is 1e-09 to 1e+09 (N)"),
        (["--servo-rate", "x"], "--servo-rate: 'x'"),
        (["--output", "basin.gif"], "output: 'basin.gif'; allowed for a basin are .csv"),
        (["--output", "basin.cvs"], "did you mean '.csv'?"),
        (["--settings", "nothing.toml"], "settings file: cannot read 'nothing.toml'"),
        (["--period", "-1"], "gaitgraph: --period: -1.0"),
        (["--period", "1s"], "--period: '1s'; allowed is a number of seconds"),
        (["--law", "smoth"], "gaitgraph: --law: 'smoth'; allowed are"),
        (["--bias", "1"], "--bias: 1; allowed are others"),
        (["--bias", "0.8", "--bias", "0.8"], "--bias: 0.8 is there twice"),
        (
            ["--thrust-limit", "5", "--no-saturation"],
            "--thrust-limit: 5 with --no-saturation; allowed is one of the two",
        ),
    ],
)
def test_wrong_options_are_one_line(
    options: list[str], told: str, gait_file: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("basin", gait_file, *options) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert told in err


def test_settings_come_from_a_file_and_options_go_before_it(
    gait_file: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "flight.toml"
    file.write_text("[flight]\nduration = 2\nfloor = 0.02\n")
    asked = ["basin", gait_file, "--settings", str(file), "--resolution", "1", "--json"]
    assert run(*asked, "--floor", "0.03", "--no-saturation") == 0
    settings = json.loads(capsys.readouterr().out)["settings"]
    assert (settings["duration"], settings["floor"], settings["saturation"]) == (2.0, 0.03, False)
    for content, told in (
        ("[flights]\nduration = 2\n", "'flights'; allowed is one table [flight]; did you mean 'flight'?"),
        ("duration = 2\n", "'duration'; allowed is one table [flight], with settings in it"),
        ("flight = 3\n", "flight: 3; allowed is a table of settings by name"),
        ("[flight]\ndamping = 2\n", "damping: no setting of a flight"),
        ("[flight]\nduration = -2\n", "duration: -2; allowed is 0.001 to 10000 (s)"),
        ('[flight]\nreference = "hover"\n', "reference: 'hover'; allowed for a basin is attitude"),
        ("[flight\n", "it is not TOML"),
    ):
        file.write_text(content)
        assert run(*asked) == 2
        error = capsys.readouterr().err
        assert told in error
        assert str(file) in error
