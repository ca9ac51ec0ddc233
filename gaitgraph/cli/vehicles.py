"""The command vehicles: the presets, and what is computed from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import command, print_json

if TYPE_CHECKING:
    from gaitgraph.vehicle import Vehicle


@command("List the vehicles that come with the package, or show one.", "vehicle coefficients json")
def vehicles_command(vehicle: Vehicle | None = None, coefficients: Any = None, as_json: bool = False) -> int:
    """List the preset vehicles with their drag ratio κ and crossing angle δ, or show the one of --vehicle."""
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.vehicle import preset_names, vehicle_named

    known = map(vehicle_named, preset_names()) if vehicle is None else [vehicle]
    rows = [{**one.as_mapping(), "delta": coefficients_of(one, coefficients).delta} for one in known]
    if as_json:
        print_json({"vehicles": rows})
        return 0
    for row in rows:
        click.echo(f"{row['name']}: κ = {row['drag_ratio']:.6f}, δ = {row['delta']:.6f} rad")
        for name, value in row.items():
            if name not in ("name", "drag_ratio", "delta"):
                click.echo(f"    {name} = {value}")
    return 0
