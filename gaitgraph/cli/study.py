"""The command study: plan, check and fly many cases, on as many processes as there are."""

from __future__ import annotations

import logging
from datetime import timedelta
from pathlib import Path
from typing import Any

from gaitgraph.cli import (
    Working,
    command,
    file,
    flag,
    named_in_errors,
    option,
    print_problem,
    show,
    tell,
)


@command(
    "Plan, check and fly many cases of vehicles, gaits and attitudes.",
    file("study_file", "STUDY.toml"),
    option(
        "--output",
        "FOLDER",
        "Folder of the results.  [default: the file's name without .toml]",
    ),
    option(
        "--workers",
        "N",
        "Local worker processes; 0 flies in this process.  [default: one a core]",
    ),
    option(
        "--scheduler",
        "ADDRESS",
        "Address of a Dask scheduler whose workers are used: tcp://HOST:PORT.",
    ),
    flag("--dry-run", "Count the cases and fly none."),
    "json",
)
def study_command(
    study_file: str, output: str | None = None, dry_run: bool = False, **given: Any
) -> int:
    """Fly every case of a study, and write a row for each to a Parquet dataset.

    The folder gets study.json, certificates, and rows/part-….parquet, each written when its cases are done.
    After an interruption the same command continues. The exit code is 0 once all rows are written, whatever the
    flights did. Needs mujoco, dask and pyarrow: pip install 'gaitgraph[study]'.
    """
    from gaitgraph.study.design import read_study
    from gaitgraph.study.running import run_study

    study = read_study(study_file)
    if dry_run:
        counts = {
            "cases": len(study),
            "parts": len(study.batches),
            "seconds_on_one_process": study.seconds,
        }
        estimate = f"about {timedelta(seconds=round(study.seconds))} on one process; nothing was flown"
        return tell(
            {"study": study.name, "fingerprint": study.fingerprint, **counts},
            [str(study), estimate],
        )
    folder = Path(output) if output is not None else Path(Path(study_file).stem)
    logging.disable()  # what ends a study is one line; Dask would log it too
    try:
        with Working(f"study {study.name}") as progress, named_in_errors(given):
            run = run_study(study, folder, progress=progress, **given)
    except KeyboardInterrupt:
        parts = len(list((folder / "rows").glob("part-*.parquet")))
        kept = f"{parts} of {len(study.batches)} parts are in {str(folder)!r}"
        print_problem(f"interrupted; {kept}; run the same command again to continue")
        return 130
    finally:
        logging.disable(logging.NOTSET)
    return show(run, ok=True)
