"""The command optimize: the best smooth gait through discs."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import Paths, Working, check_outputs, command, one_of, option, show, write_outputs
from gaitgraph.errors import InputError


@command(
    "The smooth gait through discs with the best worst case, or the least tilt-rate effort.",
    option("--waypoint", "A1,A2", "Centre of a disc; repeat in order.", name="waypoints", multiple=True),
    option("--radius", "ANGLE", "Radius of all discs; repeat it for one each.  [default: 0.1]", multiple=True),
    one_of("--objective", "singular_value", "hover_reserve", "tilt_rate"),
    "sign floor period",
    option("--pieces", "N", "Pieces of the spline.  [default: 12 for each waypoint]"),
    option("--concession", "X", "Fraction of the worst case given up for less effort.  [default: 0.001]"),
    "samples rate keep_in keep_out outputs force vehicle coefficients json",
)
def optimize_command(outputs: Paths = (), force: bool = False, **given: Any) -> int:
    """Find the smooth closed gait that passes discs in order and is optimal along all of it.

    The answer says how far from the best possible it may be, and is checked between samples too. The exit code is 1,
    with the reason, if no flyable gait passes the discs.
    """
    from gaitgraph.optimization.optimize import optimal_gait
    from gaitgraph.timing.timed_gait import checked_clock

    if "waypoints" not in given:
        raise InputError("waypoints must be given with --waypoint A1,A2, got none")
    if len(given.get("radius", ())) == 1:
        given["radius"] = given["radius"][0]
    sampling = {name: given.pop(name) for name in ("samples", "rate") if name in given}
    check_outputs(outputs, force=force)
    checked_clock(given.get("period", 1.0), "smooth", **sampling)
    with Working("optimising"):
        found = optimal_gait(**given)
        if found and outputs:
            write_outputs(lambda: [found.table(**sampling)], outputs, force=force)
    return show(found)
