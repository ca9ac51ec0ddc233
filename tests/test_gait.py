"""Gaits: lifted, reordered, biased, merged, their vertices; and rows of tables that are closed and completed."""

from __future__ import annotations

import math
import warnings
from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
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
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    level_determinant,
    level_determinant_resolution,
)
from gaitgraph.surface.sheets import COLORS, roots
from gaitgraph.timing.laws import LAWS
from tests.published import GAITS
from tests.samples import EXACT, PUBLISHED, table_from

# Squares of lengths below 1e-150 are zero.
angle = st.floats(-1.5, 1.5).map(lambda x: round(x, 6))
loops = st.lists(st.tuples(angle, angle), min_size=1, max_size=7)
# Blue is a sheet of solutions without rotor height alone.
LOW_BEETLE = gg.vehicle_named("beetle_omni").replace(rotor_height=0.0)


@settings(deadline=None, max_examples=30)
@given(
    points=loops,
    color=st.sampled_from(COLORS),
    numbers=st.sampled_from([PUBLISHED, EXACT, coefficients_of(LOW_BEETLE)]),
)
def test_corners_are_roots_of_their_color(
    points: Any, color: Any, numbers: Any
) -> None:
    gait = lift(points, color, coefficients=numbers)
    for point, corner in zip(points, gait.alpha, strict=True):
        of_color = [
            root.alpha
            for root in roots(*point, coefficients=numbers)
            if root.color == color
        ]
        np.testing.assert_allclose(of_color, [corner], atol=1e-15)


def edges_of(gait: Gait) -> set[Any]:
    return {
        (tuple(a), tuple(b))
        for a, b in zip(gait.alpha.tolist(), gait.ends.tolist(), strict=True)
    }


@settings(deadline=None, max_examples=30)
@given(points=loops, start=st.integers(0, 6))
def test_reversing_and_restarting_keep_the_edges_and_the_colors(
    points: list[tuple[float, float]], start: int
) -> None:
    gait = lift(points, ["red" if k % 2 else "blue" for k in range(len(points))])
    start %= len(points)
    turned, back = gait.started_at(start), gait.reversed()
    assert edges_of(turned) == edges_of(gait)
    assert edges_of(back) == {(b, a) for a, b in edges_of(gait)}
    assert turned.alpha[0].tolist() == gait.alpha[start].tolist()
    assert back.alpha[0].tolist() == gait.alpha[0].tolist()
    for other in (turned, back):
        assert other.length == pytest.approx(gait.length)
        again = lift(other.alpha[:, :2], other.colors).alpha
        np.testing.assert_array_equal(other.alpha, again)


@settings(deadline=None, max_examples=30)
@given(points=loops, parts=st.integers(1, 5))
def test_points_on_straight_runs_are_merged(
    points: list[tuple[float, float]], parts: int
) -> None:
    corners = np.array(points)
    step = np.roll(corners, -1, axis=0) - corners
    shares = np.arange(parts)[:, None] / parts
    fine = (corners[:, None] + shares * step[:, None]).reshape(-1, 2)
    merged = lift(np.repeat(fine, 2, axis=0), "red").merged()
    np.testing.assert_allclose(
        merged.alpha, lift(corners, "red").merged().alpha, atol=1e-12
    )


@pytest.mark.parametrize(
    ("points", "kept"),
    [
        ([(0, 0), (1, 0), (1, 1), (1, 0)], [0, 1, 2, 3]),  # a side passed twice
        ([(0.2, 0), (0.4, 0), (0.4, 0.4), (0, 0)], [0, 1, 2, 3]),  # the start stays
        ([(0, 0), (0.1, 0), (0.2, 0), (0.1, 0)], [0, 2]),  # out and back
        ([(0.3, -0.3)] * 4, [0]),
    ],
)
def test_corners_that_stay(points: Any, kept: list[int]) -> None:
    gait = lift(points, "red")
    np.testing.assert_array_equal(gait.merged().alpha, gait.alpha[kept])


def test_a_change_of_color_is_a_corner() -> None:
    points = [(0.1, 0.0), (0.2, 0.0), (0.3, 0.0), (0.4, 0.0), (0.5, 0.0)]
    gait = lift(points, ["red", "red", "red", "blue", "blue"])
    assert gait.color == "mixed"
    np.testing.assert_array_equal(gait.merged().alpha, gait.alpha[[0, 2, 3, 4]])


TRIANGLE = [(0.1, 0.1), (0.9, 0.2), (0.7, 0.8)]
SHIP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.0, 0.9), (-1.2, 0.5)]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("points", [TRIANGLE, SHIP, GAITS[0].angles, [(0.3, 0.2)]])
def test_vertices_are_the_corners_of_a_loop_and_of_its_samples(
    law: Any, points: Any
) -> None:
    loop = lift(points, "red")
    np.testing.assert_array_equal(loop.vertices(), loop.alpha)
    timed = loop.parametrize(1.0, law=law)
    times = np.union1d(timed.t, timed.corner_times)[:-1]
    np.testing.assert_allclose(vertices(timed.at(times).alpha), loop.alpha, atol=1e-8)


def test_vertices_of_a_curve_and_of_measured_rows_need_a_tolerance() -> None:
    turn = np.linspace(0, 2 * pi, 37)
    circle = np.column_stack([np.cos(turn), np.sin(turn)] * 2)
    assert (len(vertices(circle)), len(vertices(circle, 0.1))) == (36, 0)
    loop = lift(TRIANGLE, "red")
    noise = np.random.default_rng(1).uniform(-1e-4, 1e-4, (9, 4))
    noisy = np.repeat(loop.alpha, 3, axis=0) + noise
    np.testing.assert_allclose(vertices(noisy, 3e-4), loop.alpha, atol=3e-4)


# Rows of tables

CORNERS = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]


def table(points: Any, colors: Any = "red", **columns: Any) -> Table:
    first, second = np.array(points, dtype=float).T
    names = (colors,) * len(points) if isinstance(colors, str) else colors
    more = {name: np.array(values, dtype=float) for name, values in columns.items()}
    return Table(columns={**more, "alpha1": first, "alpha2": second, "color": names})


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize(
    ("gap", "closed", "told"),
    [
        (0.0, True, False),
        (-0.99e-9, True, False),
        (1.01e-9, False, True),
        (-1.9e-3, False, True),  # typed by hand, or measured
        (2.1e-3, False, False),
    ],
)
def test_a_last_row_closes_where_it_is_the_first_and_one_nearby_is_told_and_kept(
    joint: int, gap: float, closed: bool, told: bool
) -> None:
    last = np.array(CORNERS[0])
    last[joint] += gap
    rows = table([*CORNERS, last], t=[0.0, 1.0, 2.0, 3.0])
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        gait, times = given_gait(rows).rows
        whole = completed_table(rows)
        report = gg.validate(rows)
    assert {"the last row is" in str(warning.message) for warning in warned} <= {True}
    assert bool(warned) is told
    count = 3 if closed else 4
    assert (len(gait.alpha), len(whole), whole["t"][-1]) == (count, count + 1, count)
    assert times is not None
    assert times[-1] == count
    for name, values in whole.columns.items():
        assert name == "t" or values[0] == values[-1]
    assert report["closed"].value == (0.0 if closed else pytest.approx(abs(gap)))
    assert ("a point of its own" in str(report.notes)) is told


def test_a_last_row_of_another_color_and_a_single_row_close_nothing() -> None:
    colors = ("red", "red", "red", "blue")
    rows = table([*CORNERS, CORNERS[0]], colors)
    assert given_gait(rows).rows.gait.colors == colors
    assert not is_closed(np.zeros((1, 4)))


def test_an_open_table_closes_after_one_mean_step() -> None:
    assert (closing_time(2.0, 5.0, 4), closing_time(2.0, 2.0, 1)) == (6.0, 2.0)
    times = given_gait(table(CORNERS, t=[1.0, 1.5, 4.0])).rows.times
    np.testing.assert_array_equal(times, [1.0, 1.5, 4.0, 5.5])
    assert given_gait(table(CORNERS)).rows.times is None


@pytest.mark.parametrize(
    ("off", "is_on"), [(0.0, True), (1.9e-3, True), (2.1e-3, False)]
)
def test_rows_without_colors_get_those_of_the_sheets_within_the_tolerance(
    off: float, is_on: bool
) -> None:
    alpha = lift(CORNERS, "blue").alpha + np.array([0, 0, off, 0])
    colors = given_gait(table_from(alpha)).rows.gait.colors
    assert colors == ("blue",) * 3 * is_on


def test_a_request_stays_unless_another_vehicle_is_given() -> None:
    request = {"waypoints": [[0.4, -0.4]]}
    about = {"request": request, "crossing_tolerance": 0}
    made = Table(columns=table(CORNERS, t=[0, 1, 2]).columns, about=about)
    own = given_gait(made).rows.gait
    assert own.request == gg.gait_of(made).request == request
    assert own.crossing_tolerance == 0
    assert completed_table(made).about["request"] == request
    others: list[dict[str, Any]] = [{"coefficients": "exact"}, {"vehicle": LOW_BEETLE}]
    for options in others:
        other = given_gait(made, **options).rows.gait
        assert (other.request, other.coefficients.kind) == ({}, "exact")
        assert "request" not in completed_table(made, **options).about


@pytest.mark.parametrize(("share", "stays"), [(0.99, True), (1.01, False)])
def test_stated_R_stays_within_its_digits_and_not_beyond(
    share: float, stays: bool
) -> None:
    rows = table([*CORNERS, CORNERS[0]], t=[0, 1, 2, 3])
    alpha = tilt_angles(rows, PUBLISHED)
    computed = np.asarray(level_determinant(alpha, PUBLISHED))
    digits = 2 * level_determinant_resolution(alpha, PUBLISHED)
    stated = computed + share * digits * np.array([0, 1, 0, 0])
    kept = completed_table(Table(columns={**rows.columns, "R": stated}))["R"]
    np.testing.assert_array_equal(kept, stated if stays else computed)


def test_provenance_is_read_back_and_what_is_broken_is_refused() -> None:
    made = Table(columns={"t": np.zeros(1)}, about={"period": 2.0, "note": "α"})
    assert about_from_text(provenance_text(made), required=True) == made.about
    assert about_from_text("measured") == about_from_text(None) == {}
    for text in ("measured", "[1]", '{"format": "another"}'):
        with pytest.raises(gg.InputError, match="^made_by must be the JSON"):
            about_from_text(text, required=True)
    nested: Any = 1.0
    for _ in range(10_000):
        nested = [nested]
    wrong = ({"a": nested}, {"a": math.inf}, {"a": {1}}, [1])
    for content in wrong:
        with pytest.raises(gg.InputError, match="about must"):
            checked_about(content)
