"""What holds for a curve beside its chords: the checks of a closed polyline, each with the difference taken off."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import Coefficients, coefficients_of
from gaitgraph.invertibility.segment_bounds import (
    least_level_determinant,
    least_singular_value_of_all,
    thrust_shares_along,
    thrusts_push_up,
)

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.validation.report import Check

__all__ = ["Beside"]

FloatArray = npt.NDArray[np.float64]

_SQRT2 = math.sqrt(2.0)


class Beside:
    """What a curve may differ by from the chords beside it, for each check of a gait."""

    def __init__(self, gait: Gait, extremes: FloatArray, chord: float) -> None:
        self.gait, self.extremes, self.chord = gait, extremes, chord

    def tightened(self, check: Check, floor: float) -> Check:
        """Return a check of the chords as a check of the curve."""
        how = {
            "R_sign": self._level_sign,
            "hover_thrust": self._hover_thrust,
            "thrust_limit": self._thrust_limit,
            "tilt_range": self._tilt_range,
        }
        if check.name == "least_singular_value":
            return self._singular_value(check, floor)
        return how[check.name](check) if check.name in how else check

    def _least_level(self, coefficients: Coefficients, sign: float) -> float:
        """Return a lower bound of sign·R on the curve.

        R is bilinear in the features of both pairs, each of norm √2 at most, as their slopes are; four angles move,
        by 2√2·chord in sum.
        """
        lower = least_level_determinant(self.gait.alpha, self.gait.ends, coefficients, sign=sign).lower.min()
        slope = 2.0 * float(np.linalg.norm(coefficients.bilinear_form, 2))
        return float(lower) - slope * 2.0 * _SQRT2 * self.chord

    def sign_kept(self, coefficients: Coefficients, sign: float) -> bool:
        """Return whether R keeps a sign along the curve."""
        return self._least_level(coefficients, sign) > 0

    def _level_sign(self, check: Check) -> Check:
        if not check.ok or not check.decided or check.value is None:
            return check
        sign = 1.0 if check.value > 0 else -1.0
        lower, resolution = self._least_level(self.gait.coefficients, sign), check.limit or 0.0
        if lower > resolution:
            message = f"R {'≥' if sign > 0 else '≤'} {sign * lower:.3g} along the whole curve"
            return replace(check, value=sign * lower, message=f"{message} ({self.gait.coefficients.kind} coefficients)")
        message = f"sign of R undecided: along the curve |R| may fall to {max(lower, 0.0):.2g}: try a smaller chord"
        return replace(check, value=sign * lower, message=message, decided=False)

    def _singular_value(self, check: Check, floor: float) -> Check:
        if not check.ok:
            return check
        vehicle = self.gait.vehicle
        lower = float(least_singular_value_of_all(self.gait.alpha, self.gait.ends, vehicle, tolerance=1e-6).lower.min())
        lower -= math.sqrt(2.0 + vehicle.drag_ratio**2) * _SQRT2 * self.chord
        if lower >= floor:
            message = f"least singular value at least {lower:.4f} along the whole curve, floor {floor:g}"
            return replace(check, value=lower, message=message)
        message = f"least singular value may fall to {max(lower, 0.0):.3g} along the curve, floor {floor:g}"
        return replace(check, ok=False, value=lower, message=f"{message}: keep away from it, or try a smaller chord")

    def _shares(self) -> tuple[float, float] | None:
        """Return bounds of the least and the largest thrust share on the curve, None where a rotor may idle.

        On red each factor of the zero-moment inputs depends on one coordinate, so the diagonal of the box around
        the curve decides for all of it. There T1/(m·g) = |sin β2|/(2D) with D = |sin β2| cos α1 + |sin β1| cos α2 =
        (κ cos³δ/2)·|R|/|cos β1 cos β2|, and D's slope is at most 2√2.
        """
        vehicle, gait = self.gait.vehicle, self.gait
        if gait.color != "red" or not thrusts_push_up(self.extremes[:1], self.extremes[1:], vehicle).all():
            return None
        kappa = vehicle.drag_ratio
        exact = coefficients_of(vehicle, "exact")
        sign = 1.0 if gait.R[0] > 0 else -1.0
        weight = self._least_level(exact, sign) * kappa / (2.0 * (1.0 + kappa**2) ** 1.5)
        upward, least, largest = thrust_shares_along(gait.alpha, gait.ends, vehicle, tolerance=1e-6)
        steep = 2.0 * _SQRT2 * self.chord / weight if weight > 0 else math.inf
        if not upward.all() or steep >= 0.5:
            return None
        high = (-float(largest.lower.min()) + self.chord / (2.0 * weight)) / (1.0 - steep)
        return float(least.lower.min()) - self.chord / (2.0 * weight) - steep * high, high

    def _hover_thrust(self, check: Check) -> Check:
        if not check.ok:
            return check
        shares = self._shares()
        if shares is None or shares[0] <= 0:
            message = "a rotor may have to idle to hover beside the chords: keep away from β1 = 0 and β2 = 0"
            return replace(check, ok=False, value=None, message=message)
        low, high = shares
        message = f"hover thrusts {low:.3f} to {high:.3f} of m·g per rotor along the whole curve, all positive"
        return replace(check, value=low, message=message)

    def _thrust_limit(self, check: Check) -> Check:
        shares, vehicle = self._shares(), self.gait.vehicle
        if not check.ok or shares is None or check.limit is None:
            return check
        mass, gravity = vehicle.require("mass", "gravity", purpose="the check of the largest thrust")
        newtons = shares[1] * mass * gravity
        message = f"largest hover thrust {newtons:.3g} N, limit {check.limit:.3g} N"
        return replace(check, ok=newtons <= check.limit, value=newtons, message=message)

    def _tilt_range(self, check: Check) -> Check:
        value, limit = float(np.abs(self.extremes).max()), float(check.limit or 0.0)
        ok = value <= limit + 1e-9
        message = f"largest tilt {math.degrees(value):.1f}°, limit {math.degrees(limit):.1f}°"
        return replace(check, ok=ok, value=value, message=message + ("" if ok else ": stay nearer to 0"))
