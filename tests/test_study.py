"""Studies: what they ask for, their cases, their rows on disk, the page, the command, and Dask."""

from __future__ import annotations

import json
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

import gaitgraph as gg
from gaitgraph.certificates import check
from gaitgraph.errors import FileProblem, Infeasible, InputError, OutputExists
from gaitgraph.flight.flight import FlightSettings
from gaitgraph.flight.simulation import fly
from gaitgraph.study import running
from gaitgraph.study.design import (
    FLIGHT,
    columns_of,
    read_study,
    study_from_mapping,
)
from gaitgraph.study.running import StudyRun, flown_batch, row_of, run_study, versions
from gaitgraph.vehicle import PAPER
from tests.samples import gait_of_paper

SMALL: dict[str, Any] = {
    "name": "small",
    "gaits": ["gait1", "gait4"],
    "attitudes": {"roll": [0.0, "20deg"], "pitch": [0.0, 0.2]},
    "flight": {"duration": 0.6},
}
EXAMPLES = sorted(
    (Path(__file__).parent.parent / "examples" / "studies").glob("*.toml")
)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return run_study(SMALL, tmp_path_factory.mktemp("studies") / "small", workers=0)


def test_a_grid_has_every_combination_once_the_pitch_fastest() -> None:
    study = study_from_mapping(
        SMALL
        | {
            "vehicles": [
                "paper",
                {
                    "preset": "paper",
                    "drag_ratio": [0.1, 0.2],
                    "servo_lag": [0.01, 0.02, 0.03],
                },
            ],
            "biases": [1.0, 0.8],
            "periods": {"from": 1, "to": 2, "count": 2},
        }
    )
    cases = [study.case(number) for number in range(len(study))]
    keys = {
        repr(
            (
                one.model,
                one.varied,
                one.source,
                one.bias,
                one.period,
                one.roll,
                one.pitch,
            )
        )
        for one in cases
    }
    assert len(study) == len(keys) == (1 + 2 * 3) * 2 * 2 * 2 * 2 * 2
    assert [one.pitch for one in cases[:3]] == [0.0, 0.2, 0.0]
    assert [one.period for one in cases[:8:4]] == [1.0, 2.0]
    assert [list(cases[k].varied.values()) for k in (0, 32, 64)] == [
        [],
        [0.1, 0.01],
        [0.1, 0.02],
    ]
    assert (cases[-1].vehicle.drag_ratio, cases[-1].vehicle.servo_lag) == (0.2, 0.03)
    assert [number for batch in study.batches for number in batch] == list(
        range(len(study))
    )
    assert (len(study.batches[0]), len(study.batches)) == (4, 56)


def test_a_case_of_a_random_sample_depends_on_the_seed_and_its_number_alone() -> None:
    asked = SMALL | {
        "vehicles": [
            "beetle_omni",
            {"preset": "paper", "mass": {"from": 0.3, "to": 0.6}},
        ],
        "attitudes": {"roll": {"from": -0.5, "to": 0.5}, "pitch": [0.0, 0.1]},
        "periods": {"from": 0.5, "to": 2.0},
        "sample": {"kind": "random", "count": 400, "seed": 5},
    }
    study, longer = (
        study_from_mapping(asked),
        study_from_mapping(asked | {"sample": {"count": 1000, "seed": 5}}),
    )
    other = study_from_mapping(asked | {"sample": {"count": 400, "seed": 6}})
    cases = [study.case(number) for number in range(400)]
    assert [longer.case(k).roll for k in reversed(range(400))] == [
        one.roll for one in cases
    ][::-1]
    assert sum(other.case(k).roll == cases[k].roll for k in range(400)) == 0
    rolls = np.array([one.roll for one in cases])
    assert -0.5 <= rolls.min() < -0.48 < 0.48 < rolls.max() < 0.5
    assert abs(np.histogram(rolls, bins=5, range=(-0.5, 0.5))[0] - 80).max() < 30
    assert {one.pitch for one in cases} == {0.0, 0.1}
    assert 150 < sum(one.model.base.name == "beetle_omni" for one in cases) < 250
    masses = [one.vehicle.mass for one in cases if one.varied]
    assert len(set(masses)) == len(masses)
    assert len(study_from_mapping(asked | {"sample": {"count": 1}})) == 1
    assert study.as_mapping()["sample"] == asked["sample"]
    # Pinned: later versions continue a stored study.
    assert (cases[17].roll, cases[17].period) == pytest.approx(
        (0.4349099096549526, 1.1392466424151815), abs=1e-15
    )


def test_a_study_is_known_by_its_content() -> None:
    asked = SMALL | {
        "vehicles": [
            "paper",
            {
                "preset": "paper",
                "inertia": [[1e-3, 1e-3, 2e-3], [2e-3, 2e-3, 4e-3]],
                "name": "two",
            },
        ],
        "gaits": [
            "gait4",
            {
                "waypoints": [["pi/8", "-pi/8"], [1.2, -1.2]],
                "color": "red",
                "name": "line",
            },
        ],
    }
    study = study_from_mapping(asked)
    assert study_from_mapping(asked).fingerprint == study.fingerprint
    assert study.as_mapping()["sample"] == "grid"
    assert (
        study_from_mapping(asked | {"name": "other"}).fingerprint != study.fingerprint
    )
    assert pickle.loads(pickle.dumps(study)) == study  # as workers get it
    assert list(columns_of(study))[3:6] == ["inertia_x", "inertia_y", "inertia_z"]


def test_gaits_come_from_files_too(tmp_path: Path) -> None:
    gait = gait_of_paper(3)
    gait.parametrize(2.0).write(tmp_path / "mine.csv")
    (tmp_path / "plane.csv").write_text(
        "alpha1,alpha2,color\n"
        + "\n".join(f"{a!r},{b!r},red" for a, b in gait.alpha[:, :2].tolist())
        + "\n"
    )
    (tmp_path / "asked.toml").write_text(
        'waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]\nperiod = 9.0\n'
    )
    study = study_from_mapping(
        SMALL
        | {
            "gaits": [
                "gait3",
                "mine.csv",
                {"file": "plane.csv", "name": "lifted"},
                "asked.toml",
            ]
        },
        folder=tmp_path,
    )
    shutil.rmtree(tmp_path)  # a study needs no file any more
    assert [source.name for source in study.sources] == [
        "gait3",
        "mine",
        "lifted",
        "asked",
    ]
    for source in study.sources:
        np.testing.assert_allclose(source.gait(PAPER).alpha, gait.alpha, atol=1e-9)


def test_a_file_that_is_no_study_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    for text, message in (
        ("gaits = [", "it is not TOML"),
        ("gaits = ['gait3']\nperiods = 0", "periods must be between"),
        ("gaits = ['none.csv']", r"gait 1: gait file '.*none\.csv' cannot be read"),
    ):
        path.write_text(text)
        with pytest.raises(
            (InputError, FileProblem), match=rf"study file '.*a\.toml': {message}"
        ):
            read_study(path)


def test_the_examples_are_flown_in_minutes() -> None:
    for path in EXAMPLES:
        study = read_study(path)
        assert len(study) <= 10_000
        assert study.seconds <= 600.0


def test_rows_state_the_gait_and_the_flight(small: StudyRun) -> None:
    table = small.table
    assert table.schema.names == list(columns_of(small.study))
    assert table["case"].to_pylist() == list(range(8))
    rows = table.to_pylist()
    assert [row["outcome"] for row in rows] == ["refused"] * 4 + ["settled"] * 4
    for row in rows[:4]:
        assert row["reason"].startswith("refused before take-off: ")
        assert (row["valid"], row["flyable"], row["peak_thrust"]) == (True, False, None)
    assert all(
        (row["flyable"], row["reason"], row["duration"]) == (True, "", 0.6)
        for row in rows[4:]
    )
    assert small.outcomes == {
        "settled": 4,
        "not settled": 0,
        "refused": 4,
        "no gait": 0,
        "failed": 0,
    }


def test_a_case_that_fails_is_a_row_with_its_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    study = study_from_mapping(
        SMALL
        | {
            "vehicles": [
                {"name": "bare", "drag_ratio": 0.1},
                {"preset": "paper", "drag_ratio": [0.1, 0.2]},
            ],
            "gaits": [
                {
                    "waypoints": [[0.1, 0.1], [1.2, -1.2]],
                    "color": "red",
                    "name": "torn",
                },
                "gait3",
            ],
            "attitudes": {},
        }
    )
    gaits: dict[str, Any] = {}
    rows = [row_of(study.case(number), study, gaits) for number in range(4)]
    assert len(gaits) == 4  # nothing is planned twice, failures too
    assert [row_of(study.case(number), study, gaits) for number in range(4)] == rows
    assert [row["outcome"] for row in rows] == [
        "no gait",
        "failed",
        "no gait",
        "settled",
    ]
    assert rows[0]["reason"].startswith("no closed loop: ")
    assert "bare" in rows[1]["reason"]
    assert rows[1]["flyable"] is True
    assert rows[3]["drag_ratio"] == 0.1

    def broken(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr(running, "fly", broken)
    assert (
        row_of(study.case(3), study, {})["reason"]
        == "ZeroDivisionError: division by zero"
    )


def test_a_row_is_the_flight_of_its_case() -> None:
    places = {"biases": 0.8, "periods": 1.5, "attitudes": {"roll": 0.3, "pitch": -0.1}}
    study = study_from_mapping(SMALL | places | {"gaits": ["gait2"], "anyway": True})
    row = row_of(study.case(0), study, {})
    timed = gait_of_paper(2).biased(0.8).parametrize(1.5)
    flight = fly(
        timed, attitude=(0.3, -0.1), settings=FlightSettings(duration=0.6), anyway=True
    )
    assert row["gait_tilt_rate"] == timed.peak_rates.max()
    assert {name: row.get(name) for name in FLIGHT} == {
        name: flight.as_mapping()[name] for name in FLIGHT
    }


def test_each_flyable_gait_has_a_certificate(small: StudyRun, tmp_path: Path) -> None:
    (path,) = (small.folder / "certificates").iterdir()
    assert path.name == "1_gait4_paper.cert.json"  # gait1 is not flyable
    assert check.check(path.read_text())["proved"]
    none = run_study(
        {"name": "none", "gaits": ["gait1"], "flight": {"duration": 0.1}},
        tmp_path / "none",
        workers=0,
    )
    assert not list((none.folder / "certificates").iterdir())
    (row,) = none.table.to_pylist()
    with pytest.raises(Infeasible) as error:
        gg.certify("gait1")
    assert row["uncertified"] == str(error.value)
    assert set(small.table["uncertified"].to_pylist()[4:]) == {""}


def test_units_and_what_made_them_are_in_the_file(small: StudyRun) -> None:
    parts = sorted((small.folder / "rows").iterdir())
    assert [path.name for path in parts] == [f"part-{k:05d}.parquet" for k in range(8)]
    schema = pa.parquet.read_schema(parts[0])
    assert [
        schema.field(name).metadata[b"unit"]
        for name in ("period", "energy", "drag_ratio")
    ] == [b"s", b"J", b"1"]
    assert schema.field("outcome").metadata is None
    assert (
        json.loads(schema.metadata[b"gaitgraph"])["fingerprint"]
        == small.study.fingerprint
    )
    for content in (parts[0].read_bytes(), (small.folder / "study.json").read_bytes()):
        assert str(Path.home()).encode() not in content


def test_what_is_there_is_kept_and_the_rest_is_flown(
    small: StudyRun, tmp_path: Path
) -> None:
    folder = tmp_path / "again"
    shutil.copytree(small.folder, folder)
    for number in (0, 5, 7):
        (folder / "rows" / f"part-{number:05d}.parquet").unlink()
    words: list[str] = []
    run = run_study(SMALL, folder, workers=0, progress=words.append)
    assert run.flown == 3
    assert contents(folder) == contents(small.folder)
    assert [word.split(",")[0] for word in words if "of 8" in word] == [
        f"{k} of 8 cases" for k in range(5, 9)
    ]
    assert re.fullmatch(r"7 of 8 cases, about 0:00:\d\d left", words[-2])
    part = folder / "rows" / "part-00002.parquet"
    part.write_bytes(part.read_bytes()[:500])
    with pytest.raises(
        FileProblem, match=r"rows cannot be read: .*part-00002.*; delete the part and"
    ):
        run_study(SMALL, folder, workers=0)
    part.unlink()
    assert run_study(SMALL, folder, workers=0).flown == 1
    assert contents(folder) == contents(small.folder)


def test_a_folder_of_something_else_is_refused(small: StudyRun, tmp_path: Path) -> None:
    def refused(asked: dict[str, Any], folder: Path, message: str) -> None:
        before = contents(tmp_path)
        with pytest.raises(
            (OutputExists, FileProblem),
            match="output must be a new folder or one of this study, .*" + message,
        ):
            run_study(asked, folder, workers=0)
        assert contents(tmp_path) == before

    refused(SMALL | {"periods": 2.0}, small.folder, "of another study or other ver")
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "a.png").write_bytes(b"x")
    refused(SMALL, tmp_path / "pictures", "pictures' with other files")
    refused(SMALL, tmp_path / "pictures" / "a.png", "File exists")
    refused(SMALL, tmp_path / "none" / "deep", "No such file")
    old = tmp_path / "old"
    shutil.copytree(small.folder, old)
    text = (old / "study.json").read_text()
    (old / "study.json").write_text(text.replace(versions()["mujoco"], "3.2.0"))
    refused(SMALL, old, "other versions")


def test_the_command_counts_flies_and_reports(run: Any, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        "gaits = ['gait1', 'gait4']\nflight.duration = 0.6\n"
    )
    dry = run("study", "s.toml", "--dry-run")
    assert (dry.code, dry.out.splitlines()[0]) == (
        0,
        "Study s: 2 cases, a grid, in 2 batches",
    )
    assert run("study", "s.toml", "--dry-run", "--json").json["cases"] == 2
    assert not (tmp_path / "s").exists()
    done = run("study", "s.toml", "--workers", 0)
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines()[:3] == [
        "Study s: 2 cases",
        "  settled  1",
        "  refused  1",
    ]
    again = run("study", "s.toml", "--workers", 0, "--json").json
    assert (again["flown"], again["kept"], again["settled"]) == (0, 2, 1)
    for arguments, message in (
        (
            ("--workers", 2000),
            "workers must be a whole number from 0 to 1024, got 2000",
        ),
        (
            ("--workers", 2, "--scheduler", "tcp://127.0.0.1:1"),
            "workers must be left out beside a scheduler, got 2",
        ),
    ):
        wrong = run("study", "s.toml", *arguments)
        assert (wrong.code, wrong.out, wrong.err) == (2, "", f"gaitgraph: {message}\n")


def test_an_interrupt_ends_the_study_in_order(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s.toml").write_text(
        "gaits = ['gait1']\n[attitudes]\nroll = [0.1, 0.2, 0.3]\n"
    )
    true = running.row_of

    def ended(case: Any, *rest: Any) -> Any:
        if case.number == 1:
            try:
                signal.raise_signal(signal.SIGINT)
            finally:
                signal.raise_signal(signal.SIGINT)  # again, while it cleans up
        return true(case, *rest)

    with monkeypatch.context() as context:
        context.setattr(running, "row_of", ended)
        done = run("study", "s.toml", "--workers", 0)
    assert (done.code, done.out) == (130, "")
    assert (
        done.err
        == "gaitgraph: interrupted; 1 of 3 parts are in 's'; run the same command again to continue\n"
    )
    assert run("study", "s.toml", "--workers", 0, "--json").json["flown"] == 2


def test_a_scheduler_that_does_not_answer_is_one_line(run: Any, tmp_path: Path) -> None:
    dask = pytest.importorskip("dask", reason="install the extra 'study'")
    (tmp_path / "s.toml").write_text("gaits = ['gait3']\n")
    for address in ("tcp://127.0.0.1:9", "carrier://pigeon"):
        with dask.config.set({"distributed.comm.timeouts.connect": "1s"}):
            done = run("study", "s.toml", "--scheduler", address)
        assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
        assert (
            f"must be the address of a running Dask scheduler with workers, got '{address}' ("
            in done.err
        )


# Worker processes


def workers_of(process: int) -> list[Any]:
    psutil = pytest.importorskip("psutil", reason="install psutil")
    return [
        one
        for one in psutil.Process(process).children(recursive=True)
        if "spawn_main" in " ".join(one.cmdline())
    ]


@pytest.mark.slow
def test_workers_one_killed_midway_write_the_same_bytes(
    small: StudyRun, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    killed: list[int] = []

    def kill_one(words: str) -> None:
        if not killed and words.startswith("2 of"):
            killed.append(workers_of(os.getpid())[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    run = run_study(SMALL, tmp_path / "two", workers=2, progress=kill_one)
    assert killed
    assert run.outcomes["failed"] == 0
    assert contents(tmp_path / "two") == contents(small.folder)
    assert workers_of(os.getpid()) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_a_driver_that_ends_leaves_no_workers_and_is_continued(
    tmp_path: Path, end: signal.Signals
) -> None:
    psutil = pytest.importorskip("psutil", reason="install psutil")
    (tmp_path / "s.toml").write_text(
        "gaits = ['gait4']\nattitudes.roll = { from = -0.4, to = 0.4, count = 40 }\nflight.duration = 1\n"
    )
    parts = tmp_path / "s" / "rows"
    command = [sys.executable, "-m", "gaitgraph", "study", "s.toml", "--workers", "1"]
    with subprocess.Popen(
        command, cwd=tmp_path, stderr=subprocess.PIPE, start_new_session=True
    ) as driver:
        while len(list(parts.glob("*.parquet"))) < 2:
            assert driver.poll() is None
            sleep(0.01)
        below = workers_of(driver.pid)
        if end is signal.SIGINT:  # from a terminal, all of its processes get it
            os.killpg(driver.pid, end)
        else:
            driver.kill()
        _, error = driver.communicate(timeout=60)
    kept = len(list(parts.glob("*.parquet")))
    assert below
    assert psutil.wait_procs(below, timeout=30)[1] == [], (
        "workers outlive the process that started them"
    )
    if end is signal.SIGINT:
        assert error.decode() == (
            f"gaitgraph: interrupted; {kept} of 40 parts are in 's'; run the same command again to continue\n"
        )
    assert run_study(tmp_path / "s.toml", tmp_path / "s", workers=0).flown == 40 - kept


@pytest.mark.slow
def test_a_cluster_flies_the_same_and_stays(
    small: StudyRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed", reason="install distributed")
    options = {
        "processes": False,
        "protocol": "tcp",
        "dashboard_address": "127.0.0.1:0",
        "silence_logs": 60,
    }
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, **options
    ) as cluster:
        run_study(SMALL, tmp_path / "there", scheduler=cluster.scheduler_address)
        assert contents(tmp_path / "there") == contents(small.folder)
        with distributed.Client(
            cluster.scheduler_address, set_as_default=False
        ) as client:
            assert client.submit(abs, -1).result() == 1
    monkeypatch.setattr(running, "_PATIENCE", 0.4)
    with (
        distributed.LocalCluster(n_workers=0, **options) as cluster,
        pytest.raises(
            InputError,
            match=r"a running Dask scheduler with workers, got 'tcp://.*Only 0/1 workers arrived",
        ),
    ):
        run_study(SMALL, tmp_path / "empty", scheduler=cluster.scheduler_address)


CLUSTER = """
from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=60
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""


@pytest.mark.slow
@pytest.mark.parametrize("end", ["killed", "closed"])
def test_a_scheduler_that_ends_is_one_line_and_the_same_command_continues(
    tmp_path: Path, end: str
) -> None:
    pytest.importorskip("distributed", reason="install distributed")
    psutil = pytest.importorskip("psutil", reason="install psutil")
    (tmp_path / "s.toml").write_text(
        "gaits = ['gait4']\nattitudes.roll = { from = -0.4, to = 0.4, count = 40 }\nflight.duration = 1\n"
    )
    (tmp_path / "cluster.py").write_text(CLUSTER)
    parts = tmp_path / "s" / "rows"
    piped: dict[str, Any] = {"cwd": tmp_path, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(
        [sys.executable, "cluster.py"], stdin=subprocess.PIPE, **piped
    ) as cluster:
        assert cluster.stdin is not None
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        command = [sys.executable, "-m", "gaitgraph", "study", "s.toml"]
        with subprocess.Popen(
            [*command, "--scheduler", address], stderr=subprocess.PIPE, **piped
        ) as driver:

            def wait_for(count: int) -> None:
                while len(list(parts.glob("*.parquet"))) < count:
                    assert driver.poll() is None
                    sleep(0.01)

            wait_for(2)
            below = workers_of(cluster.pid)
            below[0].kill()
            wait_for(5)
            if end == "killed":
                cluster.kill()
            else:
                cluster.stdin.write("\n")
                cluster.stdin.flush()
            output, error = driver.communicate(timeout=120)
    assert len(below) == 2
    assert psutil.wait_procs(below, timeout=30)[1] == []
    assert (driver.returncode, output) == (2, "")
    assert error == (
        f"gaitgraph: the Dask scheduler {address!r} is gone; rows that are written are kept; run the same study again "
        "to continue\n"
    )
    kept = len(list(parts.glob("*.parquet")))
    again = run_study(tmp_path / "s.toml", tmp_path / "s", workers=0)
    assert (again.flown, again.outcomes["failed"]) == (40 - kept, 0)
    run_study(tmp_path / "s.toml", tmp_path / "whole", workers=0)
    assert contents(tmp_path / "s") == contents(tmp_path / "whole")


def die_at_a_roll(numbers: Any, study: Any) -> Any:
    """Stand for a case that ends its process, as a fault in a compiled library does."""
    rows = flown_batch(numbers, study)
    if any(row["roll"] == 0.4 for row in rows):
        os.kill(os.getpid(), signal.SIGKILL)
    return rows


@pytest.mark.slow
def test_a_case_that_kills_its_worker_is_a_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dask = pytest.importorskip("dask", reason="install the extra 'study'")
    monkeypatch.setattr(running, "flown_batch", die_at_a_roll)
    asked = SMALL | {"gaits": ["gait4"], "attitudes": {"roll": [0.2, 0.4, 0.3]}}
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
        rows = run_study(asked, tmp_path / "killing", workers=1).table.to_pylist()
    assert [(row["case"], row["outcome"]) for row in rows] == [
        (0, "settled"),
        (1, "failed"),
        (2, "settled"),
    ]
    assert rows[1]["reason"] == "each worker that flew this case alone died"


@pytest.mark.slow
def test_workers_need_the_same_versions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed", reason="install distributed")
    other = {"gaitgraph": "0.0", "mujoco": "1.0"}
    monkeypatch.setattr(distributed.Client, "run", lambda *_: {"tcp://worker": other})
    with (
        distributed.LocalCluster(
            n_workers=1,
            processes=False,
            dashboard_address="127.0.0.1:0",
            silence_logs=60,
        ) as cluster,
        pytest.raises(InputError, match=r"workers must have .*, got .*'0.0'"),
    ):
        run_study(SMALL, tmp_path / "other", scheduler=cluster.scheduler_address)
