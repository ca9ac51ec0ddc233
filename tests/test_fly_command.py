"""The command fly: what settles, gait files and their times, options, tables; and the numbers of its page."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.errors import FileWarning
from gaitgraph.flight.course import biased_timed_gait
from gaitgraph.flight.flight import FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.timing.curve import rounded
from gaitgraph.timing.timed_gait import ROW_BY_ROW, RowTimedGait, timed_gait_of
from tests.samples import cases, gait_of_paper, write_rows

SHORT = FlightSettings(duration=0.5)
PAGE = Path(__file__).parent.parent / "docs" / "guide" / "flight.md"
LOOP = "waypoints = [[-0.4, 0.4], [-0.4, 1.2], [-1.2, 1.2]]\nperiod = 2.0\n"


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("loop.toml").write_text(LOOP)


def test_a_loop_through_waypoints_settles(run: Any) -> None:
    done = run("fly", "loop.toml", "--json")
    assert (done.code, done.err) == (0, "")
    assert [*done.json][:2] == ["settled", "reason"]
    answer = [done.json[name] for name in ("settled", "reason", "warnings", "attitude")]
    assert answer == [True, "", [], [0.3, -0.2]]


@pytest.mark.parametrize(
    ("options", "said"),
    cases("""
gait1 | refused before take-off: sign of R undecided
gait1 --anyway --output f.csv | nothing was flown, so f.csv is not written
gait1 --anyway | nears singularity at 0.000 s
gait1 --anyway | warning: flown although it is not flyable: sign of R und
gait3 --from-hover | every flight between them passes a singular matrix
"""),
)
def test_what_cannot_fly_is_refused_before_take_off_or_fails(
    run: Any, options: str, said: str
) -> None:
    done = run("fly", *options.split())
    assert done.code == 1
    assert said in done.out


def test_gait_4_is_entered_from_hover_and_left(run: Any) -> None:
    done = run("fly", "gait4", "--from-hover", "--json").json
    assert (done["settled"], done["duration"]) == (True, 6.0)
    assert done["attitude"] == [0.0, 0.0]


def test_the_numbers_of_the_page_on_flight() -> None:
    row = r"^\| (Gait [^|]*?)(?: \([^|]*)? \| (settles) \| (.*?) \| (.*?) \| (.*?) \|$"
    rows = {cells[0]: cells[1:] for cells in re.findall(row, PAGE.read_text(), re.M)}
    for name, number, bias, settings in (
        ("Gait 3", 3, 1.0, {}),
        ("Gait 3 biased by 0.8", 3, 0.8, {}),
        ("Gait 4", 4, 1.0, {}),
        ("Gait 4 biased by 0.8", 4, 0.8, {}),
        ("Gait 2 biased by 0.8, `--anyway`", 2, 0.8, {"floor": 0.01}),
    ):
        flight = flown(number, bias, **settings)
        assert rows[name] == (
            "settles",
            f"{flight.settling_time:.2f} s",
            f"{flight.peak_thrust_share:.2f} shares",
            f"{flight.least_singular_value:.3f}",
        )
    low, high = flown(1, floor=0.0), flown(2, floor=0.0)
    assert low.outcome in ("sign change", "near singular")  # rounding decides
    assert low.flown < 2.0
    assert low.peak_thrust_share > 10_000
    assert high.column("z")[-1] > 100.0
    stops = flown(1, 0.8, floor=0.01)
    assert "nears singularity" in stops.reason
    assert stops.flown < 0.2


def flown(number: int, bias: float = 1.0, **settings: Any) -> Any:
    timed = gait_of_paper(number).biased(bias).parametrize(1.0)
    return fly(timed, anyway=bool(settings), settings=FlightSettings(**settings))


def test_the_period_and_the_bias_are_those_asked_for(run: Any) -> None:
    gait = gait_of_paper(3)
    for option, timed in (
        ("--period", gait.parametrize(0.8)),
        ("--bias", gait.biased(0.8).parametrize(1.0)),
    ):
        told = run("fly", "gait3", option, 0.8, "--duration", 0.5, "--json").json
        assert told["peak_thrust"] == fly(timed, settings=SHORT).peak_thrust


@pytest.mark.parametrize("factor", [1, 1.01])
@pytest.mark.parametrize("is_law", [True, False])
def test_only_a_table_that_states_no_law_of_its_rows_has_a_warning(
    is_law: bool, factor: float
) -> None:
    gait = gait_of_paper(4)
    if is_law:
        limits = gg.Limits(rate=6, acceleration=60)
        made: Any = gg.paced(gait, limits, rounding="2deg").timed
    else:
        curve = rounded(gait, 0.05).curve  # its corners are too many to be stated
        made = curve.polyline(1e-7).parametrize(1.0, samples=200)
    made.write("a.json")
    table = json.loads(Path("a.json").read_text())
    table["columns"]["t"] = [factor * t for t in table["columns"]["t"]]
    Path("a.json").write_text(json.dumps(table))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)
        timed = timed_gait_of("a.json")
    assert isinstance(timed, RowTimedGait) != (is_law and factor == 1)
    said = " ".join(fly(timed, settings=SHORT, anyway=True).warnings)
    assert ("no built-in law" in said) == (factor != 1)


def test_another_table_flies_straight_from_row_to_row(run: Any) -> None:
    times = np.array([0.0, 0.3, 0.4, 0.9, 1.0])
    gait = gait_of_paper(4)
    rows = np.array([*gait.alpha, gait.alpha[0]])
    write_rows(Path("rows.csv"), np.column_stack([times, rows]))
    timed = timed_gait_of("rows.csv")
    assert timed.law == ROW_BY_ROW
    np.testing.assert_allclose(timed.at(times[:4]).alpha, rows[:4], atol=1e-12)
    middle = timed.at(0.15).alpha
    np.testing.assert_allclose(middle, (rows[0] + rows[1]) / 2, atol=1e-12)
    assert timed.check().flyable
    half = biased_timed_gait(timed, 0.5).at(0.15).alpha
    np.testing.assert_allclose(half, middle * [1, 1, 0.5, 0.5], atol=1e-12)
    said = "warning: the timing matches no built-in law: 4 rows are flown straight"
    assert said in run("fly", "rows.csv", "--duration", 0.6).out
    # With a new law it has a law again.
    assert timed_gait_of("rows.csv", law="smooth").period == 1.0


def test_a_table_that_is_not_closed_has_a_message(run: Any) -> None:
    """A quarter of a gait: the path back has one mean step of time."""
    timed = gait_of_paper(4).parametrize(1.0, samples=40)
    rows = np.column_stack([timed.t, timed.alpha])[:16]
    write_rows(Path("open.csv"), rows)
    write_rows(Path("closed.csv"), np.vstack([rows, [0.6, *rows[0, 1:]]]))
    jump = np.linalg.norm(rows[15, 1:] - rows[0, 1:])
    said = f"warning: the table is not closed: the {jump:.3g} rad from its last row back to the first are flown within 0.025 s"
    assert said in run("fly", "open.csv").out
    half = fly(biased_timed_gait(timed_gait_of("open.csv"), 0.9), settings=SHORT)
    assert any("is not closed: the 1." in warning for warning in half.warnings)
    assert "is not closed" not in run("fly", "closed.csv", "--duration", 0.6).out


def test_a_point_needs_no_period_and_a_saved_plan_states_it(run: Any) -> None:
    write_rows(Path("point.csv"), gait_of_paper(4).alpha[:1])
    assert timed_gait_of("point.csv").period == timed_gait_of("gait2").period == 1.0
    Path("plan.json").write_text(run("plan", "loop.toml", "--json").out)
    assert timed_gait_of("plan.json").period == 2.0
    assert timed_gait_of("plan.json", period=3.0).period == 3.0


def test_settings_come_from_a_file_and_options_go_before_it(run: Any) -> None:
    calm = '[flight]\nreference = "hover"\nduration = -1\nattitude_noise = "0.1deg"\n'
    Path("calm.toml").write_text(calm)
    # They are judged together: an option may replace what is wrong in the file.
    options = ("--settings", "calm.toml", "--duration", 0.3, "--output", "a.json")
    assert run("fly", "gait4", *options).code == 0
    stated = json.loads(Path("a.json").read_text())["about"]["flight"]
    assert (stated["reference"], stated["duration"]) == ("hover", 0.3)
    assert stated["attitude_noise"] == pytest.approx(np.radians(0.1))
    Path("bad.toml").write_text("[flight]\ncontrol_rate = 2000\n")
    wrong = run("fly", "gait3", "--settings", "bad.toml")
    assert (wrong.code, wrong.out, wrong.err.count("\n")) == (2, "", 1)
    said = "control_rate must be 1000 Hz divided by a whole"
    assert f"flight file 'bad.toml': {said}" in wrong.err


def test_a_flights_file_plans_its_gait_again_but_is_no_gait(run: Any) -> None:
    outputs = ("--output", "flight.csv", "--output", "flight.mat")
    assert run("fly", "loop.toml", "--duration", 0.2, *outputs).code == 1
    for name in ("flight.csv", "flight.mat"):
        assert run("plan", name, "--json").json["request"]["period"] == 2.0
    refused = run("fly", "flight.csv")
    assert refused.code == 2
    said = (
        "must be the table of a gait, got that of a flight; gaitgraph plan flight.csv"
    )
    assert said in refused.err
    run("fly", "gait3", "--duration", 0.02, "--output", "paper.csv")
    answer = run("plan", "paper.csv")
    assert (answer.code, answer.out) == (2, "")
    assert "got none (it was made by fly)" in answer.err
