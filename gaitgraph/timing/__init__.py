"""Timing: laws over a period, limits of the servos, the least period, timed gaits and their vertices."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.timing.curve import (
        Curve as Curve,
        Rounding as Rounding,
        rounded as rounded,
    )
    from gaitgraph.timing.joining import (
        JoinedPath as JoinedPath,
        RunUp as RunUp,
        played as played,
        run_up as run_up,
    )
    from gaitgraph.timing.limited_gait import LimitedGait as LimitedGait
    from gaitgraph.timing.limits import Limits as Limits
    from gaitgraph.timing.servo_lag import (
        ServoResponse as ServoResponse,
        servo_response as servo_response,
    )
    from gaitgraph.timing.time_optimal import (
        LeastPeriod as LeastPeriod,
        least_period as least_period,
        paced as paced,
    )
    from gaitgraph.timing.timed_gait import (
        Motion as Motion,
        TimedGait as TimedGait,
        TimedPath as TimedPath,
        table_of as table_of,
        timed_gait_of as timed_gait_of,
    )
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.timing.curve": ["Curve", "Rounding", "rounded"],
            "gaitgraph.timing.joining": ["JoinedPath", "RunUp", "played", "run_up"],
            "gaitgraph.timing.servo_lag": ["ServoResponse", "servo_response"],
            "gaitgraph.timing.limited_gait": ["LimitedGait"],
            "gaitgraph.timing.limits": ["Limits"],
            "gaitgraph.timing.time_optimal": [
                "LeastPeriod",
                "least_period",
                "paced",
            ],
            "gaitgraph.timing.timed_gait": [
                "Motion",
                "TimedGait",
                "TimedPath",
                "table_of",
                "timed_gait_of",
            ],
        },
    )
