"""C headers: compiled with every warning an error, as C and as C++, run, and compared with the gait itself."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from dataclasses import replace
from math import inf, nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import gaitgraph as gg
from gaitgraph.gait.table import ANGLES, Table, about_from_text
from gaitgraph.io.formats import write_tables
from gaitgraph.io.servo_map import servo_map_from_mapping, servo_map_named
from gaitgraph.timing.timed_gait import table_of
from tests.published import GAITS
from tests.samples import rows_of, table_from

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]

WARNINGS = "-Wall -Wextra -pedantic -Werror -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wundef".split()
# Undefined behaviour, an overflow say, ends the program; no library is needed for that.
TRAPS = "-O1 -fsanitize=undefined,float-cast-overflow,bounds -fsanitize-undefined-trap-on-error".split()
COMPILERS = {"c": ("gcc", "clang", "cc"), "c++": ("g++", "clang++", "c++")}
STANDARDS = {"c": "c99", "c++": "c++11"}

GAIT = gg.lift(GAITS[2].angles, "red")
SMOOTH = GAIT.parametrize(0.8, samples=100)
COARSE = GAIT.parametrize(0.8, samples=27)  # corners between rows
LOOP = gg.lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2), (-1.2, 0.4)], "red")
CORNERED = GAIT.parametrize(3.0, samples=24, law="constant-speed")


WHOLE = table_of(SMOOTH)
BARE = Table(columns={name: WHOLE[name] for name in ("t", *ANGLES)})
OPEN = rows_of(WHOLE, 0, 41)  # does not end where it starts
POINT = table_from([[0.5] * 4], t=[0.5])
STRANGE = {"note": '*/ ??/ ??" /* // \\', "ü": "ü\n", "period": 0.8}
SERVOS = servo_map_from_mapping(
    {"joint": [{"name": name} for name in ("a", "/*b??/", "c*/", "d")]}
)
CASES = {
    "gait-3 a": WHOLE,
    "coarse": table_of(COARSE),
    "int": table_of(CORNERED),
    "bare": BARE,
    "open": OPEN,
    "point": POINT,
    "Tricky??7": replace(table_of(COARSE), about=STRANGE),
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


def compiled(folder: Path, source: str, *, language: str = "c") -> list[str]:
    """Compile a program, every warning an error, and return the command that runs it."""
    compiler = next(filter(None, map(shutil.which, COMPILERS[language])), None)
    if compiler is None:
        pytest.skip(f"install one of {', '.join(COMPILERS[language])}")
    (folder / "main.c").write_text(source)
    command = [compiler, "-x", language, f"-std={STANDARDS[language]}", *WARNINGS]
    command += TRAPS if language == "c" else []
    command += [str(folder / "main.c"), "-o", str(folder / "main")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return [str(folder / "main")]


def answers(program: list[str], lines: list[str]) -> FloatArray:
    asked = "".join(f"{line}\n" for line in lines)
    out = subprocess.check_output(program, input=asked, text=True)
    return np.array([line.split() for line in out.splitlines()], dtype=float)


@pytest.fixture(scope="module", params=COMPILERS)
def angles(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., FloatArray]:
    """Give what the compiled headers, all in one program, say at some times."""
    folder = tmp_path_factory.mktemp("c")
    includes, branches, names = "", [], [*CASES]
    for number, (name, table) in enumerate(CASES.items()):
        write_tables(table, [folder / f"{name}.h"], servos=SERVOS)
        # Twice each: the guards are tried too.
        includes += 2 * f'#include "{name}.h"\n'
        call = re.sub("[- ?]", "_", name)
        branches.append(BRANCH.format(number=number, call=call))
    source = DRIVER.format(includes=includes, branches="\n".join(branches))
    program = compiled(folder, source, language=request.param)

    def run(name: str, times: npt.ArrayLike) -> FloatArray:
        number = names.index(name)
        return answers(program, [f"{number} {t!r}" for t in np.asarray(times).tolist()])

    return run


def some_times(period: float, rows: int) -> FloatArray:
    even = np.linspace(0.0, period, rows + 1)
    random = np.random.default_rng(7).uniform(-3 * period, 3 * period, 2000)
    tiny = [1e-30, -1e-30, -5e-324]
    return np.concatenate([random, even, even - period, even + 2 * period, tiny])


def stated_error(path: Path) -> float:
    found = re.search("off the gait by (?:at most|about) ([0-9.e-]+)", path.read_text())
    assert found is not None
    return float(found[1])


ROUNDING = 4e-6  # of t/T within three periods, times the rate, and of the angle


@pytest.mark.parametrize("name", ["gait-3 a", "coarse", "Tricky??7"])
def test_cubics_are_as_near_to_the_gait_as_they_say(
    angles: Callable[..., FloatArray], name: str, tmp_path: Path
) -> None:
    timed = SMOOTH if name == "gait-3 a" else COARSE
    times = some_times(timed.period, timed.samples)
    off = np.abs(angles(name, times) - timed.at(times).alpha).max()
    write_tables(CASES[name], [tmp_path / "g.h"])
    assert f" of {timed.period:g} s [rad]" in (tmp_path / "g.h").read_text()
    most = stated_error(tmp_path / "g.h")
    assert off <= most + ROUNDING
    assert most <= (1e-3 if timed is SMOOTH else 5e-3)


def test_the_error_of_rows_that_state_no_motion_is_estimated(tmp_path: Path) -> None:
    late = {"t": WHOLE["t"] + 1.0}
    write_tables(Table(columns=WHOLE.columns | late), [tmp_path / "g.h"])
    times = np.linspace(0.0, SMOOTH.period, 20_001)
    cubic = CubicHermiteSpline(SMOOTH.t, SMOOTH.alpha, SMOOTH.rates)
    off = np.abs(cubic(times) - SMOOTH.at(times).alpha).max()
    assert off <= stated_error(tmp_path / "g.h") <= 60 * off


@pytest.mark.parametrize("seed", range(6))
def test_the_stated_error_is_a_bound(tmp_path: Path, seed: int) -> None:
    """Of cubics by the rows' angles and rates, with corners on rows and between them, in joints of any order, of any law."""
    random = np.random.default_rng(seed)
    corners = 2 + seed % 2 * 2  # there and back, the corners are on rows
    gait = gg.lift(random.uniform(0.1, 1.0, (corners, 2)) * (-1, 1), "red")
    samples = 2 * int(random.integers(4, 30))
    timed: Any = gait.parametrize(2.0, samples=samples)
    if seed % 3 == 0:
        rounding = "3deg" if seed % 2 else None
        limits = gg.Limits(rate=8, acceleration=100)
        timed = gg.least_period(gait, limits, rounding=rounding).timed
    servos = servo_map_named("x_frame") if seed % 2 else None
    write_tables(table_of(timed), [tmp_path / "gait.h"], servos=servos)
    times = np.linspace(0.0, timed.period, 20_001)
    cubic = CubicHermiteSpline(timed.t, timed.alpha, timed.rates)
    off = np.abs(cubic(times) - timed.at(times).alpha).max()
    assert off <= stated_error(tmp_path / "gait.h") <= 40 * off


@pytest.mark.parametrize("rounding", [None, "2deg"])
def test_peaks_between_rows_are_stated(tmp_path: Path, rounding: str | None) -> None:
    """Cubics through rows of a law that keeps 6 rad/s and 150 rad/s² exceed both between rows; the header says so."""
    limits = gg.Limits(rate=6, acceleration=150)
    timed: Any = gg.least_period(LOOP, limits, rounding=rounding, samples=34).timed
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


@pytest.mark.parametrize("name", ["int", "bare", "point"])
def test_without_accelerations_rows_are_joined_by_straight_lines(
    angles: Callable[..., FloatArray], name: str
) -> None:
    table = CASES[name]
    alpha, period = table.alpha, float(table["t"][-1])
    times = some_times(period, 24)
    turns = np.mod(times, period)
    lines = [np.interp(turns, table["t"], column) for column in alpha.T]
    assert np.abs(angles(name, times) - np.transpose(lines)).max() <= ROUNDING * 4


def test_any_time_is_taken(angles: Callable[..., FloatArray]) -> None:
    times = [0.0, nan, inf, -inf, 1e30, -1e30, 3e9, -2.5e9, 9.3e18, 1e300, -1e-300]
    for name, table in CASES.items():
        found = angles(name, times)
        assert np.isfinite(found).all()
        assert table.alpha.min() - 1e-3 <= found.min()
        assert found.max() <= table.alpha.max() + 1e-3
        assert (found[1] == found[0]).all()  # not a number


def test_what_made_it_is_stated_whatever_it_is(tmp_path: Path) -> None:
    for name, table in CASES.items():
        path = tmp_path / f"{name}.h"
        write_tables(table, [path], servos=SERVOS)
        text = path.read_text(encoding="ascii")
        (made,) = re.findall(r"^ \* made_by: (.*)", text, re.M)
        servos = SERVOS.in_radians().as_mapping()
        about = about_from_text(made, required=True)
        assert about == {**table.about, "servos": servos}
        comment = text[: text.index("#ifndef")]
        assert comment.count("*/") == comment.count("/*") == 1
        assert "??" not in comment
        write_tables(table, [path], force=True, servos=SERVOS)
        assert path.read_text() == text


def test_joints_are_named_with_their_rotors(tmp_path: Path) -> None:
    write_tables(WHOLE, [tmp_path / "g.h"], servos=servo_map_named("x_frame"))
    said = '["tilt1", "tilt2", "tilt3", "tilt4"], which tilt rotors 4, 2, 1, 3.'
    assert said in (tmp_path / "g.h").read_text()


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (np.arange(16_386.0), "rows must be at most 16385 in a C header"),
        ([0, 1, 3], "t must be evenly spaced in a C header"),
        (None, "column 't' is missing; a C header needs a table with times"),
    ],
)
def test_what_a_header_cannot_hold_is_refused(
    times: Any, message: str, tmp_path: Path
) -> None:
    rows = 3 if times is None else len(times)
    with pytest.raises(gg.InputError, match=message):
        write_tables(table_from(np.zeros((rows, 4)), t=times), [tmp_path / "g.h"])
    assert not [*tmp_path.iterdir()]


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
    law: Any, tmp_path: Path
) -> None:
    motion: Any
    if law == "paced":
        limits = gg.Limits(rate=6, acceleration=150)
        motion = gg.least_period(LOOP, limits, rate=200).timed
    else:
        motion = LOOP.parametrize(2.0, samples=400, law=law)
    error = 4e-3 if law == "equal-time" else 2e-4  # its corners between rows are cut
    flight = gg.mission(motion, periods=3)
    write_tables(table_of(flight), [tmp_path / "flight.h"])
    program = compiled(tmp_path, FLIGHT_DRIVER)
    times = np.linspace(-1.0, flight.period + 1.0, 1001)

    def at(asked: float) -> tuple[FloatArray, FloatArray]:
        """Return the whole flight, and that in which a stop is asked for."""
        values = answers(program, [f"{t!r} {asked!r}" for t in times.tolist()])
        return values[:, :4], values[:, 4:]

    sections = zip(flight.course.phases, flight.course.sections, strict=True)
    begin = next(section[0] for phase, section in sections if phase == "gait")
    whole, endless = at(-1.0)
    off = np.abs(whole - flight.at(times).alpha).max()
    assert off <= error
    if law != "equal-time":  # whose rows are joined by straight lines
        assert off <= stated_error(tmp_path / "flight.h") + ROUNDING
    # Nobody asks for a stop: the gait repeats.
    start = begin - 1.0
    runs = times > start
    repeated = motion.at(times[runs] - start).alpha
    assert endless[runs] == pytest.approx(repeated, abs=error)
    rate = float(np.max(flight.peaks(1)))
    for periods in (-1.0, 0.0, 0.4, 1.01):
        asked = max(0.0, start + periods * motion.period)
        _, stopped = at(asked)
        # It is the flight with so many periods: before its join and after it.
        ends = start + max(0, math.ceil(periods)) * motion.period
        before = times <= ends
        assert stopped[before] == pytest.approx(endless[before], abs=2e-6)
        later = times[~before] - ends + begin + 3 * motion.period
        assert stopped[~before] == pytest.approx(flight.at(later).alpha, abs=error)
        steps = np.abs(np.diff(stopped, axis=0)).max()
        assert steps <= rate * (times[1] - times[0]) * 1.03 + 2e-6
        assert not stopped[-1].any() or ends > times[-1] - 3.0


def test_an_edited_mission_is_written_as_its_rows(tmp_path: Path) -> None:
    flight = table_of(gg.mission("gait4"))
    edited = Table(columns=flight.columns, about=flight.about)
    write_tables(edited, [tmp_path / "flight.h"])
    text = (tmp_path / "flight.h").read_text()
    assert "static inline void flight_at(float t, float alpha[4])" in text
    assert "flight_stop_at" not in text
