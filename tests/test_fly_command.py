"""The command fly: what settles, gait files and their times, options, tables; and the numbers of its page."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from gaitgraph.errors import FileWarning, InputError
from gaitgraph.flight.course import biased_timed_gait
from gaitgraph.flight.flight import FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.timing.curve import rounded
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import paced
from gaitgraph.timing.timed_gait import ROW_BY_ROW, RowTimedGait, timed_gait_of
from tests.published import GAITS
from tests.samples import gait_of_paper, write_rows

if TYPE_CHECKING:
    from gaitgraph.flight.flight import Flight

SHORT = FlightSettings(duration=0.5)


def request_of(number: int) -> str:
    points = ", ".join(f"[{a!r}, {b!r}]" for a, b in GAITS[number - 1].angles)
    sign = "positive" if number == 4 else "negative"
    return f'waypoints = [{points}]\ncolor = "red"\nsign = "{sign}"\n'


def test_a_loop_through_waypoints_settles(run: Any, tmp_path: Path) -> None:
    (tmp_path / "loop.toml").write_text(request_of(3))
    done = run("fly", "loop.toml", "--json")
    assert (done.code, done.err) == (0, "")
    assert list(done.json)[:2] == ["settled", "reason"]
    answer = [done.json[name] for name in ("settled", "reason", "warnings", "attitude")]
    assert answer == [True, "", [], [0.3, -0.2]]


def test_blue_gaits_are_refused_before_take_off_and_fail_anyway(run: Any) -> None:
    refused = run("fly", "gait1", "--output", "flight.csv")
    assert refused.code == 1
    assert "refused before take-off: sign of R undecided" in refused.out
    assert "nothing was flown, so flight.csv is not written" in refused.out
    anyway = run("fly", "gait1", "--anyway")
    assert anyway.code == 1
    assert "stopped: the decoupling matrix nears singularity at 0.000 s" in anyway.out
    assert (
        "warning: flown although it is not flyable: sign of R undecided" in anyway.out
    )


def test_gait_4_is_entered_from_hover_and_left_and_gait_3_cannot_be(run: Any) -> None:
    done = run("fly", "gait4", "--from-hover", "--periods", 1, "--json").json
    assert (done["settled"], done["duration"], done["attitude"]) == (
        True,
        5.0,
        [0.0, 0.0],
    )
    refused = run("fly", "gait3", "--from-hover")
    assert refused.code == 1
    assert (
        "every flight between them passes a singular matrix, at any attitude"
        in refused.out
    )


def test_the_numbers_of_the_page_on_flight() -> None:
    page = (Path(__file__).parent.parent / "docs" / "guide" / "flight.md").read_text()
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in page.splitlines()
        if line[:1] == "|"
    ]
    rows = {cell[0].split(" (")[0]: cell[1:] for cell in cells if len(cell) == 5}

    def flown(number: int, eta: float = 1.0, **settings: Any) -> Flight:
        timed = gait_of_paper(number).biased(eta).parametrize(1.0)
        return fly(timed, anyway=bool(settings), settings=FlightSettings(**settings))

    flights = {
        "Gait 3": flown(3),
        "Gait 3 biased by 0.8": flown(3, 0.8),
        "Gait 4": flown(4),
    }
    flights |= {
        "Gait 4 biased by 0.8": flown(4, 0.8),
        "Gait 2 biased by 0.8, `--anyway`": flown(2, 0.8, floor=0.01),
    }
    for name, flight in flights.items():
        time, share, least = (
            flight.settling_time,
            flight.peak_thrust_share,
            flight.least_singular_value,
        )
        row = ["settles", f"{time:.2f} s", f"{share:.2f} shares", f"{least:.3f}"]
        assert rows[name] == row, name
    low, high, stops = (
        flown(1, floor=0.0),
        flown(2, floor=0.0),
        flown(1, 0.8, floor=0.01),
    )
    assert "its determinant has changed sign" in low.reason
    assert (low.flown < 2.0, (low.peak_thrust_share or 0) > 10_000) == (True, True)
    assert (high.column("z")[-1] > 100.0, (high.peak_thrust_share or 0) > 1000) == (
        True,
        True,
    )
    assert ("nears singularity" in stops.reason, stops.flown < 0.2) == (True, True)


def test_a_table_of_a_law_flies_as_that_law(tmp_path: Path) -> None:
    for law in ("smooth", "constant-speed", "equal-time"):
        timed = gait_of_paper(4).parametrize(1.5, law=law, samples=40)
        timed.write(tmp_path / "stated.csv", force=True)
        write_rows(tmp_path / "bare.csv", np.column_stack([timed.t, timed.alpha]))
        t = np.linspace(0.0, 3.0, 31)
        read = timed_gait_of(tmp_path / "stated.csv")
        np.testing.assert_allclose(read.at(t).alpha, timed.at(t).alpha, atol=1e-12)
        bare = timed_gait_of(tmp_path / "bare.csv")  # which states no law
        assert isinstance(bare, RowTimedGait)
        assert bare.period == pytest.approx(1.5)
        np.testing.assert_allclose(bare.at(timed.t).alpha, timed.alpha, atol=1e-12)


def test_only_a_table_that_states_no_law_of_its_rows_has_a_warning(
    tmp_path: Path,
) -> None:
    gait = gait_of_paper(4)
    law = paced(gait, Limits(rate=6, acceleration=60), rounding="2deg").timed
    curve = rounded(gait, 0.05).curve.polyline(
        1e-7
    )  # its corners are too many to be stated
    assert law is not None
    for made in (law, curve.parametrize(1.0, samples=200)):
        made.write(tmp_path / "a.json", force=True)
        table = json.loads((tmp_path / "a.json").read_text())
        for factor in (1, 1.01):
            table["columns"]["t"] = [factor * t for t in table["columns"]["t"]]
            (tmp_path / "a.json").write_text(json.dumps(table))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FileWarning)
                timed = timed_gait_of(tmp_path / "a.json")
            is_law = factor == 1 and made is law
            assert isinstance(timed, RowTimedGait) is not is_law
            warned = any(
                "no built-in law" in one
                for one in fly(timed, settings=SHORT, anyway=True).warnings
            )
            assert warned is (factor != 1)


def test_another_table_flies_straight_from_row_to_row(run: Any, tmp_path: Path) -> None:
    times = np.array([0.0, 0.3, 0.4, 0.9, 1.0])
    rows = np.array([*gait_of_paper(4).alpha, gait_of_paper(4).alpha[0]])
    write_rows(tmp_path / "rows.csv", np.column_stack([times, rows]))
    timed = timed_gait_of(tmp_path / "rows.csv")
    assert timed.law == ROW_BY_ROW
    np.testing.assert_allclose(timed.at(times[:4]).alpha, rows[:4], atol=1e-12)
    np.testing.assert_allclose(
        timed.at([0.15]).alpha[0], (rows[0] + rows[1]) / 2, atol=1e-12
    )
    assert timed.check().flyable
    half = biased_timed_gait(timed, 0.5)
    assert half.at([0.15]).alpha[0, 2] == pytest.approx(
        timed.at([0.15]).alpha[0, 2] / 2
    )
    done = run("fly", "rows.csv", "--duration", 0.6)
    assert (
        "warning: the timing matches no built-in law: 4 rows are flown straight"
        in done.out
    )
    # With a new period or law it has a law again.
    assert timed_gait_of(tmp_path / "rows.csv", law="smooth").period == 1.0


def test_a_table_that_is_not_closed_has_a_message(run: Any, tmp_path: Path) -> None:
    """A quarter of a gait: the path back has one mean step of time."""
    timed = gait_of_paper(4).parametrize(1.0, samples=40)
    rows = np.column_stack([timed.t, timed.alpha])
    tables = {
        "open": rows[:16],
        "closed": np.vstack([rows[:16], [0.6, *rows[0, 1:]]]),
    }
    for name, part in tables.items():
        write_rows(tmp_path / f"{name}.csv", part)
    jump = np.linalg.norm(rows[15, 1:] - rows[0, 1:])
    message = f"the {jump:.3g} rad from its last row back to the first are flown within 0.025 s"
    assert f"warning: the table is not closed: {message}" in run("fly", "open.csv").out
    half = fly(
        biased_timed_gait(timed_gait_of(tmp_path / "open.csv"), 0.9), settings=SHORT
    )
    assert [
        one
        for one in half.warnings
        if one.startswith("the table is not closed: the 1.")
    ]
    whole = fly(
        timed_gait_of(tmp_path / "closed.csv"), settings=FlightSettings(duration=1.0)
    )
    (warning,) = whole.warnings
    assert warning.startswith("the timing matches no built-in law: 16 rows")


def test_a_gait_without_times_needs_a_period(run: Any, tmp_path: Path) -> None:
    write_rows(tmp_path / "rows.csv", gait_of_paper(3).alpha)
    with pytest.raises(InputError, match="has no column t; set period= "):
        timed_gait_of("rows.csv", law="smooth")
    assert timed_gait_of("rows.csv", period=1.0).law == "smooth"
    # A point needs none; a saved plan states its request, and that the period.
    write_rows(tmp_path / "point.csv", gait_of_paper(4).alpha[:1])
    assert timed_gait_of("point.csv").period == timed_gait_of("gait2").period == 1.0
    (tmp_path / "loop.toml").write_text(request_of(4) + "period = 2.0\n")
    (tmp_path / "plan.json").write_text(run("plan", "loop.toml", "--json").out)
    assert timed_gait_of(tmp_path / "plan.json").period == 2.0
    assert timed_gait_of(tmp_path / "plan.json", period=3.0).period == 3.0


def test_settings_come_from_a_file_and_options_go_before_it(
    run: Any, tmp_path: Path
) -> None:
    (tmp_path / "calm.toml").write_text(
        '[flight]\nreference = "hover"\nduration = 0.7\nattitude_noise = "0.1deg"\n'
    )
    (tmp_path / "fast.toml").write_text("[flight]\ncontrol_rate = 2000\n")
    (tmp_path / "long.toml").write_text("[flight]\nduration = -1\n")
    (tmp_path / "bad.toml").write_text("[flight]\nattitude_damping = 3000\n")

    def flown(file: str, *options: object, code: int) -> Any:
        done = run(
            "fly",
            "gait4",
            "--settings",
            file,
            *options,
            "--output",
            "a.json",
            "--force",
        )
        assert done.code == code, done.err
        return json.loads((tmp_path / "a.json").read_text())["about"]["flight"]

    calm = flown("calm.toml", "--duration", 0.3, code=0)
    assert (calm["reference"], calm["duration"]) == ("hover", 0.3)
    assert calm["attitude_noise"] == pytest.approx(np.radians(0.1))
    # They are judged together: an option may replace what is wrong, or does not fit, in the file. None settles yet.
    assert flown("long.toml", "--duration", 0.01, code=1)["duration"] == 0.01
    for options, message in (
        (
            ["fast.toml"],
            "flight file 'fast.toml': control_rate must be 1000 Hz divided by a whole number",
        ),
        (["long.toml"], "flight file 'long.toml': duration must be between 0.001"),
        (["bad.toml"], "flight file 'bad.toml': attitude_damping must be between"),
    ):
        wrong = run("fly", "gait3", "--settings", *options)
        assert (wrong.code, wrong.out, wrong.err.count("\n")) == (2, "", 1)
        assert message in wrong.err
    drifts = []
    for seed in (3, 4):
        settings = f"wind = [-1, 0.5]\ngust = 0.3\nseed = {seed}\nduration = 0.2\n"
        (tmp_path / "wind.toml").write_text(settings)
        flight = run("fly", "gait4", "--settings", "wind.toml", "--json")
        drifts.append(flight.json["drift"])
    assert drifts[0] != drifts[1]


def test_a_flights_file_plans_its_gait_again_but_is_no_gait(
    run: Any, tmp_path: Path
) -> None:
    (tmp_path / "loop.toml").write_text(request_of(4) + "period = 2.0\n")
    outputs = ["flight.csv", "flight.mat"]
    assert (
        run(
            "fly",
            "loop.toml",
            "--duration",
            0.2,
            *(x for name in outputs for x in ("--output", name)),
        ).code
        == 1
    )
    for name in outputs:
        again = run("plan", name, "--json")
        assert again.json["request"]["period"] == 2.0
        assert again.json["color"] == "red"
    refused = run("fly", "flight.csv")
    assert refused.code == 2
    assert (
        "must be the table of a gait, got that of a flight; gaitgraph plan flight.csv"
        in refused.err
    )
    assert run("fly", "gait3", "--duration", 0.02, "--output", "paper.csv").code == 1
    answer = run("plan", "paper.csv")
    assert (answer.code, answer.out) == (2, "")
    assert "got none (it was made by fly)" in answer.err
