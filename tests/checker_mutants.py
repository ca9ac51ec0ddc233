"""Change the checker of certificates in one place at a time, and see whether its tests notice.

    python -m tests.checker_mutants [--jobs 2] [NUMBER …]

Comparisons, operators, numbers, and/or are changed: each mutant is a module of its own in a child process, in which the
tests run until one fails. Survivors are printed, and are killed by a test or listed in docs/developers/mutation.md. A
mutant that runs for longer than LIMIT counts as killed.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import copy
import importlib.util
import inspect
import os
import signal
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import gaitgraph.certificates
import gaitgraph.timing.timed_gait
import gaitgraph.validation.validating  # once, in the parent of all children

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

CHECKER = Path(gaitgraph.certificates.__file__).with_name("check.py")
LIMIT = 150  # s
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
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.USub: ast.UAdd,
}


def places(tree: ast.AST) -> Iterator[tuple[ast.AST, str, int | None]]:
    """Yield nodes that can be changed: the node, its field, and the index in it."""
    for node in ast.walk(tree):
        for field, value in ast.iter_fields(node):
            if field in ("annotation", "returns"):
                for inner in ast.walk(value) if value else ():
                    inner.is_annotation = True  # type: ignore[attr-defined]
    for node in ast.walk(tree):
        if hasattr(node, "is_annotation"):
            continue
        if isinstance(node, ast.Compare):
            for k, op in enumerate(node.ops):
                if type(op) in SWAPS:
                    yield node, "ops", k
        elif isinstance(node, (ast.BinOp, ast.AugAssign, ast.BoolOp, ast.UnaryOp)):
            if type(node.op) in SWAPS:
                yield node, "op", None
        elif isinstance(node, ast.Constant) and type(node.value) is int:
            yield node, "value", None


def mutants(source: str) -> list[tuple[str, str]]:
    """Return the mutants of a module: what is changed, and the source."""
    out = []
    tree = ast.parse(source)
    for number in range(len(list(places(tree)))):
        changed = copy.deepcopy(tree)
        node, field, index = list(places(changed))[number]
        before = ast.unparse(node)
        old = getattr(node, field)
        if index is not None:
            old[index] = SWAPS[type(old[index])]()
        elif field == "value":
            node.value = old + 1  # type: ignore[attr-defined]
        else:
            node.op = SWAPS[type(old)]()  # type: ignore[attr-defined]
        line = source.splitlines()[node.lineno - 1].strip()  # type: ignore[attr-defined]
        what = (
            f"{number}: line {node.lineno}: {before} -> {ast.unparse(node)}  # {line}"  # type: ignore[attr-defined]
        )
        out.append((what, ast.unparse(changed)))
    return out


def survives(source: str) -> bool:
    """Return whether the tests pass with a mutant in the place of the checker, in a child process."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] == 0
    code = 1
    try:
        signal.alarm(LIMIT)
        out = os.open(os.devnull, os.O_WRONLY)
        os.dup2(out, 1)
        os.dup2(out, 2)
        path = Path(tempfile.mkdtemp()) / "check.py"
        path.write_text(source, encoding="utf-8")
        name = "gaitgraph.certificates.check"
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        gaitgraph.certificates.check = module
        spec.loader.exec_module(module)
        run_tests(importlib.import_module("tests.test_certificate_checker"))
        code = 0
    finally:
        os._exit(code)


def run_tests(tests: ModuleType) -> None:
    """Call the tests of a module in their order, until one fails; pytest itself takes longer to start."""
    for name, test in vars(tests).items():
        if not name.startswith("test_"):
            continue
        cases: list[dict[str, Any]] = [{}]
        for mark in getattr(test, "pytestmark", []):
            names, values = mark.args
            if isinstance(names, str):
                cases = [{names: value} for value in values]
            else:
                cases = [dict(zip(names, row, strict=True)) for row in values]
        if "tmp_path" in inspect.signature(test).parameters:
            cases = [{"tmp_path": Path(tempfile.mkdtemp())}]
        for case in cases:
            with contextlib.suppress(pytest.skip.Exception):
                test(**case)


def main() -> None:
    """Judge all mutants, or those with the given numbers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("numbers", nargs="*", type=int)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    source = CHECKER.read_text(encoding="utf-8")
    if not survives(source):
        sys.exit("The tests must pass before anything is changed.")
    every = mutants(source)
    chosen = [every[k] for k in options.numbers] or every
    survived = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        verdicts = pool.map(survives, (changed for _, changed in chosen))
        for (what, _), alive in zip(chosen, verdicts, strict=True):
            if alive:
                print(f"survived: {what}", flush=True)
                survived += 1
    print(f"{len(chosen)} mutants, {survived} survived")


if __name__ == "__main__":
    main()
