"""The command line as a user meets it: every command, exit codes, one line for wrong input; completion and progress."""

from __future__ import annotations

import inspect
import json
import math
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
import pytest

import gaitgraph as gg
from gaitgraph.cli import COMMANDS, cli, output as terminal
from gaitgraph.cli.options import LAWS as STATED_LAWS
from gaitgraph.io.formats import read_table
from gaitgraph.planning.location import located
from gaitgraph.planning.request import CHOICES, REQUEST_FIELDS, PlanRequest
from gaitgraph.timing.laws import LAWS
from tests.published import GAITS
from tests.samples import cases

if TYPE_CHECKING:
    from collections.abc import Callable

PAGE = Path(__file__).parent.parent / "docs" / "command_line.md"
CORNERS = [list(pair) for pair in GAITS[2].waypoints]
FAR = "[[1.4, 1.4], [1.5, 1.4], [1.5, 1.5]]"
FILES = {
    "there.csv": "mine",
    "bad.toml": "waypoints = [",
    "light.toml": "drag_ratio = 0.2\n",
    "degrees.toml": "waypoints = [[30, 0], [0.3, 0.3]]\n",
    "good.toml": f"waypoints = {CORNERS}\nperiod = 2.0\n",
    "point.csv": "alpha1,alpha2,alpha3,alpha4\n0.5,-0.5,0.5,-0.5\n0.8,-0.5,0.8,-0.5\n",
    "off.csv": "alpha1,alpha2,alpha3,alpha4\n0.1,0.2,1.3,1.4\n",
    "crossing.csv": "alpha1,alpha2,color\n0.5,-0.5,red\n-0.5,0.5,blue\n",
    "crossing.toml": 'waypoints = [[0.5, -0.5], [-0.5, 0.5]]\nsign = "positive"\n',
    "long.csv": "alpha1,alpha2,color\n1.125,-1," + "x" * 131073,
    "far.toml": f"waypoints = [[0.4, -0.4]]\nkeep_in = [{FAR}]\n",
    "study.toml": 'name = "two"\ngaits = ["gait1"]\n[flight]\nduration = 1.0\n',
    "fast.toml": 'preset = "paper"\nmax_tilt_rate = 300\nmax_tilt_acceleration = 2e4\n',
}


@pytest.fixture
def line(run: Any) -> Callable[[str], Any]:
    """Run a command line in a folder with files."""
    for name, text in FILES.items():
        Path(name).write_text(text)
    return lambda command: run(*shlex.split(command))


# Answers


def test_plan_for_people_fits_a_screen_and_writes_the_gait(line: Any) -> None:
    done = line("plan good.toml --output a.csv --output a.json")
    lines = done.out.splitlines()
    assert done.code == 0
    assert len(lines) <= 40
    assert lines[0].startswith("Planned a red gait, R < 0: 4 corners, 3.1416 rad")
    assert "Flyable: yes. Obeys the paper's rules: yes. Reachable from" in done.out
    assert lines[-4].startswith("warning: entering from hover (R > 0)")
    assert lines[-2:] == ["wrote a.csv", "wrote a.json"]
    assert len(read_table("a.csv")) == len(read_table("a.json")) == 101


def test_options_replace_what_a_file_says_and_an_answer_is_a_request(line: Any) -> None:
    options = "--period 4 --divisions 16 --rate 0.5 --require valid --output b.csv"
    plan = line(f"plan good.toml {options} --json").json
    assert (plan["request"]["period"], plan["request"]["method"]) == (4.0, "grid")
    assert len(read_table("b.csv")) == 3
    Path("plan.json").write_text(json.dumps(plan))
    assert line("plan plan.json --json").json == plan


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("plan good.toml --period 0.99 --rate 60 --output a.csv", "60.6061 rows per s"),
        ("plan good.toml --period 1 --rate 60 --output a.csv", ""),
        ("validate crossing.csv", "warning: the file states no vehicle"),
        ("validate crossing.csv --vehicle paper", ""),
        ("validate crossing.csv --json", ""),
        ("cycles good.toml --limit 1", "do not use waypoints"),
    ],
)
def test_what_is_not_used_or_assumed_is_said_on_standard_error(
    line: Any, command: str, said: str
) -> None:
    err = line(command).err
    assert said in err
    assert bool(err) == bool(said)


def test_limits_that_look_like_degrees_are_shown_in_degrees(line: Any) -> None:
    told = [
        "warning: the limit of the tilt rate is 300 rad/s = 17,189°/s: for degrees write '300deg'",
        "warning: the limit of the tilt acceleration is 20,000 rad/s² = 1,145,916°/s²: for degrees write '20000deg'",
    ]
    planned = line("plan good.toml --vehicle fast.toml --output fast.csv")
    for done in (planned, line("validate fast.csv"), line("pace fast.csv")):
        lines = done.out.splitlines()
        assert [text for text in lines if "for degrees" in text] == told
    assert all(text in line("vehicles fast.toml").err for text in told)


@pytest.mark.parametrize(
    ("command", "first"),
    cases("""
plan --waypoint 0.4,-1.2 | The plan is a single posture, not a gait
optimize --waypoint 0.4,-0.4 --radius 0.1 --objective hover_reserve | The best gait stands still at (
optimize --waypoint 0.4,-0.4 --waypoint 0.4,-0.4 | The best gait stands still at (
"""),
)
def test_a_gait_that_stands_still_says_so_first(
    line: Any, command: str, first: str
) -> None:
    assert line(command).out.startswith(first)
    assert first[1:] in line(f"{command} --json").json["warnings"][0]


def test_roots(line: Any) -> None:
    answer = line("roots 0.3 -3pi/8 --json").json
    assert answer["alpha2"] == -3 * math.pi / 8
    names = {"alpha3", "alpha4", "types", "color", "R", "R_phi", "R_theta"}
    assert {*answer["roots"][0]} == names
    printed = line("roots 0.3 0.5 --coefficients exact").out.splitlines()
    assert printed[3].split()[::4] == ["blue", "0"]  # without the noise of round-off
    fiber = f"roots {math.atan(gg.PAPER.drag_ratio)!r} -.3 --coefficients exact"
    assert "continuum (?,*): alpha3 = 0.167093, alpha4 free" in line(fiber).out


def test_export(line: Any) -> None:
    line("plan good.toml --output a.csv")
    answer = line("export a.csv b.json c.csv --json").json
    report = gg.validate("a.csv")
    assert (answer["rows"], answer["outputs"]) == (101, ["b.json", "c.csv"])
    assert answer["columns"] == [*read_table("a.csv").columns]
    assert answer["warnings"] == [*report.warnings]
    assert (answer["valid"], answer["flyable"]) == (True, True)
    slower = "--force --period 4 --samples 8 --law equal-time --periods 2"
    said = line(f"export a.csv c.csv d.h {slower}").out
    assert said.startswith("wrote c.csv: 17 rows\nwrote d.h: 9 rows\n")
    assert read_table("c.csv")["t"][-1] == 8


def test_vehicles_and_version(line: Any) -> None:
    names = [row["name"] for row in line("vehicles --json").json["vehicles"]]
    assert names == [*gg.vehicle.preset_names()]
    Path("mine.toml").write_text('drag_ratio = 0.1\nmax_tilt = "80deg"\n')
    shown = line("vehicles --vehicle mine.toml").out
    assert shown.startswith("mine: κ = 0.100000, δ = 0.099669 rad")
    assert "max tilt          1.3963 rad = 80°\n" in shown
    about = gg.vehicle.vehicle_named("mine.toml")
    assert shown.splitlines()[1:] == str(about).splitlines()[1:]
    assert line("--version").out == f"gaitgraph, version {gg.__version__}\n"


def test_colorings(line: Any) -> None:
    done = line("colorings gait3 --json")
    assert (done.code, done.json["colorings"]) == (0, [["red"] * 4, ["blue"] * 4])
    shown = line("colorings gait3").out
    assert "R > 0  none: point 1 has no root with R > 0, neither red nor blue" in shown
    assert shown.endswith("  R < 0  all red\n  R < 0  all blue\n")
    assert line("colorings gait2").out.startswith("2 colourings of a loop of 4 points")


def test_region(line: Any) -> None:
    request = PlanRequest(waypoints=((0.8, -0.8), (1.2, -0.4)))
    stated = "--waypoint 0.8,-0.8 --waypoint 1.2,-0.4"
    expected = json.loads(json.dumps(located(request).as_mapping()))
    assert line(f"region {stated} --json").json["regions"] == expected["regions"]


def test_cycles(line: Any) -> None:
    region = "keep_in = [[[0.2, -0.2], [1.3, -0.2], [1.3, -1.3], [0.2, -1.3]]]"
    Path("region.toml").write_text(f'{region}\ncolor = "red"\n')
    done = line("cycles region.toml --max-length 0.8 --limit 500 --json")
    rows = [json.loads(text) for text in done.out.splitlines()]
    assert done.code == 0
    assert len(rows) > 50
    lengths = [row["length"] for row in rows]
    assert lengths == sorted(lengths)
    assert lengths[-1] <= 0.8
    for row in rows:
        for alpha1, alpha2, *_ in row["path"]:
            assert 0.2 <= alpha1 <= 1.3
            assert -1.3 <= alpha2 <= -0.2
    assert f"{len(rows)} cycles: all there are" in done.err
    default = line("cycles region.toml --max-length 0.8 --json")
    assert default.out.splitlines() == done.out.splitlines()[:20]
    first = line("cycles region.toml --max-length 0.8 --limit 3 --json")
    assert first.out.splitlines() == done.out.splitlines()[:3]
    assert first.err.startswith("3 cycles: no others are shorter than ")
    short = line("cycles --max-length 0.1 --json")
    assert (short.code, short.json["status"]) == (1, "none")
    assert "within 0.1 rad" in short.json["reason"]


def test_pace(line: Any) -> None:
    Path("lagging.toml").write_text('preset = "paper"\nservo_lag = 0.02\n')
    options = (
        "--vehicle lagging.toml --max-rate 6 --max-acceleration 60 --rounding 2deg"
    )
    done = line(f"pace gait3 {options} --output fast.json --samples 50 --json")
    answer = done.json
    assert (done.code, answer["status"], answer["flyable"]) == (0, "ok", True)
    stated = gg.Limits(rate=6, acceleration=60)
    least = gg.least_period("gait3", stated, rounding="2deg").least
    assert answer["period"] == answer["least_period"] == pytest.approx(least)
    assert answer["servo"]["distance_off_sheet"] == 0
    table = read_table("fast.json")
    assert (len(table), table.about["law"]) == (51, "least-period")
    shown = line("pace gait3 --max-acceleration 60 --output slow.csv --samples 20").out
    assert "not flyable" not in shown
    assert "wrote slow.csv: 21 rows" in shown


ANSWERS = cases("""
0 | plan good.toml
1 | plan far.toml --output none.csv
0 | validate gait3
1 | validate off.csv
0 | certify gait3 --output certificate.json
1 | certify gait1
0 | verify proof.json
1 | colorings crossing.toml
0 | region good.toml
1 | region far.toml
0 | robustness off.csv --bias 0.8
0 | transition gait3 gait3 --output path.csv
1 | transition gait3 hover --output none.csv
0 | optimize --waypoint 0.9,-0.9 --objective hover_reserve
0 | pace gait3 --max-rate 5 --max-acceleration 30
1 | pace gait3 --max-rate 5 --max-acceleration 30 --period 0.1
0 | retarget gait3 --output kept.csv
1 | retarget gait3 --keep-in '1.4,1.4 1.5,1.4 1.5,1.5'
1 | fly gait1
1 | basin gait1
1 | basin gait2 --resolution 1 --bias 0.05
0 | basin gait4 --resolution 1
0 | study study.toml --dry-run
0 | roots 0.3 -0.4
0 | export gait3 gait3.json
0 | vehicles
0 | compare gait1 gait3
""")


@pytest.mark.parametrize(("code", "command"), ANSWERS)
def test_every_answer_is_one_object_and_nothing_else(
    line: Any, command: str, code: str
) -> None:
    gg.certify("gait3").write("proof.json")
    done = line(f"{command} --json")
    assert (done.code, done.err, done.out.count("\n")) == (int(code), "", 1)
    assert isinstance(done.json, dict)
    assert not Path("none.csv").exists()


def test_no_command_was_forgotten() -> None:
    """Figures take long to draw and are tested elsewhere, cycles have a line each, explore has no answer."""
    tried = {command.split()[0] for _, command in ANSWERS}
    assert tried | {"cycles", "explore", "figures"} == {*COMMANDS}
    page = re.findall(r"^\| `gaitgraph (\w+)", PAGE.read_text(), re.MULTILINE)
    assert page == [*COMMANDS]


# One case for each way of being wrong


@pytest.mark.parametrize(
    ("command", "message"),
    cases("""
plan | a request file or --waypoint A1,A2 must be given; see gaitgraph plan --help
plann | No such command 'plann'. Did you mean 'plan'?
plan --waypoints 0,0 | Did you mean '--waypoint'? See gaitgraph plan --help
plan --color | Option '--color' requires an argument; see gaitgraph plan --help
validate gait4 --once | --once must be given with a table of rows, got gait4; see gaitgraph validate
fly gait4 --once | --once must be given with a table of rows, got gait4
plan --waypoint 0.1 | Invalid value for '--waypoint': '0.1' is not two angles
plan --waypoint 0,0,0,0 | '0,0,0,0' is not two angles
plan --waypoint 0,0 --period soon | 'soon' is not a valid number
plan --waypoint 0,0 --period -1 | -1.0 is not in the range x>0
plan --waypoint 0,0 --divisions 300 | from 2 to 256, got 300; plan --method exact needs no grid
plan --waypoint 0,0 --vehicle none.toml | vehicle 'none.toml' cannot be read: No such file
plan --waypoint 0,0 --vehicle light | got 'light'; did you mean 'light.toml'?
plan --waypoint 0,0 --vehicle= | vehicle must be a preset
plan --waypoint 0,0 --output x.cvs | got 'x.cvs'; did you mean '.csv'
plan --waypoint 0,0 --output x.svg | .h, .gif, .mp4, got 'x.svg'; films are .gif, .mp4
plan --waypoint 0,0 --output there.csv | output 'there.csv' exists; overwrite it with --force
plan --waypoint 0,0 --output none/x.csv | folder 'none' does not exist
plan none.toml | request file 'none.toml' cannot be read:
plan bad.toml | texts need quotes, as in '30deg', and numbers a decimal point
plan light.toml | request file 'light.toml'
plan film.gif | got 'film.gif'; this format is not read: use the gait table or the request
plan good.toml --sign plus | 'plus' is not one of 'auto', 'positive', 'negative'; see gaitgraph plan
plan degrees.toml --waypoint 30,0 | gaitgraph: waypoint 1 alpha1 must be within
plan degrees.toml | gaitgraph: request file 'degrees.toml': waypoint 1 alpha1 must be within
plan good.toml --period 1e10 | gaitgraph: period must be between 1e-6 and 1e9 s, got 10000000000.0
roots 0.1 0.2 -0.3 | Got unexpected extra argument (-0.3)
roots | Missing argument 'A1'
roots 0.1 north | alpha2 must be a finite number in radians
validate none.csv | gaitgraph: gait file 'none.csv' cannot be read: No such file or directory
validate long.csv | line 2 must be comma-separated text: field larger than field limit (131072)
optimize --waypoint 0,0 --keep-in '0,0 1' | Invalid value for '--keep-in': '1' is not two angles
optimize --waypoint 0,0 --radius=-1 | '-1' is not an angle ≥ 0, such as 0.3, pi/8 or 20deg
transition hover hovr | did you mean 'hover'?
figures --only 2 --output there.csv | '--output': Directory 'there.csv' is a file
compare gait3 none.csv --output both.gif | must end in .png, .svg or .pdf, got ['both.gif']
pace point.csv --max-rate 3 | state max_tilt_acceleration in the vehicle, or use --max-acceleration
pace point.csv --max-acceleration 9 --rounding 0 | --rounding
pace point.csv --max-acceleration 9 --certify | --certify must be given with --output
pace off.csv --max-acceleration 9 | off.csv must be a gait on one sheet, red or blue; gaitgraph validate
export point.csv g.h --periods 3 | periods needs a table, .mcap or .yaml as output, got 3 without one
basin gait3 --output b.mcap | suffix of the basin output 'b.mcap' must be one of .csv
fly gait3 --output x.h | suffix of the flight output 'x.h' must be one of .csv
fly gait3 --settings none.toml | gaitgraph: flight 'none.toml' cannot be read: No such file
fly gait3 --settings degrees.toml | gaitgraph: flight file 'degrees.toml': flight has no field 'waypoints'
fly gait3 --attitude 0,2 | attitude must be a roll from -pi to pi
fly gait3 --vehicle light.toml | gaitgraph: vehicle 'light' states no mass (kg), which flight needs
vehicles paper --vehicle paper | of NAME_OR_FILE, --vehicle and --from only one can be given
"""),
)
def test_wrong_input_is_one_line_and_exit_code_2(
    line: Any, command: str, message: str
) -> None:
    before = sorted(Path().iterdir())
    done = line(command)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert done.err.startswith("gaitgraph: ")
    assert message in done.err
    assert Path("there.csv").read_text() == "mine"
    assert sorted(Path().iterdir()) == before


def test_memory_that_does_not_suffice_is_one_line(
    line: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spent(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("gaitgraph.planning.planner.plan", spent)
    done = line("plan --waypoint 0,0")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert "not enough memory" in done.err


# Where the process ends early


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
@pytest.mark.parametrize(
    ("command", "error"),
    [
        ("gaitgraph roots 0.3 -0.4 >&-", "standard output is closed"),
        ("gaitgraph vehicles > /dev/full", "cannot be written: No space left"),
        ("gaitgraph cycles --limit 150 --json | head -1", ""),
        ("PYTHONIOENCODING=latin-1 gaitgraph roots 0.3 -0.4", ""),
    ],
)
def test_outputs_that_do_not_take_everything(
    tmp_path: Path, command: str, error: str
) -> None:
    command = command.replace("gaitgraph", f"{sys.executable} -m gaitgraph", 1)
    shell = ["bash", "-o", "pipefail", "-c", command]
    done = subprocess.run(
        shell, capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert error in done.stderr
    assert (done.returncode, done.stderr.count("\n")) == ((2, 1) if error else (0, 0))


def test_interrupting_keeps_what_is_printed(tmp_path: Path) -> None:
    command = f"{sys.executable} -m gaitgraph cycles --limit 100000000 --json"
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command.split(), cwd=tmp_path, stdout=pipe, stderr=pipe, text=True
    ) as job:
        assert job.stdout is not None
        assert job.stderr is not None
        first = job.stdout.readline()
        job.send_signal(signal.SIGINT)
        # communicate loses what readline read ahead.
        rest = job.stdout.read()
        error = job.stderr.read()
    assert (job.returncode, error) == (130, "gaitgraph: interrupted\n")
    for text in [first, *rest.splitlines()]:
        assert json.loads(text)["valid"]


# Help


@pytest.mark.parametrize("name", COMMANDS)
def test_help(run: Any, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    done = run(name, "--help")
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("Usage: gaitgraph")
    fits_a_screen = len(done.out.splitlines()) <= 40
    assert fits_a_screen or name in ("plan", "fly", "export")


CONTEXT = click.Context(cli)


def options_of(command: str) -> dict[str, Any]:
    loaded = cli.get_command(CONTEXT, command)
    assert loaded is not None
    return {str(option.name): option for option in loaded.params}


def test_options_of_plan_are_fields_of_a_request() -> None:
    """They show its defaults and its words; polygons, the floor, the accuracy and own costs are in files alone."""
    assert tuple(LAWS) == STATED_LAWS
    options = options_of("plan")
    in_files = {"keep_in", "keep_out", "floor", "accuracy", "weight"}
    in_words = {"vehicle", "coefficients", "method", "servo_margin", "waypoints"}
    fields = REQUEST_FIELDS.keys() - in_files
    assert fields == REQUEST_FIELDS.keys() & options.keys()
    for name, words in CHOICES.items():
        assert {*options[name].type.choices} == {*words}
    for name in fields - in_words:
        assert options[name].get_default(CONTEXT) == REQUEST_FIELDS[name], name


@pytest.mark.parametrize(
    ("command", "function", "names"),
    [
        ("optimize", gg.optimal_gait, "objective sign period"),
        ("retarget", gg.retarget, "margin"),
        ("validate", gg.validate, "floor"),
        ("robustness", gg.robustness_of, "tilt"),
        ("basin", gg.basins_of, "resolution"),
    ],
)
def test_defaults_that_help_shows_are_those_of_the_library(
    command: str, function: Any, names: str
) -> None:
    for name in names.split():
        option = options_of(command)[name]
        shown = option.type_cast_value(CONTEXT, option.get_default(CONTEXT))
        default = inspect.signature(function).parameters[name].default
        assert shown == pytest.approx(default), name


# Completion


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("pl?", ["plan"]),
        ("plan r.toml --color b?", ["blue"]),
        ("cycles --require ?", ["flyable", "valid", "two_color"]),
        ("plan --waypoint -0.3,?", []),
        ("plan re?", ["file,re"]),
        ("vehicles --vehicle b?", ["file,b", "beetle_omni", "beetle_art"]),
        ("transition gait.csv h?", ["file,h", "hover"]),
    ],
)
def test_values_are_completed(
    run: Any, words: str, offered: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_GAITGRAPH_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", f"gaitgraph {words.rstrip('?')}")
    monkeypatch.setenv("COMP_CWORD", str(len(words.split())))
    done = run()
    assert (done.code, done.err) == (0, "")
    shown = [text.removeprefix("plain,") for text in done.out.splitlines() if text]
    assert shown == offered


COMPLETE = """
import os, sys
os.environ |= {"COMP_WORDS": "gaitgraph plan --color r", "COMP_CWORD": "3", "_GAITGRAPH_COMPLETE": "bash_complete"}
from gaitgraph.cli import main
try:
    main()
except SystemExit:
    pass
print(*(name for name in sys.modules if name.startswith("gaitgraph.") or name == "numpy"))
"""


def test_completion_loads_neither_the_library_nor_other_commands() -> None:
    out = subprocess.check_output([sys.executable, "-c", COMPLETE], text=True)
    first, loaded = out.splitlines()
    assert first == "plain,red"
    shared = "_lazy cli cli.inputs cli.options cli.output cli.plan errors explorer explorer.words"
    assert {*loaded.split()} == {f"gaitgraph.{name}" for name in shared.split()}


# Progress

WAITING = """
import gaitgraph.cli.output as terminal
with terminal.working('waiting') as progress:
    progress('for nothing')
    terminal.print_problem('warning: it is late')
    progress('still')
"""


def at_a_terminal(script: str) -> str:
    """Return what a script writes on standard error where that is a terminal."""
    import pty

    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", script]
    environment = {**os.environ, "TERM": "xterm"}
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stderr=theirs, env=environment
    ) as job:
        os.close(theirs)
        shown = b""
        with suppress(OSError):  # what Linux says once the other side is closed
            while block := os.read(ours, 65536):
                shown += block
        os.close(ours)
    assert job.returncode == 0, shown
    return shown.decode()


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_terminal_shows_progress_and_removes_it_and_a_pipe_shows_none(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = at_a_terminal(WAITING)
    before, after = shown.split("warning: it is late")
    assert "waiting  [" in before
    assert before.endswith("for nothing\r\x1b[Kgaitgraph: ")  # in the place of the bar
    assert "still" in after
    assert shown.endswith("\x1b[1A\x1b[2K")
    with terminal.working("waiting") as progress:
        progress("in a pipe")
    assert capsys.readouterr().err == ""
