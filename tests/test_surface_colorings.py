"""Every colouring of a loop: against brute force, counted without listing, refused with the pair that forbids it."""

from __future__ import annotations

import itertools
import json
import math
import re
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gaitgraph as gg
from gaitgraph.invertibility.matrices import noise_of
from gaitgraph.planning.request import colorings_of_file
from gaitgraph.surface.adjacency import neighbors_allowed, text_from_types, types_from_text
from gaitgraph.surface.loop_colorings import (
    MOST_LISTED,
    Coloring,
    ColoringCount,
    ColoringListing,
    ColoringObstacle,
    color_choices,
)
from gaitgraph.surface.sheets import SIGNS
from tests.published import GAITS, PublishedGait

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from gaitgraph.surface.sheets import Sign

G1, G2, G3, G4 = GAITS
PUBLISHED, EXACT = gg.invertibility.coefficients_of(kind="published"), gg.invertibility.coefficients_of(kind="exact")
MIRRORED = gg.Vehicle(drag_ratio=gg.PAPER.drag_ratio, first_rotor_spin="counterclockwise")

Point = tuple[float, float]
Loop = list[Point]

# The nodes of the paper's grid at which both types are ? (section 8 of theory.md), and those of them whose red and
# blue roots both have R < 0.
UNKNOWN = [(a, b) for a in (pi / 16, -7 * pi / 16) for b in (-pi / 16, 7 * pi / 16)]
MEETING = (pi / 16, -pi / 16)

# Points that can be painted with R < 0 in one color only, both of fixed types.
RED_ONLY = (-1.55, 0.0)  # left of α1 = δ − π/2, where blue comes back shifted by π with R > 0
BLUE_ONLY = (-pi / 8, pi / 8)

# A loop with one (?,?), two points of fixed types, and one (?,·); all with both colors for R < 0.
RICH = [MEETING, (pi / 8, -pi / 8), (3 * pi / 16, -pi / 8), (pi / 16, -3 * pi / 8)]

_near = st.floats(-0.11, 0.11)  # both sides of π/32, the default tolerance
_grid = st.integers(-8, 8).map(lambda k: k * pi / 16)  # sides and corners of the square too
_anywhere = st.floats(-pi / 2, pi / 2)
_first = st.one_of(
    st.sampled_from([pi / 16, -7 * pi / 16]),
    _grid,
    _near.map(lambda x: PUBLISHED.delta + x),
    _near.map(lambda x: max(PUBLISHED.delta - pi / 2 + x, -pi / 2)),
    _anywhere,
)
_second = _first.map(lambda x: -x)  # the crossing lines of α4 are those of α3, mirrored
_node = st.sampled_from([*UNKNOWN, RED_ONLY, BLUE_ONLY, *RICH])
points = st.one_of(_node, st.tuples(_first, _second))
loops = st.lists(points, min_size=1, max_size=7)
either_kind = st.sampled_from([PUBLISHED, EXACT])


def offers(loop: Sequence[Point], sign: str, coefficients: gg.Coefficients, tolerance: float = pi / 32) -> list[Any]:
    """Return, for each point, the colors of its roots with a sign of R, red first, with their types, as texts."""
    plane = np.array(loop, dtype=float)
    roots = gg.surface.root_arrays(plane[:, 0], plane[:, 1], coefficients, crossing_tolerance=tolerance)
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


def first_violation(types: Sequence[str], *, closed: bool = True) -> int | None:
    """Return the first pair of neighbours of which an angle has + and −, written out on the labels."""
    pairs = [*itertools.pairwise(types), *([(types[-1], types[0])] if closed else [])]
    broken = [k for k, pair in enumerate(pairs) if any({pair[0][i], pair[1][i]} == {"+", "-"} for i in (1, 3))]
    return broken[0] if broken else None


def brute(choices: Sequence[dict[str, str]], *, closed: bool = True) -> list[tuple[str, ...]]:
    """Return every choice of colors whose types obey Figure 15, in lexicographic order."""
    out = []
    for colors in itertools.product(*choices):
        types = [choice[color] for choice, color in zip(choices, colors, strict=True)]
        if first_violation(types, closed=closed) is None:
            out.append(colors)
    return out


def groups_of(choices: Sequence[dict[str, str]]) -> list[tuple[list[int], list[str]]]:
    """Return the runs of points that must share one color, with the colors that they can share, in order.

    Between neighbours Figure 15 either allows every pair of colors or the same color only, because + against − is all
    that it forbids. So a colouring is a free choice for each run, and the number of colourings is a product.
    """
    n = len(choices)

    def tied(k: int) -> bool:
        # The types of the other color are those of this one with + and − exchanged.
        first, second = types_from_text(next(iter(choices[k].values()))), next(iter(choices[(k + 1) % n].values()))
        ours, theirs = np.abs(first), -np.abs(types_from_text(second))
        return not neighbors_allowed((ours[0], ours[1]), (theirs[0], theirs[1]))

    cuts = [k + 1 for k in range(n) if not tied(k)]
    if not cuts:
        runs = [list(range(n))]
    else:
        runs = [list(range(a, b)) for a, b in itertools.pairwise(cuts)]
        seam = [*range(cuts[-1], n), *range(cuts[0])]
        runs = [seam, *runs] if seam else runs
    shared = [(sorted(run), [c for c in ("red", "blue") if all(c in choices[k] for k in run)]) for run in runs]
    return sorted(shared)


def listed(choices: Sequence[dict[str, str]]) -> Iterator[tuple[str, ...]]:
    """Yield every colouring from the free choices of the runs, in lexicographic order."""
    groups = groups_of(choices)
    for chosen in itertools.product(*(colors for _, colors in groups)):
        painted = [""] * len(choices)
        for (run, _), color in zip(groups, chosen, strict=True):
            for k in run:
                painted[k] = color
        yield tuple(painted)


def read_off(coloring: Coloring) -> tuple[str, ...]:
    return coloring.colors


def counted(loop: Sequence[Point], cuts: Sequence[int], sign: Sign, coefficients: gg.Coefficients) -> ColoringCount:
    """Return the count of a loop that comes in pieces, cut before the points of these numbers."""
    plane = np.array(loop, dtype=float)
    palette = color_choices(plane[:, 0], plane[:, 1], coefficients)[sign]
    chain = ColoringCount(sign)
    for start, end in itertools.pairwise([0, *sorted(cuts), len(palette)]):
        chain.add(palette[start:end])
    return chain


# Published cases


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
def test_the_loops_of_the_papers_gaits(gait: PublishedGait, expected: list[tuple[Sign, str]]) -> None:
    found = gg.colorings(gait.angles)
    assert [(one.sign, set(one.colors)) for one in found] == [(sign, {color}) for sign, color in expected]
    assert found.count == len(expected)
    assert (gait.sign, gait.color) in expected
    assert set(found.obstacles) == set(SIGNS) - {sign for sign, _ in expected}
    assert found
    # In exact physics blue has R = 0, so red remains.
    exact = gg.colorings(gait.angles, coefficients=EXACT)
    assert [(one.sign, set(one.colors)) for one in exact] == [(s, {c}) for s, c in expected if c == "red"]


def test_gaits_2_and_3_are_the_two_colourings_of_one_loop() -> None:
    assert G2.angles == G3.angles
    assert [one.colors for one in gg.colorings(G2.angles)] == [("red",) * 4, ("blue",) * 4]


@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
def test_the_colouring_of_each_gait_is_a_gait_that_keeps_the_two_color_rule(gait: PublishedGait) -> None:
    for one in gg.colorings(gait.angles, sign=gait.sign):
        lifted = gg.lift(gait.angles, one.colors)
        assert gg.validate(lifted).two_color
        assert gg.colorings(gait.angles).types_of(one) == list(lifted.types)


# Against brute force


@settings(deadline=None, max_examples=150)
@given(loop=loops, coefficients=either_kind)
def test_the_same_list_in_the_same_order_as_brute_force(loop: Loop, coefficients: gg.Coefficients) -> None:
    found = gg.colorings(loop, coefficients=coefficients)
    whole = []
    for sign in SIGNS:
        expected = brute(offers(loop, sign, coefficients))
        assert [one.colors for one in found.of(sign)] == expected
        assert found.counts[sign] == len(expected)
        assert (sign in found.obstacles) == (not expected)
        whole += [Coloring(colors=colors, sign=sign) for colors in expected]
        alone = gg.colorings(loop, sign=sign, coefficients=coefficients)
        assert [one.colors for one in alone] == expected
        assert set(alone.counts) == {sign}
    assert list(found) == whole
    assert list(found) == whole  # every iteration starts anew
    assert found.count == len(whole)
    assert bool(found) == bool(whole)


@pytest.mark.parametrize("coefficients", [PUBLISHED, EXACT], ids=["published", "exact"])
def test_every_node_of_the_papers_grid_and_its_sides_alone_and_in_pairs(coefficients: gg.Coefficients) -> None:
    axis = [k * pi / 16 for k in range(-8, 9)]
    grid = [(a, b) for a in axis for b in axis]
    choices = {sign: offers(grid, sign, coefficients) for sign in SIGNS}
    for k, point in enumerate(grid):
        assert gg.colorings([point], coefficients=coefficients).counts == {s: len(choices[s][k]) for s in SIGNS}
        other = (7 * k + 3) % len(grid)  # 7 and 289 have no common divisor: every node is met as neighbour
        pair = gg.colorings([point, grid[other]], coefficients=coefficients)
        for sign in SIGNS:
            expected = brute([choices[sign][k], choices[sign][other]])
            assert [one.colors for one in pair.of(sign)] == expected


@settings(deadline=None, max_examples=60)
@given(loop=loops, coefficients=either_kind, tolerance=st.one_of(st.floats(0, 0.8), st.sampled_from([0.0, pi / 4])))
def test_any_crossing_tolerance(loop: Loop, coefficients: gg.Coefficients, tolerance: float) -> None:
    found = gg.colorings(loop, coefficients=coefficients, crossing_tolerance=tolerance)
    default = gg.colorings(loop, coefficients=coefficients)
    for sign in SIGNS:
        assert [one.colors for one in found.of(sign)] == brute(offers(loop, sign, coefficients, tolerance))
        smaller, larger = sorted([(tolerance, found), (pi / 32, default)], key=lambda pair: pair[0])
        assert {one.colors for one in smaller[1].of(sign)} <= {one.colors for one in larger[1].of(sign)}


@settings(deadline=None, max_examples=40)
@given(loop=loops)
def test_the_two_ends_of_the_tolerance(loop: Loop) -> None:
    # No angle is further than π/4 from a multiple of π/2: then all types are ? and every choice is allowed.
    free = gg.colorings(loop, crossing_tolerance=pi / 4)
    for sign in SIGNS:
        assert free.counts[sign] == math.prod(len(choice) for choice in offers(loop, sign, PUBLISHED))
        assert all(set(free.types_of(one)) == {"(?,?)"} for one in itertools.islice(free.of(sign), 4))
    # Away from the lines nothing changes color without a tolerance.
    tight = gg.colorings(loop, crossing_tolerance=0.0)
    for one in tight:
        types = tight.types_of(one)
        changes = [k for k in range(len(types)) if one.colors[k] != one.colors[k - 1]]
        assert all("(?,?)" in (types[k], types[k - 1]) or "?" in types[k] + types[k - 1] for k in changes)


# Long loops, counted without listing


@pytest.mark.no_cover
@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 400), kind=either_kind, repeat=st.integers(1, 5))
def test_counts_of_long_loops_are_the_product_of_free_choices(
    seed: int, size: int, kind: gg.Coefficients, repeat: int
) -> None:
    """Runs of points that must share a color are chosen freely, one by one: no matrices, no search."""
    rng = np.random.default_rng(seed)
    # Mostly around the node where all is possible, so that both colors often exist.
    steps = rng.choice(5, p=[0.6, 0.1, 0.1, 0.1, 0.1], size=(size, 2))
    loop: Loop = [(MEETING[0] + i * pi / 16, MEETING[1] - j * pi / 16) for i, j in steps.tolist()] * repeat
    found = gg.colorings(loop, coefficients=kind)
    for sign in SIGNS:
        choices = offers(loop, sign, kind)
        if not all(choices):
            assert found.counts[sign] == 0
            assert found.obstacles[sign].points[0] <= choices.index({}) + 1
            continue
        assert found.counts[sign] == math.prod(len(colors) for _, colors in groups_of(choices))
        first = list(map(read_off, itertools.islice(found.of(sign), 50)))
        assert first == list(itertools.islice(listed(choices), 50))


@settings(deadline=None, max_examples=60)
@given(loop=loops, coefficients=either_kind)
def test_the_product_of_free_choices_is_brute_force_on_small_loops(loop: Loop, coefficients: gg.Coefficients) -> None:
    # The yardstick of the test above, without any code of the package that it measures.
    for sign in SIGNS:
        choices = offers(loop, sign, coefficients)
        if all(choices):
            assert list(listed(choices)) == brute(choices)


@pytest.mark.no_cover
@pytest.mark.parametrize(
    ("pattern", "free"),
    [
        ([MEETING], 1),  # one free choice for each point
        ([MEETING, (pi / 8, -pi / 8)], 2),  # a point of fixed type is free between two (?,?)
        ([MEETING, (pi / 8, -pi / 8), (3 * pi / 16, -pi / 8)], 2),  # two neighbours of fixed type share their color
        ([(pi / 16, -3 * pi / 8), (pi / 8, -pi / 16)], 2),  # (+,?) beside (?,-): each angle has its own ?
    ],
)
def test_fifty_thousand_points_are_counted_exactly_and_listed_lazily(pattern: Loop, free: int) -> None:
    for small in (1, 2, 3):
        loop = pattern * small
        assert len(brute(offers(loop, "negative", PUBLISHED))) == 2 ** (free * small)
    repeat = 50_000 // len(pattern)
    found = gg.colorings(pattern * repeat, sign="negative")
    assert found.count == 2 ** (free * repeat)
    n = len(pattern) * repeat
    assert next(iter(found)).colors == ("red",) * n
    second = next(itertools.islice(found, 1, None)).colors
    assert second[:-1].count("blue") < len(pattern)
    assert second[-1] == "blue"  # the last free choice changes first


def test_a_loop_with_two_to_the_fifty_thousand_colourings_is_told_by_its_logarithm() -> None:
    n = 50_000
    found = gg.colorings([MEETING] * n, sign="negative")
    told, listing = found.as_mapping(), found.listing()
    assert told["colorings_count"] is None
    assert told["counts"] == {"negative": None}
    for mapping in (told, listing.as_mapping()):
        assert mapping["colorings_count"] is None
        assert abs(mapping["colorings_count_log10"] - n * math.log10(2)) < 1
        json.loads(json.dumps(mapping, allow_nan=False))
    assert listing.count == 2**n
    assert len(listing.first) == MOST_LISTED
    for text, rest in (
        (str(found), rf" colourings of a loop of {n} points"),
        (str(listing), r" with R < 0, all red or all blue \(those that change color jump between the sheets\)"),
    ):
        match = re.fullmatch(rf"about 10\^(\d+){rest}", text)
        assert match is not None
        assert abs(int(match[1]) - n * math.log10(2)) < 1


def test_the_logarithm_of_a_huge_count_is_its_logarithm() -> None:
    for n in (14_000, 50_000):
        told = gg.colorings([MEETING] * n, sign="negative").as_mapping()["colorings_count_log10"]
        assert math.isclose(told, n * math.log10(2), abs_tol=1e-6)


@pytest.mark.parametrize("more", [-2, -1, 0, 1, 2])
def test_counts_of_up_to_4000_digits_are_written_out(more: int) -> None:
    n = int(4000 / math.log10(2)) + more
    found = gg.colorings([MEETING] * n, sign="negative")
    told = json.loads(json.dumps(found.as_mapping()))
    if told["colorings_count"] is None:
        assert more >= 0
        assert abs(told["colorings_count_log10"] - n * math.log10(2)) < 1
        assert re.match(r"about 10\^(4000|4001) ", str(found))
    else:
        assert more < 2
        assert told["colorings_count"] == told["counts"]["negative"] == 2**n
        assert str(found).startswith(f"{2**n} ")


# The chain in pieces


@settings(deadline=None, max_examples=150)
@given(data=st.data(), loop=st.lists(points, min_size=1, max_size=25), coefficients=either_kind)
def test_arbitrary_pieces_count_as_one(data: st.DataObject, loop: Loop, coefficients: gg.Coefficients) -> None:
    cuts = data.draw(st.lists(st.integers(0, len(loop)), max_size=8))  # equal cuts make empty pieces
    for sign in SIGNS:
        whole = counted(loop, [], sign, coefficients)
        pieces = counted(loop, cuts, sign, coefficients)
        assert pieces.closed() == whole.closed() == gg.colorings(loop, sign=sign, coefficients=coefficients).count
        assert pieces.obstacle == whole.obstacle
        assert pieces.closed() == whole.closed()  # closing twice changes nothing
        if whole.obstacle is None:
            assert pieces.points == whole.points == len(loop)
            assert pieces.plain == whole.plain
            everywhere = [set(choice) for choice in offers(loop, sign, coefficients)]
            assert set(whole.plain) == set.intersection(*everywhere)


def test_one_point_at_a_time_over_two_thousand_points() -> None:
    loop: Loop = [MEETING, (pi / 8, -pi / 8), (3 * pi / 16, -pi / 8)] * 700
    chain = counted(loop, list(range(len(loop))), "negative", PUBLISHED)
    assert chain.closed() == 2**1400
    assert chain.plain == ("red", "blue")


def test_a_chain_without_points_has_no_colouring() -> None:
    chain = ColoringCount("negative")
    nothing = np.zeros((0, 4), dtype=bool)
    chain.add(nothing)
    assert (chain.closed(), chain.points, chain.obstacle) == (0, 0, None)


# Metamorphic


@settings(deadline=None, max_examples=80)
@given(loop=loops, start=st.integers(0, 6), coefficients=either_kind)
def test_where_a_loop_starts_and_which_way_it_runs_keep_the_colourings(
    loop: Loop, start: int, coefficients: gg.Coefficients
) -> None:
    start %= len(loop)
    found = gg.colorings(loop, coefficients=coefficients)
    turned = gg.colorings(loop[start:] + loop[:start], coefficients=coefficients)
    back = gg.colorings(loop[::-1], coefficients=coefficients)
    assert found.counts == turned.counts == back.counts
    assert {(c.sign, c.colors[start:] + c.colors[:start]) for c in found} == {(c.sign, c.colors) for c in turned}
    assert {(c.sign, c.colors[::-1]) for c in found} == {(c.sign, c.colors) for c in back}


@settings(deadline=None, max_examples=80)
@given(loop=loops)
def test_the_mirrored_spin_at_the_mirrored_angles_has_the_same_colourings(loop: Loop) -> None:
    mirrored = [(-a, -b) for a, b in loop]
    numbers = gg.invertibility.coefficients_of(MIRRORED)
    # What the law rests on: R(α; −κ) = R(−α; κ) and α3 − α1, α4 − α2 of both sheets change their sign (section 16).
    ours, theirs = gg.colorings(loop, coefficients=EXACT), gg.colorings(mirrored, vehicle=MIRRORED)
    assert numbers.kind == "exact"
    assert list(ours) == list(theirs)
    assert ours.counts == theirs.counts
    assert ours.obstacles == theirs.obstacles
    assert [ours.types_of(one) for one in ours] == [theirs.types_of(one) for one in theirs]


@settings(deadline=None, max_examples=40)
@given(loop=loops, turn=st.floats(-pi, pi))
def test_turned_arms_change_no_colouring(loop: Loop, turn: float) -> None:
    vehicle = gg.Vehicle(drag_ratio=0.3, first_arm_angle=turn)
    plain = gg.Vehicle(drag_ratio=0.3)
    assert list(gg.colorings(loop, vehicle=vehicle)) == list(gg.colorings(loop, vehicle=plain))


@settings(deadline=None, max_examples=60)
@given(loop=loops, where=st.integers(0, 6), coefficients=either_kind)
def test_a_point_said_twice(loop: Loop, where: int, coefficients: gg.Coefficients) -> None:
    where %= len(loop)
    twice = loop[: where + 1] + loop[where:]
    before, after = (gg.colorings(one, coefficients=coefficients) for one in (loop, twice))
    for sign in SIGNS:
        choice = offers(loop, sign, coefficients)[where]
        if choice and "(?,?)" in choice.values():
            # The second one is chosen freely.
            assert after.counts[sign] == len(choice) * before.counts[sign]
        else:
            assert after.counts[sign] == before.counts[sign]


@settings(deadline=None, max_examples=30)
@given(loop=loops, coefficients=either_kind)
def test_tables_of_four_angles_count_by_the_first_two(loop: Loop, coefficients: gg.Coefficients) -> None:
    plane = np.array(loop)
    for extra in (np.zeros((len(loop), 2)), np.full((len(loop), 2), 9.0)):
        four = gg.colorings(np.hstack([plane, extra]), coefficients=coefficients)
        np.testing.assert_array_equal(four.points, plane)
        assert list(four) == list(gg.colorings(loop, coefficients=coefficients))


# Obstacles


def check_obstacle(loop: Loop, sign: Sign, obstacle: ColoringObstacle, coefficients: gg.Coefficients) -> None:
    """Check by brute force that what an obstacle says is so, and that nothing is in the way before it."""
    choices = offers(loop, sign, coefficients)
    relation = "R < 0" if sign == "negative" else "R > 0"
    assert relation in obstacle.message
    assert "\n" not in obstacle.message
    if obstacle.kind == "point":
        (number,) = obstacle.points
        assert choices[number - 1] == {}
        assert obstacle.types == ()
        assert obstacle.message == f"point {number} has no root with {relation}, neither red nor blue"
        assert all(choices[: number - 1])
        assert number == 1 or brute(choices[: number - 1], closed=False)
        return
    first, second = obstacle.points
    assert not gg.surface.types_may_be_adjacent(*obstacle.types)
    before = brute(choices[:first], closed=False)
    assert before
    if second == 1:
        assert first == len(loop)
        ends = {(colors[-1], colors[0]) for colors in before}
        told = {(choices[-1][end], choices[0][start]) for end, start in ends}
    else:
        assert second == first + 1
        assert brute(choices[:second], closed=False) == []
        ends = {(colors[-1], after) for colors in before for after in choices[second - 1]}
        told = {(choices[first - 1][end], choices[second - 1][after]) for end, after in ends}
    assert told == {obstacle.types}  # nothing else can stand there
    ((end, other),) = ends
    assert f"points {first} {obstacle.types[0]} and {second} {obstacle.types[1]} may not be neighbours" in (
        obstacle.message
    )
    assert f"the first can only be {end}, the second only {other}" in obstacle.message
    broken = [f"α{k + 3}" for k in range(2) if np.prod([types_from_text(text)[k] for text in obstacle.types]) < 0]
    assert f"by Figure 15 {' and '.join(broken)} may change between + and -" in obstacle.message


@settings(deadline=None, max_examples=200)
@given(loop=loops, coefficients=st.sampled_from([PUBLISHED, PUBLISHED, EXACT]))
def test_an_obstacle_names_what_is_in_the_way(loop: Loop, coefficients: gg.Coefficients) -> None:
    found = gg.colorings(loop, coefficients=coefficients)
    for sign, obstacle in found.obstacles.items():
        check_obstacle(loop, sign, obstacle, coefficients)


def test_the_points_of_the_cases_below_are_what_they_are_called() -> None:
    assert offers([RED_ONLY, BLUE_ONLY, *RICH], "negative", PUBLISHED) == [
        {"red": "(+,+)"},
        {"blue": "(-,-)"},
        {"red": "(?,?)", "blue": "(?,?)"},
        {"red": "(+,+)", "blue": "(-,-)"},
        {"red": "(+,+)", "blue": "(-,-)"},
        {"red": "(?,+)", "blue": "(?,-)"},
    ]


@pytest.mark.parametrize(
    ("loop", "expected"),
    [
        ([RED_ONLY, BLUE_ONLY], (1, 2)),
        pytest.param(
            [BLUE_ONLY, RED_ONLY],
            (1, 2),
        ),
        ([RED_ONLY, (0.0, -pi / 16)], (1, 2)),  # (+,+) and (-,?): α3 alone forbids it
        ([RED_ONLY, (pi / 16, 0.0)], (1, 2)),  # (+,+) and (?,-): α4 alone
        ([RED_ONLY, MEETING, BLUE_ONLY], (3, 1)),  # over (?,?) there, and no way back
        ([MEETING, RED_ONLY, BLUE_ONLY, MEETING], (2, 3)),
        ([RED_ONLY, MEETING, BLUE_ONLY, BLUE_ONLY, MEETING], None),
        ([MEETING, BLUE_ONLY, MEETING, RED_ONLY], None),
        ([BLUE_ONLY, (pi / 8, -pi / 8), (3 * pi / 16, -pi / 8), RED_ONLY], (3, 4)),  # blue is carried along
    ],
)
def test_the_pair_that_forbids_a_colouring(loop: Loop, expected: tuple[int, int] | None) -> None:
    found = gg.colorings(loop, sign="negative")
    if expected is None:
        assert found
        assert not found.obstacles
        return
    assert not found
    obstacle = found.obstacles["negative"]
    assert (obstacle.kind, obstacle.points) == ("pair", expected)
    check_obstacle(loop, "negative", obstacle, PUBLISHED)
    assert str(found) == f"0 colourings of a loop of {len(loop)} points\n  R < 0  none: {obstacle.message}"
    assert str(found.listing()) == f"none: {obstacle.message}"


def test_a_point_without_a_root_of_the_sign_is_named_unless_a_pair_comes_first() -> None:
    nothing: Point = (-pi / 2, -pi / 2)  # corners of the square have red R = 0 …
    assert offers([nothing], "negative", EXACT) == [{}]
    found = gg.colorings([(0.9, -0.9), nothing, nothing], coefficients=EXACT, sign="negative")
    assert (found.obstacles["negative"].kind, found.obstacles["negative"].points) == ("point", (2,))
    pair_first = gg.colorings([RED_ONLY, BLUE_ONLY, nothing], sign="negative")
    assert (pair_first.obstacles["negative"].kind, pair_first.obstacles["negative"].points) == ("pair", (1, 2))


@pytest.mark.parametrize("kind", ["published", "exact"])
def test_exact_coefficients_leave_all_red_or_nothing(kind: gg.invertibility.Kind) -> None:
    coefficients = gg.invertibility.coefficients_of(kind=kind)
    rng = np.random.default_rng(11)
    for _ in range(60):
        loop = rng.uniform(-1.2, 1.2, (3, 2))
        for one in gg.colorings(loop, coefficients=coefficients):
            assert kind == "published" or set(one.colors) == {"red"}


# Files


def written(folder: Path, name: str, content: str) -> Path:
    path = folder / name
    path.write_text(content, encoding="utf-8")
    return path


def csv_of(names: str, rows: Sequence[Sequence[Any]]) -> str:
    return "\n".join([names, *(",".join(map(str, row)) for row in rows)]) + "\n"


def same(first: gg.surface.Colorings, second: gg.surface.Colorings) -> bool:
    np.testing.assert_array_equal(first.points, second.points)
    return list(first) == list(second) and first.counts == second.counts and first.obstacles == second.obstacles


@pytest.mark.parametrize("closed", [False, True])
def test_tables_of_two_angles(tmp_path: Path, closed: bool) -> None:
    rows = [*RICH, RICH[0]] if closed else RICH
    expected = gg.colorings(RICH)
    assert expected.count > 2
    assert same(colorings_of_file(written(tmp_path, "a.csv", csv_of("alpha1,alpha2", rows))), expected)
    swapped = csv_of("note,alpha2,alpha1", [("x", b, a) for a, b in rows])
    assert same(colorings_of_file(written(tmp_path, "b.csv", swapped)), expected)
    columns = {"alpha1": [a for a, _ in rows], "alpha2": [b for _, b in rows]}
    assert same(colorings_of_file(written(tmp_path, "c.json", json.dumps(columns))), expected)
    records = [{"alpha1": a, "alpha2": b} for a, b in rows]
    assert same(colorings_of_file(written(tmp_path, "d.json", json.dumps(records))), expected)
    # A color is what is asked for, not what is told.
    painted = csv_of("alpha1,alpha2,color", [(a, b, "blue") for a, b in rows])
    assert same(colorings_of_file(written(tmp_path, "e.csv", painted)), expected)


def test_degrees_are_read_as_degrees(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", csv_of("alpha1_deg,alpha2_deg", [(67.5, -67.5), (67.5, -22.5), (22.5, -22.5)]))
    found = colorings_of_file(path)
    np.testing.assert_allclose(found.points, G3.angles[:3])
    assert [one.colors[0] for one in found] == ["red", "blue"]


@pytest.mark.parametrize("gait", GAITS, ids=lambda gait: f"gait{gait.number}")
@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_written_gait_tables_with_their_closing_row(tmp_path: Path, gait: PublishedGait, suffix: str) -> None:
    timed = gg.lift(gait.angles, gait.color).parametrize(samples=12)
    path = tmp_path / f"gait{suffix}"
    timed.write(path)
    found = colorings_of_file(path)
    assert same(found, gg.colorings(timed.alpha[:-1]))
    assert gait.color in [one.colors[0] for one in found if set(one.colors) == {gait.color}]


def test_a_last_row_on_another_sheet_is_a_point_of_its_own(tmp_path: Path) -> None:
    rows = gg.lift([*RICH, RICH[0]], ["red", "red", "red", "red", "blue"]).alpha.tolist()
    path = written(tmp_path, "a.csv", csv_of("alpha1,alpha2,alpha3,alpha4", rows))
    assert same(colorings_of_file(path), gg.colorings([*RICH, RICH[0]]))


@pytest.mark.parametrize(
    ("closing", "color"),
    [
        (False, "red"),
        (True, "red"),
        pytest.param(
            True,
            "blue",
        ),
    ],
)
def test_a_file_has_the_colourings_that_its_report_counts(tmp_path: Path, closing: bool, color: str) -> None:
    rows = [(a, b, "red") for a, b in RICH]
    rows += [(*RICH[0], color)] if closing else []
    path = written(tmp_path, "a.csv", csv_of("alpha1,alpha2,color", rows))
    listing = gg.validate(path).listing
    assert listing is not None
    found = colorings_of_file(path)
    assert found.counts == listing.counts
    assert found.listing() == listing


def test_a_saved_plan_and_its_request_as_toml_and_json(tmp_path: Path) -> None:
    request: dict[str, Any] = {"waypoints": [list(pair) for pair in G3.waypoints], "samples": 20}
    plan = gg.plan_loop(G3.waypoints)
    saved = written(tmp_path, "plan.json", json.dumps(plan.as_mapping()))
    assert plan.loop is not None
    assert same(colorings_of_file(saved), gg.colorings(plan.loop.path.alpha))
    toml = written(tmp_path, "request.toml", f"waypoints = {json.dumps(request['waypoints'])}\nsamples = 20\n")
    plain = written(tmp_path, "request.json", json.dumps(request))
    for path in (toml, plain):
        assert same(colorings_of_file(path), gg.colorings(G3.angles))
        exact = colorings_of_file(path, coefficients="exact")
        assert same(exact, gg.colorings(G3.angles, coefficients=EXACT))
        assert set(colorings_of_file(path, sign="positive").counts) == {"positive"}
        wide = colorings_of_file(path, crossing_tolerance=pi / 4)
        assert wide.count == gg.colorings(G3.angles, crossing_tolerance=pi / 4).count > 2


def test_a_request_says_sign_vehicle_and_coefficients_unless_overruled(tmp_path: Path) -> None:
    points = json.dumps([[-a, -b] for a, b in G3.angles])
    text = (
        f'waypoints = {points}\nsign = "negative"\n'
        f'[vehicle]\ndrag_ratio = {MIRRORED.drag_ratio!r}\nfirst_rotor_spin = "counterclockwise"\n'
    )
    path = written(tmp_path, "mirrored.toml", text)
    found = colorings_of_file(path)
    assert found.counts == {"negative": 1}  # exact coefficients: red alone
    assert [set(one.colors) for one in found] == [{"red"}]
    assert colorings_of_file(path, sign="auto").counts == {"negative": 1, "positive": 0}
    ours = gg.colorings([(-a, -b) for a, b in G3.angles], sign="negative")
    assert same(colorings_of_file(path, vehicle=gg.PAPER), ours)


def test_a_plan_without_a_gait_is_read_as_its_request(tmp_path: Path) -> None:
    plan = gg.plan_loop([(0.5, -0.5), (-0.5, 0.5)], color="red", sign="negative")
    assert not plan
    path = written(tmp_path, "plan.json", json.dumps(plan.as_mapping()))
    assert same(colorings_of_file(path), gg.colorings([(0.5, -0.5), (-0.5, 0.5)], sign="negative"))


def test_a_table_says_its_vehicle_and_tolerance(tmp_path: Path) -> None:
    gait = gg.lift([(-a, -b) for a, b in RICH], "red", vehicle=MIRRORED, crossing_tolerance=0.01)
    path = tmp_path / "mirrored.json"
    gait.parametrize(samples=4, law="equal-time").write(path)
    found = colorings_of_file(path)
    expected = gg.colorings(gait.alpha, vehicle=MIRRORED, crossing_tolerance=0.01)
    assert same(found, expected)
    palette, other = found.choices["negative"], colorings_of_file(path, crossing_tolerance=pi / 32)
    assert not palette[:, 2:].any()
    assert other.choices["negative"][:, 2:].any()
    published = colorings_of_file(path, vehicle=gg.PAPER, coefficients="published")
    assert same(published, gg.colorings(gait.alpha, crossing_tolerance=0.01))


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("a.csv", "alpha1,alpha3\n0.1,0.2\n", "alpha2"),
        ("a.csv", "alpha1,alpha2\n2.0,0.2\n", "alpha1"),
        ("a.csv", "alpha1,alpha2\n", "no rows"),
        ("a.csv", "alpha1,alpha2\nnan,0.2\n", "alpha1"),
        ("a.json", "[]", "no rows"),
        ("a.json", '{"waypoints": [[0.1, 9]]}', "waypoint 1 alpha2"),
        ("a.toml", "period = 1\n", "waypoints"),
        ("a.txt", "alpha1,alpha2\n0.1,0.2\n", "suffixes"),
    ],
)
def test_files_that_hold_no_loop(tmp_path: Path, name: str, content: str, told: str) -> None:
    path = written(tmp_path, name, content)
    with pytest.raises(gg.InputError) as caught:
        colorings_of_file(path)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(gg.errors.FileProblem):
        colorings_of_file(tmp_path / f"missing-{name}" if not name.endswith(".txt") else tmp_path / "missing.csv")


# Texts


@pytest.mark.parametrize(
    ("colors", "sign", "text"),
    [
        ("r", "negative", "R < 0  all red"),
        ("bbb", "positive", "R > 0  all blue"),
        ("rb", "negative", "R < 0  red 1, blue 2 (jumps between the sheets)"),
        ("rrbr", "positive", "R > 0  red 1 to 2, blue 3, red 4 (jumps between the sheets)"),
        ("bbbrrr", "negative", "R < 0  blue 1 to 3, red 4 to 6 (jumps between the sheets)"),
    ],
)
def test_a_colouring_in_words(colors: str, sign: Sign, text: str) -> None:
    names = {"r": "red", "b": "blue"}
    assert str(Coloring(colors=tuple(names[letter] for letter in colors), sign=sign)) == text


def test_colourings_in_words() -> None:
    assert str(gg.colorings(G3.angles, sign="negative")) == "2 colourings of a loop of 4 points"
    assert str(gg.colorings([MEETING], sign="negative", coefficients=EXACT)) == "1 colouring of a loop of 1 point"
    both = str(gg.colorings(G3.angles))
    assert both.splitlines()[0] == "2 colourings of a loop of 4 points"
    assert both.splitlines()[1:] == ["  R > 0  none: point 1 has no root with R > 0, neither red nor blue"]


def test_listings_in_words() -> None:
    assert str(gg.colorings(G1.angles).listing()) == "1 with R < 0, all blue"
    assert str(gg.colorings(G3.angles).listing()) == "2 with R < 0, all red or all blue"
    mixed = str(gg.colorings([MEETING, MEETING], sign="negative").listing())
    assert mixed == "4 with R < 0, all red or all blue (those that change color jump between the sheets)"
    only = gg.colorings([RED_ONLY, MEETING, BLUE_ONLY, MEETING], sign="negative")
    assert [one.colors for one in only] == brute(offers([RED_ONLY, MEETING, BLUE_ONLY, MEETING], "negative", PUBLISHED))
    assert str(only.listing()) == f"{only.count} with R < 0 (those that change color jump between the sheets)"
    # A point on a side of the square has roots of both signs.
    side = gg.colorings([(pi / 2, 0.3)]).listing()
    assert str(side) == "; ".join(
        f"{len(choice)} with {relation}, all {' or all '.join(choice)}"
        for sign, relation in (("negative", "R < 0"), ("positive", "R > 0"))
        for choice in offers([(pi / 2, 0.3)], sign, PUBLISHED)
    )


@settings(deadline=None, max_examples=40)
@given(loop=loops, coefficients=either_kind)
def test_a_listing_holds_the_first_ones_and_counts_all(loop: Loop, coefficients: gg.Coefficients) -> None:
    found = gg.colorings(loop, coefficients=coefficients)
    listing = found.listing()
    assert isinstance(listing, ColoringListing)
    assert listing.first == tuple(found)[:MOST_LISTED]
    assert listing.counts == found.counts
    assert listing.count == found.count
    for sign in SIGNS:
        uniform = {one.colors[0] for one in found.of(sign) if len(set(one.colors)) == 1}
        assert set(listing.plain[sign]) == uniform
    told = json.loads(json.dumps(listing.as_mapping(), allow_nan=False))
    assert told["colorings"] == [list(one.colors) for one in listing.first]
    assert told["coloring_signs"] == [one.sign for one in listing.first]
    assert told["colorings_count"] == found.count
    assert set(told["coloring_obstacles"]) == set(found.obstacles)
    whole = json.loads(json.dumps(found.as_mapping(), allow_nan=False))
    assert whole["counts"] == found.counts
    assert whole["coloring_obstacles"] == told["coloring_obstacles"]
    for text in (str(found), str(listing), *map(str, listing.first)):
        assert text
        assert text == text.strip()


def test_the_same_loop_gives_the_same_bytes() -> None:
    first, second = (json.dumps(gg.colorings(RICH * 5).listing().as_mapping()).encode() for _ in range(2))
    assert first == second


# Bad input


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"points": []}, "points: an array of shape (0,)"),
        ({"points": np.zeros((0, 2))}, "points: an array of shape (0, 2)"),
        ({"points": [0.1, 0.2]}, "points: an array of shape (2,)"),
        ({"points": [[0.1, 0.2, 0.3]]}, "points: an array of shape (1, 3)"),
        ({"points": None}, "points: an array of shape ()"),
        ({"points": [[2.0, 0.0]]}, "alpha1: 2.0 rad; allowed is"),
        ({"points": [[0.0, -1.6]]}, "alpha2: -1.6 rad; allowed is"),
        ({"points": [[0.0, math.nan]]}, "alpha2: nan rad"),
        ({"points": [[math.inf, 0.0]]}, "alpha1: inf rad"),
        ({"sign": "both"}, "sign: 'both'; allowed are auto, negative and positive"),
        ({"sign": None}, "sign: None; allowed are"),
        ({"sign": ["auto"]}, "sign: ['auto']; allowed are"),
        ({"crossing_tolerance": -0.1}, "crossing_tolerance: -0.1; allowed is"),
        ({"crossing_tolerance": math.nan}, "crossing_tolerance: nan; allowed is"),
        ({"crossing_tolerance": math.inf}, "crossing_tolerance: inf; allowed is"),
        ({"crossing_tolerance": "π/32"}, "crossing_tolerance: 'π/32'; allowed is"),
        ({"crossing_tolerance": True}, "crossing_tolerance: True; allowed is"),
    ],
)
def test_bad_input_is_named_in_one_line(arguments: dict[str, Any], told: str) -> None:
    with pytest.raises(gg.InputError) as caught:
        gg.colorings(**{"points": [(0.1, 0.2)], **arguments})
    assert str(caught.value).startswith(told)
    assert "allowed" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("loop", [[("a", "b")], [(0.1, 0.2), (0.3,)], "text"])
def test_points_that_are_no_numbers_are_named(loop: Any) -> None:
    with pytest.raises(gg.InputError, match="points: "):
        gg.colorings(loop)


# The parts of the count


@pytest.mark.parametrize("pieces", [[], [1], [2], [1, 2, 3]])
def test_the_first_obstacle_is_told_also_right_before_a_point_without_a_root(pieces: list[int]) -> None:
    nothing: Point = (-3 * pi / 8, 3 * pi / 8)
    assert offers([nothing], "negative", PUBLISHED) == [{}]
    for loop, expected in (
        ([RED_ONLY, BLUE_ONLY, nothing, MEETING], ("pair", (1, 2))),
        ([RED_ONLY, RED_ONLY, BLUE_ONLY, nothing], ("pair", (2, 3))),
        ([RED_ONLY, RED_ONLY, nothing, BLUE_ONLY], ("point", (3,))),
        ([RED_ONLY, nothing, RED_ONLY, BLUE_ONLY], ("point", (2,))),
        ([nothing, nothing, RED_ONLY, BLUE_ONLY], ("point", (1,))),
    ):
        chain = counted(loop, pieces, "negative", PUBLISHED)
        assert chain.closed() == 0
        assert chain.obstacle is not None
        assert (chain.obstacle.kind, chain.obstacle.points) == expected
        check_obstacle(loop, "negative", chain.obstacle, PUBLISHED)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_loop_that_is_forced_to_end_on_the_other_color_is_refused_at_its_end(mirrored: bool) -> None:
    """The first point may be both, the second forces its color, and over (?,?) the last one has the other."""
    both = (pi / 8, -pi / 8)
    start, end = (RED_ONLY, BLUE_ONLY) if mirrored else (BLUE_ONLY, RED_ONLY)
    loop = [both, start, MEETING, end]
    chain = counted(loop, [], "negative", PUBLISHED)
    assert chain.closed() == 0
    assert chain.obstacle is not None
    assert (chain.obstacle.kind, chain.obstacle.points) == ("pair", (4, 1))
    check_obstacle(loop, "negative", chain.obstacle, PUBLISHED)
