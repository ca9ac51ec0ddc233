"""Gait files in other formats, with another timing, or with another sampling of the same motion."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.errors import Advice, Infeasible, checked_choice
from gaitgraph.files import is_stream, naming_file
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import (
    ACCELERATIONS,
    ANGLES,
    RATE_CHECKS,
    RATES,
    Table,
    completed_table,
    surface_of,
    warn_of_ends,
)
from gaitgraph.io.formats import (
    check_outputs,
    read_table,
    suffix_of_stream,
    write_tables,
)
from gaitgraph.io.servo_map import clipped_table, servo_map_named
from gaitgraph.records import Record
from gaitgraph.timing.laws import DEFAULT_LAW, LAWS
from gaitgraph.timing.timed_gait import (
    TimedGait,
    checked_clock,
    table_of,
    timed_gait_of,
)
from gaitgraph.validation.report import Check, Report
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import PAPER, vehicle_within

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from gaitgraph.gait.given import GaitLike, GivenGait
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.io.servo_map import ServoMapLike
    from gaitgraph.timing.laws import LawName
    from gaitgraph.vehicle import Each, VehicleLike


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exported(Record):
    """What was written: the table, how it was judged, and the number of rows in which each servo was clipped.

    `rate_checks` are those of another timing: its peaks beside the limits of the vehicle, or of the table.
    """

    table: Table
    report: Report
    clipped: dict[str, int]
    rate_checks: tuple[Check, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows of one period."""
        return len(self.table)

    def __repr__(self) -> str:
        return f"<Exported: {self.rows} rows, {len(self.table.columns)} columns>"


def export(
    source: GaitLike,
    outputs: str | Path | Iterable[str | Path] | IO[Any],
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
    require: Literal["flyable", "valid"] = "flyable",
    anyway: bool = False,
    format: str | None = None,
) -> Exported:
    """Write a gait file, or a gait in any other form, to files.

    A table with times keeps its rows, from t = 0 and closed unless it is a path, and gets the columns that follow from
    them, see :func:`gaitgraph.gait.table.completed_table`. With `samples`, `rate` or a `period` alone the motion that it
    states is sampled: its law, else the cubics through its rows and rates, else straight lines. With a `law`, without
    times, or of a single row it gets a new timing on the polyline through its rows. Tables are held in memory.

    Parameters
    ----------
    source, outputs
        A gait in any form, see :func:`gaitgraph.gait.given.given_gait`; and files, whose suffixes are the formats, or an
        open stream with its `format`, "csv" say.
    vehicle, coefficients
        Replace those that the file states.
    period, law, samples, rate
        As for :meth:`gaitgraph.gait.gait.Gait.parametrize`; by default those that the file states, else the
        times of its rows or 1 s, and smooth.
    joints
        The servo map of the columns of another program's table, with the linkages of the `vehicle` given beside it.
    servos, periods, force
        As for :func:`gaitgraph.io.formats.write_tables`, which raises the same errors. Where a map clips, the clipped rows
        are judged.
    require, anyway
        What is written must be flyable, by the limits of the vehicle and those that the table was made for, or only
        valid; with `anyway` it is written all the same.

    Raises
    ------
    Infeasible
        If it is not, with the reason; then nothing is written.
    """
    paths: list[Any] = [outputs]
    if is_stream(outputs) or format is not None:
        suffix_of_stream(outputs, format, "write")
    else:
        if not isinstance(outputs, str):
            with suppress(TypeError):  # one path, or no path at all
                paths = list(outputs)  # type: ignore[arg-type]
        check_outputs(paths, force=force, periods=periods)
    chosen: dict[str, Any] = {"vehicle": vehicle, "coefficients": coefficients}
    sampling: dict[str, Any] = {"samples": samples, "rate": rate}
    table = _to_write(source, chosen, joints, period, law, sampling)
    made_for = {}
    if period is not None or law is not None:
        # Another timing keeps the limits that the table was made for, also where its vehicle allows more.
        made_for = table.limits
    servo_map = None
    clipped: dict[str, int] = {}
    if servos is not None:
        servo_map = servo_map_named(servos)
        if servo_map.clip:
            table, clipped = clipped_table(table, servo_map)
        if clipped:
            table = completed_table(table)
    report = judged(
        table, require=require, anyway=anyway or not paths, made_for=made_for
    )
    write_tables(
        table, paths, force=force, periods=periods, servos=servo_map, format=format
    )
    rate_checks: list[Check] = []
    if (period, law, samples, rate) != (None,) * 4:
        rate_checks = [check for check in report.checks if check.name in RATE_CHECKS]
    return Exported(
        table=table, report=report, clipped=clipped, rate_checks=tuple(rate_checks)
    )


def _to_write(
    source: GaitLike,
    chosen: dict[str, Any],
    joints: ServoMapLike | None,
    period: float | None,
    law: LawName | None,
    sampling: dict[str, Any],
) -> Table:
    """Return the table of a gait in any form, with another timing or sampling if asked for, with all columns.

    Another sampling, or a period alone, keeps the motion: the one that is given, or that a table states, or that of its
    rows. A law times the polyline anew, and so are rows without times.
    """
    if isinstance(source, (str, Path)) and joints is not None:
        vehicle = PAPER
        if chosen["vehicle"] is not None:
            vehicle = chosen["vehicle"]
        source = read_table(source, joints=servo_map_named(joints).linked_to(vehicle))
    given = given_gait(source, **chosen)
    with naming_file(given.file):
        return _timed_as_asked(given, chosen, period, law, sampling)


def _timed_as_asked(
    given: GivenGait,
    chosen: dict[str, Any],
    period: float | None,
    law: LawName | None,
    sampling: dict[str, Any],
) -> Table:
    table = given.table
    given = replace(given, file=None)  # of a file a period would have to be given
    is_resampled = any(value is not None for value in sampling.values())
    has_times = table is None or ("t" in table and len(table) > 1)
    keeps_motion = law is None and has_times
    if table is not None and keeps_motion:
        if period is None and not is_resampled:
            warn_of_ends(table)
            return completed_table(_exact(table), **chosen)
        if table.motion is None:
            rows = _sampled_rows(given, table, period, sampling)
            return completed_table(rows, **chosen)
    if not keeps_motion:
        if law is not None:
            checked_choice("law", law, LAWS)
        motion = timed_gait_of(given, period=period, law=law)
    else:
        motion = timed_gait_of(given)
        if period is not None:
            checked_clock(period, DEFAULT_LAW)
            motion = motion.with_period(period)
    if is_resampled or not keeps_motion:
        count = checked_clock(motion.period, DEFAULT_LAW, **sampling)
        motion = replace(motion, samples=count)
    kept = {}
    if table is not None and table.limits:
        kept["limits"] = table.about["limits"]
    return table_of(motion, kept)


def _exact(table: Table) -> Table:
    """Return a table whose rows are the samples of a motion to their last digit with all digits of these."""
    if table.motion is None:
        return table
    about = dict(table.about)
    about.pop("angle_rounding", None)
    exact = Table(columns=table.motion.columns, about=about)
    return exact.with_motion(table.motion)


def _sampled_rows(
    given: GivenGait, table: Table, period: float | None, sampling: dict[str, Any]
) -> Table:
    """Return the motion through the rows of a table in another period, or at even times.

    Rows are joined by cubics through the rates where the table stated rates, else straight; see
    :attr:`gaitgraph.gait.table.Table.joined_by_cubics`.
    """
    motion = timed_gait_of(given)
    seconds = motion.period
    if period is not None:
        seconds = period
    count = checked_clock(seconds, DEFAULT_LAW, **sampling)
    rows = completed_table(
        table, vehicle=given.vehicle, coefficients=given.coefficients
    )
    t = own = rows["t"]
    if any(value is not None for value in sampling.values()):
        own = np.linspace(0.0, t[-1], count + 1)
    slower = seconds / t[-1]
    columns: dict[str, Any] = {"t": own * slower}
    if table.joined_by_cubics:
        columns |= _along_cubics(rows, own, slower)
    else:
        for name in ANGLES:
            columns[name] = np.interp(own, t, rows[name])
    if "color" in rows:
        passed = np.searchsorted(t, own, side="right") - 1
        columns["color"] = tuple(np.array(rows["color"])[passed].tolist())
    about = rows.about | {"period": seconds, "samples": len(own) - 1}
    phases = motion.with_period(seconds).phases
    if phases:
        about["phases"] = list(map(list, phases))
    return Table(columns=columns, about=about)


def _along_cubics(rows: Table, own: FloatArray, slower: float) -> dict[str, FloatArray]:
    """Return angles, rates and accelerations at own times, which then pass more slowly, between rows with rates."""
    from scipy.interpolate import CubicHermiteSpline

    t = rows["t"]
    columns = {}
    for angle, rate, acceleration in zip(ANGLES, RATES, ACCELERATIONS, strict=True):
        spline = CubicHermiteSpline(t, rows[angle], rows[rate])
        columns[angle] = spline(own)
        # No rate or acceleration above those of the rows: cubics have a little more between them.
        most = np.abs(rows[rate]).max()
        columns[rate] = np.clip(spline(own, 1), -most, most) / slower
        if acceleration in rows:
            columns[acceleration] = np.interp(own, t, rows[acceleration]) / slower**2
    return columns


def judged(
    motion: Table | TimedGait,
    *,
    require: Literal["flyable", "valid"] = "flyable",
    anyway: bool = False,
    made_for: Mapping[str, Each] | None = None,
) -> Report:
    """Return the report of what is to be written; Infeasible unless it meets what is required, or `anyway` is set.

    It is judged by the limits of its vehicle, and by those of `made_for` where these are lower.
    """
    checked_choice("require", require, ("flyable", "valid"))
    limited: dict[str, Any] = {}
    if made_for and isinstance(motion, Table):
        vehicle, coefficients, crossing_tolerance = surface_of(motion)
        limited = {
            "vehicle": vehicle_within(vehicle, made_for),
            "coefficients": coefficients,
            "crossing_tolerance": crossing_tolerance,
        }
    report = validate(motion, **limited)
    meets = report.valid
    if require == "flyable":
        meets = report.flyable
    if not meets and not anyway:
        raise Infeasible(
            f"nothing is written, since the motion is not {require}: {report.reason}",
            advice=Advice(
                "anyway=True writes it all the same", "--anyway writes it all the same"
            ),
        )
    return report
