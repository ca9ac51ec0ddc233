"""Checks of tables: the same as those of gaits, for all pieces, with row and time of each place."""

from __future__ import annotations

import itertools
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.table import ANGLES, Table
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
    pitch_sensitivity,
    roll_sensitivity,
)
from gaitgraph.validation.rows import MOST_LISTED_ROWS
from gaitgraph.validation.validating import validate
from tests.published import GAITS, PublishedGait
from tests.samples import table_from

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.validation.report import Report

G1, G2, G3, G4 = GAITS
STRONG = gg.PAPER.replace(max_thrust=5.0)  # enough for these gaits


def value_of(report: Report, name: str) -> float:
    value = report[name].value
    assert value is not None
    return value


def sampled(gait: PublishedGait, samples: int = 64, **options: Any) -> Table:
    timed = lift(gait.angles, gait.color).parametrize(samples=samples, **options)
    return Table(columns=timed.columns)


@pytest.mark.parametrize("samples", [4, 37])
@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
def test_the_four_gaits_as_tables(gait: PublishedGait, samples: int) -> None:
    report = validate(sampled(gait, samples))
    assert (report.valid, report.flyable, report.reachable_from_hover) == (
        True,
        gait.flyable,
        gait.reachable,
    )
    assert report["R_sign"].decided is (gait.color == "red")
    assert (report.listing and report.listing.count) == {1: 1, 2: 2, 3: 2, 4: 1}[
        gait.number
    ]
    assert report.rows == samples + 1


@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
@pytest.mark.parametrize("colored", [True, False])
@pytest.mark.parametrize("rounding", [None, 5e-4])
def test_verdicts_of_the_printed_digits(
    gait: PublishedGait, colored: bool, rounding: float | None
) -> None:
    """Three decimals, with colors given or found from the rows; the sign of R of Gaits 1 and 2 stays undecided."""
    rows = np.column_stack([np.round(gait.angles, 3), gait.printed])
    report = validate(
        table_from(rows, **({"color": (gait.color,) * 4} if colored else {})),
        angle_rounding=rounding,
    )
    assert (report.valid, report.flyable, report.reachable_from_hover) == (
        True,
        gait.flyable,
        gait.reachable,
    )
    assert report["R_sign"].decided is (gait.color == "red")
    assert gait.color in report["two_color"].message


angle = st.floats(-1.5, 1.5)
near_sheet = st.sampled_from([0.0, 1e-4, 3e-3, 0.2])


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Rows on red, on blue, beside them, or anywhere; in turns; with or without times and colors."""
    coefficients = coefficients_of(kind="exact")
    n = draw(st.integers(1, 9))
    rows, colors = [], []
    color = draw(st.sampled_from(["red", "blue"]))
    for _ in range(n):
        if draw(st.integers(0, 5)) == 0:
            color = draw(st.sampled_from(["red", "blue"]))
        row = (
            lift([(draw(angle), draw(angle))], color, coefficients=coefficients)
            .alpha[0]
            .copy()
        )
        row[2] += draw(near_sheet)
        rows.append(row)
        colors.append(color)
    if draw(st.booleans()):
        rows.append(rows[0])
        colors.append(colors[0])
    t = np.cumsum(
        draw(st.lists(st.floats(1e-3, 2), min_size=len(rows), max_size=len(rows)))
    )
    extra: dict[str, Any] = {"color": tuple(colors)} if draw(st.booleans()) else {}
    return table_from(rows, t=t if draw(st.booleans()) else None, **extra)


def verdicts(report: Report) -> list[Any]:
    return [(check.name, check.ok, check.decided) for check in report.checks]


@pytest.mark.no_cover
@settings(deadline=None, max_examples=25)
@given(table=tables())
def test_a_table_has_the_verdicts_of_the_gait_through_its_rows(table: Table) -> None:
    if "color" not in table:
        return
    for kind in ("exact", "published"):
        gait = Gait(
            alpha=table.alpha,
            colors=table["color"],
            coefficients=coefficients_of(kind=kind),
        )
        mine = validate(table, coefficients=kind)
        theirs = gait.check()
        for check in theirs.checks:
            assert (mine[check.name].ok, mine[check.name].decided) == (
                check.ok,
                check.decided,
            ), check.name
        assert mine.reachable_from_hover == theirs.reachable_from_hover


@pytest.mark.no_cover
@settings(deadline=None, max_examples=25)
@given(table=tables())
def test_reported_values_hold_between_rows(table: Table) -> None:
    """Against dense sampling of the closed polyline, with formulas of their own."""
    exact = coefficients_of(kind="exact")
    report = validate(table, coefficients="exact")
    rows = table.alpha
    s = np.linspace(0, 1, 257)[:, None, None]
    along = (rows + s * (np.roll(rows, -1, axis=0) - rows)).reshape(-1, 4)
    sigma = np.asarray(least_singular_value(along)).min()
    assert value_of(report, "least_singular_value") <= sigma + 1e-3
    assert (
        report["least_singular_value"].ok is bool(sigma >= 0.05)
        or abs(sigma - 0.05) < 2e-3
    )
    residual = np.maximum(
        np.abs(roll_sensitivity(along, exact)), np.abs(pitch_sensitivity(along, exact))
    ).max()
    assert value_of(report, "on_surface") >= residual - 1e-9
    assert value_of(report, "on_surface") <= residual + 0.02 * max(1.0, residual)
    R = np.asarray(level_determinant(along, exact))
    if R.min() < -1e-2 and R.max() > 1e-2:
        assert not report["R_sign"].ok or (report["R_sign"].limit or 0.0) > 1e-2
    if report["R_sign"].ok and report["R_sign"].decided:
        assert R.min() * R.max() > 0
    shares = hover_thrust_shares(along).min()
    if report["hover_thrust"].ok:
        assert 0 < shares == pytest.approx(value_of(report, "hover_thrust"), abs=2e-3)
    elif R.min() * R.max() > 0 and sigma > 0.0505 and residual < 1e-9:
        assert shares < 1e-3  # the only reason on the red sheet


def test_the_row_and_the_time_of_what_is_wrong() -> None:
    table = sampled(G3, 100, law="constant-speed")
    alpha = table.alpha
    colors = list(table["color"])
    colors[30] = "blue"
    report = validate(table_from(alpha, t=table["t"], color=tuple(colors)))
    assert not report.two_color
    assert (
        "rows 30 (+,+) and 31 (-,-) may not be neighbours (Figure 15)"
        in report["two_color"].message
    )
    there = {
        "row": 30,
        "t": pytest.approx(0.29),
        "fraction": 0.0,
        "alpha": alpha[29].tolist(),
    }
    assert report["two_color"].where == there
    # One wrong color is no rounding, and changes no physics.
    assert report["R_sign"].decided
    assert report["hover_thrust"].ok
    all_blue = validate(table_from(alpha, color=("blue",) * len(alpha)))
    assert all_blue.two_color
    assert not all_blue["continuous"].ok
    bent = alpha.copy()
    bent[57, 2] += 0.1
    report = validate(table_from(bent, t=table["t"]))
    assert not report
    for name in ("on_surface", "two_color", "continuous"):
        assert not report[name].ok
        where = report[name].where or {}
        assert (where["row"], where["t"]) == (58, pytest.approx(0.57))
    assert report["two_color"].message.startswith(
        "follows from on_surface: row 58, t = 0.57 s ("
    )
    assert " at row 58, t = 0.57 s (" in report["on_surface"].message


FOLLOWERS = ("two_color", "continuous")


CONVENTIONS: list[tuple[list[int], list[float], str]] = [
    ([0, 1, 2, 3], [1, 1, -1, 1], "the other sign of alpha3"),
    ([0, 1, 2, 3], [1, 1, 1, -1], "the other sign of alpha4"),
    ([0, 1, 2, 3], [1, 1, -1, -1], "the other sign of alpha3 and alpha4"),
    ([0, 2, 1, 3], [1, 1, 1, 1], "alpha2 and alpha3 exchanged"),
    ([0, 1, 3, 2], [1, 1, 1, 1], "alpha3 and alpha4 exchanged"),
    (
        [0, 1, 3, 2],
        [1, 1, -1, 1],
        "alpha3 and alpha4 exchanged, then the other sign of alpha4",
    ),
    (
        [0, 1, 2, 3],
        [1, 1, 180 / math.pi, 180 / math.pi],
        "alpha3 and alpha4 in degrees (alpha3_deg, alpha4_deg)",
    ),
]


@pytest.mark.parametrize(
    ("gait", "columns", "factors", "words"),
    [
        (gait, *convention)
        for gait in (G2, G3, G4)
        for convention in CONVENTIONS
        # With alpha2 and alpha3 exchanged alpha2 of Gait 2 is beyond its range.
        if not (gait is G2 and convention[0][1] == 2)
    ],
)
def test_another_convention_that_puts_all_rows_on_a_sheet_is_named(
    gait: PublishedGait,
    columns: list[int],
    factors: list[float],
    words: str,
) -> None:
    rows = sampled(gait).alpha[:, columns] * factors
    report = validate(table_from(rows))
    surface = report["on_surface"]
    assert surface.message.endswith(f"all rows would lie on {gait.color} with {words}")
    broken = [check for check in report.checks if not check.ok]
    assert [one.follows_from for one in broken] == [None] + ["on_surface"] * (
        len(broken) - 1
    )
    assert str(report).count("  NO  ") == str(report).count("  follow from it  ") == 1


def test_a_convention_that_puts_all_rows_but_one_on_a_sheet_is_not_named() -> None:
    rows = sampled(G3).alpha * [1, 1, -1, 1]
    rows[20, 3] += 0.01
    message = validate(table_from(rows))["on_surface"].message
    assert message.endswith(
        "take (α3, α4) from the roots of (α1, α2), or raise the tolerance"
    )


def test_points_of_few_angles_do_not_make_a_convention_of_several_changes() -> None:
    """Along the diagonal a biased gait lies on red with alpha2 and alpha3 exchanged and two signs turned."""
    s = np.linspace(-0.4, 0.9, 14)
    rows = np.column_stack([s, -s, 0.8 * s, -0.8 * s])
    report = validate(table_from(rows))
    assert "would lie" not in report["on_surface"].message
    assert report["R_sign"].follows_from is None


def test_a_constant_offset_is_told_in_degrees() -> None:
    rows = sampled(G3).alpha
    for offset, words in (
        ([0, 0, 3, 0], "α3 by 3.00° and α4 by 0.00°"),
        ([0, 1, 0, -4], "α3 by 0.00° and α4 by -5.00°"),
    ):
        report = validate(table_from(rows + np.radians(offset)))
        assert f"all rows are off red by the same angles, {words}" in str(
            report["on_surface"].message
        )
        assert [report[name].follows_from for name in FOLLOWERS] == ["on_surface"] * 2
    apart = table_from(lift([(-1.3, 0.4), (-1.1, 0.4), (-1.2, 0.5)], "blue").alpha)
    assert "by the same angles" not in validate(apart)["on_surface"].message
    noisy = rows + np.random.default_rng(5).normal(0, 0.02, rows.shape)
    one = rows[:1] + np.radians([0, 0, 3, 0])
    for table in (noisy, one):
        message = validate(table_from(table))["on_surface"].message
        assert "by the same angles" not in message


@pytest.mark.parametrize("row", [0, 1, 2, 31, 62, 63])
@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("on_red", [True, False])
def test_a_single_row_far_from_its_neighbours_is_named(
    row: int,
    closed: bool,
    on_red: bool,
) -> None:
    table = sampled(G3, law="constant-speed")
    alpha, t = table.alpha[:-1].copy(), table["t"][:-1]
    alpha[row, [0, 2] if on_red else [2]] -= 0.25
    if closed:
        alpha, t = np.vstack([alpha, alpha[:1]]), table["t"]
    vehicle = gg.PAPER.replace(max_tilt_rate=6.0, max_tilt_acceleration=150.0)
    report = validate(table_from(alpha, t=t), vehicle=vehicle)
    broken = [check for check in report.checks if not check.ok]
    first = broken[0]
    assert first.name == ("tilt_rate" if on_red else "on_surface")
    assert f"row {row + 1} alone is 0.2" in first.message
    assert "take at least" not in str(report)
    assert {one.follows_from for one in broken[1:]} == {first.name}
    assert not [note for note in report.notes if "alone" in note]
    # Where no rule is broken by it, it is a warning.
    if on_red:
        free = validate(table_from(alpha, t=t), vehicle=gg.PAPER)
        assert [note for note in free.notes if f"row {row + 1} alone is 0.2" in note]


@pytest.mark.parametrize("law", ["smooth", "constant-speed", "equal-time"])
@pytest.mark.parametrize("samples", [11, 40])
@pytest.mark.parametrize("gait", GAITS)
def test_no_row_of_a_planned_gait_is_far_from_its_neighbours(
    gait: PublishedGait, samples: int, law: str
) -> None:
    table = table_from(sampled(gait, samples, law=law).alpha)
    assert validate(table, vehicle=STRONG).notes == ()


def test_one_cause_is_one_no() -> None:
    """Rules that are broken by another one follow from it; each keeps its place and its words."""
    crossing = validate(
        table_from(lift([(0, 0), (0.9, -0.9), (0.9, -0.4)], "red").alpha)
    )
    blue = validate(table_from(lift([(0.5, -0.7), (0.6, -0.7)], "blue").alpha))
    jumping = validate(
        table_from(
            lift([(0.9, -0.9), (0.9, -0.4)], ["red", "blue"]).alpha,
            color=("red", "blue"),
        )
    )
    for report, names, cause in (
        (crossing, ["least_singular_value", "hover_thrust"], "R_sign"),
        (blue, ["hover_thrust"], "least_singular_value"),
        (jumping, ["on_surface"], "continuous"),
    ):
        assert report[cause].follows_from is None
        for name in names:
            check = report[name]
            assert not check.ok
            assert check.follows_from == cause
            assert check.message.startswith(f"follows from {cause}: ")
            assert check.as_mapping()["follows_from"] == cause
        listed = ", ".join(names).replace("_", " ")
        assert f"  --  follow from it        {listed}\n" in str(report)
    assert "follows from" not in jumping.reason


@pytest.mark.parametrize("turn", range(3))
def test_a_change_of_the_sign_of_R_between_rows_is_found(turn: int) -> None:
    """All rows have R > 0, one straight segment crosses the saddle of R: between rows, or the one that closes."""
    rows = np.roll(
        lift([(-1.2, 1.2), (1.35, 1.2), (-1.5, -1.0)], "red").alpha, turn, axis=0
    )
    exact = coefficients_of(kind="exact")
    s = np.linspace(0, 1, 4001)[:, None, None]
    R = np.asarray(
        level_determinant(rows + s * (np.roll(rows, -1, axis=0) - rows), exact)
    )
    check = validate(table_from(rows, t=[0, 1, 2]), coefficients="exact")["R_sign"]
    assert not check.ok
    at_rows = level_determinant(rows, exact)
    worst = R.min(axis=0) if at_rows[np.argmax(np.abs(at_rows))] > 0 else -R.max(axis=0)
    assert abs(check.value or 0.0) == pytest.approx(-worst.min(), abs=1e-3)
    assert check.where is not None
    assert check.where["row"] == int(np.argmin(worst)) + 1
    assert 0 < check.where["fraction"] < 1
    assert f"R changes its sign at row {check.where['row']} and " in check.message
    assert check.where["t"] == pytest.approx(
        check.where["row"] - 1 + check.where["fraction"]
    )


@pytest.mark.parametrize("open_", [True, False])
def test_closing(open_: bool) -> None:
    table = sampled(G3, 40, law="constant-speed")
    report = validate(table.rows(0, 40) if open_ else table, vehicle=STRONG)
    assert (report.valid, report.flyable, report.notes) == (True, True, ())
    step = np.abs(np.diff(table.alpha, axis=0)).max()
    assert report["closed"].value == pytest.approx(step if open_ else 0.0)
    assert ("back to row 1 is judged too" in report["closed"].message) is open_
    single = validate(table_from([[0.4, -0.4, 0.4, -0.4]], t=[3.0]))
    assert single.flyable is lift([(0.4, -0.4)], "red").check().flyable
    assert single["closed"].message == "the gait is a single point"
    assert single.notes == (
        "the table is a single posture, not a gait: its rows are all equal",
    )
    assert single["tilt_rate"].value == 0


@pytest.mark.parametrize(
    ("first", "noted"),
    [([0.5, 0.6, 0.7, 0.8], False), ([0.5, 0.6, 0.7, 0.8, 0.805], True)],
)
def test_a_closing_segment_of_more_than_three_steps_is_suspicious(
    first: list[float], noted: bool
) -> None:
    report = validate(table_from(lift([(a, -0.9) for a in first], "red").alpha))
    assert report["closed"].value == pytest.approx(first[-1] - 0.5)
    assert (
        any("is the end of the table missing?" in note for note in report.warnings)
        is noted
    )


class TestClock:
    def table(self, n: int = 400, **columns: Any) -> Table:
        t = np.linspace(0, 2, n + 1)
        swing = 0.2 * np.cos(np.pi * t)
        alpha = np.column_stack([0.9 + swing, -0.9 - swing, 0.9 + swing, -0.9 - swing])
        return table_from(alpha, t=t, **columns)

    def test_against_the_motion_itself(self) -> None:
        """A cosine of amplitude 0.2 and period 2 s: peaks 0.2π rad/s and 0.2π² rad/s², from below."""
        vehicle = gg.PAPER.replace(max_tilt_rate=1.0, max_tilt_acceleration=3.0)
        report = validate(self.table(), vehicle=vehicle)
        for name, peak in (
            ("tilt_rate", 0.2 * np.pi),
            ("tilt_acceleration", 0.2 * np.pi**2),
        ):
            assert report[name].ok
            assert 0.999 * peak <= value_of(report, name) <= peak * (1 + 1e-9)

    @pytest.mark.parametrize(
        "cut", [1, *range(110, 116)]
    )  # among them those that put the kick at the seam
    def test_the_seam_is_seen(self, cut: int) -> None:
        """A kick of one row has the same peaks wherever the table begins."""
        table = self.table(120)
        alpha = table.alpha[:-1].copy()
        alpha[7] += 0.01
        values = []
        for shift in (0, cut):
            turned = np.roll(alpha, shift, axis=0)
            closed = table_from(np.vstack([turned, turned[:1]]), t=table["t"])
            open_ = table_from(turned, t=table["t"][:-1])
            for one in (closed, open_):
                report = validate(
                    one, vehicle=gg.PAPER.replace(max_tilt_acceleration=1.0)
                )
                assert not report["tilt_acceleration"].ok
                where = report["tilt_acceleration"].where or {}
                assert (where["row"] <= len(one), where["row"] % 120) == (
                    True,
                    (8 + shift) % 120,
                )
                assert where["t"] == one["t"][where["row"] - 1]
                values.append(
                    (
                        value_of(report, "tilt_rate"),
                        value_of(report, "tilt_acceleration"),
                    )
                )
        np.testing.assert_allclose(
            values, np.broadcast_to(values[0], (4, 2)), rtol=1e-6
        )

    def test_stated_accelerations_count_if_they_are_larger(self) -> None:
        stated: dict[str, Any] = {
            f"{angle}_acceleration": np.zeros(401) for angle in ANGLES
        }
        stated["alpha3_acceleration"][7] = -50.0
        vehicle = gg.PAPER.replace(max_tilt_acceleration=40.0)
        check = validate(self.table(**stated), vehicle=vehicle)["tilt_acceleration"]
        assert (check.ok, check.where and check.where["row"]) == (False, 8)
        assert check.value == pytest.approx(50.0, rel=0.02)  # but for its digits
        assert "(α3)" in check.message

    def test_messages_of_limits(self) -> None:
        """Times count from anywhere; rates scale with the time, accelerations with its square."""
        table = self.table()
        table.columns["t"] = table["t"] + 5.0
        names = [check.name for check in validate(table).checks]
        assert names[-2:] == ["tilt_rate", "tilt_acceleration"]
        vehicle = gg.PAPER.replace(
            max_tilt_rate=0.05 * np.pi, max_tilt_acceleration=np.pi**2 / 45
        )
        report = validate(table, vehicle=vehicle)
        rate, acceleration = report["tilt_rate"], report["tilt_acceleration"]
        assert rate.where is not None
        row, t = rate.where["row"], rate.where["t"]
        assert t == pytest.approx(5.0 + (row - 1) / 200)
        assert f" at row {row}, t = {t:.6g} s (" in rate.message
        assert rate.message.endswith(": take at least 8 s instead of 2 s")
        assert acceleration.message.endswith(": take at least 6 s instead of 2 s")

    @pytest.mark.filterwarnings("ignore::gaitgraph.errors.FileWarning")
    @pytest.mark.parametrize(
        ("factor", "fits"),
        [(0.2, True), (1.0, True), (3.0, False), (-1.0, False), (57.3, False)],
    )
    def test_stated_rates_that_do_not_fit_are_not_used(
        self, factor: float, fits: bool
    ) -> None:
        table = self.table(40)
        rate = -0.2 * np.pi * np.sin(np.pi * table["t"]) * factor
        signs = (1, -1, 1, -1)
        stated = {
            f"{name}_rate": sign * rate
            for name, sign in zip(ANGLES, signs, strict=True)
        }
        table = Table(columns={**table.columns, **stated})
        report = validate(table)
        assert any("are not used" in one for one in report.warnings) is not fits
        assert value_of(report, "tilt_rate") == pytest.approx(0.2 * np.pi, rel=5e-3)

    def test_two_rows_swing_to_and_fro(self) -> None:
        """Out in 1 s and back in one mean step, 1 s: the rate turns from 0.5 to −0.5 rad/s within 1 s, at both ends."""
        rows, limited = (
            lift([(0.4, -0.4), (0.9, -0.9)], "red").alpha,
            gg.PAPER.replace(max_tilt_acceleration=9.0),
        )
        for table in (
            table_from(rows, t=[2, 3]),
            table_from(np.vstack([rows, rows[:1]]), t=[2, 3, 4]),
        ):
            report = validate(table, vehicle=limited)
            assert value_of(report, "tilt_rate") == pytest.approx(0.5)
            assert (report["tilt_rate"].where or {})["row"] == 1
            assert value_of(report, "tilt_acceleration") == pytest.approx(1.0)


def test_wrong_types_and_R_are_reported() -> None:
    table = sampled(G4, 50)
    types = list(table["types"])
    types[9] = "(-,?)"
    R = table["R"].copy()
    for row, off in ((1, 0.0101 * R[0]), (26, -0.0101)):
        stated = np.where(
            np.abs(R) < 1, R - 0.0099, R * 1.0099
        )  # as near as counts as rounding
        stated[row - 1] = R[row - 1] + off
        report = validate(
            Table(columns={**table.columns, "types": tuple(types), "R": stated}),
            vehicle=STRONG,
        )
        assert report.valid
        assert "row 10 states the types (-,?), but it is red" in report.warnings[0]
        assert (
            f"row {row} states R = {stated[row - 1]:.4g}, but R is {R[row - 1]:.4g} there (pub"
            in report.warnings[1]
        )


def test_rows_where_the_sheets_meet_take_the_color_of_their_neighbours() -> None:
    """At (δ, −δ) red and blue agree; a loop on either sheet through it has one color."""
    exact = coefficients_of(kind="exact")
    meeting = (exact.delta, -exact.delta)
    for color in ("red", "blue"):
        for turn in range(3):
            points = np.roll([meeting, (0.5, -0.6), (0.6, -0.3)], turn, axis=0)
            report = validate(
                table_from(lift(points, color, coefficients=exact).alpha),
                coefficients="exact",
            )
            assert f"({color})" in report["two_color"].message


def test_long_tables_are_counted_and_not_listed() -> None:
    report = validate(
        table_from(
            np.tile(lift(G3.angles, "red").alpha, (MOST_LISTED_ROWS // 4 + 1, 1))
        )
    )
    assert report.listing is not None
    assert (report.listing.count, report.listing.first) == (2, ())
    assert str(report.listing).startswith("2 colourings of a loop\n")
    assert "2 with R < 0, all red or all blue" in str(report)


@pytest.mark.parametrize("decimals", [1, 2, 3, 8, 9, 12])
def test_the_sign_of_R_is_that_of_the_angles_as_they_stand_in_every_format(
    tmp_path: Path, decimals: int
) -> None:
    """Red, with tan α1 − tan α2 just beyond 2κ: R is about −4e-3, which an error of 5e-4 rad does not carry."""
    a2 = -0.2
    a1 = math.atan(2 * gg.PAPER.drag_ratio + math.tan(a2)) + 3e-4
    angles = [round(angle, decimals) for angle in (a1, a2, a1, a2)]
    columns: dict[str, Any] = {
        name: [angle] for name, angle in zip(ANGLES, angles, strict=True)
    }
    rows = ",".join(ANGLES), ",".join(f"{angle:.{decimals}f}" for angle in angles)
    (tmp_path / "gait.csv").write_text("\n".join(rows))
    (tmp_path / "gait.json").write_text(json.dumps({"columns": columns}))
    checks = [
        gg.validate(source, coefficients="exact")["R_sign"]
        for source in (columns, tmp_path / "gait.csv", tmp_path / "gait.json")
    ]
    assert checks[0] == checks[1] == checks[2]
    assert "angles exact" in checks[0].message
    rough = gg.validate(columns, coefficients="exact", angle_rounding=5e-4)["R_sign"]
    assert "angles to 0.0005 rad" in rough.message
    if decimals >= 3:
        assert checks[0].decided
        assert not rough.decided


def test_options_of_checks_are_passed_on() -> None:
    gait = lift(G3.angles, "red")
    bent = Gait(alpha=gait.alpha + np.array([0, 0, 1e-2, 0]), colors=gait.colors)
    slow = lift(G3.angles, "red", vehicle=gg.PAPER.replace(max_tilt_rate=1.0))
    for one, other in ((gait, bent), (gait.parametrize(), bent.parametrize())):
        assert validate(one).flyable
        assert not validate(one, floor=0.6).flyable
        assert not validate(one, angle_rounding=1.0)["R_sign"].decided
        assert (validate(other).valid, validate(other, tolerance=0.2).valid) == (
            False,
            True,
        )
    assert (validate(slow).flyable, validate(slow.parametrize())["tilt_rate"].ok) == (
        True,
        False,
    )


def test_colourings_of_gaits_have_their_coefficients_and_crossings() -> None:
    exact, wide = coefficients_of(kind="exact"), math.pi / 2
    for gait, count in (
        (lift(G3.angles, "red"), 2),
        (lift(G3.angles, "red", coefficients=exact), 1),
        (lift(G3.angles, "red", crossing_tolerance=wide), 2**4),
    ):
        listing = validate(gait).listing
        assert listing is not None
        assert listing.count == count
        assert len(listing.first) == min(count, 16)
        assert ("all red" in str(validate(gait))) == (
            "red" in listing.plain["negative"]
        )
    # A gait through the sides of the square has colourings; one beyond has none that are looked for.
    at_side = Gait(
        alpha=np.array([[math.pi / 2, 0.3, math.pi / 2, 0.3]]), colors=("red",)
    )
    assert validate(at_side).listing is not None
    beyond = Gait(
        alpha=np.array([[0.3, -math.pi / 2 - 1e-6, 0.3, 0.3]]), colors=("red",)
    )
    assert validate(beyond).listing is None
    for times in (1, MOST_LISTED_ROWS + 1):  # tables are refused, as their files are
        with pytest.raises(gg.InputError, match="^row 1: alpha2 must be within ±π/2"):
            validate(table_from(np.tile(beyond.alpha, (times, 1))))


def test_whole_turns_change_no_physics() -> None:
    rows = lift(G4.angles, "red").alpha
    plain, turned = (
        validate(table_from(rows + shift))
        for shift in (0.0, np.array([0, 0, 2 * np.pi, -4 * np.pi]))
    )
    for name in (
        "least_singular_value",
        "hover_thrust",
        "R_sign",
        "on_surface",
        "continuous",
    ):
        assert turned[name].ok is plain[name].ok
        # Off red the bounds are wider and the search finer, within the same brackets.
        assert value_of(turned, name) == pytest.approx(value_of(plain, name), abs=1e-4)
    flipped = validate(table_from(rows + np.array([0, 0, np.pi, 0])))
    assert not flipped["hover_thrust"].ok


def test_inserting_rows_on_segments_changes_nothing() -> None:
    """Ends 1.5 mrad beside the sheet on different sides: the segment between them is nowhere farther away."""
    ends = [[-0.8, 0, -0.7985, 0], [-0.7, 0, -0.7015, 0]]
    middle = [-0.75, 0, -0.75, 0]
    short, full = (
        validate(table_from(ends)),
        validate(table_from([ends[0], middle, ends[1], middle])),
    )
    assert short.valid
    assert verdicts(short) == verdicts(full)


@settings(deadline=None, max_examples=25)
@given(table=tables(), times=st.integers(2, 4))
def test_refining_a_table_changes_no_verdict(table: Table, times: int) -> None:
    if (
        "color" in table
    ):  # without colors a row is judged by where it lies, and a new row may lie elsewhere
        rows = table.alpha
        s = np.linspace(0, 1, times, endpoint=False)[:, None]
        fine = np.concatenate(
            [a + s * (b - a) for a, b in itertools.pairwise([*rows, rows[0]])]
        )
        colors = tuple(color for color in table["color"] for _ in range(times))
        same = len(set(table["color"])) == 1
        for kind in ("exact", "published"):
            mine, theirs = (
                validate(one, coefficients=kind)
                for one in (table, table_from(fine, color=colors))
            )
            for name in ("on_surface", "least_singular_value", "hover_thrust") + (
                ("continuous",) if same else ()
            ):
                assert mine[name].ok is theirs[name].ok, name


def test_the_place_where_thrusts_vanish_between_rows_is_reported() -> None:
    check = validate(table_from(lift([(-0.896, 1.14), (-1.12, 1.512)], "red").alpha))[
        "hover_thrust"
    ]
    assert (check.ok, check.value) == (False, None)
    beta2 = (check.where or {})["alpha"][1] + coefficients_of(kind="exact").delta
    assert math.cos(beta2) == pytest.approx(0, abs=1e-9)
    assert "not positive at row 1 and 71 % of the way to the next (" in check.message


def test_the_end_of_the_closing_segment_is_the_first_row_at_its_own_time() -> None:
    rows = lift([(0.5, -0.5), (1.1, -1.1), (1.0, -1.1)], "red").alpha
    report = validate(
        table_from(np.vstack([rows[1:], rows[:1]]), t=[-11.0, -8.0, -5.0])
    )
    for check in report.checks:
        if check.where is not None and check.where["fraction"] == 0:
            assert check.where["t"] == [-11.0, -8.0, -5.0][check.where["row"] - 1]


def test_a_table_of_a_cubic_has_its_jerk() -> None:
    """Third divided differences of a cubic are its third derivative, whatever the times."""
    t = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.65, 0.8])
    alpha = -0.6 + 0.05 * t + 0.3 * t**3
    table = table_from(np.column_stack([alpha, 0.5 + 0 * t, alpha, 0.5 + 0 * t]), t=t)
    for limit, ok in ((1e9, True), (1.0, False)):
        report = validate(table, vehicle=gg.PAPER.replace(max_tilt_jerk=limit))
        assert report["tilt_jerk"].ok is ok
        assert value_of(report, "tilt_jerk") >= 6 * 0.3 * (1 - 1e-9)
