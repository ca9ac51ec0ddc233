"""Gaits and tables: loops lifted to four angles, and rows that are closed and completed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.gait.gait import Gait as Gait, lift as lift, vertices as vertices
    from gaitgraph.gait.given import gait_of as gait_of
    from gaitgraph.gait.table import Table as Table
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.gait.gait": ["Gait", "lift", "vertices"],
            "gaitgraph.gait.given": ["gait_of"],
            "gaitgraph.gait.table": ["Table"],
        },
    )
