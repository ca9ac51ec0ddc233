"""Plane types and the Figure 15 rule: which of them may be neighbours on a loop.

An angle must not step from its + plane to its − plane; it may pass through `?`, where the planes cross. Figure 15 (a)
states this for one angle, Figure 15 (b) for the pair (α3, α4): both must be allowed, so (?,?) is a neighbour of every
type.

On a fibre one angle is free and has the type `*`, which may be a neighbour of every type: the fibre holds both planes
of that angle and all between them, so the angle moves from one to the other without a jump.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown

# The seven categories of roots; (+,−) and (−,+) never occur.
PLANE_TYPES = ("(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)", "(?,?)")
FIBER_TYPES = ("(?,*)", "(*,?)")  # on the first and on the second fibre
FREE = 2  # the code of the type `*`, of an angle that is free on a fibre, beside +1, 0 and −1
_MARKS = {1: "+", 0: "?", -1: "-", FREE: "*"}
_CODES = {"−": -1, **{mark: code for code, mark in _MARKS.items()}}
_LABEL = re.compile(r"\(\s*([+?−*-])\s*,\s*([+?−*-])\s*\)")


def text_from_types(third: int, fourth: int) -> str:
    """Return the ASCII label, such as ``(+,?)``, of plane types given as +1, 0, −1, or :data:`FREE` for `*`."""
    return f"({_MARKS[int(third)]},{_MARKS[int(fourth)]})"


def types_from_text(label: str) -> tuple[int, int]:
    """Return a label such as ``(+,?)`` as +1, 0 or −1 for α3 and for α4, and :data:`FREE` for `*`.

    InputError unless it is one of the seven categories or that of a fibre.

    >>> types_from_text("(?,-)"), types_from_text("(?,*)")
    ((0, -1), (0, 2))
    """
    match = _LABEL.fullmatch(label.strip()) if isinstance(label, str) else None
    codes = (_CODES[match[1]], _CODES[match[2]]) if match else (1, -1)
    if codes[0] * codes[1] < 0 or (FREE in codes and 0 not in codes):
        raise InputError(f"types must be one of {', '.join((*PLANE_TYPES, *FIBER_TYPES))}, got {shown(label)}")
    return codes


def neighbors_allowed(first: tuple[npt.ArrayLike, npt.ArrayLike], second: tuple[npt.ArrayLike, npt.ArrayLike]) -> Any:
    """Return whether types, given as +1, 0, −1 or `FREE` for α3 and for α4, may be adjacent; arrays broadcast."""
    # Neither angle may have the types + and −, whose product is −1; that of `FREE` and − is −2.
    return (np.multiply(first[0], second[0]) != -1) & (np.multiply(first[1], second[1]) != -1)


def types_may_be_adjacent(first: str, second: str) -> bool:
    """Return whether Figure 15 joins two types by a line.

    >>> types_may_be_adjacent("(+,+)", "(+,?)"), types_may_be_adjacent("(+,+)", "(-,-)")
    (True, False)
    >>> all(types_may_be_adjacent(one, other) for one in ("(?,?)", *FIBER_TYPES) for other in PLANE_TYPES)
    True
    """
    return bool(neighbors_allowed(types_from_text(first), types_from_text(second)))
