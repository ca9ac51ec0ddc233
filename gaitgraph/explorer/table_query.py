"""The queries with files: check a table of the user, and download the planned gait. No path of the user is used."""

from __future__ import annotations

from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from shutil import make_archive
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.certificates.making import certify
from gaitgraph.certificates.verifying import CERTIFICATE
from gaitgraph.errors import (
    FileProblem,
    InputError,
    check_fields,
    checked_choice,
    needs_extra,
    reworded,
    wrong,
)
from gaitgraph.explorer.queries import (
    CURVES,
    diagram_of,
    in_words,
    planned,
    quiet,
    series_answer,
    to_digits,
    vehicle_view_answer,
)
from gaitgraph.explorer.state import fields_of, state_of, state_of_request
from gaitgraph.gait.given import given_gait
from gaitgraph.io.formats import FORMATS, read_format, read_table, write_tables
from gaitgraph.plots.films import write_films
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.validation.report import verdict_of
from gaitgraph.validation.validating import validate

if TYPE_CHECKING:
    from gaitgraph.explorer.queries import Progress
    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.validation.report import Report

_MOST_ROWS = 2000
_PLACES = 400  # along the legs of a table without times
_MOST_CORNERS = 5000  # whose attitudes are judged
_FILM = ".gif"


def formats_answer() -> list[dict[str, Any]]:
    """Return the formats of a download, and for each that is not available the reason."""
    reasons = {(one.suffix, one.name): one.why_not() for one in FORMATS.values()}
    reasons[_FILM, "animated GIF"] = None
    if find_spec("matplotlib") is None:
        reason = str(needs_extra("matplotlib", "a film", "plot"))
        reasons[_FILM, "animated GIF"] = reason
    reasons[CERTIFICATE, "certificate"] = None
    return [
        {"suffix": suffix, "name": name, "why_not": why_not}
        for (suffix, name), why_not in reasons.items()
    ]


def table_answer(
    name: str, content: bytes, progress: Progress = quiet
) -> dict[str, Any]:
    """Return the report of a gait file's bytes, and its rows; InputError or FileProblem if it is no table.

    The suffix of the name selects the format; the name appears only in messages.
    """
    name = name.replace("\\", "/").rpartition("/")[2]
    progress("reading")
    table, report = _judged_table(name, content)
    rows, times = given_gait(table).rows
    gait = rows.merged() if table.motion is None else table.motion.gait
    # The polyline of a path leads out and back, and only the way out is shown.
    legs = len(rows.alpha)
    if not table.repeats:
        legs = max(legs // 2, 1)
    samples = len(table) - 1 if "t" in table else None
    return {
        "name": name,
        "rows": report.rows,
        "warnings": list(report.warnings),
        **verdict_of(report),
        **in_words(report),
        "series": _series_of_rows(rows, times, legs, report),
        "vehicle": rows.vehicle.name,
        "map": fields_of(rows.vehicle) | {"coefficients": rows.coefficients.kind},
        "vehicle_view": vehicle_view_answer(rows.vehicle),
        "color": gait.color,
        "surface": gait.color,
        "corners": to_digits(gait.alpha[:_MOST_ROWS]),
        "types": list(gait.types[:_MOST_ROWS]),
        "colors": list(gait.colors[:_MOST_ROWS]),
        "diagram": _diagram_of_table(gait, progress),
        "request": state_of_request(table.about.get("request"), samples),
    }


def _judged_table(name: str, content: bytes) -> tuple[Table, Report]:
    """Return the table that the bytes of a file hold, and its report."""
    form = read_format(name, "table")
    if form.folder:
        raise wrong(
            "table", "must be a single file", name, f": a {form.name} is a folder"
        )
    try:
        table = read_table(BytesIO(content), format=form.suffix)
        return table, validate(table)
    except (InputError, FileProblem) as error:
        message = error.message.replace(f"'stream{form.suffix}'", repr(name))
        raise reworded(error, message) from error


def _series_of_rows(
    rows: Gait, times: FloatArray | None, legs: int, report: Report
) -> dict[str, Any]:
    """Return the series of the legs of a table: over its times, or without times over places on its straight legs."""
    corners = len(rows.alpha)
    parts = 1
    if times is None:
        parts = max(1, _PLACES // corners)
    last = legs * parts
    places = np.linspace(0, last, min(last + 1, _MOST_ROWS)).round().astype(int)
    leg = places // parts % corners
    share = places % parts / parts
    alpha = rows.alpha[leg] + share[:, None] * (rows.ends - rows.alpha)[leg]
    series = series_answer(alpha, rows, report)
    series["rows"] = to_digits(1 + places / parts)
    if times is not None:
        series["t"] = to_digits(times[places], 9)
    return series


def _diagram_of_table(gait: Gait, progress: Progress) -> dict[str, Any]:
    """Return the roll–pitch diagram of a table's gait, or the reason why there is none."""
    corners = len(gait.alpha)
    if corners > _MOST_CORNERS:
        limit = f"At most {_MOST_CORNERS} corners are drawn here, got {corners}"
        reason = f"{limit}. For longer tables: gaitgraph robustness FILE"
        return {"own": None, "reason": reason}
    robustness = robustness_of(gait, curves=CURVES, progress=progress)
    return {"own": diagram_of(robustness.gait), "reason": None}


def file_answer(query: Any, progress: Progress = quiet) -> tuple[str, bytes]:
    """Return the planned gait of a ``state`` as a file of a ``suffix``, or its certificate: name and bytes.

    A folder is a zip file.
    """
    check_fields("request", query, ("state", "suffix"))
    state = state_of(query.get("state", {}))
    suffixes = (*FORMATS, _FILM, CERTIFICATE)
    suffix = checked_choice("suffix", query.get("suffix", ".csv"), suffixes)
    if not state.request.waypoints:
        raise InputError(
            "waypoints must have at least one entry, got 0", field="waypoints"
        )
    result = planned(state, progress)
    if result.loop is None:
        raise InputError(f"there is no gait to write: {result.reason}")
    progress(f"writing {suffix}")
    timed = result.timed(samples=state.samples)
    if suffix == CERTIFICATE:
        return f"gait{CERTIFICATE}", certify(timed).text.encode()
    table = table_of(timed, {"request": state.request.as_mapping()})
    with TemporaryDirectory(prefix="gaitgraph-") as folder:
        path = Path(folder) / f"gait{suffix}"
        if suffix == _FILM:
            write_films(table, [path])
        else:
            write_tables(table, [path])
        if path.is_dir():
            path = Path(make_archive(str(path), "zip", folder, path.name))
        return path.name, path.read_bytes()
