"""A gait as a C header.

The header has a table of the angles as floats, and a function that returns them at any time: before 0, after many
periods, not a number. It is C99 and C++11, needs only <stdint.h>, and allocates nothing. Its first comment states what
made it. There is a template for rows that are joined by straight lines and one for cubics, one for the header around
them, and one for that of a mission: functions that start, run and stop a gait, and one that flies them.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitgraph.errors import Advice, InputError
from gaitgraph.gait.table import (
    ANGLES,
    RATES,
    accelerations_of,
    is_closed,
    provenance_text,
)
from gaitgraph.io.ros import check_rows
from gaitgraph.io.servo_map import mapped_table, servos_of, tilts_from_joints
from gaitgraph.timing.joining import JoinedPath, Turns
from gaitgraph.timing.timed_gait import table_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.io.servo_map import ServoMap
    from gaitgraph.timing.joining import RunUp
    from gaitgraph.timing.timed_gait import TimedGait, TimedPath


_MOST_ROWS = 16_384  # as floats with rates, half a megabyte
_EVEN, _NANOSECOND = 1e-6, 1e-9
_REPEATS = (
    "It repeats for ever; a float has 7 digits, so let t stay within some periods of 0."
)
_RESTS = "Before it and after it the angles are those of its ends."
_STRAIGHT = (
    "Between rows the angles change evenly; corners of the gait between rows are cut."
)
_CUBIC = (
    "Between rows it is a cubic by angles and rates, off the gait by {off} rad, and rounding.\n"
    " * Its rates reach {rate:.4g} rad/s, its accelerations {acceleration:.4g} rad/s^2, between rows too."
)
# Of a table alone: accelerations within ±d of a straight line between rows put a cubic off by at most step²/16·d, and
# where they jump, d is half the largest second difference of the rows' accelerations.
_CUBIC_SHARE = 32.0


def write_h(table: Table, path: Path) -> None:
    """Write a new C header.

    Rows are joined by cubics where the table says so and has no linkage, else by straight lines. A mission becomes the
    functions of :func:`_pieces_of`, each over rows of its own, and one that flies them.
    """
    check_rows(table, _MOST_ROWS + 1, "a C header")
    servos = servos_of(table)
    name = _c_name(path.stem)
    motion = table.motion
    if isinstance(motion, JoinedPath) and motion.phases:
        kind = "mission"
        pieces = _pieces_of(table, motion, servos, name)
        words = _words_of_mission(motion)
    else:
        kind = "gait"
        pieces = [_piece_of(table, servos, name)]
        words = pieces[0].words
    words |= {
        "file": _harmless(path.name),
        "provenance": _harmless(provenance_text(table)),
        "name": name,
        "NAME": name.upper(),
        "joints": _harmless(json.dumps(servos.joint_names)),
        "rotors": ", ".join(str(joint.rotor) for joint in servos.joints),
        "pieces": "\n".join(piece.code for piece in pieces),
        "between": _between(pieces, is_proven=motion is not None),
    }
    path.write_text(_filled(kind, words), encoding="utf-8")


def _filled(kind: str, words: dict[str, Any]) -> str:
    """Return one of the templates beside this file, filled."""
    template = Path(__file__).with_name(f"{kind}.h.txt")
    return Template(template.read_text(encoding="ascii")).substitute(words)


def _pieces_of(
    table: Table, motion: JoinedPath, servos: ServoMap, name: str
) -> list[_Piece]:
    """Return the parts of a mission, as dense as its table, in the columns of its map.

    They are `start`, from hover to the first row of the gait, `run`, one period, and `stop`, from there to hover.
    """
    step = motion.period / motion.samples
    sections = motion.sections
    turns = _turns_of(motion)
    gait = sections.index(turns)

    def samples(period: float) -> int:
        return max(1, round(period / step))

    def path(parts: Sequence[TimedPath | RunUp]) -> JoinedPath:
        return JoinedPath.of(parts, samples(sum(part.period for part in parts)))

    parts = {
        "start": path(sections[1:gait]),
        "run": replace(turns.motion, samples=samples(turns.motion.period)),
        "stop": path(sections[gait + 1 : -1]),
    }
    pieces = []
    for part, own_motion in parts.items():
        piece = table_of(own_motion)
        if "servos" in table.about:
            piece = mapped_table(piece, servos)
        pieces.append(_piece_of(piece, servos, f"{name}_{part}"))
    return pieces


def _turns_of(motion: JoinedPath) -> Turns:
    """Return the periods of the gait in a mission."""
    return next(section for section in motion.sections if isinstance(section, Turns))


def _words_of_mission(motion: JoinedPath) -> dict[str, Any]:
    """Return what the template of missions has beside its pieces."""
    turns = _turns_of(motion)
    pause = motion.sections[0].period
    begins = dict(motion.phases)["gait"] - pause
    asked = begins + (turns.periods - 0.5) * turns.motion.period
    return {
        "seconds": f"{motion.period:g}",
        "periods": str(turns.periods),
        "pause": _literal(pause),
        "asked": _literal(asked),
    }


class _Quality(NamedTuple):
    """How far cubics are off the gait between rows [rad]; their largest rate and acceleration."""

    off: float
    rate: float
    acceleration: float


class _Piece(NamedTuple):
    """The code of one table and its function, words for the comment, and the quality of its cubics, if it has some."""

    code: str
    words: dict[str, Any]
    quality: _Quality | None


def _piece_of(table: Table, servos: ServoMap, name: str) -> _Piece:
    """Return the table of a motion in C, and the function that joins its rows."""
    times = table["t"] - table["t"][0]
    angles = table.alpha
    closed = is_closed(angles) and table.repeats
    cubic = table.joined_by_cubics and not _rates_jump(table, servos)
    if len(times) == 1:  # a gait that is a point, once more
        times = np.array([0.0, 1.0])
        angles = np.vstack([angles, angles])
        closed = True
    _check_even(times)
    rows = len(times) - closed  # a closed table without its last row
    words = {
        "motion": "over its period" if closed else "a path",
        "ends": _REPEATS if closed else _RESTS,
        "seconds": f"{times[-1]:g}",
        "name": name,
        "NAME": name.upper(),
        "period": _literal(times[-1]),
        "rows": rows,
        "intervals": len(times) - 1,
        "repeats": int(closed),
        "angle": _rows_of(angles[:rows]),
    }
    if not cubic:
        return _Piece(_filled("straight", words), words, None)
    rates = np.column_stack([table[name] for name in RATES])
    words["rate_rows"] = _rows_of(rates[:rows])
    words["step"] = _literal(times[-1] / (len(times) - 1))
    return _Piece(_filled("cubic", words), words, _quality_of(table, times, rates))


def _rates_jump(table: Table, servos: ServoMap) -> bool:
    """Return whether rates jump between rows: of joints with a linkage, and where a law turns at full speed."""
    if any(joint.linkage is not None for joint in servos.joints):
        return True
    return table.motion is not None and not np.isfinite(table.motion.peaks(2)).all()


def _between(pieces: list[_Piece], *, is_proven: bool) -> str:
    """Return the lines of the comment that say what happens between rows, of the worst of some pieces."""
    qualities = [piece.quality for piece in pieces if piece.quality is not None]
    if len(qualities) < len(pieces):
        return _STRAIGHT
    off, rate, acceleration = np.max(qualities, axis=0)
    about = f"about {off:.1e}"
    if is_proven:
        about = f"at most {1.06 * off:.1e}"  # not less, to two digits
    return _CUBIC.format(off=about, rate=rate, acceleration=acceleration)


def _check_even(times: FloatArray) -> None:
    """Raise InputError unless times from 0 are evenly spaced."""
    step = times[-1] / (len(times) - 1)
    late = np.abs(times - step * np.arange(len(times))).max()
    if late > max(_EVEN * step, _NANOSECOND):
        raise InputError(
            "t must be evenly spaced in a C header",
            advice=Advice(
                "give the gait another timing with samples= or rate=",
                "give the gait another timing with --samples or --rate",
            ),
        )


def _c_name(stem: str) -> str:
    """Return a name of C of up to 60 letters, digits and _ for a file's name."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", stem)[:60]
    if name[:1].isalpha():
        return name
    return f"gait_{name.strip('_')}"[:60].rstrip("_")


def _literal(value: float) -> str:
    """Return a number as the compiler reads the same float again."""
    return f"{np.float32(value)!s}f"


def _rows_of(values: FloatArray) -> str:
    """Return the rows of an array as those of a table in C."""
    rows = (", ".join(map(_literal, row)) for row in values.tolist())
    return "\n".join(f"    {{{row}}}," for row in rows)


def _quality_of(table: Table, times: FloatArray, rates: FloatArray) -> _Quality:
    """Return how far the cubics through a table's rows are off the gait, and their peaks."""
    if table.motion is not None:
        off = _proven_error(table, table.motion, times)
    else:
        longest = float(np.diff(times).max())
        changes = np.diff(accelerations_of(table), 2, axis=0)
        off = longest**2 * float(np.abs(changes).max(initial=0.0)) / _CUBIC_SHARE
    rate, acceleration = cubic_peaks(
        table.alpha.astype(np.float32).astype(float),
        rates.astype(np.float32).astype(float),
        times[-1] / (len(times) - 1),
    )
    return _Quality(off, rate, acceleration)


def cubic_peaks(
    angles: FloatArray, rates: FloatArray, step: float
) -> tuple[float, float]:
    """Return the largest rate [rad/s] and acceleration [rad/s²] of the cubics through rows, a step [s] apart.

    The acceleration is linear between rows, so it is largest at one of them, and the rate at a row or where the
    acceleration is zero.

    >>> rest_to_rest = np.zeros((2, 1))
    >>> cubic_peaks(np.array([[0.0], [1.0]]), rest_to_rest, 1.0)
    (1.5, 6.0)
    """
    slope = np.diff(angles, axis=0) / step
    first, last = rates[:-1], rates[1:]
    starting = (6.0 * slope - 4.0 * first - 2.0 * last) / step
    ending = (2.0 * first + 4.0 * last - 6.0 * slope) / step
    turns = starting * ending < 0.0
    passed = np.divide(
        starting, starting - ending, where=turns, out=np.zeros_like(slope)
    )
    between = first + 0.5 * step * starting * passed
    rate = np.abs(np.append(rates, between)).max()
    acceleration = np.abs(np.append(starting, ending)).max()
    return float(rate), float(acceleration)


def _proven_error(table: Table, motion: TimedGait, times: FloatArray) -> float:
    """Return a bound of the error of the cubics through a table's floats against the motion that it samples [rad].

    For a cubic with the values and slopes of both ends it is h⁴/384·max|f⁗|. Over a corner, where f‴ jumps, it is
    h³/96·max|f‴|: the integral of |Peano kernel| is largest at h/2. Where f″ jumps, it is h²/16·max|f″|. Angles that
    are off by a and rates that are off by b, as floats are, add a + h·b/4.
    """
    tilts = tilts_from_joints(table.columns, servos_of(table))
    step = float(np.diff(times).max())
    off = []
    for names, values in zip((ANGLES, RATES), motion.at(times), strict=False):
        written = np.column_stack([tilts[name] for name in names])
        stated = np.column_stack([table[name] for name in names])
        by_float = np.abs(stated - stated.astype(np.float32)).max()
        off.append(by_float + np.abs(written - values).max())
    second, third, fourth = (float(motion.peaks(order).max()) for order in (2, 3, 4))
    corners = motion.corner_times
    after = np.searchsorted(times[1:-1], corners)
    nearest = np.minimum(
        np.abs(corners - times[after]), np.abs(corners - times[after + 1])
    )
    between_rows = min(step**2 / 16 * second, step**3 / 96 * third)
    if nearest.max() <= _NANOSECOND:
        between_rows = min(step**4 / 384 * fourth, between_rows)
    return float(between_rows + off[0] + step / 4 * off[1])


def _harmless(text: str) -> str:
    """Return JSON, or a name, escaped so that it contains no comment marks and no trigraph; JSON reads the same."""
    return (
        text.replace("*", "\\u002a")
        .replace("?", "\\u003f")
        .encode("ascii", "backslashreplace")
        .decode()
    )
