"""The rules of valid and flyable, each checked along the whole gait, and the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.validation.any_rotors import validate_geometry as validate_geometry
    from gaitgraph.validation.report import Check as Check, Report as Report
    from gaitgraph.validation.validating import validate as validate
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.validation.any_rotors": ["validate_geometry"],
            "gaitgraph.validation.report": ["Check", "Report"],
            "gaitgraph.validation.validating": ["validate"],
        },
    )
