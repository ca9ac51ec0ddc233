"""Every figure of the paper, drawn from the package's own results."""

from __future__ import annotations

__all__ = []
