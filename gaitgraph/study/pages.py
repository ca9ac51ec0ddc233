"""The summary of a study as one page: counts, small tables, pictures; no script, and nothing to load."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Any

from gaitgraph.study.cases import OUTCOMES, columns_of
from gaitgraph.study.charts import MOST_PANELS, Columns, basins, levels_of, singular_values, thrusts

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy as np
    import numpy.typing as npt

    from gaitgraph.study.designs import Study

    Level = tuple[str, npt.NDArray[np.bool_]]

__all__ = ["page_of", "reasons_of"]

_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_MOST_REASONS = 30
_FACTORS = (("vehicle", "vehicle"), ("gait", "gait"), ("eta", "bias η"), ("period", "period (s)"))
_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.45 system-ui, sans-serif; background: Canvas; color: CanvasText; margin: 2rem auto;
  max-width: 62rem; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin: 0; } h2 { font-size: 1.1rem; margin: 2rem 0 .4rem; }
.counts { display: flex; flex-wrap: wrap; gap: .5rem 2rem; margin: 1rem 0; }
.counts b { font-size: 1.6rem; display: block; font-weight: 600; }
.tables { display: flex; flex-wrap: wrap; gap: 1rem 2.5rem; align-items: flex-start; }
table { border-collapse: collapse; } th, td { text-align: right; padding: .15rem .7rem .15rem 0; vertical-align: top; }
th { font-weight: 600; border-bottom: 1px solid; }
th:first-child, td:first-child, td.text, th.text, td.outcome { text-align: left; }
h1, td:first-child, td.text { overflow-wrap: anywhere; }
td.number, td.outcome { white-space: nowrap; }
td.bar { width: 7rem; } td.bar i { display: block; height: .7rem; margin-top: .35rem; background: #1f9e89; }
@media (max-width: 36rem) { th, td { padding-right: .4rem; } td.bar { width: 2rem; } }
.box { overflow-x: auto; }
svg.chart { display: block; height: auto; stroke-linejoin: round; stroke-linecap: butt; }
p.note { opacity: .75; margin: .2rem 0 .6rem; } code { overflow-wrap: anywhere; }
"""


def reasons_of(table: Any) -> tuple[tuple[str, str, int], ...]:
    """Return outcome, reason and count of what did not settle, the most frequent first.

    Reasons that differ in their numbers alone count as one, told as in the first of those cases.
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
    rows = Columns.of(table)
    body = [f"<h1>{escape(study.name)}</h1>", f'<p class="note">{_made(study)}</p>', _counts(rows)]
    body += ["<h2>What settled</h2>", f'<div class="tables">{"".join(_factors(study, rows))}</div>']
    reasons = reasons_of(table)
    if reasons:
        body += ["<h2>Why others did not</h2>", _reasons(reasons)]
    if rows.flown.any():
        body += _pictures(study, rows)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width">\n'
        f"<title>{escape(study.name)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def _made(study: Study) -> str:
    count = len(study)
    how = "every combination" if study.count is None else f"a random sample, seed {study.seed}"
    most = "" if study.flown_at_most == study.flight.seconds else "up to "
    return escape(
        f"{count} case{'s' * (count != 1)}, {how}; each flown for {most}{study.flown_at_most:g} s"
        + (", whether flyable or not" if study.anyway else "")
        + f"; study {study.fingerprint[:12]}"
    )


def _counts(rows: Columns) -> str:
    counts = {name: int((rows["outcome"] == name).sum()) for name in OUTCOMES}
    cells = [f"<div><b>{count}</b>{escape(name)}</div>" for name, count in counts.items() if count or name == "settled"]
    return f'<div class="counts">{"".join(cells)}</div>'


def _factors(study: Study, rows: Columns) -> Iterable[str]:
    """Yield a table for each quantity that the cases differ in, or that there is one of."""
    known = dict(_FACTORS)
    units = {name: unit for name, _, unit in columns_of(study)}
    columns = list(units)
    constants = columns[columns.index("vehicle") + 1 : columns.index("gait")]
    levels = {name: levels_of(rows[name], order=_order(study, name)) for name in [*known, *constants]}
    for name in [*known, *(one for one in constants if len(levels[one]) > 1)]:
        lines = []
        for level, mask in levels[name]:
            some = rows.where(mask)
            part = some.settled.sum() / len(some)
            lines.append(
                f"<tr><td>{escape(level)}</td><td>{len(some)}</td><td>{int(some.flown.sum())}</td>"
                f'<td>{int(some.settled.sum())}</td><td class="number">{100 * part:.1f} %</td>'
                f'<td class="bar"><i style="width:{100 * part:.1f}%"></i></td></tr>'
            )
        title = escape(known.get(name) or _told(name, units[name]))
        head = f"<tr><th>{title}</th><th>cases</th><th>flown</th><th>settled</th><th>of cases</th><th></th></tr>"
        yield f"<table>{head}{''.join(lines)}</table>"


def _told(column: str, unit: str) -> str:
    return column.replace("_", " ") + (f" ({unit})" if unit not in ("", "1") else "")


def _order(study: Study, column: str) -> list[str]:
    """Return the texts of a column in the order of the study."""
    if column == "vehicle":
        return [model.name for model in study.models]
    return [source.name for source in study.sources] if column == "gait" else []


def _reasons(reasons: Sequence[tuple[str, str, int]]) -> str:
    lines = [
        f'<tr><td>{count}</td><td class="outcome">{escape(outcome)}</td><td class="text">{escape(reason)}</td></tr>'
        for outcome, reason, count in reasons[:_MOST_REASONS]
    ]
    more = len(reasons) - _MOST_REASONS
    note = f'<p class="note">and {more} more reasons</p>' if more > 0 else ""
    head = '<tr><th>cases</th><th class="text">outcome</th><th class="text">reason, as told by the first</th></tr>'
    return f"<table>{head}{''.join(lines)}</table>{note}"


def _pictures(study: Study, rows: Columns) -> Iterable[str]:
    """Yield what is drawn: attitudes by gait and bias, thrust by period, singular values."""
    gaits, biases = levels_of(rows["gait"], order=_order(study, "gait")), levels_of(rows["eta"], pieces=3)
    both: list[Level] = []
    for gait, mask in gaits:
        for eta, other in biases:
            inside = mask & other
            if rows.where(inside).flown.any():
                both.append((gait if len(biases) == 1 else f"{gait}, η = {eta}", inside))
    if len({*zip(rows["roll"].tolist(), rows["pitch"].tolist(), strict=True)}) > 1:
        yield "<h2>From which attitudes</h2>"
        note = "The part of the flights from each initial attitude that settled, over all vehicles and periods."
        more = len(both) - MOST_PANELS
        left = f" The first {MOST_PANELS} of {len(both)}." if more > 0 else ""
        yield f'<p class="note">{note} Grey where none flew.{left}</p>'
        yield basins(rows, both)
    if rows.settled.any():
        yield "<h2>Peak thrust and the period, of flights that settled</h2>"
        yield (
            '<p class="note">In shares of a quarter of the weight: the median, and from the least to the largest.</p>'
        )
        yield thrusts(rows, both)
    yield "<h2>How near to singular</h2>"
    yield '<p class="note">The least singular value of the decoupling matrix that each flight met.</p>'
    yield singular_values(rows)
