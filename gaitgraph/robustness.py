"""A gait's robustness to attitude, beside that of its biased gaits."""

from __future__ import annotations

__all__ = []
