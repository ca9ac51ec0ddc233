"""What all pictures share: axes in multiples of π, colors and markers, reproducible files.

matplotlib is imported only inside functions. :func:`paper_style` sets the style; nothing global changes.
"""

from __future__ import annotations

import io
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from gaitgraph.angles import HALF_PI, text_from_angle
from gaitgraph.errors import InputError, needs_extra, shown, wrong
from gaitgraph.files import check_new_files, write_whole

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

Format = Literal["png", "svg", "pdf"]

FORMATS: tuple[Format, ...] = get_args(Format)  # of files of pictures
PALETTE: dict[str, tuple[str, str]] = {
    "alpha1": ("#d27c00", "#ffc14d"),
    "alpha2": ("#3a9ad6", "#a6dcff"),
    "alpha3": ("#00543c", "#14906e"),
    "alpha4": ("#7a2a82", "#c56cc4"),
    "red": ("#d22a17", "#ff7c68"),
    "blue": ("#12429f", "#86abff"),
    "shade-positive": ("#f7dc94", "#5c4a17"),
    "shade-negative": ("#c9cede", "#343c57"),
    "yes": ("#0b6b4f", "#5fd0a6"),
    "partly": ("#8f5600", "#f0b040"),
    "no": ("#8c1183", "#f082e6"),
}
"""Colors of plots, films and the explorer on a light and on a dark background: of rotors, sheets, signs of
R, and verdicts. They are safe for colour-blind readers; markers and dashes say the same without color."""

ROTOR_COLORS = tuple(PALETTE[f"alpha{k}"][0] for k in (1, 2, 3, 4))
# Opposite rotors have the same angle on the red sheet: they differ in width, so that both curves are visible.
_WIDTHS = (3.4, 3.4, 1.6, 1.6)
_DASHES: tuple[Any, ...] = ("-", (0, (3, 0.7)), (0, (5, 2)), (0, (1, 1.2)))
RED = PALETTE["red"][0]
BLUE = PALETTE["blue"][0]
POSITIVE = PALETTE["shade-positive"][0]
NEGATIVE = PALETTE["shade-negative"][0]
GREY = "#8a8a8a"  # of singular points, and of missing data
COLOR_OF = {"red": RED, "blue": BLUE}
MARKER_OF = {"red": "s", "blue": "o"}
INCH = 25.4  # mm

STYLE = Path(__file__).with_name("paper.mplstyle")
"""The style of the figures, as a file for matplotlib.style.use."""

_STAMPS = {
    "png": ("Software",),
    "svg": ("Date", "Creator"),
    "pdf": ("CreationDate", "Producer", "Creator"),
}


def require_matplotlib() -> None:
    """Raise MissingExtra if matplotlib is not installed."""
    try:
        import matplotlib as _  # noqa: F401
    except ImportError as error:
        raise needs_extra("matplotlib", "drawing", "plot") from error


@contextmanager
def paper_style() -> Iterator[None]:
    """Use :data:`STYLE` on top of matplotlib's defaults, then restore the user's settings."""
    require_matplotlib()
    from matplotlib import rc_context

    with rc_context(fname=STYLE):
        yield


def blank_figure(width: float, height: float, *, pyplot: bool = False) -> Figure:
    """Return an empty figure of a size [mm]. With `pyplot` it is registered with pyplot."""
    require_matplotlib()
    from matplotlib.figure import Figure

    if pyplot:
        from matplotlib.pyplot import figure as Figure  # type: ignore[assignment] # noqa: N812
    return Figure(
        figsize=(width / INCH, height / INCH),
        layout="constrained",
        dpi=150 if pyplot else None,
    )


def axes_or_new(ax: Axes | None, *, size: tuple[float, float] = (152.4, 127.0)) -> Axes:
    """Return the given two-dimensional axes, or those of a new pyplot figure of a size [mm]."""
    if ax is None:
        return blank_figure(*size, pyplot=True).add_subplot()
    require_matplotlib()
    from matplotlib.axes import Axes

    if not isinstance(ax, Axes) or ax.name == "3d":
        raise wrong("ax", "must be None or two-dimensional axes of matplotlib", ax)
    return ax


def angle_axis(axis: Axis, label: str, *, divisor: int = 4) -> None:
    r"""Make an axis run from −π/2 to π/2 [rad], labelled with a symbol such as ``\alpha_1``, ticks each π/divisor."""
    from matplotlib.ticker import FixedLocator, FuncFormatter

    def text_of(angle: float, _: object) -> str:
        return f"${text_from_angle(angle)}$".replace("π", r"\pi")

    ticks = np.linspace(-HALF_PI, HALF_PI, divisor + 1).tolist()
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FuncFormatter(text_of))
    axis.set_label_text(f"${label}$ (rad)")
    axis.axes.set(**{f"{axis.axis_name}lim": (-HALF_PI, HALF_PI)})  # type: ignore[attr-defined]


def plane_axes(
    ax: Axes, x: str, y: str, *, divisor: int = 4, grid: bool = True
) -> None:
    r"""Make both axes angles from −π/2 to π/2 [rad], to the same scale, with ticks at multiples of π/divisor.

    `x` and `y` are symbols in mathtext, such as ``"\alpha_1"``.
    """
    angle_axis(ax.xaxis, x, divisor=divisor)
    angle_axis(ax.yaxis, y, divisor=divisor)
    ax.set_aspect("equal", adjustable="box")
    ax.grid(grid)


def legend_above(ax: Any, *, columns: int, over: float = 5.0) -> None:
    """Put a legend `over` points above axes."""
    tight = {"columnspacing": 1.2, "handletextpad": 0.4}
    _put_legend(ax, columns, "lower center", 1.0, over, **tight)


def legend_below(ax: Any, *, columns: int = 1) -> None:
    """Put a legend below the label of axes' x axis."""
    _put_legend(ax, columns, "upper center", 0.0, 32.0)


def _put_legend(
    ax: Any, columns: int, side: str, height: float, distance: float, **look: float
) -> None:
    """Put a legend outside of axes, with one entry for each label, if anything there has a label."""
    handles, labels = ax.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True))
    size = 7.5  # points
    if entries:
        legend = ax.legend(
            entries.values(),
            entries.keys(),
            loc=side,
            bbox_to_anchor=(0.5, height),
            borderaxespad=distance / size,
            ncols=columns,
            fontsize=size,
            frameon=False,
            **look,
        )
        for line in legend.get_lines():
            line.set_linewidth(min(line.get_linewidth(), 6.0))


def draw_arrow(
    ax: Any,
    start: Any,
    end: Any,
    color: str,
    *,
    width: float = 1.0,
    size: float = 9.0,
    **look: Any,
) -> Any:
    """Draw an arrow between two points; width and head size are in points."""
    return ax.annotate(
        "",
        xy=tuple(end),
        xytext=tuple(start),
        arrowprops={
            "arrowstyle": "-|>",
            "color": color,
            "lw": width,
            "mutation_scale": size,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        **({"zorder": 5.0} | look),
    )


def draw_label(
    ax: Axes, place: Any, text: str, color: str = "black", **look: Any
) -> Any:
    """Write a text centred on a point."""
    centred: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 6}
    return ax.text(place[0], place[1], text, color=color, **centred | look)


def draw_note(ax: Axes, text: str) -> None:
    """Write in the middle of axes why nothing is drawn on them."""
    draw_label(ax, (0.5, 0.5), text, GREY, transform=ax.transAxes)


def draw_four(ax: Axes, t: Any, values: Any, label: str) -> None:
    """Draw a curve of each rotor over time [s]; `label` has a place for its number."""
    looks = zip(values.T, ROTOR_COLORS, _WIDTHS, _DASHES, strict=True)
    for number, (curve, color, width, dash) in enumerate(looks, start=1):
        words = label.format(number)
        ax.plot(t, curve, color=color, linewidth=width, linestyle=dash, label=words)


def draw_limit(ax: Axes, value: float, label: str) -> None:
    """Draw a limit as a dashed line."""
    ax.axhline(value, color=RED, linewidth=0.9, linestyle="--", zorder=1, label=label)


def check_pictures(
    paths: Sequence[str | Path], *, force: bool = False
) -> dict[Path, Any]:
    """Return the format of each file of a picture; raise before any work is done if one cannot be written."""
    kinds = {Path(path): Path(path).suffix.lower()[1:] for path in paths}
    if not set(kinds.values()).issubset(FORMATS):
        raise InputError(
            f"output of a picture must end in .png, .svg or .pdf, got {shown(list(map(str, paths)))}"
        )
    check_new_files(paths, force=force)
    return kinds


def write_pictures(
    figure: Figure, paths: Sequence[str | Path], *, force: bool = False
) -> None:
    """Write a figure to .png, .svg or .pdf files, whole or not at all."""
    kinds = check_pictures(paths, force=force)
    write_whole(
        [(path, picture_bytes(figure, kind)) for path, kind in kinds.items()],
        force=force,
    )


def picture_bytes(figure: Figure, kind: Format) -> bytes:
    """Return a figure as the bytes of a file, without time stamps: the same figure gives the same bytes."""
    stream = io.BytesIO()
    with paper_style():
        # The layout is computed once, so that it is the same in every format.
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.execute(figure)
            figure.set_layout_engine("none")
            # The last digits of its solver may differ from run to run.
            for ax in figure.axes:
                bounds = ax.get_position(original=True).bounds
                ax.set_position(np.round(bounds, 9).tolist())
        figure.savefig(stream, format=kind, metadata=dict.fromkeys(_STAMPS[kind]))
    return stream.getvalue()
