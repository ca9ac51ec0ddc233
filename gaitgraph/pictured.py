"""The base of the objects that have a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gaitgraph import later
from gaitgraph.errors import MissingExtra
from gaitgraph.records import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Pictured(Record):
    """Base of the objects that have a picture, which :mod:`gaitgraph.plots.gaits` draws."""

    __slots__ = ()

    @property
    def _shown(self) -> Any:
        """What its picture shows: itself, or the gait that is its answer; None if there is none."""
        return self

    def plot(self: Any, ax: Axes | None = None) -> Axes:
        """Draw the object on axes, by default those of a new figure; see :func:`gaitgraph.plots.plot`."""
        return later.plot(self, ax=ax)

    def _repr_html_(self: Any) -> str:
        return later.html_of(self)


def pandas() -> Any:
    """Return the library pandas, for methods called `to_pandas`; MissingExtra if it is not installed."""
    try:
        import pandas
    except ImportError as error:
        raise MissingExtra(
            "to_pandas needs pandas. Install it with: pip install pandas"
        ) from error
    return pandas
