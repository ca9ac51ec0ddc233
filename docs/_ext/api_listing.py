"""The directive ``api-listing``: every public name by package, with one line and a link to its own page.

The pages are written into the folder ``api`` when the site is built.
"""

from __future__ import annotations

import ast
import inspect
import re
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_origin

from sphinx.pycode import ModuleAnalyzer
from sphinx.util.docutils import SphinxDirective

import gaitgraph
from gaitgraph._lazy import lazy_modules

if TYPE_CHECKING:
    from docutils import nodes
    from sphinx.addnodes import pending_xref
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

ORDER = Path(__file__).parent.parent / "developers" / "architecture.md"
CODE = re.compile(r"(``.*?``|`[^`]*`)")
ROLE = re.compile(r":\w+:`~?([^`]+)`")  # in a summary, which has no class around it
FIRST = (
    "planning",
    "gait",
    "vehicle",
    "validation",
    "timing",
    "io",
    "robustness",
    "flight",
    "study",
    "optimization",
)
"""The packages that users need first; the others follow in the order of the architecture page."""
FIRST_NAME = "plan_loop"


def packages() -> list[str]:
    """Return the public packages in the order in which they are listed."""
    order = re.findall(r"^\| `(\w+)` \|", ORDER.read_text(encoding="utf-8"), re.M)
    return [name for name in dict.fromkeys((*FIRST, *order)) if name in dir(gaitgraph)]


def names_of(package: str) -> list[tuple[str, str]]:
    """Return a package's public names and where they are found: those at the top first."""
    here = import_module(f"gaitgraph.{package}")
    top = set(dir(gaitgraph)) - set(packages())
    found = [
        (f"gaitgraph.{package}", name)
        for name in dir(here)
        if not name.startswith("_") and name not in top
    ]
    found += [
        ("gaitgraph", name) for name in top if home_of(name).split(".")[1] == package
    ]

    def place(pair: tuple[str, str]) -> tuple[bool, bool, bool, bool, str]:
        where, name = pair
        value = getattr(import_module(where), name)
        return (
            name != FIRST_NAME,
            where != "gaitgraph",
            not inspect.isroutine(value),
            not inspect.isclass(value),
            name,
        )

    return sorted(found, key=place)


@cache
def home_of(name: str) -> str:
    """Return the module that a public name of the package comes from."""
    return lazy_modules("gaitgraph")[name]


def described(module: str, name: str, package: str) -> list[str]:
    """Return the lines that describe one name."""
    value = getattr(import_module(module), name)
    if inspect.isclass(value):
        options = (
            ["   :show-inheritance:"]
            if issubclass(value, BaseException)
            else ["   :members:"]
        )
        return [f".. autoclass:: {module}.{name}", *options, ""]
    if inspect.isroutine(value):
        return [f".. autofunction:: {module}.{name}", ""]
    home = home_of(name) if module == "gaitgraph" else f"gaitgraph.{package}"
    body = [f"   {line}" for line in docs_of(home, name)]
    is_type_alias = get_origin(value) is not None
    kind = [] if is_type_alias else [f"   :type: {type(value).__name__}"]
    return [f".. py:data:: {name}", f"   :module: {module}", *kind, "", *body, ""]


def docs_of(module: str, name: str) -> list[str]:
    """Return the docstring of a constant, which stands below it in its module."""
    return ModuleAnalyzer.for_module(module).find_attr_docs().get(("", name), [])


def summary_of(module: str, name: str, package: str) -> str:
    """Return the first sentence of a name's docstring."""
    value = getattr(import_module(module), name)
    if inspect.isroutine(value) or inspect.isclass(value):
        about = inspect.getdoc(value) or ""
    else:
        home = home_of(name) if module == "gaitgraph" else f"gaitgraph.{package}"
        about = " ".join(docs_of(home, name))
    paragraph = " ".join(about.partition("\n\n")[0].split())
    sentence = re.split(r"(?<=\.)\s", paragraph)[0]
    return escaped(ROLE.sub(r"``\1``", sentence))


def section_of(package: str) -> list[str]:
    """Return the lines of one package's section: the first paragraph of its docstring, and a table of its names."""
    names = names_of(package)
    if not names:
        return []
    module = f"gaitgraph.{package}"
    about = inspect.getdoc(import_module(module)) or ""
    lines = [module, "-" * len(module), "", f".. module:: {module}", ""]
    lines += [*about.partition("\n\n")[0].splitlines(), ""]
    lines += [".. list-table::", ""]
    for where, name in names:
        shown = f"{where}.{name}".replace("gaitgraph", "gg", 1)
        lines += [f"   * - :py:obj:`{shown} <{where}.{name}>`"]
        lines += [f"     - {summary_of(where, name, package)}"]
    return [*lines, ""]


class ApiListing(SphinxDirective):
    """One section for each package that has public names."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        lines = [line for package in packages() for line in section_of(package)]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def write_pages(app: Sphinx) -> None:
    """Write the page of each public name, and remove those of names that are gone."""
    folder = Path(app.srcdir) / "api"
    folder.mkdir(exist_ok=True)
    texts = {}
    for package in packages():
        for where, name in names_of(package):
            title = f"{where}.{name}"
            lines = [":orphan:", "", title, "=" * len(title), ""]
            lines += [f".. currentmodule:: {where}", ""]
            lines += described(where, name, package)
            texts[folder / f"{title}.rst"] = "\n".join(lines)
    for path in folder.iterdir():
        if path not in texts:
            path.unlink()
    for path, text in texts.items():
        # A page that stays as it is need not be read again.
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def keep_bars(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Keep reStructuredText from reading |α| in a docstring as a substitution."""
    for k, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            lines[k] = escaped(line)


def escaped(line: str) -> str:
    """Return a line of a docstring with its bars escaped, outside code."""
    parts = CODE.split(line)
    parts[::2] = [re.sub(r"(?<!\\)\|", r"\\|", part) for part in parts[::2]]
    return "".join(parts)


def find_public_name(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, contnode: nodes.TextElement
) -> nodes.Node | None:
    """Resolve a name by its home, as docstrings write it; what exists and has no entry here stays plain text."""
    if node.get("refdomain") != "py":
        return None
    path = node["reftarget"].split(".")
    if path[-1] in dir(gaitgraph) and path[0] in ("gaitgraph", path[-1]):
        python = env.get_domain("py")
        target = f"gaitgraph.{path[-1]}"
        return python.resolve_xref(
            env, node["refdoc"], app.builder, node["reftype"], target, node, contnode
        )
    return contnode if is_known(path) else None


def is_known(path: list[str]) -> bool:
    """Return whether a dotted name exists: in the package, in a class of it, or where the package imports from."""
    if path[0] == "gaitgraph":
        return any(holds(".".join(path[:k]), path[k:]) for k in range(1, len(path)))
    return path[0] in imported_names() or any(
        holds(module, path) for module in modules()
    )


def holds(module: str, path: list[str]) -> bool:
    """Return whether a module has an attribute of an attribute … of that name; a field of a record is one."""
    try:
        value: Any = import_module(module)
    except ImportError:
        return False
    for name in path:
        if not hasattr(value, name):
            return False
        value = getattr(value, name)
    return True


@cache
def modules() -> tuple[str, ...]:
    """Return the modules of the package, those of its sub-packages too, by their files."""
    root = Path(gaitgraph.__file__).parent
    files = sorted(
        file.relative_to(root.parent).with_suffix("") for file in root.rglob("*.py")
    )
    return tuple(
        ".".join(file.parts).removesuffix(".__init__")
        for file in files
        if file.stem != "__main__"
    )


@cache
def imported_names() -> frozenset[str]:
    """Return the names that the package imports from elsewhere, for type checking too, and where from.

    Types that exist only for type checking (such as ``GaitLike``) are among them.
    """
    names: set[str] = set()
    for file in Path(gaitgraph.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import | ast.ImportFrom):
                home = node.module if isinstance(node, ast.ImportFrom) else None
                if home is None or not home.startswith("gaitgraph"):
                    names |= {
                        (home or alias.name).partition(".")[0] for alias in node.names
                    }
                    names |= {alias.asname or alias.name for alias in node.names}
            elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                for part in node.body:
                    if isinstance(part, ast.Assign):
                        names |= {ast.unparse(target) for target in part.targets}
                    elif isinstance(part, ast.AnnAssign):
                        names.add(ast.unparse(part.target))
    return frozenset(names)


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the directive known, and read docstrings as they are written."""
    app.add_directive("api-listing", ApiListing)
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-docstring", keep_bars)
    app.connect("missing-reference", find_public_name)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
