"""A gait as one C header: a table of its angles, and a function that returns them at any time.

The header is C99 and C++11, needs no library but <stdint.h>, allocates nothing, and takes any time: before 0, after
many periods, not a number. What made it is told in its first comment.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gaitgraph.errors import InputError
from gaitgraph.gait.rows import is_closed
from gaitgraph.gait.table import ACCELERATIONS, RATES, Table, provenance_text
from gaitgraph.io.options import FormatOptions
from gaitgraph.io.trajectory import merged_up_to, told_after

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

__all__ = ["MOST_ROWS", "provenance_of_h", "write_h"]

FloatArray = npt.NDArray[np.float64]

MOST_ROWS = 16_384
"""A C header may have this many rows at most: as floats with rates, half a megabyte."""

_MARK = " * made_by: "
_END = "#endif"
_LARGEST = 32_767
_EVEN = 1e-6
_NANOSECOND = 1e-9
_CUBIC_SHARE = 128.0
"""What a cubic is off by, as a part of step² times the largest second difference of the accelerations: 1/384 where the
fourth derivative is steady, and up to thrice that where the third one jumps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Curve:
    """What a header has: rows at times, joined by straight lines or cubics; a closed one without its last row."""

    times: FloatArray
    angles: FloatArray
    rates: FloatArray | None
    accelerations: FloatArray | None
    closed: bool
    even: bool

    @property
    def period(self) -> float:
        return float(self.times[-1])

    @property
    def intervals(self) -> int:
        return len(self.times) - 1

    @property
    def rows(self) -> int:
        return self.intervals if self.closed else len(self.times)


def write_h(pieces: Iterable[Table], path: Path, options: FormatOptions | None = None) -> None:
    """Write a new C header.

    Rows are joined by cubics where the table has rates and accelerations, else, and in fixed point, by straight lines.

    Raises
    ------
    InputError
        If the table has no clock, has too many rows, or has what the numbers asked for cannot hold.
    """
    options = options or FormatOptions()
    table = merged_up_to(pieces, MOST_ROWS + 1, "a C header")
    curve = _curve_of(table, options.number)
    name = options.c_name or _identifier(path.stem)
    text = _FIXED if options.number == "fixed" else _FLOATING
    parts = _Parts(name=name, number=options.number, curve=curve)
    lines = [
        *_comment(path.name, table, options, parts),
        f"#ifndef GAITGRAPH_{name.upper()}_H",
        f"#define GAITGRAPH_{name.upper()}_H",
        "",
        "#include <stdint.h>",
        "",
        *parts.constants(),
        "",
        *parts.tables(),
        _filled(text, parts),
        _END,
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def provenance_of_h(path: Path) -> str:
    """Return the text of what made a C header."""
    return told_after(_MARK, path, end=_END)


def _identifier(stem: str) -> str:
    """Return what names in C may begin with, from a file's name.

    >>> _identifier("gait-3 b"), _identifier("3rd")
    ('gait_3_b', 'gait_3rd')
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", stem)[:60]
    return name if name[:1].isalpha() else f"gait_{name.strip('_')}"[:60].rstrip("_")


def _curve_of(table: Table, number: str) -> _Curve:
    if "t" not in table or "alpha3" not in table:
        missing = "t" if "t" not in table else "alpha3"
        raise InputError(f"column {missing!r} is missing; allowed is a table with a clock and four angles")
    times = table["t"] - table["t"][0]
    smooth = ACCELERATIONS[0] in table and RATES[0] in table
    angles = table.alpha
    rates = _rows_of(table, RATES) if smooth else None
    accelerations = _rows_of(table, ACCELERATIONS) if smooth else None
    closed = is_closed(table)
    if len(times) == 1:  # a gait that is a point, once more
        times, angles, closed = np.array([0.0, 1.0]), np.vstack([angles, angles]), True
        rates = accelerations = None
    step = times[-1] / (len(times) - 1)
    even = bool(np.abs(times - step * np.arange(len(times))).max() <= max(_EVEN * step, _NANOSECOND))
    if rates is None or accelerations is None or not accelerations.any():
        rates = accelerations = None
    if number == "fixed" and not even:
        raise InputError(
            "number: 'fixed' of rows that are not evenly spaced; allowed is float, or even rows: a new clock"
        )
    if number == "float" and not even and np.diff(times.astype(np.float32)).min() <= 0:
        raise InputError("number: 'float' of rows too near in time for it; allowed is double")
    return _Curve(times=times, angles=angles, rates=rates, accelerations=accelerations, closed=closed, even=even)


def _rows_of(table: Table, names: Iterable[str]) -> FloatArray:
    return np.column_stack([table[name] for name in names])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Parts:
    """The parts of a header that depend on the curve."""

    name: str
    number: str
    curve: _Curve

    @property
    def real(self) -> str:
        """The type of angles and times."""
        return "double" if self.number == "double" else "float"

    @property
    def cubic(self) -> bool:
        """Whether rows are joined by cubics."""
        return self.number != "fixed" and self.curve.rates is not None

    @property
    def bits(self) -> int:
        """How many bits of a fixed-point number are behind the point: as many as its largest angle leaves."""
        largest = float(np.abs(self.curve.angles).max())
        bits = next((bits for bits in range(15, -1, -1) if round(largest * 2**bits) <= _LARGEST), None)
        if bits is None:
            raise InputError(
                f"number: 'fixed' of an angle of {largest:g} rad; allowed is up to {_LARGEST} rad, or float"
            )
        return bits

    def literal(self, value: float) -> str:
        """Return a number as the compiler reads the same one again."""
        if self.real == "double":
            return repr(float(value))
        return f"{np.float32(value)!s}f"

    def units(self) -> npt.NDArray[np.int64]:
        """Return the angles in fixed point."""
        return np.rint(self.curve.angles * 2.0**self.bits).astype(np.int64)

    def constants(self) -> list[str]:
        """Return the definitions of the period, the number of rows, and the scale."""
        upper = self.name.upper()
        found = [f"#define {upper}_PERIOD {self.literal(self.curve.period)}", f"#define {upper}_ROWS {self.curve.rows}"]
        if self.number == "fixed":
            found.append(f"#define {upper}_SCALE {self.literal(2.0**-self.bits)}")
        return found

    def tables(self) -> list[str]:
        """Return the tables."""
        curve = self.curve
        if self.number == "fixed":
            return self._table("int16_t", "angle", [list(map(str, row)) for row in self.units().tolist()])
        found = self._table(self.real, "angle", [list(map(self.literal, row)) for row in curve.angles.tolist()])
        if self.cubic and curve.rates is not None:
            found += self._table(self.real, "rate", [list(map(self.literal, row)) for row in curve.rates.tolist()])
        if not curve.even:
            times = ", ".join(map(self.literal, curve.times.tolist()))
            found += [f"static const {self.real} {self.name}_time[{len(curve.times)}] = {{", *_wrapped(times), "};", ""]
        return found

    def _table(self, kind: str, what: str, rows: list[list[str]]) -> list[str]:
        lines = [f"    {{{', '.join(row)}}}," for row in rows[: self.curve.rows]]
        return [f"static const {kind} {self.name}_{what}[{self.curve.rows}][4] = {{", *lines, "};", ""]


def _wrapped(text: str) -> list[str]:
    from textwrap import wrap

    return wrap(text, 116, initial_indent="    ", subsequent_indent="    ")


def _comment(file: str, table: Table, options: FormatOptions, parts: _Parts) -> list[str]:
    curve, name = parts.curve, parts.name
    span = f"over its period of {curve.period:g} s" if curve.closed else f"a way of {curve.period:g} s"
    names, rotors = options.joints_of(table)
    lines = [
        f"/* {_harmless(file)}: the angles of the joints that tilt four rotors through a gait, {span} [rad].",
        " *",
        f" * {name}_at(t, alpha) sets alpha[0] to alpha[3] to the angles at time t [s] of the joints",
        f" * {_harmless(json.dumps(names))}, which tilt rotors {', '.join(map(str, rotors))}.",
        f" * {_ends(curve, parts.real)}",
    ]
    if parts.number == "fixed":
        off = float(np.abs(parts.units() * 2.0**-parts.bits - curve.angles).max())
        lines += [
            f" * Its table is in units of 2^-{parts.bits} rad: at the rows it is off by {off:.1e} rad at most.",
            f" * {name}_at_phase(phase, angle) sets angle[0] to angle[3] in these units with whole numbers alone;",
            f" * the phase is the part of the {'period' if curve.closed else 'way'} that is over, times 2^32.",
        ]
    lines.append(f" * {_between(parts)}")
    return [*lines, f"{_MARK}{_harmless(provenance_text(table))}", " */"]


def _ends(curve: _Curve, real: str) -> str:
    if not curve.closed:
        return "Before it and after it the angles are those of its ends."
    digits = "7" if real == "float" else "16"
    return f"It repeats for ever; a {real} has {digits} digits, so let t stay within some periods of 0."


def _between(parts: _Parts) -> str:
    """Return how rows are joined, and how far that is from the gait that the table is of."""
    curve = parts.curve
    step = float(np.diff(curve.times).max())
    if curve.accelerations is None:
        return "Between rows the angles change evenly; corners of the gait between rows are cut."
    if parts.cubic:
        bend = float(np.abs(np.diff(curve.accelerations, 2, axis=0)).max(initial=0.0))
        off = step**2 * bend / _CUBIC_SHARE
        return (
            f"Between rows it is a cubic by angles and rates, off the gait by up to about {off:.1e} rad, and rounding."
        )
    off = step**2 * float(np.abs(curve.accelerations).max()) / 8
    return f"Between rows the angles change evenly, which is off the gait by up to about {off:.1e} rad, and rounding."


def _harmless(text: str) -> str:
    r"""Return JSON, or a name, such that it ends no comment, begins none, and has no trigraph; JSON reads the same.

    >>> _harmless('{"name": "a*/b?"}')
    '{"name": "a\\u002a/b\\u003f"}'
    """
    plain = text.replace("*", "\\u002a").replace("?", "\\u003f")
    return plain.encode("ascii", "backslashreplace").decode()


def _filled(template: str, parts: _Parts) -> str:
    """Return C with the names, the type, and the parts that this curve needs."""
    curve = parts.curve
    words: dict[str, Any] = {
        "name": parts.name,
        "NAME": parts.name.upper(),
        "real": parts.real,
        "far": "9.0e15" if parts.real == "double" else "1.0e9f",
        "whole": "int64_t" if parts.real == "double" else "int32_t",
        "zero": parts.literal(0.0),
        "one": parts.literal(1.0),
        "two": parts.literal(2.0),
        "three": parts.literal(3.0),
        "intervals": f"{parts.name.upper()}_ROWS" if curve.closed else f"({parts.name.upper()}_ROWS - 1)",
        "next": f"i + 1 < {parts.name.upper()}_ROWS ? i + 1 : 0" if curve.closed else "i + 1",
    }
    words["phase"] = (_AROUND if curve.closed else _ALONG).format(**words)
    step = f"    const {parts.real} h = {parts.literal(curve.period / curve.intervals)};\n" if parts.cubic else ""
    words["spacing"] = step if curve.even else f"    {parts.real} h;\n"
    words["place"] = (_EVEN_ROWS if curve.even else _UNEVEN_ROWS).format(**words)
    words["join"] = (_CUBIC if parts.cubic else _STRAIGHT).format(**words)
    return template.format(**words)


_AROUND = """\
    if (!(x > -{far} && x < {far})) {{
        x = {zero}; /* not a number, or too far off to tell */
    }}
    x -= ({real})({whole})x;
    if (x < {zero}) {{
        x += {one};
    }}"""

_ALONG = """\
    if (!(x > {zero})) {{
        x = {zero};
    }}
    if (x > {one}) {{
        x = {one};
    }}"""

_EVEN_ROWS = """\
    x *= ({real}){intervals};
    i = (int32_t)x;
    if (i >= {intervals}) {{
        i = {intervals} - 1;
    }}
    x -= ({real})i;
    j = {next};"""

_UNEVEN_ROWS = """\
    x *= {NAME}_PERIOD;
    for (i = 0, j = {intervals}; j - i > 1;) {{
        const int32_t middle = (i + j) / 2;
        if ({name}_time[middle] <= x) {{
            i = middle;
        }} else {{
            j = middle;
        }}
    }}
    h = {name}_time[i + 1] - {name}_time[i];
    x = (x - {name}_time[i]) / h;
    j = {next};"""

_STRAIGHT = """\
        const {real} step = {name}_angle[j][k] - {name}_angle[i][k];
        alpha[k] = {name}_angle[i][k] + x * step;"""

_CUBIC = """\
        const {real} step = {name}_angle[j][k] - {name}_angle[i][k];
        const {real} v = h * {name}_rate[i][k], w = h * {name}_rate[j][k];
        const {real} b = {three} * step - {two} * v - w, c = v + w - {two} * step;
        alpha[k] = {name}_angle[i][k] + x * (v + x * (b + x * c));"""

_FLOATING = """\
static inline void {name}_at({real} t, {real} alpha[4])
{{
    {real} x = t / {NAME}_PERIOD;
{spacing}    int32_t i, j;
    int k;
{phase}
{place}
    for (k = 0; k < 4; ++k) {{
{join}
    }}
}}
"""

_FIXED = """\
static inline void {name}_at_phase(uint32_t phase, int16_t angle[4])
{{
    const uint64_t x = (uint64_t)phase * (uint64_t){intervals};
    const int32_t i = (int32_t)(x >> 32);
    const int32_t j = {next};
    const int32_t part = (int32_t)((x >> 17) & 0x7fffu);
    int k;
    for (k = 0; k < 4; ++k) {{
        const int32_t step = (int32_t){name}_angle[j][k] - (int32_t){name}_angle[i][k];
        const int32_t half = step < 0 ? -16384 : 16384;
        angle[k] = (int16_t)({name}_angle[i][k] + (step * part + half) / 32768);
    }}
}}

static inline void {name}_at(float t, float alpha[4])
{{
    float x = t / {NAME}_PERIOD;
    int32_t i, j;
    int k;
{phase}
{place}
    for (k = 0; k < 4; ++k) {{
        const float step = (float){name}_angle[j][k] - (float){name}_angle[i][k];
        alpha[k] = {NAME}_SCALE * ((float){name}_angle[i][k] + x * step);
    }}
}}
"""
