"""The queries about a state: its plan with all that the page draws of it, and its roll–pitch diagrams."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import percent
from gaitgraph.explorer.state import State, state_of
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.planning.planner import Plan, plan
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.surface.sheets import Color, sheet_angles
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.report import not_judged_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.planning.request import PlanRequest
    from gaitgraph.robustness.biased import Robustness
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Vehicle

    Progress = Callable[..., None]

CURVES = 16  # singular curves of a diagram
_MOST_ROWS = 401  # of a series; a chart has fewer pixels
_FINE_DIGITS = 10  # of values as small as the rounding of published coefficients
_KEPT_PLANS = 16

_plans: dict[PlanRequest, Plan] = {}  # the most recently used is last


def quiet(*_: object) -> None:
    """Ignore progress. A progress function is called before each step of long work, and may raise to stop it."""


def planned(state: State, progress: Progress = quiet) -> Plan:
    """Return the plan of a state with waypoints; the last few plans are kept, for the diagram and for undo."""
    result = _plans.pop(state.request, None)
    if result is None:
        result = plan(state.request, progress=progress)
    _plans[state.request] = result
    for oldest in list(_plans)[:-_KEPT_PLANS]:
        _plans.pop(oldest, None)  # another thread may have taken it
    return result


def plan_answer(content: Any, progress: Progress = quiet) -> dict[str, Any]:
    """Return the plan of a state, see :func:`state_of`, as the command `plan --json` answers, with what the page draws of it.

    ``status`` may also be "empty". ``verdict``, ``caveat`` and ``surface`` are words; ``series`` and ``vehicle_view`` are
    for the pictures. Without a gait there is a ``posture`` instead: that of the first waypoint, or upright.
    """
    state = state_of(content)
    request = state.request
    more = {
        **in_words(None),
        "surface": "",
        "series": None,
        "posture": _posture(request),
        "vehicle_view": vehicle_view_answer(request.vehicle),
    }
    if not request.waypoints:
        nothing = Plan(request=request, loop=None, reason=None, waypoints=())
        return nothing.as_mapping() | more | {"status": "empty"}
    result = planned(state, progress)
    answer = result.as_mapping() | more
    for loop, other in zip(result.alternatives, answer["alternatives"], strict=True):
        other.update(in_words(loop.report), surface=loop.surface)
    if result.loop is None:
        return answer
    gait, report = result.loop.gait, result.loop.report
    timed = result.timed(samples=state.samples)
    t = timed.t
    if len(t) > _MOST_ROWS:
        t = np.linspace(0.0, timed.period, _MOST_ROWS)
    motion = timed.at(t)
    series = series_answer(motion.alpha, gait, report)
    series |= {"t": to_digits(t, 9), "rates": to_digits(motion.rates.T)}
    return answer | {
        **in_words(report),
        "surface": result.loop.surface,
        "types": list(gait.types),  # of the corners
        "colors": list(gait.colors),
        "series": series,
        "posture": None,
    }


def in_words(report: Report | None) -> dict[str, str]:
    """Return the verdict of a report in words, and what was not judged."""
    if report is None:
        return {"verdict": "", "caveat": ""}
    return {"verdict": report.in_words, "caveat": not_judged_text(report.not_judged)}


def _posture(request: PlanRequest) -> dict[str, Any]:
    """Return the tilt angles of the first waypoint, or upright, and the hover thrusts there, None for each if none hold."""
    alpha1, alpha2 = request.waypoints[0] if request.waypoints else (0.0, 0.0)
    color: Color = "red"
    if request.color == "blue" and request.vehicle.asymmetry is None:
        color = "blue"
    coefficients = coefficients_of(request.vehicle, request.coefficients)
    others = sheet_angles(color, alpha1, alpha2, coefficients)
    alpha = np.array([alpha1, alpha2, *others])
    shares: list[Any] = [None] * 4
    least = matrices.least_singular_value(alpha, request.vehicle)
    if color == "red" and least > DEFAULT_FLOOR:
        shares = to_digits(matrices.hover_thrust_shares(alpha, request.vehicle), 5)
    return {"alpha": to_digits(alpha), "shares": shares}


def series_answer(alpha: FloatArray, gait: Gait, report: Report) -> dict[str, Any]:
    """Return tilt angles of a gait, shape (n, 4) [rad], and the values that follow from them, as lists over the rows.

    R has the coefficients of the gait, the rest is exact. Hover thrusts are None where no thrusts carry the weight.
    """
    shares = np.full(alpha.shape, np.nan)
    if report["hover_thrust"].value is not None:
        shares = matrices.hover_thrust_shares(alpha, gait.vehicle)
    R = matrices.level_determinant(alpha, gait.coefficients)
    least = matrices.least_singular_value(alpha, gait.vehicle)
    return {
        "alpha": to_digits(alpha.T),
        "R": to_digits(R, _FINE_DIGITS),
        "least_singular_value": to_digits(least, _FINE_DIGITS),
        "hover_thrusts": [_finite(rotor) for rotor in to_digits(shares.T, 5)],
    }


def _finite(values: list[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


def vehicle_view_answer(vehicle: Vehicle) -> dict[str, Any]:
    """Return what a picture of a vehicle needs: places of the rotors in arm lengths, the axes of their frames, and spins.

    A frame has x along the tilt axis and z along the thrust at zero tilt, as columns of a rotation.
    """
    tilt_axes, thrust_axes = vehicle.axes
    across = np.cross(thrust_axes, tilt_axes)
    return {
        "places": to_digits(vehicle.scaled_positions),
        "frames": to_digits(np.stack([tilt_axes, across, thrust_axes], axis=-1)),
        "clockwise": (matrices.thrust_signs(vehicle) < 0).tolist(),
    }


def to_digits(values: npt.ArrayLike, digits: int = 6) -> list[Any]:
    """Return an array as nested lists of numbers rounded to some decimals, without negative zeros."""
    return list((np.round(np.asarray(values), digits) + 0.0).tolist())


def diagram_answer(content: Any, progress: Progress = quiet) -> dict[str, Any]:
    """Return the roll–pitch diagrams of a state's planned gait and of the gait biased by its η, as plain values."""
    state = state_of(content)
    answer = {"own": None, "biased": None, "eta": state.eta, "reason": None}
    if not state.request.waypoints:
        return answer | {"reason": "no waypoints yet"}
    result = planned(state, progress)
    if result.loop is None:
        return answer | {"reason": result.reason}
    progress("drawing the roll–pitch diagram")
    robustness = robustness_of(
        result.loop.gait, bias=state.eta, curves=CURVES, progress=progress
    )
    biased = robustness.sweep[0]
    return answer | {"own": diagram_of(robustness.gait), "biased": diagram_of(biased)}


def diagram_of(robustness: Robustness) -> dict[str, Any]:
    """Return the roll–pitch diagram of one gait as plain values."""
    import shapely

    acceptable = robustness.acceptable
    outline = shapely.get_coordinates(acceptable.polygon.simplify(1e-3))
    curves = [curve.points(61) for _, curve in robustness.curves]
    margin_deg = None
    if robustness.tilt_margin is not None:
        margin_deg = math.degrees(robustness.tilt_margin)
    return {
        "curves": [to_digits(points, 5) for points in curves if len(points)],
        "tilt_margin_deg": margin_deg,
        "tilt_margin_reason": robustness.margin.reason or None,
        "verdict": robustness.verdict,
        "acceptable_fraction": acceptable.fraction,
        "acceptable_percent": percent(acceptable.fraction),
        "acceptable": to_digits(outline, 5),
    }
