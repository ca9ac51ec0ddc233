"""Certificates: what proves a gait, and the short program that checks it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.certificates.making import Certified as Certified, certify as certify
    from gaitgraph.certificates.verifying import (
        Verified as Verified,
        verify as verify,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.certificates.making": ["Certified", "certify"],
            "gaitgraph.certificates.verifying": ["Verified", "verify"],
        },
    )
