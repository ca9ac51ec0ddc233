"""The (α1, α2) map below the loop: shading, regions and plane types of one sheet."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import GaitgraphError
from gaitgraph.explorer.state import checked_choice, checked_object, vehicle_of
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

    from gaitgraph.surface.region import Region
    from gaitgraph.vehicle import Vehicle

__all__ = ["SHADINGS", "map_answer"]

FloatArray = npt.NDArray[np.float64]

SHADINGS = ("R", "least_singular_value", "none")
"""What the map may be shaded by."""

_REGIONS = (("R>0", "R > 0"), ("R<0", "R < 0"), ("hover", "all hover thrusts positive"), ("flyable", "flyable"))
_POINTS = 129
_ACCURACY = 1e-3  # of curved borders [rad]; a pixel of the map is wider
_SINGULAR_BLUE = "with exact coefficients R = 0 on the whole blue sheet: the matrix is singular there"
_ROUNDED_BLUE = (
    "the sign of R on blue is what the rounding of the published coefficients leaves; in exact physics the matrix is "
    "singular on the whole sheet"
)


def map_answer(content: object, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Return the map that a question asks for, as plain values.

    Parameters
    ----------
    content
        An object with any of ``vehicle``, ``drag_ratio``, ``coefficients`` as in a state, ``sheet`` ("red" or "blue")
        and ``shading`` (one of :data:`SHADINGS`).
    progress
        Called before each step of long work.

    Returns
    -------
    dict
        ``values`` row by row from α2 = −π/2 up, in each from α1 = −π/2, `n`·`n` of them, or None; ``range``; regions as
        rings in the plane [rad], a hole being a ring too, so that they are filled by the even-odd rule; the plane types
        of the nodes of the paper's grid, None where R has no sign; and a note, or None.

    Raises
    ------
    InputError
        If a name is unknown or a value is not allowed.
    """
    asked = checked_object(content, ("vehicle", "drag_ratio", "coefficients", "sheet", "shading"))
    vehicle = vehicle_of(asked.get("vehicle", "paper"), asked.get("drag_ratio"))
    kind = checked_choice("coefficients", asked.get("coefficients"), ("published", "exact", None))
    sheet = checked_choice("sheet", asked.get("sheet", "red"), COLORS)
    shading = checked_choice("shading", asked.get("shading", "none"), SHADINGS)
    coefficients = coefficients_of(vehicle, kind)
    tell = progress or (lambda _: None)
    tell("shading the map")
    values = _values(vehicle, coefficients, sheet, shading)
    blank = sheet == "blue" and coefficients.kind == "exact"
    note = None
    if sheet == "blue":
        note = _SINGULAR_BLUE if blank else _ROUNDED_BLUE
    return {
        "n": _POINTS,
        "values": None if values is None else values[0],
        "range": None if values is None else values[1],
        "regions": _regions(vehicle, coefficients, sheet, tell),
        "types": {"n": DEFAULT_DIVISIONS + 1, "codes": _types(coefficients, sheet)},
        "note": note,
    }


def _on_grid(points: int, coefficients: Coefficients, sheet: Color) -> FloatArray:
    """Return the tilt angles of a sheet over a grid, rows of constant α2, shape (points, points, 4)."""
    axis = np.linspace(-HALF_PI, HALF_PI, points)
    a1, a2 = np.meshgrid(axis, axis)
    return np.stack([a1, a2, *sheet_angles(sheet, a1, a2, coefficients)], axis=-1)


@lru_cache(maxsize=32)
def _values(
    vehicle: Vehicle, coefficients: Coefficients, sheet: Color, shading: str
) -> tuple[list[float], list[float]] | None:
    """Return the values of a shading, and their range."""
    if shading == "none":
        return None
    alpha = _on_grid(_POINTS, coefficients, sheet)
    signed = shading == "R"
    values = np.asarray(level_determinant(alpha, coefficients) if signed else least_singular_value(alpha, vehicle))
    told = [float(f"{value:.5g}") for value in values.ravel().tolist()]
    return told, [float(values.min()), float(values.max())]


@lru_cache(maxsize=32)
def _types(coefficients: Coefficients, sheet: Color) -> list[str | None]:
    """Return the types of the nodes of the paper's grid, row by row; None where R has no sign."""
    alpha = _on_grid(DEFAULT_DIVISIONS + 1, coefficients, sheet)
    third, fourth = types_of(sheet, alpha[..., 0], alpha[..., 1], coefficients, math.pi / (2 * DEFAULT_DIVISIONS))
    signed = np.abs(level_determinant(alpha, coefficients)) > noise_of(coefficients)
    rows = zip(third.ravel().tolist(), fourth.ravel().tolist(), signed.ravel().tolist(), strict=True)
    return [text_from_types(a, b) if there else None for a, b, there in rows]


def _regions(
    vehicle: Vehicle, coefficients: Coefficients, sheet: Color, tell: Callable[[str], None]
) -> list[dict[str, Any]]:
    if sheet == "blue" and coefficients.kind == "exact":
        return []
    found = []
    for name, label in _REGIONS if sheet == "red" else _REGIONS[:2]:
        tell(f"drawing the region {label}")
        rings = _rings(name, vehicle, coefficients, sheet)
        if rings is not None:
            found.append({"name": name, "label": label, "polygons": rings})
    return found


@lru_cache(maxsize=64)
def _rings(name: str, vehicle: Vehicle, coefficients: Coefficients, sheet: Color) -> list[Any] | None:
    """Return a region as rings, or None where nothing can be said of it for this vehicle."""
    import shapely

    try:
        region = _region(name, vehicle, coefficients, sheet)
    except GaitgraphError:
        if name != "flyable":
            raise
        return None
    rings = shapely.get_rings(shapely.get_parts(region.inner))
    return [np.round(shapely.get_coordinates(ring), 5).tolist() for ring in rings]


def _region(name: str, vehicle: Vehicle, coefficients: Coefficients, sheet: Color) -> Region:
    from gaitgraph.surface.admissible import admissible_region, hover_region
    from gaitgraph.surface.components import sign_region

    if name == "hover":
        return hover_region(vehicle)
    if name == "flyable":
        return admissible_region(vehicle, coefficients=coefficients, accuracy=_ACCURACY)
    sign: Any = "positive" if name == "R>0" else "negative"
    return sign_region(sign, vehicle, color=sheet, coefficients=coefficients, accuracy=_ACCURACY)
