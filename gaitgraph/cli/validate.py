"""The command validate: check a gait file by every rule."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import Working, command, option, show


@command(
    "Check a gait file: every rule, with value, limit and place.",
    "gait_file require",
    option("--tolerance", "X", "Largest |Rφ|, |Rθ| on the surface.  [default: 0.002]"),
    "floor angle_rounding crossing_tolerance vehicle coefficients json",
)
def validate_command(gait_file: str, require: str = "valid", **given: Any) -> int:
    """Check a gait file of any format, the gait of a request, or gait1 to gait4, along its whole length.

    Rows need alpha1 to alpha4, or alpha1, alpha2 and color; the last row is joined with the first.
    The exit code is 1 if the gait is not valid (or not flyable, with --require flyable). CSV and Parquet files of any
    length are read piece by piece.
    """
    from gaitgraph.validation.validating import validate

    with Working(f"judging {gait_file}") as progress:
        report = validate(gait_file, progress=progress.part, **given)
    return show(report, ok=report.flyable if require == "flyable" else report.valid)
