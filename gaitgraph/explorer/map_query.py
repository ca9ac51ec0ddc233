"""The query about the map: shading, regions and plane types of one sheet over the (α1, α2) plane."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import MissingConstant, check_fields, checked_choice
from gaitgraph.explorer.queries import quiet, to_digits
from gaitgraph.explorer.state import vehicle_of
from gaitgraph.graph.nodes import DEFAULT_DIVISIONS
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.surface.sheets import (
    COLORS,
    RAISED,
    Color,
    sheet_angles,
    text_from_types,
    types_of,
)
from gaitgraph.tolerances import DEFAULT_FLOOR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.explorer.queries import Progress
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.surface.sheets import Sign
    from gaitgraph.vehicle import Vehicle

SHADINGS = ("R", "least_singular_value", "servo_margin", "none")
"""The quantities that the map can show as shading."""

_REGIONS = {
    "R>0": "R > 0",
    "R<0": "R < 0",
    "hover": "all hover thrusts positive",
    "flyable": "flyable",
}
_POINTS = {
    "servo_margin": 65
}  # along a side; each takes as long as a hundred of the others
_MOST_POINTS = 129
_BISECTIONS = 10  # of margins, to 0.1°
_ACCURACY = 1e-3  # of curved borders [rad]; a pixel of the map is wider
_SINGULAR_BLUE = (
    "R = 0 on the whole blue sheet in exact physics: the matrix is singular there."
)
_CURVED = (
    "The vehicle has one sheet, which is curved: it has no colors and no plane types."
)
_ROUNDED_BLUE = (
    f"{_SINGULAR_BLUE} The signs of R drawn are rounding noise of the paper's digits."
)


def map_answer(content: Any, progress: Progress = quiet) -> dict[str, Any]:
    """Return the shading, the regions and the plane types of one sheet of the map, as plain values.

    A query may have ``vehicle``, ``drag_ratio``, ``coefficients`` as in a state, ``sheet`` and ``shading``. The answer
    has `n`·`n` ``values``, row by row from α2 = −π/2 up, each from α1 = −π/2, or None; servo margins in degrees; regions as
    rings in the plane [rad], with holes, to be filled by the even-odd rule; the plane types of the nodes of the paper's
    grid, None where R has no sign; a note, or None; ``raised``, whether there is a rotor height; and ``curved``, whether
    the vehicle is not symmetric: then its only sheet is answered, without types and colors.
    """
    names = ("vehicle", "drag_ratio", "coefficients", "sheet", "shading")
    check_fields("request", content, names)
    vehicle = vehicle_of(content.get("vehicle", "paper"), content.get("drag_ratio"))
    sheet: Color = checked_choice("sheet", content.get("sheet", "red"), COLORS)
    shading = checked_choice("shading", content.get("shading", "none"), SHADINGS)
    coefficients = coefficients_of(vehicle, content.get("coefficients"))
    progress("shading the map")
    values = None
    is_curved = vehicle.asymmetry is not None
    if is_curved:
        sheet = "red"
    shown, note = _regions_and_note(sheet, vehicle, coefficients)
    if sheet == "red" and shading != "none":  # on blue all are rounding noise
        try:
            values = _shading(vehicle, coefficients, shading)
        except MissingConstant as error:
            note = f"Nothing is shaded: {error}."
    regions = []
    for name in shown:
        label = _REGIONS[name]
        progress(f"drawing the region {label}")
        try:
            rings = _rings(name, vehicle, coefficients, sheet)
        except MissingConstant as error:
            note = f"The region {label} is not drawn: {error}."
        else:
            regions.append({"name": name, "label": label, "polygons": rings})
    return {
        "n": _POINTS.get(shading, _MOST_POINTS),
        "values": values,
        "regions": regions,
        "types": {"n": DEFAULT_DIVISIONS + 1, "codes": _types(coefficients, sheet)},
        "note": note,
        "raised": vehicle.has_raised_rotors,
        "curved": is_curved,
    }


def _regions_and_note(
    sheet: Color, vehicle: Vehicle, coefficients: Coefficients
) -> tuple[Sequence[str], str | None]:
    """Return the names of the regions of a sheet, and why it is not what one may expect."""
    if vehicle.asymmetry is not None:
        return ["flyable"], _CURVED
    if sheet == "red":
        return list(_REGIONS), None
    if coefficients.kind != "exact":
        return ["R>0", "R<0"], _ROUNDED_BLUE
    if vehicle.has_raised_rotors:
        return [], f"Blue is no gait surface {RAISED} {vehicle.heights_in_words}."
    return [], _SINGULAR_BLUE


def _on_grid(points: int, coefficients: Coefficients, sheet: Color) -> FloatArray:
    """Return the tilt angles of a sheet over a grid, rows of constant α2, shape (points, points, 4)."""
    axis = np.linspace(-HALF_PI, HALF_PI, points)
    a1, a2 = np.meshgrid(axis, axis)
    return np.stack([a1, a2, *sheet_angles(sheet, a1, a2, coefficients)], axis=-1)


@lru_cache(maxsize=32)
def _shading(vehicle: Vehicle, coefficients: Coefficients, shading: str) -> list[float]:
    """Return the values of a shading of the red sheet."""
    alpha = _on_grid(_POINTS.get(shading, _MOST_POINTS), coefficients, "red")
    if shading == "R":
        values = matrices.level_determinant(alpha, coefficients)
    elif shading == "servo_margin":
        postures = alpha.reshape(-1, 4)
        margins = servo_margins_found(postures, vehicle, DEFAULT_FLOOR, _BISECTIONS)
        values = np.degrees(margins)
    else:
        values = matrices.least_singular_value(alpha, vehicle)
    return [float(f"{value:.5g}") for value in np.ravel(values)]


@lru_cache(maxsize=32)
def _types(coefficients: Coefficients, sheet: Color) -> list[str | None]:
    """Return the plane types of the nodes of the paper's grid, row by row; None where R has no sign."""
    alpha = _on_grid(DEFAULT_DIVISIONS + 1, coefficients, sheet)
    if coefficients.rotors.asymmetry is not None:
        return [None] * len(alpha) ** 2
    tolerance = math.pi / (2 * DEFAULT_DIVISIONS)
    third, fourth = types_of(
        sheet, alpha[..., 0], alpha[..., 1], coefficients, tolerance
    )
    R = matrices.level_determinant(alpha, coefficients)
    is_signed = np.abs(R) > matrices.noise_of(coefficients)
    nodes = zip(third.flat, fourth.flat, is_signed.flat, strict=True)
    return [text_from_types(int(a), int(b)) if there else None for a, b, there in nodes]


@lru_cache(maxsize=64)
def _rings(
    name: str, vehicle: Vehicle, coefficients: Coefficients, sheet: Color
) -> list[Any]:
    """Return a region as rings; MissingConstant if the flyable region of the vehicle is unknown."""
    import shapely

    from gaitgraph.surface.admissible import admissible_region
    from gaitgraph.surface.flight_regions import hover_region
    from gaitgraph.surface.sign_regions import sign_region

    options: Any = {"coefficients": coefficients, "accuracy": _ACCURACY}
    if name == "hover":
        region = hover_region(vehicle)
    elif name == "flyable":
        region = admissible_region(vehicle, **options)
    else:
        sign: Sign = "positive" if name == "R>0" else "negative"
        region = sign_region(sign, vehicle, color=sheet, **options)
    rings = shapely.get_rings(shapely.get_parts(region.inner))
    return [to_digits(shapely.get_coordinates(ring), 5) for ring in rings]
