"""How gaits, plans, reports, vehicles and regions show themselves: text for a terminal, HTML for a notebook.

Each page is one element with a small picture of :mod:`gaitgraph.plots.sketches`, without scripts, ids or style sheets, so
that it can stand anywhere and twice. Names and messages are the user's text: the XML library that builds the page
escapes them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, cast
from xml.etree.ElementTree import Element, SubElement, tostring

from gaitgraph.angles import text_from_angle
from gaitgraph.errors import MissingConstant
from gaitgraph.invertibility.matrices import coefficients_of
from gaitgraph.plots.sketches import (
    HUES,
    MOST_RINGS,
    plane_of,
    plane_sketch,
    time_sketch,
    vehicle_sketch,
    verdict_sketch,
)
from gaitgraph.surface.admissible import admissible_region
from gaitgraph.surface.sheets import COLORS
from gaitgraph.validation.report import verdict_line
from gaitgraph.vehicle import constants_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from shapely import MultiPolygon

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import Coefficients
    from gaitgraph.planning.plan import Loop, Plan
    from gaitgraph.surface.region import Region, Zones
    from gaitgraph.surface.sheets import Color, Sign
    from gaitgraph.timing.timed_gait import TimedGait
    from gaitgraph.validation.report import Check, Report
    from gaitgraph.vehicle import Vehicle

__all__ = [
    "html_of_gait",
    "html_of_plan",
    "html_of_region",
    "html_of_report",
    "html_of_timed_gait",
    "html_of_vehicle",
]

_MOST_CHECKED = 2000  # corners that are judged in passing; that takes a tenth of a second
_MOST_ROWS = 6
_COARSE = 1e-3  # of the borders of a region in a small picture [rad]
_JOINTS = ("α1", "α2", "α3", "α4")
_CARD = "display:flex;flex-wrap:wrap;gap:4px 20px;align-items:flex-start;margin:4px 0;line-height:1.35"
_CELL = "text-align:left;vertical-align:top;padding:1px 12px 1px 0;border:none;background:none;font-weight:normal"
_TABLE = "border-collapse:collapse;margin:4px 0;border:none;font-size:inherit;color:inherit"
_MARK = {"ok": "yes", "NO": "no", "??": "unknown"}


def _heading_of_gait(gait: Gait) -> tuple[str, str]:
    count = len(gait.alpha)
    low, high = float(gait.R.min()), float(gait.R.max())
    about = f"R {low:.3g} to {high:.3g} at its corners" if count > 1 else f"R {low:.3g}"
    return (
        f"Gait, {_sheet(gait)}: {count} corner{'s' * (count > 1)}, {gait.length:.4f} rad around, {about}",
        f"vehicle {gait.vehicle.name} (κ = {gait.vehicle.drag_ratio:.4f}), {gait.coefficients.kind} coefficients",
    )


def _sheet(gait: Gait) -> str:
    return gait.color or "off the surfaces"


def html_of_gait(gait: Gait) -> str:
    """Return a gait as HTML: its loop over the region it should stay in, its corners, the verdict.

    The verdict is left out if there are more than 2000 corners.
    """
    title, setting = _heading_of_gait(gait)
    region, told = _region_under(gait)
    card, box = _card(plane_sketch(f"{title}; {told}", gait=gait, region=region), title, setting)
    for line in _verdict(gait):
        _line(box, line)
    if gait.colors:
        rows = zip(gait.alpha.tolist(), gait.types, strict=True)
    else:
        rows = zip(gait.alpha.tolist(), [""] * len(gait.alpha), strict=True)
    head = ("corner", *_JOINTS, "types" if gait.colors else "")
    cells = [(str(k), *map(text_from_angle, alpha), types) for k, (alpha, types) in enumerate(rows, start=1)]
    _table(box, cells, head)
    _line(box, told, small=True)
    return _html(card)


def _verdict(gait: Gait) -> tuple[str, ...]:
    """Return the verdict on a gait and the first reason against it; or why it cannot be judged."""
    if len(gait.alpha) > _MOST_CHECKED:
        return (f"not judged here, with more than {_MOST_CHECKED} corners: check() does",)
    try:
        report = gait.check()
    except MissingConstant as error:
        return (f"not judged: {error}",)
    verdict = verdict_line(report.valid, report.flyable, report.reachable_from_hover)
    return (verdict, report.reason) if report.reason else (verdict,)


def _region_under(gait: Gait, zones: Zones | None = None) -> tuple[MultiPolygon | None, str]:
    """Return the region to draw under a gait's loop, and what it is."""
    if gait.color not in COLORS:
        angles = " and ".join(f"α{angle}" for angle in plane_of(gait))
        return None, f"its loop in the plane of {angles}"
    sign: Sign | None = "positive" if gait.R.min() > 0 else "negative" if gait.R.max() < 0 else None
    return _region_of(gait.vehicle, gait.color, sign, gait.coefficients, zones)


def _region_of(
    vehicle: Vehicle, color: Color, sign: Sign | None, coefficients: Coefficients, zones: Zones | None
) -> tuple[MultiPolygon, str]:
    """Return where gaits of a color and sign are flyable, or at least valid, and what that is in words."""
    which = {"positive": " with R > 0", "negative": " with R < 0", None: ""}[sign]
    # On blue nothing is flyable; without a mass, limits of thrust cannot be judged.
    judged = color == "red" and (vehicle.max_thrust is None or vehicle.mass is not None)
    use: Literal["flyable", "valid"] = "flyable" if judged else "valid"
    region = admissible_region(
        vehicle, use=use, color=color, sign=sign, coefficients=coefficients, zones=zones, accuracy=_COARSE
    )
    within = ", with the given polygons" if zones is not None else ""
    return region.inner, f"shaded: where a {color} gait{which} is {use}{within}"


def _heading_of_timed(timed: TimedGait) -> tuple[str, str]:
    gait = timed.gait
    return (
        f"{type(timed).__name__}, {_sheet(gait)}: T = {timed.period:.6g} s, {timed.law}, {timed.samples} samples, "
        f"{gait.length:.4f} rad around",
        _heading_of_gait(gait)[1],
    )


def _peaks(timed: TimedGait) -> list[tuple[str, str, str, str, str]]:
    alpha = timed.gait.alpha
    columns = (alpha.min(axis=0), alpha.max(axis=0), timed.peak_rates(), timed.peak_accelerations())
    return [
        (
            name,
            text_from_angle(float(low)),
            text_from_angle(float(high)),
            f"{rate:.4g}",
            f"{acceleration:.4g}".replace("inf", "infinite"),
        )
        for name, low, high, rate, acceleration in zip(_JOINTS, *columns, strict=True)
    ]


def _units(timed: TimedGait) -> str:
    vehicle = timed.gait.vehicle
    limits = [
        f"{value:.4g} {unit}"
        for value, unit in ((vehicle.max_tilt_rate, "rad/s"), (vehicle.max_tilt_acceleration, "rad/s²"))
        if value is not None
    ]
    stated = f"the vehicle's limits are {', '.join(limits)}" if limits else "the vehicle states no limits"
    return f"in rad, rad/s and rad/s²; peaks between samples too; {stated}"


def html_of_timed_gait(timed: TimedGait) -> str:
    """Return a timed gait as HTML: its four angles over one period, and the largest rates and accelerations."""
    title, setting = _heading_of_timed(timed)
    card, box = _card(time_sketch(timed, f"{title}: tilt angles over one period"), title, setting)
    _table(box, _peaks(timed), ("angle", "least", "largest", "peak rate", "peak acceleration"))
    _line(box, _units(timed), small=True)
    return _html(card)


def _heading_of_region(region: Region) -> str:
    count = len(region.components)
    if not count:
        return "Region of the (α1, α2) plane: empty"
    borders = f"borders to {region.accuracy:.3g} rad" if region.accuracy else "exact borders"
    return f"Region of the (α1, α2) plane: {region.area:.4g} rad² in {count} component{'s' * (count > 1)}, {borders}"


def _components(region: Region) -> list[tuple[str, str, str]]:
    rows = []
    for number, part in enumerate(region.components, start=1):
        left, below, right, above = (f"{value:.4f}" for value in part.bounds)
        rows.append((str(number), f"{part.area:.3g} rad²", f"α1 {left} to {right}, α2 {below} to {above}"))
    return rows


def _conditions(region: Region) -> str:
    return " · ".join(dict.fromkeys(condition.name for condition in region.conditions))


def html_of_region(region: Region) -> str:
    """Return a region as HTML: its polygons, its components, what was intersected."""
    title = _heading_of_region(region)
    card, box = _card(plane_sketch(title, region=region.inner), title, _conditions(region))
    if region.components:
        _table(box, _components(region), ("component", "area", "extent [rad]"))
    return _html(card)


def html_of_report(report: Report) -> str:
    """Return a report as HTML: the verdict, and every check with its mark and its message."""
    answers = (
        ("valid", report.valid),
        ("flyable", report.flyable),
        ("reachable from hover", report.reachable_from_hover),
    )
    card = Element("div", {"style": _CARD})
    box = SubElement(card, "div", {"style": "max-width:60em"})
    box.append(verdict_sketch(answers, verdict_line(report.valid, report.flyable, report.reachable_from_hover)))
    _checks(box, report.checks)
    _line(box, f"from hover: {report.reachability}")
    if report.listing is not None:
        _line(box, f"colorings: {report.listing}")
    for note in report.notes:
        _line(box, f"warning: {note}")
    return _html(card)


def html_of_plan(plan: Plan) -> str:
    """Return a plan as HTML: its loop with the waypoints, the verdict, alternatives; or why there is none."""
    title = plan.headline
    setting = plan.setting
    request = plan.request
    if plan.loop is None:
        color: Color = "blue" if request.color == "blue" else "red"
        sign: Sign | None = None if request.sign == "auto" else cast("Sign", request.sign)
        coefficients = coefficients_of(request.vehicle, request.coefficients)
        inside, told = _region_of(request.vehicle, color, sign, coefficients, request.zones)
        words = f"the waypoints of a plan without a gait; {told}"
        sketch = plane_sketch(words, waypoints=plan.waypoints, region=inside)
        card, box = _card(sketch, title, "")
        for reason in dict.fromkeys(obstacle.message for obstacle in plan.obstacles):
            _line(box, reason)
        _notes(box, plan.alternatives, plan.warnings)
        _line(box, setting, small=True)
        _line(box, f"{told}; {_rings(plan)}", small=True)
        return _html(card)
    report, gait = plan.loop.report, plan.loop.gait
    region, told = _region_under(gait, request.zones)
    sketch = plane_sketch(f"{title}; {told}; {_rings(plan)}", gait=gait, waypoints=plan.waypoints, region=region)
    card, box = _card(sketch, title, setting)
    _line(box, verdict_line(report.valid, report.flyable, report.reachable_from_hover))
    _checks(box, report.checks)
    # What a check says already is not said again.
    _notes(box, plan.alternatives, [warning for warning in plan.warnings if warning not in report.warnings])
    _line(box, f"{told}; {_rings(plan)}", small=True)
    return _html(card)


def _rings(plan: Plan) -> str:
    count = len(plan.waypoints)
    return "rings: waypoints" if count <= MOST_RINGS else f"rings: the first {MOST_RINGS} of {count} waypoints"


def html_of_vehicle(vehicle: Vehicle) -> str:
    """Return a vehicle as HTML: its arms from above, and the constants it states."""
    delta = coefficients_of(vehicle, "exact").delta
    title = f"Vehicle {vehicle.name}: κ = {vehicle.drag_ratio:.6g}, δ = {delta:.6g} rad"
    card, box = _card(vehicle_sketch(vehicle, f"{title}; its arms and spins from above"), title, "")
    _table(box, constants_of(vehicle), ())
    return _html(card)


def _notes(box: Element, alternatives: Iterable[Loop], warnings: Iterable[str]) -> None:
    for other in alternatives:
        verdict = "flyable" if other.report.flyable else "valid, not flyable" if other.report.valid else "not valid"
        sign = ">" if other.sign == "positive" else "<"
        _line(box, f"alternative: {other.color}, R {sign} 0, {other.length:.4f} rad, {verdict}")
    for warning in warnings:
        _line(box, f"warning: {warning}")


def _card(picture: Element, title: str, under: str) -> tuple[Element, Element]:
    """Return a page with a picture and a heading, and the box beside the picture for what follows."""
    card = Element("div", {"style": _CARD})
    card.append(picture)
    box = SubElement(card, "div", {"style": "flex:1 1 24em;max-width:60em;min-width:0"})
    SubElement(SubElement(box, "div"), "strong").text = title
    if under:
        _line(box, under)
    return card, box


def _line(box: Element, text: str, *, small: bool = False) -> None:
    SubElement(box, "div", {"style": "font-size:85%;opacity:0.8"} if small else {}).text = text


def _table(box: Element, rows: Sequence[Sequence[str]], head: Sequence[str]) -> None:
    """Append a table of its first rows; the first cell of each row is its heading."""
    table = SubElement(box, "table", {"style": _TABLE})
    if head:
        top = SubElement(table, "tr", {"style": "background:none"})
        for name in head:
            SubElement(top, "th", {"scope": "col", "style": _CELL.replace("normal", "bold")}).text = name
    for row in rows[:_MOST_ROWS] if head else rows:
        line = SubElement(table, "tr", {"style": "background:none"})
        for k, text in enumerate(row):
            if k:
                SubElement(line, "td", {"style": _CELL}).text = text
            else:
                SubElement(line, "th", {"scope": "row", "style": _CELL}).text = text
    if head and len(rows) > _MOST_ROWS:
        _line(box, f"… and {len(rows) - _MOST_ROWS} more", small=True)


def _checks(box: Element, checks: Iterable[Check]) -> None:
    table = SubElement(box, "table", {"style": _TABLE})
    for check in checks:
        row = SubElement(table, "tr", {"style": "background:none"})
        SubElement(row, "td", {"style": f"{_CELL};font-weight:bold;color:{HUES[_MARK[check.mark]]}"}).text = check.mark
        SubElement(row, "th", {"scope": "row", "style": f"{_CELL};white-space:nowrap"}).text = check.name.replace(
            "_", " "
        )
        SubElement(row, "td", {"style": _CELL}).text = check.message


def _html(card: Element) -> str:
    # With a closing tag for each element it is HTML too.
    return tostring(card, encoding="unicode", short_empty_elements=False)
