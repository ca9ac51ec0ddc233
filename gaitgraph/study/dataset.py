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
import math
import re
import shutil
import sys
from base64 import b64encode
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import FileProblem, GaitgraphError, OutputExists, shown
from gaitgraph.files import text_of, write_whole
from gaitgraph.plots.axes import blank_figure, paper_style, picture_bytes
from gaitgraph.vehicle import UNITS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from gaitgraph.study.design import Study

    Row = dict[str, Any]

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
    manifest, rows = folder / "study.json", folder / "rows"
    wanted = f"output must be a new folder or one of this study, got {str(folder)!r}"
    try:
        if not manifest.exists():
            if folder.exists() and any(not path.match(_SCRATCH) for path in folder.iterdir()):
                raise OutputExists(f"{wanted} with files")
            folder.mkdir(exist_ok=True)
            text = json.dumps(about, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
            write_whole([(manifest, text.encode())], force=False)
        found = dict(json.loads(text_of(manifest, "study", "a study's manifest")))
        if differing := [name for name, value in about.items() if found.get(name) != value]:
            raise OutputExists(f"{wanted}, whose study.json has another {', '.join(differing)}")
        stream = manifest.open("r+b")
    except (OSError, TypeError, ValueError) as error:  # a name with a null character is a ValueError
        if isinstance(error, GaitgraphError):
            raise
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
_MOST_LINES = 20  # of a table; drawn quantities have more values, which the rows themselves hold
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{name}</title></head>
<body style="font: 15px/1.45 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto">
<h1>{name}</h1>
{body}
</body>
</html>
"""


def page_of(study: Study, table: Any) -> str:
    """Return the page of a study whose rows are all there; the same rows give the same page."""
    columns = columns_of(study)
    quantities = list(columns)[1 : list(columns).index("roll")]
    rows = {name: table[name].to_pylist() for name in (*quantities, "roll", "pitch", "outcome")}
    how = "every combination" if study.count is None else f"a random sample, seed {study.seed}"
    body = [f"<p>{len(study)} cases, {how}; study {study.fingerprint[:12]}</p>"]
    # A line for each value that a quantity takes, and one for all cases.
    lines = [("all cases", rows["outcome"])]
    for name in quantities:
        levels = [value for value in dict.fromkeys(rows[name]) if value is not None]
        unit = f" {columns[name]}" * (columns[name] not in ("string", "1"))
        for value in levels if 1 < len(levels) <= _MOST_LINES else ():
            text = value if isinstance(value, str) else f"{name.replace('_', ' ')} {value:.6g}{unit}"
            lines.append((text, [out for out, one in zip(rows["outcome"], rows[name], strict=True) if one == value]))
    counts = [[text, str(len(found)), *(str(found.count(name)) for name in OUTCOMES)] for text, found in lines]
    body.append(_html_table(["", "cases", *OUTCOMES], counts))
    if reasons := reasons_of(table):
        of_each = [[str(count), outcome, reason] for outcome, reason, count in reasons]
        body.append(_html_table(["cases", "outcome", "reason, as in the first"], of_each))
    if {"settled", "not settled"} & set(rows["outcome"]):
        body.append(_picture(rows))
    return _PAGE.format(name=escape(study.name), body="\n".join(body))


def _html_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = [f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in line)}</tr>" for line in (head, *lines)]
    return f'<table cellpadding="4">{"".join(rows)}</table>'


def _picture(rows: Mapping[str, Sequence[Any]]) -> str:
    """Return the picture of the page: from which attitudes flights settle, by gait and bias."""
    # Of each panel, of each attitude: whether its flights settled.
    panels: dict[str, dict[tuple[float, float], list[bool]]] = {}
    for gait, eta, *at, outcome in zip(
        *(rows[name] for name in ("gait", "eta", "roll", "pitch", "outcome")), strict=True
    ):
        if outcome in ("settled", "not settled"):
            places = panels.setdefault(f"{gait}, η = {eta:.3g}", {})
            places.setdefault((math.degrees(at[0]), math.degrees(at[1])), []).append(outcome == "settled")
    with paper_style():
        height = -(-min(len(panels), _MOST_PANELS) // 4)
        figure = blank_figure(170.0, 20.0 + 46.0 * height)
        axes = figure.subplots(height, 4, squeeze=False, sharex=True, sharey=True)
        for ax, (title, places) in zip(axes.flat, panels.items(), strict=False):
            part = [sum(flights) / len(flights) for flights in places.values()]
            dots = ax.scatter(*zip(*places, strict=True), s=9, c=part, cmap="viridis", vmin=0, vmax=1)
            ax.set_title(title, parse_math=False)
        for ax in axes.flat[len(panels) :]:
            ax.set_axis_off()
        figure.supxlabel("initial roll (°)")
        figure.supylabel("initial pitch (°)")
        figure.colorbar(dots, ax=axes, label="part of the flights that settled")
        more = f"; the first {_MOST_PANELS} of {len(panels)}" * (len(panels) > _MOST_PANELS)
        content = b64encode(picture_bytes(figure, "png")).decode()
    return f'<p>From which attitudes flights settle{more}.</p><img alt="" src="data:image/png;base64,{content}">'
