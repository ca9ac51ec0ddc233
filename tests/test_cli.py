"""The command line as a user meets it: every command, exit codes, one line for wrong input; completion and progress."""

from __future__ import annotations

import inspect
import json
import os
import re
import shlex
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.cli import COMMANDS, cli, output as terminal
from gaitgraph.cli.options import LAWS as STATED_LAWS
from gaitgraph.io.formats import read_table
from gaitgraph.planning.request import CHOICES, REQUEST_FIELDS
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from tests.published import GAITS, PublishedGait

if TYPE_CHECKING:
    from collections.abc import Callable


G1, G2, G3, G4 = GAITS
ESCAPE = "\x1b"
PAGE = Path(__file__).parent.parent / "docs" / "command_line.md"


SQUARE = [part for a, b in G3.waypoints for part in ("--waypoint", f"{a},{b}")]


def test_plan_for_people_fits_one_screen(run: Any) -> None:
    result = run("plan", *SQUARE, "--output", "gait3.csv", "--output", "gait3.json")
    assert result.code == 0
    lines = result.out.splitlines()
    assert len(lines) <= 40
    assert lines[0].startswith(
        "Planned a red gait, R < 0: 4 corners, 3.1416 rad around"
    )
    assert (
        "Flyable: yes. Obeys the paper's rules: yes. Reachable from hover: no."
        in result.out
    )
    assert any(
        line.startswith(
            "  ok  tilt acceleration     peak 72.6 rad/s² (α1); the vehicle states"
        )
        for line in lines
    )
    assert lines[lines.index("wrote gait3.csv") - 2].startswith(
        "warning: entering from hover (R > 0)"
    )  # on one line
    assert len(read_table("gait3.csv")) == len(read_table("gait3.json")) == 101
    assert read_table("gait3.json").about["request"]["waypoints"][0] == pytest.approx(
        G3.angles[0]
    )


def test_printed_coefficients_in_requests_files_and_commands(run: Any) -> None:
    """A blue gait of the printed digits stays one: its sign of R is decided, and it does not fly."""
    lines = ['coefficients = "printed"', 'color = "blue"', 'require = "valid"']
    lines.append(f"waypoints = {[list(pair) for pair in G2.waypoints]}")
    Path("blue.toml").write_text("\n".join(lines))
    told = "< 0 along the whole gait (printed coefficients, angles exact)"
    assert told in run("plan", "blue.toml", "--output", "blue.csv").out
    assert run("export", "blue.csv", "blue.json", "blue.npz", "--anyway").code == 0
    for name in ("blue.csv", "blue.json", "blue.npz"):
        assert read_table(name).about["coefficients"] == "printed"
        judged = run("validate", name)
        assert (judged.code, told in judged.out) == (1, True)
        assert run("validate", name, "--require", "valid").code == 0
    command = ("robustness", "gait2", "--coefficients", "printed", "--json")
    assert run(*command).json["verdict"] == "no singular attitude"
    assert run(*command[:2], "--json").json["verdict"] == "singular at every attitude"


STILL = "he plan is a single posture, not a gait; for a gait, give two or more different waypoints"


@pytest.mark.parametrize(
    ("line", "first", "warning"),
    [
        ("plan --waypoint 0.4,-1.2", f"T{STILL}", f"t{STILL}"),
        (
            "optimize --waypoint 0.4,-0.4 --waypoint 0.5,-0.5 --radius 0.3 --objective hover_reserve",
            "The best gait stands still at (",
            "",
        ),
    ],
)
def test_a_gait_that_stands_still_says_so_first(
    run: Any, line: str, first: str, warning: str
) -> None:
    assert run(*line.split()).out.startswith(first)
    assert (warning or first) in run(*line.split(), "--json").json["warnings"][0]


def test_limits_that_look_like_degrees_are_shown_in_degrees(run: Any) -> None:
    Path("fast.toml").write_text(
        'preset = "paper"\nmax_tilt_rate = 300\nmax_tilt_acceleration = 2e4\n'
    )
    told = [
        "warning: the limit of the tilt rate is 300 rad/s = 17,189°/s: for degrees write '300deg'",
        "warning: the limit of the tilt acceleration is 20,000 rad/s² = 1,145,916°/s²: for degrees write '20000deg'",
    ]
    planned = run(
        "plan", *SQUARE, "--vehicle", "fast.toml", "--output", "fast.csv"
    ).out.splitlines()
    for lines in (
        planned,
        *(run(name, "fast.csv").out.splitlines() for name in ("validate", "pace")),
    ):
        assert [line for line in lines if "for degrees" in line] == told
    assert run("vehicles", "fast.toml").err.splitlines() == [
        f"gaitgraph: {line}" for line in told
    ]


def test_a_rate_that_a_period_does_not_hold_is_said(run: Any) -> None:
    for period, told in (
        (
            "0.99",
            "60.6061 rows per second, not 60; a period that is a multiple of 1/60 s",
        ),
        ("1", ""),
    ):
        err = run(
            "plan",
            *SQUARE,
            "--period",
            period,
            "--rate",
            "60",
            "--output",
            "a.csv",
            "--force",
        ).err
        assert told in err
        assert bool(err) == bool(told)


def test_a_table_without_a_vehicle_is_judged_for_the_papers_and_that_is_said(
    run: Any,
) -> None:
    run("plan", *SQUARE, "--output", "a.csv")
    Path("bare.csv").write_text("alpha1,alpha2,color\n1.2,-0.4,red\n0.4,-1.2,red\n")
    assert "warning: the file states no vehicle" in run("validate", "bare.csv").err
    for line in ("a.csv", "gait3", "bare.csv --vehicle paper", "bare.csv --json"):
        assert run("validate", *line.split()).err == ""


def test_plan_from_files(run: Any) -> None:
    Path("vehicle.toml").write_text('preset = "paper"\nmax_tilt_rate = "400deg"\n')
    Path("request.toml").write_text(
        'waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]\n'
        'vehicle = "vehicle.toml"\nperiod = 2.0\nsamples = 8\n'
        "keep_out = [[[0.6, -0.6], [1.0, -0.6], [1.0, -0.2], [0.6, -0.2]]]\n"
    )
    plan = run("plan", "request.toml", "--json", "--output", "a.csv").json
    assert plan["length"] > np.pi
    assert plan["request"]["period"] == 2.0
    assert plan["flyable"]
    assert read_table("a.csv")["t"].tolist() == np.linspace(0, 2, 9).tolist()
    # Options replace what the file says, a rate replaces a count; a vehicle too slow is said.
    quick = ["--period", "0.5", "--rate", "4", "--json"]
    assert (
        "needs a period of at least"
        in run("plan", "request.toml", *quick).json["reason"]
    )
    fast = run(
        "plan", "request.toml", *quick, "--require", "valid", "--output", "b.csv"
    ).json
    assert not fast["flyable"]
    assert len(read_table("b.csv")) == 3
    Path("plan.json").write_text(json.dumps(plan))  # a saved plan is a request too
    assert run("plan", "plan.json", "--json").json == plan


def test_an_option_replaces_what_a_file_says_also_by_its_default(run: Any) -> None:
    waypoints = [list(pair) for pair in G3.waypoints]
    Path("coarse.toml").write_text(f"waypoints = {waypoints}\nperiod = 2.0\n")
    stated = run("plan", "coarse.toml", "--json").json["request"]
    assert (stated["period"], stated["method"]) == (2.0, "exact")
    options = ("--period", "1", "--divisions", "16")
    replaced = run("plan", "coarse.toml", *options, "--json").json["request"]
    assert (replaced["period"], replaced["method"]) == (1.0, "grid")


def test_roots(run: Any) -> None:
    result = run("roots", "0.3", "-3pi/8", "--json")
    assert result.code == 0
    roots = result.json["roots"]
    assert set(roots[0]) == {
        "alpha3",
        "alpha4",
        "types",
        "color",
        "R",
        "R_phi",
        "R_theta",
    }
    assert [root["color"] for root in roots] == ["red", "blue"]
    assert result.json["alpha2"] == -3 * np.pi / 8
    printed = run("roots", "0.3", "0.5", "--coefficients", "exact").out.splitlines()
    assert printed[3].split()[::4] == ["blue", "0"]  # without the noise of round-off
    exact = repr(float(np.arctan(gg.PAPER.drag_ratio)))
    fiber = run("roots", exact, "-.3", "--coefficients", "exact")
    assert "continuum (?,*): alpha3 = 0.167093, alpha4 free" in fiber.out


def test_export(run: Any) -> None:
    run("plan", *SQUARE, "--output", "a.csv")
    result = run("export", "a.csv", "b.json", "c.csv", "--json")
    report = gg.validate("a.csv")
    assert result.json == {
        "rows": 101,
        "columns": list(read_table("a.csv").columns),
        "outputs": ["b.json", "c.csv"],
        "valid": True,
        "flyable": True,
        "not_judged": list(report.not_judged),
        "hover_power": report.hover_power,
        "warnings": list(report.warnings),
    }
    assert Path("a.csv").read_bytes() == Path("c.csv").read_bytes()
    assert run("export", "a.csv", "c.csv").code == 2
    slower = run(
        "export",
        "a.csv",
        "c.csv",
        "--force",
        "--period",
        "4",
        "--samples",
        "8",
        "--law",
        "equal-time",
    )
    assert slower.out.startswith("wrote c.csv: 9 rows")
    assert read_table("c.csv")["t"][-1] == 4


def test_vehicles_and_version(run: Any) -> None:
    rows = run("vehicles", "--json").json["vehicles"]
    assert [row["name"] for row in rows] == [
        "paper",
        "beetle_omni",
        "beetle_art",
        "gimbalrotor",
        "padova",
    ]
    Path("mine.toml").write_text('drag_ratio = 0.1\nmax_tilt = "80deg"\n')
    shown = run("vehicles", "--vehicle", "mine.toml").out
    assert shown.startswith("mine: κ = 0.100000, δ = 0.099669 rad")
    assert "max tilt          1.3963 rad = 80°\n" in shown
    assert run("--version").out == f"gaitgraph, version {gg.__version__}\n"


@pytest.mark.parametrize("command", [[], *[[name] for name in COMMANDS]])
def test_help(run: Any, command: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    result = run(*command, "--help")
    assert result.code == 0
    assert result.out.startswith("Usage: gaitgraph")
    assert result.err == ""
    if command not in (["plan"], ["fly"], ["export"]):
        assert len(result.out.splitlines()) <= 40  # it fits a screen


def test_laws_that_help_states_again_are_those_of_the_library() -> None:
    assert tuple(LAWS) == STATED_LAWS


WRONG = [
    ("plan", "a request file or --waypoint A1,A2 must be given; see gaitgraph plan --help"),
    ("optimize", "--waypoint A1,A2 must be given; see gaitgraph optimize --help"),
    ("plan --waypoint 0.1", "Invalid value for '--waypoint': '0.1' is not two angles with a comma between them, such as"),
    ("roots 0 0 --vehicle=", "vehicle must be a preset (paper, beetle_omni, beetle_art, gimbalrotor, padova), a .toml"),
    ("plan --waypoint 0,0 --vehicle none.toml", "vehicle 'none.toml' cannot be read: No such file"),
    ("plan --waypoint 0,0 --output x.txt", "got 'x.txt'"),
    ("plan --waypoint 0,0 --output there.csv", "output 'there.csv' exists; overwrite it with --force"),
    ("plan none.toml", "request file 'none.toml' cannot be read: "),
    ("plan bad.toml", "texts need quotes, as in '30deg', and numbers a decimal point"),
    ("roots 0.1 0.2 -0.3", "Got unexpected extra argument (-0.3)"),
    ("roots", "Missing argument 'A1'"),
    ("roots 0.1 north", "alpha2 must be a finite number in radians"),
    ("export", "GAIT_FILE"),
    ("export there.csv out.csv", "gait file 'there.csv'"),
    ("plann", "No such command 'plann'. Did you mean 'plan'?"),
    ("plan --waypoint 0,0,0,0", "'0,0,0,0' is not two angles"),
    ("plan --waypoint 0,0 --divisions 300", "from 2 to 256, got 300; plan --method exact needs no grid"),
    ("figures --divisions 3", "No such option '--divisions'"),
    ("plan --waypoints 0,0", "Did you mean '--waypoint'? See gaitgraph plan --help"),
    ("plan folder.d", "gaitgraph: request file must have one of the suffixes .csv"),
    ("plan good.toml --sign plus", "Invalid value for '--sign': 'plus' is not one of 'auto', 'positive', 'negative'; see gaitgraph plan --help"),
    ("plan --waypoint 0,0 --vehicle light", "got 'light'; did you mean 'light.toml'?"),
    ("plan film.gif", "got 'film.gif'; this format is not read: use the gait table or the request"),
    ("plan --waypoint 0,0 --output x.svg", ".h, .gif, .mp4, got 'x.svg'; films are .gif, .mp4"),
    ("validate none.csv", "gaitgraph: gait file 'none.csv' cannot be read: No such file or directory\n"),
    ("validate long.csv", "line 2 must be comma-separated text: field larger than field limit (131072)"),
    ("explore --port x", "Invalid value for '--port': 'x' is not a valid integer"),
    ("cycles --limit 0", "Invalid value for '--limit': 0 is not in the range x>=1"),
    ("plan --waypoint 0,0 --period soon", "Invalid value for '--period': 'soon' is not a valid number"),
    ("validate one.csv --require pretty", "Invalid value for '--require': 'pretty' is not one of 'flyable', 'valid'"),
    ("optimize --waypoint 0,0 --keep-in '0,0 1'", "Invalid value for '--keep-in': '1' is not two angles"),
    ("optimize --waypoint 0,0 --radius=-1", "Invalid value for '--radius': '-1' is not an angle ≥ 0, such as 0.3, pi/8 or 20deg"),
    ("transition hover hovr", "did you mean 'hover'?"),
    ("transition hover", "Missing argument 'TO'"),
    ("robustness one.csv --bias abc", "Invalid value for '--bias': 'abc' is not a valid number"),
    ("figures --only 2 --output there.csv", "Invalid value for '--output': Directory 'there.csv' is a file"),
    ("figures none.csv", "gait file 'none.csv' cannot be read"),
    ("compare gait3 none.csv --output both.gif", "must end in .png, .svg or .pdf, got ['both.gif']"),
    ("compare gait3 none.csv", "gait file 'none.csv' cannot be read"),
    ("compare gait3", "Missing argument 'B'"),
    ("region --waypoint 9,9 --output there.csv", "must end in .png, .svg or .pdf, got ['there.csv']"),
    ("pace one.csv --period quick --max-jerk 100", "Invalid value for '--period': 'quick' is not a valid number"),
    ("plan typed.toml --period -1", "Invalid value for '--period': -1.0 is not in the range x>0"),
    ("plan typed.toml --waypoint 30,0", "gaitgraph: waypoint 1 alpha1 must be within"),
    ("plan typed.toml --law smooth", "gaitgraph: request file 'typed.toml': waypoint 1 alpha1 must be within"),
    ("plan typed.toml --period 1e10", "gaitgraph: period must be between 1e-6 and 1e9 s, got 10000000000.0"),
    ("fly gait3 --settings typed.toml", "gaitgraph: flight file 'typed.toml': flight has no field 'waypoints'"),
    ("fly gait3 --settings none.toml", "gaitgraph: flight 'none.toml' cannot be read: No such file"),
    ("pace one.csv --max-rate 3", "got neither; state max_tilt_acceleration in the vehicle, or use --max-acceleration"),
    ("pace one.csv --max-acceleration 9 --rounding 0", "--rounding"),
    ("pace one.csv --max-acceleration 9 --servo-lag 1e-12", "lag must be from"),
    ("pace one.csv --max-acceleration 9 --certify", "--certify must be given with --output, beside which it writes"),
    ("pace off.csv --max-acceleration 9", "off.csv must be a gait on one sheet, red or blue; gaitgraph validate"),
    ("plan --waypont 0,0", "'--waypoint'"),
    ("plan typo.toml", "; did you mean 'objective'"),
    ("plan --waypoint 0,0 --output gait.cvs", "; did you mean '.csv'"),
    ("export one.csv g.h --periods 3", "periods needs a table, .mcap or .yaml as output, got 3 without one"),
    ("robustness gait3 --output r.gif", "must end in .png, .svg or .pdf, got ['r.gif']"),
    ("basin gait3 --output b.mcap", "suffix of the basin output 'b.mcap' must be one of .csv"),
    ("basin gait3 --bias 2", "Invalid value for '--bias': 2.0 is not in the range 0<x<=1"),
    ("basin gait3 --output basin.gif", "suffix of the basin output 'basin.gif' must be one of .csv"),
    ("colorings there.csv", "gait file 'there.csv'"),
    ("fly gait3 --output x.h", "suffix of the flight output 'x.h' must be one of .csv"),
    ("vehicles beetle_omni --vehicle paper", "of NAME_OR_FILE, --vehicle and --from only one can be given"),
    ("fly gait3 --output none/x.csv", "folder 'none' does not exist"),
    ("fly gait3 --attitude 0.3", "Invalid value for '--attitude': '0.3' is not two angles"),
    ("fly gait3 --attitude 0,2", "attitude must be a roll from -pi to pi"),
    ("fly gait3 --reference cirle", "'cirle' is not one of 'attitude', 'hover', 'step', 'line', 'circle'"),
    ("fly gait3 --periods 3", "--from-hover"),
    ("fly gait3 --from-hover --periods 0", "Invalid value for '--periods': 0 is not in the range x>=1"),
    ("fly gait3 --size 2", "No such option '--size'"),
    ("fly gait3 --vehicle light.toml", "gaitgraph: vehicle 'light' states no mass (kg), which flight needs"),
]  # fmt: skip


@pytest.mark.parametrize(("command", "message"), WRONG, ids=[case[0] for case in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(
    run: Any, command: str, message: str
) -> None:
    Path("there.csv").write_text("mine")
    Path("bad.toml").write_text("waypoints = [")
    Path("light.toml").write_text("drag_ratio = 0.2\n")
    Path("typed.toml").write_text("waypoints = [[30, 0], [0.3, 0.3]]\n")
    Path("folder.d").mkdir()
    Path("good.toml").write_text("waypoints = [[0, 0]]")
    Path("typo.toml").write_text('waypoints = [[0, 0]]\nobjectve = "robust"\n')
    for name, row in (
        ("one.csv", "0.5,-0.5,0.5,-0.5\n0.8,-0.5,0.8,-0.5"),
        ("off.csv", "0.1,0.2,1.3,1.4"),
    ):
        Path(name).write_text(f"alpha1,alpha2,alpha3,alpha4\n{row}\n")
    Path("long.csv").write_text(
        "alpha1,alpha2,alpha3,alpha4,color\n1.125,-1,1.125,-1," + "x" * 131073
    )
    before = sorted(Path().iterdir())
    result = run(*shlex.split(command))
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert result.err.startswith("gaitgraph: ")
    assert message in result.err
    assert Path("there.csv").read_text() == "mine"
    assert sorted(Path().iterdir()) == before


def written(name: str, gait: PublishedGait, **options: Any) -> str:
    gg.lift(gait.angles, gait.color).parametrize(**options).write(name)
    return name


@pytest.mark.parametrize("gait", [G1, G4], ids=lambda gait: f"gait{gait.number}")
def test_validate(run: Any, gait: PublishedGait) -> None:
    result = run("validate", written("gait.csv", gait), "--json")
    assert (result.code, result.err) == (0 if gait.flyable else 1, "")
    report = result.json
    assert (report["valid"], report["two_color"], report["flyable"]) == (
        True,
        True,
        gait.flyable,
    )
    assert report["reachable_from_hover"] is gait.reachable
    assert report["colorings"] == [[gait.color] * 100]
    assert report["colorings_count"] == 1
    lenient = run("validate", "gait.csv", "--require", "valid")
    assert lenient.code == 0
    assert lenient.out.startswith(
        f"Flyable: {'yes' if gait.flyable else 'no'}. Obeys the paper's rules: yes."
    )


def test_colorings(run: Any) -> None:
    Path("request.json").write_text(json.dumps({"waypoints": G3.waypoints}))
    result = run("colorings", "request.json", "--json")
    assert result.code == 0
    assert (result.json["colorings"], result.json["colorings_count"]) == (
        [["red"] * 4, ["blue"] * 4],
        2,
    )
    text = run("colorings", written("gait.csv", GAITS[1]), "--limit", "1").out
    assert text.splitlines()[0] == "2 colourings of a loop of 100 points"
    assert text.splitlines()[-1] == "  … 1 of them shown"
    assert run("colorings", "gait3").out.splitlines()[1:] == [
        "  R > 0  none: point 1 has no root with R > 0, neither red nor blue",
        *("  R < 0  all red", "  R < 0  all blue"),
    ]
    Path("loop.csv").write_text("alpha1,alpha2\n0.9,-0.9\n-0.9,0.9\n")
    result = run("colorings", "loop.csv", "--coefficients", "exact", "--json")
    assert (result.code, result.json["colorings"]) == (1, [])
    assert result.json["coloring_obstacles"]["negative"]["points"] == [2]


def test_cycles(run: Any) -> None:
    Path("region.toml").write_text(
        'keep_in = [[[0.2, -0.2], [1.3, -0.2], [1.3, -1.3], [0.2, -1.3]]]\ncolor = "red"\n'
    )
    result = run(
        "cycles", "region.toml", "--max-length", "0.8", "--limit", "500", "--json"
    )
    rows = [json.loads(line) for line in result.out.splitlines()]
    assert (result.code, len(rows) > 50) == (0, True)
    lengths = [row["length"] for row in rows]
    assert lengths == sorted(lengths)
    assert {
        "color",
        "sign",
        "path",
        "types",
        "colors",
        "valid",
        "two_color",
        "flyable",
    } <= set(rows[0])
    assert all(
        0.2 <= row[0] <= 1.3 and -1.3 <= row[1] <= -0.2
        for one in rows
        for row in one["path"]
    )
    assert "all there are" in result.err
    short = run("cycles", "--max-length", "0.1", "--json")
    assert (short.code, short.json["status"]) == (1, "none")
    assert "within 0.1 rad" in short.json["reason"]
    Path("request.toml").write_text('waypoints = [["pi/8", "-pi/8"]]\n')
    assert "do not use waypoints" in run("cycles", "request.toml", "--limit", "1").err


def test_interrupting_keeps_what_is_printed(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "gaitgraph",
        "cycles",
        "--limit",
        "100000000",
        "--json",
    ]
    streams: dict[str, Any] = {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
        "text": True,
    }
    with subprocess.Popen(command, cwd=tmp_path, **streams) as job:
        assert job.stdout is not None
        assert job.stderr is not None
        first = job.stdout.readline()
        job.send_signal(signal.SIGINT)
        rest, error = (
            job.stdout.read(),
            job.stderr.read(),
        )  # communicate loses what readline read ahead
    assert (job.returncode, error) == (130, "gaitgraph: interrupted\n")
    for line in [first, *rest.splitlines()]:
        assert json.loads(line)["valid"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
@pytest.mark.parametrize(
    ("line", "code", "error"),
    [
        ("gaitgraph roots 0.3 -0.4 >&-", 2, "gaitgraph: standard output is closed\n"),
        (
            "gaitgraph vehicles > /dev/full",
            2,
            "standard output cannot be written: No space left on device\n",
        ),
        ("gaitgraph vehicles --json | head -c 10", 0, ""),
        ("gaitgraph roots 0.4 -0.4 --json | true", 0, ""),
        ("gaitgraph cycles --limit 500 --json | head -1", 0, ""),
        ("gaitgraph --help | true", 0, ""),
        ("PYTHONIOENCODING=latin-1 gaitgraph roots 0.3 -0.4", 0, ""),
    ],
)
def test_outputs_that_do_not_take_everything(
    tmp_path: Path, line: str, code: int, error: str
) -> None:
    line = line.replace("gaitgraph", f"{sys.executable} -m gaitgraph", 1)
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line],
        capture_output=True,
        check=False,
        cwd=tmp_path,
    )
    assert (done.returncode, done.stderr.count(b"\n")) == (code, error.count("\n"))
    assert done.stderr.decode().endswith(error)


def test_memory_that_does_not_suffice_is_one_line(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spent(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("gaitgraph.planning.planner.plan", spent)
    result = run("plan", "--waypoint", "0,0")
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert "not enough memory" in result.err


def test_pace(run: Any) -> None:
    limits = [
        "--max-rate",
        "6",
        "--max-acceleration",
        "60",
        "--rounding",
        "2deg",
        "--servo-lag",
        "0.02",
    ]
    asked = ["pace", written("gait3.csv", G3), *limits, "--output", "fast.json"]
    result = run(*asked, "--samples", "50", "--json")
    answer, gait = result.json, gg.lift(G3.angles, "red")
    assert (result.code, answer["status"], answer["reason"], answer["flyable"]) == (
        0,
        "ok",
        None,
        True,
    )
    least = least_period(
        gait, Limits(rate=6.0, acceleration=60.0), rounding=np.radians(2)
    ).least
    assert answer["period"] == answer["least_period"] == pytest.approx(least)
    assert answer["servo"]["distance_off_sheet"] == 0
    table = read_table("fast.json")
    assert (len(table), table.about["law"]) == (51, "least-period")


# Completion


@pytest.fixture
def complete(run: Any, monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Ask as a shell does: the words before, and the one that is not complete."""

    def ask(*words: str) -> list[str]:
        monkeypatch.setenv("_GAITGRAPH_COMPLETE", "bash_complete")
        monkeypatch.setenv("COMP_WORDS", " ".join(["gaitgraph", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        result = run()
        assert (result.code, result.err) == (0, "")
        return [line for line in result.out.splitlines() if line]

    return ask


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("pl?", ["plan"]),
        ("plan --color ?", ["auto", "red", "blue"]),
        ("plan r.toml --color b?", ["blue"]),
        ("cycles --require ?", ["flyable", "valid", "two_color"]),
        ("roots -0.3 -pi/8 --coefficients p?", ["published", "printed"]),
        ("plan --waypoint -0.3,?", []),
        ("plan re?", ["file,re"]),
        ("vehicles --vehicle b?", ["file,b", "beetle_omni", "beetle_art"]),
        ("transition gait.csv h?", ["file,h", "hover"]),
    ],
)
def test_values_are_completed(complete: Any, words: str, offered: list[str]) -> None:
    *before, last = words.split()
    assert [
        one.removeprefix("plain,") for one in complete(*before, last.rstrip("?"))
    ] == offered


def test_completion_loads_neither_the_library_nor_other_commands() -> None:
    script = (
        "import sys\nfrom gaitgraph.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print(*(name for name in sys.modules if name.startswith('gaitgraph.') or name == 'numpy'))"
    )
    asked = {
        "_GAITGRAPH_COMPLETE": "bash_complete",
        "COMP_WORDS": "gaitgraph plan --color r",
        "COMP_CWORD": "3",
    }
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **asked},
    )
    first, loaded = done.stdout.splitlines()
    assert first == "plain,red"
    shared = {
        "_lazy",
        "cli",
        "cli.inputs",
        "cli.options",
        "cli.output",
        "cli.plan",
        "errors",
        "explorer",
        "explorer.words",
        "tolerances",
    }
    assert set(loaded.split()) == {f"gaitgraph.{name}" for name in shared}


# JSON everywhere


@pytest.fixture
def files(run: Any) -> None:
    """Gaits 1 and 3 as tables, one row off every surface, and a square whose corners may not be neighbours."""
    for gait, name in ((G3, "gait3.csv"), (G1, "gait1.csv")):
        waypoints = [(a, b) for a, b in gait.waypoints]
        gg.plan_loop(waypoints, color=gait.color, require="valid").gait.parametrize(
            samples=16
        ).write(name)
    gg.certify("gait3").write("proof.json")
    Path("off.csv").write_text("alpha1,alpha2,alpha3,alpha4\n0.1,0.2,1.3,1.4\n")
    Path("no.csv").write_text("alpha1,alpha2,color\n0.5,-0.5,red\n-0.5,0.5,blue\n")
    corners = "keep_in = [[[1.4, 1.4], [1.5, 1.4], [1.5, 1.5]]]"
    square = [list(pair) for pair in G3.waypoints]
    Path("faraway.toml").write_text(f"waypoints = {square}\n{corners}\n")
    Path("study.toml").write_text(
        'name = "two"\ngaits = ["gait1", "gait4"]\n[flight]\nduration = 1.0\n'
    )


ANSWERS = [
    (["plan", *SQUARE], 0),
    (["plan", "faraway.toml", "--output", "none.csv"], 1),
    (["validate", "gait3.csv"], 0),
    (["validate", "off.csv"], 1),
    (["certify", "gait3.csv", "--output", "certificate.json"], 0),
    (["certify", "gait1.csv"], 1),
    (["verify", "proof.json"], 0),
    (["colorings", "no.csv", "--sign", "positive"], 1),
    (["region", *SQUARE], 0),
    (["region", "faraway.toml"], 1),
    (["robustness", "off.csv", "--bias", "0.8", "--scale", "0.5"], 0),
    (["transition", "gait3.csv", "gait3.csv", "--output", "path.csv"], 0),
    (["transition", "gait3.csv", "hover", "--output", "none.csv"], 1),
    (
        [
            "optimize",
            "--waypoint",
            "0.9,-0.9",
            "--objective",
            "hover_reserve",
        ],
        0,
    ),
    (["pace", "gait3.csv", "--max-rate", "5", "--max-acceleration", "30"], 0),
    (
        [
            "pace",
            "gait3.csv",
            "--max-rate",
            "5",
            "--max-acceleration",
            "30",
            "--period",
            "0.1",
        ],
        1,
    ),
    (["retarget", "gait3.csv", "--output", "kept.csv"], 0),
    (["retarget", "gait3.csv", "--keep-in", "1.4,1.4 1.5,1.4 1.5,1.5"], 1),
    (["fly", "gait1.csv"], 1),
    (["basin", "gait1.csv"], 1),
    (["study", "study.toml", "--dry-run"], 0),
    (["roots", "0.3", "-0.4"], 0),
    (["export", "gait3.csv", "gait3.json"], 0),
    (["vehicles"], 0),
    (["compare", "gait1", "gait3.csv"], 0),
]


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(
    ("arguments", "code"), ANSWERS, ids=[" ".join(case[0]) for case in ANSWERS]
)
def test_every_answer_is_one_object_and_nothing_else(
    run: Any, arguments: list[str], code: int
) -> None:
    result = run(*arguments, "--json")
    assert (result.code, result.err) == (code, "")
    assert isinstance(result.json, dict)
    assert result.out.count("\n") == 1
    assert not Path("none.csv").exists()


def test_no_command_was_forgotten() -> None:
    """Figures take long to draw, and are in tests/test_figures.py; explore serves, and has no answer."""
    assert {arguments[0] for arguments, _ in ANSWERS} | {
        "cycles",
        "explore",
        "figures",
    } >= set(COMMANDS)


def test_the_page_tells_every_command() -> None:
    assert re.findall(r"^\| `gaitgraph (\w+)", PAGE.read_text(), re.MULTILINE) == list(
        COMMANDS
    )


# Progress


def at_a_terminal(script: str) -> str:
    """Return what a script writes on standard error where that is a terminal."""
    import pty

    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm"}
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.DEVNULL,
        stderr=theirs,
        env=environment,
    ) as job:
        os.close(theirs)
        shown = b""
        with suppress(OSError):  # what Linux says once the other side is closed
            while block := os.read(ours, 65536):
                shown += block
        os.close(ours)
    assert job.returncode == 0, shown
    return shown.decode()


def test_a_pipe_shows_no_progress(capsys: pytest.CaptureFixture[str]) -> None:
    with terminal.working("waiting") as progress:
        progress("in a pipe")
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_terminal_shows_progress_and_removes_it() -> None:
    shown = at_a_terminal(
        "import gaitgraph.cli.output as terminal\n"
        "with terminal.working('waiting') as progress:\n"
        "    progress('for nothing')\n"
        "    terminal.print_problem('warning: it is late')\n"
        "    progress('still')\n"
    )
    before, after = shown.split("warning: it is late")
    assert "waiting  [" in before
    assert before.endswith("for nothing\r\x1b[Kgaitgraph: ")  # in the place of the bar
    assert "still" in after
    assert shown.endswith("\x1b[1A\x1b[2K")


# described in words
DEFAULTS_OF_NONE = {"vehicle", "coefficients", "method", "servo_margin"}


def test_options_of_plan_are_fields_of_a_request() -> None:
    """They show its defaults and its words; polygons, the floor, the accuracy and own costs are in files alone."""
    from gaitgraph.cli.plan import plan_command

    options: dict[Any, Any] = {option.name: option for option in plan_command.params}
    in_files = {"keep_in", "keep_out", "floor", "accuracy", "weight"}
    assert REQUEST_FIELDS.keys() & options.keys() == REQUEST_FIELDS.keys() - in_files
    for name, words in CHOICES.items():
        assert set(options[name].type.choices) == set(words)
    for name in REQUEST_FIELDS.keys() - in_files - DEFAULTS_OF_NONE - {"waypoints"}:
        option = options[name]
        assert option.get_default(click.Context(cli)) == REQUEST_FIELDS[name], name


@pytest.mark.parametrize(
    ("command", "function", "names"),
    [
        ("optimize", gg.optimal_gait, ("objective", "sign", "period")),
        ("retarget", gg.retarget, ("margin",)),
        ("validate", gg.validate, ("tolerance", "floor")),
        ("certify", gg.certify, ("floor",)),
        ("robustness", gg.robustness_of, ("tilt",)),
        ("basin", gg.basins_of, ("resolution", "extent", "begins")),
        ("fly", gg.flight.from_hover, ("periods",)),
    ],
)
def test_defaults_that_help_shows_are_those_of_the_library(
    command: str, function: Any, names: tuple[str, ...]
) -> None:
    context = click.Context(cli)
    found = cli.get_command(context, command)
    assert found is not None
    options = {option.name: option for option in found.params}
    parameters = inspect.signature(function).parameters
    for name in names:
        option = options[name]
        stated = option.type_cast_value(context, option.get_default(context))
        assert stated == pytest.approx(parameters[name].default), name
