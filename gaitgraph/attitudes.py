"""Singular and acceptable attitudes in the roll–pitch diagram, in closed form."""

from __future__ import annotations

__all__ = []
