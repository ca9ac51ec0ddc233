"""Comfort on the command line: completion, JSON everywhere, progress, color, suggestions, and watching a request."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import pytest
from gaitgraph.cli.watching import OwnOutputs, changes, files_of_request

import gaitgraph as gg
from gaitgraph.cli import _FILES, cli, options, terminal
from gaitgraph.flight.settings import ARMS
from gaitgraph.optimization.result import OBJECTIVES
from gaitgraph.planning.request import CHOICES
from gaitgraph.timing.timed_gait import LAWS
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.gait.table import Table

ESCAPE = "\x1b"
ANSI = re.compile(r"\x1b\[\d+m")
G1, _, G3, _ = GAITS
PAGE = Path(__file__).parent.parent / "docs" / "command_line.md"


def waypoints(*points: str) -> list[str]:
    return [part for point in points for part in ("--waypoint", point)]


SQUARE = waypoints(*(f"{a},{b}" for a, b in G3.waypoints))


# Completion


@pytest.fixture
def complete(run: Any, monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Ask as a shell does: the words before, and the one that is not complete."""

    def ask(*words: str, shell: str = "bash") -> list[str]:
        monkeypatch.setenv("_GAITGRAPH_COMPLETE", f"{shell}_complete")
        monkeypatch.setenv("COMP_WORDS", " ".join(["gaitgraph", *words]))
        monkeypatch.setenv("COMP_CWORD", words[-1] if shell == "fish" else str(len(words)))
        result = run()
        assert (result.code, result.err) == (0, "")
        return [line for line in result.out.splitlines() if line]

    return ask


def test_commands_are_completed(complete: Any) -> None:
    assert complete("") == [f"plain,{name}" for name in sorted(cli.commands)]
    assert complete("pl") == ["plain,plan"]
    assert complete("nothing") == []


@pytest.mark.parametrize("name", cli.commands)
def test_options_of_every_command_are_completed(complete: Any, name: str) -> None:
    offered = [line.removeprefix("plain,") for line in complete(name, "--")]
    known = [option for param in cli.commands[name].params for option in param.opts if option.startswith("--")]
    assert set(offered) == {*known, "--help"}
    assert "--json" in offered or name == "explore"


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("plan --color ?", ["auto", "red", "blue"]),
        ("plan r.toml --color b?", ["blue"]),
        ("plan --color = b?", ["blue"]),  # as bash divides --color=b
        ("plan --sign p?", ["positive"]),
        ("plan --objective ?", ["shortest", "robust"]),
        ("plan --method ?", ["grid", "exact"]),
        ("plan --law ?", ["smooth", "constant-speed", "equal-time"]),
        ("plan --coefficients e?", ["exact"]),
        ("optimize --objective h?", ["hover_reserve"]),
        ("cycles --require ?", ["flyable", "valid", "two_color"]),
        ("roots -0.3 -pi/8 --coefficients p?", ["published"]),
        ("plan --waypoint -0.3,?", []),
        ("plan --period ?", []),
        ("pace gait.csv --period ?", ["least"]),
    ],
)
def test_values_are_completed(complete: Any, words: str, offered: list[str]) -> None:
    *before, last = words.split()
    assert complete(*before, last.rstrip("?")) == [f"plain,{one}" for one in offered]


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("plan re?", ["file,re"]),
        ("plan --output ou?", ["file,ou"]),
        ("vehicles --vehicle b?", ["file,b", "plain,beetle_omni"]),
        ("transition g?", ["file,g"]),
        ("transition gait.csv h?", ["file,h", "plain,hover"]),
    ],
)
def test_files_are_completed_and_words_that_may_stand_for_them(complete: Any, words: str, offered: list[str]) -> None:
    *before, last = words.split()
    assert complete(*before, last.rstrip("?")) == offered


def test_other_shells_are_told_what_a_name_means(complete: Any) -> None:
    assert complete("roo", shell="zsh") == ["plain", "roots", "Every (α3, α4) on the gait surfaces for one (α1, α2)."]
    assert complete("plan", "--color", "r", shell="fish")[0].startswith("plain")
    for shell in ("zsh", "fish"):
        assert "red" in " ".join(complete("plan", "--color", "r", shell=shell))


def test_what_a_shell_offers_is_what_the_library_allows() -> None:
    known: dict[str, Any] = {**CHOICES, "goal": OBJECTIVES, "law": LAWS, "arms": ARMS}
    assert {name: tuple(known[name]) for name in options.NAMES} == options.NAMES


def test_every_name_and_file_on_the_command_line_is_completed() -> None:
    lacking = [
        (name, param.name)
        for name in cli.commands
        for param in cli.commands[name].params
        if re.search("NAME|FILE|REQUEST|FROM|TO$|OUTPUT", param.metavar or "")
        and param._custom_shell_complete is None
        and not isinstance(param.type, click.Choice)
    ]
    assert lacking == []


def test_completion_loads_neither_the_library_nor_other_commands() -> None:
    script = (
        "import sys\nfrom gaitgraph.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print(*(name for name in sys.modules if name.startswith('gaitgraph.') or name == 'numpy'))"
    )
    asked = {"_GAITGRAPH_COMPLETE": "bash_complete", "COMP_WORDS": "gaitgraph plan --color r", "COMP_CWORD": "3"}
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, env={**os.environ, **asked}
    )
    first, loaded = done.stdout.splitlines()
    assert first == "plain,red"
    shared = {"cli", "cli.commands", "cli.options", "cli.terminal", "cli.plan", "errors"}
    assert set(loaded.split()) == {f"gaitgraph.{name}" for name in shared}


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_takes_the_completion(tmp_path: Path) -> None:
    program = tmp_path / "gaitgraph"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m gaitgraph "$@"\n')
    program.chmod(0o755)
    script = (
        'eval "$(_GAITGRAPH_COMPLETE=bash_source gaitgraph)"\n'
        "complete -p gaitgraph\n"
        "COMP_WORDS=(gaitgraph plan --color = r) COMP_CWORD=4\n"
        '_gaitgraph_completion gaitgraph\necho "${COMPREPLY[@]}"\n'
    )
    paths = {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "--norc", "-c", script], capture_output=True, text=True, check=True, env={**os.environ, **paths}
    )
    assert done.stdout.splitlines() == ["complete -o nosort -F _gaitgraph_completion gaitgraph", "red"]


# JSON everywhere


@pytest.fixture
def files(run: Any) -> None:
    """Gaits 1 and 3 as tables, one row off every surface, and a square whose corners may not be neighbours."""
    for gait, name in ((G3, "gait3.csv"), (G1, "gait1.csv")):
        waypoints = [(a, b) for a, b in gait.waypoints]
        gg.plan_loop(waypoints, color=gait.color).gait.parametrize(samples=16).write(name)
    Path("off.csv").write_text("alpha1,alpha2,alpha3,alpha4\n0.1,0.2,1.3,1.4\n")
    Path("no.csv").write_text("alpha1,alpha2,color\n0.5,-0.5,red\n-0.5,0.5,blue\n")
    Path("study.toml").write_text('name = "two"\ngaits = ["gait1", "gait4"]\n[flight]\nduration = 1.0\n')
    Path("fly.toml").write_text('preset = "paper"\nmax_thrust = 2.0\n')


FARAWAY = ["--keep-in", "1.4,1.4 1.5,1.4 1.5,1.5"]
ANSWERS = [
    (["plan", *SQUARE], 0),
    (["plan", *SQUARE, "--method", "grid", "--objective", "robust", "--output", "new.csv"], 0),
    (["plan", *SQUARE, "--color", "blue", "--coefficients", "exact"], 1),
    (["plan", *SQUARE, *FARAWAY], 1),
    (["validate", "gait3.csv"], 0),
    (["validate", "gait1.csv", "--require", "flyable"], 1),
    (["validate", "off.csv"], 1),
    (["colorings", "gait3.csv", "--limit", "3"], 0),
    (["colorings", "no.csv", "--sign", "positive"], 1),
    (["region", *SQUARE], 0),
    (["region", *SQUARE, *FARAWAY], 1),
    (["robustness", "off.csv", "--bias", "0.8", "--scale", "0.5", "--curves", "1"], 0),
    (["robustness", "gait1.csv", "--curves", "1"], 0),
    (["transition", "gait3.csv", "gait3.csv", "--output", "way.csv"], 0),
    (["transition", "gait3.csv", "hover"], 1),
    (["optimize", *waypoints("0.9,-0.9"), "--pieces", "8", "--objective", "tilt_rate"], 0),
    (["optimize", *waypoints("0.9,-0.9"), *FARAWAY], 1),
    (["pace", "gait3.csv", "--max-rate", "5", "--max-acceleration", "30"], 0),
    (["pace", "gait3.csv", "--max-rate", "5", "--max-acceleration", "30", "--period", "0.1"], 1),
    (["retarget", "gait3.csv", "--output", "kept.csv"], 0),
    (["retarget", "gait3.csv", "--floor", "9"], 1),
    (["fly", "gait3.csv", "--duration", "1"], 0),
    (["fly", "gait1.csv"], 1),
    (["basin", "gait4", "--resolution", "2", "--extent", "10deg"], 0),
    (["basin", "gait1.csv"], 1),
    (["study", "study.toml", "--dry-run"], 0),
    (["study", "study.toml", "--workers", "0"], 0),
    (["roots", "0.3", "-0.4"], 0),
    (["export", "gait3.csv", "gait3.json"], 0),
    (["vehicles"], 0),
    (["vehicles", "--vehicle", "fly.toml"], 0),
]


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize(("arguments", "code"), ANSWERS, ids=[" ".join(case[0]) for case in ANSWERS])
def test_every_answer_is_one_object_and_nothing_else(
    run: Any, monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    result = run(*arguments, "--json")
    assert (result.code, result.err) == (code, "")
    assert isinstance(result.json, dict)
    assert result.out.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--limit", "3"], 0),
        (["--max-length", "0.01"], 1),
        ([*waypoints("0.5,-0.5"), *FARAWAY], 1),
        (["--effort", "1"], 1),
    ],
)
def test_cycles_are_an_object_a_line(run: Any, arguments: list[str], code: int) -> None:
    result = run("cycles", *arguments, "--json")
    assert result.code == code
    assert all(isinstance(json.loads(line), dict) for line in result.out.splitlines())
    assert result.out.count("\n") == (3 if code == 0 else 1)


def test_no_command_was_forgotten() -> None:
    """Figures take long to draw, and are in tests/test_figures.py; explore serves, and has no answer."""
    assert {arguments[0] for arguments, _ in ANSWERS} | {"cycles", "explore", "figures"} >= set(cli.commands)


def test_the_page_tells_every_command() -> None:
    assert re.findall(r"^\| `gaitgraph (\w+)", PAGE.read_text(), re.MULTILINE) == list(_FILES)


# Progress


def at_a_terminal(script: str, *arguments: str, **environment: str) -> str:
    """Return what a script writes on standard error where that is a terminal."""
    import pty

    ours, theirs = pty.openpty()
    job = subprocess.Popen(
        [sys.executable, "-c", script, *arguments],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=theirs,
        env={**os.environ, **environment},
    )  # fmt: skip
    os.close(theirs)
    shown = b""
    while True:
        try:
            block = os.read(ours, 65536)
        except OSError:  # what Linux says once the other side is closed
            break
        if not block:
            break
        shown += block
    os.close(ours)
    assert job.wait() == 0, shown
    return shown.decode()


EACH = """
import json, sys
from gaitgraph.cli import main, terminal
terminal._GRACE = 0.0
for arguments in json.loads(sys.argv[1]):
    try:
        main(arguments)
    except SystemExit as stopped:
        print("|", end="", file=sys.stderr, flush=True)
"""
LONG = {
    "planning": ["plan", *SQUARE],
    "drawing the region": ["region", *SQUARE],
    "judging gait3.csv": ["validate", "gait3.csv"],
    "tilting gait3.csv": ["robustness", "gait3.csv", "--curves", "1"],
    "coloring gait3.csv": ["colorings", "gait3.csv"],
    "searching a way": ["transition", "gait3.csv", "hover"],
    "optimising": ["optimize", *waypoints("0.9,-0.9"), "--pieces", "8", "--objective", "tilt_rate"],
    "reading gait3.csv": ["pace", "gait3.csv", "--max-rate", "5", "--max-acceleration", "30"],
    "retargeting gait3.csv": ["retarget", "gait3.csv"],
    "building the graph": ["cycles", "--limit", "3"],
    "exporting gait3.csv": ["export", "gait3.csv", "copy.csv"],
}


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
@pytest.mark.usefixtures("files")
def test_all_long_work_tells_its_progress_at_a_terminal() -> None:
    shown = at_a_terminal(EACH, json.dumps(list(LONG.values())), TERM="xterm", FORCE_COLOR="1").split("|")[:-1]
    for words, one in zip(LONG, shown, strict=True):
        assert re.match(rf"\r{re.escape(words)}( \d+ %)? … 0 s", one), (words, one)
        # The line is written over, so that nothing is left of it.
        assert re.search(r"\r +\r", one)
        assert ESCAPE not in one


def test_a_dumb_terminal_gets_lines(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(terminal, "_GRACE", 0.0)
    monkeypatch.setattr(terminal, "_RARELY", 0.0)
    shown = ""
    with terminal.Working("waiting", live=True) as progress:
        progress.part(0.25)
        while "waiting 25 %" not in shown:
            shown += capsys.readouterr().err
    shown += capsys.readouterr().err
    assert set(shown.splitlines()) <= {"waiting …", "waiting 25 % …"}
    assert "\r" not in shown


def test_quick_work_and_pipes_show_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with terminal.working("waiting") as progress:
        progress("in a pipe")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with terminal.working("waiting") as progress, progress.aside():
        progress("at a terminal, for less than a second")
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_an_answer_does_not_run_into_the_progress_line() -> None:
    script = (
        "import sys, time\nfrom gaitgraph.cli import terminal\nterminal._GRACE = 0.0\n"
        "with terminal.working('w' * 200) as progress:\n"
        "    while not progress._line:\n        time.sleep(0.001)\n"
        "    with progress.aside():\n        print('found', file=sys.stderr, flush=True)\n"
    )
    shown = at_a_terminal(script, TERM="xterm")
    before, after = shown.split("found")
    assert before.startswith("\r" + "w" * 73 + " … 0 s\r")  # as wide as the terminal, and no line more
    assert before.endswith(" \r")
    assert after.startswith("\r\n")


# Color


def test_verdicts_have_color_only_where_it_is_wanted(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    asked = ["plan", *SQUARE, "--color", "red"]
    plain = run(*asked)
    assert ESCAPE not in plain.out + plain.err

    monkeypatch.setenv("FORCE_COLOR", "1")
    colored = run(*asked).out
    assert "valid \x1b[32myes\x1b[0m · flyable" in colored
    assert "reachable from hover \x1b[31mno\x1b[0m" in colored
    assert "  \x1b[32mok\x1b[0m  closed" in colored
    assert "\x1b[33mwarning\x1b[0m: " in colored
    assert ANSI.sub("", colored) == plain.out
    assert run(*asked, *FARAWAY).out.startswith("\x1b[31mNo gait\x1b[0m.")

    monkeypatch.setenv("NO_COLOR", "1")
    assert run(*asked).out == plain.out


@pytest.mark.parametrize(
    ("environment", "is_colored"),
    [
        ({"TERM": "xterm"}, True),
        ({"TERM": "xterm", "NO_COLOR": ""}, True),  # no-color.org: only if it is not empty
        ({"TERM": "xterm", "NO_COLOR": "1"}, False),
        ({"TERM": "dumb"}, False),
        ({"TERM": "dumb", "FORCE_COLOR": "1"}, True),
        ({"TERM": "dumb", "FORCE_COLOR": "0"}, False),
    ],
)
def test_a_terminal_has_color_unless_the_environment_says_otherwise(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    environment: dict[str, str],
    is_colored: bool,
) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    terminal.print_text("  NO  tilt rate  too fast")
    assert (ESCAPE in capsys.readouterr().out) == is_colored


# Suggestions


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        ("validte x.csv", "plan|validate"),
        ("plan --waypont 0,0", "--waypoint"),
        ("plan --waypoint 0,0 --color rde", "red"),
        ("plan --waypoint 0,0 --sign positve", "positive"),
        ("plan --waypoint 0,0 --objective robst", "robust"),
        ("plan --waypoint 0,0 --method exat", "exact"),
        ("plan --waypoint 0,0 --law smoth", "smooth"),
        ("plan --waypoint 0,0 --coefficients publishd", "published"),
        ("plan --waypoint 0,0 --vehicle papr", "paper"),
        ("validate x.csv --require flyble", "flyable"),
        ("cycles --require two_colour", "two_color"),
        ("region --waypoint 0,0 --use flyabel", "flyable"),
        ("optimize --waypoint 0,0 --objective hover_reserv", "hover_reserve"),
        ("plan request.toml", "objective"),
        ("plan --waypoint 0,0 --vehicle vehicle.toml", "max_tilt"),
        ("plan --waypoint 0,0 --vehicle preset.toml", "beetle_omni"),
        ("figures --only gate", "gait"),
        ("figures --format pgn", "png"),
        ("optimize --waypoint 0,0 --sign positve", "positive"),
        ("colorings loop.csv --sign negatve", "negative"),
        ("retarget loop.csv --sign positve", "positive"),
        ("plan coefficients.toml", "published"),
        ("plan --waypoint 0,0 --vehicle spin.toml", "clockwise"),
        ("plan request.tml", ".toml"),
        ("pace gait.csv --period lest", "least"),
        ("transition gait.csv hoover", "hover"),
        ("plan --waypoint 0,0 --output gait.cvs", ".csv"),
    ],
)
def test_a_mistyped_name_is_answered_with_the_one_that_was_meant(run: Any, arguments: str, meant: str) -> None:
    Path("request.toml").write_text('waypoints = [[0, 0]]\nobjectve = "robust"\n')
    Path("vehicle.toml").write_text('preset = "paper"\nmax_tlt = 1.0\n')
    Path("preset.toml").write_text('preset = "betle_omni"\n')
    Path("coefficients.toml").write_text('waypoints = [[0, 0]]\ncoefficients = "publishd"\n')
    Path("spin.toml").write_text('preset = "paper"\nfirst_rotor_spin = "clokwise"\n')
    Path("loop.csv").write_text("alpha1,alpha2,alpha3,alpha4\n0.5,-0.5,0.5,-0.5\n")
    result = run(*arguments.split())
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert re.search(f"[Dd]id you mean.*'({meant})'", result.err)


# Watching


REQUEST = "waypoints = [[0.9, -0.9], [0.9, -0.4], [0.4, -0.4]]\n"
OTHER = "waypoints = [[0.9, -0.9], [0.9, -0.4], [0.4, -0.4]]\nreverse = true\n"


def renamed(text: str) -> Callable[[], object]:
    """Put a file in the place of the request, as many editors do."""
    Path("aside.toml").write_text(text)
    return lambda: Path("aside.toml").replace("request.toml")


@pytest.fixture
def while_watching(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[float]]:
    """Let things happen between looks at the files, one after the other, and then an interrupt."""
    slept: list[float] = []

    def plan(*happenings: Callable[[], object] | int) -> list[float]:
        """Take actions, and numbers of looks at which nothing happens."""

        def each() -> Iterator[Callable[[], object]]:
            for one in happenings:
                yield from [lambda: None] * one if isinstance(one, int) else [one]

        coming = each()

        def sleep(seconds: float) -> None:
            slept.append(seconds)
            act = next(coming, None)
            if act is None:
                raise KeyboardInterrupt
            act()

        monkeypatch.setattr("gaitgraph.cli.watching.sleep", sleep)
        return slept

    return plan


def writes(text: str, name: str = "request.toml") -> Callable[[], object]:
    return lambda: Path(name).write_text(text)


def test_watch_plans_again_after_each_change(run: Any, while_watching: Any) -> None:
    Path("request.toml").write_text(REQUEST)
    while_watching(5, writes(OTHER), 5, renamed(REQUEST), 5)
    result = run("plan", "request.toml", "--watch", "--json")
    assert (result.code, result.err) == (130, "gaitgraph: interrupted\n")
    plans = [json.loads(line) for line in result.out.splitlines()]
    assert [plan["request"]["reverse"] for plan in plans] == [False, True, False]


def test_watch_waits_until_a_file_has_settled(run: Any, while_watching: Any) -> None:
    Path("request.toml").write_text(REQUEST)
    half = OTHER[:20]
    while_watching(
        writes(""), 3, writes(half), 1, writes(OTHER), 5,  # written in pieces
        lambda: Path("request.toml").unlink(), 5, writes(REQUEST), 5,  # away for half a second
    )  # fmt: skip
    result = run("plan", "request.toml", "--watch", "--json")
    assert (result.code, result.err) == (130, "gaitgraph: interrupted\n")
    assert result.out.count("\n") == 3


def test_watch_tells_what_is_wrong_and_goes_on(run: Any, while_watching: Any) -> None:
    Path("request.toml").write_text(REQUEST)
    while_watching(
        writes("waypoints = ["), 5, writes('colour = "red"\n' + REQUEST), 5,
        lambda: Path("request.toml").unlink(), 20, writes("vehicle = 3\n" + REQUEST), 5, writes(OTHER), 5,
    )  # fmt: skip
    result = run("plan", "request.toml", "--watch")
    assert result.code == 130
    lines = result.err.splitlines()
    expected = ("it is not TOML", "did you mean 'color'?", "cannot read 'request.toml'", "vehicle: 3", "interrupted")
    assert len(lines) == len(expected)
    assert all(words in line for words, line in zip(expected, lines, strict=True))
    assert result.out.count("Planned a red gait") == 2


def test_watch_looks_at_the_vehicle_too(run: Any, while_watching: Any) -> None:
    Path("sub").mkdir()
    vehicle = 'preset = "paper"\nmax_tilt_rate = {}\n'
    Path("sub/mine.toml").write_text(vehicle.format(900))
    Path("sub/yours.toml").write_text(vehicle.format(800))
    Path("request.toml").write_text('vehicle = "sub/mine.toml"\n' + REQUEST)
    while_watching(
        writes(vehicle.format(70), "sub/mine.toml"), 5,
        writes("drag_ratio", "sub/yours.toml"), 5,  # not asked for yet
        writes('vehicle = "sub/yours.toml"\n' + REQUEST), 5,
        writes(vehicle.format(6), "sub/yours.toml"), 5,
        writes(vehicle.format(5), "sub/mine.toml"), 5,  # not asked for any more
    )  # fmt: skip
    result = run("plan", "request.toml", "--watch", "--json")
    plans = [json.loads(line) for line in result.out.splitlines()]
    assert [plan["request"]["vehicle"]["max_tilt_rate"] for plan in plans] == [900, 70, 6]
    assert result.err.splitlines()[0].startswith(
        "gaitgraph: request file 'request.toml': vehicle file 'sub/yours.toml'"
    )
    assert len(result.err.splitlines()) == 2


def test_watch_replaces_what_it_wrote_and_nothing_else(run: Any, while_watching: Any) -> None:
    Path("request.toml").write_text(REQUEST)
    seen: list[str] = []

    def look() -> None:
        seen.append(Path("gait.csv").read_text())

    while_watching(
        look, writes(OTHER), 5, look,
        writes("mine", "gait.csv"), writes(REQUEST), 5, look,
        lambda: Path("gait.csv").unlink(), writes(OTHER), 5, look,
        writes("sign = 'positive'\nkeep_in = [[[1.4, 1.4], [1.5, 1.4], [1.5, 1.5]]]\n" + REQUEST), 5, look,
    )  # fmt: skip
    result = run("plan", "request.toml", "--watch", "--output", "gait.csv")
    assert result.code == 130
    first, second, third, fourth, last = seen
    assert first != second
    assert third == "mine"
    assert fourth == second
    assert last == fourth
    lines = result.err.splitlines()
    assert "'gait.csv' exists; allowed is a new file, or --force" in lines[0]
    assert lines[1] == "gaitgraph: gait.csv holds the gait before; this request has none"
    assert len(lines) == 3
    assert result.out.count("Planned a red gait") == 4
    assert result.out.count("wrote gait.csv") == 3


def test_long_outputs_are_written_piece_by_piece(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever writes a table from a clock holds some rows of it at a time."""
    sizes: list[int] = []

    def taken(pieces: Iterable[Table], path: Path) -> None:
        sizes.extend(map(len, pieces))
        path.write_text("")

    monkeypatch.setattr("gaitgraph.io.csv_files.write_csv", taken)
    rows, long = 70_000, ["--samples", "69999", "--output", "long.csv", "--force"]
    assert run("plan", *SQUARE, "--output", "gait.json").code == 0
    for command in (
        ["plan", *SQUARE],
        ["pace", "gait.json", "--max-rate", "10", "--max-acceleration", "90", "--max-jerk", "2000"],
        ["transition", "hover", "hover"],
        ["optimize", "--waypoint", "0.9,-0.9"],
    ):
        sizes.clear()
        done = run(*command, *long)
        assert (done.code, done.err) == (0, ""), command
        assert (sum(sizes), max(sizes)) == (rows, 1 << 16), command


def test_watch_with_force_replaces_everything(run: Any, while_watching: Any) -> None:
    Path("request.toml").write_text(REQUEST)
    Path("gait.csv").write_text("mine")
    assert run("plan", "request.toml", "--watch", "--output", "gait.csv").code == 2
    while_watching(writes("mine", "gait.csv"), writes(OTHER), 5)
    result = run("plan", "request.toml", "--watch", "--output", "gait.csv", "--force")
    assert (result.code, result.err) == (130, "gaitgraph: interrupted\n")
    assert Path("gait.csv").read_text().startswith("t,alpha1")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([*SQUARE, "--watch"], "--watch: no request file to watch; allowed is with REQUEST.toml"),
        (["--watch"], "--watch: no request file to watch"),
        (["none.toml", "--watch"], "cannot read 'none.toml'"),
        (["broken.toml", "--watch"], "'broken.toml': it is not TOML"),
        (["good.toml", "--watch", "--color", "rde"], "did you mean 'red'?"),
        (["gait.json", "--watch", "--output", "./gait.json", "--force"], "output: './gait.json' is watched itself"),
    ],
)
def test_watch_begins_with_what_is_right(run: Any, arguments: list[str], message: str) -> None:
    Path("broken.toml").write_text("waypoints = [")
    Path("good.toml").write_text(REQUEST)
    Path("gait.json").write_text('{"waypoints": [[0.5, -0.5]]}')
    result = run("plan", *arguments)
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert message in result.err


def test_a_terminal_is_told_that_a_request_is_watched(
    run: Any, while_watching: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("request.toml").write_text(REQUEST)
    while_watching(1)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    result = run("plan", "request.toml", "--watch", "--json")
    assert result.err == "watching request.toml; Ctrl-C ends it\n\ngaitgraph: interrupted\n"
    assert result.out.count("\n") == 1


def test_changes_come_once_each(tmp_path: Path, while_watching: Any) -> None:
    path, beside = tmp_path / "a.toml", tmp_path / "b"
    path.write_text("1")
    beside.mkdir()
    slept = while_watching(
        3,
        lambda: path.write_text("12"), 9,
        lambda: (beside / "c").write_text("1"), 9,  # a folder changes with what is in it
        lambda: path.rename(tmp_path / "d"), lambda: (tmp_path / "d").rename(path), 9,  # back unchanged
        path.unlink, 19,
    )  # fmt: skip
    told: list[None] = []
    with pytest.raises(KeyboardInterrupt):
        told.extend(changes(lambda: [path, beside], pause=0.5, patience=4.0))
    assert len(told) == 1 + 3
    assert set(slept) == {0.5}


def test_a_request_that_cannot_be_read_keeps_its_vehicle(tmp_path: Path) -> None:
    path = tmp_path / "request.json"
    files = files_of_request(path)
    assert files() == [path]
    path.write_text('{"vehicle": "mine.toml"}')
    assert files() == [path, tmp_path / "mine.toml"]
    path.write_text('{"vehicle": "mi')
    assert files() == [path, tmp_path / "mine.toml"]
    path.write_text("[" * 100_000)
    assert files() == [path, tmp_path / "mine.toml"]
    path.write_text('{"vehicle": "paper"}')
    assert files() == [path]
    assert files_of_request(path, "paper")() == [path]
    assert files_of_request(tmp_path / "gait.csv")() == [tmp_path / "gait.csv"]


def test_outputs_are_all_kept_if_one_is_not_ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from gaitgraph.timing.timed_gait import pieces_of

    monkeypatch.chdir(tmp_path)
    table = partial(pieces_of, gg.lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=4))
    other = partial(pieces_of, gg.lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(samples=6))
    own = OwnOutputs(["a.csv", "b.json"])
    own.write(table)
    assert own.own == ("a.csv", "b.json")
    kept = Path("a.csv").read_bytes()
    Path("b.json").write_text("mine")
    with pytest.raises(gg.errors.OutputExists, match=r"b\.json"):
        own.write(other)
    assert Path("a.csv").read_bytes() == kept
    Path("b.json").unlink()
    own.write(other)
    assert Path("a.csv").read_bytes() != kept
