"""Check the certificate of a gait with the standard library alone: ``python check.py gait.cert.json``.

Polynomials are exact fractions; sines and cosines are integers times 2^-96 with bounds of their errors. The matrix is
that of Shen, Ma and Tsuchiya (2022). Exit codes: 0 every claim is proved, 1 one is not, 2 it is no certificate.
"""

from __future__ import annotations

import json
import re
import sys
from fractions import Fraction
from functools import partial
from itertools import pairwise
from math import comb
from pathlib import Path
from typing import Any, NamedTuple

ONE, ZERO = 1 << 96, Fraction(0)
Polynomial = list[Fraction]  # coefficients, the lowest power first
NUMBER = re.compile(r"-?[0-9]{1,40}(\.[0-9]{1,60}|/[1-9][0-9]{0,59})?")  # exact: a decimal or a fraction
POSITIVE = re.compile(r"(?=[0-9.]*[1-9])[0-9]{1,40}(\.[0-9]{1,60}|/[1-9][0-9]{0,59})?")
TEXT, FOUR, COVER = "(?s:.{0,1000})", [NUMBER, 4, 4], {"cover": [[NUMBER, 2, 10**6], 1, 10**6]}
ORDERS = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}  # claims about derivatives by time
CLAIMS = {name: {"at_least": FOUR, "at_most": FOUR, **COVER} for name in ORDERS} | {
    "least_singular_value": {"at_least": NUMBER, **COVER}, "sign_of_R": {"sign": "positive|negative", **COVER},
    "hover_thrust": {"at_least": NUMBER, "at_most": NUMBER, **COVER}, "attitude": {"tilt": NUMBER, **COVER},
    "joints": {"rate_jump": NUMBER, "acceleration_jump": NUMBER},
}  # fmt: skip
CONSTANTS = dict.fromkeys(("drag_coefficient", "thrust_coefficient", "arm_length"), POSITIVE)
FORM = {  # of a document: objects by their names, lists by what is in them and how often, texts by what they match
    "format": "gaitgraph certificate 1", "made_by": TEXT, "digest": "([0-9a-f]{64})?", "deviation": NUMBER,
    "vehicle": {"name": TEXT, **CONSTANTS, "first_rotor_spin": "clockwise|counterclockwise"}, "law": [NUMBER, 2, 8],
    "pieces": [{"alpha": [[NUMBER, 1, 24], 4, 4], "duration": POSITIVE}, 1, 10**6], "claims": CLAIMS,
}  # fmt: skip


class Bounds(NamedTuple):
    """Of a function f of u in [-1, 1]: f(0) is within error of value, (f(u) - f(0)) / u within spread of slope."""

    value: int
    error: int
    slope: int
    spread: int

    def __add__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        return Bounds(*(a + b for a, b in zip(self, other, strict=True)))

    def __sub__(self, other: Bounds) -> Bounds:
        return self + Bounds(-other.value, other.error, -other.slope, other.spread)

    def __mul__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        # f g - f0 g0 = (f - f0) (g + g0)/2 + (g - g0) (f + f0)/2, and (g + g0)/2 is within e2 + |g - g0|/2 of g0.
        (v1, e1, s1, r1), (v2, e2, s2, r2) = self, other
        f, g, size1, size2 = abs(s1) + r1, abs(s2) + r2, abs(v1), abs(v2)
        error, spread = size1 * e2 + size2 * e1 + e1 * e2, r1 * size2 + r2 * size1 + f * e2 + g * e1 + f * g + f + g
        return Bounds(v1 * v2 >> 96, (error >> 96) + 2, s1 * v2 + s2 * v1 >> 96, (spread >> 96) + 2)


def enclosed(value: Fraction, slope: Fraction = ZERO, bend: Fraction = ZERO) -> Bounds:
    """Return bounds of value + u (slope + v), where v is at most `bend` in size."""
    return Bounds(value * ONE // 1, 1, slope * ONE // 1, bend * ONE // 1 + 2)


def sine_and_cosine(angle: Bounds) -> list[Bounds]:
    """Return the sine and the cosine of an angle."""
    a, off, s, r = angle
    if abs(a) > 4 * ONE:
        raise ValueError("angles must be at most 4 rad in size, got a larger one")
    sums, term, wrong, k = [0, ONE], ONE, 0, 0
    while k < 4 or abs(term) > 16:
        k += 1
        term, wrong = term * a // (k << 96), wrong * abs(a) // (k << 96) + 2  # a^k / k!, and a bound of its error
        sums[(k + 1) % 2] += -term if k % 4 in (2, 3) else term
        off += wrong
    off += abs(term) + wrong  # at least the remainder |a|^(k+1) / (k+1)!, since k + 1 > 4 >= |a|
    # sin(a + d) - sin a = sin d cos a - (1 - cos d) sin a, where 1 - sin(d)/d is in [0, d²/6], (1 - cos d)/|d| in
    # [0, |d|/2]; and cos(a + d) - cos a = -sin d sin a - (1 - cos d) cos a.
    d, out = abs(s) + r, []
    for value, first in ((sums[0], sums[1]), (sums[1], -sums[0])):
        around = ((abs(first) + off) * (d * d // (6 << 96) + 1) + (abs(value) + off) * (d // 2 + 1) >> 96) + off + 1
        out.append(Bounds(value, off, s * first >> 96, (d * around + r * abs(first) >> 96) + 2))
    return out


def composed(outer: Polynomial, inner: Polynomial) -> Polynomial:
    """Return the polynomial outer(inner(x))."""
    out = outer[-1:]
    for coefficient in outer[-2::-1]:  # Horner's rule
        rows = [[ZERO] * k + [a * b for a in out] + [ZERO] * (len(inner) - 1 - k) for k, b in enumerate(inner)]
        out = [sum(column, ZERO if k else coefficient) for k, column in enumerate(zip(*rows, strict=True))]
    return out


def control_values(polynomial: Polynomial, low: Fraction, high: Fraction) -> Polynomial:
    """Return the Bernstein coefficients on an interval; the polynomial lies between the least and the largest."""
    a = composed(polynomial, [low, high - low])
    return [sum((a[k] * comb(j, k) / comb(len(a) - 1, k) for k in range(j + 1)), ZERO) for j in range(len(a))]


def motion(piece: dict[str, Any], law: Polynomial, order: int) -> list[Polynomial]:
    """Return a derivative by time of the angles on a piece, of the share of its duration; order 0: of s."""
    out: list[Polynomial] = [composed(one, law) if order else one for one in piece["alpha"]]
    for _ in range(order):
        out = [[k * a / piece["duration"] for k, a in enumerate(one)][1:] or [ZERO] for one in out]
    return out


def level_physics(kappa: Fraction, angles: list[Polynomial], low: Fraction, high: Fraction) -> tuple[Any, Any, Any]:
    """Return the level matrix of the four thrusts on an interval, thrusts without torque, and their force in body axes.

    M = [[0, x2, 0, -x4], [y1, 0, -y3, 0], [-z1, z2, -z3, z4], [c1, c2, c3, c4]] are torques / (L Kf), that about y
    with the other sign, and lift / Kf. The vertical part of the force is det M = 2 kappa R.
    """
    k, found = enclosed(kappa), {}
    for one in set(map(tuple, angles)):
        a, *b = composed(list(one), [(low + high) / 2, (high - low) / 2])  # in powers of u in [-1, 1]
        found[one] = sine_and_cosine(enclosed(a, sum(b[:1], ZERO), sum(map(abs, b[1:]), ZERO)))
    (s1, c1), (s2, c2), (s3, c3), (s4, c4) = (found[tuple(one)] for one in angles)
    x2, y1, x4, y3 = c2 - k * s2, c1 + k * s1, c4 - k * s4, c3 + k * s3
    z1, z2, z3, z4 = k * c1 - s1, k * c2 + s2, k * c3 - s3, k * c4 + s4
    p, q = z2 * x4 + z4 * x2, z1 * y3 + z3 * y1
    t1, t2, t3, t4 = thrusts = y3 * p, x4 * q, y1 * p, x2 * q
    force = s2 * t2 - s4 * t4, s3 * t3 - s1 * t1, c1 * t1 + c2 * t2 + c3 * t3 + c4 * t4
    return ((x2, x4), (y1, y3), (z1, z2, z3, z4), (c1, c2, c3, c4)), thrusts, force


def proves(name: str, claim: Any, kappa: Fraction, curves: Any, ends: list[Fraction], known: Any = None) -> bool:
    """Return whether a claim holds on an interval, of which level_physics may be known."""
    if name in ORDERS:
        limits = zip(claim["at_least"], curves, claim["at_most"], strict=True)
        return all(a <= value <= b for a, one, b in limits for value in control_values(one, *ends))
    rows, thrusts, (x, y, z) = known or level_physics(kappa, curves, *ends)
    if name == "least_singular_value":  # M M' - floor² 1 = [[a, 0, u, v], [0, b, w, t], [u, w, c, e], [v, t, e, d]]
        (x2, x4), (y1, y3), (z1, z2, z3, z4), (c1, c2, c3, c4) = rows
        a, b, c, d = (sum((i * i for i in row), enclosed(ZERO) - enclosed(claim["at_least"] ** 2)) for row in rows)
        e, ab = z2 * c2 + z4 * c4 - z1 * c1 - z3 * c3, a * b
        u, v, w, t = x2 * z2 - x4 * z4, x2 * c2 - x4 * c4, y3 * z3 - y1 * z1, y1 * c1 - y3 * c3
        left = b * (u * u * d + v * v * c - (u * v + u * v) * e) + a * (w * w * d + t * t * c - (w * t + w * t) * e)
        last = ab * (c * d - e * e) - left + (u * t - v * w) * (u * t - v * w)
        parts = [a, ab, ab * c - b * u * u - a * w * w, last]  # the leading minors
    elif name == "sign_of_R":
        parts = [z if (kappa > 0) == (claim["sign"] == "positive") else enclosed(ZERO) - z]
    elif name == "hover_thrust":  # the share of the weight is thrust / z
        least, most = enclosed(claim["at_least"]) * z, enclosed(claim["at_most"]) * z
        parts = [z, *(part for thrust in thrusts for part in (thrust - least, most - thrust))]
        parts = parts if z.value > 0 else [enclosed(ZERO) - part for part in parts]
    else:  # attitude: the determinant is the product of the force and the vertical in body axes
        sine, cosine = sine_and_cosine(enclosed(claim["tilt"]))
        parts = [cosine, z * z * cosine * cosine - (x * x + y * y) * sine * sine]
    return all(part.value - part.error > abs(part.slope) + part.spread for part in parts)


def parsed(value: Any, form: Any, what: str) -> Any:
    """Return a value of a form, its numbers as fractions; an object comes as a tuple of pairs."""
    found = sorted(name for name, _ in value) if isinstance(value, tuple) else []
    if isinstance(form, dict) and found and found == sorted({*found, "joints"} & {*form} if form is CLAIMS else form):
        return {name: parsed(dict(value)[name], form[name], name) for name in form if name in found}
    if isinstance(form, list) and isinstance(value, list) and form[1] <= len(value) <= form[2]:
        return [parsed(one, form[0], what) for one in value]
    if isinstance(form, (str, re.Pattern)) and isinstance(value, str) and re.fullmatch(form, value):
        return Fraction(value) if isinstance(form, re.Pattern) else value
    rule = f"an object with the names {', '.join(form)}, each once" if isinstance(form, dict) else f"the text {form}"
    rule = f"a list of {form[1]} to {form[2]}" if isinstance(form, list) else rule
    rule = "an exact number in a text, such as '0.25' or '2/3'" if isinstance(form, re.Pattern) else rule
    raise ValueError(f"{what} must be {rule}, got {repr(found or value)[:60]}")


def check(text: str) -> list[tuple[str, str]]:
    """Return each claim and the first place where it is not proved, if any; ValueError if it is no certificate."""
    whole = parsed(json.loads(text, object_pairs_hook=tuple), FORM, "the document")
    drag, thrust, arm = (whole["vehicle"][name] for name in CONSTANTS)
    kappa = drag / (thrust * arm) * (1 if whole["vehicle"]["first_rotor_spin"] == "clockwise" else -1)
    rise, out = control_values(whole["law"], ZERO, Fraction(1)), []
    if rise[0] != 0 or rise[-1] != 1 or rise != sorted(rise):
        raise ValueError("law must rise from 0 to 1, got another polynomial")
    for name, claim in whole["claims"].items():
        missed, law, pieces = [], whole["law"], whole["pieces"]
        for order, most in enumerate([ZERO, *claim.values()] if name == "joints" else []):
            at = [motion(piece, law, order) for piece in pieces]
            jumps = [max(abs(sum(a) - b[0]) for a, b in zip(at[k - 1], at[k], strict=True)) for k in range(len(at))]
            missed += [f"at the start of piece {k}" for k, jump in enumerate(jumps) if jump > most]
        ends = [one == sorted({ZERO, Fraction(1), *one}) and one[-1] - one[0] for one in claim.get("cover", [])]
        if name != "joints" and ends != [1] * len(pieces):
            raise ValueError(f"cover of {name} must rise from 0 to 1 on each piece, got another")
        for k, breaks in enumerate(claim.get("cover", [])):
            test = partial(proves, name, claim, kappa, motion(pieces[k], law, ORDERS.get(name, 0)))
            missed += [f"on piece {k} from {a} to {b}" for a, b in pairwise(breaks) if not test([a, b])]
        out.append((name, missed[0] if missed else ""))
    return out


if __name__ == "__main__":
    try:
        found = check(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    except (OSError, RecursionError, ValueError) as error:
        print(f"{sys.argv[-1]}: {error}", file=sys.stderr)
        sys.exit(2)
    print("\n".join(f"NOT proved: {name} {place}" if place else f"proved: {name}" for name, place in found))
    sys.exit(int(any(place for _, place in found)))
