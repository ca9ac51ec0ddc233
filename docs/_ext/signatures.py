"""Signatures as the source writes them, for autodoc: constants by their values, literal kinds spelled out."""

from __future__ import annotations

import ast
import inspect
import sys
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from sphinx.util.inspect import TypeAliasForwardRef

if TYPE_CHECKING:
    from sphinx.application import Sphinx


@cache
def literal_named(name: str) -> ast.expr | None:
    """Return ``Literal[...]`` for a name that some module of the package gives to one."""
    for module, content in list(sys.modules.items()):
        value = vars(content).get(name) if module.startswith("gaitgraph.") else None
        if get_origin(value) is Literal:
            return ast.parse(f"Literal{list(get_args(value))!r}", mode="eval").body
    return None


class Spelled(ast.NodeTransformer):
    """Spells out names of literal types."""

    def visit_Name(self, node: ast.Name) -> ast.expr:  # noqa: D102
        return literal_named(node.id) or node


def default_text(node: ast.expr, names: dict[str, Any]) -> str:
    """Return a default: the value of a constant, the call of a factory, or what stands there."""
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "field":
        for keyword in node.keywords:
            if keyword.arg == "default_factory":
                return f"{ast.unparse(keyword.value)}()"
    if isinstance(node, ast.Name | ast.Subscript):
        value = eval(ast.unparse(node), names)  # noqa: S307  a constant of the package
        if isinstance(value, int | str):
            return repr(value)
        if isinstance(value, float):
            return f"{value:.4g}"
    return ast.unparse(node)


def parameter(
    name: str,
    annotation: ast.expr | None,
    default: ast.expr | None,
    names: dict[str, Any],
) -> str:
    """Return one parameter."""
    text = (
        name
        if annotation is None
        else f"{name}: {ast.unparse(Spelled().visit(annotation))}"
    )
    return (
        text
        if default is None or is_bare_field(default)
        else f"{text} = {default_text(default, names)}"
    )


def is_bare_field(default: ast.expr) -> bool:
    """Return whether ``field(...)`` gives a field other properties than a default."""
    if not isinstance(default, ast.Call) or ast.unparse(default.func) != "field":
        return False
    return not any(
        word.arg in ("default", "default_factory") for word in default.keywords
    )


def signature_of_function(
    node: ast.FunctionDef, names: dict[str, Any], *, bound: bool
) -> tuple[str, str | None]:
    """Return parameters and return type of a function; those of a method without ``self`` or ``cls``."""
    given = node.args
    plain = [*given.posonlyargs, *given.args]
    defaults = [None] * (len(plain) - len(given.defaults)) + list(given.defaults)
    out = [
        parameter(arg.arg, arg.annotation, default, names)
        for arg, default in zip(plain, defaults, strict=True)
    ]
    out = out[1:] if bound else out
    if given.vararg:
        out.append(
            parameter(f"*{given.vararg.arg}", given.vararg.annotation, None, names)
        )
    elif given.kwonlyargs:
        out.append("*")
    out += [
        parameter(a.arg, a.annotation, d, names)
        for a, d in zip(given.kwonlyargs, given.kw_defaults, strict=True)
    ]
    if given.kwarg:
        out.append(
            parameter(f"**{given.kwarg.arg}", given.kwarg.annotation, None, names)
        )
    returned = (
        None if node.returns is None else ast.unparse(Spelled().visit(node.returns))
    )
    return f"({', '.join(out)})", returned


def signature_of_record(node: ast.ClassDef, names: dict[str, Any]) -> str:
    """Return the parameters of a dataclass: its fields, all by keyword."""
    fields = [
        parameter(item.target.id, item.annotation, item.value, names)
        for item in node.body
        if isinstance(item, ast.AnnAssign)
        and isinstance(item.target, ast.Name)
        and is_given(item.value)
    ]
    return f"({', '.join(['*', *fields])})"


def is_given(value: ast.expr | None) -> bool:
    """Return whether a field of a dataclass is a parameter."""
    if not isinstance(value, ast.Call):
        return True
    return not any(
        word.arg == "init" and ast.unparse(word.value) == "False"
        for word in value.keywords
    )


@cache
def tree_of(module: str) -> ast.Module:
    """Return a module's source as a tree."""
    return ast.parse(
        Path(str(sys.modules[module].__file__)).read_text(encoding="utf-8")
    )


def definition_of(obj: Any) -> ast.stmt | None:
    """Return the statement that defines a class, function or method of the package."""
    body: list[ast.stmt] = tree_of(obj.__module__).body
    found: ast.stmt | None = None
    for part in obj.__qualname__.split("."):
        named = [
            node
            for node in body
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == part
        ]
        if not named:
            return None
        found, body = named[-1], named[-1].body
    return found


def as_written(
    app: Sphinx,
    what: str,
    name: str,
    obj: Any,
    options: object,
    signature: str | None,
    returned: str | None,
) -> tuple[str, str | None] | None:
    """Return the signature as it is written in the source, or None where there is none."""
    if what not in ("class", "function", "method"):
        return None
    obj = inspect.unwrap(obj) if what != "class" else obj
    node, names = definition_of(obj), vars(sys.modules[obj.__module__])
    if isinstance(node, ast.ClassDef) and is_dataclass(obj):
        return signature_of_record(node, names), None
    if isinstance(node, ast.FunctionDef):
        static = any(
            ast.unparse(decorator) == "staticmethod"
            for decorator in node.decorator_list
        )
        return signature_of_function(node, names, bound=what == "method" and not static)
    return None


def alias_name(alias: TypeAliasForwardRef) -> str:
    """Return the name of an alias of autodoc_type_aliases."""
    return str(alias.name)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the signatures of this module; aliases inside other types, of properties, are shown by their names."""
    TypeAliasForwardRef.__repr__ = alias_name  # type: ignore[method-assign]
    app.connect("autodoc-process-signature", as_written)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
