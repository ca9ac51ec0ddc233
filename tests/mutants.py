"""Change the code in one place at a time, and see whether the tests notice.

    python -m tests.mutants gaitgraph/surface tests/test_surface*.py [--count 60] [--seed 1] [--jobs 2]
    python -m tests.mutants gaitgraph/certificates/check.py tests/test_certificate_checker.py --count 0

Comparisons, operators, numbers, and/or, not, min and max are changed: `count` changes at random (0 for all), each in a
copy of the package with which the test files run until one test fails. Survivors are printed: each gets a test, or a
line with its reason in docs/developers/mutation.md. A change with which the tests run for ten times as long, and a
minute, counts as noticed.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parent.parent
SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Div,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.USub: ast.UAdd,
    ast.Not: ast.UAdd,
}
NAMES = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "any": "all",
    "all": "any",
    "floor": "ceil",
    "ceil": "floor",
}


class Mutant(NamedTuple):
    """One change: its module, what is changed, and the source of the changed module."""

    module: Path
    change: str
    source: str


def nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of code: no annotations, texts or blocks for type checkers."""
    todo = [tree]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        yield node
        for field, value in ast.iter_fields(node):
            if field not in ("annotation", "returns", "type_params"):
                children = value if isinstance(value, list) else [value]
                todo += [child for child in children if isinstance(child, ast.AST)]


def change(node: ast.AST) -> bool:
    """Change a node in its place, and return whether it is of a kind that is changed."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in SWAPS:
        node.ops[0] = SWAPS[type(node.ops[0])]()  # type: ignore[call-overload]
    elif (
        isinstance(node, (ast.BinOp, ast.AugAssign, ast.BoolOp, ast.UnaryOp))
        and type(node.op) in SWAPS
    ):
        node.op = SWAPS[type(node.op)]()  # type: ignore[assignment]
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        node.value += 1  # type: ignore[operator]
    elif isinstance(node, ast.Name) and node.id in NAMES:
        node.id = NAMES[node.id]
    elif isinstance(node, ast.Attribute) and node.attr in NAMES:
        node.attr = NAMES[node.attr]
    else:
        return False
    return True


def places(module: Path) -> list[tuple[Path, int]]:
    """Return a module with the number of each of its nodes that can be changed."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    # A changed node has as many children as before.
    return [(module, k) for k, node in enumerate(nodes(tree)) if change(node)]


def mutant_of(module: Path, number: int) -> Mutant:
    """Return a module with its node of a number changed."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    node: Any = list(nodes(tree))[number]
    before = ast.unparse(node)
    change(node)
    what = f"{module}:{node.lineno}: {before} -> {ast.unparse(node)}"
    return Mutant(module, what, ast.unparse(tree))


def survives(mutant: Mutant, tests: list[str], seconds: float | None = None) -> bool:
    """Return whether the tests pass in time with a mutant, in a copy of the package and the tests."""
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder)
        for name in ("gaitgraph", "tests", "docs", "examples"):
            shutil.copytree(
                ROOT / name, copied / name, ignore=shutil.ignore_patterns("__pycache__")
            )
        for name in ("pyproject.toml", "README.md"):
            shutil.copy(ROOT / name, copied)
        if mutant.source:
            (copied / mutant.module).write_text(mutant.source, encoding="utf-8")
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-n0",
            "-p",
            "no:cacheprovider",
            *tests,
        ]
        environment = {
            **os.environ,
            "PYTHONPATH": folder,
            "HYPOTHESIS_PROFILE": "mutation",
        }
        try:
            run = subprocess.run(
                command,
                cwd=folder,
                env=environment,
                capture_output=True,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return False
    return run.returncode == 0


def main() -> None:
    """Judge a sample of the mutants of a module or of a package."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "code", type=Path, help="a module or a folder, from the top of the project"
    )
    parser.add_argument("tests", nargs="+", help="test files, and options of pytest")
    parser.add_argument(
        "--count", type=int, default=60, help="changes at random; 0 for all"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    modules = (
        sorted(options.code.rglob("*.py")) if options.code.is_dir() else [options.code]
    )
    chosen = [place for module in modules for place in places(module)]
    if options.count:
        chosen = random.Random(options.seed).sample(
            chosen, min(options.count, len(chosen))
        )
    changed = [mutant_of(*place) for place in chosen]
    begin = monotonic()
    if not survives(Mutant(options.code, "none", ""), options.tests):
        sys.exit("The tests must pass before anything is changed.")
    seconds = 60 + 10 * (monotonic() - begin)
    judge = partial(survives, tests=options.tests, seconds=seconds)
    survivors = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        verdicts = pool.map(judge, changed)
        for mutant, alive in zip(changed, verdicts, strict=True):
            if alive:
                print(f"survived: {mutant.change}", flush=True)
                survivors += 1
    print(f"{len(chosen)} changes, {len(chosen) - survivors} found")


if __name__ == "__main__":
    main()
