"""The command study: plan, check and fly many cases, on as many processes as there are."""

from __future__ import annotations

import logging
from datetime import timedelta
from pathlib import Path

import click

from gaitgraph.cli.options import Whole, json_option
from gaitgraph.cli.output import print_problem, show, tell, working


@click.command(
    "study",
    short_help="Plan, check and fly many cases of vehicles, gaits and attitudes.",
)
@click.argument("study_file", metavar="STUDY.toml", type=click.Path())
@click.option(
    "--output",
    type=click.Path(file_okay=False),
    metavar="FOLDER",
    show_default="the file's name without .toml",
    help="Folder of the results.",
)
@click.option(
    "--workers",
    type=Whole(min=0),
    show_default="one a core",
    help="Local worker processes; 0 flies in this process.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Address of a Dask scheduler whose workers are used: tcp://HOST:PORT.",
)
@click.option("--dry-run", is_flag=True, help="Count the cases and fly none.")
@json_option
def study_command(
    study_file: str,
    output: str | None,
    workers: int | None,
    scheduler: str | None,
    dry_run: bool,
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
    folder = Path(output or Path(study_file).stem)
    logging.disable()  # what ends a study is one line; Dask would log it too
    try:
        with working(f"study {study.name}") as progress:
            run = run_study(
                study,
                folder,
                workers=workers,
                scheduler=scheduler,
                progress=progress,
            )
    except KeyboardInterrupt:
        parts = len(list((folder / "rows").glob("part-*.parquet")))
        kept = f"{parts} of {len(study.batches)} parts are in {str(folder)!r}"
        print_problem(f"interrupted; {kept}; run the same command again to continue")
        return 130
    finally:
        logging.disable(logging.NOTSET)
    return show(run, ok=True)
