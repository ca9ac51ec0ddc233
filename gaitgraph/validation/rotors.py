"""Can rotors of any geometry fly a tilt table? On the physics alone: the paper's rules are about four arms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import checked_number, figure
from gaitgraph.errors import InputError
from gaitgraph.gait.table import is_closed
from gaitgraph.invertibility.geometry import LEAST_DECIDED
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR
from gaitgraph.io.formats import read_pieces
from gaitgraph.validation.report import Check, GaitPoint, lines_of_checks

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.invertibility.geometry import Geometry


@dataclass(frozen=True, slots=True, kw_only=True)
class GeometryReport:
    """The checks of a tilt table of `rows` rows on a geometry; true in a condition if it can fly."""

    checks: tuple[Check, ...]
    rows: int

    @property
    def flyable(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    def __bool__(self) -> bool:
        return self.flyable

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON: those of a Report, None where a rule does not apply."""
        names = ("valid", "two_color", "reachable_from_hover", "colorings", "colorings_count")
        checks = [check.as_mapping() for check in self.checks]
        return {**dict.fromkeys(names), "flyable": self.flyable, "checks": checks, "warnings": [], "rows": self.rows}

    def __str__(self) -> str:
        verdict = f"Flyable: {'yes' if self.flyable else 'no'}. The paper's rules do not apply to this geometry."
        return "\n".join([verdict, *lines_of_checks(self.checks)])


def validate_geometry(
    table: str | Path | npt.ArrayLike,
    geometry: Geometry,
    *,
    floor: float = DEFAULT_FLOOR,
    progress: Callable[[float], None] | None = None,
) -> GeometryReport:
    """Return whether rotors of any geometry can fly a tilt table, proven along the straight segments between its rows.

    Parameters
    ----------
    table
        A gait file with a column alpha1 … alphaN for each rotor that tilts (or with _deg), or an (n, N) array [rad].
        The last row is joined with the first.
    floor
        Least singular value floor of the level matrix, dimensionless.
    progress
        Called with the fraction of a file that was read.

    Returns
    -------
    GeometryReport
        With the checks `least_singular_value`, `hover_thrust` (that of least norm, positive) and `tilt_range`.

    Raises
    ------
    InputError, FileProblem
        If no rotor tilts, a value is wrong, or a file cannot be read.

    Examples
    --------
    >>> from gaitgraph.invertibility.geometry import Geometry
    >>> from gaitgraph.vehicle import PAPER
    >>> report = validate_geometry([[0, 0, 0, 0], [-0.3, 0.3, -0.3, 0.3]], Geometry.of_vehicle(PAPER))
    >>> report.flyable, round(report.checks[0].value, 4)
    (True, 0.3373)
    """
    tilts = geometry.tilt_axis.any(axis=1)
    angles = tuple(f"alpha{k + 1}" for k in np.flatnonzero(tilts))
    if not angles:
        raise InputError("tilt_axis must be other than zero for at least one rotor, got none that tilts")
    floor = checked_number("floor", floor)
    if isinstance(table, (str, Path)):
        pieces = list(read_pieces(table, progress=progress, angles=angles))
        alpha = np.zeros((sum(map(len, pieces)), len(tilts)))
        alpha[:, tilts] = np.vstack([np.column_stack([piece[name] for name in angles]) for piece in pieces])
    else:
        alpha = np.atleast_2d(np.asarray(table, dtype=float))
        if alpha.shape[1:] != tilts.shape or not np.isfinite(alpha).all():
            raise InputError(f"table must be finite angles of shape (n, {len(tilts)}), got shape {alpha.shape}")
    starts = alpha[:-1] if is_closed(alpha) else alpha
    ends = np.roll(starts, -1, axis=0)

    def check(name: str, ok: bool, found: str, advice: str, segment: int, fraction: float, **numbers: Any) -> Check:
        if fraction == 1.0:
            segment, fraction = (segment + 1) % len(starts), 0.0
        at = tuple((starts[segment] + fraction * (ends - starts)[segment]).tolist())
        place = GaitPoint(point=segment, fraction=fraction, alpha=at)
        message = found if ok else f"{found} at {place.described('row')}: {advice}"
        return Check(name=name, kind="flyable", ok=ok, message=message, where=place.as_mapping("row"), **numbers)

    lower, upper, *where = geometry.least_singular_value_along(starts, ends).worst()
    if lower < floor <= upper:
        lower, upper, *where = geometry.least_singular_value_along(starts, ends, tolerance=1e-6).worst()
    proven = (
        f"least singular value {figure(upper)} (proven lower bound {math.floor(1e4 * lower) / 1e4:g}, floor {floor:g})"
    )
    ok, advice = lower >= floor, "the thrusts alone cannot make every moment and the vertical force there"
    checks = [check("least_singular_value", ok, proven, advice, *where, value=upper, limit=floor)]
    if lower >= LEAST_DECIDED:
        lower, upper, *where = geometry.least_hover_thrust_along(starts, ends).worst()
        found, advice = f"least hover thrust {figure(upper)} of m·g", "a rotor would have to idle or to push down"
        checks.append(check("hover_thrust", lower > 0, found, advice, *where, value=upper, limit=0.0))
    beyond = np.maximum(geometry.tilt_range[:, 0] - starts, starts - geometry.tilt_range[:, 1])
    row, rotor = np.unravel_index(np.argmax(beyond), beyond.shape)
    low, high = np.degrees(geometry.tilt_range[rotor])
    found = f"α{rotor + 1} = {math.degrees(starts[row, rotor]):.4g}°, range {low:.4g}° to {high:.4g}°"
    if math.isfinite(beyond.max()):
        ok, advice = bool(beyond.max() <= 1e-12), "beyond the range of its servo"
        checks.append(check("tilt_range", ok, found, advice, int(row), 0.0, value=float(starts[row, rotor])))
    return GeometryReport(checks=tuple(checks), rows=len(alpha))
