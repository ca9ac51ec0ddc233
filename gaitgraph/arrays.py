"""Arrays that are taken have no masked values; arrays and mappings that records hand out cannot be written to."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, NoReturn

from gaitgraph.errors import InputError

if TYPE_CHECKING:
    import numpy as np

_MOST_DIMENSIONS = 64  # of an array of numpy
_PLAIN = {float, int, str}


def check_unmasked(values: object, name: str = "angles") -> None:
    """Raise InputError with the row of the first masked value in an array, or in nested lists of arrays.

    A masked array, of numpy.ma for one, says that these values do not count, while numpy reads the numbers below.
    """
    found = first_masked(values, _MOST_DIMENSIONS)
    if found is not None:
        row = found[0] + 1 if found else None
        place = f" in row {row}" if found else ""
        raise InputError(
            f"{name} must have no masked values, got one{place}", field=name, row=row
        )


def first_masked(values: Any, depth: int = 0) -> tuple[int, ...] | None:
    """Return the indices of the first masked value, in lists of up to some depth; None if there is none."""
    if isinstance(values, (list, tuple)):
        if not depth or _PLAIN.issuperset(map(type, values)):
            return None
        for k, part in enumerate(values):
            found = first_masked(part, depth - 1)
            if found is not None:
                return (k, *found)
        return None
    mask = getattr(values, "mask", None)
    if mask is None or callable(mask):  # in pandas it is a method
        return None
    import numpy as np

    return next(map(tuple, np.argwhere(mask).tolist()), None)


def read_only(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return a view of an array that cannot be written to.

    >>> import numpy as np
    >>> read_only(np.zeros(2))[0] = 1.0
    Traceback (most recent call last):
    ValueError: assignment destination is read-only
    """
    view = array.view()
    view.flags.writeable = False
    return view


class ReadOnlyDict(dict[Any, Any]):
    """A dictionary that cannot be changed; `dict` of it, or its union with another one, can be.

    >>> ReadOnlyDict(law="smooth")["law"] = "equal-time"
    Traceback (most recent call last):
    TypeError: mapping is read-only
    """

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("mapping is read-only")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> Any:
        return ReadOnlyDict, (dict(self),)


def read_only_mapping(mapping: dict[Any, Any]) -> ReadOnlyDict:
    """Return a mapping that cannot be changed, nor the arrays and mappings in it; lists in it can."""
    import numpy as np

    frozen: dict[Any, Any] = {}
    for name, value in mapping.items():
        if isinstance(value, np.ndarray):
            frozen[name] = read_only(value)
        elif isinstance(value, dict):
            frozen[name] = read_only_mapping(value)
        else:
            frozen[name] = value
    return ReadOnlyDict(frozen)


def freeze_arrays(record: Any) -> None:
    """Replace the arrays and mappings in the fields of a new dataclass by those that cannot be written to.

    A number that is written into an array of a record would change some of its answers and not others.
    """
    import numpy as np

    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, dict):
            value = read_only_mapping(value)
        elif isinstance(value, np.ndarray):
            value = read_only(value)
        else:
            continue
        object.__setattr__(record, field.name, value)  # the record is frozen
