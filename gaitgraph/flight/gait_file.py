"""The timed gait in a file: on a timing law where the file's times match one, otherwise straight from row to row."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.rows import closed_rows
from gaitgraph.gait.table import ANGLES, Table
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR
from gaitgraph.io.reading import naming_file, read_table
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import holds_request, read_request
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE
from gaitgraph.timing.timed_gait import LAWS, TimedGait, parametrize
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import vehicle_named

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.invertibility.matrices import Kind
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

ROW_BY_ROW = "row-by-row"
"""The name of the law of :class:`RowTimedGait`."""

_SAME = 1e-6  # rad between a row and a law


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RowTimedGait(TimedGait):
    """A gait that passes each row of a table at the row's own time, straight between them.

    Parameters
    ----------
    gait
        The closed polyline through the rows, each of them a corner.
    times
        Times of the rows, the first again at the end, shape (n + 1,), from 0 to the period [s].
    closed
        Whether the table's last row was the first again; otherwise one more segment leads back.
    """

    times: FloatArray
    closed: bool = True

    @property
    def gap(self) -> str:
        """A line on the gap between the table's last row and its first; "" if the table is closed."""
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


def timed_gait_from_file(
    path: str | Path,
    *,
    vehicle: Vehicle | str | None = None,
    coefficients: Kind | None = None,
    period: float | None = None,
    law: str | None = None,
) -> TimedGait:
    """Return the timed gait in a file, ready to fly.

    Parameters
    ----------
    path
        A gait file of any format that is read, or a request, which is planned.
    vehicle, coefficients
        By default those that the file states.
    period, law
        A new period [s] and timing law. By default the file's own: where the times of its rows are those of a law to
        1e-6 rad, that law; otherwise its rows are joined straight, each at its own time. A single row needs no times.

    Raises
    ------
    InputError, FileProblem
        If the file cannot be read, is a flight's, or has no times and `period` is not given.
    Infeasible
        If it is a request that has no gait.
    """
    stated = {"vehicle": vehicle, "coefficients": coefficients, "period": period, "law": law}
    stated = {name: value for name, value in stated.items() if value is not None}
    if holds_request(path):
        request, sampling = read_request(path, stated)
        return plan(request).timed(**sampling)
    table = read_table(path)
    about = table.about
    if about.get("made_by") == "fly":
        advice = f"; gaitgraph plan {path} --output gait.csv writes its gait" if "request" in about else ""
        raise InputError(f"gait file {str(path)!r} is the table of a flight, not of a gait{advice}")
    named = vehicle_named(vehicle) if isinstance(vehicle, str) else vehicle
    with naming_file(path):
        rows, times = closed_rows(table, vehicle=named, coefficients=coefficients)
    gait = replace(rows.merged(), request=rows.request)
    law_of_file = None if about.get("made_by") == "pace" else about.get("law")
    period = about.get("period") if period is None else period
    law = law_of_file or LAWS[0] if law is None else law
    if times is None or len(table) == 1:
        if period is None and len(gait.alpha) > 1:
            raise InputError(
                f"gait file {str(path)!r} has no column t; state its period with --period SECONDS (period=)"
            )
        return parametrize(gait, 1.0 if period is None else period, law=law)
    times = times - times[0]
    if "period" in stated or "law" in stated:
        return parametrize(gait, float(times[-1]) if period is None else period, law=law)
    with naming_file(path):
        for name in sorted(LAWS, key=lambda name: name != law):  # the file's law first
            timed = parametrize(gait, float(times[-1]), law=name, samples=max(len(times) - 1, 1))
            if np.abs(timed.at(times[:-1])[0] - rows.alpha).max() <= _SAME:
                return timed
        colors = gait.colors[:1] * len(rows.alpha) if len(set(gait.colors)) == 1 else ()
        times.flags.writeable = False
        return RowTimedGait(
            gait=replace(gait, alpha=rows.alpha, colors=colors),
            period=float(times[-1]),
            law=ROW_BY_ROW,
            samples=len(times) - 1,
            times=times,
            closed=len(rows.alpha) < len(table),
        )


def biased_timed_gait(timed: TimedGait, eta: float) -> TimedGait:
    """Return the biased gait, equations (14) and (15), with the same times; InputError if η is not allowed."""
    gait = timed.gait.biased(eta)
    if isinstance(timed, RowTimedGait):
        return replace(timed, gait=gait)
    if timed.law not in LAWS:
        raise InputError(f"law must be one of {', '.join(LAWS)} to bias the gait, got {shown(timed.law)}")
    return parametrize(gait, timed.period, law=timed.law, samples=timed.samples)
