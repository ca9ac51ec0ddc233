"""Every figure of the paper, drawn from the package's own results, and two that it lacks.

A figure is known by its number, "1" to "22", or by its name, "regions" and "gait". Neither :func:`draw` nor
:func:`write_figures` uses pyplot, and both have their own style, so that the user's settings change nothing.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from gaitgraph.errors import FileProblem, InputError, did_you_mean, shown
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.gait import Gait, paper_gait, printed_gait
from gaitgraph.gait.table import Table
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.invertibility.matrices import Coefficients, Kind, coefficients_of
from gaitgraph.invertibility.tilt_margins import least_tilt_margin
from gaitgraph.io.formats import gait_of
from gaitgraph.plots.axes import (
    FORMATS,
    Format,
    blank_figure,
    legend_above,
    paper_style,
    picture_bytes,
    require_matplotlib,
)
from gaitgraph.plots.gaits import (
    at_face_value,
    axes_of_a_gait,
    gait_in_four_dimensions,
    gait_loop,
    roll_pitch_diagram,
)
from gaitgraph.plots.planes import (
    adjacency_rule,
    level_determinants,
    regions_map,
    root_angle,
    root_counts,
    signed_roots,
    singular_value_map,
    type_map,
)
from gaitgraph.plots.vehicles import vehicle_figure
from gaitgraph.robustness.attitudes import acceptable_attitudes
from gaitgraph.vehicle import PAPER, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.timing.timed_gait import TimedGait


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperFigure:
    """A figure: its number in the paper or its name, its title, the title with what it shows, and what draws it."""

    name: str
    title: str
    caption: str
    draw: _Drawing

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


_Drawing: TypeAlias = "Callable[[_Setting], Figure]"


def _on_one(width: float, height: float, function: Callable[..., Any], *first: Any, **options: Any) -> _Drawing:
    """Return what draws a figure of one plot over the grid; the roots in space, all others on a plane."""

    def drawn(setting: _Setting) -> Figure:
        figure = blank_figure(width, height)
        in_space = function in (root_angle, signed_roots, level_determinants)
        ax = figure.add_subplot(projection="3d" if in_space else None)
        function(*first, ax=ax, coefficients=setting.coefficients, divisions=setting.divisions, **options)
        return figure

    return drawn


def _vehicle(setting: _Setting) -> Figure:
    figure = blank_figure(170, 98)
    vehicle_figure(setting.vehicle, ax=figure.add_subplot())
    return figure


def _rule(setting: _Setting) -> Figure:
    figure = blank_figure(170, 68)
    left, right = figure.subplots(1, 2)
    adjacency_rule("angle", ax=left)
    adjacency_rule("pair", ax=right)
    left.set_title(r"(a) types of $\alpha_3$ or of $\alpha_4$")
    right.set_title(r"(b) types of $(\alpha_3, \alpha_4)$")
    return figure


def _loops(setting: _Setting) -> Figure:
    figure = blank_figure(170, 177)
    ax = figure.add_subplot()
    type_map("negative", coefficients=setting.coefficients, divisions=setting.divisions, ax=ax)
    # Wide enough for the types written on them. Gaits 2 and 3 share their loop: red lies on the wider blue.
    for number, width in ((1, 18.0), (2, 18.0), (3, 10.0)):
        gait = paper_gait(number, setting.vehicle, setting.coefficients)
        gait_loop(gait, label=f"Gait {number}: {gait.color}", width=width, band=True, ax=ax)
        if number != 3:
            x, y = gait.alpha[:, :2].mean(axis=0)
            name = "Gait 1" if number == 1 else "Gaits 2 and 3"
            ax.text(x, y + math.pi / 32, name, ha="center", va="center")  # between the rows of nodes
    legend_above(ax, columns=3)
    return figure


def _attitudes(number: int, eta: float, claim: str, setting: _Setting) -> Figure:
    """Draw the roll–pitch diagram of a gait of the paper and its biased gait; of a blue one with each rounding."""
    vehicle, numbers = setting.vehicle, setting.coefficients
    own = vehicle.carries_published_coefficients
    if number > 2 or not own:
        figure = blank_figure(85, 108)
        gait = paper_gait(number, vehicle, numbers if number > 2 else coefficients_of(vehicle, "exact"))
        digits = "four-digit" if gait.coefficients.kind == "published" else "exact"
        _diagram(figure.add_subplot(), gait, number, eta, f"{digits} coefficients", claim if own else "")
        return figure
    exact = coefficients_of(vehicle, "exact")
    rounded = paper_gait(number, vehicle, coefficients_of(vehicle, "published"))
    readings = (
        ("(a) exact coefficients", paper_gait(number, vehicle, exact)),
        ("(b) four-digit coefficients", rounded),
        ("(c) printed vertices", printed_gait(number, exact)),
        ("(d) four-digit surface, exact formula", Gait(alpha=rounded.alpha, vehicle=vehicle, coefficients=exact)),
    )
    figure = blank_figure(170, 216, apart=0.08)
    for ax, (title, one) in zip(figure.subplots(2, 2).flat, readings, strict=True):
        _diagram(ax, one, number, eta, title, claim)
    return figure


def _diagram(ax: Axes, gait: Gait, number: int, eta: float, title: str, claim: str) -> None:
    """Draw a roll–pitch diagram, and say in its title what it shows and whether it agrees with the paper's claim.

    "farther" claims that the gait has a wider acceptable region than its biased gait, "alike" that it has little more.
    """
    roll_pitch_diagram(gait, eta=eta, name=f"Gait {number}", ax=ax)
    numbers, both = at_face_value(gait.coefficients), (gait, gait.biased(eta))
    margins = [least_tilt_margin(one.alpha, one.ends, numbers, tolerance=1e-4).upper for one in both]
    texts = ["none" if math.isnan(margin) else f"{math.degrees(margin):.1f}°" for margin in margins]
    lines = [title, f"tilt margin {texts[0]}, biased {texts[1]}"]
    if claim:
        agrees = not math.isnan(margins[0])  # else the gait is singular at every attitude
        if agrees:
            own, biased = (acceptable_attitudes(one.alpha, numbers).fraction for one in both)
            agrees = own > biased if claim == "farther" else own < biased + 0.02
        lines.append("as the paper says" if agrees else "unlike the paper")
    ax.set_title("\n".join(lines))


def _regions(setting: _Setting) -> Figure:
    figure = blank_figure(170, 93)
    left, right = figure.subplots(1, 2)
    regions_map(setting.vehicle, ax=left)
    singular_value_map(setting.vehicle, ax=right)
    return figure


def _gait(setting: _Setting) -> Figure:
    figure = blank_figure(170, 120)
    axes = axes_of_a_gait(figure)
    given = setting.gait if setting.gait is not None else paper_gait(3, setting.vehicle, setting.coefficients)
    if isinstance(given, Table):
        polyline = gait_of(given, vehicle=setting.asked, coefficients=setting.kind)
        gait_in_four_dimensions(given, gait=polyline, axes=axes)
    else:
        gait_in_four_dimensions(given.parametrize() if isinstance(given, Gait) else given, axes=axes)
    return figure


def _figures() -> dict[str, PaperFigure]:
    order = "The roots of a node are ordered by α3, then α4: the solver's order in the paper is not known."
    inner = "Interior nodes of the grid of 16 divisions."
    rounded = (
        "Blue has a sign of R only because the paper's coefficients have four digits; with exact ones it is singular, "
        "grey and hollow here."
    )
    readings = (
        "The blue sheet depends on rounding: (a) exact coefficients make the gait singular at every attitude; (b) the "
        "paper's four digits, taken at face value, leave it a small R and no singular attitude; (c) straight lines "
        "between the vertices as printed, with exact coefficients; (d) angles found with four digits, judged with "
        "exact coefficients. For another vehicle there is (a) alone. "
    )
    lines = (
        "Thin lines are singular attitudes, red solid for the gait, blue dashed for the biased gait; thick ones border "
        "what is never singular around level flight. Above: the least tilt from level flight to a singular attitude, "
        "gait | biased gait, and whether the bordered regions are as the paper says, "
    )
    claims = {"farther": "that the gait's is the wider one.", "alike": "that the gait has little advantage."}
    table: dict[str, tuple[str, str, _Drawing]] = {
        "1": (
            "The tilt-rotor with its arms, tilt axes and signs",
            "Left from above, right one rotor from the tip of its arm. Positive tilts are right-handed about the "
            "outward arm axes e1 to e4; the arrows beside the rotors show where thrusts then lean. cw and ccw are "
            "spins seen from above.",
            _vehicle,
        ),
        "2": (
            "Number of roots (α3, α4) at each node (α1, α2)",
            "Two inside, three on a side, five in a corner: an angle at an end of [−π/2, π/2] is one at the other end "
            "too.",
            _on_one(85, 92, root_counts),
        ),
    }
    words = {"first": "the first root", "other": "the other root", "both": "both roots"}
    for number, (which, angle) in enumerate(product(words, ("alpha3", "alpha4")), start=3):
        symbol = angle.replace("alpha", "α")
        caption = f"Red squares lie on the + plane of {symbol}, blue discs on its − plane. {inner}"
        caption += "" if which == "both" else f" {order}"
        table[str(number)] = f"{symbol} of {words[which]}", caption, _on_one(85, 74, root_angle, angle, which=which)
    for number, function, sign, which in (
        (9, signed_roots, "positive", "first"),
        (10, level_determinants, "positive", "first"),
        (11, signed_roots, "positive", "other"),
        (12, level_determinants, "positive", "other"),
        (13, signed_roots, "negative", "first"),
        (14, signed_roots, "negative", "other"),
    ):
        if function is signed_roots:
            title = f"α3 and α4 of the {which} root where R {'>' if sign == 'positive' else '<'} 0"
            squares = "Red squares are α3, blue discs α4."
        else:
            title = f"R of the {which} root where it is positive"
            squares = "Red squares lie on the red sheet, blue discs on the blue one."
        drawing = _on_one(85, 74, function, sign, which=which)
        table[str(number)] = title, f"{squares} {inner} {order} {rounded}", drawing
    table |= {
        "15": (
            "Which types may be neighbours",
            "Lined types may; each type may also follow itself. (a) one angle; (b) the pair, without (?,?), which may "
            "be a neighbour of every type.",
            _rule,
        ),
        "16": (
            "Types of the roots with R < 0",
            f"Red squares are nodes with (+,+), blue discs those with (−,−), halves those with both; types with a ? "
            f"are written, those of the red sheet in red, those of the blue one in blue. {inner} {rounded}",
            _on_one(170, 173, type_map, "negative"),
        ),
        "17": (
            "Gaits 1 to 3 on the map of types",
            f"Pale bands are the loops of (α1, α2), arrows their direction; Gaits 2 and 3 share theirs. {rounded}",
            _loops,
        ),
    }
    for number, gait, eta, claim in (
        (18, 1, 0.8, "farther"),
        (19, 2, 0.99, "farther"),
        (20, 3, 0.8, "farther"),
        (21, 4, 0.8, "farther"),
        (22, 2, 0.8, "alike"),
    ):
        title = f"Unacceptable attitudes of Gait {gait} and its biased gait, η = {eta:g}"
        caption = f"{readings if gait <= 2 else ''}{lines}{claims[claim]}"
        table[str(number)] = title, caption, partial(_attitudes, gait, eta, claim)
    table |= {
        "regions": (
            "Exact regions of the (α1, α2) plane on the red sheet",
            "Left: signs of R, where hover takes positive thrusts alone (hatched), and contours of the largest thrust "
            "of a rotor in hover, in units of the weight. Right: the least singular value in level flight, "
            "dimensionless; black lines are R = 0, the cross is α = 0.",
            _regions,
        ),
        "gait": (
            "A gait in four dimensions over its period",
            "Angles in time, the loop on the map of types, and three projections with the + planes (red) and − planes "
            "(blue, dashed) as thin lines; arrows show the direction. Gait 3 unless another is given.",
            _gait,
        ),
    }
    return {
        name: PaperFigure(name=name, title=title, caption=f"{title}. {caption}", draw=drawing)
        for name, (title, caption, drawing) in table.items()
    }


FIGURES: dict[str, PaperFigure] = _figures()
"""Every figure by its name, in the order in which they are written."""

_ALLOWED = "1 to 22, ranges such as 9-14, regions and gait"


def names_of_figures(texts: Sequence[str | int]) -> tuple[str, ...]:
    """Return the names that texts such as 16, "3", "9-14" or "2,regions" ask for, each once, in the order of FIGURES.

    >>> names_of_figures(["regions", "9-11,3", 3])
    ('3', '9', '10', '11', 'regions')
    """
    asked: set[str] = set()
    for text in texts:
        if isinstance(text, bool) or not isinstance(text, (str, int)):
            raise InputError(f"only must be some of {_ALLOWED}, got {shown(text)}")
        for part in (part.strip().lower() for part in str(text).split(",")):
            span = re.fullmatch(r"(\d{1,3})\s*-\s*(\d{1,3})", part)
            first, last = (int(span[1]), int(span[2])) if span else (0, 0)
            name = str(int(part)) if re.fullmatch(r"[0-9]{1,3}", part) else part
            if 1 <= first <= last <= 22:
                asked.update(str(number) for number in range(first, last + 1))
            elif name in FIGURES:
                asked.add(name)
            else:
                hint = did_you_mean(part, ["regions", "gait"])
                raise InputError(f"only must be some of {_ALLOWED}, got {shown(part)}{hint}")
    return tuple(name for name in FIGURES if name in asked)


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
        For "gait": a gait as it is, or a table, to which vehicle and coefficients apply; by default Gait 3.
    divisions
        Pieces n of the grid.

    Raises
    ------
    InputError
        If matplotlib is missing or a value is not allowed.
    """
    names = names_of_figures([name])
    if len(names) != 1:
        raise InputError(f"name must be one of {', '.join(FIGURES)}, got {shown(name)}")
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
    InputError, FileProblem
        If matplotlib is missing, a name, a format or a setting is not allowed, or a file cannot be written.
    OutputExists
        If a file exists and `force` is not set; then none is written.

    Notes
    -----
    The same request gives the same bytes, with the same version of matplotlib.
    """
    require_matplotlib()
    names = tuple(FIGURES) if only is None else names_of_figures(only)
    if not names:
        raise InputError(f"only must be some of {_ALLOWED}, got none")
    if gait is not None and "gait" not in names:
        raise InputError(f"gait has an effect on the figure gait only, and drawn are {', '.join(names)}")
    kinds: tuple[Any, ...] = tuple(dict.fromkeys((formats,) if isinstance(formats, str) else formats))
    for kind in kinds or (None,):
        if kind not in FORMATS:
            hint = did_you_mean(kind, list(FORMATS)) if isinstance(kind, str) else ""
            raise InputError(f"format must be one of {', '.join(FORMATS)}, got {shown(kind)}{hint}")
    coefficients_of(vehicle or PAPER, coefficients)
    if not isinstance(out, (str, Path)) or not str(out):
        raise InputError(f"out must be the name of a folder, got {shown(out)}")
    folder = Path(out)
    paths = {name: [folder / f"{FIGURES[name].stem}.{kind}" for kind in kinds] for name in names}
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileProblem(f"out must be a folder that can be written, got {shown(str(folder))}: {reason}") from error
    check_new_files([path for targets in paths.values() for path in targets], force=force)
    for name, targets in paths.items():
        if progress is not None:
            progress(f"drawing {targets[0].stem}")
        figure = draw(name, vehicle=vehicle, coefficients=coefficients, gait=gait)
        write_whole(
            [(path, picture_bytes(figure, kind)) for path, kind in zip(targets, kinds, strict=True)], force=force
        )
    return [path for targets in paths.values() for path in targets]
