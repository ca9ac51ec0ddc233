"""The codebase's own rules: import order, a light start, no stray names."""

from __future__ import annotations

import ast
import compileall
import inspect
import re
import shutil
import subprocess
import sys
import tomllib
import warnings
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click
import networkx as nx
import pytest
from click.testing import CliRunner

import gaitgraph as gg
from gaitgraph import cli
from gaitgraph._lazy import lazy_modules

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parent.parent
PACKAGE = Path(gg.__file__).parent
PAGE = ROOT / "docs" / "developers" / "architecture.md"
ORDER = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.M)
ANYTHING = "*"  # what an import by a computed name, or of the whole package, may reach
RANKS = [
    "",
    "_lazy",
    *ORDER,
    "__main__",
    ANYTHING,
]  # "" is gaitgraph/__init__.py, of which there is the version

LATER = "later"  # what points against the order, all of it

# Imports against the order elsewhere: from which module, where in it, of which module.
EXCEPTIONS = {
    ("cli", "Group.get_command", ANYTHING),  # a command's file, by the command's name
    ("records", "_class_of", ANYTHING),  # a record's class, by the name in a mapping
}


def places(tree: ast.AST) -> Iterator[tuple[ast.AST, str]]:
    """Yield all nodes, each with the names of the classes and functions that it is in, or TYPE_CHECKING."""
    left = [(tree, "")]
    while left:
        outer, place = left.pop()
        for node in ast.iter_child_nodes(outer):
            yield node, place
            name = getattr(node, "name", "") if isinstance(node, ast.stmt) else ""
            if isinstance(node, ast.If):
                test = ast.unparse(node.test)
                name = "TYPE_CHECKING" if test.endswith("TYPE_CHECKING") else ""
            left.append((node, f"{place}.{name}".strip(".")))


@cache
def arrows(root: Path) -> set[tuple[str, str, str]]:
    """Return all imports of a package's modules: from which module, where in it, of which module.

    An `__init__.py` is the module of its package's name. A name that it states is imported from where it is defined.
    """
    paths = {
        path.relative_to(root).with_suffix("").parts: path
        for path in root.rglob("*.py")
    }
    packages = {".".join(parts[:-1]) for parts in paths if parts[-1] == "__init__"}
    trees = {
        ".".join(parts[:-1] if parts[-1] == "__init__" else parts): ast.parse(
            path.read_text(encoding="utf-8")
        )
        for parts, path in paths.items()
    }

    def base_of(source: str, node: ast.ImportFrom) -> str | None:
        """Return the module from which names are imported, without `gaitgraph`; None if it is another library's."""
        above = node.level - (source in packages)
        parts = ["gaitgraph", *source.split(".")]
        start = (
            [part for part in parts[: len(parts) - above] if part] if node.level else []
        )
        first, _, rest = ".".join([*start, *filter(None, [node.module])]).partition(".")
        return rest if first == "gaitgraph" else None

    @cache
    def home_of(base: str, name: str) -> str:
        """Return the module that a name of a module is, or that defines it."""
        full = f"{base}.{name}".strip(".")
        if full in trees:
            return full
        for node in ast.walk(trees[base]) if base in packages else ():
            if isinstance(node, ast.ImportFrom) and name in [
                alias.asname or alias.name for alias in node.names
            ]:
                inner = base_of(base, node)
                return base if inner is None else home_of(inner, name)
        return base

    def targets(source: str, node: ast.AST) -> Iterator[str]:
        if isinstance(node, ast.Import):
            for alias in node.names:
                first, _, target = alias.name.partition(".")
                if first == "gaitgraph":
                    yield (
                        target if alias.asname and target else ANYTHING
                    )  # else `gaitgraph` itself is bound
        elif isinstance(node, ast.ImportFrom):
            base = base_of(source, node)
            for alias in node.names:
                if base is not None:
                    yield (
                        ANYTHING
                        if (base, alias.name) == ("", "*")
                        else home_of(base, alias.name)
                    )
                elif alias.name == "import_module" and alias.asname:
                    yield ANYTHING
        elif getattr(node, "id", getattr(node, "attr", "")) in (
            "import_module",
            "__import__",
        ):
            yield ANYTHING

    inside = {
        source: tree
        for source, tree in trees.items()
        if source not in ("", "_lazy", "__main__")
    }
    return {
        (source, place, target)
        for source, tree in inside.items()
        for node, place in places(tree)
        for target in targets(source, node)
    }


def problems(root: Path) -> list[str]:
    """Return each import against the order, and the modules of each circle of other imports."""
    found = {arrow for arrow in arrows(root) - EXCEPTIONS if arrow[0] != LATER}
    upward = {
        (source, place, target)
        for source, place, target in found
        if RANKS.index(target.split(".")[0]) > RANKS.index(source.split(".")[0])
    }
    graph = nx.DiGraph((source, target) for source, _, target in found - upward)
    circles = [
        sorted(part)
        for part in nx.strongly_connected_components(graph)
        if len(part) > 1
    ]
    lines = [
        f"{source}: {place or 'module'} imports {target}"
        for source, place, target in upward
    ]
    return sorted([*lines, *(f"circle of {' and '.join(part)}" for part in circles)])


def test_imports_keep_the_order() -> None:
    against = problems(PACKAGE)
    assert not against, "\n".join(against)
    assert not EXCEPTIONS - arrows(PACKAGE), "no such imports"


def test_records_with_arrays_are_compared_as_objects() -> None:
    record = r"^@dataclass\((?!.*eq=False).*frozen.*\nclass.*\n(?:(?:    .*)?\n)*?    \w+: (?!.*compare=False).*Array\b"
    for path in PACKAGE.rglob(
        "*.py"
    ):  # a generated == would ask for the truth of an array
        assert not re.findall(record, path.read_text(encoding="utf-8"), re.M), path


# Modules of the made-up tree, what is added to them, and what it reaches that it must not.
WRONG = [
    ("surface/sheets", "import gaitgraph.plots.axes as axes", "plots.axes"),
    ("surface/sheets", "def f():\n    import gaitgraph.plots.axes as p", "plots.axes"),
    ("surface/sheets", "import gaitgraph.angles", "*"),
    ("surface/sheets", "from gaitgraph import *", "*"),
    ("surface/sheets", "from ..plots import axes", "plots.axes"),
    ("surface/sheets", "from gaitgraph import plots", "plots"),
    ("surface/sheets", "from gaitgraph import draw", "plots.axes"),
    (
        "surface/sheets",
        "if TYPE_CHECKING:\n    from gaitgraph.plots import draw",
        "plots.axes",
    ),
    (
        "surface/sheets",
        "from importlib import import_module\nimport_module('gaitgraph.plots')",
        "*",
    ),
    ("surface/sheets", "from importlib import import_module as load", "*"),
    ("surface/sheets", "__import__('gaitgraph.plots')", "*"),
    ("surface/__init__", "from gaitgraph.plots.axes import draw", "plots.axes"),
    (
        "surface/__init__",
        "if TYPE_CHECKING:\n    from ..plots.axes import draw as draw",
        "plots.axes",
    ),
    ("surface/adjacency", "from gaitgraph.surface import roots", "surface.sheets"),
    ("surface/adjacency", "def f():\n    from .sheets import roots", "surface.sheets"),
    ("surface/adjacency", "from gaitgraph import surface", "surface.sheets"),
    ("gait/gait", "from gaitgraph.validation.rules import rule", "validation.rules"),
    (
        "gait/gait",
        "def f():\n    from gaitgraph.later import check_gait",
        "validation.validating",
    ),
]
RIGHT = [
    (
        "plots/axes",
        "import os.path\nfrom .. import surface\nfrom gaitgraph import __version__, roots",
        None,
    ),
    ("gait/gait", "from gaitgraph import later\nlater.check_gait()", None),
]


@pytest.mark.parametrize(("module", "code", "reached"), [*WRONG, *RIGHT])
def test_each_form_of_import_is_judged(
    tmp_path: Path, module: str, code: str, reached: str | None
) -> None:
    listing = "if TYPE_CHECKING:\n    from gaitgraph.{0} import {1} as {1}\n"
    files = {
        "__init__": listing.format("plots", "draw")
        + "    from gaitgraph import plots as plots\n__version__ = '1'\n",
        "angles": "",
        "later/__init__": listing.format("validation.validating", "check_gait"),
        "surface/__init__": listing.format("surface.sheets", "roots"),
        "surface/adjacency": "from gaitgraph.angles import text\n",
        "surface/sheets": "from gaitgraph.surface.adjacency import rule\n",
        "gait/__init__": "",
        "gait/gait": "from gaitgraph.surface import roots\n",
        "validation/__init__": "",
        "validation/rules": "",
        "validation/validating": "from gaitgraph.gait.gait import Gait\n",
        "plots/__init__": listing.format("plots.axes", "draw"),
        "plots/axes": "from gaitgraph.validation.validating import check_gait\n",
    }
    for name, text in files.items():
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text + code * (name == module))
    assert [line.split()[-1] for line in problems(tmp_path)] == (
        [reached] if reached else []
    )


def test_the_page_lists_the_packages() -> None:
    there = {path.stem for path in PACKAGE.glob("*.py")} | {
        path.parent.name for path in PACKAGE.glob("*/__init__.py")
    }
    assert there - {"__init__", "__main__", "_lazy"} == set(ORDER)
    assert len(ORDER) == len(set(ORDER))


def test_every_command_is_in_the_file_that_is_stated() -> None:
    assert {*cli.COMMANDS.values()} == {
        path.stem for path in (PACKAGE / "cli").glob("*.py")
    } - {"__init__", "inputs", "options", "output"}
    for name in cli.cli.list_commands(click.Context(cli.cli)):
        found = cli.cli.get_command(click.Context(cli.cli), name)
        assert found is not None
        assert found.name == name


def loaded_by(code: str) -> set[str]:
    heavy = "{'numpy', 'scipy', 'networkx', 'shapely', 'matplotlib', 'click'}"
    script = f"{code}\nimport sys\nprint(*sorted({heavy} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
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


def test_a_plan_loads_no_graphs_and_no_scipy() -> None:
    request = PAGE.parents[2] / "examples" / "gait3.toml"
    run = f"import gaitgraph.cli as c\ntry:\n    c.main(['plan', {str(request)!r}])\nexcept SystemExit:\n    pass"
    assert loaded_by(run) <= {"click", "numpy", "shapely"}


def test_at_most_forty_public_names() -> None:
    names = gg.__all__  # type: ignore[attr-defined]
    assert len(names) <= 40
    every: dict[str, object] = {}
    exec("from gaitgraph import *", every)
    assert sorted(every.keys() - {"__builtins__"}) == names
    for name in (*names, *ORDER):
        assert getattr(gg, name) is not None
    assert {*dir(gg)} - {*names} == {*ORDER} - {
        "arrays",
        "cli",
        "files",
        "later",
        "pictured",
        "records",
        "texts",
        "tolerances",
    }
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = gg.nothing  # type: ignore[attr-defined]


def test_names_are_the_same_for_type_checkers_and_at_run_time() -> None:
    for path in sorted(PACKAGE.rglob("__init__.py")):
        source = path.read_text(encoding="utf-8")
        if "lazy_names(" not in source:
            continue
        blocks = [node for node in ast.parse(source).body if isinstance(node, ast.If)]
        package = ".".join(("gaitgraph", *path.parent.relative_to(PACKAGE).parts))
        stated = {}
        for node in blocks[0].body:
            assert isinstance(node, ast.ImportFrom)
            for alias in node.names:
                module = str(node.module)
                whole = module == package
                stated[alias.name] = f"{module}.{alias.name}" if whole else module
        import_module(package)
        assert lazy_modules(package) == stated, package


def texts_of(tree: ast.AST) -> Iterator[str]:
    """Yield the texts of a module that are neither docstrings nor advice for the command line."""
    for node in ast.iter_child_nodes(tree):
        name = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue
        if isinstance(node, (ast.JoinedStr, ast.Constant)):
            yield ast.unparse(node)
        elif name == "Advice":
            assert isinstance(node, ast.Call)
            yield ast.unparse(node.args[0])
        else:
            yield from texts_of(node)


def test_flags_are_named_by_the_command_line_alone() -> None:
    """The library names arguments, or whole commands; flags are in what Advice has for the command line."""
    flag = re.compile(r"(?<![-\w])--[a-z]")
    for path in PACKAGE.rglob("*.py"):
        source = path.read_text(encoding="utf-8")
        if path.parent.name != "cli" and flag.search(source):
            for text in texts_of(ast.parse(source)):
                assert "gaitgraph " in text or not flag.search(text), (path, text)


def test_the_package_works_without_its_sources(tmp_path: Path) -> None:
    copy = tmp_path / "gaitgraph"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    compileall.compile_dir(copy, quiet=1, legacy=True)
    for path in copy.rglob("*.py"):
        path.unlink()
    code = (
        "import gaitgraph as gg; print(gg.__file__, gg.plan_loop([(0.3, -0.3)]).status)"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stdout == f"{copy / '__init__.pyc'} planned\n"


def test_help_lists_each_command_on_one_line_in_the_order_of_the_work() -> None:
    shown = CliRunner().invoke(cli.cli, ["--help"], terminal_width=80).output
    lines = [line.split()[0] for line in shown.splitlines() if line.startswith("  ")]
    assert [word for word in lines if word in cli.COMMANDS] == [*cli.COMMANDS]
    listed = shown.partition("Plan:")[2].splitlines()
    assert sum(line.startswith("  ") for line in listed) == len(cli.COMMANDS)
    assert "..." not in shown.partition("Plan:")[2]
    assert max(map(len, listed)) <= 80


def test_a_new_release_that_deprecates_something_fails_no_test() -> None:
    def warned(category: type[Warning]) -> None:
        warnings.warn_explicit("a", category, "angles.py", 1, module="gaitgraph.angles")

    with warnings.catch_warnings(record=True):
        for of_a_library in (DeprecationWarning, FutureWarning):
            warned(of_a_library)
        for ours in (UserWarning, RuntimeWarning, gg.errors.FileWarning):
            with pytest.raises(ours):
                warned(ours)


def test_skipped_tests_name_an_extra_that_there_is() -> None:
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = stated["project"]["optional-dependencies"]
    for path in (ROOT / "tests").rglob("*.py"):
        for name in re.findall(r"install .*extra '(\w+)'", path.read_text("utf-8")):
            assert name in extras, path


def test_a_test_that_skips_itself_says_what_to_install() -> None:
    for path in (ROOT / "tests").glob("*.py"):
        source = path.read_text(encoding="utf-8")
        if "pytest.skip(" not in source:
            continue
        for call in ast.walk(ast.parse(source)):
            if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.skip":
                reason = call.args[0]
                if isinstance(reason, ast.Constant):
                    assert str(reason.value).startswith("install "), path


def test_help_of_a_function_shows_the_name_of_the_vehicle_it_takes() -> None:
    assert "= PAPER" in str(inspect.signature(gg.plan_loop)).replace(
        "=PAPER", "= PAPER"
    )


def test_a_module_lists_its_public_names_alone() -> None:
    import_module("gaitgraph.explorer.server")  # a loaded module is no public name
    for package in {*dir(gg)} - {*gg.__all__}:  # type: ignore[attr-defined]
        module = getattr(gg, package)
        listed = {name for name in dir(module) if not name.startswith("_")}
        assert listed == {*getattr(module, "__all__", ())}, package
