"""Certificates of random gaits, and certificates with random changes, before the checker and two witnesses."""

from __future__ import annotations

import json
import math
import random
import re
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from gaitgraph.certificates import check, certify
from gaitgraph.errors import Infeasible
from gaitgraph.gait.gait import lift
from gaitgraph.timing.curve import rounded
from gaitgraph.timing.time_optimal import Limits, paced
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.validation.validating import validate
from tests.certificate_witnesses import Certificate, doubted_by_balls, false_at_samples, proved_by_intervals
from tests.samples import random_vehicle

FORMS = ("smooth", "constant-speed", "smooth", "equal-time", "untimed", "rows", "paced")
NUMBERS = ["0", "1", "-1", "1/2", "1e400", "NaN", "9" * 40, "9" * 5000, "1/0", "٣", "0." + "9" * 60, "", " 1", "1\n"]
OTHERS = [*NUMBERS, 0, 0.5, math.nan, math.inf, True, None, [], {}, [[]], "negative", "counterclockwise", "a\nb"]


def random_gait(seed: int) -> Any:
    """Return a flyable gait of a random vehicle in one of the forms."""
    form, numbers = "rounded" if seed % 100 == 99 else FORMS[seed % len(FORMS)], np.random.default_rng(seed)
    while True:
        vehicle, count = random_vehicle(numbers), int(numbers.integers(1 if form == "smooth" else 3, 7))
        middle, size = numbers.uniform(-0.95, 0.95, 2), numbers.choice([0.05, 0.3, 0.6])
        gait = lift(middle + numbers.uniform(-size, size, (count, 2)), "red", vehicle=vehicle, coefficients="exact")
        if form == "untimed":
            made: Any = gait
        elif form in ("paced", "rounded"):
            path = rounded(gait, 0.02) if form == "rounded" else gait
            made = paced(path, Limits(rate=50.0, acceleration=2000.0), period=float(numbers.uniform(1, 9)), nodes=40).timed
        else:
            law: Any = "smooth" if form == "rows" else form
            made = gait.parametrize(period=float(numbers.uniform(0.1, 9)), law=law, samples=12)
            made = table_of(made) if form == "rows" else made
        if made is not None and validate(made).flyable:
            return made


def distance(gait: Any, it: Certificate) -> float:
    """Return how far corners or samples of a gait are from the curve of its certificate at the same times."""
    if not hasattr(gait, "at"):
        return 0.0
    ends, times = np.cumsum([0.0, *map(float, it.durations)]), np.linspace(0.0, gait.period, 200, endpoint=False)
    worst = abs(ends[-1] - gait.period)
    for time, alpha in zip(times, gait.at(times)[0], strict=True):
        k = min(int(np.searchsorted(ends, time, side="right")) - 1, len(it.pieces) - 1)
        s = np.polyval([float(c) for c in it.law[::-1]], (time - ends[k]) / float(it.durations[k]))
        worst = max(worst, *(abs(np.polyval([float(c) for c in a[::-1]], s) - x) for a, x in zip(it.pieces[k], alpha, strict=True)))
    return float(worst)


def certified(seed: int) -> str:
    """Return a random gait's certificate, after the checker and both witnesses have proved it."""
    gait = random_gait(seed)
    text = certify(gait, tilt="5deg" if seed % 3 == 0 else None).text()
    assert not [pair for pair in check.check(text) if pair[1]]
    assert not doubted_by_balls(text)
    assert proved_by_intervals(text)
    assert distance(gait, Certificate(text)) < 1e-11
    return text


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(16))
def test_checker_and_both_witnesses_prove_certificates_of_random_gaits(seed: int) -> None:
    certified(seed)


def nudged(number: str, chance: random.Random) -> str:
    """Return another exact number, most often one close by."""
    change = 1 + Fraction(chance.choice([-1, 1]), 10 ** chance.randrange(1, 16))
    value = Fraction(number) * chance.choice([change, change, change, -1, 10, Fraction(1, 10)])
    return chance.choice([f"{value.numerator}/{value.denominator}", f"{float(value):.20f}"])


def changed(node: Any, chance: random.Random) -> Any:
    """Return JSON with one change somewhere."""
    if not isinstance(node, (dict, list)) or not node or chance.random() < 0.02:
        if isinstance(node, str) and re.fullmatch(r"-?\d{1,99}(\.\d+|/[1-9]\d*)?", node) and chance.random() < 0.95:
            return nudged(node, chance)
        return chance.choice(OTHERS)
    pairs = list(node.items()) if isinstance(node, dict) else list(enumerate(node))
    i, j, action = chance.randrange(len(pairs)), chance.randrange(len(pairs)), chance.random()
    (key, one), (_, other) = pairs[i], pairs[j]
    if action < 0.88:
        pairs[i] = key, changed(one, chance)
    elif action < 0.91:
        pairs[i], pairs[j] = pairs[j], pairs[i]  # of an object: its order
    elif action < 0.94:
        pairs[i] = key, other
    elif action < 0.96:
        pairs.insert(j, pairs[i])
    elif action < 0.98:
        del pairs[i]
    else:
        pairs[i] = f"{key} ", one
    return dict(pairs) if isinstance(node, dict) else [one for _, one in pairs]


def mutated(text: str, chance: random.Random) -> str:
    """Return a certificate of some of the claims, with some changes to its values or its text."""
    document = json.loads(text)
    for name in chance.sample(sorted(document["claims"]), chance.randrange(len(document["claims"]))):
        document["claims"].pop(name if name != "joints" else "", None)
    for k in range(chance.randrange(3)):  # a closed curve, elsewhere
        shift = Fraction(chance.randrange(-100, 100), 10 ** chance.randrange(2, 9))
        for piece in document["pieces"]:
            piece["alpha"][k][0] = str(Fraction(piece["alpha"][k][0]) + shift)
    for _ in range(chance.choice([0, 1, 1, 2, 3])):
        part = chance.choice(["vehicle", "law", "pieces", "claims", "claims"]) if chance.random() < 0.8 else ""
        if part and isinstance(document, dict) and part in document:
            document[part] = changed(document[part], chance)
        else:
            document = changed(document, chance)
    text = json.dumps(document)
    for _ in range(chance.choice([0, 0, 0, 0, 0, 0, 0, 1, 2])):
        i, j = sorted(chance.randrange(len(text) + 1) for _ in range(2))
        text = chance.choice([text[:i], text[:i] + text[j:], text[:j] + text[i:], text[:i] + '0"[{,'[j % 5] + text[i:]])
    return text


def judged(text: str, samples: int = 20) -> str:
    """Return "refused", "not proved" or "proved", after a look at whether what is proved is true."""
    try:
        found = check.check(text)
    except (ValueError, RecursionError) as error:
        assert "\n" not in str(error)
        return "refused"
    proved = {name for name, place in found if not place}
    assert not false_at_samples(text, proved, samples), text
    return "proved" if len(proved) == len(found) else "not proved"


@pytest.mark.slow
def test_no_false_claim_of_a_changed_certificate_is_proved() -> None:
    chance, texts = random.Random(17), [certified(seed) for seed in (0, 1, 3, 4, 5)]
    seen = [judged(mutated(chance.choice(texts), chance)) for _ in range(800)]
    assert min(seen.count(verdict) for verdict in ("refused", "not proved", "proved")) > 40


def test_limits_of_jumps_are_known_by_their_names() -> None:
    document = json.loads(certify(lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red").parametrize(law="equal-time")).text())
    document["claims"] = {"joints": {"acceleration_jump": "100", "rate_jump": "0"}}
    assert check.check(json.dumps(document))[0][1]
    assert false_at_samples(json.dumps(document), {"joints"}, 2) == ["joints"]
