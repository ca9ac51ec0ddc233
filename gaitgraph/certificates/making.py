"""Make the certificate of a gait: its curve as exact polynomials, its claims, and for each claim a cover of the curve.

What is claimed follows from the report of the gait and from samples, with room for round-off; an interval on which the
checker's own functions do not prove a claim is cut in half until they do.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal, Inexact
from fractions import Fraction
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from gaitgraph import __version__
from gaitgraph.angles import angle_within
from gaitgraph.arrays import freeze_arrays
from gaitgraph.certificates import check
from gaitgraph.certificates.open_paths import (
    GRID,
    decimal,
    opposite_once,
    pieces_along,
)
from gaitgraph.errors import Advice, FileWarning, Infeasible, InputError, wrong
from gaitgraph.files import (
    check_new_files,
    is_stream,
    naming_file,
    write_to,
    write_whole,
)
from gaitgraph.gait.given import given_gait
from gaitgraph.gait.table import Table, even_times, tilt_angles
from gaitgraph.invertibility import matrices
from gaitgraph.records import Record
from gaitgraph.texts import table_lines
from gaitgraph.timing.polynomials import bernstein_from_power, values_of
from gaitgraph.timing.timed_gait import TimedGait, timed_gait_of
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import four_of

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.gait.given import GaitLike, GivenGait
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.validation.report import Check, Report
    from gaitgraph.vehicle import Vehicle, VehicleLike

_ROOM = 0.01  # share by which claims stay below what is attained
_ROOM_OF_RATES = 0.03
_LEAST_ROOM = 1e-6  # of angles [rad], rates and so on
_SLACK = Fraction(1, 10**9)  # of limits, a share of them
_OPEN_SLACK = Fraction(1, 10**6)  # of an open path, whose pieces are fitted
_FIGURES = 12  # of a piece's coefficients from the second power on
_SAMPLES = 17  # of a piece, at most
_MOST_SAMPLES = 20_000
_MOST_ANGLE = 3.9  # the checker's limit is 4 [rad]
_MOST_INTERVALS = 20_000  # of a piece
_SMALLEST = Fraction(1, 2**40)  # interval
_EXACT = Context(prec=60, traps=[Inexact])
_SMOOTH = (0, 0, 10, -15, 6)  # 10τ³ − 15τ⁴ + 6τ⁵, the smooth law on each piece


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certified(Record):
    """A gait with its certificate, the `document`, as plain values; `intervals` has the size of each claim's cover.

    `warnings` are those of the gait's report.
    """

    document: dict[str, Any]
    intervals: dict[str, int]
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        try:
            claims = check.read(self.text)["claims"]
        except (RecursionError, TypeError, ValueError) as error:
            raise InputError(
                f"document must be that of a certificate: {error}", field="document"
            ) from error
        if self.intervals.keys() != claims.keys():
            rule = f"must have the names {', '.join(claims)}"
            raise wrong("intervals", rule, self.intervals)
        freeze_arrays(self)

    @property
    def text(self) -> str:
        """The document as JSON, one line."""
        return json.dumps(self.document, separators=(",", ":")) + "\n"

    def write(self, path: str | Path | IO[Any], *, force: bool = False) -> None:
        """Write the document to a file, whole or not at all, or to an open stream."""
        if is_stream(path):
            content = BytesIO(self.text.encode())
            write_to(path, content, "a certificate", is_text=True)
            return
        check_certificate(path)
        check_new_files([path], force=force)
        write_whole([(Path(path), self.text.encode())], force=force)

    def as_mapping(self) -> dict[str, Any]:
        """Return the claims as plain values, ready for JSON."""
        claims = {name: dict(claim) for name, claim in self.document["claims"].items()}
        for claim in claims.values():
            claim.pop("cover", None)
        return {
            "status": "certified",
            "claims": claims,
            "intervals": self.intervals,
            "warnings": list(self.warnings),
        }

    def __repr__(self) -> str:
        pieces = len(self.document["pieces"])
        return f"<Certified: {pieces} pieces, claims {', '.join(self.intervals)}>"

    def __str__(self) -> str:
        rows = []
        for name, claim in self.as_mapping()["claims"].items():
            text = f"{_shown(claim)}; {self.intervals[name]} intervals"
            rows.append((name.replace("_", " "), text))
        lines = [f"Certified {len(self.document['pieces'])} pieces"]
        lines += table_lines(rows)
        lines += [f"warning: {warning}" for warning in self.warnings]
        return "\n".join(lines)


def _shown(claim: dict[str, Any]) -> str:
    """Return the names and values of a claim in words."""
    texts = []
    for name, value in claim.items():
        shown = value
        if isinstance(value, list):
            figures = [f"{float(number):.4g}" for number in value]
            shown = f"({', '.join(figures)})"
        texts.append(f"{name.replace('_', ' ')} {shown}")
    return ", ".join(texts)


def check_certificate(path: str | Path) -> None:
    """Raise InputError if the name of a certificate does not end in .json."""
    suffix = Path(path).suffix
    if suffix != ".json":
        raise InputError(
            f"output {str(path)!r} must end in .json, as a certificate does, got {suffix!r}",
            value=suffix,
            path=str(path),
        )


def certify(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    floor: float = DEFAULT_FLOOR,
    tilt: float | str | None = None,
    timing: bool = True,
    format: str | None = None,
) -> Certified:
    """Return the certificate of a flyable gait, which ``gaitgraph/certificates/check.py`` checks by itself.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.gait.given.given_gait`, or a path from rest to rest. With a clock rates
        and accelerations are claimed too; rows of a table without a law are joined by straight segments.
    vehicle, coefficients
        For tables and files; by default those that the table states, else the paper's vehicle.
    floor
        As for :func:`gaitgraph.validation.validating.validate`.
    tilt
        Claim that no attitude within this tilt from upright is singular; radians below π/2, or a text such as "30deg".
    timing
        False leaves rates out.
    format
        That of an open stream as the gait, "csv" say.

    Raises
    ------
    Infeasible
        If the gait is not flyable, a path is not at rest at both ends, its rows have rates but state no law, or a claim
        cannot be proved, with the reason and the place.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> certify(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red")).document["claims"]["sign_of_R"]["sign"]
    'negative'
    """
    given = given_gait(gait, vehicle=vehicle, coefficients=coefficients, format=format)
    angle = None
    if tilt is not None:
        angle = angle_within(tilt, "tilt", math.pi / 2 - 1e-6, least=0.0)
    with naming_file(given.file):
        table = given.table
        if table is not None and table.motion is None and table.joined_by_cubics:
            raise Infeasible(
                "no certificate, since the rows are played as cubics through their rates, and state no law; leave the "
                "columns of rates out to certify straight segments"
            )
        report = validate(given, floor=floor)
        if not report.flyable:
            raise Infeasible(
                f"no certificate, since the gait is not flyable: {report.reason}"
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileWarning)  # the report has them
            path: Gait | TimedGait = given.gait
            if timing and _is_timed(given):
                path = timed_gait_of(given)
    stated = _Stated(path)
    claims = _claims_of(stated, report, angle)
    intervals = {"joints": len(stated.pieces)}
    covered = [name for name in claims if name != "joints"]
    for name in covered:
        claims[name]["cover"] = []
        intervals[name] = 0
    for k, piece in enumerate(stated.curve):
        for name in covered:
            breaks = _cover(piece, name, claims[name], k)
            claims[name]["cover"].append(breaks)
            intervals[name] += len(breaks) - 1
    document = {
        "format": check.FORM["format"],
        "made_by": f"gaitgraph {__version__}",
        "deviation": _rounded(_deviation(stated, table), ROUND_CEILING),
        "path": stated.path,
        "vehicle": stated.vehicle,
        "pieces": stated.pieces,
        "claims": claims,
    }
    return Certified(
        document=_plain(document),
        intervals=intervals,
        warnings=report.warnings,
    )


def _is_timed(given: GivenGait) -> bool:
    if given.table is None:
        return given.motion is not None
    return "t" in given.table or "period" in given.table.about


def _plain(document: dict[str, Any]) -> Any:
    """Return a document with its exact numbers as texts."""
    return json.loads(json.dumps(document, default=_text_of))


def _text_of(number: Fraction) -> str:
    """Return an exact number as a decimal if it is a short one, else as a fraction."""
    above, below = map(Decimal, number.as_integer_ratio())
    try:
        return f"{_EXACT.divide(above, below):f}"
    except Inexact:
        return str(number)


def _rounded(value: float, rounding: str) -> Fraction:
    """Return a number with three significant digits."""
    return Fraction(Context(prec=3, rounding=rounding).create_decimal(value))


def _claimed(
    peak: float,
    limit: float | None,
    room: float = _ROOM,
    slack: Fraction = _SLACK,
) -> Fraction:
    """Return what is claimed of a peak: with room, or else the limit, with the slack if that is reached."""
    bound = _rounded(peak * (1 + room) + _LEAST_ROOM, ROUND_CEILING)
    if limit is None or bound <= limit:
        return bound
    if peak < limit * (1 - 2 * float(slack)):
        return decimal(limit)
    return decimal(limit) * (1 + slack)


def stated_vehicle(vehicle: Vehicle) -> dict[str, Any]:
    """Return a vehicle as a certificate states it, with exact numbers; without an arm length its lengths are in arms.

    Four equal arms are turned about body z, so that the first is along body x: singular values do not depend on it.
    Rotors with spins or axes of their own stay where they are.
    """
    arm = vehicle.arm_length or 1.0
    places: Any = vehicle.rotor_positions
    turning: dict[str, Any] = {"first_rotor_spin": vehicle.first_rotor_spin}
    if vehicle.spins is not None or vehicle.has_own_axes:
        tilt_axes, thrust_axes = vehicle.axes
        words = {1: "counterclockwise", -1: "clockwise"}
        turning = {
            "spins": [words[sign] for sign in vehicle.spin_signs],
            "tilt_axes": _decimals(tilt_axes),
            "thrust_axes": _decimals(thrust_axes),
        }
        if places is None:
            places = arm * np.array(vehicle.scaled_positions)
    elif places is None:
        height = vehicle.rotor_height
        places = [
            (arm, 0, height),
            (0, arm, height),
            (-arm, 0, height),
            (0, -arm, height),
        ]
    drags = vehicle.drag_to_thrust
    if drags is None or vehicle.arm_length is None:
        drags = vehicle.drag_ratio * arm
    return {
        "name": vehicle.name,
        **turning,
        "rotor_positions": _decimals(places),
        "drag_to_thrust": list(map(decimal, four_of(drags))),
    }


def _decimals(vectors: Any) -> list[list[Fraction]]:
    return [list(map(decimal, vector)) for vector in vectors]


class _Stated:
    """A gait as a certificate states it, at most `off` from the gait [rad], and as the `curve` of the checker."""

    def __init__(self, path: Gait | TimedGait) -> None:
        self.timed: Any = path if isinstance(path, TimedGait) else None
        self.gait = path.gait if isinstance(path, TimedGait) else path
        self.vehicle = stated_vehicle(self.gait.vehicle)
        self.path = "closed"
        if isinstance(path, TimedGait) and not path.repeats:
            self.path = "open"
            self.pieces, self.off = pieces_along(path)
        else:
            self.powers, widths, self.is_smooth = self._polynomials()
            self.off = 0.0
            self.pieces = [
                {"alpha": self._alpha(k), "duration": decimal(width or 1.0)}
                for k, width in enumerate(widths.tolist())
            ]
        level = check.Level(self.vehicle)
        self.curve = [check.Piece(piece, level) for piece in self.pieces]
        if self.path == "open":
            self.powers = _powers_of(self.curve)

    def _polynomials(self) -> tuple[FloatArray, FloatArray, bool]:
        """Return angles in powers of the share of a piece, highest first, widths, and whether the law is `smooth`.

        The pieces of a smooth gait are straight, and its law rises on each. Pieces of no length are left out.
        """
        timed = self.timed
        alpha = self.gait.alpha
        is_smooth = False
        curve = getattr(timed, "curve", None)
        tilts = getattr(timed, "tilts", None)
        if tilts is not None:
            powers, widths = tilts, timed.widths
        elif curve is not None:
            widths = np.diff(curve.breaks)
            powers = _by_share(curve.pieces, widths)
        else:
            step = np.roll(alpha, -1, axis=0) - alpha
            powers = np.stack([step, alpha])
            widths = step.any(axis=1) * 1.0
            if timed is not None:
                widths = np.diff(timed.corner_times)
                is_smooth = timed.law == "smooth"
        kept = widths > 0
        kept[0] |= not kept.any()
        powers = np.tile(powers, 4 // powers.shape[-1])
        return powers[:, kept], widths[kept], is_smooth

    def _alpha(self, k: int) -> list[list[Fraction]]:
        """Return the exact polynomials of a piece, which begins where the piece before ends."""
        after = (k + 1) % self.powers.shape[1]
        size = np.abs(self.powers[:-2, k]).max(initial=0.0) or 1.0
        digits = _FIGURES - math.floor(math.log10(size))
        rows = self.powers[::-1, k].T.tolist()
        alpha = []
        for row, end in zip(rows, self.powers[-1, after].tolist(), strict=True):
            rest = [decimal(a, digits) for a in row[2:]]
            first = decimal(row[0], GRID)
            curve = [first, decimal(end, GRID) - first - sum(rest), *rest]
            off = 0.0
            for exact, value in zip(curve, row, strict=True):
                off += abs(float(exact) - value)
            self.off = max(self.off, off)
            if self.is_smooth:
                curve = [first, *[curve[1] * rise for rise in _SMOOTH]]
            while len(curve) > 1 and curve[-1] == 0:
                curve.pop()
            alpha.append(curve)
        return opposite_once(alpha)


def _powers_of(curve: list[check.Piece]) -> FloatArray:
    """Return exact pieces as floats, highest power first, shape (degree + 1, pieces, 4)."""
    angles = [piece.motion[0] for piece in curve]
    degree = max(len(polynomial) for four in angles for polynomial in four) - 1
    powers = np.zeros((degree + 1, len(curve), 4))
    for k, joint in np.ndindex(len(curve), 4):
        for power, factor in enumerate(angles[k][joint]):
            powers[degree - power, k, joint] = factor
    return powers


def _by_share(pieces: FloatArray, widths: FloatArray) -> FloatArray:
    """Return polynomials of a parameter as those of the share of their widths."""
    orders = np.arange(len(pieces))[::-1]
    return np.asarray(pieces * (widths ** orders[:, None])[:, :, None])


def _deviation(stated: _Stated, table: Table | None) -> float:
    """Return how far a gait is from its certificate's curve at most [rad]."""
    deviation: float = 2 * stated.off + 1e-14
    path = stated.timed
    if path is None:
        return deviation
    # Floats of the times are off by some ulps of the period.
    fastest = float(np.abs(path.at(path.t).rates).max())
    deviation += 4e-15 * (1.0 + fastest * path.period)
    if table is not None:
        seconds = path.t
        if "t" in table:
            seconds = even_times(table) - table["t"][0]
        rows = tilt_angles(table, path.gait.coefficients)
        deviation += float(np.abs(path.at(seconds).alpha - rows).max())
    return deviation


def _claims_of(stated: _Stated, report: Report, tilt: float | None) -> dict[str, Any]:
    """Return the claims without their covers; InputError if an angle is too large."""
    vehicle = stated.gait.vehicle
    powers = stated.powers
    count = min(_SAMPLES, _MOST_SAMPLES // len(stated.pieces))
    share = np.linspace(0.0, 1.0, max(2, count))
    alpha = values_of(powers[:, None], share[:, None])
    largest = float(np.abs(alpha).max())
    if largest > _MOST_ANGLE:
        raise InputError(
            f"angles of a certificate must be at most {_MOST_ANGLE} rad in size, got {largest:.6g}"
        )
    shares = matrices.hover_thrust_shares(alpha, vehicle)
    singular = matrices.least_singular_value(alpha, vehicle)
    most = _claimed(float(shares.max()), vehicle.thrust_share)
    start = check.Arc(stated.curve[0], Fraction(0), Fraction(0))
    above = check.sign_of_R(start, {"sign": "positive"})[0].low > 0
    claims: dict[str, Any] = {
        "joints": _joints(stated),
        "least_singular_value": {
            "at_least": _least_claimed(singular, report["least_singular_value"])
        },
        "sign_of_R": {"sign": "positive" if above else "negative"},
        "hover_thrust": {
            "at_least": _least_claimed(shares, report["hover_thrust"]),
            "at_most": most,
        },
    }
    if tilt is not None:
        claims["attitude"] = {"tilt": decimal(tilt, GRID)}
    hull = bernstein_from_power(powers, np.ones(len(stated.pieces)))
    limits = np.array(vehicle.tilt_range or [(-math.inf, math.inf)] * 4)
    slack = float(_SLACK) * np.where(limits == 0, 1.0, np.abs(limits))
    low, high = (limits + slack * [-1.0, 1.0]).T
    at_least = np.maximum(hull.min(axis=(0, 1)) - _LEAST_ROOM, low)
    at_most = np.minimum(hull.max(axis=(0, 1)) + _LEAST_ROOM, high)
    claims["tilt"] = {
        "at_least": list(map(decimal, at_least)),
        "at_most": list(map(decimal, at_most)),
    }
    if stated.timed is not None:
        claims |= _claims_by_time(stated.timed, vehicle)
    return claims


def _least_claimed(values: Any, judged: Check) -> Fraction:
    """Return what is claimed of the least of some values, and of what the report found: a little less."""
    attained = min(float(np.min(values)), float(judged.value or 0.0))
    return _rounded(attained * (1 - _ROOM), ROUND_FLOOR)


def _claims_by_time(timed: Any, vehicle: Vehicle) -> dict[str, Any]:
    """Return the claims of rates, accelerations and, where the vehicle limits it, jerk."""
    claims = {}
    slack = _SLACK if timed.repeats else _OPEN_SLACK
    for name in ("rate", "acceleration", "jerk"):
        limit = getattr(vehicle, f"max_tilt_{name}")
        peaks = timed.peaks(check.ORDERS[name])
        if limit is None and (name == "jerk" or not np.isfinite(peaks).all()):
            continue
        if not np.isfinite(peaks).all():
            raise Infeasible(
                f"max_tilt_{name} cannot be proved of rows, between which rates jump",
                advice=Advice(
                    "certify the timed gait before it is written, or the path alone with timing=False",
                    "make it with the gait (plan or pace with --certify), or of the path alone with --untimed",
                ),
            )
        bounds = []
        for peak, most in zip(peaks.tolist(), four_of(limit), strict=True):
            bounds.append(_claimed(peak, most, _ROOM_OF_RATES, slack))
        claims[name] = {"at_least": [-bound for bound in bounds], "at_most": bounds}
    return claims


def _joints(stated: _Stated) -> dict[str, Fraction]:
    """Return the largest jumps of rates and accelerations from each piece to the next, rounded up."""
    curve = check.with_neighbours(stated.curve, stated.path)
    largest = {}
    for order, name in enumerate(check.JUMPS, start=1):
        jumps = [check.jump(*joint, order) for joint in pairwise(curve)]
        largest[name] = _rounded(float(max(jumps)) * (1 + 1e-9), ROUND_CEILING)
    return largest


def _cover(piece: check.Piece, name: str, claim: Any, k: int) -> list[Fraction]:
    """Return the break points of intervals of piece k on which a claim is proved; Infeasible if one is not."""
    breaks = [Fraction(0)]
    todo = [(Fraction(0), Fraction(1))]
    while todo:
        low, high = todo.pop()
        middle = (low + high) / 2
        if check.proves(piece, name, claim, low, high):
            breaks.append(high)
        elif high - low < _SMALLEST or len(breaks) > _MOST_INTERVALS:
            curves = piece.motion[check.ORDERS.get(name, 0)]
            values = [check.value_at(curve, middle) for curve in curves]
            what = "it is" if name in check.ORDERS else "the angles are"
            raise Infeasible(
                f"{name} {_shown(_plain(claim))} cannot be proved on piece {k} at {float(middle):.6g} of it, where "
                f"{_shown({what: values})}"
            )
        else:
            todo += [(middle, high), (low, middle)]
    return breaks
