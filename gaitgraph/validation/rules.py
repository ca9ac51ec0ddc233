"""The rules of the paper: on the surface, two-color, continuous.

A rule is a function from a gait with its criteria to a check. It holds along all segments, by closed form or a bound.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gaitgraph.invertibility.matrices import hover_thrust_shares
from gaitgraph.surface.sheets import (
    COLORS,
    color_of,
    neighbors_allowed,
    sheet_distances,
    sheet_jumps,
    text_from_types,
    types_at,
)
from gaitgraph.tolerances import DEFAULT_TOLERANCE, SAME_ANGLE
from gaitgraph.validation.report import Check, GaitPoint, check_of

if TYPE_CHECKING:
    from gaitgraph.validation.judged import JudgedGait
    from gaitgraph.vehicle import Vehicle

_TAKE_ROOTS = "take (α3, α4) from the roots of (α1, α2)"


def compared(
    ok: bool, found: str, limit: str, place: GaitPoint | None, advice: str
) -> str:
    """Return what was found and its limit in words; if it is not ok, the place and the advice too."""
    if ok:
        return f"{found}, limit {limit}"
    return f"{found} at {place}, limit {limit}: {advice}"


def idle_pair(place: GaitPoint, vehicle: Vehicle) -> str:
    """Return the pair of rotors that idles in hover at a place, such as "rotors 1 and 3", "" if none does."""
    shares = hover_thrust_shares(np.array(place.alpha), vehicle)
    idle = np.flatnonzero(np.abs(shares) <= DEFAULT_TOLERANCE)
    if len(idle) != 2:
        return ""
    return f"rotors {idle[0] + 1} and {idle[1] + 1}"


def on_surface(gait: JudgedGait) -> Check:
    """Check that Rφ and Rθ vanish, to within the tolerance."""
    value, place = gait.residual
    limit = gait.criteria.tolerance
    message = compared(
        value <= limit,
        f"max(|Rφ|, |Rθ|) = {value:.2g}",
        f"{limit:g}",
        place,
        _advice_off_surface(gait, place),
    )
    return check_of(
        "on_surface", value <= limit, message, value=value, limit=limit, place=place
    )


def _advice_off_surface(gait: JudgedGait, place: GaitPoint) -> str:
    """Return what brings a gait onto the surface that is farthest from it at a place."""
    segments, criteria = gait.segments, gait.criteria
    if gait.misreading.advice:
        return gait.misreading.advice
    if gait.lone.is_near(place.point + 1):
        return gait.lone.note
    if criteria.coefficients.is_raised:
        _, from_blue = sheet_distances(place.alpha, criteria.coefficients)
        if from_blue <= criteria.tolerance:
            height = criteria.vehicle.heights_in_words
            return f"use red, since on blue the zero-moment direction leans for rotors at a height of {height}"
    advice = f"{_TAKE_ROOTS}, or raise the tolerance"
    bare = segments.number[segments.color == 0]
    is_bare = len(bare) > 0 and place.point + 1 == bare[0] and not place.fraction
    if len(bare) and not is_bare:
        return f"{segments.noun} {bare[0]} lies on neither sheet: {advice}"
    return advice


def two_color(gait: JudgedGait) -> Check:
    """Check Figure 15: neither α3 nor α4 steps from its + plane to its − plane, and each point has a color."""
    segments = gait.segments
    point, message = _first_wrong_pair(gait)
    if point is not None:
        place = segments.place(point)
        return check_of("two_color", False, message, value=1.0, limit=0.0, place=place)
    present = set(segments.color.tolist())
    color = "mixed"
    if len(present) == 1:
        color = color_of(present.pop())
    message = f"all neighbours allowed by Figure 15 of the paper ({color})"
    return check_of("two_color", True, message, value=0.0, limit=0.0)


def _first_wrong_pair(gait: JudgedGait) -> tuple[int | None, str]:
    """Return the first point without color, or that may not be the next one's neighbour, and why; None if all may be."""
    segments, criteria = gait.segments, gait.criteria
    color, number = segments.color, segments.number
    if color[0] and (color == color[0]).all():
        return None, ""  # on one sheet no two types are + and −
    third, fourth = types_at(
        segments.alpha, color, criteria.coefficients, criteria.crossing_tolerance
    )
    allowed = neighbors_allowed((third[:-1], fourth[:-1]), (third[1:], fourth[1:]))
    is_wrong = color == 0
    is_wrong[:-1] |= ~allowed
    if not is_wrong.any():
        return None, ""
    point = int(np.argmax(is_wrong))
    if not color[point]:
        return (
            point,
            f"{segments.place(point)} lies on neither sheet and has no color: {_TAKE_ROOTS}",
        )
    here = f"{number[point]} {text_from_types(third[point], fourth[point])}"
    after = point + 1
    there = f"{number[after]} {text_from_types(third[after], fourth[after])}"
    message = (
        f"{segments.noun}s {here} and {there} may not be neighbours (Figure 15): give both one color, or pass a (?,?) "
        "point between them"
    )
    return point, message


def continuous(gait: JudgedGait) -> Check:
    """Check that points are on the sheets of their colors, and segments too.

    Within one color printed digits may move a segment off its sheet by the tolerance.
    """
    segments, tolerance = gait.segments, gait.criteria.tolerance
    bare = np.flatnonzero(segments.color == 0)
    if len(bare):
        place = segments.place(bare[0])
        lies = f"{place} lies on neither sheet"
        idle = idle_pair(place, gait.criteria.vehicle)
        if idle:
            lies = f"{idle} idle at {place}, which lies on neither sheet"
        message = f"{lies}: {_TAKE_ROOTS}"
        return check_of("continuous", False, message, limit=tolerance, place=place)
    before, after = segments.color[:-1], segments.color[1:]
    jumps = sheet_jumps(
        segments.starts, segments.ends, before, after, gait.criteria.coefficients
    )
    limits = np.where(before != after, SAME_ANGLE, tolerance)
    worst = int(np.argmax(jumps / np.maximum(limits, SAME_ANGLE)))
    jump = float(jumps[worst])
    limit = float(limits[worst])
    changes_color = bool(before[worst] != after[worst])
    farthest = int(np.argmax(gait.off))
    off = float(gait.off[farthest])
    breaks_by_jump = changes_color and jump > max(limit, off + SAME_ANGLE)
    if off > tolerance and not breaks_by_jump:
        place = segments.place(farthest)
        color = color_of(segments.color[farthest])
        near = gait.distances[farthest] <= tolerance
        on_others = [f", on the {COLORS[k]} one" for k in np.flatnonzero(near)]
        message = (
            f"{place} is colored {color} but lies off that sheet{''.join(on_others)}, by {off:.4f} rad (limit "
            f"{tolerance:g}): give it the color of its sheet, or take (α3, α4) from the sheet of its color"
        )
        return check_of(
            "continuous", False, message, value=off, limit=tolerance, place=place
        )
    place = segments.place(worst)
    ok = jump <= limit
    message = "every segment stays on its sheet"
    if not ok:
        cause = "wraps by π or leaves its sheet"
        if changes_color:
            cause = "changes color"
        size = f"{jump:.4f} rad (limit {limit:g})"
        message = f"(α3, α4) jumps by {size} after {place}, where it {cause}: stay on one sheet"
    return check_of("continuous", ok, message, value=jump, limit=limit, place=place)
