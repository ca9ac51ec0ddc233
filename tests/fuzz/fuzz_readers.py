"""Coverage-guided fuzzing of everything that reads what users bring: tables, requests, vehicles, angles.

Run it for a minute, with the seeds beside it::

    python tests/fuzz/fuzz_readers.py -max_total_time=60 tests/fuzz/seeds

Whatever the bytes, there are two outcomes: an answer that serialises, or one of the package's own errors in one line.
The first byte chooses the reader. Anything else, a warning too that is no FileWarning, is a finding, which is written
to a file crash-….
"""

from __future__ import annotations

import json
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import atheris

with atheris.instrument_imports(include=["gaitgraph"]):
    from gaitgraph.angles import angle_from_text
    from gaitgraph.errors import FileWarning, GaitgraphError
    from gaitgraph.gait.given import gait_of
    from gaitgraph.io import binary_tables, text_files
    from gaitgraph.io.exporting import export
    from gaitgraph.io.formats import read_table
    from gaitgraph.planning.request import colorings_of_file, read_request
    from gaitgraph.validation.validating import validate
    from gaitgraph.vehicle import vehicle_named

KINDS = (".csv", ".json", "request", "vehicle", "angle", ".npz", ".parquet")
"""The readers, chosen by the letters A to G; scipy's of MAT files may end the process on wrong sizes."""

LATE = (
    binary_tables,
    text_files,
)  # imported when a file of theirs is read, which would be too late here
FOLDER = Path(tempfile.mkdtemp(prefix="gaitgraph-fuzz-"))


def serialised(content: Any) -> None:
    """Write an answer as JSON, which has no NaN and no infinity."""
    json.dumps(content, allow_nan=False)


def judged(path: Path) -> None:
    """Read, judge, list the colorings, export, and read back."""
    report = validate(path)
    serialised(report.as_mapping())
    str(report)
    serialised(colorings_of_file(path).as_mapping())
    table = read_table(path)
    gait_of(table).check()
    again = FOLDER / "again.json"
    export(path, [again], samples=5, force=True)
    if not validate(again)["closed"].ok:
        raise AssertionError("an exported table is not closed")


def one_input(data: bytes) -> None:
    """Give the bytes to the reader that the first of them chooses."""
    if not data:
        return
    kind, content = (data[0] - ord("A")) % len(KINDS), data[1:]
    try:
        if KINDS[kind] == "angle":
            angle_from_text(content.decode("utf-8", "replace"))
            return
        path = FOLDER / (
            "input" + (KINDS[kind] if KINDS[kind].startswith(".") else ".toml")
        )
        path.write_bytes(content)
        if KINDS[kind].startswith("."):
            judged(path)
        elif KINDS[kind] == "request":
            request, _ = read_request(path, {})
            serialised(request.as_mapping())
        else:
            serialised(vehicle_named(str(path)).as_mapping())
    except GaitgraphError as error:
        message = str(error)
        if not message or "\n" in message:
            raise AssertionError(f"not one line: {message!r}") from error


def main() -> None:
    """Fuzz until told to stop."""
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", FileWarning)  # what a file has that is not used
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
