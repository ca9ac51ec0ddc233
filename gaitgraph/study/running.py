"""Run a study on Dask: batches that are written are kept, the others are flown, each written when it is done.

The folder of a study::

    study.json                 the study with its fingerprint, and the versions that made the rows
    rows/part-00000.parquet    cases 0 to B − 1, in order; written whole or not at all
    rows/part-00001.parquet    the next B, and so on; B depends on the number of cases
    summary.html               written at the end: counts and reasons, without scripts or links
    certificates/              written at the end: one of each flyable gait, untimed, for each vehicle

Rows do not depend on the time, the machine or the process, so a part has the same bytes whichever worker flew it. A
case that cannot be planned, is refused, does not settle or fails has a row too, with its reason.
"""

from __future__ import annotations

import asyncio
import io
import json
import logging
import math
import re
from collections import Counter
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import timedelta
from html import escape
from importlib.metadata import PackageNotFoundError, version
from itertools import product
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from gaitgraph import __version__
from gaitgraph.angles import whole_number
from gaitgraph.certificates.making import certify
from gaitgraph.certificates.verifying import CERTIFICATE
from gaitgraph.errors import (
    Advice,
    FileProblem,
    GaitgraphError,
    Infeasible,
    InputError,
    OutputExists,
    needs_extra,
    shown,
)
from gaitgraph.files import text_of, write_whole
from gaitgraph.flight.simulation import fly
from gaitgraph.study.design import (
    FLIGHT,
    Case,
    Study,
    columns_of,
    read_study,
    study_from_mapping,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from gaitgraph.gait.gait import Gait

    Row = dict[str, Any]

OUTCOMES = ("settled", "not settled", "refused", "no gait", "failed")
"""The outcomes of a case: it flew and settled, or did not; it was refused; no gait was found; an error ended it."""

_MOST_WORKERS = 1024
_FREE_CASES = 10_000  # more cases, or a longer estimate, need `yes`
_FREE_SECONDS = 3600.0
_PATIENCE = 5.0  # s to wait for the scheduler's answer
_EMPTY = 60.0  # s to wait for the first worker of a scheduler
_DEATHS = 2  # workers that a batch may lose before its cases are flown one by one
# An interrupt at the terminal reaches the workers too; they ignore it, since this process ends them.
_NO_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRun:
    """The result of a study: its `folder`, and its `table`, a pyarrow table of all rows in the order of the cases.

    `outcomes` is the number of cases with each of :data:`OUTCOMES`; `reasons` are outcome, reason and count of those
    that did not settle, in the words of the first such case. This run flew `flown` of the cases. `uncertified` are
    gait, vehicle and reason where a gait has no certificate.
    """

    study: Study
    folder: Path
    outcomes: Mapping[str, int]
    reasons: tuple[tuple[str, str, int], ...]
    flown: int
    table: Any
    uncertified: tuple[tuple[str, str, str], ...] = ()

    def as_mapping(self) -> dict[str, Any]:
        """Return the result as plain values, ready for JSON."""
        return {
            "study": self.study.name,
            "fingerprint": self.study.fingerprint,
            "folder": str(self.folder),
            "cases": len(self.study),
            "flown": self.flown,
            "kept": len(self.study) - self.flown,
            **{name.replace(" ", "_"): self.outcomes[name] for name in OUTCOMES},
            "reasons": [
                dict(zip(("outcome", "reason", "cases"), one, strict=True))
                for one in self.reasons
            ],
            "uncertified": [
                dict(zip(("gait", "vehicle", "reason"), one, strict=True))
                for one in self.uncertified
            ],
            "summary": str(self.folder / "summary.html"),
        }

    def __str__(self) -> str:
        count, kept = len(self.study), len(self.study) - self.flown
        lines = [
            f"Study {self.study.name}: {count} case{'s' * (count != 1)}"
            + f", {kept} of them kept" * (kept > 0)
        ]
        lines += [
            f"  {name:<12} {self.outcomes[name]}"
            for name in OUTCOMES
            if self.outcomes[name]
        ]
        lines += [
            f"  {count} × {outcome}: {why}" for outcome, why, count in self.reasons[:5]
        ]
        lines += [
            f"  no certificate of {gait} for {vehicle}: {why}"
            for gait, vehicle, why in self.uncertified[:5]
        ]
        return "\n".join(
            [
                *lines,
                f"rows in {self.folder / 'rows'}, summary in {self.folder / 'summary.html'}",
            ]
        )


def run_study(
    study: Study | str | Path | dict[str, Any],
    output: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    yes: bool = False,
    progress: Callable[[str], None] | None = None,
) -> StudyRun:
    """Plan, check and fly every case of a study, and write a row for each.

    Parameters
    ----------
    study
        A study, the name of its TOML file, or a mapping for :func:`gaitgraph.study.design.study_from_mapping`.
    output
        The folder of its rows: a new one, or one of the same study, which is then continued.
    workers
        Processes on this machine; by default one for each core. 0 flies in this process, without Dask.
    scheduler
        The address of a running Dask scheduler, such as "tcp://host:8786"; its workers fly instead.
    yes
        Run a study of more than 10,000 flights, or longer than an estimated hour.
    progress
        Called with lines of text.

    Raises
    ------
    InputError, FileProblem, OutputExists
        If an argument is wrong, the scheduler does not answer, workers do not start, or an extra is missing; if the
        folder has other content, is of another study, in use, or cannot be written.

    Notes
    -----
    After an interrupt or a crash the same call continues: written batches stay, the others are flown. Rows do not
    depend on the number of workers, but on another kind of processor their last digits may differ. A script that
    starts workers needs ``if __name__ == "__main__":``, as for Python's ``multiprocessing``.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> asked = {"name": "tiny", "gaits": ["gait1", "gait4"], "flight": {"duration": 1}}
    >>> with TemporaryDirectory() as folder:
    ...     run = run_study(asked, f"{folder}/tiny", workers=0)
    >>> run.outcomes["settled"], run.outcomes["refused"]
    (1, 1)
    """
    if not isinstance(study, Study):
        study = (
            study_from_mapping(study) if isinstance(study, dict) else read_study(study)
        )
    if scheduler is not None and workers is not None:
        raise InputError(
            f"workers must be left out beside a scheduler, got {shown(workers)}",
            field="workers",
        )
    if workers is None:
        workers = 1
        with suppress(ImportError):  # reported when workers start
            from dask.system import CPU_COUNT  # respects the limits of a container

            workers = CPU_COUNT if scheduler is None else 1
    whole_number("workers", workers, 0, _MOST_WORKERS)
    seconds = study.seconds / max(workers, 1)
    if not yes and (len(study) > _FREE_CASES or seconds > _FREE_SECONDS):
        takes, free = (
            timedelta(seconds=round(seconds)),
            timedelta(seconds=_FREE_SECONDS),
        )
        where = f"on {workers} worker{'s' * (workers > 1)}"
        asked = (
            f"study {study.name!r} has {len(study):,} flights, about {takes} {where}"
        )
        larger = f"to fly more than {_FREE_CASES:,} or for more than {free}, add"
        raise InputError(asked, advice=Advice(f"{larger} yes=True", f"{larger} --yes"))
    try:
        from pyarrow.dataset import dataset
    except ImportError as error:
        raise needs_extra("pyarrow", "a study", "study") from error
    here, folder, say = versions(), Path(output), progress or (lambda _: None)
    parts = {
        folder / "rows" / f"part-{k:05d}.parquet": numbers
        for k, numbers in enumerate(study.batches)
    }
    with ExitStack() as stack:
        client = None
        if (
            scheduler is not None
        ):  # before the folder, so that a wrong address leaves none
            say("connecting to the scheduler")
            client = stack.enter_context(_client(0, scheduler))
        stack.enter_context(_opened(folder, study, here))
        missing = _missing(parts, study)
        if missing and workers and client is None:
            say("starting workers")
            client = stack.enter_context(_client(min(workers, len(missing)), None))
        todo, flown, start = sum(map(len, missing.values())), 0, monotonic()
        say(f"{len(study) - todo} of {len(study)} cases")
        flown_here = (
            (path, flown_batch(numbers, study, here))
            for path, numbers in missing.items()
        )
        for path, rows in (
            flown_here
            if client is None
            else _flown_on_dask(client, study, missing, here)
        ):
            write_whole([(path, _content_of(rows, study, here))], force=False)
            flown += len(rows)
            left = timedelta(
                seconds=round((monotonic() - start) * (todo - flown) / flown)
            )
            say(
                f"{len(study) - todo + flown} of {len(study)} cases"
                + f", about {left} left" * (flown < todo)
            )
        say("writing the summary")
        try:
            table = dataset(list(parts), format="parquet").to_table()
        except OSError as error:
            raise FileProblem(
                f"a part was removed while the study ran; run it again ({error})"
            ) from error
        return _summarised(study, folder, table, flown)


def _summarised(study: Study, folder: Path, table: Any, flown: int) -> StudyRun:
    """Write the summary and the certificates of a study, whose rows are given, and return its answer."""
    reasons = _reasons_of(table)
    written: dict[Path, str] = {}
    uncertified = []
    # The certificate of each gait for each vehicle, with the first of the constants that vary.
    for number, (model, source) in enumerate(product(study.models, study.sources)):
        name = re.sub(r"[^\w-]+", "_", f"{number}_{source.name}_{model.base.name}")[
            :100
        ]
        try:
            text = certify(source.gait(model.base)).text
        except GaitgraphError as error:
            uncertified.append((source.name, model.base.name, str(error)))
            continue
        written[folder / "certificates" / f"{name}{CERTIFICATE}"] = text
        (folder / "certificates").mkdir(exist_ok=True)
    page = _page_of(study, table, reasons, uncertified)
    written[folder / "summary.html"] = page
    write_whole([(path, text.encode()) for path, text in written.items()], force=True)
    outcomes = {**dict.fromkeys(OUTCOMES, 0), **Counter(table["outcome"].to_pylist())}
    return StudyRun(
        study=study,
        folder=folder,
        outcomes=outcomes,
        reasons=reasons,
        flown=flown,
        table=table,
        uncertified=tuple(uncertified),
    )


@contextmanager
def _opened(folder: Path, study: Study, here: Mapping[str, str]) -> Iterator[None]:
    """Open a folder, new or of the same study, for this process alone; `here` are the versions that make its rows.

    OutputExists if it has other content or another process writes there; FileProblem if it cannot be written.
    """
    about: dict[str, Any] = {
        "format": "gaitgraph study",
        "versions": dict(here),
        "fingerprint": study.fingerprint,
        "cases": len(study),
        "batch": study.batch,
        "study": study.as_mapping(),
    }
    manifest, rows = folder / "study.json", folder / "rows"
    wanted = f"output must be a new folder or one of this study, got {str(folder)!r}"
    try:
        if not manifest.exists():
            if folder.exists() and any(folder.iterdir()):
                raise OutputExists(f"{wanted} with files")
            folder.mkdir(exist_ok=True)
            text = (
                json.dumps(about, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
            )
            write_whole([(manifest, text.encode())], force=False)
        found = dict(json.loads(text_of(manifest, "study")))
        if differing := [
            name for name, value in about.items() if found.get(name) != value
        ]:
            raise OutputExists(
                f"{wanted}, whose study.json has another {', '.join(differing)}"
            )
        stream = manifest.open("rb")
    except (
        OSError,
        TypeError,
        ValueError,
    ) as error:  # a name with a null character is a ValueError
        if isinstance(error, GaitgraphError):
            raise
        raise FileProblem(f"{wanted}: {error}") from error
    with stream:
        try:  # the operating system releases the lock when the process ends
            with suppress(ImportError):  # Windows has none
                import fcntl

                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise OutputExists(
                f"another process writes to {str(folder)!r}; run one at a time"
            ) from error
        rows.mkdir(exist_ok=True)
        yield


def _content_of(rows: Sequence[Row], study: Study, here: Mapping[str, str]) -> bytes:
    """Return the content of a part, a Parquet file."""
    import pyarrow as pa
    import pyarrow.parquet

    about = {"format": "gaitgraph study rows", "versions": dict(here)}
    about |= {"study": study.name, "fingerprint": study.fingerprint}
    fields = []
    for name, unit in columns_of(study).items():
        is_type = unit in ("int64", "string", "bool")
        kind = pa.type_for_alias(unit if is_type else "double")
        fields.append(
            pa.field(name, kind, name != "case", None if is_type else {"unit": unit})
        )
    schema = pa.schema(
        fields, metadata={"gaitgraph": json.dumps(about, allow_nan=False)}
    )
    stream = io.BytesIO()
    pa.parquet.write_table(
        pa.Table.from_pylist(rows, schema=schema), stream, write_page_checksum=True
    )
    return stream.getvalue()


def _missing(parts: Mapping[Path, range], study: Study) -> dict[Path, range]:
    """Return the missing parts, in order; OutputExists if a file in the folder is not a part of the study."""
    import pyarrow as pa
    import pyarrow.parquet

    missing = dict(parts)
    for path in sorted(next(iter(parts)).parent.iterdir()):
        if path.name.startswith(
            "."
        ):  # of a file manager; readers of datasets ignore it too
            continue
        try:
            table = pa.parquet.read_table(
                path, page_checksum_verification=True, partitioning=None
            )
        except (
            pa.ArrowException,
            OSError,
            OverflowError,
            TypeError,
            ValueError,
        ) as error:
            reason = shown(f"{type(error).__name__}: {error}")
        else:
            if path in missing and _is_of(study, list(missing[path]), table):
                del missing[path]
                continue
            reason = "it is of another study or has other cases"
        remedy = "move or delete it, then run the same command again"
        raise OutputExists(
            f"{str(path)!r} is not a complete part of this study ({reason}); {remedy}"
        )
    return missing


def _is_of(study: Study, cases: list[int], table: Any) -> bool:
    """Return whether a table of Parquet says that it is of a study, and has these cases."""
    try:
        stated = json.loads((table.schema.metadata or {}).get(b"gaitgraph", b"{}"))
    except ValueError:  # the text of another program
        return False
    if not isinstance(stated, dict) or stated.get("fingerprint") != study.fingerprint:
        return False
    return "case" in table.column_names and table["case"].to_pylist() == cases


def versions() -> dict[str, str]:
    """Return the versions that rows depend on; MissingExtra if the engine is not installed."""
    try:
        return {"gaitgraph": __version__, "mujoco": version("mujoco")}
    except PackageNotFoundError as error:
        raise needs_extra("mujoco", "a study", "study") from error


def flown_batch(
    numbers: Sequence[int], study: Study, expected: Mapping[str, str]
) -> list[Row]:
    """Return the rows of some cases of a study; workers run this. InputError if they have other versions."""
    here = versions()
    for name, wanted in expected.items():
        if here.get(name) != wanted:
            raise InputError(
                f"workers must have {name} {wanted}, as this process has, got {here.get(name)}"
            )
    gaits: dict[str, Gait | GaitgraphError] = {}
    return [row_of(study.case(number), study, gaits) for number in numbers]


def row_of(case: Case, study: Study, gaits: dict[str, Gait | GaitgraphError]) -> Row:
    """Return the row of a case, also if it fails; `gaits` are the gaits and errors of the cases before."""
    row = case.known()
    try:
        row["drag_ratio"] = case.vehicle.drag_ratio
        key = repr((case.model.base.name, case.varied, case.source.name))
        if key not in gaits:
            try:
                gaits[key] = case.source.gait(case.vehicle)
            except GaitgraphError as error:
                gaits[key] = error
        gait = gaits[key]
        if isinstance(gait, GaitgraphError):
            raise gait
        moved = gait if case.bias == 1 else gait.biased(case.bias)
        timed = moved.parametrize(case.period, law=case.source.law)
        report = timed.check()
        row |= {
            name: getattr(report, name)
            for name in ("valid", "flyable", "reachable_from_hover")
        }
        row["gait_singular_value"] = report["least_singular_value"].value
        row["gait_tilt_rate"] = report["tilt_rate"].value
        flight = fly(
            timed,
            attitude=(case.roll, case.pitch),
            settings=study.flight,
            anyway=study.anyway,
        )
        values = flight.as_mapping()
        row |= {
            name: values[name] if math.isfinite(values[name] or 0.0) else None
            for name in FLIGHT
        }
        outcome = (
            "settled"
            if flight.settled
            else "refused"
            if flight.refused
            else "not settled"
        )
        reason = flight.reason
    except Exception as error:  # an error of one case does not end the study
        outcome = "no gait" if isinstance(error, Infeasible) else "failed"
        reason = (
            str(error)
            if isinstance(error, GaitgraphError)
            else f"{type(error).__name__}: {error}"
        )
    return row | {"outcome": outcome, "reason": " ".join(reason.split())}


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """Give a Dask client of a scheduler, or of new worker processes on this machine, which end with it."""
    try:
        import cryptography as _  # noqa: F401 - Dask needs it for its keys
        from distributed import Client, LocalCluster
        from distributed.comm import connect
        from distributed.security import Security
    except ImportError as error:
        raise needs_extra(
            "distributed", "a study on several processes", "study"
        ) from error
    with ExitStack() as stack:
        for logger in _loggers_of("distributed", "tornado", "asyncio"):
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL + 1)  # errors are reported below
        try:
            if scheduler is not None:
                # A client would wait forever for a server that accepts the connection but does not answer.
                security = Security().get_connection_args("client")
                hello = asyncio.wait_for(
                    connect(scheduler, timeout=_PATIENCE, **security), _PATIENCE
                )
                with ThreadPoolExecutor(
                    1
                ) as pool:  # this thread may have an event loop
                    pool.submit(asyncio.run, hello).result()
                client = stack.enter_context(
                    Client(scheduler, timeout=_PATIENCE, set_as_default=False)
                )
                client.wait_for_workers(1, timeout=_EMPTY)
            else:
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    memory_limit=0,
                    preload=[_NO_INTERRUPTS],
                    env={
                        "MUJOCO_GL": "disable"
                    },  # otherwise mujoco looks for a display in a new process
                    security=True,
                    silence_logs=logging.CRITICAL + 1,
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False, "allowed_failures": _DEATHS},
                )
                client = stack.enter_context(
                    Client(stack.enter_context(cluster), set_as_default=False)
                )
        except Exception as error:  # Dask raises different errors for a bad address, a silent host, a dead worker
            if scheduler is None:
                raise InputError(
                    f"workers did not start ({_line(error)})",
                    advice=Advice(
                        "workers=0 flies without them",
                        "--workers 0 flies without them",
                    ),
                ) from error
            wanted = (
                "scheduler must be the address of a running Dask scheduler with workers"
            )
            raise InputError(
                f"{wanted}, got {shown(scheduler)} ({_line(error)})", field="scheduler"
            ) from error
        yield client


def _loggers_of(*libraries: str) -> list[logging.Logger]:
    """Return the loggers of some libraries, those of their modules too, which have levels of their own."""
    names = [
        name
        for name in logging.root.manager.loggerDict
        if name.split(".")[0] in libraries
    ]
    return [logging.getLogger(name) for name in names]


@contextmanager
def _while_scheduled(client: Any) -> Iterator[None]:
    """Raise InputError if the scheduler of a client ends, or cancels what it was asked for, as after a restart."""
    address = client.scheduler.address
    try:
        yield
    except GaitgraphError:
        raise
    except Exception as error:
        if client.status == "running" and not isinstance(error, CancelledError):
            raise
        kept = "rows that are written are kept; run the same study again to continue"
        raise InputError(
            f"the Dask scheduler {address!r} is gone; {kept}", field="scheduler"
        ) from error


def _flown_on_dask(
    client: Any, study: Study, missing: Mapping[Path, range], here: Mapping[str, str]
) -> Iterator[tuple[Path, list[Row]]]:
    """Yield parts and their rows in any order; InputError if a worker cannot run the study or the scheduler ends.

    When a worker dies, Dask gives its batch to another. A batch on which several workers died is flown case by case at
    the end; a case on which a worker dies again has a row that states it.
    """
    with _while_scheduled(client):
        yield from _flown_by_workers(client, study, missing, here)


def _flown_by_workers(
    client: Any, study: Study, missing: Mapping[Path, range], here: Mapping[str, str]
) -> Iterator[tuple[Path, list[Row]]]:
    """Yield parts and their rows; other errors than InputError are those of a scheduler that ends."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    # Sent once, as a task of its own: workers copy its result, and it is computed again if they die.
    shared = client.submit(_same, study, pure=False)

    def submitted(numbers: Sequence[int]) -> Any:
        return client.submit(flown_batch, numbers, shared, dict(here), pure=False)

    def rows_of(future: Any) -> Any:  # None where workers died
        try:
            return future.result()
        except KilledWorker:
            return None
        except GaitgraphError:
            raise
        except (
            Exception
        ) as error:  # of any kind: pickled in the worker, or made by Dask
            if client.status != "running" or isinstance(error, CancelledError):
                raise
            needs = "workers need the same gaitgraph, with its extra study"
            raise InputError(
                f"a worker cannot run the study ({_line(error)}); {needs}"
            ) from error
        finally:
            # Here and not when it is collected, where Python would swallow an interrupt.
            future.release()

    path_of = {submitted(numbers): path for path, numbers in missing.items()}
    lost = []
    for future in as_completed(list(path_of), loop=client.loop):
        path, rows = path_of.pop(future), rows_of(future)
        if rows is None:
            lost.append(path)
        else:
            yield path, rows
    died = {"outcome": "failed", "reason": "each worker that flew this case alone died"}
    for path in sorted(lost):
        alone = [(number, rows_of(submitted([number]))) for number in missing[path]]
        yield (
            path,
            [
                rows[0] if rows else study.case(number).known() | died
                for number, rows in alone
            ],
        )


def _same(study: Study) -> Study:
    return study


def _line(error: BaseException) -> str:
    return shown(f"{type(error).__name__}: {error}")[1:-1]


_MOST_LINES = (
    20  # of a table; quantities with more values, as drawn ones, have no table
)
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{name}</title></head>
<body style="font: 15px/1.45 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto">
<h1>{name}</h1>
{body}
</body>
</html>
"""


def _reasons_of(table: Any) -> tuple[tuple[str, str, int], ...]:
    """Return outcome, reason and count of the cases that did not settle, the most frequent first.

    Reasons that differ in numbers only count as one, in the words of the first case.
    """
    found: dict[tuple[str, str], list[str]] = {}
    for outcome, reason in zip(
        table["outcome"].to_pylist(), table["reason"].to_pylist(), strict=True
    ):
        if outcome != "settled":
            key = outcome, re.sub(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", "#", reason)
            found.setdefault(key, []).append(reason)
    order = sorted(
        found.items(), key=lambda item: -len(item[1])
    )  # ties stay in the order of the cases
    return tuple((outcome, reasons[0], len(reasons)) for (outcome, _), reasons in order)


def _page_of(
    study: Study,
    table: Any,
    reasons: Sequence[tuple[str, str, int]],
    uncertified: Sequence[tuple[str, str, str]],
) -> str:
    """Return the page of a study whose rows are all there; the same rows give the same page."""
    columns = columns_of(study)
    quantities = list(columns)[1 : list(columns).index("roll")]
    outcomes = table["outcome"].to_pylist()
    how = (
        "every combination"
        if study.count is None
        else f"a random sample, seed {study.seed}"
    )
    body = [f"<p>{len(study)} cases, {how}; study {study.fingerprint[:12]}</p>"]
    # A line for each value that a quantity takes, and one for all cases.
    lines = [("all cases", Counter(outcomes))]
    for name in quantities:
        count = Counter(zip(table[name].to_pylist(), outcomes, strict=True))
        levels = [
            value
            for value in dict.fromkeys(value for value, _ in count)
            if value is not None
        ]
        unit = f" {columns[name]}" * (columns[name] not in ("string", "1"))
        for value in levels if 1 < len(levels) <= _MOST_LINES else ():
            text = (
                value
                if isinstance(value, str)
                else f"{name.replace('_', ' ')} {value:.6g}{unit}"
            )
            lines.append(
                (
                    text,
                    Counter({outcome: count[value, outcome] for outcome in OUTCOMES}),
                )
            )
    counts = [
        [text, *map(str, (found.total(), *(found[name] for name in OUTCOMES)))]
        for text, found in lines
    ]
    body.append(_html_table(["", "cases", *OUTCOMES], counts))
    if reasons:
        of_each = [[str(count), outcome, reason] for outcome, reason, count in reasons]
        body.append(
            _html_table(["cases", "outcome", "reason, as in the first"], of_each)
        )
    if uncertified:
        body.append(_html_table(["gait", "vehicle", "no certificate"], uncertified))
    return _PAGE.format(name=escape(study.name), body="\n".join(body))


def _html_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = [
        f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in line)}</tr>"
        for line in (head, *lines)
    ]
    return f'<table cellpadding="4">{"".join(rows)}</table>'
