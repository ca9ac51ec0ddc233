"""The formats of gait files, by suffix: which module writes and reads them, what they need, and their options.

Every file states what made it (:func:`gaitgraph.gait.table.provenance_text`), where its own readers keep such things.
The modules of the formats are loaded when a format is first used, and the libraries of an extra by their functions.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError, OutputExists, did_you_mean, needs_extra, shown
from gaitgraph.files import check_new_files, text_of, write_whole
from gaitgraph.gait.table import ANGLES, DEGREES, ORDER
from gaitgraph.io.servo_map import check_choice, mapped_table, servo_map_from_mapping

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

    from gaitgraph.errors import MissingExtra
    from gaitgraph.gait.table import Table
    from gaitgraph.io.servo_map import ServoMap

    Writer = Callable[[Iterable[Table], Path], None]
    Progress = Callable[[float], None] | None
    RawPieces = Iterator[tuple[list[tuple[str, Any]], dict[str, Any]]]
    Reader = Callable[[Path, Progress], RawPieces]

KNOWN = frozenset(ORDER) | frozenset(DEGREES)
"""The names of a gait table's columns."""

NUMBERS = ("float", "double", "fixed")
"""What the tables of a C header are made of, the default first."""

PROVENANCE_TOPIC = "/gaitgraph"
"""The topic of a bag that states what made it."""

_MOST_PERIODS = 100_000
_LONGEST_NAME = 100
_TOPIC = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,59}")


@dataclass(frozen=True, slots=True, kw_only=True)
class FormatOptions:
    """Choices that some formats of gait files have.

    Parameters
    ----------
    periods
        How often the gait is repeated in a bag or a ROS 2 trajectory.
    joint_names
        What the robot calls the joints that tilt rotors 1 to 4; by default alpha1 to alpha4. Of a table of joints the
        names of its joints, in their order; by default as the table says.
    trajectory_topic, states_topic
        The topics of a bag: JointTrajectory and JointState.
    number
        What the table of a C header is made of: "float", "double", or "fixed", which is 16-bit fixed point.
    c_name
        What the names in a C header begin with; by default the file's name.

    Raises
    ------
    InputError
        If a value is not allowed.

    Examples
    --------
    >>> FormatOptions(periods=3, joint_names=("a", "b", "c", "d")).chosen()
    ['periods', 'joint_names']
    """

    periods: int = 1
    joint_names: tuple[str, ...] | None = None
    trajectory_topic: str = "/joint_trajectory"
    states_topic: str = "/joint_states"
    number: str = NUMBERS[0]
    c_name: str | None = None

    def __post_init__(self) -> None:
        periods = self.periods
        if isinstance(periods, bool) or not isinstance(periods, int) or not 1 <= periods <= _MOST_PERIODS:
            raise InputError(f"periods must be a whole number from 1 to {_MOST_PERIODS}, got {shown(periods)}")
        if self.joint_names is not None:
            self._check_joint_names(self.joint_names)
        for name in ("trajectory_topic", "states_topic"):
            topic = getattr(self, name)
            if not (isinstance(topic, str) and len(topic) <= 255 and _TOPIC.fullmatch(topic)):
                raise InputError(f"{name} must be a topic such as '/arm/joint_states', got {shown(topic)}")
            if topic == PROVENANCE_TOPIC:
                raise InputError(f"{name} must not be {topic!r}, which states what made the bag")
        if self.trajectory_topic == self.states_topic:
            raise InputError(f"states_topic must differ from trajectory_topic, got {self.states_topic!r} for both")
        check_choice(self.number, NUMBERS, "number")
        if self.c_name is not None and not (isinstance(self.c_name, str) and _IDENTIFIER.fullmatch(self.c_name)):
            raise InputError(
                f"c_name must be up to 60 letters, digits and underscores, a letter first, got {shown(self.c_name)}"
            )

    def _check_joint_names(self, names: object) -> None:
        if not isinstance(names, tuple) or len(names) != len(ANGLES):
            raise InputError(f"joint_names must be four names, for rotors 1 to 4, got {shown(names)}")
        for name in names:
            printable = isinstance(name, str) and name.isprintable() and name == name.strip()
            if not printable or not 0 < len(name) <= _LONGEST_NAME:
                raise InputError(
                    f"joint_names must be printable texts of up to {_LONGEST_NAME} characters, got {shown(name)}"
                )
        if len(set(names)) < len(names):
            raise InputError(f"joint_names must differ, got {shown(names)}")

    def joints_of(self, table: Table) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Return the names of a table's four joints, and which rotor each of them tilts.

        A table of joints states both; names that were chosen replace those.
        """
        names: tuple[str, ...] = ANGLES
        rotors: tuple[int, ...] = (1, 2, 3, 4)
        if "servos" in table.about:
            servo_map = servo_map_from_mapping(table.about["servos"])
            names, rotors = servo_map.joint_names, tuple(joint.rotor for joint in servo_map.joints)
        return names if self.joint_names is None else self.joint_names, rotors

    def chosen(self) -> list[str]:
        """Return the names of the options that are not at their default."""
        return [one.name for one in fields(self) if getattr(self, one.name) != one.default]


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One kind of gait file.

    Parameters
    ----------
    suffix
        How its files' names end, with the dot.
    name
        What people call it.
    module
        The module that has its functions: ``write_SUFFIX(pieces, path)`` writes a new file or folder from the pieces of
        a table; ``pieces_of_SUFFIX(path, progress)`` yields raw columns and what made them, piece by piece.
    library, extra
        The library that it needs, and the extra that brings it, if it needs any.
    mark, end
        Of a format that is not read as a table, and is text: how the line begins that states what made it, and the
        last line.
    folder
        Whether it is a folder of files.
    options
        Which fields of :class:`FormatOptions` its writer heeds; the writer is then given the options.
    """

    suffix: str
    name: str
    module: str
    library: str | None = None
    extra: str | None = None
    mark: str = ""
    end: str = ""
    folder: bool = False
    options: tuple[str, ...] = ()

    @property
    def reads(self) -> bool:
        """Whether its files are read as gait tables."""
        return not self.mark

    def why_not(self) -> str | None:
        """Return what is missing here, or None if the format can be used."""
        missing = self._missing()
        return None if missing is None else str(missing)

    def _missing(self) -> MissingExtra | None:
        if self.library is None or self.extra is None or find_spec(self.library):
            return None
        return needs_extra(self.library, self.name, self.extra)

    def _function(self, task: str) -> Any:
        if missing := self._missing():
            raise missing
        return getattr(import_module(self.module), f"{task}_{self.suffix.removeprefix('.')}")

    def writer(self, options: FormatOptions | None = None) -> Writer:
        """Return what writes a new file or folder from the pieces of a table; MissingExtra if it cannot."""
        found = self._function("write")
        return partial(found, options=options or FormatOptions()) if self.options else found

    def reader(self) -> Reader:
        """Return what yields the raw columns of a file; MissingExtra if it cannot."""
        found: Reader = self._function("pieces_of")
        return found

    def provenance(self, path: Path) -> str:
        """Return the text of what made a file of a format that is not read as a table.

        Raises
        ------
        FileProblem, InputError
            If the file cannot be read, does not state it, or was cut off.
        """
        lines = text_of(path, "gait file", f"a {self.name} that gaitgraph wrote").rstrip().splitlines()
        line = next((line for line in lines if line.startswith(self.mark)), None)
        if line is None:
            raise InputError(f"it does not state what made it; it must be a {self.name} that gaitgraph wrote")
        if lines[-1].rstrip() != self.end:
            raise InputError(f"it ends early: its last line must be {self.end!r}, got {shown(lines[-1])}")
        return line.removeprefix(self.mark)


_BAG_OPTIONS = ("periods", "joint_names", "trajectory_topic", "states_topic")
_BINARY, _CODE, _ROS = "gaitgraph.io.binary_tables", "gaitgraph.io.code_files", "gaitgraph.io.ros"

FORMATS = {
    one.suffix: one
    for one in (
        Format(suffix=".csv", name="CSV", module="gaitgraph.io.text_files"),
        Format(suffix=".json", name="JSON", module="gaitgraph.io.text_files"),
        Format(suffix=".npz", name="NumPy archive", module=_BINARY),
        Format(suffix=".mat", name="MATLAB file", module=_BINARY),
        Format(suffix=".m", name="MATLAB script", module=_CODE, mark="% made by: ", end="% end"),
        Format(suffix=".parquet", name="Parquet", module=_BINARY, library="pyarrow", extra="table"),
        *(
            Format(
                suffix=suffix,
                name=f"ROS 2 bag ({storage})",
                module=_ROS,
                library="rosbags",
                extra="ros",
                folder=True,
                options=_BAG_OPTIONS,
            )
            for suffix, storage in ((".mcap", "MCAP"), (".db3", "sqlite3"))
        ),
        Format(
            suffix=".yaml",
            name="ROS 2 trajectory",
            module=_ROS,
            mark="# made_by: ",
            end="# end",
            options=("periods", "joint_names"),
        ),
        Format(
            suffix=".h",
            name="C header",
            module=_CODE,
            mark=" * made_by: ",
            end="#endif",
            options=("joint_names", "number", "c_name"),
        ),
    )
}
"""The formats by suffix."""

FILMS = (".gif", ".mp4")
"""Suffixes of films, which :mod:`gaitgraph.plots.films` writes."""


def readable_suffixes() -> list[str]:
    """Return the suffixes of files that are read as gait tables.

    >>> readable_suffixes()[:3]
    ['.csv', '.json', '.npz']
    """
    return [suffix for suffix, one in FORMATS.items() if one.reads]


def known_format(path: str | Path, what: str, *, reads: bool = False) -> Format:
    """Return the format of a gait file by its suffix.

    Parameters
    ----------
    path
        The file; capitals in its suffix do not matter. A folder to be read may have another name, if the files in it
        are those of a bag.
    what
        What messages call it.
    reads
        Whether it is to be read as a table.

    Raises
    ------
    InputError
        If the suffix is not known.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    known = readable_suffixes() if reads else list(FORMATS)
    is_folder = reads and path.is_dir()
    if is_folder and suffix not in FORMATS:
        try:
            inside = {file.suffix.lower() for file in path.iterdir() if file.is_file()}
        except OSError:
            inside = set()
        suffix = next((one.suffix for one in FORMATS.values() if one.folder and one.suffix in inside), suffix)
    if suffix not in known:
        hint = did_you_mean(suffix, known) if suffix else ""
        which = f"{str(path)!r}, a folder that is no ROS 2 bag" if is_folder else repr(str(path))
        raise InputError(f"{what} must have one of the suffixes {', '.join(known)}, got {which}{hint}")
    return FORMATS[suffix]


def check_options(options: FormatOptions, formats: Iterable[Format]) -> None:
    """Raise InputError if an option is chosen that none of the formats has."""
    there = {name for one in formats for name in one.options}
    for name in options.chosen():
        if name not in there:
            suffixes = ", ".join(suffix for suffix, one in FORMATS.items() if name in one.options)
            raise InputError(f"{name} needs an output {suffixes}, got {shown(getattr(options, name))} without one")


def check_names(names: Iterable[str], own: Collection[str], suffix: str) -> None:
    """Raise InputError if a column of joints has a name that a format gives to something of its own.

    >>> check_names(["t", "alpha1"], ["made_by"], ".csv")
    """
    for name in names:
        if name in own:
            raise InputError(
                f"column {name!r}: a {suffix} file has something else there; use another name than "
                f"{', '.join(map(repr, own))}"
            )


def write_tables(
    table: Table,
    paths: Sequence[str | Path],
    *,
    force: bool = False,
    options: FormatOptions | None = None,
    servos: ServoMap | None = None,
) -> None:
    """Write a table to files, each whole or not at all; the format follows from the suffix.

    Parameters
    ----------
    table
        What to write.
    paths
        Files, or folders for the formats that are folders; :data:`gaitgraph.io.formats.FORMATS` has the suffixes.
    force
        Overwrite files that exist.
    options
        Choices that some formats have; the others ignore them.
    servos
        What the columns are to be, in formats of tables; the joints' order, signs and zeros in formats of robots.
        Pictures and MATLAB functions do not change.

    Raises
    ------
    OutputExists
        If a file exists and `force` is not set; then none is written.
    FileProblem
        If a file cannot be written; the old one, if any, is whole.
    InputError
        If a suffix is not known or a file is named twice.
    MissingExtra
        If a format needs a library that is not installed.
    """
    write_pieces(lambda: [table], paths, force=force, options=options, servos=servos)


def write_pieces(
    pieces: Callable[[], Iterable[Table]],
    paths: Sequence[str | Path],
    *,
    force: bool = False,
    options: FormatOptions | None = None,
    servos: ServoMap | None = None,
) -> None:
    """Write a table that comes piece by piece, as :func:`write_tables` does.

    Parameters
    ----------
    pieces
        Called once a file; its pieces have the same columns, and the first states what made them.
    paths, force, options, servos
        As for :func:`write_tables`.
    """
    check_outputs(paths, force=force)

    def write(form: Format, scratch: Path) -> None:
        form.writer(options)(pieces() if servos is None else _for_servos(pieces(), servos, form), scratch)

    write_whole([(Path(path), partial(write, known_format(path, "output"))) for path in paths], force=force)


def _for_servos(pieces: Iterable[Table], servos: ServoMap, form: Format) -> Iterator[Table]:
    """Yield pieces as a format states joints: in its own radians, or in the columns of the map."""
    rows = 0
    for piece in pieces:
        if "joint_names" in form.options:
            yield mapped_table(piece, servos.in_radians(), rows_before=rows)
        else:
            yield mapped_table(piece, servos, rows_before=rows) if form.reads else piece
        rows += len(piece)


def check_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any work is done if an output cannot be: its suffix, an extra, a name taken or given twice."""
    folders = set()
    for path in map(Path, paths):
        form = known_format(path, "output")
        form.writer()  # MissingExtra, if that is so
        if form.folder:
            folders.add(path)
            for one in sorted(path.iterdir()) if path.is_dir() else ():
                if not one.is_file() or (one.name != "metadata.yaml" and one.suffix != form.suffix):
                    problem = f"is a folder with {one.name!r} in it; allowed is a new one, or a {form.name}"
                    raise OutputExists(f"output: {str(path)!r} {problem}")
    check_new_files(paths, force=force, folders=folders)
