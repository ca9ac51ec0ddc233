"""The command roots: every root of Rφ = Rθ = 0 over one point of the plane."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli.commands import command
from gaitgraph.cli.options import angle_not_negative, crossing_option, json_option, setting_options
from gaitgraph.cli.terminal import print_json

__all__ = ["roots_command"]


@command("Every (α3, α4) on the gait surfaces for one (α1, α2).")
@click.argument("a1", metavar="A1")
@click.argument("a2", metavar="A2")
@crossing_option
@setting_options
@json_option
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
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.surface.closed_form_roots import roots
    from gaitgraph.surface.sheets import DEFAULT_CROSSING_TOLERANCE
    from gaitgraph.vehicle import PAPER, vehicle_named

    numbers = coefficients_of(PAPER if vehicle is None else vehicle_named(vehicle), coefficients)
    tolerance = DEFAULT_CROSSING_TOLERANCE
    if crossing_tolerance is not None:
        tolerance = angle_not_negative(crossing_tolerance, "crossing_tolerance")
    alpha1, alpha2 = angle_from_text(a1, "alpha1"), angle_from_text(a2, "alpha2")
    found = roots(alpha1, alpha2, numbers, crossing_tolerance=tolerance)
    if as_json:
        rows = []
        for root in found:
            row = asdict(root)
            del row["alpha1"], row["alpha2"]
            rows.append(row)
        fibers = [asdict(fiber) for fiber in found.fibers]
        print_json({"alpha1": alpha1, "alpha2": alpha2, "roots": rows, "fibers": fibers})
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
