"""The summary of a study as one page: counts, small tables, pictures; no script, and nothing to load."""

from __future__ import annotations

import re
from base64 import b64encode
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.plots.axes import blank_figure, paper_style, picture_bytes
from gaitgraph.study.rows import OUTCOMES, columns_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.study.design import Study

    Mask = npt.NDArray[np.bool_]
    Columns = dict[str, npt.NDArray[Any]]

MOST_PANELS = 24
"""Panels of attitudes; more are left out."""

_MOST_REASONS = 30
_MOST_LEVELS = 20
_SETTLED, _NOT_SETTLED, _NOT_FLOWN = "#1f9e89", "#e0722c", "#8a8a8a"
_BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}  # the axes: "best" is slow
_TITLES = {"eta": "bias η", "period": "period (s)"}
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{name}</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font: 15px/1.45 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }}
table {{ border-collapse: collapse; margin: 1rem 0; overflow-wrap: anywhere; }}
th, td {{ text-align: left; padding: .15rem .7rem .15rem 0; vertical-align: top; }}
th {{ border-bottom: 1px solid; }}
img {{ max-width: 100%; background: white; }}
</style>
</head>
<body>
<h1>{name}</h1>
{body}
</body>
</html>
"""


def reasons_of(table: Any) -> tuple[tuple[str, str, int], ...]:
    """Return outcome, reason and count of what did not settle, the most frequent first.

    Reasons that differ in their numbers alone count as one, worded as in the first of those cases.
    """
    first: dict[tuple[str, str], str] = {}
    counts: dict[tuple[str, str], int] = {}
    for outcome, reason in zip(table["outcome"].to_pylist(), table["reason"].to_pylist(), strict=True):
        if outcome != "settled":
            key = (outcome, _NUMBER.sub("#", reason))
            first.setdefault(key, reason)
            counts[key] = counts.get(key, 0) + 1
    order = sorted(counts, key=lambda key: -counts[key])  # ties stay in the order of the cases
    return tuple((key[0], first[key], counts[key]) for key in order)


def page_of(study: Study, table: Any) -> str:
    """Return the page of a study whose rows are all there; the same rows give the same page."""
    rows = {name: table[name].to_numpy() for name in table.schema.names}
    settled: Mask = rows["outcome"] == "settled"
    flown: Mask = settled | (rows["outcome"] == "not settled")
    how = "every combination" if study.count is None else f"a random sample, seed {study.seed}"
    most = "" if study.flown_at_most == study.flight.seconds else "up to "
    anyway = ", whether flyable or not" if study.anyway else ""
    body = [
        f"<p>{len(study)} cases, {how}; each flown for {most}{study.flown_at_most:g} s{anyway}; "
        f"study {study.fingerprint[:12]}</p>",
        _html_table(["outcome", "cases"], [[name, str(int((rows["outcome"] == name).sum()))] for name in OUTCOMES]),
        "<h2>What settled</h2>",
    ]
    columns = columns_of(study)
    names = list(columns)
    constants = names[names.index("vehicle") + 1 : names.index("gait")]
    for name in ("vehicle", "gait", "eta", "period", *constants):
        levels = _levels_of(rows[name])
        if name in constants and len(levels) < 2:
            continue
        unit = columns[name][1]
        title = _TITLES.get(name) or name.replace("_", " ") + (f" ({unit})" if unit not in ("", "1") else "")
        lines = []
        for level, mask in levels:
            part = 100 * settled[mask].mean()
            counts = (str(int(one.sum())) for one in (mask, mask & flown, mask & settled))
            lines.append([level, *counts, f"{part:.1f} %"])
        body.append(_html_table([title, "cases", "flown", "settled", "of cases"], lines))
    reasons = reasons_of(table)
    if reasons:
        lines = [[str(count), outcome, reason] for outcome, reason, count in reasons[:_MOST_REASONS]]
        if len(reasons) > _MOST_REASONS:
            lines.append([f"and {len(reasons) - _MOST_REASONS} more reasons"])
        body += ["<h2>Why others did not</h2>", _html_table(["cases", "outcome", "reason, as in the first"], lines)]
    if flown.any():
        body += _pictures(rows, settled, flown)
    return _PAGE.format(name=escape(study.name), body="\n".join(body))


def _html_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = ["".join(f"<td>{escape(cell)}</td>" for cell in line) for line in lines]
    cells = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    return f"<table><tr>{cells}</tr>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def _levels_of(values: npt.NDArray[Any]) -> list[tuple[str, Mask]]:
    """Return the values of a column, or six ranges of them where they are many, each with the rows that have it.

    >>> [name for name, _ in _levels_of(np.array([2.0, 1.0, 2.0]))]
    ['1', '2']
    """
    if values.dtype == object:  # texts, in the order of the cases
        return [(str(one), values == one) for one in dict.fromkeys(values.tolist()) if one is not None]
    known = np.unique(values[np.isfinite(values)])
    if len(known) <= _MOST_LEVELS:
        return [(f"{value:.6g}", values == value) for value in known]
    edges = np.linspace(known[0], known[-1], 7)
    piece = np.searchsorted(edges[1:-1], values, side="right")
    piece[~np.isfinite(values)] = -1
    found = [(f"{edges[k]:.3g} to {edges[k + 1]:.3g}", piece == k) for k in range(6)]
    return [(name, mask) for name, mask in found if mask.any()]


def _pictures(rows: Columns, settled: Mask, flown: Mask) -> list[str]:
    """Return attitudes by gait and bias, thrust by period, and singular values, as figures of the page."""
    groups = [
        (f"{gait}, η = {eta}", of_gait & of_eta)
        for gait, of_gait in _levels_of(rows["gait"])
        for eta, of_eta in _levels_of(rows["eta"])
        if (flown & of_gait & of_eta).any()
    ]
    panels = groups[:MOST_PANELS]
    with paper_style():
        figure = blank_figure(170.0, 20.0 + 46.0 * -(-len(panels) // 4))
        axes = figure.subplots(-(-len(panels) // 4), 4, squeeze=False, sharex=True, sharey=True)
        for ax in axes.flat[len(panels) :]:
            ax.set_axis_off()
        dots = None
        for ax, (title, mask) in zip(axes.flat, panels, strict=False):
            # Cases of one attitude are one dot: the part of their flights that settled.
            at = np.rad2deg(np.column_stack([rows["roll"], rows["pitch"]])[mask])
            places, place = np.unique(at, axis=0, return_inverse=True)
            flights = np.bincount(place.ravel(), flown[mask], len(places))
            part = np.bincount(place.ravel(), settled[mask], len(places)) / np.maximum(flights, 1)
            ax.scatter(*places[flights == 0].T, s=9, color=_NOT_FLOWN)
            dots = ax.scatter(*places[flights > 0].T, s=9, c=part[flights > 0], cmap="viridis", vmin=0, vmax=1)
            ax.set_title(title, parse_math=False)
        figure.supxlabel("initial roll (°)")
        figure.supylabel("initial pitch (°)")
        if dots is not None:
            figure.colorbar(dots, ax=axes, label="part of the flights that settled")
        more = f" The first {MOST_PANELS} of {len(groups)}." * (len(groups) > MOST_PANELS)
        pictures = [("From which attitudes flights settle; grey where none flew." + more, figure)]

        if settled.any():
            figure = blank_figure(170.0, 70.0)
            ax = figure.subplots()
            for name, mask in groups:
                some = mask & settled
                ax.scatter(rows["period"][some], rows["peak_thrust_share"][some], s=9, alpha=0.7, label=name)
            ax.set(xlabel="period (s)", ylabel="peak thrust / (m g / 4)")
            legend = ax.legend(**_BESIDE)
            for text in legend.get_texts():
                text.set_parse_math(False)
            pictures.append(("Peak thrust of the flights that settled, in shares of a quarter of the weight.", figure))

        figure = blank_figure(170.0, 60.0)
        ax = figure.subplots()
        values = rows["least_singular_value"]
        known = np.isfinite(values)
        parts, colors = [values[known & settled], values[known & flown & ~settled]], [_SETTLED, _NOT_SETTLED]
        ax.hist(parts, bins=30, stacked=True, color=colors, label=["settled", "not settled"])
        ax.set(xlabel="least singular value in flight", ylabel="flights")
        ax.legend(**_BESIDE)
        pictures.append(("The least singular value of the decoupling matrix in each flight.", figure))
    return [
        f'<h2>{escape(title)}</h2><img alt="{escape(title)}" src="data:image/png;base64,'
        f'{b64encode(picture_bytes(figure, "png")).decode()}">'
        for title, figure in pictures
    ]
