"""The base of the objects that have a picture. It calls the pictures when one is asked for, and loads them then."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
