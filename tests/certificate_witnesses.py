"""Two witnesses of certificates, from the paper's equations and the format alone: Arb balls, and mpmath intervals.

Neither uses the package, the other witness, or the covers: each bisects until it can decide. The balls take the arms
and axes of the rotors (docs/theory.md, section 1), cofactors and elimination in M'M − σ²1; the intervals take the
zero-moment thrusts (sections 2 and 3) and the Schur complement in MM' − σ²1, whose rows of roll and pitch are
orthogonal. Angles and rates are polynomials: the first judges them exactly, the second to within 1e-18.
"""

from __future__ import annotations

import json
from fractions import Fraction
from itertools import pairwise
from math import comb
from typing import TYPE_CHECKING, Any

import flint
import mpmath
from flint import arb, arb_series, fmpq, fmpq_poly

if TYPE_CHECKING:
    from collections.abc import Callable

ORDER = 4  # of the Taylor polynomials of the balls
DERIVATIVES = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}
BOUNDS = ("at_least", "at_most")
iv = mpmath.ctx_iv.MPIntervalContext()
iv.prec = 80


class Certificate:
    """The content of a certificate; κ is negative where the first rotor turns counterclockwise."""

    def __init__(self, text: str) -> None:
        document = json.loads(text)
        vehicle, pieces, self.claims = document["vehicle"], document["pieces"], document["claims"]
        drag, thrust, arm = (Fraction(vehicle[x]) for x in ("drag_coefficient", "thrust_coefficient", "arm_length"))
        self.kappa = drag / (thrust * arm) * (1 if vehicle["first_rotor_spin"] == "clockwise" else -1)
        self.law = [Fraction(c) for c in document["law"]]
        self.durations = [Fraction(piece["duration"]) for piece in pieces]
        self.pieces = [[[Fraction(c) for c in angle] for angle in piece["alpha"]] for piece in pieces]


def everywhere(holds: Callable[[Any, Any], bool], low: Any, width: Any, depth: int = 60) -> bool:
    """Return whether something is shown on all of [low, low + width], halved where that helps."""
    halves = (low, low + width / 2)
    return holds(low, width) or (depth > 0 and all(everywhere(holds, x, width / 2, depth - 1) for x in halves))


# Balls


def exact(number: Fraction | str) -> fmpq:
    return fmpq(*Fraction(number).as_integer_ratio())


def nowhere_negative(q: fmpq_poly) -> bool:
    """Decide by the Bernstein coefficients of a polynomial on [0, 1] and its parts."""
    n = max(q.degree(), 0)

    def holds(low: fmpq, width: fmpq) -> bool:
        part = q(fmpq_poly([low, width]))
        return all(sum((part[k] * comb(i, k) / comb(n, k) for k in range(i + 1)), fmpq(0)) >= 0 for i in range(n + 1))

    return everywhere(holds, fmpq(0), fmpq(1), 60 if q(0) >= 0 and q(1) >= 0 else 0)


def signs(kappa: Fraction, name: str, claim: dict[str, Any]) -> Callable[[list[Any]], list[Any]]:
    """Return a function of four angles (balls, or series of balls) whose values are positive where the claim holds."""
    k, bounds = arb(exact(kappa)), [arb(exact(claim[side])) for side in BOUNDS if side in claim]

    def values(alpha: list[Any]) -> list[Any]:
        axes, torques = [], []
        for a, (ex, ey), spin in zip(alpha, [(1, 0), (0, 1), (-1, 0), (0, -1)], [k, -k, k, -k], strict=True):
            s, c = a.sin(), a.cos()
            n = (s * ey, -s * ex, c)  # cos α z + sin α e×z
            axes.append(n)
            torques.append((ey * c + spin * n[0], -ex * c + spin * n[1], ex * n[1] - ey * n[0] + spin * c))  # e×n + σκn
        if name == "least_singular_value":
            columns = [(*torque, n[2]) for torque, n in zip(torques, axes, strict=True)]
            gram = [[sum(x * y for x, y in zip(p, q, strict=True)) for q in columns] for p in columns]
            for i in range(4):
                gram[i][i] -= bounds[0] * bounds[0]
                for row in range(i):
                    share = gram[i][row] / gram[row][row]
                    gram[i] = [x - share * y for x, y in zip(gram[i], gram[row], strict=True)]
            return [gram[i][i] for i in range(4)]
        free = []  # thrusts without torque
        for i in range(4):
            a, b, c = torques[:i] + torques[i + 1 :]
            minor = a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
            free.append((minor + c[0] * (a[1] * b[2] - a[2] * b[1])) * (-1) ** (i + 1))
        force = [sum(u * n[j] for u, n in zip(free, axes, strict=True)) for j in range(3)]
        if name == "sign_of_R":
            return [force[2] / k * {"positive": 1, "negative": -1}[claim["sign"]]]
        if name == "hover_thrust":
            return [x for u in free for x in (u / force[2] - bounds[0], bounds[1] - u / force[2])]
        s, c = arb(exact(claim["tilt"])).sin_cos()
        up, x, y = force[2] * c, force[0] * s, force[1] * s
        return [up * up - x * x - y * y]

    return values


def always_positive(values: Callable[[list[Any]], list[Any]], piece: list[list[arb]]) -> bool:
    """Decide by Taylor polynomials about the middle, with the remainder's coefficient on the whole interval."""

    def holds(low: fmpq, width: fmpq) -> bool:
        middle, step, found = arb(low + width / 2), arb(0, arb(width / 2)), []
        for x in (middle, middle + step):
            variable, alpha = arb_series([x, 1]), [arb_series([0])] * 4
            for i, coefficients in enumerate(piece):
                for c in reversed(coefficients):
                    alpha[i] = alpha[i] * variable + c
            try:
                found.append(values(alpha))
            except (ValueError, ZeroDivisionError):  # a divisor's ball holds zero
                return False
        for f, rest in zip(*found, strict=True):
            enclosure = rest[ORDER]
            for k in reversed(range(ORDER)):
                enclosure = enclosure * step + f[k]
            if not enclosure > 0:
                return False
        return True

    return everywhere(holds, fmpq(0), fmpq(1), 40)


def demands(it: Certificate, name: str) -> list[fmpq_poly]:
    """Return polynomials that are nowhere negative on [0, 1] exactly if joints, or a claim of angles or rates, hold."""
    law, found = fmpq_poly([exact(c) for c in it.law]), []
    timed = []  # for each piece and angle: the angle, its rate, acceleration and jerk, by the share of the duration
    for piece, duration in zip(it.pieces, it.durations, strict=True):
        timed.append([[fmpq_poly([exact(c) for c in angle])(law)] for angle in piece])
        for derivatives in timed[-1]:
            for _ in range(3):
                derivatives.append(derivatives[-1].derivative() / exact(duration))
    if name != "joints":
        limits = [[exact(x) for x in it.claims[name][side]] for side in BOUNDS]
        values = [(i, angle[DERIVATIVES[name]]) for piece in timed for i, angle in enumerate(piece)]
        return [q for i, value in values for q in (value - limits[0][i], limits[1][i] - value)]
    jumps = [fmpq(0), exact(it.claims["joints"]["rate_jump"]), exact(it.claims["joints"]["acceleration_jump"])]
    for before, after in pairwise([*timed, timed[0]]):
        for a, b in zip(before, after, strict=True):
            found += [fmpq_poly([m - abs(p(1) - q(0))]) for p, q, m in zip(a, b, jumps, strict=False)]
    return [law.derivative(), fmpq_poly([-abs(law(0))]), fmpq_poly([-abs(law(1) - 1)]), *found]


def doubted_by_balls(text: str) -> list[str]:
    """Return the claims that balls do not prove."""
    it, doubted = Certificate(text), []
    flint.ctx.prec, flint.ctx.cap = 128, ORDER + 1
    pieces = [[[arb(exact(c)) for c in angle] for angle in piece] for piece in it.pieces]
    for name, claim in it.claims.items():
        if name in DERIVATIVES or name == "joints":
            holds = all(nowhere_negative(q) for q in demands(it, name))
        else:
            values = signs(it.kappa, name, claim)
            holds = all(always_positive(values, piece) for piece in pieces)
        doubted += [name] * (not holds)
    return doubted


def false_at_samples(text: str, names: set[str], samples: int) -> list[str]:
    """Return those of some claims that are false at one of evenly spaced points of a piece, in 128 bits."""
    it, false = Certificate(text), []
    flint.ctx.prec, points = 128, [fmpq(i, samples) for i in range(samples + 1)]
    polynomials = [[fmpq_poly([exact(c) for c in angle]) for angle in piece] for piece in it.pieces]
    where = [[arb(angle(x)) for angle in piece] for piece in polynomials for x in points]
    for name in names:
        if name in DERIVATIVES or name == "joints":
            wrong = any(q(x) < 0 for q in demands(it, name) for x in points)
        else:
            values = signs(it.kappa, name, it.claims[name])
            wrong = any(value < 0 for alpha in where for value in values(alpha))
        false += [name] * wrong
    return false


# Intervals


class Slope:
    """A function on an interval U about m: its value at m, its range on U, and the range of its slopes to m."""

    def __init__(self, at: Any, on: Any, slope: Any) -> None:
        self.at, self.on, self.slope = at, on, slope

    def __add__(self, x: Any) -> Slope:
        x = x if isinstance(x, Slope) else Slope(x, x, 0)
        return Slope(self.at + x.at, self.on + x.on, self.slope + x.slope)

    def __mul__(self, x: Any) -> Slope:
        x = x if isinstance(x, Slope) else Slope(x, x, 0)
        return Slope(self.at * x.at, self.on * x.on, self.slope * x.on + self.at * x.slope)

    def __sub__(self, x: Any) -> Slope:
        return self + x * -1

    def __truediv__(self, x: Slope) -> Slope:
        return Slope(self.at / x.at, self.on / x.on, (self.slope - self.at / x.at * x.slope) / x.on)

    def turned(self) -> tuple[Slope, Slope]:
        """Return sine and cosine."""
        sines, cosines = iv.sin(self.on), iv.cos(self.on)
        return Slope(iv.sin(self.at), sines, cosines * self.slope), Slope(iv.cos(self.at), cosines, -sines * self.slope)


def interval(number: Fraction | str) -> Any:
    return iv.mpf(Fraction(number).numerator) / Fraction(number).denominator


def composed(outer: list[Fraction], inner: list[Fraction]) -> list[Fraction]:
    total = [Fraction(0)]
    for c in reversed(outer):
        product = [Fraction(0)] * (len(total) + len(inner) - 1)
        for i, x in enumerate(total):
            for j, y in enumerate(inner):
                product[i + j] += x * y
        total = [product[0] + c, *product[1:]]
    return total


def powers(coefficients: list[Any], x: Slope) -> Slope:
    total = x * 0
    for c in reversed(coefficients):
        total = total * x + c
    return total


def positive(it: Certificate, alpha: list[Slope]) -> list[Slope]:
    """Return what is positive where the claims hold that the four angles alone decide."""
    trig, claims, k, found = [a.turned() for a in alpha], it.claims, interval(it.kappa), []
    (s1, c1), (s2, c2), (s3, c3), (s4, c4) = trig
    C1, C2, C3, C4 = (c + s * x for (s, c), x in zip(trig, [k, -k, k, -k], strict=True))  # cos β / cos δ
    S1, S2, S3, S4 = (s - c * x for (s, c), x in zip(trig, [k, -k, k, -k], strict=True))  # sin β / cos δ
    x, y = S1 * C3 + C1 * S3, S2 * C4 + C2 * S4
    u = (y * C3 * -1, x * C4, y * C1 * -1, x * C2)  # zero-moment thrusts
    N = (u[1] * s2 - u[3] * s4, u[2] * s3 - u[0] * s1, u[0] * c1 + u[1] * c2 + u[2] * c3 + u[3] * c4)
    if claim := claims.get("sign_of_R"):
        found += [N[2] * {"positive": -1, "negative": 1}[claim["sign"]] * (-1 if it.kappa < 0 else 1)]  # det M = −N_z
    if claim := claims.get("attitude"):
        up, x, y = N[2] * iv.cos(interval(claim["tilt"])), *(n * iv.sin(interval(claim["tilt"])) for n in N[:2])
        found += [up * up - x * x - y * y]
    if claim := claims.get("hover_thrust"):
        shares = [thrust / N[2] for thrust in u]
        found += [share - interval(claim["at_least"]) for share in shares]
        found += [share * -1 + interval(claim["at_most"]) for share in shares]
    if claim := claims.get("least_singular_value"):
        square = interval(claim["at_least"]) * interval(claim["at_least"])
        roll, pitch = C2 * C2 + C4 * C4 - square, C1 * C1 + C3 * C3 - square
        a, b = C4 * S4 - C2 * S2, C1 * S1 - C3 * S3  # yaw with roll and with pitch
        e, f = C2 * c2 - C4 * c4, C3 * c3 - C1 * c1  # altitude with roll and with pitch
        yaw = S1 * S1 + S2 * S2 + S3 * S3 + S4 * S4 - square - a * a / roll - b * b / pitch
        altitude = c1 * c1 + c2 * c2 + c3 * c3 + c4 * c4 - square - e * e / roll - f * f / pitch
        both = S1 * c1 + S2 * c2 + S3 * c3 + S4 * c4 + a * e / roll + b * f / pitch
        found += [roll, pitch, yaw, yaw * altitude - both * both]
    return found


def proved_by_intervals(text: str) -> bool:
    """Return whether intervals prove all claims but joints."""
    it = Certificate(text)

    def shown(function: Callable[[Slope], list[Slope]], above: float) -> bool:
        def holds(low: Any, width: Any) -> bool:
            radius = iv.mpf([-(width / 2).b, (width / 2).b])
            values = function(Slope(low + width / 2, iv.mpf([low.a, (low + width).b]), iv.mpf(1)))
            return all(max(q.on.a, (q.at + q.slope * radius).a) > above for q in values)

        return everywhere(holds, iv.mpf(0), iv.mpf(1))

    for piece, duration in zip(it.pieces, it.durations, strict=True):
        angles = [[interval(c) for c in angle] for angle in piece]
        if not shown(lambda s, angles=angles: positive(it, [powers(angle, s) for angle in angles]), 0):
            return False
        for name in DERIVATIVES.keys() & it.claims.keys():
            for i, angle in enumerate(piece):
                derived = composed(angle, it.law) if DERIVATIVES[name] else angle
                for _ in range(DERIVATIVES[name]):
                    derived = [k * c / duration for k, c in enumerate(derived)][1:]
                low, high = (interval(it.claims[name][side][i]) for side in BOUNDS)
                value = [interval(c) for c in derived]
                between = lambda s, v=value, low=low, high=high: [powers(v, s) - low, powers(v, s) * -1 + high]  # noqa: E731
                if not shown(between, -1e-18):
                    return False
    return True
