"""Reading text files, and writing files whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import shutil
import signal
import tempfile
import traceback
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gaitgraph.errors import (
    Advice,
    FileProblem,
    GaitgraphError,
    InputError,
    MissingExtra,
    OutputExists,
    reworded,
    shown,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    Content = bytes | Callable[[Path], None]

T = TypeVar("T")

MOST_BYTES = 1 << 30
"""Files that are read whole may have this many bytes at most."""

_DEEPEST = 100
_OVERWRITE = Advice("overwrite it with force=True", "overwrite it with --force")


def path_of(value: object, what: str) -> Path:
    """Return a path; InputError, which calls it `what`, for anything else."""
    if not isinstance(value, (str, Path)):
        raise InputError(f"{what} must be the path of a file, got {shown(value)}")
    return Path(value)


def text_of(path: Path, what: str) -> str:
    """Return the text of a UTF-8 file of up to :data:`MOST_BYTES`; errors, which call it `what`, as of :func:`reading`.

    A byte-order mark is left out.
    """
    with reading(path, what):
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise InputError(
                f"{what} {str(path)!r} must have at most {MOST_BYTES >> 20} MiB, got {size >> 20} MiB",
                file=str(path),
            )
        return path.read_text(encoding="utf-8-sig")


def pass_interruption(error: BaseException) -> None:
    """Raise what interrupted a reader or writer, if an error is that or stems from it; else return.

    That is what a signal handler raised, or a TimeoutError without the number that the system gives its own. It says
    nothing about the file.
    """
    handlers = map(signal.getsignal, signal.valid_signals())
    codes = {getattr(handler, "__code__", None) for handler in handlers}
    cause: BaseException | None = error
    while cause is not None:
        frames = traceback.walk_tb(cause.__traceback__)
        in_handler = any(frame.f_code in codes for frame, _ in frames)
        if in_handler or (isinstance(cause, TimeoutError) and cause.errno is None):
            raise cause
        hidden = cause.__context__ if cause.__suppress_context__ else None
        cause = cause.__cause__ or hidden


@contextlib.contextmanager
def reading(path: Path, what: str) -> Iterator[None]:
    """Raise FileProblem if a file cannot be read, and InputError if it is not UTF-8 text; both name the file."""
    if "\0" in str(path):  # Python raises a ValueError of no particular kind
        raise FileProblem(
            f"{what} {str(path)!r} cannot be read: it has a null character"
        )
    try:
        yield
    except UnicodeDecodeError as error:
        got = "got other bytes" + "; in Excel save it as CSV UTF-8" * (
            what != "certificate"
        )
        raise InputError(
            f"{what} {str(path)!r} must be UTF-8 text, {got}", file=str(path)
        ) from error
    except OSError as error:
        if isinstance(error, GaitgraphError):
            raise
        pass_interruption(error)
        reason = error.strerror or error
        raise FileProblem(f"{what} {str(path)!r} cannot be read: {reason}") from error


@contextlib.contextmanager
def naming_file(source: object, what: str = "gait file") -> Iterator[None]:
    """Name the file, once, in errors about its content; errors stay as they are if the source is not a path."""
    try:
        yield
    except (MissingExtra, FileProblem):
        raise
    except GaitgraphError as error:
        if not isinstance(source, (str, Path)) or error.file is not None:
            raise
        named = reworded(error, f"{what} {str(source)!r}: {error.message}")
        named.file = str(source)
        raise named from error


def table_from_toml(text: str) -> dict[str, Any]:
    """Return what a TOML text holds, or raise InputError in one line.

    Keys of more than 100 dotted parts are refused first: Python's reader takes quadratic time and memory for them.
    """
    import tomllib

    for run in re.split(r"[^\w.\"' \t-]+", text):
        if run.count(".") > _DEEPEST:
            raise InputError(
                f"it is nested too deeply: a key must have at most {_DEEPEST} dotted parts"
            )
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise InputError("it is nested too deeply") from error
    except ValueError as error:
        pass_interruption(error)
        hint = "texts need quotes, as in '30deg', and numbers a decimal point"
        raise InputError(
            f"it is not TOML ({str(error).splitlines()[0]}); {hint}"
        ) from error


def value_from_json(text: str | bytes, wanted: str) -> Any:
    """Return what a JSON text holds; InputError if it is broken, or an object has a name twice."""

    def fields_of(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        fields = dict(pairs)
        if len(fields) < len(pairs):
            twice = next(
                name
                for name, count in Counter(name for name, _ in pairs).items()
                if count > 1
            )
            raise InputError(
                f"names in an object must differ, got {shown(twice)} twice"
            )
        return fields

    def refused(name: str) -> None:
        raise ValueError(f"{name} is no number of JSON")

    try:
        return json.loads(text, parse_constant=refused, object_pairs_hook=fields_of)
    except InputError:
        raise
    except (RecursionError, ValueError) as error:
        pass_interruption(error)
        why = (
            "it is nested too deeply"
            if isinstance(error, RecursionError)
            else str(error).splitlines()[0]
        )
        raise InputError(f"it is not JSON ({why}); {wanted}") from error


def from_toml_file(path: Path, what: str, make: Callable[[dict[str, Any]], T]) -> T:
    """Return what `make` returns for the fields of a TOML file, at its top level or in its one table `what`.

    Raises FileProblem if the file cannot be read; errors of `make` name the file.
    """
    text = text_of(path, what)
    try:
        content = table_from_toml(text)
        inner = content.get(what, content)
        if not isinstance(inner, dict):
            raise InputError(
                f"{what} must be a table of values by name, got {shown(inner)}"
            )
        if inner is not content and len(content) > 1:
            beside = next(name for name in content if name != what)
            raise InputError(
                f"{beside} must be inside the [{what}] table, got it beside the table"
            )
        return make(inner)
    except GaitgraphError as error:
        raise reworded(error, f"{what} file {str(path)!r}: {error.message}") from error


def write_whole(contents: Sequence[tuple[Path, Content]], *, force: bool) -> None:
    """Write every file or folder beside its target first, then put all in place, each in one step.

    Contents are paths, each with the bytes of a file, or with a function that writes a new file or folder at a path.
    Raises OutputExists if something has the name by now and `force` is not set, and FileProblem if the file system
    refuses; existing files are then unchanged. Leftovers of killed processes beside the targets are removed.
    """
    path, wholes = Path(), list[Path]()
    with contextlib.ExitStack() as stack:
        try:
            for path, content in contents:
                target = target_of(path)
                whole = stack.enter_context(_scratch_in(target.parent)) / target.name
                wholes.append(whole)
                if isinstance(content, bytes):
                    whole.write_bytes(content)
                else:
                    content(whole)
                # Bring all bytes to the disk, with the permissions of what they replace.
                for file in sorted(whole.iterdir()) if whole.is_dir() else [whole]:
                    with file.open("rb") as stream:
                        os.fsync(stream.fileno())
                    replaced = target if file == whole else target / file.name
                    if replaced.exists():
                        shutil.copymode(replaced, file)
            for (path, _), whole in zip(contents, wholes, strict=True):
                place = _replace if force else _place_new
                place(whole, target_of(path) if force else path)
        except FileExistsError as error:
            raise _exists(path) from error
        except OSError as error:
            if isinstance(error, GaitgraphError):
                raise
            pass_interruption(error)
            raise FileProblem(
                f"output {str(path)!r} cannot be written: {error.strerror or error}"
            ) from error


@contextlib.contextmanager
def _scratch_in(folder: Path) -> Iterator[Path]:
    """Make a hidden folder to write in, locked while it is used, and remove it after."""
    remove_leftovers(folder)
    while True:
        scratch = Path(
            tempfile.mkdtemp(prefix=".gaitgraph-", suffix=".part", dir=folder)
        )
        lock = _locked(scratch, wait=True)
        if (
            scratch.exists()
        ):  # before it was locked, another process may have taken it for a leftover
            break
    try:
        yield scratch
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _locked(folder: Path, *, wait: bool) -> int | None:
    """Return a descriptor that locks a folder until it is closed or the process ends, or None.

    None: another process holds the lock, or folders have no locks, as on Windows and some network file systems.
    """
    try:
        import fcntl

        lock = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
    except (ImportError, OSError):
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        os.close(lock)
        return None
    return lock


def remove_leftovers(folder: Path) -> None:
    """Remove hidden folders of our own killed processes; those of running processes are locked.

    A folder that such a process had moved aside, to replace it, is put back.
    """
    for scratch in folder.glob(".gaitgraph-????????.part"):
        lock = _locked(scratch, wait=False)
        if lock is None:
            continue
        with contextlib.suppress(OSError):
            if os.fstat(lock).st_uid == os.getuid():
                for old in scratch.glob("*.old"):
                    if not os.path.lexists(folder / old.stem):
                        old.rename(folder / old.stem)
                shutil.rmtree(scratch)
        os.close(lock)


def _exists(path: Path) -> OutputExists:
    return OutputExists(f"output {str(path)!r} exists", advice=_OVERWRITE)


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
                raise InputError(f"outputs must differ, got {str(path)!r} twice")
            seen.add(target)
            if target.exists() and not (
                target.is_dir() if path in folders else target.is_file()
            ):
                got = (
                    "a folder"
                    if target.is_dir()
                    else "a file"
                    if target.is_file()
                    else "a special file"
                )
                wanted = "a new folder" if path in folders else "a regular file"
                raise OutputExists(f"output {str(path)!r} must be {wanted}, got {got}")
            if os.path.lexists(path) and not force:
                raise _exists(path)
            if not path.parent.is_dir():
                what = "is not a folder" if path.parent.exists() else "does not exist"
                raise FileProblem(f"output folder {str(path.parent)!r} {what}")
        except GaitgraphError:
            raise
        except (OSError, ValueError) as error:  # a name that the file system refuses
            reason = getattr(error, "strerror", None) or error
            raise FileProblem(
                f"output {shown(str(path))} cannot be written: {reason}"
            ) from error


def target_of(path: Path) -> Path:
    """Return the file that a path names, with links resolved."""
    return Path(os.path.realpath(path))


def _replace(whole: Path, target: Path) -> None:
    """Give a finished file or folder its name, replacing the old one; of several processes the last one wins."""
    if not whole.is_dir():
        whole.replace(target)
        return
    aside = whole.with_name(
        f"{target.name}.old"
    )  # a folder takes the place of another only while that one is away
    while True:
        try:
            with contextlib.suppress(FileNotFoundError):
                target.rename(aside)
            whole.rename(target)
            return
        except OSError as error:
            if error.errno not in (errno.EEXIST, errno.ENOTEMPTY):
                raise
            shutil.rmtree(
                aside, ignore_errors=True
            )  # another process took the place meanwhile: once more
        finally:
            if aside.exists() and not os.path.lexists(
                target
            ):  # interrupted, or refused
                aside.rename(target)


def _place_new(whole: Path, path: Path) -> None:
    """Give a finished file or folder its name unless something has that name by now."""
    if whole.is_dir():
        path.mkdir()  # nobody else takes the name from here on
        whole.rename(path)
        return
    try:
        os.link(whole, path)
    except OSError:  # the name is taken, or the file system has no hard links
        if os.path.lexists(path):
            raise FileExistsError(str(path)) from None
        whole.replace(path)
