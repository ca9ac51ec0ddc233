"""JSON files of gait tables: an object of columns, a list of rows, or a plan as the command line prints it."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import ANGLES, Table, checked_about, merged, provenance_of
from gaitgraph.io.column_checks import table_from_columns

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from gaitgraph.io.servo_map import ServoMap

_JSON = "allowed is an object of columns, a list of rows, or a plan"
_MOST_BRACKETS = 5_000_000


def table_of_json(text: str, plane_only: bool, joints: ServoMap | None) -> Table:
    """Return the table that a JSON text holds.

    Parameters
    ----------
    text
        An object of columns (beside them, or around them, what made them), a list of rows, or a plan.
    plane_only, joints
        As for :func:`gaitgraph.io.reading.read_pieces`; a plan is always of tilt angles.

    Raises
    ------
    InputError
        If it is no JSON, or no gait table.

    Examples
    --------
    >>> table_of_json('[{"alpha1": "pi/4", "alpha2": 0, "color": "red"}]', False, None).columns["alpha1"].round(4)
    array([0.7854])
    """
    if text.count("[") + text.count("{") > _MOST_BRACKETS:  # they take twenty times the memory of the text, and more
        raise InputError(f"it has more than {_MOST_BRACKETS} lists and objects; {_JSON}")
    try:
        content = json.loads(text, parse_constant=_refused_constant, object_pairs_hook=_object)
    except RecursionError as error:
        raise InputError("it is nested too deeply; allowed is a gait table") from error
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"it is not JSON ({str(error).splitlines()[0]}); {_JSON}") from error
    if isinstance(content, list):
        return table_from_columns(_columns_of_rows(content), plane_only=plane_only, joints=joints)
    if not isinstance(content, dict):
        raise InputError(f"it holds {shown(content)}; {_JSON}")
    if "path" in content:
        return _table_of_plan(content)
    columns = content.get("columns", content)
    if not isinstance(columns, dict):
        raise InputError(f"'columns' is no object; {_JSON}")
    about = checked_about(content.get("about", {}))
    lists = {name: values for name, values in columns.items() if isinstance(values, list)}
    if isinstance(columns.get("color"), str) and lists:
        lists["color"] = [columns["color"]] * len(next(iter(lists.values())))
    return table_from_columns(list(lists.items()), about, plane_only=plane_only, joints=joints)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object, or raise InputError if a name appears twice in it."""
    content = dict(pairs)
    if len(content) < len(pairs):
        name = next(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        raise InputError(f"{shown(name)} appears twice; allowed is once")
    return content


def _refused_constant(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _columns_of_rows(rows: list[Any]) -> list[tuple[str, Any]]:
    if not all(isinstance(row, dict) for row in rows):
        raise InputError(f"a list whose entries are not all objects; {_JSON}")
    if not rows:
        raise InputError(f"it has no rows; {_JSON}")
    for number, row in enumerate(rows, start=1):
        if row.keys() != rows[0].keys():
            raise InputError(f"row {number} has other fields than row 1; {_JSON}")
    return [(name, [row[name] for row in rows]) for name in rows[0]]


def _table_of_plan(content: dict[str, Any]) -> Table:
    if content.get("status") == "infeasible":
        raise InputError(f"it holds a plan without a gait: {content.get('reason')}")
    path, colors = content["path"], content.get("colors", [])
    if not (isinstance(path, list) and path and all(isinstance(row, list) and len(row) == 4 for row in path)):
        raise InputError(f"path: {shown(path)}; allowed is a list of [alpha1, alpha2, alpha3, alpha4]")
    if not isinstance(colors, list):
        raise InputError(f"colors: {shown(colors)}; allowed is a list of 'red' and 'blue'")
    columns: list[tuple[str, Any]] = [(name, [row[k] for row in path]) for k, name in enumerate(ANGLES)]
    if colors:
        columns.append(("color", colors))
    request = content.get("request")
    keys = ("vehicle", "coefficients", "period", "law")
    about = {key: request[key] for key in keys if key in request} if isinstance(request, dict) else {}
    if about:
        about["request"] = request
    if "crossing_tolerance" in content:
        about["crossing_tolerance"] = content["crossing_tolerance"]
    return table_from_columns(columns, about)


def write_json(pieces: Iterable[Table], path: Path) -> None:
    """Write a new JSON file: format, version, about, and the columns as lists."""
    table = merged(pieces)
    heads = [
        f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in provenance_of(table).items()
    ]
    columns = []
    for name, values in table.columns.items():
        plain = values.tolist() if isinstance(values, np.ndarray) else list(values)
        columns.append(f"    {json.dumps(name)}: {json.dumps(plain, allow_nan=False)}")
    heads.append('  "columns": {\n' + ",\n".join(columns) + "\n  }")
    path.write_text("{\n" + ",\n".join(heads) + "\n}\n", encoding="utf-8")
