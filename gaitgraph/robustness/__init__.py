"""How robust a gait is to attitude, a gait beside its biased gaits, and how wrong servos and drags may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.invertibility.error_margins import (
        ErrorMargin as ErrorMargin,
        drag_margin as drag_margin,
        servo_margin as servo_margin,
    )
    from gaitgraph.robustness.attitudes import (
        AcceptableAttitudes as AcceptableAttitudes,
        SingularCurve as SingularCurve,
        acceptable_attitudes as acceptable_attitudes,
        singular_curve as singular_curve,
    )
    from gaitgraph.robustness.biased import (
        Robustness as Robustness,
        RobustnessReport as RobustnessReport,
        robustness_of as robustness_of,
    )
    from gaitgraph.robustness.comparing import (
        Comparison as Comparison,
        comparison_of as comparison_of,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.robustness.attitudes": [
                "AcceptableAttitudes",
                "SingularCurve",
                "acceptable_attitudes",
                "singular_curve",
            ],
            "gaitgraph.robustness.biased": [
                "Robustness",
                "RobustnessReport",
                "robustness_of",
            ],
            "gaitgraph.robustness.comparing": ["Comparison", "comparison_of"],
            "gaitgraph.invertibility.error_margins": [
                "ErrorMargin",
                "drag_margin",
                "servo_margin",
            ],
        },
    )
