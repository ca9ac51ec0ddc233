"""The commands that write another gait, a path, or a gait in other formats."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gaitgraph.cli import (
    PAPER_GAITS,
    Kind,
    Paths,
    Working,
    certificates_beside,
    check_outputs,
    command,
    file,
    flag,
    gait_in,
    named_in_errors,
    one_of,
    option,
    show,
    tell,
    warn_of_rate,
    write_outputs,
)
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.timing.joining import JoinedPath
    from gaitgraph.timing.time_optimal import LeastPeriod


@command(
    "A path from hover to a gait, back, or from gait to gait.",
    file("start", "FROM", "hover", *PAPER_GAITS),
    file("end", "TO", "hover", *PAPER_GAITS),
    option(
        "--duration",
        "SECONDS",
        "Duration of the path.  [default: 1, or what the limits need]",
    ),
    "samples rate law require outputs force vehicle coefficients json",
)
def transition_command(
    start: str,
    end: str,
    require: str = "flyable",
    outputs: Paths = (),
    force: bool = False,
    **given: Any,
) -> int:
    """Find a path on the surface from FROM to TO, each a gait file or the word hover.

    A table is left and joined at its first row, gait1 to gait4 at a corner. Where a gait is in motion at its first row,
    its clock starts slowly after the path, and stops slowly before it. The exit code is 1, with the proof, if there is no path: between R > 0, where
    hover is, and R < 0 every path passes a singular matrix. It is 1 too, with the reason and without outputs, if the path
    is not flyable, unless --require valid.
    """
    from gaitgraph.planning.transitions import transition
    from gaitgraph.timing.joining import HOVER

    check_outputs(outputs, force=force)
    with Working("searching a path"):
        ends = (
            HOVER if end.lower() == HOVER else gait_in(end, given)
            for end in (start, end)
        )
        found = transition(*ends, **given)
        meets = bool(found) and (require == "valid" or found.report.flyable)
        written = outputs if meets else ()
        if written:
            write_outputs(found.table, written, force=force, rate=given.get("rate"))
    return show(found, lines=[f"wrote {name}" for name in written], ok=meets)


@command(
    "The smooth gait through discs with the best worst case.",
    option(
        "--waypoint",
        "A1,A2",
        "Centre of a disc; repeat in order.",
        name="waypoints",
        multiple=True,
    ),
    option(
        "--radius",
        "ANGLE",
        "Radius of all discs; repeat it for one each.  [default: 0.1]",
        multiple=True,
    ),
    one_of("--objective", "singular_value", "hover_reserve"),
    "sign floor period",
    option("--pieces", "N", "Pieces of the spline.  [default: 12 for each waypoint]"),
    option(
        "--concession",
        "X",
        "Fraction of the worst case given up for less effort.  [default: 0.001]",
    ),
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
        raise InputError(
            "waypoints must be given with --waypoint A1,A2, got none", field="waypoints"
        )
    if len(given.get("radius", ())) == 1:
        given["radius"] = given["radius"][0]
    sampling = {name: given.pop(name) for name in ("samples", "rate") if name in given}
    check_outputs(outputs, force=force)
    checked_clock(given.get("period", 1.0), "smooth", **sampling)
    with Working("optimising"):
        found = optimal_gait(**given)
        if found and outputs:
            write_outputs(found.table(**sampling), outputs, force=force)
    return show(found)


_PERIOD = Kind(
    "a number of seconds or the word least",
    lambda text: None if text == "least" else float(text),
)


@command(
    "The least period of a gait under limits of the servos.",
    "gait_file",
    option(
        "--period",
        "SECONDS",
        "Period T, or least.  [default: least]",
        type=_PERIOD,
        words=["least"],
    ),
    option(
        "--max-rate", "ANGLE", "Largest tilt rate per second.  [default: the vehicle's]"
    ),
    option(
        "--max-acceleration", "ANGLE", "Per second squared.  [default: the vehicle's]"
    ),
    option("--max-jerk", "ANGLE", "Per second cubed.  [default: the vehicle's]"),
    option(
        "--rounding",
        "ANGLE",
        "Largest distance from a rounded corner.  [default: what the file says, else rest at corners]",
    ),
    option(
        "--servo-lag", "SECONDS", "Time constant.  [default: the vehicle's, if any]"
    ),
    "samples rate certify outputs require",
    flag("--anyway", "Write it although it is not flyable."),
    "force vehicle coefficients json",
)
def pace_command(
    gait_file: str,
    period: float | None = None,
    outputs: Paths = (),
    require: str = "flyable",
    anyway: bool = False,
    force: bool = False,
    **given: Any,
) -> int:
    """Find the time-optimal timing law of a gait file, a request's gait or gait1 to gait4, or one for a given period.

    A timing law maps time to position along the loop. This one is twice continuously differentiable, periodic, and
    keeps the limits between samples too. It rests at every corner unless corners are rounded. The exit code is 1 if no
    law meets the limits in the period. It is 1 too, and nothing is written, if outputs are asked for and the motion is
    not flyable (or not valid, with --require valid), unless --anyway.
    """
    from gaitgraph.certificates.making import certify
    from gaitgraph.timing.servo_lag import servo_response
    from gaitgraph.timing.timed_gait import table_of
    from gaitgraph.validation.report import unlikely_limits, verdict_of
    from gaitgraph.validation.validating import validate
    from gaitgraph.validation.worst import both

    check_outputs(outputs, force=force)
    beside = certificates_beside(outputs, force=force) if given.get("certify") else []
    names = {kind: f"max_{kind}" for kind in _LIMITS}
    names |= {"tolerance": "rounding", "lag": "servo_lag"}
    with Working(f"reading {gait_file}") as progress, named_in_errors(given, **names):
        pacing = _pacing(gait_file, period, given, progress)
        warnings = unlikely_limits(pacing.limits.as_mapping())
        more: dict[str, Any] = {
            **dict.fromkeys(verdict_of(None)),
            "servo": None,
            "outputs": [],
            "warnings": warnings,
        }
        lines = [f"warning: {warning}" for warning in warnings]
        timed = pacing.timed
        refused = False
        if timed is not None:
            table = table_of(timed)
            report = both(timed.check(), validate(table))
            meets = report.flyable if require == "flyable" else report.valid
            refused = bool(outputs) and not (meets or anyway)
            if refused:
                lines.append("nothing is written")
                outputs, beside = (), []
            more |= {**verdict_of(report), "outputs": list(outputs)}
            lines.append(f"  {report.verdict}")
            for warning in report.warnings:
                if warning not in warnings:
                    warnings.append(warning)
                    lines.append(f"warning: {warning}")
            if not report.flyable:
                lines.append(f"  not flyable: {report.reason}")
            lag = given.get("servo_lag", timed.gait.vehicle.servo_lag)
            if lag is not None:
                response = servo_response(timed, lag)
                more["servo"] = response.as_mapping()
                lines.append(f"  {response}")
            certified = [(path, certify(timed)) for path in beside]
            if outputs:
                write_outputs(
                    table,
                    outputs,
                    force=force,
                    rate=given.get("rate"),
                )
            lines += [f"wrote {name}: {timed.samples + 1} rows" for name in outputs]
            for path, one in certified:
                one.write(path, force=force)
                lines.append(f"wrote {path}")
    return show(pacing, more=more, lines=lines, ok=bool(pacing) and not refused)


_LIMITS = ("rate", "acceleration", "jerk")


def _pacing(
    gait_file: str,
    period: float | None,
    given: dict[str, Any],
    progress: Callable[[str], None],
) -> LeastPeriod:
    """Return the law of a gait file under the limits that are given, else those of the file and its vehicle."""
    from gaitgraph.timing.limits import limits_of
    from gaitgraph.timing.time_optimal import least_period, origin_of, paced

    origin = origin_of(
        gait_in(gait_file, given),
        vehicle=given.get("vehicle"),
        coefficients=given.get("coefficients"),
    )
    gait = origin.gait
    if gait.color not in ("red", "blue"):
        why = f"gaitgraph validate {gait_file} says why"
        remedy = f"{why}, gaitgraph retarget {gait_file} moves it there"
        raise InputError(
            f"{gait_file} must be a gait on one sheet, red or blue; {remedy}"
        )
    chosen = {kind: given.get(f"max_{kind}") for kind in _LIMITS}
    lag = given.get("servo_lag")
    limits = limits_of(gait.vehicle, origin.limits, servo_lag=lag, **chosen)
    asked = {"rounding": origin.rounding} | {
        name: given[name] for name in ("samples", "rate", "rounding") if name in given
    }
    progress("pacing")
    if period is None:
        return least_period(gait, limits, progress=progress, **asked)
    return paced(gait, limits, period=period, progress=progress, **asked)


@command(
    "The nearest flyable gait: rows moved as little as possible.",
    "gait_file sign floor",
    option(
        "--margin",
        "ANGLE",
        "Distance to keep from the flyable region's border.  [default: 0]",
    ),
    option(
        "--keep",
        "X",
        "Keep the shape, smaller by this factor.  [default: the nearest rows, however little moves]",
    ),
    "keep_in keep_out outputs force vehicle coefficients json",
)
def retarget_command(
    gait_file: str, outputs: Paths = (), force: bool = False, **given: Any
) -> int:
    """Move the rows of a gait table as little as possible so that the gait is valid and flyable.

    Rows need alpha1 to alpha4. A table with times keeps them. The exit code is 1, with the reason, if nothing is
    flyable, or if the vehicle's limits of tilt rate forbid the new gait at the given times.
    """
    from gaitgraph.optimization.retargeting import KEEP_HALF, retarget

    if given.get("sign") == "auto":
        del given["sign"]
    check_outputs(outputs, force=force)
    with Working(f"retargeting {gait_file}"):
        found = retarget(gait_in(gait_file, {}), **given)
        table = found.table
        if table is not None and outputs:
            write_outputs(table, outputs, force=force)
    if found.advice is not None:
        found = replace(found, advice=KEEP_HALF.command_line)
    return show(found, ok=found.after is not None and found.after.flyable)


def _map_names() -> list[str]:
    from gaitgraph.io.servo_map import PRESETS

    return list(PRESETS)


@command(
    "Write a gait file in other formats, or with another timing.",
    "gait_file",
    file("outputs", "OUTPUT...", nargs=-1, required=True),
    option(
        "--columns",
        "NAME_OR_FILE",
        "Joints of a servo table from elsewhere, as for --servos.",
        words=_map_names,
    ),
    option(
        "--servos",
        "NAME_OR_FILE",
        "Write positions of joints, by a preset or a TOML file.",
        words=_map_names,
    ),
    option(
        "--periods",
        "N",
        "Periods, one after the other; a C header and a film have one.  [default: 1]",
    ),
    flag(
        "--from-hover",
        "Enter it from hover, run --periods of it, and return, as one motion.",
    ),
    "require",
    flag("--anyway", "Write it although it is not flyable."),
    "once period samples rate law force vehicle coefficients json",
)
def export_command(
    gait_file: str,
    outputs: Paths,
    force: bool = False,
    servos: str | None = None,
    once: bool = False,
    from_hover: bool = False,
    **given: Any,
) -> int:
    """Write a gait file, a plan, a request's gait or gait1 to gait4 to OUTPUT files; their suffixes say the formats.

    A table with times keeps its rows; a path, as of a transition or with --once, is not closed. --samples and --rate
    sample the motion that the table states: its law, else what joins its rows. --period runs it faster or slower. Without
    times, or with --law, the polyline through the rows gets a new timing. With --servos the columns are positions of the
    vehicle's joints: order, sign, zero, degrees or pulse widths. Such files are read without an option, servo tables from
    elsewhere with --columns. What is written is judged: if it is not flyable (or not valid, with --require valid),
    nothing is written and the exit code is 1, unless --anyway. With --from-hover the flight is written from hover to hover,
    which is run once; with --period or --law of the gait.
    """
    from gaitgraph.io.exporting import export
    from gaitgraph.io.formats import tables_and_films
    from gaitgraph.io.servo_map import servo_map_named
    from gaitgraph.plots.films import check_films, write_films
    from gaitgraph.validation.report import lines_of_checks

    servo_map = None if servos is None else servo_map_named(servos)
    if "columns" in given:
        given["joints"] = servo_map_named(given.pop("columns"))
    tables, films = tables_and_films(outputs)
    check_films(films, force=force)
    with Working(f"exporting {gait_file}"):
        source = gait_in(gait_file, given, once=once, joints=given.get("joints"))
        if from_hover:
            source = _mission_of(source, given)
        done = export(source, tables, force=force, servos=servo_map, **given)
        if films:
            write_films(done.table, films, force=force)
        warn_of_rate(done.table["t"], given.get("rate"))
    rows = len(done.table)
    answer: dict[str, Any] = {
        "rows": rows,
        "columns": list(done.table.columns),
        "outputs": list(outputs),
        "valid": done.report.valid,
        "flyable": done.report.flyable,
        "not_judged": list(done.report.not_judged),
        "hover_power": done.report.hover_power,
        "warnings": list(done.report.warnings),
    }
    if done.rate_checks:
        answer["rate_checks"] = [check.as_mapping() for check in done.rate_checks]
    if servo_map:
        answer |= {"servos": servo_map.as_mapping(), "clipped": done.clipped}
    lines = []
    for name in outputs:
        count = (rows - 1) * given.get("periods", 1) + 1
        if name.lower().endswith(".h"):  # it repeats by itself
            count = rows
        content = "one period, drawn" if name in films else f"{count} rows"
        lines.append(f"wrote {name}: {content}")
    lines += lines_of_checks(done.rate_checks)
    lines += [done.report.verdict, *done.report.warning_lines]
    for joint, count in done.clipped.items():
        lines.append(f"clipped: joint {joint!r} at its limit in {count} of {rows} rows")
    return tell(answer, lines)


def _mission_of(source: Any, given: dict[str, Any]) -> JoinedPath:
    """Return the flight from hover to hover that options ask for, which are taken out of them."""
    from gaitgraph.planning.missions import mission
    from gaitgraph.timing.timed_gait import timed_gait_of

    of_gait = {
        name: given.pop(name)
        for name in ("period", "law", "vehicle", "coefficients")
        if name in given
    }
    if "period" in of_gait or "law" in of_gait:
        source = timed_gait_of(source, **of_gait)
        of_gait = {}
    count = {"periods": given.pop("periods")} if "periods" in given else {}
    return mission(
        source,
        rate=given.get("rate"),
        anyway=given.get("anyway", False),
        **count,
        **of_gait,
    )
