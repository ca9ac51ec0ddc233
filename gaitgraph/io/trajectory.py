"""The points of a gait over several periods, and the YAML goal that a joint_trajectory_controller's action takes.

The goal is of control_msgs/action/FollowJointTrajectory. Its first lines are comments, the second of which tells what
made the file; the last one too, so that a file that was cut off is known.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.files import blocks_of
from gaitgraph.gait.rows import is_closed
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table, merged, provenance_text
from gaitgraph.io.options import FormatOptions

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

__all__ = ["MOST_POINTS", "Points", "merged_up_to", "points_of", "provenance_of_yaml", "told_after", "write_yaml"]

FloatArray = npt.NDArray[np.float64]

MOST_POINTS = 100_000
"""A trajectory for ROS 2 may have this many points at most."""

NANOSECONDS = 1_000_000_000
_LAST_SECOND = 2**31 - 2  # seconds are whole numbers of 32 bits, and stamps begin a second later
_SHORTEST_STEP = 2
_MARK = "# made_by: "
_END = "# end"
_BLOCK = 1 << 16
_MOST_TOLD = 1 << 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """A gait repeated: times that increase, and what the joints do at them.

    Parameters
    ----------
    times
        Since the first point, shape (n,) [ns], strictly increasing.
    positions, velocities, accelerations
        Shape (n, 4) [rad], [rad/s], [rad/s²]; rates and accelerations are None where the table has none.
    """

    times: npt.NDArray[np.int64]
    positions: FloatArray
    velocities: FloatArray | None
    accelerations: FloatArray | None

    def __len__(self) -> int:
        return len(self.times)


def merged_up_to(pieces: Iterable[Table], most: int, what: str) -> Table:
    """Return the pieces of a table as one; InputError as soon as there are more rows than `most`."""
    taken: list[Table] = []
    for piece, rows in _counted(pieces):
        if rows > most:
            raise InputError(
                f"rows: more than {most}; allowed are that many in {what}: fewer samples, or a lower rate (Hz)"
            )
        taken.append(piece)
    return merged(taken)


def _counted(pieces: Iterable[Table]) -> Iterable[tuple[Table, int]]:
    return accumulate(((piece, len(piece)) for piece in pieces), lambda before, new: (new[0], before[1] + new[1]))


def points_of(table: Table, periods: int = 1) -> Points:
    """Return a table's rows, repeated; the row where one period ends and the next begins is there once.

    Parameters
    ----------
    table
        With t, alpha1 to alpha4, and the rates and accelerations if it has them.
    periods
        How often.

    Raises
    ------
    InputError
        If the table has no clock or is not closed, or if there are too many points, or points too near in time.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> from gaitgraph.timing.timed_gait import table_of
    >>> table = table_of(lift([(0.4, -0.4), (0.8, -0.8)], "red").parametrize(2.0, samples=2))
    >>> points_of(table, 2).times.tolist()
    [0, 1000000000, 2000000000, 3000000000, 4000000000]
    """
    if "t" not in table or "alpha3" not in table:
        missing = "t" if "t" not in table else "alpha3"
        raise InputError(f"column {missing!r} is missing; allowed is a table with a clock and four angles")
    if periods > 1 and not is_closed(table):
        raise InputError(f"periods: {periods} of a table that does not end where it starts; allowed is 1")
    rows = len(table)
    if (rows - 1) * periods + 1 > MOST_POINTS:
        raise InputError(
            f"periods: {periods} of {rows} rows; allowed are {MOST_POINTS} points: fewer periods, samples, or Hz"
        )
    seconds = table["t"] - table["t"][0]
    if seconds[-1] * periods > _LAST_SECOND:
        raise InputError(f"periods: {periods} of {seconds[-1]:g} s; allowed are {_LAST_SECOND} s in all")
    once = np.rint(seconds * NANOSECONDS).astype(np.int64)
    later = [once[1:] + k * once[-1] for k in range(1, periods)]
    times = np.concatenate([once, *later])
    if len(times) > 1 and np.diff(times).min() < _SHORTEST_STEP:
        raise InputError(f"t: steps under {_SHORTEST_STEP} ns; allowed are longer ones, for ROS counts nanoseconds")
    return Points(
        times=times,
        positions=_repeated(table, ANGLES, periods),
        velocities=_repeated(table, RATES, periods) if RATES[0] in table else None,
        accelerations=_repeated(table, ACCELERATIONS, periods) if ACCELERATIONS[0] in table else None,
    )


def _repeated(table: Table, names: Iterable[str], periods: int) -> FloatArray:
    once = np.column_stack([table[name] for name in names])
    return np.concatenate([once, *[once[1:]] * (periods - 1)])


def write_yaml(pieces: Iterable[Table], path: Path, options: FormatOptions | None = None) -> None:
    """Write a new file with the goal of an action.

    ``ros2 action send_goal`` takes it as its argument. Times are whole nanoseconds.
    """
    options = options or FormatOptions()
    table = merged_up_to(pieces, MOST_POINTS, "a ROS 2 trajectory")
    points = points_of(table, options.periods)
    lines = [
        "# A goal of control_msgs/action/FollowJointTrajectory; angles in rad, with rad/s and rad/s².",
        _MARK + provenance_text(table),
        "trajectory:",
        f"  joint_names: {json.dumps(options.joints_of(table)[0], ensure_ascii=False)}",
        "  points:",
    ]
    named = [
        ("positions", points.positions),
        ("velocities", points.velocities),
        ("accelerations", points.accelerations),
    ]
    there = [(name, rows.tolist()) for name, rows in named if rows is not None]
    for k, time in enumerate(points.times.tolist()):
        fields = [f"{name}: [{', '.join(map(_number, rows[k]))}]" for name, rows in there]
        fields.append(f"time_from_start: {{sec: {time // NANOSECONDS}, nanosec: {time % NANOSECONDS}}}")
        lines.append(f"  - {{{', '.join(fields)}}}")
    path.write_text("\n".join([*lines, _END]) + "\n", encoding="utf-8")


def _number(value: float) -> str:
    """Return a number as YAML 1.1 reads it: an exponent without a point before it would be a text.

    >>> _number(1e-05), _number(-0.25)
    ('1.0e-05', '-0.25')
    """
    text = repr(value)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def provenance_of_yaml(path: Path) -> str:
    """Return the text of what made a trajectory."""
    return told_after(_MARK, path, end=_END)


def told_after(mark: str, path: Path, *, end: str) -> str:
    """Return the rest of the first line of a text file that begins with a mark.

    What is between the first 16 MiB and the last line is not looked at.

    Raises
    ------
    FileProblem, InputError
        If the file cannot be read, no line begins so, or the last one is not `end`.
    """
    start, last = b"", b""
    for block, _ in blocks_of(path, "gait file", "what gaitgraph wrote"):
        start += block[: _MOST_TOLD - len(start)]
        last = (last + block)[-_BLOCK:]
    found = (line for line in start.decode("utf-8-sig", errors="replace").splitlines() if line.startswith(mark))
    told = next(found, None)
    if told is None:
        raise InputError("it does not tell what made it; allowed is what gaitgraph wrote")
    if last.rstrip().rpartition(b"\n")[2].rstrip() != end.encode():
        raise InputError(f"it ends early: its last line is not {end!r}; allowed is all that gaitgraph wrote")
    return told.removeprefix(mark)
