"""The storage files of ROS 2 bags, MCAP and sqlite3, read as what they may be: broken, cut off, or made to do harm.

Nothing in them is believed: lengths are checked before they are used, what is compressed is unpacked up to the size
that is stated, and a database may hold plain tables only. Messages stay as they are; :mod:`gaitgraph.io.rosbag`
reads them.
"""

from __future__ import annotations

import io
import struct
import sys
import zlib
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import IO, TYPE_CHECKING, Any

from gaitgraph.errors import FileProblem, InputError, needs_extra, shown
from gaitgraph.files import MOST_BYTES

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Collection, Iterator
    from pathlib import Path

__all__ = ["MOST_MESSAGE", "Topic", "messages_in", "topics_in"]

MOST_MESSAGE = 1 << 24
"""A message that is read may have this many bytes at most."""

_MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F
_MOST_CHUNK = 1 << 28
_MOST_TOPICS = 10_000
_TABLES = {
    "topics": ("id", "name", "type", "serialization_format"),
    "messages": ("id", "topic_id", "timestamp", "data"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """A topic of a storage file.

    Parameters
    ----------
    id
        Its number in the file.
    name, kind, encoding
        Its name, the type of its messages, and how they are serialised, such as "cdr".
    """

    id: int
    name: str
    kind: str
    encoding: str


def topics_in(path: Path) -> list[Topic]:
    """Return the topics of a storage file, .mcap or .db3 by its suffix.

    Raises
    ------
    FileProblem
        If the file cannot be read.
    InputError
        If it is no such file, or broken.
    """
    if path.suffix.lower() == ".mcap":
        with _mcap(path) as records:
            return list(_mcap_topics(records))
    with _database(path) as connection:
        rows = connection.execute("SELECT id, name, type, serialization_format FROM topics ORDER BY id")
        return [_topic(*row) for row in rows.fetchmany(_MOST_TOPICS)]


def messages_in(path: Path, topics: Collection[Topic]) -> Iterator[tuple[int, int, bytes]]:
    """Yield the messages of some topics of a storage file: topic number, time of the record [ns], bytes.

    Raises
    ------
    FileProblem, InputError
        As :func:`topics_in` does; or if a message is longer than :data:`MOST_MESSAGE`.
    """
    wanted = {topic.id for topic in topics}
    if path.suffix.lower() == ".mcap":
        with _mcap(path) as records:
            for kind, content in records:
                if kind == _MESSAGE and len(content) >= 22:
                    channel, _, time, _ = struct.unpack_from("<HIQQ", content)
                    if channel in wanted:
                        if len(content) - 22 > MOST_MESSAGE:
                            raise InputError(f"a message of {len(content) - 22} bytes; allowed are {MOST_MESSAGE}")
                        yield channel, time, bytes(content[22:])
        return
    marks = ", ".join("?" * len(wanted))
    query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY timestamp, id"  # noqa: S608
    with _database(path) as connection:
        for topic, time, data in connection.execute(query, sorted(wanted)):
            if not (isinstance(time, int) and isinstance(data, bytes)):
                raise InputError(f"a message is {shown(data)} at {shown(time)}; allowed are bytes at nanoseconds")
            yield topic, time, data


def _topic(number: Any, name: Any, kind: Any, encoding: Any) -> Topic:
    if not (isinstance(number, int) and all(isinstance(text, str) for text in (name, kind, encoding))):
        raise InputError(f"topics: {shown((number, name, kind, encoding))}; allowed are a number and three texts")
    return Topic(id=number, name=name, kind=kind, encoding=encoding)


@contextmanager
def _told(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if isinstance(error, FileProblem):
            raise
        reason = error.strerror or error
        raise FileProblem(f"gait file: cannot read {str(path)!r}: {reason}; allowed is a ROS 2 bag") from error


@contextmanager
def _mcap(path: Path) -> Iterator[Iterator[tuple[int, memoryview]]]:
    """Open an MCAP file and give its records up to the end of its data."""
    with _told(path), path.open("rb") as stream:
        size = stream.seek(0, io.SEEK_END)
        _check_size(size)
        stream.seek(0)
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise InputError("it is no MCAP file; allowed is a ROS 2 bag")
        yield _records(stream, size, [0])


def _check_size(size: int) -> None:
    if size > MOST_BYTES:
        raise InputError(
            f"more than {MOST_BYTES >> 20} MiB; allowed is a bag up to that: ros2 bag convert keeps some topics only"
        )


def _records(
    stream: IO[bytes], size: int, unpacked: list[int], *, inner: bool = False
) -> Iterator[tuple[int, memoryview]]:
    """Yield kind and content of each record, those in chunks too; `unpacked` counts what chunks unpack to."""
    place = stream.tell()
    while place < size or not inner:
        head = stream.read(9)
        if len(head) < 9:
            raise InputError(f"it ends in the middle, at byte {size}; allowed is a whole bag (mcap recover mends some)")
        kind, length = struct.unpack("<BQ", head)
        place += 9
        if length > size - place:
            what = "chunk" if inner else "file"
            raise InputError(
                f"a record of {length} bytes at byte {place} of a {what} of {size}; allowed is a whole bag"
            )
        if kind in (_DATA_END, _FOOTER):
            return
        if kind in (_SCHEMA, _CHANNEL, _MESSAGE):
            yield kind, memoryview(stream.read(length))
        elif kind == _CHUNK:
            if inner:
                raise InputError("a chunk within a chunk; allowed are messages")
            chunk = _unpacked(_Fields(memoryview(stream.read(length))), unpacked)
            yield from _records(io.BytesIO(chunk), len(chunk), unpacked, inner=True)
        else:
            stream.seek(length, io.SEEK_CUR)
        place += length


class _Fields:
    """The fields of a record, one after another; InputError where it ends too early."""

    def __init__(self, content: memoryview) -> None:
        self._content, self._place = content, 0

    def take(self, length: int) -> memoryview:
        end = self._place + length
        if end > len(self._content):
            raise InputError(f"a record of {len(self._content)} bytes that ends too early; allowed is a whole bag")
        part = self._content[self._place : end]
        self._place = end
        return part

    def number(self, length: int) -> int:
        return int.from_bytes(self.take(length), "little")

    def text(self) -> str:
        content = bytes(self.take(self.number(4)))
        try:
            return content.decode()
        except UnicodeDecodeError as error:
            raise InputError(f"a name {shown(content)} that is no text; allowed is UTF-8") from error


def _unpacked(chunk: _Fields, unpacked: list[int]) -> bytes:
    """Return the records of a chunk, which is unpacked to the size that it states and no further."""
    chunk.take(16)
    size, checksum, packing = chunk.number(8), chunk.number(4), chunk.text()
    content = bytes(chunk.take(chunk.number(8)))
    unpacked[0] += size
    if size > _MOST_CHUNK or unpacked[0] > MOST_BYTES:
        raise InputError(f"a chunk that unpacks to {size} bytes, {unpacked[0]} so far; allowed are {MOST_BYTES}")
    if packing:
        try:
            content = _decompressor(packing).decompress(content, max_length=size + 1)
        except InputError:
            raise
        except Exception as error:  # each library has its own
            raise InputError(f"a chunk packed with {packing} cannot be unpacked; allowed is a whole bag") from error
    if len(content) != size:
        raise InputError(f"a chunk of {len(content)} bytes that states {size}; allowed is a whole bag")
    if checksum and zlib.crc32(content) != checksum:
        raise InputError("a chunk whose checksum is wrong; allowed is a whole bag")
    return content


def _decompressor(packing: str) -> Any:
    # Python's own zstd from 3.14 on, before that the one that rosbags takes.
    zstd = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
    homes = {"lz4": ("lz4.frame", "LZ4FrameDecompressor"), "zstd": (zstd, "ZstdDecompressor")}
    if packing not in homes:
        raise InputError(f"a chunk packed with {shown(packing)}; allowed are lz4, zstd, or none")
    module, name = homes[packing]
    try:
        return getattr(import_module(module), name)()
    except ImportError as error:
        raise needs_extra(module, f"a bag packed with {packing}", "ros") from error


def _mcap_topics(records: Iterator[tuple[int, memoryview]]) -> Iterator[Topic]:
    kinds: dict[int, str] = {}
    seen: set[int] = set()
    for kind, content in records:
        fields = _Fields(content)
        if kind == _SCHEMA:
            number = fields.number(2)
            kinds[number] = fields.text()
        elif kind == _CHANNEL:
            number, schema = fields.number(2), fields.number(2)
            if number not in seen:
                seen.add(number)
                yield Topic(id=number, kind=kinds.get(schema, ""), name=fields.text(), encoding=fields.text())


@contextmanager
def _database(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a bag's database to read it, if it holds plain tables."""
    import sqlite3

    with _told(path), path.open("rb") as stream:
        size = stream.seek(0, io.SEEK_END)
        stream.seek(0)
        head = stream.read(100)
    _check_size(size)
    _check_pages(head, size)
    connection = None
    try:
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_MESSAGE)
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA temp_store = MEMORY")
        _check_schema(connection)
        yield connection
    except (sqlite3.Error, OverflowError, UnicodeDecodeError) as error:
        told = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"it cannot be read as a database ({told}); allowed is a ROS 2 bag") from error
    finally:
        if connection is not None:
            connection.close()


def _check_pages(head: bytes, size: int) -> None:
    """Raise InputError unless all pages of a database are there, which sqlite3 only finds out where it reads one."""
    if len(head) < 100 or not head.startswith(b"SQLite format 3\0"):
        raise InputError("it is no database of sqlite3; allowed is a ROS 2 bag")
    (page,) = struct.unpack_from(">H", head, 16)
    changes, pages = struct.unpack_from(">II", head, 24)
    (counted,) = struct.unpack_from(">I", head, 92)
    if counted == changes and size < pages * (65_536 if page == 1 else page):
        raise InputError(f"it ends in the middle, at byte {size}; allowed is a whole bag")


def _check_schema(connection: sqlite3.Connection) -> None:
    """Raise InputError unless the tables of a bag are there, and are tables: a view may run for ever."""
    for table, columns in _TABLES.items():
        found = connection.execute("SELECT type, sql FROM sqlite_master WHERE name = ?", (table,)).fetchall()
        plain = len(found) == 1 and found[0][0] == "table" and "virtual" not in str(found[0][1]).lower()[:20]
        if not plain:
            raise InputError(f"it has no table {table!r}; allowed is a ROS 2 bag")
        there = {row[1]: row[6] for row in connection.execute(f"PRAGMA table_xinfo({table})")}
        for column in columns:
            if there.get(column) != 0:
                raise InputError(f"its table {table!r} has no plain column {column!r}; allowed is a ROS 2 bag")
