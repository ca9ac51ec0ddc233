"""The formats of gait files, by suffix: who writes them, who reads them, and what they need.

Every file carries what made it (:func:`gaitgraph.gait.table.provenance_text`), where its own readers keep such things.
The rooms of this package are loaded when a format is first used, and the libraries of an extra by their functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import InputError, did_you_mean, needs_extra

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from gaitgraph.gait.table import Table
    from gaitgraph.io.options import FormatOptions

    Writer = Callable[[Iterable[Table], Path], None]
    RawPieces = Iterator[tuple[list[tuple[str, Any]], dict[str, Any]]]
    Reader = Callable[[Path, Callable[[float], None] | None], RawPieces]

__all__ = ["FORMATS", "Format", "known_format", "readable_suffixes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One kind of gait file.

    Parameters
    ----------
    suffix
        How its files' names end, with the dot.
    name
        What people call it.
    room
        The module of this package that has it: ``write_SUFFIX(pieces, path)`` writes a new file or folder from the
        pieces of a table; ``pieces_of_SUFFIX(path, progress)`` yields raw columns and what made them, piece by piece;
        ``provenance_of_SUFFIX(path)`` returns the text of what made it, where there is no table to read.
    module, extra
        The library that it needs, and the extra that brings it, if it needs any.
    reads
        Whether its files are read as gait tables.
    folder
        Whether it is a folder of files.
    options
        Which fields of :class:`gaitgraph.io.options.FormatOptions` its writer heeds, which it is then given.
    """

    suffix: str
    name: str
    room: str
    module: str | None = None
    extra: str | None = None
    reads: bool = True
    folder: bool = False
    options: tuple[str, ...] = ()

    def why_not(self) -> str | None:
        """Return what is missing here, or None if the format can be used."""
        if self.module is None or self.extra is None or find_spec(self.module):
            return None
        return str(needs_extra(self.module, self.name, self.extra))

    def _function(self, task: str) -> Any:
        if self.module is not None and self.extra is not None and not find_spec(self.module):
            raise needs_extra(self.module, self.name, self.extra)
        return getattr(import_module(self.room), f"{task}_{self.suffix.removeprefix('.')}")

    def writer(self, options: FormatOptions | None = None) -> Writer:
        """Return what writes a new file or folder from the pieces of a table; MissingExtra if it cannot."""
        found = self._function("write")
        return partial(found, options=options) if self.options else found

    def reader(self) -> Reader:
        """Return what yields the raw columns of a file; MissingExtra if it cannot."""
        found: Reader = self._function("pieces_of")
        return found

    def provenance(self, path: Path) -> str:
        """Return the text of what made a file that is no table to read; MissingExtra if it cannot."""
        found: str = self._function("provenance_of")(path)
        return found


FORMATS = {
    one.suffix: one
    for one in (
        Format(suffix=".csv", name="CSV", room="gaitgraph.io.texts"),
        Format(suffix=".json", name="JSON", room="gaitgraph.io.texts"),
        Format(suffix=".npz", name="NumPy archive", room="gaitgraph.io.npz"),
        Format(suffix=".mat", name="MATLAB file", room="gaitgraph.io.mat"),
        Format(suffix=".m", name="MATLAB script", room="gaitgraph.io.mat_script", reads=False),
        Format(suffix=".parquet", name="Parquet", room="gaitgraph.io.parquet", module="pyarrow", extra="table"),
        Format(
            suffix=".mcap",
            name="ROS 2 bag (MCAP)",
            room="gaitgraph.io.rosbag",
            module="rosbags",
            extra="ros",
            folder=True,
            options=("periods", "joint_names", "trajectory_topic", "states_topic"),
        ),
        Format(
            suffix=".db3",
            name="ROS 2 bag (sqlite3)",
            room="gaitgraph.io.rosbag",
            module="rosbags",
            extra="ros",
            folder=True,
            options=("periods", "joint_names", "trajectory_topic", "states_topic"),
        ),
        Format(
            suffix=".yaml",
            name="ROS 2 trajectory",
            room="gaitgraph.io.trajectory",
            reads=False,
            options=("periods", "joint_names"),
        ),
        Format(
            suffix=".h",
            name="C header",
            room="gaitgraph.io.c_header",
            reads=False,
            options=("joint_names", "number", "c_name"),
        ),
        Format(suffix=".svg", name="animated SVG", room="gaitgraph.plots.svg_films", reads=False),
        Format(
            suffix=".gif",
            name="animated GIF",
            room="gaitgraph.plots.gif_films",
            module="PIL",
            extra="plot",
            reads=False,
        ),
    )
}
"""The formats by suffix."""


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
        The file; capitals in its suffix do not matter.
    what
        What messages call it.
    reads
        Whether it is to be read as a table.

    Raises
    ------
    InputError
        If the suffix is not known.
    """
    suffix = _suffix_of(Path(path)) if reads else Path(path).suffix.lower()
    known = readable_suffixes() if reads else list(FORMATS)
    if suffix not in known:
        hint = did_you_mean(suffix, known) if suffix else ""
        told = " is a folder, and no ROS 2 bag" if reads and Path(path).is_dir() else ""
        raise InputError(f"{what}: {str(path)!r}{told}; allowed are the suffixes {', '.join(known)}{hint}")
    return FORMATS[suffix]


def _suffix_of(path: Path) -> str:
    """Return the suffix of a file in lower case; that of the files in it for a folder whose own says nothing."""
    suffix = path.suffix.lower()
    if suffix in FORMATS or not path.is_dir():
        return suffix
    try:
        inside = {file.suffix.lower() for file in path.iterdir() if file.is_file()}
    except OSError:
        return suffix
    return next((one.suffix for one in FORMATS.values() if one.folder and one.suffix in inside), suffix)
