"""The queries of the page: its state, checked, and the answers: plan, roll–pitch diagram and map.

Input is not trusted. Unknown names, wrong types, counts above :data:`LIMITS` and numbers outside :data:`RANGES` raise
InputError. A vehicle is the name of a preset, never a file.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import HALF_PI, number_of, percent
from gaitgraph.errors import (
    InputError,
    MissingConstant,
    check_fields,
    checked_choice,
    shown,
)
from gaitgraph.graph.nodes import DEFAULT_DIVISIONS
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import REQUEST_FIELDS, PlanRequest, plan_request
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.surface.sheets import (
    COLORS,
    RAISED,
    Color,
    sheet_angles,
    text_from_types,
    types_of,
)
from gaitgraph.timing.timed_gait import DEFAULT_SAMPLES, checked_clock
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.report import not_judged_text, verdict_of
from gaitgraph.vehicle import (
    PAPER,
    Vehicle,
    preset_names,
    vehicle_from_mapping,
    vehicle_named,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import Coefficients
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.planning.loop import Loop
    from gaitgraph.planning.planner import Plan
    from gaitgraph.robustness.biased import Robustness
    from gaitgraph.validation.report import Report

    Progress = Callable[..., None]

LIMITS: dict[str, int] = {
    "waypoints": 64,
    "polygons": 32,
    "corners": 64,
    "rows": 200_000,
    "table_bytes": 8 << 20,
    "request_bytes": 256 << 10,
}
"""The largest counts and sizes in the explorer; the library allows more."""


class Range(NamedTuple):
    """The range of a number, also in words."""

    low: float
    high: float
    allowed: str
    whole: bool = False

    def contains(self, value: object) -> bool:
        """Return whether a value is a number in the range."""
        return (isinstance(value, int) or not self.whole) and self.low <= number_of(
            value
        ) <= self.high


RANGES: dict[str, Range] = {
    "divisions": Range(2, 64, "a whole number from 2 to 64", whole=True),
    "drag_ratio": Range(0.02, 1.0, "a number from 0.02 to 1"),
    "accuracy": Range(1e-5, 0.1, "a number from 1e-5 to 0.1"),
    "period": Range(1e-6, 1e9, "a number of seconds from 1e-6 to 1e9"),
    "samples": Range(1, 10_000, "a whole number from 1 to 10000", whole=True),
    "eta": Range(0.01, 1.0, "a number from 0.01 to 1"),
}
"""The ranges of the numbers of a state; the library allows more divisions and samples, and a finer accuracy."""

DEFAULTS: dict[str, Any] = {
    **REQUEST_FIELDS,
    "waypoints": [],
    "keep_out": [],
    "keep_in": [],
    "vehicle": PAPER.name,
    "drag_ratio": None,
    "accuracy": 1e-4,  # coarser than in the library, so that dragging is smooth
    "samples": DEFAULT_SAMPLES,
    "eta": 0.8,
}
del DEFAULTS["floor"]  # which the page does not let choose
"""The state of an empty page."""

_NOT_OF_A_REQUEST = ("drag_ratio", "samples", "eta")
_MARKS = {"ok": "ok", "NO": "no", "??": "undecided"}
_MOST_ROWS = 401  # of a series; a chart has fewer pixels
_FINE_DIGITS = (
    10  # of values that may be as small as the rounding of the published coefficients
)
CURVES = 16  # singular curves of a diagram
_KEPT_PLANS = 16

_plans: dict[str, Plan] = {}  # the most recently used is last


def quiet(*_: object) -> None:
    """Ignore progress. A progress function is called before each step of long work, and may raise to stop it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A checked state."""

    request: PlanRequest  # an empty state has the waypoint (0, 0) here
    empty: bool  # there are no waypoints
    samples: int  # even intervals per period, of a table
    eta: float  # bias of the gait in the second roll–pitch diagram
    key: str  # equal for two states if and only if they ask for the same plan


def state_of(content: Any) -> State:
    """Return the state of an object with names of :data:`DEFAULTS`; missing names have their defaults.

    ``view`` is ignored. InputError if a name is unknown or a value is out of range.
    """
    check_fields("request", content, (*DEFAULTS, "view"))
    values = {name: content.get(name, default) for name, default in DEFAULTS.items()}
    _check_count("waypoints", values["waypoints"], LIMITS["waypoints"])
    for name in ("keep_out", "keep_in"):
        _check_count(name, values[name], LIMITS["polygons"])
        for number, polygon in enumerate(values[name], start=1):
            _check_count(f"{name} polygon {number}", polygon, LIMITS["corners"])
    if values["method"] == "exact":
        values["divisions"] = DEFAULTS["divisions"]
    for name, allowed in RANGES.items():
        if name != "drag_ratio" and not allowed.contains(values[name]):
            raise InputError(
                f"{name} must be {allowed.allowed}, got {shown(values[name])}"
            )
    samples = checked_clock(values["period"], values["law"], samples=values["samples"])
    fields = {
        name: value for name, value in values.items() if name not in _NOT_OF_A_REQUEST
    }
    fields["vehicle"] = vehicle_of(values["vehicle"], values["drag_ratio"])
    empty = not values["waypoints"]
    request = plan_request(
        **(fields | {"waypoints": [[0.0, 0.0]]} if empty else fields)
    )
    key = "" if empty else json.dumps(request.as_mapping(), sort_keys=True)
    return State(
        request=request, empty=empty, samples=samples, eta=float(values["eta"]), key=key
    )


def vehicle_of(preset: object, drag_ratio: object = None) -> Vehicle:
    """Return a preset, with another drag ratio κ if one is given."""
    checked_choice("vehicle", preset, preset_names())
    vehicle = vehicle_named(str(preset))
    if drag_ratio is None or drag_ratio == vehicle.drag_ratio:
        return vehicle
    allowed = RANGES["drag_ratio"]
    if not allowed.contains(drag_ratio):
        raise InputError(
            f"drag_ratio must be {allowed.allowed}, or null for the preset, got {shown(drag_ratio)}",
            field="drag_ratio",
        )
    return vehicle_from_mapping({"preset": preset, "drag_ratio": drag_ratio})


def _check_count(name: str, value: object, most: int) -> None:
    if not isinstance(value, list):
        raise InputError(f"{name} must be a list, got {shown(value)}")
    if len(value) > most:
        raise InputError(f"{name} must have at most {most} entries, got {len(value)}")


def planned(state: State, progress: Progress = quiet) -> Plan:
    """Return the plan of a state with waypoints; the last few plans are cached, for the diagram and for undo."""
    found = _plans.pop(state.key, None)
    if found is None:
        found = plan(state.request, progress=progress)
    _plans[state.key] = found
    for oldest in list(_plans)[:-_KEPT_PLANS]:
        _plans.pop(oldest, None)  # another thread may have taken it
    return found


def plan_answer(state: State, progress: Progress = quiet) -> dict[str, Any]:
    """Return the plan of a state as plain values: verdict, paths, series over one period, and view of the vehicle.

    ``status`` is "empty", "infeasible" or "planned". Without a gait the view is of one ``posture``: that of the first
    waypoint, or upright. Angles are exact in ``corners`` and ``vertices``, and rounded to 1e-6 rad elsewhere.
    """
    lists = "checks warnings waypoints refusals corners types colors path vertices alternatives"
    answer: dict[str, Any] = {
        "status": "empty",
        **dict.fromkeys(
            ("reason", "advice", "color", "sign", "length", "lower_bound", "series")
        ),
        **_standing(state),
        **verdict_of(None),
        "caveat": "",
        **{name: [] for name in lists.split()},
    }
    if state.empty:
        return answer
    result = planned(state, progress)
    answer |= {
        "status": "infeasible",
        "reason": result.reason,
        "advice": result.advice,
        "waypoints": result.waypoints,
        "refusals": [asdict(refusal) for refusal in result.refusals],
        "warnings": list(result.warnings),
        "alternatives": [
            _outline(loop)
            | {"valid": loop.report.valid, "flyable": loop.report.flyable}
            for loop in result.alternatives
        ],
    }
    loop = result.loop
    if loop is None:
        return answer
    timed, report, gait = result.timed(samples=state.samples), loop.report, loop.gait
    t = (
        timed.t
        if len(timed.t) <= _MOST_ROWS
        else np.linspace(0.0, timed.period, _MOST_ROWS)
    )
    alpha, rates, _ = timed.at(t)
    return answer | {
        "status": "planned",
        **_outline(loop),
        "lower_bound": loop.lower_bound,
        **verdict_answer(report),
        "corners": gait.alpha.tolist(),
        "types": list(gait.types),
        "colors": list(gait.colors),
        "vertices": loop.path.vertices().tolist(),
        "series": series_answer(alpha, gait, report, t=t, rates=rates),
        "posture": None,
        "vehicle_view": vehicle_view_answer(gait.vehicle),
    }


def _standing(state: State) -> dict[str, Any]:
    """Return the posture of the first waypoint, with hover thrusts or None for each, and the view of the vehicle."""
    request, (alpha1, alpha2) = state.request, state.request.waypoints[0][:2]
    color: Color = "blue" if request.color == "blue" else "red"
    others = sheet_angles(
        color,
        alpha1,
        alpha2,
        coefficients_of(request.vehicle, request.coefficients),
    )
    alpha = np.array([alpha1, alpha2, *others])
    shares = matrices.hover_thrust_shares(alpha, request.vehicle)
    holds = (
        color == "red"
        and matrices.least_singular_value(alpha, request.vehicle) > DEFAULT_FLOOR
    )
    posture = {
        "alpha": to_digits(alpha),
        "shares": to_digits(shares, 5) if holds else [None] * 4,
    }
    view = vehicle_view_answer(request.vehicle)
    return {"posture": posture, "vehicle_view": view}


def _outline(loop: Loop) -> dict[str, Any]:
    path = to_digits(loop.gait.alpha[[*range(len(loop.gait.alpha)), 0], :2])
    return {"color": loop.color, "sign": loop.sign, "length": loop.length, "path": path}


def to_digits(values: FloatArray, digits: int = 6) -> list[Any]:
    """Return an array as nested lists of numbers rounded to some decimals, without negative zeros."""
    return list((np.round(values, digits) + 0.0).tolist())


def verdict_answer(report: Report) -> dict[str, Any]:
    """Return the verdict of a report and its checks, each with a title, a mark, and its place with named angles."""
    checks = []
    for check in report.checks:
        place = None if check.where is None else dict(check.where)
        if place is not None:
            place |= {
                f"alpha{k}": angle
                for k, angle in enumerate(place.pop("alpha"), start=1)
            }
        title = {
            "title": check.name.replace("_", " "),
            "mark": _MARKS[check.mark],
            "where": place,
        }
        checks.append(check.as_mapping() | title)
    caveat = not_judged_text(report.not_judged)
    return {**verdict_of(report), "caveat": caveat, "checks": checks}


def series_answer(
    alpha: FloatArray,
    gait: Gait,
    report: Report,
    *,
    t: FloatArray | None,
    rates: FloatArray | None = None,
) -> dict[str, Any]:
    """Return tilt angles of a gait, shape (n, 4) [rad], and the values that follow from them, as lists over the rows.

    R has the coefficients of the gait, the rest is exact. Hover thrusts are None where no thrusts carry the weight.
    """
    vehicle, hovers = gait.vehicle, report["hover_thrust"].value is not None
    shares = (
        matrices.hover_thrust_shares(alpha, vehicle)
        if hovers
        else np.full(alpha.shape, np.nan)
    )
    thrusts = [
        [value if math.isfinite(value) else None for value in rotor]
        for rotor in to_digits(shares.T, 5)
    ]
    least = np.asarray(matrices.least_singular_value(alpha, vehicle))
    return {
        **({} if t is None else {"t": to_digits(t, 9)}),
        "alpha": to_digits(alpha.T),
        **({} if rates is None else {"rates": to_digits(rates.T)}),
        "R": to_digits(
            np.asarray(matrices.level_determinant(alpha, gait.coefficients)),
            _FINE_DIGITS,
        ),
        "least_singular_value": to_digits(least, _FINE_DIGITS),
        "hover_thrusts": thrusts,
    }


def vehicle_view_answer(vehicle: Vehicle) -> dict[str, Any]:
    """Return what a picture of a vehicle needs: bearings of the arms [rad], spins, and the rotors' height in arm lengths."""
    return {
        "bearings": to_digits(np.array(vehicle.arm_angles)),
        "clockwise": (matrices.thrust_signs(vehicle) < 0).tolist(),
        "height": vehicle.height_ratio,
    }


def spread_rows(count: int, most: int) -> npt.NDArray[np.int64]:
    """Return the indices of at most `most` of `count` rows, spread evenly, with the first and the last."""
    return np.unique(
        np.round(np.linspace(0, count - 1, min(count, most))).astype(np.int64)
    )


def diagram_answer(state: State, progress: Progress = quiet) -> dict[str, Any]:
    """Return the roll–pitch diagrams of the planned gait and of the gait biased by η, as plain values."""
    answer = {"own": None, "biased": None, "eta": state.eta}
    if state.empty:
        return answer | {"reason": "no waypoints yet"}
    result = planned(state, progress)
    if result.loop is None:
        return answer | {"reason": result.reason}
    progress("drawing the roll–pitch diagram")
    found = robustness_of(
        result.loop.gait, bias=state.eta, curves=CURVES, progress=progress
    )
    return answer | {
        "own": diagram_of(found.gait),
        "biased": diagram_of(found.sweep[0]),
        "reason": None,
    }


def diagram_of(one: Robustness) -> dict[str, Any]:
    """Return the roll–pitch diagram of one gait as plain values."""
    import shapely

    margin, outline = (
        one.tilt_margin,
        shapely.get_coordinates(one.acceptable.polygon.simplify(1e-3)),
    )
    curves = (curve.points(61) for _, curve in one.curves)
    return {
        "curves": [to_digits(points, 5) for points in curves if len(points)],
        "tilt_margin_deg": None if margin is None else math.degrees(margin),
        "tilt_margin_reason": one.margin.reason or None,
        "verdict": one.verdict,
        "acceptable_fraction": one.acceptable.fraction,
        "acceptable_percent": percent(one.acceptable.fraction),
        "acceptable": to_digits(outline, 5),
    }


SHADINGS = ("R", "least_singular_value", "none")
"""The quantities that the map can show as shading."""

_REGIONS = (
    ("R>0", "R > 0"),
    ("R<0", "R < 0"),
    ("hover", "all hover thrusts positive"),
    ("flyable", "flyable"),
)
_POINTS = 129
_ACCURACY = 1e-3  # of curved borders [rad]; a pixel of the map is wider
_SINGULAR_BLUE = (
    "R = 0 on the whole blue sheet in exact physics: the matrix is singular there."
)
_ROUNDED_BLUE = (
    f"{_SINGULAR_BLUE} The signs of R drawn are rounding noise of the paper's digits."
)


def map_answer(content: Any, progress: Progress = quiet) -> dict[str, Any]:
    """Return the shading, the regions and the plane types of one sheet of the map, as plain values.

    A query may have ``vehicle``, ``drag_ratio``, ``coefficients`` as in a state, ``sheet`` and ``shading``. The answer
    has `n`·`n` ``values``, row by row from α2 = −π/2 up, each from α1 = −π/2, or None; their ``range``; regions as
    rings in the plane [rad], with holes, to be filled by the even-odd rule; the plane types of the nodes of the paper's
    grid, None where R has no sign; a note, or None; and ``raised``, true, if there is a rotor height.
    """
    check_fields(
        "request",
        content,
        ("vehicle", "drag_ratio", "coefficients", "sheet", "shading"),
    )
    vehicle = vehicle_of(content.get("vehicle", "paper"), content.get("drag_ratio"))
    sheet: Color = checked_choice("sheet", content.get("sheet", "red"), COLORS)
    shading: str = checked_choice("shading", content.get("shading", "none"), SHADINGS)
    coefficients = coefficients_of(vehicle, content.get("coefficients"))
    progress("shading the map")
    # On blue R and the least singular value are rounding noise, which is not shaded.
    values, extent = (
        (None, None)
        if sheet == "blue" or shading == "none"
        else _shading(vehicle, coefficients, shading)
    )
    blank = sheet == "blue" and coefficients.kind == "exact"
    singular = _SINGULAR_BLUE
    if vehicle.has_raised_rotors:
        singular = f"Blue is no gait surface {RAISED} {vehicle.heights_in_words}."
    regions, note = [], None if sheet == "red" else singular if blank else _ROUNDED_BLUE
    for name, label in () if blank else _REGIONS if sheet == "red" else _REGIONS[:2]:
        progress(f"drawing the region {label}")
        try:
            rings = _rings(name, vehicle, coefficients, sheet)
        except MissingConstant as error:
            note = f"The region {label} is not drawn: {error}."
            continue
        regions.append({"name": name, "label": label, "polygons": rings})
    return {
        "n": _POINTS,
        "values": values,
        "range": extent,
        "regions": regions,
        "types": {"n": DEFAULT_DIVISIONS + 1, "codes": _types(coefficients, sheet)},
        "note": note,
        **({"raised": True} if vehicle.has_raised_rotors else {}),
    }


def _on_grid(points: int, coefficients: Coefficients, sheet: Color) -> FloatArray:
    """Return the tilt angles of a sheet over a grid, rows of constant α2, shape (points, points, 4)."""
    axis = np.linspace(-HALF_PI, HALF_PI, points)
    a1, a2 = np.meshgrid(axis, axis)
    return np.stack([a1, a2, *sheet_angles(sheet, a1, a2, coefficients)], axis=-1)


@lru_cache(maxsize=32)
def _shading(
    vehicle: Vehicle, coefficients: Coefficients, shading: str
) -> tuple[list[float], list[float]]:
    """Return the values of a shading of the red sheet, and their range."""
    alpha = _on_grid(_POINTS, coefficients, "red")
    function: Any = (
        matrices.level_determinant if shading == "R" else matrices.least_singular_value
    )
    values = (
        np.asarray(function(alpha, coefficients if shading == "R" else vehicle))
        .ravel()
        .tolist()
    )
    return [float(f"{value:.5g}") for value in values], [min(values), max(values)]


@lru_cache(maxsize=32)
def _types(coefficients: Coefficients, sheet: Color) -> list[str | None]:
    """Return the plane types of the nodes of the paper's grid, row by row; None where R has no sign."""
    alpha = _on_grid(DEFAULT_DIVISIONS + 1, coefficients, sheet)
    third, fourth = types_of(
        sheet,
        alpha[..., 0],
        alpha[..., 1],
        coefficients,
        math.pi / (2 * DEFAULT_DIVISIONS),
    )
    signed = np.abs(
        matrices.level_determinant(alpha, coefficients)
    ) > matrices.noise_of(coefficients)
    rows = zip(
        third.ravel().tolist(),
        fourth.ravel().tolist(),
        signed.ravel().tolist(),
        strict=True,
    )
    return [text_from_types(a, b) if there else None for a, b, there in rows]


@lru_cache(maxsize=64)
def _rings(
    name: str, vehicle: Vehicle, coefficients: Coefficients, sheet: Color
) -> list[Any]:
    """Return a region as rings; MissingConstant if the flyable region of the vehicle is unknown."""
    import shapely

    from gaitgraph.surface.admissible import (
        admissible_region,
        hover_region,
        sign_region,
    )

    if name == "hover":
        region = hover_region(vehicle)
    elif name == "flyable":
        region = admissible_region(
            vehicle, coefficients=coefficients, accuracy=_ACCURACY
        )
    else:
        sign: Any = "positive" if name == "R>0" else "negative"
        region = sign_region(
            sign, vehicle, color=sheet, coefficients=coefficients, accuracy=_ACCURACY
        )
    rings = shapely.get_rings(shapely.get_parts(region.inner))
    return [np.round(shapely.get_coordinates(ring), 5).tolist() for ring in rings]
