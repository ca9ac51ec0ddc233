"""What a table states of its rows is checked once, number by number; verdicts hold for both; proofs are held against rows."""

from __future__ import annotations

import csv
import json
import math
import re
import subprocess
import sys
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import gaitgraph as gg
from gaitgraph.certificates import check, verify
from gaitgraph.errors import FileWarning, Infeasible
from gaitgraph.gait.digits import Digits, digits_of
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table
from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value
from gaitgraph.io.formats import write_tables
from gaitgraph.timing.laws import LAWS
from gaitgraph.timing.timed_gait import table_of

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.invertibility.forms import FloatArray

FAST = gg.Vehicle(
    name="fast", mass=1.6, arm_length=0.24, drag_to_thrust=0.018, max_tilt="75deg"
)
CORNERS = [(-0.2, 0.3), (-0.2, -0.07), (-0.9, -0.07), (-0.9, 0.3)]
TRIANGLE = [(-0.3, 0.3), (-0.3, 0.9), (-0.9, 0.9)]
NUMBERS = ("t", *ANGLES, *RATES, *ACCELERATIONS)
FORMATS = [".csv", ".json", ".npz", ".mat", ".parquet"]


def given_table(gait: Any) -> Table:
    table = given_gait(gait).table
    assert table is not None
    return table


def rounded(table: Table, angles: int, times: int = 17) -> Table:
    """Return a table whose angles, rates and accelerations, and times, are printed with some decimals."""
    columns = dict(table.columns)
    for name in NUMBERS:
        columns[name] = np.round(table[name], times if name == "t" else angles)
    return Table(columns=columns, about=table.about)


def edited(table: Table, name: str, row: int, value: float) -> Table:
    column = table[name].copy()
    column[row] = value
    return Table(columns={**table.columns, name: column}, about=table.about)


def random_gait(random: np.random.Generator, vehicle: Any = gg.PAPER) -> gg.Gait:
    """Return a small loop around a point of hover's component."""
    centre = random.uniform((-0.8, 0.3), (-0.3, 0.8))
    points = centre + random.uniform(-0.25, 0.25, (random.integers(2, 6), 2))
    return gg.lift(points, "red", vehicle=vehicle)


def read_in(path: Path, table: Table) -> tuple[Table, list[str]]:
    """Return a table written and read again, and the warnings."""
    write_tables(table, [path], force=True)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FileWarning)
        found = gg.read_table(path)
    return found, [str(one.message) for one in caught]


@pytest.mark.parametrize("decimals", range(1, 10))
def test_digits_are_those_that_numbers_were_printed_with(decimals: int) -> None:
    random = np.random.default_rng(decimals)
    values = random.uniform(-2, 2, 300).round(decimals)
    assert digits_of(values).decimals == decimals
    half_units = digits_of(values).half_units(values)
    np.testing.assert_allclose(half_units, 0.5 * 10.0**-decimals)
    counted = np.array(
        [float(f"{value:.{decimals}g}") for value in random.uniform(1, 200, 500)]
    )
    after_point = np.maximum(decimals - 1 - np.floor(np.log10(counted)), 0)
    half_units = digits_of(counted).half_units(counted)
    np.testing.assert_allclose(half_units, 0.5 * 10.0**-after_point)
    assert digits_of(random.uniform(-2, 2, 50)) == Digits()


@pytest.mark.parametrize(
    ("values", "decimals"),
    [
        ([0.5] * 5000 + [0.123], 3),  # a row that no sample may miss
        ([0.06, 0.06, 0.1], 2),  # a number that ends in zeros
        # The multiple by a power of ten is no float; it is refused as an angle later.
        ([0.4, 0.71e308], 1),
        ([0.71e308, 0.125, -1e300], 3),
    ],
)
def test_digits_of_a_column_with_an_odd_number(
    values: list[float], decimals: int
) -> None:
    assert digits_of(np.array(values)).decimals == decimals


STATED = [*LAWS, "least", "rounded", "path"]


@pytest.mark.parametrize("law", STATED)
def test_unedited_tables_are_what_they_state(law: Any, tmp_path: Path) -> None:
    random = np.random.default_rng(len(law) + 40)
    gait = random_gait(random)
    period = float(10 ** random.uniform(-2, 1))
    samples = int(random.integers(20, 150))
    timed: Any
    if law in LAWS:
        timed = gait.parametrize(period, law=law, samples=samples)
    elif law == "path":
        timed = gg.transition("hover", gait, samples=samples).timed
    else:
        limits = gg.Limits(rate=6.0, acceleration=150.0)
        rounding = 0.05 if law == "rounded" else None
        gait = gg.lift([*gait.alpha[:, :2], (-0.9, 0.9)], "red")
        if len(gait.vertices()) < 3:  # pace makes a curve of a loop that turns back
            gait = gg.lift(TRIANGLE, "red")
        timed = gg.least_period(gait, limits, rounding=rounding, samples=samples).timed
    table = table_of(timed)
    for angles, times in ((17, 17), (9, 12), (5, 7), (3, 6), (2, 17)):
        if not (np.diff(table["t"].round(times)) > 1e-8).all():
            continue
        found, said = read_in(tmp_path / "a.csv", rounded(table, angles, times))
        assert not said
        assert found.motion is not None
        at = np.linspace(0, timed.period, 500)
        np.testing.assert_allclose(
            found.motion.at(at).alpha, timed.at(at).alpha, atol=1e-9
        )


@pytest.mark.parametrize("suffix", FORMATS)
def test_one_number_that_differs_drops_the_statement(
    suffix: str, tmp_path: Path
) -> None:
    random = np.random.default_rng(len(suffix))
    for _ in range(5):
        timed = random_gait(random).parametrize(
            float(10 ** random.uniform(-2, 1)), samples=int(random.integers(10, 60))
        )
        decimals = int(random.integers(2, 10))
        table = rounded(table_of(timed), decimals)
        name = str(random.choice(NUMBERS[1:]))
        row = int(random.integers(0, len(table)))
        unit = 10.0**-decimals * random.choice([-2.0, 2.0])
        value = round(float(table[name][row]) + unit, decimals)
        found, said = read_in(tmp_path / f"a{suffix}", edited(table, name, row, value))
        assert found.motion is None
        assert len(said) == 1
        assert f"row {row + 1} has {name}" in said[0]
        assert found.notes == (said[0].split(": ", 1)[1],)
        assert set(found.about) <= {"vehicle", "coefficients", "crossing_tolerance"}
        assert set(found.columns) == {"t", *ANGLES}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileWarning)
            report = gg.validate(tmp_path / f"a{suffix}")
        assert found.notes[0] in report.as_mapping()["warnings"]
        assert found.notes[0] not in str(report)  # it was said when the file was read


@pytest.mark.parametrize("suffix", [".csv", ".json"])
@pytest.mark.parametrize(
    ("edit", "said"),
    [
        ({"R": 1e-3}, "row 5 has R = "),
        ({"types": "(-,-)"}, "row 5 has the types"),
        ({"waypoints": [(-0.3, 0.5)]}, "passes 0.1 rad from waypoint 1"),
        ({"waypoints": [("x", 0)]}, "the stated request is wrong: waypoints"),
        ({"period": 2.0}, "the stated request has period = 2.0, the stated motion"),
        ({"law": "equal-time"}, "the stated request has law = 'equal-time'"),
        ({"thrust2": 1e-3}, "row 5 has thrust2 = "),
        ({"vehicle": "padova"}, "the stated request has vehicle = 'padova'"),
        ({"color": "blue"}, "has the color 'blue', the stated motion has red"),
        ({"sign": "negative"}, "has the sign 'negative', which R"),
        (
            {"keep_out": [[(-0.5, 0.6), (-0.3, 0.6), (-0.3, 0.8)]]},
            "leaves the polygons",
        ),
    ],
)
def test_what_follows_from_the_motion_is_compared_with_it(
    edit: dict[str, Any], said: str, suffix: str, tmp_path: Path
) -> None:
    planned = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]
    table = table_of(gg.plan_loop(planned).timed(samples=20))
    columns = dict(table.columns)
    request = dict(table.about["request"])
    for name, value in edit.items():
        if name in ("R", "thrust2"):
            columns[name] = columns[name] + value * (np.arange(21) == 4)
        elif name == "types":
            columns[name] = [*columns[name][:4], value, *columns[name][5:]]
        else:
            request[name] = value
    wrong = Table(columns=columns, about=table.about | {"request": request})
    found, notes = read_in(tmp_path / f"a{suffix}", wrong)
    assert len(notes) == 1
    assert said in notes[0]
    assert found.motion is None
    assert set(found.columns) == {"t", *ANGLES}


@pytest.mark.parametrize("limits", ["fast", {"rate": "5"}, {"rate": [1, 1, 1, -1]}])
def test_limits_that_are_none_are_refused(limits: Any, tmp_path: Path) -> None:
    """Which limits a table was made for cannot be seen from its rows."""
    table = table_of(gg.lift(TRIANGLE, "red").parametrize(0.8))
    with pytest.raises(gg.InputError, match="limits"):
        read_in(
            tmp_path / "a.json", replace(table, about=table.about | {"limits": limits})
        )


def without(table: Table, rows: Any) -> Table:
    keep = np.delete(np.arange(len(table)), rows)
    columns = {
        name: values[keep]
        if isinstance(values, np.ndarray)
        else tuple(values[k] for k in keep)
        for name, values in table.columns.items()
    }
    return replace(table, columns=columns)


def test_rows_that_are_missing_or_out_of_order_drop_the_statement(
    tmp_path: Path,
) -> None:
    limits = gg.Limits(rate=6.0, acceleration=150.0)
    gait = gg.lift(TRIANGLE, "red")
    for rounding in (None, 0.05):
        timed: Any = gg.least_period(gait, limits, rounding=rounding, samples=100).timed
        table = table_of(timed)
        three = [k for k in range(101) if k not in (0, 50, 100)]
        for rows, said in ((three, "row 2 is at"), (range(30, 70), "row 31 is at")):
            _, notes = read_in(tmp_path / "a.csv", without(table, list(rows)))
            assert len(notes) == 1
            assert said in notes[0]
        _, notes = read_in(tmp_path / "a.csv", without(table, [100]))
        assert "row 101 is missing" in notes[0]
        order = np.arange(101)
        order[10:40] = np.random.default_rng(1).permutation(order[10:40])
        angles = {name: table[name][order] for name in ANGLES}
        shuffled = replace(table, columns={**table.columns, **angles})
        found, notes = read_in(tmp_path / "a.csv", shuffled)
        assert len(notes) == 1
        assert found.motion is None
        assert len(gg.gait_of(found).alpha) > 20  # the rows, not the stated corners


def test_the_line_with_what_made_a_csv_file_is_not_lost_silently(
    tmp_path: Path,
) -> None:
    """Without it another vehicle, or none of its limits, would be judged."""
    timed = gg.lift(CORNERS, "red", vehicle=FAST).parametrize(1.0, samples=60)
    path, cut = tmp_path / "a.csv", tmp_path / "cut.csv"
    timed.write(path)
    head, *lines = path.read_text().splitlines(keepends=True)
    cut.write_text("".join([head, *lines[1:]]))
    with pytest.raises(gg.InputError, match="the row is missing whose text in made_by"):
        gg.read_table(cut)
    pandas = pytest.importorskip("pandas", reason="install pandas")
    with pytest.raises(gg.InputError, match="the row is missing whose text in made_by"):
        gg.validate(pandas.read_csv(cut))
    cut.write_text("".join([head, *lines[::-1]]))  # reversed, as a sheet is sorted
    with pytest.raises(gg.InputError, match="t must be"):
        gg.read_table(cut)
    cut.write_text("".join([head, lines[0], *lines[10:]]))
    with (
        pytest.warns(FileWarning, match="row 2 is at"),
        pytest.warns(FileWarning, match="10 times the median step"),
    ):
        assert gg.read_table(cut).about["vehicle"]["name"] == "fast"


def test_edited_rows_of_a_fast_gait_are_not_flyable(tmp_path: Path, run: Any) -> None:
    """Half a digit of the angles is no error of time: three decimals at T = 0.1 s hid 0.016 rad."""
    plan = gg.plan_loop(CORNERS, sign="positive", vehicle=FAST)
    table = rounded(table_of(plan.gait.parametrize(0.1)), 3)
    columns = dict(table.columns)
    for name in ("alpha2", "alpha4"):
        columns[name] = np.where(columns[name] == -0.07, -0.086, columns[name])
    write_tables(Table(columns=columns, about=table.about), [tmp_path / "fast.csv"])
    for command in ("validate fast.csv", "certify fast.csv", "export fast.csv a.csv"):
        done = run(*command.split())
        assert done.code == 1
        assert "has alpha2 = -0.086" in done.err
    assert not (tmp_path / "a.csv").exists()


def test_rates_that_do_not_fit_the_rows_are_dropped(tmp_path: Path) -> None:
    timed = gg.lift(TRIANGLE, "red").parametrize(0.8)
    table = table_of(timed)
    bare = {name: table[name] for name in NUMBERS}
    for factor, fits in ((1.0, True), (57.3, False), (-1.0, False)):
        columns = bare | {name: factor * table[name] for name in RATES}
        stated = Table(columns=columns)
        if fits:
            assert RATES[0] in read_in(tmp_path / "a.json", stated)[0]
            continue
        found, said = read_in(tmp_path / "a.json", stated)
        assert "stated rates and accelerations are not used" in said[0]
        assert RATES[0] not in found
        # The same in a file that states its motion: everything is computed from the rows.
        found, said = read_in(tmp_path / "a.json", replace(table, columns=columns))
        assert "the stated motion has" in said[0]
        gg.export(found, [tmp_path / "a.h"], force=True)
        assert "cubic" not in (tmp_path / "a.h").read_text()


@pytest.mark.filterwarnings("error::gaitgraph.errors.FileWarning")
def test_rates_of_smooth_optimized_and_entered_gaits_fit_their_rows(
    tmp_path: Path,
) -> None:
    random = np.random.default_rng(8)
    for samples in random.integers(4, 200, 20).tolist():
        timed = random_gait(random).parametrize(1.0, samples=samples)
        bare = Table(columns={name: timed.columns[name] for name in NUMBERS})
        assert RATES[0] in given_table(bare)
    # The angles swing between rows, so that a rate may lie outside the slopes beside it.
    optimal: Any = gg.optimal_gait([(-1.0, 0.5), (-0.8, 1.1), (-0.5, 0.6)])
    optimal.timed().write(tmp_path / "a.csv")
    assert RATES[0] in gg.read_table(tmp_path / "a.csv")
    # Beyond its last row nothing is known: the rate there may have another sign than the slope before it.
    first = [optimal.timed().columns[name][0] for name in RATES]
    for samples in (30, 57, 400):
        entry = gg.transition("hover", optimal, samples=samples)
        entry.write(tmp_path / "a.csv", force=True)
        table = gg.read_table(tmp_path / "a.csv")
        np.testing.assert_allclose([table[name][-1] for name in RATES], first)


def test_a_row_beyond_the_digits_of_its_column_is_found() -> None:
    corners = [(0.063, 0.31), (0.063, 0.46), (0.063, 0.98)]
    table = rounded(table_of(gg.lift(corners, "red").parametrize(2.5)), 2)
    assert given_gait(table).motion is not None
    with pytest.warns(FileWarning, match="row 41 has alpha3 = 0.1"):
        assert given_gait(edited(table, "alpha3", 40, 0.1)).motion is None


def test_late_times_of_a_clock_that_started_long_ago_are_found() -> None:
    table = table_of(gg.lift(CORNERS, "red").parametrize(1.0, samples=100))
    columns = {**table.columns, "t": table["t"] + 9e8}
    since_epoch = Table(columns=columns, about=table.about)
    assert given_gait(since_epoch).motion is not None
    with pytest.warns(FileWarning, match=r"row 31 is at t = 900000000\.303"):
        found = given_gait(edited(since_epoch, "t", 30, 9e8 + 0.303))
    assert found.motion is None


def test_times_are_those_of_the_statement_to_half_a_unit(tmp_path: Path) -> None:
    timed = gg.lift(CORNERS, "red", vehicle=FAST).parametrize(1.0, samples=50)
    certificate, path = tmp_path / "g.cert.json", tmp_path / "a.csv"
    gg.certify(timed).write(certificate)
    table = table_of(timed)
    shifted = replace(table, columns={**table.columns, "t": table["t"] + 0.3})
    shifted = rounded(shifted, 17, 2)
    assert read_in(path, shifted)[0].motion is not None
    assert not verify(certificate, path).off
    for unit in (0.01, -0.01):  # half of a step
        late = edited(shifted, "t", 7, round(float(shifted["t"][7]) + unit, 2))
        found, said = read_in(path, late)
        assert found.motion is None
        assert "row 8" in said[0]
        text = certificate.read_text()
        assert check.held_against(text, *check.rows_of_csv(path))[0]


def test_a_time_halfway_between_two_digits_is_the_stated_one(tmp_path: Path) -> None:
    timed = gg.lift(CORNERS, "red", vehicle=FAST).parametrize(1.0, samples=4)
    coarse = rounded(table_of(timed), 17, 1)
    assert coarse["t"].tolist() == [0.0, 0.2, 0.5, 0.8, 1.0]  # 0.25 is 0.2 to a tenth
    assert read_in(tmp_path / "a.csv", coarse)[0].motion is not None


def test_a_gait_that_reaches_a_limit_is_flyable_as_a_table(tmp_path: Path) -> None:
    """A corner at the limit between two rows, which the cubics pass by some 1e-6 rad."""
    vehicle = FAST.replace(max_tilt="50deg")
    plan = gg.plan_loop(
        [(-0.2, 0.3), ("-50deg", 0.35), (-0.6, 0.8)], vehicle=vehicle, sign="positive"
    )
    plan.timed().write(tmp_path / "a.csv")
    assert gg.validate(tmp_path / "a.csv").flyable
    bare = Table(columns=gg.read_table(tmp_path / "a.csv").columns)
    report = gg.validate(
        bare, vehicle=vehicle
    )  # without the motion they are all there is
    assert not report["tilt_range"].ok


def test_rows_that_are_lifted_may_state_rates(tmp_path: Path) -> None:
    zeros = dict.fromkeys(RATES, np.zeros(3))
    columns = {
        "t": [0.0, 1.0, 2.0],
        "alpha1": [-0.3, -0.3, -0.6],
        "alpha2": [0.3, 0.6, 0.6],
    }
    frame = {**columns, "color": "red", **zeros}
    assert gg.validate(frame).flyable
    assert gg.retarget(frame)
    with pytest.raises(Infeasible, match="cubics through their rates"):
        gg.certify(frame)
    assert gg.certify({**columns, "color": "red"})
    wrong = gg.validate({**frame, "R": [9.0, 9.0, 9.0]})
    assert any("row 1 states R = 9" in one for one in wrong.warnings)


def test_rows_that_are_lifted_are_joined_through_their_rates() -> None:
    # Joined through these rates alpha1 passes hover's border, atan(kappa), between rows.
    border = math.atan(gg.PAPER.signed_drag_ratio)
    columns: dict[str, Any] = {
        "t": np.arange(3.0),
        "alpha1": np.array([-0.6, border - 0.01, -0.6]),
        "alpha2": np.array([0.3, 0.4, 0.3]),
        "color": ("red",) * 3,
    }
    assert gg.validate(columns).flyable
    columns |= dict.fromkeys(RATES, np.zeros(3))
    rate = np.array([0.0, 0.5, 0.0])
    fitting = columns | {"alpha1_rate": rate, "alpha3_rate": rate}
    four = fitting | {"alpha3": columns["alpha1"], "alpha4": columns["alpha2"]}
    assert not gg.validate(four).flyable
    assert not gg.validate(fitting).flyable
    with pytest.warns(FileWarning, match="row 2 states alpha3_rate = 50"):
        found = given_table(fitting | {"alpha3_rate": 100 * rate})
    assert RATES[0] not in found
    stated = {"corners": CORNERS, "law": "smooth", "period": 2.0, "samples": 2}
    with pytest.warns(FileWarning, match="not all angles"):
        found = given_table(Table(columns=fitting, about=stated))
    assert RATES[0] not in found
    assert "color" in found


def test_coarse_times_beside_rates_alone_break_no_limit() -> None:
    timed = gg.lift(CORNERS, "red").parametrize(2.2089, samples=180)
    peak = float(timed.peaks(2).max())
    limited = gg.PAPER.replace(max_tilt_acceleration=peak * 1.001)
    gait = gg.lift(CORNERS, "red", vehicle=limited)
    table = rounded(table_of(gait.parametrize(2.2089, samples=180)), 4, 2)
    columns = {
        name: one for name, one in table.columns.items() if name not in ACCELERATIONS
    }
    alone = Table(columns=columns, about=table.about)
    assert given_gait(alone).motion is not None
    assert gg.validate(alone).flyable


def test_determinants_beside_rounded_angles_are_those_of_the_rows() -> None:
    table = table_of(
        gg.lift([(-0.3, 0.3), (-0.3, 1.3), (-1.3, 1.3)], "red").parametrize(0.8)
    )
    columns = {name: table[name].round(1) for name in ANGLES}
    coarse = Table(columns={"t": table["t"], "R": table["R"], **columns})
    assert not any("states R" in one for one in gg.validate(coarse).warnings)
    wrong = edited(coarse, "R", 40, 2.0 + 1.5 * float(table["R"][40]))
    assert any("row 41 states R" in one for one in gg.validate(wrong).warnings)


def test_slopes_between_rounded_angles_are_named_as_that(tmp_path: Path) -> None:
    limits = gg.Limits(rate=6, acceleration=150)
    paced: Any = gg.least_period(gg.lift(CORNERS, "red"), limits, samples=200).timed
    found, said = read_in(tmp_path / "a.csv", rounded(table_of(paced), 2))
    check = gg.validate(found)["tilt_rate"]
    assert (said, check.ok) == ([], False)
    assert "write them with more decimals" in check.message
    # Here the rates break the limit, no slope does.
    rates = {name: 1.2 * paced.columns[name] for name in RATES}
    stated = Table(columns={**paced.columns, **rates}, about={"limits": {"rate": 6.0}})
    message = gg.validate(stated)["tilt_rate"].message
    assert "peak 7.2" in message
    assert "decimals" not in message


@pytest.mark.parametrize("samples", [9, 25, 59])
@pytest.mark.parametrize(("swing", "ok"), [(0.9, True), (1.1, False)])
def test_cubics_that_leave_their_segments_along_them_are_judged(
    samples: int, swing: float, ok: bool
) -> None:
    corners = [(-0.3, 0.3), (-0.9, 0.4), (-0.5, 1 / 3)]  # out and back on a line
    timed = gg.lift(corners, "red", vehicle=FAST).parametrize(samples=samples)
    spline = CubicHermiteSpline(timed.t, timed.alpha, timed.rates)
    dense = spline(np.linspace(0, timed.period, 20_001))
    most = np.abs(timed.gait.alpha).max()
    beyond = np.abs(dense).max() - most
    assert beyond > 1e-5
    vehicle = FAST.replace(max_tilt=float(most + beyond / swing))
    bare = Table(columns=timed.columns)
    assert gg.validate(bare, vehicle=vehicle).flyable == ok


def test_cubics_across_their_segments_are_judged() -> None:
    """Rows on one line whose cubics swing out of it to where thrusts are smaller."""
    t = np.arange(5) * 1.0
    alpha = np.array([[-0.4, -0.5, -0.6, -0.5, -0.4], [0.3] * 5])
    rates = 0.1 * np.array([[0] * 5, [0, -0.75, 0.75, -0.75, 0]])
    columns = {"t": t, **dict(zip(ANGLES, [*alpha, *alpha], strict=True))}
    straight = gg.validate(columns)["hover_thrust"].value
    columns |= dict(zip(RATES, [*rates, *rates], strict=True))
    columns |= dict.fromkeys(ACCELERATIONS, np.full(5, 0.01))
    least = gg.validate(Table(columns=columns))["hover_thrust"].value
    dense = CubicHermiteSpline(t, alpha.T, rates.T)(np.linspace(0, 4, 8001))
    expected = hover_thrust_shares(np.hstack([dense, dense]), gg.PAPER).min()
    assert least == pytest.approx(expected, abs=1e-3)
    assert straight is not None
    assert expected < straight - 1e-3


@pytest.mark.parametrize("name", ["tilt_range", "tilt_rate"])
def test_a_value_and_the_limit_that_it_breaks_are_told_apart(name: str) -> None:
    corners = [(-0.2, 0.3), (-0.2, 0.6), (-0.5, 0.6)]
    peak = float(gg.lift(corners, "red").parametrize(1.0).peak_rates.max())
    limits = {"tilt_range": {"max_tilt": 0.6}, "tilt_rate": {"max_tilt_rate": peak}}
    stated: Any = {key: one * (1 - 1e-6) for key, one in limits[name].items()}
    gait = gg.lift(corners, "red", vehicle=gg.PAPER.replace(**stated))
    message = gg.validate(gait.parametrize(1.0))[name].message
    size, limit = re.findall(r"(?:tilt|peak|limit) ([\d.]+)", message)[:2]
    assert float(size) > float(limit)


def test_a_stated_error_of_angles_raises_no_limit(tmp_path: Path) -> None:
    vehicle = FAST.replace(max_tilt_rate=2.0)
    timed = gg.lift(CORNERS[:3], "red", vehicle=vehicle).parametrize(1.0, samples=60)
    timed.write(tmp_path / "a.json")
    file = json.loads((tmp_path / "a.json").read_text())
    for name in ("corners", "law", "period", "samples"):
        del file["about"][name]
    for stated in (0.0, 0.1, 1e9):
        file["about"]["angle_rounding"] = stated
        (tmp_path / "a.json").write_text(json.dumps(file))
        assert not gg.validate(tmp_path / "a.json")["tilt_rate"].ok


def dense_check(report: gg.Report, table: Table, vehicle: gg.Vehicle) -> None:
    """Assert that nothing is called flyable where rows as they are joined break a condition."""
    if not report.flyable:
        return
    alpha = table.alpha
    closed = np.vstack([alpha, alpha[:1]])
    share = np.linspace(0, 1, 41)[:, None, None]
    dense = (closed[:-1] + share * np.diff(closed, axis=0)).reshape(-1, 4)
    assert least_singular_value(dense, vehicle).min() >= 0.05 - 1e-9
    assert hover_thrust_shares(dense, vehicle).min() > 0
    if vehicle.max_tilt is not None:
        assert np.abs(dense).max() <= np.max(vehicle.max_tilt) + 1e-9
    if vehicle.max_tilt_rate is not None:
        even = np.linspace(table["t"][0], table["t"][-1], len(table))
        slopes = np.abs(np.diff(alpha, axis=0)) / np.diff(even)[:, None]
        assert slopes.max() <= np.max(vehicle.max_tilt_rate) * 1.0101


def test_no_flyable_verdict_where_rows_break_a_condition(tmp_path: Path) -> None:
    """Random laws, periods, digits, and edits of rows, of runs of rows and of the statement."""
    random = np.random.default_rng(0)
    flyable = 0
    for trial in range(20):
        vehicle = gg.PAPER.replace(
            max_tilt=float(random.uniform(0.6, 1.2)),
            max_tilt_rate=float(random.uniform(3, 40)),
        )
        gait = random_gait(random, vehicle)
        period = float(10 ** random.uniform(-1, 1))
        law: Any = random.choice([*LAWS])
        timed = gait.parametrize(period, law=law, samples=int(random.integers(8, 120)))
        table = rounded(table_of(timed), int(random.integers(2, 10)))
        kind = random.choice(["none", "row", "run", "corner", "period"])
        if kind in ("row", "run"):
            columns = dict(table.columns)
            first = int(random.integers(1, len(table) - 1))
            rows = slice(first, first + (1 if kind == "row" else 6))
            by = float(random.choice([-1, 1]) * 10 ** random.uniform(-3, 0))
            for name in random.choice(ANGLES[:2], int(random.integers(1, 3))):
                other = ANGLES[ANGLES.index(str(name)) + 2]
                for one in (str(name), other):
                    columns[one] = columns[one].copy()
                    columns[one][rows] += by
            table = Table(columns=columns, about=table.about)
        elif kind == "corner":
            corners = np.array(table.about["corners"])
            corners[0] *= 1.01
            table = replace(table, about={**table.about, "corners": corners.tolist()})
        elif kind == "period":
            table = replace(table, about={**table.about, "period": 2 * period})
        verdicts = []
        for suffix in (".csv", FORMATS[1 + trial % 4]):
            found, said = read_in(tmp_path / f"a{suffix}", table)
            assert bool(said) is (kind != "none"), (kind, said)
            report = gg.validate(found)
            dense_check(report, found, vehicle)
            verdicts.append(report.flyable)
        assert len(set(verdicts)) == 1
        flyable += bool(verdicts[0])
    assert 2 < flyable < 18


def test_what_pace_made_flyable_stays_flyable_on_every_way_between_formats(
    tmp_path: Path,
) -> None:
    vehicle = gg.PAPER.replace(max_tilt_rate=6.0, max_tilt_acceleration=60.0)
    gait = gg.lift(TRIANGLE, "red", vehicle=vehicle)
    pytest.importorskip("rosbags", reason="install gaitgraph[ros]")
    ways = [gg.least_period(gait, rounding=one, samples=40) for one in (None, 0.03)]
    suffixes = [*FORMATS, ".mcap"]
    for k, suffix in enumerate(suffixes):
        timed = ways[k % 2].timed
        assert timed is not None
        timed.write(tmp_path / f"a{suffix}", force=True)
        other = tmp_path / f"b{suffixes[(k + 3) % len(suffixes)]}"
        gg.export(tmp_path / f"a{suffix}", [other], force=True)
        gg.export(other, [tmp_path / "c.csv"], force=True)
        for path in (other, tmp_path / "c.csv"):
            report = gg.validate(path)
            assert report.flyable, (path.name, report.reason)
            assert not report.warnings


# -- Proofs held against tables


def in_place(alpha: FloatArray, row: int, joint: int, by: float) -> FloatArray:
    moved = alpha.copy()
    moved[row, joint] += by
    return moved


def test_a_certificate_finds_each_edit_above_its_deviation(tmp_path: Path) -> None:
    random = np.random.default_rng(11)
    for decimals in (3, 17):
        timed = random_gait(random).parametrize(
            float(10 ** random.uniform(-1, 1)), samples=int(random.integers(10, 30))
        )
        table = rounded(table_of(timed), decimals)
        certificate = tmp_path / "a.cert.json"
        found, _ = read_in(tmp_path / "a.csv", table)
        certified = gg.certify(found)
        certified.write(certificate, force=True)
        allowed = float(certified.document["deviation"])
        row, joint = int(random.integers(1, len(table) - 1)), int(random.integers(4))
        at = timed.at(timed.t).alpha
        for factor, is_found in ((0.98, False), (1.02, True), (-1.02, True)):
            moved = in_place(at, row, joint, factor * allowed)
            columns = {"t": timed.t, **dict(zip(ANGLES, moved.T, strict=True))}
            write_tables(Table(columns=columns), [tmp_path / "b.csv"], force=True)
            answer = verify(certificate, tmp_path / "b.csv")
            if decimals < 17 or allowed > 1e-13:  # above what floats carry
                assert bool(answer.off) is is_found
                assert not is_found or f"row {row + 1}," in answer.off


@pytest.fixture
def certified(tmp_path: Path) -> Any:
    timed = gg.lift(TRIANGLE, "red").parametrize(0.8)
    timed.write(tmp_path / "a.csv")
    gg.certify(timed).write(tmp_path / "a.cert.json")
    return timed


def test_other_periods_and_parts_of_a_gait_are_seen(
    certified: Any, tmp_path: Path, run: Any
) -> None:
    alone = run("verify", "a.cert.json", "--json").json
    assert (alone["table"], alone["rows"]) == ("a.csv", 101)
    assert alone["between"] < 2e-3
    certified.with_period(0.9).write(tmp_path / "slow.csv")
    for name, rows in (("half", range(51, 101)), ("few", range(1, 100))):
        part = without(table_of(certified), list(rows))
        write_tables(Table(columns=part.columns), [tmp_path / f"{name}.csv"])
    few = run("verify", "a.cert.json", "few.csv", "--json").json
    assert few["between"] > 0.1
    for other, said in (
        ("slow.csv", "row 2, t = 0.009 s"),
        ("half.csv", "the rows last 0.4 s, the curve 0.8 s"),
    ):
        done = run("verify", "a.cert.json", other)
        assert done.code == 1
        assert said in done.out
    (tmp_path / "a.csv").unlink()
    done = run("verify", "a.cert.json")
    assert done.code == 0
    assert "no table was compared" in done.out


def test_a_proof_of_less_than_flight_needs_is_none_of_flight(
    certified: Any, tmp_path: Path, run: Any
) -> None:
    document = json.loads((tmp_path / "a.cert.json").read_text())
    document["claims"]["least_singular_value"]["at_least"] = "0.01"
    (tmp_path / "weak.cert.json").write_text(json.dumps(document))
    done = run("verify", "weak.cert.json", "--json")
    assert (done.code, done.json["proved"], done.json["flyable"]) == (0, True, False)
    alone = [sys.executable, "-I", check.__file__, str(tmp_path / "weak.cert.json")]
    told = subprocess.run(alone, capture_output=True, text=True, check=True).stdout
    assert "not proved flyable: least_singular_value at least 0.01" in told


@pytest.mark.parametrize(
    ("of_times", "period", "samples"), [(3, 1 / 3, 70), (17, 0.37, 60)]
)
def test_checker_and_command_agree_on_rounded_times(
    of_times: int, period: float, samples: int, tmp_path: Path
) -> None:
    gait = gg.lift([(-0.2, 0.3), (-0.2, -0.07), (-0.9, -0.07)], "red")
    table = table_of(gait.parametrize(period, samples=samples))
    columns = {name: table[name].round(6) for name in ANGLES}
    columns = {"t": table["t"].round(of_times), **columns}
    write_tables(replace(table, columns=columns), [tmp_path / "a.csv"])
    certified = gg.certify(tmp_path / "a.csv")
    certified.write(tmp_path / "a.cert.json")
    assert float(certified.document["deviation"]) < 1e-6
    assert verify(tmp_path / "a.cert.json", tmp_path / "a.csv")
    command = [sys.executable, "-S", check.__file__, "a.cert.json", "a.csv"]
    assert subprocess.run(command, cwd=tmp_path, check=False).returncode == 0


def test_rows_whose_times_go_back_are_not_on_the_curve(
    certified: Any, tmp_path: Path, run: Any
) -> None:
    lines = (tmp_path / "a.csv").read_text().splitlines()
    lines[5:7] = lines[6:4:-1]
    (tmp_path / "b.csv").write_text("\n".join(lines) + "\n")
    done = run("verify", "a.cert.json", "b.csv")
    assert done.code == 1
    assert "row 6: t must be at least" in done.out


def test_servo_tables_and_bags_are_held_against_the_proof(
    certified: Any, tmp_path: Path
) -> None:
    pytest.importorskip("rosbags", reason="install gaitgraph[ros]")
    certificate, pulses = tmp_path / "a.cert.json", tmp_path / "pulses.csv"
    stated = {"preset": "x_frame", "unit": "us", "us_per_rad": 400}
    servos = gg.io.servo_map_from_mapping(stated)
    write_tables(table_of(certified), [pulses], servos=servos)
    certified.write(tmp_path / "a.mcap")
    assert verify(certificate, pulses)
    assert verify(certificate, tmp_path / "a.mcap")
    head, *rows = csv.reader(pulses.read_text().splitlines())
    column = next(k for k, name in enumerate(head) if name.endswith("_us"))
    rows[20][column] = str(round(float(rows[20][column]) + 2, 1))
    with pulses.open("w", newline="") as stream:
        csv.writer(stream).writerows([head, *rows])
    with pytest.warns(FileWarning):
        assert "row 21," in verify(certificate, pulses).off
