"""The codebase's own rules: import order, a light start, no stray names."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import click
import networkx as nx
import pytest

import gaitgraph as gg
from gaitgraph import cli

PACKAGE = Path(gg.__file__).parent
PAGE = Path(__file__).parent.parent / "docs" / "architecture.md"
ORDER = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.M)
OUTSIDE = {"__init__", "__main__", "_lazy"}  # the public names, the entry point, and what both need

# Methods that call a later package: (method, package).
CONVENIENCES = {
    ("parametrize", "timing"),
    ("check", "validation"),
    ("plot", "plots"),
    ("animate", "plots"),
    ("_repr_html_", "plots"),
}


@cache
def imports() -> list[tuple[str, str, int]]:
    """Return every import of the package that the order holds for: the module, what it names, and the line.

    Those for type checking and inside functions count too; those of conveniences, and of what they return, do not.
    """
    paths = [path for path in sorted(PACKAGE.rglob("*.py")) if path.stem not in OUTSIDE]
    known = {".".join(path.relative_to(PACKAGE).with_suffix("").parts): path for path in paths}
    found: list[tuple[str, str, int]] = []
    for source, path in known.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        inside = {child: function.name for function in functions for child in ast.walk(function)}
        returned = {
            (package, function.returns.id)
            for function in functions
            for method, package in CONVENIENCES
            if function.name == method and isinstance(function.returns, ast.Name)
        }
        for node in ast.walk(tree):
            if not isinstance(node, ast.ImportFrom) or (node.module or "").split(".")[0] != "gaitgraph":
                continue
            base = (node.module or "").removeprefix("gaitgraph").removeprefix(".")
            for name in (alias.name for alias in node.names):
                full = f"{base}.{name}".removeprefix(".")
                target = full if full in known else base
                package = target.split(".")[0]
                if target and (inside.get(node), package) not in CONVENIENCES and (package, name) not in returned:
                    found.append((source, target, node.lineno))
    return found


def test_the_page_lists_the_packages() -> None:
    there = {path.stem for path in PACKAGE.glob("*.py")} | {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert there - OUTSIDE == set(ORDER)
    assert len(ORDER) == len(set(ORDER))


def test_each_package_imports_only_from_those_above_it() -> None:
    upward = [
        f"{source}:{line} imports {target}"
        for source, target, line in imports()
        if ORDER.index(target.split(".")[0]) > ORDER.index(source.split(".")[0])
    ]
    assert not upward, "\n".join(upward)


def test_no_imports_go_in_a_circle() -> None:
    graph = nx.DiGraph((source, target) for source, target, _ in imports())
    assert not [sorted(part) for part in nx.strongly_connected_components(graph) if len(part) > 1]


def test_the_package_does_not_grow() -> None:
    """The aim is 24,000 lines in 100 files; until it is met no change may go the other way."""
    files = list(PACKAGE.rglob("*.py"))
    assert len(files) <= 103
    assert sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files) <= 25_000


def test_at_most_forty_public_names() -> None:
    assert len(set(dir(gg)) - set(ORDER)) <= 40


def test_every_command_has_a_file_of_its_own() -> None:
    for name in cli.cli.list_commands(click.Context(cli.cli)):
        assert (PACKAGE / "cli" / f"{name}.py").exists(), name
        found = cli.cli.get_command(click.Context(cli.cli), name)
        assert found is not None
        assert found.name == name


def loaded_by(code: str) -> set[str]:
    heavy = "{'numpy', 'scipy', 'networkx', 'shapely', 'matplotlib', 'click'}"
    script = f"{code}\nimport sys\nprint(*sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_help_loads_nothing_heavy() -> None:
    assert loaded_by("import gaitgraph") == set()
    # One after the other in one process: what a command loaded would be there at the end.
    names = cli.cli.list_commands(click.Context(cli.cli))
    calls = [["--help"], ["--version"], *([name, "--help"] for name in names)]
    run = (
        f"import gaitgraph.cli as c\nfor call in {calls}:\n"
        "    try:\n        c.main(call)\n    except SystemExit:\n        pass"
    )
    assert loaded_by(run) <= {"click"}


def test_public_names_are_found_and_others_are_not() -> None:
    for name in dir(gg):
        assert getattr(gg, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = gg.nothing  # type: ignore[attr-defined]
