"""Reading text files, and writing files whole or not at all."""

from __future__ import annotations

import codecs
import contextlib
import errno
import io
import json
import os
import shutil
import tempfile
from collections import Counter
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

from gaitgraph.errors import (
    Advice,
    FileProblem,
    GaitgraphError,
    InputError,
    MissingExtra,
    OutputExists,
    reworded,
    shown,
    wrong,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from typing_extensions import TypeIs

    Content = bytes | Callable[[Path], None]

T = TypeVar("T")

_OVERWRITE = Advice("overwrite it with force=True", "overwrite it with --force")


def path_of(value: object, what: str) -> Path:
    """Return a path; InputError, which calls it `what`, for anything else."""
    if not isinstance(value, (str, Path)):
        field = what if what.isidentifier() else "path"
        raise wrong(what, "must be the path of a file", value, field=field)
    return Path(value)


def is_folder(path: Path) -> bool:
    """Return whether a path is that of a folder; False where no file can have the name."""
    try:
        return path.is_dir()
    except OSError:  # the name is too long
        return False


def is_stream(value: object) -> TypeIs[IO[Any]]:
    """Return whether a value is an open stream, of bytes or of text, which may be given instead of a path."""
    # Gaits and other answers have a method `write` too, and frames may have a column of any name.
    methods = (getattr(value, name, None) for name in ("read", "writelines", "flush"))
    return any(map(callable, methods))


def content_of(stream: IO[Any], what: str) -> bytes:
    """Return the rest of a stream, text as UTF-8; InputError or FileProblem, which call it `what`, if it has none."""
    try:
        content = stream.read()
        if content is None:
            raise BlockingIOError("it has nothing to read now")
        return content.encode() if isinstance(content, str) else bytes(content)
    except UnicodeError as error:
        raise InputError(f"{what} must be UTF-8 text, got other bytes") from error
    except io.UnsupportedOperation as error:
        message = f"{what} must be a stream that is open for reading, got another"
        raise FileProblem.of(message, error) from error
    except Exception as error:  # of whatever library the stream is
        message = f"{what} cannot be read from the stream: {error}"
        raise FileProblem.of(message, error) from error


def write_to(stream: IO[Any], content: IO[bytes], what: str, *, is_text: bool) -> None:
    """Write content to a stream of bytes in pieces, UTF-8 text to one of text too; InputError or FileProblem if not."""
    source: Any = content
    try:
        piece = source.read(io.DEFAULT_BUFFER_SIZE)
        try:
            _write_piece(stream, piece)
        except TypeError:
            if not is_text:
                raise InputError(
                    f"{what} needs a stream of bytes, got one of text"
                ) from None
            content.seek(0)
            source = codecs.getreader("utf-8")(content)
        piece = source.read(io.DEFAULT_BUFFER_SIZE)
        while piece:
            _write_piece(stream, piece)
            piece = source.read(io.DEFAULT_BUFFER_SIZE)
    except InputError:
        raise
    except io.UnsupportedOperation as error:
        message = f"{what} needs a stream that is open for writing, got another"
        raise FileProblem.of(message, error) from error
    except Exception as error:  # of whatever library the stream is
        message = f"{what} cannot be written to the stream: {error}"
        raise FileProblem.of(message, error) from error


def _write_piece(stream: Any, piece: Any) -> None:
    """Write all of a piece; a stream without a buffer may take less of it than it is given."""
    left = piece
    while True:
        taken = stream.write(left)
        is_full = taken is None and isinstance(stream, io.RawIOBase)
        if is_full or (taken == 0 and left):
            raise BlockingIOError("it takes nothing more")
        if taken is None or taken >= len(left):
            break
        left = left[taken:]


def text_of(source: Path | IO[Any], what: str) -> str:
    """Return the text of a UTF-8 file or stream, without a byte-order mark; errors call it `what`."""
    if is_stream(source):
        try:
            return content_of(source, what).decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise InputError(f"{what} must be UTF-8 text, got other bytes") from error
    with reading(source, what):
        return source.read_text(encoding="utf-8-sig")


@contextlib.contextmanager
def reading(path: Path, what: str) -> Iterator[None]:
    """Raise FileProblem if a file cannot be read, and InputError if it is not UTF-8 text; both name the file."""
    if "\0" in str(path):  # Python raises a ValueError of no particular kind
        raise FileProblem(
            f"{what} {str(path)!r} cannot be read: it has a null character",
            path=str(path),
        )
    try:
        yield
    except UnicodeDecodeError as error:
        got = "got other bytes" + "; in Excel save it as CSV UTF-8" * (
            what != "certificate"
        )
        raise InputError(
            f"{what} {str(path)!r} must be UTF-8 text, {got}", path=str(path)
        ) from error
    except OSError as error:
        if isinstance(error, GaitgraphError):
            raise
        message = f"{what} {str(path)!r} cannot be read: {_reason(error)}"
        raise FileProblem.of(message, error, path) from error


@contextlib.contextmanager
def naming_file(source: object, what: str = "gait file") -> Iterator[None]:
    """Name the file, once, in errors about its content; errors stay as they are if the source is not a path."""
    try:
        yield
    except (MissingExtra, FileProblem):
        raise
    except GaitgraphError as error:
        if not isinstance(source, (str, Path)) or error.path is not None:
            raise
        named = reworded(error, f"{what} {str(source)!r}: {error.message}")
        named.path = str(source)
        raise named from error


def _reason(error: Exception) -> object:
    """Return what an error of the system says, without number and name of the file."""
    return getattr(error, "strerror", None) or error


def table_from_toml(text: str) -> dict[str, Any]:
    """Return what a TOML text holds, or raise InputError in one line."""
    import tomllib

    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise InputError("it is nested too deeply") from error
    except ValueError as error:
        hint = "texts need quotes, as in '30deg', and numbers a decimal point"
        raise InputError(
            f"it is not TOML ({str(error).splitlines()[0]}); {hint}"
        ) from error


def value_from_json(text: str | bytes, wanted: str) -> Any:
    """Return what a JSON text holds; InputError if it is broken, or an object has a name twice."""
    try:
        return json.loads(
            text, parse_constant=_no_number, object_pairs_hook=_different_names
        )
    except InputError:
        raise
    except RecursionError as error:
        raise InputError(
            f"it is not JSON (it is nested too deeply); {wanted}"
        ) from error
    except ValueError as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"it is not JSON ({reason}); {wanted}") from error


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _different_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    for name, count in Counter(name for name, _ in pairs).items():
        if count > 1:
            raise wrong("names in an object", "must differ", name, " twice", field=name)
    return dict(pairs)


def from_toml_file(
    source: Path | IO[Any], what: str, make: Callable[[dict[str, Any]], T]
) -> T:
    """Return what `make` returns for the fields of a TOML file or stream, at its top level or in its one table `what`.

    Raises FileProblem if the file cannot be read; errors of `make` name the file.
    """
    text = text_of(source, what)
    try:
        content = table_from_toml(text)
        inner = content.get(what, content)
        if not isinstance(inner, dict):
            raise wrong(what, "must be a table of values by name", inner)
        if inner is not content and len(content) > 1:
            beside = next(name for name in content if name != what)
            raise InputError(
                f"{beside} must be inside the [{what}] table, got it beside the table",
                field=beside,
            )
        return make(inner)
    except GaitgraphError as error:
        if is_stream(source):
            raise
        named = reworded(error, f"{what} file {str(source)!r}: {error.message}")
        named.path = error.path or str(source)  # of a file that the fields name
        raise named from error


def write_whole(contents: Sequence[tuple[Path, Content]], *, force: bool) -> None:
    """Write every file or folder beside its target first, then put all in place.

    Contents are paths, each with the bytes of a file, or with a function that writes a new file or folder at a path.
    Raises OutputExists if something has the name by now and `force` is not set, and FileProblem if the file system
    refuses it.
    """
    path = Path()
    try:
        with contextlib.ExitStack() as stack:
            finished = []
            for path, content in contents:
                target = target_of(path)
                folder = tempfile.TemporaryDirectory(
                    prefix=".gaitgraph-", dir=target.parent
                )
                whole = Path(stack.enter_context(folder)) / path.name
                if isinstance(content, bytes):
                    whole.write_bytes(content)
                else:
                    content(whole)
                if os.path.lexists(path) and not force:
                    raise _exists(path)
                finished.append((whole, target))
            for whole, target in finished:
                _replace(whole, target)
    except OSError as error:
        if isinstance(error, GaitgraphError):
            raise
        message = f"output {str(path)!r} cannot be written: {_reason(error)}"
        raise FileProblem.of(message, error, path) from error


def _replace(whole: Path, target: Path) -> None:
    """Give a finished file or folder its name, with the permissions of the old one."""
    if target.is_dir():  # a folder takes the place of another only while that is away
        target.replace(whole.with_name(f"{target.name}.old"))
    elif target.exists():
        shutil.copymode(target, whole)
    whole.replace(target)


def _exists(path: Path) -> OutputExists:
    exists = FileExistsError(errno.EEXIST, "it exists")
    return OutputExists.of(f"output {str(path)!r} exists", exists, path, _OVERWRITE)


def check_new_files(
    paths: Sequence[str | Path], *, force: bool, folders: Collection[Path] = ()
) -> None:
    """Raise before any work is done if one of these files, or `folders` among them, cannot be written.

    Raises InputError if a file is named twice, OutputExists if something has the name and is no file or `force` is not
    set, and FileProblem if the folder does not exist or the file system refuses the name.
    """
    seen: set[Path] = set()
    for path in map(Path, paths):
        try:
            target = target_of(path)
            if target in seen:
                raise InputError(
                    f"outputs must differ, got {str(path)!r} twice",
                    field="outputs",
                    value=str(path),
                )
            seen.add(target)
            _check_new(path, target, force=force, is_folder=path in folders)
        except GaitgraphError as problem:
            problem.path = str(path)
            raise
        except (OSError, ValueError) as error:  # a name that the file system refuses
            name = shown(str(path))
            message = f"output {name} cannot be written: {_reason(error)}"
            raise FileProblem.of(message, error, path) from error


def _check_new(path: Path, target: Path, *, force: bool, is_folder: bool) -> None:
    got = _kind_of(target)
    wanted = "a folder" if is_folder else "a file"
    if got not in ("nothing", wanted):
        new = "a new folder" if is_folder else "a regular file"
        exists = FileExistsError(errno.EEXIST, "it exists")
        message = f"output {str(path)!r} must be {new}, got {got}"
        raise OutputExists.of(message, exists, path)
    if os.path.lexists(path) and not force:
        raise _exists(path)
    if not path.parent.is_dir():
        what = "is not a folder" if path.parent.exists() else "does not exist"
        missing = FileNotFoundError(errno.ENOENT, what)
        message = f"output folder {str(path.parent)!r} {what}"
        raise FileProblem.of(message, missing, path)


def _kind_of(target: Path) -> str:
    if target.is_dir():
        return "a folder"
    if target.is_file():
        return "a file"
    return "a special file" if target.exists() else "nothing"


def target_of(path: Path) -> Path:
    """Return the file that a path names, with links resolved."""
    return Path(os.path.realpath(path))
