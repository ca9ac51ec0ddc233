"""The commands validate and robustness."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gaitgraph.cli.inputs import check_is_table, gait_in, stated_options
from gaitgraph.cli.options import (
    PAPER_GAITS,
    SHARE,
    Angle,
    Number,
    VehicleOrGeometry,
    coefficients_option,
    common_options,
    gait_file_argument,
    json_option,
    once_option,
    picture_outputs_options,
    require_option,
)
from gaitgraph.cli.output import (
    print_problem,
    show,
    wants_json,
    working,
)
from gaitgraph.tolerances import DEFAULT_FLOOR

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.coefficients import Kind
    from gaitgraph.invertibility.geometry import Geometry
    from gaitgraph.vehicle import Vehicle


@click.command(
    "validate", short_help="Check a gait file: every rule, with value, limit and place."
)
@gait_file_argument
@once_option
@require_option
@click.option(
    "--floor",
    type=Number(min=0),
    default=DEFAULT_FLOOR,
    help="The least singular value must stay above this.",
)
@click.option(
    "--vehicle",
    type=VehicleOrGeometry(),
    help="A preset, a TOML file, or a file that describes rotors.",
)
@coefficients_option
@json_option
def validate_command(
    gait_file: str,
    once: bool,
    require: str,
    floor: float,
    vehicle: Vehicle | Geometry | None,
    coefficients: Kind | None,
) -> int:
    """Check a gait file of any format, the gait of a request, or gait1 to gait4, along its whole length.

    Rows need alpha1 to alpha4, or alpha1, alpha2 and color; the last row is joined with the first, unless the table is
    a path, as that of a transition, or with --once.
    The exit code is 1 if the gait is not flyable (or not valid, with --require valid).

    If --vehicle describes rotors of any geometry (TOML with [[rotor]], PX4 parameters, URDF or MJCF), or four that no
    half turn maps to each other, physics alone is checked, on alpha1 to alphaN, and the exit code is 1 if the table is not flyable.
    """
    from gaitgraph.files import naming_file
    from gaitgraph.io.formats import holds_request, read_table
    from gaitgraph.validation.any_rotors import validate_geometry
    from gaitgraph.validation.validating import validate
    from gaitgraph.vehicle import Vehicle

    with working(f"judging {gait_file}"):
        if vehicle is not None and not isinstance(vehicle, Vehicle):
            _check_any_rotors(require)
            check_is_table(gait_file, "--vehicle with rotors")
            report = validate_geometry(gait_file, vehicle, once=once, floor=floor)
            return show(report)
        source: GaitLike
        states_vehicle = True
        note = ""
        if once:
            check_is_table(gait_file, "--once")
        if once or not (gait_file in PAPER_GAITS or holds_request(gait_file)):
            source = table = read_table(gait_file)
            states_vehicle = "vehicle" in table.about
            note = _note_on_certificate(gait_file, table, vehicle)
            if once:
                source = table.once()
        else:
            source = gait_in(gait_file, vehicle=vehicle, coefficients=coefficients)
        with naming_file(gait_file):
            report = validate(
                source,
                vehicle=vehicle,
                coefficients=coefficients,
                floor=floor,
            )
        if report.valid is None:
            _check_any_rotors(require)
        if note:
            report = replace(report, notes=(*report.notes, note))
    if not (wants_json() or vehicle is not None or states_vehicle):
        print_problem(
            "warning: the file states no vehicle: the paper's is taken; --vehicle names another"
        )
    return show(report, ok=getattr(report, require))


def _check_any_rotors(require: str) -> None:
    """Raise if what the paper's rules need is asked for rotors to which they do not apply."""
    if require != "flyable":
        raise click.UsageError(
            f"--require must be flyable for rotors of any geometry, got {require}"
        )
    if "coefficients" in stated_options():
        raise click.UsageError(
            "--coefficients must be omitted for rotors of any geometry"
        )


def _note_on_certificate(
    gait_file: str, table: Table, stated_vehicle: Vehicle | None
) -> str:
    """Return why the certificate beside a gait file is not that of its rows, "" if it is or there is none."""
    from gaitgraph.certificates.verifying import certificate_beside, note_on_certificate
    from gaitgraph.gait.table import surface_of

    if not certificate_beside(Path(gait_file)).is_file():
        return ""
    vehicle, _, _ = surface_of(table, stated_vehicle)
    return note_on_certificate(Path(gait_file), table, vehicle)


@click.command(
    "robustness",
    short_help="Tilt margin and acceptable attitudes, beside biased gaits.",
)
@gait_file_argument
@once_option
@click.option(
    "--bias",
    type=SHARE,
    multiple=True,
    help="Scale α3 and α4 by a factor η; repeatable.",
)
@click.option(
    "--tilt",
    type=Angle(),
    default="30deg",
    help="Report the least singular value within this tilt.",
)
@picture_outputs_options
@common_options
def robustness_command(
    gait_file: str,
    once: bool,
    bias: tuple[float, ...],
    tilt: float,
    outputs: tuple[str, ...],
    force: bool,
    chosen: Chosen,
) -> int:
    """Compute how far a gait can be tilted before its decoupling matrix is singular.

    Takes any table of alpha1 to alpha4, on the gait surfaces or not. Coefficients are exact unless others are asked
    for; printed gives the paper's own numbers. Rows are joined by straight segments, and the last with the first.
    """
    from gaitgraph.plots.axes import (
        blank_figure,
        check_pictures,
        paper_style,
        write_pictures,
    )
    from gaitgraph.plots.gaits import draw_robustness
    from gaitgraph.robustness.biased import robustness_of

    check_pictures(outputs, force=force)
    with working(f"tilting {gait_file}") as progress:
        source = gait_in(gait_file, once=once, **chosen)
        report = robustness_of(
            source,
            bias=bias,
            tilt=tilt,
            **chosen,
            progress=progress,
        )
        if outputs:
            with paper_style():
                figure = blank_figure(152.4, 127.0)
                draw_robustness(figure.add_subplot(), report, Path(gait_file).stem)
            write_pictures(figure, outputs, force=force)
    return show(report, outputs=outputs, ok=True)
