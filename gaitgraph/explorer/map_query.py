"""The query for the (α1, α2) map below the loop: shading, regions and plane types of one sheet."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import GaitgraphError
from gaitgraph.explorer.plan_query import checked_choice, checked_object, vehicle_of
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.invertibility.matrices import (
    Coefficients,
    coefficients_of,
    least_singular_value,
    level_determinant,
    noise_of,
)
from gaitgraph.surface.adjacency import text_from_types
from gaitgraph.surface.sheets import COLORS, Color, sheet_angles, types_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.vehicle import Vehicle

FloatArray = npt.NDArray[np.float64]

SHADINGS = ("R", "least_singular_value", "none")
"""What shades the map."""

_REGIONS = (("R>0", "R > 0"), ("R<0", "R < 0"), ("hover", "all hover thrusts positive"), ("flyable", "flyable"))
_POINTS = 129
_ACCURACY = 1e-3  # of curved borders [rad]; a pixel of the map is wider
_SINGULAR_BLUE = "with exact coefficients R = 0 on the whole blue sheet: the matrix is singular there"
_ROUNDED_BLUE = (
    "the sign of R on blue is what the rounding of the published coefficients leaves; in exact physics the matrix is "
    "singular on the whole sheet"
)


def map_answer(content: object, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Return the map that a query asks for, as plain values.

    It may have ``vehicle``, ``drag_ratio``, ``coefficients`` as in a state, ``sheet`` and ``shading``. The answer has
    ``values`` row by row from α2 = −π/2 up, in each from α1 = −π/2, `n`·`n` of them, or None; their ``range``; regions
    as rings in the plane [rad], a hole being a ring too, so that they are filled by the even-odd rule; the plane types
    of the nodes of the paper's grid, None where R has no sign; and a note, or None. `progress` is called before each
    step of long work. InputError if a name is unknown or a value is not allowed.
    """
    query = checked_object(content, ("vehicle", "drag_ratio", "coefficients", "sheet", "shading"))
    vehicle = vehicle_of(query.get("vehicle", "paper"), query.get("drag_ratio"))
    kind = checked_choice("coefficients", query.get("coefficients"), ("published", "exact", None))
    sheet: Color = checked_choice("sheet", query.get("sheet", "red"), COLORS)
    shading: str = checked_choice("shading", query.get("shading", "none"), SHADINGS)
    coefficients = coefficients_of(vehicle, kind)
    update = progress or (lambda _: None)
    update("shading the map")
    values, extent = _shading(vehicle, coefficients, sheet, shading)
    blank = sheet == "blue" and coefficients.kind == "exact"
    regions = []
    for name, label in () if blank else _REGIONS if sheet == "red" else _REGIONS[:2]:
        update(f"drawing the region {label}")
        rings = _rings(name, vehicle, coefficients, sheet)
        if rings is not None:
            regions.append({"name": name, "label": label, "polygons": rings})
    return {
        "n": _POINTS,
        "values": values,
        "range": extent,
        "regions": regions,
        "types": {"n": DEFAULT_DIVISIONS + 1, "codes": _types(coefficients, sheet)},
        "note": None if sheet == "red" else _SINGULAR_BLUE if blank else _ROUNDED_BLUE,
    }


def _on_grid(points: int, coefficients: Coefficients, sheet: Color) -> FloatArray:
    """Return the tilt angles of a sheet over a grid, rows of constant α2, shape (points, points, 4)."""
    axis = np.linspace(-HALF_PI, HALF_PI, points)
    a1, a2 = np.meshgrid(axis, axis)
    return np.stack([a1, a2, *sheet_angles(sheet, a1, a2, coefficients)], axis=-1)


@lru_cache(maxsize=32)
def _shading(
    vehicle: Vehicle, coefficients: Coefficients, sheet: Color, shading: str
) -> tuple[list[float] | None, list[float] | None]:
    """Return the values of a shading, and their range."""
    if shading == "none":
        return None, None
    alpha = _on_grid(_POINTS, coefficients, sheet)
    signed = shading == "R"
    values = np.asarray(level_determinant(alpha, coefficients) if signed else least_singular_value(alpha, vehicle))
    short = [float(f"{value:.5g}") for value in values.ravel().tolist()]
    return short, [float(values.min()), float(values.max())]


@lru_cache(maxsize=32)
def _types(coefficients: Coefficients, sheet: Color) -> list[str | None]:
    """Return the types of the nodes of the paper's grid, row by row; None where R has no sign."""
    alpha = _on_grid(DEFAULT_DIVISIONS + 1, coefficients, sheet)
    third, fourth = types_of(sheet, alpha[..., 0], alpha[..., 1], coefficients, math.pi / (2 * DEFAULT_DIVISIONS))
    signed = np.abs(level_determinant(alpha, coefficients)) > noise_of(coefficients)
    rows = zip(third.ravel().tolist(), fourth.ravel().tolist(), signed.ravel().tolist(), strict=True)
    return [text_from_types(a, b) if there else None for a, b, there in rows]


@lru_cache(maxsize=64)
def _rings(name: str, vehicle: Vehicle, coefficients: Coefficients, sheet: Color) -> list[Any] | None:
    """Return a region as rings, or None where the vehicle's flyable region is unknown."""
    import shapely

    from gaitgraph.surface.admissible import admissible_region, hover_region, sign_region

    if name == "hover":
        region = hover_region(vehicle)
    elif name == "flyable":
        try:
            region = admissible_region(vehicle, coefficients=coefficients, accuracy=_ACCURACY)
        except GaitgraphError:
            return None
    else:
        sign: Any = "positive" if name == "R>0" else "negative"
        region = sign_region(sign, vehicle, color=sheet, coefficients=coefficients, accuracy=_ACCURACY)
    rings = shapely.get_rings(shapely.get_parts(region.inner))
    return [np.round(shapely.get_coordinates(ring), 5).tolist() for ring in rings]
