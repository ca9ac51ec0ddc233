"""The command vehicles: the presets, what is computed from them, and vehicles in files of others."""

from __future__ import annotations

from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import command, file, option, print_json, print_problem, wants_json
from gaitgraph.errors import InputError

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle


@command(
    "List the vehicles that come with the package, or show one.",
    file("name", "[NAME_OR_FILE]", required=False),
    "vehicle coefficients",
    option(
        "--from",
        "FILE",
        "Read URDF, MJCF or PX4 parameters, and print TOML for --vehicle.",
        name="source",
    ),
    option("--output", "FILE", "Write the vehicle as a model of MuJoCo (.xml)."),
    "force json",
)
def vehicles_command(
    name: str | None = None,
    vehicle: Vehicle | None = None,
    coefficients: Any = None,
    source: str | None = None,
    output: str | None = None,
    force: bool = False,
) -> int:
    """List the preset vehicles with their drag ratio κ and crossing angle δ, or show one: a preset or a TOML file.

    With --from the exit code is 1 if the paper's method does not fit the vehicle, or the file states no drag ratio.
    """
    from gaitgraph.validation.report import unlikely_limits
    from gaitgraph.vehicle import preset_names, vehicle_named

    stated = [
        one
        for one in (
            name,
            vehicle and f"--vehicle {vehicle.name}",
            source and f"--from {source}",
        )
        if one
    ]
    if len(stated) > 1:
        raise InputError(f"{stated[-1]} cannot be combined with {stated[0]!r}")
    if source is not None:
        if output is not None:
            raise InputError(
                f"--output {output} cannot be combined with --from; give it with the TOML that is printed"
            )
        return _show_description(source)
    given = vehicle if name is None else name
    if output is not None:
        if given is None or Path(output).suffix.lower() != ".xml":
            raise InputError(
                f"--output must be a file .xml, with the name of one vehicle, got {output!r}"
            )
        from gaitgraph.files import check_new_files, write_whole
        from gaitgraph.flight.engine import mjcf_of

        check_new_files([output], force=force)
        write_whole(
            [
                (
                    Path(output),
                    mjcf_of(vehicle_named(given), step=1e-3, air=False).encode(),
                )
            ],
            force=force,
        )
    known = [
        vehicle_named(one) for one in (preset_names() if given is None else [given])
    ]
    rows = [{**one.as_mapping(), **_crossings_of(one, coefficients)} for one in known]
    if wants_json():
        print_json({"vehicles": rows})
        return 0
    for one, row in zip(known, rows, strict=True):
        unlikely = unlikely_limits(
            {kind: row.get(f"max_tilt_{kind}") for kind in ("rate", "acceleration")}
        )
        for warning in (*unlikely, *one.warnings):
            print_problem(f"warning: {warning}")
        click.echo(
            f"{one.name}: κ = {one.drag_ratio:.6f}, {_crossing_text(one, row['crossings'])}"
        )
        click.echo("\n".join(str(one).splitlines()[1:]))
    if output is not None:
        click.echo(f"wrote {output}")
    return 0


def _show_description(source: str) -> int:
    from gaitgraph.flight.vehicle_files import read_description

    found = read_description(source)
    if wants_json():
        stated = {
            name: getattr(found, name) for name in ("rotors", "missing", "reasons")
        }
        stated["notes"] = [*found.beside, *found.notes]
        print_json({"vehicles": [] if found.reasons else [found.constants], **stated})
    else:
        click.echo(found.as_toml())
        if found.missing:
            print_problem(
                f"warning: the file does not state {', '.join(found.missing)}: add what you know"
            )
    return 1 if found.reasons or "drag_to_thrust" in found.missing else 0


def _crossings_of(vehicle: Vehicle, coefficients: Any) -> dict[str, Any]:
    """Return the crossing angle δ, and the crossing lines of α1 and of α2 [rad]; None for a vehicle that is not symmetric."""
    from gaitgraph.invertibility.coefficients import coefficients_of

    if vehicle.asymmetry is not None:
        return dict.fromkeys(("delta", "crossings"))
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
