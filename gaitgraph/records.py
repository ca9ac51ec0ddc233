"""Records as plain values and back, and their equality by value.

:func:`plain` goes to what JSON takes: numbers, texts, lists and mappings. What these cannot tell apart, a tuple, an array, a
record, becomes a mapping that names its `type`. :func:`rebuilt` makes the value again, by the constructor of each record,
and refuses values of other types than those that its fields are annotated with. The mappings are those of one version
of gaitgraph; what other programs read is ``as_mapping()``, where a record has one.
"""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from importlib import import_module
from inspect import Parameter, signature
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Literal,
    Self,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from gaitgraph.arrays import freeze_arrays
from gaitgraph.errors import InputError, check_fields, shown, wrong

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

_TYPE = "type"
_MOST = 1 << 1000  # of whole numbers that are floats
_OWN = "gaitgraph."
_BROKEN = (
    ArithmeticError,
    AttributeError,
    ImportError,
    LookupError,
    NameError,
    TypeError,
    ValueError,
)


class Record:
    """Base of the records that are equal by value, and go to plain values and back."""

    __slots__ = ()
    not_stated: ClassVar[str] = ""  # why a record cannot be made from its mapping

    def as_dict(self) -> dict[str, Any]:
        """Return the whole record as plain values, which JSON takes; see :meth:`from_dict`."""
        return plain(self)  # type: ignore[no-any-return]

    @classmethod
    def from_dict(cls, mapping: Mapping[str, Any]) -> Self:
        """Return the record that :meth:`as_dict` gave, or raise InputError.

        The mapping of a Region or of a Cycle is not the whole of it, so that they are asked for again.
        """
        if cls.not_stated:
            requirement = (
                f"must not be that of a {cls.__name__}, whose {cls.not_stated}"
            )
            raise wrong("mapping", requirement, mapping)
        try:
            record = rebuilt(mapping)
        except RecursionError as error:
            raise InputError("mapping is nested too deeply") from error
        if not isinstance(record, cls):
            raise wrong("mapping", f"must be that of a {cls.__name__}", mapping)
        return record

    def _constructed_from(self) -> dict[str, Any]:
        """Return the fields by name; a record whose constructor takes fewer has a method of its own."""
        return {one.name: getattr(self, one.name) for one in fields(self)}  # type: ignore[arg-type]

    def __reduce__(self) -> Any:
        values = {one.name: getattr(self, one.name) for one in fields(self)}  # type: ignore[arg-type]
        return _restored, (type(self), values)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self is other or _key(self) == _key(other)

    def __hash__(self) -> int:
        return hash(_key(self))


def _restored(kind: type[Any], values: dict[str, Any]) -> Any:
    """Return a record that was pickled or copied, whose arrays cannot be written to either."""
    record = object.__new__(kind)
    for name, value in values.items():
        object.__setattr__(record, name, value)  # the record is frozen
    freeze_arrays(record)
    return record


def plain(value: Any) -> Any:
    """Return a value as plain ones; InputError if it holds what has no such form, a function say.

    >>> plain({"t": (1.0, float("inf"))})
    {'t': {'type': 'tuple', 'items': [1.0, {'type': 'float', 'value': 'inf'}]}}
    """
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        number = float(value)
        if math.isfinite(number):
            return number
        return {_TYPE: "float", "value": repr(number)}
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return _plain_mapping(value)
    if isinstance(value, Enum):
        return {_TYPE: _name_of(type(value)), "value": value.value}
    if isinstance(value, tuple):
        kind = "tuple" if type(value) is tuple else _name_of(type(value))
        return {_TYPE: kind, "items": [plain(item) for item in value]}
    if isinstance(value, Record):
        return {_TYPE: _name_of(type(value)), **_plain_fields(value)}
    return _plain_of_library(value)


def _plain_fields(record: Record) -> dict[str, Any]:
    values = {}
    for name, value in record._constructed_from().items():
        try:
            values[name] = plain(value)
        except InputError as error:
            error.field = error.field or name
            raise
    return values


def _plain_mapping(mapping: dict[Any, Any]) -> dict[str, Any]:
    items = {key: plain(item) for key, item in mapping.items()}
    if all(isinstance(key, str) for key in items) and _TYPE not in items:
        return items
    return {
        _TYPE: "mapping",
        "items": [[plain(key), item] for key, item in items.items()],
    }


def _plain_of_library(value: Any) -> dict[str, Any]:
    """Return an array or a number of numpy, or a geometry of shapely, as plain values."""
    import numpy as np
    import shapely

    if isinstance(value, np.generic):
        return plain(value.item())  # type: ignore[no-any-return]
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        return {
            _TYPE: "array",
            "dtype": value.dtype.str,
            "shape": list(value.shape),  # which lists without items do not tell
            "items": plain(value.tolist()),
        }
    if isinstance(value, shapely.Geometry):
        return {_TYPE: "geometry", "wkb": shapely.to_wkb(value, hex=True)}
    raise InputError(f"a value must have a form in JSON, got {shown(value)}")


def rebuilt(value: Any) -> Any:
    """Return the value whose plain form :func:`plain` gave; InputError, whose field is the place in it, if it is none.

    >>> rebuilt(plain((1.0, [2])))
    (1.0, [2])
    """
    if isinstance(value, list):
        return [item for _, item in _rebuilt_items(enumerate(value))]
    if not isinstance(value, dict):
        return value
    if _TYPE not in value:
        return dict(_rebuilt_items(value.items()))
    rest = dict(value)
    kind = rest.pop(_TYPE)
    items = rest.get("items", [])
    if not isinstance(items, list):
        raise wrong("items", "must be a list", items)
    try:
        if isinstance(kind, str) and kind in _LIBRARY:
            return _LIBRARY[kind](**rest)
        return _rebuilt_record(_class_of(kind), rest)
    except _BROKEN as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"mapping must be as as_dict() gave it: {error}") from error


def _rebuilt_items(items: Iterable[tuple[Any, Any]]) -> Iterator[tuple[Any, Any]]:
    """Yield names or numbers of items, each with its value; an InputError has them before its field."""
    for place, item in items:
        try:
            value = rebuilt(item)
        except InputError as error:
            error.field = f"{place}.{error.field}" if error.field else str(place)
            raise
        yield place, value


def _rebuilt_record(kind: Any, rest: dict[str, Any]) -> Any:
    if issubclass(kind, Enum):
        return kind(rest["value"])
    if issubclass(kind, tuple):
        return kind(*rebuilt(rest["items"]))
    named = dict(_rebuilt_items(rest.items()))
    _check_names(kind, named)
    # A constructor that takes wider types than the record holds checks them itself.
    if kind._constructed_from is Record._constructed_from:
        _check_types(kind, named)
    later = {one.name: named.pop(one.name) for one in fields(kind) if not one.init}
    record = kind(**named)
    for name, item in later.items():
        object.__setattr__(record, name, item)  # the record is frozen
    return record


def _check_names(kind: Any, named: dict[str, Any]) -> None:
    """Raise InputError for the first field that a mapping lacks, or that the record does not have.

    A record with a method of its own for what it is constructed from leaves out what has the default value.
    """
    parameters = signature(kind).parameters.values()
    known = [one.name for one in parameters if one.kind is not Parameter.VAR_KEYWORD]
    needed = [one.name for one in parameters if one.default is Parameter.empty]
    later = [one.name for one in fields(kind) if not one.init]
    if kind._constructed_from is Record._constructed_from:
        needed = known
    for name in [*needed, *later]:
        if name in known + later and name not in named:
            raise InputError(
                f"mapping of a {kind.__name__} must have {name}, got none", field=name
            )
    if len(known) == len(parameters):
        check_fields(f"mapping of a {kind.__name__}", named, known + later)


def _check_types(kind: Any, named: dict[str, Any]) -> None:
    """Raise InputError for the first value that is not of the type that its field states."""
    hints = _hints_of(kind)
    for one in fields(kind):
        if one.name in named and not _fits(named[one.name], hints[one.name]):
            raise wrong(one.name, f"must be {one.type}", named[one.name])


@cache
def _hints_of(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _fits(value: Any, hint: Any) -> bool:
    """Return whether a value is of an annotated type, and its items of theirs; what is no class fits anything."""
    kind: Any = get_origin(hint) or hint
    parts: tuple[Any, ...] = get_args(hint)
    if kind in (Union, UnionType):
        return any(_fits(value, part) for part in parts)
    if kind is Literal:
        return isinstance(value, str) and value in parts
    if kind is float:
        return type(value) is float or (type(value) is int and abs(value) < _MOST)
    if kind in (int, bool, str):
        return type(value) is kind
    if kind is Any or not isinstance(kind, type):
        return True
    if kind is tuple and isinstance(value, tuple) and parts:
        hints = parts[:1] * len(value) if parts[-1] is Ellipsis else parts
        return len(hints) == len(value) and all(map(_fits, value, hints))
    if isinstance(value, dict) and parts:
        items_fit = all(_fits(item, parts[1]) for item in value.values())
        return isinstance(value, kind) and items_fit
    return isinstance(value, kind)


def _array(dtype: str, shape: list[int], items: list[Any]) -> Any:
    import numpy as np

    array = np.array(rebuilt(items)).reshape(shape)
    # Texts become no truth values; an array without items is one of floats.
    casting: Any = "same_kind" if array.size else "unsafe"
    return array.astype(dtype, casting=casting)


def _geometry(wkb: str) -> Any:
    import shapely

    try:
        return shapely.from_wkb(wkb)
    except shapely.errors.ShapelyError as error:
        raise wrong("wkb", "must be a geometry", wkb) from error


def _float(value: str) -> float:
    return float(value)


def _tuple(items: list[Any]) -> tuple[Any, ...]:
    return tuple(rebuilt(items))


def _mapping(items: list[list[Any]]) -> dict[Any, Any]:
    return {rebuilt(key): rebuilt(item) for key, item in items}


_LIBRARY: dict[Any, Callable[..., Any]] = {
    "float": _float,
    "tuple": _tuple,
    "mapping": _mapping,
    "array": _array,
    "geometry": _geometry,
}


def _name_of(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"


def _class_of(name: Any) -> Any:
    """Return a class of gaitgraph by the name that :func:`plain` gave; InputError for any other."""
    if not isinstance(name, str) or not name.startswith(_OWN):
        raise wrong("type", "must be one that as_dict() gave", name)
    module, _, kind = name.rpartition(".")
    found = getattr(import_module(module), kind)
    if not isinstance(found, type) or not issubclass(found, (Record, tuple, Enum)):
        raise wrong("type", "must be one that as_dict() gave", name)
    return found


def _key(value: Any) -> Any:
    """Return what equal values share, and others do not; it can be hashed."""
    if isinstance(value, dict):
        return frozenset((_key(key), _key(item)) for key, item in value.items())
    if isinstance(value, (list, tuple)):
        return type(value), *(_key(item) for item in value)
    if is_dataclass(value) and not isinstance(value, type):
        return type(value), *(_key(getattr(value, one.name)) for one in fields(value))
    if hasattr(value, "dtype") and hasattr(value, "tobytes"):
        # Adding zero turns negative zeros into zeros.
        positive = value if value.dtype.kind in "bOU" else value + 0
        return value.shape, value.dtype.str, positive.tobytes()
    if isinstance(value, float) and math.isnan(value):
        return "nan"
    return value
