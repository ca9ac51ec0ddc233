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

from gaitgraph.errors import InputError, MissingExtra, OutputExists, did_you_mean, needs_extra, shown
from gaitgraph.files import check_new_files, text_of, write_whole
from gaitgraph.gait.table import ANGLES, DEGREES, ORDER
from gaitgraph.io.servo_map import check_choice, mapped_table, servo_map_from_mapping

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

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

    Examples
    --------
    >>> options = FormatOptions(periods=3, joint_names=("front", "left", "rear", "right"))
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
        names: Any = ANGLES if self.joint_names is None else self.joint_names
        if not isinstance(names, tuple) or len(names) != len(ANGLES):
            raise InputError(f"joint_names must be four names, for rotors 1 to 4, got {shown(names)}")
        for name in names:
            printable = isinstance(name, str) and name.isprintable() and name == name.strip()
            if not printable or not 0 < len(name) <= _LONGEST_NAME:
                wanted = f"printable texts of up to {_LONGEST_NAME} characters"
                raise InputError(f"joint_names must be {wanted}, got {shown(name)}")
        if len(set(names)) < len(names):
            raise InputError(f"joint_names must differ, got {shown(names)}")
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
            allowed = "up to 60 letters, digits and underscores, a letter first"
            raise InputError(f"c_name must be {allowed}, got {shown(self.c_name)}")

    def joints_of(self, table: Table) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Return the names of a table's four joints, as chosen or stated, and which rotor each of them tilts."""
        names: tuple[str, ...] = ANGLES
        rotors: tuple[int, ...] = (1, 2, 3, 4)
        if "servos" in table.about:
            servo_map = servo_map_from_mapping(table.about["servos"])
            names, rotors = servo_map.joint_names, tuple(joint.rotor for joint in servo_map.joints)
        return names if self.joint_names is None else self.joint_names, rotors


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
        if self.library is None or self.extra is None or find_spec(self.library):
            return None
        return str(needs_extra(self.library, self.name, self.extra))

    def writer(self, options: FormatOptions | None = None) -> Writer:
        """Return what writes a new file or folder from the pieces of a table; MissingExtra if it cannot."""
        found: Any = self._function("write")
        return partial(found, options=options or FormatOptions()) if self.options else found

    def reader(self) -> Reader:
        """Return what yields the raw columns of a file; MissingExtra if it cannot."""
        found: Reader = self._function("pieces_of")
        return found

    def _function(self, task: str) -> Any:
        if missing := self.why_not():
            raise MissingExtra(missing)
        return getattr(import_module(self.module), f"{task}_{self.suffix.removeprefix('.')}")

    def provenance(self, path: Path) -> str:
        """Return the text of what made a file of a format that is not read as a table; InputError if it is cut off."""
        lines = text_of(path, "gait file", f"a {self.name} that gaitgraph wrote").rstrip().splitlines()
        line = next((line for line in lines if line.startswith(self.mark)), None)
        if line is None:
            raise InputError(f"it does not state what made it; it must be a {self.name} that gaitgraph wrote")
        if lines[-1].rstrip() != self.end:
            raise InputError(f"it ends early: its last line must be {self.end!r}, got {shown(lines[-1])}")
        return line.removeprefix(self.mark)


_BINARY, _CODE, _ROS = "gaitgraph.io.binary_tables", "gaitgraph.io.code_files", "gaitgraph.io.ros"
_BAG_OPTIONS = ("periods", "joint_names", "trajectory_topic", "states_topic")
_BAG: Any = {"module": _ROS, "library": "rosbags", "extra": "ros", "folder": True, "options": _BAG_OPTIONS}
_GOAL: Any = {"mark": "# made_by: ", "end": "# end", "options": ("periods", "joint_names")}
_HEADER: Any = {"mark": " * made_by: ", "end": "#endif", "options": ("joint_names", "number", "c_name")}

FORMATS = {
    one.suffix: one
    for one in (
        Format(suffix=".csv", name="CSV", module="gaitgraph.io.text_files"),
        Format(suffix=".json", name="JSON", module="gaitgraph.io.text_files"),
        Format(suffix=".npz", name="NumPy archive", module=_BINARY),
        Format(suffix=".mat", name="MATLAB file", module=_BINARY),
        Format(suffix=".m", name="MATLAB script", module=_CODE, mark="% made by: ", end="% end"),
        Format(suffix=".parquet", name="Parquet", module=_BINARY, library="pyarrow", extra="table"),
        Format(suffix=".mcap", name="ROS 2 bag (MCAP)", **_BAG),
        Format(suffix=".db3", name="ROS 2 bag (sqlite3)", **_BAG),
        Format(suffix=".yaml", name="ROS 2 trajectory", module=_ROS, **_GOAL),
        Format(suffix=".h", name="C header", module=_CODE, **_HEADER),
    )
}
"""The formats by suffix."""

FILMS = (".gif", ".mp4")
"""Suffixes of films, which :mod:`gaitgraph.plots.films` writes."""


def known_format(path: str | Path, what: str, *, reads: bool = False) -> Format:
    """Return the format of a gait file by its suffix; InputError if it has none, or is not read where that is needed.

    A folder to be read may have another name, if the files in it are those of a bag. `what` is how messages call it.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    known = [suffix for suffix, one in FORMATS.items() if one.reads or not reads]
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
    for name, default in ((one.name, one.default) for one in fields(options)):
        if name not in there and (value := getattr(options, name)) != default:
            suffixes = ", ".join(suffix for suffix, one in FORMATS.items() if name in one.options)
            raise InputError(f"{name} needs an output {suffixes}, got {shown(value)} without one")


def check_names(names: Iterable[str], own: Collection[str], suffix: str) -> None:
    """Raise InputError if a column of joints has a name that a format gives to something of its own."""
    for name in names:
        if name in own:
            other = f"use another name than {', '.join(map(repr, own))}"
            raise InputError(f"column {name!r}: a {suffix} file has something else there; {other}")


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
    OutputExists, FileProblem
        If a file exists and `force` is not set, or if one cannot be written; then none is, and old ones are whole.
    InputError, MissingExtra
        If a suffix is not known, a file is named twice, or a format needs a library that is not installed.
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

    `pieces` is called once a file; its pieces have the same columns, and the first states what made them.
    """
    check_outputs(paths, force=force)

    def stated_in(form: Format) -> Iterator[Table]:
        # Formats of robots state joints in their own radians, tables in the columns of the map.
        in_format = servos if form.reads else None
        if servos is not None and "joint_names" in form.options:
            in_format = servos.in_radians()
        rows = 0
        for piece in pieces():
            yield piece if in_format is None else mapped_table(piece, in_format, rows_before=rows)
            rows += len(piece)

    def write(form: Format, scratch: Path) -> None:
        form.writer(options)(stated_in(form), scratch)

    write_whole([(Path(path), partial(write, known_format(path, "output"))) for path in paths], force=force)


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
