"""Names that are loaded, and values that are computed, when they are first used.

So importing the package costs nothing.

A package states its names in the imports of its ``if TYPE_CHECKING:`` block, for type checkers, and in a table beside it,
from which :func:`lazy_names` imports a name's module when the name is asked for. A test compares the two.
"""

from __future__ import annotations

import functools
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from functools import cached_property as cached_property  # noqa: PLC0414
else:

    class cached_property(functools.cached_property):  # noqa: N801 - as in functools
        """The one of functools without its lock, which threads that work on different objects share in Python 3.11."""

        def __get__(self, instance, owner=None):
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value


_MODULES: dict[str, dict[str, str]] = {}


def lazy_modules(package: str) -> dict[str, str]:
    """Return the module of each public name of a package. A subpackage is its own module."""
    return _MODULES[package]


def lazy_names(
    package: str, table: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the ``__getattr__`` and the ``__dir__`` of a package whose names are loaded on first use.

    The table has the public names of each module; those of the package itself are its subpackages and modules.
    """
    modules = _MODULES.setdefault(package, {})
    for module, names in table.items():
        for name in names:
            modules[name] = f"{package}.{name}" if module == package else module

    def public() -> list[str]:  # what __all__ has, which __getattr__ gives
        return sorted(
            name for name, module in modules.items() if module != f"{package}.{name}"
        )

    def getattr_(name: str) -> Any:
        if name == "__all__":
            return public()
        module = None if name.startswith("__") else modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        loaded = import_module(module)
        value = loaded if module == f"{package}.{name}" else getattr(loaded, name)
        setattr(sys.modules[package], name, value)
        return value

    return getattr_, lambda: sorted(modules)
