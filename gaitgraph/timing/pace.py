"""The fastest periodic law under limits: how quickly a gait can be run, and a law for a period that is asked for.

A smooth curve is run without a stop; a gait with corners rests at each, unless it is rounded. The law is twice
continuously differentiable, closed at the seam, and a polynomial of time between knots, so that its largest rate,
acceleration and jerk are bounded between samples by Bernstein coefficients. What exceeds a limit is removed by
stretching time by the exact factor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.timing.limits import KINDS, UNITS, Limits, limits_for
from gaitgraph.timing.paced_gait import PacedGait
from gaitgraph.timing.routes import Route
from gaitgraph.timing.timed_gait import checked_clock

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitgraph.gait.gait import Gait
    from gaitgraph.timing.curve import Curve
    from gaitgraph.timing.rounding import Rounding

__all__ = ["Pacing", "least_period", "paced"]

_NODES = 1000
_NODES_UNDER_JERK = 300
# Periods that a clock may have [s].
_SHORTEST, _LONGEST = 1e-6, 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Pacing:
    """An answer about periods; falsy when no law was found for what was asked.

    Parameters
    ----------
    status
        "ok", "too short" (the period asked for is below the least found), "no period" (a limit of zero on a joint that
        must move, or limits with which the least period is beyond 1e9 s or below 1e-6 s) or "still" (the gait is a
        point, so that no period is the least).
    reason
        One sentence; empty if the status is "ok".
    limits
        What the law had to respect.
    timed
        The law, or None.
    least
        The least period found [s]; None where there is none.
    lower_bound
        A period below which there is certainly no law along this path [s]: no joint can be quicker on its own.
    stretch
        What the found law was stretched by so that limits hold between samples too, minus 1; its price.
    rounding
        How corners were rounded, if they were; None too where the law rests at the corners, being quicker that way.
    note
        Why the law rests although rounding was asked for, or what was left undone; empty as a rule.
    limit, where
        The limit that stands in the way, and a place where it does.
    """

    status: str
    reason: str
    limits: Limits
    timed: PacedGait | None = None
    least: float | None = None
    lower_bound: float = 0.0
    stretch: float = 0.0
    rounding: Rounding | None = None
    note: str = ""
    limit: str | None = None
    where: dict[str, Any] | None = None

    def __bool__(self) -> bool:
        return self.status == "ok"

    @property
    def period(self) -> float | None:
        """The period of the law, or None [s]."""
        return None if self.timed is None else self.timed.period

    def as_mapping(self) -> dict[str, Any]:
        """Return the answer as plain values, ready for JSON."""
        out: dict[str, Any] = {
            "status": self.status,
            "reason": self.reason or None,
            "note": self.note or None,
            "period": self.period,
            "least_period": self.least,
            "lower_bound": self.lower_bound,
            "stretch": self.stretch,
            "limits": self.limits.as_mapping(),
            "limit": self.limit,
            "where": self.where,
            "rounding": None if self.rounding is None else self.rounding.as_mapping(),
        }
        if self.timed is not None:
            peaks = (self.timed.peak_rates(), self.timed.peak_accelerations(), self.timed.peak_jerks())
            out |= {f"peak_{kind}": float(peak.max()) for kind, peak in zip(KINDS, peaks, strict=True)}
            out["touched"] = [touch.as_mapping() for touch in self.timed.limits_touched()]
        return out

    def __repr__(self) -> str:
        if self.timed is None:
            return f"<Pacing: {self.status}>"
        return f"<Pacing: {str(self).splitlines()[0]}>"

    def __str__(self) -> str:
        lines = []
        if self.timed is not None and self.least is not None:
            lines.append(
                f"period {self.timed.period:.4f} s; least found {self.least:.4f} s, none below {self.lower_bound:.4f} s"
            )
            lines += [f"  {touch}" for touch in self.timed.limits_touched()]
        else:
            lines.append(self.reason)
        if self.rounding is not None:
            lines.append(f"  {self.rounding}")
        if self.note:
            lines.append(f"  {self.note}")
        return "\n".join(lines)


def least_period(
    path: Gait | Curve | Rounding,
    limits: Limits | None = None,
    *,
    rounding: float | str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    nodes: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Pacing:
    """Return the fastest periodic law along a path under limits.

    Parameters
    ----------
    path
        A gait of one color, a curve, or a rounded gait.
    limits
        What to respect; those of the vehicle by default.
    rounding
        For a gait: round its corners by this tolerance first; radians in the (α1, α2) plane, or a text such as "2deg".
        Without it the law rests at every corner; only a gait that does nothing but turn back on its line is run
        without a rest. With it the law is never slower than at rest: where resting is quicker, as it can be with tiny
        blends, that law is the answer, with a note.
    samples, rate
        Even intervals per period, or samples per second, for tables; see :func:`gaitgraph.timing.timed_gait.parametrize`.
    nodes
        Nodes along a curve, 1000 by default and 300 under a jerk limit; the period comes down with 1/nodes. Every piece
        of the curve has at least eight.
    progress
        Called with a line of text now and then; programmes under a jerk limit may take a minute in all.

    Returns
    -------
    Pacing
        Falsy if there is no law: a limit of zero on a joint that moves, a period that no clock has, or a gait that is
        a point.

    Raises
    ------
    InputError
        If an argument is not what is allowed, or the gait is not on one sheet.

    Notes
    -----
    The period is the least of what was searched: laws with constant s̈ between nodes, exactly; under a jerk limit, the
    best of a few linear programmes. `lower_bound` says how much there is left to find at most. Without a jerk limit the
    acceleration changes over 0.1 % of the period (a thousandth of a leg's time, where the law rests). With more than
    5000 nodes no programmes are solved; a note says so. Not guaranteed: that looser limits are found to be quicker.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> there_and_back = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    >>> pacing = least_period(there_and_back, Limits(acceleration=20.0))
    >>> bool(pacing), round(pacing.lower_bound, 6), 0.8 <= pacing.period < 0.801
    (True, 0.8, True)
    """
    route = Route(path, rounding)
    limits = limits_for(limits, route.vehicle)
    if samples is not None or rate is not None:
        checked_clock(1.0, "smooth", samples=samples, rate=rate)
    count = _checked_nodes(nodes, limits)
    if route.still:
        reason = "the gait is a point: it stands still at any period, and none is the least"
        return Pacing(status="still", reason=reason, limits=limits, least=0.0, rounding=route.rounding)
    blocked = route.blocked(limits)
    if blocked is not None:
        kind, joint, alpha = blocked
        place = ", ".join(f"{angle:.3f}" for angle in alpha)
        return Pacing(
            status="no period",
            reason=f"no period meets the {kind} limit 0 of α{joint}, which must move from ({place}) on",
            limits=limits,
            rounding=route.rounding,
            limit=kind,
            where={"alpha": alpha.tolist()},
        )
    resting = route.at_rest(path)
    routes = (route,) if resting is None else (route, resting)
    bound = _lower_bound(routes, limits)[0]
    if bound > _LONGEST:
        return _out_of_range(route, limits, bound)
    if progress is not None:
        progress("looking for the fastest law")
    widths, tilts, stretch, note = route.fastest(limits, count, progress)
    period = float(widths.sum())
    if resting is not None:
        at_rest = resting.fastest(limits, count)
        if float(at_rest[0].sum()) < period:
            note = "; ".join(filter(None, (_resting(float(at_rest[0].sum()), period), note)))
            route, (widths, tilts, stretch, _) = resting, at_rest
            period = float(widths.sum())
    if not _SHORTEST <= period <= _LONGEST:
        return _out_of_range(route, limits, period)
    timed = PacedGait(
        gait=route.gait,
        period=period,
        law="least-period",
        samples=checked_clock(period, "smooth", samples=samples, rate=rate),
        curve=route.curve,
        widths=widths,
        tilts=tilts,
        limits=limits,
    )
    return Pacing(
        status="ok",
        reason="",
        limits=limits,
        timed=timed,
        least=period,
        lower_bound=min(bound, period),
        stretch=stretch,
        rounding=route.rounding,
        note=note,
    )


def paced(
    path: Gait | Curve | Rounding,
    limits: Limits | None = None,
    period: float = 1.0,
    *,
    rounding: float | str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    nodes: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Pacing:
    """Return a law for a given period, or say why there is none.

    Parameters
    ----------
    period
        T [s].
    path, limits, rounding, samples, rate, nodes, progress
        As for :func:`least_period`.

    Returns
    -------
    Pacing
        The fastest law with its time stretched to the period: rates fall with 1/T, accelerations with 1/T², jerks
        with 1/T³. Falsy with status "too short" if the period is below the least found; it is certain that there is
        no law only below `lower_bound`.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> there_and_back = lift([(0.4, -0.4), (1.2, -0.4)], "red")
    >>> print(paced(there_and_back, Limits(acceleration=20.0), 0.7))
    T = 0.7 s is too short: α1 alone needs at least 0.8000 s under the limits
    """
    checked_clock(period, "smooth", samples=samples, rate=rate)
    route = Route(path, rounding)
    limits = limits_for(limits, route.vehicle)
    if route.still:
        timed = PacedGait(
            gait=route.gait,
            period=float(period),
            law="paced",
            samples=checked_clock(period, "smooth", samples=samples, rate=rate),
            curve=route.curve,
            widths=np.array([float(period)]),
            tilts=np.array(route.gait.alpha[None, :1, :2]),
            limits=limits,
        )
        return Pacing(status="ok", reason="", limits=limits, timed=timed, least=0.0, rounding=route.rounding)
    found = least_period(path, limits, rounding=rounding, nodes=nodes, progress=progress)
    if found.timed is None or found.least is None:
        return found
    if period >= found.least:
        timed = found.timed.at_period(float(period), checked_clock(period, "smooth", samples=samples, rate=rate))
        return replace(found, timed=timed)
    touch = max(found.timed.limits_touched(), key=lambda touch: touch.share)
    reason = f"T = {period:g} s is too short: "
    if period < found.lower_bound:
        resting = route.at_rest(path)
        bound, joint = _lower_bound((route,) if resting is None else (route, resting), limits)
        reason += f"α{joint} alone needs" if joint else "any law along this path needs"
        reason += f" at least {bound:.4f} s under the limits"
    else:
        factor = (found.least / period) ** (1 + KINDS.index(touch.kind))
        reason += (
            f"the least found is {found.least:.4f} s; at T the {touch.kind} of {touch.names} would reach "
            f"{touch.limit * factor:.3g} {UNITS[touch.kind]}, limit {touch.limit:.3g}"
        )
    return replace(found, status="too short", reason=reason, timed=None, limit=touch.kind, where=touch.where())


def _lower_bound(routes: tuple[Route, ...], limits: Limits) -> tuple[float, int]:
    """Return a period below which there is certainly no law along any of the routes, and the joint that says so."""
    return min((route.lower_bound(limits) for route in routes), key=lambda found: found[0])


def _resting(at_rest: float, rounded: float) -> str:
    return f"rests at the corners: {at_rest:.4f} s, against {rounded:.4f} s with rounded corners"


def _out_of_range(route: Route, limits: Limits, period: float) -> Pacing:
    """Return the answer where the least period is none that a clock may have."""
    kind, words = limits.slowest(route.extent)
    beyond = f"beyond {_LONGEST:g} s" if period > _LONGEST else f"below {_SHORTEST:g} s"
    return Pacing(
        status="no period",
        reason=f"the least period under the {words} would be {beyond}, which no clock here has",
        limits=limits,
        rounding=route.rounding,
        limit=kind,
    )


def _checked_nodes(nodes: int | None, limits: Limits) -> int:
    if nodes is None:
        return _NODES if limits.jerk is None else _NODES_UNDER_JERK
    if isinstance(nodes, bool) or not isinstance(nodes, (int, np.integer)) or not 10 <= nodes <= 100_000:
        raise InputError(f"nodes: {shown(nodes)}; allowed is a whole number from 10 to 100000")
    return int(nodes)
