"""Gaits whose law keeps limits: polynomials of time between knots, closed and twice differentiable."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self, Unpack

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import figure
from gaitgraph.arrays import read_only
from gaitgraph.gait.table import RATE_UNITS
from gaitgraph.invertibility.forms import FloatArray
from gaitgraph.timing.curve import Curve, Rounding, lifted
from gaitgraph.timing.polynomials import peaks_of, value_at
from gaitgraph.timing.timed_gait import Motion, TimedGait

if TYPE_CHECKING:
    from gaitgraph import later
    from gaitgraph.gait.gait import Gait


@dataclass(frozen=True, slots=True, kw_only=True)
class TouchedLimit:
    """A limit that a law reaches."""

    limit: str  # "rate", "acceleration" or "jerk"
    joints: list[int]  # 1 and 3, or 2 and 4, which move alike; one on a curved sheet
    value: float  # of the limit [rad/s, rad/s² or rad/s³]
    share: float  # share of the period spent at the limit
    where: dict[str, Any]  # the first time at it, t [s], and then the angles, alpha

    @property
    def angles(self) -> str:
        """The names of the joints."""
        return " and ".join(f"α{joint}" for joint in self.joints)

    def __str__(self) -> str:
        limit = f"{figure(self.value)} {RATE_UNITS[self.limit]}"
        during = f"during {100 * self.share:.0f} % of the period"
        return f"{self.limit} of {self.angles} at its limit {limit} {during}"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False, eq=False)
class LimitedGait(TimedGait):
    """A timed gait that keeps limits; its law is closed, twice differentiable, and polynomial between knots.

    Parameters
    ----------
    gait
        A polyline: the gait itself if the law rests at its corners, else points of the curve.
    period, law, samples
        As for a timed gait; the law is named "least-period" or "paced".
    curve
        The curve that is run, or None for a polyline.
    widths
        Widths of the intervals of time between knots, shape (m,) [s]; they add up to the period.
    tilts
        (α1, α2) on these intervals as polynomials of the share of the interval that has passed, highest power first,
        shape (degree + 1, m, 2) [rad]; on a curved sheet all four angles, shape (degree + 1, m, 4).
    limits
        The limits that the law keeps: rate, acceleration and jerk of these, shape (3, 2) or (3, 4), infinite for none.
    stretch
        Factor, minus 1, by which time was stretched to keep the limits between samples too.
    rounding
        The gait whose rounded corners are the curve; None for a polyline, and for a curve of another kind.
    """

    curve: Curve | None
    widths: FloatArray
    tilts: FloatArray
    limits: FloatArray
    stretch: float = 0.0
    rounding: Rounding | None = None

    @property
    def made_from(self) -> dict[str, Any]:
        """The corners, and their rounding [rad]; see :attr:`TimedGait.made_from`.

        A law under a jerk limit along rounded corners takes too long to be found again.
        """
        if self.curve is None:
            return super(LimitedGait, self).made_from  # slots make a new class
        under_jerk = bool(np.isfinite(self.limits[2]).any())
        if self.rounding is None or under_jerk:
            return {}
        corners = self.rounding.gait.alpha.tolist()
        return {"corners": corners, "rounding": self.rounding.tolerance}

    def with_gait(self, gait: Gait) -> Self:
        """Return the same law for another vehicle, or other coefficients, of a gait; see :meth:`TimedGait.with_gait`."""
        curve = self.curve
        if curve is not None:
            curve = replace(
                curve,
                vehicle=gait.vehicle,
                coefficients=gait.coefficients,
                crossing_tolerance=gait.crossing_tolerance,
            )
        return replace(self, gait=gait, curve=curve)

    @property
    def made_for(self) -> dict[str, list[float]]:
        """The limits that the law keeps; see :attr:`TimedGait.made_for`."""
        return {
            kind: np.resize(limits, 4).tolist()  # opposite joints have the same
            for kind, limits in zip(RATE_UNITS, self.limits, strict=True)
            if np.isfinite(limits).all()
        }

    def with_period(self, period: float) -> Self:
        """Return the same law over another period [s], named "paced"; its limits are as they were, its peaks are not."""
        widths = self.widths * (period / self.period)
        return replace(self, law="paced", period=float(period), widths=widths)

    @property
    def corner_times(self) -> FloatArray:
        """The knots, between which the law is a polynomial, from 0 to the period, shape (m + 1,) [s]."""
        times = np.concatenate([[0.0], np.cumsum(self.widths[:-1]), [self.period]])
        return read_only(times)

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return tilt angles, rates and accelerations at any times; see :meth:`TimedGait.at`."""
        return Motion(*(self.derivative(t, order) for order in range(3)))

    def derivative(self, t: npt.ArrayLike, order: int) -> FloatArray:
        """Return a derivative of the tilt angles at times of shape (...) [s]; the third one jumps at knots."""
        gait = self.gait
        tilts = value_at(self.tilts, self.corner_times, self.widths, t, order)
        color = gait.color or "red"
        return lifted(tilts, color, gait.alpha[0, :2], gait.coefficients, order)

    def peaks_between_knots(self, order: int) -> FloatArray:
        """Return upper bounds of a derivative of `tilts` between knots, shape (m, 2) or (m, 4)."""
        return peaks_of(self.tilts, self.widths, order)

    def peaks(self, order: int) -> FloatArray:
        """Return upper bounds from Bernstein coefficients; they are the sharper the more knots there are."""
        return np.resize(self.peaks_between_knots(order).max(axis=0), 4)

    def limits_touched(self, within: float = 0.01) -> tuple[TouchedLimit, ...]:
        """Return the limits that the law comes within a share of, and for what share of the period."""
        touches = []
        for order, kind in enumerate(RATE_UNITS, start=1):
            peaks = self.peaks_between_knots(order)
            touched = (peaks >= self.limits[order - 1] * (1 - within)) & (peaks > 0)
            for joint in np.flatnonzero(touched.any(axis=0)).tolist():
                t = float(self.corner_times[int(np.argmax(touched[:, joint]))])
                seconds = self.widths[touched[:, joint]].sum()
                touch = TouchedLimit(
                    limit=kind,
                    joints=[*range(joint + 1, 5, peaks.shape[1])],
                    value=float(self.limits[order - 1, joint]),
                    share=float(seconds / self.period),
                    where={"t": t, "alpha": self.derivative(t, 0).tolist()},
                )
                touches.append(touch)
        return tuple(touches)

    def vertices(self, tolerance: float = 1e-9) -> FloatArray:
        """Return the corners of the loop; a curve has them only where it turns back on its line."""
        if self.curve is None:
            return self.gait.vertices(tolerance)
        at = self.curve.turning_points()
        speed = np.linalg.norm(self.curve.at(at, 1), axis=1)
        return self.curve.at(at[speed <= tolerance])

    def check(self, **options: Unpack[later.CheckOptions]) -> later.Report:
        """Return every check of the path, along the curve itself, and those of rates, accelerations and jerks."""
        return (self.curve or self.gait).check(**options).with_timing(self)
