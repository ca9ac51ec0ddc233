"""The queries with files: check a table of the user, and download the planned gait. No path of the user is used."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path
from shutil import make_archive
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from gaitgraph.angles import number_of
from gaitgraph.certificates.making import certify
from gaitgraph.certificates.verifying import CERTIFICATE
from gaitgraph.errors import (
    FileProblem,
    GaitgraphError,
    InputError,
    checked_choice,
    needs_extra,
    reworded,
    shown,
)
from gaitgraph.explorer import queries
from gaitgraph.files import naming_file
from gaitgraph.gait.given import given_gait
from gaitgraph.io.formats import FORMATS, read_format, unchecked_table, write_tables
from gaitgraph.plots.vehicles import write_films
from gaitgraph.robustness.biased import robustness_of
from gaitgraph.timing.statement import checked
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import preset_names, vehicle_from_mapping

if TYPE_CHECKING:
    from gaitgraph.explorer.queries import Progress
    from gaitgraph.gait.table import Table
    from gaitgraph.vehicle import Vehicle

_MOST_ROWS = 2000
_PLACES = 400  # along the legs of a table without times
_MOST_CORNERS = 5000  # whose attitudes are judged
_FILM = ".gif"
_NOT_SHOWN = {"floor": DEFAULT_FLOOR}  # request fields without a control on the page


def formats_answer() -> list[dict[str, Any]]:
    """Return the formats of a download, and for each that is not available the reason."""
    missing = next(
        (module for module in ("matplotlib", "PIL") if find_spec(module) is None), None
    )
    why_no_film = (
        None if missing is None else str(needs_extra(missing, "a film", "plot"))
    )
    listed = [
        (one.suffix, one.name, one.why_not(), one.reads and not one.folder)
        for one in FORMATS.values()
    ]
    others = (
        (_FILM, "animated GIF", why_no_film, False),
        (CERTIFICATE, "certificate", None, False),
    )
    return [
        {
            "suffix": suffix,
            "name": name,
            "available": why_not is None,
            "why_not": why_not,
            "reads": reads,
        }
        for suffix, name, why_not, reads in (*listed, *others)
    ]


def table_answer(
    name: str, content: bytes, progress: Progress = queries.quiet
) -> dict[str, Any]:
    """Return the report of a gait file's bytes, and its rows; InputError or FileProblem if it is no table.

    The suffix of the name selects the format; the name appears only in messages.
    """
    last = "".join(
        letter for letter in re.split(r"[\\/]", name)[-1] if letter.isprintable()
    )
    if not last:
        raise InputError(f"name must be a file name with a suffix, got {shown(name)}")
    name = last if len(last) <= 100 else last[:60] + "…" + last[-30:]
    form = read_format(name, "table")
    if form.folder:
        raise InputError(
            f"table must be a single file, got {name!r}: a {form.name} is a folder"
        )
    with TemporaryDirectory(prefix="gaitgraph-") as folder:
        path = Path(folder) / f"table{form.suffix}"
        path.write_bytes(content)
        try:
            progress("reading")
            table = unchecked_table(path)
            _check_rows(table)
            table = checked(table, path)
            with naming_file(path):
                report = validate(table)
            rows, times = given_gait(table).rows
            progress(1.0)
        except (InputError, FileProblem) as error:
            raise reworded(
                error, error.message.replace(repr(str(path)), repr(name))
            ) from error
    # Without times the motion between rows is straight: values there are those of places on the legs.
    # The polyline of a path leads out and back, and only the way out is shown.
    corners = len(rows.alpha)
    count = corners if table.repeats else max(corners // 2, 1)
    parts = 1 if times is not None else max(1, _PLACES // corners)
    some = queries.spread_rows(count * parts + 1, _MOST_ROWS)
    legs, t = some // parts % corners, None if times is None else times[some]
    alpha = (
        rows.alpha[legs]
        + (some % parts / parts)[:, None] * (rows.ends - rows.alpha)[legs]
    )
    gait = rows.merged() if table.motion is None else table.motion.gait
    map_of = _preset_of(rows.vehicle)
    diagram: dict[str, Any] = {"own": None, "reason": None}
    if len(gait.alpha) > _MOST_CORNERS:
        limit = f"At most {_MOST_CORNERS} corners are drawn here, got {len(gait.alpha)}"
        diagram["reason"] = f"{limit}. For longer tables: gaitgraph robustness FILE"
    else:
        diagram["own"] = queries.diagram_of(
            robustness_of(gait, curves=queries.CURVES, progress=progress).gait
        )
    return {
        "name": name,
        "rows": report.rows,
        **queries.verdict_answer(report),
        "warnings": list(report.warnings),
        "path": queries.to_digits(
            rows.alpha[queries.spread_rows(count + 1, _MOST_ROWS) % corners, :2]
        ),
        "series": queries.series_answer(alpha, rows, report, t=t)
        | {"rows": queries.to_digits(1 + some / parts)},
        "vehicle": rows.vehicle.name,
        "map": map_of and map_of | {"coefficients": rows.coefficients.kind},
        "vehicle_view": queries.vehicle_view_answer(rows.vehicle),
        "color": gait.color,
        "corners": queries.to_digits(gait.alpha[:_MOST_ROWS]),
        "types": list(gait.types[:_MOST_ROWS]),
        "colors": list(gait.colors[:_MOST_ROWS]),
        "diagram": diagram,
        "request": _state_of_request(table),
    }


def _check_rows(table: Table) -> None:
    """Raise InputError if a table has more rows than are judged here."""
    most = queries.LIMITS["rows"]
    if len(table) > most:
        raise InputError(
            f"a table must have at most {most} rows here, got {len(table)}; 'gaitgraph validate' has no limit"
        )


def _preset_of(vehicle: Vehicle) -> dict[str, Any] | None:
    """Return the fields of a state that stand for a vehicle: a preset, with another drag ratio; None if none do."""
    ratios = (
        None,
        *filter(queries.RANGES["drag_ratio"].contains, [vehicle.drag_ratio]),
    )
    pairs = ((name, ratio) for name in preset_names() for ratio in ratios)
    found = next((pair for pair in pairs if queries.vehicle_of(*pair) == vehicle), None)
    return found and {"vehicle": found[0], "drag_ratio": found[1]}


def _state_of_request(table: Table) -> dict[str, Any] | None:
    """Return the request of a file as a state, or None if the file has none, or the page cannot show it."""
    request = table.about.get("request")
    if not isinstance(request, dict):
        return None
    if any(
        _NOT_SHOWN.get(name, ...) != value
        for name, value in request.items()
        if name not in queries.DEFAULTS
    ):
        return None
    state = {name: value for name, value in request.items() if name in queries.DEFAULTS}
    if "t" in table and 2 <= len(table) <= queries.RANGES["samples"].high + 1:
        state["samples"] = len(table) - 1
    if state.get("method") == "exact":
        state.pop("divisions", None)  # not used, and may be out of range here
    if number_of(state.get("accuracy")) < queries.RANGES["accuracy"].low:
        state["accuracy"] = queries.RANGES[
            "accuracy"
        ].low  # finer would be too slow for the page
    stated = request.get("vehicle", queries.DEFAULTS["vehicle"])
    try:
        vehicle = (
            vehicle_from_mapping(stated)
            if isinstance(stated, dict)
            else queries.vehicle_of(stated)
        )
        found = _preset_of(vehicle)
        queries.state_of(state := state | (found or {}))
    except GaitgraphError:
        return None
    return (
        state if found else None
    )  # only presets, with another drag ratio, have a control


def file_answer(
    state: queries.State, suffix: object, progress: Progress = queries.quiet
) -> tuple[str, bytes]:
    """Return the planned gait of a state as a file, or its certificate: name and bytes; a folder as a zip file."""
    suffix = checked_choice("suffix", suffix, (*FORMATS, _FILM, CERTIFICATE))
    if state.empty:
        raise InputError(
            "waypoints must have at least one entry, got 0", field="waypoints"
        )
    result = queries.planned(state, progress)
    if result.loop is None:
        raise InputError(f"there is no gait to write: {result.reason}")
    progress(f"writing {suffix}")
    timed = result.timed(samples=state.samples)
    if suffix == CERTIFICATE:
        return f"gait{CERTIFICATE}", certify(timed).text.encode()
    table = table_of(timed, {"request": state.request.as_mapping()})
    with TemporaryDirectory(prefix="gaitgraph-") as folder:
        path = Path(folder) / f"gait{suffix}"
        (write_films if suffix == _FILM else write_tables)(table, [path])
        if path.is_dir():
            path = Path(make_archive(str(path), "zip", folder, path.name))
        return path.name, path.read_bytes()
