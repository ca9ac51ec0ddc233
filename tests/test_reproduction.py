"""The reproduction page: all of our values are computed again."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from tests.published_formulas import MISPRINTS

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "reproduction.md"
TEXT = PAGE.read_text(encoding="utf-8")
SLOW = ("readings", "moved", "beside_gait_2")
VERDICTS = ("agrees", "misprint", "rough", "artefact", "cannot be decided")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```\n", re.M | re.S)


class Claim(NamedTuple):
    """The cells with our values in one or several rows, their line, and the expression that computes them."""

    line: int
    told: list[list[str]]
    expression: str


def cells_of(line: str) -> list[str]:
    return [
        cell.strip().replace("\\|", "|")
        for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]
    ]


def tables() -> Iterator[tuple[int, list[str], list[list[str]], str]]:
    """Yield the line number, header, rows and the expression below of each table."""
    text = BLOCK.sub(lambda found: "\n" * found[0].count("\n"), TEXT)
    for found in re.finditer(r"((?:^\|.*\n)+)(?:\nShown by: `(.*)`\n)?", text, re.M):
        header, _, *rows = map(cells_of, found[1].splitlines())
        yield text.count("\n", 0, found.start()) + 3, header, rows, found[2] or ""


def claims() -> Iterator[Claim]:
    for line, header, rows, below in tables():
        ours = [k for k, name in enumerate(header) if name.startswith("ours")]
        if not ours:
            continue
        told = [[row[k] for k in ours] for row in rows]
        if below:
            yield Claim(line, told, below)
            continue
        assert header[-1] == "shown by", f"line {line}: nothing shows the column ours"
        for number, (row, cells) in enumerate(zip(rows, told, strict=True)):
            assert re.fullmatch(r"`[^`]+`", row[-1]), f"line {line + number}: {row[-1]}"
            yield Claim(line + number, [cells], row[-1][1:-1])


def text_of(value: Any) -> str:
    """Return a value as the page writes it."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple, np.ndarray)):
        return ", ".join(map(text_of, value))
    return str(value.item() if isinstance(value, np.generic) else value)


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    return vars(importlib.import_module("tests.reproduced"))


def marked(claim: Claim) -> Any:
    """Mark what is slow: regions of gaits that are nearly singular all along."""
    marks = [pytest.mark.slow] if claim.expression.startswith(SLOW) else []
    return pytest.param(claim, marks=marks, id=f"line {claim.line}")


@pytest.mark.parametrize("claim", list(map(marked, claims())))
def test_our_values_are_those_of_their_expressions(
    claim: Claim, names: dict[str, Any]
) -> None:
    value = eval(compile(claim.expression, f"{PAGE.name}:{claim.line}", "eval"), names)
    if len(claim.told) == 1:
        value = [value if len(claim.told[0]) > 1 else [value]]
    assert [[text_of(cell) for cell in row] for row in value] == claim.told


def test_every_verdict_is_a_word_that_is_explained_and_counted() -> None:
    told = [
        row[header.index("verdict")]
        for _, header, rows, _ in tables()
        if "verdict" in header[1:]
        for row in rows
    ]
    assert set(told) == set(VERDICTS)
    summary = next(rows for _, header, rows, _ in tables() if header[0] == "verdict")
    assert [row[0] for row in summary] == list(VERDICTS)
    assert [int(row[-1]) for row in summary] == [
        told.count(verdict) for verdict in VERDICTS
    ]


def test_every_figure_of_the_paper_is_shown_and_judged() -> None:
    shown = re.findall(r"!\[Figure (\d+)\]\(_figures/figure_(\d\d)\.png\)", TEXT)
    assert sorted(int(number) for number, _ in shown) == list(range(1, 23))
    assert all(int(number) == int(file) for number, file in shown)
    judged: set[int] = set()
    for words in re.findall(r"^\*\*Figures? ([\d, toand]+)\*\*", TEXT, re.M):
        spans = re.findall(r"(\d+)(?: to (\d+))?", words)
        judged.update(
            number
            for first, last in spans
            for number in range(int(first), int(last or first) + 1)
        )
    assert judged == set(range(1, 23))


def test_the_misprints_are_those_of_the_printed_formulas() -> None:
    rows = next(rows for _, header, rows, _ in tables() if header[0] == "formula")
    told = [(row[0].partition(",")[0], *row[1:3]) for row in rows]
    expected = [
        (place, as_printed.rpartition(" ")[0], corrected.rpartition(" ")[0])
        for place, as_printed, corrected in MISPRINTS
    ]
    assert told == expected
