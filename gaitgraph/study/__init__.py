"""Studies: many flights, planned, checked and flown on Dask into a Parquet dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.study.design import Study as Study, read_study as read_study
    from gaitgraph.study.running import run_study as run_study
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.study.design": ["Study", "read_study"],
            "gaitgraph.study.running": ["run_study"],
        },
    )
