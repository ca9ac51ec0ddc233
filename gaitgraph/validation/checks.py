"""Is a gait valid, and can it fly? All rules over the whole of it, in one report."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.surface.sheets import family_codes
from gaitgraph.validation.pieces import Rule, Setting, Stretch
from gaitgraph.validation.report import DEFAULT_FLOOR, DEFAULT_TOLERANCE, Check, Report
from gaitgraph.validation.rules import (
    Continuous,
    HoverThrust,
    LevelSign,
    OnSurface,
    Reach,
    SingularValue,
    TiltRange,
    TwoColor,
)

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait

__all__ = ["CLOSED", "Judge", "check_gait", "checked_limits", "stretch_of"]

_BLOCK = 1 << 14

CLOSED = Check(name="closed", kind="valid", ok=True, value=0.0, limit=0.0, message="closed by construction")
"""The check of a gait whose way back from the last corner to the first is implied."""


class Judge:
    """Sees a gait as stretches, in order, and reports; see :mod:`gaitgraph.validation.pieces`."""

    def __init__(self, setting: Setting) -> None:
        continuous = Continuous(setting)
        self.rules: list[Rule] = [
            OnSurface(setting),
            TwoColor(setting),
            continuous,
            LevelSign(setting, continuous),
            SingularValue(setting, continuous),
            HoverThrust(setting, continuous),
            TiltRange(setting),
        ]
        self.reach = Reach(setting, continuous)

    def see(self, stretch: Stretch) -> None:
        """Take in the next stretch; long ones are looked at in blocks, so that memory stays bounded."""
        last = len(stretch.alpha) - 1
        for start in range(0, last, _BLOCK):
            block = stretch[start : start + _BLOCK + 1]
            for rule in self.rules:
                rule.see(block)
            self.reach.see(block)

    def report(self, closed: Check = CLOSED) -> Report:
        """Return what was found; `closed` is the check of how the gait closes."""
        reachable, reachability = self.reach.answer()
        checks = (closed, *(check for rule in self.rules for check in rule.checks()))
        return Report(checks=checks, reachable_from_hover=reachable, reachability=reachability)


def checked_limits(tolerance: float, floor: float, angle_rounding: float | None) -> None:
    """Raise InputError unless what a gait is judged by are finite numbers that are not negative."""
    for name, number in (("tolerance", tolerance), ("floor", floor), ("angle_rounding", angle_rounding)):
        if number is not None and not 0 <= number_of(number) < math.inf:
            raise InputError(f"{name}: {shown(number)}; allowed is a finite number ≥ 0")


def check_gait(
    gait: Gait,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
) -> Report:
    """Return every check of valid and flyable for a gait, and whether it can be reached from hover.

    Parameters
    ----------
    gait
        The gait; limits of its vehicle are checked where the vehicle states them. Rates need a clock: see
        :meth:`gaitgraph.timing.timed_gait.TimedGait.check`.
    tolerance
        Largest |Rφ| and |Rθ| that count as on the surface, dimensionless; and how far from the sheet of its color
        a corner may lie [rad].
    floor
        Least singular value that a flyable gait must keep, dimensionless.
    angle_rounding
        What each angle may be off by because it was printed or measured, e.g. 5e-4 for three decimals [rad]. By
        default what is seen: the largest distance of α3 and α4 from the sheet of their color.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = check_gait(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"))
    >>> report.valid, report.flyable, report.reachable_from_hover
    (True, True, False)
    """
    checked_limits(tolerance, floor, angle_rounding)
    judge = Judge(
        Setting(
            vehicle=gait.vehicle,
            coefficients=gait.coefficients,
            tolerance=tolerance,
            floor=floor,
            angle_rounding=angle_rounding,
            crossing_tolerance=gait.crossing_tolerance,
        )
    )
    judge.see(stretch_of(gait))
    return judge.report()


def stretch_of(gait: Gait) -> Stretch:
    """Return a gait, with its way back to the first corner, as one stretch."""
    sheet = family_codes(gait.colors) if gait.colors else np.zeros(len(gait.alpha), dtype=np.int8)
    return Stretch(alpha=np.vstack([gait.alpha, gait.alpha[:1]]), sheet=np.append(sheet, sheet[0]), after=0)
