"""A gait as a C header.

The header has a table of the angles as floats, and a function that returns them at any time: before 0, after many
periods, not a number. It is C99 and C++11, needs only <stdint.h>, and allocates nothing. Its first comment states what
made it. There is a template for rows that are joined by straight lines and one for cubics.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

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
from gaitgraph.io.servo_map import servos_of, tilts_from_joints

if TYPE_CHECKING:
    from gaitgraph.gait.table import Table
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.timing.timed_gait import TimedGait


_MOST_ROWS = 16_384  # as floats with rates, half a megabyte
_EVEN, _NANOSECOND = 1e-6, 1e-9
_REPEATS = (
    "It repeats for ever; a float has 7 digits, so let t stay within some periods of 0."
)
_RESTS = "Before it and after it the angles are those of its ends."
# Of a table alone: accelerations within ±d of a straight line between rows put a cubic off by at most step²/16·d, and
# where they jump, d is half the largest second difference of the rows' accelerations.
_CUBIC_SHARE = 32.0


def write_h(table: Table, path: Path) -> None:
    """Write a new C header.

    Rows are joined by cubics where the table says so and has no linkage, else by straight lines.
    """
    check_rows(table, _MOST_ROWS + 1, "a C header")
    servos = servos_of(table)
    times = table["t"] - table["t"][0]
    angles = table.alpha
    closed = is_closed(angles) and table.repeats
    # With a linkage the rates of joints jump between rows.
    is_linked = any(joint.linkage is not None for joint in servos.joints)
    cubic = table.joined_by_cubics and not is_linked
    if len(times) == 1:  # a gait that is a point, once more
        times = np.array([0.0, 1.0])
        angles = np.vstack([angles, angles])
        closed = True
    _check_even(times)
    rows = len(times) - closed  # a closed table without its last row
    name = _c_name(path.stem)
    words = {
        "file": _harmless(path.name),
        "motion": "over its period" if closed else "a path",
        "ends": _REPEATS if closed else _RESTS,
        "provenance": _harmless(provenance_text(table)),
        "name": name,
        "NAME": name.upper(),
        "joints": _harmless(json.dumps(servos.joint_names)),
        "rotors": ", ".join(str(joint.rotor) for joint in servos.joints),
        "seconds": f"{times[-1]:g}",
        "period": _literal(times[-1]),
        "rows": rows,
        "intervals": len(times) - 1,
        "repeats": int(closed),
        "angle": _rows_of(angles[:rows]),
    }
    if cubic:
        words |= _words_of_cubics(table, times, rows)
    kind = "cubic" if cubic else "straight"
    template = Path(__file__).with_name(f"{kind}_gait.h.txt")
    text = Template(template.read_text(encoding="ascii")).substitute(words)
    path.write_text(text, encoding="utf-8")


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


def _words_of_cubics(table: Table, times: FloatArray, rows: int) -> dict[str, Any]:
    """Return what the template of cubics has beside the angles: rates, peaks, and how far they are off the gait."""
    rates = np.column_stack([table[name] for name in RATES])
    longest = float(np.diff(times).max())
    if table.motion is not None:
        bound = _proven_error(table, table.motion, longest)
        off = f"at most {1.06 * bound:.1e}"  # not less, to two digits
    else:
        changes = np.diff(accelerations_of(table), 2, axis=0)
        estimate = longest**2 * float(np.abs(changes).max(initial=0.0)) / _CUBIC_SHARE
        off = f"about {estimate:.1e}"
    step = times[-1] / (len(times) - 1)
    rate, acceleration = cubic_peaks(
        table.alpha.astype(np.float32).astype(float),
        rates.astype(np.float32).astype(float),
        step,
    )
    return {
        "rate_rows": _rows_of(rates[:rows]),
        "off": off,
        "rate": f"{rate:.4g}",
        "acceleration": f"{acceleration:.4g}",
        "step": _literal(step),
    }


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
    rate = max(float(np.abs(one).max()) for one in (rates, between))
    return rate, max(float(np.abs(one).max()) for one in (starting, ending))


def _proven_error(table: Table, motion: TimedGait, step: float) -> float:
    """Return a bound of the error of the cubics through a table's floats against the motion that it samples [rad].

    For a cubic with the values and slopes of both ends it is h⁴/384·max|f⁗|. Over a corner, where f‴ jumps, it is
    h³/96·max|f‴|: the integral of |Peano kernel| is largest at h/2. Where f″ jumps, it is h²/16·max|f″|. Angles that are off by a and rates that are off by
    b, as floats are, add a + h·b/4.
    """
    tilts = tilts_from_joints(table.columns, servos_of(table))
    seconds = table["t"] - table["t"][0]
    off = []
    for names, values in zip((ANGLES, RATES), motion.at(seconds), strict=False):
        written = np.column_stack([tilts[name] for name in names])
        stated = np.column_stack([table[name] for name in names])
        by_float = np.abs(stated - stated.astype(np.float32)).max()
        off.append(float(by_float + np.abs(written - values).max()))
    second, third, fourth = (float(motion.peaks(order).max()) for order in (2, 3, 4))
    corners = motion.corner_times
    after = np.searchsorted(seconds[1:-1], corners)
    nearest = np.minimum(
        np.abs(corners - seconds[after]), np.abs(corners - seconds[after + 1])
    )
    between_rows = min(step**2 / 16 * second, step**3 / 96 * third)
    if nearest.max() <= _NANOSECOND:
        between_rows = min(step**4 / 384 * fourth, between_rows)
    return between_rows + off[0] + step / 4 * off[1]


def _harmless(text: str) -> str:
    """Return JSON, or a name, escaped so that it contains no comment marks and no trigraph; JSON reads the same."""
    return (
        text.replace("*", "\\u002a")
        .replace("?", "\\u003f")
        .encode("ascii", "backslashreplace")
        .decode()
    )
