"""The report on a gait, with one check for each rule.

*Valid* gaits obey the paper's rules: closed, on the surface, two-color, continuous, R of one sign. *Flyable* gaits also
obey the physics, always with the exact coefficients of the vehicle: the decoupling matrix is well invertible, hover
thrusts are positive, and thrusts, tilt angles and rates are within limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal, TypedDict

from gaitgraph.angles import figure, figures_apart
from gaitgraph.arrays import freeze_arrays
from gaitgraph.gait.table import RATE_UNITS
from gaitgraph.pictured import Pictured, pandas
from gaitgraph.records import Record
from gaitgraph.surface.loop_colorings import Colorings
from gaitgraph.texts import table_lines

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


_LIKELY = {
    "rate": 100.0,
    "acceleration": 10_000.0,
}  # a larger limit is probably in degrees
_YES = {True: "yes", False: "no", None: "unknown"}

LIMITED = {
    "thrust_limit": "max_thrust",
    "tilt_range": "tilt_range",
    "tilt_rate": "max_tilt_rate",
    "tilt_acceleration": "max_tilt_acceleration",
}
"""The conditions of flyable that need a limit, and what a vehicle that states it calls it."""

PAPER_RULES = ("closed", "on_surface", "two_color", "continuous", "R_sign")
"""The checks of the paper's rules; all others are physics."""

# The paper's rules that flight does not need: on the surfaces no small tilt makes the matrix singular.
_SURFACE_RULES = frozenset({"closed", "on_surface", "two_color", "continuous"})
_WORDS = {"thrust_limit": "thrust", "tilt_range": "tilt angle"}


def limited_quantities(names: Iterable[str]) -> str:
    """Return what the conditions of :data:`LIMITED` with these names limit, in words.

    >>> limited_quantities(["thrust_limit", "tilt_rate"])
    'thrust, tilt rate'
    """
    return ", ".join(_WORDS.get(name, name.replace("_", " ")) for name in names)


def not_judged_text(names: Iterable[str]) -> str:
    """Return the sentence that names the conditions without a limit, empty if there are none."""
    words = limited_quantities(names)
    if not words:
        return ""
    return f"No limit stated of {words}."


class CheckOptions(TypedDict, total=False):
    """Options of all checks; see :func:`gaitgraph.validation.validating.check_gait`."""

    tolerance: float
    floor: float
    angle_rounding: float | None


class State(Enum):
    """The three states of a check; their values are its marks in a summary."""

    HOLDS = "ok"
    BROKEN = "NO"
    UNDECIDED = "??"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Check(Record):
    """The result of one rule.

    Parameters
    ----------
    name
        The rule.
    state
        Whether it holds along the whole gait, is broken, or is undecided: a sign of R that is within the error of
        coefficients and angles, or hover thrusts of other than four rotors whose sign the bounded search leaves open.
    message
        One line with the value and the limit; for a broken rule also the place and what would help.
    value, limit
        The value at the worst place and its limit, in the unit of the message, or None.
    where
        The worst place: segment, counted from 0, fraction along it, and tilt angles [rad]; or None.
    follows_from
        The name of the broken rule that this one is broken by, or None.
    """

    name: str
    state: State
    value: float | None = None
    limit: float | None = None
    where: dict[str, Any] | None = None
    message: str
    follows_from: str | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def kind(self) -> Literal["valid", "flyable"]:
        """What the rule is for: "valid" for the paper's rules, "flyable" for physics."""
        return "valid" if self.name in PAPER_RULES else "flyable"

    @property
    def ok(self) -> bool:
        """Whether the rule holds along the whole gait."""
        return self.state is State.HOLDS

    @property
    def decided(self) -> bool:
        """Whether it is known if the rule holds."""
        return self.state is not State.UNDECIDED

    @property
    def broken(self) -> bool:
        """Whether the rule is known to be broken."""
        return self.state is State.BROKEN

    @property
    def mark(self) -> str:
        """The mark of the check in a summary: "ok", "NO", or "??" if it is undecided."""
        return self.state.value

    def as_mapping(self) -> dict[str, Any]:
        """Return the check as plain values, ready for JSON, which has no infinities."""
        return {
            "name": self.name,
            "kind": self.kind,
            "ok": self.ok,
            "decided": self.decided,
            "value": _finite(self.value),
            "limit": _finite(self.limit),
            "where": self.where,
            "message": self.message,
            "follows_from": self.follows_from,
        }


def _finite(number: float | None) -> float | None:
    """Return a number, None if it is not finite."""
    if number is None or not math.isfinite(number):
        return None
    return float(number)


def hover_thrust_text(least: float, largest: float) -> str:
    """Return the message of positive hover thrusts, as shares of the weight."""
    return f"hover thrusts {least:.3f} to {largest:.3f} of m·g per rotor, all positive"


@dataclass(frozen=True, slots=True, kw_only=True)
class GaitPoint(Record):
    """A place on a gait: a point, counted from 0, the fraction of the segment to the next one, angles and time.

    `noun` is the word for the points of the gait: "row" in a table, "corner", or "chord" of a curve.
    """

    point: int
    fraction: float
    alpha: tuple[float, ...]
    t: float | None = None
    noun: str = "row"

    def as_mapping(self) -> dict[str, Any]:
        """Return the place as plain values: a row, counted from 1, with its time, or a segment, counted from 0."""
        place: dict[str, Any] = {"segment": self.point}
        if self.noun == "row":
            place = {"row": self.point + 1, "t": self.t}
        return place | {"fraction": self.fraction, "alpha": list(self.alpha)}

    def __str__(self) -> str:
        """Return the place in words: number of the corner or row, fraction, time, and tilt angles."""
        between = ""
        time = ""
        if self.fraction:
            between = f" and {100 * self.fraction:.0f} % of the way to the next"
        if self.t is not None:
            time = f", t = {self.t:.6g} s"
        angles = ", ".join(f"{angle:.3f}" for angle in self.alpha)
        return f"{self.noun} {self.point + 1}{between}{time} ({angles})"


def limit_check(
    name: str,
    peak: float,
    joint: int,
    limit: float | None,
    advice: str,
    place: GaitPoint | None = None,
) -> Check:
    """Return the check of a peak of one tilt angle's derivative, of a row if it has a place, against the limit."""
    slack = 1e-12 if place is None else 1e-9  # of floats
    ok = limit is None or peak <= limit * (1 + slack)
    size = figure(peak)
    stated = "; the vehicle states no limit"
    if limit is not None:
        allowed = figure(limit)
        if not ok:
            size, allowed = figures_apart(peak, limit)
        stated = f", limit {allowed}"
    text = "infinite"
    if math.isfinite(peak):
        text = f"{size} {RATE_UNITS[name.removeprefix('tilt_')]}"
    message = f"peak {text} (α{joint})"
    if not ok and place is not None:
        message += f" at {place}"
    message += stated
    if not ok:
        message += f": {advice}"
    return check_of(name, ok, message, value=peak, limit=limit, place=place)


def check_of(
    name: str,
    state: State | bool,
    message: str,
    *,
    value: float | None = None,
    limit: float | None = None,
    place: GaitPoint | None = None,
) -> Check:
    """Return a check at a place; a state may be whether it holds."""
    if isinstance(state, bool):
        state = State.HOLDS if state else State.BROKEN
    where = None
    if place is not None:
        where = place.as_mapping()
    return Check(
        name=name,
        state=state,
        message=message,
        value=value,
        limit=limit,
        where=where,
    )


def unlikely_limits(limits: Mapping[str, Any]) -> list[str]:
    """Return a warning for each limit of a derivative that is so large that it is probably in degrees.

    >>> unlikely_limits({"rate": 300.0, "acceleration": 50.0})
    ["the limit of the tilt rate is 300 rad/s = 17,189°/s: for degrees write '300deg'"]
    """
    warnings = []
    for kind, most in _LIKELY.items():
        limit = limits.get(kind)
        if isinstance(limit, list):
            limit = max(limit)
        if limit is not None and limit > most:
            unit = RATE_UNITS[kind]
            degrees = f"{math.degrees(limit):,.0f}{unit.replace('rad', '°')}"
            warnings.append(
                f"the limit of the tilt {kind} is {figure(limit)} {unit} = {degrees}: for degrees write '{limit:g}deg'"
            )
    return warnings


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Report(Pictured):
    """All checks of one gait; false in a condition if it is not valid.

    The rules of planes do not apply to vehicles that are not symmetric, and to other than four rotors: without them
    `valid` is None, and a report is false in a condition if the gait is not flyable.

    Parameters
    ----------
    checks
        One for each rule.
    reachable_from_hover, reachability
        Whether a flight from hover can enter and leave the gait, None if undecided or not asked; and the reason.
    notes
        Warnings that belong to no rule.
    rows
        Number of rows, for a table.
    listing
        The colourings of the gait's loop, or None.
    repeats
        Whether the motion repeats; False for a path that is run once.
    said
        Warnings that were given when the table was read.
    unlimited
        The conditions, of :data:`LIMITED`, whose limit the vehicle does not state.
    hover_power, hover_power_over
        The rotors' mean power in hover, relative to that at α = 0, by momentum theory; None where hover thrusts are
        not all positive. The mean is over the "time" of a period, or without times over the "length" of the loop.
    hover_thrusts
        The least and the largest thrust of a rotor in hover, as shares of the weight; None where not all are positive.
    """

    checks: tuple[Check, ...]
    reachable_from_hover: bool | None = None
    reachability: str = ""
    notes: tuple[str, ...] = ()
    rows: int | None = None
    listing: Colorings | None = None
    repeats: bool = True
    said: tuple[str, ...] = ()
    unlimited: tuple[str, ...] = ()
    hover_power: float | None = None
    hover_power_over: Literal["time", "length"] = "length"
    hover_thrusts: tuple[float, float] | None = None

    @property
    def valid(self) -> bool | None:
        """Whether every rule of the paper holds, None where these do not apply."""
        if not any(check.name == "two_color" for check in self.checks):
            return None
        return not any(check.broken for check in self.checks if check.kind == "valid")

    @property
    def two_color(self) -> bool | None:
        """Whether every adjacent pair obeys Figure 15, None where that does not apply."""
        if self.valid is None:
            return None
        return self["two_color"].ok

    @property
    def flyable(self) -> bool | None:
        """Whether the gait is valid, its sign of R decided, and every physical check holds.

        None where the paper's rules do not apply and no check is broken, but one is undecided.
        """
        if all(check.ok for check in self.checks):
            return True
        if self.valid is None and not any(check.broken for check in self.checks):
            return None
        return False

    @property
    def in_words(self) -> str:
        """The verdict in a few words, such as "not flyable, obeys the paper's rules"."""
        if self.flyable is None:
            return "undecided"
        if self.flyable:
            return "flyable"
        if self.valid is None:
            return "not flyable"
        obeys = "obeys" if self.valid else "breaks"
        return f"not flyable, {obeys} the paper's rules"

    @property
    def not_judged(self) -> tuple[str, ...]:
        """The conditions of flyable that were not judged, because neither the vehicle nor the file states a limit."""
        judged = {check.name for check in self.checks if check.limit is not None}
        return tuple(name for name in self.unlimited if name not in judged)

    @property
    def reason(self) -> str:
        """The first reason why the gait is not flyable, or not valid; empty if it is both."""
        broken = [
            check for check in self.checks if not check.ok and not check.follows_from
        ]
        if not broken:
            return ""
        first = min(
            broken, key=lambda check: (not check.broken, check.kind == "flyable")
        )
        return first.message

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings: undecided signs, unlikely limits, and the notes."""
        undecided = [check.message for check in self.checks if not check.decided]
        return tuple(undecided + self._unlikely) + self.notes + self.said

    @property
    def warning_lines(self) -> list[str]:
        """The warnings as lines of text, but for those that a check or the reader of the table tells."""
        told = self._unlikely + list(self.notes)
        return [f"warning: {warning}" for warning in told]

    @property
    def _unlikely(self) -> list[str]:
        limits = {
            check.name.removeprefix("tilt_"): check.limit for check in self.checks
        }
        return unlikely_limits(limits)

    def __getitem__(self, name: str) -> Check:
        for check in self.checks:
            if check.name == name:
                return check
        raise KeyError(name)

    def __bool__(self) -> bool:
        if self.valid is None:
            return bool(self.flyable)
        return self.valid

    def with_timing(self, timed: Any) -> Report:
        """Return the report with what a timed gait adds: the checks of its rates, and the mean power over its time."""
        power = self.hover_power
        if power is not None:
            power = timed.hover_power
        checks = (*self.checks, *timed.rate_checks())
        return replace(self, checks=checks, hover_power=power, hover_power_over="time")

    def to_pandas(self) -> Any:
        """Return the checks as a pandas frame, a row for each."""
        return pandas().DataFrame([check.as_mapping() for check in self.checks])

    def as_mapping(self) -> dict[str, Any]:
        """Return the report as plain values, ready for JSON."""
        out = verdict_of(self)
        out["repeats"] = self.repeats
        out["warnings"] = list(self.warnings)
        if self.rows is not None:
            out["rows"] = self.rows
        if self.valid is None:
            out |= dict.fromkeys(("colorings", "colorings_count"))
        if self.listing is not None:
            first = self.listing.first
            out["colorings"] = [list(coloring.colors) for coloring in first]
            out["coloring_signs"] = [coloring.sign for coloring in first]
            out |= self.listing.as_mapping()
            del out["counts"]
        return out

    @property
    def verdict(self) -> str:
        """The verdict in one line, such as "Flyable: no. Obeys the paper's rules: yes. Reachable from hover: no.".

        It names the conditions that were not judged.
        """
        return f"{self._answers} {not_judged_text(self.not_judged)}".rstrip()

    @property
    def _answers(self) -> str:
        flyable = _YES[self.flyable]
        rules = f"Obeys the paper's rules: {_YES[self.valid]}."
        if self.valid is None:
            flyable = flyable.replace("unknown", "undecided")
            rules = "The paper's rules do not apply to this geometry."
        answers = f"Flyable: {flyable}. {rules}"
        if self.reachability:
            reachable = _YES[self.reachable_from_hover]
            answers += f" Reachable from hover: {reachable}."
        return answers

    @property
    def lines(self) -> list[str]:
        """The verdict, the checks and the power in hover as lines of text."""
        return [self.verdict, *table_lines(self._rows)]

    @property
    def _rows(self) -> list[tuple[str, str, str]]:
        """The mark, the name and the message of each check and of the power in hover."""
        rows = _rows_of_checks(self.checks)
        if self.hover_power is not None:
            message = f"{self.hover_power:.3f} times that of level hover (momentum theory, mean over {self.hover_power_over})"
            rows.append(("--", "hover power", message))
        return rows

    def __str__(self) -> str:
        rows = self._rows
        if self.reachability:
            mark = "ok" if self.reachable_from_hover else "--"
            rows.append((mark, "reachable from hover", self.reachability))
        if self.listing is not None:
            mark = "ok" if self.listing.count else "--"
            rows.append((mark, "colorings", self.listing.in_report))
        return "\n".join([self.verdict, *table_lines(rows), *self.warning_lines])

    def __repr__(self) -> str:
        broken = [check.name for check in self.checks if not check.ok]
        names = ", ".join(broken).replace("_", " ") or "none"
        return f"<Report: {self._answers} {len(self.checks)} checks, not ok: {names}>"


def verdict_of(report: Report | None) -> dict[str, Any]:
    """Return the verdict of a report as plain values, in the order in which answers have them; of no gait without one."""
    names = ("valid", "two_color", "flyable", "reachable_from_hover")
    if report is None:
        out: dict[str, Any] = dict.fromkeys(names, False)
        out |= {"not_judged": [], "hover_power": None, "hover_power_over": None}
        return out | {"checks": []}
    out = {name: getattr(report, name) for name in names}
    out["not_judged"] = list(report.not_judged)
    out["hover_power"] = report.hover_power
    out["hover_power_over"] = report.hover_power_over
    out["checks"] = [check.as_mapping() for check in report.checks]
    return out


def following(checks: Iterable[Check], causes: Mapping[str, str]) -> list[Check]:
    """Return checks, those that are broken by another one with its name; `causes` has the names of both."""
    followed = []
    for check in checks:
        if check.name in causes and check.broken:
            cause = causes[check.name]
            message = f"follows from {cause}: {check.message}"
            followed.append(replace(check, follows_from=cause, message=message))
        else:
            followed.append(check)
    return followed


def lines_of_checks(checks: Iterable[Check]) -> list[str]:
    """Return checks as lines of text; those that follow from another one are in one line behind it."""
    return table_lines(_rows_of_checks(checks))


def _rows_of_checks(checks: Iterable[Check]) -> list[tuple[str, str, str]]:
    listed = list(checks)
    rows = []
    for check in listed:
        if check.follows_from is not None:
            continue
        rows.append((check.mark, check.name.replace("_", " "), check.message))
        names = [other.name for other in listed if other.follows_from == check.name]
        if names:
            words = ", ".join(names).replace("_", " ")
            rows.append(("--", "follow from it", words))
    return rows


def broken_rules(
    report: Report, *, pulling: bool = False
) -> tuple[list[str], list[str]]:
    """Return the messages of the rules that a gait breaks: those that forbid flight, and the others.

    Flight needs an invertible matrix when level, positive hover thrusts unless rotors may pull, and tilt angles and
    rates within the vehicle's limits. The gait need not be on the surfaces.
    """
    harmless = set(_SURFACE_RULES)
    if pulling:
        harmless.add("hover_thrust")
    forbidden = []
    others = []
    for check in report.checks:
        if check.ok:
            continue
        # What follows from another rule is said with that one, unless it alone forbids flight.
        cause = check.follows_from
        if check.name not in harmless:
            if cause is None or cause in harmless:
                forbidden.append(check.message)
        elif cause is None:
            others.append(check.message)
    return forbidden, others
