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
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click
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
ORDER = re.findall(r"^\| `(\w+)` \|", PAGE.read_text("utf-8"), re.M)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
CONTEXT = click.Context(cli.cli)
NOT_PUBLIC = set("arrays cli files later pictured records texts tolerances".split())


def source_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def run_python(code: str, folder: Path | None = None) -> str:
    command = [sys.executable, "-c", code]
    return subprocess.check_output(command, cwd=folder, text=True)


def test_imports_keep_the_contracts_of_pyproject() -> None:
    linter = pytest.importorskip("importlinter.cli", reason="install the extra 'dev'")
    config = str(ROOT / "pyproject.toml")
    assert linter.lint_imports(config_filename=config, no_cache=True) == 0


def test_the_page_lists_the_packages_in_the_order_of_the_contract() -> None:
    layers = PROJECT["tool"]["importlinter"]["contracts"][0]["layers"]
    assert layers == ["__main__", *reversed(ORDER), "_lazy"]


def test_modules_import_names_from_where_they_are_defined() -> None:
    """The linter does not look through the names that a package hands on."""
    for path in PACKAGE.rglob("*.py"):
        if path.name in ("__init__.py", "__main__.py"):
            continue
        for node in ast.walk(ast.parse(source_of(path))):
            module = getattr(node, "module", None) or ""
            if not isinstance(node, ast.ImportFrom) or module_path(module).is_file():
                continue
            if not module.startswith("gaitgraph"):
                continue
            for alias in node.names:
                is_module = module_path(f"{module}.{alias.name}").exists()
                assert is_module or alias.name == "__version__", (path, alias.name)


def module_path(name: str) -> Path:
    """Return the file of a module, or the folder of a package."""
    path = PACKAGE.parent / name.replace(".", "/")
    return path if path.is_dir() else path.with_suffix(".py")


def test_records_with_arrays_are_compared_as_objects() -> None:
    """A generated == would ask for the truth of an array."""
    record = r"^@dataclass\((?!.*eq=False).*frozen.*\nclass.*\n(?:(?:    .*)?\n)*?    \w+: (?!.*compare=False).*Array\b"
    for path in PACKAGE.rglob("*.py"):
        assert not re.findall(record, source_of(path), re.M), path


def test_every_command_is_in_the_file_that_is_stated() -> None:
    files = {path.stem for path in (PACKAGE / "cli").glob("*.py")}
    shared = {"__init__", "inputs", "options", "output"}
    assert {*cli.COMMANDS.values()} == files - shared
    for name in cli.cli.list_commands(CONTEXT):
        command = cli.cli.get_command(CONTEXT, name)
        assert command is not None
        assert command.name == name


def test_the_start_is_light() -> None:
    heavy = "{'numpy', 'scipy', 'networkx', 'shapely', 'matplotlib', 'click'}"
    # One after the other in one process: what a command loaded would be there at the end.
    names = cli.cli.list_commands(CONTEXT)
    calls = [["--help"], ["--version"], *([name, "--help"] for name in names)]
    plan = [["plan", str(ROOT / "examples" / "gait3.toml")]]
    for called, allowed in (
        ([], set()),
        (calls, {"click"}),
        (plan, {"click", "numpy", "shapely"}),
    ):
        code = (
            f"import sys, gaitgraph\nfor call in {called}:\n"
            "    try:\n        import gaitgraph.cli as c; c.main(call)\n"
            f"    except SystemExit:\n        pass\nprint(*{heavy} & {{*sys.modules}})"
        )
        assert {*run_python(code).splitlines()[-1].split()} <= allowed


def test_public_names_are_forty_at_most_and_those_that_are_listed() -> None:
    names = gg.__all__  # type: ignore[attr-defined]
    assert len(names) <= 40
    every: dict[str, object] = {}
    exec("from gaitgraph import *", every)
    assert sorted(every.keys() - {"__builtins__"}) == names
    assert {*dir(gg)} - {*names} == {*ORDER} - NOT_PUBLIC
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = gg.nothing  # type: ignore[attr-defined]
    import_module("gaitgraph.explorer.server")  # a loaded module is no public name
    for name in {*ORDER} - NOT_PUBLIC:
        module = getattr(gg, name)
        listed = {name for name in dir(module) if not name.startswith("_")}
        assert listed == {*getattr(module, "__all__", ())}, name


def test_names_are_the_same_for_type_checkers_and_at_run_time() -> None:
    for path in PACKAGE.rglob("__init__.py"):
        tree = ast.parse(source_of(path))
        if "lazy_names(" not in source_of(path):
            continue
        package = ".".join(path.parent.relative_to(PACKAGE.parent).parts)
        block = next(node for node in tree.body if isinstance(node, ast.If))
        stated = {}
        for node in block.body:
            assert isinstance(node, ast.ImportFrom)
            for alias in node.names:
                is_module = node.module == package
                full = f"{package}.{alias.name}"
                stated[alias.name] = full if is_module else node.module
        import_module(package)
        assert lazy_modules(package) == stated, package


def test_flags_are_named_by_the_command_line_alone() -> None:
    """The library names arguments, or whole commands; flags are in what Advice has for the command line."""
    flag = re.compile(r"(?<![-\w])--[a-z]")
    for path in PACKAGE.rglob("*.py"):
        source = source_of(path)
        if path.parent.name == "cli" or not flag.search(source):
            continue
        for text in texts_of(ast.parse(source)):
            assert "gaitgraph " in text or not flag.search(text), (path, text)


def texts_of(tree: ast.AST) -> Iterator[str]:
    """Yield the texts of a module that are neither docstrings nor advice for the command line."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue
        if isinstance(node, (ast.JoinedStr, ast.Constant)):
            yield ast.unparse(node)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "Advice":
            yield ast.unparse(node.args[0])
        else:
            yield from texts_of(node)


def test_the_package_works_without_its_sources(tmp_path: Path) -> None:
    copy = tmp_path / "gaitgraph"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    compileall.compile_dir(copy, quiet=1, legacy=True)
    for path in copy.rglob("*.py"):
        path.unlink()
    code = "import gaitgraph as g; print(g.__file__, g.plan_loop([(0.3, -0.3)]).status)"
    assert run_python(code, tmp_path) == f"{copy / '__init__.pyc'} planned\n"


def test_help_lists_each_command_on_one_line_in_the_order_of_the_work() -> None:
    shown = CliRunner().invoke(cli.cli, ["--help"], terminal_width=80).output
    listed = shown.partition("Plan:")[2].splitlines()
    lines = [line for line in listed if line.startswith("  ")]
    assert [line.split()[0] for line in lines] == [*cli.COMMANDS]
    assert max(map(len, lines)) <= 80
    assert not any("..." in line for line in lines)


def test_a_new_release_of_a_library_that_deprecates_something_fails_no_test() -> None:
    with warnings.catch_warnings(record=True):
        warn_in_our_name(DeprecationWarning)
        warn_in_our_name(FutureWarning)
        for ours in (UserWarning, RuntimeWarning):
            with pytest.raises(ours):
                warn_in_our_name(ours)


def warn_in_our_name(category: type[Warning]) -> None:
    warnings.warn_explicit("a", category, "angles.py", 1, module="gaitgraph.angles")


def test_skipped_tests_name_an_extra_that_there_is() -> None:
    extras = PROJECT["project"]["optional-dependencies"]
    for path in (ROOT / "tests").rglob("*.py"):
        for name in re.findall(r"install .*extra '(\w+)'", source_of(path)):
            assert name in extras, path


def test_help_of_a_function_shows_the_name_of_the_vehicle_it_takes() -> None:
    assert "=PAPER" in str(inspect.signature(gg.plan_loop)).replace(" ", "")
