"""The command pace: answers, files and refusals."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

import gaitgraph as gg
from gaitgraph.cli.pace import pace_command
from gaitgraph.gait.gait import lift
from gaitgraph.io.reading import read_table
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import least_period
from tests.published import GAITS

if TYPE_CHECKING:
    from pathlib import Path

SQUARE = lift(GAITS[2].angles, "red")
LIMITS = Limits(rate=6.0, acceleration=60.0)


def run_pace(*arguments: str) -> tuple[int, str]:
    """Run the command alone, without the group around it."""
    done = CliRunner().invoke(pace_command, list(arguments), standalone_mode=False)
    if done.exception is not None:
        raise done.exception
    return int(done.return_value), done.output


def test_the_command_paces_a_gait_file(tmp_path: Path) -> None:
    given, output = str(tmp_path / "gait3.csv"), tmp_path / "fast.json"
    SQUARE.parametrize().write(given)
    asked = (given, "--max-rate", "6", "--max-acceleration", "60", "--rounding", "2deg", "--servo-lag", "0.02")
    code, text = run_pace(*asked, "--output", str(output), "--samples", "50", "--json")
    answer = json.loads(text)
    assert code == 0
    assert (answer["status"], answer["reason"], answer["flyable"]) == ("ok", None, True)
    assert answer["period"] == answer["least_period"]
    assert answer["period"] == pytest.approx(least_period(SQUARE, LIMITS, rounding=np.radians(2)).least)
    assert answer["limits"] == {"rate": 6.0, "acceleration": 60.0}
    assert answer["rounding"]["deviation"] == pytest.approx(np.radians(2))
    assert {touch["limit"] for touch in answer["touched"]} == {"rate", "acceleration"}
    assert answer["servo"]["distance_off_sheet"] == 0
    assert answer["peak_acceleration"] <= 60 * (1 + 1e-9)
    table = read_table(output)
    assert len(table) == 51
    assert table.about["law"] == "least-period"
    np.testing.assert_array_equal(table.alpha[0], table.alpha[-1])
    with pytest.raises(gg.errors.OutputExists):
        run_pace(*asked, "--output", str(output))
    code, text = run_pace(*asked, "--output", str(output), "--force", "--period", "1.5")
    assert code == 0
    assert "wrote" in text
    assert "servo lag" in text
    assert read_table(output).about["period"] == 1.5


def test_the_command_says_no_and_refuses(tmp_path: Path) -> None:
    given = str(tmp_path / "gait3.csv")
    SQUARE.parametrize().write(given)
    code, text = run_pace(given, "--max-rate", "200deg", "--max-acceleration", "40", "--period", "0.3")
    assert code == 1
    assert text.startswith("T = 0.3 s is too short: ")
    code, text = run_pace(given, "--max-rate", "0", "--max-acceleration", "40", "--json")
    assert code == 1
    assert json.loads(text)["status"] == "no period"
    for arguments, message in (
        (("--period", "quick", "--max-jerk", "100"), "--period must be .* got 'quick'"),
        (("--max-rate", "3"), "limits must have an acceleration or a jerk"),
        (("--max-acceleration", "many"), "^--max-acceleration\\b.*'many'"),
        (("--max-rate", "-3", "--max-acceleration", "9"), "^--max-rate\\b.*-3"),
        (("--max-jerk", "nan"), "^--max-jerk\\b.*nan"),
        (("--max-acceleration", "9", "--rate", "-3"), "^(--)?rate\\b.*-3"),
        (("--max-acceleration", "9", "--rounding", "0"), "^--rounding\\b.*0"),
        (("--max-acceleration", "9", "--servo-lag", "1e-12"), "^--servo-lag\\b.*at least.*1e-12"),
    ):
        with pytest.raises(gg.InputError, match=message):
            run_pace(given, *arguments)
    off = str(tmp_path / "off.csv")
    SQUARE.biased(0.8).parametrize().write(off)
    with pytest.raises(gg.InputError, match=r"off\.csv must be .* on one sheet.* gaitgraph retarget .*off\.csv"):
        run_pace(off, "--max-acceleration", "9")
