"""What the documentation shows runs: examples, requests, every Python block, commands above their output."""

from __future__ import annotations

import json
import re
import runpy
import shlex
import tomllib
from doctest import ELLIPSIS, OutputChecker
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

import click
import matplotlib.pyplot as plt
import pytest

import gaitgraph as gg
from gaitgraph.cli import cli, main
from gaitgraph.io.formats import read_table
from gaitgraph.plots import films
from gaitgraph.plots.figures import FIGURES

if TYPE_CHECKING:
    from _pytest.mark import ParameterSet

pytestmark = (
    pytest.mark.no_cover
)  # what pages show has tests of its own, which are traced

ROOT = Path(__file__).parent.parent
SLOW = {"planning", "reproduction", "research", "robustness", "servo_errors"}  # pages


def of_page(page: Path, *values: str) -> ParameterSet:
    """Return the case of a test of a page, marked if the page is one of the slow ones."""
    marks = [pytest.mark.slow] if page.stem in SLOW else []
    return pytest.param(page, *values, id=page.stem, marks=marks)


EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
CONTEXT = click.Context(cli)
REQUESTS = sorted((ROOT / "examples").glob("*.toml"))
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("**/*.md"))]
TUTORIAL = ROOT / "docs" / "tutorial.md"
OTHER_PAGES = [page for page in PAGES if page != TUTORIAL]
BLOCK = r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?"
BLOCKS = [
    of_page(page, block, shown)
    for page in OTHER_PAGES
    for block, shown in re.findall(BLOCK, page.read_text(), re.M | re.S)
]
FIGURES_OF_PAGES = {
    f"_figures/{figure.stem}.png" for figure in FIGURES.values()
}  # drawn when the site is built
EXPECTED = {
    "any_four_rotors": "on the plane: tilt margin 71.0°, 81.4 % of attitudes acceptable",
    "plan_a_gait": "[ 1.178 -0.393  1.178 -0.393]",
    "the_four_gaits": "Gait 4: valid True, flyable True, from hover True",
    "check_your_own_gait": "corners 1 (+,+) and 2 (-,-) may not be neighbours",
    "your_vehicle": "T = 2.0 s: flyable",
    "judge_a_table": "row 2 lies on neither sheet: take",
    "colour_a_loop": "1267650600228229401496703205376 for 100 points",
    "enter_from_hover": "No path: R = +4 at the start and -5.559 at the end",
    "list_cycles": "80 flyable cycles up to 0.8 rad in the square",
    "graph_tour": "294 nodes, 1038 edges",
    "robustness_of_a_gait": "biased by 0.8         74.46°     85.15 %  0.3754",
    "basin_of_a_gait": "Basin of biased by 0.8: 4 by 4 attitudes, roll and pitch up to 70°: 81.2 % settled",
    "draw_a_gait": "figure_15.svg",
    "where_a_waypoint_lies": "0.1000 rad away is (0.5000, -0.9000)",
    "export_to_c": "100 rows, 3200 bytes",
    "least_period": "least period: 0.950 s with rests, 0.729 s rounded",
    "around_a_keep_out": "no loop through these waypoints in this order is shorter than 3.8393 rad",
    "replan_in_flight": "then: 0.188 s to waypoint 3, 0.882 s around, least singular value at least 0.563, 6 corners",
    "best_gait": "radius 0.1: least singular value 0.592, at most 0.592, 13.44 rad²/s",
    "retarget_a_gait": "moved by 0.4566 rad at most (row 11), 0.3477 rad rms",
    "which_drag_ratio": "0.1687      9.57°  2.374  2.374    2.358  0.167  0.886",
    "which_period": "T = 0.25 s: settles after 0.44 s, peak 2.93 shares, 1.87 after 1 s, where α1 spans 0.53 rad",
    "best_hover_reserve": "best within 0.2 rad: 1.9644 quarters, any loop needs 1.9643",
    "fly_a_gait": "biased by 0.8: 2.62 shares, least singular value 0.375",
    "servo_table": "read back to 1.0e-04 rad; flyable True",
}


@pytest.fixture(autouse=True)
def pictures_without_windows_and_films_of_few_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plt.switch_backend("agg")
    monkeypatch.setattr(films, "_FEWEST", 2)
    monkeypatch.setattr(films, "RATE", 1)


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run(
    path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    assert EXPECTED[path.stem] in capsys.readouterr().out


@pytest.mark.parametrize("path", REQUESTS, ids=lambda path: path.stem)
def test_requests_plan_flyable_gaits(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "gait.csv"
    with pytest.raises(SystemExit) as stopped:
        main(["plan", str(path), "--output", str(output)])
    assert stopped.value.code == 0
    assert "Flyable: yes" in capsys.readouterr().out
    assert len(read_table(output)) > 100


def enter(folder: Path, page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Go to a folder with the examples and the TOML files of a page that begin with their name."""
    monkeypatch.chdir(folder)
    (folder / "examples").symlink_to(ROOT / "examples")
    for text, name in re.findall(
        r"^```toml\n(# (\S+\.toml)\n.*?)^```", page.read_text(), re.M | re.S
    ):
        (folder / name).write_text(text)


def is_shown(shown: str, capsys: pytest.CaptureFixture[str]) -> bool:
    """Return whether what was printed is what a page shows, where ... stands for any text."""
    return OutputChecker().check_output(
        shown.replace("…", "..."), capsys.readouterr().out, ELLIPSIS
    )


@pytest.mark.parametrize(("page", "block", "shown"), BLOCKS)
def test_python_blocks_run(
    page: Path,
    block: str,
    shown: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    enter(tmp_path, page, monkeypatch)
    for library in re.findall(r"^import (pandas|polars)", block, re.MULTILINE):
        pytest.importorskip(library, reason=f"install {library}")
    exec(compile(block, "<block>", "exec"), {"__name__": "__main__"})
    assert not shown or is_shown(shown, capsys)


@pytest.mark.parametrize("page", [of_page(page) for page in OTHER_PAGES])
def test_commands_print_what_is_shown_below_them(
    page: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    enter(tmp_path, page, monkeypatch)
    blocks = r"^```sh\n((?:(?:gaitgraph| )[^\n]*\n)+)```\n\n```text\n(.*?)^```"
    for commands, shown in re.findall(blocks, page.read_text(), re.M | re.S):
        for command in commands.replace("\\\n", "").splitlines():
            with pytest.raises(SystemExit):
                main(shlex.split(command)[1:])
        assert is_shown(shown, capsys), commands


@pytest.mark.slow
def test_the_tutorial_runs_in_one_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    enter(tmp_path, TUTORIAL, monkeypatch)
    blocks = r"^```(python|sh)\n(.*?)^```\n(?:\n```text\n(.*?)^```)?"
    for language, block, shown in re.findall(blocks, TUTORIAL.read_text(), re.M | re.S):
        capsys.readouterr()
        if language == "python":
            exec(compile(block, "<block>", "exec"), {"__name__": "__main__"})
        for command in re.findall(r"^gaitgraph (.*)", block, re.M):
            with pytest.raises(SystemExit) as stopped:
                main(shlex.split(command))
            assert stopped.value.code in (0, 1), command
        assert not shown or is_shown(shown, capsys), block


def test_links_between_pages_are_not_broken() -> None:
    broken = []
    for page in PAGES:
        for target in re.findall(
            r"\]\((?!https?:|#|mailto:)([^)#\s]+)", page.read_text()
        ):
            drawn = target.removeprefix("../") in FIGURES_OF_PAGES
            if not drawn and not (page.parent / target).exists():
                broken.append((page.name, target))
    assert broken == []


def test_pages_name_what_there_is() -> None:
    commands = [cli.get_command(CONTEXT, name) for name in cli.list_commands(CONTEXT)]
    options = {
        name
        for command in [cli, *commands]
        if command
        for one in command.params
        for name in one.opts
    }
    strange = []
    for page in PAGES:
        text = page.read_text()
        for call in re.findall(
            r"^(?:\$ |\.venv/bin/)?gaitgraph (?:.*\\\n)*.*$", text, re.M
        ):
            strange += [
                (page.name, name)
                for name in re.findall(r"(?<!\S)--[a-z-]+", call)
                if name not in options
            ]
        for name in set(
            re.findall(r"(?<![\w/])(?:gg|gaitgraph)\.([a-zA-Z_][\w.]*\w)", text)
        ):
            if not is_there(name):
                strange.append((page.name, name))
        for name in re.findall(r"`((?:\w+/)+\w+\.py)`", text):
            if not any(
                (folder / name).exists()
                for folder in (ROOT, ROOT / "gaitgraph", page.parent)
            ):
                strange.append((page.name, name))
    assert strange == []


def is_there(name: str) -> bool:
    try:
        resolve_name(f"gaitgraph.{name}")
    except (AttributeError, ImportError):
        return False
    return True


def test_the_version_is_stated_once() -> None:
    citation = (ROOT / "CITATION.cff").read_text()
    changelog = (ROOT / "CHANGELOG.md").read_text()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "version" in project["dynamic"]
    assert f"version: {gg.__version__}\n" in citation
    assert f"## {gg.__version__}" in changelog


@pytest.mark.slow
def test_how_cost_grows_is_what_was_measured() -> None:
    from tests.benchmarks import growth

    found = json.loads((growth.IMAGES / "growth.json").read_text(encoding="utf-8"))
    assert [*found] == [*growth.CASES]
    assert growth.summary(found) in (ROOT / "docs" / "limitations.md").read_text(
        encoding="utf-8"
    )
    assert growth.picture(found).startswith(b"\x89PNG")
