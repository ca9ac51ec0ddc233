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
from gaitgraph.graph import DEFAULT_DIVISIONS
from gaitgraph.invertibility import (
    Coefficients,
    coefficients_of,
    least_singular_value,
    level_determinant,
    noise_of,
)
from gaitgraph.surface import COLORS, Color, sheet_angles, text_from_types, types_of

if TYPE_CHECKING:
    from gaitgraph.areas import Region
    from gaitgraph.vehicle import Vehicle

__all__ = ["SHADINGS", "map_answer"]

FloatArray = npt.NDArray[np.float64]

SHADINGS = ("R", "least_singular_value", "none")
"""What the map may be shaded by."""

_POINTS = 129
_ACCURACY = 1e-3  # of curved borders [rad]; a pixel of the map is wider
_SINGULAR_BLUE = "with exact coefficients R = 0 on the whole blue sheet: the matrix is singular there"
_ROUNDED_BLUE = (
    "the sign of R on blue is what the rounding of the published coefficients leaves; in exact physics the matrix is "
    "singular on the whole sheet"
)


def map_answer(content: object) -> dict[str, Any]:
    """Return the map that a question asks for, as plain values.

    Parameters
    ----------
    content
        An object with any of ``vehicle``, ``drag_ratio``, ``coefficients`` as in a state, ``sheet`` ("red" or "blue")
        and ``shading`` (one of :data:`SHADINGS`).

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
    return _map(vehicle, coefficients_of(vehicle, kind), sheet, shading)


@lru_cache(maxsize=32)
def _map(vehicle: Vehicle, coefficients: Coefficients, sheet: Color, shading: str) -> dict[str, Any]:
    values = _values(vehicle, coefficients, sheet, shading)
    blank = sheet == "blue" and coefficients.kind == "exact"
    note = None
    if sheet == "blue":
        note = _SINGULAR_BLUE if blank else _ROUNDED_BLUE
    return {
        "n": _POINTS,
        "values": None if values is None else [float(f"{value:.5g}") for value in values.ravel().tolist()],
        "range": None if values is None else [float(values.min()), float(values.max())],
        "regions": _regions(vehicle, coefficients, sheet),
        "types": {"n": DEFAULT_DIVISIONS + 1, "codes": _types(coefficients, sheet)},
        "note": note,
    }


def _on_grid(points: int, coefficients: Coefficients, sheet: Color) -> FloatArray:
    """Return the tilt angles of a sheet over a grid, rows of constant α2, shape (points, points, 4)."""
    axis = np.linspace(-HALF_PI, HALF_PI, points)
    a1, a2 = np.meshgrid(axis, axis)
    return np.stack([a1, a2, *sheet_angles(sheet, a1, a2, coefficients)], axis=-1)


def _values(vehicle: Vehicle, coefficients: Coefficients, sheet: Color, shading: str) -> FloatArray | None:
    if shading == "none":
        return None
    alpha = _on_grid(_POINTS, coefficients, sheet)
    if shading == "R":
        return np.asarray(level_determinant(alpha, coefficients))
    return np.asarray(least_singular_value(alpha, vehicle))


def _types(coefficients: Coefficients, sheet: Color) -> list[str | None]:
    """Return the types of the nodes of the paper's grid, row by row; None where R has no sign."""
    alpha = _on_grid(DEFAULT_DIVISIONS + 1, coefficients, sheet)
    third, fourth = types_of(sheet, alpha[..., 0], alpha[..., 1], coefficients, math.pi / (2 * DEFAULT_DIVISIONS))
    signed = np.abs(level_determinant(alpha, coefficients)) > noise_of(coefficients)
    rows = zip(third.ravel().tolist(), fourth.ravel().tolist(), signed.ravel().tolist(), strict=True)
    return [text_from_types(a, b) if there else None for a, b, there in rows]


def _regions(vehicle: Vehicle, coefficients: Coefficients, sheet: Color) -> list[dict[str, Any]]:
    from gaitgraph.areas import admissible_region, hover_region, sign_region

    of_sheet: dict[str, Any] = {"color": sheet, "coefficients": coefficients, "accuracy": _ACCURACY}
    if sheet == "blue" and coefficients.kind == "exact":
        return []
    found = [
        _drawn("R>0", "R > 0", sign_region("positive", vehicle, **of_sheet)),
        _drawn("R<0", "R < 0", sign_region("negative", vehicle, **of_sheet)),
    ]
    if sheet == "red":
        found.append(_drawn("hover", "all hover thrusts positive", hover_region(vehicle)))
        try:
            flyable = admissible_region(vehicle, coefficients=coefficients, accuracy=_ACCURACY)
        except GaitgraphError:  # a vehicle that nothing can be said of has no such region
            return found
        found.append(_drawn("flyable", "flyable", flyable))
    return found


def _drawn(name: str, label: str, region: Region) -> dict[str, Any]:
    import shapely

    rings = shapely.get_rings(shapely.get_parts(region.inner))
    return {
        "name": name,
        "label": label,
        "polygons": [np.round(shapely.get_coordinates(ring), 5).tolist() for ring in rings],
    }
