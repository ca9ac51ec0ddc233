"""Two witnesses of certificates, from the paper's equations and the format alone: Arb balls, and mpmath intervals.

Neither uses the package, or the covers: each bisects until it can decide. The balls take places and axes of the rotors
(docs/theory.md, section 1), cofactors and elimination in M'M − σ²1; the intervals the zero-moment thrusts (sections 2,
3 and 19) and the Schur complement in MM' − σ²1. Claims of angles, rates and joints are exact polynomials, which may
touch zero: each judges them to within 1e-18.
"""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import mpmath
import pytest

pytest.importorskip("flint", reason="install python-flint, of the extra 'dev'")

import flint
from flint import arb, arb_series, fmpq, fmpq_poly

ORDER = 4  # of the Taylor polynomials of the balls
DERIVATIVES = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}
EXACT = {*DERIVATIVES, "joints"}
iv = mpmath.ctx_iv.MPIntervalContext()
iv.prec, flint.ctx.prec, flint.ctx.cap = 80, 128, ORDER + 1


def exact(text: str) -> fmpq:
    return fmpq(*Fraction(text).as_integer_ratio())


class Certificate:
    """The content of a certificate: places of rotors in units of their mean distance L from body z, and signed drags.

    κ and H are those of four equal arms, of which the first is along body x; `equal` says whether it has such.
    """

    def __init__(self, text: str) -> None:
        document = json.loads(text)
        vehicle, pieces = document["vehicle"], document["pieces"]
        self.claims = document["claims"]
        self.is_open = document["path"] == "open"
        spin = 1 if vehicle["first_rotor_spin"] == "clockwise" else -1
        places = [list(map(exact, place)) for place in vehicle["rotor_positions"]]
        drags = [
            exact(drag) * (spin, -spin)[k % 2]
            for k, drag in enumerate(vehicle["drag_to_thrust"])
        ]
        arm, height = places[0][0], places[0][2]
        ends = [(arm, 0), (0, arm), (-arm, 0), (0, -arm)]
        self.equal = places == [[x, y, height] for x, y in ends]
        self.equal &= all(abs(drag) == abs(drags[0]) for drag in drags)
        if self.equal:
            self.kappa, self.height = drags[0] / arm, height / arm
        self.spin = spin
        lengths = [(arb(x * x + y * y)).sqrt() for x, y, _ in places]
        mean = sum(lengths, arb(0)) / 4
        self.axes = [
            (arb(x) / length, arb(y) / length)
            for (x, y, _), length in zip(places, lengths, strict=True)
        ]
        self.places = [[arb(part) / mean for part in place] for place in places]
        self.drags = [arb(drag) / mean for drag in drags]
        self.durations = [exact(p["duration"]) for p in pieces]
        self.pieces = [
            [fmpq_poly(list(map(exact, angle))) for angle in (piece["alpha"] * 2)[:4]]
            for piece in pieces
        ]

    def polynomials(self, name: str) -> list[list[fmpq_poly]]:
        """Return for each piece the angles, or for EXACT, one by one, what is not negative where a claim holds."""
        if name not in EXACT:
            return self.pieces
        moved, claim = (
            [],
            self.claims[name],
        )  # the angles, rates, accelerations and jerks by the share of a duration
        for piece, duration in zip(self.pieces, self.durations, strict=True):
            moved.append([piece])
            for _ in range(3):
                moved[-1].append([q.derivative() / duration for q in moved[-1][-1]])
        found = []
        for k, derivatives in enumerate(moved):
            if name == "joints":
                is_first = k == 0
                if is_first and self.is_open:
                    for rate in derivatives[1]:
                        found.append(fmpq_poly([-abs(rate(0))]))
                    for rate in moved[-1][1]:
                        found.append(fmpq_poly([-abs(rate(1))]))
                    most = exact(claim["acceleration_jump"])
                    ends = [q(0) for q in derivatives[2]]
                    ends += [q(1) for q in moved[-1][2]]
                    found += [fmpq_poly([most - abs(end)]) for end in ends]
                    continue
                for order, most in enumerate(
                    ["0", claim["rate_jump"], claim["acceleration_jump"]]
                ):
                    jumps = [
                        a(1) - b(0)
                        for a, b in zip(
                            moved[k - 1][order], derivatives[order], strict=True
                        )
                    ]
                    found += [fmpq_poly([exact(most) - abs(jump)]) for jump in jumps]
            else:
                rows = (
                    derivatives[DERIVATIVES[name]],
                    claim["at_least"],
                    claim["at_most"],
                )
                for q, low, high in zip(*rows, strict=True):
                    found += [q - exact(low), exact(high) - q]
        return [[q] for q in found]


def everywhere(holds: Any, piece: Any, low: Any, width: Any, depth: int = 50) -> bool:
    """Return whether something is shown of a piece on all of [low, low + width], halved where that helps."""
    halves = (low, low + width / 2)
    more = (everywhere(holds, piece, x, width / 2, depth - 1) for x in halves if depth)
    return holds(piece, low, width) or (depth > 0 and all(more))


def powers(coefficients: list[Any], x: Any) -> Any:
    total = x * 0
    for c in reversed(coefficients):
        total = total * x + c
    return total


def in_balls(it: Certificate, name: str, alpha: list[Any]) -> list[Any]:
    """Return what is positive where a claim holds, for four angles that are balls, or series of balls."""
    if name in EXACT:
        return alpha
    claim = it.claims[name]
    bounds = [
        arb(exact(claim[side]))
        for side in ("at_least", "at_most", "tilt")
        if side in claim
    ]
    axes, torques = [], []
    for a, (ex, ey), (x, y, h), drag in zip(
        alpha, it.axes, it.places, it.drags, strict=True
    ):
        s, c = a.sin(), a.cos()
        n = (s * ey, -s * ex, c)  # cos α z + sin α e×z
        axes.append(n)
        roll, pitch = y * c - h * n[1], h * n[0] - x * c
        torques.append(
            (roll + drag * n[0], pitch + drag * n[1], x * n[1] - y * n[0] + drag * c)
        )  # r×n + σκn
    if name == "least_singular_value":
        columns = [(*torque, n[2]) for torque, n in zip(torques, axes, strict=True)]
        gram = [
            [sum(x * y for x, y in zip(p, q, strict=True)) for q in columns]
            for p in columns
        ]
        for i in range(4):
            gram[i][i] -= bounds[0] * bounds[0]
            for row in range(i):
                share = gram[i][row] / gram[row][row]
                gram[i] = [
                    x - share * y for x, y in zip(gram[i], gram[row], strict=True)
                ]
        return [gram[i][i] for i in range(4)]
    free = []  # thrusts without torque
    for i in range(4):
        a, b, c = torques[:i] + torques[i + 1 :]
        minor = a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
        free.append((minor + c[0] * (a[1] * b[2] - a[2] * b[1])) * (-1) ** (i + 1))
    x, y, z = (sum(u * n[j] for u, n in zip(free, axes, strict=True)) for j in range(3))
    if name == "sign_of_R":
        return [z * it.spin * {"positive": 1, "negative": -1}[claim["sign"]]]
    if name == "hover_thrust":
        return [side for u in free for side in (u / z - bounds[0], bounds[1] - u / z)]
    s, c = bounds[0].sin_cos()
    return [z * z * c * c - (x * x + y * y) * s * s]


def proved_by_balls(it: Certificate, name: str) -> bool:
    """Decide by Taylor polynomials about the middle, with the remainder's coefficient on the whole interval."""

    def holds(piece: list[list[arb]], low: fmpq, width: fmpq) -> bool:
        middle, step = arb(low + width / 2), arb(0, arb(width / 2))
        try:
            at, on = (
                in_balls(it, name, [powers(q, arb_series([x, 1])) for q in piece])
                for x in (middle, middle + step)
            )
        except (ValueError, ZeroDivisionError):  # a divisor's ball holds zero
            return False
        enclosures = [f[ORDER] for f in on]
        for k in reversed(range(ORDER)):
            enclosures = [x * step + f[k] for x, f in zip(enclosures, at, strict=True)]
        return all(x > (-1e-18 if name in EXACT else 0) for x in enclosures)

    pieces = (
        [list(map(arb, q.coeffs())) for q in piece] for piece in it.polynomials(name)
    )
    return all(everywhere(holds, piece, fmpq(0), fmpq(1)) for piece in pieces)


def false_at_samples(it: Certificate, name: str, samples: int) -> bool:
    """Return whether a claim is false at one of evenly spaced points of a piece, in 128 bits."""
    points = [fmpq(i, samples) for i in range(samples + 1)]
    where = [
        [arb(q(x)) for q in piece] for piece in it.polynomials(name) for x in points
    ]
    return any(value < 0 for alpha in where for value in in_balls(it, name, alpha))


class Slope:
    """A function on an interval U about m: its value at m, its range on U, and the range of its slopes to m."""

    def __init__(self, at: Any, on: Any, slope: Any) -> None:
        self.at, self.on, self.slope = at, on, slope

    def __add__(self, x: Any) -> Slope:
        x = x if isinstance(x, Slope) else Slope(x, x, 0)
        return Slope(self.at + x.at, self.on + x.on, self.slope + x.slope)

    def __mul__(self, x: Any) -> Slope:
        x = x if isinstance(x, Slope) else Slope(x, x, 0)
        return Slope(
            self.at * x.at, self.on * x.on, self.slope * x.on + self.at * x.slope
        )

    def __sub__(self, x: Any) -> Any:
        return self + x * -1

    def __truediv__(self, x: Slope) -> Slope:
        return Slope(
            self.at / x.at,
            self.on / x.on,
            (self.slope - self.at / x.at * x.slope) / x.on,
        )

    def sine_and_cosine(self) -> tuple[Slope, Slope]:
        s, c = iv.sin(self.on), iv.cos(self.on)
        return Slope(iv.sin(self.at), s, c * self.slope), Slope(
            iv.cos(self.at), c, -s * self.slope
        )


def interval(number: fmpq | str) -> Any:
    return iv.mpf(Fraction(str(number)).numerator) / Fraction(str(number)).denominator


def in_intervals(it: Certificate, name: str, alpha: list[Slope]) -> list[Slope]:
    """Return what is positive where a claim holds."""
    if name in EXACT:
        return alpha
    trig, claim = [a.sine_and_cosine() for a in alpha], it.claims[name]
    k, h = interval(it.kappa), interval(it.height)
    (s1, c1), (s2, c2), (s3, c3), (s4, c4) = trig
    C1, C2, C3, C4 = (
        c + s * x for (s, c), x in zip(trig, [k, -k, k, -k], strict=True)
    )  # cos β / cos δ
    S1, S2, S3, S4 = (
        s - c * x for (s, c), x in zip(trig, [k, -k, k, -k], strict=True)
    )  # sin β / cos δ
    if name == "least_singular_value":
        square = interval(claim["at_least"]) * interval(claim["at_least"])
        h1, h2, h3, h4 = (s * h for s in (s1, s2, s3, s4))
        roll, pitch = (
            C2 * C2 + C4 * C4 + h1 * h1 + h3 * h3 - square,
            C1 * C1 + C3 * C3 + h2 * h2 + h4 * h4 - square,
        )
        a, b = (
            C4 * S4 - C2 * S2 + h3 * S3 - h1 * S1,
            C1 * S1 - C3 * S3 + h4 * S4 - h2 * S2,
        )  # yaw with roll, with pitch
        e, f = (
            C2 * c2 - C4 * c4 + h1 * c1 - h3 * c3,
            C3 * c3 - C1 * c1 + h2 * c2 - h4 * c4,
        )  # altitude likewise
        g = (
            h2 * C2 + h4 * C4 - h1 * C1 - h3 * C3
        ) / roll  # roll with pitch: zero for rotors without a height
        pitch, b, f = pitch - g * g * roll, b - g * a, f - g * e
        yaw = (
            S1 * S1
            + S2 * S2
            + S3 * S3
            + S4 * S4
            - square
            - a * a / roll
            - b * b / pitch
        )
        altitude = (
            c1 * c1
            + c2 * c2
            + c3 * c3
            + c4 * c4
            - square
            - e * e / roll
            - f * f / pitch
        )
        both = S1 * c1 + S2 * c2 + S3 * c3 + S4 * c4 + a * e / roll + b * f / pitch
        return [roll, pitch, yaw, yaw * altitude - both * both]
    x, y = S1 * C3 + C1 * S3, S2 * C4 + C2 * S4
    E, F = s1 * s3 * 2 - (s1 * c3 + c1 * s3) * k, s2 * s4 * 2 + (s2 * c4 + c2 * s4) * k
    p, q = s1 * c3 - c1 * s3, s2 * c4 - c2 * s4
    u1, u2 = (
        q * S3 * h - y * C3 - s3 * F * (h * h),
        x * C4 + p * S4 * h + s4 * E * (h * h),
    )  # zero-moment thrusts
    u = (
        u1,
        u2,
        q * S1 * -h - y * C1 - s1 * F * (h * h),
        x * C2 - p * S2 * h + s2 * E * (h * h),
    )
    N = (
        u[1] * s2 - u[3] * s4,
        u[2] * s3 - u[0] * s1,
        u[0] * c1 + u[1] * c2 + u[2] * c3 + u[3] * c4,
    )
    if name == "sign_of_R":
        return [
            N[2]
            * {"positive": -1, "negative": 1}[claim["sign"]]
            * (-1 if it.kappa < 0 else 1)
        ]  # det M = −N_z
    if name == "hover_thrust":
        low, high = (interval(claim[side]) for side in ("at_least", "at_most"))
        return [
            side
            for thrust in u
            for side in (thrust / N[2] - low, thrust / N[2] * -1 + high)
        ]
    s, c = iv.sin(interval(claim["tilt"])), iv.cos(interval(claim["tilt"]))
    return [N[2] * N[2] * c * c - (N[0] * N[0] + N[1] * N[1]) * s * s]


def proved_by_intervals(it: Certificate, name: str) -> bool:
    """Decide by ranges and by slopes to the middle, whichever is narrower."""

    def holds(piece: list[list[Any]], low: Any, width: Any) -> bool:
        reach, step = (
            iv.mpf([low.a, (low + width).b]),
            iv.mpf([-(width / 2).b, (width / 2).b]),
        )
        alpha = [powers(q, Slope(low + width / 2, reach, iv.mpf(1))) for q in piece]
        least = -1e-18 if name in EXACT else 0
        return all(
            max(q.on.a, (q.at + q.slope * step).a) > least
            for q in in_intervals(it, name, alpha)
        )

    pieces = (
        [list(map(interval, q.coeffs())) for q in piece]
        for piece in it.polynomials(name)
    )
    return all(everywhere(holds, piece, iv.mpf(0), iv.mpf(1)) for piece in pieces)
