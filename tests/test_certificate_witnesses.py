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

from gaitgraph.certificates import certify, check
from gaitgraph.gait.gait import lift
from gaitgraph.timing.limits import Limits
from gaitgraph.timing.time_optimal import paced
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.validation.validating import validate
from tests.samples import random_vehicle

witness = pytest.importorskip(
    "tests.certificate_witnesses",
    reason="install python-flint, of the extra 'dev'",
)

FORMS = ("smooth", "constant-speed", "smooth", "equal-time", "untimed", "rows", "paced")
OTHERS: list[Any] = [
    0,
    0.5,
    math.nan,
    math.inf,
    True,
    None,
    [],
    {},
    [[]],
    "",
    "0",
    "1",
    "-1",
    "1e400",
    "NaN",
    "1\n",
]
OTHERS += [
    "9" * 40,
    "9" * 5000,
    "0." + "9" * 60,
    "1/0",
    "٣",
    " 1",
    "a\nb",
    "negative",
    "counterclockwise",
]


def random_gait(seed: int) -> Any:
    """Return a flyable gait of a random vehicle in one of the forms."""
    numbers, form = np.random.default_rng(seed), FORMS[seed % len(FORMS)]
    made: Any = None
    while made is None or not validate(made).flyable:
        points = numbers.uniform(-0.95, 0.95, 2) + numbers.uniform(
            -0.5, 0.5, (int(numbers.integers(3, 7)), 2)
        )
        least, most, rate = (
            numbers.uniform(low, high, 4).tolist()
            for low, high in ((-2, -0.8), (0.8, 2), (20, 60))
        )
        raised = {
            "arm_length": 0.2,
            "rotor_height": float(
                numbers.choice([0.0, *numbers.uniform(-0.3, 0.3, 3)])
            ),
        }
        vehicle = random_vehicle(numbers).replace(
            **raised, min_tilt=least, max_tilt=most, max_tilt_rate=rate
        )
        made = gait = lift(points, "red", vehicle=vehicle, coefficients="exact")
        period, limits = (
            float(numbers.uniform(0.2, 9)),
            Limits(rate=50.0, acceleration=2000.0),
        )
        if form == "paced":
            made = paced(gait, limits, period=period, nodes=40).timed
        elif form != "untimed":
            law: Any = "smooth" if form == "rows" else form
            timed = gait.parametrize(period, law=law, samples=12)
            made = table_of(timed) if form == "rows" else timed
    return made


def certified(seed: int) -> str:
    """Return a random gait's certificate, after the checker and both witnesses have proved it of that gait's curve."""
    gait = random_gait(seed)
    text = certify(gait, tilt="5deg" if seed % 3 == 0 else None).text
    it, found = witness.Certificate(text), check.check(text)["claims"]
    assert it.equal
    assert not any(found.values())
    assert all(
        witness.proved_by_balls(it, name) and witness.proved_by_intervals(it, name)
        for name in found
    )
    if hasattr(gait, "at"):
        durations = np.array([float(witness.arb(d)) for d in it.durations])
        s = witness.exact("0.3")
        curve = [
            [float(witness.arb(angle(s))) for angle in piece] for piece in it.pieces
        ]
        assert np.allclose(
            gait.at(durations.cumsum() - 0.7 * durations).alpha,
            curve,
            rtol=0,
            atol=1e-11,
        )
    return text


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(21))  # each form, tilted and level
def test_checker_and_both_witnesses_prove_certificates_of_random_gaits(
    seed: int,
) -> None:
    certified(seed)


def changed(node: Any, chance: random.Random) -> Any:
    """Return JSON with one change somewhere, most often another number close by."""
    if not isinstance(node, (dict, list)) or not node or chance.random() < 0.02:
        if (
            not re.fullmatch(r"-?\d{1,99}(\.\d+|/[1-9]\d*)?", str(node))
            or chance.random() < 0.05
        ):
            return chance.choice(OTHERS)
        close = 1 + Fraction(chance.choice([-1, 1]), 10 ** chance.randrange(1, 16))
        number = Fraction(node) * chance.choice(
            [close, close, close, Fraction(-1), Fraction(10), Fraction(1, 10)]
        )
        return chance.choice([str(number), f"{float(number):.20f}"])
    pairs = list(node.items()) if isinstance(node, dict) else list(enumerate(node))
    i, j = chance.randrange(len(pairs)), chance.randrange(len(pairs))
    before, (key, one), after = pairs[:i], pairs[i], pairs[i + 1 :]
    if chance.random() < 0.88:
        pairs = [*before, (key, changed(one, chance)), *after]
    else:  # lost, renamed, doubled, replaced by another, reversed
        others: list[Any] = [
            [],
            [(f"{key} ", one)],
            [(key, one), (key, one)],
            [(key, pairs[j][1])],
        ]
        pairs = chance.choice(
            [*([*before, *other, *after] for other in others), pairs[::-1]]
        )
    return dict(pairs) if isinstance(node, dict) else [one for _, one in pairs]


def mutated(text: str, chance: random.Random) -> str:
    """Return a certificate of some of the claims, with some changes to its values or its text."""
    document = json.loads(text)
    for name in chance.sample(
        sorted({*document["claims"]} - {"joints"}),
        chance.randrange(len(document["claims"])),
    ):
        del document["claims"][name]
    for k in range(chance.randrange(3)):  # a closed curve, elsewhere
        shift = Fraction(chance.randrange(-100, 100), 10 ** chance.randrange(2, 9))
        for piece in document["pieces"]:
            piece["alpha"][k][0] = str(Fraction(piece["alpha"][k][0]) + shift)
    for _ in range(chance.choice([0, 1, 1, 2, 3])):
        part = chance.choice(["vehicle", "pieces", "pieces", "claims", "claims", ""])
        inside = isinstance(document, dict) and part in document
        document = (
            {**document, part: changed(document[part], chance)}
            if inside
            else changed(document, chance)
        )
    text = json.dumps(document)
    for _ in range(chance.choice([0, 0, 0, 0, 0, 0, 1, 2])):
        i, j = sorted(chance.randrange(len(text) + 1) for _ in range(2))
        text = chance.choice(
            [
                text[:i],
                text[:i] + text[j:],
                text[:j] + text[i:],
                text[:i] + '0"[{,'[j % 5] + text[i:],
            ]
        )
    return text


def judged(text: str) -> str:
    """Return what the checker says, after a look at whether what it has proved is true."""
    try:
        found = check.check(text)["claims"]
    except (ValueError, RecursionError) as error:
        assert "\n" not in str(error)
        return "refused"
    it = witness.Certificate(text)
    assert not any(
        witness.false_at_samples(it, name, 20) for name in found if not found[name]
    ), text
    return "not proved" if any(found.values()) else "proved"


@pytest.mark.slow
def test_no_false_claim_of_a_changed_certificate_is_proved() -> None:
    chance, texts = random.Random(17), [certified(seed) for seed in (0, 1, 3, 4, 12)]
    seen = [judged(mutated(chance.choice(texts), chance)) for _ in range(600)]
    assert (
        min(seen.count(verdict) for verdict in ("refused", "not proved", "proved")) > 40
    )


def test_limits_of_jumps_are_known_by_their_names() -> None:
    text = certify(
        lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red").parametrize(
            law="equal-time"
        )
    ).text
    text = json.dumps(
        {
            **json.loads(text),
            "claims": {"joints": {"acceleration_jump": "99", "rate_jump": "0"}},
        }
    )
    assert check.check(text)["claims"]["joints"]
    assert witness.false_at_samples(witness.Certificate(text), "joints", 2)
