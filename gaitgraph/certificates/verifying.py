"""Check a certificate, and hold a table against it: each row must be on the proven curve at its time."""

from __future__ import annotations

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from gaitgraph.certificates.check import (
    ONE,
    Row,
    check,
    held_against,
    read,
    wrenches_of,
)
from gaitgraph.certificates.making import Certified
from gaitgraph.errors import InputError
from gaitgraph.files import is_stream, naming_file, path_of, text_of
from gaitgraph.gait.table import ANGLES, Table
from gaitgraph.io.formats import FORMATS, read_table
from gaitgraph.records import Record

if TYPE_CHECKING:
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.vehicle import Vehicle

CERTIFICATE = ".cert.json"
"""The suffix of the certificate of a gait file, beside it."""

_MOST_ROWS = 20_000  # that are compared without being asked to


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Verified(Record):
    """What a certificate proves, and what of a table is on its curve.

    Parameters
    ----------
    found
        The answer of :func:`gaitgraph.certificates.check.check`.
    table, off
        The file that was compared, or None; and its first row that is not on the curve, "" if all are.
    between
        How far the middles of straight lines between its rows are from the curve at most [rad].
    """

    found: dict[str, Any]
    table: str | None = None
    rows: int | None = None
    off: str = ""
    between: float | None = None

    def __bool__(self) -> bool:
        return self.found["proved"] and not self.off

    @property
    def flyable(self) -> bool:
        """Whether the claims are proved, and are those that a flyable gait needs."""
        return bool(self.found["flyable"])

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        values = self.found | {
            "table": self.table,
            "rows": self.rows,
            "off": self.off or None,
            "between": self.between,
        }
        del values["lines"]
        return values

    def __str__(self) -> str:
        lines = list(self.found["lines"])
        if self.table is None:
            lines.append("no table was compared with the curve")
        elif self.off:
            lines.append(f"{self.table} is NOT on the proven curve: {self.off}")
        else:
            lines.append(
                f"{self.table}: all {self.rows} rows are on the proven curve to {self.found['deviation']:.2g} rad; straight "
                f"lines between them leave it by {self.between:.2g} rad"
            )
        return "\n".join(lines)


def verify(
    certificate: str | Path | IO[Any] | Certified,
    table: str | Path | IO[Any] | None = None,
    *,
    format: str | None = None,
) -> Verified:
    """Return what a certificate proves, and whether each row of a table is on its curve at the row's time.

    Parameters
    ----------
    certificate
        The path of a certificate, an open stream, or one that was made or stored.
    table
        The path of a gait file of any format that is read, servo tables included, or an open stream with its `format`,
        "csv" say; by default the one that lies beside the certificate, gait.csv beside gait.cert.json, if there is one.

    Raises
    ------
    InputError, FileProblem
        If the first is no certificate, or the second no table with times, or the certificate states no times.

    Notes
    -----
    A row may be off by the deviation that the certificate states; in a table of servo positions by half a step of the servo
    more, and in a bag by what half a nanosecond explains.
    """
    path = None
    named = "certificate"
    if isinstance(certificate, Certified):
        text = certificate.text
    elif is_stream(certificate):
        text = text_of(certificate, "certificate")
    else:
        path = path_of(certificate, "certificate")
        named, text = f"certificate {str(path)!r}", text_of(path, "certificate")
    try:
        found = check(text)
    except (OverflowError, RecursionError, ValueError) as error:
        rule = "it must be JSON: " if isinstance(error, json.JSONDecodeError) else ""
        raise InputError(f"{named}: {rule}{error}") from None
    if table is None and path is not None and "rate" in found["values"]:
        table = table_beside(path)
    if table is None:
        return Verified(found=found)
    name = "the table" if is_stream(table) else str(table)
    try:
        rows = read_table(table, format=format)
    except InputError as error:
        if error.field != "t":
            raise
        return Verified(found=found, table=name, off=str(error))
    with naming_file(table):
        if "t" not in rows or "alpha3" not in rows:
            raise InputError("a table that is compared must have t and four angles")
        try:
            off, between = held_against(text, *_exact_rows(rows, Path(name)))
            off = off or _other_kind(found["path"], rows)
        except (OverflowError, ValueError) as error:
            raise InputError(f"{named}: {error}") from None
    return Verified(found=found, table=name, rows=len(rows), off=off, between=between)


def _other_kind(path: str, rows: Table) -> str:
    """Return that a certificate is of a closed gait and a table of a path, or the other way round; else ""."""
    if (path == "closed") == rows.repeats:
        return ""
    motion = "repeats" if rows.repeats else "is run once"
    return f"its motion {motion}, and the path of the certificate is {path}"


def table_beside(certificate: Path) -> Path | None:
    """Return the gait file beside a certificate, of the first format for which there is one."""
    if not certificate.name.endswith(CERTIFICATE):
        return None
    stem = certificate.name.removesuffix(CERTIFICATE)
    for form in FORMATS.values():
        path = certificate.with_name(stem + form.suffix)
        if form.reads and path.exists():
            return path
    return None


def certificate_beside(gait_file: Path) -> Path:
    """Return the path of the certificate beside a gait file, gait.cert.json beside gait.csv, whether or not it is there."""
    return gait_file.with_suffix(CERTIFICATE) if gait_file.suffix else Path()


def note_on_certificate(gait_file: Path, table: Table, vehicle: Vehicle) -> str:
    """Return why the certificate that lies beside a gait file is not that of its rows and vehicle, "" if it is."""
    from gaitgraph.certificates.making import stated_vehicle

    beside = certificate_beside(gait_file)
    if "t" not in table or len(table) > _MOST_ROWS:
        return ""
    name = f"the certificate {beside.name!r}"
    try:
        text = text_of(beside, "certificate")
        document = read(text)
        stated = _wrenches_of(document["vehicle"])
        off, _ = held_against(text, *_exact_rows(table, gait_file))
        off = off or _other_kind(document["path"], table)
    except (OverflowError, RecursionError, ValueError):
        return f"{name} is no certificate; gaitgraph verify {beside.name} says why"
    if off:
        return f"{name} does not belong to these rows: {off}"
    own = _wrenches_of(stated_vehicle(vehicle))
    if np.allclose(stated, own, rtol=1e-9, atol=1e-12):
        return ""
    most = float(np.abs(stated - own).max())
    return f"{name} is of another vehicle: moments of rotors differ by up to {most:.3g} arm lengths"


def _wrenches_of(vehicle: dict[str, Any]) -> FloatArray:
    """Return the moments and forces of the rotors of a certificate's vehicle, shape (4, 2, 6)."""
    return np.array(wrenches_of(vehicle), dtype=float)[..., 0] / ONE


def _exact_rows(table: Table, path: Path) -> tuple[list[Row], Fraction]:
    """Return a table's rows as exact numbers, each with what its format adds to the deviation, and half a unit of t."""
    t = table["t"]
    slack = np.zeros((len(table), 4))
    for joint, name in enumerate(ANGLES):
        if table.digits[name].steps:
            slack[:, joint] = table.half_units(name)
    if path.suffix == ".mcap" or path.is_dir():
        rates = np.abs(np.diff(table.alpha, axis=0)).max(axis=0) / np.diff(t).min()
        slack += rates * 1e-9  # stamps are whole nanoseconds
    rows = [
        Row(Fraction(time), list(map(Fraction, angles)), list(map(Fraction, slacks)))
        for time, angles, slacks in zip(
            t.tolist(), table.alpha.tolist(), slack.tolist(), strict=True
        )
    ]
    return rows, Fraction(float(table.half_units("t").min()))
