"""The command roots: every root of Rφ = Rθ = 0 over one point of the plane."""

from __future__ import annotations

from typing import Any

import click

from gaitgraph.cli import command, print_json, wants_json
from gaitgraph.errors import InputError


@command(
    "Every (α3, α4) on the gait surfaces for one (α1, α2).",
    click.argument("angles", metavar="A1 A2", nargs=-1),
    "crossing_tolerance vehicle coefficients json",
    ignore_unknown_options=True,  # a negative angle is an argument
)
def roots_command(angles: tuple[str, ...] = (), vehicle: Any = None, coefficients: Any = None, **given: float) -> int:
    """Print every root (α3, α4) of Rφ = Rθ = 0 for one (α1, α2), with plane types, color and R."""
    from dataclasses import asdict

    from gaitgraph.angles import text_from_angle
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.surface.sheets import roots
    from gaitgraph.vehicle import PAPER

    pair, numbers = ",".join(angles).split(","), coefficients_of(vehicle or PAPER, coefficients)
    if len(pair) != 2:
        raise InputError(f"roots needs two angles A1 A2, got {' '.join(angles)!r}")
    found = roots(*pair, coefficients=numbers, **given)
    alpha1, alpha2 = found[0].alpha[:2]
    if wants_json():
        rows = [{k: value for k, value in asdict(root).items() if k not in ("alpha1", "alpha2")} for root in found]
        print_json({"alpha1": alpha1, "alpha2": alpha2, "roots": rows, "fibers": [*map(asdict, found.fibers)]})
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
