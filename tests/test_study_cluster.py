"""Studies on Dask: real worker processes, one of them killed; a driver that is killed; clusters that are not there."""

from __future__ import annotations

import logging
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest

from gaitgraph.errors import InputError
from gaitgraph.study import clusters
from gaitgraph.study.cases import flown_batch
from gaitgraph.study.running import run_study
from tests.test_study import contents

psutil = pytest.importorskip("psutil")
distributed = pytest.importorskip("distributed")

STUDY: dict[str, Any] = {
    "name": "cluster",
    "gaits": ["gait1", "gait4"],
    "biases": [1.0, 0.9],
    "attitudes": {"roll": {"from": -0.4, "to": 0.4, "count": 3}, "pitch": [0.0, 0.2]},
    "flight": {"duration": 0.3},
}
TOML = """
name = "cluster"
gaits = ["gait1", "gait4"]
biases = [1.0, 0.9]
attitudes = { roll = { from = -0.4, to = 0.4, count = 3 }, pitch = [0.0, 0.2] }
flight = { duration = 0.3 }
"""


def worker_processes(of: int) -> list[Any]:
    """Return the processes that fly, below one that runs a study."""
    found = []
    for process in psutil.Process(of).children(recursive=True):
        with suppress(psutil.Error):  # it ends at this very moment
            if "spawn_main" in " ".join(process.cmdline()):
                found.append(process)
    return found


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What the study comes to when this process flies it."""
    folder = tmp_path_factory.mktemp("alone") / "rows"
    run_study(STUDY, folder, workers=0)
    return contents(folder)


def test_two_workers_one_killed_midway_write_the_same_bytes(
    alone: dict[str, bytes], tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    killed: list[int] = []
    # The first worker that is up begins alone; here both are to be at work when one dies.
    monkeypatch.setattr(clusters, "_wait_for_one", lambda client, *_: client.wait_for_workers(2, timeout=120))

    def kill_one(words: str) -> None:
        here = worker_processes(os.getpid())
        if not killed and words.startswith(("5 ", "6 ", "7 ", "8 ")) and len(here) == 2:
            killed.append(here[0].pid)
            os.kill(here[0].pid, signal.SIGKILL)

    run = run_study(STUDY, tmp_path / "two", workers=2, progress=kill_one)
    assert killed
    assert run.outcomes["failed"] == 0
    assert contents(tmp_path / "two") == alone
    assert not psutil.wait_procs(worker_processes(os.getpid()), timeout=30)[1]
    assert capfd.readouterr() == ("", "")
    assert logging.getLogger("distributed").level != logging.CRITICAL + 1


def test_a_driver_killed_midway_is_gone_on_with(alone: dict[str, bytes], tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(TOML)
    rows = tmp_path / "study" / "rows"
    command = [sys.executable, "-m", "gaitgraph", "study", "study.toml", "--workers", "1"]
    quiet: dict[str, Any] = {"cwd": tmp_path, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, env=os.environ | {"TMPDIR": str(tmp_path)}, **quiet) as driver:
        while len(list(rows.glob("*.parquet"))) < 4:
            assert driver.poll() is None, driver.stderr.read().decode() if driver.stderr else ""
            sleep(0.01)
        below = psutil.Process(driver.pid).children(recursive=True)
        driver.send_signal(signal.SIGKILL)
        driver.wait()
    kept = len(list(rows.glob("*.parquet")))
    assert 4 <= kept < 24
    run = run_study(tmp_path / "study.toml", tmp_path / "study", workers=0)
    assert run.flown == 24 - kept
    assert contents(tmp_path / "study") == alone
    _, alive = psutil.wait_procs(below, timeout=30)
    assert alive == [], "workers outlive the process that started them"


def test_a_cluster_that_is_there_flies_the_same_and_stays(alone: dict[str, bytes], tmp_path: Path) -> None:
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
        scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
    ) as cluster:
        address = cluster.scheduler_address
        run_study(STUDY, tmp_path / "there", scheduler=address)
        assert contents(tmp_path / "there") == alone
        with distributed.Client(address, set_as_default=False) as client:
            assert client.submit(abs, -1).result() == 1


def die_at_a_roll(text: str, numbers: Any, expected: Any) -> Any:
    """Stand for a case that ends its process, as a fault in a compiled library does."""
    rows = flown_batch(text, numbers, expected)
    if any(row["roll"] == 0.4 and row["pitch"] == 0.2 and row["gait"] == "gait4" for row in rows):
        os.kill(os.getpid(), signal.SIGKILL)
    return rows


def test_a_case_that_kills_its_worker_is_a_row_that_says_so(
    alone: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "flown_batch", die_at_a_roll)
    monkeypatch.setattr(clusters, "_DEATHS", 0)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent.parent))
    asked = STUDY | {"biases": 1.0, "attitudes": {"roll": [0.2, 0.4], "pitch": [0.0, 0.2]}}
    run = run_study(asked, tmp_path / "killing", workers=1)
    rows = run.table.to_pylist()
    lost = [row for row in rows if row["outcome"] == "failed"]
    assert [(row["gait"], row["roll"], row["pitch"], row["reason"]) for row in lost] == [
        ("gait4", 0.4, 0.2, clusters.LOST)
    ]
    assert [row["case"] for row in rows] == list(range(8))


def test_a_scheduler_that_does_not_answer_is_told_in_one_line(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s.toml").write_text("gaits = ['gait3']\n")
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        for patience, address, message in (
            (0.5, f"tcp://127.0.0.1:{port}", "does not answer within 0.5 s; allowed is the address of a running Dask"),
            (0.5, "tcp://127.0.0.1:9", "does not answer within 0.5 s; allowed is"),
            (
                5.0,
                "carrier://pigeon",
                "is no Dask scheduler; allowed is the address of a running Dask",
            ),
        ):
            monkeypatch.setattr(clusters, "PATIENCE", patience)
            begun = monotonic()
            done = run("study", "s.toml", "--scheduler", address)
            assert (done.code, done.out) == (2, "")
            assert done.err.startswith(f"gaitgraph: --scheduler: '{address}' {message}")
            assert done.err.count("\n") == 1
            assert monotonic() - begun < 30
    assert not (tmp_path / "s").exists()


def test_a_cluster_without_workers_is_waited_for_and_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "EMPTY", 0.4)
    words: list[str] = []
    with distributed.LocalCluster(
        n_workers=0,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
        scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
    ) as cluster:
        address = cluster.scheduler_address
        with pytest.raises(
            InputError, match=f"--scheduler: '{address}' had no workers for 0.4 s; allowed is a cluster"
        ):
            run_study(STUDY, tmp_path / "empty", scheduler=address, progress=words.append)
    assert f"waiting for workers of {address}" in words


def test_workers_that_end_again_and_again_are_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[list[str]] = []

    class Killed:
        def __init__(self, command: list[str], **_: Any) -> None:
            begun.append(command)

        def poll(self) -> int:
            return -9

    security = distributed.security.Security.temporary()
    monkeypatch.setattr(subprocess, "Popen", Killed)
    foreman = clusters._Foreman(2, "tls://127.0.0.1:1", security, tmp_path)
    foreman.start()
    told = "workers: the process that keeps them was started 4 times; signal 9 ended it; allowed is a machine that"
    for _ in range(3):
        foreman.tend(True)
    with pytest.raises(InputError, match=told):
        foreman.tend(True)
    assert len(begun) == 4
    (tmp_path / "log").write_text("nanny - INFO - Start\nOSError: no room\nnanny - INFO - End\n")
    with pytest.raises(InputError, match="4 times; OSError: no room; allowed"):
        foreman.tend(True)


def test_no_logger_of_dask_speaks() -> None:
    with clusters._quietly():
        for name in ("distributed.client", "distributed.core", "distributed.made_later", "tornado.application"):
            assert not logging.getLogger(name).isEnabledFor(logging.CRITICAL), name
    assert logging.getLogger("distributed.client").isEnabledFor(logging.ERROR)


def test_workers_with_another_package_end_the_study(tmp_path: Path) -> None:
    class Future:
        status = "error"

        def exception(self) -> Exception:
            return ModuleNotFoundError("No module named 'gaitgraph'")

    answers = clusters._problem_of(Future())
    assert isinstance(answers, InputError)
    assert str(answers) == (
        "--scheduler: a worker cannot run the study (ModuleNotFoundError: No module named 'gaitgraph'); allowed are "
        "workers with this gaitgraph and its extra study"
    )


def test_threads_end_with_the_cluster() -> None:
    names = [thread.name for thread in threading.enumerate() if thread.is_alive()]
    assert not [name for name in names if "profile" in name.lower()]
