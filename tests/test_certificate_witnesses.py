"""Certificates of random gaits, and certificates with random changes, before the checker and a witness.

The witness takes the paper's equations and the format alone, neither the package nor the covers: places and axes of the
rotors (docs/theory.md, 1), cofactors, and elimination in M'M − σ²1, in Arb balls; it bisects until it can decide. Claims
of angles, rates and joints are exact polynomials, which may touch zero: it judges them to within 1e-18.
"""

from __future__ import annotations

import json
import math
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from gaitgraph.certificates import certify, check
from gaitgraph.gait.gait import lift
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import paced
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.validation.validating import validate
from tests.samples import LEANING, random_vehicle, small_gait, symmetric_vehicle

flint = pytest.importorskip("flint", reason="install python-flint, of the extra 'dev'")
arb, arb_series, fmpq, fmpq_poly = (
    flint.arb,
    flint.arb_series,
    flint.fmpq,
    flint.fmpq_poly,
)

ORDER = 4  # of the Taylor polynomials of the balls
DERIVATIVES = {"tilt": 0, "rate": 1, "acceleration": 2, "jerk": 3}
EXACT = {*DERIVATIVES, "joints"}
flint.ctx.prec, flint.ctx.cap = 128, ORDER + 1


def exact(text: str) -> Any:
    return fmpq(*Fraction(text).as_integer_ratio())


class Certificate:
    """The content of a certificate: places of rotors in units of their mean distance from body z, and signed drags."""

    def __init__(self, text: str) -> None:
        document = json.loads(text)
        vehicle, pieces = document["vehicle"], document["pieces"]
        self.claims, self.is_open = document["claims"], document["path"] == "open"
        words = vehicle.get("spins") or [vehicle["first_rotor_spin"]]
        spins = [1 if word == "clockwise" else -1 for word in words]
        if len(spins) == 1:
            spins = [spins[0], -spins[0]] * 2
        places = [list(map(exact, place)) for place in vehicle["rotor_positions"]]
        lengths = [arb(x * x + y * y).sqrt() for x, y, _ in places]
        mean = sum(lengths, arb(0)) / 4
        outward = [(x, y, fmpq(0)) for x, y, _ in places]
        self.axes = []  # tilt axes and thrust axes at zero tilt
        for tilt, thrust in zip(
            stated_axes(vehicle, "tilt_axes") or outward,
            stated_axes(vehicle, "thrust_axes") or [(0, 0, 1)] * 4,
            strict=True,
        ):
            share = dotted(tilt, thrust) / dotted(tilt, tilt)
            across = [a - share * e for a, e in zip(thrust, tilt, strict=True)]
            self.axes.append((unit(tilt), unit(across)))
        self.places = [[arb(part) / mean for part in place] for place in places]
        self.drags = [
            arb(exact(drag) * spin) / mean
            for drag, spin in zip(vehicle["drag_to_thrust"], spins, strict=True)
        ]
        axes, torques = in_space(self, [arb(0)] * 4)
        lift = dotted(without_torque(torques), [n[2] for n in axes])
        self.sign = spins[0]  # of the lift where R > 0
        if lift * spins[0] < -1e-11:  # R would be negative at zero tilt
            self.sign = -spins[0]
        self.durations = [exact(piece["duration"]) for piece in pieces]
        # Of each piece the angles, rates, accelerations and jerks by the share of its duration.
        self.motion = []
        for piece, duration in zip(pieces, self.durations, strict=True):
            curves = (piece["alpha"] * 2)[:4]
            orders = [[fmpq_poly(list(map(exact, curve))) for curve in curves]]
            for _ in range(3):
                orders.append([q.derivative() / duration for q in orders[-1]])
            self.motion.append(orders)

    def polynomials(self, name: str) -> list[list[Any]]:
        """Return for each piece the angles, or for EXACT, one by one, what is not negative where a claim holds."""
        if name not in EXACT:
            return [orders[0] for orders in self.motion]
        claim, positive = self.claims[name], []
        if name == "joints":
            limits = ["0", claim["rate_jump"], claim["acceleration_jump"]]
            if self.is_open:  # at rest at both ends
                for order, most in ((1, "0"), (2, limits[2])):
                    first, last = self.motion[0][order], self.motion[-1][order]
                    ends = [q(0) for q in first] + [q(1) for q in last]
                    positive += [fmpq_poly([exact(most) - abs(end)]) for end in ends]
            for k, orders in enumerate(self.motion):
                if k == 0 and self.is_open:
                    continue
                for order, most in enumerate(limits):
                    pairs = zip(self.motion[k - 1][order], orders[order], strict=True)
                    jumps = [abs(before(1) - after(0)) for before, after in pairs]
                    positive += [fmpq_poly([exact(most) - jump]) for jump in jumps]
            return [[q] for q in positive]
        for orders in self.motion:
            curves = orders[DERIVATIVES[name]]
            rows = zip(curves, claim["at_least"], claim["at_most"], strict=True)
            for q, low, high in rows:
                positive += [q - exact(low), exact(high) - q]
        return [[q] for q in positive]


def stated_axes(vehicle: dict[str, Any], name: str) -> list[Any] | None:
    axes = vehicle.get(name)
    return axes and [list(map(exact, axis)) for axis in axes]


def dotted(a: Any, b: Any) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def unit(vector: Any) -> list[Any]:
    length = arb(dotted(vector, vector)).sqrt()
    return [arb(part) / length for part in vector]


def crossed(a: Any, b: Any) -> Any:
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def in_space(it: Certificate, alpha: list[Any]) -> tuple[list[Any], list[Any]]:
    """Return the directions of the thrusts, cos α a + sin α e×a, and the torques r×n + σκn."""
    axes, torques = [], []
    for a, (tilt, thrust), place, drag in zip(
        alpha, it.axes, it.places, it.drags, strict=True
    ):
        s, c = a.sin(), a.cos()
        turned = crossed(tilt, thrust)
        n = [c * u + s * v for u, v in zip(thrust, turned, strict=True)]
        axes.append(n)
        arms = crossed(place, n)
        torques.append([arm + drag * part for arm, part in zip(arms, n, strict=True)])
    return axes, torques


def without_torque(torques: list[Any]) -> list[Any]:
    """Return thrusts that make no torque."""
    free = []
    for i in range(4):
        a, b, c = torques[:i] + torques[i + 1 :]
        free.append(dotted(a, crossed(b, c)) * (-1) ** (i + 1))
    return free


def everywhere(holds: Any, piece: Any, low: Any, width: Any, depth: int = 50) -> bool:
    """Return whether something is shown of a piece on all of [low, low + width], halved where that helps."""
    if holds(piece, low, width):
        return True
    halves = (low, low + width / 2)
    return depth > 0 and all(
        everywhere(holds, piece, x, width / 2, depth - 1) for x in halves
    )


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
    axes, torques = in_space(it, alpha)
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
    free = without_torque(torques)
    x, y, z = (sum(u * n[j] for u, n in zip(free, axes, strict=True)) for j in range(3))
    if name == "sign_of_R":
        return [z * it.sign * {"positive": 1, "negative": -1}[claim["sign"]]]
    if name == "hover_thrust":
        return [side for u in free for side in (u / z - bounds[0], bounds[1] - u / z)]
    s, c = bounds[0].sin_cos()
    return [z * z * c * c - (x * x + y * y) * s * s]


def is_true(it: Certificate, name: str) -> bool:
    """Decide by Taylor polynomials about the middle, with the remainder's coefficient on the whole interval."""

    def holds(piece: list[list[Any]], low: Any, width: Any) -> bool:
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


def is_false_at_samples(it: Certificate, name: str) -> bool:
    """Return whether a claim is false at one of evenly spaced points of a piece, in 128 bits."""
    points = [fmpq(i, 20) for i in range(21)]
    for piece in it.polynomials(name):
        for x in points:
            if any(
                value < 0 for value in in_balls(it, name, [arb(q(x)) for q in piece])
            ):
                return True
    return False


# -- Random gaits


FORMS = ("smooth", "constant-speed", "equal-time", "untimed", "rows", "paced")


def random_gait(seed: int) -> Any:
    """Return a flyable gait of a random vehicle in one of the forms."""
    random, form = np.random.default_rng(seed), FORMS[seed % len(FORMS)]
    while True:
        steps = random.uniform(-0.5, 0.5, (int(random.integers(3, 7)), 2))
        rate = random.uniform(20, 60, 4).tolist()
        kind = symmetric_vehicle if seed % 2 else random_vehicle
        vehicle = kind(random).replace(
            min_tilt=random.uniform(-2, -0.8, 4).tolist(),
            max_tilt=random.uniform(0.8, 2, 4).tolist(),
            max_tilt_rate=rate,
        )
        points = random.uniform(-0.95, 0.95, 2) + steps
        gait = lift(points, "red", vehicle=vehicle, coefficients="exact")
        made: Any = gait
        if form == "paced":
            limits = Limits(rate=50.0, acceleration=2000.0)
            made = paced(gait, limits, period=9.0, nodes=40).timed
        elif form == "rows":
            made = table_of(gait.parametrize(2.0, samples=12))
        elif form != "untimed":
            law: Any = form
            made = gait.parametrize(float(random.uniform(0.2, 9)), law=law, samples=12)
        if validate(made).flyable:
            return made


def certified(seed: int) -> str:
    """Return a random gait's certificate, after the checker and the witness have proved it of that gait's curve."""
    gait = random_gait(seed)
    text = certify(gait, tilt="5deg" if seed % 3 == 0 else None).text
    it, places = Certificate(text), check.check(text)["claims"]
    assert not any(places.values())
    for name in places:
        assert is_true(it, name), name
    if hasattr(gait, "at"):
        durations = np.array([float(Fraction(str(d))) for d in it.durations])
        times = durations.cumsum() - 0.7 * durations
        share = exact("0.3")
        curve = [[float(arb(q(share))) for q in orders[0]] for orders in it.motion]
        np.testing.assert_allclose(gait.at(times).alpha, curve, rtol=0, atol=1e-11)
    return text


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(18))  # each form, tilted and level
def test_checker_and_witness_prove_certificates_of_random_gaits(seed: int) -> None:
    certified(seed)


# -- Changed certificates


OTHERS: list[Any] = [0, 0.5, math.nan, True, None, [], {}, [[]], "", "0", "-1", "1e400"]
OTHERS += ["NaN", "1\n", "9" * 40, "9" * 5000, "1/0", "٣", " 1", "negative"]


def changed_at_random(node: Any, chance: random.Random) -> Any:
    """Return JSON with one change somewhere, most often another number close by."""
    if isinstance(node, dict) and node:
        key = chance.choice(list(node))
        if chance.random() < 0.05:
            return {name: value for name, value in node.items() if name != key}
        return {**node, key: changed_at_random(node[key], chance)}
    if isinstance(node, list) and node:
        k = chance.randrange(len(node))
        if chance.random() < 0.05:
            return chance.choice([node[:k], node[::-1], [*node, node[k]]])
        return [*node[:k], changed_at_random(node[k], chance), *node[k + 1 :]]
    try:
        number = Fraction(node)
    except (ArithmeticError, TypeError, ValueError):
        return chance.choice(OTHERS)
    if chance.random() < 0.05:
        return chance.choice(OTHERS)
    close = 1 + Fraction(chance.choice([-1, 1]), 10 ** chance.randrange(1, 16))
    factor = chance.choice([close, close, close, Fraction(-1), Fraction(10)])
    return str(number * factor)


def changed_text(text: str, chance: random.Random) -> str:
    """Return a certificate with some of the claims, moved, and with some changes."""
    document = json.loads(text)
    for name in document["claims"].keys() - {"joints"}:
        if chance.random() < 0.5:
            del document["claims"][name]
    for k in range(chance.randrange(3)):  # a closed curve, elsewhere
        shift = Fraction(chance.randrange(-100, 100), 10 ** chance.randrange(2, 9))
        for piece in document["pieces"]:
            piece["alpha"][k][0] = str(Fraction(piece["alpha"][k][0]) + shift)
    for _ in range(chance.choice([0, 1, 1, 2, 3])):
        part = chance.choice(["vehicle", "pieces", "claims", "claims"])
        document[part] = changed_at_random(document[part], chance)
    return json.dumps(document)


def verdict_of(text: str) -> str:
    """Return what the checker says, after a look at whether what it has proved is true."""
    try:
        places = check.check(text)["claims"]
    except (ValueError, RecursionError) as error:
        assert "\n" not in str(error)
        return "refused"
    it = Certificate(text)
    for name, place in places.items():
        assert place or not is_false_at_samples(it, name), text
    return "not proved" if any(places.values()) else "proved"


def text_of_own_axes() -> str:
    return certify(small_gait(LEANING), tilt="5deg").text


def test_the_witness_proves_a_certificate_of_axes_and_spins_of_their_own() -> None:
    it = Certificate(text_of_own_axes())
    for name in it.claims:
        assert is_true(it, name), name


@pytest.mark.slow
def test_no_false_claim_of_a_changed_certificate_is_proved() -> None:
    chance, texts = random.Random(17), [certified(seed) for seed in (0, 1, 3, 4, 12)]
    texts += [text_of_own_axes()] * 2
    verdicts = [
        verdict_of(changed_text(chance.choice(texts), chance)) for _ in range(600)
    ]
    for verdict in ("refused", "not proved", "proved"):
        assert verdicts.count(verdict) > 40


def test_limits_of_jumps_are_known_by_their_names() -> None:
    gait = lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red")
    document = json.loads(certify(gait.parametrize(law="equal-time")).text)
    document["claims"] = {"joints": {"acceleration_jump": "99", "rate_jump": "0"}}
    text = json.dumps(document)
    assert check.check(text)["claims"]["joints"]
    assert is_false_at_samples(Certificate(text), "joints")
