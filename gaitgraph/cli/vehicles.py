"""The command vehicles: the presets, what is computed from them, and vehicles in files of others."""

from __future__ import annotations

from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli.options import VehicleName, common_options, force_option
from gaitgraph.cli.output import print_problem, tell, wants_json

if TYPE_CHECKING:
    from gaitgraph.cli.options import Chosen
    from gaitgraph.invertibility.coefficients import Kind
    from gaitgraph.vehicle import Vehicle


@click.command(
    "vehicles", short_help="List the vehicles that come with the package, or show one."
)
@click.argument("named", metavar="[NAME_OR_FILE]", type=VehicleName(), required=False)
@click.option(
    "--from",
    "source",
    type=click.Path(),
    help="Read URDF, MJCF or PX4 parameters, and print TOML for --vehicle.",
)
@click.option(
    "--output", type=click.Path(), help="Write the vehicle as a model of MuJoCo (.xml)."
)
@force_option
@common_options
def vehicles_command(
    named: Vehicle | None,
    source: str | None,
    output: str | None,
    force: bool,
    chosen: Chosen,
) -> int:
    """List the preset vehicles with their drag ratio κ and crossing angle δ, or show one: a preset or a TOML file.

    With --from the exit code is 1 if the paper's method does not fit the vehicle, or the file states no drag ratio.
    """
    vehicle = chosen["vehicle"]
    if [named, vehicle, source].count(None) < 2:
        raise click.UsageError(
            "of NAME_OR_FILE, --vehicle and --from only one can be given"
        )
    if source is None:
        vehicle = vehicle or named
        if output is not None:
            _write_model(vehicle, output, force=force)
        return _show_vehicles(vehicle, chosen["coefficients"], output)
    if output is not None:
        raise click.UsageError(
            "--output cannot be combined with --from; give it with the TOML that is printed"
        )
    return _show_description(source)


def _show_description(source: str) -> int:
    """Print a vehicle in a file of others as TOML; return the exit code."""
    from gaitgraph.flight.vehicle_files import read_description

    description = read_description(source)
    missing = description.missing
    vehicles = []
    if not description.reasons:
        vehicles.append(description.constants)
    content = {
        "vehicles": vehicles,
        "rotors": description.rotors,
        "missing": missing,
        "reasons": description.reasons,
        "notes": description.beside + description.notes,
    }
    tell(content, [description.as_toml()])
    if missing and not wants_json():
        names = ", ".join(missing)
        print_problem(f"warning: the file does not state {names}: add what you know")
    return int(bool(description.reasons) or "drag_to_thrust" in missing)


def _write_model(vehicle: Vehicle | None, output: str, *, force: bool) -> None:
    """Write a vehicle as a model of MuJoCo."""
    from gaitgraph.files import check_new_files, write_whole
    from gaitgraph.flight.engine import mjcf_of

    if vehicle is None or Path(output).suffix.lower() != ".xml":
        raise click.UsageError(
            f"--output must be a file .xml, with the name of one vehicle, got {output!r}"
        )
    check_new_files([output], force=force)
    model = mjcf_of(vehicle, step=1e-3, air=False).encode()
    write_whole([(Path(output), model)], force=force)


def _show_vehicles(
    vehicle: Vehicle | None, coefficients: Kind | None, output: str | None
) -> int:
    """Print one vehicle, or the presets; return the exit code."""
    from gaitgraph.validation.report import unlikely_limits
    from gaitgraph.vehicle import preset_names, vehicle_named

    if vehicle is None:
        vehicles = [vehicle_named(name) for name in preset_names()]
    else:
        vehicles = [vehicle]
    rows = []
    lines = []
    for shown in vehicles:
        row = {**shown.as_mapping(), **_crossings_of(shown, coefficients)}
        rows.append(row)
        crossing = _crossing_text(shown, row["crossings"])
        lines.append(f"{shown.name}: κ = {shown.drag_ratio:.6f}, {crossing}")
        lines += str(shown).splitlines()[1:]
        if not wants_json():
            warnings = unlikely_limits(
                {
                    "rate": row.get("max_tilt_rate"),
                    "acceleration": row.get("max_tilt_acceleration"),
                }
            )
            for warning in (*warnings, *shown.warnings):
                print_problem(f"warning: {warning}")
    if output is not None:
        lines.append(f"wrote {output}")
    return tell({"vehicles": rows}, lines)


def _crossings_of(vehicle: Vehicle, coefficients: Kind | None) -> dict[str, Any]:
    """Return the crossing angle δ, and the crossing lines of α1 and of α2 [rad]; None for a vehicle that is not symmetric."""
    from gaitgraph.invertibility.coefficients import coefficients_of

    if vehicle.asymmetry is not None:
        return {"delta": None, "crossings": None}
    first, second = coefficients_of(vehicle, coefficients).crossings
    return {"delta": first, "crossings": [first, second]}


def _crossing_text(vehicle: Vehicle, crossings: list[float] | None) -> str:
    """Return the crossing angle δ of both pairs of arms, or of each if they differ; else the pair that is not symmetric."""
    if crossings is None:
        return str(vehicle.asymmetry)
    first, second = crossings
    if isclose(first, -second, rel_tol=1e-9):
        return f"δ = {first:.6f} rad"
    return f"planes cross at α1 = {first:.6f} rad and α2 = {second:.6f} rad"
