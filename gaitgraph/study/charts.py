"""The pictures of a study's summary, as SVG that stands in a page: ink in the page's own color, no background."""

from __future__ import annotations

import io
import itertools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.plots.axes import blank_figure, paper_style

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["MOST_PANELS", "Columns", "basins", "levels_of", "singular_values", "thrusts"]

MOST_PANELS = 24
"""Panels of attitudes; more are left out."""

_INK = "#010203"  # replaced by the page's color
_SETTLED, _ASTRAY, _UNFLOWN = "#1f9e89", "#e0722c", "#8a8a8a"
_WIDTH, _PANEL = 170.0, 42.0  # mm
_HUES = ("#2f7fd6", "#e0722c", "#1f9e89", "#b04fc4", "#c2a01a", "#d64b6a", "#6a7fd0", "#5f9e2f")
_MOST_LEVELS = 20
_MOST_LINES = 40  # periods that have a mark each
_WIDE = 15.0  # ratio of thrusts from which the axis is logarithmic
_DEGREES = 180.0 / np.pi
_LEAST = 3.3  # pixels a millimetre, below which letters are too small: a narrow page scrolls its charts
_FLAT = 2.5  # ratio of the ranges of roll and pitch from which a degree is not the same length in both


@dataclass(frozen=True, slots=True, kw_only=True)
class Columns:
    """Rows of a study as arrays, by column; numbers that are missing are NaN."""

    values: dict[str, npt.NDArray[Any]]

    @classmethod
    def of(cls, table: Any) -> Columns:
        """Return the columns of a pyarrow table."""
        return cls(values={name: table[name].to_numpy() for name in table.schema.names})

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        return self.values[name]

    def where(self, mask: npt.NDArray[np.bool_]) -> Columns:
        """Return some of the rows."""
        return Columns(values={name: values[mask] for name, values in self.values.items()})

    @property
    def settled(self) -> npt.NDArray[np.bool_]:
        """Which rows settled."""
        return np.asarray(self["outcome"] == "settled")

    @property
    def flown(self) -> npt.NDArray[np.bool_]:
        """Which rows flew, whatever came of it."""
        return np.asarray(self.settled | (self["outcome"] == "not settled"))

    def __len__(self) -> int:
        return len(self["case"])


def levels_of(
    values: npt.NDArray[Any], *, order: Sequence[str] = (), pieces: int = 6
) -> list[tuple[str, npt.NDArray[np.bool_]]]:
    """Return the values of a column, or ranges of them where they are many, each with the rows that have it.

    Parameters
    ----------
    values
        The column.
    order
        Of texts.
    pieces
        How many ranges.

    Examples
    --------
    >>> [name for name, _ in levels_of(np.array([2.0, 1.0, 2.0]))]
    ['1', '2']
    """
    if values.dtype == object:
        texts = [value for value in dict.fromkeys([*order, *values.tolist()]) if value is not None]
        found = [(str(value), np.asarray(values == value)) for value in texts]
        return [(text, mask) for text, mask in found if mask.any()]
    known = np.unique(values[np.isfinite(values)])
    if len(known) <= _MOST_LEVELS:
        return [(f"{value:.6g}", values == value) for value in known]
    edges = np.linspace(known[0], known[-1], pieces + 1)
    out = []
    for low, high in itertools.pairwise(edges):
        inside = (values >= low) & ((values < high) | (high == edges[-1]))
        if inside.any():
            out.append((f"{low:.3g} to {high:.3g}", inside))
    return out


def _svg(width: float, height: float, draw: Callable[[Figure], None], name: str) -> str:
    """Return a figure as an SVG element whose ids begin with its name; the same figure gives the same text."""
    with paper_style():
        import matplotlib as mpl

        inks = ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color")
        style: Any = dict.fromkeys(inks, _INK) | {"grid.color": _UNFLOWN, "grid.alpha": 0.35}
        mpl.rcParams.update(style)
        figure = blank_figure(width, height)
        draw(figure)
        for ax in figure.axes:
            ax.set_facecolor("none")
        stream = io.BytesIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None}, facecolor="none")
    text = stream.getvalue().decode()
    text = text[text.index("<svg") :].replace(_INK, "currentColor")
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<style[^>]*>.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", text)
    share = f'style="width: {100 * width / _WIDTH:.4g}%; min-width: {_LEAST * width:.0f}px"'
    svg = re.sub(r'^<svg [^>]*?(viewBox="[^"]*")[^>]*>', rf'<svg class="chart" {share} \1>', text)
    return f'<div class="box">{svg}</div>'


def basins(rows: Columns, panels: Sequence[tuple[str, npt.NDArray[np.bool_]]]) -> str:
    """Return one panel of roll and pitch for each set of rows, colored by the part that settled.

    Attitudes that lie on a grid are cells, others dots.
    """
    shown = panels[:MOST_PANELS]
    across = min(4, len(shown))
    down = -(-len(shown) // across)
    ranges = [np.ptp(rows[name]) for name in ("roll", "pitch")]
    square = max(ranges) < _FLAT * min(ranges)

    def draw(figure: Figure) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LinearSegmentedColormap

        colors = LinearSegmentedColormap.from_list("settled", [_ASTRAY, "#c9c27a", _SETTLED])
        axes = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
        for ax in axes.flat[len(shown) :]:
            ax.set_axis_off()
        for ax, (title, mask) in zip(axes.flat, shown, strict=False):
            _draw_basin(ax, rows.where(mask), colors)
            ax.set_title(title, parse_math=False)
            if square:
                ax.set_aspect("equal", adjustable="box")
            ax.plot(0, 0, marker="+", color=_INK, markersize=5, linestyle="none")
        for ax in axes[-1]:
            ax.set_xlabel("initial roll (°)")
        for ax in axes[:, 0]:
            ax.set_ylabel("initial pitch (°)")
        bar = figure.colorbar(ScalarMappable(cmap=colors), ax=axes, fraction=0.03, shrink=0.9)
        bar.set_label("part of the flights that settled")
        if bar.solids is not None:
            bar.solids.set_edgecolor("face")

    width = min(_WIDTH, 26.0 + 48.0 * across)
    return _svg(width, 14.0 + down * (_PANEL + 4.0), draw, "basins")


def _draw_basin(ax: Axes, rows: Columns, colors: Any) -> None:
    roll, pitch = rows["roll"] * _DEGREES, rows["pitch"] * _DEGREES
    places, at = np.unique(np.column_stack([roll, pitch]), axis=0, return_inverse=True)
    at = at.reshape(-1)
    flown = np.bincount(at, rows.flown, len(places))
    part = np.bincount(at, rows.settled, len(places)) / np.where(flown > 0, flown, 1.0)
    faces = colors(part)
    faces[flown == 0] = _rgba(_UNFLOWN)
    steps = [_step(places[:, k]) for k in range(2)]
    if len(places) > 1 and all(step is not None for step in steps):
        from matplotlib.collections import PolyCollection

        wide, high = (step / 2 if step else 0.5 for step in steps)
        corners = np.array([(-wide, -high), (wide, -high), (wide, high), (-wide, high)])
        ax.add_collection(
            PolyCollection(places[:, None, :] + corners, facecolors=faces, edgecolors=faces, linewidths=0.3)
        )
        ax.set_xlim(places[:, 0].min() - wide, places[:, 0].max() + wide)
        ax.set_ylim(places[:, 1].min() - high, places[:, 1].max() + high)
    else:
        ax.margins(0.06)
        ax.scatter(places[:, 0], places[:, 1], s=9, c=faces, linewidths=0, zorder=3)  # above the cross


def _rgba(color: str) -> tuple[float, ...]:
    return (*(int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)), 0.6)


def _step(values: npt.NDArray[np.float64]) -> float | None:
    """Return the even step between values, 0 if there is one alone, None if they are not even."""
    known = np.unique(values)
    gaps = np.diff(known)
    if not len(gaps):
        return 0.0
    return float(gaps[0]) if np.allclose(gaps, gaps[0], rtol=1e-6) and len(known) ** 2 <= 4 * len(values) else None


def thrusts(rows: Columns, groups: Sequence[tuple[str, npt.NDArray[np.bool_]]]) -> str:
    """Return the peak thrust of flights that settled, in shares of a quarter of the weight, against the period."""
    good = rows.settled & np.isfinite(rows["peak_thrust_share"])
    periods = np.unique(rows["period"][good])
    shares = rows["peak_thrust_share"]

    def draw(figure: Figure) -> None:
        ax = figure.subplots()
        for k, (name, mask) in enumerate(groups):
            mine, color = mask & good, _HUES[k % len(_HUES)]
            if not mine.any():
                continue
            if len(periods) > _MOST_LINES:
                ax.scatter(rows["period"][mine], shares[mine], s=5, color=color, linewidths=0, alpha=0.7, label=name)
                continue
            known = np.unique(rows["period"][mine])
            parts = [shares[mine & (rows["period"] == one)] for one in known]
            middle, low, high = (np.array([take(part) for part in parts]) for take in (np.median, np.min, np.max))
            at = known
            if len(periods) == 1:
                at = np.array([float(k)])
            else:  # side by side
                at = known + (k - (len(groups) - 1) / 2) * 0.01 * (periods[-1] - periods[0])
            ax.vlines(at, low, high, color=color, linewidth=2.4, alpha=0.4)
            ax.plot(at, middle, marker="o", markersize=3.5, color=color, label=name)
        if len(periods) == 1:
            ax.set_xticks([])
            ax.set_xlabel(f"period {periods[0]:.6g} s")
            ax.set_xlim(-1, len(groups))
        else:
            ax.set_xlabel("period (s)")
        if shares[good].max() > _WIDE * max(float(shares[good].min()), 1e-9):
            from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

            ax.set_yscale("log")
            ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            ax.yaxis.set_minor_formatter(NullFormatter())
        ax.set_ylabel("peak thrust / (m g / 4)")
        ax.grid(True)
        _legend(ax)

    return _svg(_WIDTH, 70.0, draw, "thrusts")


def singular_values(rows: Columns) -> str:
    """Return how many flights met which least singular value, those that settled apart from those that did not."""
    values = rows["least_singular_value"]
    flown = np.isfinite(values) & rows.flown
    parts = [values[flown & rows.settled], values[flown & ~rows.settled]]

    def draw(figure: Figure) -> None:
        from matplotlib.ticker import MaxNLocator

        ax = figure.subplots()
        low, high = float(values[flown].min()), float(values[flown].max())
        edges = np.linspace(low, high, 31) if high - low > 1e-9 else np.array([low - 0.01, low + 0.01])
        ax.hist(parts, bins=edges.tolist(), stacked=True, color=[_SETTLED, _ASTRAY], label=["settled", "not settled"])
        ax.set_xlabel("least singular value met in flight")
        ax.set_ylabel("flights")
        ax.yaxis.set_major_locator(MaxNLocator(integer=True))
        ax.grid(True, axis="y")
        _legend(ax)

    return _svg(_WIDTH, 60.0, draw, "values")


def _legend(ax: Axes) -> None:
    handles, labels = ax.get_legend_handles_labels()
    if handles:
        legend = ax.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        for text in legend.get_texts():
            text.set_parse_math(False)
