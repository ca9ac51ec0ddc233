"""The gait in a file with its clock: a law where its times are those of one, else straight from row to row."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import GaitgraphError, InputError, shown
from gaitgraph.gait.table import ANGLES, Table
from gaitgraph.io.exchange import closed_rows, read_gait
from gaitgraph.io.reading import read_table
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import holds_request, read_request
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE
from gaitgraph.timing.timed_gait import LAWS, TimedGait, parametrize
from gaitgraph.validation.report import DEFAULT_FLOOR
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import vehicle_named

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import Kind
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Vehicle

__all__ = ["ROW_BY_ROW", "RowTimedGait", "biased", "timed_of_file"]

FloatArray = npt.NDArray[np.float64]

ROW_BY_ROW = "row-by-row"
"""What the law of :class:`RowTimedGait` is called."""

_SAME = 1e-6  # rad by which rows may be off a law


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RowTimedGait(TimedGait):
    """A gait that passes each row of a table at the row's own time, straight between them.

    Parameters
    ----------
    gait
        The closed polyline through the rows, each of them a corner.
    times
        When the rows are passed, the first again at the end, shape (n + 1,), from 0 to the period [s].
    closed
        Whether the table's last row was the first again; otherwise the way back is one more segment.
    """

    times: FloatArray
    closed: bool = True

    def __post_init__(self) -> None:
        times = np.array(self.times, dtype=float)
        times.flags.writeable = False
        object.__setattr__(self, "times", times)

    @property
    def gap(self) -> str:
        """What the table leaves open between its last row and its first, in a line; "" if it is closed."""
        if self.closed:
            return ""
        jump = float(np.linalg.norm(self.gait.alpha[-1] - self.gait.alpha[0]))
        return (
            f"the table is not closed: the {jump:.3g} rad from its last row back to the first are flown within "
            f"{self.times[-1] - self.times[-2]:.3g} s"
        )

    @property
    def corner_times(self) -> FloatArray:
        """When the gait passes its rows, from 0 to T, shape (n + 1,) [s]."""
        return self.times

    def check(
        self,
        *,
        tolerance: float = DEFAULT_TOLERANCE,
        floor: float = DEFAULT_FLOOR,
        angle_rounding: float | None = None,
    ) -> Report:
        """Return every check of the rows, as :func:`gaitgraph.validation.validating.validate` makes them of a table."""
        gait = self.gait
        columns: dict[str, Any] = {"t": self.times}
        columns |= {name: np.append(gait.alpha[:, k], gait.alpha[0, k]) for k, name in enumerate(ANGLES)}
        if gait.colors:
            columns["color"] = (*gait.colors, gait.colors[0])
        return validate(
            Table(columns=columns),
            vehicle=gait.vehicle,
            coefficients=gait.coefficients.kind,
            tolerance=tolerance,
            floor=floor,
            angle_rounding=angle_rounding,
        )


def timed_of_file(
    path: str | Path,
    *,
    vehicle: Vehicle | str | None = None,
    coefficients: Kind | None = None,
    period: float | None = None,
    law: str | None = None,
) -> TimedGait:
    """Return the gait in a file with its clock, ready to fly.

    Parameters
    ----------
    path
        A gait file of any format that is read, or a request, which is planned.
    vehicle, coefficients
        What it is for; by default what the file says.
    period, law
        A new clock [s]. By default the file's own: where the times of its rows are those of a law to 1e-6 rad, that
        law; otherwise its rows are joined straight, each at its own time. A single row needs no clock.

    Raises
    ------
    InputError, FileProblem
        If the file cannot be read, is a flight's, or has no clock and `period` gives none.
    Infeasible
        If it is a request that has no gait.
    """
    clock = {name: value for name, value in (("period", period), ("law", law)) if value is not None}
    if holds_request(path):
        asked = {"vehicle": vehicle, "coefficients": coefficients}
        request, sampling = read_request(path, {k: v for k, v in asked.items() if v is not None} | clock)
        return plan(request).timed(**sampling)
    one = vehicle_named(vehicle) if isinstance(vehicle, str) else vehicle
    table = read_table(path)
    about = table.about
    if about.get("made_by") == "fly":
        advice = f"gaitgraph plan {path} --output gait.csv writes it" if "request" in about else "it flew from one"
        raise InputError(f"gait file {str(path)!r}: it is the table of a flight; allowed is a gait: {advice}")
    gait = read_gait(path, vehicle=one, coefficients=coefficients)
    told = about.get("period")
    stated = None if about.get("made_by") == "pace" else about.get("law")
    if "t" not in table or len(table) == 1:
        seconds = _first(period, told, 1.0 if len(gait.alpha) == 1 else None)
        if seconds is None:
            raise InputError(
                f"gait file {str(path)!r}: it has no clock, for it has no column t; allowed is with --period SECONDS "
                "(period=)"
            )
        return parametrize(gait, seconds, law=_first(law, stated, LAWS[0]))
    rows, _, _ = closed_rows(table, vehicle=one, coefficients=coefficients, source=path)
    times = _first(rows.t, table["t"])
    times = times - times[0]
    if clock:
        return parametrize(gait, _first(period, told, float(times[-1])), law=_first(law, stated, LAWS[0]))
    try:
        return _of_rows(gait, times, rows.alpha, stated, closed=len(rows.alpha) == len(table))
    except GaitgraphError as error:
        raise type(error)(f"gait file {str(path)!r}: {error}") from error


def _first(*values: Any) -> Any:
    return next((value for value in values if value is not None), None)


def _of_rows(gait: Gait, times: FloatArray, alpha: FloatArray, stated: object, *, closed: bool) -> TimedGait:
    """Return the law whose times these are, or the rows at their own times."""
    period = float(times[-1])
    for law in sorted(LAWS, key=lambda name: name != stated):
        timed = parametrize(gait, period, law=law, samples=max(len(times) - 1, 1))
        if np.abs(timed.at(times)[0] - alpha).max() <= _SAME:
            return timed
    colors = gait.colors if len(set(gait.colors)) == 1 else ()
    every = replace(gait, alpha=alpha[:-1], colors=colors[:1] * (len(alpha) - 1))
    return RowTimedGait(gait=every, period=period, law=ROW_BY_ROW, samples=len(times) - 1, times=times, closed=closed)


def biased(timed: TimedGait, eta: float) -> TimedGait:
    """Return the biased gait, equations (14) and (15), with the same clock; InputError if η is not allowed."""
    gait = timed.gait.biased(eta)
    if isinstance(timed, RowTimedGait):
        return replace(timed, gait=gait)
    if timed.law not in LAWS:
        raise InputError(f"law: {shown(timed.law)} has no biased gait; allowed are {', '.join(LAWS)}")
    return parametrize(gait, timed.period, law=timed.law, samples=timed.samples)
