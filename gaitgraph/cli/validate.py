"""The command validate: check a gait file by every rule."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import PAPER_GAITS, Working, command, option, print_problem, show, wants_json


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
    from gaitgraph.io.formats import holds_request, read_pieces
    from gaitgraph.validation.validating import validate

    with Working(f"judging {gait_file}"):
        report = validate(gait_file, **given)
    states_none = not (wants_json() or "vehicle" in given or gait_file in PAPER_GAITS or holds_request(gait_file))
    if states_none and "vehicle" not in next(read_pieces(gait_file)).about:
        print_problem("warning: the file states no vehicle: the paper's is taken; --vehicle names another")
    return show(report, ok=report.flyable if require == "flyable" else report.valid)
