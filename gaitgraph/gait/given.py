"""The one way in for gaits: whatever a function takes as a gait, it takes through :func:`given_gait`.

That is a Gait, a TimedGait, a Plan or another answer with a timed gait, a Table, a data frame, an array of shape
(n, 4), the path of a gait file, or "gait1" to "gait4". The answer has what these have in common, the closed polyline,
and what some of them have, rows and a motion. A request is no gait yet: who has one plans it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias, TypeGuard

import numpy as np

from gaitgraph import later
from gaitgraph.arrays import check_unmasked
from gaitgraph.errors import Infeasible, wrong
from gaitgraph.files import is_stream, naming_file
from gaitgraph.gait.gait import PAPER_GAITS, Gait, paper_gait
from gaitgraph.gait.table import (
    ANGLES,
    Table,
    check_repeats,
    closing_time,
    colors_of,
    is_closed,
    surface_of,
    tilt_angles,
    warn_of_ends,
)
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.vehicle import PAPER, vehicle_named

if TYPE_CHECKING:
    import numpy.typing as npt

    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import VehicleLike

_FORMS = "a Gait, TimedGait, Plan, Table, data frame or (n, 4) array, or the path of a gait file"


class Answer(Protocol):
    """An answer with a timed gait, or None where there is none: a plan, a transition, a least period."""

    @property
    def timed(self) -> later.TimedGait | Callable[..., later.TimedGait] | None:
        """The timed gait, or what makes it."""


class HasColumns(Protocol):
    """What is read of frames, whichever library they are of: names of columns, and columns by their names."""

    columns: Any

    def __getitem__(self, name: str, /) -> Any: ...


Frame = HasColumns | Mapping[str, Any]
"""A frame, whichever library it is of, or a mapping of names to columns."""


def is_frame(value: object) -> TypeGuard[Frame]:
    """Return whether a value is a mapping, or a frame: that has columns and Arrow's interface, as no lazy frame does."""
    is_arrow = hasattr(value, "__arrow_c_stream__") and hasattr(value, "columns")
    return is_arrow or isinstance(value, Mapping)


class Rows(NamedTuple):
    """The closed polyline through rows, each row a corner, and its n + 1 times [s]; None without times."""

    gait: Gait
    times: FloatArray | None


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenGait:
    """A gait as it was handed over, with the vehicle and the coefficients that were chosen for it.

    Parameters
    ----------
    source
        The gait or the timed gait; the table, if it was given as rows.
    vehicle, coefficients
        Those to read a table with; by default those that it states, else the paper's.
    file
        The path of its file, which errors name; None if it is not of a file.
    """

    source: Gait | later.TimedGait | Table
    vehicle: VehicleLike | None = None
    coefficients: CoefficientsLike | None = None
    file: str | Path | None = None

    @property
    def table(self) -> Table | None:
        """The rows, if it was given as rows."""
        if isinstance(self.source, Table):
            return self.source
        return None

    @property
    def repeats(self) -> bool:
        """Whether the motion repeats; False for a path that is run once."""
        return isinstance(self.source, Gait) or self.source.repeats

    @property
    def motion(self) -> later.TimedGait | None:
        """The timed gait: as given, or the one that the rows sample; None without times or such a statement.

        A law under limits on blue is none for another vehicle, whose blue sheet is elsewhere.
        """
        if isinstance(self.source, Gait):
            return None
        if not isinstance(self.source, Table):
            return self.source
        motion = self.source.motion
        if motion is None or (self.vehicle is None and self.coefficients is None):
            return motion
        if motion.made_for and motion.gait.color != "red":
            return None
        vehicle, numbers, _ = surface_of(self.source, self.vehicle, self.coefficients)
        gait = replace(motion.gait, vehicle=vehicle, coefficients=numbers, request={})
        return motion.with_gait(gait)

    @property
    def gait(self) -> Gait:
        """The closed polyline, of rows with straight runs merged, and with the request that its table states."""
        if isinstance(self.source, Gait):
            return self.source
        if self.motion is not None:
            return self.motion.gait
        rows = self.rows.gait
        return replace(rows.merged(), request=rows.request)

    @property
    def rows(self) -> Rows:
        """The closed polyline through the rows, and its times; of a gait that has no rows its corners.

        Rows without colors get those of the sheets they lie on, if each lies on one to within 2e-3 rad. A last row that
        closes the table is no corner. The times include the return to the first corner. Of a path that is run once the
        polyline leads out and back, in twice the time: its segments are those of the path.

        >>> columns = {"t": [0, 1], "alpha1": [0.4, 0.9], "alpha2": [-0.4, -0.4], "color": ["red", "red"]}
        >>> gait, times = given_gait(columns).rows
        >>> gait.alpha[:, 2].tolist(), times.tolist()
        ([0.4, 0.9], [0.0, 1.0, 2.0])
        """
        if isinstance(self.source, Gait):
            return Rows(self.source, None)
        if not isinstance(self.source, Table):
            return Rows(self.source.gait, self.source.corner_times)
        with naming_file(self.file):
            return self._rows_of(self.source)

    def _rows_of(self, table: Table) -> Rows:
        vehicle, numbers, crossing = surface_of(table, self.vehicle, self.coefficients)
        alpha = tilt_angles(table, numbers)
        colors = colors_of(alpha, numbers)
        if "color" in table:
            colors = tuple(table["color"])
        t = table.columns.get("t")
        warn_of_ends(table, self.file)
        if not table.repeats and len(alpha) > 1:
            back = slice(-2, 0, -1)
            alpha = np.vstack([alpha, alpha[back]])
            colors += colors[back]
            if t is not None:
                t = np.append(t, 2 * t[-1] - t[-2::-1])
        elif is_closed(alpha):
            alpha = alpha[:-1]
            colors = colors[: len(alpha)]
        elif t is not None:
            t = np.append(t, closing_time(t[0], t[-1], len(t)))
        request: dict[str, Any] = {}
        stated = table.about.get("request")
        is_own = self.vehicle is None and self.coefficients is None
        if is_own and isinstance(stated, dict):
            request = dict(stated)
        gait = Gait(
            alpha=alpha,
            colors=colors,
            vehicle=vehicle,
            coefficients=numbers,
            crossing_tolerance=crossing,
            request=request,
        )
        return Rows(gait, t)


if TYPE_CHECKING:
    GaitLike: TypeAlias = (
        IO[Any]
        | Gait
        | later.TimedGait
        | Answer
        | GivenGait
        | Table
        | Frame
        | str
        | Path
        | npt.ArrayLike
    )


def given_gait(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    name: str = "gait",
    once: bool = True,
    format: str | None = None,
) -> GivenGait:
    """Return a gait that was handed over in any form.

    A vehicle and coefficients are for rows and for "gait1" to "gait4"; another gait has its own. What rows state of
    their motion is compared with them, see :mod:`gaitgraph.timing.statement`. A GivenGait stays as it is. `once` is
    whether a path that is run once is taken; `name` is the argument's name in messages. With a `format`, "csv" say, the
    gait is an open stream, which :func:`gaitgraph.io.formats.read_table` reads. Raises InputError if it is no gait, FileProblem if a file
    cannot be read, and Infeasible if an answer has no timed gait.
    """
    if format is not None or is_stream(gait):
        stream: Any = gait
        if not is_stream(stream):
            raise wrong(name, "must be an open stream beside a format", stream)
        gait = later.read_table(stream, format=format)
    given = gait
    if not isinstance(given, GivenGait):
        given = _given(gait, vehicle, coefficients, name)
    if not once:
        with naming_file(given.file):
            check_repeats(given, name)
    return given


def _given(
    gait: GaitLike,
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
    name: str,
) -> GivenGait:
    if _is_answer(gait):
        gait = _timed_in(gait, name)
    if isinstance(gait, (Gait, later.TimedGait)):
        for option, value in (("vehicle", vehicle), ("coefficients", coefficients)):
            if value is not None:
                raise wrong(
                    option, "must be None beside a gait, which has its own", value
                )
        return GivenGait(source=gait)
    if isinstance(gait, (str, Path)) and str(gait) in PAPER_GAITS:
        body = vehicle_named(vehicle or PAPER)
        numbers = coefficients_of(body, coefficients)
        return GivenGait(source=paper_gait(PAPER_GAITS[str(gait)], body, numbers))
    file = gait if isinstance(gait, (str, Path)) else None
    return GivenGait(
        source=_table_of(gait, name),
        vehicle=None if vehicle is None else vehicle_named(vehicle),
        coefficients=coefficients,
        file=file,
    )


def _is_answer(value: object) -> TypeGuard[Answer]:
    return hasattr(type(value), "timed")


def _timed_in(answer: Answer, name: str) -> later.TimedGait:
    """Return the timed gait of an answer; Infeasible, with its reason, if it has none."""
    timed = answer.timed() if callable(answer.timed) else answer.timed
    if timed is None:
        raise Infeasible(getattr(answer, "reason", "") or f"{name} has no timed gait")
    return timed


def _table_of(gait: GaitLike, name: str) -> Table:
    """Return the rows of a file, a frame, a table or an array, compared with what they state."""
    if isinstance(gait, (str, Path)):
        return later.read_table(gait)
    if is_frame(gait):
        return later.table_from_frame(gait)
    if isinstance(gait, Table):
        return later.checked_table(gait)
    check_unmasked(gait, name)
    is_array = isinstance(gait, (list, tuple, np.ndarray))
    rows = np.array(gait if is_array else None, dtype=object)
    if not rows.size or rows.shape[1:] != (4,):
        raise wrong(name, f"must be {_FORMS}", gait)
    return later.table_from_frame(dict(zip(ANGLES, rows.T.tolist(), strict=True)))


def gait_of(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    format: str | None = None,
) -> Gait:
    """Return the closed polyline of a gait in any form; of a table straight runs are merged.

    A last row that repeats the first is the closing row. Rows of alpha1, alpha2 and color alone are lifted. Rows
    without a color get that of the sheet they lie on, if each lies on one to within 2e-3 rad. The vehicle and the
    coefficients are those given, else those that the table states, else the paper's. The gait keeps the request that
    the table states, if none is given. Raises InputError for a path that is run once too, see :func:`given_gait`.

    >>> gait_of({"alpha1": [0.4, 0.6, 0.9], "alpha2": [-0.4, -0.4, -0.4], "color": "red"}).alpha[:, 0].tolist()
    [0.4, 0.9]
    """
    chosen = given_gait(
        gait, vehicle=vehicle, coefficients=coefficients, once=False, format=format
    )
    return chosen.gait
