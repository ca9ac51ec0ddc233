"""Formulas (1), (2) and (4)–(6) term by term as printed, with the list of misprints."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

Term = tuple[str, str, str]
"""Signed number as printed, "c" or "s" for each of the four angles, attitude factor."""

PRINTED = {
    "(1)": """
        +1.000 c1 c2 c3 s4 sθ  -1.000 c1 s2 c3 c4 sθ  -2.880 c1 c2 s3 s4 sθ  +2.880 c1 s2 s3 c4 sθ
        -2.880 s1 c2 c3 s4 sθ  +2.880 s1 s2 c3 c4 sθ  -1.000 s1 c2 s3 s4 sθ  +1.000 s1 s2 s3 c4 sθ
        +4.000 c1 c2 c3 c4 cφcθ  +5.592 c1 c2 c3 s4 cφcθ  -5.592 c1 c2 s3 c4 cφcθ  +5.592 c1 s2 c3 c4 cφcθ
        -5.592 s1 c2 c3 c4 cφcθ  +1.000 c1 c2 s3 c4 sφcθ  +0.9716 c1 c2 s3 s4 cφcθ  -2.000 c1 s2 c3 s4 cφcθ
        +0.9716 c1 s2 s3 c4 cφcθ  -1.000 s1 c2 c3 c4 sφcθ  +0.9716 s1 c2 c3 s4 cφcθ  -2.000 s1 c2 s3 c4 cφcθ
        +0.9716 s1 s2 c3 c4 cφcθ  +2.880 c1 c2 s3 s4 sφcθ  +2.880 c1 s2 s3 c4 sφcθ  -0.1687 c1 s2 s3 s4 cφcθ
        -2.880 s1 c2 s3 s4 sφcθ  +0.1687 s1 c2 s3 s4 cφcθ  -2.880 s1 s2 s3 c4 sφcθ  -0.1687 s1 s2 c3 s4 cφcθ
        +0.1687 s1 s2 s3 c4 cφcθ  -1.000 c1 s2 s3 s4 sφcθ  +1.000 s1 s2 s3 s4 sφcθ
    """,
    "(2)": """
        +4.000 c1 c2 c3 c4 cφcθ  +5.592 c1 c2 c3 s4 cφcθ  -5.592 c1 c2 s3 c4 cφcθ  +5.592 c1 s2 c3 c4 cφcθ
        -5.592 s1 c2 c3 c4 cφcθ  +0.9716 c1 c2 s3 s4 cφcθ  +0.9716 c1 s2 s3 c4 cφcθ  +0.9716 s1 c2 c3 s4 cφcθ
        +0.9716 s1 s2 c3 c4 cφcθ  -2.000 c1 s2 c3 s4 cφcθ  -2.000 s1 c2 s3 c4 cφcθ  -0.1687 c1 s2 s3 s4 cφcθ
        +0.1687 s1 c2 s3 s4 cφcθ  -0.1687 s1 s2 c3 s4 cφcθ  +0.1687 s1 s2 s3 c4 cφcθ
    """,
    "(4)": """
        +1.000 c1 c2 s3 c4 sφcθ  -1.000 s1 c2 c3 c4 sφcθ  -1.000 c1 s2 s3 s4 sφcθ  +1.000 s1 s2 c3 s4 sφcθ
        +2.880 c1 c2 s3 s4 sφcθ  +2.880 c1 s2 s3 c4 sφcθ  -2.880 s1 c2 c3 s4 sφcθ  -2.880 s1 s2 c3 c4 sφcθ
    """,
    "(5)": """
        +1.000 c1 c2 c3 s4 sθ  -1.000 c1 s2 c3 c4 sθ  -1.000 s1 c2 s3 s4 sθ  +1.000 s1 s2 s3 c4 sθ
        -2.880 c1 c2 c3 s4 sθ  +2.880 c1 s2 s3 c4 sθ  -2.880 s1 c2 c3 s4 sθ  +2.880 s1 s2 c3 c4 sθ
    """,
    "(6)": """
        +4.000 c1 c2 c3 c4 cφcθ  +5.592 c1 c2 c3 s4 cφcθ  -5.592 c1 c2 s3 c4 cφcθ  +5.592 c1 s2 c3 c4 cφcθ
        -5.592 s1 c2 c3 c4 cφcθ  +0.9716 c1 c2 s3 s4 cφcθ  +0.9716 c1 s2 s3 c4 cφcθ  +0.9716 s1 c2 s3 c4 cφcθ
        +0.9716 s1 s2 c3 c4 cφcθ  -2.000 c1 s2 c3 s4 cφcθ  -2.000 s1 c2 c3 s4 cφcθ  -0.1687 c1 s2 s3 s4 cφcθ
        +0.1687 s1 c2 s3 s4 cφcθ  -0.1687 s1 s2 c3 s4 cφcθ  +0.1687 s1 s2 s3 c4 cφcθ
    """,
}
"""The left sides of (1), (2), (4), (5), (6) as printed; (2) and (4)-(6) with the factor that they have in (1)."""

MISPRINTS = [
    ("(1)", "-2.880 s1 c2 s3 s4 sφcθ", "-2.880 s1 c2 c3 s4 sφcθ"),
    ("(1)", "-2.880 s1 s2 s3 c4 sφcθ", "-2.880 s1 s2 c3 c4 sφcθ"),
    ("(1)", "+1.000 s1 s2 s3 s4 sφcθ", "+1.000 s1 s2 c3 s4 sφcθ"),
    ("(5)", "-2.880 c1 c2 c3 s4 sθ", "-2.880 c1 c2 s3 s4 sθ"),
    ("(6)", "+0.9716 s1 c2 s3 c4 cφcθ", "+0.9716 s1 c2 c3 s4 cφcθ"),
    ("(6)", "-2.000 s1 c2 c3 s4 cφcθ", "-2.000 s1 c2 s3 c4 cφcθ"),
]

IN_KAPPA: dict[str, Callable[[Any], Any]] = {
    "1.000": lambda kappa: 1,
    "2.000": lambda kappa: 2,
    "4.000": lambda kappa: 4,
    "2.880": lambda kappa: (1 / kappa - kappa) / 2,
    "5.592": lambda kappa: 1 / kappa - 2 * kappa,
    "0.9716": lambda kappa: 1 - kappa**2,
    "0.1687": lambda kappa: kappa,
}
"""What the printed numbers are rounded from."""

PART = {"(2)": "cφcθ", "(4)": "sφcθ", "(5)": "sθ", "(6)": "cφcθ"}
"""The attitude factor of the part of (1) that each equation repeats."""


def term_of(text: str) -> Term:
    match = re.fullmatch(
        r"([+-][\d.]+) ([cs])1 ([cs])2 ([cs])3 ([cs])4 (sθ|sφcθ|cφcθ)", text
    )
    assert match is not None, text
    number, *letters, attitude = match.groups()
    return number, "".join(letters), attitude


def terms_of(text: str) -> list[Term]:
    return [term_of(term) for term in re.split(r"\s{2,}", text.strip())]


def corrected(equation: str) -> list[Term]:
    """Return an equation's terms with the listed misprints replaced."""
    terms = terms_of(PRINTED[equation])
    for where, wrong, right in MISPRINTS:
        if where == equation:
            terms[terms.index(term_of(wrong))] = term_of(right)
    return terms
