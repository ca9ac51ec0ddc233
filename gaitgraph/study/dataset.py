"""The dataset of a study: the columns of its rows, the folder that keeps them, and the page that sums them up.

::

    study.json                 what the study is, resolved; its fingerprint; the versions that rows are made with
    rows/part-00000.parquet    cases 0 to B − 1, in order; written whole or not at all
    rows/part-00001.parquet    the next B, and so on; B follows from the number of cases
    summary.html               once all are there: counts, tables, pictures; no script, and nothing to load

Rows hold nothing of the clock, the machine or the process, so parts have the same bytes whichever worker flew them.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
from base64 import b64encode
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import FileProblem, GaitgraphError, InputError, OutputExists, shown
from gaitgraph.files import text_of, write_whole
from gaitgraph.plots.axes import blank_figure, paper_style, picture_bytes
from gaitgraph.vehicle import UNITS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from gaitgraph.study.design import Study

    Row = dict[str, Any]
    Mask = npt.NDArray[np.bool_]

OUTCOMES = ("settled", "not settled", "refused", "no gait", "failed")
"""What may come of a case: it flew and settled, or not; it was not flown; there is nothing to fly; it broke off."""

MANIFEST = "study.json"
KEPT = "what is written stays, and the same command continues from there"

_HEAD = {"case": ("int64", ""), "vehicle": ("string", ""), "drag_ratio": ("double", "1")}
_GAIT = {
    "gait": ("string", ""),
    "eta": ("double", "1"),
    "period": ("double", "s"),
    "roll": ("double", "rad"),
    "pitch": ("double", "rad"),
    "outcome": ("string", ""),
    "reason": ("string", ""),
    "valid": ("bool", ""),
    "flyable": ("bool", ""),
    "reachable_from_hover": ("bool", ""),
    "gait_singular_value": ("double", "1"),
    "gait_tilt_rate": ("double", "rad/s"),
}
FLIGHT = {
    "duration": "s",
    "settling_time": "s",
    "peak_tilt": "rad",
    "peak_thrust": "N",
    "peak_thrust_share": "1",
    "least_singular_value": "1",
    "saturated_fraction": "1",
    "energy": "J",
    "final_roll": "rad",
    "final_pitch": "rad",
    "drift": "m",
    "tracking_error": "m",
}
_KEY = b"gaitgraph"
_SCRATCH = ".gaitgraph-*.part"
_BEYOND = 1 << 40  # a byte that no manifest has: Windows lets nobody read a locked one


def columns_of(study: Study) -> dict[str, tuple[str, str]]:
    """Return the Arrow type and the unit of each column of a study's rows.

    A constant that varies in any of the vehicles has its column, empty for the others.
    """
    varied = {}
    for name in dict.fromkeys(name for model in study.models for name in model.varied if name != "drag_ratio"):
        unit = "rad" if name == "first_arm_angle" else UNITS.get(name, "").replace("²", "^2").replace("³", "^3")
        for column in columns_of_constant(name):
            varied[column] = ("string" if name == "first_rotor_spin" else "double", unit)
    return _HEAD | varied | _GAIT | {name: ("double", unit) for name, unit in FLIGHT.items()}


def columns_of_constant(name: str) -> tuple[str, ...]:
    """Return the columns of a constant that varies."""
    return ("inertia_x", "inertia_y", "inertia_z") if name == "inertia" else (name,)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """The folder of a study, open for one process."""

    folder: Path
    study: Study
    versions: Mapping[str, str]

    def path(self, batch: int) -> Path:
        """Return the file of a batch."""
        return self.folder / "rows" / f"part-{batch:05d}.parquet"

    def write(self, batch: int, rows: Sequence[Row]) -> None:
        """Write the rows of a batch, whole or not at all; FileProblem if the file system refuses."""
        import pyarrow as pa
        import pyarrow.parquet

        about = {
            "format": "gaitgraph study rows",
            "versions": dict(self.versions),
            "study": self.study.name,
            "fingerprint": self.study.fingerprint,
        }
        fields = [
            pa.field(name, pa.type_for_alias(kind), nullable=name != "case", metadata={"unit": unit} if unit else None)
            for name, (kind, unit) in columns_of(self.study).items()
        ]
        schema = pa.schema(fields, metadata={_KEY: json.dumps(about, allow_nan=False)})
        stream = io.BytesIO()
        pa.parquet.write_table(pa.Table.from_pylist(rows, schema=schema), stream, write_page_checksum=True)
        self.put(self.path(batch), stream.getvalue(), force=False)

    def put(self, path: Path, content: bytes, *, force: bool) -> None:
        """Write a file; a full disk says how to continue."""
        try:
            write_whole([(path, content)], force=force)
        except FileProblem as error:
            raise type(error)(f"{error}; {KEPT}") from error

    def missing(self) -> list[int]:
        """Return the batches that are not there, in order; InputError or FileProblem if a part is broken or foreign."""
        import pyarrow as pa
        import pyarrow.parquet

        paths = {self.path(batch).name: batch for batch in range(self.study.batches)}
        missing = set(paths.values())
        for path in sorted((self.folder / "rows").iterdir()):
            if path.name.startswith("."):  # of a file manager; readers of datasets pass it over too
                continue
            if path.name not in paths:
                raise OutputExists(f"{str(path)!r} is not part of this study; move it out of the folder rows")
            cure = "delete it, and the same command flies its cases again"
            batch = paths[path.name]
            try:
                table = pa.parquet.read_table(path, page_checksum_verification=True, partitioning=None)
                about = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
                cases = table["case"].to_pylist()
            except (pa.ArrowException, KeyError, MemoryError, OSError, OverflowError, TypeError, ValueError) as error:
                raise InputError(f"{str(path)!r} is not a whole Parquet file ({shown(str(error))}): {cure}") from error
            if about.get("fingerprint") != self.study.fingerprint or cases != list(self.study.numbers(batch)):
                raise OutputExists(f"{str(path)!r} does not hold these cases of this study: {cure}")
            missing.discard(batch)
        return sorted(missing)

    def table(self) -> Any:
        """Return all rows, a pyarrow table in the order of the cases; FileProblem if a part is gone."""
        import pyarrow.dataset

        paths = [self.path(batch) for batch in range(self.study.batches)]
        try:
            return pyarrow.dataset.dataset(paths, format="parquet").to_table()
        except OSError as error:
            raise FileProblem(f"a part was removed while the study ran ({error}); {KEPT}") from error


@contextmanager
def opened_dataset(folder: Path, study: Study, here: Mapping[str, str]) -> Iterator[Dataset]:
    """Open a folder, new or of this very study, for this process alone; `here` are the versions that make its rows.

    OutputExists if it is something else, or another process writes there; FileProblem if the file system refuses.
    """
    about: dict[str, Any] = {
        "format": "gaitgraph study",
        "versions": dict(here),
        "fingerprint": study.fingerprint,
        "cases": len(study),
        "batch": study.batch,
        "study": study.as_mapping(),
    }
    text = json.dumps(about, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    manifest, rows = folder / MANIFEST, folder / "rows"
    try:
        if manifest.exists():
            found = json.loads(text_of(manifest, "study", "a study's manifest"))
            found = found if isinstance(found, dict) else {}
            differing = [name for name, value in json.loads(text).items() if found.get(name) != value]
            if differing:
                raise OutputExists(
                    f"output must be a new folder or one of this study, got {str(folder)!r}, whose study.json has "
                    f"another {', '.join(differing)}"
                )
        else:
            if folder.exists() and any(not path.match(_SCRATCH) for path in folder.iterdir()):
                raise OutputExists(f"output must be a new folder or one of this study, got {str(folder)!r} with files")
            folder.mkdir(exist_ok=True)
            write_whole([(manifest, text.encode())], force=False)
        stream = manifest.open("r+b")
    except (OSError, ValueError) as error:  # a name with a null character is a ValueError
        if isinstance(error, GaitgraphError):
            raise
        raise FileProblem(f"output must be a new folder, got {shown(str(folder))}: {error}") from error
    with stream:
        try:  # the operating system drops the lock when the process ends
            if sys.platform == "win32":
                import msvcrt

                stream.seek(_BEYOND)
                msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError) as error:  # the latter on Windows
            raise OutputExists(f"another process writes to {str(folder)!r}; run one at a time") from error
        rows.mkdir(exist_ok=True)
        for scratch in [*folder.glob(_SCRATCH), *rows.glob(_SCRATCH)]:  # of a process that was killed while it wrote
            shutil.rmtree(scratch, ignore_errors=True)
        yield Dataset(folder=folder, study=study, versions=here)


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


def _pictures(rows: dict[str, npt.NDArray[Any]], settled: Mask, flown: Mask) -> list[str]:
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
