"""From tables to gaits and back: closing, lifting, completing, and exporting files."""

from __future__ import annotations

import math
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.coloring import types_from_text
from gaitgraph.errors import GaitgraphError, InputError
from gaitgraph.fibers import families_along, family_codes, family_of, family_types, types_contradict
from gaitgraph.formats import FORMATS
from gaitgraph.gait import Gait, lift
from gaitgraph.invertibility import Coefficients, Kind, coefficients_of, level_determinant, level_determinant_resolution
from gaitgraph.paintings import Colorings, colorings
from gaitgraph.reading import provenance_in, read_pieces, read_table
from gaitgraph.reports import DEFAULT_TOLERANCE
from gaitgraph.requests import holds_request, planes_only, read_request, request_from_mapping, request_in_about
from gaitgraph.stretches import Stretch
from gaitgraph.surface import text_from_types
from gaitgraph.tables import (
    ACCELERATIONS,
    ANGLES,
    CLOSED_GAP,
    ORDER,
    RATES,
    Table,
    merged,
    setting_of,
    table_of,
)
from gaitgraph.timing import LAWS, parametrize
from gaitgraph.writing import check_outputs, write_tables

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from gaitgraph.requests import PlanRequest
    from gaitgraph.vehicle import Vehicle

__all__ = ["closed_rows", "colorings_of_file", "export", "gait_of", "read_gait", "request_of_file"]

FloatArray = npt.NDArray[np.float64]


def gait_of(table: Table, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Gait:
    """Return the closed polyline through a table's rows, straight runs merged.

    A last row that equals the first is the closing row. Rows of alpha1, alpha2 and color alone are lifted; where
    there is no color, rows get that of the sheet they lie on, if each lies on one to within 2e-3 rad.

    Parameters
    ----------
    table
        The rows.
    vehicle, coefficients
        What the gait is for; by default what the table says, else the paper's vehicle.
    """
    vehicle, numbers, tolerance = setting_of(table, vehicle, coefficients)
    alpha = _alpha_of(table, vehicle, numbers)
    colors = table["color"] if "color" in table else _sheet_of(alpha, numbers)
    if len(alpha) > 1 and np.abs(alpha[-1] - alpha[0]).max() <= CLOSED_GAP:
        alpha, colors = alpha[:-1], colors[:-1]
    gait = Gait(alpha=alpha, colors=colors, vehicle=vehicle, coefficients=numbers, crossing_tolerance=tolerance)
    return gait.merged()


def _alpha_of(table: Table, vehicle: Vehicle, coefficients: Coefficients) -> FloatArray:
    """Return the four tilt angles of each row, lifted where the table has (α1, α2) and colors alone."""
    if "alpha3" in table:
        return table.alpha
    plane = np.column_stack([table["alpha1"], table["alpha2"]])
    return lift(plane, table["color"], vehicle=vehicle, coefficients=coefficients).alpha


def closed_rows(
    table: Table, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None, source: object = None
) -> tuple[Stretch, Vehicle, Coefficients]:
    """Return a table's rows as one closed stretch, and what it is for.

    Rows of alpha1, alpha2 and color alone are lifted. A last row that equals the first closes the table; else the way
    back takes one mean step of time.

    Parameters
    ----------
    table, vehicle, coefficients
        As for :func:`gait_of`.
    source
        The file that it was read from, if any; messages name it.
    """
    with _of_file(source) if isinstance(source, (str, Path)) else nullcontext():
        vehicle, numbers, _ = setting_of(table, vehicle, coefficients)
        alpha = _alpha_of(table, vehicle, numbers)
    t = table.columns.get("t")
    if len(alpha) > 1 and np.abs(alpha[-1] - alpha[0]).max() <= CLOSED_GAP:
        alpha = np.vstack([alpha[:-1], alpha[:1]])
    else:
        alpha = np.vstack([alpha, alpha[:1]])
        t = None if t is None else np.append(t, t[-1] + (t[-1] - t[0]) / max(len(t) - 1, 1))
    sheet = np.zeros(len(alpha), dtype=np.int8)
    after_t = None if t is None else float(t[0])
    return Stretch(alpha=alpha, sheet=sheet, after=0, t=t, after_t=after_t), vehicle, numbers


@contextmanager
def _of_file(path: str | Path) -> Iterator[None]:
    """Name the file in an error about what a table says."""
    try:
        yield
    except GaitgraphError as error:
        raise type(error)(f"gait file {str(path)!r}: {error}") from error


def read_gait(path: str | Path, *, vehicle: Vehicle | None = None, coefficients: Kind | None = None) -> Gait:
    """Return the gait in a file: the closed polyline through its rows; parameters and errors as for :func:`gait_of`."""
    table = read_table(path)
    with _of_file(path):
        return gait_of(table, vehicle=vehicle, coefficients=coefficients)


def request_of_file(path: str | Path, overrides: dict[str, Any]) -> tuple[PlanRequest, dict[str, Any]]:
    """Return the request in a request file, or the one that made a plan or a gait file of any format, and its sampling.

    Parameters
    ----------
    path
        The file.
    overrides
        What replaces fields of the request, by their names.

    Raises
    ------
    InputError, FileProblem
        If the file cannot be read, or tells no request.
    """
    if Path(path).suffix.lower() in (".toml", ".json"):
        return read_request(path, overrides)
    if Path(path).suffix.lower() not in FORMATS:
        allowed = ", ".join([".toml", *FORMATS])
        raise InputError(f"request file: {str(path)!r}; allowed are the suffixes {allowed}")
    about = provenance_in(path)
    with _of_file(path):
        content = request_in_about(about)
        if {"samples", "rate"} & set(overrides):
            content = {name: value for name, value in content.items() if name not in ("samples", "rate")}
        return request_from_mapping({**content, **overrides})


def colorings_of_file(
    path: str | Path,
    *,
    sign: str | None = None,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    crossing_tolerance: float | None = None,
) -> Colorings:
    """Return every colouring of the loop in a gait file, a table of alpha1 and alpha2, or a request's waypoints.

    A last row that equals the first is the closing row.

    Parameters
    ----------
    path
        A .csv or .json table, a saved plan, or a .toml or .json request.
    sign
        "negative", "positive" or "auto"; by default what a request says, else "auto".
    vehicle, coefficients, crossing_tolerance
        By default what the file says, for a request half a step of its grid; else the paper's vehicle, its published
        coefficients, and π/32.

    Raises
    ------
    InputError, FileProblem
        If the file holds neither, or a value is not allowed.
    """
    if holds_request(path):
        given = {"vehicle": vehicle, "coefficients": coefficients, "sign": sign}
        request, _ = read_request(path, {name: value for name, value in given.items() if value is not None})
        planes_only(request, "colourings")
        points: Any = request.waypoints
        vehicle, numbers = request.vehicle, coefficients_of(request.vehicle, request.coefficients)
        told = math.pi / (2 * request.divisions)
        sign = request.sign
    else:
        table = merged(read_pieces(path, plane_only=True))
        with _of_file(path):
            vehicle, numbers, told = setting_of(table, vehicle, coefficients)
        names = [name for name in ANGLES if name in table]
        rows = np.column_stack([table[name] for name in names])
        same_color = "color" not in table or table["color"][-1] == table["color"][0]
        if len(rows) > 1 and np.abs(rows[-1] - rows[0]).max() <= CLOSED_GAP and same_color:
            rows = rows[:-1]
        points = rows[:, :2]
    return colorings(
        points,
        sign=sign or "auto",
        vehicle=vehicle,
        coefficients=numbers,
        crossing_tolerance=told if crossing_tolerance is None else crossing_tolerance,
    )


def _sheet_of(alpha: FloatArray, coefficients: Coefficients) -> tuple[str, ...]:
    """Return the color of the sheet or fibre that each row lies on, or nothing if a row lies on none."""
    codes = families_along(alpha, coefficients, DEFAULT_TOLERANCE)
    return tuple(map(family_of, codes.tolist())) if codes.all() else ()


def _completed(table: Table, *, vehicle: Vehicle | None, coefficients: Kind | None) -> Table:
    """Return the table closed, from t = 0, with every column that follows from the rest.

    What the table states stays where it agrees with the angles: R to within what its digits carry, types with the
    color. What disagrees, or is for another vehicle, is computed anew. Rows are joined by straight segments: unless
    all rates and accelerations are stated, rates are those just after each row and accelerations are zero.
    """
    asked, kind = vehicle, coefficients
    vehicle, numbers, tolerance = setting_of(table, vehicle, coefficients)
    columns = dict(table.columns)
    if "alpha3" not in columns:
        plane = np.column_stack([columns["alpha1"], columns["alpha2"]])
        lifted = lift(plane, columns["color"], vehicle=vehicle, coefficients=numbers)
        columns["alpha3"], columns["alpha4"] = lifted.alpha[:, 2], lifted.alpha[:, 3]
    alpha = np.column_stack([columns[name] for name in ANGLES])
    colors = columns.get("color") or _sheet_of(alpha, numbers)
    computed = np.asarray(level_determinant(alpha, numbers))
    digits = 2 * level_determinant_resolution(alpha, numbers)
    if (np.abs(columns.get("R", math.inf) - computed) > digits).any():
        columns["R"] = computed
    if colors:
        columns["color"] = colors
        families = family_codes(colors)
        stated = columns.get("types", ())
        codes = np.array([types_from_text(text) for text in stated]).reshape(-1, 2)
        if not stated or types_contradict(codes, families).any():
            pairs = zip(*family_types(alpha, families, numbers, tolerance), strict=True)
            columns["types"] = tuple(text_from_types(*pair) for pair in pairs)
    else:
        columns.pop("types", None)
    columns = _closed(columns)
    if not all(name in columns for name in (*RATES, *ACCELERATIONS)) and len(columns["t"]) > 1:
        step = np.diff(columns["t"])
        for name, rate, acceleration in zip(ANGLES, RATES, ACCELERATIONS, strict=True):
            slope = np.diff(columns[name]) / step
            columns[rate] = np.append(slope, slope[0]) + 0.0
            columns[acceleration] = np.zeros(len(columns["t"]))
    about = {**table.about, "vehicle": vehicle.as_mapping(), "coefficients": numbers.kind}
    if not _told_request(table, asked, kind):
        about.pop("request", None)
    return Table(columns={name: columns[name] for name in ORDER if name in columns}, about=about)


def export(
    source: str | Path,
    outputs: Iterable[str | Path],
    *,
    vehicle: Vehicle | None = None,
    coefficients: Kind | None = None,
    period: float | None = None,
    law: str | None = None,
    samples: int | None = None,
    rate: float | None = None,
    force: bool = False,
) -> Table:
    """Read a gait file and write it to other files.

    A table with a clock keeps its rows, counted from t = 0 and closed, and columns that follow from them are added.
    A table without one, one of a single row, or any of `period`, `law`, `samples`, `rate`, puts a new clock on the
    closed polyline through the rows.

    Returns
    -------
    Table
        What was written.

    Raises
    ------
    InputError, FileProblem, OutputExists
        As :func:`read_table` and :func:`write_tables` do.
    """
    paths = list(outputs)
    check_outputs(paths, force=force)
    table = read_table(source)
    retime = "t" not in table or len(table) == 1 or any(option is not None for option in (period, law, samples, rate))
    with _of_file(source):
        if retime:
            gait = gait_of(table, vehicle=vehicle, coefficients=coefficients)
            gait = replace(gait, request=_told_request(table, vehicle, coefficients))
        else:
            table = _completed(table, vehicle=vehicle, coefficients=coefficients)
    if retime:
        timed = parametrize(
            gait,
            _default(period, table.about.get("period"), 1.0),
            law=_default(law, table.about.get("law"), LAWS[0]),
            samples=samples,
            rate=rate,
        )
        table = table_of(timed)
    write_tables(table, paths, force=force)
    return table


def _told_request(table: Table, vehicle: Vehicle | None, coefficients: Kind | None) -> dict[str, Any]:
    """Return the request that made a table; empty if it tells none, or if the table is taken for something else."""
    request = table.about.get("request")
    return dict(request) if isinstance(request, dict) and vehicle is None and coefficients is None else {}


def _closed(columns: dict[str, Any]) -> dict[str, Any]:
    """Return the columns with t from 0 and a closing row, one mean step later, if the last row is not the first."""
    angles = np.column_stack([columns[name] for name in ANGLES])
    t = columns["t"] - columns["t"][0]
    end = len(t)
    if end > 1 and np.abs(angles[-1] - angles[0]).max() <= CLOSED_GAP:
        end -= 1  # its last row is the first again, but for rounding
    else:
        t = np.append(t, t[-1] + t[-1] / max(end - 1, 1))
    out = {
        name: np.append(values[:end], values[0]) if isinstance(values, np.ndarray) else (*values[:end], values[0])
        for name, values in columns.items()
    }
    return {**out, "t": t}


def _default(*values: Any) -> Any:
    return next(value for value in values if value is not None)
