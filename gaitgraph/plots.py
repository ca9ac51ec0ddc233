"""Pictures of surfaces, graphs, gaits and attitudes; each takes axes and returns them."""

from __future__ import annotations

__all__ = []
