"""A gait as a C header.

The header has a table of the angles, and a function that returns them at any time. It is C99 and C++11, needs no
library but <stdint.h>, allocates nothing, and takes any time: before 0, after many periods, not a number. Its first
comment states what made it. Its functions are in `gait_header.h.txt`.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.gait.table import ACCELERATIONS, RATES, Table, is_closed, provenance_text
from gaitgraph.io.formats import FORMATS
from gaitgraph.io.ros import merged_up_to

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from gaitgraph.io.formats import FormatOptions

FloatArray = npt.NDArray[np.float64]

_MOST_ROWS = 16_384  # as floats with rates, half a megabyte
_LARGEST = 32_767
_EVEN, _NANOSECOND = 1e-6, 1e-9
# The error of a cubic is step² times the largest second difference of the accelerations, divided by this: by 384 where
# the fourth derivative is steady, and thrice as much where the third one jumps.
_CUBIC_SHARE = 128.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Curve:
    """What a header has: rows at times, joined by straight lines or cubics; a closed one without its last row."""

    name: str
    number: str
    times: FloatArray
    angles: FloatArray
    rates: FloatArray | None
    accelerations: FloatArray | None
    closed: bool
    even: bool
    bits: int  # of a fixed-point number behind the point: as many as its largest angle leaves

    @property
    def rows(self) -> int:
        return len(self.times) - self.closed

    @property
    def real(self) -> str:
        return "double" if self.number == "double" else "float"

    @property
    def cubic(self) -> bool:
        return self.number != "fixed" and self.rates is not None

    def literal(self, value: float) -> str:
        """Return a number as the compiler reads the same one again."""
        return repr(float(value)) if self.real == "double" else f"{np.float32(value)!s}f"

    def units(self) -> npt.NDArray[np.int64]:
        """Return the angles in fixed point."""
        return np.rint(self.angles * 2.0**self.bits).astype(np.int64)


def write_h(pieces: Iterable[Table], path: Path, options: FormatOptions) -> None:
    """Write a new C header.

    Rows are joined by cubics where the table has rates and accelerations, else, and in fixed point, by straight lines.
    """
    table = merged_up_to(pieces, _MOST_ROWS + 1, "a C header")
    number, name = options.number, options.c_name or re.sub(r"[^A-Za-z0-9_]", "_", path.stem)[:60]
    if not name[:1].isalpha():
        name = f"gait_{name.strip('_')}"[:60].rstrip("_")
    times, angles, closed = table["t"] - table["t"][0], table.alpha, is_closed(table)
    motion: dict[str, Any] = {"rates": None, "accelerations": None}
    if len(times) == 1:  # a gait that is a point, once more
        times, angles, closed = np.array([0.0, 1.0]), np.vstack([angles, angles]), True
    elif ACCELERATIONS[0] in table and RATES[0] in table and any(table[one].any() for one in ACCELERATIONS):
        columns = {"rates": RATES, "accelerations": ACCELERATIONS}
        motion = {what: np.column_stack([table[one] for one in names]) for what, names in columns.items()}
    step = times[-1] / (len(times) - 1)
    even = bool(np.abs(times - step * np.arange(len(times))).max() <= max(_EVEN * step, _NANOSECOND))
    largest = float(np.abs(angles).max())
    bits = next((bits for bits in range(15, -1, -1) if round(largest * 2**bits) <= _LARGEST), None)
    if number == "fixed" and not even:
        raise InputError("number must be float or double for rows that are not evenly spaced, got 'fixed'")
    if number == "fixed" and bits is None:
        raise InputError(f"number must be float for an angle of {largest:g} rad; 'fixed' goes up to {_LARGEST} rad")
    if number == "float" and not even and np.diff(times.astype(np.float32)).min() <= 0:
        raise InputError("number must be double for rows so near in time, got 'float'")
    motion |= {"times": times, "angles": angles, "closed": closed, "even": even}
    curve = _Curve(name=name, number=number, bits=bits or 0, **motion)
    guard = f"GAITGRAPH_{name.upper()}_H"
    lines = [*_comment(path.name, table, options, curve), f"#ifndef {guard}", f"#define {guard}", ""]
    lines += ["#include <stdint.h>", "", *_tables(curve), _functions(curve), FORMATS[".h"].end]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _comment(file: str, table: Table, options: FormatOptions, curve: _Curve) -> list[str]:
    """Return what the header is of, how far it is off, and what made it."""
    name, seconds = curve.name, f"{curve.times[-1]:g} s [rad]."
    names, rotors = options.joints_of(table)
    over, ends = f"a path of {seconds}", "Before it and after it the angles are those of its ends."
    if curve.closed:
        over, digits = f"over its period of {seconds}", "7" if curve.real == "float" else "16"
        ends = f"It repeats for ever; a {curve.real} has {digits} digits, so let t stay within some periods of 0."
    lines = [
        f"/* {_harmless(file)}: the angles of the joints that tilt four rotors through a gait, {over}",
        " *",
        f" * {name}_at(t, alpha) sets alpha[0] to alpha[3] to the angles at time t [s] of the joints",
        f" * {_harmless(json.dumps(names))}, which tilt rotors {', '.join(map(str, rotors))}.",
        f" * {ends}",
    ]
    if curve.number == "fixed":
        off = float(np.abs(curve.units() * 2.0**-curve.bits - curve.angles).max())
        lines += [
            f" * Its table is in units of 2^-{curve.bits} rad: at the rows it is off by {off:.1e} rad at most.",
            f" * {name}_at_phase(phase, angle) sets angle[0] to angle[3] in these units with whole numbers alone;",
            f" * the phase is the part of the {'period' if curve.closed else 'path'} that is over, times 2^32.",
        ]
    step = float(np.diff(curve.times).max())
    if curve.accelerations is None:
        between = "the angles change evenly; corners of the gait between rows are cut."
    elif curve.cubic:
        off = step**2 * float(np.abs(np.diff(curve.accelerations, 2, axis=0)).max(initial=0.0)) / _CUBIC_SHARE
        between = f"it is a cubic by angles and rates, off the gait by up to about {off:.1e} rad, and rounding."
    else:
        off = step**2 * float(np.abs(curve.accelerations).max()) / 8
        between = f"the angles change evenly, which is off the gait by up to about {off:.1e} rad, and rounding."
    return [*lines, f" * Between rows {between}", FORMATS[".h"].mark + _harmless(provenance_text(table)), " */"]


def _harmless(text: str) -> str:
    """Return JSON, or a name, such that it ends no comment, begins none, and has no trigraph; JSON reads the same."""
    plain = text.replace("*", "\\u002a").replace("?", "\\u003f")
    return plain.encode("ascii", "backslashreplace").decode()


def _tables(curve: _Curve) -> list[str]:
    """Return the definitions of the period, the number of rows and the scale, and the tables."""
    name, upper = curve.name, curve.name.upper()
    lines = [f"#define {upper}_PERIOD {curve.literal(curve.times[-1])}", f"#define {upper}_ROWS {curve.rows}"]
    kind: str = curve.real
    text: Callable[[Any], str] = curve.literal
    tables: dict[str, Any] = {"angle": curve.angles, "rate": curve.rates}
    if curve.number == "fixed":
        lines.append(f"#define {upper}_SCALE {curve.literal(2.0**-curve.bits)}")
        kind, text, tables = "int16_t", str, {"angle": curve.units()}
    for what, values in tables.items():
        if values is not None:
            lines += ["", f"static const {kind} {name}_{what}[{curve.rows}][4] = {{"]
            lines += [*(f"    {{{', '.join(map(text, row))}}}," for row in values[: curve.rows].tolist()), "};"]
    if not curve.even:
        times = ", ".join(map(curve.literal, curve.times.tolist()))
        lines += ["", f"static const {curve.real} {name}_time[{len(curve.times)}] = {{"]
        lines += [*wrap(times, 116, initial_indent="    ", subsequent_indent="    "), "};"]
    return [*lines, ""]


def _functions(curve: _Curve) -> str:
    """Return the lines of the template that this curve needs, with its names and types.

    A line of `gait_header.h.txt` states, before a bar, what the curve must be.
    """
    rows, real, upper = f"{curve.name.upper()}_ROWS", curve.real, curve.name.upper()
    kinds = {
        "",
        "closed" if curve.closed else "open",
        "even" if curve.even else "uneven",
        "cubic" if curve.cubic else "straight",
        "fixed" if curve.number == "fixed" else "floating",
    }
    words = {"name": curve.name, "NAME": upper, "real": real}
    words |= {"far": "9.0e15", "whole": "int64_t"} if real == "double" else {"far": "1.0e9f", "whole": "int32_t"}
    words |= {word: curve.literal(value) for value, word in enumerate(("zero", "one", "two", "three"))}
    words["step"] = curve.literal(curve.times[-1] / (len(curve.times) - 1))
    words["intervals"] = rows if curve.closed else f"({rows} - 1)"
    words["next"] = f"i + 1 < {rows} ? i + 1 : 0" if curve.closed else "i + 1"
    template = Path(__file__).with_name("gait_header.h.txt").read_text(encoding="ascii").splitlines()
    parts = (one.partition("|") for one in template)
    lines = [line for needed, _, line in parts if kinds.issuperset(needed.split(","))]
    return re.sub("<<([A-Za-z]+)>>", lambda found: words[found[1]], "\n".join(lines)) + "\n"
