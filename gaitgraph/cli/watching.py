"""Files that are watched: when they have changed and settled, and outputs that only their own writer may replace."""

from __future__ import annotations

import json
import stat
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import GaitgraphError, InputError
from gaitgraph.files import table_from_toml, target_of, text_of
from gaitgraph.io.writing import check_outputs, write_pieces

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from gaitgraph.gait.table import Table

__all__ = ["OwnOutputs", "changes", "files_of_request", "mark_of"]

Mark = tuple[Any, ...]

_PAUSE = 0.1
_PATIENCE = 1.0


def mark_of(path: Path) -> Mark | None:
    """Return what tells one content of a file or folder from another without reading it; None if nothing is there.

    Not guaranteed: that a content of the same size is told apart if it is written within the file system's tick.

    >>> mark_of(Path("nothing.toml")) is None
    True
    """
    try:
        about = path.stat()
        inside = sorted(path.iterdir()) if stat.S_ISDIR(about.st_mode) else []
    except (OSError, ValueError):
        return None
    return (about.st_size, about.st_ino, about.st_mtime_ns, *((one.name, mark_of(one)) for one in inside))


def files_of_request(path: str | Path, vehicle: str | None = None) -> Callable[[], list[Path]]:
    """Return what tells the files that a request depends on, the vehicle's among them, whenever it is called.

    Parameters
    ----------
    path
        The request. While it cannot be read, the vehicle's file that it named before counts.
    vehicle
        The vehicle that replaces the request's: a preset's name or a TOML file.

    Examples
    --------
    >>> files_of_request("request.toml", "mine.toml")()
    [PosixPath('request.toml'), PosixPath('mine.toml')]
    """
    path = Path(path)
    known: dict[str, Any] = {"mark": None, "beside": []}

    def files() -> list[Path]:
        if vehicle is not None:
            return [path, *([Path(vehicle)] if vehicle.lower().endswith(".toml") else [])]
        mark = mark_of(path)
        if mark != known["mark"]:
            named = _vehicle_in(path)
            if named is not None:
                known["beside"] = [path.parent / named] if named.lower().endswith(".toml") else []
            known["mark"] = mark
        return [path, *known["beside"]]

    return files


def _vehicle_in(path: Path) -> str | None:
    """Return what a request file states as its vehicle, empty if that is no text; None if it cannot be read."""
    suffix = path.suffix.lower()
    if suffix not in (".toml", ".json"):
        return ""  # a gait file holds its vehicle
    try:
        text = text_of(path, "request file", "TOML or JSON")
        content = table_from_toml(text) if suffix == ".toml" else json.loads(text)
    except (GaitgraphError, ValueError, RecursionError):
        return None
    vehicle = content.get("vehicle") if isinstance(content, dict) else None
    return vehicle if isinstance(vehicle, str) else ""


def changes(
    files: Callable[[], Iterable[Path]], *, pause: float = _PAUSE, patience: float = _PATIENCE
) -> Iterator[None]:
    """Yield at once, and then whenever one of the files has changed and settled; for ever.

    Parameters
    ----------
    files
        Called before every look: which files there are.
    pause
        Time between two looks [s]. A change counts once nothing has changed for two of them, so that a file is not
        read half written.
    patience
        How long a file may be missing or empty before that counts [s]: editors write anew, or put another in place.

    Notes
    -----
    What changes while the caller works on the change before is not missed: files are looked at first, then yielded.
    """

    def look() -> dict[Path, Mark | None]:
        return {path: mark_of(path) for path in files()}

    known = look()
    yield
    while True:
        sleep(pause)
        now, still = look(), 0.0
        while now != known:
            hollow = any(mark is None or not mark[0] for mark in now.values())
            if still >= (patience if hollow else 2 * pause):
                known = now
                yield
                break
            sleep(pause)
            after = look()
            now, still = after, still + pause if after == now else 0.0


class OwnOutputs:
    """Outputs that are written again and again: what this wrote it may replace, what is somebody else's it may not.

    Parameters
    ----------
    paths
        The files.
    force
        Replace whatever is there.
    apart_from
        Files that no output may be, even so.

    Raises
    ------
    InputError, FileProblem
        If an output cannot be written, or exists and `force` is not set.
    """

    def __init__(self, paths: Sequence[str], *, force: bool = False, apart_from: Sequence[str] = ()) -> None:
        check_outputs(paths, force=force)
        watched = {target_of(Path(path)) for path in apart_from}
        for path in paths:
            if target_of(Path(path)) in watched:
                raise InputError(f"output: {path!r} is watched itself; allowed is another file")
        self.paths = tuple(paths)
        self._force = force
        self._written: dict[str, Mark | None] = {}

    @property
    def own(self) -> tuple[str, ...]:
        """What was written, and stands there untouched."""
        return tuple(path for path in self.paths if self._is_own(path))

    def write(self, pieces: Callable[[], Iterable[Table]]) -> None:
        """Write a table that comes piece by piece to every output.

        Parameters
        ----------
        pieces
            As for :func:`gaitgraph.io.writing.write_pieces`.

        Raises
        ------
        OutputExists
            If a file was put there, or changed, by somebody else, and `force` is not set; then none is written.
        """
        mine = self.own
        others = [path for path in self.paths if path not in mine]
        write_pieces(pieces, others, force=self._force)
        write_pieces(pieces, mine, force=True)
        self._written = {path: mark_of(Path(path)) for path in self.paths}

    def _is_own(self, path: str) -> bool:
        mark = self._written.get(path)
        return mark is not None and mark == mark_of(Path(path))
