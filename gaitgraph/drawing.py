"""What every picture shares: axes in multiples of π, colors and markers, deterministic files."""

from __future__ import annotations

__all__ = []
