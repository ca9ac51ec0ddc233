"""Make the certificate of a gait: its curve as exact polynomials, its claims, and for each claim a cover of the curve.

What is claimed follows from the report of the gait and from samples, with room for round-off; an interval on which the
checker's own functions do not prove a claim is cut in half until they do.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph import __version__
from gaitgraph.angles import angle_within
from gaitgraph.certificates import check
from gaitgraph.errors import Advice, FileWarning, Infeasible, InputError
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.table import Table, even_times, tilt_angles
from gaitgraph.invertibility import matrices
from gaitgraph.invertibility.forms import Sines, level_of, rotors_of
from gaitgraph.io.formats import gait_of, given_gait, naming_file
from gaitgraph.timing.laws import bernstein_from_power, values_of
from gaitgraph.timing.timed_gait import TimedGait, timed_gait_of
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.validation.validating import validate
from gaitgraph.vehicle import four_of

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.coefficients import CoefficientsLike
    from gaitgraph.invertibility.forms import FloatArray
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.validation.report import Report
    from gaitgraph.vehicle import Vehicle, VehicleLike

_ROOM = 0.01  # share by which claims stay below what is attained
_ROOM_OF_RATES = 0.03
_LEAST_ROOM = 1e-6  # of angles [rad], rates and so on
_SLACK = Fraction(1, 10**9)  # of limits, a share of them
_FIGURES = 12  # of a piece's coefficients from the second power on
_GRID = 15  # digits of angles [rad]
_SAMPLES = 17  # of a piece, at most
_MOST_SAMPLES = 20_000
_MOST_ANGLE = 3.9  # the checker's limit is 4 [rad]
_MOST_INTERVALS = 20_000  # of a piece
_SMALLEST = Fraction(1, 2**40)  # interval
_MOST_DIGITS = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """A gait with its certificate, the `document`, as plain values; `intervals` has the size of each claim's cover.

    `warnings` are those of the gait's report.
    """

    document: dict[str, Any]
    intervals: dict[str, int]
    warnings: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The document as JSON, one line."""
        return json.dumps(self.document, separators=(",", ":")) + "\n"

    def write(self, path: str | Path, *, force: bool = False) -> None:
        """Write the document to a file, whole or not at all."""
        check_certificate(path)
        check_new_files([path], force=force)
        write_whole([(Path(path), self.text.encode())], force=force)

    def as_mapping(self) -> dict[str, Any]:
        """Return the claims as plain values, ready for JSON."""
        named = self.document["claims"].items()
        claims = {
            name: {key: one for key, one in claim.items() if key != "cover"}
            for name, claim in named
        }
        return {
            "status": "certified",
            "claims": claims,
            "intervals": self.intervals,
            "warnings": list(self.warnings),
        }

    def __repr__(self) -> str:
        pieces, claims = len(self.document["pieces"]), ", ".join(self.intervals)
        return f"<Certified: {pieces} pieces, claims {claims}>"

    def __str__(self) -> str:
        lines = [f"Certified {len(self.document['pieces'])} pieces"]
        for name, values in self.as_mapping()["claims"].items():
            texts = (
                f"{key.replace('_', ' ')} {_shown(value)}"
                for key, value in values.items()
            )
            lines.append(
                f"  {name.replace('_', ' '):<21} {', '.join(texts)}; {self.intervals[name]} intervals"
            )
        return "\n".join(
            [*lines, *(f"warning: {warning}" for warning in self.warnings)]
        )


def _shown(value: Any) -> str:
    return (
        value
        if isinstance(value, str)
        else f"({', '.join(f'{float(one):.4g}' for one in value)})"
    )


def check_certificate(path: str | Path) -> None:
    """Raise InputError if the name of a certificate does not end in .json."""
    if Path(path).suffix != ".json":
        raise InputError(
            f"output {str(path)!r} must end in .json, as a certificate does, got {Path(path).suffix!r}"
        )


def certify(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
    floor: float = DEFAULT_FLOOR,
    tilt: float | str | None = None,
    timing: bool = True,
) -> Certified:
    """Return the certificate of a flyable gait, which ``gaitgraph/certificates/check.py`` checks by itself.

    Parameters
    ----------
    gait
        A gait in any form, see :func:`gaitgraph.io.formats.given_gait`. With a clock rates and accelerations are
        claimed too; rows of a table without a law are joined by straight segments.
    vehicle, coefficients
        For tables and files; by default those that the table states, else the paper's vehicle.
    floor
        As for :func:`gaitgraph.validation.validating.validate`.
    tilt
        Claim that no attitude within this tilt from upright is singular; radians below π/2, or a text such as "30deg".
    timing
        False leaves rates out.

    Raises
    ------
    Infeasible
        If the gait is not flyable or a table is that of a transition, its rows have rates but state no law, or a claim
        cannot be proved, with the reason and the place.

    Examples
    --------
    >>> from gaitgraph.gait.gait import lift
    >>> certify(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red")).document["claims"]["sign_of_R"]["sign"]
    'negative'
    """
    choices: Any = {"vehicle": vehicle, "coefficients": coefficients}
    source = given_gait(gait, **choices)
    if not isinstance(source, Table):
        choices = {}
    with naming_file(gait):
        if not getattr(source, "repeats", True):
            raise Infeasible(
                "no certificate, since it is a path that is run once, and no closed gait"
            )
        states_no_law = isinstance(source, Table) and source.motion is None
        if states_no_law and source.joined_by_cubics:
            raise Infeasible(
                "no certificate, since the rows are played as cubics through their rates, and state no law; leave the "
                "columns of rates out to certify straight segments"
            )
        report = validate(source, floor=floor, **choices)
        if not report.flyable:
            raise Infeasible(
                f"no certificate, since the gait is not flyable: {report.reason}"
            )
        is_timed = hasattr(source, "rate_checks")
        if isinstance(source, Table) and timing:
            is_timed = "t" in source or "period" in source.about
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileWarning)  # the report has them
            path: Gait | TimedGait
            if is_timed and timing:
                path = timed_gait_of(source, **choices)
            else:
                path = gait_of(source, **choices)
    angle = (
        None
        if tilt is None
        else angle_within(tilt, "tilt", math.pi / 2 - 1e-6, least=0.0)
    )
    exact = _Path(path)
    claims = _claims_of(exact, report, angle)
    covers = {
        name: [_cover(exact, name, claim, k) for k in range(len(exact.pieces))]
        for name, claim in claims.items()
    }
    deviation = 2 * exact.deviation + 1e-14
    if isinstance(path, TimedGait):
        # Floats of the times are off by some ulps of the period.
        fastest = float(np.abs(path.at(path.t).rates).max())
        deviation += 4e-15 * (1.0 + fastest * path.period)
    if isinstance(source, Table) and isinstance(path, TimedGait):
        seconds = even_times(source) - source["t"][0] if "t" in source else path.t
        rows = tilt_angles(source, path.gait.coefficients)
        deviation += float(np.abs(path.at(seconds).alpha - rows).max())
    document = {
        "format": check.FORM["format"],
        "made_by": f"gaitgraph {__version__}",
        "deviation": _rounded(deviation, up=True),
        "vehicle": exact.vehicle,
        "law": exact.law,
        "pieces": exact.pieces,
        "claims": {"joints": _joints(exact)}
        | {name: {**claims[name], "cover": covers[name]} for name in claims},
    }
    count = {name: sum(len(one) - 1 for one in cover) for name, cover in covers.items()}
    return Certified(
        document=_plain(document),
        intervals={"joints": len(exact.pieces), **count},
        warnings=report.warnings,
    )


def _decimal(value: float, digits: int | None = None) -> Fraction:
    """Return the exact value of a float's shortest decimal, rounded to some digits."""
    return Fraction(repr(float(value) if digits is None else round(value, digits)))


def _plain(value: Any) -> Any:
    """Return exact numbers as texts: a decimal where there is one. Lists and objects are kept."""
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    if not isinstance(value, Fraction):
        return value
    top, under = value.as_integer_ratio()
    digits = next((k for k in range(_MOST_DIGITS + 1) if 10**k % under == 0), None)
    if not digits:
        return f"{top}/{under}" if digits is None else str(top)
    figures = f"{abs(top) * 10**digits // under:0{digits + 1}d}"
    return f"{'-' * (top < 0)}{figures[:-digits]}.{figures[-digits:]}"


def _rounded(value: float, *, up: bool) -> Fraction:
    """Return a number with three significant digits, at least or at most the value."""
    step = (
        Fraction(10) ** (math.floor(math.log10(abs(value))) - 2)
        if value
        else Fraction(1)
    )
    return step * (math.ceil if up else math.floor)(Fraction(value) / step)


def _claimed(peak: float, limit: float | None, room: float = _ROOM) -> Fraction:
    """Return what is claimed of a peak: with room, or else the limit, with the slack if that is reached."""
    bound = _rounded(peak * (1 + room) + _LEAST_ROOM, up=True)
    if limit is None or bound <= limit:
        return bound
    return _decimal(limit) * (
        1 if peak < limit * (1 - 2 * float(_SLACK)) else 1 + _SLACK
    )


def stated_vehicle(vehicle: Vehicle) -> dict[str, Any]:
    """Return a vehicle as a certificate states it, with exact numbers; four equal arms without their angle."""
    named: dict[str, Any] = {
        "name": vehicle.name[:1000],
        "first_rotor_spin": vehicle.first_rotor_spin,
    }
    arm: Any = vehicle.arm_length
    if vehicle.rotor_positions is None and not isinstance(
        vehicle.drag_to_thrust, tuple
    ):
        constants = (vehicle.drag_coefficient, vehicle.thrust_coefficient, arm)
        if None in constants:
            constants = (vehicle.drag_ratio, 1.0, 1.0)
            height = _decimal(vehicle.rotor_height) / _decimal(arm or 1.0)
        else:
            height = _decimal(vehicle.rotor_height)
        exact = [_decimal(constant or 0.0) for constant in constants]
        return (
            named
            | dict(zip(check.CONSTANTS, exact, strict=True))
            | {"rotor_height": height}
        )
    places = vehicle.rotor_positions
    if places is None:
        ends = ((1, 0), (0, 1), (-1, 0), (0, -1))
        places = tuple((arm * x, arm * y, vehicle.rotor_height) for x, y in ends)
    drags = vehicle.drag_to_thrust
    if drags is None:
        drags = vehicle.drag_ratio * arm
    return named | {
        "rotor_positions": [list(map(_decimal, place)) for place in places],
        "drag_to_thrust": list(map(_decimal, four_of(drags))),
    }


class _Path:
    """A gait as a certificate states it: `vehicle`, `law` and `pieces`, at most `deviation` from the gait [rad]."""

    def __init__(self, path: Gait | TimedGait) -> None:
        self.timed: Any = path if isinstance(path, TimedGait) else None
        self.gait = path.gait if isinstance(path, TimedGait) else path
        self.vehicle = stated_vehicle(self.gait.vehicle)
        level = check.Level(self.vehicle)
        self.powers, widths, is_smooth = self._polynomials()
        self.law = [Fraction(a) for a in check.LAWS[is_smooth]]
        self.pieces: list[dict[str, Any]] = []
        self.deviation = 0.0
        starts = [
            [_decimal(a, _GRID) for a in angles] for angles in self.powers[-1].tolist()
        ]
        for k, width in enumerate(widths.tolist()):
            rows = self.powers[::-1, k].T.tolist()
            size = max((abs(a) for row in rows for a in row[2:]), default=0.0) or 1.0
            alpha = []
            for row, start, end in zip(
                rows, starts[k], starts[(k + 1) % len(starts)], strict=True
            ):
                rest = [
                    _decimal(a, _FIGURES - math.floor(math.log10(size)))
                    for a in row[2:]
                ]
                alpha.append(
                    [start, end - start - sum(rest), *rest]
                )  # pieces join exactly
                self.deviation = max(
                    self.deviation,
                    sum(abs(float(a) - b) for a, b in zip(alpha[-1], row, strict=True)),
                )
                while len(alpha[-1]) > 1 and alpha[-1][-1] == 0:
                    alpha[-1].pop()
            self.pieces.append({"alpha": alpha, "duration": _decimal(width or 1.0)})
        self.curve = [check.Piece(piece, self.law, level) for piece in self.pieces]

    def _polynomials(self) -> tuple[FloatArray, FloatArray, bool]:
        """Return angles in powers of the share of a piece, highest first, widths, and whether the law is `smooth`.

        Two angles instead of four where opposite ones are equal. Pieces of no length are left out.
        """
        timed, alpha, is_smooth = self.timed, self.gait.alpha, False
        curve = getattr(timed, "curve", None)
        if hasattr(timed, "tilts"):
            powers, widths = timed.tilts, timed.widths
        elif curve is not None:
            widths = np.diff(curve.breaks)
            powers = (
                curve.pieces
                * (widths ** np.arange(len(curve.pieces) - 1, -1, -1)[:, None])[
                    :, :, None
                ]
            )
        else:
            step = np.roll(alpha, -1, axis=0) - alpha
            powers = np.stack([step, alpha])[
                :, :, : 2 if (alpha[:, :2] == alpha[:, 2:]).all() else 4
            ]
            widths = (
                step.any(axis=1) * 1.0 if timed is None else np.diff(timed.corner_times)
            )
            is_smooth = timed is not None and timed.law == "smooth"
        kept = widths > 0 if (widths > 0).any() else np.arange(len(widths)) == 0
        return powers[:, kept], widths[kept], is_smooth


def _claims_of(
    path: _Path, report: Report, tilt: float | None
) -> dict[str, dict[str, Any]]:
    """Return the claims without their covers; InputError if an angle is too large."""
    vehicle, powers = path.gait.vehicle, path.powers
    share = np.linspace(
        0.0, 1.0, max(2, min(_SAMPLES, _MOST_SAMPLES // len(path.pieces)))
    )
    alpha = np.tile(values_of(powers[:, None], share[:, None]), 4 // powers.shape[-1])
    if (largest := float(np.abs(alpha).max())) > _MOST_ANGLE:
        raise InputError(
            f"angles of a certificate must be at most {_MOST_ANGLE} rad in size, got {largest:.6g}"
        )
    shares, values = (
        matrices.hover_thrust_shares(alpha, vehicle),
        matrices.least_singular_value(alpha, vehicle),
    )
    least = {
        name: _rounded(
            min(float(np.min(found)), float(report[name].value or 0.0)) * (1 - _ROOM),
            up=False,
        )
        for name, found in (("least_singular_value", values), ("hover_thrust", shares))
    }
    direction = level_of(rotors_of(vehicle)).direction.at(Sines.of(alpha[0, :1]))
    is_positive = direction[2, 0] > 0
    claims: dict[str, dict[str, Any]] = {
        "least_singular_value": {"at_least": least["least_singular_value"]},
        "sign_of_R": {"sign": "positive" if is_positive else "negative"},
        "hover_thrust": {
            "at_least": least["hover_thrust"],
            "at_most": _claimed(float(shares.max()), vehicle.thrust_share),
        },
    }
    if tilt is not None:
        claims["attitude"] = {"tilt": _decimal(tilt, _GRID)}
    hull = np.tile(
        bernstein_from_power(powers, np.ones(len(path.pieces))), 4 // powers.shape[-1]
    )
    low, high = np.array(vehicle.tilt_range or [(-math.inf, math.inf)] * 4).T
    slack = float(_SLACK) * np.where([low == 0, high == 0], 1.0, np.abs([low, high]))
    at_least = np.maximum(hull.min(axis=(0, 1)) - _LEAST_ROOM, low - slack[0])
    at_most = np.minimum(hull.max(axis=(0, 1)) + _LEAST_ROOM, high + slack[1])
    claims["tilt"] = {
        "at_least": list(map(_decimal, at_least)),
        "at_most": list(map(_decimal, at_most)),
    }
    for name, order in list(check.ORDERS.items())[1:] if path.timed is not None else ():
        largest, peaks = getattr(vehicle, f"max_tilt_{name}"), path.timed.peaks(order)
        if largest is not None and not np.isfinite(peaks).all():
            raise Infeasible(
                f"max_tilt_{name} cannot be proved of rows, between which rates jump",
                advice=Advice(
                    "certify the timed gait before it is written, or the path alone with timing=False",
                    "make it with the gait (plan or pace with --certify), or of the path alone with --untimed",
                ),
            )
        if np.isfinite(peaks).all() and (largest is not None or name != "jerk"):
            each = zip(peaks.tolist(), four_of(largest), strict=True)
            bounds = [_claimed(peak, limit, _ROOM_OF_RATES) for peak, limit in each]
            claims[name] = {"at_least": [-bound for bound in bounds], "at_most": bounds}
    return claims


def _joints(path: _Path) -> dict[str, Fraction]:
    """Return the largest jumps of rates and accelerations from piece to piece, rounded up."""
    out = {}
    for order, name in enumerate(check.JUMPS, start=1):
        jumps = [
            piece.jump(path.curve[k - 1], order) for k, piece in enumerate(path.curve)
        ]
        out[name] = _rounded(float(max(jumps)) * (1 + 1e-9), up=True)
    return out


def _cover(path: _Path, name: str, claim: dict[str, Any], k: int) -> list[Fraction]:
    """Return the break points of intervals of a piece on which a claim is proved; Infeasible if one is not."""
    piece, breaks, todo = path.curve[k], [Fraction(0)], [(Fraction(0), Fraction(1))]
    curves = piece.motion[check.ORDERS.get(name, 0)]
    while todo:
        low, high = todo.pop()
        middle = (low + high) / 2
        if piece.proves(name, claim, low, high):
            breaks.append(high)
        elif high - low < _SMALLEST or len(breaks) > _MOST_INTERVALS:
            at = _shown(
                [
                    np.polyval([float(a) for a in one[::-1]], float(middle))
                    for one in curves
                ]
            )
            what = f"{name} {', '.join(f'{key} {_shown(_plain(one))}' for key, one in claim.items())}"
            where = f"at {float(middle):.6g} of it, where {'it is' if name in check.ORDERS else 'the angles are'} {at}"
            raise Infeasible(f"{what} cannot be proved on piece {k} {where}")
        else:
            todo += [(middle, high), (low, middle)]
    return breaks
