"""The command study: plan, check and fly many cases, on as many processes as there are."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph.cli import options
from gaitgraph.cli.terminal import Working, print_json, print_problem, print_text, show

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

_ONCE = 3.0  # seconds in which further signals are the same wish


class _Stopped(KeyboardInterrupt):
    """A signal asked for the end; its argument is the number of the signal."""


@contextmanager
def _ended_in_order() -> Iterator[None]:
    """Turn the signals that ask for an end into an exception, so that workers, keys and locks go with the study.

    A second one shortly after does not disturb the clearing up. Afterwards they mean what they meant before; but once
    one has come, they are left alone: the process is about to end.
    """
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    signals = [getattr(signal, name) for name in names if hasattr(signal, name)]
    # An ignored SIGHUP is that of nohup; and only the main thread may have handlers.
    heard = [one for one in signals if signal.getsignal(one) not in (signal.SIG_IGN, None)]
    if threading.current_thread() is not threading.main_thread():
        heard = []
    last: float | None = None

    def stop(number: int, _: FrameType | None) -> None:
        nonlocal last
        if last is None or monotonic() - last > _ONCE:
            last = monotonic()
            raise _Stopped(number)

    before = [signal.signal(one, stop) for one in heard]
    try:
        yield
    finally:
        for one, handler in zip(heard, before, strict=True):
            signal.signal(one, handler if last is None else signal.SIG_IGN)


@options.command("Plan, check and fly many cases: vehicles, gaits, biases, periods, attitudes.")
@options.file("study_file", "STUDY.toml")
@options.option("--output", "FOLDER", "Of the rows.  [default: the file's name without .toml]")
@options.option("--workers", "N", "Processes here; 0 for this one.  [default: one a core]")
@options.option("--scheduler", "ADDRESS", "A Dask scheduler whose workers fly instead: tcp://HOST:PORT.")
@options.flag("--yes", "Fly more than 10,000 cases, or for more than an hour.")
@options.flag("--dry-run", "Count the cases and fly none.")
@options.as_json
def study_command(
    study_file: str,
    output: str | None = None,
    dry_run: bool = False,
    as_json: bool = False,
    **given: Any,
) -> int:
    """Fly every case of a study, and write a row for each to a Parquet dataset.

    The folder gets study.json, rows/part-….parquet, each written when its cases are done, and at the end summary.html.
    Interrupted or killed, the same command goes on where it stopped. The exit code is 0 once all rows are there,
    whatever came of the cases. Needs mujoco, dask and pyarrow: pip install 'gaitgraph[study]'.
    """
    from gaitgraph.study.design import read_study
    from gaitgraph.study.running import run_study, time_text

    study = read_study(study_file)
    if dry_run:
        seconds = study.seconds(1)
        counts = {"cases": len(study), "parts": len(study.batches), "seconds_on_one_process": seconds}
        if as_json:
            print_json({"study": study.name, "fingerprint": study.fingerprint, **counts})
        else:
            print_text(f"{study}\nabout {time_text(seconds)} on one process; nothing was flown")
        return 0
    folder = Path(output) if output is not None else Path(Path(study_file).stem)
    try:
        with _ended_in_order(), Working(f"study {study.name}") as progress:
            run = run_study(study, folder, progress=progress, **given)
    except KeyboardInterrupt as error:
        number = error.args[0] if isinstance(error, _Stopped) else signal.SIGINT
        parts = len(list((folder / "rows").glob("part-*.parquet")))
        with suppress(OSError):  # the terminal may be gone
            print_problem(
                f"{'interrupted' if number == signal.SIGINT else 'terminated'}; {parts} of {len(study.batches)} parts are "
                f"in {str(folder)!r}, and the same command goes on from there"
            )
        return 128 + number
    show(run, as_json=as_json)
    return 0
