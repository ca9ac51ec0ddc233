"""How far a configuration is from a singular matrix: tilt margin and worst attitude."""

from __future__ import annotations

__all__ = []
