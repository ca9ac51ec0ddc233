"""The codebase's own rules: import order, a light start, no stray names."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import click
import pytest

import gaitgraph as gg
from gaitgraph import cli

PACKAGE = Path(gg.__file__).parent

ORDER = (
    "errors", "angles", "files", "vehicle", "invertibility", "surface", "fibers", "unfolding", "coloring", "palettes",
    "paintings", "regions", "segments", "areas", "visibility", "gait", "margins", "attitudes", "reports", "stretches",
    "rules", "checks", "timing", "curves", "pacing", "fibergrid", "graph", "contract", "loads", "search", "compact",
    "requests", "obstacles", "summary", "plans", "sketches", "showing", "gridloops", "anyangle", "whereabouts",
    "fiberloops", "planning", "ways", "enumeration", "circuits", "simplecycles", "catalog", "tables", "joints",
    "scenes", "formats", "writing", "reading", "frames", "validation", "completing", "exchange", "transitions",
    "optimal", "retargeting", "robustness", "drawing", "plots", "figures", "flight", "study", "watching", "explorer",
    "cli", "__main__",
)  # fmt: skip

# Convenience methods that delegate to a later room by an import inside them.
DELEGATIONS = {
    ("gait", "parametrize", "timing"),
    ("gait", "check", "checks"),
    ("timing", "write", "tables"),
    ("vehicle", "_repr_html_", "showing"),
    ("gait", "__str__", "showing"),
    ("gait", "_repr_html_", "showing"),
    ("timing", "__str__", "showing"),
    ("timing", "_repr_html_", "showing"),
    ("reports", "_repr_html_", "showing"),
    ("areas", "__str__", "showing"),
    ("areas", "_repr_html_", "showing"),
    ("plans", "_repr_html_", "showing"),
    ("timing", "write", "writing"),
    ("tables", "to_pandas", "frames"),
    ("tables", "to_polars", "frames"),
    ("timing", "to_pandas", "tables"),
    ("timing", "to_polars", "tables"),
}


# The rooms of the sub-packages, in their order. Some gather in their __init__ what their rooms offer.
INNER = {
    "segments": ("search", "determinants", "sines", "singularvalues", "residuals", "thrusts"),
    "areas": ("borders", "outlines", "region", "signs", "conditions", "admissible"),
    "anyangle": ("prepared", "straight", "meetings", "loops"),
    "curves": ("polynomials", "chords", "curve", "rounding"),
    "pacing": ("limits", "speeds", "laws", "jerks", "rests", "routes", "pacedgait", "pace", "servos"),
    "compact": ("rasters", "bits", "sweeps", "bottlenecks", "walks"),
    "optimal": ("splines", "corridors", "programs", "efforts", "levels", "tours", "optima", "optimum"),
    "retargeting": ("retargeted", "nearest"),
    "joints": ("joint", "limits", "presets", "maps", "files", "inverse"),
    "formats": (
        "options", "columns", "texts", "arrays", "matlab", "scripts", "parquet", "trajectories", "storages", "bags",
        "headers", "pictures", "svgs", "gifs",
    ),
    "reading": ("values", "header", "columns", "lines", "csvs", "jsons", "files"),
    "plots": ("vehicles", "roots", "types", "regions", "gaits", "flights", "basins"),
    "flight": (
        "settings", "servos", "references", "engine", "allocation", "clocks", "courses", "rendering", "films",
        "outputs", "records", "controllers", "disturbances", "simulation", "viewing", "basins",
    ),
    "study": (
        "axes", "fleets", "sources", "designs", "cases", "charts", "clusters", "datasets", "pages", "running",
    ),
    "explorer": ("state", "jobs", "maps", "answers", "tables", "guards", "server"),
}  # fmt: skip

# Those of the sub-package cli: what commands share, in order, and the files of commands, which import only that.
CLI = ("commands", "options", "terminal")
SHARED = (*CLI, "flights")  # the last by those that fly, and loaded by no other
COMMANDS = (
    "plan", "region", "optimising", "pacing", "cycles", "judge", "roots", "write", "vehicles", "exploring", "flying",
    "basins", "study",
)  # fmt: skip


def source_of(module: str) -> str:
    """Return the source of a room, all of it if the room is a sub-package."""
    single = PACKAGE / f"{module}.py"
    parts = [single] if single.exists() else sorted((PACKAGE / module).glob("*.py"))
    return "\n".join(part.read_text().replace("from __future__ import annotations\n", "") for part in parts)


def imports(module: str) -> list[tuple[str, str | None]]:
    """Return the rooms that a module imports, each with the function that does it (None at the top)."""
    tree = ast.parse(source_of(module))
    found: list[tuple[str, str | None]] = []

    def visit(node: ast.AST, function: str | None) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and getattr(child.test, "id", "") == "TYPE_CHECKING":
                continue
            if isinstance(child, ast.ImportFrom) and (child.module or "").startswith("gaitgraph."):
                found.append(((child.module or "").split(".")[1], function))
            elif isinstance(child, ast.ImportFrom) and child.module == "gaitgraph":
                found.extend((alias.name, function) for alias in child.names if alias.name != "__version__")
            inside = child.name if isinstance(child, ast.FunctionDef) and function is None else function
            visit(child, inside)

    visit(tree, None)
    return found


def test_each_room_imports_only_from_rooms_before_it() -> None:
    rooms = {path.stem for path in PACKAGE.glob("*.py")} | {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert rooms == {*ORDER, "__init__"}
    delegations = set()
    for position, module in enumerate(ORDER):
        for room, function in imports(module):
            if room == module and room in (*INNER, "cli"):
                continue  # its own order is tested below
            if ORDER.index(room) >= position:
                assert function is not None, f"{module} imports {room}, which comes later"
                delegations.add((module, function, room))
    assert delegations == DELEGATIONS


@pytest.mark.parametrize("package", INNER)
def test_the_rooms_of_a_sub_package_import_only_from_those_before_them(package: str) -> None:
    rooms = INNER[package]
    assert {path.stem for path in (PACKAGE / package).glob("*.py")} == {*rooms, "__init__"}
    for position, module in enumerate(rooms):
        tree = ast.parse((PACKAGE / package / f"{module}.py").read_text())
        only_typed = {
            inside
            for block in tree.body
            if isinstance(block, ast.If) and getattr(block.test, "id", "") == "TYPE_CHECKING"
            for inside in ast.walk(block)
        }
        for node in ast.walk(tree):
            if node in only_typed:
                continue
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"gaitgraph.{package}."):
                assert rooms.index((node.module or "").split(".")[2]) < position, module


def test_the_files_of_the_command_line_import_only_what_commands_share() -> None:
    assert {path.stem for path in (PACKAGE / "cli").glob("*.py")} == {*SHARED, *COMMANDS, "__init__"}
    for module in (*SHARED, *COMMANDS, "__init__"):
        allowed = SHARED[: SHARED.index(module)] if module in SHARED else SHARED
        tree = ast.parse((PACKAGE / "cli" / f"{module}.py").read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("gaitgraph.cli"):
                assert (node.module or "").removeprefix("gaitgraph.cli").removeprefix(".") in allowed, module


def test_every_command_is_in_the_file_that_is_told() -> None:
    told = {(file, name) for name, file in cli._FILES.items()}
    there = {
        (file, name.removesuffix("_command").replace("_", "-"))
        for file in COMMANDS
        for name, value in vars(import_module(f"gaitgraph.cli.{file}")).items()
        if isinstance(value, click.Command)
    }
    assert told == there
    for name in cli._FILES:
        assert cli.cli.commands[name].name == name
        assert isinstance(cli.cli.commands[name], cli.commands.Command)


def test_the_docstring_tells_the_same_order() -> None:
    assert gg.__doc__ is not None
    told = gg.__doc__.split("in order:")[1].replace("\n", " ").strip(" .")
    assert tuple(name.strip() for name in told.split(",")) == ORDER[:-1]


def test_no_public_name_is_a_room_too() -> None:
    """Importing a room binds its name in the package, over whatever had it."""
    assert not set(gg.__all__) & set(ORDER)


def loaded_by(code: str) -> set[str]:
    heavy = "{'numpy', 'scipy', 'networkx', 'shapely', 'matplotlib', 'click'}"
    script = f"{code}\nimport sys\nprint(*sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_help_loads_nothing_heavy() -> None:
    assert loaded_by("import gaitgraph") == set()
    # One after the other in one process: what a command loaded would be there at the end.
    told = [["--help"], ["--version"], *([command, "--help"] for command in cli._FILES)]
    run = (
        f"import gaitgraph.cli as c\nfor told in {told}:\n"
        "    try:\n        c.main(told)\n    except SystemExit:\n        pass"
    )
    assert loaded_by(run) <= {"click"}


def test_a_command_loads_no_file_of_another() -> None:
    script = (
        "import sys\nfrom gaitgraph.cli import main\n"
        "try:\n    main(['roots', '--help'])\nexcept SystemExit:\n    pass\n"
        "print(*(name.split('.')[2] for name in sys.modules if name.startswith('gaitgraph.cli.')))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert set(done.stdout.splitlines()[-1].split()) == {*CLI, "roots"}


def test_planning_loads_shapely_only_for_polygons() -> None:
    plan = "import gaitgraph as gg\np = gg.plan_loop([(0.5, -0.5)]{})"
    assert "shapely" not in loaded_by(plan.format(""))
    assert "shapely" in loaded_by(plan.format(", keep_out=[[(0, 0), (0.1, 0), (0, 0.1)]]"))
    assert "scipy" not in loaded_by(plan.format(""))


def test_every_public_name_is_there_and_known_to_type_checkers() -> None:
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    typed = {
        alias.name
        for block in tree.body
        if isinstance(block, ast.If)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
    assert typed | {"__version__"} == set(gg.__all__)
    for name in gg.__all__:
        assert getattr(gg, name) is not None
    assert set(dir(gg)) == set(gg.__all__)
    try:
        gg.nothing  # noqa: B018
    except AttributeError as error:
        assert "no attribute 'nothing'" in str(error)


def test_modules_say_what_they_offer() -> None:
    for module in ORDER[:-1]:
        tree = ast.parse(source_of(module))
        names = {node.name for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
        names |= {
            target.id
            for node in tree.body
            if isinstance(node, (ast.Assign, ast.AnnAssign))
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
            if isinstance(target, ast.Name)
        }
        offered = next(
            ast.literal_eval(node.value)
            for node in tree.body
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
        )
        assert set(offered) <= names, module
