"""Studies: vehicles, gaits, biases, periods and initial attitudes crossed, planned, checked and flown."""

from __future__ import annotations

from gaitgraph.study.designs import Case, Study, read_study, study_from_mapping
from gaitgraph.study.running import StudyRun, run_study

__all__ = ["Case", "Study", "StudyRun", "read_study", "run_study", "study_from_mapping"]
