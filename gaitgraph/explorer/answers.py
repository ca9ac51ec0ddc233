"""What the page is told of a state: the plan with its series and scene, and the roll–pitch diagram."""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    least_singular_value_on_red,
    level_determinant,
)
from gaitgraph.planning.planner import plan
from gaitgraph.plots.scenes import scene_of
from gaitgraph.robustness.biased import robustness_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from gaitgraph.explorer.state import State
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.planning.plan import Loop, Plan
    from gaitgraph.robustness.biased import Robustness
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import Check
    from gaitgraph.vehicle import Vehicle

__all__ = [
    "checks_answer",
    "diagram_answer",
    "plan_answer",
    "planned",
    "rounded",
    "scene_answer",
    "series_answer",
    "spread_rows",
]

FloatArray = npt.NDArray[np.float64]

_MARKS = {"ok": "ok", "NO": "no", "??": "undecided"}
_MOST_ROWS = 401  # of series; more than there are pixels
_MOST_FRAMES = 101
_SCENE = (480.0, 360.0)
_DIGITS = 6
_FINE_DIGITS = 10  # of what may be as small as the rounding of the published coefficients
_CURVES = 16
_KEPT = 16
_HALF = math.pi / 2

_plans: OrderedDict[str, Plan] = OrderedDict()
_lock = threading.Lock()


def planned(state: State, progress: Callable[[str], None] | None = None) -> Plan:
    """Return the plan of a state that has waypoints; the last few are kept, for the diagram and for undoing."""
    with _lock:
        found = _plans.get(state.key)
        if found is not None:
            _plans.move_to_end(state.key)
            return found
    found = plan(state.request, progress=progress)
    with _lock:
        _plans[state.key] = found
        while len(_plans) > _KEPT:
            _plans.popitem(last=False)
    return found


def rounded(values: FloatArray, digits: int = _DIGITS) -> list[Any]:
    """Return an array as nested lists of numbers with a few decimals, without negative zeros."""
    out: list[Any] = (np.round(values, digits) + 0.0).tolist()
    return out


def plan_answer(state: State, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Return the plan of a state as plain values.

    Parameters
    ----------
    state
        A checked state.
    progress
        Called before each step of long work.

    Returns
    -------
    dict
        ``status`` "empty", "infeasible" or "planned", the verdict with its checks, what there is to draw in the plane,
        the series over one period and the scene of the tilting vehicle; see ``docs/explorer.md``. Angles are exact in
        ``corners`` and ``vertices``, elsewhere rounded to 1e-6 rad for the picture.
    """
    if state.empty:
        return _nothing("empty", None)
    result = planned(state, progress)
    others = [_alternative(loop) for loop in result.alternatives]
    if result.loop is None:
        told = {"obstacles": [asdict(obstacle) for obstacle in result.obstacles], "warnings": list(result.warnings)}
        return _nothing("infeasible", result.reason) | told | {"alternatives": others}
    loop = result.loop
    timed = result.timed(samples=state.samples)
    report = loop.report
    return {
        "status": "planned",
        "reason": result.reason,
        "color": loop.color,
        "sign": loop.sign,
        "length": loop.length,
        "lower_bound": loop.lower_bound,
        "valid": report.valid,
        "two_color": report.two_color,
        "flyable": report.flyable,
        "reachable_from_hover": report.reachable_from_hover,
        "checks": checks_answer(report.checks),
        "warnings": list(result.warnings),
        "obstacles": [asdict(obstacle) for obstacle in result.obstacles],
        "corners": loop.gait.alpha.tolist(),
        "types": list(loop.gait.types),
        "colors": list(loop.gait.colors),
        "path": _closed_path(loop),
        "vertices": loop.path.vertices().tolist(),
        "order": list(loop.order),
        "alternatives": others,
        **_series_and_scene(timed, hovers=report["hover_thrust"].value is not None),
    }


def _nothing(status: str, reason: str | None) -> dict[str, Any]:
    """Return the answer without a loop: every name, with nothing under it."""
    lists = ("checks", "warnings", "obstacles", "corners", "types", "colors", "path", "vertices", "order")
    return {
        "status": status,
        "reason": reason,
        **dict.fromkeys(("color", "sign", "length", "lower_bound"), None),
        **dict.fromkeys(("valid", "two_color", "flyable", "reachable_from_hover"), False),
        **{name: [] for name in lists},
        "alternatives": [],
        "series": None,
        "scene": None,
    }


def checks_answer(checks: Iterable[Check]) -> list[dict[str, Any]]:
    """Return checks as the page shows them: with a title, a mark, and the angles of the place by name."""
    out = []
    for check in checks:
        place = check.where
        if place is not None:
            angles = dict(zip(("alpha1", "alpha2", "alpha3", "alpha4"), place["alpha"], strict=True))
            place = {name: value for name, value in place.items() if name != "alpha"} | angles
        told = {"title": check.name.replace("_", " "), "mark": _MARKS[check.mark], "where": place}
        out.append(check.as_mapping() | told)
    return out


def _closed_path(loop: Loop) -> list[list[float]]:
    plane = loop.gait.alpha[:, :2]
    return rounded(np.vstack([plane, plane[:1]]))


def _alternative(loop: Loop) -> dict[str, Any]:
    return {
        "color": loop.color,
        "sign": loop.sign,
        "length": loop.length,
        "valid": loop.report.valid if loop.is_judged else None,
        "flyable": loop.report.flyable if loop.is_judged else None,
        "path": _closed_path(loop),
    }


def _series_and_scene(timed: TimedGait, *, hovers: bool) -> dict[str, Any]:
    """Return what changes over one period, at the samples of the table, or at as many as there are pixels."""
    t = timed.t
    if len(t) > _MOST_ROWS:
        t = np.linspace(0.0, timed.period, _MOST_ROWS)
    alpha, rates, _ = timed.at(t)
    gait = timed.gait
    series = series_answer(alpha, gait.vehicle, gait.coefficients, t=t, rates=rates, hovers=hovers)
    return {"series": series, "scene": scene_answer(alpha, gait.vehicle, t=t)}


def series_answer(
    alpha: FloatArray,
    vehicle: Vehicle,
    coefficients: Coefficients,
    *,
    t: FloatArray | None,
    rates: FloatArray | None,
    hovers: bool,
) -> dict[str, Any]:
    """Return tilt angles, shape (n, 4) [rad], and what follows from them, as lists over the rows.

    Parameters
    ----------
    alpha, vehicle, coefficients
        The rows and what they are for; R has these coefficients, the rest is exact.
    t, rates
        Times [s] and tilt rates [rad/s]; left out where they are None.
    hovers
        Whether there are thrusts that carry the weight; else there are no numbers under ``hover_thrusts``.
    """
    shares = hover_thrust_shares(alpha, vehicle) if hovers else np.full(alpha.shape, np.nan)
    thrusts = [[value if math.isfinite(value) else None for value in rotor] for rotor in rounded(shares.T, 5)]
    return {
        **({} if t is None else {"t": rounded(t, 9)}),
        "alpha": rounded(alpha.T),
        **({} if rates is None else {"rates": rounded(rates.T)}),
        "R": rounded(np.asarray(level_determinant(alpha, coefficients)), _FINE_DIGITS),
        "least_singular_value": rounded(_least_singular_values(alpha, vehicle), _FINE_DIGITS),
        "hover_thrusts": thrusts,
    }


def _least_singular_values(alpha: FloatArray, vehicle: Vehicle) -> FloatArray:
    """Return the least singular value of rows, shape (n,): on the red sheet in closed form, which is quicker."""
    if np.array_equal(alpha[:, :2], alpha[:, 2:]):
        return np.asarray(least_singular_value_on_red(alpha[:, 0], alpha[:, 1], vehicle))
    return np.asarray(least_singular_value(alpha, vehicle))


def scene_answer(alpha: FloatArray, vehicle: Vehicle, *, t: FloatArray | None) -> dict[str, Any]:
    """Return the vehicle tilting through rows, shape (n, 4) [rad], in as many frames as can be told apart.

    Each frame has its time under ``t``, or without times the number of its row, from 1.
    """
    rows = spread_rows(len(alpha), _MOST_FRAMES)
    scene = scene_of(alpha[rows], vehicle, size=_SCENE).as_mapping(decimals=1)
    return {**scene, "t": (rows + 1).tolist() if t is None else rounded(t[rows], 9)}


def spread_rows(count: int, most: int) -> npt.NDArray[np.int64]:
    """Return the numbers of at most so many of `count` rows, spread evenly, the first and the last among them.

    >>> spread_rows(7, 4).tolist()
    [0, 2, 4, 6]
    """
    return np.unique(np.round(np.linspace(0, count - 1, min(count, most))).astype(np.int64))


def diagram_answer(state: State, progress: Callable[[str], None] | None = None) -> dict[str, Any]:
    """Return the roll–pitch diagram of a state's plan, and of the gait biased by the state's η, as plain values."""
    out: dict[str, Any] = {
        "extent": [-_HALF, _HALF],
        "own": None,
        "biased": None,
        "eta": state.eta,
        "reason": "no waypoints yet",
    }
    if state.empty:
        return out
    result = planned(state, progress)
    if result.loop is None:
        return out | {"reason": result.reason}
    if progress is not None:
        progress("drawing the roll–pitch diagram")
    found = robustness_of(result.loop.gait, bias=state.eta, tolerance=1e-4, curves=_CURVES, progress=progress)
    return out | {"own": _diagram(found.gait), "biased": _diagram(found.sweep[0]), "reason": None}


def _diagram(one: Robustness) -> dict[str, Any]:
    import shapely

    margin = one.tilt_margin
    outline = shapely.get_coordinates(one.acceptable.polygon.simplify(1e-3))
    curves = [curve.points(61) for _, curve in one.curves]
    return {
        "curves": [rounded(points, 5) for points in curves if len(points)],
        "tilt_margin_deg": None if margin is None else math.degrees(margin),
        "tilt_margin_reason": one.margin.reason or None,
        "acceptable_fraction": one.acceptable.fraction,
        "acceptable_reason": one.acceptable.reason or None,
        "acceptable": rounded(outline, 5),
        "nearest_singular_attitude": None if one.direction is None else list(one.direction),
        "least_singular_value": one.singular_value[1],
        "tilt_deg": math.degrees(one.tilt),
    }
