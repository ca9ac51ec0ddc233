"""Complete a table that comes piece by piece: closed, from t = 0, with every column that follows from the rest.

What the table states stays where all of it agrees with the angles: R to within what its digits carry, types with the
color. What disagrees, or is for another vehicle, is computed anew. So the pieces are asked for twice: to look at them,
and to complete them. No more than two of them are held at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.gait.gait import lift
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, CLOSED_GAP, ORDER, RATES, Table, merged, setting_of
from gaitgraph.invertibility.matrices import Coefficients, Kind, level_determinant, level_determinant_resolution
from gaitgraph.surface.adjacency import text_from_types, types_from_text
from gaitgraph.surface.sheets import (
    DEFAULT_TOLERANCE,
    families_along,
    family_codes,
    family_of,
    family_types,
    types_contradict,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.vehicle import Vehicle

__all__ = ["completed", "completed_pieces"]

FloatArray = npt.NDArray[np.float64]
CodeArray = npt.NDArray[np.int8]


def completed(table: Table, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Table:
    """Return a table with times, closed, and with every column that follows from the rest.

    Rows are joined by straight segments: unless all rates and accelerations are stated, rates are those just after each
    row and accelerations are zero.

    Parameters
    ----------
    table
        At least two rows, with `t`.
    vehicle, coefficients
        What it is for; by default what the table says, else the paper's vehicle.

    Examples
    --------
    >>> columns = {"t": [1, 2, 3], "alpha1": [0.4, 0.9, 0.9], "alpha2": [-0.4, -0.4, -0.8]}
    >>> columns |= {"alpha3": columns["alpha1"], "alpha4": columns["alpha2"]}
    >>> table = Table(columns={name: np.array(values, dtype=float) for name, values in columns.items()})
    >>> whole = completed(table)
    >>> whole["t"].tolist(), whole["color"], whole["alpha2_rate"].tolist()
    ([0.0, 1.0, 2.0, 3.0], ('red', 'red', 'red', 'red'), [0.0, -0.4, 0.4, 0.0])
    """
    return merged(completed_pieces(lambda: [table], vehicle=vehicle, coefficients=coefficients)())


def completed_pieces(
    pieces: Callable[[], Iterable[Table]], *, vehicle: Vehicle | None = None, coefficients: Kind | None = None
) -> Callable[[], Iterator[Table]]:
    """Look at a table that comes piece by piece, and return what yields it completed, as often as it is called.

    Parameters
    ----------
    pieces
        Yields the same pieces each time: at least two rows, with `t`.
    vehicle, coefficients
        As for :func:`completed`.
    """
    survey = _Survey(asked=vehicle, kind=coefficients)
    for piece in pieces():
        survey.see(piece)
    return lambda: _with_rates(_closed(survey, pieces()))


@dataclass(slots=True, kw_only=True)
class _Survey:
    """What all pieces say together: what can stay, and what is computed anew."""

    asked: Vehicle | None
    kind: Kind | None
    setting: tuple[Vehicle, Coefficients, float] | None = None
    rows: int = 0
    is_painted: bool = True
    keeps_level: bool = True
    keeps_types: bool = True
    before: int = 0
    about: dict[str, Any] = field(default_factory=dict)

    def see(self, piece: Table) -> None:
        """Take in the next rows."""
        if self.setting is None:
            self.setting = setting_of(piece, self.asked, self.kind)
            vehicle, numbers, _ = self.setting
            self.about = {**piece.about, "vehicle": vehicle.as_mapping(), "coefficients": numbers.kind}
            told = isinstance(piece.about.get("request"), dict)
            if not told or self.asked is not None or self.kind is not None:
                self.about.pop("request", None)  # it is for something else
        _, numbers, _ = self.setting
        alpha = self.alpha(piece)
        self.rows += len(alpha)
        if "R" not in piece:
            self.keeps_level = False
        elif self.keeps_level:
            digits = 2 * level_determinant_resolution(alpha, numbers)
            self.keeps_level = not (np.abs(piece["R"] - _level(alpha, numbers)) > digits).any()
        codes = self.codes(piece, alpha, self.before)
        self.before = int(codes[-1])
        if not codes.all():
            self.is_painted = False
        if not piece.columns.get("types", ()):
            self.keeps_types = False
        elif self.keeps_types:
            self.keeps_types = not _contradicts(piece["types"], codes)

    def alpha(self, piece: Table) -> FloatArray:
        """Return the four tilt angles of each row, lifted where the table has (α1, α2) and colors alone."""
        if "alpha3" in piece:
            return piece.alpha
        vehicle, numbers, _ = self.given
        plane = np.column_stack([piece["alpha1"], piece["alpha2"]])
        return lift(plane, piece["color"], vehicle=vehicle, coefficients=numbers).alpha

    @property
    def given(self) -> tuple[Vehicle, Coefficients, float]:
        """Vehicle, coefficients and crossing tolerance."""
        assert self.setting is not None  # noqa: S101 - a piece was seen
        return self.setting

    def codes(self, piece: Table, alpha: FloatArray, before: int) -> CodeArray:
        """Return the family that each row is painted as, or lies on; 0 for none."""
        if piece.columns.get("color"):
            return family_codes(piece["color"])
        return families_along(alpha, self.given[1], DEFAULT_TOLERANCE, before=before)

    def completed(self, piece: Table, before: int, start: float) -> tuple[Table, int]:
        """Return a piece with all columns but rates and accelerations, and the family of its last row."""
        _, numbers, tolerance = self.given
        alpha = self.alpha(piece)
        columns = dict(piece.columns) | {name: alpha[:, k] for k, name in enumerate(ANGLES)}
        columns["t"] = columns["t"] - start
        if not self.keeps_level:
            columns["R"] = _level(alpha, numbers)
        codes = self.codes(piece, alpha, before)
        if not self.is_painted:
            columns.pop("types", None)
        else:
            columns["color"] = tuple(map(family_of, codes.tolist()))
            if not self.keeps_types:
                pairs = zip(*family_types(alpha, codes, numbers, tolerance), strict=True)
                columns["types"] = tuple(text_from_types(*pair) for pair in pairs)
        ordered = {name: columns[name] for name in ORDER if name in columns}
        return Table(columns=ordered, about=self.about), int(codes[-1])


def _level(alpha: FloatArray, numbers: Coefficients) -> FloatArray:
    """Return R of each row; of a single one as of many, which numpy rounds in another way."""
    return np.asarray(level_determinant(np.repeat(alpha, 2, axis=0) if len(alpha) == 1 else alpha, numbers))[
        : len(alpha)
    ]


def _contradicts(types: Iterable[str], codes: CodeArray) -> bool:
    known = {text: types_from_text(text) for text in set(types)}
    return bool(types_contradict(np.array([known[text] for text in types]).reshape(-1, 2), codes).any())


def _closed(survey: _Survey, pieces: Iterable[Table]) -> Iterator[Table]:
    """Yield completed pieces with t from 0, and a closing row: instead of a last one that is the first, or after it."""
    first: Table | None = None
    held: Table | None = None  # the last row so far, which may turn out to be the first again
    before, start = 0, 0.0
    for piece in pieces:
        if first is None:
            start = float(piece["t"][0])
        whole, before = survey.completed(piece, before, start)
        first = first or whole.rows(0, 1)
        joined = whole if held is None else merged([held, whole])
        held = joined.rows(len(joined) - 1, len(joined))
        if len(joined) > 1:
            yield joined.rows(0, len(joined) - 1)
    assert first is not None and held is not None  # noqa: PT018, S101 - pieces have rows
    end = float(held["t"][0])
    if survey.rows > 1 and np.abs(held.alpha - first.alpha).max() <= CLOSED_GAP:
        yield _at(first, end)  # but for rounding
        return
    yield held
    yield _at(first, end + end / max(survey.rows - 1, 1))


def _at(row: Table, t: float) -> Table:
    return Table(columns={**row.columns, "t": np.array([t])}, about=row.about)


def _with_rates(pieces: Iterable[Table]) -> Iterator[Table]:
    """Yield closed pieces with rates and accelerations: as stated, or those of straight segments between the rows."""
    held: Table | None = None  # a row whose next one has not come yet
    first_rates: dict[str, Any] | None = None
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
            yield _with(joined.rows(0, len(joined) - 1), rates)
    if held is not None:
        yield _with(held, first_rates or {})


def _with(table: Table, rates: dict[str, Any]) -> Table:
    zeros = {name: np.zeros(len(table)) for name in ACCELERATIONS if rates}
    columns = {**table.columns, **rates, **zeros}
    return Table(columns={name: columns[name] for name in ORDER if name in columns}, about=table.about)
