"""Studies: what they ask for, their cases, their rows on disk, the page, and the command; on this process alone."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from gaitgraph.errors import FileProblem, InputError, OutputExists
from gaitgraph.files import write_whole
from gaitgraph.flight.settings import FlightSettings
from gaitgraph.study import cases as cases_room
from gaitgraph.study.cases import columns_of, flown_batch, row_of, versions
from gaitgraph.study.designs import read_study, study_from_mapping
from gaitgraph.study.running import StudyRun, check_size, run_study

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

SMALL: dict[str, Any] = {
    "name": "small",
    "gaits": ["gait1", "gait3"],
    "attitudes": {"roll": [0.0, "20deg"], "pitch": {"from": -0.2, "to": 0.2, "count": 3}},
    "flight": {"duration": 0.6},
}
EXAMPLES = sorted((Path(__file__).parent.parent / "examples" / "studies").glob("*.toml"))


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return run_study(SMALL, tmp_path_factory.mktemp("studies") / "small", workers=0)


# What a study asks for


def test_a_grid_has_every_combination_once_the_pitch_fastest() -> None:
    study = study_from_mapping(
        SMALL
        | {
            "vehicles": ["paper", {"preset": "paper", "drag_ratio": [0.1, 0.2], "servo_lag": [0.01, 0.02, 0.03]}],
            "biases": [1.0, 0.8],
            "periods": {"from": 1, "to": 2, "count": 2},
        }
    )
    cases = [study.case(number) for number in range(len(study))]
    told = {
        (one.model.name, *one.varied.values(), one.source.name, one.eta, one.period, one.roll, one.pitch)
        for one in cases
    }
    assert len(study) == len(told) == (1 + 2 * 3) * 2 * 2 * 2 * 2 * 3
    assert [one.pitch for one in cases[:4]] == [-0.2, 0.0, 0.2, -0.2]
    assert [one.period for one in cases[:12:6]] == [1.0, 2.0]
    assert cases[0].vehicle.name == "paper"
    assert cases[48].varied == {"drag_ratio": 0.1, "servo_lag": 0.01}
    assert cases[96].varied == {"drag_ratio": 0.1, "servo_lag": 0.02}
    assert cases[-1].vehicle.drag_ratio == 0.2
    assert cases[-1].vehicle.servo_lag == 0.03
    numbers = [number for batch in range(study.batches) for number in study.numbers(batch)]
    assert numbers == list(range(len(study)))
    assert study.batches <= 64


def test_a_case_of_a_random_sample_depends_on_the_seed_and_its_number_alone() -> None:
    asked = SMALL | {
        "vehicles": ["beetle_omni", {"preset": "paper", "mass": {"from": 0.3, "to": 0.6}}],
        "attitudes": {"roll": {"from": -0.5, "to": 0.5}, "pitch": [0.0, 0.1]},
        "periods": {"from": 0.5, "to": 2.0},
        "sample": {"kind": "random", "count": 400, "seed": 5},
    }
    study, longer = study_from_mapping(asked), study_from_mapping(asked | {"sample": {"count": 1000, "seed": 5}})
    other = study_from_mapping(asked | {"sample": {"count": 400, "seed": 6}})
    cases = [study.case(number) for number in range(400)]
    assert [longer.case(k).roll for k in reversed(range(400))] == [one.roll for one in cases][::-1]
    assert sum(other.case(k).roll == cases[k].roll for k in range(400)) == 0
    rolls = np.array([one.roll for one in cases])
    assert -0.5 <= rolls.min() < -0.48
    assert 0.48 < rolls.max() < 0.5
    assert abs(np.histogram(rolls, bins=5, range=(-0.5, 0.5))[0] - 80).max() < 30
    assert {one.pitch for one in cases} == {0.0, 0.1}
    assert 150 < sum(one.model.name == "beetle_omni" for one in cases) < 250
    masses = [one.vehicle.mass for one in cases if one.varied]
    assert len(set(masses)) == len(masses)
    # Pinned: a stored study is gone on with by later versions.
    assert (cases[17].roll, cases[17].period) == pytest.approx((PINNED_ROLL, PINNED_PERIOD), abs=1e-15)


PINNED_ROLL, PINNED_PERIOD = 0.4349099096549526, 1.1392466424151815


def test_a_study_is_its_mapping(tmp_path: Path) -> None:
    (tmp_path / "v.toml").write_text('mass = 1.0\ndrag_ratio = 0.1\narm_length = "oops"\n')
    asked = SMALL | {
        "vehicles": ["paper", {"preset": "paper", "inertia": [[1e-3, 1e-3, 2e-3], [2e-3, 2e-3, 4e-3]], "name": "two"}],
        "gaits": ["gait4", {"waypoints": [["pi/8", "-pi/8"], [1.2, -1.2]], "color": "red", "name": "line"}],
        "anyway": True,
    }
    study = study_from_mapping(asked)
    again = study_from_mapping(json.loads(study.text))
    assert again == study
    assert again.fingerprint == study.fingerprint
    assert study_from_mapping(asked | {"name": "other"}).fingerprint != study.fingerprint
    with pytest.raises(InputError, match=r"arm_length: 'oops'"):
        study_from_mapping(SMALL | {"vehicles": ["v.toml"]}, folder=tmp_path)


def test_gaits_come_from_files_too(tmp_path: Path, small: StudyRun) -> None:
    from gaitgraph.gait.paper_gaits import paper_gait
    from gaitgraph.invertibility.matrices import coefficients_of
    from gaitgraph.vehicle import PAPER

    gait = paper_gait(3, PAPER, coefficients_of(PAPER))
    gait.parametrize(2.0).write(tmp_path / "mine.csv")
    (tmp_path / "plane.csv").write_text(
        "alpha1,alpha2,color\n" + "\n".join(f"{a!r},{b!r},red" for a, b in gait.alpha[:, :2].tolist()) + "\n"
    )
    (tmp_path / "asked.toml").write_text(
        'waypoints = [["3pi/8", "-3pi/8"], ["3pi/8", "-pi/8"], ["pi/8", "-pi/8"], ["pi/8", "-3pi/8"]]\nperiod = 9.0\n'
    )
    study = study_from_mapping(
        SMALL | {"gaits": ["gait3", "mine.csv", {"file": "plane.csv", "name": "lifted"}, "asked.toml"]},
        folder=tmp_path,
    )
    for path in tmp_path.iterdir():
        path.unlink()  # a study needs no file any more
    assert [source.name for source in study.sources] == ["gait3", "mine", "lifted", "asked"]
    for source in study.sources:
        np.testing.assert_allclose(source.gait(PAPER).alpha, gait.alpha, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gait": ["gait3"]}, "gait: no part of a study; did you mean 'gaits'?"),
        ({"gaits": []}, "gaits: []; allowed is a list of gait1 to gait4, files and tables, not empty"),
        ({"gaits": ["gait5"]}, "gait 1: 'gait5'; allowed are gait1, gait2, gait3, gait4, or the name of a file; did"),
        ({"gaits": ["gait3", "gait3"]}, "gaits: two are called 'gait3'; allowed are names that differ (name = …)"),
        ({"gaits": [{"waypoint": []}]}, "gait 1 waypoint: no field of a request; did you mean 'waypoints'?"),
        ({"gaits": [{"waypoints": [[0, 0]], "period": 2.0}]}, "gait 1 period: 2.0; allowed is in the study's periods"),
        ({"gaits": [{"waypoints": [[9, 0]]}]}, "gait 1: waypoint 1 alpha1: 9; allowed is −π/2 to π/2"),
        ({"gaits": ["none.csv"]}, "gait 1: gait file: cannot read 'none.csv': No such file or directory; allowed is"),
        ({"vehicles": []}, "vehicles: []; allowed is a list of presets, files and tables, at least one"),
        ({"vehicles": ["papr"]}, "vehicle: 'papr' is neither a preset (paper, beetle_omni) nor a .toml file; did you"),
        ({"vehicles": [{"preset": "paper", "mas": [1.0]}]}, "vehicle 1: mas: [1.0]; allowed are lists only of const"),
        ({"vehicles": [{"preset": "paper", "mass": [1.0, -1.0]}]}, "vehicle 1: mass: -1.0; allowed is a positive fin"),
        ({"vehicles": [{"preset": "paper", "mass": []}]}, "vehicle 1: mass: [], which gives no case; allowed is at le"),
        ({"vehicles": [{"preset": "paper", "mass": {"to": 1}}]}, "vehicle 1: mass.from: missing; allowed is a range"),
        ({"vehicles": [{"preset": "paper", "name": ["a"]}]}, "vehicle 1: name: ['a']; allowed are lists only of"),
        ({"biases": [0.8, 1.2]}, "biases: 1.2; allowed is more than 0 and 1 at most (dimensionless)"),
        ({"biases": [0.8, 0.8]}, "biases: 0.8 is given twice; allowed are values that differ"),
        ({"periods": []}, "periods: [], which gives no case; allowed is at least one value"),
        ({"periods": {"from": 1, "to": 2}}, "periods.count: missing; allowed is a whole number from 2, or a random"),
        ({"periods": {"from": 2, "to": 1, "count": 2}}, "periods: from 2.0 to 1.0; allowed is a range that rises"),
        ({"periods": {"from": 1, "to": 2, "count": 1}}, "periods.count: 1; allowed is a whole number from 2 to 100000"),
        ({"attitudes": {"rol": 1}}, "attitudes.rol: no part of an attitude; did you mean 'roll'?"),
        ({"attitudes": {"roll": "3 pints"}}, "attitudes.roll: '3 pints' is no angle; allowed is a finite number in"),
        ({"attitudes": {"pitch": 1.6}}, "attitudes.pitch: 1.6; allowed is an angle between −π/2 and π/2"),
        ({"flight": {"durations": 1}}, "flight: durations is no setting of a flight; did you mean 'duration'?"),
        ({"flight": {"attitude_damping": 3000}}, "flight: attitude_damping must be between 0.05125 and 1949.95 1/s"),
        ({"sample": "gird"}, "sample.kind: 'gird'; allowed are grid and random; did you mean 'grid'?"),
        ({"sample": {"kind": "random"}}, "sample.count: None; allowed is a whole number from 1 to 1000000"),
        ({"sample": {"count": 2, "seed": -1}}, "sample.seed: -1; allowed is a whole number from 0 to 184467440737095"),
        ({"anyway": "yes"}, "anyway: 'yes'; allowed are true and false"),
        ({"name": "a\nb"}, "name: 'a\\nb'; allowed is a printable text of up to 200 letters"),
        (
            {"periods": {"from": 1, "to": 2, "count": 90000}, "biases": {"from": 0.1, "to": 1, "count": 100}},
            "study 'small': 108000000 cases; allowed are 1000000 at most",
        ),
    ],
)
def test_what_a_study_may_not_be_is_told_in_one_line(change: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, FileProblem)) as caught:
        study_from_mapping(SMALL | change)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_a_study_file_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"allowed is the suffix \.toml; did you mean '\.toml'\?"):
        read_study(tmp_path / "a.tml")
    path = tmp_path / "a.toml"
    path.write_text("gaits = [")
    with pytest.raises(InputError, match=r"study file '.*a\.toml': it is not TOML"):
        read_study(path)
    path.write_text("gaits = ['gait3']\nperiods = 0")
    with pytest.raises(InputError, match=r"study file '.*a\.toml': periods: 0; allowed is 1e-06 or more"):
        read_study(path)
    path.write_text("gaits = ['none.csv']")
    with pytest.raises(FileProblem, match=r"study file '.*a\.toml': gait 1: gait file: cannot read '.*none\.csv'"):
        read_study(path)
    path.write_text("gaits = ['gait3']")
    assert read_study(path).name == "a"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_are_studies_that_need_no_asking_twice(path: Path) -> None:
    check_size(read_study(path), 1)


def test_large_studies_are_asked_for_twice() -> None:
    many = study_from_mapping(SMALL | {"periods": {"from": 1, "to": 2, "count": 1000}})
    with pytest.raises(InputError, match=r"study 'small': 12000 flights, about \d+ s on 4 processes; allowed without"):
        check_size(many, 4)
    long = study_from_mapping(
        SMALL | {"periods": {"from": 1, "to": 2, "count": 100}, "flight": {"duration": 80.0}},
    )
    with pytest.raises(InputError, match=r"1200 flights, about 80 min on 1 process; allowed without --yes"):
        check_size(long, 1)
    check_size(long, 2)


# Its cases


def test_a_row_tells_the_gait_and_the_flight(small: StudyRun) -> None:
    names = [name for name, _, _ in columns_of(small.study)]
    table = small.table
    assert table.schema.names == names
    assert table["case"].to_pylist() == list(range(12))
    rows = table.to_pylist()
    assert {row["outcome"] for row in rows if row["gait"] == "gait3"} <= {"settled", "not settled"}
    assert all(row["flyable"] and row["reason"] == "" for row in rows if row["outcome"] == "settled")
    for row in rows[:6]:
        assert row["outcome"] == "refused"
        assert row["reason"].startswith("refused before take-off: ")
        assert row["valid"]
        assert not row["flyable"]
        assert row["peak_thrust"] is None
    assert small.outcomes == {"settled": 6, "not settled": 0, "refused": 6, "no gait": 0, "failed": 0}
    assert small.reasons[0][::2] == ("refused", 6)


def test_a_case_that_fails_is_a_row_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    study = study_from_mapping(
        SMALL
        | {
            "vehicles": [{"name": "bare", "drag_ratio": 0.1}, {"preset": "paper", "drag_ratio": [0.1, 0.2]}],
            "gaits": [{"waypoints": [[0.1, 0.1], [1.2, -1.2]], "color": "red", "name": "torn"}, "gait3"],
            "attitudes": {},
        }
    )
    rows = [row_of(study.case(number), study) for number in range(len(study))]
    assert [row["outcome"] for row in rows[:4]] == ["no gait", "failed", "no gait", "settled"]
    assert rows[0]["reason"].startswith("no closed loop: ")
    assert rows[1]["reason"] == "vehicle 'bare' states no mass (kg), which flight needs"
    assert rows[1]["flyable"] is True
    assert rows[3]["drag_ratio"] == 0.1

    def broken(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr(cases_room, "fly", broken)
    assert row_of(study.case(3), study)["reason"] == "ZeroDivisionError: division by zero"


def test_bias_period_and_attitude_reach_the_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    study = study_from_mapping(
        SMALL
        | {"gaits": ["gait4"], "biases": 0.8, "periods": 1.5, "attitudes": {"roll": 0.3, "pitch": -0.1}, "anyway": True}
    )
    seen: list[Any] = []

    def seeing(timed: TimedGait, **options: Any) -> None:
        seen.append((timed, options))
        raise InputError("seen")

    monkeypatch.setattr(cases_room, "fly", seeing)
    row_of(study.case(0), study)
    timed, options = seen[0]
    assert timed.period == 1.5
    assert timed.gait.alpha[0, 2] == pytest.approx(0.8 * timed.gait.alpha[0, 0])
    assert options == {"attitude": (0.3, -0.1), "settings": FlightSettings(duration=0.6), "anyway": True}


def test_a_worker_of_another_version_is_refused() -> None:
    study = study_from_mapping(SMALL)
    with pytest.raises(InputError, match=r"mujoco: a worker has '.*'; allowed is '1\.0', with which this began"):
        flown_batch(study.text, [0], versions() | {"mujoco": "1.0"})


# Its rows on disk


def test_units_and_what_made_them_are_in_the_file(small: StudyRun) -> None:
    parts = sorted((small.folder / "rows").iterdir())
    assert [path.name for path in parts] == [f"part-{k:05d}.parquet" for k in range(12)]
    schema = pa.parquet.read_schema(parts[0])
    units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}
    assert units["period"] == "s"
    assert units["roll"] == "rad"
    assert units["energy"] == "J"
    told = json.loads(schema.metadata[b"gaitgraph"])
    assert told["fingerprint"] == small.study.fingerprint
    manifest = json.loads((small.folder / "study.json").read_text())
    assert study_from_mapping(manifest["study"]) == small.study
    everything = b"".join(contents(small.folder).values())
    assert str(Path.home()).encode() not in everything
    assert os.uname().nodename.encode() not in everything


def test_what_is_there_is_kept_and_the_rest_is_flown(
    small: StudyRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "again"
    shutil.copytree(small.folder, folder)
    before = contents(folder)
    for number in (0, 7, 11):
        (folder / "rows" / f"part-{number:05d}.parquet").unlink()
    (folder / "rows" / ".gaitgraph-killed.part").mkdir()
    (folder / "summary.html").unlink()
    flown: list[int] = []
    true = cases_room.row_of

    def counted(case: Any, *rest: Any) -> Any:
        flown.append(case.number)
        return true(case, *rest)

    monkeypatch.setattr(cases_room, "row_of", counted)
    words: list[str] = []
    run = run_study(SMALL, folder, workers=0, progress=words.append)
    assert flown == [0, 7, 11]
    assert run.flown == 3
    assert contents(folder) == before
    assert [word.split(",")[0] for word in words if "of 12" in word] == [f"{k} of 12 cases" for k in range(9, 13)]
    assert re.fullmatch(r"10 of 12 cases, about \d+ s left", words[-4])


HARMS = ["cut", "flipped", "other cases", "of another study", "strange", "beyond", "roll", "gait", "outcome", "reason"]


@pytest.mark.parametrize("harm", HARMS)
def test_a_part_that_is_none_is_named_and_nothing_is_flown(small: StudyRun, tmp_path: Path, harm: str) -> None:
    folder = tmp_path / "harmed"
    shutil.copytree(small.folder, folder)
    rows = folder / "rows"
    part = rows / "part-00003.parquet"
    content = part.read_bytes()
    told = "part '.*part-00003.parquet': "
    if harm == "cut":
        part.write_bytes(content[: len(content) // 2])
        told += "it is no Parquet file, or a broken one .*; allowed is a whole part: delete it, and"
    elif harm == "flipped":
        middle = content.index(b"refused before") + 40
        part.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
        told += "it is no Parquet file, or a broken one "
    elif harm == "other cases":
        shutil.copy(rows / "part-00004.parquet", part)
        told += "it does not hold cases 3 to 3; allowed is a whole part"
    elif harm == "of another study":
        table = pa.parquet.read_table(part).replace_schema_metadata({b"gaitgraph": b'{"fingerprint": "x"}'})
        pa.parquet.write_table(table, part)
        told += "it is of another study; allowed are parts of this one"
    elif harm in ("roll", "gait", "outcome", "reason"):
        table = pa.parquet.read_table(part)
        field = table.schema.field(harm)
        other = {"roll": 0.1, "gait": "gait9", "outcome": "maybe", "reason": None}[harm]
        k = table.schema.get_field_index(harm)
        pa.parquet.write_table(table.set_column(k, field, pa.array([other], field.type)), part)
        told += f"its column '{harm}' is not of this study's cases; allowed is a part as it was written: delete it"
    elif harm == "strange":
        (rows / "notes.txt").write_text("mine")
        told = r"output: '.*notes\.txt' is no part of this study; allowed in rows are part-00000\.parquet to part-00011"
    else:
        shutil.copy(part, rows / "part-00012.parquet")
        told = r"output: '.*part-00012\.parquet' is no part of this study"
    with pytest.raises((InputError, OutputExists), match=told):
        run_study(SMALL, folder, workers=0)


def test_a_part_that_is_taken_away_meanwhile_is_missed(small: StudyRun, tmp_path: Path) -> None:
    rows = tmp_path / "gone" / "rows"

    def take_away(words: str) -> None:
        if words.startswith("5 of"):
            (rows / "part-00002.parquet").unlink()

    with pytest.raises(
        FileProblem, match=r"part '.*part-00002\.parquet': it was taken away while the study ran; allow"
    ):
        run_study(SMALL, rows.parent, workers=0, progress=take_away)
    assert run_study(SMALL, rows.parent, workers=0).flown == 1
    assert contents(rows.parent) == contents(small.folder)


def test_a_manifest_that_was_changed_is_refused(small: StudyRun, tmp_path: Path) -> None:
    folder = tmp_path / "changed"
    shutil.copytree(small.folder, folder)
    manifest = folder / "study.json"
    manifest.write_text(manifest.read_text().replace('"gait3"', '"gait4"'))
    with pytest.raises(
        OutputExists, match=r"study\.json' was changed after it was written; allowed is the manifest as"
    ):
        run_study(SMALL, folder, workers=0)


def test_a_folder_of_something_else_is_refused(small: StudyRun, tmp_path: Path) -> None:
    def refused(asked: dict[str, Any], folder: Path, message: str) -> None:
        before = contents(tmp_path)
        with pytest.raises((OutputExists, FileProblem), match=message):
            run_study(asked, folder, workers=0)
        assert contents(tmp_path) == before

    refused(SMALL | {"name": "mine"}, small.folder, r"holds another study \('small'\); allowed is a new folder, or")
    refused(SMALL | {"periods": 2.0}, small.folder, r"holds this study as it was before a change; allowed is a new")
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "a.png").write_bytes(b"x")
    refused(SMALL, tmp_path / "pictures", r"is a folder with 'a\.png' in it; allowed is a new one, or one of this")
    refused(SMALL, tmp_path / "pictures" / "a.png", r"is a file; allowed is a new folder")
    refused(SMALL, tmp_path / "none" / "deep", r"folder '.*none' does not exist; allowed is an existing folder")
    (tmp_path / "json").mkdir()
    (tmp_path / "json" / "study.json").write_text("{}")
    refused(SMALL, tmp_path / "json", r"study\.json' is no manifest of a study; allowed is a new folder")
    old = tmp_path / "old"
    shutil.copytree(small.folder, old)
    manifest = old / "study.json"
    manifest.write_text(manifest.read_text().replace(versions()["mujoco"], "3.2.0"))
    refused(SMALL, old, r"was begun with mujoco '3\.2\.0', and this is '.*'; allowed is a new folder, or the same")


def test_two_at_once_are_refused_and_the_lock_ends_with_its_process(small: StudyRun, tmp_path: Path) -> None:
    import subprocess
    import sys

    folder = tmp_path / "locked"
    shutil.copytree(small.folder, folder)
    code = (
        "import fcntl, sys, time\n"
        f"stream = open({str(folder / 'study.json')!r}, 'r+b')\n"
        "fcntl.flock(stream, fcntl.LOCK_EX)\nprint('locked', flush=True)\ntime.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        with pytest.raises(OutputExists, match=r"another process writes to '.*locked'; allowed is one at a time"):
            run_study(SMALL, folder, workers=0)
        other.kill()
    assert run_study(SMALL, folder, workers=0).flown == 0


def test_a_full_disk_leaves_what_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Any) -> None:
    true, room = write_whole, [3]

    def full(contents: Any, **options: Any) -> None:
        room[0] -= 1
        if room[0] < 0:
            monkeypatch.setattr(Path, "write_bytes", lambda *_: (_ for _ in ()).throw(OSError(28, os.strerror(28))))
        true(contents, **options)

    (tmp_path / "s.toml").write_text("gaits = ['gait1']\n[attitudes]\nroll = [0.1, 0.2, 0.3, 0.4]\n")
    with monkeypatch.context() as context:
        context.setattr("gaitgraph.study.datasets.write_whole", full)
        done = run("study", "s.toml", "--workers", 0)
    monkeypatch.undo()
    assert done.code == 2
    assert done.out == ""
    assert re.fullmatch(
        r"gaitgraph: output: cannot write 's/rows/part-00002\.parquet': No space left on device; allowed is a place "
        r"with room: what is written stays, and the same command goes on from there\n",
        done.err,
    )
    assert sorted(path.name for path in (tmp_path / "s" / "rows").iterdir()) == [
        "part-00000.parquet",
        "part-00001.parquet",
    ]


# The page, and the command


def test_the_page_loads_nothing_and_shows_names_as_they_are(tmp_path: Path) -> None:
    asked = {
        "name": "<b>$x$ & y</b>",
        "gaits": ["gait3", {"waypoints": [[0.1, 0.1], [1.2, -1.2]], "color": "red", "name": "$torn_{$ <i>"}],
        "biases": [1.0, 0.9],
        "periods": [1.0, 2.0],
        "attitudes": {"roll": [0.1, 0.3]},
        "flight": {"duration": 0.5},
        "anyway": True,
    }
    page = run_study(asked, tmp_path / "page", workers=0).summary.read_text()
    assert "<h1>&lt;b&gt;$x$ &amp; y&lt;/b&gt;</h1>" in page
    assert "<b>$x$" not in page
    assert "$torn_{$ &lt;i&gt;" in page
    assert not re.search(r"<script|<link|<img|@import|url\((?!#)", page)
    assert all(not to or to.startswith("data:image/png") for to in re.findall(r'(?:href|src)="([^#"]*)', page))
    assert set(re.findall(r"https?://[^\"\s<]+", page)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }
    assert page.count("<svg") == page.count('<div class="box"><svg class="chart" style="width: ') == 3
    assert "#010203" not in page
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_the_command_counts_flies_and_tells(run: Any, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(
        "gaits = ['gait1', 'gait3']\n[attitudes]\nroll = [0.1, 0.2]\n[flight]\nduration = 0.5\n"
    )
    dry = run("study", "s.toml", "--dry-run")
    assert dry.code == 0
    assert dry.out == "Study s: 4 cases, a grid, in 4 batches\nabout 1 s on one process; nothing was flown\n"
    assert run("study", "s.toml", "--dry-run", "--json").json["cases"] == 4
    assert not (tmp_path / "s").exists()
    done = run("study", "s.toml", "--workers", 0)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith(
        "Study s: 4 cases\n  settled      2\n  refused      2\n  2 × refused, e.g.: refused before"
    )
    again = run("study", "s.toml", "--workers", 0, "--json")
    assert again.json["flown"] == 0
    assert again.json["kept"] == 4
    assert again.json["settled"] == 2
    for arguments, message in (
        (("--workers", -1), "--workers: -1; allowed is a whole number from 0 to 1024"),
        (("--workers", 2, "--scheduler", "tcp://127.0.0.1:1"), "--workers: 2 beside a scheduler; allowed is one of"),
        (("--scheduler", " "), "--scheduler: ' '; allowed is an address such as tcp://10.0.0.5:8786"),
    ):
        wrong = run("study", "s.toml", *arguments)
        assert (wrong.code, wrong.out) == (2, "")
        assert wrong.err.startswith(f"gaitgraph: {message}")
        assert wrong.err.count("\n") == 1
    (tmp_path / "many.toml").write_text("gaits = ['gait1']\nperiods = {from = 1, to = 2, count = 10001}\n")
    assert "10001 flights" in run("study", "many.toml", "--workers", 0).err
    assert not (tmp_path / "many").exists()


def test_an_interrupt_says_how_to_go_on(run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "s.toml").write_text("gaits = ['gait1']\n[attitudes]\nroll = [0.1, 0.2, 0.3]\n")
    true = cases_room.row_of

    def interrupted(case: Any, *rest: Any) -> Any:
        if case.number == 2:
            raise KeyboardInterrupt
        return true(case, *rest)

    with monkeypatch.context() as context:
        context.setattr(cases_room, "row_of", interrupted)
        done = run("study", "s.toml", "--workers", 0)
    assert (done.code, done.out) == (130, "")
    assert done.err == "gaitgraph: interrupted; 2 of 3 parts are in 's', and the same command goes on from there\n"
    assert run("study", "s.toml", "--workers", 0, "--json").json["flown"] == 1


@pytest.mark.parametrize(("name", "code", "told"), [("SIGTERM", 143, "terminated"), ("SIGINT", 130, "interrupted")])
def test_a_signal_ends_the_study_in_order(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, code: int, told: str
) -> None:
    (tmp_path / "s.toml").write_text("gaits = ['gait1']\n[attitudes]\nroll = [0.1, 0.2, 0.3]\n")
    true = cases_room.row_of
    number = getattr(signal, name)

    def ended(case: Any, *rest: Any) -> Any:
        if case.number == 1:
            try:
                os.kill(os.getpid(), number)
            finally:
                os.kill(os.getpid(), number)  # again, while it clears up
        return true(case, *rest)

    monkeypatch.setattr(cases_room, "row_of", ended)
    others = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        done = run("study", "s.toml", "--workers", 0)
    finally:
        for one, handler in others.items():
            signal.signal(one, handler)
    assert (done.code, done.out) == (code, "")
    assert done.err == f"gaitgraph: {told}; 1 of 3 parts are in 's', and the same command goes on from there\n"
