"""Where waypoints lie: told for the library and for the command line, and consistent with what is planned."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

import gaitgraph as gg

WALL = [[(0.6, -2.0), (0.7, -2.0), (0.7, 2.0), (0.6, 2.0)]]


def test_a_wall_separates_what_is_joined_without_it() -> None:
    points = [("pi/8", "-pi/8"), ("3pi/8", "-3pi/8")]
    free, walled = (
        gg.location_of(points, sign="negative", keep_out=wall) for wall in ([], WALL)
    )
    assert free
    assert not walled
    assert set(free.regions[0].parts) == {1}
    assert set(walled.regions[0].parts) == {1, 2}
    assert "no loop can join them" in str(walled)


def test_what_is_joined_can_be_planned_and_what_is_not_cannot() -> None:
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(25):
        points = [tuple(point) for point in rng.uniform(-1.5, 1.5, (2, 2)).tolist()]
        found = gg.location_of(points, keep_out=WALL, accuracy=1e-3)
        plan = gg.plan_loop(points, color="red", keep_out=WALL, accuracy=1e-3)
        assert bool(found) == bool(plan and plan.report.flyable)
        seen.add(bool(found))
    assert seen == {True, False}


def test_the_command(run: Any, tmp_path: Any) -> None:
    out = run("region", "--waypoint", "-0.4,0.4", "--waypoint", "0.5,0.5", "--json")
    content = out.json
    assert (out.code, content["use"]) == (1, "flyable")
    assert [region["sign"] for region in content["regions"]] == ["positive", "negative"]
    first = content["regions"][0]
    assert [waypoint["part"] for waypoint in first["waypoints"]] == [1, None]
    assert first["waypoints"][1]["nearest"] == pytest.approx([0.1671, 0.5], abs=1e-4)
    assert sum(part["area"] for part in first["parts"]) == pytest.approx(first["area"])
    request = tmp_path / "request.toml"
    request.write_text(
        'waypoints = [[-0.4, 0.4], ["-pi/8", "pi/8"]]\nsign = "positive"\n'
    )
    out = run("region", str(request))
    assert out.code == 0
    assert "waypoint 2 (-0.3927, 0.3927): in part 1" in out.out
    assert "a loop can join them all" in out.out
    request.write_text(request.read_text() + "floor = 0.3\naccuracy = 1e-3\n")
    assert run("region", str(request), "--use", "valid").code == 0
    request.write_text("keep_in = [[[0.6, -0.6], [1.0, -0.6], [1.0, -1.0]]]\n")
    assert run("region", str(request), "--sign", "negative").out.count("part 1") == 1
    listed = run("region", "--output", str(tmp_path / "map.png"))
    assert (listed.code, (tmp_path / "map.png").stat().st_size > 10_000) == (0, True)
    assert "red, R > 0: 2 parts of" in listed.out
    assert "  part 2: 0.01623 rad², around (-1.5047, 1.4796)" in listed.out
    empty = run("region", "--color", "blue", "--output", str(tmp_path / "empty.png"))
    assert (empty.code, empty.err, "red" in empty.out, empty.out.count("empty\n")) == (
        1,
        "",
        False,
        2,
    )
    out = run("region", "--output", "map.bmp")
    assert (out.code, out.out, out.err.count("\n")) == (2, "", 1)


@pytest.mark.no_cover
def test_parts_that_touch_in_a_point_are_joined_there_and_planned_through() -> None:
    """Borders are allowed, so two keep-outs that touch leave a way of no width."""
    fence = [[(-1.2, 0.25), (-0.25, 0.25), (-0.25, 1.2), (-1.2, 1.2)]]
    blocks = [
        [(-0.6, 0.25), (-0.6, 0.7), (-0.4, 0.5), (-0.4, 0.25)],
        [(-0.6, 0.7), (-0.6, 1.2), (-0.4, 1.2), (-0.4, 0.9)],
    ]
    points = [(-0.8, 0.75), (-0.35, 0.75)]
    zones: dict[str, Any] = {"keep_in": fence, "keep_out": blocks}
    found = gg.location_of(points, sign="positive", **zones)
    assert found
    assert set(found.regions[0].parts) == {1, 2}
    objectives: tuple[Literal["shortest", "robust"], ...] = ("shortest", "robust")
    for objective in objectives:
        plan = gg.plan_loop(
            points, color="red", sign="positive", objective=objective, **zones
        )
        assert plan.report.flyable
        assert [-0.6, 0.7] in plan.gait.alpha[:, :2].tolist()
    moved = [blocks[0], [(-0.6, 0.7 - 1e-6), *blocks[1][1:]]]
    assert not gg.location_of(points, keep_in=fence, keep_out=moved, sign="positive")
    assert not gg.plan_loop(
        points, color="red", keep_in=fence, keep_out=moved, sign="positive"
    )
