"""The colourings of the loop in a file: tables, plans and requests."""

from __future__ import annotations

import json
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

import gaitgraph as gg
from gaitgraph.planning.request import colorings_of_file
from tests.published import GAITS

if TYPE_CHECKING:
    from pathlib import Path

G3 = GAITS[2]
MIRRORED = gg.Vehicle(
    drag_ratio=gg.PAPER.drag_ratio, first_rotor_spin="counterclockwise"
)
RICH = [
    (pi / 16, -pi / 16),
    (pi / 8, -pi / 8),
    (3 * pi / 16, -pi / 8),
    (pi / 16, -3 * pi / 8),
]


def written(folder: Path, name: str, content: Any) -> Path:
    path = folder / name
    path.write_text(
        content if isinstance(content, str) else json.dumps(content), encoding="utf-8"
    )
    return path


def csv_of(names: str, rows: Any) -> str:
    return "\n".join([names, *(",".join(map(str, row)) for row in rows)]) + "\n"


def assert_same(found: gg.surface.Colorings, expected: gg.surface.Colorings) -> None:
    np.testing.assert_allclose(found.points, expected.points, rtol=1e-15)
    assert list(found) == list(expected)
    assert (found.counts, found.obstacles) == (expected.counts, expected.obstacles)


def test_tables_of_two_angles(tmp_path: Path) -> None:
    expected = gg.colorings(RICH)
    assert expected.count > 2
    for rows in (RICH, [*RICH, RICH[0]]):
        for name, content in (
            ("a.csv", csv_of("alpha1,alpha2", rows)),
            ("b.csv", csv_of("note,alpha2,alpha1", [("x", b, a) for a, b in rows])),
            (
                "c.json",
                {"alpha1": [a for a, _ in rows], "alpha2": [b for _, b in rows]},
            ),
            ("d.json", [{"alpha1": a, "alpha2": b} for a, b in rows]),
            (
                "e.csv",
                csv_of("alpha1,alpha2,color", [(a, b, "blue") for a, b in rows]),
            ),  # colors are what is asked for
        ):
            assert_same(colorings_of_file(written(tmp_path, name, content)), expected)
    degrees = csv_of(
        "alpha1_deg,alpha2_deg", [(67.5, -67.5), (67.5, -22.5), (22.5, -22.5)]
    )
    np.testing.assert_allclose(
        colorings_of_file(written(tmp_path, "f.csv", degrees)).points, G3.angles[:3]
    )


def test_a_file_has_the_colourings_that_its_report_counts(tmp_path: Path) -> None:
    table = [(a, b, "red") for a, b in RICH]
    blue_end = [*table, (*RICH[0], "blue")]  # a point of its own
    for rows in (table, table[:1], [*table, (*RICH[0], "red")], blue_end):
        path = written(tmp_path, "a.csv", csv_of("alpha1,alpha2,color", rows))
        listing = gg.validate(path).listing
        assert colorings_of_file(path) == listing


def test_plans_and_requests(tmp_path: Path) -> None:
    plan = gg.plan_loop(G3.waypoints)
    assert_same(
        colorings_of_file(written(tmp_path, "plan.json", plan.as_mapping())),
        gg.colorings(plan.gait.alpha),
    )
    request = {"waypoints": [list(pair) for pair in G3.waypoints], "samples": 20}
    toml = f"waypoints = {json.dumps(request['waypoints'])}\nsamples = 20\n"
    for path in (
        written(tmp_path, "request.toml", toml),
        written(tmp_path, "request.json", request),
    ):
        assert_same(colorings_of_file(path), gg.colorings(G3.angles))
        exact = gg.invertibility.coefficients_of(kind="exact")
        assert_same(
            colorings_of_file(path, coefficients="exact"),
            gg.colorings(G3.angles, coefficients=exact),
        )
        assert set(colorings_of_file(path, sign="positive").counts) == {"positive"}
        wide = colorings_of_file(path, crossing_tolerance=pi / 4)
        assert (
            wide.count == gg.colorings(G3.angles, crossing_tolerance=pi / 4).count > 2
        )
    none = gg.plan_loop([(0.5, -0.5), (-0.5, 0.5)], color="red", sign="negative")
    assert not none
    path = written(tmp_path, "none.json", none.as_mapping())
    assert_same(
        colorings_of_file(path),
        gg.colorings([(0.5, -0.5), (-0.5, 0.5)], sign="negative"),
    )


def test_files_state_sign_vehicle_and_tolerance_unless_overruled(
    tmp_path: Path,
) -> None:
    mirrored = [(-a, -b) for a, b in G3.angles]
    text = (
        f'waypoints = {json.dumps(mirrored)}\nsign = "negative"\n'
        f'[vehicle]\ndrag_ratio = {MIRRORED.drag_ratio!r}\nfirst_rotor_spin = "counterclockwise"\n'
    )
    path = written(tmp_path, "mirrored.toml", text)
    assert [set(one.colors) for one in colorings_of_file(path)] == [
        {"red"}
    ]  # exact coefficients
    assert colorings_of_file(path, sign="auto").counts == {"negative": 1, "positive": 0}
    assert_same(
        colorings_of_file(path, vehicle=gg.PAPER),
        gg.colorings(mirrored, sign="negative"),
    )
    gait = gg.lift(
        [(-a, -b) for a, b in RICH], "red", vehicle=MIRRORED, crossing_tolerance=0.01
    )
    table = tmp_path / "table.json"
    gait.parametrize(samples=4, law="equal-time").write(table)
    assert_same(
        colorings_of_file(table),
        gg.colorings(gait.alpha, vehicle=MIRRORED, crossing_tolerance=0.01),
    )
    wider = colorings_of_file(table, crossing_tolerance=pi / 32)
    assert_same(
        wider, gg.colorings(gait.alpha, vehicle=MIRRORED, crossing_tolerance=pi / 32)
    )
