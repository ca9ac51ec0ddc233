"""Every figure of the paper, computed by the package, and some more; without pyplot and the user's settings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from gaitgraph.errors import FileProblem, InputError, check_kind, checked_choice, shown
from gaitgraph.files import check_new_files, path_of
from gaitgraph.gait.gait import Gait, name_of, paper_gait, printed_gait
from gaitgraph.invertibility.coefficients import (
    Coefficients,
    CoefficientsLike,
    coefficients_of,
)
from gaitgraph.plots import axes as base, gaits, planes
from gaitgraph.plots.vehicles import vehicle_figure
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.timing.timed_gait import TimedGait, timed_gait_of
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.gait.given import GaitLike

    Drawing = Callable[[Figure, "_Input"], Any]


class _Input(NamedTuple):
    vehicle: Vehicle
    coefficients: Coefficients
    attitudes: Coefficients  # of Figures 18 to 22
    timed: TimedGait  # of the figure set


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure and how it is drawn."""

    name: str  # the number in the paper, with b for a second figure, or "regions", "margins" or "set"
    title: str
    size: tuple[float, float]  # mm
    drawing: Drawing

    @property
    def stem(self) -> str:
        """Name of its files without suffix: figure_01 … figure_22, figure_18b, figure_regions, figure_margins, figure_set."""
        return f"figure_{self.name:0>2}"


FIGURES: dict[str, PaperFigure] = {}
"""All figures by name, in the order of writing."""


def _add(name: str, title: str, width: float, height: float) -> Callable[..., Any]:
    """Return a decorator of a function that draws a figure of a size [mm]: it is one of FIGURES then."""

    def add(drawing: Drawing) -> Drawing:
        FIGURES[name] = PaperFigure(name, title, (width, height), drawing)
        return drawing

    return add


@_add("1", "The tilt-rotor from above, and one rotor from the tip of its arm", 170, 98)
def _vehicle(figure: Figure, of: _Input) -> None:
    vehicle_figure(of.vehicle, ax=figure.add_subplot())


@_add("2", "Number of roots (α3, α4) at each node (α1, α2)", 85, 92)
def _counts(figure: Figure, of: _Input) -> None:
    planes.root_counts(figure.add_subplot(), of.coefficients)


def _add_roots(
    name: str, title: str, function: Callable[..., None], **options: Any
) -> None:
    """Add a figure of roots over the plane."""

    @_add(name, title, 85, 74)
    def _(figure: Figure, of: _Input) -> None:
        ax = figure.add_subplot(projection="3d", computed_zorder=False)
        function(ax, of.coefficients, **options)
        figure.suptitle(title, fontsize=9)


_ANGLE, _SIGNED, _R = planes.root_angle, planes.signed_roots, planes.level_determinants
_PLUS: dict[str, Any] = {"sign": "positive"}
_MINUS: dict[str, Any] = {"sign": "negative"}
_add_roots("3", "α3 of the first root", _ANGLE, angle=3, which="first")
_add_roots("4", "α4 of the first root", _ANGLE, angle=4, which="first")
_add_roots("5", "α3 of the other root", _ANGLE, angle=3, which="other")
_add_roots("6", "α4 of the other root", _ANGLE, angle=4, which="other")
_add_roots("7", "α3 of both roots", _ANGLE, angle=3, which="both")
_add_roots("8", "α4 of both roots", _ANGLE, angle=4, which="both")
_FIRST, _OTHER = (
    "α3 and α4 of the first root where R",
    "α3 and α4 of the other root where R",
)
_add_roots("9", f"{_FIRST} > 0", _SIGNED, which="first", **_PLUS)
_add_roots("10", "R of the first root where it is positive", _R, which="first", **_PLUS)
_add_roots("11", f"{_OTHER} > 0", _SIGNED, which="other", **_PLUS)
_add_roots("12", "R of the other root where it is positive", _R, which="other", **_PLUS)
_add_roots("13", f"{_FIRST} < 0", _SIGNED, which="first", **_MINUS)
_add_roots("14", f"{_OTHER} < 0", _SIGNED, which="other", **_MINUS)


@_add("15", "Which types may be neighbours", 170, 68)
def _rule(figure: Figure, of: _Input) -> None:
    left, right = figure.subplots(1, 2)
    planes.adjacency_rule("angle", ax=left)
    planes.adjacency_rule("pair", ax=right)
    left.set_title(r"(a) types of $\alpha_3$ or of $\alpha_4$")
    right.set_title(r"(b) types of $(\alpha_3, \alpha_4)$")


@_add("16", "Types of the roots with R < 0", 170, 173)
def _types(figure: Figure, of: _Input) -> Axes:
    ax = figure.add_subplot()
    return planes.type_map("negative", coefficients=of.coefficients, ax=ax)


@_add("17", "Gaits 1 to 3 on the map of types", 170, 177)
def _loops(figure: Figure, of: _Input) -> None:
    ax = _types(figure, of)
    # Bands are wider than the texts on them. Gaits 2 and 3 have the same loop: the red band lies on the wider blue one.
    names = {1: "Gait 1", 2: "Gaits 2 and 3", 3: ""}
    widths = {1: 18.0, 2: 18.0, 3: 10.0}
    for number, name in names.items():
        gait = paper_gait(number, of.vehicle, of.coefficients)
        label = f"Gait {number}: {gait.color}"
        gaits.gait_loop(gait, label=label, width=widths[number], band=True, ax=ax)
        x, y = gait.alpha[:, :2].mean(axis=0)
        base.draw_label(ax, (x, y + math.pi / 32), name)  # between the rows of nodes
    base.legend_above(ax, columns=3)


def _add_attitudes(name: str, number: int, bias: float) -> None:
    """Add the roll–pitch diagram of a gait of the paper and its biased gait."""
    title = f"Unacceptable attitudes of Gait {number} and its biased gait, η = {bias:g}"

    @_add(name, title, 85, 98)
    def _(figure: Figure, of: _Input) -> None:
        gait = paper_gait(number, of.vehicle, of.attitudes)
        reading = f"Gait {number}: {of.attitudes.kind} coefficients"
        ax = figure.add_subplot()
        _draw_reading(ax, reading, gait, of.attitudes, f"Gait {number}", bias)


def _add_readings(name: str, number: int, bias: float) -> None:
    """Add the roll–pitch diagram of a blue gait of the paper with other digits than :func:`_add_attitudes`."""

    @_add(name, f"Figure {name.removesuffix('b')} with other digits", 170, 84)
    def _(figure: Figure, of: _Input) -> None:
        exact = coefficients_of(of.vehicle, "exact")
        readings = {"exact coefficients": paper_gait(number, of.vehicle, exact)}
        if of.vehicle.carries_published_coefficients:
            printed = coefficients_of(of.vehicle, "printed")
            rounded = paper_gait(number, of.vehicle, printed)
            vertices = printed_gait(number, exact)
            readings["four-digit angles, exact formula"] = rounded
            readings["printed vertices, exact formula"] = vertices
        axes = figure.subplots(1, len(readings), squeeze=False)[0]
        for ax, (title, gait) in zip(axes, readings.items(), strict=True):
            _draw_reading(ax, title, gait, exact, f"Gait {number}", bias)
            base.legend_below(ax)
        for ax in axes[1:]:
            ax.set_ylabel("")


def _draw_reading(
    ax: Axes,
    title: str,
    gait: Gait,
    coefficients: Coefficients,
    name: str,
    bias: float,
) -> None:
    """Draw the diagram of a gait with some digits; all digits count as they stand."""
    report = robustness_of(
        gait,
        bias=bias,
        tilt=0.0,
        curves=48,
        coefficients=coefficients,
        angle_rounding=0.0,
    )
    gaits.draw_robustness(ax, report, name)
    margins = []
    for robustness in (report.gait, report.sweep[0]):
        margin = robustness.tilt_margin
        margins.append("none" if margin is None else f"{math.degrees(margin):.1f}°")
    own, biased = margins
    ax.set_title(f"{title}\ntilt margin {own}, biased {biased}")


_add_attitudes("18", 1, 0.8)
_add_attitudes("19", 2, 0.99)
_add_attitudes("20", 3, 0.8)
_add_attitudes("21", 4, 0.8)
_add_attitudes("22", 2, 0.8)
_add_readings("18b", 1, 0.8)
_add_readings("19b", 2, 0.99)
_add_readings("22b", 2, 0.8)


@_add("regions", "Exact regions of the (α1, α2) plane on the red sheet", 170, 93)
def _regions(figure: Figure, of: _Input) -> None:
    left, right = figure.subplots(1, 2)
    planes.regions_map(of.vehicle, ax=left)
    planes.singular_value_map(of.vehicle, ax=right)


@_add("margins", "Servo margin of each posture of the red sheet", 100, 82)
def _margins(figure: Figure, of: _Input) -> None:
    planes.servo_margin_map(of.vehicle, ax=figure.add_subplot())


@_add("set", "The set of a gait", 400, 84)
def _set(figure: Figure, of: _Input) -> None:
    gaits.draw_sheet(figure, [of.timed], [name_of(of.timed.gait)])


def draw(
    name: str | int,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    gait: GaitLike | None = None,
) -> Figure:
    """Return one figure of the paper, which pyplot does not know.

    `name` is one of FIGURES, `vehicle` by default the paper's. Other vehicles have no four-digit coefficients: 18b, 19b
    and 22b then show the same as 18, 19 and 22. If their spins are opposite, the loops of Gaits 1 to 4 are mirrored in
    the origin. `coefficients` are by default "published" for the paper's vehicle, in Figures 18 to 22 "printed", and
    "exact" for others. `gait` is that of the figure "set" in any form, by default Gait 3; vehicle and coefficients are
    then those of its table.
    """
    checked_choice("name", str(name), FIGURES)
    return _drawn(str(name), _input_of(vehicle, coefficients, gait))


def _input_of(
    vehicle: VehicleLike | None,
    coefficients: CoefficientsLike | None,
    gait: GaitLike | None,
) -> _Input:
    chosen = vehicle_named(PAPER if vehicle is None else vehicle)
    numbers = coefficients_of(chosen, coefficients)
    if gait is None:
        timed = paper_gait(3, chosen, numbers).parametrize()
    else:
        timed = timed_gait_of(gait, vehicle=vehicle, coefficients=coefficients)
    judged = numbers
    if coefficients is None:
        judged = numbers.as_they_stand
    return _Input(chosen, numbers, judged, timed)


def _drawn(name: str, of: _Input) -> Figure:
    known = FIGURES[name]
    with base.paper_style():
        figure = base.blank_figure(*known.size)
        known.drawing(figure, of)
    return figure


def write_figures(
    out: str | Path,
    *,
    only: Sequence[str | int] | None = None,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    gait: GaitLike | None = None,
    formats: Sequence[base.Format] = ("png", "svg"),
    force: bool = False,
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Draw figures, write them to figure_01.png and so on in the folder `out`, and return the paths.

    Files are written whole or not at all. The same request gives the same bytes, with the same version of matplotlib.
    `only` are names such as 16, "18b" or "regions", by default all; `vehicle`, `coefficients` and `gait` are as for
    :func:`draw`; `formats` are some of png (200 dots per inch), svg and pdf. Without `force` an existing file raises
    OutputExists before anything is written. `progress` is called with a short text before each figure.
    """
    base.require_matplotlib()
    folder = path_of(out, "out")
    check_kind("formats", formats, list, tuple)
    names = list(FIGURES)
    if only is not None:
        check_kind("only", only, list, tuple)
        asked = [checked_choice("only", str(name), FIGURES) for name in only]
        names = [name for name in FIGURES if name in asked]
    if gait is not None and "set" not in names:
        raise InputError(
            f"gait must be omitted unless the figure set is drawn, got one with only {', '.join(names)}",
            field="gait",
            value=gait,
        )
    for kind in formats or ("none",):
        checked_choice("format", kind, base.FORMATS)
    of = _input_of(vehicle, coefficients, gait)
    targets: dict[str, list[Path]] = {}
    for name in names:
        stem = FIGURES[name].stem
        targets[name] = [folder / f"{stem}.{kind}" for kind in dict.fromkeys(formats)]
    written = [path for paths in targets.values() for path in paths]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileProblem(
            f"output must be a folder that can be written, got {shown(str(folder))}: {reason}"
        ) from error
    check_new_files(written, force=force)
    for name, paths in targets.items():
        if progress is not None:
            progress(f"drawing {FIGURES[name].stem}")
        base.write_pictures(_drawn(name, of), paths, force=force)
    return written
