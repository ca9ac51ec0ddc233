"""Figure 15, entry by entry."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gaitgraph.surface.sheets import (
    PLANE_TYPES,
    neighbors_allowed,
    text_from_types,
    types_from_text,
    types_may_be_adjacent,
)

# Figure 15 (b): which types of (α3, α4) are joined, with the row and the column of (?,?) that the paper leaves out
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
CODES = {"+": 1, "?": 0, "-": -1, "*": 2}


def test_figure_15_b_by_labels_and_by_arrays() -> None:
    assert set(PLANE_TYPES) == set(ORDER)
    codes = np.array([types_from_text(label) for label in ORDER])
    table = neighbors_allowed(
        (codes[:, None, 0], codes[:, None, 1]), (codes[:, 0], codes[:, 1])
    )
    for (i, first), (k, second) in itertools.product(enumerate(ORDER), repeat=2):
        # Figure 15 (a): one angle may not change between + and -.
        by_angle = all({first[m], second[m]} != {"+", "-"} for m in (1, 3))
        assert (
            types_may_be_adjacent(first, second)
            is FIGURE_15_B[first, second]
            is by_angle
        )
        assert table[i, k] == by_angle


@pytest.mark.parametrize("label", ORDER)
def test_labels_mean_their_signs(label: str) -> None:
    codes = CODES[label[1]], CODES[label[3]]
    assert types_from_text(label) == codes
    assert text_from_types(*codes) == label
    assert types_from_text(label.replace("-", "−")) == codes  # as the paper prints it
    assert types_from_text(f"  ( {label[1]} , {label[3]} )\n") == codes
