"""A study's results on disk: a folder with a manifest and a Parquet file for every batch.

::

    study.json                 what the study is, resolved; its fingerprint; the versions that rows are made with
    rows/part-00000.parquet    cases 0 to B − 1, in order; written whole or not at all
    rows/part-00001.parquet    the next B, and so on; B follows from the number of cases
    summary.html               once all are there

What is in a part follows from the study alone, so parts are the same bytes whoever writes them, and in which order. One
process at a time writes: it holds a lock on the manifest, which the operating system drops when the process ends,
however it ends.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import shutil
import sys
import textwrap
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gaitgraph.errors import FileProblem, GaitgraphError, InputError, OutputExists, needs_extra, shown
from gaitgraph.files import text_of, write_whole
from gaitgraph.study.cases import OUTCOMES, columns_of, known_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from gaitgraph.study.designs import Study

__all__ = ["Dataset", "holds_study", "opened_dataset", "require_pyarrow"]

FORMAT = "gaitgraph study"
MANIFEST, ROWS, SUMMARY = "study.json", "rows", "summary.html"

_KEY = b"gaitgraph"
_PART = re.compile(r"part-(\d{5,7})\.parquet")
_SCRATCH = ".gaitgraph-*.part"
_BEYOND = 1 << 40  # a byte that no manifest has: where Windows locks, nobody can read


def require_pyarrow() -> Any:
    """Return pyarrow with its Parquet; MissingExtra if it is not installed."""
    try:
        import pyarrow as pa
        import pyarrow.parquet
    except ImportError as error:
        raise needs_extra("pyarrow", "a study", "study") from error
    return pa


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """The folder of a study, open for one process.

    Parameters
    ----------
    folder
        Where it is.
    study
        What it holds the rows of.
    versions
        Of what the rows are made with.
    """

    folder: Path
    study: Study
    versions: Mapping[str, str]

    def path(self, batch: int) -> Path:
        """Return the file of a batch."""
        return self.folder / ROWS / f"part-{batch:05d}.parquet"

    @property
    def summary(self) -> Path:
        """The file of the summary page."""
        return self.folder / SUMMARY

    def write(self, batch: int, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write the rows of a batch, whole or not at all.

        Raises
        ------
        FileProblem
            If the file system refuses; what is there stays as it is.
        """
        pa = require_pyarrow()
        schema = self._schema(pa)
        columns = [pa.array([row.get(field.name) for row in rows], field.type) for field in schema]
        stream = io.BytesIO()
        pa.parquet.write_table(pa.Table.from_arrays(columns, schema=schema), stream, write_page_checksum=True)
        self._put(self.path(batch), stream.getvalue(), force=False)

    def write_summary(self, page: str) -> None:
        """Write the summary page, over an older one."""
        self._put(self.summary, page.encode(), force=True)

    def _put(self, path: Path, content: bytes, *, force: bool) -> None:
        try:
            write_whole([(path, content)], force=force)
        except FileProblem as error:
            raise type(error)(
                f"{error}; allowed is a place with room: what is written stays, and the same command goes on from there"
            ) from error

    def parts(self, *, closely: bool = True) -> dict[int, Any]:
        """Return the parts that are there as pyarrow tables by their batch, in order, each found whole.

        Parameters
        ----------
        closely
            Whether each row is compared with its case, which takes some 0.1 ms a case; else only their numbers.

        Raises
        ------
        FileProblem, InputError
            If a file is broken, of another study, or none of a study's.
        """
        found = {}
        rows = self.folder / ROWS
        for path in sorted(rows.iterdir()):
            if path.name.startswith("."):  # of a file manager or a file system; readers of datasets pass it over too
                continue
            match = _PART.fullmatch(path.name)
            batch = int(match[1]) if match else -1
            if not 0 <= batch < self.study.batches or self.path(batch) != path:
                raise OutputExists(
                    f"output: {str(path)!r} is no part of this study; allowed in {ROWS} are part-00000.parquet to "
                    f"{self.path(self.study.batches - 1).name}"
                )
            found[batch] = self._checked(path, batch, closely=closely)
        return found

    def whole(self) -> dict[int, Any]:
        """Return all parts; their rows were compared with the cases before, or written by this process.

        Raises
        ------
        FileProblem, InputError
            If one is not there, too.
        """
        found = self.parts(closely=False)
        gone = [batch for batch in range(self.study.batches) if batch not in found]
        if gone:
            raise FileProblem(
                f"part {str(self.path(gone[0]))!r}: it was taken away while the study ran; allowed is a folder that is "
                "left alone: the same command flies its cases again"
            )
        return found

    def _checked(self, path: Path, batch: int, *, closely: bool) -> Any:
        """Return a part; InputError unless it is whole, of this study, and has the cases that it should."""
        cure = "delete it, and the same command flies its cases again"
        try:
            table = self._read(path)
        except FileProblem:
            raise
        except InputError as error:
            raise InputError(f"part {str(path)!r}: {error}; allowed is a whole part: {cure}") from error
        told = self._told(table.schema.metadata or {})
        if told != self.study.fingerprint:
            raise OutputExists(f"part {str(path)!r}: it is of another study; allowed are parts of this one: {cure}")
        numbers = list(self.study.numbers(batch))
        if table.schema.names != self._schema(require_pyarrow()).names or table["case"].to_pylist() != numbers:
            raise InputError(
                f"part {str(path)!r}: it does not hold cases {numbers[0]} to {numbers[-1]}; allowed is a whole part: "
                f"{cure}"
            )
        wrong = self._strange_in(table, numbers) if closely else None
        if wrong:
            raise InputError(
                f"part {str(path)!r}: its column {wrong!r} is not of this study's cases; allowed is a part as it was "
                f"written: {cure}"
            )
        return table

    def _strange_in(self, table: Any, numbers: Sequence[int]) -> str | None:
        """Return the first column that differs from what is known of the cases without flying them, or None."""
        pa = require_pyarrow()
        rows = [known_of(self.study.case(number)) for number in numbers]
        given = frozenset().union(*rows)
        for field in self._schema(pa):
            if table.schema.field(field.name).type != field.type:
                return str(field.name)
            if field.name in given and table[field.name].to_pylist() != [row.get(field.name) for row in rows]:
                return str(field.name)
        outcomes, reasons = table["outcome"].to_pylist(), table["reason"].to_pylist()
        if any(outcome not in OUTCOMES for outcome in outcomes):
            return "outcome"
        lacking = (reason is None for outcome, reason in zip(outcomes, reasons, strict=True) if outcome != "settled")
        return "reason" if any(lacking) else None

    def _read(self, path: Path) -> Any:
        pa = require_pyarrow()
        try:
            content = path.read_bytes()
        except OSError as error:
            raise FileProblem(
                f"part {str(path)!r}: cannot read it: {error.strerror or error}; allowed is a Parquet file"
            ) from error
        try:
            return pa.parquet.read_table(pa.BufferReader(content), page_checksum_verification=True, use_threads=False)
        except (pa.ArrowException, MemoryError, OSError, OverflowError, TypeError, ValueError) as error:
            reason = textwrap.shorten(str(error), 100, placeholder=" …") or type(error).__name__
            raise InputError(f"it is no Parquet file, or a broken one ({reason})") from error

    @staticmethod
    def _told(metadata: Mapping[bytes, bytes]) -> str | None:
        try:
            content = json.loads(metadata.get(_KEY, b""))
        except (RecursionError, ValueError):
            return None
        told = content.get("fingerprint") if isinstance(content, dict) else None
        return told if isinstance(told, str) else None

    def _schema(self, pa: Any) -> Any:
        kinds = {"whole": pa.int64(), "number": pa.float64(), "text": pa.string(), "flag": pa.bool_()}
        fields = [
            pa.field(name, kinds[kind], nullable=name != "case", metadata={"unit": unit} if unit else None)
            for name, kind, unit in columns_of(self.study)
        ]
        about = {
            "format": f"{FORMAT} rows",
            "versions": dict(self.versions),
            "study": self.study.name,
            "fingerprint": self.study.fingerprint,
        }
        return pa.schema(fields, metadata={_KEY: json.dumps(about, allow_nan=False)})


def holds_study(folder: Path) -> bool:
    """Return whether a folder has a manifest."""
    return os.path.lexists(folder / MANIFEST)


@contextmanager
def opened_dataset(folder: Path, study: Study, versions: Mapping[str, str]) -> Iterator[Dataset]:
    """Open the folder of a study for this process alone, a new one or one that holds this very study.

    Parameters
    ----------
    folder
        A folder that does not exist or is empty, or one that was written before.
    study, versions
        What its rows are of, and made with.

    Raises
    ------
    OutputExists
        If the folder is something else, or of another study, or another process writes there.
    FileProblem
        If the file system refuses.
    """
    with ExitStack() as stack:
        try:
            _enter(stack, folder, study, versions)
        except (OSError, ValueError) as error:  # a name with a null character is a ValueError
            if isinstance(error, GaitgraphError):
                raise
            reason = getattr(error, "strerror", None) or error
            raise FileProblem(
                f"output: cannot write {shown(str(folder))}: {reason}; allowed is a new folder"
            ) from error
        yield Dataset(folder=folder, study=study, versions=versions)


def _enter(stack: ExitStack, folder: Path, study: Study, versions: Mapping[str, str]) -> None:
    """Make the folder, or find that it is this study's, and lock it until the stack ends."""
    known = _manifest_in(folder)
    if known is None:
        _check_new(folder)
        (folder / ROWS).mkdir(parents=True, exist_ok=True)
        content = {
            "format": FORMAT,
            "versions": dict(versions),
            "fingerprint": study.fingerprint,
            "cases": len(study),
            "batch": study.batch,
            "study": study.as_mapping(),
        }
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        write_whole([(folder / MANIFEST, text.encode())], force=False)
    else:
        _check_same(folder, known, study, versions)
    stack.enter_context(_locked(folder / MANIFEST))
    (folder / ROWS).mkdir(exist_ok=True)
    for place in (folder, folder / ROWS):
        for scratch in place.glob(_SCRATCH):  # of a process that was killed while it wrote
            shutil.rmtree(scratch, ignore_errors=True)


def _manifest_in(folder: Path) -> dict[str, Any] | None:
    """Return what the manifest of a folder tells, or None if there is none."""
    path = folder / MANIFEST
    if not os.path.lexists(path):
        return None
    text = text_of(path, "study", "a study's manifest")
    try:
        content = json.loads(text)
    except (RecursionError, ValueError):
        content = None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise OutputExists(f"output: {str(path)!r} is no manifest of a study; allowed is a new folder")
    return content


def _check_new(folder: Path) -> None:
    """Raise unless a folder without a manifest is one to begin in."""
    if folder.exists() and not folder.is_dir():
        raise OutputExists(f"output: {str(folder)!r} is a file; allowed is a new folder, or one of this study")
    if not folder.exists():
        if not folder.parent.is_dir():
            raise FileProblem(f"output: folder {str(folder.parent)!r} does not exist; allowed is an existing folder")
        return
    strange = [path.name for path in sorted(folder.iterdir()) if path.name != ROWS and not path.match(_SCRATCH)]
    rows = folder / ROWS
    strange += [f"{ROWS}/{path.name}" for path in sorted(rows.iterdir())] if rows.is_dir() else []
    if strange:
        raise OutputExists(
            f"output: {str(folder)!r} is a folder with {strange[0]!r} in it; allowed is a new one, or one of this study"
        )


def _check_same(folder: Path, known: dict[str, Any], study: Study, versions: Mapping[str, str]) -> None:
    told = known.get("study")
    if hashlib.sha256(json.dumps(told).encode()).hexdigest() != known.get("fingerprint"):
        raise OutputExists(
            f"output: {str(folder / MANIFEST)!r} was changed after it was written; allowed is the manifest as it was, "
            "or a new folder"
        )
    if known.get("fingerprint") != study.fingerprint or known.get("batch") != study.batch:
        name = told.get("name") if isinstance(told, dict) else None
        whose = f"another study ({shown(name)})" if name != study.name else "this study as it was before a change"
        raise OutputExists(f"output: {str(folder)!r} holds {whose}; allowed is a new folder, or one of this study")
    before = known.get("versions")
    for name, here in versions.items():
        there = before.get(name) if isinstance(before, dict) else None
        if there != here:
            raise OutputExists(
                f"output: {str(folder)!r} was begun with {name} {shown(there)}, and this is {here!r}; allowed is a new "
                "folder, or the same version"
            )


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock on a file that ends with the process, however that ends."""
    with path.open("r+b") as stream:
        try:
            if sys.platform == "win32":
                import msvcrt

                stream.seek(_BEYOND)
                msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError) as error:  # the latter on Windows
            raise OutputExists(
                f"output: another process writes to {str(path.parent)!r}; allowed is one at a time"
            ) from error
        yield
