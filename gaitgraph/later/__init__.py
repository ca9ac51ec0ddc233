"""What records do by packages that come later in the order of imports: the only place that points against it.

A package imports only from those before it. Some methods need one that comes after: ``Gait.check`` needs the rules,
``Gait.parametrize`` the timing, ``TimedGait.write`` the formats, ``plot`` the pictures. They call it by its name here,
and it is loaded then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.io.columns import (
        checked_table as checked_table,
        table_from_frame as table_from_frame,
    )
    from gaitgraph.io.formats import (
        check_outputs as check_outputs,
        read_table as read_table,
        tables_and_films as tables_and_films,
        unchecked_table as unchecked_table,
        write_tables as write_tables,
    )
    from gaitgraph.optimization.retargeting import retarget as retarget
    from gaitgraph.plots.films import write_films as write_films
    from gaitgraph.plots.flights import write_flight as write_flight
    from gaitgraph.plots.gaits import html_of as html_of, plot as plot
    from gaitgraph.timing.laws import LawName as LawName
    from gaitgraph.timing.lifted_gait import gait_with_law as gait_with_law
    from gaitgraph.timing.timed_gait import (
        TimedGait as TimedGait,
        checked_clock as checked_clock,
    )
    from gaitgraph.validation.report import (
        Check as Check,
        CheckOptions as CheckOptions,
        Report as Report,
        limit_check as limit_check,
    )
    from gaitgraph.validation.validating import (
        check_gait as check_gait,
        validate as validate,
    )
    from gaitgraph.validation.worst import worst_of as worst_of
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.io.columns": ["checked_table", "table_from_frame"],
            "gaitgraph.io.formats": [
                "check_outputs",
                "read_table",
                "tables_and_films",
                "unchecked_table",
                "write_tables",
            ],
            "gaitgraph.optimization.retargeting": ["retarget"],
            "gaitgraph.plots.flights": ["write_flight"],
            "gaitgraph.plots.gaits": ["html_of", "plot"],
            "gaitgraph.plots.films": ["write_films"],
            "gaitgraph.timing.laws": ["LawName"],
            "gaitgraph.timing.lifted_gait": ["gait_with_law"],
            "gaitgraph.timing.timed_gait": ["TimedGait", "checked_clock"],
            "gaitgraph.validation.report": [
                "Check",
                "CheckOptions",
                "Report",
                "limit_check",
            ],
            "gaitgraph.validation.validating": ["check_gait", "validate"],
            "gaitgraph.validation.worst": ["worst_of"],
        },
    )
