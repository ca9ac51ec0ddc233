"""Every figure of the paper, computed by the package, and some more; without pyplot and the user's settings."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.errors import FileProblem, InputError, checked_choice, did_you_mean, shown
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.gait import Gait, paper_gait, printed_gait
from gaitgraph.gait.table import Table
from gaitgraph.graph.build import DEFAULT_DIVISIONS
from gaitgraph.invertibility.matrices import Coefficients, CoefficientsLike, coefficients_of
from gaitgraph.invertibility.tilt_margins import least_tilt_margin
from gaitgraph.io.formats import gait_of, given_gait, naming_file
from gaitgraph.plots import axes as base, gaits, planes
from gaitgraph.plots.vehicles import vehicle_figure
from gaitgraph.timing.timed_gait import timed_gait_of
from gaitgraph.vehicle import PAPER, Vehicle, VehicleLike, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitgraph.io.formats import GaitLike

    Drawing = Callable[[Figure, "_FigureInput"], Any]


class _FigureInput(NamedTuple):
    vehicle: Vehicle
    coefficients: Coefficients
    divisions: int
    gait: Any  # of the figure gait: a gait, timed gait or table
    polyline: Gait | None  # of a table


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure and its caption."""

    name: str  # the number in the paper, with b for a second figure, or "regions" or "gait"
    caption: str
    size: tuple[float, float]  # mm
    drawing: Drawing

    @property
    def title(self) -> str:
        """First sentence of the caption."""
        return self.caption.partition(". ")[0]

    @property
    def stem(self) -> str:
        """Name of its files without suffix: figure_01 … figure_22, figure_18b, figure_regions, figure_gait."""
        return f"figure_{self.name:0>2}"


def _in_space(function: Callable[..., None], figure: Figure, of: _FigureInput, **options: Any) -> None:
    ax = figure.add_subplot(projection="3d", computed_zorder=False)
    function(ax, of.coefficients, of.divisions, **options)


def _rule(figure: Figure, of: _FigureInput) -> None:
    left, right = figure.subplots(1, 2)
    planes.adjacency_rule("angle", ax=left).set_title(r"(a) types of $\alpha_3$ or of $\alpha_4$")
    planes.adjacency_rule("pair", ax=right).set_title(r"(b) types of $(\alpha_3, \alpha_4)$")


def _types(figure: Figure, of: _FigureInput) -> Axes:
    return planes.type_map("negative", coefficients=of.coefficients, divisions=of.divisions, ax=figure.add_subplot())


def _loops(figure: Figure, of: _FigureInput) -> None:
    ax = _types(figure, of)
    # Bands are wider than the texts on them. Gaits 2 and 3 have the same loop: the red band lies on the wider blue one.
    for number, width, name in ((1, 18.0, "Gait 1"), (2, 18.0, "Gaits 2 and 3"), (3, 10.0, "")):
        gait = paper_gait(number, of.vehicle, of.coefficients)
        gaits.gait_loop(gait, label=f"Gait {number}: {gait.color}", width=width, band=True, ax=ax)
        x, y = gait.alpha[:, :2].mean(axis=0)
        if name:
            ax.text(x, y + math.pi / 32, name, ha="center", va="center")  # between the rows of nodes
    base.legend_above(ax, columns=3)


def _regions(figure: Figure, of: _FigureInput) -> None:
    left, right = figure.subplots(1, 2)
    planes.regions_map(of.vehicle, ax=left)
    planes.singular_value_map(of.vehicle, ax=right)


def _attitudes(figure: Figure, of: _FigureInput, *, number: int, eta: float, more: bool = False) -> None:
    """Draw the roll–pitch diagram of a gait of the paper and its biased gait.

    A blue gait of the paper's vehicle has angles of four digits and the exact formula: the reading that gives the
    paper's picture. With `more` its other readings are drawn.
    """
    exact = coefficients_of(of.vehicle, "exact")
    if number <= 2 and of.vehicle.carries_published_coefficients:
        rounded = paper_gait(number, of.vehicle, coefficients_of(of.vehicle, "published"))
        mixed = Gait(alpha=rounded.alpha, vehicle=of.vehicle, coefficients=exact)
        others = {"exact coefficients": paper_gait(number, of.vehicle, exact), "four-digit coefficients": rounded}
        others["printed vertices"] = printed_gait(number, exact)
        readings = others if more else {"four-digit angles, exact formula": mixed}
    else:
        gait = paper_gait(number, of.vehicle, of.coefficients if number > 2 else exact)
        readings = {f"{'four-digit' if gait.coefficients.kind == 'published' else 'exact'} coefficients": gait}
    for ax, (title, gait) in zip(np.ravel(figure.subplots(1, len(readings))), readings.items(), strict=True):
        gaits.roll_pitch_diagram(gait, eta=eta, name=f"Gait {number}", ax=ax)
        numbers = gaits.as_if_exact(gait.coefficients)
        margins = [
            math.degrees(least_tilt_margin(one.alpha, one.ends, numbers, tolerance=1e-4).upper)
            for one in (gait, gait.biased(eta))
        ]
        own, biased = ("none" if math.isnan(margin) else f"{margin:.1f}°" for margin in margins)
        head = title if more else f"Gait {number}: {title}"
        ax.set_title(f"{head}\ntilt margin {own}, biased {biased}")
        if more:
            base.legend_below(ax)
            ax.set_ylabel(ax.get_ylabel() if ax.get_subplotspec().is_first_col() else "")


def _set(figure: Figure, of: _FigureInput) -> None:
    rows: Any = of.polyline and {"vehicle": of.polyline.vehicle, "coefficients": of.polyline.coefficients}
    gaits.draw_sheet(figure, [timed_gait_of(of.gait, **(rows or {}))])


def _figures() -> dict[str, PaperFigure]:
    order = "The roots of a node are ordered by α3, then α4: the solver's order in the paper is not known."
    rounded = "Blue has a sign of R only because the paper's coefficients have four digits; with exact ones R = 0."
    lines = "Lines are singular attitudes, shaded is what is never singular around level flight."
    captions = {
        "1": "The tilt-rotor from above, and one rotor from the tip of its arm. Positive tilts are right-handed about "
        "the arm axes e1 to e4; cw and ccw are spins seen from above.",
        "2": "Number of roots (α3, α4) at each node (α1, α2). −π/2 and π/2 are one angle.",
        "15": "Which types may be neighbours. Lines join types that may; each may follow itself, and (?,?) all.",
        "16": "Types of the roots with R < 0. Red squares are nodes with (+,+), blue discs those with (−,−), halves "
        f"both; other types are written. {rounded}",
        "17": f"Gaits 1 to 3 on the map of types. Pale bands are the loops of (α1, α2). {rounded}",
        "regions": "Exact regions of the (α1, α2) plane on the red sheet. Left: signs of R, positive hover thrusts "
        "(hatched), and the largest thrust of a rotor in units of the weight. Right: the least singular value.",
        "set": "The set of a gait. Its loop on the map, tilt angles, level hover thrusts, acceptable attitudes, and "
        "least singular value, with exact physics; Gait 3 unless another is given.",
        "gait": "A gait in four dimensions over its period. Angles in time, the loop on the map of types, and three "
        "projections with the + planes (red) and − planes (blue, dashed); Gait 3 unless another is given.",
    }
    drawings: dict[str, tuple[float, float, Drawing]] = {  # with width and height [mm]
        "1": (170, 98, lambda figure, of: vehicle_figure(of.vehicle, ax=figure.add_subplot())),
        "2": (85, 92, lambda figure, of: planes.root_counts(figure.add_subplot(), of.coefficients, of.divisions)),
        "15": (170, 68, _rule),
        "16": (170, 173, _types),
        "17": (170, 177, _loops),
        "regions": (170, 93, _regions),
        "set": (400, 84, _set),
        "gait": (170, 120, lambda figure, of: gaits.gait_in_four_dimensions(of.gait, gait=of.polyline, axes=figure)),
    }
    for name, (which, angle) in zip("345678", product(("first", "other", "both"), (3, 4)), strict=True):
        words = "both roots" if which == "both" else f"the {which} root"
        marks = f"Red squares lie on the + plane of α{angle}, blue discs on its − plane."
        captions[name] = f"α{angle} of {words}. {marks} {order if which != 'both' else ''}".strip()
        drawings[name] = 85, 74, partial(_in_space, planes.root_angle, angle=angle, which=which)
    for name, (sign, which) in zip(
        ("9", "11", "13", "14"), product(("positive", "negative"), ("first", "other")), strict=True
    ):
        title = f"α3 and α4 of the {which} root where R {'>' if sign == 'positive' else '<'} 0"
        captions[name] = f"{title}. Red squares are α3, blue discs α4. {order} {rounded}"
        drawings[name] = 85, 74, partial(_in_space, planes.signed_roots, sign=sign, which=which)
    for name, which in (("10", "first"), ("12", "other")):
        title = f"R of the {which} root where it is positive"
        captions[name] = f"{title}. Red is the red sheet, blue the blue one. {order} {rounded}"
        drawings[name] = 85, 74, partial(_in_space, planes.level_determinants, sign="positive", which=which)
    biased = {"18": (1, 0.8), "19": (2, 0.99), "20": (3, 0.8), "21": (4, 0.8), "22": (2, 0.8)}
    for name, (number, eta) in biased.items():
        title = f"Unacceptable attitudes of Gait {number} and its biased gait, η = {eta:g}"
        digits = " Blue depends on rounding: here the angles have four digits, and the formula is exact."
        captions[name] = f"{title}. {lines}{digits if number <= 2 else ''}"
        drawings[name] = 85, 98, partial(_attitudes, number=number, eta=eta)
        if number <= 2:
            captions[f"{name}b"] = (
                f"Figure {name} with other digits. {lines} Blue depends on rounding: exact coefficients; four digits, "
                "taken as exact; straight lines between the printed vertices."
            )
            drawings[f"{name}b"] = 170, 84, partial(_attitudes, number=number, eta=eta, more=True)
    names = (*map(str, range(1, 23)), "18b", "19b", "22b", "regions", "gait", "set")
    return {name: PaperFigure(name, captions[name], drawings[name][:2], drawings[name][2]) for name in names}


FIGURES: dict[str, PaperFigure] = _figures()
"""All figures by name, in the order of writing."""


def names_of_figures(texts: Sequence[str | int]) -> tuple[str, ...]:
    """Return the figures named by texts such as 16, "3", "9-14" or "2,regions", each once, in the order of FIGURES.

    >>> names_of_figures(["regions", "9-11,3", 3])
    ('3', '9', '10', '11', 'regions')
    """
    parts = [part.strip().lower() for text in texts for part in str(text).split(",")]
    asked: set[str] = set()
    for part in parts or ["none"]:
        span = re.fullmatch(r"([0-9]{1,3})(?:\s*-\s*([0-9]{1,3}))?", part)
        names = [str(number) for number in range(int(span[1]), int(span[2] or span[1]) + 1)] if span else [part]
        if not names or not set(names) <= set(FIGURES):
            got = f"{shown(part)}{did_you_mean(part, ['regions', 'gait'])}"
            raise InputError(
                f"only must be some of 1 to 22, ranges such as 9-14, 18b, 19b, 22b, regions, gait and set, got {got}"
            )
        asked.update(names)
    return tuple(name for name in FIGURES if name in asked)


def draw(
    name: str | int,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    gait: GaitLike | None = None,
    divisions: int = DEFAULT_DIVISIONS,
) -> Figure:
    """Return one figure of the paper, which pyplot does not know.

    `name` is one of FIGURES, `vehicle` by default the paper's. Other vehicles have no four-digit coefficients: 18b, 19b
    and 22b then show the same as 18, 19 and 22. If their spins are opposite, the loops of Gaits 1 to 4 are mirrored in
    the origin. `coefficients` are by default "published" for the paper's vehicle, "exact" for others. `gait` is that of
    the figures "gait" and "set" in any form, by default Gait 3; vehicle and coefficients apply to it if it is a table.
    `divisions` is the number of grid intervals in [−π/2, π/2].
    """
    names = names_of_figures([name])
    if len(names) != 1:
        raise InputError(f"name must be one of {', '.join(FIGURES)}, got {shown(name)}")
    chosen = vehicle_named(PAPER if vehicle is None else vehicle)
    numbers = coefficients_of(chosen, coefficients)
    given = paper_gait(3, chosen, numbers) if gait is None else given_gait(gait)
    polyline = gait_of(given, vehicle=vehicle, coefficients=coefficients) if isinstance(given, Table) else None
    known = FIGURES[names[0]]
    with base.paper_style():
        figure = base.blank_figure(*known.size)
        known.drawing(figure, _FigureInput(chosen, numbers, divisions, given, polyline))
        if known.name in map(str, range(3, 15)):
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
    `only` are names such as 16, "3", "9-14" or "2,regions", by default all; `vehicle`, `coefficients` and `gait` are as
    for :func:`draw`; `formats` are some of png (200 dots per inch), svg and pdf. Without `force` an existing file
    raises OutputExists before anything is written. `progress` is called with a short text before each figure.
    """
    base.require_matplotlib()
    source = None if gait is None else given_gait(gait)
    if isinstance(source, Table):
        with naming_file(gait):
            gait_of(source, vehicle=vehicle, coefficients=coefficients)
    names = tuple(FIGURES) if only is None else names_of_figures(only)
    if gait is not None and not {"gait", "set"} & {*names}:
        raise InputError(f"gait has an effect on the figures gait and set only, and only selects {', '.join(names)}")
    kinds = tuple(dict.fromkeys(formats))
    for kind in kinds or ("none",):
        checked_choice("format", kind, base.FORMATS)
    coefficients_of(PAPER if vehicle is None else vehicle, coefficients)
    folder = Path(out)
    files = {name: [(folder / f"{FIGURES[name].stem}.{kind}", kind) for kind in kinds] for name in names}
    paths = [path for targets in files.values() for path, _ in targets]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileProblem(f"out must be a folder that can be written, got {shown(str(folder))}: {reason}") from error
    check_new_files(paths, force=force)
    for name, targets in files.items():
        if progress is not None:
            progress(f"drawing {FIGURES[name].stem}")
        figure = draw(name, vehicle=vehicle, coefficients=coefficients, gait=source)
        write_whole([(path, base.picture_bytes(figure, kind)) for path, kind in targets], force=force)
    return paths
