"""The dataset of a study: the columns of its rows, the folder that keeps them, and the page that sums them up.

::

    study.json                 what the study is, resolved; its fingerprint; the versions that rows are made with
    rows/part-00000.parquet    cases 0 to B − 1, in order; written whole or not at all
    rows/part-00001.parquet    the next B, and so on; B follows from the number of cases
    summary.html               once all are there: counts, tables, a picture; no script, and nothing to load

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
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import FileProblem, GaitgraphError, OutputExists, shown
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

FLIGHT = {
    "duration": "s", "settling_time": "s", "peak_tilt": "rad", "peak_thrust": "N", "peak_thrust_share": "1",
    "least_singular_value": "1", "saturated_fraction": "1", "energy": "J", "final_roll": "rad", "final_pitch": "rad",
    "drift": "m", "tracking_error": "m",
}  # fmt: skip
"""The columns of a flight, and their units."""

_GAIT = {
    "gait": "string", "eta": "1", "period": "s", "roll": "rad", "pitch": "rad", "outcome": "string",
    "reason": "string", "valid": "bool", "flyable": "bool", "reachable_from_hover": "bool",
    "gait_singular_value": "1", "gait_tilt_rate": "rad/s",
}  # fmt: skip
_MANIFEST = "study.json"
_KEY = b"gaitgraph"
_SCRATCH = ".gaitgraph-*.part"
_BEYOND = 1 << 40  # a byte that no manifest has: Windows lets nobody read a locked one


def columns_of(study: Study) -> dict[str, str]:
    """Return the unit of each column of a study's rows, or its Arrow type (int64, string, bool) where it has none.

    A constant that varies in any of the vehicles has its column, empty for the others.
    """
    varied: dict[str, str] = {}
    for name in dict.fromkeys(name for model in study.models for name in model.varied if name != "drag_ratio"):
        unit = {"first_arm_angle": "rad", "first_rotor_spin": "string"}.get(name) or UNITS[name]
        varied |= dict.fromkeys(columns_of_constant(name), unit.replace("²", "^2").replace("³", "^3"))
    return {"case": "int64", "vehicle": "string", "drag_ratio": "1"} | varied | _GAIT | FLIGHT


def columns_of_constant(name: str) -> tuple[str, ...]:
    """Return the columns of a constant that varies."""
    return ("inertia_x", "inertia_y", "inertia_z") if name == "inertia" else (name,)


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """The folder of a study, open for one process."""

    folder: Path
    study: Study
    versions: Mapping[str, str]

    def _paths(self) -> list[Path]:
        return [self.folder / "rows" / f"part-{batch:05d}.parquet" for batch in range(len(self.study.batches))]

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
        fields = []
        for name, unit in columns_of(self.study).items():
            is_type = unit in ("int64", "string", "bool")
            kind = pa.type_for_alias(unit if is_type else "double")
            fields.append(pa.field(name, kind, name != "case", None if is_type else {"unit": unit}))
        schema = pa.schema(fields, metadata={_KEY: json.dumps(about, allow_nan=False)})
        stream = io.BytesIO()
        pa.parquet.write_table(pa.Table.from_pylist(rows, schema=schema), stream, write_page_checksum=True)
        write_whole([(self._paths()[batch], stream.getvalue())], force=False)

    def missing(self) -> list[int]:
        """Return the batches that are not there, in order; OutputExists if a file in the folder is none of them."""
        import pyarrow as pa
        import pyarrow.parquet

        paths = self._paths()
        missing = dict(zip(paths, self.study.batches, strict=True))
        for path in sorted((self.folder / "rows").iterdir()):
            if path.name.startswith("."):  # of a file manager; readers of datasets pass it over too
                continue
            try:
                table = pa.parquet.read_table(path, page_checksum_verification=True, partitioning=None)
                about = json.loads(table.schema.metadata[_KEY])
                reason = "" if about["fingerprint"] == self.study.fingerprint else "it is of another study"
                reason = reason if table["case"].to_pylist() == list(missing.pop(path)) else "it has other cases"
            except (pa.ArrowException, KeyError, MemoryError, OSError, OverflowError, TypeError, ValueError) as error:
                reason = shown(f"{type(error).__name__}: {error}")
            if reason:
                raise OutputExists(
                    f"{str(path)!r} is not a whole part of this study ({reason}): move or delete it, and the same "
                    "command flies what is missing"
                )
        return [paths.index(path) for path in missing]

    def table(self) -> Any:
        """Return all rows, a pyarrow table in the order of the cases; FileProblem if a part is gone."""
        import pyarrow.dataset

        try:
            return pyarrow.dataset.dataset(self._paths(), format="parquet").to_table()
        except OSError as error:
            raise FileProblem(f"a part was removed while the study ran; run it again ({error})") from error


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
    manifest, rows = folder / _MANIFEST, folder / "rows"
    wanted = f"output must be a new folder or one of this study, got {str(folder)!r}"
    try:
        if manifest.exists():
            found = json.loads(text_of(manifest, "study", "a study's manifest"))
            differing = [name for name, value in about.items() if dict(found).get(name) != value]
            if differing:
                raise OutputExists(f"{wanted}, whose study.json has another {', '.join(differing)}")
        else:
            if folder.exists() and any(not path.match(_SCRATCH) for path in folder.iterdir()):
                raise OutputExists(f"{wanted} with files")
            folder.mkdir(exist_ok=True)
            write_whole([(manifest, text.encode())], force=False)
        stream = manifest.open("r+b")
    except GaitgraphError:
        raise
    except (OSError, TypeError, ValueError) as error:  # a name with a null character is a ValueError
        raise FileProblem(f"{wanted}: {error}") from error
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
    found: dict[tuple[str, str], list[str]] = {}
    for outcome, reason in zip(table["outcome"].to_pylist(), table["reason"].to_pylist(), strict=True):
        if outcome != "settled":
            key = outcome, re.sub(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", "#", reason)
            found.setdefault(key, []).append(reason)
    order = sorted(found.items(), key=lambda item: -len(item[1]))  # ties stay in the order of the cases
    return tuple((outcome, reasons[0], len(reasons)) for (outcome, _), reasons in order)


# ---------------------------------------------------------------- the page

_MOST_PANELS = 24
_MOST_LEVELS = 20
_TITLES = {"eta": "bias η", "period": "period (s)"}
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
    units = columns_of(study)
    names = list(units)
    constants = names[names.index("vehicle") + 1 : names.index("gait")]
    for name in ("vehicle", "gait", "eta", "period", *constants):
        levels = _levels_of(rows[name])
        if name in constants and len(levels) < 2:
            continue
        unit = units[name]
        title = _TITLES.get(name) or name.replace("_", " ") + f" ({unit})" * (unit not in ("string", "1"))
        lines = []
        for level, mask in levels:
            counts = (str(int(one.sum())) for one in (mask, mask & flown, mask & settled))
            lines.append([level, *counts, f"{100 * settled[mask].mean():.1f} %"])
        body.append(_html_table([title, "cases", "flown", "settled", "of cases"], lines))
    reasons = reasons_of(table)
    if reasons:
        lines = [[str(count), outcome, reason] for outcome, reason, count in reasons]
        body += ["<h2>Why others did not</h2>", _html_table(["cases", "outcome", "reason, as in the first"], lines)]
    if flown.any():
        body.append(_picture(rows, settled, flown))
    return _PAGE.format(name=escape(study.name), body="\n".join(body))


def _html_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = ["".join(f"<td>{escape(cell)}</td>" for cell in line) for line in lines]
    cells = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    return f"<table><tr>{cells}</tr>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def _levels_of(values: npt.NDArray[Any]) -> list[tuple[str, Mask]]:
    """Return the values of a column, or six ranges of them where they are many, each with the rows that have it."""
    if values.dtype == object:  # texts, in the order of the cases
        return [(str(one), values == one) for one in dict.fromkeys(values.tolist()) if one is not None]
    known = np.unique(values[np.isfinite(values)])
    if len(known) <= _MOST_LEVELS:
        return [(f"{value:.6g}", values == value) for value in known]
    edges = np.linspace(known[0], np.nextafter(known[-1], np.inf), 7)
    return [(f"{low:.3g} to {high:.3g}", (low <= values) & (values < high)) for low, high in pairwise(edges)]


def _picture(rows: dict[str, npt.NDArray[Any]], settled: Mask, flown: Mask) -> str:
    """Return the picture of the page: from which attitudes flights settle, by gait and bias."""
    groups = [
        (f"{gait}, η = {eta}", of_gait & of_eta)
        for gait, of_gait in _levels_of(rows["gait"])
        for eta, of_eta in _levels_of(rows["eta"])
        if (flown & of_gait & of_eta).any()
    ]
    panels = groups[:_MOST_PANELS]
    with paper_style():
        figure = blank_figure(170.0, 20.0 + 46.0 * -(-len(panels) // 4))
        axes = figure.subplots(-(-len(panels) // 4), 4, squeeze=False, sharex=True, sharey=True)
        for ax in axes.flat[len(panels) :]:
            ax.set_axis_off()
        for ax, (title, mask) in zip(axes.flat, panels, strict=False):
            # Cases of one attitude are one dot: the part of their flights that settled.
            at = np.rad2deg(np.column_stack([rows["roll"], rows["pitch"]])[mask])
            places, place = np.unique(at, axis=0, return_inverse=True)
            flights = np.bincount(place.ravel(), flown[mask], len(places))
            part = np.bincount(place.ravel(), settled[mask], len(places)) / np.maximum(flights, 1)
            ax.scatter(*places[flights == 0].T, s=9, color="#8a8a8a")
            dots = ax.scatter(*places[flights > 0].T, s=9, c=part[flights > 0], cmap="viridis", vmin=0, vmax=1)
            ax.set_title(title, parse_math=False)
        figure.supxlabel("initial roll (°)")
        figure.supylabel("initial pitch (°)")
        figure.colorbar(dots, ax=axes, label="part of the flights that settled")
        more = f" The first {_MOST_PANELS} of {len(groups)}." * (len(groups) > _MOST_PANELS)
        title = "From which attitudes flights settle; grey where none flew." + more
        content = b64encode(picture_bytes(figure, "png")).decode()
    return f'<h2>{title}</h2><img alt="{title}" src="data:image/png;base64,{content}">'
