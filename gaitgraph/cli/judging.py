"""The commands that judge gaits: validate, certify, verify, robustness and compare."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.cli import (
    PAPER_GAITS,
    TIMED,
    Working,
    command,
    file,
    flag,
    gait_in,
    option,
    print_problem,
    show,
    tell,
    wants_json,
)
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from gaitgraph.cli import Paths
    from gaitgraph.gait.given import GaitLike
    from gaitgraph.gait.table import Table
    from gaitgraph.timing.timed_gait import TimedGait


def _vehicle(_: Any, __: Any, name: str | None) -> Any:
    from gaitgraph.flight.vehicle_files import vehicle_or_geometry

    return (
        None
        if name is None
        else vehicle_or_geometry(name, lambda note: print_problem(f"warning: {note}"))
    )


@command(
    "Check a gait file: every rule, with value, limit and place.",
    "gait_file once require",
    option("--tolerance", "X", "Largest |Rφ|, |Rθ| on the surface.  [default: 0.002]"),
    "floor angle_rounding crossing_tolerance",
    option(
        "--vehicle",
        "NAME_OR_FILE",
        "A preset, a TOML file, or a file that describes rotors.",
        callback=_vehicle,
    ),
    "coefficients json",
)
def validate_command(
    gait_file: str, require: str = "flyable", once: bool = False, **given: Any
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

    with Working(f"judging {gait_file}"):
        if not isinstance(given.get("vehicle"), Vehicle | None):
            geometry = given.pop("vehicle")
            floor = {name: given.pop(name) for name in ("floor",) if name in given}
            for name, value in given.items():
                which = f"--{name.replace('_', '-')}"
                raise InputError(
                    f"{which} must be omitted for rotors of any geometry, got {value!r}"
                )
            _check_any_rotors(require)
            return show(validate_geometry(gait_file, geometry, once=once, **floor))
        source: GaitLike
        states_vehicle, note = True, ""
        if once or not (gait_file in PAPER_GAITS or holds_request(gait_file)):
            table = read_table(gait_file)
            states_vehicle = "vehicle" in table.about
            note = _note_on_certificate(gait_file, table, given)
            source = table.once() if once else table
        else:
            source = gait_in(gait_file, given)
        with naming_file(gait_file):
            report = validate(source, **given)
        if report.valid is None:
            _check_any_rotors(require)
        if note:
            report = replace(report, notes=(*report.notes, note))
    if not (wants_json() or "vehicle" in given or states_vehicle):
        print_problem(
            "warning: the file states no vehicle: the paper's is taken; --vehicle names another"
        )
    return show(report, ok=report.flyable if require == "flyable" else report.valid)


def _check_any_rotors(require: str) -> None:
    """Raise InputError for --require valid: the paper's rules do not apply to every rotors."""
    if require != "flyable":
        raise InputError(
            f"--require must be flyable for rotors of any geometry, got {require}"
        )


def _note_on_certificate(gait_file: str, table: Table, given: dict[str, Any]) -> str:
    """Return why the certificate beside a gait file is not that of its rows, "" if it is or there is none."""
    from gaitgraph.certificates.verifying import certificate_beside, note_on_certificate
    from gaitgraph.gait.table import surface_of

    if not certificate_beside(Path(gait_file)).is_file():
        return ""
    vehicle, _, _ = surface_of(table, given.get("vehicle"))
    return note_on_certificate(Path(gait_file), table, vehicle)


@command(
    "Prove what holds along a flyable gait, and write a certificate.",
    "gait_file",
    option("--output", "FILE", "Write the certificate, a JSON document."),
    option(
        "--tilt",
        "ANGLE",
        "Claim too that no attitude within this tilt from upright is singular.",
    ),
    flag("--untimed", "Leave rates and accelerations out."),
    "floor force vehicle coefficients json",
)
def certify_command(
    gait_file: str,
    output: str | None = None,
    force: bool = False,
    untimed: bool = False,
    **given: Any,
) -> int:
    """Certify a gait file of any format, the gait of a request, or gait1 to gait4.

    The certificate holds the curve as exact polynomials, the claims, and what proves each; gaitgraph verify checks it,
    and so does the file gaitgraph/certificates/check.py by itself. The exit code is 1 if a claim cannot be proved.
    """
    from gaitgraph.certificates.making import certify, check_certificate
    from gaitgraph.files import check_new_files, target_of

    outputs = [] if output is None else [output]
    for name in outputs:
        check_certificate(name)
        if target_of(Path(name)) == target_of(Path(gait_file)):
            raise InputError(
                f"--output must be another file than the gait, got {name!r}"
            )
    check_new_files(outputs, force=force)
    with Working(f"certifying {gait_file}"):
        source = gait_in(gait_file, given)
        found = certify(source, timing=not untimed, **given)
        for name in outputs:
            found.write(name, force=force)
    return show(
        found, more={"outputs": outputs}, lines=[f"wrote {name}" for name in outputs]
    )


@command(
    "Check a certificate with exact arithmetic.",
    file("certificate", "CERTIFICATE"),
    file("table", "[TABLE]", required=False),
    "json",
)
def verify_command(certificate: str, table: str | None = None) -> int:
    """Check each claim of a certificate, which gaitgraph certify writes, as gaitgraph/certificates/check.py does.

    With TABLE, each of its rows must be on the proven curve at its time; any format that can be read, also the positions
    of servos. Without it the table beside the certificate is compared, gait.csv beside gait.cert.json. The exit code is 1 if
    a claim is not proved or a row is not on the curve, 2 if a file is no certificate or no table.
    """
    from gaitgraph.certificates.verifying import verify

    with Working(f"checking {certificate}"):
        found = verify(certificate, table)
    return show(found)


@command(
    "Tilt margin and acceptable attitudes, beside biased gaits.",
    "gait_file once",
    option(
        "--bias", "ETA", "Scale α3 and α4 by η in (0, 1]; repeatable.", multiple=True
    ),
    option("--scale", "ETA", "Scale all four by η; repeatable.", multiple=True),
    option(
        "--tilt",
        "ANGLE",
        "Report the least singular value within this tilt.  [default: 30deg]",
    ),
    option(
        "--tolerance", "X", "Fraction of attitudes that may be missed.  [default: 1e-5]"
    ),
    option("--curves", "N", "Number of singular curves along the gait.  [default: 24]"),
    "angle_rounding floor vehicle coefficients",
    option(
        "--output",
        "FILE",
        "Draw the attitudes: .png, .svg or .pdf; repeatable.",
        name="outputs",
        multiple=True,
    ),
    "force json",
)
def robustness_command(
    gait_file: str,
    once: bool = False,
    outputs: Paths = (),
    force: bool = False,
    **given: Any,
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
    figure = blank_figure(152.4, 127.0) if outputs else None
    with Working(f"tilting {gait_file}") as progress:
        source = gait_in(gait_file, given, once=once)
        report = robustness_of(source, progress=progress, **given)
        if figure is not None:
            with paper_style():
                draw_robustness(figure.add_subplot(), report, Path(gait_file).stem)
            write_pictures(figure, outputs, force=force)
    lines = [f"wrote {name}" for name in outputs]
    return show(report, more={"outputs": list(outputs)}, lines=lines, ok=True)


_UNITS = {
    "length": "rad", "period": "s", "tilt_margin_deg": "degrees", "acceptable_fraction": "of attitudes",
    "servo_margin_deg": "degrees", "drag_margin": "of the drag ratio",
    "least_hover_thrust": "m·g", "largest_hover_thrust": "m·g", "hover_power": "of level hover", "peak_rate": "rad/s", "peak_acceleration": "rad/s²",
}  # fmt: skip


@command(
    "Two gaits side by side: verdicts, margins, thrusts, rates.",
    file("first", "A", *PAPER_GAITS),
    file("second", "B", *PAPER_GAITS),
    "period_of_file law_of_file vehicle coefficients",
    option(
        "--output",
        "FILE",
        "Draw both: .png, .svg or .pdf; repeatable.",
        name="outputs",
        multiple=True,
    ),
    "force json",
)
def compare_command(
    first: str, second: str, outputs: Paths = (), force: bool = False, **given: Any
) -> int:
    """Compare two gaits, each in any form that the other commands take.

    Hover thrusts and the least singular value are those of level flight, with exact coefficients, as the margins are.
    The exit code does not depend on the verdicts.
    """
    from gaitgraph.plots.axes import blank_figure, check_pictures, write_pictures
    from gaitgraph.plots.gaits import draw_sheet
    from gaitgraph.timing.timed_gait import timed_gait_of

    check_pictures(outputs, force=force)
    names = (first, second)
    with Working("comparing"):
        gaits = [timed_gait_of(gait_in(name, given, TIMED), **given) for name in names]
        found = [
            {"gait": name, **_numbers(timed)}
            for name, timed in zip(names, gaits, strict=True)
        ]
        if outputs:
            draw_sheet(figure := blank_figure(400.0, 172.0), gaits, names)
            write_pictures(figure, outputs, force=force)
    plain = [
        {
            name: None if isinstance(value, float) and not isfinite(value) else value
            for name, value in one.items()
        }
        for one in found
    ]
    rows = [
        (name, *(_text(one[name]) for one in found))
        for name in found[0]
        if name != "reason"
    ]
    width, lines = 2 + max(len(left) for _, left, _ in rows), []
    for name, left, right in rows:
        unit = f" ({_UNITS[name]})" if name in _UNITS else ""
        lines.append(
            f"{name.removesuffix('_deg').replace('_', ' ') + unit:<36}{left:<{width}}{right}"
        )
    lines += [
        f"{one['gait']} is not flyable: {one['reason']}"
        for one in found
        if one["reason"]
    ]
    lines += [f"wrote {name}" for name in outputs]
    return tell({"gaits": plain, "outputs": list(outputs)}, lines)


def _numbers(timed: TimedGait) -> dict[str, Any]:
    """Return what is compared of a gait as plain values; None or NaN for what does not exist."""
    from gaitgraph.invertibility.segment_bounds import thrust_shares_along
    from gaitgraph.robustness.biased import robustness_of

    gait, report, robustness = (
        timed.gait,
        timed.check(),
        robustness_of(timed, curves=1).gait.as_mapping(),
    )
    least, (_, _, largest) = (
        report["hover_thrust"].value,
        thrust_shares_along(gait.alpha, gait.ends, gait.vehicle),
    )
    return {
        **{
            name: getattr(report, name)
            for name in (
                "flyable",
                "valid",
                "reachable_from_hover",
                "not_judged",
                "reason",
            )
        },
        "vehicle": gait.vehicle.name,
        "color": gait.color,
        "length": gait.length if timed.repeats else gait.length / 2,
        "period": timed.period,
        "least_singular_value": report["least_singular_value"].value,
        **{
            name: robustness[name]
            for name in (
                "tilt_margin_deg",
                "acceptable_fraction",
                "servo_margin_deg",
                "drag_margin",
            )
        },
        "least_hover_thrust": least,
        "largest_hover_thrust": None
        if least is None
        else -float(largest.upper.min()),  # NaN unless all are positive
        "hover_power": report.hover_power,
        "peak_rate": report["tilt_rate"].value,
        "peak_acceleration": report["tilt_acceleration"].value,
    }


def _text(value: Any) -> str:
    from gaitgraph.validation.report import limited_quantities

    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return limited_quantities(value) or "nothing"
    return (
        value
        if isinstance(value, str)
        else "none"
        if value is None or isnan(value)
        else f"{value:.4g}"
    )
