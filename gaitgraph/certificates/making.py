"""Make the certificate of a gait: its curve as exact polynomials, its claims, and for each claim a cover of the curve.

What is claimed is found from samples, with room for round-off; an interval that the checker's own functions do not
prove is cut in half until they do.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitgraph import __version__
from gaitgraph.angles import angle_within
from gaitgraph.certificates import check
from gaitgraph.errors import Infeasible, InputError
from gaitgraph.files import check_new_files, write_whole
from gaitgraph.gait.table import Table, row_texts
from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value
from gaitgraph.io.formats import gait_of, given_gait, naming_file
from gaitgraph.timing.timed_gait import TimedGait, pieces_of, timed_gait_of
from gaitgraph.validation.validating import CERTIFICATE as SUFFIX, validate

if TYPE_CHECKING:
    from collections.abc import Iterable

    from gaitgraph.gait.gait import Gait
    from gaitgraph.invertibility.matrices import CoefficientsLike, FloatArray
    from gaitgraph.io.formats import GaitLike
    from gaitgraph.vehicle import VehicleLike

_GRID = Decimal("1e-15")  # of angles [rad]
_ROOM = 0.01  # share by which claims stay below what samples show
_SAMPLES = 16  # of a piece, at most
_MOST_SAMPLES = 20_000
_MOST_ANGLE = 3.9  # the checker's limit is 4 [rad]
_FEW = 100  # pieces
_DEEPEST = 40  # halvings of a piece
_PATIENCE = 4  # times that a claim is lowered to what was found between samples
_SLACK = Decimal("1e-9")  # of limits, a share of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """A gait with its certificate, the `document`, as plain values; `intervals` has the size of each claim's cover."""

    document: dict[str, Any]
    intervals: dict[str, int]

    def text(self) -> str:
        """Return the document as JSON, one line."""
        return json.dumps(self.document) + "\n"

    def write(self, path: str | Path, *, force: bool = False) -> None:
        """Write the document to a file, whole or not at all."""
        check_new_files([path], force=force)
        write_whole([(Path(path), self.text().encode())], force=force)

    def as_mapping(self) -> dict[str, Any]:
        """Return the claims as plain values, ready for JSON."""
        return {"status": "certified", "claims": _without_covers(self.document["claims"]), "intervals": self.intervals}

    def __str__(self) -> str:
        lines = [f"Certified {len(self.document['pieces'])} pieces"]
        for name, values in _without_covers(self.document["claims"]).items():
            texts = (f"{key.replace('_', ' ')} {_shown(value)}" for key, value in values.items())
            lines.append(f"  {name.replace('_', ' '):<21} {', '.join(texts)}; {self.intervals[name]} intervals")
        return "\n".join(lines)


def certificates_beside(outputs: Iterable[str | Path], *, force: bool) -> list[Path]:
    """Return the certificates beside gait files, gait.cert.json beside gait.csv; raise if one cannot be written."""
    paths = sorted({Path(output).with_suffix(SUFFIX) for output in outputs})
    if not paths:
        raise InputError("--certify must be given with --output, beside which it writes, got no output")
    check_new_files(paths, force=force)
    return paths


def _without_covers(claims: dict[str, Any]) -> dict[str, Any]:
    return {name: {key: one for key, one in claim.items() if key != "cover"} for name, claim in claims.items()}


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else f"({', '.join(f'{float(one):.4g}' for one in value)})"


def certify(
    gait: GaitLike,
    *,
    vehicle: VehicleLike | None = None,
    coefficients: CoefficientsLike | None = None,
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
    tilt
        Claim that no attitude within this tilt from upright is singular; radians below π/2, or a text such as "30deg".
    timing
        False leaves rates out.

    Raises
    ------
    Infeasible
        If the gait is not flyable, or a claim cannot be proved, with the reason and the place.

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
        report = validate(source, **choices)
        if not report.flyable:
            raise Infeasible(f"no certificate, since the gait is not flyable: {report.reason}")
        is_timed = hasattr(source, "rate_checks")
        if isinstance(source, Table) and timing:
            is_timed = "t" in source or "period" in source.about
        path = gait_of(source, **choices) if not (is_timed and timing) else timed_gait_of(source, **choices)
    rows = [source] if isinstance(source, Table) else pieces_of(source) if isinstance(source, TimedGait) else []
    digest = hashlib.sha256(b"".join(map(row_texts, rows))).hexdigest() if rows else ""
    angle = None if tilt is None else angle_within(tilt, "tilt", math.pi / 2 - 1e-6, least=0.0)
    return _Maker(path, digest, angle).made()


def _decimal(value: float, grid: Decimal | None = None) -> Fraction:
    """Return the exact value of a float's shortest decimal, or of the nearest one on a grid."""
    exact = Decimal(repr(float(value)))
    return Fraction(exact if grid is None else exact.quantize(grid))


def _text(value: Fraction) -> str:
    """Return an exact number as a text: a decimal where there is one."""
    digits = 0
    while digits < 60 and (value * 10**digits).denominator > 1:
        digits += 1
    scaled = value * 10**digits
    if scaled.denominator > 1:
        return f"{value.numerator}/{value.denominator}"
    figures = f"{abs(scaled.numerator):0{digits + 1}d}"
    return "-" * (value < 0) + (f"{figures[:-digits]}.{figures[-digits:]}" if digits else figures)


def _rounded(value: float, *, up: bool) -> Fraction:
    """Return a number with three significant digits, at least or at most the value."""
    if value == 0:
        return Fraction(0)
    exact = Decimal(value)
    step = Decimal(1).scaleb(exact.adjusted() - 2)
    return Fraction(exact.quantize(step, rounding=ROUND_CEILING if up else ROUND_FLOOR))


def _claimed(peak: float, limit: float | None) -> Fraction:
    """Return what is claimed of a peak: with room, or else the limit; one that is reached with the slack."""
    bound = _rounded(peak * (1 + _ROOM), up=True)
    if limit is None or bound <= limit:
        return bound
    return _decimal(limit) * (1 if peak < limit * (1 - float(_SLACK)) else 1 + Fraction(_SLACK))


class _Maker:
    """Makes one certificate."""

    def __init__(self, path: Gait | TimedGait, digest: str, tilt: float | None) -> None:
        self.timed = path if isinstance(path, TimedGait) else None
        self.gait = path.gait if isinstance(path, TimedGait) else path
        self.digest, self.tilt = digest, tilt
        vehicle = self.gait.vehicle
        known = (vehicle.drag_coefficient, vehicle.thrust_coefficient, vehicle.arm_length)
        constants = [Fraction(1) if one is None else _decimal(one) for one in known]
        kappa = constants[0] / (constants[1] * constants[2])
        if None in known or abs(kappa / Fraction(vehicle.drag_ratio) - 1) > Fraction(1, 10**12):
            kappa = _decimal(vehicle.drag_ratio)
            constants = [kappa, Fraction(1), Fraction(1)]
        self.kappa = kappa if vehicle.signed_drag_ratio > 0 else -kappa
        self.constants = constants
        self.law = [Fraction(0), Fraction(1)]
        self.pieces: list[dict[str, Any]] = []
        self.deviation = Fraction(_GRID)
        self._cut()

    def _cut(self) -> None:
        """Set the law and the pieces."""
        timed: Any = self.timed
        curve = getattr(timed, "curve", None)
        if hasattr(timed, "tilts"):
            self._follow(timed.tilts, timed.widths)
        elif curve is not None:
            widths = np.diff(curve.breaks)
            powers = np.arange(len(curve.pieces) - 1, -1, -1)
            self._follow(curve.pieces * (widths ** powers[:, None])[:, :, None], widths)
        else:
            corners = [[_decimal(angle, _GRID) for angle in corner] for corner in self.gait.alpha]
            durations = [1.0] * len(corners) if timed is None else np.diff(timed.corner_times).tolist()
            if timed is not None and timed.law == "smooth":
                self.law = [Fraction(one) for one in (0, 0, 0, 10, -15, 6)]
            for start, end, duration in zip(corners, [*corners[1:], corners[0]], durations, strict=True):
                if start != end or len(corners) == 1:
                    alpha = [[a, b - a] if a != b else [a] for a, b in zip(start, end, strict=True)]
                    self.pieces.append({"alpha": alpha, "duration": _decimal(duration or 1.0)})

    def _follow(self, tilts: FloatArray, widths: FloatArray) -> None:
        """Set pieces that follow (α1, α2) on the red sheet, made to join exactly."""
        first = [_decimal(one, _GRID) for one in tilts[-1, 0]]
        at = first
        for k, width in enumerate(widths.tolist()):
            off = max(abs(_decimal(one) - start) for one, start in zip(tilts[-1, k], at, strict=True))
            self.deviation = max(self.deviation, 2 * off + Fraction(_GRID))
            plane = []
            for joint in range(2):
                rest = [_decimal(one, Decimal("1e-20")) for one in tilts[-2::-1, k, joint]]
                plane.append([at[joint], *rest])
            at = [sum(one, Fraction(0)) for one in plane]
            if k == len(widths) - 1:  # what rounding has left open
                for joint in range(2):
                    plane[joint][1:2] = [sum(plane[joint][1:2]) + first[joint] - at[joint]]
            self.pieces.append({"alpha": [*plane, *plane], "duration": _decimal(width)})

    def made(self) -> Certified:
        """Return the certificate; Infeasible if a claim cannot be proved."""
        claims = {**self._physics_claims(), **self._motion_claims()}
        covers: dict[str, list[list[str]]] = {name: [] for name in claims}
        patience, k = _PATIENCE, 0
        while k < len(self.pieces):
            missed = self._covered(k, claims, covers)
            if not missed:
                k += 1
                continue
            name, low, high = missed
            patience -= 1
            if patience < 0 or not self._lowered(claims[name], name, k, (low + high) / 2):
                at = ", ".join(f"{float(one):.4f}" for one in self._angles(k, (low + high) / 2))
                what = f"{name} {' '.join(_text(one) for one in claims[name].values() if isinstance(one, Fraction))}"
                raise Infeasible(f"{what.strip()} cannot be proved on piece {k} at {float(low):.6g} of it ({at})")
            covers, k = {name: [] for name in claims}, 0
        plain = {name: {key: _plain(one) for key, one in claim.items()} for name, claim in claims.items()}
        out = {"joints": self._joints(), **{name: {**plain[name], "cover": covers[name]} for name in claims}}
        spin = self.gait.vehicle.first_rotor_spin
        vehicle = {"name": self.gait.vehicle.name[:1000], "first_rotor_spin": spin}
        vehicle |= dict(zip(check.CONSTANTS, map(_text, self.constants), strict=True))
        pieces = [{"alpha": _plain(one["alpha"]), "duration": _text(one["duration"])} for one in self.pieces]
        document = {
            "format": check.FORM["format"],
            "made_by": f"gaitgraph {__version__}",
            "digest": self.digest,
            "deviation": _text(_rounded(float(self.deviation), up=True)),
            "vehicle": vehicle,
            "law": _plain(self.law),
            "pieces": pieces,
            "claims": out,
        }
        count = {name: sum(len(one) - 1 for one in cover) for name, cover in covers.items()}
        return Certified(document=document, intervals={"joints": len(pieces), **count})

    def _angles(self, k: int, s: Fraction) -> list[float]:
        return [float(check.composed(one, [s])[0]) for one in self.pieces[k]["alpha"]]

    def _physics_claims(self) -> dict[str, dict[str, Any]]:
        """Return claims about the level matrix, as samples show them, with room."""
        vehicle, count = self.gait.vehicle, max(2, min(_SAMPLES, _MOST_SAMPLES // len(self.pieces)))
        share = np.linspace(0.0, 1.0, count)
        alpha = np.stack([
            np.stack([np.polyval([float(a) for a in one[::-1]], share) for one in piece["alpha"]], axis=-1)
            for piece in self.pieces
        ])  # fmt: skip
        if (largest := float(np.abs(alpha).max())) > _MOST_ANGLE:
            raise InputError(f"angles of a certificate must be at most {_MOST_ANGLE} rad in size, got {largest:.6g}")
        shares = hover_thrust_shares(alpha, vehicle)
        high = _claimed(float(shares.max()), vehicle.thrust_share)
        positive = check.level_physics(self.kappa, self.pieces[0]["alpha"], Fraction(0), Fraction(0))[2][2].value > 0
        least = float(np.min(least_singular_value(alpha, vehicle)))
        out: dict[str, dict[str, Any]] = {
            "least_singular_value": {"at_least": _rounded(least * (1 - _ROOM), up=False)},
            "sign_of_R": {"sign": "positive" if positive == (self.kappa > 0) else "negative"},
            "hover_thrust": {
                "at_least": _rounded(float(shares.min()) * (1 - _ROOM), up=False),
                "at_most": high,
            },
        }
        if self.tilt is not None:
            out["attitude"] = {"tilt": _decimal(self.tilt, _GRID)}
        return out

    def _lowered(self, claim: dict[str, Any], name: str, k: int, s: Fraction) -> bool:
        """Lower a claim to what is found at a place, with room; False if that changes nothing."""
        alpha, vehicle, before = self._angles(k, s), self.gait.vehicle, dict(claim)
        if name == "least_singular_value":
            found = float(least_singular_value(alpha, vehicle)) * (1 - _ROOM)
            claim["at_least"] = min(claim["at_least"], _rounded(found, up=False))
        if name == "hover_thrust":
            shares = hover_thrust_shares(alpha, vehicle)
            claim["at_least"] = min(claim["at_least"], _rounded(float(shares.min()) * (1 - _ROOM), up=False))
            if vehicle.thrust_share is None:
                claim["at_most"] = max(claim["at_most"], _rounded(float(shares.max()) * (1 + _ROOM), up=True))
        return claim != before

    def _motion_claims(self) -> dict[str, dict[str, Any]]:
        """Return claims about angles and their derivatives."""
        vehicle, zero, one = self.gait.vehicle, Fraction(0), Fraction(1)
        count = 8 if len(self.pieces) <= _FEW else 1  # of parts, which narrow the bounds of curves
        parts = [(Fraction(k, count), Fraction(k + 1, count)) for k in range(count)]
        bounds = []
        for joint in range(4):
            values = []
            for polynomial in (piece["alpha"][joint] for piece in self.pieces):
                for low, high in parts if len(polynomial) > 2 else [(zero, one)]:
                    values += check.control_values(polynomial, low, high)
            bounds.append((min(values), max(values)))
        out = {"tilt": {"at_least": [low for low, _ in bounds], "at_most": [high for _, high in bounds]}}
        if vehicle.max_tilt is not None:
            most = _decimal(vehicle.max_tilt) + Fraction(_SLACK)
            for k, pair in enumerate(bounds):
                if max(map(abs, pair)) > most:
                    raise Infeasible(f"α{k + 1} cannot be proved to keep max_tilt, {float(most):.6g} rad")
        if self.timed is None:
            return out
        for order, name in enumerate(("rate", "acceleration", "jerk"), start=1):
            limit, peaks = getattr(vehicle, f"max_tilt_{name}"), self.timed.peaks(order)
            if name == "jerk" and limit is None:
                continue
            if not np.isfinite(peaks).all():
                if limit is not None:
                    remedy = "use the law 'smooth', or certify the path alone with --untimed (timing=False)"
                    raise Infeasible(f"max_tilt_{name} cannot be proved, since the rates jump between rows: {remedy}")
                continue
            at_most = [_claimed(float(peak), limit) for peak in peaks]
            out[name] = {"at_least": [-bound for bound in at_most], "at_most": at_most}
        return out

    def _joints(self) -> dict[str, str]:
        """Return the largest jumps of rates and accelerations, rounded up."""
        out = {}
        for order, name in ((1, "rate_jump"), (2, "acceleration_jump")):
            moved = [check.motion(piece, self.law, order) for piece in self.pieces]
            jumps = (
                abs(sum(a) - b[0]) for k, after in enumerate(moved) for a, b in zip(moved[k - 1], after, strict=True)
            )
            most = max(jumps)
            out[name] = _text(_rounded(float(most) * (1 + 1e-9), up=True) if most else Fraction(0))
        return out

    def _covered(
        self, k: int, claims: dict[str, dict[str, Any]], covers: dict[str, list[list[str]]]
    ) -> tuple[str, Fraction, Fraction] | None:
        """Add the covers of a piece; return the claim and the interval that were not proved, if any."""
        known: dict[tuple[Fraction, Fraction], Any] = {}
        for name, claim in claims.items():
            curves = check.motion(self.pieces[k], self.law, check.ORDERS.get(name, 0))
            breaks, todo = [Fraction(0)], [(Fraction(0), Fraction(1))]
            while todo:
                low, high = todo.pop()
                if name not in check.ORDERS and (low, high) not in known:
                    known[low, high] = check.level_physics(self.kappa, curves, low, high)
                if check.proves(name, claim, self.kappa, curves, [low, high], known.get((low, high))):
                    breaks.append(high)
                elif (high - low) * 2**_DEEPEST < 1 or len(todo) + len(breaks) > _MOST_SAMPLES:
                    return name, low, high
                else:
                    todo += [((low + high) / 2, high), (low, (low + high) / 2)]
            covers[name].append([_text(one) for one in breaks])
        return None


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return _text(value) if isinstance(value, Fraction) else value
