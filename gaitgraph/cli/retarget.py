"""The command retarget: the flyable gait nearest to a table."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import Paths, Working, check_outputs, command, option, show, write_outputs


@command(
    "The nearest flyable gait: rows moved as little as possible.",
    "gait_file sign floor",
    option("--margin", "ANGLE", "Distance to keep from the flyable region's border.  [default: 0]"),
    option("--keep", "X", "Keep the shape, smaller by this factor.  [default: the nearest rows, however little moves]"),
    "keep_in keep_out outputs force vehicle coefficients json",
)
def retarget_command(gait_file: str, outputs: Paths = (), force: bool = False, **given: Any) -> int:
    """Move the rows of a gait table as little as possible so that the gait is valid and flyable.

    Rows need alpha1 to alpha4. A table with times keeps them. The exit code is 1, with the reason, if nothing is
    flyable, or if the vehicle's limits of tilt rate forbid the new gait at the given times.
    """
    from gaitgraph.optimization.retargeting import retarget

    if given.get("sign") == "auto":
        del given["sign"]
    check_outputs(outputs, force=force)
    with Working(f"retargeting {gait_file}"):
        found = retarget(gait_file, **given)
        table = found.table
        if table is not None and outputs:
            write_outputs(lambda: [table], outputs, force=force)
    return show(found, ok=found.after is not None and found.after.flyable)
