"""The command robustness: how far a gait can be tilted before its decoupling matrix is singular."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import Working, command, option, show


@command(
    "Tilt margin and acceptable attitudes, beside biased gaits.",
    "gait_file",
    option("--bias", "ETA", "Scale α3 and α4 by η in (0, 1]; repeatable.", multiple=True),
    option("--scale", "ETA", "Scale all four by η; repeatable.", multiple=True),
    option("--tilt", "ANGLE", "Report the least singular value within this tilt.  [default: 30deg]"),
    option("--tolerance", "X", "Fraction of attitudes that may be missed.  [default: 1e-5]"),
    option("--curves", "N", "Number of singular curves along the gait.  [default: 24]"),
    "angle_rounding vehicle coefficients json",
)
def robustness_command(gait_file: str, **given: Any) -> int:
    """Compute how far a gait can be tilted before its decoupling matrix is singular.

    Takes any table of alpha1 to alpha4, on the gait surfaces or not. Coefficients are exact unless published ones are
    asked for. Rows are joined by straight segments, and the last with the first.
    """
    from gaitgraph.robustness.biased import robustness_of

    with Working(f"tilting {gait_file}") as progress:
        report = robustness_of(gait_file, progress=progress, **given)
    return show(report, ok=True)
