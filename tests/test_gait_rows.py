"""Rows of tables as gaits: lifted, closed by one rule, and completed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.gait.table import (
    CLOSED_GAP,
    Table,
    about_from_text,
    checked_about,
    closed_rows,
    closes,
    closing_time,
    completed_pieces,
    is_closed,
    merged,
    provenance_text,
    tilt_angles,
)
from gaitgraph.invertibility.matrices import level_determinant_resolution

PUBLISHED = gg.invertibility.coefficients_of()
CORNERS = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]


def table(points: list[tuple[float, float]], colors: str | tuple[str, ...] = "red", **columns: Any) -> Table:
    """Return a table of alpha1, alpha2 and color."""
    a1, a2 = np.array(points, dtype=float).T
    names = (colors,) * len(points) if isinstance(colors, str) else colors
    more = {name: np.array(values, dtype=float) for name, values in columns.items()}
    return Table(columns={**more, "alpha1": a1, "alpha2": a2, "color": names})


@pytest.mark.parametrize("off", [-1.0, 1.0])
def test_a_last_row_closes_up_to_the_gap_and_not_beyond(off: float) -> None:
    assert CLOSED_GAP == 1e-9
    for gap, closed in ((0.0, True), (0.99e-9, True), (1.01e-9, False), (0.01, False)):
        for angle in (0, 1):
            last = (CORNERS[0][0] + off * gap * (angle == 0), CORNERS[0][1] + off * gap * (angle == 1))
            rows = table([*CORNERS, last])
            assert is_closed(rows) is closed
            gait, _ = closed_rows(rows)
            assert len(gait.alpha) == (3 if closed else 4)
            assert gg.validate(rows)["closed"].value == (0.0 if closed else pytest.approx(gap, rel=1e-6))


def test_a_last_row_of_another_color_is_a_row_of_its_own() -> None:
    rows = table([*CORNERS, CORNERS[0]], ("red", "red", "red", "blue"))
    assert not is_closed(rows)
    assert closed_rows(rows)[0].colors == ("red", "red", "red", "blue")
    assert closes(rows.rows(0, 1), rows.rows(0, 1))
    assert not is_closed(table(CORNERS[:1]))


def test_an_open_table_closes_after_one_mean_step() -> None:
    assert closing_time(2.0, 5.0, 4) == 6.0
    assert closing_time(2.0, 2.0, 1) == 2.0
    _, times = closed_rows(table(CORNERS, t=[1.0, 1.5, 4.0]))
    assert times is not None
    assert times.tolist() == [1.0, 1.5, 4.0, 5.5]
    _, times = closed_rows(table([*CORNERS, CORNERS[0]], t=[1.0, 1.5, 4.0, 9.0]))
    assert times is not None
    assert times.tolist() == [1.0, 1.5, 4.0, 9.0]
    assert closed_rows(table(CORNERS))[1] is None


def test_rows_are_lifted_each_to_its_color() -> None:
    rows = table(CORNERS, ("red", "blue", "red"))
    gait, _ = closed_rows(rows)
    np.testing.assert_array_equal(tilt_angles(rows, PUBLISHED), gait.alpha)
    for corner, color in zip(gait.alpha, gait.colors, strict=True):
        (root,) = (root for root in gg.roots(corner[0], corner[1]) if root.color == color)
        np.testing.assert_allclose(corner, root.alpha, atol=1e-15)
    with pytest.raises(gg.InputError, match="row 12: color is 'fiber2'; without alpha3 and alpha4 it must be 'red'"):
        tilt_angles(table(CORNERS, ("red", "fiber2", "red")), PUBLISHED, rows_before=10)
    with pytest.raises(gg.InputError, match="alpha1 must be"):
        tilt_angles(table([(1.6, 0.0)]), PUBLISHED)


def test_rows_without_colors_get_those_of_the_sheets_within_the_tolerance() -> None:
    alpha = gg.lift(CORNERS, "blue").alpha
    for off, colors in ((0.0, ("blue",) * 3), (1.9e-3, ("blue",) * 3), (2.1e-3, ())):
        moved = alpha + off * np.array([0, 0, 1, 0])
        rows = Table(columns={f"alpha{k + 1}": moved[:, k] for k in range(4)})
        assert closed_rows(rows)[0].colors == colors


def test_the_request_stays_unless_another_vehicle_is_given() -> None:
    made = table(CORNERS)
    made = Table(columns=made.columns, about={"request": {"waypoints": [[0.4, -0.4]]}})
    assert closed_rows(made)[0].request == gg.gait_of(made).request == {"waypoints": [[0.4, -0.4]]}
    assert closed_rows(made, coefficients="exact")[0].request == {}
    assert closed_rows(made, vehicle=gg.vehicle_named("beetle_omni"))[0].coefficients.kind == "exact"


def test_stated_R_stays_within_its_digits_and_not_beyond() -> None:
    rows = table([*CORNERS, CORNERS[0]], t=[0, 1, 2, 3])
    computed = np.asarray(gg.invertibility.level_determinant(tilt_angles(rows, PUBLISHED), PUBLISHED))
    digits = 2 * level_determinant_resolution(tilt_angles(rows, PUBLISHED), PUBLISHED)
    for share, stays in ((0.99, True), (1.01, False)):
        stated = computed + share * digits * np.array([0, 1, 0, 0])
        given = Table(columns={**rows.columns, "R": stated})
        kept = merged(completed_pieces(lambda given=given: [given])())["R"]  # type: ignore[misc]
        np.testing.assert_array_equal(kept, stated if stays else computed)


def test_provenance_is_read_back_and_what_is_broken_is_refused() -> None:
    made = Table(columns={"t": np.zeros(1)}, about={"period": 2.0, "note": "α"})
    assert about_from_text(provenance_text(made)) == about_from_text(provenance_text(made), required=True) == made.about
    assert about_from_text("measured") == about_from_text(None) == {}
    for text in ("measured", "[1]", '{"format": "another"}'):
        with pytest.raises(gg.InputError, match="the provenance in the file"):
            about_from_text(text, required=True)
    nested: Any = 1.0
    for _ in range(98):
        nested = [nested]
    assert checked_about({"a": nested})
    for content, message in (
        ({"a": [nested]}, "nested too deeply"),
        ({"a": math.inf}, "about must hold finite numbers and texts"),
        ({"a": {1}}, "about must hold finite numbers and texts"),
        ([1], "about must be an object"),
    ):
        with pytest.raises(gg.InputError, match=message):
            checked_about(content)
