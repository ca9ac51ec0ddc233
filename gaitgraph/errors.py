"""Every error that gaitgraph raises on purpose.

All derive from :class:`GaitgraphError`, and each from the builtin error that a reader would catch. Infeasible requests
are answers, not errors: a plan states its reason, and only reading its gait raises :class:`Infeasible`.
"""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, Self

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

__all__ = [
    "ContractError",
    "FileProblem",
    "FileWarning",
    "GaitgraphError",
    "Infeasible",
    "InputError",
    "MissingConstant",
    "MissingExtra",
    "OutputExists",
]


def __dir__() -> list[str]:
    return [*__all__]


class Advice(NamedTuple):
    """What to ask for instead: in the words of Python, and in those of the command line."""

    python: str
    command_line: str


class GaitgraphError(Exception):
    """Base of all errors raised by gaitgraph.

    Its text is its `message` and, where something helps, `advice` with the argument of Python to use. `on_command_line`
    is the same text with the flag instead. The fields below say what is wrong, each None where the message does not.

    Parameters
    ----------
    field
        Name of the argument, option, column or field; with dots for one inside another, "vehicle.drag_ratio" say.
    row
        Row of a table, or place in a list of waypoints or polygons, counted from 1.
    value
        What the message says that it got.
    path
        The file.
    """

    def __init__(
        self,
        message: object = "",
        *,
        field: str | None = None,
        row: int | None = None,
        value: object = None,
        path: str | None = None,
        advice: Advice | None = None,
    ) -> None:
        super().__init__(message)
        self.field = field
        self.row = row
        self.value = value
        self.path = path
        self.advice = advice

    @property
    def message(self) -> str:
        """What is wrong, without advice."""
        return str(self.args[0])  # with errno, OSError would print that instead

    @property
    def on_command_line(self) -> str:
        """The whole text in the words of the command line."""
        if self.advice is None:
            return self.message
        return f"{self.message}; {self.advice.command_line}"

    def as_mapping(self) -> dict[str, Any]:
        """Return the message, and those of field, row, value and path that are known, as plain values, ready for JSON.

        A value that JSON does not take is a text, as messages show it.
        """
        values = {"message": self.message, "field": self.field, "row": self.row}
        values |= {"value": _for_json(self.value), "path": self.path}
        return {name: value for name, value in values.items() if value is not None}

    def __str__(self) -> str:
        if self.advice is None:
            return self.message
        return f"{self.message}; {self.advice.python}"


class InputError(GaitgraphError, ValueError):
    """A value is malformed or out of range; the message says what it must be, and what it is."""


class MissingConstant(InputError):
    """A vehicle does not state a constant that the computation needs."""


class MissingExtra(InputError, ImportError):
    """An optional library is not installed; the message says how to install it."""


class ContractError(GaitgraphError, ValueError):
    """A graph breaks the contract of :mod:`gaitgraph.graph.build`."""


class Infeasible(GaitgraphError, RuntimeError):
    """A gait was asked of a plan that has none; the message is the plan's reason."""


class FileProblem(GaitgraphError, OSError):
    """A file cannot be read or written; `errno` and `filename` are those of the system's error, if that was the cause."""

    @classmethod
    def of(
        cls,
        message: str,
        error: Exception,
        path: Path | None = None,
        advice: Advice | None = None,
    ) -> Self:
        """Return the problem of a path, or of a stream, that an error of the system tells."""
        problem = cls(message, advice=advice)
        problem.errno = getattr(error, "errno", None)
        if path is not None:
            problem.path = problem.filename = str(path)
        return problem

    def __reduce__(self) -> Any:
        system = {"errno": self.errno, "filename": self.filename}
        return type(self), self.args, self.__dict__ | system


class FileWarning(UserWarning):
    """A part of a gait file or frame is not used; the message names it. The command line prints it."""


class OutputExists(FileProblem, FileExistsError):
    """An output file exists already and overwriting was not asked for."""


def wrong(
    name: str,
    rule: str,
    value: object,
    hint: str = "",
    *,
    got: str = "",
    field: str | None = None,
    row: int | None = None,
    advice: Advice | None = None,
) -> InputError:
    """Return the error that a value breaks a rule; `got` is what to say of the value instead of itself.

    The `field` of the error is the name, unless that is one for messages.

    >>> error = wrong("period", "must be positive", -1.0)
    >>> str(error), error.field, error.value
    ('period must be positive, got -1.0', 'period', -1.0)
    """
    return InputError(
        f"{name} {rule}, got {got or shown(value)}{hint}",
        field=field or name,
        row=row,
        value=value,
        advice=advice,
    )


@contextmanager
def of_field(name: str, row: int | None = None) -> Iterator[None]:
    """Set the field, and the row, of each InputError that arises within."""
    try:
        yield
    except InputError as error:
        error.field = name
        error.row = row
        raise


@contextmanager
def inside(name: str) -> Iterator[None]:
    """Put the name of the whole before the field of each InputError that arises within, as in "vehicle.drag_ratio"."""
    try:
        yield
    except InputError as error:
        if error.field is None:
            error.field = name
        elif error.field != name:
            error.field = f"{name}.{error.field}"
        raise


def reworded(error: GaitgraphError, message: str) -> GaitgraphError:
    """Return an error of the same kind, about the same field and with the same advice, with another message.

    >>> reworded(InputError("period must be 1", field="period"), "file a.toml: period must be 1").field
    'period'
    """
    other = type(error)(message)
    other.__dict__.update(error.__dict__)
    return other


def shown(value: object) -> str:
    """Return any value as one short line for a message, with numbers of numpy as plain numbers.

    >>> shown("pi/8"), shown(10**5000)
    ("'pi/8'", 'a whole number of 16610 bits')
    """
    try:
        text = " ".join(line.strip() for line in repr(_plain(value)).splitlines())
    except ValueError:  # whole numbers of thousands of digits are not written out
        text = ""
        if isinstance(value, int):
            text = f"a whole number of {value.bit_length()} bits"
    except RecursionError:
        text = ""
    text = text or f"a {type(value).__name__}"
    return text if len(text) <= 70 else text[:70] + "…"


class _Masked:
    """What stands in messages for a masked value of numpy."""

    def __repr__(self) -> str:
        return "masked"


_MASKED = _Masked()


def _plain(value: Any) -> Any:
    """Return numpy's scalars and arrays, also inside lists and tuples, as Python's own numbers and lists."""
    # The size of a class of numbers is no number.
    has_size = isinstance(getattr(value, "size", None), int)
    if has_size and callable(getattr(value, "tolist", None)):
        few = value
        if value.size > 100 and hasattr(value, "ravel"):
            few = value.ravel()[:100]
        # Long doubles have no number of Python's own.
        plain = (few.astype(float) if few.dtype.kind == "f" else few).tolist()
        is_masked = plain is None and hasattr(value, "mask")
        return _MASKED if is_masked else plain
    if type(value) in (list, tuple):
        return type(value)(_plain(entry) for entry in value)
    return value


def _for_json(value: object) -> Any:
    """Return a value as JSON takes it; a text if it does not."""
    try:
        plain = _plain(value)
        json.dumps(plain, allow_nan=False)
    except (RecursionError, TypeError, ValueError):
        return shown(value)
    return plain


def check_kind(name: str, value: object, *kinds: type) -> None:
    """Raise InputError unless a value is of one of some kinds.

    >>> check_kind("zones", [], dict)
    Traceback (most recent call last):
    gaitgraph.errors.InputError: zones must be of the kind dict, got []
    """
    if not isinstance(value, kinds):
        names = " or ".join(kind.__name__ for kind in kinds)
        raise wrong(name, f"must be of the kind {names}", value)


def needs_extra(module: str, purpose: str, extra: str) -> MissingExtra:
    """Return what to raise where a library of an extra cannot be imported.

    >>> print(needs_extra("uvicorn", "the explorer", "explore"))
    The explorer needs uvicorn. Install it with: pip install 'gaitgraph[explore]'
    """
    who = purpose[0].upper() + purpose[1:]
    return MissingExtra(
        f"{who} needs {module}. Install it with: pip install 'gaitgraph[{extra}]'"
    )


def did_you_mean(word: object, known: Sequence[str]) -> str:
    """Return ``"; did you mean …?"`` when a known word is close, else an empty string.

    >>> did_you_mean("colour", ["color", "sign"])
    "; did you mean 'color'?"
    """
    from difflib import get_close_matches

    close = get_close_matches(word, known) if isinstance(word, str) else []
    return f"; did you mean {close[0]!r}?" if close else ""


def checked_choice(name: str, value: Any, known: Collection[str]) -> Any:
    """Return a value that is one of a few words; raise InputError for anything else."""
    if isinstance(value, str) and value in known:
        return value
    words = list(known)
    hint = did_you_mean(value, words)
    raise wrong(name, f"must be one of {', '.join(words)}", value, hint)


def check_fields(who: str, stated: object, known: Sequence[str]) -> None:
    """Raise InputError unless `stated` is a mapping of known field names; `who` begins the message."""
    if not isinstance(stated, dict):
        raise wrong(who, "must be a table of values by name", stated)
    for name in stated:
        if name not in known:
            hint = did_you_mean(name, known) or f"; the fields are {', '.join(known)}"
            raise InputError(f"{who} has no field {shown(name)}{hint}", field=str(name))
