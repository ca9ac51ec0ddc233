"""The command transition: a path on the surface from hover to a gait, back, or from gait to gait."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gaitgraph.cli import options
from gaitgraph.cli.terminal import Working, show
from gaitgraph.errors import InputError, did_you_mean


@options.command("A path from hover to a gait, back, or from gait to gait.")
@options.file("start", "FROM", "hover")
@options.file("end", "TO", "hover")
@options.option("--duration", "SECONDS", "Of the path.  [default: 1, or what the limits need]")
@options.sampling
@options.law
@options.divisions
@options.require
@options.outputs
@options.force
@options.setting
@options.as_json
def transition_command(
    start: str,
    end: str,
    require: str,
    outputs: tuple[str, ...] = (),
    force: bool = False,
    as_json: bool = False,
    **given: Any,
) -> int:
    """Find a path on the surface from FROM to TO, each a gait file or the word hover.

    A gait is left and joined at a corner. The exit code is 1, with the proof, if there is no path: between R > 0, where
    hover is, and R < 0 every flight passes a singular matrix.
    """
    from gaitgraph.io.reading import read_gait
    from gaitgraph.planning.transitions import HOVER, transition

    options.check_outputs(outputs, force=force)
    setting = {name: given.pop(name, None) for name in ("vehicle", "coefficients")}
    for name, one in (("FROM", start), ("TO", end)):
        hint = did_you_mean(one.lower(), [HOVER])
        if hint and one.lower() != HOVER and not Path(one).exists():
            raise InputError(f"{name} must be a gait file or the word hover, got {one!r}{hint}")
    with Working("searching a path"):
        ends: list[Any] = [HOVER if one.lower() == HOVER else read_gait(one, **setting) for one in (start, end)]
        if ends == [HOVER, HOVER]:
            given |= setting
        found = transition(ends[0], ends[1], **given)
        written = outputs if found else ()
        if written:
            options.write_outputs(found.pieces, written, force=force)
    show(found, as_json=as_json, lines=[f"wrote {name}" for name in written])
    meets = found.report is not None and (require == "valid" or found.report.flyable)
    return 0 if meets else 1
