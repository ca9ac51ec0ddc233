"""The command line: parse, make one library call, print or write.

Exit codes: 0 done; 1 well-formed, and the answer is no; 2 wrong input or something missing, one line on standard
error and nothing on standard output; 130 interrupted. Data goes to standard output, messages to standard error.
Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

import io
import json
import os
import re
import sys
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

import click

from gaitgraph import __version__
from gaitgraph.errors import GaitgraphError, InputError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

__all__ = ["main"]

_NEGATIVE_ANGLE = re.compile(r"-\s*(?:\d|\.|pi|π|inf|nan)", re.IGNORECASE)
_MINUS = "−"  # stands for the hyphen of a negative angle while the arguments are parsed


def _unmarked(value: Any) -> Any:
    """Give a marked argument its hyphen back."""
    return "-" + value[1:] if isinstance(value, str) and value.startswith(_MINUS) else value


class _Command(click.Command):
    """A command whose arguments may be negative angles as they stand; there are no short options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        valued = {
            name
            for option in self.params
            if isinstance(option, click.Option) and not option.is_flag
            for name in option.opts
        }
        marked = [
            _MINUS + arg[1:] if _NEGATIVE_ANGLE.match(arg) and before not in valued else arg
            for before, arg in zip(["", *args], args, strict=False)
        ]
        rest = super().parse_args(ctx, marked)
        for name, value in ctx.params.items():
            if isinstance(value, tuple):
                ctx.params[name] = tuple(map(_unmarked, value))
            else:
                ctx.params[name] = _unmarked(value)
        return rest


class _Group(click.Group):
    command_class = _Command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if self.get_command(ctx, name) is None and not name.startswith("-"):
            known = self.list_commands(ctx)
            hint = did_you_mean(name, known) or f"; allowed are {', '.join(known)}"
            raise click.UsageError(f"no command {name!r}{hint}")
        return super().resolve_command(ctx, args)


def _setting(command: Callable[..., int]) -> Callable[..., int]:
    """Add the options that every command has."""
    command = click.option(
        "--coefficients",
        type=click.Choice(["published", "exact"]),
        help="Coefficients of formula (1); published for the paper's own vehicle, exact for any other.",
    )(command)
    return click.option("--vehicle", metavar="NAME_OR_FILE", help="A preset (see gaitgraph vehicles) or a TOML file.")(
        command
    )


_json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")


_force_option = click.option("--force", is_flag=True, help="Overwrite outputs that exist.")

_outputs_option = click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="FILE",
    help="Write the gait table (.csv, .json); repeatable.",
)

_crossing_option = click.option(
    "--crossing-tolerance",
    metavar="ANGLE",
    help="Distance from a crossing line within which a type is '?'.  [default: pi/32]",
)


def _sampling(command: Callable[..., int]) -> Callable[..., int]:
    options = (
        click.option("--period", type=float, metavar="SECONDS", help="Period T.  [default: 1]"),
        click.option("--samples", type=int, metavar="N", help="Even intervals per period.  [default: 100]"),
        click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples."),
        click.option("--law", metavar="NAME", help="smooth, constant-speed or equal-time.  [default: smooth]"),
        _force_option,
    )
    for option in reversed(options):
        command = option(command)
    return command


def _print_json(content: Any) -> None:
    click.echo(json.dumps(content, allow_nan=False))


@click.group(cls=_Group, context_settings={"max_content_width": 100})
@click.version_option(__version__, prog_name="gaitgraph")
def cli() -> None:
    """Plan gaits of a tilt-rotor that keep its decoupling matrix invertible.

    Angles are numbers in radians or texts such as 3pi/8, -3*pi/8 or 67.5deg.
    """


@cli.command(short_help="Plan a closed gait through (α1, α2) waypoints.")
@click.argument("request_file", metavar="[REQUEST.toml]", required=False)
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="A waypoint; repeat in order.")
@click.option("--color", metavar="NAME", help="auto, red or blue.  [default: auto]")
@click.option("--sign", metavar="NAME", help="Sign of R: auto, positive or negative.  [default: auto]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@click.option("--objective", metavar="NAME", help="shortest or robust.  [default: shortest]")
@click.option("--method", metavar="NAME", help="grid: the paper's grid graph.  [default: grid]")
@click.option("--any-order", is_flag=True, help="Visit the waypoints in the order that is shortest.")
@click.option("--reverse", is_flag=True, help="Run the loop the other way.")
@_outputs_option
@_sampling
@_setting
@_json_option
def plan(
    request_file: str | None,
    waypoints: Sequence[str],
    outputs: Sequence[str],
    force: bool,
    as_json: bool,
    **options: Any,
) -> int:
    """Plan a closed gait through (α1, α2) waypoints, in order and back to the first.

    The request comes from a TOML or JSON file, from options, or from both: options replace what the file says.
    The exit code is 1, with the reason, if there is no such gait.
    """
    from gaitgraph.planning import plan as answer
    from gaitgraph.requests import read_request, request_from_mapping
    from gaitgraph.summary import text_of_plan
    from gaitgraph.tables import check_outputs, table_of, write_tables
    from gaitgraph.timing import checked_clock

    asked = {name: value for name, value in options.items() if value is not None and value is not False}
    if waypoints:
        asked["waypoints"] = [_waypoint(text, number) for number, text in enumerate(waypoints, start=1)]
    if request_file is not None:
        request, sampling = read_request(request_file, asked)
    elif waypoints:
        request, sampling = request_from_mapping(asked)
    else:
        raise InputError("waypoints: none given; allowed is a request file, or --waypoint A1,A2 at least once")
    check_outputs(outputs, force=force)
    checked_clock(request.period, request.law, **sampling)
    result = answer(request, progress=_progress(at_once=request.divisions > _MANY_DIVISIONS))
    if result and outputs:
        write_tables(table_of(result.timed(**sampling), {"request": request.as_mapping()}), outputs, force=force)
    if as_json:
        _print_json(result.as_mapping())
    else:
        click.echo(text_of_plan(result, written=tuple(outputs) if result else ()))
    return 0 if result else 1


@cli.command(name="validate", short_help="Judge a gait file: every rule, with value, limit and place.")
@click.argument("gait_file", metavar="GAIT_FILE")
@click.option(
    "--require",
    type=click.Choice(["valid", "flyable"]),
    default="valid",
    help="What decides the exit code.  [default: valid]",
)
@click.option("--tolerance", type=float, metavar="X", help="Largest |Rφ|, |Rθ| on the surface.  [default: 0.002]")
@click.option("--floor", type=float, metavar="X", help="Least singular value to keep.  [default: 0.05]")
@click.option("--angle-rounding", metavar="ANGLE", help="What each angle may be off by.  [default: what is seen]")
@_crossing_option
@_setting
@_json_option
def validate_command(
    gait_file: str, require: str, vehicle: str | None, coefficients: Any, as_json: bool, **limits: Any
) -> int:
    """Judge a gait table (.csv, .json) or a saved plan, along its whole length.

    Rows need alpha1 to alpha4, or alpha1, alpha2 and color; the way back to the first row is implied. The exit code
    is 1 if the gait is not valid (or not flyable, with --require flyable). A CSV file of any length is read piece by
    piece.
    """
    from gaitgraph.validation import validate
    from gaitgraph.vehicle import vehicle_named

    for name in ("angle_rounding", "crossing_tolerance"):
        if limits[name] is not None:
            limits[name] = _angle_not_negative(limits[name], name)
    given = {name: value for name, value in limits.items() if value is not None}
    with _bar(gait_file) as progress:
        report = validate(
            gait_file,
            vehicle=None if vehicle is None else vehicle_named(vehicle),
            coefficients=coefficients,
            progress=progress,
            **given,
        )
    if as_json:
        _print_json(report.as_mapping())
    else:
        click.echo(str(report))
    return 0 if (report.flyable if require == "flyable" else report.valid) else 1


@cli.command(name="colorings", short_help="Every Two-Color-consistent colouring of a loop.")
@click.argument("loop_file", metavar="GAIT_FILE_OR_REQUEST")
@click.option("--sign", metavar="NAME", help="Sign of R: auto (both), positive or negative.  [default: auto]")
@click.option("--limit", type=click.IntRange(0, 10**9), metavar="N", help="List so many at most; all are counted.")
@_crossing_option
@_setting
@_json_option
def colorings_command(
    loop_file: str,
    sign: str | None,
    limit: int | None,
    crossing_tolerance: str | None,
    vehicle: str | None,
    coefficients: Any,
    as_json: bool,
) -> int:
    """List every colouring of a closed loop of (α1, α2) that obeys the Two Color rule.

    The loop is that of a gait table, of a table of alpha1 and alpha2 alone, or of a request's waypoints. The exit
    code is 1, with the first pair of neighbours that forbids it, if there is none.
    """
    from itertools import islice

    from gaitgraph.exchange import colorings_of_file
    from gaitgraph.vehicle import vehicle_named

    reach = None if crossing_tolerance is None else _angle_not_negative(crossing_tolerance, "crossing_tolerance")
    found = colorings_of_file(
        loop_file,
        sign=sign,
        vehicle=None if vehicle is None else vehicle_named(vehicle),
        coefficients=coefficients,
        crossing_tolerance=reach,
    )
    shown = islice(found, limit)
    if as_json:
        # Written one by one: there may be more than fit in memory.
        head = json.dumps({"points": found.points.tolist(), **found.as_mapping()}, allow_nan=False)
        click.echo(f'{head[:-1]}, "colorings": [', nl=False)
        signs: list[str] = []
        for coloring in shown:
            click.echo((", " if signs else "") + json.dumps(list(coloring.colors)), nl=False)
            signs.append(coloring.sign)
        click.echo(f'], "coloring_signs": {json.dumps(signs)}}}')
    else:
        click.echo(str(found))
        for coloring in shown:
            click.echo(f"  {coloring}")
        if limit is not None and found.count > limit:
            click.echo(f"  … {limit} of them shown")
    return 0 if found else 1


@cli.command(name="cycles", short_help="Closed cycles of the graph, shortest first.")
@click.argument("request_file", metavar="[REQUEST.toml]", required=False)
@click.option("--waypoint", "waypoints", multiple=True, metavar="A1,A2", help="Only through these; repeat in order.")
@click.option("--any-order", is_flag=True, help="Through the waypoints in any order.")
@click.option("--keep-in", multiple=True, metavar="POLYGON", help='Only inside: "A1,A2 A1,A2 A1,A2 …"; repeatable.')
@click.option("--keep-out", multiple=True, metavar="POLYGON", help="Only outside; repeatable.")
@click.option("--max-length", metavar="ANGLE", help="No longer ones, in the (α1, α2) plane.")
@click.option("--limit", type=click.IntRange(1, 10**9), default=20, metavar="N", help="So many.  [default: 20]")
@click.option("--color", metavar="NAME", help="auto (both), red or blue.  [default: auto]")
@click.option("--sign", metavar="NAME", help="Sign of R: auto (both), positive or negative.  [default: auto]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@click.option(
    "--require",
    type=click.Choice(["flyable", "valid", "two_color"]),
    default="valid",
    help="Which edges of the graph count.  [default: valid]",
)
@click.option(
    "--effort", type=click.IntRange(min=1), metavar="STEPS", help="Give up then, telling the bound.  [default: none]"
)
@_setting
@_json_option
def cycles_command(
    request_file: str | None,
    waypoints: Sequence[str],
    max_length: str | None,
    limit: int,
    require: Any,
    effort: int | None,
    as_json: bool,
    **options: Any,
) -> int:
    """List simple closed cycles of the surface graph, the shortest first, each with its verdict.

    They are found one by one and printed at once, as text or as one JSON object a line; interrupt as you like. With
    waypoints, from options or a request file, only cycles that pass them. The exit code is 1 if there is none.
    """
    from itertools import islice
    from math import isfinite

    from gaitgraph.catalog import catalog
    from gaitgraph.requests import PlanRequest, read_request, request_from_mapping, stated_fields

    asked = {name: value for name, value in options.items() if value not in (None, False, ())}
    for name in ("keep_in", "keep_out"):
        if name in asked:
            asked[name] = [_polygon(text, name) for text in asked[name]]
    if waypoints:
        asked["waypoints"] = [_waypoint(text, number) for number, text in enumerate(waypoints, start=1)]
    through = bool(waypoints) or (request_file is not None and "waypoints" in stated_fields(request_file))
    if not through:
        # The whole region counts; a request has at least one waypoint, which then plays no part.
        asked["waypoints"] = [(0.0, 0.0)]
    request: PlanRequest = (request_from_mapping(asked) if request_file is None else read_request(request_file, asked))[
        0
    ]
    longest = None if max_length is None else _angle_not_negative(max_length, "max_length")
    found = catalog(
        request,
        through=through,
        max_length=longest,
        use=require,
        effort=effort,
        progress=_progress(at_once=request.divisions > _MANY_DIVISIONS),
    )
    for note in found.notes:
        click.echo(f"warning: {note}", err=True)
    for cycle in islice(found, limit):
        if as_json:
            _print_json(cycle.as_mapping())
        else:
            click.echo(str(cycle))
    if found.found:
        click.echo(found.told(), err=True)
        return 0
    best, bound, reason = found.best(effort=effort or 1_000_000)
    if best is not None:
        exact = best.length <= bound
        if as_json:
            _print_json({**best.as_mapping(), "exact": exact, "bound": bound})
        else:
            click.echo(str(best))
        proof = "a shortest one" if exact else f"not proven shortest: none is shorter than {bound:.4f} rad"
        click.echo(f"the best one found, {proof}", err=True)
        return 0
    if as_json:
        unknown = {} if found.complete else {"bound": bound if isfinite(bound) else None}
        _print_json({"status": "none" if found.complete else "unfinished", "reason": reason, **unknown})
    else:
        click.echo(f"{'No cycle' if found.complete else 'Unfinished'}: {reason}")
    return 1


def _polygon(text: str, name: str) -> list[list[str]]:
    corners = [corner.split(",") for corner in text.split()]
    if any(len(corner) != 2 for corner in corners):
        flag = "--" + name.replace("_", "-")
        raise InputError(f"{flag}: {text!r}; allowed is 'A1,A2 A1,A2 A1,A2 …'")
    return corners


@cli.command(name="robustness", short_help="Tilt margin and acceptable attitudes, beside biased gaits.")
@click.argument("gait_file", metavar="GAIT_FILE")
@click.option("--bias", type=float, multiple=True, metavar="ETA", help="Scale α3 and α4 by η in (0, 1]; repeatable.")
@click.option("--scale", type=float, multiple=True, metavar="ETA", help="Scale all four by η; repeatable.")
@click.option("--tilt", metavar="ANGLE", help="Tilt to ask the least singular value within.  [default: 30deg]")
@click.option("--tolerance", type=float, metavar="X", help="Fraction of attitudes that may be missed.  [default: 1e-5]")
@click.option("--curves", type=int, metavar="N", help="Singular curves at so many places.  [default: 24]")
@click.option("--angle-rounding", metavar="ANGLE", help="What each angle may be off by.  [default: what is seen]")
@_setting
@_json_option
def robustness_command(
    gait_file: str,
    tilt: str | None,
    angle_rounding: str | None,
    vehicle: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Say how far a gait can be tilted before its decoupling matrix is singular.

    Works on any table of alpha1 to alpha4, on the gait surfaces or not. Judged with exact coefficients unless published
    ones are asked for. The file's rows are joined by straight segments, and the last with the first.
    """
    from gaitgraph.angles import angle_from_text
    from gaitgraph.robustness import robustness_of
    from gaitgraph.vehicle import vehicle_named

    if tilt is not None:
        options["tilt"] = angle_from_text(tilt, "--tilt")
    if angle_rounding is not None:
        options["angle_rounding"] = _angle_not_negative(angle_rounding, "angle_rounding")
    report = robustness_of(
        gait_file,
        vehicle=None if vehicle is None else vehicle_named(vehicle),
        **{name: value for name, value in options.items() if value is not None},
    )
    if as_json:
        _print_json(report.as_mapping())
    else:
        click.echo(str(report))
    return 0


@cli.command(name="transition", short_help="A way from hover to a gait, back, or from gait to gait.")
@click.argument("start", metavar="FROM")
@click.argument("end", metavar="TO")
@click.option("--duration", type=float, metavar="SECONDS", help="One way.  [default: 1, or what the limits need]")
@click.option("--samples", type=int, metavar="N", help="Even intervals.  [default: 100]")
@click.option("--rate", type=float, metavar="HZ", help="Samples per second, instead of --samples.")
@click.option("--law", metavar="NAME", help="smooth, constant-speed or equal-time.  [default: smooth]")
@click.option("--divisions", type=int, metavar="N", help="Grid pieces of [−π/2, π/2].  [default: 16]")
@click.option(
    "--require",
    type=click.Choice(["valid", "flyable"]),
    default="valid",
    help="What decides the exit code.  [default: valid]",
)
@_outputs_option
@_force_option
@_setting
@_json_option
def transition_command(
    start: str,
    end: str,
    require: str,
    outputs: Sequence[str],
    force: bool,
    vehicle: str | None,
    coefficients: Any,
    as_json: bool,
    **options: Any,
) -> int:
    """Find a way on the surface from FROM to TO, each a gait file or the word hover.

    A gait is left and joined at a corner. The exit code is 1, with the proof, if there is no way: between R > 0, where
    hover is, and R < 0 every flight passes a singular matrix.
    """
    from gaitgraph.exchange import read_gait
    from gaitgraph.tables import check_outputs
    from gaitgraph.transitions import HOVER, transition
    from gaitgraph.vehicle import vehicle_named

    check_outputs(outputs, force=force)
    setting = {"vehicle": None if vehicle is None else vehicle_named(vehicle), "coefficients": coefficients}
    ends: list[Any] = [HOVER if one.lower() == HOVER else read_gait(one, **setting) for one in (start, end)]
    given = {name: value for name, value in options.items() if value is not None}
    if ends == [HOVER, HOVER]:
        given |= setting
    result = transition(ends[0], ends[1], **given)
    if result and outputs:
        result.write(*outputs, force=force)
    if as_json:
        _print_json(result.as_mapping())
    else:
        click.echo(str(result))
        for name in outputs if result else ():
            click.echo(f"wrote {name}")
    meets = result.report is not None and (require == "valid" or result.report.flyable)
    return 0 if meets else 1


def _angle_not_negative(text: str, name: str) -> float:
    """Return an option's angle [rad]; InputError if it is none, or negative."""
    from gaitgraph.angles import angle_from_text

    flag = "--" + name.replace("_", "-")
    angle = angle_from_text(text, flag)
    if angle < 0:
        raise InputError(f"{flag}: {text!r}; allowed is an angle ≥ 0")
    return angle


@contextmanager
def _bar(label: str) -> Iterator[Callable[[float], None] | None]:
    """Show a progress bar on a terminal once work takes longer than a second; nothing for a pipe."""
    if not sys.stderr.isatty():
        yield None
        return

    from time import monotonic

    start, steps = monotonic(), 1000
    with ExitStack() as stack:
        bars: list[Any] = []

        def show(fraction: float) -> None:
            if not bars and monotonic() - start > 1.0:
                bars.append(stack.enter_context(click.progressbar(length=steps, label=label, file=sys.stderr)))
            for bar in bars:
                bar.update(max(int(fraction * steps) - bar.pos, 0))

        yield show


def _waypoint(text: str, number: int) -> list[str]:

    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(f"waypoint {number}: {text!r}; allowed is A1,A2")
    return [part.strip() for part in parts]


_MANY_DIVISIONS = 128


def _progress(*, at_once: bool = False) -> Callable[[str], None] | None:
    """Return what shows progress on a terminal once work takes longer than a second; nothing for a pipe."""
    if not sys.stderr.isatty():
        return None

    from time import monotonic

    start = monotonic()

    def show(text: str) -> None:
        if at_once or monotonic() - start > 1.0:
            click.echo(f"{text} …", err=True)

    return show


@cli.command(name="roots", short_help="Every (α3, α4) on the gait surfaces for one (α1, α2).")
@click.argument("a1", metavar="A1")
@click.argument("a2", metavar="A2")
@_crossing_option
@_setting
@_json_option
def roots_command(
    a1: str,
    a2: str,
    crossing_tolerance: str | None,
    vehicle: str | None,
    coefficients: Any,
    as_json: bool,
) -> int:
    """Print every root (α3, α4) of Rφ = Rθ = 0 for one (α1, α2), with plane types, color and R."""
    from dataclasses import asdict

    from gaitgraph.angles import angle_from_text, text_from_angle
    from gaitgraph.invertibility import coefficients_of
    from gaitgraph.surface import DEFAULT_CROSSING_TOLERANCE, roots
    from gaitgraph.vehicle import PAPER, vehicle_named

    numbers = coefficients_of(PAPER if vehicle is None else vehicle_named(vehicle), coefficients)
    tolerance = DEFAULT_CROSSING_TOLERANCE
    if crossing_tolerance is not None:
        tolerance = _angle_not_negative(crossing_tolerance, "crossing_tolerance")
    alpha1, alpha2 = angle_from_text(a1, "alpha1"), angle_from_text(a2, "alpha2")
    found = roots(alpha1, alpha2, numbers, crossing_tolerance=tolerance)
    if as_json:
        rows = []
        for root in found:
            row = asdict(root)
            del row["alpha1"], row["alpha2"]
            rows.append(row)
        fibers = [asdict(fiber) for fiber in found.fibers]
        _print_json({"alpha1": alpha1, "alpha2": alpha2, "roots": rows, "fibers": fibers})
        return 0
    click.echo(f"(α1, α2) = ({text_from_angle(alpha1)}, {text_from_angle(alpha2)}), {numbers.kind} coefficients")
    click.echo("  color  types            α3            α4             R")
    for root in found:
        click.echo(f"  {root.color:<5}  {root.types}  {root.alpha3:12.6f}  {root.alpha4:12.6f}  {root.R:12.6g}")
    for fiber in found.fibers:
        fixed = ", ".join(f"{value:.6f}" for value in fiber.values)
        note = "; singular at every attitude" if fiber.singular else ""
        click.echo(f"  and a continuum {fiber.types}: {fiber.fixed} = {fixed}, {fiber.free} free{note}")
    return 0


@cli.command(name="export", short_help="Write a gait file in other formats, or with another clock.")
@click.argument("gait_file", metavar="GAIT_FILE")
@click.argument("outputs", metavar="OUTPUT...", nargs=-1, required=True)
@_sampling
@_setting
@_json_option
def export_command(
    gait_file: str,
    outputs: Sequence[str],
    vehicle: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Read a gait table or a saved plan and write it to OUTPUT files (.csv, .json).

    A table with a clock keeps its rows. Without one, or with --period, --samples, --rate or --law, the closed
    polyline through the rows gets a new clock.
    """
    from gaitgraph.exchange import export
    from gaitgraph.vehicle import vehicle_named

    table = export(gait_file, outputs, vehicle=None if vehicle is None else vehicle_named(vehicle), **options)
    if as_json:
        _print_json({"rows": len(table), "columns": list(table.columns), "outputs": list(outputs)})
        return 0
    for name in outputs:
        click.echo(f"wrote {name}: {len(table)} rows of {', '.join(table.columns)}")
    return 0


@cli.command(short_help="List the vehicles that come with the package, or show one.")
@_setting
@_json_option
def vehicles(vehicle: str | None, coefficients: Any, as_json: bool) -> int:
    """List the preset vehicles with their drag ratio κ and crossing angle δ, or show the one of --vehicle."""
    from gaitgraph.invertibility import coefficients_of
    from gaitgraph.vehicle import preset_names, vehicle_named

    rows = []
    for name in preset_names() if vehicle is None else [vehicle]:
        one = vehicle_named(name)
        delta = coefficients_of(one, coefficients).delta
        rows.append({**one.as_mapping(), "delta": delta})
    if as_json:
        _print_json({"vehicles": rows})
        return 0
    for row in rows:
        click.echo(f"{row['name']}: κ = {row['drag_ratio']:.6f}, δ = {row['delta']:.6f} rad")
        for name, value in row.items():
            if name not in ("name", "drag_ratio", "delta"):
                click.echo(f"    {name} = {value}")
    return 0


@cli.command(name="figures", short_help="Draw the figures of the paper, and two that it lacks.")
@click.option("--only", multiple=True, metavar="N", help="1 to 22, 9-14, regions or gait; repeatable.  [default: all]")
@click.option("--out", metavar="DIR", default="figures", help="Folder, made if need be.  [default: figures]")
@click.option(
    "--format", "formats", multiple=True, metavar="NAME", help="png, svg or pdf; repeatable.  [default: png, svg]"
)
@click.option("--gait", "gait_file", metavar="GAIT_FILE", help="What the figure gait shows.  [default: Gait 3]")
@_force_option
@_setting
@_json_option
def figures_command(
    only: Sequence[str],
    out: str,
    formats: Sequence[str],
    gait_file: str | None,
    vehicle: str | None,
    coefficients: Any,
    force: bool,
    as_json: bool,
) -> int:
    """Draw Figures 1 to 22 of the paper, the exact regions, and a gait in four dimensions.

    With exact coefficients, the default for any vehicle but the paper's, blue has R = 0 and is shown as singular.
    Needs matplotlib: pip install 'gaitgraph[plot]'.
    """
    from gaitgraph.exchange import read_gait
    from gaitgraph.figures import FIGURES, write_figures
    from gaitgraph.reading import read_table
    from gaitgraph.vehicle import vehicle_named

    os.environ["MPLBACKEND"] = "agg"  # no window is opened, and a notebook's backend may be missing here
    setting = {"vehicle": None if vehicle is None else vehicle_named(vehicle), "coefficients": coefficients}
    given: dict[str, Any] = {"formats": tuple(name.lower() for name in formats)} if formats else {}
    if gait_file is not None:
        read_gait(gait_file, **setting)  # what is wrong with it is told with its name
        given["gait"] = read_table(gait_file)
    written = write_figures(
        out,
        only=only or None,
        **setting,
        force=force,
        progress=_progress(),
        **given,
    )
    titles = {figure.stem: (name, figure.title, figure.caption) for name, figure in FIGURES.items()}
    if as_json:
        keys = ("figure", "title", "caption")
        rows = [{"file": str(path), **dict(zip(keys, titles[path.stem], strict=True))} for path in written]
        _print_json({"files": rows})
        return 0
    for path in written:
        click.echo(f"wrote {path}: {titles[path.stem][1]}")
    return 0


def _stop(code: int, message: str = "") -> NoReturn:
    if message:
        click.echo("gaitgraph: " + " ".join(message.split()), err=True)
    sys.exit(code)


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit with its code."""
    if sys.stderr is None:
        sys.stderr = io.StringIO()
    if sys.stdout is None:
        sys.stdout = io.StringIO()
        _stop(2, "standard output is closed; allowed is an open one")
    for stream in (sys.stdout, sys.stderr):
        # An encoding without Greek letters gets question marks instead of a traceback.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code = cli.main(args=None if args is None else list(args), prog_name="gaitgraph", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        _stop(2 if error.ctx and error.ctx.parent else 0)
    except click.UsageError as error:
        message = error.format_message().replace(_MINUS, "-").rstrip(".")
        _stop(2, f"{message}; allowed is what '{error.ctx.command_path if error.ctx else 'gaitgraph'} --help' says")
    except (click.Abort, KeyboardInterrupt):
        _stop(130, "interrupted")
    except BrokenPipeError:
        # The reader went away; there is nobody to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _stop(0)
    except GaitgraphError as error:
        _stop(2, str(error))
    except MemoryError:
        _stop(2, "not enough memory; allowed are smaller grids and files, or a table as CSV, which is read in pieces")
    except OSError as error:
        # Every file is guarded in its own place: this is the output itself, a full disk for example.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        _stop(2, f"standard output: cannot write: {error.strerror or error}; allowed is a place with room")
    sys.exit(code or 0)
