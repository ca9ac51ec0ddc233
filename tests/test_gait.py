"""Gaits: lifting, exactness between corners, reordering, biasing, merging, vertices; rows closed and completed."""

from __future__ import annotations

import math
import warnings
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.errors import FileWarning
from gaitgraph.gait.gait import Gait, lift, vertices
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import (
    Table,
    about_from_text,
    checked_about,
    closing_time,
    completed_table,
    is_closed,
    provenance_text,
    tilt_angles,
)
from gaitgraph.invertibility.matrices import level_determinant_resolution
from gaitgraph.io.c_header import write_h
from gaitgraph.surface.sheets import COLORS, roots
from gaitgraph.timing.laws import LAWS, LawName
from gaitgraph.timing.timed_gait import timed_gait_of
from tests.published import GAITS
from tests.samples import EXACT, PUBLISHED, table_from, write_rows

if TYPE_CHECKING:
    from pathlib import Path

angle = st.floats(-1.5, 1.5)
loops = st.lists(st.tuples(angle, angle), min_size=1, max_size=7)
LOW_BEETLE = gg.vehicle_named("beetle_omni").replace(
    rotor_height=0.0
)  # blue is a sheet of solutions for h = 0 alone
kinds = st.sampled_from(
    [PUBLISHED, EXACT, gg.invertibility.coefficients_of(LOW_BEETLE)]
)


@settings(deadline=None, max_examples=30)
@given(
    points=loops, color=st.sampled_from(COLORS), numbers=kinds, fraction=st.floats(0, 1)
)
def test_corners_are_roots_and_points_between_on_their_sheet(  # type: ignore[no-untyped-def]
    points, color, numbers, fraction
) -> None:
    gait = lift(points, color, coefficients=numbers)
    for lifted in gait.alpha:
        (root,) = (
            root
            for root in roots(lifted[0], lifted[1], coefficients=numbers)
            if root.color == color
        )
        np.testing.assert_allclose(lifted, root.alpha, atol=1e-15)
    along = gait.alpha + fraction * (gait.ends - gait.alpha)
    # α3 ∓ α1 and α4 ∓ α2 are constant on a sheet; where they are not, an angle wraps by π.
    sign = 1 if color == "red" else -1
    constant = gait.alpha[:, 2:] - sign * gait.alpha[:, :2]
    wraps = np.abs(np.roll(constant, -1, axis=0) - constant).max(axis=1) > 1
    for residual in (
        gg.invertibility.roll_sensitivity,
        gg.invertibility.pitch_sensitivity,
    ):
        assert np.abs(residual(along[~wraps], numbers)).max(initial=0) < 1e-12


@settings(deadline=None, max_examples=30)
@given(points=loops, start=st.integers(0, 6))
def test_reversing_and_restarting_are_permutations(
    points: list[tuple[float, float]], start: int
) -> None:
    gait = lift(points, ["red" if k % 2 else "blue" for k in range(len(points))])
    start %= len(points)
    again = gait.started_at(start).started_at((len(points) - start) % len(points))
    np.testing.assert_array_equal(again.alpha, gait.alpha)
    assert again.colors == gait.colors
    back = gait.reversed()
    np.testing.assert_array_equal(back.alpha[0], gait.alpha[0])
    assert back.length == pytest.approx(gait.length)
    pairs = {(tuple(a), tuple(b)) for a, b in zip(gait.alpha, gait.ends, strict=True)}
    assert {
        (tuple(b), tuple(a)) for a, b in zip(back.alpha, back.ends, strict=True)
    } == pairs


def test_bias_scales_the_last_two_angles() -> None:
    red = lift(GAITS[3].angles, "red")
    biased = red.biased(0.8)
    np.testing.assert_allclose(biased.alpha, red.alpha * [1, 1, 0.8, 0.8])
    assert biased.colors == biased.types == ()
    np.testing.assert_array_equal(red.biased(1.0).alpha, red.alpha)
    assert red.biased(1.0).colors == red.colors
    assert not biased.check()["on_surface"].ok


def test_straight_runs_merge_and_turns_stay() -> None:
    points = [
        (0.0, 0.1),
        (0.2, 0.1),
        (0.2, 0.1),
        (0.5, 0.1),
        (0.5, 0.5),
        (0.5, 0.3),
        (0.5, 0.1),
        (0.3, 0.1),
    ]
    merged = lift(points, "red").merged()
    # Out along (0.5, …) and back: the turning point stays, the corner passed twice stays twice.
    np.testing.assert_allclose(
        merged.alpha[:, :2], [(0, 0.1), (0.5, 0.1), (0.5, 0.5), (0.5, 0.1)]
    )
    assert merged.length == pytest.approx(lift(points, "red").length)
    np.testing.assert_array_equal(merged.merged().alpha, merged.alpha)
    # The start stays where it is, even on a straight run.
    merged = lift(
        [(0.2, 0.0), (0.4, 0.0), (0.4, 0.4), (0.0, 0.4), (0.0, 0.0)], "red"
    ).merged()
    np.testing.assert_allclose(merged.alpha[0, :2], (0.2, 0.0))
    assert len(merged.alpha) == 5
    # A change of color is a corner, and a point that is repeated is a point.
    gait = lift(
        [(0.1, 0.0), (0.2, 0.0), (0.3, 0.0), (0.4, 0.0)], ["red", "red", "blue", "blue"]
    )
    assert len(gait.merged().alpha) == 4
    assert gait.color == "mixed"
    merged = lift([(0.3, -0.3)] * 4, "red").merged()
    assert (merged.alpha.shape, merged.length, merged.vertices().shape) == (
        (1, 4),
        0,
        (1, 4),
    )


def test_corners_are_copied_and_read_only() -> None:
    source = np.zeros((2, 4))
    gait = Gait(alpha=source)
    source[:] = 1
    assert (gait.alpha == 0).all()
    with pytest.raises(ValueError, match="read-only"):
        gait.alpha[0, 0] = 1.0


def extremes(points: np.ndarray) -> np.ndarray:
    """Equations (16) to (19) word by word: every angle is the least or the largest over the curve."""
    ends = np.stack([points.min(axis=0), points.max(axis=0)])
    return np.asarray(
        points[
            np.isclose(points, ends[:, None], rtol=0, atol=1e-9).any(axis=0).all(axis=1)
        ]
    )


TRIANGLE, SHIP = (
    [(0.1, 0.1), (0.9, 0.2), (0.7, 0.8)],
    [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.0, 0.9), (-1.2, 0.5)],
)


@pytest.mark.parametrize("law", ["smooth", "constant-speed", "equal-time"])
@pytest.mark.parametrize(
    "points", [TRIANGLE, SHIP, GAITS[0].angles, [(0.1, 0.1), (0.8, 0.3)], [(0.3, 0.2)]]
)
@pytest.mark.parametrize("samples", [100, 1009])
def test_vertices_are_the_corners_of_a_loop_and_of_its_samples(
    law: Any, points: Any, samples: int
) -> None:
    loop = lift(points, "red")
    timed = loop.parametrize(1.0, law=law, samples=samples)
    assert np.array_equal(loop.vertices(), loop.alpha)
    assert np.array_equal(timed.vertices(), loop.alpha)
    found = vertices(timed.alpha)
    if len(points) != 2:  # samples may miss the tips of an out-and-back loop
        np.testing.assert_allclose(found, loop.alpha, atol=1e-8)
    if len(points) == 4:
        rows = (
            timed.alpha[:-1] if samples == 100 else loop.alpha
        )  # 100 samples meet all four corners
        np.testing.assert_allclose(loop.vertices(), extremes(rows), atol=1e-9)


def test_vertices_of_a_curve_and_of_measured_rows_need_a_tolerance() -> None:
    turn = np.linspace(0, 2 * pi, 37)
    circle = np.column_stack([np.cos(turn), np.sin(turn), np.cos(turn), np.sin(turn)])
    assert (len(vertices(circle)), len(vertices(circle, 0.1))) == (36, 0)
    loop = lift(TRIANGLE, "red")
    noisy = np.repeat(loop.alpha, 3, axis=0) + np.random.default_rng(1).uniform(
        -1e-4, 1e-4, (9, 4)
    )
    np.testing.assert_allclose(vertices(noisy, 3e-4), loop.vertices(), atol=3e-4)


# -- Rows of tables

CORNERS = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]


def table(
    points: list[tuple[float, float]],
    colors: str | tuple[str, ...] = "red",
    **columns: Any,
) -> Table:
    a1, a2 = np.array(points, dtype=float).T
    names = (colors,) * len(points) if isinstance(colors, str) else colors
    more = {name: np.array(values, dtype=float) for name, values in columns.items()}
    return Table(columns={**more, "alpha1": a1, "alpha2": a2, "color": names})


@pytest.mark.parametrize("off", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("gap", "closed", "told"),
    [
        (0.0, True, False),
        (0.99e-9, True, False),
        (1.01e-9, False, True),
        (1.5e-3, False, True),  # typed by hand, or measured
        (1.9e-3, False, True),
        (2.1e-3, False, False),
        (0.01, False, False),
    ],
)
def test_a_last_row_closes_where_it_is_the_first_and_one_nearby_is_told_and_kept(
    off: float, gap: float, closed: bool, told: bool
) -> None:
    for angle in (0, 1):
        last = (
            CORNERS[0][0] + off * gap * (angle == 0),
            CORNERS[0][1] + off * gap * (angle == 1),
        )
        rows = table([*CORNERS, last], t=[0.0, 1.0, 2.0, 3.0])
        assert is_closed(tilt_angles(rows, PUBLISHED)) is closed
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            gait, times = given_gait(rows).rows
        assert [
            "counts as a point of its own" in str(one.message) for one in warned
        ] == [True] * told
        assert times is not None
        assert (len(gait.alpha), times[-1]) == ((3, 3.0) if closed else (4, 4.0))
        whole = completed_table(rows)
        assert (len(whole), whole["t"][-1]) == ((4, 3.0) if closed else (5, 4.0))
        assert all(
            name == "t" or values[0] == values[-1]
            for name, values in whole.columns.items()
        )
        report = gg.validate(rows)
        check = report["closed"]
        assert check.message.startswith("the last row repeats the first") is closed
        assert check.value == (0.0 if closed else pytest.approx(gap, rel=1e-6))
        noted = [one for one in report.notes if "counts as a point of its own" in one]
        assert len(noted) == told


@pytest.mark.parametrize(
    ("law", "samples", "decimals"),
    [*zip(LAWS, (20, 100, 1000), (3, 4, 9), strict=True)],
)
def test_all_readers_of_a_table_find_its_period(
    tmp_path: Path, law: LawName, samples: int, decimals: int
) -> None:
    """Also one that rests at its start, after a leg that is longer than the first, and begins with short steps."""
    timed = gg.lift([(0.4, -0.4), (0.5, -0.4), (1.2, -1.2)], "red").parametrize(
        law=law, samples=samples
    )
    closed = np.column_stack([timed.t, timed.alpha.round(decimals)])
    source = tmp_path / "rows.csv"
    for rows, returns in ((closed, True), (closed[:-1], False)):
        write_rows(source, rows)
        assert (
            gg.validate(source)["closed"].message.startswith(
                "the last row repeats the first"
            )
            is returns
        )
        read = gg.read_table(source)
        corners, times = given_gait(read).rows
        gg.export(source, [tmp_path / "whole.csv"], force=True)
        write_h(read, tmp_path / "rows.h")
        whole = gg.read_table(tmp_path / "whole.csv")
        assert times is not None
        for end in (times[-1], timed_gait_of(source).period, whole["t"][-1]):
            assert end == pytest.approx(1.0, abs=1e-9)
        assert (len(corners.alpha), len(whole)) == (samples, samples + 1)
        assert (whole.alpha[-1] == whole.alpha[0]).all()
        assert f"_angle[{samples}][4]" in (tmp_path / "rows.h").read_text()


def test_of_a_measured_table_that_nearly_closes_every_row_is_kept(
    tmp_path: Path,
) -> None:
    timed = gg.lift(GAITS[2].angles, "red").parametrize(period=1.0, samples=20)
    rows = np.column_stack([timed.t, timed.alpha])
    rows[-1, 1::2] += 1e-6
    source = tmp_path / "rows.csv"
    write_rows(source, rows)
    with pytest.warns(FileWarning, match="rows.csv': the last row is 1e-06 rad from"):
        assert (given_gait(source).rows.gait.alpha == rows[:, 1:]).all()
    with pytest.warns(FileWarning, match="rows.csv': the last row is 1e-06 rad from"):
        kept: Any = gg.retarget(source)  # flyable, so it comes back bit by bit
    assert (kept.status, kept.table["t"][-1]) == ("unchanged", 1.0)
    np.testing.assert_array_equal(kept.table.alpha, rows[:, 1:])
    rows[-1, 1::2] -= 1e-6
    rows[:, 1::2] -= 0.5  # where it cannot fly a closing row goes with the first
    moved: Any = gg.retarget(rows[:, 1:])
    assert (moved.table.alpha[0] == moved.table.alpha[-1]).all()
    np.testing.assert_allclose(
        moved.moved[-1], np.linalg.norm(moved.table.alpha[-1] - rows[-1, 1:])
    )


def test_each_command_says_once_that_a_measured_table_nearly_closes(
    run: Any, tmp_path: Path
) -> None:
    timed = gg.lift(GAITS[3].angles, "red").parametrize(period=1.0, samples=20)
    rows = np.column_stack([timed.t, timed.alpha])
    rows[-1, 1::2] += 1e-6
    write_rows(tmp_path / "rows.csv", rows)
    for command in (
        "certify rows.csv",
        "colorings rows.csv",
        "export rows.csv rows.json",
        "export rows.csv even.json --samples 40",
        "pace rows.csv --max-rate 9 --max-acceleration 90",
        "retarget rows.csv",
        "robustness rows.csv",
        "validate rows.csv",
    ):
        done = run(*command.split())
        assert done.code == 0
        said = (done.out + done.err).count("the last row is 1e-06 rad from the first")
        assert said == 1, command


def test_a_last_row_of_another_color_is_a_row_of_its_own() -> None:
    rows = table([*CORNERS, CORNERS[0]], ("red", "red", "red", "blue"))
    assert not is_closed(tilt_angles(rows, PUBLISHED))
    assert given_gait(rows).rows[0].colors == ("red", "red", "red", "blue")
    assert not is_closed(np.zeros((1, 4)))


def test_an_open_table_closes_after_one_mean_step() -> None:
    assert (closing_time(2.0, 5.0, 4), closing_time(2.0, 2.0, 1)) == (6.0, 2.0)
    for corners, stated, end in (
        (CORNERS, [1.0, 1.5, 4.0], [5.5]),
        ([*CORNERS, CORNERS[0]], [1.0, 1.5, 4.0, 9.0], []),
    ):
        np.testing.assert_array_equal(
            given_gait(table(corners, t=stated)).rows[1], [*stated, *end]
        )
    assert given_gait(table(CORNERS)).rows[1] is None


def test_rows_are_lifted_each_to_its_color() -> None:
    rows = table(CORNERS, ("red", "blue", "red"))
    gait, *_ = given_gait(rows).rows
    np.testing.assert_array_equal(tilt_angles(rows, PUBLISHED), gait.alpha)
    np.testing.assert_array_equal(
        gait.alpha, lift(CORNERS, ["red", "blue", "red"]).alpha
    )
    with pytest.raises(gg.InputError, match="alpha1 must be"):
        tilt_angles(table([(1.6, 0.0)]), PUBLISHED)


def test_rows_without_colors_get_those_of_the_sheets_within_the_tolerance() -> None:
    alpha = gg.lift(CORNERS, "blue").alpha
    for off, colors in ((0.0, ("blue",) * 3), (1.9e-3, ("blue",) * 3), (2.1e-3, ())):
        moved = alpha + off * np.array([0, 0, 1, 0])
        assert given_gait(table_from(moved)).rows[0].colors == colors


def test_the_request_stays_unless_another_vehicle_is_given() -> None:
    made = table(CORNERS)
    made = Table(columns=made.columns, about={"request": {"waypoints": [[0.4, -0.4]]}})
    assert (
        given_gait(made).rows[0].request
        == gg.gait_of(made).request
        == {"waypoints": [[0.4, -0.4]]}
    )
    assert given_gait(made, coefficients="exact").rows[0].request == {}
    assert (
        given_gait(made, vehicle=gg.vehicle_named("beetle_omni"))
        .rows[0]
        .coefficients.kind
        == "exact"
    )
    timed = Table(
        columns={**made.columns, "t": np.arange(3.0)},
        about=made.about | {"crossing_tolerance": 0},
    )
    assert given_gait(timed).rows[0].crossing_tolerance == 0
    assert "request" in completed_table(timed).about
    assert "request" not in completed_table(timed, coefficients="exact").about


def test_stated_R_stays_within_its_digits_and_not_beyond() -> None:
    rows = table([*CORNERS, CORNERS[0]], t=[0, 1, 2, 3])
    computed = np.asarray(
        gg.invertibility.level_determinant(tilt_angles(rows, PUBLISHED), PUBLISHED)
    )
    digits = 2 * level_determinant_resolution(tilt_angles(rows, PUBLISHED), PUBLISHED)
    for share, stays in ((0.99, True), (1.01, False)):
        stated = computed + share * digits * np.array([0, 1, 0, 0])
        given = Table(columns={**rows.columns, "R": stated})
        kept = completed_table(given)["R"]
        np.testing.assert_array_equal(kept, stated if stays else computed)


def test_provenance_is_read_back_and_what_is_broken_is_refused() -> None:
    made = Table(columns={"t": np.zeros(1)}, about={"period": 2.0, "note": "α"})
    assert (
        about_from_text(provenance_text(made))
        == about_from_text(provenance_text(made), required=True)
        == made.about
    )
    assert about_from_text("measured") == about_from_text(None) == {}
    for text in ("measured", "[1]", '{"format": "another"}'):
        with pytest.raises(gg.InputError, match="the provenance in the file"):
            about_from_text(text, required=True)
    nested: Any = 1.0
    for _ in range(98):
        nested = [nested]
    assert checked_about({"a": nested})
    for content, message in (
        ({"a": [nested]}, "about must have at most 100 levels of nesting"),
        ({"a": math.inf}, "about must hold finite numbers and texts"),
        ({"a": {1}}, "about must hold finite numbers and texts"),
        ([1], "about must be an object"),
    ):
        with pytest.raises(gg.InputError, match=message):
            checked_about(content)
