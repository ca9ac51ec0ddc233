"""Every colouring of a loop: against brute force, counted without listing, refused with the pair that forbids it."""

from __future__ import annotations

import itertools
import json
import math
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.surface.loop_colorings import (
    MOST_LISTED,
    Coloring,
    ColoringObstacle,
)
from gaitgraph.surface.sheets import SIGNS, text_from_types, types_from_text
from tests.published import GAITS, PublishedGait

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gaitgraph.surface.sheets import Sign

G1, G2, G3, G4 = GAITS
PUBLISHED, EXACT = coefficients_of(kind="published"), coefficients_of(kind="exact")

Point = tuple[float, float]
Loop = list[Point]

# The nodes of the paper's grid at which both types are ?, and one of them whose red and blue roots both have R < 0.
UNKNOWN = [(a, b) for a in (pi / 16, -7 * pi / 16) for b in (-pi / 16, 7 * pi / 16)]
MEETING = (pi / 16, -pi / 16)
BOTH = (pi / 8, -pi / 8)  # of fixed types, with both colors for R < 0

# Points of fixed types with one color only for R < 0.
RED_ONLY = (
    -1.55,
    0.0,
)  # left of α1 = δ − π/2, where blue comes back shifted by π with R > 0
BLUE_ONLY = (-pi / 8, pi / 8)

# A loop with one (?,?), two points of fixed types, and one (?,·); all with both colors for R < 0.
RICH = [MEETING, BOTH, (3 * pi / 16, -pi / 8), (pi / 16, -3 * pi / 8)]

_near = st.floats(-0.11, 0.11)  # both sides of π/32, the default tolerance
_first = st.one_of(
    st.sampled_from([pi / 16, -7 * pi / 16]),
    st.integers(-8, 8).map(
        lambda k: k * pi / 16
    ),  # sides and corners of the square too
    _near.map(lambda x: PUBLISHED.delta + x),
    _near.map(lambda x: max(PUBLISHED.delta - pi / 2 + x, -pi / 2)),
    st.floats(-pi / 2, pi / 2),
)
_second = _first.map(lambda x: -x)  # the crossing lines of α4 are those of α3, mirrored
points = st.one_of(
    st.sampled_from([*UNKNOWN, RED_ONLY, BLUE_ONLY, *RICH]), st.tuples(_first, _second)
)
loops = st.lists(points, min_size=1, max_size=7)
either_kind = st.sampled_from([PUBLISHED, EXACT])


def offers(
    loop: Sequence[Point],
    sign: str,
    coefficients: gg.Coefficients,
    tolerance: float = pi / 32,
) -> list[Any]:
    """Return, for each point, the colors of its roots with a sign of R, red first, with their types, as texts."""
    plane = np.array(loop, dtype=float)
    roots = gg.surface.root_arrays(
        plane[:, 0],
        plane[:, 1],
        coefficients=coefficients,
        crossing_tolerance=tolerance,
    )
    wanted = -1.0 if sign == "negative" else 1.0
    out = []
    for k in range(len(plane)):
        found: dict[str, str] = {}
        for m in range(roots.count[k]):
            color = "red" if roots.sheet[k, m] > 0 else "blue"
            real = color == "red" or coefficients.kind == "published"
            if real and wanted * roots.R[k, m] > noise_of(coefficients):
                found[color] = text_from_types(*roots.types[k, m])
        out.append({color: found[color] for color in ("red", "blue") if color in found})
    return out


def brute(
    choices: Sequence[dict[str, str]], *, closed: bool = True
) -> list[tuple[str, ...]]:
    """Return every choice of colors of which no neighbours have + and − for one angle, in lexicographic order."""
    out = []
    for colors in itertools.product(*choices):
        types = [choice[color] for choice, color in zip(choices, colors, strict=True)]
        pairs = [
            *itertools.pairwise(types),
            *([(types[-1], types[0])] if closed else []),
        ]
        if not any(
            {pair[0][i], pair[1][i]} == {"+", "-"} for pair in pairs for i in (1, 3)
        ):
            out.append(colors)
    return out


@pytest.mark.parametrize(
    ("gait", "expected"),
    [
        (G1, [("negative", "blue")]),
        (G2, [("negative", "red"), ("negative", "blue")]),
        (G3, [("negative", "red"), ("negative", "blue")]),
        (G4, [("positive", "red")]),
    ],
    ids=lambda value: f"gait{value.number}" if isinstance(value, PublishedGait) else "",
)
def test_the_loops_of_the_papers_gaits(
    gait: PublishedGait, expected: list[tuple[Sign, str]]
) -> None:
    found = gg.colorings(gait.angles)
    assert [(one.sign, set(one.colors)) for one in found] == [
        (sign, {color}) for sign, color in expected
    ]
    assert found.count == len(expected)
    assert (gait.sign, gait.color) in expected
    assert set(found.obstacles) == set(SIGNS) - {sign for sign, _ in expected}
    assert found
    # In exact physics blue has R = 0, so red remains.
    exact = gg.colorings(
        [[*pair, 9.0, 9.0] for pair in gait.angles], coefficients=EXACT
    )  # two angles count
    assert [(one.sign, set(one.colors)) for one in exact] == [
        (s, {c}) for s, c in expected if c == "red"
    ]
    for one in found:
        lifted = gg.lift(gait.angles, one.colors)
        assert gg.validate(lifted).two_color


@settings(deadline=None, max_examples=60)
@given(
    loop=loops,
    coefficients=either_kind,
    tolerance=st.sampled_from([pi / 32, pi / 32, 0.0, 0.3, pi / 4]),
)
def test_the_same_list_in_the_same_order_as_brute_force(
    loop: Loop, coefficients: gg.Coefficients, tolerance: float
) -> None:
    found = gg.colorings(loop, coefficients=coefficients, crossing_tolerance=tolerance)
    whole = []
    for sign in SIGNS:
        choices = offers(loop, sign, coefficients, tolerance)
        expected = brute(choices)
        assert [one.colors for one in found.of(sign)] == expected
        assert found.counts[sign] == len(expected)
        assert (sign in found.obstacles) == (not expected)
        whole += [Coloring(colors=colors, sign=sign) for colors in expected]
        # No angle is further than π/4 from a multiple of π/2: then all types are ? and every choice is allowed.
        assert tolerance < pi / 4 or found.counts[sign] == math.prod(map(len, choices))
        alone = gg.colorings(
            loop, sign=sign, coefficients=coefficients, crossing_tolerance=tolerance
        )
        assert [one.colors for one in alone] == expected
        assert set(alone.counts) == {sign}
    assert list(found) == whole
    assert list(found) == whole  # every iteration starts anew
    assert found.count == len(whole)
    assert bool(found) == bool(whole)


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("pattern", "free"),
    [
        ([MEETING], 1),  # one free choice for each point
        ([MEETING, BOTH], 2),  # a point of fixed type is free between two (?,?)
        (
            [MEETING, BOTH, (3 * pi / 16, -pi / 8)],
            2,
        ),  # two neighbours of fixed type share their color
        (
            [(pi / 16, -3 * pi / 8), (pi / 8, -pi / 16)],
            2,
        ),  # (+,?) beside (?,-): each angle has its own ?
    ],
)
def test_thousands_of_points_are_counted_exactly_and_listed_lazily(
    pattern: Loop, free: int
) -> None:
    repeat = 10_000 // len(pattern)
    found = gg.colorings(pattern * repeat, sign="negative")
    assert found.count == 2 ** (free * repeat)
    first, second = itertools.islice(found, 2)
    assert set(first.colors) == {"red"}
    assert second.colors[-1] == "blue"  # the last free choice changes first
    assert second.colors.count("blue") <= len(pattern)


@pytest.mark.parametrize("n", [13_287, 13_288])
def test_a_count_of_more_than_4000_digits_is_given_by_its_logarithm(n: int) -> None:
    assert int(4000 / math.log10(2)) == 13_287
    found = gg.colorings([MEETING] * n, sign="negative")
    assert found.count == 2**n
    assert len(found.first) == MOST_LISTED
    mapping = json.loads(json.dumps(found.as_mapping(), allow_nan=False))
    if n == 13_287:
        assert mapping["colorings_count"] == 2**n
    else:
        assert mapping["colorings_count"] is None
        assert mapping["colorings_count_log10"] == pytest.approx(
            n * math.log10(2), abs=1e-6
        )
    text = str(2**n) if n == 13_287 else f"about 10^{n * math.log10(2):.0f}"
    assert str(found) == f"{text} colourings of a loop of {n} points"
    jump = "(those that change color jump between the sheets)"
    assert found.in_report == f"{text} with R < 0, all red or all blue {jump}"


def check_obstacle(
    loop: Loop, sign: Sign, obstacle: ColoringObstacle, coefficients: gg.Coefficients
) -> None:
    """Check an obstacle by brute force, and that there is none before it."""
    choices = offers(loop, sign, coefficients)
    relation = "R < 0" if sign == "negative" else "R > 0"
    if obstacle.kind == "point":
        (number,) = obstacle.points
        assert choices[number - 1] == {}
        assert obstacle.types == ()
        assert (
            obstacle.message
            == f"point {number} has no root with {relation}, neither red nor blue"
        )
        assert number == 1 or brute(choices[: number - 1], closed=False)
        return
    first, second = obstacle.points
    assert not gg.surface.types_may_be_adjacent(*obstacle.types)
    before = brute(choices[:first], closed=False)
    assert before
    if second == 1:
        assert first == len(loop)
        ends = {(colors[-1], colors[0]) for colors in before}
    else:
        assert second == first + 1
        assert brute(choices[:second], closed=False) == []
        ends = {
            (colors[-1], after) for colors in before for after in choices[second - 1]
        }
    types = {
        (choices[first - 1][end], choices[second - 1][after]) for end, after in ends
    }
    assert types == {obstacle.types}  # nothing else can stand there
    ((end, other),) = ends
    assert (
        f"points {first} {obstacle.types[0]} and {second} {obstacle.types[1]} may not be"
        in obstacle.message
    )
    assert (
        f"{relation} the first can only be {end}, the second only {other}, and by Figure 15"
        in obstacle.message
    )
    for k in range(2):
        breaks = np.prod([types_from_text(text)[k] for text in obstacle.types]) < 0
        assert (f"α{k + 3}" in obstacle.message) == breaks


@settings(deadline=None, max_examples=60)
@given(loop=loops, coefficients=st.sampled_from([PUBLISHED, PUBLISHED, EXACT]))
def test_an_obstacle_is_the_true_one(loop: Loop, coefficients: gg.Coefficients) -> None:
    for sign, obstacle in gg.colorings(
        loop, coefficients=coefficients
    ).obstacles.items():
        check_obstacle(loop, sign, obstacle, coefficients)


NOTHING = (-3 * pi / 8, 3 * pi / 8)  # without a root with R < 0


@pytest.mark.parametrize(
    ("loop", "expected"),
    [
        ([RED_ONLY, BLUE_ONLY], (1, 2)),
        ([RED_ONLY, (0.0, -pi / 16)], (1, 2)),  # (+,+) and (-,?): α3 alone forbids it
        ([RED_ONLY, MEETING, BLUE_ONLY], (3, 1)),  # over (?,?) there, and no path back
        (
            [BOTH, BLUE_ONLY, MEETING, RED_ONLY],
            (4, 1),
        ),  # the second point forces the color of the first
        (
            [BLUE_ONLY, BOTH, (3 * pi / 16, -pi / 8), RED_ONLY],
            (3, 4),
        ),  # blue is carried along
        ([RED_ONLY, RED_ONLY, NOTHING, BLUE_ONLY], (3,)),
        ([NOTHING, NOTHING, RED_ONLY, BLUE_ONLY], (1,)),
    ],
)
def test_the_first_obstacle(loop: Loop, expected: tuple[int, ...]) -> None:
    found = gg.colorings(loop, sign="negative")
    obstacle = found.obstacles["negative"]
    assert obstacle.points == expected
    check_obstacle(loop, "negative", obstacle, PUBLISHED)
    text = f"0 colourings of a loop of {len(loop)} points\n  R < 0  none: {obstacle.message}"
    assert (str(found), found.in_report, found.count) == (
        text,
        f"none: {obstacle.message}",
        0,
    )


def test_colourings_in_words() -> None:
    assert str(Coloring(colors=("blue",) * 3, sign="positive")) == "R > 0  all blue"
    mixed = Coloring(colors=("red", "red", "blue", "red"), sign="negative")
    assert str(mixed) == "R < 0  red 1 to 2, blue 3, red 4 (jumps between the sheets)"
    assert (
        str(gg.colorings([MEETING], sign="negative", coefficients=EXACT))
        == "1 colouring of a loop of 1 point"
    )
    assert gg.colorings(G3.angles).in_report == "2 with R < 0, all red or all blue"
    mapping = gg.colorings(G3.angles).as_mapping()
    assert (mapping["colorings_count"], mapping["counts"]) == (
        2,
        {"negative": 2, "positive": 0},
    )
    assert set(mapping["coloring_obstacles"]) == {"positive"}
    only = gg.colorings([RED_ONLY, MEETING, BLUE_ONLY, MEETING], sign="negative")
    assert (
        only.in_report
        == "4 with R < 0 (those that change color jump between the sheets)"
    )
