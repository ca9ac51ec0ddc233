"""Every figure of the paper, drawn from the package's own results, and two that it lacks.

A figure is known by its number, "1" to "22", or by its name, "regions" and "gait". :func:`draw` returns one,
:func:`write_figures` writes them to files. Neither uses pyplot, and both hold their own style: the same figures come
out whatever the user's settings.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph import plots
from gaitgraph.errors import FileProblem, GaitgraphError, InputError, OutputExists, did_you_mean, shown
from gaitgraph.files import write_whole
from gaitgraph.gait.gait import Gait
from gaitgraph.gait.paper_gaits import paper_gait, printed_gait
from gaitgraph.gait.table import Table
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.invertibility.matrices import Coefficients, Kind, coefficients_of
from gaitgraph.invertibility.tilt_margins import least_tilt_margin
from gaitgraph.io.reading import gait_of
from gaitgraph.plots.axes import (
    FORMATS,
    Format,
    blank_figure,
    legend_above,
    paper_style,
    picture_bytes,
    require_matplotlib,
)
from gaitgraph.robustness.attitudes import acceptable_attitudes
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.timing.timed_gait import TimedGait

__all__ = ["FIGURES", "PaperFigure", "draw", "names_of_figures", "write_figures"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperFigure:
    """What one figure is.

    Parameters
    ----------
    name
        Its number in the paper, or a name.
    title
        A few words.
    caption
        What it shows, in full.
    draw
        What draws it.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[_Setting], Figure]

    @property
    def stem(self) -> str:
        """The name of its files without suffix: figure_01 … figure_22, figure_regions, figure_gait."""
        return f"figure_{int(self.name):02d}" if self.name.isdigit() else f"figure_{self.name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setting:
    """What figures are drawn for: a vehicle and a kind of coefficients as asked for, or None; a grid; a gait."""

    asked: Vehicle | None
    kind: Kind | None
    divisions: int
    gait: Gait | TimedGait | Table | None

    @property
    def vehicle(self) -> Vehicle:
        return self.asked or PAPER

    @property
    def coefficients(self) -> Coefficients:
        return coefficients_of(self.vehicle, self.kind)


def _sketch(setting: _Setting) -> Figure:
    figure = blank_figure(170, 98)
    plots.vehicle_sketch(setting.vehicle, ax=figure.add_subplot())
    return figure


def _counts(setting: _Setting) -> Figure:
    figure = blank_figure(85, 92)
    plots.root_counts(setting.coefficients, divisions=setting.divisions, ax=figure.add_subplot())
    return figure


def _in_space(function: Callable[..., Any], first: str, which: str) -> Callable[[_Setting], Figure]:
    def drawn(setting: _Setting) -> Figure:
        figure = blank_figure(85, 74)
        ax = figure.add_subplot(projection="3d")
        grid = {"coefficients": setting.coefficients, "divisions": setting.divisions}
        function(first, which=which, ax=ax, **grid)
        return figure

    return drawn


def _rule(setting: _Setting) -> Figure:
    figure = blank_figure(170, 68)
    left, right = figure.subplots(1, 2)
    plots.adjacency_rule("angle", ax=left)
    plots.adjacency_rule("pair", ax=right)
    left.set_title(r"(a) types of $\alpha_3$ or of $\alpha_4$")
    right.set_title(r"(b) types of $(\alpha_3, \alpha_4)$")
    return figure


def _map(setting: _Setting) -> Figure:
    figure = blank_figure(170, 173)
    numbers, divisions = setting.coefficients, setting.divisions
    plots.type_map("negative", coefficients=numbers, divisions=divisions, ax=figure.add_subplot())
    return figure


def _loops(setting: _Setting) -> Figure:
    figure = blank_figure(170, 177)
    ax = figure.add_subplot()
    plots.type_map("negative", coefficients=setting.coefficients, divisions=setting.divisions, ax=ax)
    # Wide enough for the types written on them. Gaits 2 and 3 share their loop: red lies on the wider blue.
    for number, width in ((1, 18.0), (2, 18.0), (3, 10.0)):
        gait = paper_gait(number, setting.vehicle, setting.coefficients)
        plots.gait_loop(gait, label=f"Gait {number}: {gait.color}", width=width, band=True, ax=ax)
        if number != 3:
            x, y = gait.alpha[:, :2].mean(axis=0)
            name = "Gait 1" if number == 1 else "Gaits 2 and 3"
            ax.text(x, y + math.pi / 32, name, ha="center", va="center")  # between the rows of nodes
    legend_above(ax, columns=3)
    return figure


def _around_gait(number: int, eta: float, claim: str) -> Callable[[_Setting], Figure]:
    """Return what draws one roll–pitch diagram of a gait of the paper and its biased gait."""

    def drawn(setting: _Setting) -> Figure:
        figure = blank_figure(85, 108)
        gait = paper_gait(number, setting.vehicle, setting.coefficients)
        digits = "four-digit" if setting.coefficients.kind == "published" else "exact"
        judged = claim if setting.vehicle.carries_published_coefficients else ""
        _diagram(figure.add_subplot(), gait, number, eta, f"{digits} coefficients", judged)
        return figure

    return drawn


def _four_readings(number: int, eta: float, claim: str) -> Callable[[_Setting], Figure]:
    """Return what draws a blue gait and its biased gait with each rounding that there is of it."""

    def drawn(setting: _Setting) -> Figure:
        vehicle = setting.vehicle
        exact = coefficients_of(vehicle, "exact")
        gait = paper_gait(number, vehicle, exact)
        if not vehicle.carries_published_coefficients:
            figure = blank_figure(85, 108)
            _diagram(figure.add_subplot(), gait, number, eta, "exact coefficients", "")
            return figure
        published = coefficients_of(vehicle, "published")
        rounded = paper_gait(number, vehicle, published)
        figure = blank_figure(170, 216, apart=0.08)
        panels = figure.subplots(2, 2)
        readings = (
            ("(a) exact coefficients", gait),
            ("(b) four-digit coefficients", rounded),
            ("(c) printed vertices", printed_gait(number, exact)),
            ("(d) four-digit surface, exact formula", Gait(alpha=rounded.alpha, vehicle=vehicle, coefficients=exact)),
        )
        for ax, (title, one) in zip(panels.flat, readings, strict=True):
            _diagram(ax, one, number, eta, title, claim)
        return figure

    return drawn


def _diagram(ax: Axes, gait: Gait, number: int, eta: float, title: str, claim: str) -> None:
    """Draw a roll–pitch diagram, and say in its title what it shows and whether the paper claims that."""
    plots.roll_pitch_diagram(gait, eta=eta, name=f"Gait {number}", ax=ax)
    both = (gait, gait.biased(eta))
    margins = [_nearest(one) for one in both]
    told = ["none" if math.isnan(margin) else f"{math.degrees(margin):.1f}°" for margin in margins]
    lines = [title, f"tilt margin {told[0]}, biased {told[1]}"]
    if claim:
        agrees = not math.isnan(margins[0]) and _agrees([_fraction(one) for one in both], claim)
        lines.append("as the paper says" if agrees else "unlike the paper")
    ax.set_title("\n".join(lines))


def _nearest(gait: Gait) -> float:
    """Return the least tilt at which a gait is singular [rad], its coefficients at face value; NaN if at any."""
    numbers = plots.at_face_value(gait.coefficients)
    return least_tilt_margin(gait.alpha, gait.ends, numbers, tolerance=1e-4).upper


def _fraction(gait: Gait) -> float:
    """Return the part of the diagram, around level flight, where a gait is never singular, at face value too."""
    return acceptable_attitudes(gait.alpha, plots.at_face_value(gait.coefficients)).fraction


_LITTLE = 0.02
"""Fractions of the diagram that differ by less are alike."""


def _agrees(fractions: list[float], claim: str) -> bool:
    """Return whether the acceptable fractions of a gait and of its biased gait show what the paper claims.

    "farther": the gait's singular curves leave it a wider region; "alike": the gait has little advantage.
    """
    gait, biased = fractions
    return gait > biased if claim == "farther" else gait < biased + _LITTLE


def _regions(setting: _Setting) -> Figure:
    figure = blank_figure(170, 93)
    left, right = figure.subplots(1, 2)
    plots.regions_map(setting.vehicle, ax=left)
    plots.singular_value_map(setting.vehicle, ax=right)
    return figure


def _gait(setting: _Setting) -> Figure:
    figure = blank_figure(170, 120)
    axes = plots.axes_of_a_gait(figure)
    given = setting.gait if setting.gait is not None else paper_gait(3, setting.vehicle, setting.coefficients)
    if isinstance(given, Table):
        polyline = gait_of(given, vehicle=setting.asked, coefficients=setting.kind)
        plots.gait_in_four_dimensions(given, gait=polyline, axes=axes)
    else:
        plots.gait_in_four_dimensions(given.parametrize() if isinstance(given, Gait) else given, axes=axes)
    return figure


_ORDER = "The roots of a node are ordered by α3, then α4: the solver's order in the paper is not known."
_INNER = "Interior nodes of the grid of 16 divisions."
_ROUND = (
    "Blue has a sign of R only because the paper's coefficients have four digits; with exact ones it is singular, "
    "grey and hollow here."
)


def _catalog() -> dict[str, PaperFigure]:
    found: dict[str, PaperFigure] = {}

    def add(name: object, title: str, caption: str, drawing: Callable[[_Setting], Figure]) -> None:
        found[str(name)] = PaperFigure(name=str(name), title=title, caption=f"{title}. {caption}", draw=drawing)

    add(
        1,
        "The tilt-rotor with its arms, tilt axes and signs",
        "Left from above, right one rotor from the tip of its arm. Positive tilts are right-handed about the outward "
        "arm axes e1 to e4; the arrows beside the rotors show where thrusts then lean. cw and ccw are spins seen from "
        "above.",
        _sketch,
    )
    add(
        2,
        "Number of roots (α3, α4) at each node (α1, α2)",
        "Two inside, three on a side, five in a corner: an angle at an end of [−π/2, π/2] is one at the other end too.",
        _counts,
    )
    for number, angle, which, word in (
        (3, "alpha3", "first", "the first root"),
        (4, "alpha4", "first", "the first root"),
        (5, "alpha3", "other", "the other root"),
        (6, "alpha4", "other", "the other root"),
        (7, "alpha3", "both", "both roots"),
        (8, "alpha4", "both", "both roots"),
    ):
        symbol = angle.replace("alpha", "α")
        planes = f"Red squares lie on the + plane of {symbol}, blue discs on its − plane. "
        order = "" if which == "both" else f" {_ORDER}"
        add(number, f"{symbol} of {word}", f"{planes}{_INNER}{order}", _in_space(plots.root_angle, angle, which))
    for number, sign, which, word in (
        (9, "positive", "first", "first root"),
        (11, "positive", "other", "other root"),
        (13, "negative", "first", "first root"),
        (14, "negative", "other", "other root"),
    ):
        compared = "R > 0" if sign == "positive" else "R < 0"
        add(
            number,
            f"α3 and α4 of the {word} where {compared}",
            f"Red squares are α3, blue discs α4. {_INNER} {_ORDER} {_ROUND}",
            _in_space(plots.signed_roots, sign, which),
        )
    for number, which, word in ((10, "first", "first root"), (12, "other", "other root")):
        add(
            number,
            f"R of the {word} where it is positive",
            f"Red squares lie on the red sheet, blue discs on the blue one. {_INNER} {_ORDER} {_ROUND}",
            _in_space(plots.level_determinants, "positive", which),
        )
    add(
        15,
        "Which types may be neighbours",
        "Lined types may; each type may also follow itself. (a) one angle; (b) the pair, without (?,?), which may be a "
        "neighbour of every type.",
        _rule,
    )
    add(
        16,
        "Types of the roots with R < 0",
        f"Red squares are nodes with (+,+), blue discs those with (−,−), halves those with both; types with a ? are "
        f"written, those of the red sheet in red, those of the blue one in blue. {_INNER} {_ROUND}",
        _map,
    )
    add(
        17,
        "Gaits 1 to 3 on the map of types",
        f"Pale bands are the loops of (α1, α2), arrows their direction; Gaits 2 and 3 share theirs. {_ROUND}",
        _loops,
    )
    blue = (
        "The blue sheet turns on rounding: (a) exact coefficients make the gait singular at every attitude; (b) the "
        "paper's four digits, taken at face value, leave it a small R and no singular attitude; (c) straight lines "
        "between the vertices as printed, with exact coefficients; (d) angles found with four digits, judged with "
        "exact coefficients. For another vehicle there is (a) alone. "
    )
    lines = (
        "Thin lines are singular attitudes, red solid for the gait, blue dashed for the biased gait; thick ones border "
        "what is never singular around level flight. Above: the least tilt from level flight to a singular attitude, "
        "gait | biased gait, and whether the bordered regions are as the paper says, "
    )
    farther, alike = "that the gait's is the wider one.", "that the gait has little advantage."
    for number, gait, eta, claim in ((18, 1, 0.8, "farther"), (19, 2, 0.99, "farther"), (22, 2, 0.8, "alike")):
        add(
            number,
            f"Unacceptable attitudes of Gait {gait} and its biased gait, η = {eta:g}",
            f"{blue}{lines}{farther if claim == 'farther' else alike}",
            _four_readings(gait, eta, claim),
        )
    for number, gait, eta in ((20, 3, 0.8), (21, 4, 0.8)):
        add(
            number,
            f"Unacceptable attitudes of Gait {gait} and its biased gait, η = {eta:g}",
            f"{lines}{farther}",
            _around_gait(gait, eta, "farther"),
        )
    found = {name: found[name] for name in sorted(found, key=int)}
    add(
        "regions",
        "Exact regions of the (α1, α2) plane on the red sheet",
        "Left: signs of R, where hover takes positive thrusts alone (hatched), and contours of the largest thrust of a "
        "rotor in hover, in units of the weight. Right: the least singular value in level flight, dimensionless; black "
        "lines are R = 0, the cross is α = 0.",
        _regions,
    )
    add(
        "gait",
        "A gait in four dimensions over its period",
        "Angles in time, the loop on the map of types, and three projections with the + planes (red) and − planes "
        "(blue, dashed) as thin lines; arrows show the direction. Gait 3 unless another is given.",
        _gait,
    )
    return found


FIGURES: dict[str, PaperFigure] = _catalog()
"""Every figure by its name, in the order in which they are written."""


def names_of_figures(texts: Sequence[str | int]) -> tuple[str, ...]:
    """Return the names that texts such as 16, "3", "9-14" or "2,regions" ask for, each once, in the order of FIGURES.

    >>> names_of_figures(["regions", "9-11,3", 3])
    ('3', '9', '10', '11', 'regions')
    """
    asked: set[str] = set()
    for text in texts:
        if isinstance(text, bool) or not isinstance(text, (str, int)):
            raise InputError(f"only: {shown(text)}; allowed are {_ALLOWED}")
        for part in str(text).split(","):
            asked.update(_names_of(part.strip().lower()))
    return tuple(name for name in FIGURES if name in asked)


_ALLOWED = "1 to 22, ranges such as 9-14, regions and gait"


def _names_of(part: str) -> Sequence[str]:
    span = re.fullmatch(r"(\d{1,3})\s*-\s*(\d{1,3})", part)
    first, last = (int(span[1]), int(span[2])) if span else (0, 0)
    if span and 1 <= first <= last <= 22:
        return [str(number) for number in range(first, last + 1)]
    name = str(int(part)) if re.fullmatch(r"[0-9]{1,3}", part) else part
    if span or name not in FIGURES:
        hint = did_you_mean(part, [name for name in FIGURES if not name.isdigit()])
        raise InputError(f"only: {shown(part)}; allowed are {_ALLOWED}{hint}")
    return [name]


def draw(
    name: str | int,
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    gait: Gait | TimedGait | Table | None = None,
    divisions: int = DEFAULT_DIVISIONS,
) -> Figure:
    """Return one figure of the paper, a plain matplotlib figure apart from pyplot.

    Parameters
    ----------
    name
        1 to 22, "regions" or "gait".
    vehicle
        By default the paper's. Another one has no four-digit coefficients and no printed vertices: Figures 18, 19 and
        22 then have one panel. The loops of Gaits 1 to 4 are mirrored in the origin if its spin is.
    coefficients
        "published" or "exact"; by default published for the paper's vehicle, exact for any other. Figures 18, 19 and 22
        show both.
    gait
        For "gait": a gait as it stands, or a table, to which vehicle and coefficients apply; by default Gait 3.
    divisions
        Pieces n of the grid.

    Raises
    ------
    InputError
        If matplotlib is missing or a value is not allowed.
    """
    names = names_of_figures([name])
    if len(names) != 1:
        raise InputError(f"name: {shown(name)}; allowed is one of {', '.join(FIGURES)}")
    setting = _Setting(asked=vehicle, kind=coefficients, divisions=divisions, gait=gait)
    coefficients_of(setting.vehicle, coefficients)  # refuses what does not go together, whatever the figure
    with paper_style():
        return FIGURES[names[0]].draw(setting)


def write_figures(
    out: str | Path,
    *,
    only: Sequence[str | int] | None = None,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    gait: Gait | TimedGait | Table | None = None,
    formats: Sequence[Format] = ("png", "svg"),
    force: bool = False,
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Draw figures and write them to files named figure_01.png and so on, each whole or not at all.

    Parameters
    ----------
    out
        A folder; it is made if it does not exist.
    only
        Which, as for :func:`names_of_figures`; by default all.
    vehicle, coefficients, gait
        As for :func:`draw`.
    formats
        Some of png (200 dots per inch), svg and pdf.
    force
        Overwrite files that exist.
    progress
        Called with a few words before each figure.

    Returns
    -------
    list of paths
        In the order of FIGURES, then of `formats`.

    Raises
    ------
    InputError
        If matplotlib is missing, or a name, a format or a setting is not allowed.
    OutputExists
        If a file exists and `force` is not set; then none is written.
    FileProblem
        If `out` is a file, or a folder or file cannot be written.

    Notes
    -----
    The same request gives the same bytes, with the same version of matplotlib. An older or newer one may draw a little
    differently.
    """
    require_matplotlib()
    names = tuple(FIGURES) if only is None else names_of_figures(only)
    if not names:
        raise InputError(f"only: no figure; allowed are {_ALLOWED}")
    if gait is not None and "gait" not in names:
        raise InputError(f"gait: given, and drawn are {', '.join(names)}; allowed is with the figure gait")
    kinds = _checked_formats(formats)
    coefficients_of(vehicle or PAPER, coefficients)
    folder = _folder_of(out)
    paths = {name: [folder / f"{FIGURES[name].stem}.{kind}" for kind in kinds] for name in names}
    _check_targets([path for of_one in paths.values() for path in of_one], force=force)
    for name, targets in paths.items():
        if progress is not None:
            progress(f"drawing {targets[0].stem}")
        figure = draw(name, vehicle=vehicle, coefficients=coefficients, gait=gait)
        contents = [(path, picture_bytes(figure, kind)) for path, kind in zip(targets, kinds, strict=True)]
        _make(folder)
        write_whole(contents, force=force)
    return [path for of_one in paths.values() for path in of_one]


def _checked_formats(formats: Sequence[Any]) -> tuple[Format, ...]:
    if isinstance(formats, str):
        formats = (formats,)
    for kind in formats:
        if kind not in FORMATS:
            hint = did_you_mean(kind, list(FORMATS)) if isinstance(kind, str) else ""
            raise InputError(f"format: {shown(kind)}; allowed are {', '.join(FORMATS)}{hint}")
    if not formats:
        raise InputError(f"format: none; allowed are {', '.join(FORMATS)}")
    return tuple(dict.fromkeys(formats))


def _folder_of(out: str | Path) -> Path:
    """Return the folder to write to, or raise FileProblem if it is something else."""
    if not isinstance(out, (str, Path)) or not str(out):
        raise InputError(f"out: {shown(out)}; allowed is the name of a folder")
    folder = Path(out)
    try:
        known, is_folder = os.path.lexists(folder), folder.is_dir()
    except (OSError, ValueError) as error:
        raise _unwritable(folder, error) from error
    if known and not is_folder:
        raise FileProblem(f"out: {str(folder)!r} is no folder; allowed is a folder, which is made if need be")
    return folder


def _check_targets(paths: Sequence[Path], *, force: bool) -> None:
    """Raise before any work is done if a file exists, or something that is no file."""
    for path in paths:
        try:
            if path.is_dir():
                raise OutputExists(f"output: {str(path)!r} is a folder; allowed is a file")
            if os.path.lexists(path) and not force:
                raise OutputExists(f"output: {str(path)!r} exists; allowed is a new file, or --force (force=True)")
        except GaitgraphError:
            raise
        except (OSError, ValueError) as error:
            raise _unwritable(path, error) from error


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise _unwritable(folder, error) from error


def _unwritable(path: Path, error: Exception) -> FileProblem:
    reason = getattr(error, "strerror", None) or error
    return FileProblem(f"out: cannot write {shown(str(path))}: {reason}; allowed is a folder that can be written")
