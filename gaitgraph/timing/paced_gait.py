"""A gait under a law of time that is a polynomial between knots: exact at every time, its peaks certain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.gait.gait import vertices
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE
from gaitgraph.timing.curve import lifted
from gaitgraph.timing.limits import KINDS, UNITS, Limits
from gaitgraph.timing.path_laws import peaks_of
from gaitgraph.timing.polynomials import derivative_of, values_of
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.validation.checks import check_gait
from gaitgraph.validation.report import Check, Report
from gaitgraph.validation.rules import limit_check

if TYPE_CHECKING:
    from gaitgraph.timing.curve import Curve
    from gaitgraph.validation.report import Check, Report

__all__ = ["PacedGait", "Touch"]

FloatArray = npt.NDArray[np.float64]

_WITHIN = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Touch:
    """Where a law runs at one of its limits.

    Parameters
    ----------
    kind
        "rate", "acceleration" or "jerk".
    joints
        The two opposite joints that move alike, (1, 3) or (2, 4).
    limit
        The limit [rad/s, rad/s² or rad/s³].
    share
        During what share of the period it is touched.
    t
        When it is first touched [s].
    alpha
        The tilt angles then, shape (4,) [rad].
    """

    kind: str
    joints: tuple[int, int]
    limit: float
    share: float
    t: float
    alpha: tuple[float, ...]

    @property
    def names(self) -> str:
        """The joints in words."""
        return " and ".join(f"α{joint}" for joint in self.joints)

    def where(self) -> dict[str, Any]:
        """Return when and where it is first touched, as plain values."""
        return {"t": self.t, "alpha": list(self.alpha)}

    def as_mapping(self) -> dict[str, Any]:
        """Return it as plain values, ready for JSON."""
        head = {"limit": self.kind, "joints": list(self.joints), "value": self.limit, "share": self.share}
        return head | {"where": self.where()}

    def __str__(self) -> str:
        return (
            f"{self.kind} of {self.names} at its limit {self.limit:.4g} {UNITS[self.kind]} during {self.share:.0%} of "
            "the period"
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PacedGait(TimedGait):
    """A timed gait whose law is twice continuously differentiable, closed at the seam, and polynomial between knots.

    It has all that :class:`gaitgraph.timing.timed_gait.TimedGait` offers, and is written to tables in the same way.

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
        shape (degree + 1, m, 2) [rad].
    limits
        What the law was made to respect.
    """

    curve: Curve | None
    widths: FloatArray
    tilts: FloatArray
    limits: Limits

    def __post_init__(self) -> None:
        for name in ("widths", "tilts"):
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def at_period(self, period: float, samples: int) -> PacedGait:
        """Return the same law with its time stretched to another period."""
        widths = self.widths * (period / self.period)
        return replace(self, period=period, samples=samples, widths=widths, law="paced")

    @property
    def knots(self) -> FloatArray:
        """Times between which the law is a polynomial, from 0 to the period, shape (m + 1,) [s]."""
        knots = np.concatenate([[0.0], np.cumsum(self.widths)])
        knots[-1] = self.period
        return np.asarray(knots)

    @property
    def corner_times(self) -> FloatArray:
        """The knots of the law [s]."""
        return self.knots

    def at(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tilt angles, rates and accelerations at any times; see :meth:`gaitgraph.timing.timed_gait.TimedGait.at`."""
        out = [self.derivative(t, order) for order in range(3)]
        return out[0], out[1], out[2]

    def derivative(self, t: npt.ArrayLike, order: int) -> FloatArray:
        """Return a derivative of the tilt angles by time, shape (..., 4); the third jumps at knots.

        Parameters
        ----------
        t
            Times, shape (...) [s].
        order
            0 for angles, 1 for rates, and so on.
        """
        phase = np.asarray(np.mod(np.asarray(t, dtype=float), self.period))
        knots = self.knots
        piece = np.clip(np.searchsorted(knots, phase, side="right") - 1, 0, len(knots) - 2)
        h = self.widths[piece]
        share = (phase - knots[piece]) / h
        plane = values_of(derivative_of(self.tilts, order)[:, piece], share) / h[..., None] ** order
        return self._lifted(plane, order)

    def _lifted(self, plane: FloatArray, order: int) -> FloatArray:
        gait = self.gait
        return lifted(plane, gait.color or "red", gait.alpha[0, :2], gait.coefficients, derivative=order)

    def _colors_at(self, t: FloatArray) -> tuple[str, ...]:
        return (self.gait.color or "red",) * len(t)

    def peaks(self, order: int) -> FloatArray:
        """Return the largest size of a derivative over the period, shape (4,); certain between samples too.

        An upper bound, from Bernstein coefficients; what is attained is closer to it the more knots there are.
        """
        plane = peaks_of(self.widths, self.tilts, order).max(axis=0)
        return np.concatenate([plane, plane])

    def peak_rates(self) -> FloatArray:
        """Return the largest |dαᵢ/dt| over the period, between samples too, shape (4,) [rad/s]."""
        return self.peaks(1)

    def peak_accelerations(self) -> FloatArray:
        """Return the largest |d²αᵢ/dt²| over the period, between samples too, shape (4,) [rad/s²]."""
        return self.peaks(2)

    def peak_jerks(self) -> FloatArray:
        """Return the largest |d³αᵢ/dt³| over the period, between knots, where it jumps, shape (4,) [rad/s³]."""
        return self.peaks(3)

    def limits_touched(self, within: float = _WITHIN) -> tuple[Touch, ...]:
        """Return which limits the law runs at, and during what share of the period.

        Parameters
        ----------
        within
            How near to a limit counts as touching it, as a share of the limit.
        """
        h, knots = self.widths, self.knots
        out = []
        for order, kind in enumerate(KINDS, start=1):
            if self.limits.of(kind) is None:
                continue
            peaks, limits = peaks_of(self.widths, self.tilts, order), self.limits.in_plane(kind)
            for joint in range(2):
                touched = (peaks[:, joint] >= limits[joint] * (1 - within)) & (peaks[:, joint] > 0)
                if touched.any():
                    t = float(knots[int(np.argmax(touched))])
                    out.append(
                        Touch(
                            kind=kind,
                            joints=(joint + 1, joint + 3),
                            limit=float(limits[joint]),
                            share=float(h[touched].sum() / self.period),
                            t=t,
                            alpha=tuple(self.derivative(t, 0).tolist()),
                        )
                    )
        return tuple(out)

    def vertices(self, tolerance: float = 1e-9) -> FloatArray:
        """Return the vertices by equations (16) to (19) over the whole period; a rounded loop may have none."""
        if self.curve is None:
            return self.gait.vertices(tolerance)
        return vertices(np.vstack([self.gait.alpha, self.curve.at(self.curve.turning_points())]), tolerance)

    def check(
        self,
        *,
        tolerance: float = DEFAULT_TOLERANCE,
        floor: float = DEFAULT_FLOOR,
        angle_rounding: float | None = None,
    ) -> Report:
        """Return every check of the path, along the curve itself, and those of rates, accelerations and jerks."""
        if self.curve is None:
            report = check_gait(self.gait, tolerance=tolerance, floor=floor, angle_rounding=angle_rounding)
        else:
            report = self.curve.check(tolerance=tolerance, floor=floor)
        return report.with_checks(self.rate_checks())

    def rate_checks(self, noun: str = "period", share: float = 1.0) -> tuple[Check, ...]:
        """Return the checks that need a clock; see :meth:`gaitgraph.timing.timed_gait.TimedGait.rate_checks`."""
        vehicle = self.gait.vehicle
        stated = (vehicle.max_tilt_rate, vehicle.max_tilt_acceleration, vehicle.max_tilt_jerk)
        checks = []
        for order, (kind, limit) in enumerate(zip(KINDS, stated, strict=True), start=1):
            if limit is None and kind != "rate":
                continue
            peaks = self.peaks(order)
            peak = float(peaks.max())
            needed = self.period * share * (peak / (limit or peak or 1.0)) ** (1 / order)
            advice = f"this law needs a {noun} of at least {np.ceil(needed * 1000) / 1000:.3f} s"
            checks.append(
                limit_check(f"tilt_{kind}", UNITS[kind], peak, int(np.argmax(peaks)) + 1, limit, None, advice)
            )
        return tuple(checks)
