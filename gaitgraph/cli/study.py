"""The command study: plan, check and fly many cases, on as many processes as there are."""

from __future__ import annotations

import signal
from contextlib import contextmanager, suppress
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gaitgraph.cli import Working, command, file, flag, option, print_json, print_problem, show, wants_json

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType


class _Stopped(KeyboardInterrupt):
    """A signal asked for the end; its argument is the number of the signal."""


@contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Turn the signals that ask for an end into an exception, so that workers, keys and locks go with the study."""

    def stop(number: int, _: FrameType | None) -> None:
        for one in before:  # a second one does not disturb the clearing up
            signal.signal(one, signal.SIG_IGN)
        raise _Stopped(number)

    known = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    # An ignored SIGHUP is that of nohup.
    before = {one: signal.getsignal(one) for one in known if signal.getsignal(one) is not signal.SIG_IGN}
    try:
        for one in before:
            signal.signal(one, stop)
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


@command(
    "Plan, check and fly many cases: vehicles, gaits, biases, periods, attitudes.",
    file("study_file", "STUDY.toml"),
    option("--output", "FOLDER", "Folder of the results.  [default: the file's name without .toml]"),
    option("--workers", "N", "Local worker processes; 0 flies in this process.  [default: one a core]"),
    option("--scheduler", "ADDRESS", "Address of a Dask scheduler whose workers are used: tcp://HOST:PORT."),
    flag("--yes", "Fly more than 10,000 cases, or for more than an hour."),
    flag("--dry-run", "Count the cases and fly none."),
    "json",
)
def study_command(study_file: str, output: str | None = None, dry_run: bool = False, **given: Any) -> int:
    """Fly every case of a study, and write a row for each to a Parquet dataset.

    The folder gets study.json, rows/part-….parquet, each written when its cases are done, and at the end summary.html.
    After an interruption the same command continues. The exit code is 0 once all rows are written, whatever the
    flights did. Needs mujoco, dask and pyarrow: pip install 'gaitgraph[study]'.
    """
    from gaitgraph.study.design import read_study
    from gaitgraph.study.running import run_study

    study = read_study(study_file)
    if dry_run:
        counts = {"cases": len(study), "parts": len(study.batches), "seconds_on_one_process": study.seconds}
        if wants_json():
            print_json({"study": study.name, "fingerprint": study.fingerprint, **counts})
        else:
            click.echo(f"{study}\nabout {timedelta(seconds=round(study.seconds))} on one process; nothing was flown")
        return 0
    folder = Path(output) if output is not None else Path(Path(study_file).stem)
    try:
        with _stopped_by_signals(), Working(f"study {study.name}") as progress:
            run = run_study(study, folder, progress=progress, **given)
    except _Stopped as error:
        (number,) = error.args
        parts = len(list((folder / "rows").glob("part-*.parquet")))
        with suppress(OSError):  # the terminal may be gone
            print_problem(
                f"{'interrupted' if number == signal.SIGINT else 'terminated'}; {parts} of {len(study.batches)} parts "
                f"are in {str(folder)!r}; run the same command again to continue"
            )
        return 128 + int(number)
    return show(run, ok=True)
