"""The command transition: a path on the surface from hover to a gait, back, or from gait to gait."""

from __future__ import annotations

from typing import Any

from gaitgraph.cli import PAPER_GAITS, Paths, Working, check_outputs, command, file, option, show, write_outputs


@command(
    "A path from hover to a gait, back, or from gait to gait.",
    file("start", "FROM", "hover", *PAPER_GAITS),
    file("end", "TO", "hover", *PAPER_GAITS),
    option("--duration", "SECONDS", "Duration of the path.  [default: 1, or what the limits need]"),
    "samples rate law require outputs force vehicle coefficients json",
)
def transition_command(
    start: str, end: str, require: str = "valid", outputs: Paths = (), force: bool = False, **given: Any
) -> int:
    """Find a path on the surface from FROM to TO, each a gait file or the word hover.

    A gait is left and joined at a corner. The exit code is 1, with the proof, if there is no path: between R > 0, where
    hover is, and R < 0 every path passes a singular matrix.
    """
    from gaitgraph.planning.transitions import HOVER, transition

    check_outputs(outputs, force=force)
    with Working("searching a path"):
        found = transition(*(HOVER if one.lower() == HOVER else one for one in (start, end)), **given)
        written = outputs if found else ()
        if written:
            write_outputs(lambda: [found.table()], written, force=force, rate=given.get("rate"))
    meets = found.report is not None and (require == "valid" or found.report.flyable)
    return show(found, lines=[f"wrote {name}" for name in written], ok=meets)
