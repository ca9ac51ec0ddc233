"""What may stand in a column: numbers, texts, times, each checked whatever the format.

A message names the row, counted from 1 over the whole table, the column, the value and what is allowed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.angles import angle_from_text
from gaitgraph.errors import InputError, shown
from gaitgraph.surface.adjacency import types_from_text
from gaitgraph.surface.sheets import FAMILIES

__all__ = ["check_times", "numbers_of", "texts_of"]

FloatArray = npt.NDArray[np.float64]

_LONGEST_TIME, _SHORTEST_STEP = 1e9, 1e-9
_COLORS = ", ".join(map(repr, FAMILIES))


def numbers_of(name: str, values: Any, row: int, *, angle_texts: bool = False) -> FloatArray:
    """Return the values of a column as finite numbers, in an array of their own.

    Parameters
    ----------
    name
        The column, for messages.
    values
        An array or a list, one value a row.
    row
        The number of rows before these.
    angle_texts
        Whether texts such as "3pi/8" are angles, in radians.

    Raises
    ------
    InputError
        If a value is missing, no number, or not finite.

    Examples
    --------
    >>> numbers_of("alpha1", ["pi/2", 1], 0, angle_texts=True).round(4)
    array([1.5708, 1.    ])
    """
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        odd = ~np.isfinite(values)
        if odd.any():
            k = int(np.argmax(odd))
            raise InputError(f"row {row + k + 1}: {name} is {float(values[k])!r}; allowed is a finite number")
        return np.array(values, dtype=np.float64)
    if isinstance(values, np.ndarray):
        values = values.tolist()
    numbers = np.empty(len(values))
    for k, value in enumerate(values):
        try:
            if angle_texts and isinstance(value, str):
                numbers[k] = angle_from_text(value)
            elif isinstance(value, (bool, list, dict)) or (isinstance(value, str) and not _is_plain(value)):
                numbers[k] = math.nan
            else:
                numbers[k] = float(value)
        except (TypeError, ValueError, OverflowError):
            numbers[k] = math.nan
        if not math.isfinite(numbers[k]):
            allowed = "a finite number" + (", or a text such as '3pi/8'" if angle_texts else "")
            told = "missing" if value is None else shown(value)
            raise InputError(f"row {row + k + 1}: {name} is {told}; allowed is {allowed}")
    return numbers


def _is_plain(text: str) -> bool:
    """Return whether a text may be a number: Python also reads 1_0, and the digits of other scripts."""
    return text.isascii() and "_" not in text


def texts_of(name: str, values: Any, row: int) -> tuple[str, ...]:
    """Return the values of a column of colours or of plane types; `row` is the number of rows before these.

    Raises
    ------
    InputError
        If one is neither.

    Examples
    --------
    >>> texts_of("color", ["red ", "blue"], 0)
    ('red', 'blue')
    """
    texts = values.tolist() if isinstance(values, np.ndarray) else list(values)
    texts = [text.strip() if isinstance(text, str) else text for text in texts]
    try:
        unknown = set(texts) - set(FAMILIES if name == "color" else ())
    except TypeError:  # a list or an object
        unknown = set()
    else:
        if not unknown:
            return tuple(texts)
    seen: set[str] = set()
    for k, text in enumerate(texts):
        if name == "color" and text not in FAMILIES:
            told = "missing" if text is None else shown(text)
            raise InputError(f"row {row + k + 1}: color is {told}; allowed are {_COLORS}")
        if name == "types" and not (isinstance(text, str) and text in seen):
            try:
                types_from_text(text)
            except InputError as error:
                raise InputError(f"row {row + k + 1}: {error}") from error
            seen.add(text)
    return tuple(texts)


def check_times(times: FloatArray, before: float, rows: int) -> None:
    """Raise InputError unless times increase; `rows` counts all rows up to the last one of these."""
    far = np.abs(times) > _LONGEST_TIME
    if far.any():
        k = int(np.argmax(far))
        row, time = rows - len(times) + k + 1, float(times[k])
        raise InputError(f"row {row}: t = {time!r}; allowed are times up to {_LONGEST_TIME:g} s")
    step = np.diff(times, prepend=before)
    if (step <= 0).any():
        k = int(np.argmax(step <= 0))
        row, time = rows - len(times) + k + 1, float(times[k])
        raise InputError(f"row {row}: t = {time!r} does not increase; allowed are increasing times")
    if (step < _SHORTEST_STEP).any():
        k = int(np.argmax(step < _SHORTEST_STEP))
        row, time = rows - len(times) + k + 1, float(times[k])
        raise InputError(f"row {row}: t = {time!r} follows at once; allowed are steps of {_SHORTEST_STEP:g} s and more")
