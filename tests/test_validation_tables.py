"""Checks of tables: the same as those of gaits, along all segments, with row and time of each place."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.gait.digits import Digits
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.gait.table import ANGLES, RATES, Table
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
from tests.samples import (
    EXACT,
    along,
    by_vehicle,
    closed,
    points_of,
    rows_of,
    symmetric_vehicle,
    table_from,
)

if TYPE_CHECKING:
    from gaitgraph.validation.report import Check, Report

G1, G2, G3, G4 = GAITS
STRONG = gg.PAPER.replace(max_thrust=5.0)  # so that no share is told


def value_of(report: Report, name: str) -> float:
    value = report[name].value
    assert value is not None
    return value


def sampled(gait: PublishedGait, samples: int = 64, **options: Any) -> Table:
    timed = lift(gait.angles, gait.color).parametrize(samples=samples, **options)
    return Table(columns=timed.columns)


# Laws


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Rows on red, on blue, beside them or anywhere, in turns; with or without times."""
    angle = st.floats(-1.5, 1.5)
    rows: list[Any] = []
    colors: list[Any] = []
    for _ in range(draw(st.integers(1, 9))):
        if not rows or draw(st.integers(0, 5)) == 0:
            color = draw(st.sampled_from(["red", "blue"]))
        row = lift([(draw(angle), draw(angle))], color, coefficients=EXACT).alpha[0]
        off = draw(st.sampled_from([0.0, 1e-4, 3e-3, 0.2]))
        rows.append(row + np.array([0, 0, off, 0]))
        colors.append(color)
    if draw(st.booleans()):
        rows.append(rows[0])
        colors.append(colors[0])
    times = st.lists(st.floats(1e-3, 2), min_size=len(rows), max_size=len(rows))
    t = draw(st.none() | times.map(np.cumsum))
    return table_from(rows, t=t, color=tuple(colors))


def verdicts(report: Report) -> dict[str, Any]:
    return {check.name: (check.ok, check.decided) for check in report.checks}


@pytest.mark.no_cover
@settings(deadline=None, max_examples=25)
@given(table=tables(), kind=st.sampled_from(["exact", "published"]))
def test_a_table_has_the_verdicts_of_the_gait_through_its_rows(
    table: Table, kind: Any
) -> None:
    coefficients = coefficients_of(kind=kind)
    gait = Gait(alpha=table.alpha, colors=table["color"], coefficients=coefficients)
    of_gait, of_table = gait.check(), validate(table, coefficients=kind)
    assert verdicts(of_gait).items() <= verdicts(of_table).items()
    assert of_table.reachable_from_hover == of_gait.reachable_from_hover


@pytest.mark.no_cover
@settings(deadline=None, max_examples=25)
@given(table=tables())
def test_reported_values_hold_between_rows_and_are_reached_where_it_is_said(
    table: Table,
) -> None:
    """Against dense sampling of the closed polyline, with formulas of their own."""
    report = validate(table, coefficients="exact")
    points = along(table.alpha, 257)

    def residual(points: Any) -> Any:
        roll, pitch = roll_sensitivity(points, EXACT), pitch_sensitivity(points, EXACT)
        return np.maximum(np.abs(roll), np.abs(pitch))

    sigma, shares = (
        least_singular_value(points).min(),
        hover_thrust_shares(points).min(),
    )
    R, off = np.asarray(level_determinant(points, EXACT)), residual(points).max()
    singular, surface = report["least_singular_value"], report["on_surface"]
    least, most = singular.value or 0.0, surface.value or 0.0
    # Below the floor it is a value of some place, within the bracket of the search.
    assert least <= sigma + (1e-9 if singular.ok else 1e-4)
    assert least_singular_value(place_of(singular)) == pytest.approx(least, abs=1e-3)
    assert most >= off - 1e-9
    assert residual(place_of(surface)) == pytest.approx(most, rel=0.02, abs=1e-4)
    assert singular.ok == (least >= 0.05) or abs(least - 0.05) < 1e-4
    assert surface.ok == (most <= 2e-3)
    if R.min() < -1e-2 and R.max() > 1e-2:
        assert not report["R_sign"].ok or (report["R_sign"].limit or 0.0) > 1e-2
    if report["R_sign"].ok:
        assert R.min() * R.max() > 0
    if report["hover_thrust"].ok:
        assert 0 < shares == pytest.approx(value_of(report, "hover_thrust"), abs=2e-3)
    elif R.min() * R.max() > 0 and sigma > 0.0505 and off < 1e-9:
        assert shares < 1e-3  # the only reason on the red sheet


def place_of(check: Check) -> Any:
    assert check.where is not None
    return check.where["alpha"]


@pytest.mark.no_cover
@settings(deadline=None, max_examples=25)
@given(table=tables(), times=st.integers(2, 4))
def test_rows_between_rows_change_no_verdict(table: Table, times: int) -> None:
    starts, ends = closed(table.alpha)
    shares = np.arange(times)[:, None] / times
    fine = (starts[:, None] + shares * (ends - starts)[:, None]).reshape(-1, 4)
    colors = tuple(color for color in table["color"] for _ in range(times))
    few, many = (
        verdicts(validate(one, coefficients="exact"))
        for one in (table, table_from(fine, color=colors))
    )
    names = ["on_surface", "least_singular_value", "hover_thrust"]
    if len(set(colors)) == 1:
        names.append("continuous")
    assert [few[name] for name in names] == [many[name] for name in names]


# What is wrong, and where


@by_vehicle(gg.PAPER, symmetric_vehicle(np.random.default_rng(7)))
def test_rows_that_are_rounded_either_way_are_on_the_surface(
    vehicle: gg.Vehicle,
) -> None:
    random = np.random.default_rng(3)
    points = random.uniform(-1.5, 1.5, (100, 2))
    off = 5e-7 * random.choice([-1.0, 1.0], (100, 4))
    table = replace(
        table_from(np.hstack([points, points]) + off),
        digits=dict.fromkeys(ANGLES, Digits(decimals=6, steps=True)),
        about={"angle_rounding": 1e-3},
    )
    check = validate(table, vehicle=vehicle, tolerance=1e-7)["on_surface"]
    assert check.ok
    assert check.value == pytest.approx(check.limit, rel=0.3)


def test_the_row_and_the_time_of_what_is_wrong() -> None:
    table = sampled(G3, 100, law="constant-speed")
    colors = ["red"] * 30 + ["blue"] + ["red"] * 70
    report = validate(table_from(table.alpha, t=table["t"], color=tuple(colors)))
    check = report["two_color"]
    assert (check.value, check.limit) == (1.0, 0.0)
    assert check.where == {
        "row": 30,
        "t": pytest.approx(0.29),
        "fraction": 0.0,
        "alpha": table.alpha[29].tolist(),
    }
    assert "rows 30 (+,+) and 31 (-,-) may not" in check.message
    # One wrong color is no rounding, and changes no physics.
    assert report["R_sign"].decided
    assert report["hover_thrust"].ok
    bent = table.alpha.copy()
    bent[57, 2] += 0.1
    report = validate(table_from(bent, t=table["t"]))
    for name in ("on_surface", "two_color", "continuous"):
        assert report[name].broken
        where = report[name].where or {}
        assert (where["row"], where["t"]) == (58, pytest.approx(0.57)), name
        assert "row 58, t = 0.57 s (" in report[name].message


@pytest.mark.parametrize("turn", range(3))
def test_a_change_of_the_sign_of_R_between_rows_is_found(turn: int) -> None:
    """Straight segments cross the saddle of R, between rows or back to the first."""
    points = np.roll([(-1.2, 1.2), (1.35, 1.2), (-1.5, -1.0)], turn, axis=0)
    rows = lift(points, "red").alpha
    at_rows = np.asarray(level_determinant(rows, EXACT))
    sign = np.sign(at_rows[np.abs(at_rows).argmax()])
    R = level_determinant(points_of(*closed(rows), 4001), EXACT)
    worst = (sign * R).min(axis=1)
    check = validate(table_from(rows, t=[0, 1, 2]), coefficients="exact")["R_sign"]
    assert check.broken
    assert check.value == pytest.approx(sign * worst.min(), abs=1e-3)
    where = check.where or {}
    assert where["row"] == worst.argmin() + 1
    assert 0 < where["fraction"] < 1
    assert where["t"] == pytest.approx(where["row"] - 1 + where["fraction"])
    assert f"R changes its sign at row {where['row']} and " in check.message


@pytest.mark.parametrize(
    ("points", "colors", "cause", "names"),
    [
        ([(0, 0), (0.9, -0.9), (0.9, -0.4)], "red", "R_sign", ["hover_thrust"]),
        ([(0.5, -0.7), (0.6, -0.7)], "blue", "least_singular_value", ["hover_thrust"]),
        ([(0.9, -0.9), (0.9, -0.4)], ["red", "blue"], "continuous", ["on_surface"]),
    ],
)
def test_one_cause_is_one_no(
    points: Any, colors: Any, cause: str, names: list[str]
) -> None:
    gait = lift(points, colors)
    report = validate(table_from(gait.alpha, color=gait.colors))
    assert report[cause].follows_from is None
    for name in names:
        check = report[name]
        assert check.broken
        assert check.as_mapping()["follows_from"] == cause
        assert check.message.startswith(f"follows from {cause}: ")
        line = next(line for line in str(report).splitlines() if "follow from" in line)
        assert name.replace("_", " ") in line
    assert "follows from" not in report.reason


# Why rows lie on no sheet

DEGREES = 180 / math.pi


@pytest.mark.parametrize(
    ("gait", "order", "factors", "words"),
    [
        (G2, [0, 1, 2, 3], [1, 1, -1, 1], "the other sign of alpha3"),
        (G3, [0, 1, 2, 3], [1, 1, -1, -1], "the other sign of alpha3 and alpha4"),
        (G4, [0, 2, 1, 3], [1, 1, 1, 1], "alpha2 and alpha3 exchanged"),
        (G3, [0, 1, 3, 2], [1, 1, -1, 1], "exchanged, then the other sign of alpha4"),
        (G4, [0, 1, 2, 3], [1, 1, DEGREES, DEGREES], "(alpha3_deg, alpha4_deg)"),
    ],
)
def test_another_convention_that_puts_all_rows_on_a_sheet_is_named(
    gait: PublishedGait, order: list[int], factors: list[float], words: str
) -> None:
    report = validate(table_from(sampled(gait).alpha[:, order] * factors))
    message = report["on_surface"].message
    assert f"all rows would lie on {gait.color} with " in message
    assert message.endswith(words)
    first, *others = [check.follows_from for check in report.checks if not check.ok]
    assert first is None
    assert set(others) == {"on_surface"}


def test_a_coincidence_is_no_convention() -> None:
    rows = sampled(G3).alpha * [1, 1, -1, 1]
    rows[20, 3] += 0.01  # all rows but one
    # Along the diagonal a biased gait lies on red with two exchanged and two signs turned.
    s = np.linspace(-0.4, 0.9, 14)
    line = np.column_stack([s, -s, 0.8 * s, -0.8 * s])
    for table in (table_from(rows), table_from(line)):
        assert "would lie" not in validate(table)["on_surface"].message


@pytest.mark.parametrize(
    ("offset", "words"),
    [
        ([0, 0, 3, 0], "α3 by 3.03° and α4 by 0.00°"),
        ([0, 1, 0, -4], "α3 by 0.03° and α4 by -5.00°"),
    ],
)
def test_a_constant_offset_is_told_in_degrees(offset: list[int], words: str) -> None:
    """In the middle of its range: here the first row has 0.06° more."""
    rows = sampled(G3).alpha + np.radians(offset)
    rows[0, 2] += 1e-3
    told = f"all rows are off red by the same angles, {words}"
    assert told in validate(table_from(rows))["on_surface"].message
    noise = np.random.default_rng(5).normal(0, 0.02, rows.shape)
    for other in (rows + noise, rows[:1]):
        message = validate(table_from(other))["on_surface"].message
        assert "by the same angles" not in message


@pytest.mark.parametrize("row", [0, 31, 63])
@pytest.mark.parametrize("ends", [64, 65])
@pytest.mark.parametrize("on_red", [True, False])
def test_a_single_row_far_from_its_neighbours_is_named(
    row: int, ends: int, on_red: bool
) -> None:
    table = sampled(G3, law="constant-speed")
    alpha = table.alpha.copy()
    alpha[row, [0, 2] if on_red else [2]] -= 0.25
    alpha[-1] = alpha[0]
    bent = table_from(alpha[:ends], t=table["t"][:ends])
    report = validate(bent, vehicle=limited(6.0, 150.0))
    first, *others = [check for check in report.checks if not check.ok]
    assert first.name == ("tilt_rate" if on_red else "on_surface")
    apart = np.abs(alpha[(row - 1) % 64] - alpha[(row + 1) % 64]).max()
    assert f"row {row + 1} alone is 0.2" in first.message
    assert f"which are {apart:.3g} rad apart" in first.message
    assert {check.follows_from for check in others} == {first.name}
    assert not [note for note in report.notes if "alone" in note]
    if on_red:  # where no rule is broken by it, it is a warning
        notes = validate(bent).notes
        assert any(f"row {row + 1} alone is 0.2" in note for note in notes)


TIP = [(0.4, -0.4), (0.8, -0.4)]


@pytest.mark.parametrize("law", ["smooth", "constant-speed", "equal-time"])
@pytest.mark.parametrize("points", [TIP, *(gait.angles for gait in GAITS)])
def test_no_row_of_a_planned_gait_is_far_from_its_neighbours(
    points: Any, law: Any
) -> None:
    color = "blue" if points in (G1.angles, G2.angles) else "red"
    for samples in (11, 40):
        rows = lift(points, color).parametrize(samples=samples, law=law).alpha
        assert validate(table_from(rows), vehicle=STRONG).notes == ()


# How a table closes


@pytest.mark.parametrize("rows", [40, 41])
def test_the_segment_that_closes_a_table_is_judged_too(rows: int) -> None:
    table = sampled(G3, 40, law="constant-speed")
    report = validate(rows_of(table, 0, rows), vehicle=STRONG)
    step = np.abs(table.alpha[0] - table.alpha[rows - 1]).max()
    assert (report.flyable, report.notes) == (True, ())
    assert report["closed"].value == pytest.approx(step)
    assert (report["closed"].where or {})["row"] == rows
    assert ("back to row 1 is judged too" in report["closed"].message) is (rows == 40)


@pytest.mark.parametrize(("end", "noted"), [(0.8, False), (0.805, True)])
def test_a_closing_segment_of_more_than_three_steps_is_suspicious(
    end: float, noted: bool
) -> None:
    points = [(first, -0.9) for first in (0.5, 0.6, 0.7, 0.8, end)]
    told = str(validate(table_from(lift(points, "red").alpha)).warnings)
    assert ("the end of the table missing" in told) is noted


# Rates: a cosine of amplitude 0.2 and period 2 s, with peaks 0.2π rad/s and 0.2π² rad/s²

RATE, ACCELERATION = 0.2 * math.pi, 0.2 * math.pi**2


def swing(n: int = 400, start: float = 0.0, **columns: Any) -> Table:
    t = np.linspace(0, 2, n + 1)
    angle = 0.9 + 0.2 * np.cos(np.pi * t)
    return table_from(np.column_stack([angle, -angle] * 2), t=t + start, **columns)


def limited(rate: float, acceleration: float) -> gg.Vehicle:
    return gg.PAPER.replace(max_tilt_rate=rate, max_tilt_acceleration=acceleration)


def test_broken_limits_name_the_time_needed() -> None:
    """Rates scale with the time, accelerations with its square; times count from anywhere."""
    vehicle = limited(RATE / 4, ACCELERATION / 9)
    rate, acceleration = validate(swing(start=5.0), vehicle=vehicle).checks[-2:]
    where = rate.where or {}
    assert where["t"] == pytest.approx(5.0 + (where["row"] - 1) / 200)
    assert rate.message.endswith(": take at least 8 s instead of 2 s")
    assert acceleration.message.endswith(": take at least 6 s instead of 2 s")


@pytest.mark.parametrize(
    "cut", [1, *range(110, 116)]
)  # among them the kick at the seam
@pytest.mark.parametrize("rows", [120, 121])
def test_a_kick_of_one_row_has_the_same_peaks_wherever_the_table_begins(
    cut: int, rows: int
) -> None:
    table = swing(120)
    alpha = table.alpha[:-1].copy()
    alpha[7] += 0.01
    peaks = []
    for shift in (0, cut):
        turned = np.roll(alpha, shift, axis=0)
        turned = np.vstack([turned, turned[:1]])[:rows]
        report = validate(
            table_from(turned, t=table["t"][:rows]), vehicle=limited(9.0, 1.0)
        )
        where = report["tilt_acceleration"].where or {}
        assert where["row"] % 120 == (8 + shift) % 120
        assert where["t"] == table["t"][where["row"] - 1]
        peaks.append([check.value for check in report.checks[-2:]])
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-6)


def test_stated_accelerations_count_if_they_are_larger() -> None:
    stated: dict[str, Any] = {f"{name}_acceleration": np.zeros(401) for name in ANGLES}
    stated["alpha3_acceleration"][7] = -50.0
    check = validate(swing(**stated), vehicle=limited(9.0, 40.0))["tilt_acceleration"]
    assert (check.ok, (check.where or {})["row"]) == (False, 8)
    assert check.value == pytest.approx(50.0, rel=0.02)  # but for its digits
    assert "(α3)" in check.message


@pytest.mark.parametrize("seed", range(8))
def test_the_joint_nearest_to_its_own_limit_of_rate_is_named(seed: int) -> None:
    size, *limits = np.random.default_rng(seed).uniform(0.5, 1.5, (4, 4))
    t = np.linspace(0, 2, 401)
    table = table_from(np.outer(np.cos(np.pi * t), size), t=t)
    names = ["tilt_rate", "tilt_acceleration", "tilt_jerk"]
    four = zip(names, np.array(limits).tolist(), strict=True)
    vehicle = gg.PAPER.replace(**{f"max_{name}": limit for name, limit in four})
    report = validate(table, vehicle=vehicle)
    for order, name in enumerate(names, start=1):
        joint = (size / limits[order - 1]).argmax()
        assert report[name].limit == limits[order - 1][joint]
        peak = size[joint] * np.pi**order
        assert report[name].value == pytest.approx(peak, rel=1e-3)


def test_digits_of_rates_between_uneven_times_make_no_acceleration() -> None:
    t = np.cumsum([0.0, *[0.01, 0.01, 0.08] * 20])
    angle = 0.9 + 0.2 * np.cos(np.pi * t)
    rate = np.round(-RATE * np.sin(np.pi * t), 1)
    rates = dict.fromkeys(RATES, rate)
    table = replace(
        table_from(np.column_stack([angle] * 4), t=t, **rates),
        digits=dict.fromkeys(RATES, Digits(decimals=1)),
    )
    needed = validate(table)["tilt_acceleration"].value
    assert needed == pytest.approx(ACCELERATION, rel=0.01)


def test_a_stated_period_beside_that_of_the_times_does_not_slow_the_rows() -> None:
    angle = 0.9 + 0.2 * np.cos(np.pi * np.arange(11) / 5)
    table = replace(
        table_from(np.column_stack([angle] * 4), t=np.arange(11.0)),
        digits={"t": Digits(decimals=0)},
        about={"samples": 10, "period": 10.4},
    )
    rate = validate(table)["tilt_rate"].value
    assert rate == pytest.approx(np.abs(np.diff(angle)).max())


def test_digits_of_rates_at_the_ends_of_a_path_make_no_acceleration() -> None:
    """A rate of 0.05 everywhere, rounded to 0 or 0.1."""
    t = np.arange(4) / 100
    rates = dict.fromkeys(RATES, np.array([0.0, 0.1, 0.0, 0.1]))
    table = replace(
        table_from(np.column_stack([0.9 + 0.05 * t] * 4), t=t, **rates),
        digits=dict.fromkeys(RATES, Digits(decimals=1)),
        about={"repeats": False},
    )
    assert validate(table)["tilt_acceleration"].value == pytest.approx(0, abs=1e-9)


def test_two_rows_swing_to_and_fro() -> None:
    """Out in 1 s and back in one mean step: the rate turns from 0.5 to −0.5 rad/s within 1 s, at both ends."""
    rows = lift([(0.4, -0.4), (0.9, -0.9)], "red").alpha
    for count in (2, 3):
        table = table_from(np.vstack([rows, rows])[:count], t=[2, 3, 4][:count])
        rate, acceleration = validate(table, vehicle=limited(9.0, 9.0)).checks[-2:]
        assert (rate.value, acceleration.value) == pytest.approx((0.5, 1.0))
        assert (rate.where or {})["row"] == 1


@pytest.mark.parametrize(("limit", "ok"), [(1e9, True), (1.0, False)])
def test_a_table_of_a_cubic_has_its_jerk(limit: float, ok: bool) -> None:
    """Third divided differences of a cubic are its third derivative, whatever the times."""
    t = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.65, 0.8])
    alpha = -0.6 + 0.05 * t + 0.3 * t**3
    table = table_from(np.column_stack([alpha, 0.5 + 0 * t] * 2), t=t)
    check = validate(table, vehicle=gg.PAPER.replace(max_tilt_jerk=limit))["tilt_jerk"]
    assert check.ok is ok
    assert (check.value or 0.0) >= 6 * 0.3 * (1 - 1e-9)


# What a table states


@pytest.mark.parametrize("sign", [1, -1])
def test_wrong_types_and_R_are_reported_beyond_one_percent(sign: int) -> None:
    table = sampled(G4, 50)
    types = list(table["types"])
    types[9] = "(-,?)"
    allowed = 0.01 * sign * np.maximum(1, np.abs(table["R"]))
    stated = table["R"] + 0.99 * allowed
    stated[26] += 0.02 * allowed[26]
    columns = {**table.columns, "types": tuple(types), "R": stated}
    report = validate(Table(columns=columns), vehicle=STRONG)
    assert report.valid
    of_types, of_R = report.warnings
    assert "row 10 states the types (-,?), but it is red" in of_types
    assert f"row 27 states R = {stated[26]:.4g}, but R is {table['R'][26]:.4g}" in of_R


def test_colourings_are_of_loops_in_the_square_and_of_long_tables_a_number() -> None:
    side = Gait(alpha=[[math.pi / 2, 0.3, math.pi / 2, 0.3]], colors=("red",))
    assert validate(side).listing is not None
    beyond = Gait(alpha=[[0.3, -math.pi / 2 - 1e-6, 0.3, 0.3]], colors=("red",))
    assert validate(beyond).listing is None
    opposite = Gait(alpha=[[0.3, -0.3, 2.0, -0.3]], colors=("red",))
    assert validate(opposite).listing is not None
    many = np.tile(lift(G3.angles, "red").alpha, (MOST_LISTED_ROWS // 4 + 1, 1))
    listing = validate(table_from(many)).listing
    assert listing is not None
    assert (listing.count, listing.first) == (2, ())
