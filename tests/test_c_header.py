"""C headers: compiled with every warning an error, as C and as C++, run, and compared with the gait itself."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from dataclasses import dataclass, replace
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import gaitgraph as gg
from gaitgraph.gait.gait import lift
from gaitgraph.gait.table import ANGLES, Table, about_from_text
from gaitgraph.io.formats import write_tables
from gaitgraph.io.servo_map import servo_map_from_mapping, servo_map_named
from gaitgraph.timing.timed_gait import table_of
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]

WARNINGS = "-Wall -Wextra -pedantic -Werror -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wundef".split()
# Undefined behaviour, an overflow say, ends the program; no library is needed for that.
TRAPS = "-O1 -fsanitize=undefined,float-cast-overflow,bounds -fsanitize-undefined-trap-on-error".split()
COMPILERS = {"c": ("gcc", "clang", "cc"), "c++": ("g++", "clang++", "c++")}
STANDARDS = {"c": "c99", "c++": "c++11"}

GAIT = lift(GAITS[2].angles, "red")
SMOOTH = GAIT.parametrize(0.8, samples=100)
COARSE = GAIT.parametrize(0.8, samples=27)  # corners between rows
CORNERED = GAIT.parametrize(3.0, samples=24, law="constant-speed")


def without(table: Table, *words: str) -> Table:
    return replace(
        table,
        columns={
            k: v
            for k, v in table.columns.items()
            if not any(word in k for word in words)
        },
    )


OPEN = table_of(SMOOTH).rows(0, 41)  # does not end where it starts
TRICKY = Table(
    columns=table_of(COARSE).columns,
    about={"note": '*/ ??/ ??" /* // \\', "ü": "ü\n", "period": 0.8},
)


@dataclass(frozen=True, kw_only=True)
class Case:
    file: str
    table: Table

    @property
    def name(self) -> str:
        return re.sub("[- ?]", "_", self.file.removesuffix(".h"))


SERVOS = servo_map_from_mapping(
    {"joint": [{"name": name} for name in ("a", "/*b??/", "c*/", "d")]}
)
CASES = {
    "smooth": Case(file="gait-3 a.h", table=table_of(SMOOTH)),
    "coarse": Case(file="coarse.h", table=table_of(COARSE)),
    "cornered": Case(file="int.h", table=table_of(CORNERED)),
    "bare": Case(file="bare.h", table=without(table_of(SMOOTH), "rate")),
    "open": Case(file="open.h", table=OPEN),
    "point": Case(
        file="point.h",
        table=Table(columns={name: np.full(1, 0.5) for name in ("t", *ANGLES)}),
    ),
    "tricky": Case(file="Tricky??7.h", table=TRICKY),
}
DRIVER = """
#include <stdio.h>
{includes}
int main(void)
{{
    int which, k;
    double t;
    while (scanf("%d %lf", &which, &t) == 2) {{
        double found[4] = {{0.0, 0.0, 0.0, 0.0}};
        switch (which) {{
{branches}
        default:
            return 1;
        }}
        for (k = 0; k < 4; ++k) {{
            printf("%.17g ", found[k]);
        }}
        printf("\\n");
    }}
    return 0;
}}
"""
BRANCH = """        case {number}: {{
            float value[4];
            {call}_at((float)t, value);
            for (k = 0; k < 4; ++k) {{
                found[k] = (double)value[k];
            }}
            break;
        }}"""


@pytest.fixture(scope="module", params=COMPILERS)
def angles(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., FloatArray]:
    """Give what the compiled headers, all in one program, say at some times."""
    compiler = next(filter(None, map(shutil.which, COMPILERS[request.param])), None)
    if compiler is None:
        pytest.skip(f"install one of {', '.join(COMPILERS[request.param])}")
    folder = tmp_path_factory.mktemp("c")
    for case in CASES.values():
        write_tables(case.table, [folder / case.file], servos=SERVOS)
    names = list(CASES)
    branches = [
        BRANCH.format(number=k, call=case.name) for k, case in enumerate(CASES.values())
    ]
    # Twice each: the guards are tried too.
    includes = "\n".join(
        f'#include "{case.file}"' for case in CASES.values() for _ in range(2)
    )
    source, program = folder / "main.c", folder / "main"
    source.write_text(DRIVER.format(includes=includes, branches="\n".join(branches)))
    language = ["-x", request.param, f"-std={STANDARDS[request.param]}"]
    traps = TRAPS if request.param == "c" else []
    command = [compiler, *language, *WARNINGS, *traps, str(source), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.returncode == 0

    def run(name: str, times: npt.ArrayLike) -> FloatArray:
        lines = "".join(
            f"{names.index(name)} {time!r}\n"
            for time in np.asarray(times, dtype=float).tolist()
        )
        done = subprocess.run(
            [str(program)], input=lines, capture_output=True, text=True, check=True
        )
        return np.array(
            [line.split() for line in done.stdout.splitlines()], dtype=float
        )

    run.folder = folder  # type: ignore[attr-defined]
    return run


def stated(angles: Callable[..., FloatArray], name: str, words: str) -> float:
    """Return how far off a header says it is."""
    text = (angles.folder / CASES[name].file).read_text()  # type: ignore[attr-defined]
    found = re.search(words + r" ([0-9.e-]+) rad", text)
    assert found is not None
    return float(found[1])


def some_times(period: float, rows: int) -> FloatArray:
    even = np.linspace(0.0, period, rows + 1)
    random = np.random.default_rng(7).uniform(-3 * period, 3 * period, 2000)
    return np.concatenate(
        [random, even, even - period, even + 2 * period, [1e-30, -1e-30, -5e-324]]
    )


ROUNDING = 4e-6  # of t/T within three periods, times the rate, and of the angle


@pytest.mark.parametrize("name", ["smooth", "coarse", "tricky"])
def test_cubics_are_as_near_to_the_gait_as_they_say(
    angles: Callable[..., FloatArray], name: str
) -> None:
    timed = COARSE if name in ("coarse", "tricky") else SMOOTH
    times = some_times(timed.period, timed.samples)
    off = np.abs(angles(name, times) - timed.at(times).alpha).max()
    most = stated(angles, name, "off the gait by (?:at most|about)")
    assert off <= most + ROUNDING
    assert most <= {"coarse": 5e-3, "tricky": 5e-3}.get(name, 1e-3)


@pytest.mark.parametrize("seed", range(12))
def test_the_stated_error_is_a_bound(tmp_path: Path, seed: int) -> None:
    """Of cubics by the rows' angles and rates, with corners on rows and between them, in joints of any order too."""
    random = np.random.default_rng(seed)
    gait = lift(random.uniform(-1.2, 1.2, (int(random.integers(3, 7)), 2)), "red")
    timed = gait.parametrize(
        float(random.uniform(0.3, 3.0)), samples=int(random.integers(7, 60))
    )
    servos = servo_map_named("x_frame") if seed % 2 else None
    write_tables(table_of(timed), [tmp_path / "gait.h"], servos=servos)
    found = re.search(
        "off the gait by at most ([0-9.e-]+) rad", (tmp_path / "gait.h").read_text()
    )
    assert found is not None
    times = np.linspace(0.0, timed.period, 20_001)
    off = np.abs(
        CubicHermiteSpline(timed.t, timed.alpha, timed.rates)(times)
        - timed.at(times).alpha
    ).max()
    assert off <= float(found[1]) <= 40 * off


@pytest.mark.parametrize("seed", range(6))
def test_the_error_of_a_time_optimal_gait_is_not_larger_than_stated(
    tmp_path: Path, seed: int
) -> None:
    random = np.random.default_rng(seed)
    gait = lift(random.uniform(0.1, 1.0, (4, 2)) * (-1, 1), "red")
    timed = gg.least_period(
        gait, gg.Limits(rate=8, acceleration=100), rounding=[None, "3deg"][seed % 2]
    ).timed
    assert timed is not None
    timed.write(tmp_path / "gait.h")
    found = re.search(
        "off the gait by at most ([0-9.e-]+) rad", (tmp_path / "gait.h").read_text()
    )
    times = np.linspace(0.0, timed.period, 20_001)
    off = np.abs(
        CubicHermiteSpline(timed.t, timed.alpha, timed.rates)(times)
        - timed.at(times).alpha
    ).max()
    assert found is not None
    assert off <= float(found[1]) <= 20 * off


@pytest.mark.parametrize("rounding", [None, "2deg"])
def test_peaks_between_rows_are_stated(tmp_path: Path, rounding: str | None) -> None:
    """Cubics through rows of a law that keeps 6 rad/s and 150 rad/s² exceed both between rows; the header says so."""
    gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    limits = gg.Limits(rate=6, acceleration=150)
    timed = gg.least_period(gait, limits, rounding=rounding, samples=34).timed
    assert timed is not None
    timed.write(tmp_path / "gait.h")
    text = (tmp_path / "gait.h").read_text()
    found = re.search(r"rates reach ([0-9.]+) rad/s, its accelerations ([0-9.]+)", text)
    assert found is not None
    cubic = CubicHermiteSpline(timed.t, timed.alpha, timed.rates)
    times = np.linspace(0.0, timed.period, 34 * 200 + 1)
    for order, limit in ((1, 6.0), (2, 150.0)):
        peak = np.abs(cubic(times, order)).max()
        assert float(found[order]) == pytest.approx(peak, rel=5e-3)
        assert peak > limit


def test_rows_and_rates_are_met_and_an_open_table_ends(
    angles: Callable[..., FloatArray],
) -> None:
    for name in ("smooth", "coarse", "cornered", "open"):
        table = CASES[name].table
        assert np.abs(angles(name, table["t"]) - table.alpha).max() <= ROUNDING
    step = 1e-4
    near = np.array(
        [angles("smooth", SMOOTH.t + shift) for shift in (-step, 0.0, step)]
    )
    assert np.abs(np.diff(near, axis=0) / step - SMOOTH.rates).max() < 0.05
    assert (
        np.abs(angles("open", [-0.1, 0.4]) - CASES["open"].table.alpha[[0, -1]]).max()
        <= ROUNDING
    )


@pytest.mark.parametrize("name", ["cornered", "bare", "point"])
def test_without_accelerations_rows_are_joined_by_straight_lines(
    angles: Callable[..., FloatArray], name: str
) -> None:
    table = CASES[name].table
    t, rows = (
        (table["t"], table.alpha)
        if len(table) > 1
        else (np.arange(2.0), np.repeat(table.alpha, 2, axis=0))
    )
    times = some_times(t[-1], 24)
    expected = np.column_stack(
        [np.interp(np.mod(times, t[-1]), t, rows[:, k]) for k in range(4)]
    )
    assert np.abs(angles(name, times) - expected).max() <= ROUNDING * 4


def test_any_time_is_taken(angles: Callable[..., FloatArray]) -> None:
    for name, case in CASES.items():
        found = angles(
            name,
            [0.0, nan, inf, -inf, 1e30, -1e30, 3e9, -2.5e9, 9.3e18, 1e300, -1e-300],
        )
        assert np.isfinite(found).all()
        assert found.min() >= case.table.alpha.min() - 1e-3
        assert found.max() <= case.table.alpha.max() + 1e-3
        assert (found[1] == found[0]).all()  # not a number


def test_what_made_it_is_stated_whatever_it_is(tmp_path: Path) -> None:
    for k, case in enumerate(CASES.values()):
        path = tmp_path / f"g{k}.h"
        write_tables(case.table, [path], servos=SERVOS)
        text = path.read_text(encoding="ascii")
        made = next(
            line for line in text.splitlines() if line.startswith(" * made_by: ")
        )
        about = about_from_text(made.removeprefix(" * made_by: "), required=True)
        assert about == {**case.table.about, "servos": SERVOS.in_radians().as_mapping()}
        comment = text[: text.index("#ifndef")]
        assert comment.count("*/") == comment.count("/*") == 1
        assert "??" not in comment
        write_tables(case.table, [path], force=True, servos=SERVOS)
        assert path.read_text() == text


def test_joints_are_named_with_their_rotors(tmp_path: Path) -> None:
    write_tables(
        table_of(SMOOTH), [tmp_path / "g.h"], servos=servo_map_named("x_frame")
    )
    assert (
        '["tilt1", "tilt2", "tilt3", "tilt4"], which tilt rotors 4, 2, 1, 3.'
        in (tmp_path / "g.h").read_text()
    )


def table_with(**columns: Sequence[float] | FloatArray) -> Table:
    rows = len(next(iter(columns.values())))
    zeros = {name: np.zeros(rows) for name in ANGLES}
    return Table(
        columns={
            **zeros,
            **{
                name: np.asarray(values, dtype=float)
                for name, values in columns.items()
            },
        }
    )


def test_what_a_header_cannot_hold_is_refused(tmp_path: Path) -> None:
    for table, message in (
        (table_with(t=np.arange(16_386.0)), "rows must be at most 16385 in a C header"),
        (
            table_with(alpha1=[0, 1]),
            "column 't' is missing; a C header needs a table with times",
        ),
        (
            table_with(t=[0, 1, 3]),
            "t must be evenly spaced in a C header; give the gait another timing",
        ),
    ):
        with pytest.raises(gg.InputError, match=message):
            write_tables(table, [tmp_path / "g.h"])
    assert not list(tmp_path.iterdir())


FLIGHT_DRIVER = """
#include <stdio.h>
#include "flight.h"
int main(void)
{
    double t, asked;
    while (scanf("%lf %lf", &t, &asked) == 2) {
        float whole[4], alpha[4];
        flight_at((float)t, whole);
        flight_flight_at((float)t, (float)asked, alpha);
        printf("%.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g\\n", (double)whole[0], (double)whole[1], (double)whole[2],
               (double)whole[3], (double)alpha[0], (double)alpha[1], (double)alpha[2], (double)alpha[3]);
    }
    return 0;
}
"""


@pytest.mark.parametrize("law", ["smooth", "equal-time", "paced"])
def test_a_mission_starts_runs_and_stops_at_the_first_join(
    law: str, tmp_path: Path
) -> None:
    gait = lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
    motion: Any = gg.least_period(
        gait, gg.Limits(rate=6, acceleration=150), rate=200
    ).timed
    if law != "paced":
        motion = gait.parametrize(2.0, samples=400, law=law)  # type: ignore[arg-type]
    error = 4e-3 if law == "equal-time" else 2e-4  # its corners between rows are cut
    flight = gg.mission(motion, periods=3)
    write_tables(table_of(flight), [tmp_path / "flight.h"])
    compiler = shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("install gcc or clang")
    source, program = tmp_path / "main.c", tmp_path / "main"
    source.write_text(FLIGHT_DRIVER)
    command = [compiler, "-std=c99", *WARNINGS, *TRAPS, str(source), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")

    def at(times: FloatArray, asked: float) -> tuple[FloatArray, FloatArray]:
        given = "".join(f"{t!r} {asked!r}\n" for t in times.tolist())
        out = subprocess.run(
            [program], input=given, capture_output=True, text=True, check=True
        ).stdout
        values = np.array([line.split() for line in out.splitlines()], dtype=float)
        return values[:, :4], values[:, 4:]

    begins = dict(
        zip(
            flight.course.phases,
            (at for at, _, _ in flight.course.sections),
            strict=True,
        )
    )
    times = np.linspace(-1.0, flight.period + 1.0, 2001)
    whole, on = at(times, -1.0)
    assert whole == pytest.approx(flight.at(times).alpha, abs=error)
    # Nobody asks for a stop: the gait repeats.
    start = begins["gait"] - 1.0
    runs = times > start
    assert on[runs] == pytest.approx(motion.at(times[runs] - start).alpha, abs=error)
    rate = float(np.max(flight.peaks(1)))
    for asked in (
        0.0,
        0.3 * start,
        start + 0.4 * motion.period,
        start + 1.01 * motion.period,
    ):
        _, found = at(times, asked)
        turns = max(0, math.ceil((asked - start) / motion.period))
        # It is the flight with so many periods: before its join and after it.
        ends = start + turns * motion.period
        before = times <= ends
        assert found[before] == pytest.approx(on[before], abs=2e-6)
        later = times[~before] - ends + begins["gait"] + 3 * motion.period
        assert found[~before] == pytest.approx(flight.at(later).alpha, abs=error)
        steps = np.abs(np.diff(found, axis=0)).max()
        assert steps <= rate * (times[1] - times[0]) * 1.03 + 2e-6
        assert not found[-1].any() or ends > times[-1] - 3.0


def test_an_edited_mission_is_written_as_its_rows(tmp_path: Path) -> None:
    flight = table_of(gg.mission("gait4"))
    edited = Table(columns=flight.columns, about=flight.about)
    write_tables(edited, [tmp_path / "flight.h"])
    text = (tmp_path / "flight.h").read_text()
    assert "static inline void flight_at(float t, float alpha[4])" in text
    assert "flight_stop_at" not in text
