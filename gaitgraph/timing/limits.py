"""Limits of tilt rate, acceleration and jerk, for each joint, and timed gaits whose law keeps them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown
from gaitgraph.gait.gait import vertices
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE
from gaitgraph.timing.curve import lifted
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.timing.timing_laws import derivative_of, peaks_of, values_of
from gaitgraph.validation.report import RATE_UNITS

if TYPE_CHECKING:
    from gaitgraph.timing.curve import Curve
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]
Limit = float | str | Sequence[float | str] | FloatArray | None


@dataclass(frozen=True, slots=True, kw_only=True, init=False, eq=False)
class Limits:
    """Largest sizes of the derivatives of the tilt angles.

    Parameters
    ----------
    rate, acceleration, jerk
        One number for all four joints or one for each, radians per second (per second squared, cubed) or texts such
        as "200deg"; None where there is no limit. At least one of acceleration and jerk: with a rate limit alone the
        least period of a smooth law is not attained. Zero is allowed: then a joint must stand still.

    Raises
    ------
    InputError
        If a value is not a number that is at least zero, or neither acceleration nor jerk is limited.

    Examples
    --------
    >>> Limits(rate="180deg", acceleration=40).rate.round(4).tolist()
    [3.1416, 3.1416, 3.1416, 3.1416]
    """

    rate: FloatArray | None
    acceleration: FloatArray | None
    jerk: FloatArray | None

    def __init__(self, *, rate: Limit = None, acceleration: Limit = None, jerk: Limit = None) -> None:
        if acceleration is None and jerk is None:
            reason = "under a rate limit alone no smooth law is the fastest"
            raise InputError(f"limits must have an acceleration or a jerk, got neither: {reason}")
        for (kind, unit), value in zip(RATE_UNITS.items(), (rate, acceleration, jerk), strict=True):
            numbers = None
            if value is not None:
                rule = f"{kind} must be 0, or 1e-9 to 1e12 {unit}, or four such numbers, or texts such as '200deg'"
                parts = [value] * 4 if isinstance(value, str) or np.ndim(value) == 0 else list(value)  # type: ignore[arg-type]
                try:
                    numbers = np.array([angle_from_text(part, kind) for part in parts])
                except InputError as error:
                    raise InputError(f"{rule}, got {shown(value)}") from error
                allowed = (numbers == 0) | ((numbers >= 1e-9) & (numbers <= 1e12))
                if numbers.shape != (4,) or not allowed.all():
                    raise InputError(f"{rule}, got {shown(value)}")
                numbers.flags.writeable = False
            object.__setattr__(self, kind, numbers)

    def in_plane(self, kind: str) -> FloatArray:
        """Return the limits of a kind for α1 and α2, whose opposite joints move as much, shape (2,), or infinity."""
        value: FloatArray | None = getattr(self, kind)
        return np.full(2, np.inf) if value is None else np.minimum(value[:2], value[2:])

    def completed(self, extent: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return rate, acceleration and jerk limits of α1 and α2 with the finite ones that follow, each of shape (2,).

        Landau's and Kolmogorov's inequalities bound the derivatives of a bounded motion by each other, with x within
        ±extent/2: |ẋ|² ≤ extent·|ẍ|, |ẍ|² ≤ 2|ẋ|·|x⃛| and |ẍ|³ ≤ (3/2)·extent·|x⃛|². So these are no further limits.
        The extent is by how much α1 and α2 vary over the whole motion, shape (2,) [rad].
        """
        rate, acceleration, jerk = (self.in_plane(kind) for kind in RATE_UNITS)
        with np.errstate(invalid="ignore", over="ignore"):
            acceleration = np.minimum(acceleration, np.cbrt(1.5 * extent * jerk**2))
            acceleration = np.fmin(acceleration, np.sqrt(2.0 * rate * jerk))
            rate = np.minimum(rate, np.sqrt(extent * acceleration))
        return rate, acceleration, jerk

    def as_mapping(self) -> dict[str, Any]:
        """Return the limits as plain values: a number where all joints share it."""
        values = {kind: getattr(self, kind) for kind in RATE_UNITS}
        return {
            kind: float(value[0]) if np.ptp(value) == 0 else value.tolist()
            for kind, value in values.items()
            if value is not None
        }


def limits_of(vehicle: Vehicle, *, rate: Limit = None, acceleration: Limit = None, jerk: Limit = None) -> Limits:
    """Return the limits that a vehicle states, except those that are given.

    >>> from gaitgraph.vehicle import PAPER
    >>> limits_of(PAPER.replace(max_tilt_rate=6.0), acceleration=60).as_mapping()
    {'rate': 6.0, 'acceleration': 60.0}
    """
    return Limits(
        rate=vehicle.max_tilt_rate if rate is None else rate,
        acceleration=vehicle.max_tilt_acceleration if acceleration is None else acceleration,
        jerk=vehicle.max_tilt_jerk if jerk is None else jerk,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Touch:
    """Where a law runs at one of its limits."""

    kind: str  # "rate", "acceleration" or "jerk"
    joints: tuple[int, int]  # the opposite joints that move alike, (1, 3) or (2, 4)
    limit: float  # [rad/s, rad/s² or rad/s³]
    share: float  # of the period, during which it is touched
    t: float  # when it is first touched [s]
    alpha: tuple[float, ...]  # the tilt angles then [rad]

    def as_mapping(self) -> dict[str, Any]:
        """Return it as plain values, ready for JSON."""
        return {
            "limit": self.kind,
            "joints": list(self.joints),
            "value": self.limit,
            "share": self.share,
            "where": {"t": self.t, "alpha": list(self.alpha)},
        }

    @property
    def names(self) -> str:
        """The joints in words."""
        return f"α{self.joints[0]} and α{self.joints[1]}"

    def __str__(self) -> str:
        return (
            f"{self.kind} of {self.names} at its limit {self.limit:.4g} {RATE_UNITS[self.kind]} during "
            f"{self.share:.0%} of the period"
        )


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
        shape (degree + 1, m, 2) [rad].
    limits
        What the law was made to keep.
    """

    curve: Curve | None
    widths: FloatArray
    tilts: FloatArray
    limits: Limits

    def at_period(self, period: float, samples: int) -> LimitedGait:
        """Return the same law with its time stretched to another period."""
        widths = self.widths * (period / self.period)
        return replace(self, period=period, samples=samples, widths=widths, law="paced")

    @property
    def corner_times(self) -> FloatArray:
        """The knots, between which the law is a polynomial, from 0 to the period, shape (m + 1,) [s]."""
        knots = np.concatenate([[0.0], np.cumsum(self.widths)])
        knots[-1] = self.period
        return np.asarray(knots)

    def at(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tilt angles, rates and accelerations at any times; see :meth:`TimedGait.at`."""
        return self.derivative(t, 0), self.derivative(t, 1), self.derivative(t, 2)

    def derivative(self, t: npt.ArrayLike, order: int) -> FloatArray:
        """Return a derivative of the tilt angles at times of shape (...) [s]; the third jumps at knots."""
        phase = np.asarray(np.mod(np.asarray(t, dtype=float), self.period))
        knots, gait = self.corner_times, self.gait
        piece = np.clip(np.searchsorted(knots, phase, side="right") - 1, 0, len(knots) - 2)
        h = self.widths[piece]
        share = (phase - knots[piece]) / h
        plane = values_of(derivative_of(self.tilts, order)[:, piece], share) / h[..., None] ** order
        return lifted(plane, gait.color or "red", gait.alpha[0, :2], gait.coefficients, derivative=order)

    def peaks(self, order: int) -> FloatArray:
        """Return the largest size of a derivative of each angle over the period, between samples too, shape (4,).

        An upper bound, from Bernstein coefficients; what is attained is closer to it the more knots there are.
        """
        plane = peaks_of(self.widths, self.tilts, order).max(axis=0)
        return np.concatenate([plane, plane])

    def limits_touched(self, within: float = 0.01) -> tuple[Touch, ...]:
        """Return which limits the law runs at to within a share of them, and during what share of the period."""
        out = []
        for order, kind in enumerate(RATE_UNITS, start=1):
            peaks, limits = peaks_of(self.widths, self.tilts, order), self.limits.in_plane(kind)
            for joint in range(2):
                touched = (peaks[:, joint] >= limits[joint] * (1 - within)) & (peaks[:, joint] > 0)
                if touched.any():
                    t = float(self.corner_times[int(np.argmax(touched))])
                    out.append(
                        Touch(
                            kind=kind,
                            joints=(joint + 1, joint + 3),
                            limit=float(limits[joint]),
                            share=float(self.widths[touched].sum() / self.period),
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
            return TimedGait.check(self, tolerance=tolerance, floor=floor, angle_rounding=angle_rounding)
        return self.curve.check(tolerance=tolerance, floor=floor).with_checks(self.rate_checks())
