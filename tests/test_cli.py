"""The command line as a user meets it: every command, exit codes, one line for wrong input."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.cli import cli, main
from gaitgraph.cli.commands import CommandFiles, Group
from gaitgraph.io.reading import read_table
from tests.published import GAITS, PublishedGait

G1, _, G3, G4 = GAITS


def interrupt(job: subprocess.Popen[str]) -> str:
    """Interrupt until it ends, as a user would: Python itself drops an interrupt that falls within a callback."""
    while True:
        job.send_signal(signal.SIGINT)
        try:
            return job.communicate(timeout=20)[1]
        except subprocess.TimeoutExpired:
            continue


def interruptible() -> None:
    """Let a process be interrupted even if the tests run in the background, where a shell has that ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def waypoints(gait: PublishedGait) -> list[str]:
    return [part for a, b in gait.waypoints for part in ("--waypoint", f"{a},{b}")]


@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
def test_plan_json(run: Any, gait: PublishedGait) -> None:
    result = run("plan", *waypoints(gait), "--color", gait.color, "--json")
    assert result.code == 0
    assert result.err == ""
    plan = result.json
    keys = "status reason color sign waypoints path types colors length vertices alternatives valid flyable".split()
    assert {*keys, "reachable_from_hover", "checks", "warnings"} <= set(plan)
    assert plan["status"] == "planned"
    assert (plan["color"], plan["sign"]) == (gait.color, gait.sign)
    assert (plan["valid"], plan["flyable"], plan["reachable_from_hover"]) == (True, gait.flyable, gait.reachable)
    np.testing.assert_allclose(plan["vertices"], np.column_stack([gait.angles, gait.printed]), atol=5.0001e-4)
    assert len(plan["path"]) == len(plan["types"]) == len(plan["colors"]) == 4
    assert plan["lower_bound"] == pytest.approx(plan["length"], abs=1e-12)
    grid = run("plan", *waypoints(gait), "--color", gait.color, "--method", "grid", "--json").json
    assert (plan["method"], grid["method"]) == ("exact", "grid")
    assert len(grid["path"]) == len(grid["types"]) == len(grid["colors"]) == 16
    assert grid["length"] == pytest.approx(plan["length"], abs=1e-12)
    assert {"name", "ok", "value", "limit", "where", "message"} <= set(plan["checks"][0])


def test_plan_for_people_fits_one_screen(run: Any) -> None:
    result = run("plan", *waypoints(G3), "--output", "gait3.csv", "--output", "gait3.json")
    assert result.code == 0
    lines = result.out.splitlines()
    assert len(lines) <= 40
    assert lines[0].startswith("Planned a red gait, R < 0: 4 corners, 3.1416 rad around")
    assert "valid yes · flyable yes · reachable from hover no" in result.out
    assert "wrote gait3.csv" in result.out
    assert len(read_table("gait3.csv")) == len(read_table("gait3.json")) == 101
    assert read_table("gait3.json").about["request"]["waypoints"][0] == pytest.approx(G3.angles[0])


def test_plan_that_does_not_exist(run: Any) -> None:
    result = run("plan", *waypoints(G1), "--coefficients", "exact", "--json", "--output", "none.csv")
    assert result.code == 1
    assert result.json["status"] == "infeasible"
    assert "R = 0 on the whole blue sheet" in result.json["reason"]
    assert not Path("none.csv").exists()
    text = run("plan", *waypoints(G1), "--coefficients", "exact")
    assert text.code == 1
    assert text.out.startswith("No gait.")


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
    fast = run("plan", "request.toml", "--period", "0.5", "--rate", "4", "--json", "--output", "b.csv").json
    assert not fast["flyable"]
    assert "needs a period of at least" in fast["reason"]
    assert len(read_table("b.csv")) == 3
    # A request in JSON and a saved plan are requests too.
    Path("request.json").write_text(json.dumps({"waypoints": [["pi/8", "-pi/8"]], "vehicle": {"drag_ratio": 0.1}}))
    assert run("plan", "request.json", "--json").json["request"]["vehicle"]["drag_ratio"] == 0.1
    Path("plan.json").write_text(json.dumps(plan))
    again = run("plan", "plan.json", "--json").json
    assert again == plan


def test_plan_options_reach_the_plan(run: Any) -> None:
    result = run(
        "plan", *waypoints(G4), "--any-order", "--reverse", "--objective", "robust", "--divisions", "8",
        "--method", "grid", "--sign", "positive", "--law", "equal-time", "--json",
    )  # fmt: skip
    request = result.json["request"]
    assert request["any_order"] is request["reverse"] is True
    assert (request["objective"], request["divisions"], request["law"]) == ("robust", 8, "equal-time")
    assert result.json["method"] == "grid"


def test_roots(run: Any) -> None:
    result = run("roots", "0.3", "-3pi/8", "--json")
    assert result.code == 0
    roots = result.json["roots"]
    assert set(roots[0]) == {"alpha3", "alpha4", "types", "color", "R", "R_phi", "R_theta"}
    assert [root["color"] for root in roots] == ["red", "blue"]
    assert result.json["alpha2"] == -3 * np.pi / 8
    text = run("roots", "-.4", "-pi/8")
    assert text.code == 0
    assert "blue" in text.out
    exact = repr(float(np.arctan(gg.PAPER.drag_ratio)))
    fiber = run("roots", exact, "0.3", "--coefficients", "exact")
    assert "continuum (?,*): alpha3 = 0.167093, alpha4 free" in fiber.out
    assert run("roots", exact, "0.3", "--coefficients", "exact", "--json").json["fibers"][0]["free"] == "alpha4"
    narrow = run("roots", "0.2", "0.5", "--crossing-tolerance", "1deg", "--json").json
    assert narrow["roots"][0]["types"] == "(+,+)"
    assert run("roots", "0.2", "0.5", "--json").json["roots"][0]["types"] == "(?,+)"
    assert run("roots", "0.1", "0.2", "--vehicle", "beetle_omni", "--json").code == 0


def test_export(run: Any) -> None:
    run("plan", *waypoints(G3), "--output", "a.csv")
    result = run("export", "a.csv", "b.json", "c.csv", "--json")
    assert result.json == {"rows": 101, "columns": list(read_table("a.csv").columns), "outputs": ["b.json", "c.csv"]}
    assert Path("a.csv").read_bytes() == Path("c.csv").read_bytes()
    assert run("export", "a.csv", "c.csv").code == 2
    slower = run("export", "a.csv", "c.csv", "--force", "--period", "4", "--samples", "8", "--law", "equal-time")
    assert slower.out.startswith("wrote c.csv: 9 rows")
    assert read_table("c.csv")["t"][-1] == 4


def test_vehicles_and_version(run: Any) -> None:
    rows = run("vehicles", "--json").json["vehicles"]
    assert [row["name"] for row in rows] == ["paper", "beetle_omni"]
    assert rows[1]["drag_ratio"] == pytest.approx(0.0599, abs=5e-5)
    Path("mine.toml").write_text("drag_ratio = 0.1\n")
    assert run("vehicles", "--vehicle", "mine.toml").out.startswith("mine: κ = 0.100000, δ = 0.099669 rad")
    assert run("--version").out == f"gaitgraph, version {gg.__version__}\n"


@pytest.mark.parametrize("command", [[], *[[name] for name in cli.commands]])
def test_help(run: Any, command: list[str]) -> None:
    result = run(*command, "--help")
    assert result.code == 0
    assert result.out.startswith("Usage: gaitgraph")
    assert result.err == ""


def test_no_arguments_show_the_help(run: Any) -> None:
    result = run()
    assert result.code == 0
    assert "Commands:" in result.out


WRONG = [
    ("plan", "waypoints: none given"),
    ("plan --waypoint 0.1", "waypoint 1: '0.1'; allowed is A1,A2"),
    ("plan --waypoint 0.1,x", "waypoint 1 alpha2: 'x'"),
    ("plan --waypoint nan,0", "waypoint 1 alpha1: 'nan'"),
    ("plan --waypoint inf,0", "waypoint 1 alpha1: 'inf'"),
    ("plan --waypoint 0.1,0.2 --waypoint -1.58,0", "waypoint 2 alpha1: '-1.58'; allowed is −π/2 to π/2"),
    ("plan --waypoint 0,0 --color green", "color: 'green'; allowed are auto, red, blue"),
    ("plan --waypoint 0,0 --sign +", "sign: '+'"),
    ("plan --waypoint 0,0 --divisions 1", "divisions: 1"),
    ("plan --waypoint 0,0 --divisions many", "--divisions"),
    ("plan --waypoint 0,0 --method exacto", "method: 'exacto'"),
    ("plan --waypoint 0,0 --objective x", "objective: 'x'"),
    ("plan --waypoint 0,0 --law x", "got 'x'"),
    ("plan --waypoint 0,0 --period 0", "period must be between 1e-6 and 1e9 s, got 0.0"),
    ("plan --waypoint 0,0 --period nan", "period must be between 1e-6 and 1e9 s, got nan"),
    ("plan --waypoint 0,0 --samples 0", "samples must be a whole number from 1 to 10000000, got 0"),
    ("plan --waypoint 0,0 --rate -3", "rate must be a positive finite number (Hz), got -3.0"),
    ("plan --waypoint 0,0 --rate 3 --samples 2", "samples, rate"),
    ("plan --waypoint 0,0 --vehicle x", "vehicle: 'x'"),
    ("plan --waypoint 0,0 --vehicle=", "vehicle: ''"),
    ("roots 0 0 --vehicle=", "vehicle: ''"),
    ("plan --waypoint 0,0 --vehicle none.toml", "vehicle: cannot read 'none.toml'"),
    ("plan --waypoint 0,0 --coefficients x", "--coefficients"),
    ("plan --waypoint 0,0 --vehicle beetle_omni --coefficients published", "'published' belong to the paper"),
    ("plan --waypoint 0,0 --output x.txt", "output: 'x.txt'"),
    ("plan --waypoint 0,0 --output there.csv", "output: 'there.csv' exists"),
    ("plan --waypoint 0,0 --output no/x.csv", "folder 'no' does not exist"),
    ("plan --waypoint 0,0 --colour red", "--colour"),
    ("plan none.toml", "request file: cannot read 'none.toml'"),
    ("plan bad.toml", "request file 'bad.toml': it is not TOML"),
    ("plan unknown.toml", "unknown.toml': colour: no field of a request; did you mean 'color'?"),
    ("plan empty.toml", "empty.toml': waypoints: missing"),
    ("plan number.json", "number.json': it holds a int"),
    ("plan deep.json", "deep.json'"),
    ("plan latin.toml", "not UTF-8"),
    ("plan there.csv", "column 'alpha1' is missing"),
    ("plan folder.toml", "Is a directory"),
    ("plan vehicle.toml", "vehicle: 3; allowed is a preset's name"),
    ("roots", "A1"),
    ("roots 0.1", "A2"),
    ("roots 0.1 0.2 -0.3", "(-0.3); allowed is what 'gaitgraph roots --help' says"),
    ("roots x 0", "alpha1: 'x' is no angle"),
    ("roots 1.6 0", "alpha1 must be from −π/2 to π/2"),
    ("roots 0 -inf", "-inf"),
    ("roots 0 0 --crossing-tolerance -1", "--crossing-tolerance: '-1'"),
    ("export", "GAIT_FILE"),
    ("export there.csv", "OUTPUT"),
    ("export there.csv out.csv", "gait file 'there.csv'"),
    ("export none.csv out.csv", "cannot read 'none.csv'"),
    ("export none.csv there.csv", "output: 'there.csv' exists"),
    ("vehicles --vehicle x", "vehicle: 'x'"),
    ("plann", "no command 'plann'; did you mean 'plan'?"),
    ("--nothing", "--nothing"),
]  # fmt: skip


@pytest.mark.parametrize(("command", "message"), WRONG, ids=[case[0] for case in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(run: Any, command: str, message: str) -> None:
    Path("there.csv").write_text("mine")
    Path("bad.toml").write_text("waypoints = [")
    Path("unknown.toml").write_text('colour = "red"\nwaypoints = [[0, 0]]')
    Path("empty.toml").write_text("")
    Path("number.json").write_text("3")
    Path("deep.json").write_text("[" * 100_000)
    Path("latin.toml").write_bytes(b"\xff")
    Path("vehicle.toml").write_text("waypoints = [[0, 0]]\nvehicle = 3\n")
    Path("folder.toml").mkdir()
    result = run(*command.split())
    assert result.code == 2
    assert result.out == ""
    assert result.err.count("\n") == 1
    assert result.err.startswith("gaitgraph: ")
    assert message in result.err
    assert Path("there.csv").read_text() == "mine"
    assert not Path("out.csv").exists()


def command(*args: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "gaitgraph", *args], capture_output=True, text=True, check=False, **options
    )


def test_outputs_may_begin_with_a_negative_number(run: Any) -> None:
    run("plan", *waypoints(G3), "--output", "a.csv")
    assert run("export", "a.csv", "-1.csv").code == 0
    assert Path("-1.csv").read_bytes() == Path("a.csv").read_bytes()


@pytest.mark.parametrize("encoding", ["cp1252", "latin-1"])
def test_narrow_encodings_get_question_marks(tmp_path: Path, encoding: str) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    for arguments in (["roots", "0.3", "-0.4"], ["roots", "9", "0"], ["plan", *waypoints(G3), "--json"]):
        done = subprocess.run(
            [sys.executable, "-m", "gaitgraph", *arguments],
            capture_output=True, encoding=encoding, check=False, cwd=tmp_path, env=environment,
        )  # fmt: skip
        assert done.returncode == (2 if "9" in arguments else 0)
        assert "Traceback" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
def test_a_full_output_is_one_line(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "gaitgraph", "vehicles"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert (
        done.stderr
        == "gaitgraph: standard output: cannot write: No space left on device; allowed is a place with room\n"
    )


def test_the_module_runs_as_a_program(tmp_path: Path) -> None:
    done = command("roots", "0.3", "-0.4", "--json", cwd=tmp_path)
    assert done.returncode == 0
    assert json.loads(done.stdout)["roots"]
    assert command("roots", "9", "0", cwd=tmp_path).returncode == 2


def test_a_terminal_without_greek_is_no_reason_to_fail(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = command("plan", *waypoints(G3), cwd=tmp_path, env=environment)
    assert done.returncode == 0
    assert done.stderr == ""


def test_a_reader_that_goes_away_is_no_error(tmp_path: Path) -> None:
    line = f"{sys.executable} -m gaitgraph plan {' '.join(waypoints(G3))} --json | head -c 10"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(os.name == "nt", reason="signals differ")
def test_interruption_is_130(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "gaitgraph", "plan", *waypoints(G3), "--divisions", "256", "--objective", "robust"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path, preexec_fn=interruptible,
    )  # fmt: skip
    time.sleep(3.0)
    err = interrupt(process)
    assert process.returncode == 130
    assert err.strip() == "gaitgraph: interrupted"


def test_unforeseen_errors_are_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("gaitgraph.surface.closed_form_roots.roots", broken)
    with pytest.raises(ZeroDivisionError):
        main(["roots", "0", "0"])


def written(name: str, gait: PublishedGait, **options: Any) -> str:
    gg.lift(gait.angles, gait.color).parametrize(**options).write(name)
    return name


class TestValidate:
    """gaitgraph validate."""

    @pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
    @pytest.mark.parametrize("suffix", ["csv", "json"])
    def test_the_four_gaits(self, run: Any, gait: PublishedGait, suffix: str) -> None:
        name = written(f"gait.{suffix}", gait)
        result = run("validate", name, "--json")
        assert (result.code, result.err) == (0, "")
        report = result.json
        assert (report["valid"], report["two_color"]) == (True, True)
        assert report["flyable"] is gait.flyable
        assert report["reachable_from_hover"] is gait.reachable
        assert report["colorings_count"] == len(report["colorings"]) == {1: 1, 2: 2, 3: 2, 4: 1}[gait.number]
        assert [gait.color] * 100 in report["colorings"]
        strict = run("validate", name, "--require", "flyable")
        assert strict.code == (0 if gait.flyable else 1)
        assert strict.out.startswith(f"valid yes · flyable {'yes' if gait.flyable else 'no'}")

    def test_a_saved_plan_and_options(self, run: Any) -> None:
        Path("plan.json").write_text(run("plan", *waypoints(G3), "--json").out)
        assert run("validate", "plan.json", "--require", "flyable").code == 0
        assert run("validate", "plan.json", "--require", "flyable", "--floor", "0.6").code == 1
        name = written("gait.csv", G1)
        assert run("validate", name, "--coefficients", "exact").code == 1
        Path("slow.toml").write_text('preset = "paper"\nmax_tilt_rate = 1.0\n')
        slow = run("validate", written("fast.csv", G3), "--vehicle", "slow.toml", "--require", "flyable", "--json")
        assert slow.code == 1
        rate = next(check for check in slow.json["checks"] if check["name"] == "tilt_rate")
        assert not rate["ok"]
        assert rate["value"] > rate["limit"] == 1.0
        assert rate["where"]["row"] > 0
        noisy = "alpha1,alpha2,alpha3,alpha4\n0.8,-0.8,0.81,-0.8\n"
        Path("noisy.csv").write_text(noisy)
        assert run("validate", "noisy.csv").code == 1
        assert run("validate", "noisy.csv", "--tolerance", "0.05", "--angle-rounding", "0.5deg").code == 0
        undecided = run("validate", "noisy.csv", "--tolerance", "0.05", "--angle-rounding", "60deg", "--json").json
        assert "undecided" in undecided["warnings"][0]
        wide = run("validate", written("g2.csv", GAITS[1]), "--crossing-tolerance", "pi/2", "--json").json
        assert wide["colorings_count"] is None or wide["colorings_count"] > 2

    @pytest.mark.parametrize(
        ("name", "content", "message"),
        [
            ("empty.csv", "", "it is empty"),
            ("header.csv", "alpha1,alpha2,alpha3,alpha4\n", "it has no rows"),
            ("missing.csv", "alpha1,alpha2\n0,0\n", "column 'alpha3' is missing"),
            ("doubled.csv", "alpha1,alpha2,alpha2,alpha4\n0,0,0,0\n", "column 'alpha2' appears twice"),
            ("ragged.csv", "alpha1,alpha2,alpha3,alpha4\n0,0,0,0\n0,0\n", "line 3 has 2 fields; allowed are 4"),
            ("text.csv", "alpha1,alpha2,alpha3,alpha4\n0,zero,0,0\n", "row 1: alpha2 is 'zero'; allowed is a finite"),
            ("nan.csv", "alpha1,alpha2,alpha3,alpha4\n0,nan,0,0\n", "row 1: alpha2 is 'nan'"),
            ("inf.csv", "alpha1,alpha2,alpha3,alpha4\n0,0,-inf,0\n", "row 1: alpha3 is '-inf'"),
            ("time.csv", "t,alpha1,alpha2,color\n1,0,0,red\n1,0,0,red\n", "row 2: t = 1.0 does not increase"),
            ("semi.csv", "alpha1;alpha2;alpha3;alpha4\n0;0;0;0\n", "separated by semicolons; allowed are commas"),
            ("tabs.csv", "alpha1\talpha2\talpha3\talpha4\n0\t0\t0\t0\n", "separated by tabs; allowed are commas"),
            ("suffix.xlsx", "", "must have one of the suffixes .csv, .json"),
            ("deep.json", "[" * 100_000, "nested too deeply"),
            ("deep_object.json", '{"columns": ' * 100_000, "nested too deeply"),
            ("utf16.csv", "alpha1".encode("utf-16"), "not UTF-8 text"),
            ("long.csv", b"x" * 9_000_000, "a line is longer than"),
            ("beyond.csv", "alpha1,alpha2,color\n2,0,red\n", "row 1: alpha1 is 2.0 rad; allowed is"),
        ],
    )
    def test_wrong_files_end_in_one_line(self, run: Any, name: str, content: str | bytes, message: str) -> None:
        Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
        for command in ("validate", "colorings", "export"):
            extra = ["out.csv"] if command == "export" else []
            result = run(command, name, *extra, "--json")
            if command == "colorings" and name in ("missing.csv", "suffix.xlsx"):
                continue
            assert result.code == 2
            assert result.out == ""
            assert result.err.count("\n") == 1
            assert message in result.err
            assert name in result.err
            assert not Path("out.csv").exists()

    def test_files_that_are_none(self, run: Any) -> None:
        Path("folder.csv").mkdir()
        for name, message in (("none.csv", "No such file"), ("folder.csv", "Is a directory")):
            result = run("validate", name)
            assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
            assert message in result.err

    def test_wrong_options_end_in_one_line(self, run: Any) -> None:
        name = written("gait.csv", G3)
        for options, message in (
            (["--tolerance", "-1"], "tolerance must be a finite number ≥ 0, got -1.0"),
            (["--floor", "nan"], "floor must be a finite number ≥ 0, got nan"),
            (["--angle-rounding", "much"], "--angle-rounding: 'much' is no angle"),
            (["--crossing-tolerance", "-0.1"], "--crossing-tolerance: '-0.1'; allowed is an angle ≥ 0"),
            (["--require", "pretty"], "'pretty' is not one of 'valid', 'flyable'"),
            (["--vehicle", "car"], "vehicle: 'car' is neither a preset"),
        ):
            result = run("validate", name, *options)
            assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
            assert message in result.err


class TestColorings:
    """gaitgraph colorings."""

    def test_the_papers_loops(self, run: Any) -> None:
        for gait, expected in zip(GAITS, (["blue"], ["red", "blue"], ["red", "blue"], ["red"]), strict=True):
            Path("request.json").write_text(json.dumps({"waypoints": gait.waypoints}))
            result = run("colorings", "request.json", "--json")
            assert result.code == 0
            assert result.json["colorings"] == [[color] * 4 for color in expected]
            assert result.json["colorings_count"] == len(expected)
            table = run("colorings", written(f"gait{gait.number}.csv", gait), "--json").json
            assert table["colorings"] == [[color] * 100 for color in expected]
        text = run("colorings", "gait2.csv")
        assert text.out.splitlines()[0] == "2 colourings of a loop of 100 points"
        assert "R < 0  all red" in text.out

    def test_none_and_why(self, run: Any) -> None:
        Path("loop.csv").write_text("alpha1,alpha2\n0.9,-0.9\n-0.9,0.9\n")
        result = run("colorings", "loop.csv", "--coefficients", "exact", "--json")
        assert result.code == 1
        assert result.json["colorings"] == []
        assert result.json["coloring_obstacles"]["negative"]["points"] == [2]
        assert run("colorings", "loop.csv", "--coefficients", "exact").out.startswith("0 colourings of a loop")
        assert run("colorings", "loop.csv", "--sign", "negative").out.splitlines()[-1].endswith("all blue")

    def test_limit_and_sign(self, run: Any) -> None:
        Path("loop.csv").write_text("alpha1_deg,alpha2_deg\n" + "11.25,-11.25\n22.5,-11.25\n" * 20)
        every = run("colorings", "loop.csv", "--sign", "negative", "--limit", "3", "--json").json
        assert every["colorings_count"] > 1000
        assert len(every["colorings"]) == 3
        assert run("colorings", "loop.csv", "--limit", "0", "--json").json["colorings"] == []
        wrong = run("colorings", "loop.csv", "--sign", "up")
        assert (wrong.code, wrong.err.count("\n")) == (2, 1)
        assert "sign must be auto, negative or positive, got 'up'" in wrong.err


class TestCycles:
    """gaitgraph cycles."""

    def test_a_stream_of_objects(self, run: Any) -> None:
        result = run("cycles", "--divisions", "8", "--limit", "30", "--json")
        assert result.code == 0
        rows = [json.loads(line) for line in result.out.splitlines()]
        assert len(rows) == 30
        lengths = [row["length"] for row in rows]
        assert lengths == sorted(lengths)
        for row in rows:
            assert {"color", "sign", "path", "types", "colors", "valid", "two_color", "flyable"} <= set(row)
            assert row["valid"]
            assert row["two_color"]
        assert "every cycle shorter than" in result.err

    def test_through_waypoints_the_papers_loop_is_the_shortest(self, run: Any) -> None:
        rows = [json.loads(line) for line in run("cycles", *waypoints(G3), "--limit", "2", "--json").out.splitlines()]
        assert [row["color"] for row in rows] == ["red", "blue"]
        assert rows[0]["length"] == pytest.approx(np.pi)
        Path("request.toml").write_text(
            'waypoints = [["3pi/8", "-3pi/8"], ["pi/8", "-pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]\n'
        )
        options = ["--limit", "1", "--require", "flyable", "--json"]
        crossed = run("cycles", "request.toml", *options).json
        free = run("cycles", "request.toml", "--any-order", *options).json
        assert crossed["length"] > free["length"] == pytest.approx(np.pi)

    def test_inside_a_region(self, run: Any) -> None:
        square = "0.3,-1.3 1.3,-1.3 1.3,-0.3 0.3,-0.3"
        hole = "0.7,-0.9 0.9,-0.9 0.9,-0.7 0.7,-0.7"
        for options, allowed in (([], True), (["--keep-out", hole], False)):
            out = run("cycles", "--keep-in", square, *options, "--color", "red", "--limit", "60", "--json").out
            paths = [json.loads(line)["path"] for line in out.splitlines()]
            points = np.array([row for path in paths for row in path])
            assert points[:, 0].min() >= 0.3
            assert points[:, 1].max() <= -0.3
            inside = (np.abs(points[:, 0] - np.pi / 4) < 0.01) & (np.abs(points[:, 1] + np.pi / 4) < 0.01)
            assert inside.any() == allowed

    def test_none_and_why(self, run: Any) -> None:
        short = run("cycles", "--max-length", "0.1", "--json")
        assert (short.code, short.json["status"]) == (1, "none")
        assert "within 0.1 rad" in short.json["reason"]
        apart = run("cycles", "--waypoint", "1.2,-1.2", "--waypoint", "-0.5,0.5", "--color", "red")
        assert apart.code == 1
        assert "waypoint" in apart.out or "stop" in apart.out
        for options, message in (
            (["--max-length", "nan"], "--max-length: 'nan' is no angle"),
            (["--keep-in", "0,0 1"], "--keep-in: '0,0 1'; allowed is"),
            (["--divisions", "1"], "divisions: 1; allowed"),
            (["--color", "green"], "color: 'green'; allowed"),
            (["--effort", "0"], "--effort"),
        ):
            wrong = run("cycles", *options)
            assert (wrong.code, wrong.out, wrong.err.count("\n")) == (2, "", 1)
            assert message in wrong.err

    def test_an_effort_that_is_spent_tells_the_bound(self, run: Any) -> None:
        stops = ["--waypoint", "pi/8,pi/8", "--waypoint", "-pi/4,pi/4", "--color", "blue", "--sign", "negative"]
        spent = run("cycles", *stops, "--effort", "5", "--json", "--limit", "1")
        exact = run("cycles", *stops, "--json", "--limit", "1").json
        assert spent.code == 0
        assert spent.json["bound"] <= exact["length"] + 1e-9 <= spent.json["length"] + 2e-9
        assert "the best one found" in spent.err

    def test_a_region_in_a_file_needs_no_waypoints(self, run: Any) -> None:
        Path("region.toml").write_text(
            'keep_in = [[[0.2, -0.2], [1.3, -0.2], [1.3, -1.3], [0.2, -1.3]]]\ncolor = "red"\n'
        )
        result = run("cycles", "region.toml", "--max-length", "0.8", "--limit", "500", "--json")
        paths = [json.loads(line)["path"] for line in result.out.splitlines()]
        assert result.code == 0
        assert len(paths) > 50
        assert all(0.2 <= row[0] <= 1.3 and -1.3 <= row[1] <= -0.2 for path in paths for row in path)
        assert "all there are" in result.err

    def test_more_than_nine_waypoints_in_any_order_are_a_heuristic_that_is_named(self, run: Any) -> None:
        points = [part for k in range(10) for part in ("--waypoint", f"{0.3 + 0.06 * k},{-0.4 - (k * 7) % 10 * 0.04}")]
        result = run("cycles", *points, "--any-order", "--color", "red", "--sign", "negative", "--limit", "1", "--json")
        assert result.code == 0
        assert "order of 10 waypoints by Christofides' heuristic (networkx)" in result.err
        ordered = run(
            "cycles", *points, "--color", "red", "--sign", "negative", "--limit", "1", "--effort", "1000", "--json"
        )
        assert ordered.code == 1 or ordered.json["length"] > result.json["length"]

    def test_an_effort_too_small_is_no_answer(self, run: Any) -> None:
        result = run("cycles", "--effort", "1", "--json")
        assert result.code == 1
        assert result.json["status"] == "unfinished"
        assert result.json["bound"] >= 0
        assert run("cycles", "--effort", "1").out.startswith("Unfinished: none found so far")

    def test_interrupting_keeps_what_is_printed(self, tmp_path: Path) -> None:
        command = [sys.executable, "-m", "gaitgraph", "cycles", "--limit", "100000000", "--json"]
        streams: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen(command, cwd=tmp_path, preexec_fn=interruptible, **streams) as job:
            assert job.stdout is not None
            assert job.stderr is not None
            first = job.stdout.readline()
            job.send_signal(signal.SIGINT)
            rest = job.stdout.read()
            assert job.stderr.read().strip() == "gaitgraph: interrupted"
        assert job.returncode == 130
        for line in [first, *rest.splitlines()]:
            assert json.loads(line)["valid"]


class TestTransition:
    """gaitgraph transition."""

    def test_entry_and_exit(self, run: Any) -> None:
        name = written("gait4.csv", G4)
        entry = run("transition", "hover", name, "--output", "entry.csv", "--samples", "20", "--json")
        assert entry.code == 0
        plan = entry.json
        assert (plan["status"], plan["flyable"], plan["leaves_corner"]) == ("planned", True, None)
        table = read_table("entry.csv")
        assert len(table) == 21
        assert table.alpha[0].tolist() == [0, 0, 0, 0]
        np.testing.assert_allclose(table.alpha[-1], plan["path"][-1])
        exit_ = run("transition", name, "hover", "--duration", "2", "--json").json
        assert exit_["path"] == plan["path"][::-1]
        assert exit_["duration"] == 2.0
        text = run("transition", "hover", name, "--output", "entry.csv")
        assert (text.code, text.out) == (2, "")
        assert "exists" in text.err
        text = run("transition", "hover", name, "--output", "entry.csv", "--force")
        assert "wrote entry.csv" in text.out

    def test_no_way_to_negative_R(self, run: Any) -> None:
        result = run("transition", "hover", written("gait3.csv", G3), "--output", "none.csv", "--json")
        assert result.code == 1
        assert result.json["proof"]["R_start"] == 4.0
        assert result.json["proof"]["R_end"] < 0
        assert not Path("none.csv").exists()
        text = run("transition", "hover", "gait3.csv")
        assert text.code == 1
        assert "every flight between them passes a singular matrix" in text.out

    def test_hover_to_hover_and_wrong_input(self, run: Any) -> None:
        assert run("transition", "hover", "hover", "--vehicle", "beetle_omni").code == 0
        for arguments, message in (
            (["hover", "none.csv"], "No such file"),
            (["hover", "hovr"], "did you mean 'hover'?"),
            (["hover", "hover", "--law", "fast"], "law must be smooth, constant-speed or equal-time, got 'fast'"),
            (["hover", "hover", "--duration", "-1"], "duration: -1.0; allowed"),
            (["hover"], "Missing argument 'TO'"),
        ):
            wrong = run("transition", *arguments)
            assert (wrong.code, wrong.out, wrong.err.count("\n")) == (2, "", 1)
            assert message in wrong.err


@pytest.mark.parametrize(
    "text",
    [
        ".".join(["a"] * 100_000) + " = 1",
        "[" + ".".join(["a"] * 100_000) + "]",
        "x = {" + " . ".join(['"a"'] * 100_000) + " = 1}",
        "x = " + "[" * 100_000,
    ],
)
def test_toml_nested_deeply_is_refused_at_once(run: Any, text: str) -> None:
    Path("deep.toml").write_text(text)
    for arguments in (("plan", "deep.toml"), ("vehicles", "--vehicle", "deep.toml"), ("colorings", "deep.toml")):
        result = run(*arguments)
        assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
        assert "nested too deeply" in result.err


def test_memory_that_does_not_suffice_is_one_line(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def spent(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("gaitgraph.planning.planner.plan", spent)
    result = run("plan", "--waypoint", "0,0")
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert "not enough memory" in result.err


def test_a_closed_standard_output_is_one_line(tmp_path: Path) -> None:
    command = f"{sys.executable} -m gaitgraph roots 0.3 -0.4 >&-"
    done = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "standard output is closed" in done.stderr


def test_interrupting_at_any_moment_leaves_no_traceback(tmp_path: Path) -> None:
    for delay in (0.08, 0.15, 0.25):
        command = [sys.executable, "-m", "gaitgraph", "cycles", "--limit", "100000000"]
        # Coverage, measured in every process of the tests, loads modules of its own before anything else.
        with subprocess.Popen(
            command,
            cwd=tmp_path,
            env={name: value for name, value in os.environ.items() if not name.startswith("COV")},
            preexec_fn=interruptible,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        ) as job:
            time.sleep(delay)
            err = interrupt(job)
        # Before that Python itself, or its run of the module, is what is interrupted.
        assert str(Path("gaitgraph", "cli")) not in err
        assert job.returncode != 130 or err.strip() == "gaitgraph: interrupted"


class TestRobustness:
    """gaitgraph robustness."""

    @staticmethod
    def rows(name: str, *rows: str) -> str:
        Path(name).write_text("\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]) + "\n")
        return name

    def test_json(self, run: Any) -> None:
        result = run("robustness", written("gait3.csv", G3), "--bias", "0.8", "--curves", "3", "--json")
        assert (result.code, result.err) == (0, "")
        data = result.json
        keys = {"tilt_margin_deg", "tilt_margin_reason", "acceptable_fraction", "singular_curves"}
        assert set(data) >= keys | {"biased", "sweep", "least_singular_value", "tilt_margin_where"}
        assert set(data["biased"]) >= keys | {"eta"}
        assert (data["tilt_margin_deg"], data["acceptable_fraction"]) == (90.0, 1.0)
        assert data["biased"]["eta"] == 0.8
        assert data["biased"]["tilt_margin_deg"] == pytest.approx(74.46, abs=5e-3)
        assert 0.84 < data["biased"]["acceptable_fraction"] < 0.86
        assert data["sweep"] == [data["biased"]]
        assert len(data["singular_curves"]) == len(data["biased"]["singular_curves"]) == 3

    def test_a_sweep(self, run: Any) -> None:
        options = ["--bias", "0.9", "--bias", "0.8", "--scale", "0.5", "--curves", "0"]
        data = run("robustness", written("gait4.csv", G4), *options, "--json").json
        assert data["biased"] is None
        assert [(one["scaling"], one["eta"]) for one in data["sweep"]] == [
            ("biased", 0.9), ("biased", 0.8), ("scaled", 0.5)
        ]  # fmt: skip
        margins = [one["tilt_margin_deg"] for one in data["sweep"]]
        assert margins == pytest.approx([71.01, 61.66, 90.0], abs=5e-3)
        assert data["singular_curves"] == []

    def test_no_margin_is_null_with_a_reason(self, run: Any) -> None:
        """Blue gaits, as planned and as printed with three digits; biased, there is one, or a place where R = 0."""
        printed = self.rows(
            "printed.csv", "0.982,0.393,-0.648,-0.727", "0.982,1.178,-0.648,-1.512", "0.196,1.178,0.138,-1.512",
            "0.196,0.393,0.138,-0.727",
        )  # fmt: skip
        for name in (written("gait1.csv", G1), printed):
            data = run("robustness", name, "--bias", "0.8", "--curves", "1", "--json").json
            assert data["tilt_margin_deg"] is None
            assert "singular at every attitude" in data["tilt_margin_reason"]
            assert data["acceptable_fraction"] == data["least_singular_value"] == 0
            assert data["singular_curves"][0]["kind"] == "everywhere"
            assert data["biased"]["tilt_margin_deg"] == 0
            assert data["biased"]["tilt_margin_reason"] == "R changes its sign"
            assert set(data["biased"]["tilt_margin_where"]) == {"row", "t", "fraction", "alpha"}
        text = run("robustness", printed, "--bias", "0.8").out
        assert "none" in text
        assert "tilt margin 0° at row" in text

    def test_for_people(self, run: Any) -> None:
        result = run("robustness", written("gait3.csv", G3), "--bias", "0.9", "--scale", "0.7", "--tilt", "20deg")
        assert (result.code, result.err) == (0, "")
        lines = result.out.splitlines()
        assert len(lines) <= 24
        assert lines[0] == "Robustness to attitude, vehicle paper, exact coefficients"
        assert "within 20° of tilt" in lines[1]
        assert [line.split()[0] for line in lines[2:5]] == ["the", "biased", "scaled"]
        assert "90.00°" in lines[2]
        assert "80.68°" in lines[3]

    def test_any_table_of_angles(self, run: Any) -> None:
        """Off the surface, one row only, with a vehicle of one's own."""
        single = self.rows("one.csv", "0.3,-0.3,0.1,-0.2")
        data = run("robustness", single, "--json").json
        assert data["tilt_margin_deg"] == pytest.approx(85.78, abs=5e-3)
        assert len(data["singular_curves"]) == 1
        other = run("robustness", single, "--vehicle", "beetle_omni", "--json").json
        assert other["vehicle"] == "beetle_omni"
        assert other["tilt_margin_deg"] != data["tilt_margin_deg"]
        published = run("robustness", single, "--coefficients", "published", "--json").json
        assert published["coefficients"] == "published"
        assert published["tilt_margin_deg"] == pytest.approx(data["tilt_margin_deg"], abs=0.1)
        steep = run("robustness", single, "--tilt", "89deg", "--json").json
        assert steep["least_singular_value"] == 0

    def test_a_tolerance_that_cannot_be_met_says_how_far_it_came(self, run: Any) -> None:
        name = written("gait3.csv", G3)
        start = time.perf_counter()
        met = run("robustness", name, "--bias", "0.8", "--tolerance", "1e-3", "--json").json["biased"]
        data = run("robustness", name, "--bias", "0.8", "--tolerance", "1e-12", "--json").json["biased"]
        assert time.perf_counter() - start < 60
        assert 1e-12 < data["acceptable_fraction_error"] < 1e-5 < met["acceptable_fraction_error"] <= 1e-3
        gained = data["acceptable_fraction"] - met["acceptable_fraction"]
        assert 0 <= gained <= met["acceptable_fraction_error"] + 1e-5
        assert "as far as it came" in run("robustness", name, "--bias", "0.8", "--tolerance", "1e-12").out

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ("nan.csv", "row 1: alpha4 is 'nan'; allowed is a finite number"),
            ("empty.csv", "no rows; allowed is at least one"),
            ("void.csv", "it is empty"),
            ("none.csv", "cannot read 'none.csv'"),
            ("far.csv", "alpha1 is 1000000.0 rad; allowed is"),
            *((f"one.csv --bias {eta}", "bias: η = ") for eta in ("0", "-1", "1.5", "nan", "inf")),
            ("one.csv --bias abc", "--bias"),
            ("one.csv --scale 0", "scale: η = 0.0; allowed is a number in (0, 1]"),
            ("one.csv --tilt 90deg", "tilt: 1.5707963267948966; allowed is"),
            ("one.csv --tilt -1deg", "tilt: "),
            ("one.csv --tilt x", "--tilt: 'x' is no angle"),
            *((f"one.csv --tolerance {wrong}", "tolerance: ") for wrong in ("0", "nan", "-1", "inf")),
            ("one.csv --curves -1", "curves: -1; allowed is 0 to 10000"),
            ("one.csv --curves 10001", "curves: 10001"),
            ("one.csv --angle-rounding -1", "--angle-rounding: '-1'"),
            ("one.csv --vehicle x", "vehicle: 'x'"),
            ("one.csv --vehicle beetle_omni --coefficients published", "'published' belong to the paper"),
            ("", "Missing argument 'GAIT_FILE'"),
        ],
    )
    def test_wrong_input(self, run: Any, arguments: str, message: str) -> None:
        self.rows("nan.csv", "0.3,-0.3,0.1,nan")
        self.rows("empty.csv")
        Path("void.csv").write_text("")
        self.rows("far.csv", "1e6,0,0,0")
        self.rows("one.csv", "0.3,-0.3,0.1,-0.2")
        result = run("robustness", *arguments.split())
        assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
        assert result.err.startswith("gaitgraph: ")
        assert message in result.err


def test_a_command_may_be_added_and_taken_away() -> None:
    files = CommandFiles("gaitgraph.cli", {"roots": "roots"})
    group = Group("group", commands=files)
    group.add_command(click.Command("mine"))
    assert group.list_commands(click.Context(group)) == ["mine", "roots"]
    assert files["roots"] is cli.commands["roots"]
    del files["mine"]
    assert list(files) == ["roots"]
    assert group.get_command(click.Context(group), "mine") is None
