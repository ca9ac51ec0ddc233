"""From the rows of a table to a closed gait: lifting, closing, and completing with the columns that follow.

A last row that repeats the first, to within :data:`CLOSED_GAP` and with the same color, closes a table. Any other table
is closed by a straight segment back to the first row, which takes one mean step of time.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.gait.gait import Gait, points_on_sheets
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, ORDER, RATES, Table, merged, setting_of
from gaitgraph.invertibility.matrices import Coefficients, Kind, level_determinant, level_determinant_resolution
from gaitgraph.surface.adjacency import text_from_types, types_from_text
from gaitgraph.surface.sheets import (
    DEFAULT_TOLERANCE,
    FIBERS,
    families_along,
    family_codes,
    family_of,
    family_types,
    types_contradict,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]
CodeArray = npt.NDArray[np.int8]

CLOSED_GAP = 1e-9
"""A last row closes a table if no angle differs from the first row's by more than this [rad].

That is far below any printed digit, and above the rounding of floating point. `validate` also accepts a measured loop
that comes back to within its own tolerance, but then keeps the last row as one more point.
"""


def tilt_angles(table: Table, coefficients: Coefficients, *, rows_before: int = 0) -> FloatArray:
    """Return the four tilt angles of each row, shape (n, 4) [rad]; rows of alpha1, alpha2 and color are lifted.

    Raises InputError if a row to lift is on a fibre, which leaves α3 or α4 open, or outside [−π/2, π/2]². `rows_before`
    counts the rows of the same table before these, for messages.
    """
    if "alpha3" in table:
        return table.alpha
    for k, color in enumerate(table["color"] if set(table["color"]) & set(FIBERS) else ()):
        if color in FIBERS:
            wanted = "without alpha3 and alpha4 it must be 'red' or 'blue', as a fibre leaves one of them open"
            raise InputError(f"row {rows_before + k + 1}: color is {color!r}; {wanted}")
    return points_on_sheets(table["alpha1"], table["alpha2"], table["color"], coefficients)


def closes(first: Table, last: Table) -> bool:
    """Return whether a later row, a table of one row, repeats the first."""
    gap = max(abs(float(last[name][0] - first[name][0])) for name in ANGLES if name in first)
    return gap <= CLOSED_GAP and first.columns.get("color") == last.columns.get("color")


def is_closed(table: Table) -> bool:
    """Return whether a table of two or more rows ends with its first row."""
    rows = len(table)
    return rows > 1 and closes(table.rows(0, 1), table.rows(rows - 1, rows))


def closing_time(start: float, end: float, rows: int) -> float:
    """Return when an open table is back at its first row: one mean step after its last one [s]."""
    return end + (end - start) / max(rows - 1, 1)


def closed_rows(
    table: Table, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None
) -> tuple[Gait, FloatArray | None]:
    """Return the closed polyline through a table's rows, each row a corner, and when it passes them.

    Rows without a color get that of the sheet or fibre they lie on, if each lies on one to within 2e-3 rad. The gait
    keeps the request that made the table, if no other vehicle or coefficients are given; by default these are what the
    table states, else the paper's vehicle.

    Returns
    -------
    gait
        With n corners; a row that repeats the first is none.
    times
        Shape (n + 1,), the last one when the gait is back at its first corner [s]; None without a column t.

    Examples
    --------
    >>> columns = {"t": np.array([0, 1]), "alpha1": [0.4, 0.9], "alpha2": [-0.4, -0.4], "color": ("red", "red")}
    >>> gait, times = closed_rows(Table(columns=columns))
    >>> gait.alpha[:, 2].tolist(), times.tolist()
    ([0.4, 0.9], [0.0, 1.0, 2.0])
    """
    request = table.about.get("request") if vehicle is None and coefficients is None else None
    vehicle, numbers, crossing_tolerance = setting_of(table, vehicle, coefficients)
    alpha, t = tilt_angles(table, numbers), table.columns.get("t")
    if is_closed(table):
        alpha = alpha[:-1]
    elif t is not None:
        t = np.append(t, closing_time(t[0], t[-1], len(t)))
    if "color" in table:
        colors = tuple(table["color"][: len(alpha)])
    else:
        codes = families_along(alpha, numbers, DEFAULT_TOLERANCE)
        colors = tuple(map(family_of, codes.tolist())) if codes.all() else ()
    gait = Gait(
        alpha=alpha,
        colors=colors,
        vehicle=vehicle,
        coefficients=numbers,
        crossing_tolerance=crossing_tolerance,
        request=dict(request) if isinstance(request, dict) else {},
    )
    return gait, t


def completed_pieces(
    pieces: Callable[[], Iterable[Table]], *, vehicle: Vehicle | None = None, coefficients: Kind | None = None
) -> Callable[[], Iterator[Table]]:
    """Return what yields a table completed: from t = 0, closed, with every column that follows from the others.

    Stated columns stay where all of their rows agree with the angles: R to within what its digits carry, types with
    the color. Otherwise, or for another vehicle, they are computed. That takes a first pass over all pieces, at once,
    and a second one each time the result is called. No more than two pieces are held at a time.

    Rows are joined by straight segments: unless all rates and accelerations are stated, rates are those just after each
    row and accelerations are zero.

    Parameters
    ----------
    pieces
        Yields the same pieces each time: at least two rows in all, with `t`.
    vehicle, coefficients
        As for :func:`closed_rows`.

    Examples
    --------
    >>> columns = {"t": [1, 2, 3], "alpha1": [0.4, 0.9, 0.9], "alpha2": [-0.4, -0.4, -0.8]}
    >>> columns |= {"alpha3": columns["alpha1"], "alpha4": columns["alpha2"]}
    >>> table = Table(columns={name: np.array(values, dtype=float) for name, values in columns.items()})
    >>> whole = merged(completed_pieces(lambda: [table])())
    >>> whole["t"].tolist(), whole["color"], whole["alpha2_rate"].tolist()
    ([0.0, 1.0, 2.0, 3.0], ('red', 'red', 'red', 'red'), [0.0, -0.4, 0.4, 0.0])
    """
    completion = _Completion(pieces(), vehicle, coefficients)
    return lambda: _with_rates(completion.closed(pieces()))


class _Completion:
    """What all pieces of a table state, and the table completed accordingly."""

    def __init__(self, pieces: Iterable[Table], vehicle: Vehicle | None, coefficients: Kind | None) -> None:
        self.rows = 0
        rest = iter(pieces)
        first = next(rest)
        self.has_colors, self.keeps_R, self.keeps_types = True, "R" in first, "types" in first
        stated, self.numbers, self.crossing_tolerance = setting_of(first, vehicle, coefficients)
        self.about = {**first.about, "vehicle": stated.as_mapping(), "coefficients": self.numbers.kind}
        if not isinstance(self.about.get("request"), dict) or vehicle is not None or coefficients is not None:
            self.about.pop("request", None)  # the request was for something else
        for piece, alpha, codes in self._placed(chain([first], rest)):
            self.rows += len(alpha)
            self.has_colors = self.has_colors and bool(codes.all())
            if self.keeps_R:
                digits = 2 * level_determinant_resolution(alpha, self.numbers)
                self.keeps_R = not (np.abs(piece["R"] - self._R(alpha)) > digits).any()
            if self.keeps_types:
                known = {text: types_from_text(text) for text in set(piece["types"])}
                stated_types = np.array([known[text] for text in piece["types"]]).reshape(-1, 2)
                self.keeps_types = not types_contradict(stated_types, codes).any()

    def _placed(self, pieces: Iterable[Table]) -> Iterator[tuple[Table, FloatArray, CodeArray]]:
        """Yield each piece with its tilt angles and each row's family, as stated or as it lies; 0 for none."""
        rows, code = 0, 0
        for piece in pieces:
            alpha = tilt_angles(piece, self.numbers, rows_before=rows)
            if "color" in piece:
                codes = family_codes(piece["color"])
            else:
                codes = families_along(alpha, self.numbers, DEFAULT_TOLERANCE, before=code)
            rows, code = rows + len(alpha), int(codes[-1])
            yield piece, alpha, codes

    def _R(self, alpha: FloatArray) -> FloatArray:
        rows = np.repeat(alpha, 2, axis=0) if len(alpha) == 1 else alpha  # numpy rounds a single row in another way
        return np.asarray(level_determinant(rows, self.numbers))[: len(alpha)]

    def closed(self, pieces: Iterable[Table]) -> Iterator[Table]:
        """Yield the pieces with t from 0, all columns but rates and accelerations, and a closing row.

        That row replaces a last one that repeats the first.
        """
        first: Table | None = None
        held: Table | None = None  # the last row so far, which may turn out to be the closing one
        start = 0.0
        for piece, alpha, codes in self._placed(pieces):
            if first is None:
                start = float(piece["t"][0])
            columns = piece.columns | dict(zip(ANGLES, alpha.T, strict=True)) | {"t": piece["t"] - start}
            if not self.keeps_R:
                columns["R"] = self._R(alpha)
            if not self.has_colors:
                columns.pop("types", None)
            else:
                columns["color"] = tuple(map(family_of, codes.tolist()))
                if not self.keeps_types:
                    pairs = zip(*family_types(alpha, codes, self.numbers, self.crossing_tolerance), strict=True)
                    columns["types"] = tuple(text_from_types(*pair) for pair in pairs)
            whole = Table(columns={name: columns[name] for name in ORDER if name in columns}, about=self.about)
            first = first or whole.rows(0, 1)
            joined = whole if held is None else merged([held, whole])
            held = joined.rows(len(joined) - 1, len(joined))
            if len(joined) > 1:
                yield joined.rows(0, len(joined) - 1)
        assert first is not None and held is not None  # noqa: PT018, S101 - pieces have rows
        end = float(held["t"][0])
        if self.rows < 2 or not closes(first, held):
            yield held
            end = closing_time(0.0, end, self.rows)
        yield Table(columns={**first.columns, "t": np.array([end])}, about=first.about)


def _with_rates(pieces: Iterable[Table]) -> Iterator[Table]:
    """Yield closed pieces with rates and accelerations: as stated, or those of straight segments between the rows."""
    held: Table | None = None  # a row whose next one has not come yet
    first_rates: dict[str, FloatArray] = {}
    for piece in pieces:
        if all(name in piece for name in (*RATES, *ACCELERATIONS)):
            yield piece
            continue
        joined = piece if held is None else merged([held, piece])
        held = joined.rows(len(joined) - 1, len(joined))
        if len(joined) > 1:
            step = np.diff(joined["t"])
            rates = {rate: np.diff(joined[name]) / step + 0.0 for name, rate in zip(ANGLES, RATES, strict=True)}
            first_rates = first_rates or {name: values[:1] for name, values in rates.items()}
            yield _moving(joined.rows(0, len(joined) - 1), rates)
    if held is not None:
        yield _moving(held, first_rates)


def _moving(table: Table, rates: dict[str, FloatArray]) -> Table:
    columns = table.columns | rates | {name: np.zeros(len(table)) for name in ACCELERATIONS}
    return Table(columns={name: columns[name] for name in ORDER if name in columns}, about=table.about)
