"""The formats of gait files, by suffix; and gait files of any format: written whole or not at all, and read.

Every file states what made it (:func:`gaitgraph.gait.table.provenance_text`), where its own readers keep such things.
The libraries of an extra are loaded by the functions that need them.
"""

from __future__ import annotations

import warnings
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gaitgraph.angles import whole_number
from gaitgraph.arrays import check_unmasked
from gaitgraph.errors import (
    FileProblem,
    FileWarning,
    GaitgraphError,
    Infeasible,
    InputError,
    MissingExtra,
    OutputExists,
    did_you_mean,
    needs_extra,
    reworded,
    shown,
)
from gaitgraph.files import (
    check_new_files,
    path_of,
    reading,
    text_of,
    value_from_json,
    write_whole,
)
from gaitgraph.gait.gait import PAPER_GAITS, Gait, paper_gait
from gaitgraph.gait.table import (
    ANGLES,
    Table,
    check_repeats,
    closed_rows,
    motion_of,
    repeated,
)
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.io import binary_tables, c_header, ros, text_files
from gaitgraph.io.columns import (
    TableBuilder,
    checked_table,
    is_frame,
    table_from_frame,
)
from gaitgraph.io.servo_map import mapped_table, servo_map_named
from gaitgraph.vehicle import PAPER, vehicle_named

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import ModuleType

    import numpy.typing as npt

    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.io.columns import Frame
    from gaitgraph.io.servo_map import ServoMapLike
    from gaitgraph.vehicle import VehicleLike

    class HasGait(Protocol):
        """What has a gait: a timed gait, a plan and other answers."""

        @property
        def gait(self) -> Gait:
            """The gait."""

    GaitLike = Gait | HasGait | Table | Frame | str | Path | npt.ArrayLike

_WHAT = "gait file"
_MOST_PERIODS = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One kind of gait file.

    Its module has ``write_SUFFIX(pieces, path)``, which writes a new file or folder from the pieces of a table, and
    ``read_SUFFIX(path, builder)``, which yields the tables of its columns, piece by piece.
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
        if missing := self.why_not():
            raise MissingExtra(missing)
        found: Callable[..., Any] = getattr(
            self.module, f"{task}_{self.suffix.removeprefix('.')}"
        )
        return found


_BAG: Any = {"library": "rosbags", "extra": "ros", "folder": True}
_NPZ_OWN = (
    "provenance",
    "file",
    "allow_pickle",
)  # the last two are parameters of numpy.savez
_MAT_OWN = ("alpha", "alpha_rate", "alpha_acceleration", "names", "units", "provenance")

FORMATS = {
    one.suffix: one
    for one in (
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
        Format(suffix=".mcap", name="ROS 2 bag (MCAP)", module=ros, **_BAG),
        Format(suffix=".yaml", name="ROS 2 trajectory", module=ros, reads=False),
        Format(suffix=".h", name="C header", module=c_header, reads=False),
    )
}
"""The formats by suffix."""

FILMS = (".gif", ".mp4")
"""Suffixes of films, which :mod:`gaitgraph.plots.vehicles` writes."""


def tables_and_films(
    paths: Sequence[str | Path],
) -> tuple[list[str | Path], list[str | Path]]:
    """Return those of some outputs that are tables, and those that are films."""
    films = [path for path in paths if str(path).lower().endswith(FILMS)]
    return [path for path in paths if path not in films], films


def known_format(
    path: str | Path, what: str, *, reads: bool = False, also: Sequence[str] = ()
) -> Format:
    """Return the format of a gait file by its suffix; InputError for another suffix, or if it cannot be read.

    With `reads` a folder may have any name if there is a bag in it. `what` is its name in messages, and `also` are
    further suffixes that are read, to list.
    """
    given, path = str(path), path_of(path, what)
    suffix = path.suffix.lower()
    known = [suffix for suffix, one in FORMATS.items() if one.reads or not reads]
    is_folder = reads and given != "" and suffix not in FORMATS and path.is_dir()
    if is_folder and any(path.glob("*.mcap")):
        suffix = ".mcap"
    if suffix not in known:
        which = repr(given) + ", a folder without a .mcap file" * is_folder
        not_read = "; this format is not read: use the gait table or the request"
        hints = (
            dict.fromkeys((*FORMATS, *FILMS, ".svg"), not_read)
            if reads
            else {".svg": "; films are .gif, .mp4"}
            | dict.fromkeys(FILMS, "; films are written by animate")
        )
        known += also if reads else [] if suffix in FILMS else FILMS
        hints |= {
            ".db3": "; ros2 bag convert turns it into .mcap",
            ".m": "; MATLAB and Octave load .mat",
        }
        hint = hints.get(suffix) or did_you_mean(suffix, known)
        raise InputError(
            f"{what} must have one of the suffixes {', '.join(known)}, got {which}{hint}"
        )
    return FORMATS[suffix]


# -- Writing


def write_tables(
    table: Table,
    paths: Sequence[str | Path],
    *,
    force: bool = False,
    periods: int = 1,
    servos: ServoMapLike | None = None,
) -> None:
    """Write a table to files, or folders, each whole or not at all; the format follows from the suffix.

    `servos`, a :class:`ServoMap`, a preset, a TOML file or a mapping, determines the columns of tables, and order, names,
    signs and zeros in formats of robots. The gait is written `periods` times, one after the other; a C header repeats by itself.

    Raises OutputExists if a file exists and `force` is not set, FileProblem if one cannot be written (then no file is
    changed), InputError if a suffix is not known or a file is named twice, and MissingExtra if a library is missing.
    """
    check_outputs(paths, force=force, periods=periods)
    servo_map = None if servos is None else servo_map_named(servos)

    def stated_in(form: Format) -> Table:
        stated = table
        if periods > 1 and form.reads and form.module is not ros:
            stated = repeated(table, periods)
        # Formats of robots state joints in their own radians, tables in the columns of the map.
        in_format = servo_map if form.reads else None
        if servo_map is not None and form.module in (ros, c_header):
            in_format = servo_map.in_radians()
        if in_format is not None:
            stated = mapped_table(stated, in_format)
        for name in form.own:
            if name in stated:
                other = f"use another name than {', '.join(map(repr, form.own))}"
                raise InputError(
                    f"column {name!r}: a {form.suffix} file has something else there; {other}"
                )
        return stated

    def write(form: Format, scratch: Path) -> None:
        options = {"periods": periods} if form.module is ros else {}
        form.function("write")(stated_in(form), scratch, **options)

    write_whole(
        [(Path(path), partial(write, known_format(path, "output"))) for path in paths],
        force=force,
    )


def check_outputs(
    paths: Sequence[str | Path], *, force: bool = False, periods: int = 1
) -> None:
    """Raise before any work is done if an output cannot be: its suffix, an extra, a name taken or given twice."""
    folders, formats = set(), [known_format(path, "output") for path in paths]
    whole_number("periods", periods, 1, _MOST_PERIODS)
    if periods > 1 and all(form.module is c_header for form in formats):
        raise InputError(
            f"periods needs a table, .mcap or .yaml as output, got {periods} without one"
        )
    for form, path in zip(formats, map(Path, paths), strict=True):
        form.function("write")  # MissingExtra, if that is so
        if form.folder:
            folders.add(path)
            for one in sorted(path.iterdir()) if path.is_dir() else ():
                if not one.is_file() or (
                    one.name != "metadata.yaml" and one.suffix != form.suffix
                ):
                    wanted = f"must be a new folder or a {form.name}, got a folder with {one.name!r} in it"
                    raise OutputExists(f"output {str(path)!r} {wanted}")
    check_new_files(paths, force=force, folders=folders)


# -- Reading


def given_gait(gait: GaitLike, *, name: str = "gait", **choices: Any) -> Any:
    """Return a gait in any form as a Gait, a timed gait or a Table. All functions take gaits through this one.

    A plan, or another answer with a timed gait, gives that. A request file is planned with the `choices` that are not
    None (`vehicle`, `coefficients` …); a gait has its own, so that choices beside it are refused. "gait1" to "gait4"
    are those of the paper. Rows of shape (n, 4), frames and gait files become tables, whose statement is checked
    against their rows. InputError, with the `name`, for anything else.
    """
    from gaitgraph.timing.statement import checked

    stated = {option: value for option, value in choices.items() if value is not None}
    if hasattr(type(gait), "timed"):
        timed = gait.timed() if callable(gait.timed) else gait.timed  # type: ignore[union-attr]
        if timed is None:
            raise Infeasible(
                getattr(gait, "reason", None) or f"{name} has no timed gait"
            )
        gait = timed
    if isinstance(gait, Gait) or hasattr(type(gait), "rate_checks"):
        for option, value in stated.items():
            raise InputError(
                f"{option} must be None beside a gait, which has its own, got {shown(value)}"
            )
        return gait
    if isinstance(gait, (str, Path)):
        if number := PAPER_GAITS.get(str(gait)):
            vehicle = vehicle_named(stated.get("vehicle", PAPER))
            return paper_gait(
                number, vehicle, coefficients_of(vehicle, stated.get("coefficients"))
            )
        if holds_request(gait):
            from gaitgraph.planning.planner import planned_gait

            return planned_gait(gait, stated)
        return read_table(gait)
    if is_frame(gait):
        return checked(table_from_frame(gait))  # type: ignore[arg-type]
    if isinstance(gait, Table):
        known = gait.motion is not None
        return gait if known else checked(checked_table(gait))
    check_unmasked(gait, name)
    rows = np.array(
        gait if isinstance(gait, (list, tuple, np.ndarray)) else None, dtype=object
    )
    if rows.size and rows.shape[1:] == (4,):
        return table_from_frame(dict(zip(ANGLES, rows.T.tolist(), strict=True)))
    allowed = "a Gait, TimedGait, Plan, Table, data frame or (n, 4) array, or the path of a gait file or a request"
    raise InputError(f"{name} must be {allowed}, got {shown(gait)}", field=name)


def gait_of(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    name: str = "gait",
    path: bool = False,
) -> Gait:
    """Return the gait that was handed over in any form: of a table the closed polyline, straight runs merged.

    A last row that repeats the first is the closing row. Rows of alpha1, alpha2 and color alone are lifted. Rows
    without a color get that of the sheet or fibre they lie on, if each lies on one to within 2e-3 rad.

    The vehicle and the coefficients are those given, else those that the table states, else the paper's. The gait keeps
    the request that the table states, if none is given. With `path` a table that is run once is led out and back.
    Raises InputError if it is no gait, as :func:`given_gait` says, or a path,
    FileProblem if a file cannot be read, and Infeasible if a request has no gait.

    >>> gait_of({"alpha1": [0.4, 0.6, 0.9], "alpha2": [-0.4, -0.4, -0.4], "color": "red"}).alpha[:, 0].tolist()
    [0.4, 0.9]
    """
    source = given_gait(gait, name=name, vehicle=vehicle, coefficients=coefficients)
    if not path:
        with naming_file(gait):
            check_repeats(source, name)
    if not isinstance(source, Table):
        return source if isinstance(source, Gait) else source.gait
    motion = motion_of(source, vehicle, coefficients)
    if motion is not None:
        corners: Gait = motion.gait
        return corners
    with naming_file(gait):
        rows, _ = closed_rows(
            source, vehicle=vehicle, coefficients=coefficients, name=gait
        )
    return replace(rows.merged(), request=rows.request)


def read_table(path: str | Path, *, joints: ServoMapLike | None = None) -> Table:
    """Read a gait table of any format in :data:`FORMATS`, or a plan saved as JSON.

    `joints` describes the columns of a servo table from elsewhere, as `servos` of :func:`write_tables`; ours state them. Raises FileProblem if the file
    cannot be read, and InputError, with file and place, if it holds no gait table.
    """
    from gaitgraph.timing.statement import checked

    table = unchecked_table(path, joints=joints)
    with naming_file(path):
        return checked(table, path)


def unchecked_table(
    path: str | Path,
    *,
    plane_only: bool = False,
    joints: ServoMapLike | None = None,
    angles: tuple[str, ...] = (),
) -> Table:
    """Read a gait table whose statement nobody has compared with its rows; errors as :func:`read_table`.

    The options are those of TableBuilder.
    """
    form, path = known_format(path, _WHAT, reads=True), Path(path)
    read = form.function("read")
    with reading(path, _WHAT), naming_file(path):
        path.stat()
        builder = TableBuilder(
            plane_only=plane_only,
            joints=None if joints is None else servo_map_named(joints),
            angles=angles,
            tell=lambda note: warnings.warn(
                f"{_WHAT} {str(path)!r}: {note}", FileWarning, stacklevel=2
            ),
        )
        table: Table = read(path, builder)
    return table


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


@contextmanager
def naming_file(source: object, what: str = _WHAT) -> Iterator[None]:
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
