"""A gait as a C header.

The header has a table of the angles as floats, and a function that returns them at any time: before 0, after many
periods, not a number. It is C99 and C++11, needs only <stdint.h>, and allocates nothing. Its first comment states what
made it. Its text is in `gait_header.h.txt`; before a bar each line has the kinds of curve that it is for.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
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


_MOST_ROWS = 16_384  # as floats with rates, half a megabyte
_EVEN, _NANOSECOND = 1e-6, 1e-9
# Of a table alone: accelerations within ±d of a straight line between rows put a cubic off by at most step²/16·d, and
# where they jump, d is half the largest second difference of the rows' accelerations.
_CUBIC_SHARE = 32.0


def write_h(table: Table, path: Path) -> None:
    """Write a new C header.

    Rows are joined by cubics where the table says so and has no linkage, else by straight lines.
    """
    check_rows(table, _MOST_ROWS + 1, "a C header")
    name = re.sub(r"[^A-Za-z0-9_]", "_", path.stem)[:60]
    if not name[:1].isalpha():
        name = f"gait_{name.strip('_')}"[:60].rstrip("_")
    times, angles, closed = (
        table["t"] - table["t"][0],
        table.alpha,
        is_closed(table.alpha) and table.repeats,
    )
    servos = servos_of(table)
    is_linked = any(
        joint.linkage is not None for joint in servos.joints
    )  # then rates jump between rows
    cubic = table.joined_by_cubics and not is_linked
    if len(times) == 1:  # a gait that is a point, once more
        times, angles, closed, cubic = (
            np.array([0.0, 1.0]),
            np.vstack([angles, angles]),
            True,
            False,
        )
    step = times[-1] / (len(times) - 1)
    if np.abs(times - step * np.arange(len(times))).max() > max(
        _EVEN * step, _NANOSECOND
    ):
        raise InputError(
            "t must be evenly spaced in a C header",
            advice=Advice(
                "give the gait another timing with samples= or rate=",
                "give the gait another timing with --samples or --rate",
            ),
        )
    rows = len(times) - closed  # a closed table without its last row

    def literal(value: float) -> str:
        """Return a number as the compiler reads the same one again."""
        return f"{np.float32(value)!s}f"

    tables, off, tabled = list[str](), "0", {"angle": angles}
    if cubic:
        tabled["rate"] = np.column_stack([table[one] for one in RATES])
        longest = float(np.diff(times).max())
        changes = np.diff(accelerations_of(table), 2, axis=0)
        estimate = longest**2 * float(np.abs(changes).max(initial=0.0)) / _CUBIC_SHARE
        off = f"about {estimate:.1e}"
        if table.motion is not None:
            bound = _proven_error(table, table.motion, longest)
            off = f"at most {1.06 * bound:.1e}"  # not less, to two digits
    for what, values in tabled.items():
        tables += ["", f"static const float {name}_{what}[{rows}][4] = {{"]
        tables += [
            f"    {{{', '.join(map(literal, row))}}}," for row in values[:rows].tolist()
        ] + ["};"]

    upper = name.upper()
    words = {
        "file": _harmless(path.name),
        "provenance": _harmless(provenance_text(table)),
        "tables": "\n".join(tables),
    }
    words |= {"name": name, "NAME": upper, "rows": str(rows), "off": off}
    if cubic:
        floats = [one.astype(np.float32).astype(float) for one in tabled.values()]
        rate, acceleration = cubic_peaks(floats[0], floats[1], step)
        words |= {"rate": f"{rate:.4g}", "acceleration": f"{acceleration:.4g}"}
    words["joints"] = _harmless(json.dumps(servos.joint_names))
    words["rotors"] = ", ".join(str(joint.rotor) for joint in servos.joints)
    words |= {
        "period": literal(times[-1]),
        "seconds": f"{times[-1]:g}",
        "step": literal(step),
    }
    words["intervals"] = f"{upper}_ROWS" if closed else f"({upper}_ROWS - 1)"
    words["next"] = f"i + 1 < {upper}_ROWS ? i + 1 : 0" if closed else "i + 1"
    kinds = ("", "closed" if closed else "open", "cubic" if cubic else "straight")
    template = (
        Path(__file__)
        .with_name("gait_header.h.txt")
        .read_text(encoding="ascii")
        .splitlines()
    )
    parts = (one.partition("|") for one in template)
    lines = [line for needed, _, line in parts if needed in kinds]
    text = re.sub("<<([A-Za-z]+)>>", lambda found: words[found[1]], "\n".join(lines))
    path.write_text(text + "\n", encoding="utf-8")


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


def _proven_error(table: Table, motion: Any, step: float) -> float:
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
        floats = max(
            float(np.abs(table[name] - table[name].astype(np.float32)).max())
            for name in names
        )
        off.append(floats + float(np.abs(written - values).max()))
    second, third, fourth = (float(motion.peaks(order).max()) for order in (2, 3, 4))
    corners = motion.corner_times
    off_rows = (
        np.abs(
            corners[:, None]
            - seconds[np.searchsorted(seconds[1:-1], corners)[:, None] + [0, 1]]
        )
        .min(axis=1)
        .max()
    )
    between_rows = min(step**2 / 16 * second, step**3 / 96 * third)
    if off_rows <= _NANOSECOND:
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
