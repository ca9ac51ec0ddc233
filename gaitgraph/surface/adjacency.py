"""The Two Color rule: which plane types may be neighbours (Figure 15), and where a closed loop breaks it.

An angle may not step from its + plane to its − plane; it may pass through `?`, where the planes cross. Figure
15 (a) says so for one angle, Figure 15 (b) for the pair (α3, α4): both must be allowed, so (?,?) is a
neighbour of every type.

On a fibre one angle is free, of the type `*`. It may be a neighbour of every type: the fibre holds both planes of that
angle and all between them, so the angle moves from one to the other without a jump. The other angle is where its planes
cross, of the type `?`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError, shown
from gaitgraph.surface.solutions import FREE

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "FIBER_TYPES",
    "PLANE_TYPES",
    "first_violation",
    "neighbors_allowed",
    "types_from_text",
    "types_may_be_adjacent",
]

PLANE_TYPES = ("(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)", "(?,?)")
"""The seven categories of roots; (+,−) and (−,+) never occur."""

FIBER_TYPES = ("(?,*)", "(*,?)")
"""The types on the first and on the second fibre."""

_CODES = {"+": 1, "?": 0, "-": -1, "−": -1, "*": FREE}
_LABEL = re.compile(r"\(\s*([+?−*-])\s*,\s*([+?−*-])\s*\)")


def types_from_text(label: str) -> tuple[int, int]:
    """Return a label such as ``(+,?)`` as +1, 0 or −1 for α3 and for α4; `*` is :data:`gaitgraph.surface.solutions.FREE`.

    Raises
    ------
    InputError
        If the label is none of the seven categories, nor that of a fibre.

    Examples
    --------
    >>> types_from_text("(?,-)"), types_from_text("(?,*)")
    ((0, -1), (0, 2))
    """
    match = _LABEL.fullmatch(label.strip()) if isinstance(label, str) else None
    codes = (_CODES[match[1]], _CODES[match[2]]) if match else (1, -1)
    if codes[0] * codes[1] < 0 or (FREE in codes and 0 not in codes):
        raise InputError(f"types: {shown(label)}; allowed are {', '.join((*PLANE_TYPES, *FIBER_TYPES))}")
    return codes


def neighbors_allowed(first: tuple[npt.ArrayLike, npt.ArrayLike], second: tuple[npt.ArrayLike, npt.ArrayLike]) -> Any:
    """Return whether types, given as +1, 0, −1 or `FREE` for α3 and for α4, may be adjacent; arrays broadcast.

    Neither angle may have the types + and −, whose product is −1; that of `FREE` and − is −2.
    """
    third = np.multiply(first[0], second[0])
    fourth = np.multiply(first[1], second[1])
    return (third != -1) & (fourth != -1)


def types_may_be_adjacent(first: str, second: str) -> bool:
    """Return whether Figure 15 lines two types.

    >>> types_may_be_adjacent("(+,+)", "(+,?)"), types_may_be_adjacent("(+,+)", "(-,-)")
    (True, False)
    >>> all(types_may_be_adjacent(one, other) for one in ("(?,?)", *FIBER_TYPES) for other in PLANE_TYPES)
    True
    """
    return bool(neighbors_allowed(types_from_text(first), types_from_text(second)))


def first_violation(types: Sequence[str], *, closed: bool = True) -> int | None:
    """Return the index k of the first pair (k, k+1) that Figure 15 forbids, or None.

    Parameters
    ----------
    types
        The types along a loop, in order.
    closed
        Whether the last and the first are neighbours too.

    Examples
    --------
    >>> first_violation(["(+,+)", "(+,?)", "(?,?)", "(-,-)"])
    3
    """
    codes = np.array([types_from_text(label) for label in types], dtype=int).reshape(-1, 2)
    following = np.roll(codes, -1, axis=0)
    broken = ~neighbors_allowed((codes[:, 0], codes[:, 1]), (following[:, 0], following[:, 1]))
    if not closed and broken.size:
        broken[-1] = False
    return int(np.argmax(broken)) if broken.any() else None
