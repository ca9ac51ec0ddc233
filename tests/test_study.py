"""Studies: what they ask for, their cases, their rows on disk, the command, and Dask."""

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
from gaitgraph.study.design import FLIGHT, columns_of, read_study, study_from_mapping
from gaitgraph.study.running import StudyRun, flown_batch, row_of, run_study, versions
from tests.published import GAITS
from tests.samples import gait_of_paper

SMALL: dict[str, Any] = {
    "name": "small",
    "gaits": ["gait1", "gait4"],
    "attitudes": {"roll": [0.0, "20deg"], "pitch": [0.0, 0.2]},
    "flight": {"duration": 0.6},
}
RANDOM = SMALL | {
    "vehicles": [
        "beetle_omni",
        {"preset": "paper", "mass": {"from": 0.3, "to": 0.6}},
    ],
    "attitudes": {"roll": {"from": -0.5, "to": 0.5}, "pitch": [0.0, 0.1]},
    "periods": {"from": 0.5, "to": 2.0},
}
EXAMPLES = Path(__file__).parent.parent / "examples" / "studies"
PYTHON = [sys.executable, "-m", "gaitgraph"]


def contents(folder: Path) -> dict[str, bytes]:
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return run_study(SMALL, tmp_path_factory.mktemp("studies") / "small", workers=0)


# -- Design


def test_a_grid_has_every_combination_once_the_pitch_fastest() -> None:
    varied = {"drag_ratio": [0.1, 0.2], "servo_lag": [0.01, 0.02, 0.03]}
    periods = {"from": 1, "to": 2, "count": 2}
    asked = SMALL | {"vehicles": ["paper", {"preset": "paper", **varied}]}
    study = study_from_mapping(asked | {"biases": [1.0, 0.8], "periods": periods})
    rows = [study.case(number).known() for number in range(len(study))]
    keys = {repr([*row.values()][1:]) for row in rows}
    assert len(study) == len(keys) == (1 + 2 * 3) * 2 * 2 * 2 * 2 * 2
    assert [row["case"] for row in rows] == list(range(len(study)))
    assert [row["pitch"] for row in rows[:3]] == [0.0, 0.2, 0.0]
    assert [row["period"] for row in rows[:8:4]] == [1.0, 2.0]
    constants = [(row.get("drag_ratio"), row.get("servo_lag")) for row in rows[::32]]
    assert constants[:3] == [(None, None), (0.1, 0.01), (0.1, 0.02)]
    assert rows[32]["vehicle"] == "paper, drag ratio, servo lag varied"
    assert columns_of(study)["servo_lag"] == "s"
    last = study.case(len(study) - 1).vehicle
    assert (last.drag_ratio, last.servo_lag) == (0.2, 0.03)
    numbers = [number for batch in study.batches for number in batch]
    assert numbers == list(range(len(study)))
    assert (len(study.batches[0]), len(study.batches)) == (4, 56)


def test_a_case_of_a_random_sample_depends_on_the_seed_and_its_number_alone() -> None:
    def drawn(count: int, seed: int) -> list[Any]:
        study = study_from_mapping(RANDOM | {"sample": {"count": count, "seed": seed}})
        return [study.case(number) for number in range(400)]

    drawn_cases = drawn(400, 5)
    for case, longer, other in zip(
        drawn_cases, drawn(1000, 5), drawn(400, 2**64 - 1), strict=True
    ):
        assert longer.roll == case.roll != other.roll
    rolls = [case.roll for case in drawn_cases]
    assert -0.5 <= min(rolls) < -0.48 < 0.48 < max(rolls) < 0.5
    histogram = np.histogram(rolls, bins=5, range=(-0.5, 0.5))[0]
    assert histogram == pytest.approx(80, abs=30)
    assert {case.pitch for case in drawn_cases} == {0.0, 0.1}
    masses = [case.vehicle.mass for case in drawn_cases if case.varied]
    assert 150 < len(set(masses)) == len(masses) < 250
    study = study_from_mapping(RANDOM | {"sample": {"count": 1}})
    assert study.as_mapping()["sample"] == {"kind": "random", "count": 1, "seed": 0}
    # Pinned: later versions continue a stored study.
    pinned = drawn_cases[17].roll, drawn_cases[17].period
    assert pinned == pytest.approx((0.4349099096549526, 1.1392466424151815), abs=1e-15)


def test_a_study_is_known_by_its_content() -> None:
    inertia = [[1e-3, 1e-3, 2e-3], [2e-3, 2e-3, 4e-3]]
    line = {"waypoints": [["pi/8", "-pi/8"], [1.2, -1.2]], "color": "red", "name": "a"}
    vehicles = ["paper", {"preset": "paper", "inertia": inertia, "name": "two"}]
    asked = SMALL | {"vehicles": vehicles, "gaits": ["gait4", line]}
    study, again = study_from_mapping(asked), study_from_mapping(asked)
    other = study_from_mapping(asked | {"name": "b"})
    assert again.fingerprint == study.fingerprint != other.fingerprint
    assert study.models[1].base.name == "two"
    assert study.as_mapping()["sample"] == "grid"
    assert pickle.loads(pickle.dumps(study)) == study  # as workers get it
    assert list(columns_of(study))[3:6] == ["inertia_x", "inertia_y", "inertia_z"]


def test_gaits_come_from_files_too(tmp_path: Path) -> None:
    gait = gait_of_paper(3)
    gait.parametrize(2.0).write(tmp_path / "mine.csv")
    rows = [f"{a!r},{b!r},red" for a, b in gait.alpha[:, :2].tolist()]
    (tmp_path / "plane.csv").write_text("\n".join(["alpha1,alpha2,color", *rows]))
    waypoints = [list(point) for point in GAITS[2].waypoints]
    (tmp_path / "asked.toml").write_text(f"waypoints = {waypoints}\nperiod = 9.0\n")
    lifted = {"file": "plane.csv", "name": "lifted"}
    gaits = ["gait3", "mine.csv", lifted, "asked.toml"]
    (tmp_path / "mine.toml").write_text("name = 'mine'\ndrag_ratio = 0.2\n")
    vehicles = [{"file": "mine.toml", "servo_lag": [0.01, 0.02]}]
    asked = SMALL | {"gaits": gaits, "vehicles": vehicles}
    study = study_from_mapping(asked, folder=tmp_path)
    shutil.rmtree(tmp_path)  # a study needs no file any more
    names = [source.name for source in study.sources]
    assert names == ["gait3", "mine", "lifted", "asked"]
    assert study.models[0].base.name == "mine, servo lag varied"
    assert study.models[0].base.drag_ratio == 0.2
    for source in study.sources:
        alpha = source.gait(gg.PAPER).alpha
        np.testing.assert_allclose(alpha, gait.alpha, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("gaits = [", "it is not TOML"),
        ("gaits = ['gait3']\nperiods = 0", "periods must be between"),
        ("gaits = ['gait3']\nperiods = []", "periods must have at least one value"),
        ("gaits = []", r"gaits must be a list with at least one entry, got \[\]"),
        ("gaits = 'gait3'", "gaits must be a list with at least one entry"),
        ("gaits = ['gait3']\nsample.kind = 'random'", "sample.kind must be grid, or"),
        (
            "gaits = ['gait3']\nsample = {kind = 'grid', count = 3}",
            "sample.kind must be grid, or random with a count",
        ),
        ("gaits = ['none.csv']", r"gait 1: gait file '.*none\.csv' cannot be read"),
    ],
)
def test_a_file_that_is_no_study_is_named(
    text: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(gg.GaitgraphError, match=rf"study file '.*a\.toml': {message}"):
        read_study(tmp_path / "a.toml")


@pytest.mark.parametrize(
    "path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem
)
def test_the_examples_are_flown_in_minutes(path: Path) -> None:
    study = read_study(path)
    assert len(study) <= 10_000
    assert len(study) * study.flight.seconds / 20.0 <= study.seconds <= 600.0


# -- Rows


def test_a_case_that_fails_is_a_row_with_its_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    torn = {"waypoints": [[0.1, 0.1], [1.2, -1.2]], "color": "red", "name": "torn"}
    bare = {"name": "bare", "drag_ratio": 0.1}
    vehicles = [bare, {"preset": "paper", "drag_ratio": [0.1, 0.2]}]
    asked = {"vehicles": vehicles, "gaits": [torn, "gait3"], "attitudes": {}}
    study = study_from_mapping(SMALL | asked)
    gaits: dict[str, Any] = {}
    rows = [row_of(study.case(number), study, gaits) for number in range(4)]
    assert len(gaits) == 4  # nothing is planned twice, failures too
    outcomes = ["no gait", "failed", "no gait", "settled"]
    assert [row["outcome"] for row in rows] == outcomes
    assert "bare" in rows[1]["reason"]
    assert (rows[1]["flyable"], rows[3]["drag_ratio"]) == (True, 0.1)

    def broken(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr(running, "fly", broken)
    row = row_of(study.case(3), study, {})
    assert row["reason"] == "ZeroDivisionError: division by zero"


def test_a_row_is_the_flight_of_its_case() -> None:
    asked = {"biases": 0.8, "periods": 1.5, "attitudes": {"roll": 0.3, "pitch": -0.1}}
    study = study_from_mapping(SMALL | asked | {"gaits": ["gait2"], "anyway": True})
    row = row_of(study.case(0), study, {})
    timed = gait_of_paper(2).biased(0.8).parametrize(1.5)
    settings = FlightSettings(duration=0.6)
    flight = fly(
        timed,
        attitude=(0.3, -0.1),
        settings=settings,
        anyway=True,
    )
    assert row["gait_tilt_rate"] == timed.peak_rates.max()
    values = flight.as_mapping()
    for name in FLIGHT:
        assert row.get(name) == values[name]


def test_each_flyable_gait_has_a_certificate(small: StudyRun) -> None:
    (path,) = (small.folder / "certificates").iterdir()
    assert path.name == "1_gait4_paper.cert.json"
    assert check.check(path.read_text())["proved"]
    with pytest.raises(Infeasible) as error:
        gg.certify("gait1")
    reasons = small.table["uncertified"].to_pylist()
    assert reasons == [str(error.value)] * 4 + [""] * 4


def test_units_and_what_made_them_are_in_the_file(small: StudyRun) -> None:
    parts = sorted((small.folder / "rows").iterdir())
    assert [path.name for path in parts] == [f"part-{k:05d}.parquet" for k in range(8)]
    schema = pa.parquet.read_schema(parts[0])
    for name, unit in (("period", b"s"), ("energy", b"J"), ("drag_ratio", b"1")):
        assert schema.field(name).metadata[b"unit"] == unit
    about = json.loads(schema.metadata[b"gaitgraph"])
    assert about["fingerprint"] == small.study.fingerprint
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
    assert run_study(SMALL, folder, workers=0, progress=words.append).flown == 3
    assert contents(folder) == contents(small.folder)
    counts = [word.split(",")[0] for word in words if "of 8" in word]
    assert counts == [f"{k} of 8 cases" for k in range(5, 9)]
    assert re.fullmatch(r"7 of 8 cases, about 0:00:\d\d left", words[-2])
    assert words[-1] == "8 of 8 cases"
    part = folder / "rows" / "part-00002.parquet"
    part.write_bytes(part.read_bytes()[:500])
    with pytest.raises(FileProblem, match=r"rows cannot be read: .*part-00002"):
        run_study(SMALL, folder, workers=0)


def test_a_folder_of_something_else_is_refused(small: StudyRun, tmp_path: Path) -> None:
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "a.png").write_bytes(b"x")
    old = tmp_path / "old"
    shutil.copytree(small.folder, old)
    text = (old / "study.json").read_text()
    (old / "study.json").write_text(text.replace(versions()["mujoco"], "3.2.0"))
    before = contents(tmp_path)
    for asked, folder in (
        (SMALL | {"periods": 2.0}, small.folder),
        (SMALL, tmp_path / "pictures"),
        (SMALL, tmp_path / "pictures" / "a.png"),
        (SMALL, tmp_path / "none" / "deep"),
        (SMALL, old),
    ):
        with pytest.raises((OutputExists, FileProblem), match="^output must be a new"):
            run_study(asked, folder, workers=0)
    assert contents(tmp_path) == before


# -- The command


def test_the_command_counts_flies_and_reports(run: Any, tmp_path: Path) -> None:
    text = "gaits = ['gait1', 'gait4']\nflight.duration = 0.6\n"
    (tmp_path / "s.toml").write_text(text)
    assert run("study", "s.toml", "--dry-run", "--json").json["cases"] == 2
    assert not (tmp_path / "s").exists()
    done = run("study", "s.toml", "--workers", 0)
    assert (done.code, done.err) == (0, "")
    lines = ["Study s: 2 cases", "  settled  1", "  refused  1"]
    assert done.out.splitlines()[:3] == lines
    again = run("study", "s.toml", "--workers", 0, "--json").json
    assert (again["flown"], again["kept"], again["settled"]) == (0, 2, 1)
    for options in ((2000,), (2, "--scheduler", "tcp://127.0.0.1:1")):
        wrong = run("study", "s.toml", "--workers", *options)
        assert (wrong.code, wrong.out) == (2, "")
        assert re.fullmatch(f"gaitgraph: workers must .* got {options[0]}\n", wrong.err)


def test_an_interrupt_ends_the_study_in_order(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rolls = "gaits = ['gait1']\n[attitudes]\nroll = [0.1, 0.2, 0.3]\n"
    (tmp_path / "s.toml").write_text(rolls)
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
    assert done.err.startswith("gaitgraph: interrupted; 1 of 3 parts are in 's'; ")
    again = run("study", "s.toml", "--workers", 0, "--json").json
    assert (again["flown"], again["kept"]) == (2, 1)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "carrier://pigeon"])
def test_a_scheduler_that_does_not_answer_is_one_line(
    address: str, run: Any, tmp_path: Path
) -> None:
    pytest.importorskip("distributed", reason="install the extra 'study'")
    import dask

    (tmp_path / "s.toml").write_text("gaits = ['gait3']\n")
    with dask.config.set({"distributed.comm.timeouts.connect": "200ms"}):
        done = run("study", "s.toml", "--scheduler", address)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert f"scheduler with workers, got '{address}' (" in done.err


# -- Worker processes

LOCAL = {
    "dashboard_address": "127.0.0.1:0",
    "silence_logs": 60,
    "threads_per_worker": 1,
}
FORTY = "gaits = ['gait4']\nattitudes.roll = { from = -0.4, to = 0.4, count = 40 }\nflight.duration = 1\n"
CLUSTER = f"""
from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(n_workers=2, **{LOCAL}) as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""


def workers_of(process: int) -> list[Any]:
    psutil = pytest.importorskip("psutil", reason="install psutil")
    below = psutil.Process(process).children(recursive=True)
    return [one for one in below if "spawn_main" in " ".join(one.cmdline())]


def check_gone(workers: list[Any]) -> None:
    psutil = pytest.importorskip("psutil", reason="install psutil")
    assert workers
    assert psutil.wait_procs(workers, timeout=30)[1] == []


def parts_of(study: Path) -> int:
    return len(list((study / "rows").glob("*.parquet")))


def wait_for_parts(study: Path, count: int, driver: Any) -> None:
    while parts_of(study) < count:
        assert driver.poll() is None
        sleep(0.01)


@pytest.mark.slow
def test_workers_one_killed_midway_write_the_same_bytes(
    small: StudyRun, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    killed: list[int] = []

    def kill_one(words: str) -> None:
        if not killed and words.startswith("2 of"):
            killed.append(workers_of(os.getpid())[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    run_study(SMALL, tmp_path / "two", workers=2, progress=kill_one)
    assert killed
    assert contents(tmp_path / "two") == contents(small.folder)
    assert workers_of(os.getpid()) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_a_driver_that_ends_leaves_no_workers_and_is_continued(
    tmp_path: Path, end: signal.Signals
) -> None:
    (tmp_path / "s.toml").write_text(FORTY)
    command = [*PYTHON, "study", "s.toml", "--workers", "1"]
    piped: dict[str, Any] = {"cwd": tmp_path, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, start_new_session=True, **piped) as driver:
        wait_for_parts(tmp_path / "s", 2, driver)
        below = workers_of(driver.pid)
        if end is signal.SIGINT:  # from a terminal, all of its processes get it
            os.killpg(driver.pid, end)
        else:
            driver.kill()
        _, error = driver.communicate(timeout=60)
    kept = parts_of(tmp_path / "s")
    check_gone(below)
    told = f"interrupted; {kept} of 40 parts are in 's'; run the same command again"
    assert (told in error.decode()) is (end is signal.SIGINT)
    again = run_study(tmp_path / "s.toml", tmp_path / "s", workers=0)
    assert again.flown == 40 - kept


@pytest.mark.slow
@pytest.mark.parametrize("end", ["killed", "closed"])
def test_a_scheduler_that_ends_is_one_line_and_the_same_command_continues(
    tmp_path: Path, end: str
) -> None:
    pytest.importorskip("distributed", reason="install distributed")
    (tmp_path / "s.toml").write_text(FORTY)
    (tmp_path / "cluster.py").write_text(CLUSTER)
    pipe = subprocess.PIPE
    piped: dict[str, Any] = {"cwd": tmp_path, "stdout": pipe, "text": True}
    script = [sys.executable, "cluster.py"]
    with subprocess.Popen(script, stdin=pipe, **piped) as cluster:
        assert cluster.stdin is not None
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        command = [*PYTHON, "study", "s.toml", "--scheduler", address]
        with subprocess.Popen(command, stderr=pipe, **piped) as driver:
            wait_for_parts(tmp_path / "s", 2, driver)
            below = workers_of(cluster.pid)
            below[0].kill()
            wait_for_parts(tmp_path / "s", 5, driver)
            if end == "killed":
                cluster.kill()
            else:
                cluster.stdin.write("\n")
                cluster.stdin.flush()
            output, error = driver.communicate(timeout=120)
    check_gone(below)
    assert (driver.returncode, output, error.count("\n")) == (2, "", 1)
    assert f"the Dask scheduler {address!r} is gone" in error
    kept = parts_of(tmp_path / "s")
    again = run_study(tmp_path / "s.toml", tmp_path / "s", workers=0)
    assert (again.flown, again.outcomes["failed"]) == (40 - kept, 0)
    run_study(tmp_path / "s.toml", tmp_path / "whole", workers=0)
    assert contents(tmp_path / "s") == contents(tmp_path / "whole")


@pytest.mark.slow
def test_a_cluster_flies_the_same_and_stays_and_others_are_refused(
    small: StudyRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed", reason="install distributed")
    options = {**LOCAL, "processes": False, "protocol": "tcp"}
    with distributed.LocalCluster(n_workers=1, **options) as cluster:
        address = cluster.scheduler_address
        run_study(SMALL, tmp_path / "there", scheduler=address)
        assert contents(tmp_path / "there") == contents(small.folder)
        with distributed.Client(address, set_as_default=False) as client:
            assert client.submit(abs, -1).result() == 1
        other = {"gaitgraph": "0.0", "mujoco": "1.0"}
        monkeypatch.setattr(distributed.Client, "run", lambda *_: {"a": other})
        with pytest.raises(InputError, match=r"workers must have .*, got .*'0.0'"):
            run_study(SMALL, tmp_path / "other", scheduler=address)
    monkeypatch.setattr(running, "_PATIENCE", 0.4)
    with (
        distributed.LocalCluster(n_workers=0, **options) as cluster,
        pytest.raises(InputError, match=r"^scheduler must.*Only 0/1 workers arrived"),
    ):
        run_study(SMALL, tmp_path / "empty", scheduler=cluster.scheduler_address)


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
    assert [row["case"] for row in rows] == [0, 1, 2]
    assert [row["outcome"] for row in rows] == ["settled", "failed", "settled"]
    assert rows[1]["reason"] == "each worker that flew this case alone died"
