"""Judge a gait: every check of valid and flyable in one report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph.checks import check_gait
from gaitgraph.reports import DEFAULT_FLOOR, DEFAULT_TOLERANCE, Report
from gaitgraph.timing import TimedGait

if TYPE_CHECKING:
    from gaitgraph.gait import Gait

__all__ = ["validate"]


def validate(
    gait: Gait | TimedGait,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    floor: float = DEFAULT_FLOOR,
    angle_rounding: float | None = None,
) -> Report:
    """Return every check of a gait; with a clock, those of tilt rates and accelerations too.

    Parameters
    ----------
    gait
        A gait, or a timed one.
    tolerance, floor, angle_rounding
        As for :func:`gaitgraph.checks.check_gait`.

    Returns
    -------
    Report
        Falsy when the gait is not valid; prints well; serialises by ``as_mapping``.

    Examples
    --------
    >>> from gaitgraph.gait import lift
    >>> report = validate(lift([(0.4, -0.4), (1.1, -1.1)], "blue"))
    >>> bool(report), report.flyable, report["R_sign"].decided
    (True, False, False)
    """
    if isinstance(gait, TimedGait):
        return gait.check(tolerance=tolerance, floor=floor, angle_rounding=angle_rounding)
    return check_gait(gait, tolerance=tolerance, floor=floor, angle_rounding=angle_rounding)
