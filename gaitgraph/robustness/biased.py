"""Robustness of a gait to attitude, beside that of its biased gaits; by default with exact coefficients."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import shapely

from gaitgraph._lazy import cached_property
from gaitgraph.angles import angle_within, checked_floor, percent, whole_number
from gaitgraph.gait.gait import checked_factors
from gaitgraph.gait.given import given_gait
from gaitgraph.invertibility.coefficients import Coefficients, coefficients_of
from gaitgraph.invertibility.error_margins import ErrorMargin, drag_margin, servo_margin
from gaitgraph.invertibility.matrices import singular_value_rate
from gaitgraph.invertibility.segment_bounds import least_along, singular_value_bound
from gaitgraph.invertibility.tilt_margins import (
    LeastMargin,
    checked_tilt,
    least_singular_value_within,
    least_singular_value_within_bound,
    least_tilt_margin,
    nearest_singular_attitude,
)
from gaitgraph.pictured import Pictured, pandas
from gaitgraph.records import Record
from gaitgraph.robustness.attitudes import (
    AcceptableAttitudes,
    SingularCurve,
    attitudes_within,
    singular_curve,
)
from gaitgraph.surface.sheets import sheet_distances
from gaitgraph.texts import table_lines
from gaitgraph.timing.timed_gait import TimedGait
from gaitgraph.tolerances import DEFAULT_FLOOR, DEFAULT_TOLERANCE
from gaitgraph.validation.judged import Segments, segments_of
from gaitgraph.validation.report import GaitPoint
from gaitgraph.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import VehicleLike

Scaling = Literal["none", "biased", "scaled"]

DEFAULT_TILT = math.radians(30)

_BRACKET = 5e-4
_MOST_CURVES = 10_000
_POINTS_OF_A_CURVE = 61
_TIMES = 10_001  # of a period, at which a motion is compared with a place


@dataclass(frozen=True, kw_only=True, eq=False)
class Robustness(Record):
    """The robustness of one gait, biased or not.

    `scaling` is "none"; "biased", α3 and α4 times `factor`, the bias η of equations (12) to (15); or "scaled", all four
    times `factor`.
    `margin` brackets the least tilt margin over the period, or has the reason why there is none. It is at `where`, and
    `direction` is (roll, pitch) of the singular attitude nearest to level there [rad], None if all are equally near or
    there is no margin. `acceptable` are the attitudes at which the gait is never singular. `singular_value` is the
    bracket (lower, upper) of the least singular value at the worst attitude within `tilt` [rad]: at `singular_where`
    and (roll, pitch) `singular_attitude`. `curves` are singular curves at places spread evenly over the gait.
    Margins of servos and drags, computed when they are first asked for, keep the least singular value at `floor`.
    `motion` is that of the unscaled gait, None if it has no timing.
    """

    scaling: Scaling
    factor: float
    margin: LeastMargin
    where: GaitPoint
    direction: tuple[float, float] | None
    acceptable: AcceptableAttitudes
    tilt: float
    singular_value: tuple[float, float]
    singular_where: GaitPoint
    singular_attitude: tuple[float, float]
    curves: tuple[tuple[GaitPoint, SingularCurve], ...]
    segments: Segments = field(repr=False, compare=False)
    motion: TimedGait | None = field(repr=False, compare=False)
    vehicle: Vehicle = field(repr=False)
    floor: float

    @cached_property
    def servo_margin(self) -> ErrorMargin:
        """The largest errors of the tilt angles that the gait bears in level flight [rad]."""
        return servo_margin(self.segments.alpha, self.vehicle, floor=self.floor)

    @cached_property
    def drag_margin(self) -> ErrorMargin:
        """The largest relative errors of the drag ratios that the gait bears in level flight."""
        return drag_margin(self.segments.alpha, self.vehicle, floor=self.floor)

    def found_at(self, margin: ErrorMargin) -> tuple[GaitPoint, float | None]:
        """Return where errors beyond a margin do harm, and when, the first time if the gait comes back [s].

        The time is to 1e-4 of the period; None without timing.
        """
        place = self.segments.place(margin.segment, margin.fraction)
        if self.motion is None:
            return place, place.t
        t = np.linspace(0.0, self.motion.period, _TIMES)
        alpha = self.motion.at(t).alpha * _factors_of_angles(self.scaling, self.factor)
        return place, float(t[np.abs(alpha - place.alpha).max(axis=1).argmin()])

    @property
    def tilt_margin(self) -> float | None:
        """The least tilt margin over the period [rad], or None if there is none."""
        return self.margin.upper if self.margin.exists else None

    @property
    def name(self) -> str:
        """Name of the gait in texts, such as "the gait itself" or "biased by 0.8"."""
        if self.scaling == "none":
            return "the gait itself"
        return f"{self.scaling} by {self.factor:g}"

    @property
    def verdict(self) -> str:
        """Where the gait is singular, in the words that reports, pictures and the page share."""
        if self.tilt_margin is None:
            return "singular at every attitude"
        if self.tilt_margin == 0:
            return "singular in level flight"
        if self.acceptable.fraction < 1:
            return f"{percent(self.acceptable.fraction)} acceptable"
        return "no singular attitude"

    @property
    def _texts(self) -> tuple[str, str]:
        """The tilt margin and the acceptable fraction in words."""
        margin = "none"
        if self.tilt_margin is not None:
            margin = f"{math.degrees(self.tilt_margin):.2f}°"
        return margin, f"{100 * self.acceptable.fraction:.2f} %"

    def as_mapping(self) -> dict[str, Any]:
        """Return everything as plain values for JSON; angles without `_deg` in radians."""
        acceptable = self.acceptable
        curves = []
        for place, curve in self.curves:
            x, y, z = curve.normal.tolist()
            numbers = {"R_theta": 0.0 - x, "R_phi": y, "R": z, "kind": curve.kind}
            points = curve.points(_POINTS_OF_A_CURVE).tolist()
            numbers["branches"] = [points] if points else []
            curves.append(place.as_mapping() | numbers)
        answer: dict[str, Any] = {}
        if self.scaling != "none":
            answer = {"eta": self.factor, "scaling": self.scaling}
        margin = self.tilt_margin
        if margin is not None:
            margin = math.degrees(margin)
        outline = shapely.get_coordinates(acceptable.polygon.simplify(1e-3))
        answer |= {
            "tilt_margin_deg": margin,
            "tilt_margin_reason": self.margin.reason or None,
            "tilt_margin_where": self.where.as_mapping(),
            "nearest_singular_attitude": self.direction and list(self.direction),
            "verdict": self.verdict,
            "acceptable_fraction": acceptable.fraction,
            "acceptable_fraction_error": acceptable.error,
            "acceptable_reason": acceptable.reason or None,
            "acceptable_area": float(acceptable.polygon.area),
            "acceptable_outline": outline[:-1].tolist(),
            "tilt_deg": math.degrees(self.tilt),
            "least_singular_value": self.singular_value[1],
            "least_singular_value_at_least": self.singular_value[0],
            "least_singular_value_where": self.singular_where.as_mapping(),
            "least_singular_value_attitude": list(self.singular_attitude),
            "floor": self.floor,
        }
        return answer | self._error_margins() | {"singular_curves": curves}

    def _error_margins(self) -> dict[str, Any]:
        """Return the margins of servos and drags as plain values."""
        answer: dict[str, Any] = {}
        for name, unit, scale, margin in (
            ("servo_margin", "_deg", math.degrees(1.0), self.servo_margin),
            ("drag_margin", "", 1.0, self.drag_margin),
        ):
            key = f"{name}_found{unit}"
            answer |= {
                f"{name}{unit}": scale * margin.proven,
                key: None,
                f"{name}_errors{unit}": (scale * margin.errors).tolist(),
                f"{name}_where": None,
                f"{name}_t": None,
                f"{name}_reason": "no larger errors are searched",
            }
            if margin.found is not None:
                place, time = self.found_at(margin)
                answer |= {
                    key: scale * margin.found,
                    f"{name}_where": place.as_mapping(),
                    f"{name}_t": time,
                    f"{name}_reason": margin.reason,
                }
        return answer

    def __repr__(self) -> str:
        return f"<Robustness of {self.name}: tilt margin {self._texts[0]}, {self._texts[1]} of attitudes acceptable>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobustnessReport(Pictured):
    """The robustness of a gait, and in `sweep` of its biased gaits, then of the scaled ones, in the given order."""

    gait: Robustness
    sweep: tuple[Robustness, ...]
    vehicle: Vehicle
    coefficients: Coefficients

    def to_pandas(self) -> Any:
        """Return the numbers and texts of each gait as a row of a pandas frame."""
        frame = pandas().DataFrame(
            [one.as_mapping() for one in (self.gait, *self.sweep)]
        )
        lists = [
            name for name in frame if frame[name].map(type).isin([list, dict]).any()
        ]
        return frame.drop(columns=lists)

    def as_mapping(self) -> dict[str, Any]:
        """Return everything as plain values: `biased` for one η, `sweep` for any number."""
        sweep = [scaled.as_mapping() for scaled in self.sweep]
        return self.gait.as_mapping() | {
            "vehicle": self.vehicle.name,
            "coefficients": self.coefficients.kind,
            "biased": sweep[0] if len(sweep) == 1 else None,
            "sweep": sweep,
        }

    def __repr__(self) -> str:
        return f"<RobustnessReport: {self.gait!r}, {len(self.sweep)} scaled, vehicle {self.vehicle.name!r}>"

    def __str__(self) -> str:
        lines = [
            f"Robustness to attitude, vehicle {self.vehicle.name}, {self.coefficients.kind} coefficients"
        ]
        value = f"least singular value within {math.degrees(self.gait.tilt):g}° of tilt"
        rows = [("", "tilt margin", "acceptable", value)]
        details = []
        for gait in (self.gait, *self.sweep):
            margin, acceptable = gait._texts
            least = f"{gait.singular_value[1]:.4f}"
            rows.append((gait.name, margin, acceptable, least))
            details.append(f"{gait.name}: {gait.verdict}")
            about = _details(gait) + _error_margins_in_words(gait)
            details += [f"  {line}" for line in about]
        lines += table_lines(rows, right={1, 2})
        return "\n".join(lines + details)


def _details(one: Robustness) -> list[str]:
    """Return the least margin, the acceptable attitudes and the least singular value as lines of text."""
    place = one.where
    if one.tilt_margin is None:
        return [
            f"no tilt margin, no acceptable attitudes: {one.margin.reason}, at {place}"
        ]
    if one.tilt_margin == 0:
        lines = [f"tilt margin 0° at {place}: {one.margin.reason}"]
    elif one.direction is None:
        lines = ["tilt margin 90° in every direction, as on the gait surfaces"]
    else:
        lines = [f"least tilt margin at {place}, towards {_attitude(one.direction)}"]
    lines.append(_acceptable_in_words(one))
    lower, upper = one.singular_value
    if upper == 0:
        tilt = math.degrees(one.tilt)
        lines.append(f"some attitudes within {tilt:g}° of tilt are singular")
        return lines
    worst = f"{one.singular_where}, {_attitude(one.singular_attitude)}"
    proven = math.floor(1e4 * lower) / 1e4  # rounded down, as a bound must be
    lines.append(
        f"least singular value {upper:.4f} (proven lower bound {proven:.4f}) at {worst}"
    )
    return lines


def _acceptable_in_words(one: Robustness) -> str:
    acceptable, error = one.acceptable, ""
    if acceptable.reason:
        return f"no acceptable attitudes around level: {acceptable.reason}"
    if acceptable.error:
        unit = 10.0 ** math.floor(math.log10(100 * acceptable.error))
        bound = math.ceil(100 * acceptable.error / unit) * unit  # one digit, rounded up
        error = f" (error below {bound:.1g} %)"
        if not acceptable.met:
            requested = f"the requested {100 * acceptable.tolerance:g} %"
            error = f" (error below {bound:.1g} %; {requested} is not reached)"
    area = f"{acceptable.polygon.area:.4f} rad²"
    return f"acceptable around level: {one._texts[1]} of attitudes{error}, {area}"


def _error_margins_in_words(one: Robustness) -> list[str]:
    """Return the margins of servos and drags as lines of text; proven ones are rounded down, found ones up."""
    lines = []
    for what, margin, scale, unit in (
        ("errors of the servos", one.servo_margin, math.degrees(1.0), "°"),
        ("errors of the drag ratios", one.drag_margin, 100.0, " %"),
    ):
        proven = math.floor(10 * scale * margin.proven) / 10
        text = f"bears {what} up to {proven:.1f}{unit}"
        if margin.found is None:
            text += ", the most that is searched"
        else:
            found = math.ceil(10 * scale * margin.found) / 10
            place, time = one.found_at(margin)
            text += f"; with {found:.1f}{unit}, at "
            if time is not None:
                text += f"t = {time:.4g} s, "
            text += f"{place}, {margin.reason}"
        lines.append(text)
    return lines


def _attitude(pair: tuple[float, float]) -> str:
    roll, pitch = (math.degrees(angle) + 0.0 for angle in pair)
    return f"roll {roll:.1f}°, pitch {pitch:.1f}°"


def robustness_of(
    gait: GaitLike,
    *,
    bias: float | Iterable[float] = (),
    scale: float | Iterable[float] = (),
    tilt: float = DEFAULT_TILT,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    tolerance: float = 1e-5,
    angle_rounding: float | None = None,
    curves: int = 24,
    floor: float = DEFAULT_FLOOR,
    progress: Callable[[str], None] | None = None,
) -> RobustnessReport:
    """Return how robust to attitude a gait is, and the same for the gait scaled by each η.

    Raises InputError if a value is wrong, and FileProblem if a file cannot be read as a gait table.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.gait.given.given_gait`, on the surfaces or off them; closed.
    bias, scale
        One or more η in (0, 1] by which α3 and α4, equations (12) to (15), or all four angles are scaled.
    tilt
        Tilt within which the least singular value is computed, in [0, π/2) [rad].
    vehicle, coefficients
        By default the vehicle of the gait, table or file, else the paper's, and "exact" coefficients of formula (1) for
        margins and attitudes; "printed" for those of the paper's figures. Singular values are always exact.
    tolerance
        Largest fraction of the roll–pitch diagram by which the acceptable attitudes may be too small.
    angle_rounding
        Error of each angle [rad]; by default the largest distance of a point from the sheets of `coefficients`, if all
        points are within 2e-3 rad of one, else 0.
    curves
        Number of singular curves, at places spread evenly over the gait.
    floor
        The least singular value that errors of servos and drags must leave.
    progress
        Called with a short text before each gait.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> gait = lift([(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red")
    >>> report = robustness_of(gait, bias=[0.9, 0.8])
    >>> [round(math.degrees(one.tilt_margin), 1) for one in (report.gait, *report.sweep)]
    [90.0, 80.7, 74.5]
    """
    tilt = checked_tilt(tilt)
    factors: list[tuple[Scaling, float]] = [
        ("biased", factor) for factor in checked_factors("bias", bias)
    ]
    factors += [("scaled", factor) for factor in checked_factors("scale", scale)]
    factors.append(("none", 1.0))
    curves = whole_number("curves", curves, 0, _MOST_CURVES)
    segments, motion, body = _closed_segments(gait, vehicle)
    if coefficients is None:
        coefficients = "exact"
    numbers = coefficients_of(body, coefficients)
    if angle_rounding is None:
        rounding = _angle_error(segments.alpha, numbers)
    else:
        rounding = angle_within(angle_rounding, "angle_rounding", least=0.0)
    floor = checked_floor(floor)
    gaits = []
    for scaling, factor in factors:
        if progress is not None:
            scaled = "itself" if scaling == "none" else f"{scaling} by {factor:g}"
            progress(f"the gait {scaled}")
        moved_alpha = segments.alpha * _factors_of_angles(scaling, factor)
        moved = replace(segments, alpha=moved_alpha)
        margin = least_tilt_margin(moved.alpha, numbers, angle_rounding=rounding)
        where = moved.place(margin.segment, margin.fraction)
        direction = None
        roll, pitch = nearest_singular_attitude(where.alpha, numbers).tolist()
        if margin.exists and not math.isnan(roll + pitch):
            direction = roll, pitch
        value = (0.0, 0.0)
        singular_where = where
        attitude = direction or (0.0, 0.0)
        if margin.exists and margin.upper > tilt:
            value, singular_where, attitude = _least_singular_value(moved, tilt, body)
        drawn = []
        for place in _spread(moved, curves):
            curve = singular_curve(place.alpha, numbers, angle_rounding=rounding)
            drawn.append((place, curve))
        robustness = Robustness(
            scaling=scaling,
            factor=factor,
            margin=margin,
            where=where,
            direction=direction,
            acceptable=attitudes_within(moved.alpha, numbers, margin, tolerance),
            tilt=tilt,
            singular_value=value,
            singular_where=singular_where,
            singular_attitude=attitude,
            curves=tuple(drawn),
            segments=moved,
            motion=motion,
            vehicle=body,
            floor=floor,
        )
        gaits.append(robustness)
    *sweep, unscaled = gaits
    return RobustnessReport(
        gait=unscaled, sweep=tuple(sweep), vehicle=body, coefficients=numbers
    )


def _factors_of_angles(scaling: Scaling, factor: float) -> FloatArray:
    """Return by what each of the four angles is multiplied."""
    first_two = factor if scaling == "scaled" else 1.0
    return np.array([first_two, first_two, factor, factor])


def _closed_segments(
    gait: GaitLike, vehicle: VehicleLike | None
) -> tuple[Segments, TimedGait | None, Vehicle]:
    """Return the segments of a closed gait, its motion if it is known, and its vehicle."""
    given = given_gait(gait, vehicle=vehicle)
    if given.table is not None and given.motion is None:
        rows, times = given.rows
        return segments_of(rows, "row", times), None, rows.vehicle
    return segments_of(given.gait), given.motion, given.gait.vehicle


def _angle_error(alpha: FloatArray, coefficients: Coefficients) -> float:
    """Return the distance from the planes, if all points are near one, as an error of the angles [rad]."""
    if coefficients.rotors.asymmetry is not None:
        return 0.0
    far = float(sheet_distances(alpha, coefficients)[..., :2].min(axis=-1).max())
    if far > DEFAULT_TOLERANCE:
        return 0.0
    return far


def _least_singular_value(
    segments: Segments, tilt: float, vehicle: Vehicle
) -> tuple[tuple[float, float], GaitPoint, tuple[float, float]]:
    """Return the bracket of the least singular value within a tilt below the margin, where, and the attitude."""
    value = partial(least_singular_value_within_bound, tilt=tilt, vehicle=vehicle)
    bound = singular_value_bound(singular_value_rate(vehicle, level=False))
    found = least_along(
        segments.starts, segments.ends, value, bound, tolerance=_BRACKET
    )
    lower, _, segment, fraction = found.worst()
    place = segments.place(segment, fraction)
    upper, (roll, pitch) = least_singular_value_within(place.alpha, tilt, vehicle)
    return (lower, float(upper)), place, (float(roll), float(pitch))


def _spread(segments: Segments, count: int) -> list[GaitPoint]:
    """Return places spread evenly along a closed gait; one if the gait is a point."""
    size = np.linalg.norm(segments.ends - segments.starts, axis=1)
    gone = np.append(0.0, np.cumsum(size))
    if gone[-1] == 0:
        return [segments.place(0)][:count]
    at = np.arange(count) * (gone[-1] / max(count, 1))
    segment, fraction = np.divmod(np.interp(at, gone, np.arange(len(gone))), 1.0)
    return list(map(segments.place, segment.tolist(), fraction.tolist()))
