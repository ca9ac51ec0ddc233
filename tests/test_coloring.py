"""Figure 15, entry by entry, and where a loop breaks it."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from gaitgraph.errors import InputError
from gaitgraph.surface.adjacency import (
    PLANE_TYPES,
    first_violation,
    neighbors_allowed,
    types_from_text,
    types_may_be_adjacent,
)

# Figure 15 (a): which planes of one angle are lined.
ONE_ANGLE = {
    "+": {"+": True, "?": True, "-": False},
    "?": {"+": True, "?": True, "-": True},
    "-": {"+": False, "?": True, "-": True},
}

# Figure 15 (b): which types of (α3, α4) are lined, with the row and the column of (?,?) that the paper leaves out
# because "it accommodates all types of adjacent roots".
ORDER = ("(+,+)", "(-,-)", "(+,?)", "(?,+)", "(-,?)", "(?,-)", "(?,?)")
PAIRS = """
    1 0 1 1 0 0 1
    0 1 0 0 1 1 1
    1 0 1 1 0 1 1
    1 0 1 1 1 0 1
    0 1 0 1 1 1 1
    0 1 1 0 1 1 1
    1 1 1 1 1 1 1
"""
FIGURE_15_B = {
    (first, second): entry == "1"
    for first, row in zip(ORDER, PAIRS.strip().splitlines(), strict=True)
    for second, entry in zip(ORDER, row.split(), strict=True)
}
CODES = {"+": 1, "?": 0, "-": -1}

labels = st.sampled_from(ORDER)


def test_the_seven_categories() -> None:
    assert set(PLANE_TYPES) == set(ORDER)
    assert len(PLANE_TYPES) == 7


def test_the_two_halves_of_the_figure_agree_with_each_other() -> None:
    # A slip of the pen in the table above would show here, without any code of the package.
    for (first, second), allowed in FIGURE_15_B.items():
        assert allowed == FIGURE_15_B[second, first]
        assert allowed == (ONE_ANGLE[first[1]][second[1]] and ONE_ANGLE[first[3]][second[3]])


@pytest.mark.parametrize(("first", "second"), list(itertools.product("+?-", repeat=2)))
def test_figure_15_a(first: str, second: str) -> None:
    for other in "+?-":
        # The other angle stays on its plane, so that this one decides.
        third = ((CODES[first], CODES[other]), (CODES[second], CODES[other]))
        fourth = ((CODES[other], CODES[first]), (CODES[other], CODES[second]))
        assert neighbors_allowed(*third) == ONE_ANGLE[first][second]
        assert neighbors_allowed(*fourth) == ONE_ANGLE[first][second]


@pytest.mark.parametrize(("first", "second"), list(FIGURE_15_B))
def test_figure_15_b(first: str, second: str) -> None:
    assert types_may_be_adjacent(first, second) is FIGURE_15_B[first, second]


def test_arrays_of_types_broadcast() -> None:
    codes = np.array([types_from_text(label) for label in ORDER])
    table = neighbors_allowed((codes[:, None, 0], codes[:, None, 1]), (codes[:, 0], codes[:, 1]))
    assert table.shape == (7, 7)
    for (i, first), (k, second) in itertools.product(enumerate(ORDER), repeat=2):
        assert table[i, k] == FIGURE_15_B[first, second]


@pytest.mark.parametrize("label", ORDER)
def test_labels_mean_their_signs(label: str) -> None:
    third, fourth = CODES[label[1]], CODES[label[3]]
    assert types_from_text(label) == (third, fourth)
    assert types_from_text(label.replace("-", "−")) == (third, fourth)  # as the paper prints it
    assert types_from_text(f"  ( {label[1]} , {label[3]} )\n") == (third, fourth)


@pytest.mark.parametrize(
    "label",
    [
        "(+,-)",
        "(-,+)",
        "(+,−)",
        "",
        "+",
        "+,+",
        "(+)",
        "(+,+",
        "(+,+,+)",
        "(++)",
        "(1,1)",
        "(red)",
        "[+,+]",
        "(*,*)",
        "(*,+)",
        "(-,*)",
    ],
)
def test_other_labels_are_refused_with_the_allowed_ones(label: str) -> None:
    with pytest.raises(InputError) as caught:
        types_from_text(label)
    message = str(caught.value)
    assert message.startswith(f"types: {label!r}; allowed are")
    assert message.endswith("; allowed are " + ", ".join((*PLANE_TYPES, "(?,*)", "(*,?)")))
    assert all(one in message for one in ORDER)
    for first, second in (("(+,+)", label), (label, "(+,+)")):
        with pytest.raises(InputError):
            types_may_be_adjacent(first, second)
        with pytest.raises(InputError):
            first_violation([first, second])


@pytest.mark.parametrize(
    ("types", "closed", "opened"),
    [
        ([], None, None),
        (["(+,+)"], None, None),
        (["(+,+)", "(+,+)", "(+,+)"], None, None),
        (["(+,+)", "(-,-)"], 0, 0),
        # From red to blue by way of (?,?) and back the same way.
        (["(+,+)", "(?,?)", "(-,-)", "(?,?)"], None, None),
        # The way back is missing: only the closing pair says so.
        (["(+,+)", "(?,?)", "(-,-)"], 2, None),
        (["(+,+)", "(+,?)", "(?,?)", "(?,-)", "(-,-)"], 4, None),
        # One angle at a time, and each through its own "?".
        (["(+,+)", "(+,?)", "(?,-)", "(-,-)", "(-,?)", "(?,+)"], None, None),
        (["(+,+)", "(+,?)", "(-,-)", "(?,?)"], 1, 1),
        (["(+,?)", "(-,?)", "(?,?)"], 0, 0),
        (["(?,+)", "(?,-)", "(?,?)"], 0, 0),
        (["(?,?)", "(+,+)", "(-,-)", "(+,+)"], 1, 1),
    ],
)
def test_the_first_pair_that_breaks_the_rule(types: list[str], closed: int | None, opened: int | None) -> None:
    assert first_violation(types) == closed
    assert first_violation(types, closed=True) == closed
    assert first_violation(types, closed=False) == opened


@settings(deadline=None, max_examples=200)
@given(types=st.lists(labels, max_size=12), closed=st.booleans())
def test_any_loop_against_the_table(types: list[str], closed: bool) -> None:
    pairs: list[tuple[Any, Any]] = list(itertools.pairwise(types))
    if closed and types:
        pairs.append((types[-1], types[0]))
    broken = [k for k, pair in enumerate(pairs) if not FIGURE_15_B[pair]]
    assert first_violation(types, closed=closed) == (broken[0] if broken else None)


@settings(deadline=None, max_examples=100)
@given(types=st.lists(labels, min_size=1, max_size=10), start=st.integers(0, 9))
def test_where_a_closed_loop_starts_and_which_way_it_runs_does_not_matter(types: list[str], start: int) -> None:
    start %= len(types)
    keeps = first_violation(types) is None
    assert (first_violation(types[start:] + types[:start]) is None) == keeps
    assert (first_violation(types[::-1]) is None) == keeps


@pytest.mark.parametrize("label", [3, None, ("+", "+"), b"(+,+)", 1.5])
def test_what_is_no_text_is_no_label(label: Any) -> None:
    with pytest.raises(InputError, match="^types: .*; allowed are "):
        types_from_text(label)
    with pytest.raises(InputError, match="^types: "):
        first_violation(["(+,+)", label])
