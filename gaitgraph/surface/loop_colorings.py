"""Every colouring of a closed loop of (α1, α2) by the Figure 15 rule: counted exactly, listed lazily.

At each point of a loop the red and the blue root have the required sign of R, or not. Both share their crossing lines:
α3 is `?` for both or for neither, and so is α4. So between neighbours a color may always stay, and may change exactly
if α3 is `?` at one of the two, and α4 as well (Figure 15). This cuts the loop into runs of one color each. A run may
have any color that all its points can have, whatever the other runs have. So the number of colourings is 0, or 2 to the
power of the number of runs that can have both.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from itertools import chain, groupby, islice, product
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angles_from
from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import checked_choice, wrong
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.invertibility.matrices import BoolArray, level_determinant, noise_of
from gaitgraph.records import Record
from gaitgraph.surface import sheets
from gaitgraph.surface.sheets import Sign
from gaitgraph.tolerances import DEFAULT_CROSSING_TOLERANCE
from gaitgraph.vehicle import PAPER, VehicleLike

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.invertibility.coefficients import Coefficients, CoefficientsLike
    from gaitgraph.surface.sheets import SignChoice

MOST_LISTED = 16  # in a report, which counts all
_MOST_DIGITS = 4000


@dataclass(frozen=True, slots=True, kw_only=True)
class Coloring(Record):
    """A color for each point of a loop, with the sign of R that the roots of these colors have."""

    colors: tuple[str, ...]
    sign: Sign

    def __str__(self) -> str:
        relation, parts, last = sheets.RELATION[self.sign], [], 0
        if len(set(self.colors)) == 1:
            return f"{relation}  all {self.colors[0]}"
        for color, run in groupby(self.colors):
            first, last = last + 1, last + len(list(run))
            parts.append(f"{color} {first}" + (f" to {last}" if last > first else ""))
        return f"{relation}  {', '.join(parts)} (jumps between the sheets)"


@dataclass(frozen=True, slots=True, kw_only=True)
class ColoringRefusal(Record):
    """Why a loop has no colouring with one sign of R: a "point" has no such root, or a "pair" of neighbours forbids it.

    `points` are the numbers of the points concerned, from 1; `types` are the types of the roots that a pair can have.
    """

    kind: Literal["point", "pair"]
    points: tuple[int, ...]
    types: tuple[str, ...]
    message: str


def color_choices(
    alpha1: npt.ArrayLike,
    alpha2: npt.ArrayLike,
    coefficients: Coefficients,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> dict[Sign, BoolArray]:
    """Return what decides the color of each point, for each sign of R; angles of shape (n,) [rad].

    Each array has the shape (n, 4): whether the red and the blue root have that sign, and whether the type of α3 and
    that of α4 is `?`. On the sides of [−π/2, π/2]² there is a root at both ends of its range, once with each sign.
    """
    a1, a2 = np.asarray(alpha1, dtype=float), np.asarray(alpha2, dtype=float)
    noise = noise_of(coefficients)
    is_curved = coefficients.rotors.asymmetry is not None
    crossing = [np.zeros(len(a1), dtype=bool)] * 2
    if not is_curved:
        types = sheets.types_of("red", a1, a2, coefficients, crossing_tolerance)
        crossing = [part == 0 for part in types]
    choices = {
        sign: np.array([*np.zeros((2, len(a1)), dtype=bool), *crossing]).T
        for sign in sheets.SIGNS
    }
    for k, color in enumerate(sheets.COLORS):
        if color == "blue" and coefficients.kind == "exact":
            continue  # R = 0 has no sign
        if is_curved:
            a3, a4 = sheets.curved_roots(a1, a2, coefficients)[0].T[2:]
        else:
            a3, a4 = sheets.sheet_angles(color, a1, a2, coefficients)
        R = np.asarray(level_determinant(np.array([a1, a2, a3, a4]).T, coefficients))
        either = sheets.at_end_of_range(a3) | sheets.at_end_of_range(a4)
        for sign in sheets.SIGNS:
            choices[sign][:, k] = (
                np.where(either, np.abs(R), R if sign == "positive" else -R) > noise
            )
    return choices


def _changes(choices: BoolArray) -> BoolArray:
    """Return whether the color may change from each point to the next, shape (n − 1,)."""
    return np.asarray((choices[:-1, 2:] | choices[1:, 2:]).all(axis=1))


def _count(choices: BoolArray, sign: Sign) -> int | ColoringRefusal:
    """Return the exact number of colourings of a loop, or its first refusal."""
    starts = np.concatenate([[0], np.flatnonzero(_changes(choices)) + 1])
    shared = np.logical_and.reduceat(choices[:, :2], starts, axis=0)  # by all of a run
    without = np.flatnonzero(~shared.any(axis=1))
    if without.size:
        # The first point of its run at which no color is left.
        start = int(starts[without[0]])
        left = np.logical_and.accumulate(choices[start:, :2], axis=0)
        k = start + int(np.argmin(left.any(axis=1)))
        if choices[k, :2].any():
            can = np.array([left[k - 1 - start], choices[k, :2]])
            return _forbidden((k - 1, k), can, choices, sign)
        message = f"point {k + 1} has no root with {sheets.RELATION[sign]}, neither red nor blue"
        return ColoringRefusal(kind="point", points=(k + 1,), types=(), message=message)
    goes_on = not _changes(choices[[-1, 0]])[0]  # the last run, in the first one
    if goes_on and len(shared) > 1:
        both = shared[0] & shared[-1]
        if not both.any():
            return _forbidden((-1, 0), shared[[-1, 0]], choices, sign)
        shared = np.concatenate([[both], shared[1:-1]])
    return 1 << int(shared.all(axis=1).sum())


def _forbidden(
    pair: tuple[int, int], can: BoolArray, choices: BoolArray, sign: Sign
) -> ColoringRefusal:
    """Return the refusal between two neighbours, which can have one color each."""
    colors = [sheets.COLORS[0 if red else 1] for red in can[:, 0].tolist()]
    crossing = choices[list(pair), 2:]
    signs = sheets.color_codes(colors)[:, None]
    types = tuple(
        sheets.text_from_types(*pair) for pair in np.where(crossing, 0, signs).tolist()
    )
    broken = [f"α{k + 3}" for k in range(2) if not crossing[:, k].any()]
    numbers = (pair[0] % len(choices) + 1, pair[1] + 1)
    message = (
        f"points {numbers[0]} {types[0]} and {numbers[1]} {types[1]} may not be neighbours: with "
        f"{sheets.RELATION[sign]} the first can only be {colors[0]}, the second only {colors[1]}, and by "
        f"Figure 15 {' and '.join(broken)} may change between + and - only if one of the two points has the type ?"
    )
    return ColoringRefusal(kind="pair", points=numbers, types=types, message=message)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Colorings(Record):
    """Every Two-Color-consistent colouring of a closed loop, counted; iterate to list them, lazily.

    Colourings with R < 0 come first, then those with R > 0, each in lexicographic order with red before blue. Falsy if
    there is none. For each sign of R, `counts` has the exact number, `plain` the colors that the whole loop can have,
    and `refusals` why there is none. `points` are the loop, shape (n, 2) [rad], and `choices` those of
    :func:`color_choices`; without them colourings are counted and not listed.
    """

    counts: dict[Sign, int]
    plain: dict[Sign, tuple[str, ...]]
    refusals: dict[Sign, ColoringRefusal]
    points: FloatArray = field(compare=False, default_factory=lambda: np.zeros((0, 2)))
    choices: dict[Sign, BoolArray] = field(compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def count(self) -> int:
        """The exact number of colourings."""
        return sum(self.counts.values())

    @property
    def first(self) -> tuple[Coloring, ...]:
        """The first colourings, at most 16."""
        return tuple(islice(self, MOST_LISTED))

    def __bool__(self) -> bool:
        return self.count > 0

    def __iter__(self) -> Iterator[Coloring]:
        return chain.from_iterable(map(self.of, self.choices))

    def of(self, sign: Sign) -> Iterator[Coloring]:
        """Return an iterator over the colourings with one sign of R."""
        if not self.counts[sign]:
            return
        choices = self.choices[sign]
        changes = _changes(np.concatenate([choices, choices[:1]]))
        # The number of the run that each point belongs to, from 0; the last run may go on in the first one.
        runs = max(int(changes.sum()), 1)
        run = (np.cumsum(np.roll(changes, 1)) - changes[-1]) % runs
        shared = np.ones((runs, 2), dtype=bool)
        np.logical_and.at(shared, run, choices[:, :2])
        for chosen in product(
            *([color for color in range(2) if can[color]] for can in shared)
        ):
            yield Coloring(
                colors=tuple(sheets.COLORS[chosen[k]] for k in run.tolist()), sign=sign
            )

    def as_mapping(self) -> dict[str, Any]:
        """Return counts and refusals, ready for JSON; a count of more than 4000 digits is given by its logarithm."""
        return {
            **_count_as_mapping(self.count),
            "counts": {
                sign: _count_as_mapping(count)["colorings_count"]
                for sign, count in self.counts.items()
            },
            "coloring_refusals": {
                sign: asdict(refusal) for sign, refusal in self.refusals.items()
            },
        }

    def __repr__(self) -> str:
        return f"<Colorings: {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        n, count = len(self.points), self.count
        points = (
            f" of {n} point{'s' * (n > 1)}" if n else ""
        )  # the points of counted pieces are not kept
        lines = [
            f"{_count_as_text(count)} colouring{'s' * (count != 1)} of a loop{points}"
        ]
        lines += [
            f"  {sheets.RELATION[sign]}  none: {refusal.message}"
            for sign, refusal in self.refusals.items()
        ]
        return "\n".join(lines)

    @property
    def in_report(self) -> str:
        """The line of a report that counts the colourings."""
        if not self:
            return "none: " + "; ".join(
                refusal.message for refusal in self.refusals.values()
            )
        parts = []
        for sign, count in self.counts.items():
            if count:
                plain = self.plain[sign]
                if len(plain) == count:
                    mixed = ""
                else:
                    mixed = " (those that change color jump between the sheets)"
                all_of = f", all {' or all '.join(plain)}" if plain else ""
                parts.append(
                    f"{_count_as_text(count)} with {sheets.RELATION[sign]}{all_of}{mixed}"
                )
        return "; ".join(parts)


def _count_as_mapping(count: int) -> dict[str, Any]:
    digits = math.log10(count) if count else 0.0
    if digits <= _MOST_DIGITS:
        return {"colorings_count": count}
    return {"colorings_count": None, "colorings_count_log10": digits}


def _count_as_text(count: int) -> str:
    digits = _count_as_mapping(count).get("colorings_count_log10")
    return str(count) if digits is None else f"about 10^{digits:.0f}"


def colorings(
    points: npt.ArrayLike,
    *,
    sign: SignChoice = "auto",
    vehicle: VehicleLike = PAPER,
    coefficients: CoefficientsLike | None = None,
    crossing_tolerance: float = DEFAULT_CROSSING_TOLERANCE,
) -> Colorings:
    """Return every Two-Color-consistent colouring of a closed loop, counted and ready to be listed.

    Parameters
    ----------
    points
        The loop, shape (n, 2) or (n, 4), numbers [rad] or texts such as "pi/8"; InputError
        outside [−π/2, π/2]². Only α1 and α2 are used. A last point that repeats the first is one more point.
    sign
        Sign of R that the roots must have: "negative", "positive", or "auto" for both, one after the other.
    vehicle, coefficients
        By default the paper's vehicle with its published coefficients. With exact ones blue has R = 0 or is no
        solution, so only all-red colourings remain.
    crossing_tolerance
        Distance from a crossing line within which a type is `?` [rad].

    Notes
    -----
    As in Figure 15 only neighbours are compared. A colouring that changes color at a `?` point jumps between the
    sheets: it is two-color, but not continuous. :func:`gaitgraph.validate` checks the sign of R between the points.

    Examples
    --------
    >>> from math import pi
    >>> loop = [(3 * pi / 8, -3 * pi / 8), (3 * pi / 8, -pi / 8), (pi / 8, -pi / 8), (pi / 8, -3 * pi / 8)]
    >>> found = colorings(loop)
    >>> found.count, [coloring.colors[0] for coloring in found]
    (2, ['red', 'blue'])
    >>> colorings([(0.9, 0.3), (0.9, -0.9)], sign="positive").refusals["positive"].message
    'point 1 has no root with R > 0, neither red nor blue'
    """
    plane = angles_from(points, "points")
    if plane.ndim != 2 or plane.shape[1] not in (2, 4) or not len(plane):
        raise wrong(
            "points", "must have shape (n, 2) or (n, 4), n at least 1", plane.shape
        )
    checked_choice("sign", sign, ("auto", *sheets.SIGNS))
    a1, a2 = sheets.checked_plane_angles(plane[:, 0], plane[:, 1])
    choices = color_choices(
        a1, a2, coefficients_of(vehicle, coefficients), crossing_tolerance
    )
    counts: dict[Sign, int] = {}
    plain: dict[Sign, tuple[str, ...]] = {}
    refusals: dict[Sign, ColoringRefusal] = {}
    chosen = sheets.SIGNS if sign == "auto" else (sign,)
    for one in chosen:
        found = _count(choices[one], one)
        everywhere: Any = choices[one][:, :2].all(axis=0)
        plain[one] = tuple(
            name for name, yes in zip(sheets.COLORS, everywhere, strict=True) if yes
        )
        counts[one] = 0 if isinstance(found, ColoringRefusal) else found
        if isinstance(found, ColoringRefusal):
            refusals[one] = found
    return Colorings(
        counts=counts,
        plain=plain,
        refusals=refusals,
        points=plane[:, :2],
        choices={one: choices[one] for one in chosen},
    )
