"""Every figure of the paper, computed by the package, and some more; without pyplot and the user's settings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
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

    Drawing = Callable[[Figure, "_FigureInput"], Any]


class _FigureInput(NamedTuple):
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


_SMALL: tuple[float, float] = (85, 74)  # of a figure in space [mm]


def _in_space(
    function: Callable[..., None], figure: Figure, of: _FigureInput, **options: Any
) -> None:
    ax = figure.add_subplot(projection="3d", computed_zorder=False)
    function(ax, of.coefficients, **options)


def _rule(figure: Figure, of: _FigureInput) -> None:
    left, right = figure.subplots(1, 2)
    planes.adjacency_rule("angle", ax=left)
    planes.adjacency_rule("pair", ax=right)
    left.set_title(r"(a) types of $\alpha_3$ or of $\alpha_4$")
    right.set_title(r"(b) types of $(\alpha_3, \alpha_4)$")


def _types(figure: Figure, of: _FigureInput) -> Axes:
    ax = figure.add_subplot()
    return planes.type_map("negative", coefficients=of.coefficients, ax=ax)


def _loops(figure: Figure, of: _FigureInput) -> None:
    ax = _types(figure, of)
    # Bands are wider than the texts on them. Gaits 2 and 3 have the same loop: the red band lies on the wider blue one.
    for number, width, name in (
        (1, 18.0, "Gait 1"),
        (2, 18.0, "Gaits 2 and 3"),
        (3, 10.0, ""),
    ):
        gait = paper_gait(number, of.vehicle, of.coefficients)
        label = f"Gait {number}: {gait.color}"
        gaits.gait_loop(
            gait,
            label=label,
            width=width,
            band=True,
            ax=ax,
        )
        x, y = gait.alpha[:, :2].mean(axis=0)
        base.draw_label(ax, (x, y + math.pi / 32), name)  # between the rows of nodes
    base.legend_above(ax, columns=3)


def _regions(figure: Figure, of: _FigureInput) -> None:
    left, right = figure.subplots(1, 2)
    planes.regions_map(of.vehicle, ax=left)
    planes.singular_value_map(of.vehicle, ax=right)


def _attitudes(figure: Figure, of: _FigureInput, *, number: int, bias: float) -> None:
    """Draw the roll–pitch diagram of a gait of the paper and its biased gait."""
    gait = paper_gait(number, of.vehicle, of.attitudes)
    title = f"Gait {number}: {of.attitudes.kind} coefficients"
    _draw_reading(figure.add_subplot(), title, gait, of.attitudes, number, bias)


def _other_readings(
    figure: Figure, of: _FigureInput, *, number: int, bias: float
) -> None:
    """Draw the roll–pitch diagram of a blue gait of the paper with other digits than :func:`_attitudes`."""
    exact = coefficients_of(of.vehicle, "exact")
    readings = {"exact coefficients": paper_gait(number, of.vehicle, exact)}
    if of.vehicle.carries_published_coefficients:
        printed = coefficients_of(of.vehicle, "printed")
        rounded = paper_gait(number, of.vehicle, printed)
        readings["four-digit angles, exact formula"] = rounded
        readings["printed vertices, exact formula"] = printed_gait(number, exact)
    for place, (title, gait) in enumerate(readings.items(), start=1):
        ax = figure.add_subplot(1, len(readings), place)
        _draw_reading(ax, title, gait, exact, number, bias)
        base.legend_below(ax)
        if place > 1:
            ax.set_ylabel("")


def _draw_reading(
    ax: Axes,
    title: str,
    gait: Gait,
    coefficients: Coefficients,
    number: int,
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
    gaits.draw_robustness(ax, report, f"Gait {number}")
    margins = []
    for robustness in (report.gait, report.sweep[0]):
        margin = robustness.tilt_margin
        margins.append("none" if margin is None else f"{math.degrees(margin):.1f}°")
    own, biased = margins
    ax.set_title(f"{title}\ntilt margin {own}, biased {biased}")


def _figures() -> dict[str, PaperFigure]:
    figures = [  # with width and height [mm]
        PaperFigure(
            "1", "The tilt-rotor from above, and one rotor from the tip of its arm", (170, 98),
            lambda figure, of: vehicle_figure(of.vehicle, ax=figure.add_subplot()),
        ),
        PaperFigure(
            "2", "Number of roots (α3, α4) at each node (α1, α2)", (85, 92),
            lambda figure, of: planes.root_counts(figure.add_subplot(), of.coefficients),
        ),
        PaperFigure("15", "Which types may be neighbours", (170, 68), _rule),
        PaperFigure("16", "Types of the roots with R < 0", (170, 173), _types),
        PaperFigure("17", "Gaits 1 to 3 on the map of types", (170, 177), _loops),
        PaperFigure("regions", "Exact regions of the (α1, α2) plane on the red sheet", (170, 93), _regions),
        PaperFigure(
            "margins", "Servo margin of each posture of the red sheet", (100, 82),
            lambda figure, of: planes.servo_margin_map(of.vehicle, ax=figure.add_subplot()),
        ),
        PaperFigure("set", "The set of a gait", (400, 84), lambda figure, of: gaits.draw_sheet(figure, [of.timed], [name_of(of.timed.gait)])),
    ]  # fmt: skip
    roots = {"first": "the first root", "other": "the other root", "both": "both roots"}
    names = iter("345678")
    for which, root in roots.items():
        for angle in (3, 4):
            drawing = partial(_in_space, planes.root_angle, angle=angle, which=which)
            figure = PaperFigure(next(names), f"α{angle} of {root}", _SMALL, drawing)
            figures.append(figure)
    for name, sign, relation, which in (
        ("9", "positive", ">", "first"),
        ("11", "positive", ">", "other"),
        ("13", "negative", "<", "first"),
        ("14", "negative", "<", "other"),
    ):
        title = f"α3 and α4 of the {which} root where R {relation} 0"
        drawing = partial(_in_space, planes.signed_roots, sign=sign, which=which)
        figures.append(PaperFigure(name, title, _SMALL, drawing))
    for name, which in (("10", "first"), ("12", "other")):
        title = f"R of the {which} root where it is positive"
        drawing = partial(
            _in_space, planes.level_determinants, sign="positive", which=which
        )
        figures.append(PaperFigure(name, title, _SMALL, drawing))
    for name, number, bias in (
        ("18", 1, 0.8),
        ("19", 2, 0.99),
        ("20", 3, 0.8),
        ("21", 4, 0.8),
        ("22", 2, 0.8),
    ):
        title = (
            f"Unacceptable attitudes of Gait {number} and its biased gait, η = {bias:g}"
        )
        drawing = partial(_attitudes, number=number, bias=bias)
        figures.append(PaperFigure(name, title, (85, 98), drawing))
        if number <= 2:
            title = f"Figure {name} with other digits"
            drawing = partial(_other_readings, number=number, bias=bias)
            figures.append(PaperFigure(f"{name}b", title, (170, 84), drawing))
    by_name = {figure.name: figure for figure in figures}
    order = (*map(str, range(1, 23)), "18b", "19b", "22b", "regions", "margins", "set")
    return {name: by_name[name] for name in order}


FIGURES: dict[str, PaperFigure] = _figures()
"""All figures by name, in the order of writing."""


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
) -> _FigureInput:
    chosen = vehicle_named(PAPER if vehicle is None else vehicle)
    numbers = coefficients_of(chosen, coefficients)
    if gait is None:
        timed = paper_gait(3, chosen, numbers).parametrize()
    else:
        timed = timed_gait_of(gait, vehicle=vehicle, coefficients=coefficients)
    judged = numbers
    if coefficients is None:
        judged = numbers.as_they_stand
    return _FigureInput(chosen, numbers, judged, timed)


def _drawn(name: str, of: _FigureInput) -> Figure:
    known = FIGURES[name]
    with base.paper_style():
        figure = base.blank_figure(*known.size)
        known.drawing(figure, of)
        if known.size == _SMALL:
            figure.suptitle(known.title, fontsize=9)
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
            f"gait has an effect on the figure set only, and only selects {', '.join(names)}",
            field="gait",
            value=gait,
        )
    for kind in formats or ("none",):
        checked_choice("format", kind, base.FORMATS)
    of = _input_of(vehicle, coefficients, gait)
    targets: dict[Path, str] = {}
    for name in names:
        for kind in formats:
            targets[folder / f"{FIGURES[name].stem}.{kind}"] = name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileProblem(
            f"output must be a folder that can be written, got {shown(str(folder))}: {reason}"
        ) from error
    check_new_files(list(targets), force=force)
    for name in names:
        if progress is not None:
            progress(f"drawing {FIGURES[name].stem}")
        paths = [path for path, drawn in targets.items() if drawn == name]
        base.write_pictures(_drawn(name, of), paths, force=force)
    return list(targets)
