"""The command vehicles: the presets, and what is computed from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import command, file, print_json, print_problem, wants_json

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle


@command(
    "List the vehicles that come with the package, or show one.",
    file("name", "[NAME_OR_FILE]", required=False),
    "vehicle coefficients json",
)
def vehicles_command(name: str | None = None, vehicle: Vehicle | None = None, coefficients: Any = None) -> int:
    """List the preset vehicles with their drag ratio κ and crossing angle δ, or show one: a preset or a TOML file."""
    from gaitgraph.errors import InputError
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.validation.report import unlikely_limits
    from gaitgraph.vehicle import preset_names, vehicle_named

    if name is not None and vehicle is not None:
        raise InputError(f"--vehicle {vehicle.name} cannot be combined with {name!r}")
    given = vehicle if name is None else name
    known = [vehicle_named(one) for one in (preset_names() if given is None else [given])]
    rows = [{**one.as_mapping(), "delta": coefficients_of(one, coefficients).delta} for one in known]
    if wants_json():
        print_json({"vehicles": rows})
        return 0
    for one, row in zip(known, rows, strict=True):
        for warning in unlikely_limits({kind: row.get(f"max_tilt_{kind}") for kind in ("rate", "acceleration")}):
            print_problem(f"warning: {warning}")
        click.echo(f"{one.name}: κ = {one.drag_ratio:.6f}, δ = {row['delta']:.6f} rad")
        click.echo("\n".join(str(one).splitlines()[1:]))
    return 0
