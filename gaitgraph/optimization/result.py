"""The result of an optimisation: a smooth curve in time with the measures of its optimality."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import Infeasible
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, ROWS_OF_A_PIECE, Table, merged
from gaitgraph.invertibility.matrices import Coefficients, level_determinant
from gaitgraph.surface.adjacency import text_from_types
from gaitgraph.surface.sheets import types_of
from gaitgraph.timing.timed_gait import checked_clock
from gaitgraph.timing.timing_laws import derivative_of
from gaitgraph.validation.report import RATE_UNITS, Check, Report, limit_check, lines_of_checks, verdict_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.gait.gait import Gait
    from gaitgraph.timing.curve import Curve

FloatArray = npt.NDArray[np.float64]
Objective = Literal["singular_value", "hover_reserve", "tilt_rate"]

OBJECTIVES = ("singular_value", "hover_reserve", "tilt_rate")
"""What a gait can be optimal in, the default first."""

_CHORD = 1e-4
_UNITS = {"singular_value": "", "hover_reserve": " of m·g", "tilt_rate": " rad²/s"}
_SAID = {
    "singular_value": "least singular value along the gait",
    "hover_reserve": "hover reserve along the gait",
    "tilt_rate": "tilt-rate effort",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimality:
    """How good a gait is, in its own words; everything here can be checked without the search.

    Parameters
    ----------
    gap
        What a better gait could gain at most, as a fraction of the bound (a worst case), or of the value (effort).
    stationarity
        What is left of the slope of the effort when the active constraints are taken off, as a fraction of it: zero at
        a point that meets the first-order (Karush–Kuhn–Tucker) conditions; 0 for a gait that stands still.
    violation
        How far the gait passes outside a disc, at most [rad]; of the region it is never outside.
    active
        What holds the gait, in words.
    """

    gap: float
    stationarity: float
    violation: float
    active: tuple[str, ...]

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return {
            "gap": self.gap,
            "stationarity": self.stationarity,
            "violation": self.violation,
            "active": list(self.active),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class OptimalGait:
    """The answer to :func:`optimal_gait`: a smooth gait with its own measures, or why there is none. Truthy with one.

    Parameters
    ----------
    objective
        One of :data:`OBJECTIVES`.
    waypoints, radius
        Centres, shape (n, 2), and radii, shape (n,), of the discs to pass [rad]; repeated ones merged.
    period
        T [s].
    reason
        Why there is no gait, or why it is not flyable; None if it is.
    sign
        Sign of R: "positive" or "negative"; None without a gait.
    curve
        The gait as a smooth curve; its parameter is the time [s].
    report
        All checks, along the whole curve.
    value, bound
        What was reached, certain along the whole curve; and what no gait can better: an upper bound of a worst case,
        a lower bound of effort.
    effort
        ∫ ‖α̇‖² dt over the period [rad²/s].
    optimality
        How good the gait is.
    passed, times
        Where, shape (n, 4) [rad], and when, shape (n,) [s], the discs are passed.
    history
        The effort of every loop on the way, the last one the gait's [rad²/s].
    warnings
        What deserves attention.
    """

    objective: Objective
    waypoints: FloatArray
    radius: FloatArray
    period: float
    reason: str | None
    sign: str | None = None
    curve: Curve | None = None
    report: Report | None = None
    value: float | None = None
    bound: float | None = None
    effort: float | None = None
    optimality: Optimality | None = None
    passed: FloatArray | None = None
    times: FloatArray | None = None
    history: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """Whether a gait was "found", or it is "infeasible"."""
        return "infeasible" if self.curve is None else "found"

    def __bool__(self) -> bool:
        return self.curve is not None

    def _found(self) -> Curve:
        if self.curve is None:
            raise Infeasible(self.reason)
        return self.curve

    @property
    def gait(self) -> Gait:
        """The gait as a closed polyline, its corners on the curve and nowhere farther than 1e-4 rad from it.

        Raises
        ------
        Infeasible
            If there is none; the message is the reason.
        """
        return self._found().polyline(_CHORD)

    def table(self, *, samples: int | None = None, rate: float | None = None) -> Table:
        """Return the gait table: even samples of the curve, with exact rates and accelerations.

        Parameters
        ----------
        samples, rate
            As for :func:`gaitgraph.timing.timed_gait.parametrize`.

        Raises
        ------
        Infeasible
            If there is no gait.
        InputError
            If a value is not allowed.
        """
        return merged(self.pieces(samples=samples, rate=rate))

    def pieces(
        self, *, samples: int | None = None, rate: float | None = None, rows: int = ROWS_OF_A_PIECE
    ) -> Iterator[Table]:
        """Yield :meth:`table` as consecutive pieces, so that any length fits in memory.

        Parameters
        ----------
        samples, rate
            As for :meth:`table`.
        rows
            Of a piece, at least 2; the last one may have one more.
        """
        curve = self._found()
        count = checked_clock(self.period, "smooth", samples=samples, rate=rate)
        about = {
            "vehicle": curve.vehicle.as_mapping(),
            "coefficients": curve.coefficients.kind,
            "crossing_tolerance": curve.crossing_tolerance,
            "period": self.period,
            "made_by": "optimize",
            "objective": self.objective,
            "waypoints": self.waypoints.tolist(),
            "radius": self.radius.tolist(),
        }
        end = count + 1
        first: dict[str, Any] = {}
        for start in range(0, end - 1, rows):
            stop = end if end - (start + rows) <= 1 else start + rows
            number = np.arange(start, stop)
            t = number * (self.period / count)
            t[number == count] = self.period
            alpha, rates, accelerations = (curve.at(t * (curve.span / self.period), k) + 0.0 for k in range(3))
            columns = {"t": t} | red_columns(alpha, curve.coefficients, curve.crossing_tolerance)
            columns |= dict(zip(RATES, rates.T.copy(), strict=True))
            columns |= dict(zip(ACCELERATIONS, accelerations.T.copy(), strict=True))
            first = first or columns
            if stop == end:  # the last row is the first again, bit by bit
                for name in ("R", *ANGLES, *RATES, *ACCELERATIONS):
                    columns[name][-1] = first[name][0]
            yield Table(columns=columns, about=about)

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON; a saved one can be read as a gait file."""
        verdict = self.report.as_mapping() if self.report is not None else {}
        gait = self.gait if self.curve is not None else None
        return {
            "status": self.status,
            "reason": self.reason,
            "objective": self.objective,
            "sign": self.sign,
            "waypoints": self.waypoints.tolist(),
            "radius": self.radius.tolist(),
            "period": self.period,
            "value": self.value,
            "bound": self.bound,
            "effort": self.effort,
            "length": None if self.curve is None else self.curve.length,
            "optimality": None if self.optimality is None else self.optimality.as_mapping(),
            "passed": [] if self.passed is None else self.passed.tolist(),
            "times": [] if self.times is None else self.times.tolist(),
            "history": list(self.history),
            "path": [] if gait is None else gait.alpha.tolist(),
            "colors": [] if gait is None else list(gait.colors),
            "valid": verdict.get("valid", False),
            "flyable": verdict.get("flyable", False),
            "reachable_from_hover": verdict.get("reachable_from_hover", False),
            "checks": verdict.get("checks", []),
            "warnings": [*self.warnings, *verdict.get("warnings", [])],
        }

    def __repr__(self) -> str:
        if self.curve is None:
            return f"<OptimalGait: infeasible, {len(self.waypoints)} discs>"
        return f"<OptimalGait: {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        if self.curve is None or self.report is None or self.optimality is None:
            return f"no gait: {self.reason}"
        what, unit = _SAID[self.objective], _UNITS[self.objective]
        comparison = "at most" if self.objective != "tilt_rate" else "at least"
        lines = [
            f"{what} {self.value:.4f}{unit}; any gait through these discs has {comparison} {self.bound:.4f}{unit}",
            f"R {'> 0' if self.sign == 'positive' else '< 0'}, length {self.curve.length:.4f} rad, effort "
            f"{self.effort:.4f} rad²/s over {self.period:g} s; first-order residual "
            f"{self.optimality.stationarity:.1e}, held by {', '.join(self.optimality.active) or 'nothing'}",
            verdict_line(self.report.valid, self.report.flyable, self.report.reachable_from_hover),
            *lines_of_checks(self.report.checks),
            *(f"warning: {warning}" for warning in self.warnings),
        ]
        return "\n".join(lines)


def red_columns(alpha: FloatArray, coefficients: Coefficients, crossing_tolerance: float) -> dict[str, Any]:
    """Return the columns of rows on the red sheet, shape (n, 4) [rad]: angles, color, types, R."""
    types = types_of("red", alpha[:, 0], alpha[:, 1], coefficients, crossing_tolerance)
    return {
        **dict(zip(ANGLES, alpha.T.copy(), strict=True)),
        "color": ("red",) * len(alpha),
        "types": tuple(text_from_types(int(a), int(b)) for a, b in zip(*types, strict=True)),
        "R": np.array(level_determinant(alpha, coefficients)),
    }


def rate_checks(curve: Curve) -> list[Check]:
    """Return the checks of tilt rate and, where the vehicle limits them, acceleration and jerk, exact along the curve.

    On a cubic piece a rate is a parabola, largest at an end or at its tip, an acceleration is linear, a jerk constant.
    """
    period, width = curve.span, np.diff(curve.breaks)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        tip = -curve.pieces[1] / (3 * curve.pieces[0])
    tip = np.clip(np.nan_to_num(tip, nan=0.0, posinf=0.0, neginf=0.0), 0.0, width)
    checks = []
    for order, (kind, unit) in enumerate(RATE_UNITS.items(), start=1):
        limit: float | None = getattr(curve.vehicle, f"max_tilt_{kind}")
        if order > 1 and limit is None:
            continue
        derivative = derivative_of(curve.pieces, order)
        peaks = np.max([np.abs(np.polyval(derivative, at)) for at in (0 * width, tip, width)], axis=0)
        piece, joint = divmod(int(np.argmax(peaks)), 2)
        peak = float(peaks[piece, joint])
        needed = period * (peak / limit) ** (1 / order) if limit else period
        advice = f"a period of at least {math.ceil(needed * 1000) / 1000:.3f} s would do"
        checks.append(limit_check(f"tilt_{kind}", unit, peak, joint + 1, limit, None, advice))
    return checks
