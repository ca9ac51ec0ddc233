"""Missions of random reachable gaits: within their limits, flown without a warning, and the same in every format.

By default one of each law; ``CASES=200 pytest tests/test_random_missions.py`` runs as many.
"""

from __future__ import annotations

import shutil
import subprocess
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.flight import FlightSettings, fly
from gaitgraph.io.formats import FORMATS
from gaitgraph.timing.joining import played
from tests.samples import seeds, symmetric_vehicle
from tests.test_c_header import (
    COMPILERS,
    FLIGHT_DRIVER,
    ROUNDING,
    WARNINGS,
    answers,
    stated_error,
)

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.vehicle import Vehicle

pytest.importorskip("mujoco")
pytest.importorskip("pyarrow")
pytest.importorskip("rosbags")

LAWS = (
    "smooth",
    "equal-time",
    "constant-speed",
    "time-optimal",
    "rounded",
    "rounded under a jerk limit",
)
STRAIGHT = ("equal-time", "constant-speed")
SANITIZERS = "-O1 -fsanitize=address,undefined -fno-sanitize-recover=all".split()
SETTINGS = FlightSettings(control_rate=500.0, step=2e-3)
STRANGE_TIMES = "nan inf -inf 1e30 -1e30 3e9 1e-30 -1 0 2.5".split()


def random_vehicle(law: str, rng: np.random.Generator) -> Vehicle:
    """Return a square vehicle, or one whose pairs of rotors differ, with the limits that a law can keep."""
    limits = {"max_tilt_rate": float(rng.uniform(3.0, 10.0))}
    if law not in STRAIGHT:
        limits["max_tilt_acceleration"] = float(rng.uniform(50.0, 300.0))
    if "jerk" in law:
        limits["max_tilt_jerk"] = float(rng.uniform(3e3, 3e4))
    if rng.random() < 0.5:
        return gg.PAPER.replace(drag_ratio=float(rng.uniform(0.05, 0.5)), **limits)
    return symmetric_vehicle(rng).replace(inertia=(0.02, 0.02, 0.04), **limits)


def random_mission(seed: int) -> tuple[str, Any, Any]:
    """Return the law, the motion and the mission of a random gait that hover reaches."""
    rng = np.random.default_rng(seed)
    law = LAWS[seed % len(LAWS)]
    while True:
        vehicle = random_vehicle(law, rng)
        middle = rng.uniform(-0.7, 0.7, 2)
        corners = middle + rng.uniform(-0.5, 0.5, (int(rng.integers(2, 7)), 2))
        gait = gg.lift(corners, "red", vehicle=vehicle)
        rate = (None, 50.0, 47.3, 200.0)[int(rng.integers(4))]
        periods = int(rng.integers(1, 4))
        if not gait.check().flyable:
            continue
        timed = timing(gait, law, rng)
        try:
            return law, timed, gg.mission(timed, periods=periods, rate=rate)
        except gg.Infeasible:
            continue


def timing(gait: Any, law: Any, rng: np.random.Generator) -> Any:
    """Return a gait with timing by a law, within the limits of its vehicle."""
    if law not in ("smooth", *STRAIGHT):
        rounding = None if law == "time-optimal" else float(rng.uniform(0.01, 0.1))
        found = gg.least_period(gait, rounding=rounding, rate=200.0)
        return found.timed
    timed = gait.parametrize(1.0, law=law)
    slower = timed.peaks(1).max() / gait.vehicle.max_tilt_rate
    if law == "smooth":
        steeper = timed.peaks(2).max() / gait.vehicle.max_tilt_acceleration
        slower = max(slower, steeper**0.5)
    period = float(slower * rng.uniform(1.0, 3.0))
    return gait.parametrize(period, law=law, rate=200.0)


# Seed 28: R vanishes in the box around the curve of the gait.
@pytest.mark.parametrize("seed", sorted({*seeds(len(LAWS)), 28}))
def test_a_random_mission(seed: int, tmp_path: Path) -> None:
    law, timed, flight = random_mission(seed)
    assert flight.check().flyable
    check_motion(law, timed, flight)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        flown = fly(flight, settings=SETTINGS)
        assert flown.settled, flown.reason
        assert not flown.warnings
        check_files(law, flight, flown, tmp_path)
    check_header(law, flight, tmp_path)


def check_motion(law: str, timed: Any, flight: Any) -> None:
    """Check that it is from rest to rest, continuous, and within its own bounds and the limits of its vehicle."""
    ends = flight.at([0.0, flight.period])
    assert not ends.alpha.any()
    assert not ends.rates.any()
    near = np.linspace(-1e-4, 1e-4, 41)
    joins = [begin + near for _, begin in flight.phases[1:]]
    times = np.sort(np.concatenate([np.linspace(0.0, flight.period, 20_001), *joins]))
    motion = flight.at(times)
    steps = np.diff(times)[:, None]
    known = [motion.alpha, motion.rates, motion.accelerations]
    limits = [timed.gait.vehicle.max_tilt_rate]
    if law not in STRAIGHT:
        limits.append(timed.gait.vehicle.max_tilt_acceleration)
    for order, limit in enumerate(limits, start=1):
        most = flight.peaks(order)
        assert most.max() <= limit * (1 + 1e-6)
        assert (np.abs(known[order]) <= most * (1 + 1e-9)).all()
        changes = np.abs(np.diff(known[order - 1], axis=0))
        assert (changes <= most * steps * (1 + 1e-6) + 1e-8).all()


def check_files(law: str, flight: Any, flown: Any, folder: Path) -> None:
    """Check that files of every format that is read hold the same motion, which is flown the same."""
    times = np.linspace(0.0, flight.period, 997)
    names = [folder / f"flight{suffix}" for suffix in FORMATS]
    gg.io.write_tables(gg.timing.table_of(flight), names)
    # A law under a jerk limit is not found again: the rows are joined by straight lines.
    step = flight.period / flight.samples
    error = step**2 / 8 * flight.peaks(2).max() if "jerk" in law else 1e-8
    for name in names:
        if not FORMATS[name.suffix].reads:
            continue
        table = gg.read_table(name)
        off = np.abs(played(table).at(times).alpha - flight.at(times).alpha).max()
        assert off <= error, name
        if name.suffix not in (".csv", ".mcap"):
            continue
        report = gg.validate(table)
        assert report.flyable, report
        same = fly(table, settings=SETTINGS)
        assert same.settled, same.reason
        assert same.warnings == ()
        assert same.course.phases == flown.course.phases
        assert len(same.rows) == len(flown.rows)
        share = 1e-6 if error < 1e-6 else 0.05
        assert same.peak_thrust == pytest.approx(flown.peak_thrust, rel=share)


def check_header(law: str, flight: Any, folder: Path) -> None:
    """Check the C header under sanitizers, at times inside the flight, far outside, and not finite."""
    compiler = next(filter(None, map(shutil.which, COMPILERS["c"])), None)
    if compiler is None:
        return
    (folder / "main.c").write_text(FLIGHT_DRIVER)
    program = str(folder / "main")
    built = [str(folder / "main.c"), "-o", program]
    subprocess.run([compiler, "-std=c99", *WARNINGS, *SANITIZERS, *built], check=True)
    times = np.linspace(-1.0, flight.period + 1.0, 4001)
    whole = answers([program], [f"{time!r} -1" for time in times.tolist()])[:, :4]
    off = np.abs(whole - flight.at(times).alpha).max()
    if law in STRAIGHT:  # corners between rows are cut
        error = flight.peaks(1).max() * flight.period / flight.samples
    else:
        error = stated_error(folder / "flight.h")
    assert off <= error + ROUNDING
    strange = [f"{time} {asked}" for time in STRANGE_TIMES for asked in STRANGE_TIMES]
    assert np.isfinite(answers([program], strange)).all()
