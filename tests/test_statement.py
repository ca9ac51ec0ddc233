"""What a table states of its rows is checked once, number by number; verdicts hold for both; proofs are held against rows."""

from __future__ import annotations

import json
import math
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
from tests.samples import along

if TYPE_CHECKING:
    from pathlib import Path


FAST = gg.Vehicle(
    name="fast", mass=1.6, arm_length=0.24, drag_to_thrust=0.018, max_tilt="75deg"
)
CORNERS = [(-0.2, 0.3), (-0.2, -0.07), (-0.9, -0.07), (-0.9, 0.3)]
TRIANGLE = [(-0.3, 0.3), (-0.3, 0.9), (-0.9, 0.9)]
NUMBERS = ("t", *ANGLES, *RATES, *ACCELERATIONS)
FORMATS = [".csv", ".json", ".npz", ".mat", ".parquet"]


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


@pytest.mark.parametrize(
    ("values", "decimals"),
    [
        ([0.5] * 5000 + [0.123], 3),  # a row that no sample may miss
        ([0.06, 0.06, 0.1], 2),  # a number that ends in zeros
        ([0.71e308, 0.125, -1e300], 3),  # its multiple by a power of ten is no float
        (np.random.default_rng(1).uniform(-2, 2, 50), None),
    ],
)
def test_digits_of_an_odd_column(values: Any, decimals: int | None) -> None:
    expected = Digits() if decimals is None else decimals
    found = digits_of(np.array(values))
    assert expected in (found, found.decimals)


STATED = [*LAWS, "least", "rounded", "path"]


@pytest.mark.parametrize("law", STATED)
def test_unedited_tables_are_what_they_state(law: Any, tmp_path: Path) -> None:
    random = np.random.default_rng(len(law) + 40)
    samples = int(random.integers(20, 150))
    timed: Any
    if law in LAWS:
        period = float(10 ** random.uniform(-2, 1))
        timed = random_gait(random).parametrize(period, law=law, samples=samples)
    elif law == "path":
        timed = gg.transition("hover", random_gait(random), samples=samples).timed
    else:
        rounding = 0.05 if law == "rounded" else None
        timed = fastest(rounding=rounding, samples=samples)
    table = table_of(timed)
    at = np.linspace(0, timed.period, 500)
    for angles, times in ((17, 17), (9, 12), (5, 7), (3, 6), (2, 17)):
        if not (np.diff(table["t"].round(times)) > 1e-8).all():
            continue
        again, notes = read_in(tmp_path / "a.csv", rounded(table, angles, times))
        assert not notes
        assert again.motion is not None
        angles_at = again.motion.at(at).alpha
        np.testing.assert_allclose(angles_at, timed.at(at).alpha, atol=1e-9)


@pytest.mark.parametrize("suffix", FORMATS)
def test_one_number_that_differs_drops_the_statement(
    suffix: str, tmp_path: Path
) -> None:
    random = np.random.default_rng(len(suffix))
    path = tmp_path / f"a{suffix}"
    for _ in range(5):
        gait, period = random_gait(random), float(10 ** random.uniform(-2, 1))
        timed = gait.parametrize(period, samples=int(random.integers(10, 60)))
        decimals = int(random.integers(2, 10))
        table = rounded(table_of(timed), decimals)
        name = str(random.choice(NUMBERS[1:]))
        row = int(random.integers(0, len(table)))
        unit = 10.0**-decimals * random.choice([-2.0, 2.0])
        value = round(float(table[name][row]) + unit, decimals)
        again, notes = read_in(path, edited(table, name, row, value))
        assert again.motion is None
        assert set(again.about) <= {"vehicle", "coefficients", "crossing_tolerance"}
        assert set(again.columns) == {"t", *ANGLES}
        (note,) = again.notes
        assert f"row {row + 1} has {name}" in note
        assert [told.endswith(note) for told in notes] == [True]
        report = gg.validate(again)
        assert note in report.as_mapping()["warnings"]
        assert note not in str(report)  # it was said when the file was read


PLANNED = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]


BESIDE = [[(-0.5, 0.6), (-0.3, 0.6), (-0.3, 0.8)]]


@pytest.mark.parametrize(
    ("name", "value", "note"),
    [
        ("R", 1e-3, "row 5 has R = "),
        ("thrust2", 1e-3, "row 5 has thrust2 = "),
        ("types", "(-,-)", "row 5 has the types"),
        ("color of a row", "blue", "the rows have more than one color"),
        ("waypoints", [(-0.3, 0.5)], "passes 0.1 rad from waypoint 1"),
        ("waypoints", [("x", 0)], "the stated request is wrong: waypoints"),
        ("period", 2.0, "has period = 2.0, the stated motion"),
        ("law", "equal-time", "has law = 'equal-time'"),
        ("vehicle", "padova", "has vehicle = 'padova'"),
        ("color", "blue", "has the color 'blue', the stated motion has red"),
        ("sign", "negative", "has the sign 'negative', which R"),
        ("keep_out", BESIDE, "leaves the polygons"),
    ],
)
def test_what_follows_from_the_motion_is_compared_with_it(
    name: str, value: Any, note: str, tmp_path: Path
) -> None:
    table = table_of(gg.plan_loop(PLANNED).timed(samples=20))
    columns, request = dict(table.columns), dict(table.about["request"])
    if name in ("types", "color of a row"):
        column = name.partition(" ")[0]
        columns[column] = [*columns[column][:4], value, *columns[column][5:]]
    elif name in ("R", "thrust2"):
        columns[name] = columns[name] + value * (np.arange(21) == 4)
    else:
        request[name] = value
    wrong = Table(columns=columns, about=table.about | {"request": request})
    again, (told,) = read_in(tmp_path / "a.csv", wrong)
    assert note in told
    assert again.motion is None
    assert set(again.columns) == {"t", *ANGLES}


def fastest(points: Any = TRIANGLE, **options: Any) -> Any:
    """Return the fastest motion along corners within limits."""
    limits = gg.Limits(rate=6.0, acceleration=150.0)
    return gg.least_period(gg.lift(points, "red"), limits, **options).timed


@pytest.mark.parametrize("law", [5, ["paced"], "pacd", "smooth"])
def test_another_law_beside_limits_makes_no_motion(law: Any, tmp_path: Path) -> None:
    table = table_of(fastest())
    wrong = replace(table, about=table.about | {"law": law})
    again, _ = read_in(tmp_path / "a.csv", wrong)
    assert again.motion is None


@pytest.mark.parametrize("limits", ["fast", {"rate": "5"}, {"rate": [1, 1, 1, -1]}])
def test_limits_that_are_none_are_refused(limits: Any, tmp_path: Path) -> None:
    """Which limits a table was made for cannot be seen from its rows."""
    table = table_of(gg.lift(TRIANGLE, "red").parametrize(0.8))
    with pytest.raises(gg.InputError, match="limits"):
        read_in(
            tmp_path / "a.json", replace(table, about=table.about | {"limits": limits})
        )


@pytest.mark.parametrize("seed", range(5))
def test_a_plan_that_was_rounded_is_read_back_with_its_request(
    seed: int, tmp_path: Path
) -> None:
    """Its curve passes a waypoint at the whole tolerance, and its polyline farther by its chord."""
    rng = np.random.default_rng(seed)
    waypoints = rng.uniform((-1.2, 0.2), (-0.3, 1.2), (3, 2)).tolist()
    gait = gg.plan_loop(waypoints).gait
    limits = gg.Limits(rate=5.0, acceleration=60.0)
    timed: Any = gg.least_period(gait, limits, rounding=0.03).timed
    timed.write(tmp_path / "w.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = gg.read_table(tmp_path / "w.csv")
    assert table.about["request"]["waypoints"] == waypoints
    assert table.motion is not None


@pytest.mark.parametrize("rounding", [None, 0.05])
def test_rows_that_are_missing_or_out_of_order_drop_the_statement(
    rounding: float | None, tmp_path: Path
) -> None:
    table = table_of(fastest(rounding=rounding, samples=100))
    shuffled = np.arange(101)
    shuffled[10:40] = np.random.default_rng(1).permutation(shuffled[10:40])
    for rows, said in (
        ([0, 50, 100], "row 2 is at"),
        ([*range(30), *range(70, 101)], "row 31 is at"),
        (range(100), "row 101 is missing"),
        (shuffled, "row "),
    ):
        columns = {name: np.array(table[name])[list(rows)] for name in ANGLES}
        columns["t"] = np.sort(table["t"][list(rows)])
        again, (note,) = read_in(tmp_path / "a.csv", replace(table, columns=columns))
        assert said in note
        assert again.motion is None
    assert len(gg.gait_of(again).alpha) > 20  # the rows, not the stated corners


def test_the_line_with_what_made_a_csv_file_is_not_lost_silently(
    tmp_path: Path,
) -> None:
    """Without it another vehicle, or none of its limits, would be judged."""
    timed = gg.lift(CORNERS, "red", vehicle=FAST).parametrize(1.0, samples=60)
    path = tmp_path / "a.csv"
    timed.write(path)
    head, *lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([head, *lines[1:]]))
    with pytest.raises(gg.InputError, match="the row is missing whose text in made_by"):
        gg.read_table(path)
    path.write_text("".join([head, *lines[::-1]]))  # reversed, as a sheet is sorted
    with pytest.raises(gg.InputError, match="t must be"):
        gg.read_table(path)
    path.write_text("".join([head, lines[0], *lines[10:]]))
    with pytest.warns(FileWarning) as warned:
        assert gg.read_table(path).about["vehicle"]["name"] == "fast"
    assert ["row 2 is at" in str(told.message) for told in warned] == [False, True]


@pytest.mark.parametrize(
    ("factor", "fits"), [(1.0, True), (57.3, False), (-1.0, False)]
)
def test_rates_that_do_not_fit_the_rows_are_dropped(
    factor: float, fits: bool, tmp_path: Path
) -> None:
    table = table_of(gg.lift(TRIANGLE, "red").parametrize(0.8))
    bare = {name: table[name] for name in NUMBERS}
    bare |= {name: factor * table[name] for name in RATES}
    again, notes = read_in(tmp_path / "a.json", Table(columns=bare))
    assert (RATES[0] in again, bool(notes)) == (fits, not fits)
    assert fits or "stated rates and accelerations are not used" in notes[0]
    # The same in a file that states its motion: everything is computed from the rows.
    again, notes = read_in(tmp_path / "a.json", replace(table, columns=bare))
    assert (again.motion is None, bool(notes)) == (not fits, not fits)


@pytest.mark.filterwarnings("error::gaitgraph.errors.FileWarning")
def test_rates_of_smooth_optimized_and_entered_gaits_fit_their_rows() -> None:
    random = np.random.default_rng(8)
    for samples in random.integers(4, 200, 20).tolist():
        timed = random_gait(random).parametrize(1.0, samples=samples)
        bare = {name: timed.columns[name] for name in NUMBERS}
        assert RATES[0] in joined(bare)
    # The angles swing between rows, so that a rate may lie outside the slopes beside it.
    optimal: Any = gg.optimal_gait([(-1.0, 0.5), (-0.8, 1.1), (-0.5, 0.6)]).timed()
    first = [optimal.columns[name][0] for name in RATES]
    # Beyond its last row nothing is known: the rate there may have another sign than the slope before it.
    for samples in (30, 57, 400):
        entry = gg.transition("hover", optimal, samples=samples).table
        bare = {name: entry[name] for name in NUMBERS}
        again = joined(Table(columns=bare).once())
        np.testing.assert_allclose([again[name][-1] for name in RATES], first)


def joined(rows: Any) -> Table:
    """Return rows as they are joined: with their rates, unless these do not fit."""
    table = given_gait(rows).table
    assert table is not None
    return table


def test_late_times_of_a_clock_that_started_long_ago_are_found() -> None:
    table = table_of(gg.lift(CORNERS, "red").parametrize(1.0, samples=100))
    columns = {**table.columns, "t": table["t"] + 9e8}
    since_epoch = Table(columns=columns, about=table.about)
    assert given_gait(since_epoch).motion is not None
    told = r"row 31 is at t = 900000000\.303 s, stated is 900000000\.3 s"
    with pytest.warns(FileWarning, match=told):
        late = given_gait(edited(since_epoch, "t", 30, 9e8 + 0.303))
    assert late.motion is None


def test_times_are_those_of_the_statement_to_half_a_unit(tmp_path: Path) -> None:
    timed = gg.lift(CORNERS, "red", vehicle=FAST).parametrize(1.0, samples=50)
    proof, path = tmp_path / "g.cert.json", tmp_path / "a.csv"
    gg.certify(timed).write(proof)
    table = table_of(timed)
    shifted = replace(table, columns={**table.columns, "t": table["t"] + 0.3})
    shifted = rounded(shifted, 17, 2)
    assert read_in(path, shifted)[0].motion is not None
    assert not verify(proof, path).off
    for unit in (0.01, -0.01):  # half of a step
        late = edited(shifted, "t", 7, round(float(shifted["t"][7]) + unit, 2))
        again, (note,) = read_in(path, late)
        assert (again.motion, "row 8" in note) == (None, True)
        assert check.held_against(proof.read_text(), *check.rows_of_csv(path))[0]
    # 0.25 s is 0.2 s to a tenth.
    tenths = rounded(table_of(replace(timed, samples=4)), 17, 1)
    assert tenths["t"].tolist() == [0.0, 0.2, 0.5, 0.8, 1.0]
    assert read_in(path, tenths)[0].motion is not None


def test_a_gait_that_reaches_a_limit_is_flyable_as_a_table(tmp_path: Path) -> None:
    """A corner at the limit between two rows, which the cubics pass by some 1e-6 rad."""
    vehicle = FAST.replace(max_tilt="50deg")
    points: Any = [(-0.2, 0.3), ("-50deg", 0.35), (-0.6, 0.8)]
    gg.plan_loop(points, vehicle=vehicle).timed().write(tmp_path / "a.csv")
    assert gg.validate(tmp_path / "a.csv").flyable
    # Without the motion the cubics are all there is.
    bare = Table(columns=gg.read_table(tmp_path / "a.csv").columns)
    assert not gg.validate(bare, vehicle=vehicle)["tilt_range"].ok


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
    assert gg.certify(columns)
    rate = np.array([0.0, 0.5, 0.0])
    fitting = columns | dict.fromkeys(RATES, np.zeros(3))
    fitting |= {"alpha1_rate": rate, "alpha3_rate": rate}
    four = fitting | {"alpha3": columns["alpha1"], "alpha4": columns["alpha2"]}
    assert not gg.validate(four).flyable
    assert not gg.validate(fitting).flyable
    with pytest.raises(Infeasible, match="cubics through their rates"):
        gg.certify(fitting)
    with pytest.warns(FileWarning, match="row 2 states alpha3_rate = 50"):
        assert RATES[0] not in joined(fitting | {"alpha3_rate": 100 * rate})
    stated = {"corners": CORNERS, "law": "smooth", "period": 2.0, "samples": 2}
    with pytest.warns(FileWarning, match="not all angles"):
        assert RATES[0] not in joined(Table(columns=fitting, about=stated))


@pytest.mark.parametrize("samples", [9, 25, 59])
@pytest.mark.parametrize(("swing", "ok"), [(0.9, True), (1.1, False)])
def test_cubics_that_leave_their_segments_along_them_are_judged(
    samples: int, swing: float, ok: bool
) -> None:
    corners = [(-0.3, 0.3), (-0.9, 0.4), (-0.5, 1 / 3)]  # out and back on a line
    timed = gg.lift(corners, "red", vehicle=FAST).parametrize(samples=samples)
    spline = CubicHermiteSpline(timed.t, timed.alpha, timed.rates)
    most = np.abs(timed.gait.alpha).max()
    beyond = np.abs(spline(np.linspace(0, timed.period, 20_001))).max() - most
    vehicle = FAST.replace(max_tilt=float(most + beyond / swing))
    bare = Table(columns=timed.columns)
    assert gg.validate(bare, vehicle=vehicle).flyable == ok


def test_cubics_across_their_segments_are_judged() -> None:
    """Rows on one line whose cubics swing out of it to where thrusts are smaller."""
    t = np.arange(5) * 1.0
    alpha = np.array([[-0.4, -0.5, -0.6, -0.5, -0.4], [0.3] * 5])
    rates = 0.1 * np.array([[0] * 5, [0, -0.75, 0.75, -0.75, 0]])
    columns = {"t": t, **dict(zip(ANGLES, [*alpha, *alpha], strict=True))}
    straight = gg.validate(columns)["hover_thrust"].value or 0.0
    columns |= dict(zip(RATES, [*rates, *rates], strict=True))
    columns |= dict.fromkeys(ACCELERATIONS, np.full(5, 0.01))
    least = gg.validate(columns)["hover_thrust"].value
    dense = CubicHermiteSpline(t, alpha.T, rates.T)(np.linspace(0, 4, 8001))
    expected = hover_thrust_shares(np.hstack([dense, dense]), gg.PAPER).min()
    assert least == pytest.approx(expected, abs=1e-3)
    assert expected < straight - 1e-3


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


def dense_check(report: gg.Report, table: Table, vehicle: Any) -> None:
    """Assert that nothing is called flyable where rows as they are joined break a condition."""
    if not report.flyable:
        return
    dense = along(table.alpha, 41)
    assert least_singular_value(dense, vehicle).min() >= 0.05 - 1e-9
    assert hover_thrust_shares(dense, vehicle).min() > 0
    assert np.abs(dense).max() <= np.max(vehicle.max_tilt) + 1e-9
    steps = np.abs(np.diff(table.alpha, axis=0)).max()
    slope = steps / np.ptp(table["t"]) * (len(table) - 1)
    assert slope <= np.max(vehicle.max_tilt_rate) * 1.0101


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
        about = dict(table.about)
        if kind in ("row", "run"):
            first = int(random.integers(1, len(table) - 1))
            rows = slice(first, first + (1 if kind == "row" else 6))
            by = float(random.choice([-1, 1]) * 10 ** random.uniform(-3, 0))
            joint = int(random.integers(2))
            for name in (ANGLES[joint], ANGLES[joint + 2]):
                for row in range(len(table))[rows]:
                    table = edited(table, name, row, table[name][row] + by)
        elif kind == "corner":
            about["corners"] = np.multiply(
                about["corners"], [1.01, 1, 1.01, 1]
            ).tolist()
        elif kind == "period":
            about["period"] = 2 * period
        verdicts = set()
        for suffix in (".csv", FORMATS[1 + trial % 4]):
            path = tmp_path / f"a{suffix}"
            again, notes = read_in(path, replace(table, about=about))
            assert bool(notes) is (kind != "none"), (kind, notes)
            report = gg.validate(again)
            dense_check(report, again, vehicle)
            verdicts.add(report.flyable)
        assert len(verdicts) == 1
        flyable += verdicts == {True}
    assert 2 < flyable < 18


# -- Proofs held against tables


def test_the_command_verifies_a_table_that_is_named_or_beside_its_certificate(
    run: Any, tmp_path: Path
) -> None:
    timed = gg.lift(TRIANGLE, "red").parametrize(0.8)
    timed.write(tmp_path / "a.csv")
    gg.certify(timed).write(tmp_path / "a.cert.json")
    timed.with_period(0.9).write(tmp_path / "slow.csv")
    done = run("verify", "a.cert.json", "slow.csv")
    assert (done.code, "row 2, t = 0.009 s" in done.out) == (1, True)
    assert run("verify", "a.cert.json", "--json").json["table"] == "a.csv"
    (tmp_path / "a.csv").unlink()
    done = run("verify", "a.cert.json")
    assert (done.code, "no table was compared" in done.out) == (0, True)
