"""Retargeting: nearest by brute force, unchanged where it may be, inside between rows, and answers that are no."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

from gaitgraph.errors import Infeasible, InputError
from gaitgraph.gait.gait import lift
from gaitgraph.gait.given import gait_of, given_gait
from gaitgraph.gait.table import ANGLES
from gaitgraph.io.formats import write_tables
from gaitgraph.optimization import retargeting
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from pathlib import Path

retarget: Any = (
    retargeting.retarget
)  # its answers have a table here, which types cannot know

FLYABLE = [(0.4, -1.2), (0.5, -0.5), (1.2, -0.4)]


def wave(seed: int, count: int = 24, size: float = 0.7) -> np.ndarray:
    """Return a smooth closed motion of four angles with phases of its own, as of four legs."""
    rng = np.random.default_rng(seed)
    t = np.arange(count) / count * 2 * math.pi
    phase, middle = rng.uniform(0, 2 * math.pi, 4), rng.uniform(-0.3, 0.3, 4)
    return middle + size * rng.uniform(0.5, 1.0, 4) * np.sin(t[:, None] + phase)


def nearest_by_brute_force(part: Any, row: np.ndarray) -> float:
    """Return the least distance in four dimensions from a row to points of a polygon's border and inside."""
    border = shapely.get_coordinates(shapely.segmentize(part, 0.005))
    x, y = np.meshgrid(
        *(
            np.linspace(low, high, 250)
            for low, high in np.reshape(part.bounds, (2, 2)).T
        )
    )
    inside = np.column_stack([x.ravel(), y.ravel()])
    points = np.vstack([border, inside[shapely.contains_xy(part, *inside.T)]])
    return float(np.linalg.norm(np.hstack([points, points]) - row, axis=1).min())


@pytest.mark.parametrize("seed", range(3))
def test_rows_go_to_the_nearest_place(seed: int) -> None:
    rows = wave(seed)
    answer = retarget(rows)
    assert (answer.status, answer.after.flyable) == ("retargeted", True)
    new = answer.table.alpha[answer.rows]
    np.testing.assert_allclose(
        np.linalg.norm(new - rows, axis=1), answer.moved, atol=1e-15
    )
    off = ((rows[:, :2] - rows[:, 2:]) ** 2).sum(
        axis=1
    ) / 2  # the projection onto the red sheet, and what is left
    across = np.linalg.norm(new[:, :2] - (rows[:, :2] + rows[:, 2:]) / 2, axis=1)
    np.testing.assert_allclose(answer.moved, np.sqrt(2 * across**2 + off), atol=1e-12)
    parts = admissible_region(PAPER).components
    chosen = [
        part
        for part in parts
        if shapely.distance(part, shapely.Point(new[0, :2])) < 1e-9
    ]
    assert len(chosen) == 1
    for row, moved in list(zip(rows, answer.moved, strict=True))[::4]:
        brute = nearest_by_brute_force(chosen[0], row)
        assert brute - 1e-2 <= moved <= brute + 1e-9
    middle = shapely.points((rows[:, :2] + rows[:, 2:]) / 2)
    sums = [
        float(np.sqrt(2 * shapely.distance(part, middle) ** 2 + off).sum())
        for part in parts
    ]
    assert answer.total == pytest.approx(min(sums))
    np.testing.assert_allclose(answer.alternatives, sorted(sums))


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_retargeting_twice_changes_nothing_more(margin: float) -> None:
    once = retarget(wave(1), margin=margin)
    again = retarget(once.table, margin=margin)
    assert (again.table.alpha == once.table.alpha).all()
    assert (again.status, again.total, again.unchanged) == (
        "unchanged",
        0,
        len(once.table),
    )


@pytest.mark.parametrize(
    "source",
    [
        table_of(lift(FLYABLE, "red").parametrize(2.0, samples=30)),
        lift([(0.6, -0.6)], "red"),
        np.array([[-0.3, 0.4, -0.3, 0.4], [-0.9, 0.4, -0.9, 0.4]]),
        {"alpha1": [0.4, 0.4, 1.2], "alpha2": [-1.2, -0.4, -0.4], "color": "red"},
    ],
    ids=["table", "point", "array", "lifted"],
)
def test_flyable_gaits_come_back_bit_by_bit(source: Any) -> None:
    answer = retarget(source)
    assert (answer.status, answer.added, answer.reason) == ("unchanged", 0, None)
    given = gait_of(source) if isinstance(source, dict) else source
    assert (answer.table.alpha == getattr(given, "alpha", given)).all()
    assert str(answer).startswith("unchanged: ")


def test_paths_between_rows_bend_around_what_is_forbidden() -> None:
    block = [(-0.7, 0.5), (-0.5, 0.5), (-0.5, 0.9), (-0.7, 0.9)]
    rows, t = (
        np.array([[-1.0, 0.7, -1.0, 0.7], [-0.2, 0.7, -0.2, 0.7]]),
        np.array([0.5, 2.0]),
    )
    answer = retarget(
        {"t": t, **dict(zip(ANGLES, rows.T, strict=True))}, keep_out=[block]
    )
    assert (answer.status, answer.unchanged, answer.added, answer.total) == (
        "retargeted",
        2,
        4,
        0,
    )
    assert answer.as_mapping()["new_rows"] == [1, 4]
    line = shapely.LineString(
        np.vstack([answer.table.alpha[:, :2], answer.table.alpha[:1, :2]])
    )
    assert not shapely.crosses(line, shapely.Polygon(block).buffer(-1e-9))
    assert line.length == pytest.approx(2 * (2 * math.hypot(0.3, 0.2) + 0.2), abs=1e-9)
    steps = np.linalg.norm(
        np.diff(line.coords, axis=0), axis=1
    )  # an added row has its time by its share of the length
    np.testing.assert_allclose(
        answer.table["t"], 0.5 + 3 * np.append(0, np.cumsum(steps[:-1])) / line.length
    )


def test_a_margin_keeps_rows_and_paths_off_the_border() -> None:
    answer = retarget(wave(1), margin=0.08)
    points = np.vstack([answer.table.alpha[:, :2], answer.table.alpha[:1, :2]])
    borders = [part.boundary for part in admissible_region(PAPER).components]
    assert (
        shapely.distance(shapely.union_all(borders), shapely.LineString(points))
        >= 0.08 - 1e-9
    )
    assert answer.total >= retarget(wave(1)).total
    assert "use a smaller margin" in str(retarget(wave(1), margin=1.5).reason)


def test_signs_choose_the_component() -> None:
    rows = wave(2)
    signs = {}
    for sign in ("positive", "negative"):
        answer = retarget(rows, sign=sign)
        assert answer.after.flyable
        assert (np.sign(answer.table["R"]) == (1 if sign == "positive" else -1)).all()
        signs[sign] = answer.total
    assert retarget(rows).total == min(signs.values())
    turned, kept = (
        retarget(lift(FLYABLE, "red"), sign=sign) for sign in ("positive", "negative")
    )
    assert (turned.status, turned.before.flyable, kept.status) == (
        "retargeted",
        True,
        "unchanged",
    )
    beside = retarget(
        lift(FLYABLE, "red").alpha + np.outer([0.05, 0, 0], [0, 0, 1, 0]),
        sign="negative",
    )
    assert (beside.status, beside.unchanged, beside.after.flyable) == (
        "retargeted",
        2,
        True,
    )


def test_times_stay_and_rates_are_judged() -> None:
    rows = wave(3, count=8)
    t = np.linspace(0.0, 1.4, 8)
    columns: dict[str, Any] = {"t": t, **dict(zip(ANGLES, rows.T, strict=True))}
    block = [(-0.4, 0.2), (-0.2, 0.2), (-0.2, 0.6), (-0.4, 0.6)]
    answer = retarget(columns, keep_out=[block], sign="positive")
    assert (answer.table["t"][answer.rows] == t).all()
    assert (np.diff(answer.table["t"]) > 0).all()
    slow = PAPER.replace(max_tilt_rate=0.01)
    limited = retarget(columns, vehicle=slow, sign="positive")
    assert not limited.after["tilt_rate"].ok
    before, _, after, advice, warning = str(limited).splitlines()[-5:]
    assert warning.startswith("warning: a rotor pushes with up to ")
    assert (before, after) == (
        f"before: {limited.before.verdict}",
        f"after:  {limited.after.verdict}",
    )
    assert ": take at least " in advice


def test_a_gait_that_would_stand_still_says_how_to_keep_half_of_its_motion() -> None:
    """All of blue is nearest to one posture; the same loop of (α1, α2) on red, made smaller, moves."""
    blue = lift(FLYABLE, "blue")
    still = retarget(blue)
    assert still.gait.length == pytest.approx(0.0, abs=1e-9)
    assert still.largest[0] > 0.5
    delta = math.atan(PAPER.drag_ratio)  # where both sheets meet
    assert np.abs(still.table.alpha[:, :2] - [delta, -delta]).max() < 0.1
    assert str(still).startswith(
        "The nearest flyable gait stands still; to keep half of the motion, use keep=0.5\n"
    )
    assert still.as_mapping()["advice"] == "to keep half of the motion, use keep=0.5"
    for keep in (0.5, 0.2):
        answer = retarget(blue, keep=keep)
        assert answer.after.flyable
        assert answer.share == pytest.approx(keep)
        assert answer.advice is None
        assert answer.rms > still.rms
        # No other place for the same loop is nearer: shifted towards the nearest posture it leaves the region.
        shift = 1e-4 * (
            still.table.alpha[0, :2] - answer.table.alpha[:, :2].mean(axis=0)
        )
        nearer = lift(answer.table.alpha[:, :2] + shift, "red")
        free = np.allclose(
            answer.table.alpha[:, :2].mean(axis=0), still.table.alpha[0, :2]
        )
        assert free or not nearer.check().flyable
    nowhere = retarget(
        wave(1), keep=1.0, keep_in=[[(-0.1, 0.3), (0.1, 0.3), (0.1, 0.5)]]
    )
    assert "% of the motion fits nowhere" in str(nowhere.reason)
    with pytest.raises(InputError, match="keep must be above 0 and at most 1, got 50"):
        retarget(blue, keep=50)


def test_whole_turns_are_taken_off_with_a_warning() -> None:
    rows = lift(FLYABLE, "red").alpha.copy()
    rows[1, 3] += 2 * math.pi  # which rounding does not touch
    answer = retarget(
        [*rows, rows[0] - [0, 0, 2 * math.pi, 0]]
    )  # the row that closes the gait too
    assert (answer.status, answer.unchanged, answer.added) == ("retargeted", 2, 0)
    np.testing.assert_allclose(
        answer.table.alpha[:3], lift(FLYABLE, "red").alpha, atol=1e-15
    )
    np.testing.assert_array_equal(answer.table.alpha[3], answer.table.alpha[0])
    assert answer.warnings == ("took whole turns off α3 or α4 in 2 rows",)
    rows[:, 2] -= math.pi  # half a turn is far
    assert retarget(rows).moved.min() > math.pi / math.sqrt(2) - 1e-9


def test_limits_of_the_vehicle_count_and_mirrored_spin_mirrors_the_answer() -> None:
    limited = Vehicle(
        drag_ratio=0.17, mass=0.4, max_thrust=0.27 * 0.4 * 9.80665, max_tilt=0.5
    )
    here = retarget(wave(0), vehicle=limited, sign="positive")
    assert here.after.flyable
    assert np.abs(here.table.alpha).max() <= 0.5
    mirrored = limited.replace(first_rotor_spin="counterclockwise")
    there = retarget(-wave(0), vehicle=mirrored, sign="positive")
    np.testing.assert_allclose(there.table.alpha, -here.table.alpha, atol=3e-6)


def test_why_there_is_none() -> None:
    high = retarget(wave(0), floor=1.3)
    mapping = high.as_mapping()
    assert (bool(high), high.status, mapping["path"]) == (False, "infeasible", [])
    assert not any(
        mapping[name] for name in ("valid", "flyable", "reachable_from_hover")
    )
    assert "of this vehicle is at most 1.1710" in str(high)
    for name in ("gait", "total", "largest"):
        with pytest.raises(Infeasible):
            getattr(high, name)
    everything = [(-1.6, -1.6), (1.6, -1.6), (1.6, 1.6), (-1.6, 1.6)]
    walled = retarget(wave(0), keep_out=[everything])
    assert "no tilt angles meet all conditions" in str(walled.reason)


def test_the_command_reads_writes_and_says_no(run: Any, tmp_path: Path) -> None:
    animal = given_gait(wave(6, count=12)).table
    assert animal is not None
    write_tables(animal, [tmp_path / "animal.csv"])
    answer = run("retarget", "animal.csv", "--json", "--output", "gait.json").json
    assert (answer["status"], answer["rows"], answer["flyable"]) == (
        "retargeted",
        12,
        True,
    )
    assert (
        answer["largest"]
        == max(answer["moved"])
        == answer["moved"][answer["largest_row"] - 1]
    )
    (tmp_path / "answer.json").write_text(json.dumps(answer))
    for name in ("gait.json", "answer.json"):
        assert validate(tmp_path / name).flyable
