"""Gait files in other formats, with another timing, or with another sampling of the same motion."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gaitgraph.errors import Advice, Infeasible
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATES,
    ROWS_OF_A_PIECE,
    Table,
    completed_table,
    merged,
    warn_of_ends,
)
from gaitgraph.io.formats import (
    check_outputs,
    given_gait,
    naming_file,
    read_table,
    write_tables,
)
from gaitgraph.io.servo_map import clipped_rows, servo_map_named
from gaitgraph.timing.laws import DEFAULT_LAW, LAWS
from gaitgraph.timing.time_optimal import paced_again
from gaitgraph.timing.timed_gait import (
    RowTimedGait,
    TimedGait,
    TimedPath,
    checked_clock,
    pieces_of,
    table_of,
    timed_gait_of,
)
from gaitgraph.validation.report import RATE_CHECKS
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import PAPER, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.invertibility.matrices import CoefficientsLike
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.io.servo_map import ServoMap, ServoMapLike
    from gaitgraph.timing.laws import LawName
    from gaitgraph.validation.report import Check
    from gaitgraph.vehicle import VehicleLike


def _retimed(
    table: Table,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
    period: float | None,
    law: LawName | None,
    **sampling: Any,
) -> Table | TimedGait:
    """Return a table with another period, law or sampling; as it is if none is asked for and its rows have times.

    Another sampling, or a period alone, keeps the motion that the table states: its law, or that of its rows.
    """
    has_times = "t" in table and len(table) > 1
    asked = any(one is not None for one in (period, law, *sampling.values()))
    if has_times and not asked:
        warn_of_ends(table)
        return table
    chosen: Any = {"vehicle": vehicle, "coefficients": coefficients}
    motion = timed_gait_of(table, **chosen)
    if has_times and law is None:
        law_again = paced_again(table, motion.gait)
        if law_again is not None and period is not None:
            law_again = law_again.slowed(period)
        if law_again is not None:
            count = checked_clock(law_again.period, DEFAULT_LAW, **sampling)
            return replace(law_again, samples=count)
    rests = isinstance(motion, TimedPath) and isinstance(motion.loop, RowTimedGait)
    if has_times and law is None and (rests or isinstance(motion, RowTimedGait)):
        seconds = motion.period if period is None else period
        count = checked_clock(seconds, DEFAULT_LAW, **sampling)
        keeps_rows = all(one is None for one in sampling.values())
        rows = completed_table(table, **chosen)
        return _sampled(rows, table, None if keeps_rows else count, seconds)
    if period is not None or law is not None:
        known = motion.law if motion.law in (*LAWS,) else DEFAULT_LAW
        motion = timed_gait_of(
            table,
            **chosen,
            period=motion.period if period is None else period,
            law=law or cast("LawName", known),
        )
    return replace(
        motion, samples=checked_clock(motion.period, DEFAULT_LAW, **sampling)
    )


def _sampled(rows: Table, stated: Table, count: int | None, seconds: float) -> Table:
    """Return the motion through the rows of a completed table at even times, in some seconds; `count` None keeps them.

    Rows are joined by cubics through the rates where the table stated rates and accelerations, else straight.
    """
    t, alpha = rows["t"], rows.alpha
    own = t if count is None else np.linspace(0.0, t[-1], count + 1)
    slower = seconds / t[-1]
    columns: dict[str, Any] = {"t": own * slower}
    names = (*RATES, *ACCELERATIONS)
    smooth = all(name in stated for name in names) and any(
        rows[name].any() for name in ACCELERATIONS
    )
    if smooth:
        from scipy.interpolate import CubicHermiteSpline

        rates = np.column_stack([rows[name] for name in RATES])
        spline = CubicHermiteSpline(t, alpha, rates)
        angles, most = spline(own), np.abs(rates).max(axis=0)
        # No rate or acceleration above those of the rows: cubics have a little more between them.
        speeds = np.clip(spline(own, 1), -most, most) / slower
        columns |= zip(RATES, speeds.T, strict=True)
        for name in ACCELERATIONS:
            columns[name] = np.interp(own, t, rows[name]) / slower**2
    else:
        angles = np.column_stack([np.interp(own, t, angle) for angle in alpha.T])
    columns |= zip(ANGLES, angles.T, strict=True)
    if "color" in rows:
        passed = np.searchsorted(t, own, side="right") - 1
        columns["color"] = tuple(rows["color"][k] for k in passed.tolist())
    about = rows.about | {"period": seconds}
    return completed_table(Table(columns=columns, about=about))


def _judged_rates(table: Table, *, anyway: bool) -> tuple[Check, ...]:
    """Return the checks of a table's rates; unless `anyway` Infeasible is raised if one fails."""
    checks = tuple(one for one in validate(table).checks if one.name in RATE_CHECKS)
    for check in checks:
        if not check.ok and not anyway:
            raise Infeasible(
                f"nothing is written: {check.message}",
                advice=Advice(
                    "anyway=True writes it all the same",
                    "--anyway writes it all the same",
                ),
            )
    return checks


def _linked(
    joints: ServoMapLike | None, vehicle: VehicleLike | None
) -> ServoMap | None:
    """Return a servo map with the linkages of a vehicle, by default the paper's."""
    if joints is None:
        return None
    linked = vehicle_named(PAPER if vehicle is None else vehicle)
    return servo_map_named(joints).linked_to(linked)


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """What was written: rows, columns, the number of rows in which each servo was clipped, and the table's pieces.

    `rate_checks` are those of another timing: its peaks beside the limits of the vehicle, or of the table.
    """

    rows: int
    columns: tuple[str, ...]
    clipped: dict[str, int]
    pieces: Callable[[], Iterator[Table]]
    rate_checks: tuple[Check, ...] = ()

    def __repr__(self) -> str:
        return f"<Exported: {self.rows} rows, {len(self.columns)} columns>"


def export(
    source: GaitLike,
    outputs: str | Path | Iterable[str | Path],
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    period: float | None = None,
    law: LawName | None = None,
    samples: int | None = None,
    rate: float | None = None,
    joints: ServoMapLike | None = None,
    servos: ServoMapLike | None = None,
    periods: int = 1,
    force: bool = False,
    anyway: bool = False,
) -> Exported:
    """Write a gait file, or a gait in any other form, to files.

    A table with times keeps its rows, from t = 0 and closed unless it is a path, and gets the columns that follow from
    them, see :func:`gaitgraph.gait.table.completed_table`. With `samples`, `rate` or a `period` alone the motion that it
    states is sampled: its law, else the cubics through its rows and rates, else straight lines. With a `law`, without
    times, or of a single row it gets a new timing on the polyline through its rows. Tables are held in memory.

    Parameters
    ----------
    source, outputs
        A gait in any form, see :func:`gaitgraph.io.formats.given_gait`; and files, whose suffixes are the formats.
    vehicle, coefficients
        Replace those that the file states.
    period, law, samples, rate
        As for :meth:`gaitgraph.gait.gait.Gait.parametrize`; by default those that the file states, else the
        times of its rows or 1 s, and smooth.
    joints
        The servo map of the columns of another program's table, with the linkages of the `vehicle` given beside it.
    servos, periods, force
        As for :func:`gaitgraph.io.formats.write_tables`, which raises the same errors.
    anyway
        Write another timing although it breaks limits of rates, of the vehicle or those that the table was made for.

    Raises
    ------
    Infeasible
        If another timing breaks these limits; then nothing is written.
    """
    paths: list[Any] = [outputs]
    if not isinstance(outputs, str):
        with suppress(TypeError):  # one path, or no path at all
            paths = list(outputs)  # type: ignore[arg-type]
    check_outputs(paths, force=force, periods=periods)
    given = given_gait(source, whole=False, vehicle=vehicle, coefficients=coefficients)
    if isinstance(given, Gait):
        given = given.parametrize()
    if isinstance(given, Path):
        given = read_table(given, joints=_linked(joints, vehicle))
    own_law = not isinstance(given, Table) and given.law not in (*LAWS,)
    if own_law and period is not None and law is None:
        given = table_of(given)  # whose rows take another time
    kept: dict[str, Any] = {}
    if isinstance(given, Table):
        if given.limits:
            kept["limits"] = given.about["limits"]
        with naming_file(source):
            given = _retimed(
                given, vehicle, coefficients, period, law, samples=samples, rate=rate
            )
    elif any(one is not None for one in (period, law, samples, rate)):
        timed = timed_gait_of(given, period=period, law=law)
        count = checked_clock(timed.period, DEFAULT_LAW, samples=samples, rate=rate)
        given = replace(timed, samples=count)
    pieces: Callable[[], Iterator[Table]]
    if isinstance(given, Table):
        with naming_file(source):
            table = completed_table(given, vehicle=vehicle, coefficients=coefficients)
        starts = range(0, len(table), ROWS_OF_A_PIECE)
        rows, pieces = (
            len(table),
            partial(
                map, lambda start: table.rows(start, start + ROWS_OF_A_PIECE), starts
            ),
        )
    else:
        rows, pieces = given.samples + 1, partial(pieces_of, given, kept)
    rate_checks: tuple[Check, ...] = ()
    if any(one is not None for one in (period, law, samples, rate)):
        rate_checks = _judged_rates(merged(pieces()), anyway=anyway)
    servo_map = None if servos is None else servo_map_named(servos)
    write_tables(pieces, paths, force=force, periods=periods, servos=servo_map)
    clipped = Counter[str]()
    if paths and servo_map is not None and servo_map.clip:
        for piece in pieces():
            clipped.update(clipped_rows(piece, servo_map))
    return Exported(
        rows=rows,
        columns=tuple(next(pieces()).columns),
        clipped=dict(clipped),
        pieces=pieces,
        rate_checks=rate_checks,
    )
