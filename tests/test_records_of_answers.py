"""Answers of all kinds go to plain values and come back."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.errors import InputError
from gaitgraph.flight import FlightSettings
from gaitgraph.graph import closed_walk, cycles
from gaitgraph.io.servo_map import servo_map_named

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]
ANSWERS: dict[str, Callable[[], Any]] = {
    "ErrorMargin": lambda: gg.robustness.servo_margin(np.zeros((1, 4))),
    "Coloring": lambda: next(iter(gg.colorings(LOOP))),
    "ClosedWalk": lambda: closed_walk(gg.surface_graph(), [["002 001 red"]]),
    "ServoMap": lambda: servo_map_named("x_frame"),
    "FlightSettings": lambda: FlightSettings(reference="circle", size=2.0, lap=9.0),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_comes_back_equal(name: str) -> None:
    answer = ANSWERS[name]()
    assert type(answer).__name__ == name
    text = json.dumps(answer.as_dict(), allow_nan=False)
    again = type(answer).from_dict(json.loads(text))
    assert again == answer
    assert json.dumps(again.as_dict()) == text


def test_what_was_exported_comes_back(tmp_path: Path) -> None:
    exported = gg.export("gait4", tmp_path / "a.csv")
    again = type(exported).from_dict(json.loads(json.dumps(exported.as_dict())))
    assert again == exported


def test_a_cycle_is_stated_without_its_graph() -> None:
    cycle = next(iter(cycles(gg.surface_graph(divisions=4))))
    stated = cycle.as_dict()
    assert stated["length"] == cycle.length
    with pytest.raises(InputError):
        type(cycle).from_dict(stated)


@pytest.mark.parametrize(
    ("stops", "named"),
    [([["nowhere"]], "'nowhere'"), ([], r"\[\]"), ([[]], "at least one")],
)
def test_stops_of_a_walk_are_nodes(stops: Any, named: str) -> None:
    with pytest.raises(InputError, match=named) as refused:
        closed_walk(gg.surface_graph(divisions=4), stops)
    assert refused.value.field == "stops"


def test_export_says_what_a_mission_lacks_and_what_is_no_servo_table(
    run: Any, tmp_path: Path
) -> None:
    sparse = run(
        "export", "gait4", str(tmp_path / "m.csv"), "--from-hover", "--rate", "0.1"
    )
    assert sparse.err.count("set a higher --rate") == 1
    refused = run("export", "gait4", str(tmp_path / "b.csv"), "--columns", "x_frame")
    assert refused.code == 2
    assert "--columns is of a servo table, and gait4 is none" in refused.err


def test_answers_with_rows_go_to_pandas() -> None:
    pytest.importorskip("pandas", reason="install pandas")
    report = gg.validate("gait4")
    checks = report.to_pandas().set_index("name")
    assert list(checks.index) == [check.name for check in report.checks]
    assert checks.loc["R_sign", "value"] == report["R_sign"].value
    robustness = gg.robustness_of("gait4", bias=0.8)
    gaits = robustness.to_pandas()
    stated = [one.as_mapping() for one in (robustness.gait, *robustness.sweep)]
    assert gaits.verdict.tolist() == [one["verdict"] for one in stated]
    assert "singular_curves" not in gaits
