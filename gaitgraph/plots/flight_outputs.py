"""Files of flights and basins, by suffix: tables, plots over time, a film, the picture of basins."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import FileProblem, GaitgraphError, InputError, OutputExists, did_you_mean, shown
from gaitgraph.files import target_of, write_whole
from gaitgraph.flight.basins import table_of_basins
from gaitgraph.flight.record import TABLES
from gaitgraph.io.formats import FORMATS
from gaitgraph.plots.axes import FORMATS as PICTURES, paper_style, picture_bytes, require_matplotlib
from gaitgraph.plots.basins import basins_figure
from gaitgraph.plots.flight_films import write_film, write_rendered_film
from gaitgraph.plots.flights import figure_of_panels, plot_flight

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.flight.basins import Basin
    from gaitgraph.flight.record import Flight

PLOTS = tuple(f".{name}" for name in PICTURES)
FILM = ".gif"
_ALLOWED = (*TABLES, *PLOTS, FILM)


def check_flight_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before a flight if an output cannot be: its suffix, an extra, a folder, a name taken or given twice.

    Raises
    ------
    InputError, FileProblem, OutputExists, MissingExtra
        As :func:`gaitgraph.io.writing.check_outputs` does for gaits.
    """
    seen: set[Path] = set()
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix not in _ALLOWED:
            told = f" is a {FORMATS[suffix].name}, which is of gaits alone" if suffix in FORMATS else ""
            hint = did_you_mean(suffix, list(_ALLOWED)) if suffix and not told else ""
            raise InputError(f"output: {str(path)!r}{told}; allowed for a flight are {', '.join(_ALLOWED)}{hint}")
        if suffix in PLOTS:
            require_matplotlib()
        else:
            FORMATS[suffix].writer()  # MissingExtra, if that is so
        try:
            resolved = target_of(path)
            if resolved in seen:
                raise InputError(f"output: {str(path)!r} is named twice; allowed is once")
            seen.add(resolved)
            if resolved.exists() and not resolved.is_file():
                what = "a folder" if resolved.is_dir() else "no regular file"
                raise OutputExists(f"output: {str(path)!r} is {what}; allowed is a file")
            if os.path.lexists(path) and not force:
                raise OutputExists(f"output: {str(path)!r} exists; allowed is a new file, or --force (force=True)")
            if not path.parent.is_dir():
                what = "is no folder" if path.parent.exists() else "does not exist"
                raise FileProblem(f"output: folder {str(path.parent)!r} {what}; allowed is an existing folder")
        except GaitgraphError:
            raise
        except (OSError, ValueError) as error:  # a name that the file system refuses
            reason = getattr(error, "strerror", None) or error
            raise FileProblem(f"output: cannot write {shown(str(path))}: {reason}") from error


def write_flight(flight: Flight, paths: Sequence[str | Path], *, force: bool = False, rendered: bool = False) -> None:
    """Write a flight to files, each whole or not at all; the suffix says what.

    Parameters
    ----------
    flight
        One with rows.
    paths
        Tables (:data:`TABLES`), plots over time (:data:`PLOTS`), or a film (:data:`FILM`).
    force
        Overwrite files that exist.
    rendered
        Whether films are rendered by the engine, where it can, instead of drawn.

    Raises
    ------
    InputError, FileProblem, OutputExists, MissingExtra
        As :func:`check_flight_outputs` does, or if nothing was flown or the disk is full.
    """
    check_flight_outputs(paths, force=force)
    if paths and not len(flight.rows):
        raise InputError(f"output: {str(paths[0])!r}: nothing was flown; allowed is a flight with rows")
    write_whole([(Path(path), _content(flight, Path(path).suffix.lower(), rendered)) for path in paths], force=force)


def _content(flight: Flight, suffix: str, rendered: bool) -> Any:
    if suffix == FILM:
        return partial(write_rendered_film if rendered else write_film, flight)
    if suffix in PLOTS:
        return _plot(flight, suffix.removeprefix("."))
    return partial(FORMATS[suffix].writer(), [flight.table()])


def _plot(flight: Flight, kind: Any) -> bytes:
    with paper_style():
        figure, axes = figure_of_panels()
        plot_flight(flight, axes=axes)
        return picture_bytes(figure, kind)


def check_basin_outputs(paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Raise before any flight if an output cannot be; errors as :func:`gaitgraph.io.writing.check_outputs` has them."""
    known = [*TABLES, *PLOTS]
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix not in known:
            hint = did_you_mean(suffix, known) if suffix else ""
            raise InputError(f"output: {str(path)!r}; allowed for a basin are {', '.join(known)}{hint}")
    check_flight_outputs(paths, force=force)


def write_basins(basins: Sequence[Basin], paths: Sequence[str | Path], *, force: bool = False) -> None:
    """Write basins to files, each whole or not at all: one row a flight, or the picture of all side by side.

    Parameters
    ----------
    basins
        Of one gait and its biased gaits, as :func:`basins_of` returns them.
    paths
        The suffix says what: a table (.csv, .json, .npz, .mat, .parquet) or a picture (.png, .svg, .pdf).
    force
        Overwrite files that exist.

    Raises
    ------
    InputError, FileProblem, OutputExists, MissingExtra
        As :func:`check_basin_outputs` does, or if the disk is full.
    """
    check_basin_outputs(paths, force=force)
    table = table_of_basins(basins)
    contents: list[tuple[Path, Any]] = []
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix in PLOTS:
            kind: Any = suffix.removeprefix(".")
            contents.append((path, picture_bytes(basins_figure(basins), kind)))
        else:
            contents.append((path, partial(FORMATS[suffix].writer(), [table])))
    write_whole(contents, force=force)
