"""Every colouring of a loop: against brute force, counted without listing, refused with the pair that forbids it."""

from __future__ import annotations

import itertools
import json
import math
from math import pi
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.surface.loop_colorings import Coloring
from gaitgraph.surface.sheets import SIGNS, roots
from tests.published import GAITS
from tests.samples import EXACT, PUBLISHED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.surface.sheets import Sign

STEP = pi / 16
# The nodes of the paper's grid at which both types are ?, and one of them whose red and blue roots both have R < 0.
UNKNOWN = [(a, b) for a in (STEP, -7 * STEP) for b in (-STEP, 7 * STEP)]
MEETING = (STEP, -STEP)
BOTH = (2 * STEP, -2 * STEP)  # of fixed types, with both colors for R < 0
BESIDE = (3 * STEP, -2 * STEP)  # the same
# Points of fixed types with one color only for R < 0: left of α1 = δ − π/2 blue comes back shifted by π with R > 0.
RED_ONLY, BLUE_ONLY = (-1.55, 0.0), (-2 * STEP, 2 * STEP)
NOTHING = (-6 * STEP, 6 * STEP)  # without a root with R < 0
THIRD_UNKNOWN, FOURTH_UNKNOWN = (STEP, -6 * STEP), (2 * STEP, -STEP)

_near = st.floats(-0.11, 0.11)  # both sides of π/32, the default tolerance
_first = st.one_of(
    st.integers(-8, 8).map(lambda k: k * STEP),  # sides and corners of the square too
    _near.map(lambda x: PUBLISHED.delta + x),
    _near.map(lambda x: max(PUBLISHED.delta - pi / 2 + x, -pi / 2)),
    st.floats(-pi / 2, pi / 2),
)
# The crossing lines of α4 are those of α3, mirrored.
points = st.one_of(
    st.sampled_from([*UNKNOWN, RED_ONLY, BLUE_ONLY, BOTH, BESIDE, THIRD_UNKNOWN]),
    st.tuples(_first, _first.map(lambda x: -x)),
)
loops = st.lists(points, min_size=1, max_size=7)


def offers(
    loop: Any, sign: str, numbers: gg.Coefficients, tolerance: float = pi / 32
) -> list[dict[Any, str]]:
    """Return, for each point, the colors of its roots with a sign of R, red first, with their types."""
    wanted = -1.0 if sign == "negative" else 1.0
    choices: list[dict[Any, str]] = []
    for point in loop:
        of_color: dict[Any, str] = {}
        for root in roots(*point, coefficients=numbers, crossing_tolerance=tolerance):
            is_real = root.color == "red" or numbers.kind == "published"
            if is_real and wanted * root.R > noise_of(numbers):
                of_color[root.color] = root.types
        choices.append({c: of_color[c] for c in ("red", "blue") if c in of_color})
    return choices


def brute(choices: Sequence[dict[Any, str]], *, closed: bool = True) -> list[Any]:
    """Return every choice of colors of which no neighbours have + and − for one angle, in lexicographic order."""
    allowed = []
    for colors in itertools.product(*choices):
        types = [choice[color] for choice, color in zip(choices, colors, strict=True)]
        pairs = list(itertools.pairwise(types))
        if closed:
            pairs.append((types[-1], types[0]))
        if not any({a[i], b[i]} == {"+", "-"} for a, b in pairs for i in (1, 3)):
            allowed.append(colors)
    return allowed


@settings(deadline=None, max_examples=60)
@given(
    loop=loops,
    numbers=st.sampled_from([PUBLISHED, EXACT]),
    tolerance=st.sampled_from([pi / 32, pi / 32, 0.0, 0.3, pi / 4]),
)
def test_the_same_list_in_the_same_order_as_brute_force(
    loop: Any, numbers: gg.Coefficients, tolerance: float
) -> None:
    options: Any = {"coefficients": numbers, "crossing_tolerance": tolerance}
    listing = gg.colorings(loop, **options)
    whole = []
    for sign in SIGNS:
        expected = brute(offers(loop, sign, numbers, tolerance))
        assert [coloring.colors for coloring in listing.of(sign)] == expected
        assert listing.counts[sign] == len(expected)
        assert (sign in listing.refusals) == (not expected)
        whole += [Coloring(colors=colors, sign=sign) for colors in expected]
        alone = gg.colorings(loop, sign=sign, **options)
        assert [coloring.colors for coloring in alone] == expected
        assert set(alone.counts) == {sign}
    assert list(listing) == list(listing) == whole  # every iteration starts anew
    assert listing.count == len(whole)
    assert bool(listing) == bool(whole)


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("pattern", "free"),
    [
        ([MEETING], 1),  # one free choice for each point
        ([MEETING, BOTH], 2),  # a point of fixed type is free between two (?,?)
        ([MEETING, BOTH, BESIDE], 2),  # neighbours of fixed type share their color
        ([THIRD_UNKNOWN, FOURTH_UNKNOWN], 2),  # each angle has its own ?
    ],
)
def test_thousands_of_points_are_counted_exactly_and_listed_lazily(
    pattern: Any, free: int
) -> None:
    repeat = 10_000 // len(pattern)
    listing = gg.colorings(pattern * repeat, sign="negative")
    assert listing.count == 2 ** (free * repeat)
    first, second = itertools.islice(listing, 2)
    assert set(first.colors) == {"red"}
    assert second.colors[-1] == "blue"  # the last free choice changes first
    assert second.colors.count("blue") <= len(pattern)


@pytest.mark.parametrize("n", [13_287, 13_288])
def test_a_count_of_more_than_4000_digits_is_given_by_its_logarithm(n: int) -> None:
    listing = gg.colorings([MEETING] * n, sign="negative")
    assert listing.count == 2**n
    mapping = json.loads(json.dumps(listing.as_mapping(), allow_nan=False))
    digits = n * math.log10(2)
    text = str(2**n)
    if digits < 4000:
        assert mapping["colorings_count"] == 2**n
    else:
        assert mapping["colorings_count"] is None
        assert mapping["colorings_count_log10"] == pytest.approx(digits, abs=1e-6)
        text = f"about 10^{digits:.0f}"
    assert str(listing) == f"{text} colourings of a loop of {n} points"


# What forbids a colouring


def check_refusal(loop: Any, sign: Sign, refusal: Any, numbers: Any) -> None:
    """Check a refusal by brute force, and that there is none before it."""
    choices = offers(loop, sign, numbers)
    if refusal.kind == "point":
        (number,) = refusal.points
        assert choices[number - 1] == {}
        assert number == 1 or brute(choices[: number - 1], closed=False)
        assert f"point {number} has no root" in refusal.message
        return
    first, second = refusal.points
    before = brute(choices[:first], closed=False)
    assert before
    if second == 1:
        assert first == len(loop)
        ends = {(colors[-1], colors[0]) for colors in before}
    else:
        assert second == first + 1
        assert brute(choices[:second], closed=False) == []
        ends = {(colors[-1], c) for colors in before for c in choices[second - 1]}
    ((end, other),) = ends  # nothing else can stand there
    types = choices[first - 1][end], choices[second - 1][other]
    assert refusal.types == types
    assert f"points {first} {types[0]} and {second} {types[1]} " in refusal.message
    for k in (1, 3):
        breaks = {types[0][k], types[1][k]} == {"+", "-"}
        assert (f"α{3 + k // 2}" in refusal.message) == breaks


@settings(deadline=None, max_examples=60)
@given(loop=loops, numbers=st.sampled_from([PUBLISHED, EXACT]))
def test_an_refusal_is_the_true_one(loop: Any, numbers: Any) -> None:
    refusals = gg.colorings(loop, coefficients=numbers).refusals
    for sign, refusal in refusals.items():
        check_refusal(loop, sign, refusal, numbers)


@pytest.mark.parametrize(
    ("loop", "expected"),
    [
        ([RED_ONLY, BLUE_ONLY], (1, 2)),
        ([RED_ONLY, (0.0, -STEP)], (1, 2)),  # (+,+) and (-,?): α3 alone forbids it
        ([RED_ONLY, MEETING, BLUE_ONLY], (3, 1)),  # over (?,?) there, no path back
        # The second point forces the color of the first.
        ([BOTH, BLUE_ONLY, MEETING, RED_ONLY], (4, 1)),
        ([BLUE_ONLY, BOTH, BESIDE, RED_ONLY], (3, 4)),  # blue is carried along
        ([RED_ONLY, RED_ONLY, NOTHING, BLUE_ONLY], (3,)),
        ([NOTHING, NOTHING, RED_ONLY, BLUE_ONLY], (1,)),
    ],
)
def test_the_first_refusal(loop: Any, expected: tuple[int, ...]) -> None:
    listing = gg.colorings(loop, sign="negative")
    refusal = listing.refusals["negative"]
    assert refusal.points == expected
    check_refusal(loop, "negative", refusal, PUBLISHED)
    assert str(listing).endswith(f"\n  R < 0  none: {refusal.message}")
    assert listing.in_report == f"none: {refusal.message}"


def test_colourings_in_words() -> None:
    assert str(Coloring(colors=("blue",) * 3, sign="positive")) == "R > 0  all blue"
    mixed = Coloring(colors=("red", "red", "blue", "red"), sign="negative")
    assert str(mixed) == "R < 0  red 1 to 2, blue 3, red 4 (jumps between the sheets)"
    listing = gg.colorings(GAITS[2].angles)
    assert listing.in_report == "2 with R < 0, all red or all blue"
    mapping = listing.as_mapping()
    assert mapping["counts"] == {"negative": 2, "positive": 0}
    assert set(mapping["coloring_refusals"]) == {"positive"}
    loop = [RED_ONLY, MEETING, BLUE_ONLY, MEETING]
    jumps = "4 with R < 0 (those that change color jump between the sheets)"
    assert gg.colorings(loop, sign="negative").in_report == jumps
