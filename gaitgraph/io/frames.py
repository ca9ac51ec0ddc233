"""Frames of pandas and polars: gait tables are made of them and given as them. Neither is needed.

A frame is taken by what it can do, not by what it is: names in `columns` (or in `column_names`, as pyarrow's tables
have them), and a column by its name. A plain mapping of names to arrays is one too.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from gaitgraph.errors import InputError, shown
from gaitgraph.gait.table import Table, about_from_text
from gaitgraph.io.formats import KNOWN
from gaitgraph.io.table_columns import table_from_columns


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

_ATTRIBUTE = "gaitgraph"
"""What pandas frames call what made them, in `attrs`."""


def is_frame(value: object) -> bool:
    """Return whether a value can be taken as a frame.

    >>> is_frame({"alpha1": [0.4]}), is_frame("gait.csv")
    (True, False)
    """
    if isinstance(value, (Table, str, type)) or _is_lazy(value):
        return False
    return isinstance(value, Mapping) or (hasattr(value, "columns") and hasattr(value, "__getitem__"))


def _is_lazy(value: object) -> bool:
    """Return whether a value is a frame that has to be computed first; that is not asked of the value itself."""
    return hasattr(type(value), "collect") and hasattr(type(value), "columns")


def _check_there(value: object) -> None:
    if _is_lazy(value):
        raise InputError(
            f"frame: a {type(value).__name__}; allowed is a frame whose rows are there: collect() it first"
        )


def as_table(value: Any) -> Any:
    """Return a frame as a table, and anything else as it is; InputError for a lazy frame."""
    _check_there(value)
    return table_from_frame(value) if is_frame(value) else value


def table_from_frame(frame: Any) -> Table:
    """Return the gait table in a frame of pandas or polars, a table of pyarrow, or a mapping of names to arrays.

    Parameters
    ----------
    frame
        Columns as in a file: alpha1 to alpha4 (rad), or alpha1, alpha2 and color; others are passed over. An index of
        pandas that is named `t` counts as that column.

    Returns
    -------
    Table
        What made it is told if `attrs` tells it, as :meth:`Table.to_pandas` and `pandas.read_parquet` leave it.

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
    _check_there(frame)
    if not is_frame(frame):
        raise InputError(f"frame: {shown(frame)}; allowed is a frame of pandas or polars, or a mapping of columns")
    names = list(frame) if isinstance(frame, Mapping) else list(getattr(frame, "column_names", None) or frame.columns)
    about = _about(getattr(frame, "attrs", None))
    columns: list[tuple[str, Any]] = []
    for name in names:
        if isinstance(name, str):  # a name that is there twice is told as that
            taken = (name in KNOWN or "servos" in about) and names.count(name) == 1
            columns.append((name, _values(frame[name], name) if taken else None))
    index = getattr(frame, "index", None)
    if getattr(index, "name", None) == "t" and "t" not in names:
        columns.append(("t", _values(index, "t")))
    if isinstance(frame, Mapping):
        rows = max((len(values) for _, values in columns if isinstance(values, (np.ndarray, list))), default=0)
        columns = [(name, [values] * rows if isinstance(values, str) else values) for name, values in columns]
    return table_from_columns(columns, about)


def _values(column: Any, name: str) -> Any:
    """Return a column as an array of floats or a list of texts, or InputError if it is neither."""
    if isinstance(column, (list, tuple)):
        return list(column)
    if isinstance(column, str):
        return column
    try:
        values = np.asarray(column)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: {shown(column)}; allowed is a column of numbers or texts") from error
    if values.ndim != 1:
        raise InputError(f"{name}: it has {values.ndim} dimensions; allowed is one")
    if values.dtype.kind in "fiu" and values.dtype.itemsize <= np.dtype(float).itemsize:
        return values.astype(np.float64)
    if values.dtype.kind in "OUT":
        return values.tolist()
    if name not in KNOWN:
        return None
    raise InputError(f"{name}: its values are of the type {values.dtype}; allowed are numbers or texts")


def _about(attributes: object) -> dict[str, Any]:
    told = attributes.get(_ATTRIBUTE) if isinstance(attributes, dict) else None
    try:
        return about_from_text(json.dumps(told, allow_nan=False))
    except (RecursionError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"attrs: {shown(told)}; allowed is what gaitgraph told there") from error
