"""Gaits side by side: their verdicts, margins, thrusts and rates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gaitgraph._lazy import cached_property
from gaitgraph.errors import InputError, check_kind, wrong
from gaitgraph.gait.gait import name_of
from gaitgraph.pictured import Pictured, pandas
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.timing.timed_gait import TimedGait, timed_gait_of
from gaitgraph.validation.report import limited_quantities

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.gait.given import GaitLike
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.vehicle import VehicleLike

_UNITS = {
    "length": "rad",
    "period": "s",
    "tilt_margin_deg": "degrees",
    "acceptable_fraction": "of attitudes",
    "servo_margin_deg": "degrees",
    "drag_margin": "of the drag ratio",
    "least_hover_thrust": "m·g",
    "largest_hover_thrust": "m·g",
    "hover_power": "of level hover",
    "peak_rate": "rad/s",
    "peak_acceleration": "rad/s²",
}


def comparison_of(
    gaits: Sequence[GaitLike],
    *,
    names: Sequence[str] | None = None,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    period: float | None = None,
) -> Comparison:
    """Return gaits of any form side by side, under their own names by default.

    Hover thrusts and the least singular value are those of level flight, with exact coefficients, as the margins are.
    Raises InputError if there is no gait, or if one or an option is malformed.

    >>> comparison = comparison_of(["gait1", "gait3"])
    >>> [row["flyable"] for row in comparison.rows]
    [False, True]
    """
    check_kind("gaits", gaits, list, tuple)
    timed = []
    own_names = []
    for gait in gaits:
        motion = timed_gait_of(
            gait, vehicle=vehicle, coefficients=coefficients, period=period
        )
        timed.append(motion)
        own_names.append(gait if isinstance(gait, str) else name_of(motion.gait))
    if names is None:
        names = own_names
    check_kind("names", names, list, tuple)
    return Comparison(names=tuple(names), gaits=tuple(timed))


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison(Pictured):
    """Gaits side by side, with their names; `rows` has what is compared of each."""

    names: tuple[str, ...]
    gaits: tuple[TimedGait, ...]

    def __post_init__(self) -> None:
        if not self.gaits:
            raise InputError("gaits must be one or more, got none", field="gaits")
        if len(self.names) != len(self.gaits):
            raise wrong(
                "names",
                "must be one for each gait",
                len(self.names),
                f" of {len(self.gaits)} gaits",
            )

    @cached_property
    def rows(self) -> tuple[dict[str, Any], ...]:
        """What is compared, by name, of each gait; None or NaN for what does not exist."""
        rows = []
        for name, timed in zip(self.names, self.gaits, strict=True):
            rows.append({"gait": name} | _numbers(timed))
        return tuple(rows)

    def as_mapping(self) -> dict[str, Any]:
        """Return the rows as plain values, ready for JSON."""
        rows = [
            {name: _finite_or_none(value) for name, value in row.items()}
            for row in self.rows
        ]
        return {"gaits": rows}

    def to_pandas(self) -> Any:
        """Return the rows as a pandas frame."""
        return pandas().DataFrame(list(self.rows))

    def __repr__(self) -> str:
        return f"<Comparison: {', '.join(self.names)}>"

    def __str__(self) -> str:
        """Return a line for each number of the gaits, and why one is not flyable."""
        lines = []
        for name in self.rows[0]:
            if name == "reason":
                continue
            title = name.removesuffix("_deg").replace("_", " ")
            if name in _UNITS:
                title += f" ({_UNITS[name]})"
            values = [_text(row[name]) for row in self.rows]
            lines.append([title, *values])
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        texts = []
        for cells in lines:
            padded = map(str.ljust, cells, widths)
            texts.append("  ".join(padded).rstrip())
        refused = [row for row in self.rows if row["reason"]]
        texts += [f"{row['gait']} is not flyable: {row['reason']}" for row in refused]
        return "\n".join(texts)


def _numbers(timed: TimedGait) -> dict[str, Any]:
    """Return what is compared of a gait."""
    gait = timed.gait
    report = timed.check()
    robustness = robustness_of(timed, curves=0).gait
    tilt_margin = robustness.tilt_margin
    if tilt_margin is not None:
        tilt_margin = math.degrees(tilt_margin)
    largest_thrust = None
    if report.hover_thrusts is not None:
        _, largest_thrust = report.hover_thrusts
    return {
        "flyable": report.flyable,
        "valid": report.valid,
        "reachable_from_hover": report.reachable_from_hover,
        "not_judged": report.not_judged,
        "reason": report.reason,
        "vehicle": gait.vehicle.name,
        "color": gait.color,
        "length": gait.length if timed.repeats else gait.length / 2,
        "period": timed.period,
        "least_singular_value": report["least_singular_value"].value,
        "tilt_margin_deg": tilt_margin,
        "acceptable_fraction": robustness.acceptable.fraction,
        "servo_margin_deg": math.degrees(robustness.servo_margin.proven),
        "drag_margin": robustness.drag_margin.proven,
        "least_hover_thrust": report["hover_thrust"].value,
        "largest_hover_thrust": largest_thrust,
        "hover_power": report.hover_power,
        "peak_rate": report["tilt_rate"].value,
        "peak_acceleration": report["tilt_acceleration"].value,
    }


def _finite_or_none(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return limited_quantities(value) or "nothing"
    if isinstance(value, str):
        return value
    if value is None or math.isnan(value):
        return "none"
    return f"{value:.4g}"
