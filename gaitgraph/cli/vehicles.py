"""The command vehicles: the presets, and what is computed from them."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import json_option, setting_options
from gaitgraph.cli.terminal import print_json

__all__ = ["vehicles_command"]


@command("List the vehicles that come with the package, or show one.")
@setting_options
@json_option
def vehicles_command(vehicle: str | None, coefficients: Any, as_json: bool) -> int:
    """List the preset vehicles with their drag ratio κ and crossing angle δ, or show the one of --vehicle."""
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.vehicle import preset_names, vehicle_named

    rows = []
    for name in preset_names() if vehicle is None else [vehicle]:
        one = vehicle_named(name)
        delta = coefficients_of(one, coefficients).delta
        rows.append({**one.as_mapping(), "delta": delta})
    if as_json:
        print_json({"vehicles": rows})
        return 0
    for row in rows:
        click.echo(f"{row['name']}: κ = {row['drag_ratio']:.6f}, δ = {row['delta']:.6f} rad")
        for name, value in row.items():
            if name not in ("name", "drag_ratio", "delta"):
                click.echo(f"    {name} = {value}")
    return 0
