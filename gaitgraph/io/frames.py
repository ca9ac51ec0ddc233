"""Tables from frames of pandas and polars, tables of pyarrow, and mappings of names to columns. None of them is needed.

A frame is recognised by what it offers: names in `columns` (or in `column_names`, as pyarrow's tables have them), and a
column by its name.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import Table, about_from_text
from gaitgraph.io.column_checks import table_from_columns
from gaitgraph.io.formats import KNOWN


class HasColumns(Protocol):
    """What frames of all libraries have in common."""

    @property
    def columns(self) -> Any:
        """The names of the columns."""
        ...

    def __getitem__(self, name: str, /) -> Any:
        """Return a column."""
        ...


Frame = HasColumns | Mapping[str, Any]
"""A frame, whichever library it is of, or a mapping of names to columns."""


def as_table(value: Any) -> Any:
    """Return a frame as a table, and anything else as it is; InputError for a lazy frame.

    >>> as_table("gait.csv"), len(as_table({"alpha1": [0.4], "alpha2": [-0.4], "color": "red"}))
    ('gait.csv', 1)
    """
    return table_from_frame(value) if _is_lazy(value) or _is_frame(value) else value


def _is_lazy(value: object) -> bool:
    """Return whether a value is a frame without rows yet; asking it for its columns would compute them."""
    return hasattr(type(value), "collect") and hasattr(type(value), "columns")


def _is_frame(value: object) -> bool:
    has_columns = hasattr(value, "columns") and hasattr(value, "__getitem__")
    return isinstance(value, Mapping) or (has_columns and not isinstance(value, (Table, type)))


def table_from_frame(frame: Frame) -> Table:
    """Return the gait table in a frame of pandas or polars, a table of pyarrow, or a mapping of names to arrays.

    Parameters
    ----------
    frame
        Columns as in a file: alpha1 to alpha4 (rad), or alpha1, alpha2 and color; others are ignored. An index of
        pandas that is named `t` counts as that column.

    Returns
    -------
    Table
        It states what made it if `attrs` does, as :meth:`Table.to_pandas` and `pandas.read_parquet` leave it.

    Raises
    ------
    InputError
        If it is no frame, a column is missing, or a value is not allowed.

    Examples
    --------
    >>> table = table_from_frame({"alpha1": [0.4, 0.8], "alpha2": [-0.4, -0.8], "color": ["red", "red"]})
    >>> len(table), list(table.columns)
    (2, ['alpha1', 'alpha2', 'color'])
    """
    if _is_lazy(frame):
        raise InputError(f"frame must have its rows there, got a {type(frame).__name__}: collect() it first")
    if not _is_frame(frame):
        raise InputError(f"frame must be a frame of pandas or polars, or a mapping of columns, got {shown(frame)}")
    names = list(frame) if isinstance(frame, Mapping) else list(getattr(frame, "column_names", None) or frame.columns)
    about = _about(getattr(frame, "attrs", None))
    columns: list[tuple[str, Any]] = []
    for name in names:
        if isinstance(name, str):  # one that is there twice is refused by its name
            used = (name in KNOWN or "servos" in about) and names.count(name) == 1
            columns.append((name, _values(frame[name], name) if used else None))
    index = getattr(frame, "index", None)
    if getattr(index, "name", None) == "t" and "t" not in names:
        columns.append(("t", _values(index, "t")))
    if isinstance(frame, Mapping):  # one text stands for all rows
        rows = max((len(values) for _, values in columns if isinstance(values, (np.ndarray, list))), default=0)
        columns = [(name, [values] * rows if isinstance(values, str) else values) for name, values in columns]
    return table_from_columns(columns, about)


def _values(column: Any, name: str) -> Any:
    """Return a column as an array of floats or a list of texts, None for one to ignore; InputError if it is neither."""
    if isinstance(column, (list, tuple)):
        return list(column)
    if isinstance(column, str):
        return column
    try:
        values = np.asarray(column)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be a column of numbers or texts, got {shown(column)}") from error
    if values.ndim != 1:
        raise InputError(f"{name} must have one dimension, got {values.ndim}")
    if values.dtype.kind in "fiu" and values.dtype.itemsize <= np.dtype(float).itemsize:
        return values.astype(np.float64)
    if values.dtype.kind in "OUT":
        return values.tolist()
    if name not in KNOWN:
        return None
    raise InputError(f"{name} must hold numbers or texts, got values of the type {values.dtype}")


def _about(attributes: object) -> dict[str, Any]:
    stated = attributes.get("gaitgraph") if isinstance(attributes, dict) else None
    try:
        text = json.dumps(stated, allow_nan=False)
    except (RecursionError, TypeError, ValueError) as error:
        raise InputError(f"attrs must be as gaitgraph left them, got {shown(stated)}") from error
    return about_from_text(text)
