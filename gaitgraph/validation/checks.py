"""Is a gait valid, and can it fly? All rules over the whole of it, in one report."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gaitgraph.angles import number_of
from gaitgraph.errors import InputError, shown
from gaitgraph.invertibility.matrices import DEFAULT_FLOOR
from gaitgraph.surface.sheets import DEFAULT_TOLERANCE
from gaitgraph.validation.report import Check, Report
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
from gaitgraph.validation.segments import Rule, Segments, Setting, segments_of

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait

_BLOCK = 1 << 14

CLOSED = Check(name="closed", kind="valid", ok=True, value=0.0, limit=0.0, message="closed by construction")
"""The check of a gait whose segment from the last corner to the first is implied."""


class Checker:
    """Applies all rules to the segments of a gait, in order, and returns the report."""

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

    def update(self, run: Segments) -> None:
        """Examine the next run of segments, in blocks so that memory stays bounded."""
        for start in range(0, len(run.alpha) - 1, _BLOCK):
            block = run[start : start + _BLOCK + 1]
            for rule in self.rules:
                rule.update(block)
            self.reach.update(block)

    def report(self, closed: Check = CLOSED) -> Report:
        """Return what was found; `closed` is the check of how the gait closes."""
        reachable, reachability = self.reach.answer()
        checks = (closed, *(check for rule in self.rules for check in rule.checks()))
        return Report(checks=checks, reachable_from_hover=reachable, reachability=reachability)


def checked_limits(tolerance: float, floor: float, angle_rounding: float | None) -> None:
    """Raise InputError unless the limits that a gait is judged by are finite and not negative."""
    for name, number in (("tolerance", tolerance), ("floor", floor), ("angle_rounding", angle_rounding)):
        if number is not None and not 0 <= number_of(number) < math.inf:
            raise InputError(f"{name} must be a finite number ≥ 0, got {shown(number)}")


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
        The gait; limits of its vehicle are checked where the vehicle states them. Rates need timing: see
        :meth:`gaitgraph.timing.timed_gait.TimedGait.check`.
    tolerance
        Largest |Rφ| and |Rθ| that count as on the surface, dimensionless; and how far from the sheet of its color
        a corner may lie [rad].
    floor
        Least singular value that a flyable gait must keep, dimensionless.
    angle_rounding
        Assumed error of each angle because it was printed or measured, e.g. 5e-4 for three decimals [rad]. By
        default it is inferred: the largest distance of α3 and α4 from the sheet of their color.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> report = check_gait(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red"))
    >>> report.valid, report.flyable, report.reachable_from_hover
    (True, True, False)
    """
    checked_limits(tolerance, floor, angle_rounding)
    checker = Checker(
        Setting(
            vehicle=gait.vehicle,
            coefficients=gait.coefficients,
            tolerance=tolerance,
            floor=floor,
            angle_rounding=angle_rounding,
            crossing_tolerance=gait.crossing_tolerance,
        )
    )
    checker.update(segments_of(gait))
    return checker.report()
