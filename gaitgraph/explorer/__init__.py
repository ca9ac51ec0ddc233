"""The explorer: a page on the loopback address on which gaits are planned by hand.

Everything is computed here by the package; the page under ``page/`` draws what it is told and holds no method of its
own. The rooms, in order: state, jobs, maps, answers, tables, guards, server.
"""

from __future__ import annotations

__all__: list[str] = []
