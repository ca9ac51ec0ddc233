"""The rules of valid and flyable, each checked along the whole gait, and the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.validation.report import Check as Check, Report as Report
    from gaitgraph.validation.validating import (
        GeometryReport as GeometryReport,
        validate as validate,
        validate_geometry as validate_geometry,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.validation.report": ["Check", "Report"],
            "gaitgraph.validation.validating": [
                "GeometryReport",
                "validate",
                "validate_geometry",
            ],
        },
    )
