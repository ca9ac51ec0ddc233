"""The command fly, what it writes, and the pictures of flights."""

from __future__ import annotations

import csv
import errno
import json
import os
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

import gaitgraph as gg
from gaitgraph.flight.engine import quaternion_of, rendered_frames
from gaitgraph.flight.gait_file import ROW_BY_ROW, RowTimedGait, biased_timed_gait, timed_gait_from_file
from gaitgraph.flight.record import COLUMNS, Flight
from gaitgraph.flight.settings import FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.gait.paper_gaits import paper_gait
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.flight_films import _clock_of, _Drawing, write_film
from gaitgraph.plots.flight_outputs import write_flight
from gaitgraph.plots.flights import flights_side_by_side, name_of_flight, plot_flight
from gaitgraph.plots.gif_films import provenance_of_gif
from gaitgraph.vehicle import PAPER
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Iterator

PUBLISHED = coefficients_of(PAPER)
SHORT = FlightSettings(duration=0.5)
CORNERS = [[1.178, -1.178], [1.178, -0.393], [0.393, -0.393], [0.393, -1.178]]


def gait(number: int) -> gg.Gait:
    return paper_gait(number, PAPER, PUBLISHED)


def printed(number: int) -> gg.Gait:
    """Return a gait with α3 and α4 as the paper prints them."""
    here = GAITS[number - 1]
    return gg.Gait(alpha=np.column_stack([here.angles, here.printed]), coefficients=PUBLISHED)


@pytest.fixture(scope="module")
def levelling() -> Flight:
    return fly(gait(3).parametrize(1.0), settings=SHORT)


@pytest.fixture(scope="module")
def circling() -> Flight:
    settings = FlightSettings(reference="circle", size=0.3, lap=1.0, duration=1.2)
    return fly(gait(4).parametrize(1.0), attitude=(0.2, -0.1), settings=settings)


def request_of(number: int) -> str:
    points = ", ".join(f"[{a!r}, {b!r}]" for a, b in GAITS[number - 1].angles)
    sign = "positive" if number == 4 else "negative"
    return f'waypoints = [{points}]\ncolor = "red"\nsign = "{sign}"\n'


# ---------------------------------------------------------------- what the issue expects, by the command line


@pytest.mark.parametrize(("number", "peak", "least"), [(3, 2.9, 0.45), (4, 2.6, 0.32)])
def test_loops_through_the_waypoints_of_the_red_gaits_settle(
    run: Any, tmp_path: Path, number: int, peak: float, least: float
) -> None:
    (tmp_path / "loop.toml").write_text(request_of(number))
    done = run("fly", "loop.toml", "--json")
    assert done.code == 0
    assert done.err == ""
    assert list(done.json)[:2] == ["settled", "reason"]
    assert done.json["settled"] is True
    assert done.json["reason"] == ""
    assert done.json["warnings"] == []
    assert done.json["attitude"] == [0.3, -0.2]
    assert done.json["peak_thrust_share"] == pytest.approx(peak, abs=0.05)
    assert done.json["least_singular_value"] == pytest.approx(least, abs=0.005)
    assert done.json["settling_time"] == pytest.approx(0.44, abs=0.03)


@pytest.mark.parametrize("number", [1, 2])
def test_blue_gaits_are_refused_before_take_off_and_fail_anyway(run: Any, number: int) -> None:
    refused = run("fly", f"gait{number}", "--output", "flight.csv")
    assert refused.code == 1
    assert "refused before take-off: sign of R undecided" in refused.out
    assert "nothing was flown, so flight.csv is not written" in refused.out
    told = run("fly", f"gait{number}", "--json").json
    assert told["settled"] is False
    assert told["refused"] is True
    assert told["peak_thrust"] is None
    anyway = run("fly", f"gait{number}", "--anyway")
    assert anyway.code == 1
    assert "stopped: the decoupling matrix nears singularity at 0.000 s" in anyway.out
    assert "warning: it is not flyable: sign of R undecided" in anyway.out
    assert "flown although" not in anyway.out  # for not one step was


def test_without_a_floor_the_blue_gait_flies_into_the_singular_matrix(run: Any) -> None:
    told = run("fly", "gait1", "--anyway", "--floor", 0, "--json").json
    assert "its determinant has changed sign" in told["reason"]
    assert 0.5 < told["duration"] < 3.0
    assert told["peak_thrust_share"] > 1000


def test_gait_4_is_entered_from_hover_and_left_and_gait_3_cannot_be(run: Any, tmp_path: Path) -> None:
    done = run("fly", "gait4", "--from-hover", "--periods", 1, "--json").json
    assert done["settled"] is True
    assert done["duration"] == 5.0
    assert done["attitude"] == [0.0, 0.0]
    refused = run("fly", "gait3", "--from-hover")
    assert refused.code == 1
    assert "every flight between them passes a singular matrix, at any attitude" in refused.out
    anyway = run("fly", "gait3", "--from-hover", "--anyway", "--output", "entry.csv")
    assert anyway.code == 1
    assert "stopped: the decoupling matrix nears singularity at 1.28" in anyway.out
    with (tmp_path / "entry.csv").open(newline="") as stream:
        last = list(csv.DictReader(stream))[-1]
    assert 1.27 < float(last["t"]) < 1.29
    assert float(last["nearness"]) < 0.02


def test_a_biased_gait_flies_and_says_that_it_is_off_the_surfaces(run: Any) -> None:
    done = run("fly", "gait3", "--bias", 0.8, "--json").json
    assert done["settled"] is True
    assert done["peak_thrust_share"] == pytest.approx(2.62, abs=0.01)
    (warning,) = done["warnings"]
    assert warning.startswith("biased by 0.8 it is off the surfaces: max(|Rφ|, |Rθ|) = 0.71, allowed 0.002")


def test_the_page_on_flight_tells_the_numbers() -> None:
    page = (Path(__file__).parent.parent / "docs" / "flight.md").read_text()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line[:1] == "|"]
    rows = {cell[0].split(" (")[0]: cell[1:] for cell in cells if len(cell) == 5}

    def told(number: int, eta: float = 1.0, **settings: Any) -> Flight:
        return fly(
            gait(number).biased(eta).parametrize(1.0), anyway=bool(settings), settings=FlightSettings(**settings)
        )

    flights = {"Gait 3": told(3), "Gait 3 biased by 0.8": told(3, 0.8), "Gait 4": told(4)}
    flights |= {"Gait 4 biased by 0.8": told(4, 0.8), "Gait 2 biased by 0.8, `--anyway`": told(2, 0.8, floor=0.01)}
    for name, flight in flights.items():
        time, share, least = flight.settling_time, flight.peak_thrust_share, flight.least_singular_value
        told_here = ["settles", f"{time:.2f} s", f"{share:.2f} shares", f"{least:.3f}"]
        assert rows[name] == told_here, name
    low = told(1, floor=0.0)
    assert "its determinant has changed sign" in low.reason
    assert low.flown < 2.0
    assert low.peak_thrust_share is not None
    assert low.peak_thrust_share > 10_000
    high = told(2, floor=0.0)
    assert high.column("z")[-1] > 100.0
    assert high.peak_thrust_share is not None
    assert high.peak_thrust_share > 1000
    stops = told(1, 0.8, floor=0.01)
    assert "nears singularity" in stops.reason
    assert stops.flown < 0.2
    freely = {"anyway": True, "settings": FlightSettings(floor=0.0, saturation=False)}
    # What rounding makes of a singular matrix: the order of magnitude alone is the same on every machine.
    for number, shares in ((1, 29_300), (2, 2620)):
        flight = fly(gait(number).parametrize(1.0), **freely)  # type: ignore[arg-type]
        assert flight.settled
        assert flight.peak_thrust_share == pytest.approx(shares, rel=0.5)
        assert flight.least_singular_value is not None
        assert flight.least_singular_value < 1e-4
    assert "with 29,300 and 2,620 shares" in page.replace("\n", " ")
    first, second = (fly(printed(number).parametrize(1.0), **freely) for number in (1, 2))  # type: ignore[arg-type]
    assert "Gait 1 passes a singular matrix after 0.63 s" in page.replace("\n", " ")
    assert first.flown == pytest.approx(0.63, abs=0.01)
    assert second.settled
    assert second.peak_thrust_share == pytest.approx(215, abs=1)
    assert "settles with 215 shares" in page.replace("\n", " ")


def test_the_page_on_flight_tells_every_setting_and_field(levelling: Flight) -> None:
    page = (Path(__file__).parent.parent / "docs" / "flight.md").read_text()
    for name in (*levelling.settings.as_mapping(), "thrust_limit", "servo_lag", "servo_rate", *levelling.as_mapping()):
        assert f"`{name}`" in page, name


def test_the_pictures_of_the_page_are_small() -> None:
    images = Path(__file__).parent.parent / "docs" / "images"
    assert (images / "flight.gif").stat().st_size < 400_000
    assert (images / "flights.png").stat().st_size < 300_000
    assert '"reference": "circle"' in provenance_of_gif(images / "flight.gif")


# ---------------------------------------------------------------- gait files and their clocks


def test_a_table_of_a_law_flies_as_that_law(tmp_path: Path) -> None:
    for law in ("smooth", "constant-speed", "equal-time"):
        timed = gait(4).parametrize(1.5, law=law, samples=40)
        timed.write(tmp_path / "told.csv", force=True)
        bare = np.column_stack([timed.t, timed.alpha])
        header = "t,alpha1,alpha2,alpha3,alpha4"
        np.savetxt(tmp_path / "bare.csv", bare, delimiter=",", header=header, comments="")
        t = np.linspace(0.0, 3.0, 31)
        for name in ("told.csv", "bare.csv"):
            read = timed_gait_from_file(tmp_path / name)
            assert not isinstance(read, RowTimedGait)
            assert read.period == pytest.approx(1.5)
            np.testing.assert_allclose(read.at(t)[0], timed.at(t)[0], atol=1e-6)


def test_another_table_flies_straight_from_row_to_row(run: Any, tmp_path: Path) -> None:
    times = np.array([0.0, 0.3, 0.4, 0.9, 1.0])
    rows = np.array([*gait(4).alpha, gait(4).alpha[0]])
    header = "t,alpha1,alpha2,alpha3,alpha4"
    np.savetxt(tmp_path / "rows.csv", np.column_stack([times, rows]), delimiter=",", header=header, comments="")
    timed = timed_gait_from_file(tmp_path / "rows.csv")
    assert timed.law == ROW_BY_ROW
    np.testing.assert_allclose(timed.at(times[:4])[0], rows[:4], atol=1e-12)
    np.testing.assert_allclose(timed.at([0.15])[0][0], (rows[0] + rows[1]) / 2, atol=1e-12)
    assert timed.check().flyable
    half = biased_timed_gait(timed, 0.5)
    assert half.at([0.15])[0][0, 2] == pytest.approx(timed.at([0.15])[0][0, 2] / 2)
    done = run("fly", "rows.csv", "--duration", 0.8)
    assert done.code == 0
    assert "warning: times of the table are those of no law: 4 rows are flown straight" in done.out
    # A new clock makes it a law again.
    assert timed_gait_from_file(tmp_path / "rows.csv", law="smooth").period == 1.0


def test_a_table_that_is_not_closed_is_told(run: Any, tmp_path: Path) -> None:
    """A quarter of a gait: the way back takes one mean step of time."""
    timed = gait(4).parametrize(1.0, samples=40)
    rows = np.column_stack([timed.t, timed.alpha])
    header = "t,alpha1,alpha2,alpha3,alpha4"
    tables = {"open": rows[:16], "closed": np.vstack([rows[:16], [0.9, *rows[0, 1:]]]), "law": rows[:-1]}
    for name, part in tables.items():
        np.savetxt(tmp_path / f"{name}.csv", part, delimiter=",", header=header, comments="")
    jump = np.linalg.norm(rows[15, 1:] - rows[0, 1:])
    said = f"the table is not closed: the {jump:.3g} rad from its last row back to the first are flown within 0.025 s"
    half = fly(biased_timed_gait(timed_gait_from_file(tmp_path / "open.csv"), 0.9), settings=SHORT)
    assert [one for one in half.warnings if one.startswith("the table is not closed: the 1.")]
    assert f"warning: {said}" in run("fly", "open.csv").out
    for name in ("closed", "law"):
        assert fly(timed_gait_from_file(tmp_path / f"{name}.csv"), settings=FlightSettings(duration=1.0)).warnings == ()


def test_a_gait_without_a_clock_gets_one_or_is_refused(run: Any, tmp_path: Path) -> None:
    header = "alpha1,alpha2,alpha3,alpha4"
    np.savetxt(tmp_path / "rows.csv", gait(3).alpha, delimiter=",", header=header, comments="")
    (tmp_path / "path.json").write_text(json.dumps({"path": gait(3).alpha.tolist()}))
    for name in ("rows.csv", "path.json"):
        done = run("fly", name)
        assert done.code == 2
        assert done.out == ""
        assert done.err.count("\n") == 1
        assert "it has no clock" in done.err
        assert "--period SECONDS" in done.err
        assert run("fly", name, "--period", 1, "--duration", 0.5).code == 0
    assert run("fly", "rows.csv", "--law", "smooth").code == 2
    # A point needs none; a saved plan tells its request, and that its clock.
    np.savetxt(tmp_path / "point.csv", gait(4).alpha[:1], delimiter=",", header=header, comments="")
    assert run("fly", "point.csv", "--duration", 0.5).code == 0
    (tmp_path / "loop.toml").write_text(request_of(4) + "period = 2.0\n")
    (tmp_path / "plan.json").write_text(run("plan", "loop.toml", "--json").out)
    assert timed_gait_from_file(tmp_path / "plan.json").period == 2.0
    assert timed_gait_from_file(tmp_path / "loop.toml", period=3.0).period == 3.0


def test_a_request_without_a_gait_is_answered_no(run: Any, tmp_path: Path) -> None:
    (tmp_path / "none.toml").write_text('waypoints = [[0.4, 0.4], [1.2, -1.2]]\nsign = "positive"\n')
    done = run("fly", "none.toml", "--json")
    assert done.code == 1
    assert done.json["reason"].startswith("there is no gait to fly: no closed loop")
    assert done.json.keys() == run("fly", "gait3", "--duration", 0.01, "--json").json.keys()


def test_an_attitude_may_begin_with_a_minus_and_be_in_degrees(run: Any) -> None:
    for text in ("-0.3,0.2", "-17.188733853924695deg, 11.459155902616466deg"):
        done = run("fly", "gait3", "--attitude", text, "--duration", 0.6, "--json")
        assert done.code == 0
        assert done.json["attitude"] == pytest.approx([-0.3, 0.2])
    assert run("fly", "gait3", "--attitude=-3pi/32,0", "--duration", 0.6).code == 0


def test_settings_come_from_a_file_and_options_go_before_it(run: Any, tmp_path: Path) -> None:
    (tmp_path / "calm.toml").write_text('[flight]\nreference = "hover"\nduration = 0.7\nattitude_noise = "0.1deg"\n')
    done = run("fly", "gait4", "--settings", "calm.toml", "--duration", 0.3, "--output", "a.json")
    assert done.code == 0
    flight = json.loads((tmp_path / "a.json").read_text())["about"]["flight"]
    assert (flight["reference"], flight["duration"]) == ("hover", 0.3)
    assert flight["attitude_noise"] == pytest.approx(np.radians(0.1))
    wind = ["--wind", "-1,0.5", "--gust", 0.3, "--seed", 3, "--duration", 0.2, "--json"]
    first, again = (run("fly", "gait4", *wind).json for _ in range(2))
    assert first == again
    assert first["drift"] != run("fly", "gait4", *wind, "--seed", 4).json["drift"]


def test_a_file_of_settings_and_options_are_judged_together(run: Any, tmp_path: Path) -> None:
    (tmp_path / "fast.toml").write_text("[flight]\ncontrol_rate = 2000\nduration = 0.3\n")
    fits = run("fly", "gait3", "--settings", "fast.toml", "--step", 0.0005, "--output", "a.json")
    assert fits.code == 1  # it has not settled yet
    assert json.loads((tmp_path / "a.json").read_text())["about"]["flight"]["control_rate"] == 2000.0
    (tmp_path / "bad.toml").write_text("[flight]\nattitude_damping = 3000\n")
    assert run("fly", "gait3", "--settings", "bad.toml", "--attitude-damping", 20, "--duration", 0.01).code == 1
    for options, said in (
        (["fast.toml"], "settings file 'fast.toml': control_rate: 2000 Hz does not fit steps of 0.001 s"),
        (["fast.toml", "--control-rate", 300], "--control-rate: 300 Hz does not fit steps"),
        (["bad.toml", "--attitude-stiffness", 90], "settings file 'bad.toml': attitude_damping: 3000.0 is unstable"),
        (["fast.toml", "--step", 0.0005, "--floor", 2], "--floor: 2.0; allowed is 0 to 1"),
    ):
        done = run("fly", "gait3", "--settings", *options)
        assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
        assert said in done.err


WRONG = {
    "a suffix of gaits alone": (["--output", "x.h"], "'x.h' is a C header, which is of gaits alone; allowed for a"),
    "a mistyped suffix": (["--output", "x.cvs"], "did you mean '.csv'?"),
    "no folder": (["--output", "none/x.csv"], "folder 'none' does not exist"),
    "twice": (["--output", "x.png", "--output", "./x.png"], "is named twice"),
    "half an attitude": (["--attitude", "0.3"], "--attitude: '0.3'; allowed is ROLL,PITCH"),
    "an attitude that is none": (["--attitude", "0.3,up"], "--attitude: 'up'"),
    "upside down": (["--attitude", "0,pi/2"], "allowed is a roll from -pi to pi and a pitch between"),
    "unstable damping": (["--attitude-damping", "3000"], "--attitude-damping: 3000.0 is unstable at 1000 Hz; allowed"),
    "an unstable step": (["--step", "0.02", "--control-rate", "50", "--attitude-damping", "99"], "unstable at 50 Hz"),
    "damping that the engine's step hides": (
        ["--step", "0.02", "--control-rate", "50", "--attitude-damping", "0.6"],
        "--attitude-damping: 0.6 is unstable at 50 Hz with attitude_stiffness 100.0; allowed is more than 1",
    ),
    "a short period": (["--period", "0.001"], "period: 0.001 s at a step of 0.001 s; allowed is 20 steps (0.02 s) and"),
    "a long period": (["--period", "2000"], "period: 2000 s, which is flown whole where no duration is stated"),
    "a rate that does not fit": (["--control-rate", "300"], "--control-rate: 300 Hz does not fit steps of 0.001 s"),
    "wind": (["--wind", "a,b"], "--wind: 'a,b'; allowed are two or three numbers"),
    "a lot of wind": (["--wind", "1e3,0"], "--wind: (1000.0, 0.0); allowed"),
    "a reference": (["--reference", "cirle"], "did you mean 'circle'?"),
    "periods of what": (["--periods", "3"], "allowed is with --from-hover"),
    "no periods": (["--from-hover", "--periods", "0"], "gaitgraph: --periods: 0; allowed is a whole number from 1"),
    "bias": (["--bias", "1.5"], "--bias: 1.5; allowed is a number in (0, 1]"),
    "a period with its unit": (["--period", "1s"], "--period: '1s'; allowed is a number of seconds"),
    "a negative period": (["--period", "-1"], "gaitgraph: --period: -1.0; allowed is a finite number of seconds"),
    "half a seed": (["--seed", "1.5"], "--seed: '1.5'; allowed is a whole number"),
    "one wind": (["--wind", "1"], "--wind: '1'; allowed are two or three numbers"),
    "a limit and none": (["--thrust-limit", "5", "--no-saturation"], "--thrust-limit: 5 with --no-saturation; allowed"),
    "an idle size": (["--size", "2"], "--size: 2 with the reference attitude; allowed is with --reference step, line"),
    "an idle lap": (["--reference", "step", "--lap", "2"], "--lap: 2 with the reference step; allowed is with --ref"),
    "an idle gain": (["--position-damping", "2"], "--position-damping: 2 with the reference attitude; allowed is"),
    "no duration": (["--duration", "0"], "--duration: 0.0; allowed is 0.001 to 10000 (s)"),
    "no screen": (["--view"], "--view: no screen here"),
    "no settings": (["--settings", "none.toml"], "settings file: cannot read 'none.toml'"),
    "a law": (["--law", "smoth"], "gaitgraph: --law: 'smoth'; allowed are"),
    "a steep attitude": (["--attitude", "9,9"], "gaitgraph: --attitude: (9.0, 9.0); allowed is a roll"),
    "a vehicle without mass": (["--vehicle", "light.toml"], "vehicle 'light' states no mass (kg), which flight needs"),
    "a vehicle without inertia": (["--vehicle", "dot.toml"], "vehicle 'dot' states no inertia (kg m²), which flight"),
}


@pytest.mark.parametrize(("options", "said"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_line(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], said: str
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    (tmp_path / "light.toml").write_text("drag_ratio = 0.2\n")
    (tmp_path / "dot.toml").write_text("drag_ratio = 0.2\nmass = 1.0\n")
    before = sorted(tmp_path.iterdir())
    done = run("fly", "gait3", *options)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert said in done.err
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("gait5", "GAIT_FILE: 'gait5'; allowed is a gait file, a request, or gait1, gait2, gait3, gait4; did you mean"),
        ("nothing.csv", "gait file: cannot read 'nothing.csv': No such file"),
        ("nothing.toml", "cannot read 'nothing.toml'"),
    ],
)
def test_what_is_no_gait_is_told(run: Any, name: str, said: str) -> None:
    done = run("fly", name)
    assert (done.code, done.out) == (2, "")
    assert said in done.err


def test_without_mujoco_the_extra_is_named(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    done = run("fly", "gait3", "--view")
    assert (done.code, done.out) == (2, "")
    assert "mujoco: not installed" in done.err
    assert "pip install 'gaitgraph[sim]'" in done.err


def test_an_interrupted_flight_is_130(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitgraph.flight.simulation.Simulation.run", stopped)
    done = run("fly", "gait3", "--output", "a.csv")
    assert (done.code, done.out) == (130, "")


# ---------------------------------------------------------------- tables


def test_tables_are_read_by_their_formats_own_readers(tmp_path: Path, levelling: Flight) -> None:
    from pyarrow import parquet
    from scipy.io import loadmat

    names = {suffix: tmp_path / f"flight{suffix}" for suffix in (".csv", ".json", ".npz", ".mat", ".parquet")}
    levelling.write(*names.values())
    rows = levelling.rows
    with names[".csv"].open(newline="") as stream:
        read = [{name: float(row[name]) for name in COLUMNS} for row in csv.DictReader(stream)]
    np.testing.assert_array_equal([list(row.values()) for row in read], rows)
    content = json.loads(names[".json"].read_text())
    archive, matlab = np.load(names[".npz"]), loadmat(names[".mat"])
    table = parquet.read_table(names[".parquet"])
    for k, name in enumerate(COLUMNS):
        for column in (content["columns"][name], archive[name], matlab[name].ravel(), table[name].to_numpy()):
            np.testing.assert_array_equal(column, rows[:, k])
    assert content["about"]["made_by"] == "fly"
    assert content["about"]["flight"]["attitude"] == [0.3, -0.2]
    assert content["about"]["flight"]["duration"] == 0.5
    units = levelling.table().units
    assert all(units[name] for name in COLUMNS)
    assert (units["thrust1"], units["z_rate"], units["nearness"]) == ("N", "m/s", "1")
    assert table.schema.field("thrust2").metadata[b"unit"] == b"N"
    archive.close()


def test_a_flights_file_plans_its_gait_again_but_is_no_gait(run: Any, tmp_path: Path) -> None:
    (tmp_path / "loop.toml").write_text(request_of(4) + "period = 2.0\n")
    outputs = ["flight.csv", "flight.mat", "flight.gif"]
    assert run("fly", "loop.toml", "--duration", 0.2, *(x for name in outputs for x in ("--output", name))).code == 1
    for name in outputs:
        again = run("plan", name, "--json")
        assert again.json["request"]["period"] == 2.0
        assert again.json["color"] == "red"
    refused = run("fly", "flight.csv")
    assert refused.code == 2
    assert "it is the table of a flight; allowed is a gait: gaitgraph plan flight.csv" in refused.err
    assert run("fly", "gait3", "--duration", 0.02, "--output", "paper.csv").code == 1
    told = run("plan", "paper.csv")
    assert (told.code, told.out) == (2, "")
    assert "fly made it, which plan does not repeat" in told.err


def test_what_exists_stays_and_a_full_disk_is_one_line(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.csv").write_text("mine")
    done = run("fly", "gait3", "--output", "a.csv")
    assert (done.code, done.out) == (2, "")
    assert "'a.csv' exists; allowed is a new file, or --force" in done.err

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("os.fsync", full)
        done = run("fly", "gait3", "--duration", 0.02, "--output", "a.csv", "--output", "b.png", "--force")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert "No space left on device" in done.err
    assert (tmp_path / "a.csv").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv"]
    assert run("fly", "gait3", "--duration", 0.02, "--output", "a.csv", "--force").code == 1
    assert (tmp_path / "a.csv").read_text() != "mine"


# ---------------------------------------------------------------- plots


@pytest.fixture
def no_windows() -> Iterator[None]:
    from matplotlib import pyplot

    pyplot.switch_backend("agg")
    yield
    pyplot.close("all")


@pytest.mark.usefixtures("no_windows")
def test_a_plot_shows_what_was_flown(levelling: Flight, circling: Flight) -> None:
    attitude, place, thrusts, tilts, near = plot_flight(levelling)
    lines = {line.get_label(): line for line in attitude.get_lines()}
    np.testing.assert_allclose(lines["roll"].get_ydata(), np.degrees(levelling.column("roll")))
    assert {"$x$, free", "$y$, free", "$z$"} <= {line.get_label() for line in place.get_lines()}
    shares = [line.get_ydata() for line in thrusts.get_lines() if str(line.get_label()).startswith("rotor")]
    assert np.max(shares) == pytest.approx(levelling.peak_thrust_share)
    assert len(tilts.get_lines()) == 4
    assert near.get_yscale() == "log"
    assert attitude.get_title().splitlines() == [
        "Red gait · vehicle paper · T = 1 s · from roll 17.2°, pitch −11.5°",
        "settled after 0.44 s",
    ]
    assert "· circle of 0.3 m in 1 s ·" in name_of_flight(circling)
    assert plot_flight(levelling, title="Mine")[0].get_title() == "Mine"
    assert not [line for line in attitude.get_lines() if line.get_gid() == "stop"]
    wanted = plot_flight(circling, panels=["place"])[0].get_lines()[0]
    assert wanted.get_label() == "asked for"
    np.testing.assert_allclose(wanted.get_ydata(), circling.column("x_wanted"))


@pytest.mark.usefixtures("no_windows")
def test_a_plot_marks_a_stop_and_writes_why_nothing_was_flown() -> None:
    refused = fly(gait(1).parametrize(1.0))
    stopped = fly(
        gait(1).parametrize(1.0), anyway=True, settings=FlightSettings(floor=0.0, duration=2.5, control_rate=250)
    )
    assert stopped.failed
    axes = flights_side_by_side({"refused": refused, "stopped": stopped, "level": fly(gait(3).parametrize(1.0))})
    assert axes.shape == (3, 3)
    marks = [line for line in axes[0, 1].get_lines() if line.get_gid() == "stop"]
    assert marks[0].get_xdata()[0] == stopped.flown
    assert "nothing flown" in [text.get_text() for text in axes[0, 0].texts]
    assert axes[0, 0].get_title().startswith("refused\nrefused before take-off: sign of R")
    for panels, said in ((["tilt"], "did you mean 'tilts'?"), ([3], "panels: 3; allowed are attitude")):
        with pytest.raises(gg.InputError, match="panels") as wrong:
            plot_flight(refused, panels=panels)  # type: ignore[arg-type]
        assert said in str(wrong.value)
    with pytest.raises(gg.InputError, match="1 of them; allowed are 2"):
        plot_flight(refused, axes=axes[0, 0], panels=["place", "tilts"])
    with pytest.raises(gg.InputError, match="flights: none"):
        flights_side_by_side({})


def test_the_same_flight_gives_the_same_pictures(tmp_path: Path, levelling: Flight) -> None:
    again = fly(gait(3).parametrize(1.0), settings=SHORT)
    for folder, flight in (("one", levelling), ("two", again)):
        (tmp_path / folder).mkdir()
        write_flight(flight, [tmp_path / folder / name for name in ("a.svg", "a.gif")])
    for name in ("a.svg", "a.gif"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


# ---------------------------------------------------------------- films


def test_a_film_lasts_as_long_as_the_flight_and_tells_what_made_it(tmp_path: Path, levelling: Flight) -> None:
    path = tmp_path / "film.gif"
    write_film(levelling, path)
    with Image.open(path) as film:
        lasts = []
        for k in range(film.n_frames):  # type: ignore[attr-defined]
            film.seek(k)
            lasts.append(film.info["duration"])
        assert film.size == (480, 420)
    assert sum(lasts) == 500 + 800
    assert '"made_by": "fly"' in provenance_of_gif(path)
    write_film(levelling, tmp_path / "few.gif", frames=3)
    with Image.open(tmp_path / "few.gif") as film:
        assert film.n_frames == 3  # type: ignore[attr-defined]
    for frames in (1, 2.5, True, 10_000):
        with pytest.raises(gg.InputError, match="frames: .*; allowed is a whole number from 2 to 1000"):
            write_film(levelling, tmp_path / "no.gif", frames=frames)  # type: ignore[arg-type]
    with pytest.raises(gg.InputError, match="nothing was flown"):
        write_film(fly(gait(1).parametrize(1.0)), tmp_path / "no.gif")


def test_the_drawn_vehicle_has_the_bodys_attitude(circling: Flight) -> None:
    """Arms, discs and thrusts lie where a camera that does not turn sees them."""
    drawing = _Drawing(circling)
    for row in (0, 400, 777):
        scene = drawing._scene(row)
        w, x, y, z = quaternion_of(*(float(circling.column(name)[row]) for name in ("roll", "pitch", "yaw")))
        turned = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        camera = drawing.scale * np.stack([drawing.right, -drawing.up])
        bearings = PAPER.first_arm_angle + np.arange(4) * np.pi / 2
        ends = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(4)])
        np.testing.assert_allclose(scene.arms - scene.hub, (camera @ turned @ ends).T, atol=1e-9)
        nose = camera @ turned @ np.array([1.0, 0.0, 0.0])
        np.testing.assert_allclose(
            (scene.nose - scene.hub) / np.linalg.norm(scene.nose - scene.hub), nose / np.linalg.norm(nose), atol=1e-9
        )
        # Lines of thrust: along the tilted axes, as long as the thrusts.
        alpha = [float(circling.column(f"alpha{k + 1}")[row]) for k in range(4)]
        axes = np.stack([np.sin(alpha) * np.sin(bearings), -np.sin(alpha) * np.cos(bearings), np.cos(alpha)])
        shares = np.clip(circling.thrusts[row] / drawing.quarter, -2.4, 2.4)
        pushed = scene.thrusts[0] - scene.discs[0, :, 4:]
        np.testing.assert_allclose(pushed, 0.62 * shares[:, None] * (camera @ turned @ axes).T, atol=1e-9)


def test_a_film_of_a_failed_flight_says_why(tmp_path: Path) -> None:
    flight = fly(gait(3).parametrize(1.0), attitude=(1.2, -1.0), settings=FlightSettings(duration=0.3))
    assert not flight.settled
    picture = _Drawing(flight).frame(flight.flown)
    words = np.asarray(picture.convert("L"))[275:303, 16:300]
    assert words.min() < 60


def test_words_lie_over_the_drawing_and_apart_from_each_other() -> None:
    long = "the decoupling matrix nears singularity at 0.253 s: its least singular value is between 0.009 and 0.018"
    flown = fly(gait(3).parametrize(1.0), attitude=(1.2, -1.0), settings=FlightSettings(duration=0.3))
    drawing = _Drawing(replace(flown, reason=long))
    over, boxes = drawing._over(len(flown.rows) - 1)
    picture = drawing.frame(flown.flown)
    covered = np.zeros((420, 480), dtype=int)
    for left, top, right, bottom in boxes:
        covered[top:bottom, left:right] += 1
        assert picture.crop((left, top, right, bottom)).tobytes() == over.crop((left, top, right, bottom)).tobytes()
    assert covered.max() == 1
    assert boxes[-1][3] - boxes[-1][1] < 45  # two lines, of a text of three
    assert len(drawing._over(0)[1]) == len(boxes) - 1


def test_frames_of_a_long_film_go_through_the_gait() -> None:
    """Every fifth second, a gait of one second would seem to stand still."""

    def times(seconds: float, frames: int | None = None) -> np.ndarray[Any, Any]:
        told = SimpleNamespace(rows=[0], flown=seconds, course=SimpleNamespace(timed=SimpleNamespace(period=1.0)))
        return _clock_of(told, frames)[0]  # type: ignore[arg-type]

    for seconds in (60.0, 500.0):
        found = times(seconds)
        assert np.all(np.diff(found) > 0)
        assert np.abs(found - np.linspace(0.0, seconds, 101)[:-1])[:-1].max() <= 0.5
        phases = np.round(found[:-1] % 1.0, 3) % 1.0
        assert sorted(set(phases.tolist())) == pytest.approx(np.arange(25) / 25)
        assert found[-1] == seconds
    np.testing.assert_allclose(times(5.0, 28)[:-1], np.linspace(0.0, 5.0, 29)[:-2], atol=0.01)


def test_flight_needs_no_opengl() -> None:
    told = "import os; from gaitgraph.flight.engine import mujoco_library"
    said = f"{told}; mujoco_library().MjModel; print(os.environ['MUJOCO_GL'])"
    environment = {**os.environ, "MUJOCO_GL": "nonsense"}
    done = subprocess.run([sys.executable, "-c", said], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "nonsense\n"), done.stderr


def test_the_engine_renders_what_is_drawn(
    run: Any, tmp_path: Path, levelling: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        picture = rendered_frames(levelling, [0.0])[0].astype(int)
    except gg.InputError as error:
        pytest.skip(str(error))
    # Rotor 1 is the only red thing; it is where the drawing has it, the camera a little nearer or farther.
    red = picture[..., 0] - picture[..., 1:].max(axis=-1) > 40
    centre = np.array([np.nonzero(red)[1].mean(), np.nonzero(red)[0].mean()]) - np.array([240.0, 180.0])
    scene = _Drawing(levelling)._scene(0)
    drawn = (scene.arms[0] + scene.discs[0, 0, 4:]) / 2 - scene.hub
    assert centre @ drawn > 0.95 * np.linalg.norm(centre) * np.linalg.norm(drawn)
    # Where it cannot, nothing is flown, and the message is one line.
    monkeypatch.setattr("subprocess.run", lambda *_, **__: SimpleNamespace(returncode=-11, stdout=b""))
    done = run("fly", "gait3", "--output", "a.gif", "--render")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert "film: the engine cannot render here" in done.err
    assert "no film to render" in run("fly", "gait3", "--output", "a.csv", "--render").err
    turned = [np.roll(picture, 5 * k, axis=1).astype(np.uint8) for k in range(20)]
    monkeypatch.setattr("gaitgraph.plots.flight_films.rendered_frames", lambda _, times: np.stack(turned[: len(times)]))
    write_flight(levelling, [tmp_path / "b.gif"], rendered=True)
    with Image.open(tmp_path / "b.gif") as film:
        assert film.size == (480, 360)
        assert film.n_frames == 12  # type: ignore[attr-defined]


# ---------------------------------------------------------------- the viewer


def test_the_viewer_shows_the_flight_again(monkeypatch: pytest.MonkeyPatch, levelling: Flight) -> None:
    from gaitgraph.flight.engine import check_screen, show_flight

    seen: list[np.ndarray[Any, Any]] = []
    clock = iter(np.arange(0.0, 10.0, 0.1))

    @contextmanager
    def launched(model: Any, data: Any, **_: Any) -> Iterator[Any]:
        yield SimpleNamespace(
            cam=SimpleNamespace(), is_running=lambda: len(seen) < 7, sync=lambda: seen.append(data.qpos.copy())
        )

    fake = ModuleType("mujoco.viewer")
    fake.launch_passive = launched  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "mujoco.viewer", fake)
    monkeypatch.setattr("mujoco.viewer", fake, raising=False)
    monkeypatch.setattr("gaitgraph.flight.engine.time", SimpleNamespace(monotonic=lambda: next(clock), sleep=id))
    show_flight(levelling)
    np.testing.assert_allclose(seen[0][:3], levelling.rows[100, 1:4])
    np.testing.assert_allclose(seen[-1][7:], levelling.rows[-1, [COLUMNS.index(f"alpha{k}") for k in (1, 2, 3, 4)]])

    def broken(*_: Any, **__: Any) -> None:
        raise RuntimeError("it needs mjpython")

    fake.launch_passive = broken  # type: ignore[attr-defined]
    with pytest.raises(gg.InputError, match="the viewer does not open .it needs mjpython."):
        show_flight(levelling)
    monkeypatch.setenv("DISPLAY", ":987")
    monkeypatch.setattr("subprocess.run", lambda *_, **__: SimpleNamespace(returncode=1))
    with pytest.raises(gg.InputError, match="no window can be opened here"):
        check_screen()


def test_pictures_are_pictures(tmp_path: Path, levelling: Flight) -> None:
    write_flight(levelling, [tmp_path / "a.png", tmp_path / "a.pdf"])
    with Image.open(BytesIO((tmp_path / "a.png").read_bytes())) as picture:
        assert picture.width > 1000
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
