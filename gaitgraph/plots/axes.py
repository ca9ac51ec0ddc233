"""What every picture shares: axes in multiples of π, colors and markers, deterministic files.

matplotlib is imported only inside functions. The style is never global: it holds inside :func:`paper_style`, in which
:mod:`gaitgraph.plots.figures` draws and saves.
"""

from __future__ import annotations

import io
import math
from contextlib import contextmanager
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitgraph.angles import HALF_PI
from gaitgraph.errors import InputError, needs_extra, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.path import Path

Format = Literal["png", "svg", "pdf"]

FORMATS: tuple[Format, ...] = ("png", "svg", "pdf")
"""What a picture can be saved as."""

RED = "#e0301e"
BLUE = "#0b3c9c"
"""The two sheets; red is much the lighter one, where a print loses its hue."""

GREY = "#8a8a8a"
"""What is singular, or absent."""

COLOR_OF = {"red": RED, "blue": BLUE}
MARKER_OF = {"red": "s", "blue": "o"}
"""Markers that tell the colors apart: a square is red, a disc blue."""

SINGULAR = "R = 0 to rounding: singular"
"""How legends call roots that have no sign of R."""

STYLE: Any = {
    # These fonts come with matplotlib: the same letters on every machine.
    "font.family": ["DejaVu Sans"],
    "mathtext.fontset": "dejavusans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "grid.linewidth": 0.4,
    "grid.color": "#d5d5d5",
    "axes.axisbelow": True,
    "hatch.linewidth": 0.4,
    "lines.linewidth": 1.0,
    "figure.dpi": 200.0,
    "savefig.dpi": "figure",
    "svg.hashsalt": "gaitgraph",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
}
"""rcParams of the figures, over matplotlib's defaults; sizes in points, for widths of 85 and 170 mm."""

_MILLIMETRES = 25.4
_NO_STAMPS = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}


def require_matplotlib() -> None:
    """Raise MissingExtra, saying what to install, if matplotlib is missing."""
    try:
        import matplotlib as _  # noqa: F401
    except ImportError as error:
        raise needs_extra("matplotlib", "drawing", "plot") from error


@contextmanager
def paper_style() -> Iterator[None]:
    """Hold :data:`STYLE` over matplotlib's own defaults, whatever the user's settings; they are back afterwards."""
    require_matplotlib()
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def blank_figure(width: float, height: float, *, apart: float = 0.02) -> Figure:
    """Return an empty figure of a size [mm], with panels a fraction of their width apart, and without pyplot."""
    require_matplotlib()
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    size = (width / _MILLIMETRES, height / _MILLIMETRES)
    return Figure(figsize=size, layout=ConstrainedLayoutEngine(wspace=apart))


def axes_or_new(ax: Any, *, size: tuple[float, float] = (85.0, 80.0), in_space: bool = False) -> Any:
    """Return the axes given, or those of a new pyplot figure of a size [mm]; InputError if they are not such axes."""
    require_matplotlib()
    from matplotlib.axes import Axes

    if ax is None:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=(size[0] / _MILLIMETRES, size[1] / _MILLIMETRES), layout="constrained")
        return figure.add_subplot(projection="3d" if in_space else None)
    if not isinstance(ax, Axes) or (ax.name == "3d") != in_space:
        allowed = "axes with projection='3d'" if in_space else "matplotlib's plane axes"
        raise InputError(f"ax must be None or {allowed}, got {shown(ax)}")
    return ax


def text_of_multiple(angle: float, position: int | None = None) -> str:
    r"""Return an angle [rad] as a tick label, a multiple of π in mathtext; `position` is matplotlib's and not used.

    >>> text_of_multiple(-3 * math.pi / 8), text_of_multiple(math.pi), text_of_multiple(0.0), text_of_multiple(0.3)
    ('$-3\\pi/8$', '$\\pi$', '$0$', '$0.3$')
    """
    part = Fraction(angle / math.pi).limit_denominator(64)
    if abs(float(part) * math.pi - angle) > 1e-9:
        return f"${angle:.4g}$"
    if part == 0:
        return "$0$"
    sign, size = "-" if part < 0 else "", abs(part.numerator)
    below = f"/{part.denominator}" if part.denominator > 1 else ""
    return rf"${sign}{size if size > 1 else ''}\pi{below}$"


def angle_axis(axis: Axis, label: str, *, divisor: int = 4, end: float = HALF_PI) -> None:
    r"""Label an axis with a symbol such as ``\alpha_1``, from −end to end [rad], ticks at multiples of π/divisor."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    most = math.floor(end * divisor / math.pi + 1e-9)
    axis.set_major_locator(FixedLocator([k * math.pi / divisor for k in range(-most, most + 1)]))
    axis.set_major_formatter(FuncFormatter(text_of_multiple))
    axis.set_label_text(f"${label}$ (rad)")
    axis.axes.set(**{f"{axis.axis_name}lim": (-end, end)})  # type: ignore[attr-defined]


def plane_axes(ax: Axes, x: str, y: str, *, divisor: int = 4, end: float = HALF_PI, grid: bool = True) -> None:
    r"""Make both axes those of angles to the same scale.

    Parameters
    ----------
    ax
        Plane axes.
    x, y
        Symbols in mathtext, such as ``"\alpha_1"``.
    divisor
        Ticks at multiples of π/divisor.
    end
        Half the range [rad].
    grid
        Whether lines are drawn at the ticks.
    """
    angle_axis(ax.xaxis, x, divisor=divisor, end=end)
    angle_axis(ax.yaxis, y, divisor=divisor, end=end)
    ax.set_aspect("equal", adjustable="box")
    ax.grid(grid)


def space_axes(ax: Any, *, columns: int = 2) -> Any:
    """Return axes whose x and y are α1 and α2, seen from where no plane of roots is on edge, with a legend above."""
    from matplotlib.ticker import FixedLocator

    for axis, symbol in ((ax.xaxis, r"\alpha_1"), (ax.yaxis, r"\alpha_2")):
        angle_axis(axis, symbol)
        # At the ends the labels of two axes would meet.
        axis.set_major_locator(FixedLocator([-HALF_PI / 2, 0.0, HALF_PI / 2]))
    ax.view_init(elev=14, azim=-125)
    ax.set_box_aspect((1, 1, 0.9), zoom=0.82)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
    ax.zaxis.set_rotate_label(False)
    ax.zaxis.label.set_rotation(90)
    ax.tick_params(pad=0)
    legend_above(ax, columns=columns, over=-16.0)
    return ax


def legend_above(ax: Any, *, columns: int, over: float = 5.0) -> None:
    """Put a legend `over` points above axes; marks that have one label are drawn upon each other in it."""
    named: dict[str, list[Any]] = {}
    for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
        named.setdefault(label, []).append(handle)
    ax.legend(
        [tuple(handles) if len(handles) > 1 else handles[0] for handles in named.values()],
        list(named),
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=columns,
        columnspacing=1.2,
        handletextpad=0.4,
        borderaxespad=over / STYLE["legend.fontsize"],
    )
    for line in ax.get_legend().get_lines():
        line.set_linewidth(min(line.get_linewidth(), 6.0))


def legend_below(ax: Axes, **options: Any) -> None:
    """Put a legend below the label of axes' x axis."""
    below = 32.0 / STYLE["legend.fontsize"]  # both in points
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=below, **options)


def draw_arrow(
    ax: Axes, start: Any, end: Any, color: str, *, width: float = 1.0, size: float = 9.0, zorder: float = 5.0,
    gid: str | None = None,
) -> Any:  # fmt: skip
    """Draw an arrow between two places; width and head size in points."""
    style = {"arrowstyle": "-|>", "color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    arrow = style | {"mutation_scale": size}
    return ax.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow, zorder=zorder, gid=gid)


def draw_label(ax: Axes, place: Any, text: str, color: str = "black", offset: tuple[float, float] = (0.0, 0.0)) -> None:
    """Write a text centred on a place, moved by an offset in data units."""
    ax.text(place[0] + offset[0], place[1] + offset[1], text, color=color, ha="center", va="center", zorder=6)


def half_markers() -> tuple[Path, Path]:
    """Return the left half of a square and the right half of a disc: together a mark half red, half blue."""
    from matplotlib.path import Path

    square = Path(np.array([[0.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [0.0, 1.0], [0.0, -1.0]]), closed=True)
    arc = Path.arc(-90, 90)
    vertices = np.concatenate([np.asarray(arc.vertices), [[0.0, -1.0]]])
    return square, Path(vertices, [*np.asarray(arc.codes).tolist(), Path.CLOSEPOLY])


def picture_bytes(figure: Figure, kind: Format) -> bytes:
    """Return a figure as the bytes of a file, without time stamps: the same figure gives the same bytes."""
    stream = io.BytesIO()
    with paper_style():
        # The figure is laid out once: in another format it does not differ a little.
        if figure.get_layout_engine() is not None:
            figure.draw_without_rendering()
            figure.set_layout_engine("none")
        figure.savefig(stream, format=kind, metadata=_NO_STAMPS[kind])
    return stream.getvalue()
