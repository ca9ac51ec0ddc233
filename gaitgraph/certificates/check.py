#!/usr/bin/env python3
"""Check the certificate of a gait: python check.py gait.cert.json

Every claim is proved anew from the document alone. Polynomials are evaluated in exact fractions; sines and cosines in
intervals of integers times 2^-96, rounded outward. The matrix is that of the equations of Shen, Ma and Tsuchiya (2022).
Exit codes: 0 all claims are proved, 1 one is not, 2 the document is no certificate.
"""

from __future__ import annotations

import json
import re
import sys
from fractions import Fraction
from math import comb
from typing import Any, NamedTuple

FORMAT = "gaitgraph certificate 1"
ONE = 1 << 96
NUMBER = re.compile(r"-?[0-9]{1,40}(\.[0-9]{1,60}|/0{0,9}[1-9][0-9]{0,59})?")
CLAIMS = {  # and their values
    "joints": ("rate_jump", "acceleration_jump"), "least_singular_value": ("at_least",), "sign_of_R": ("sign",),
    "hover_thrust": ("at_least", "at_most"), "tilt": ("at_least", "at_most"), "rate": ("at_most",),
    "acceleration": ("at_most",), "jerk": ("at_most",), "attitude": ("tilt",),
}  # fmt: skip
DERIVATIVES = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}
Polynomial = list[Fraction]  # coefficients, the lowest power first
ZERO, UNIT = Fraction(0), Fraction(1)


class Malformed(ValueError):
    """The document is no certificate."""


def times(a: int, b: int, c: int, d: int) -> tuple[int, int]:
    """Return the product of the intervals [a, b] and [c, d], rounded outward."""
    products = (a * c, a * d, b * c, b * d)
    return min(products) >> 96, -(-max(products) >> 96)


class Bounds(NamedTuple):
    """Of a function f of u in [-1, 1]: f(0) is in [low, high], and f(u) - f(0) is in u [down, up]."""

    low: int
    high: int
    down: int = 0
    up: int = 0

    def __add__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        return Bounds(self.low + other.low, self.high + other.high, self.down + other.down, self.up + other.up)

    def __neg__(self) -> Bounds:
        return Bounds(-self.high, -self.low, -self.up, -self.down)

    def __sub__(self, other: Bounds) -> Bounds:
        return self + -other

    def __mul__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        # f g - f0 g0 = (f - f0) (g + g0)/2 + (g - g0) (f + f0)/2, and (g + g0)/2 is in g0 + u [down, up]/2.
        f, g = (max(-one.down, one.up) + 1 >> 1 for one in (self, other))
        down, up = times(self.down, self.up, other.low - g, other.high + g)
        down1, up1 = times(other.down, other.up, self.low - f, self.high + f)
        return Bounds(*times(self.low, self.high, other.low, other.high), down + down1, up + up1)

    @property
    def is_positive(self) -> bool:
        """Whether f(u) > 0 for all u."""
        return self.low > max(-self.down, self.up, 0)


def enclosed(value: Fraction) -> Bounds:
    """Return an enclosure of a number."""
    return Bounds((value * ONE).__floor__(), (value * ONE).__ceil__())


def sine_and_cosine(angle: Bounds) -> tuple[Bounds, Bounds]:
    """Return the sine and the cosine of an angle."""
    if max(-angle.low, angle.high) > 4 * ONE:
        raise Malformed("angles must be at most 4 rad")
    sums, term, k = [[0, 0], [ONE, ONE]], (ONE, ONE), 0
    while k < 4 or max(-term[0], term[1]) > 16:
        k += 1
        low, high = times(*term, angle.low, angle.high)
        term = low // k, -(-high // k)  # angle^k / k!
        part, signed = sums[(k + 1) % 2], (-term[1], -term[0]) if k % 4 in (2, 3) else term
        part[:] = [part[0] + signed[0], part[1] + signed[1]]
    rest = max(-term[0], term[1])  # at least the remainder |angle|^(k+1) / (k+1)!, since k + 1 > 4 >= |angle|
    sine, cosine = ((low - rest, high + rest) for low, high in sums)
    # sin(a + d) - sin a = d cos(a + e) sin(e)/e with e = d/2; cos(a + e) = cos a cos e - sin a sin e, where cos e and
    # sin(e)/e are in [1 - e², 1] and |sin e| <= |e|. The cosine is the same with -sin a for cos a and cos a for sin a.
    e = max(-angle.down, angle.up) + 1 >> 1
    share = ONE - times(e, e, e, e)[1], ONE
    out = []
    for value, first, second in ((sine, cosine, sine), (cosine, (-sine[1], -sine[0]), cosine)):
        aside, (low, high) = times(-e, e, *second), times(*first, *share)
        around = times(low + aside[0], high + aside[1], *share)
        out.append(Bounds(*value, *times(*around, angle.down, angle.up)))
    return out[0], out[1]


def on_interval(polynomial: Polynomial, start: Fraction, width: Fraction) -> Polynomial:
    """Return the coefficients in powers of x, for s = start + width x."""
    out = [ZERO]
    for coefficient in reversed(polynomial):  # Horner's rule
        out = [start * a + width * b for a, b in zip([*out, ZERO], [ZERO, *out], strict=True)]
        out[0] += coefficient
    return out[: len(polynomial)]


def control_values(polynomial: Polynomial, low: Fraction, high: Fraction) -> Polynomial:
    """Return the Bernstein coefficients on an interval; the polynomial lies between the least and the largest."""
    a = on_interval(polynomial, low, high - low)
    return [sum((a[k] * comb(j, k) / comb(len(a) - 1, k) for k in range(j + 1)), ZERO) for j in range(len(a))]


def slope(polynomial: Polynomial) -> Polynomial:
    """Return the derivative."""
    return [k * a for k, a in enumerate(polynomial)][1:] or [ZERO]


def composed(outer: Polynomial, inner: Polynomial) -> Polynomial:
    """Return the polynomial outer(inner(x))."""
    out = [ZERO]
    for coefficient in reversed(outer):
        product = [ZERO] * (len(out) + len(inner) - 1)
        for i, a in enumerate(out):
            for k, b in enumerate(inner):
                product[i + k] += a * b
        out = [product[0] + coefficient, *product[1:]]
    return out


class Physics:
    """The level decoupling matrix M = [tau / (L Kf); F_z / Kf] on an interval of a piece, per rotor input.

    tau = [[0, x2, 0, x4], [y1, 0, y3, 0], [z1, z2, z3, z4]], F_z = [-c1, c2, -c3, c4] with ci = cos alpha_i.
    """

    def __init__(self, kappa: Fraction, angles: list[Polynomial], low: Fraction, high: Fraction) -> None:
        found: dict[tuple[Fraction, ...], tuple[Bounds, Bounds]] = {}
        for one in map(tuple, angles):
            if one not in found:
                a, b, *more = [*on_interval(list(one), (low + high) / 2, (high - low) / 2), ZERO]
                around = sum(map(abs, more), ZERO)  # |u| <= 1
                found[one] = sine_and_cosine(
                    Bounds(*enclosed(a)[:2], enclosed(b - around).low, enclosed(b + around).high)
                )
        (s1, c1), (s2, c2), (s3, c3), (s4, c4) = (found[tuple(one)] for one in angles)
        k, self.sign = enclosed(kappa), 1 if kappa > 0 else -1
        self.x2, self.x4, self.y1, self.y3 = c2 - k * s2, k * s4 - c4, c1 + k * s1, -c3 - k * s3
        self.z, self.f = (s1 - k * c1, -s2 - k * c2, s3 - k * c3, -s4 - k * c4), (-c1, c2, -c3, c4)
        # The inputs without torque are the 3x3 minors of tau; their thrusts have the signs -, +, -, + of F_z.
        p, q = self.x2 * self.z[3] - self.x4 * self.z[1], self.y1 * self.z[2] - self.y3 * self.z[0]
        t = self.thrusts = self.y3 * p, self.x4 * q, -self.y1 * p, -self.x2 * q
        # The force of these inputs in body axes; the vertical one is det M = 2 kappa R.
        self.force = s2 * t[1] - s4 * t[3], s3 * t[2] - s1 * t[0], t[0] * c1 + t[1] * c2 + t[2] * c3 + t[3] * c4

    def minors(self, floor: Fraction) -> list[Bounds]:
        """Return the leading minors of M M' - floor² 1."""
        x2, x4, y1, y3, (z1, z2, z3, z4), (f1, f2, f3, f4) = self.x2, self.x4, self.y1, self.y3, self.z, self.f
        square, two = enclosed(floor * floor), enclosed(Fraction(2))
        a, b = x2 * x2 + x4 * x4 - square, y1 * y1 + y3 * y3 - square
        c, d = (i * i + j * j + k * k + m * m - square for i, j, k, m in (self.z, self.f))
        e = z1 * f1 + z2 * f2 + z3 * f3 + z4 * f4
        u, v, w, t = x2 * z2 + x4 * z4, x2 * f2 + x4 * f4, y1 * z1 + y3 * z3, y1 * f1 + y3 * f3
        # The matrix [[a, 0, u, v], [0, b, w, t], [u, w, c, e], [v, t, e, d]].
        first, second, cross = u * u * d + v * v * c - two * u * v * e, w * w * d + t * t * c - two * w * t * e, u * t - v * w
        whole = a * b * (c * d - e * e) - b * first - a * second + cross * cross
        return [a, a * b, a * b * c - b * u * u - a * w * w, whole]

    def positive(self, name: str, values: dict[str, Any]) -> list[Bounds]:
        """Return what must be positive on the interval for a claim to hold there."""
        x, y, z = self.force
        if name == "least_singular_value":
            return self.minors(values["at_least"])[3:]
        if name == "sign_of_R":
            return [z if (values["sign"] == "positive") == (self.sign > 0) else -z]
        if name == "hover_thrust":  # thrust / z is the share of the weight
            least, most = (enclosed(values[key]) * z for key in CLAIMS[name])
            parts = [z, *(part for thrust in self.thrusts for part in (thrust - least, most - thrust))]
            return parts if z.low > 0 else [-part for part in parts]
        # The determinant at an attitude is (x, y, z) times the vertical in body axes.
        sine, cosine = sine_and_cosine(enclosed(values["tilt"]))
        return [z * z * cosine * cosine - (x * x + y * y) * sine * sine]


def need(right: object, rule: str, got: object) -> None:
    """Raise Malformed unless a rule is kept."""
    if not right:
        text = json.dumps(got)
        raise Malformed(f"{rule}, got {text if len(text) <= 60 else text[:60] + '…'}")


def number(text: object, what: str) -> Fraction:
    """Return the exact value of a decimal or of a fraction p/q."""
    rule = f"{what} must be an exact number, a text such as '-0.25' or '2/3'"
    need(isinstance(text, str) and NUMBER.fullmatch(text), rule, text)
    return Fraction(str(text))


def numbers(value: object, what: str, least: int, most: int) -> Polynomial:
    """Return a list of numbers."""
    return [number(one, what) for one in listed(value, what, least, most)]


def listed(value: object, what: str, least: int, most: int) -> list[Any]:
    """Return a list of some length."""
    need(isinstance(value, list) and least <= len(value) <= most, f"{what} must be a list of {least} to {most}", value)
    return value  # type: ignore[return-value]


def fields(value: object, what: str, *names: str) -> list[Any]:
    """Return the values of an object with these names and no other."""
    ok = isinstance(value, dict) and set(value) == set(names)
    need(ok, f"{what} must have the names {', '.join(names)} and no other", value)
    return [value[name] for name in names]  # type: ignore[index]


def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of JSON, no name in it twice."""
    need(len(dict(pairs)) == len(pairs), "names in an object must differ", [name for name, _ in pairs])
    return dict(pairs)


class Certificate:
    """A well-formed certificate: its vehicle, its curve and its claims in exact numbers."""

    def __init__(self, text: str) -> None:
        try:
            content = json.loads(text, object_pairs_hook=unique)
        except (RecursionError, ValueError) as error:
            if isinstance(error, Malformed):
                raise
            raise Malformed(f"the document must be JSON: {str(error).splitlines()[0]}") from None
        timed = ["law"] if isinstance(content, dict) and "law" in content else []
        names = ("format", "made_by", "digest", "deviation", "vehicle", "pieces", "claims", *timed)
        kind, _, self.digest, deviation, vehicle, pieces, claims, *law = fields(content, "the document", *names)
        need(kind == FORMAT, f"format must be {FORMAT!r}", kind)
        number(deviation, "deviation")
        constants = ("drag_coefficient", "thrust_coefficient", "arm_length")
        _, spin, *given = fields(vehicle, "vehicle", "name", "first_rotor_spin", *constants)
        drag, thrust, arm = (number(one, "constants") for one in given)
        need(min(drag, thrust, arm) > 0, "constants must be positive", given)
        need(spin in ("clockwise", "counterclockwise"), "first_rotor_spin must be clockwise or counterclockwise", spin)
        self.kappa = drag / (thrust * arm) * (1 if spin == "clockwise" else -1)
        self.law = numbers(law[0], "law", 2, 8) if timed else [ZERO, UNIT]
        rises = self.law[0] == 0 and sum(self.law) == 1 and min(control_values(slope(self.law), ZERO, UNIT)) >= 0
        need(rises, "law must rise from 0 to 1", law)
        self.pieces: list[list[Polynomial]] = []
        self.durations: Polynomial = []
        for piece in listed(pieces, "pieces", 1, 10**7):
            alpha, *duration = fields(piece, "a piece", "alpha", *["duration" for _ in timed])
            self.pieces.append([numbers(one, "alpha", 1, 24) for one in listed(alpha, "alpha", 4, 4)])
            self.durations += [number(one, "duration") for one in duration]
        need(all(one > 0 for one in self.durations), "durations must be positive", [])
        self.claims = [self._claim(one) for one in listed(claims, "claims", 1, len(CLAIMS))]
        need(len({name for name, *_ in self.claims}) == len(self.claims), "claims must differ", [])

    def _claim(self, claim: object) -> tuple[str, dict[str, Any], list[Polynomial]]:
        """Return the name of a claim, its values and its cover: break points on each piece."""
        name = claim.get("claim") if isinstance(claim, dict) else None
        need(name in CLAIMS, f"claim must be one of {', '.join(CLAIMS)}", name)
        _, *given = fields(claim, name, "claim", *CLAIMS[name], *["cover"] * (name != "joints"))
        need(self.durations or name not in ("joints", "rate", "acceleration", "jerk"), f"{name} needs a law", name)
        values: dict[str, Any] = {}
        for key, value in zip(CLAIMS[name], given, strict=False):
            if name == "tilt":
                values[key] = numbers(value, key, 4, 4)
            elif key == "sign":
                need(value in ("positive", "negative"), "sign must be positive or negative", value)
                values[key] = value
            else:
                values[key] = number(value, key)
        if name == "joints":
            return name, values, []
        if name in ("least_singular_value", "attitude"):
            need(0 <= next(iter(values.values())) <= Fraction(3, 2), f"{name} must be from 0 to 1.5", given[0])
        cover = [numbers(one, "cover", 2, 10**6) for one in listed(given[-1], "cover", len(self.pieces), len(self.pieces))]
        for one in cover:
            rises = one[0] == 0 and one[-1] == 1 and all(a < b for a, b in zip(one, one[1:], strict=False))
            need(rises, "cover must rise from 0 to 1 on each piece", [str(number) for number in one])
        return name, values, cover

    def gap(self) -> str:
        """Return where the curve is not closed or jumps, or nothing."""
        for k, piece in enumerate(self.pieces):
            if any(sum(one) != other[0] for one, other in zip(self.pieces[k - 1], piece, strict=True)):
                return f"the curve jumps at the start of piece {k}"
        return ""

    def motion(self, k: int, order: int) -> list[Polynomial]:
        """Return a derivative by time of the angles on a piece, of the share of its duration; order 0: of s."""
        out = self.pieces[k]
        if order:
            out = [composed(one, self.law) for one in out]
            for _ in range(order):
                out = [[a / self.durations[k] for a in slope(one)] for one in out]
        return out

    def holds(self, name: str, values: dict[str, Any], k: int, low: Fraction, high: Fraction) -> bool:
        """Return whether a claim is proved on one interval of a piece."""
        if name not in DERIVATIVES:
            physics = Physics(self.kappa, self.pieces[k], low, high)
            return all(part.is_positive for part in physics.positive(name, values))
        most = values["at_most"]
        least, most = (values["at_least"], most) if name == "tilt" else ([-most] * 4, [most] * 4)
        for one, below, above in zip(self.motion(k, DERIVATIVES[name]), least, most, strict=True):
            control = control_values(one, low, high)
            if min(control) < below or max(control) > above:
                return False
        return True

    def failure(self, name: str, values: dict[str, Any], cover: list[Polynomial]) -> str:
        """Return where a claim is not proved first, or nothing."""
        if name == "joints":
            for k in range(len(self.pieces)):
                for order, key in enumerate(CLAIMS[name], start=1):
                    ends, starts = self.motion(k - 1, order), self.motion(k, order)
                    if any(abs(sum(one) - other[0]) > values[key] for one, other in zip(ends, starts, strict=True)):
                        return f"{key} at the start of piece {k}"
        if name == "least_singular_value":  # positive definite at one point, and the determinant never 0
            start = Physics(self.kappa, self.pieces[0], cover[0][0], cover[0][1]).minors(values["at_least"])
            if not all(one.low > 0 for one in start):
                return "the middle of the first interval"
        for k, breaks in enumerate(cover):
            for low, high in zip(breaks, breaks[1:], strict=False):
                if not self.holds(name, values, k, low, high):
                    return f"piece {k}, s from {low} to {high}"
        return ""


def check(text: str) -> list[tuple[str, str]]:
    """Return each claim and where it is not proved first, nothing if it is proved; Malformed if it is none."""
    certificate = Certificate(text)
    out = [("closed", certificate.gap())]
    for name, values, cover in certificate.claims:
        out.append((name, certificate.failure(name, values, cover)))
    return out


def main(path: str) -> int:
    """Print what is proved, and return the exit code."""
    try:
        with open(path, encoding="utf-8") as file:
            found = check(file.read(1 << 27))
    except (OSError, ValueError) as error:
        print(f"{path}: {error}", file=sys.stderr)
        return 2
    for claim, place in found:
        print(f"NOT proved: {claim}, {place}" if place else f"proved: {claim}")
    return 1 if any(place for _, place in found) else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
