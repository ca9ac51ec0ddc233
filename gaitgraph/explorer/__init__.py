"""The explorer: a page on the loopback address on which gaits are planned by hand, and its server."""

from __future__ import annotations
