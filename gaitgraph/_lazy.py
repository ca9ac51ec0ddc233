"""Names and pictures that are loaded when they are first used, so that importing the package costs nothing.

A package states each of its names once, in the imports of its ``if TYPE_CHECKING:`` block. Type checkers read them
there; at run time :func:`lazy_names` reads the same block and imports a name's module when the name is asked for.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes


@cache
def lazy_modules(package: str) -> dict[str, str]:
    """Return the module of each public name of a package. A subpackage is its own module."""
    import ast

    spec = sys.modules[package].__spec__
    source = spec.loader.get_source(package)  # type: ignore[union-attr]  # a package of source files has both
    block = next(node for node in ast.parse(source).body if isinstance(node, ast.If))
    found = {}
    for node in block.body:
        if not isinstance(node, ast.ImportFrom):
            raise TypeError(
                f"{package}: the block of public names must hold imports only"
            )
        for name in node.names:
            found[name.name] = (
                f"{package}.{name.name}" if node.module == package else str(node.module)
            )
    return found


def lazy_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the ``__getattr__`` and the ``__dir__`` of a package whose names are loaded on first use."""

    def public() -> list[str]:  # what __all__ has, which __getattr__ gives
        return sorted(
            name
            for name, module in lazy_modules(package).items()
            if module != f"{package}.{name}"
        )

    def getattr_(name: str) -> Any:
        if name == "__all__":
            return public()
        module = None if name.startswith("__") else lazy_modules(package).get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        loaded = import_module(module)
        value = loaded if module == f"{package}.{name}" else getattr(loaded, name)
        setattr(sys.modules[package], name, value)
        return value

    return getattr_, lambda: sorted(lazy_modules(package))


class Pictured:
    """Base of the objects that have a picture, which :mod:`gaitgraph.plots.gaits` draws."""

    __slots__ = ()

    def plot(self: Any, *, ax: Axes | None = None) -> Axes:
        """Draw the object on axes, by default those of a new figure; see :func:`gaitgraph.plots.plot`."""
        from gaitgraph.plots.gaits import plot

        return plot(self, ax=ax)

    def _repr_html_(self: Any) -> str:
        from gaitgraph.plots.gaits import html_of

        return html_of(self)
