"""The formats of gait files, by suffix; and gait files of any format: written whole or not at all, and read.

Every file states what made it (:func:`gaitgraph.gait.table.provenance_text`), where its own readers keep such things.
The libraries of an extra are loaded by the functions that need them.
"""

from __future__ import annotations

import warnings
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from gaitgraph.angles import whole_number
from gaitgraph.errors import (
    FileProblem,
    FileWarning,
    GaitgraphError,
    InputError,
    MissingExtra,
    OutputExists,
    check_kind,
    checked_choice,
    did_you_mean,
    needs_extra,
    shown,
    wrong,
)
from gaitgraph.files import (
    check_new_files,
    content_of,
    is_folder,
    is_stream,
    naming_file,
    path_of,
    reading,
    text_of,
    value_from_json,
    write_to,
    write_whole,
)
from gaitgraph.gait.table import Table, repeated, surface_of
from gaitgraph.io import binary_tables, c_header, ros, text_files
from gaitgraph.io.columns import (
    Wanted,
    table_of_columns,
)
from gaitgraph.io.servo_map import mapped_table, servo_map_named
from gaitgraph.surface.curved import CHORD_DEVIATION, sheet_of
from gaitgraph.timing.statement import checked
from gaitgraph.tolerances import DEFAULT_TOLERANCE, SAME_ANGLE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import ModuleType
    from typing import IO

    from gaitgraph.io.servo_map import ServoMap, ServoMapLike

_WHAT = "gait file"
_MOST_PERIODS = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One kind of gait file.

    Its module has ``write_SUFFIX(table, path)``, which writes a new file or folder, and
    ``read_SUFFIX(path)``, which returns its columns as a RawTable.
    """

    suffix: str
    name: str
    module: ModuleType
    library: str | None = None  # that it needs, and the extra that brings it
    extra: str | None = None
    reads: bool = True  # whether its files are read as gait tables
    folder: bool = False
    own: tuple[str, ...] = ()  # names of columns that it has for something else

    def why_not(self) -> str | None:
        """Return what is missing here, or None if the format can be used."""
        if self.library is None or self.extra is None or find_spec(self.library):
            return None
        return str(needs_extra(self.library, self.name, self.extra))

    def function(self, task: str) -> Callable[..., Any]:
        """Return what does a task, "write" or "read", as the module's docstring says; MissingExtra if it cannot."""
        missing = self.why_not()
        if missing:
            raise MissingExtra(missing)
        name = self.suffix.removeprefix(".")
        does: Callable[..., Any] = getattr(self.module, f"{task}_{name}")
        return does


_NPZ_OWN = (
    "provenance",
    "file",
    "allow_pickle",
)  # the last two are parameters of numpy.savez
_MAT_OWN = ("alpha", "alpha_rate", "alpha_acceleration", "names", "units", "provenance")

_FORMATS = (
    Format(suffix=".csv", name="CSV", module=text_files, own=("made_by",)),
    Format(suffix=".json", name="JSON", module=text_files),
    Format(suffix=".npz", name="NumPy archive", module=binary_tables, own=_NPZ_OWN),
    Format(suffix=".mat", name="MATLAB file", module=binary_tables, own=_MAT_OWN),
    Format(
        suffix=".parquet",
        name="Parquet",
        module=binary_tables,
        library="pyarrow",
        extra="table",
    ),
    Format(
        suffix=".mcap",
        name="ROS 2 bag (MCAP)",
        module=ros,
        library="rosbags",
        extra="ros",
        folder=True,
    ),
    Format(suffix=".yaml", name="ROS 2 trajectory", module=ros, reads=False),
    Format(suffix=".h", name="C header", module=c_header, reads=False),
)
FORMATS = {form.suffix: form for form in _FORMATS}
"""The formats by suffix."""

FILMS = (".gif", ".mp4")
"""Suffixes of films, which :mod:`gaitgraph.plots.films` writes."""


def tables_and_films(
    paths: Sequence[str | Path],
) -> tuple[list[str | Path], list[str | Path]]:
    """Return those of some outputs that are tables, and those that are films."""
    tables = []
    films = []
    for path in paths:
        if str(path).lower().endswith(FILMS):
            films.append(path)
        else:
            tables.append(path)
    return tables, films


_NOT_READ = "; this format is not read: use the gait table or the request"
_HINTS = {
    ".db3": "; ros2 bag convert turns it into .mcap",
    ".m": "; MATLAB and Octave load .mat",
    ".svg": "; films are .gif, .mp4",
}
_HINTS_ON_READING = _HINTS | dict.fromkeys((".yaml", ".h", ".svg", *FILMS), _NOT_READ)
_HINTS_ON_READING[".toml"] = "; a request is planned first"
_HINTS_ON_WRITING = _HINTS | dict.fromkeys(FILMS, "; films are written by animate")


def known_format(path: str | Path, what: str) -> Format:
    """Return the format of a file to write, by its suffix; InputError, which calls it `what`, for another suffix."""
    file = path_of(path, what)
    suffix = file.suffix.lower()
    if suffix in FORMATS:
        return FORMATS[suffix]
    known = list(FORMATS)
    if suffix not in FILMS:
        known += FILMS
    raise _unknown(file, "", what, known, _HINTS_ON_WRITING)


def read_format(path: str | Path, what: str, also: Sequence[str] = ()) -> Format:
    """Return the format of a file to read, by its suffix; a folder may have any name if there is a bag in it.

    InputError, which calls it `what`, for another suffix; it lists those `also` that are read.
    """
    file = path_of(path, what)
    suffix = file.suffix.lower()
    known = [form.suffix for form in _FORMATS if form.reads]
    if suffix in known:
        return FORMATS[suffix]
    beside = ""
    if suffix not in FORMATS and str(path) != "" and is_folder(file):
        if any(file.glob("*.mcap")):
            return FORMATS[".mcap"]
        beside = ", a folder without a .mcap file"
    raise _unknown(file, beside, what, known + list(also), _HINTS_ON_READING)


def _unknown(
    file: Path, beside: str, what: str, known: list[str], hints: dict[str, str]
) -> InputError:
    suffix = file.suffix.lower()
    hint = hints.get(suffix) or did_you_mean(suffix, known)
    return InputError(
        f"{what} must have one of the suffixes {', '.join(known)}, got {str(file)!r}{beside}{hint}",
        value=suffix,
        path=str(file),
    )


# -- Writing


def write_tables(
    table: Table,
    paths: Sequence[str | Path | IO[Any]],
    *,
    force: bool = False,
    periods: int = 1,
    servos: ServoMapLike | None = None,
    format: str | None = None,
) -> None:
    """Write a table to files, or folders, each whole or not at all; the format follows from the suffix.

    With a `format`, "csv" say, the one "path" is an open stream, of bytes, or of text if the format is one. A bag, which is
    a folder, has no stream.

    `servos`, a :class:`ServoMap`, a preset, a TOML file or a mapping, determines the columns of tables, and order, names,
    signs and zeros in formats of robots. The gait is written `periods` times, one after the other; a C header repeats by itself.

    Raises OutputExists if a file exists and `force` is not set, FileProblem if one cannot be written (then no file is
    changed), InputError if a suffix is not known or a file is named twice, and MissingExtra if a library is missing.
    """
    check_kind("table", table, Table)
    check_kind("paths", paths, list, tuple)
    periods = whole_number("periods", periods, 1, _MOST_PERIODS)
    servo_map = None
    if servos is not None:
        servo_map = servo_map_named(servos)
    if format is not None or any(map(is_stream, paths)):
        streams: Sequence[Any] = paths
        for stream in streams:
            with _file_for(stream, format, "write") as file:
                write_tables(table, [file], periods=periods, servos=servo_map)
                is_text = FORMATS[file.suffix].module is not binary_tables
                with file.open("rb") as content:
                    write_to(stream, content, f"a {file.suffix} file", is_text=is_text)
        return
    named = [path_of(path, "output") for path in paths]
    check_outputs(named, force=force, periods=periods)
    contents = []
    for path in named:
        form = known_format(path, "output")
        write = partial(
            form.function("write"), _table_in(form, table, periods, servo_map)
        )
        if form.module is ros:
            write = partial(write, periods=periods)
        contents.append((path, write))
    write_whole(contents, force=force)
    _warn_of_chords(table)


def _warn_of_chords(table: Table) -> None:
    """Warn if a table is on a curved sheet and straight lines between its rows leave that by more than 1e-3 rad."""
    try:
        rotors = surface_of(table)[1].rotors
    except InputError:
        return  # that the statement is malformed, reading the file says
    if rotors.asymmetry is None or len(table) == 1:
        return
    sheet, alpha = sheet_of(rotors), table.alpha
    off = sheet.distances_along(alpha[:-1], alpha[1:]).max()
    is_on_sheet = sheet.distances(alpha).max() <= DEFAULT_TOLERANCE
    if is_on_sheet and off > CHORD_DEVIATION + SAME_ANGLE:
        warnings.warn(
            f"straight lines between the {len(table)} rows leave the curved sheet by up to {off:.2g} rad; more samples "
            "are nearer",
            FileWarning,
            stacklevel=3,
        )


@contextmanager
def _file_for(stream: object, format: str | None, task: str) -> Iterator[Path]:
    """Give a path of the format, in a folder of its own, for what a stream holds; errors hold no path."""
    suffix = suffix_of_stream(stream, format, task)
    try:
        with TemporaryDirectory() as folder:
            yield Path(folder) / f"stream{suffix}"
    except GaitgraphError as error:
        error.path = None
        raise
    except OSError as error:
        message = f"a stream needs a temporary folder: {error.strerror or error}"
        raise FileProblem.of(message, error) from error


def suffix_of_stream(stream: object, format: str | None, task: str) -> str:
    """Return the suffix of the format in which a stream is read or written; InputError if it is none."""
    if not is_stream(stream):
        got = f"{shown(stream)} and the format {shown(format)}"
        raise wrong("path", "must be an open stream beside a format", stream, got=got)
    if format is None:
        hint = "; read_table(stream, format='csv') reads one"
        raise wrong("format", "must be that of the stream", None, hint)
    suffix = f".{str(format).lower().removeprefix('.')}"
    known = [form.suffix for form in _FORMATS if form.reads or task == "write"]
    known.remove(".mcap")
    checked_choice("format", suffix, known)
    return suffix


def _table_in(
    form: Format, table: Table, periods: int, servo_map: ServoMap | None
) -> Table:
    """Return the table that a format writes: as often as asked for, in the columns of a map."""
    if periods > 1 and form.reads and form.module is not ros:
        if "t" not in table:
            raise InputError(
                "column 't' is missing; periods needs a table with times", field="t"
            )
        table = repeated(table, periods)
    if servo_map is not None:
        if form.module in (ros, c_header):
            # Formats of robots state joints in their own radians, tables in the columns of the map.
            servo_map = servo_map.in_radians()
        table = mapped_table(table, servo_map)
    for name in form.own:
        if name in table:
            other = f"use another name than {', '.join(map(repr, form.own))}"
            raise InputError(
                f"column {name!r}: a {form.suffix} file has something else there; {other}",
                field=name,
            )
    return table


def check_outputs(
    paths: Sequence[str | Path], *, force: bool = False, periods: int = 1
) -> None:
    """Raise before any work is done if an output cannot be: its suffix, an extra, a name taken or given twice."""
    known = [known_format(path, "output") for path in paths]
    periods = whole_number("periods", periods, 1, _MOST_PERIODS)
    if periods > 1 and all(form.module is c_header for form in known):
        raise InputError(
            f"periods needs a table, .mcap or .yaml as output, got {periods} without one",
            field="periods",
            value=periods,
        )
    formats = dict(zip(map(Path, paths), known, strict=True))
    folders = {path for path, form in formats.items() if form.folder}
    for path, form in formats.items():
        form.function("write")  # MissingExtra, if that is so
        if path in folders and path.is_dir():
            _check_ours(path, form)
    check_new_files(paths, force=force, folders=folders)


def _check_ours(folder: Path, form: Format) -> None:
    """Raise OutputExists if there is something in a folder that the format does not write."""
    for entry in sorted(folder.iterdir()):
        is_ours = entry.name == "metadata.yaml" or entry.suffix == form.suffix
        if not (is_ours and entry.is_file()):
            wanted = f"must be a new folder or a {form.name}, got a folder with {entry.name!r} in it"
            raise OutputExists(f"output {str(folder)!r} {wanted}")


# -- Reading


def read_table(
    path: str | Path | IO[Any],
    *,
    joints: ServoMapLike | None = None,
    format: str | None = None,
) -> Table:
    """Read a gait table of any format in :data:`FORMATS`, or a plan saved as JSON.

    With a `format`, "csv" say, the "path" is an open stream of bytes or of text.
    `joints` describes the columns of a servo table from elsewhere, as `servos` of :func:`write_tables`; ours state them.
    Raises FileProblem if the file cannot be read, and InputError, with file and place, if it holds no gait table.
    """
    if format is None and not is_stream(path):
        return _checked_table(path_of(path, _WHAT), joints)
    stream: Any = path
    with _file_for(stream, format, "read") as file:
        file.write_bytes(content_of(stream, _WHAT))
        return _checked_table(file, joints, Path(file.name))


def _checked_table(
    path: Path, joints: ServoMapLike | None, name: Path | None = None
) -> Table:
    """Return the table of a file, compared with what it states; messages use the `name` instead of the path."""
    table = unchecked_table(path, joints=joints, name=name)
    with naming_file(name or path):
        return checked(table, name or path)


def unchecked_table(
    path: str | Path,
    *,
    plane_only: bool = False,
    joints: ServoMapLike | None = None,
    angles: tuple[str, ...] = (),
    name: Path | None = None,
) -> Table:
    """Read a gait table whose statement nobody has compared with its rows; errors as :func:`read_table`.

    `plane_only` and `angles` are as in :class:`gaitgraph.io.columns.Wanted`; messages use the `name` instead of the path.
    """
    read = read_format(path, _WHAT).function("read")
    path = Path(path)
    name = name or path
    with reading(name, _WHAT), naming_file(name):
        path.stat()
        servo_map = None
        if joints is not None:
            servo_map = servo_map_named(joints)
        wanted = Wanted(plane_only=plane_only, angles=angles)
        source = f"{_WHAT} {str(name)!r}"
        return table_of_columns(read(path), wanted, joints=servo_map, source=source)


def object_from_json(text: str) -> dict[str, Any]:
    """Return the object that a text of JSON holds, or raise InputError."""
    content = value_from_json(text, "it must hold an object of fields")
    if not isinstance(content, dict):
        raise InputError(
            f"it must hold an object of fields, got a {type(content).__name__}"
        )
    return content


def holds_request(path: str | Path) -> bool:
    """Return whether a file is a request, or a saved plan without a gait; FileProblem if it cannot be read."""
    path = Path(path)
    if path.suffix.lower() != ".json":
        return path.suffix.lower() == ".toml"
    text = text_of(path, "file")
    if '"waypoints"' not in text:
        return False
    with suppress(InputError):  # reading it as a gait file says what is wrong
        content = object_from_json(text)
        return (
            "waypoints" in content
            and not content.get("path")
            and "columns" not in content
        )
    return False
