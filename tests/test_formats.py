"""The formats of gait files: read back bit for bit with what made them, by their own readers too; files of others, broken and hostile files; frames; streams."""

from __future__ import annotations

import json
import pickle
import re
import struct
import subprocess
import sys
import zipfile
from dataclasses import replace
from functools import partial
from io import BytesIO, RawIOBase, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import loadmat, savemat

import gaitgraph as gg
from gaitgraph.errors import FileWarning, MissingExtra
from gaitgraph.files import is_stream
from gaitgraph.gait.table import ACCELERATIONS, ANGLES, RATES, Table, completed_table
from gaitgraph.io.columns import table_from_frame
from gaitgraph.io.exporting import export
from gaitgraph.io.formats import FORMATS, read_table, write_tables
from gaitgraph.planning.planner import plan
from gaitgraph.planning.request import read_request
from gaitgraph.timing.timed_gait import table_of
from tests.mutated import check_mutations, refusal
from tests.published import GAITS
from tests.samples import cases, rows_of, table_from

if TYPE_CHECKING:
    from gaitgraph.timing.timed_gait import TimedGait

TEXT, BINARY = [".csv", ".json"], [".npz", ".mat", ".parquet"]
TABLES = [*TEXT, *BINARY]
TRIANGLE = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]
PLAN = gg.plan_loop(TRIANGLE)
ZEROS: dict[str, Any] = {name: np.zeros(3) for name in ANGLES}
savez: Any = np.savez


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def assert_same(table: Table, expected: Table) -> None:
    assert [*table.columns] == [*expected.columns]
    for name, values in expected.columns.items():
        if isinstance(values, np.ndarray):
            assert table[name].tobytes() == values.tobytes(), name
        else:
            assert tuple(table[name]) == tuple(values), name


# Our own files --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", TABLES)
def test_a_plan_is_read_back_bit_for_bit_with_what_made_it(
    suffix: str, planned: TimedGait
) -> None:
    path = f"gait{suffix}"
    planned.write(path)
    table = read_table(path)
    assert_same(table, table_of(planned))
    assert table.about == table_of(planned).about
    request, sampling = read_request(path, {})
    plan(request).timed(**sampling).write(f"planned{suffix}")
    export(path, [f"again{suffix}"])
    for name in ("planned", "again"):
        assert Path(f"{name}{suffix}").read_bytes() == Path(path).read_bytes()
    assert read_request(path, {"period": 3.0, "rate": 5.0})[1] == {"rate": 5.0}
    export(path, [f"finer{suffix}"], rate=10.0)
    assert read_request(f"finer{suffix}", {})[1] == {"samples": 20}


@pytest.mark.parametrize("suffix", TABLES)
def test_any_finite_values_survive(suffix: str) -> None:
    values = np.array([0.0, -0.0, 5e-324, 0.1 + 0.2, -1.5])
    alpha = np.column_stack([np.roll(values, k) for k in range(4)])
    about = {"": "ü\n\0\r", "'\"{},;": 1.7e308, "\U0001f681": -0.0}
    for rows, colors in ((5, {}), (1, {"color": ("red",) * 5})):
        table = table_from(alpha, **colors, R=1e11 * values)
        table = rows_of(replace(table, about=about), 0, rows)
        write_tables(table, [f"any{suffix}"], force=True)
        assert_same(read_table(f"any{suffix}"), table)
        assert read_table(f"any{suffix}").about == about


def test_stated_corners_off_the_sheet_are_not_used() -> None:
    """No row is at a corner, but all lie between the corners."""
    limits = gg.Limits(acceleration=40.0)
    paced: Any = gg.least_period(PLAN.gait, limits, samples=7)
    table = table_of(paced)
    corners = PLAN.gait.alpha.copy()
    corners[1, 3] += 0.01  # off the sheet, where no row lies
    wrong = replace(table, about=table.about | {"corners": corners.tolist()})
    with pytest.warns(FileWarning, match="gait must be on its sheet"):
        assert gg.validate(wrong).flyable


@pytest.mark.parametrize("suffix", TABLES)
@pytest.mark.parametrize("servos", [None, "x_frame"])
def test_a_gait_is_repeated_in_tables(suffix: str, servos: str | None) -> None:
    timed = PLAN.gait.parametrize(2.0, samples=8)
    period = table_of(timed)
    path = f"three{suffix}"
    export(timed, [path, "gait.h"], periods=3, servos=servos)
    three = read_table(path)
    np.testing.assert_allclose(three["t"], np.arange(25) * 0.25, rtol=0, atol=1e-12)
    for k in range(3):
        rows = rows_of(three, 8 * k, 8 * k + 9)
        np.testing.assert_allclose(rows.alpha, period.alpha, rtol=0, atol=1e-12)
        if servos is None:
            assert tuple(rows["color"]) == tuple(period["color"])
            assert (rows["alpha1_rate"] == period["alpha1_rate"]).all()
    assert (three.about["period"], three.repeats) == (6.0, True)
    report = gg.validate(path)
    assert report.flyable
    assert not any("not used" in warning for warning in report.warnings)
    export(path, ["again.csv"], periods=2)
    assert len(read_table("again.csv")) == 49


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("stated", [(), ("color", "types", "R")])
def test_a_table_is_completed(closed: bool, stated: tuple[str, ...]) -> None:
    """The rows are at the corners of the square."""
    gait = gg.lift(GAITS[2].angles, "red")
    expected = table_of(gait.parametrize(samples=40, law="constant-speed"))
    made = {name: expected.columns[name] for name in ("t", *ANGLES, *stated)}
    whole = completed_table(rows_of(Table(columns=made), 0, 41 if closed else 40))
    assert [*whole.columns] == [*expected.columns]
    for name, values in expected.columns.items():
        if isinstance(values, np.ndarray):
            np.testing.assert_allclose(whole[name], values, atol=1e-12)
        else:
            assert tuple(whole[name]) == tuple(values)
    made["alpha4"] = expected["alpha4"] + np.where(np.arange(41) == 25, 0.1, 0.0)
    without = {name: made[name] for name in ("t", *ANGLES)}  # a row is off the sheet
    assert not {"color", "types"} & {*completed_table(Table(columns=without)).columns}


@pytest.mark.parametrize("repeats", [True, False])
def test_rows_with_rates_alone_are_joined_by_cubics(repeats: bool) -> None:
    """A circle with the rates of its closed form, and no accelerations."""
    count = 61 if repeats else 31
    t = np.linspace(0.0, 2.0, 61)[:count]
    cosine, sine = 0.35 * np.cos(np.pi * t), 0.35 * np.sin(np.pi * t)
    alpha = np.column_stack([cosine - 0.8, sine + 0.8] * 2)
    rates = np.pi * np.column_stack([-sine, cosine] * 2)
    columns = dict(zip(RATES, rates.T, strict=True))
    about: dict[str, Any] = {} if repeats else {"repeats": False}
    table = replace(table_from(alpha, t=t, **columns), about=about)
    written = export(table, ["a.yaml"]).table
    for name in RATES:
        np.testing.assert_allclose(written[name], columns[name], atol=1e-15)
    assert not {*ACCELERATIONS} & {*written.columns}
    assert "accelerations: " not in Path("a.yaml").read_text()
    needed = gg.validate(table)["tilt_acceleration"].value
    assert needed == pytest.approx(0.35 * np.pi**2, rel=3e-3)
    fine = export(table, [], samples=600).table
    exact = 0.35 * np.cos(np.pi * fine["t"]) - 0.8
    np.testing.assert_allclose(fine["alpha1"], exact, atol=2e-7)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_stream_takes_the_bytes_of_a_file(suffix: str) -> None:
    if FORMATS[suffix].folder:
        return
    timed = PLAN.timed(samples=4)
    timed.write(f"stream{suffix}")
    content = Path(f"stream{suffix}").read_bytes()
    stream = BytesIO()
    timed.write(stream, format=suffix)
    assert stream.getvalue() == content
    if FORMATS[suffix].reads:
        again = gg.read_table(BytesIO(content), format=suffix.strip("."))
        assert (again.alpha == timed.alpha).all()
        assert again.motion is not None
    if suffix in TEXT:
        text = StringIO()
        timed.write(text, format=suffix)
        text.seek(0)
        assert (gg.read_table(text, format=suffix).alpha == timed.alpha).all()


@pytest.mark.parametrize(
    ("source", "suffix", "message"),
    [
        (StringIO("t,b\n1,2\n"), "csv", "^gait file 'stream.csv': column 'alpha1'"),
        (StringIO(""), "mcap", "format must be one of .csv, .json"),
        ("gait.csv", "csv", "^(path|gait) must be an open stream beside a format"),
        (StringIO(""), None, "format must be that of the stream, got None; read_table"),
        (BytesIO(b"\xff"), "json", "gait file 'stream.json' must be UTF-8 text"),
    ],
)
def test_errors_about_a_stream_name_no_path(
    source: Any, suffix: str | None, message: str
) -> None:
    for read in (gg.read_table, gg.gait_of, gg.validate, gg.certify):
        if is_stream(source):
            source.seek(0)
        with pytest.raises(gg.InputError, match=message) as refused:
            read(source, format=suffix)
        assert refused.value.path is None


def test_a_binary_format_needs_a_stream_of_bytes() -> None:
    with pytest.raises(gg.InputError, match=".npz file needs a stream of bytes"):
        PLAN.timed(samples=4).write(StringIO(), format="npz")


def both(text: str) -> tuple[StringIO, BytesIO]:
    return StringIO(text), BytesIO(text.encode("utf-8-sig"))


def test_a_stream_stands_for_the_path_of_a_file() -> None:
    for stream in both("mass = 1.0\narm_length = 0.2\ndrag_to_thrust = 0.01"):
        assert gg.vehicle_named(stream).arm_length == 0.2
    for stream in both("[servos]\npreset = 'x_frame'"):
        assert gg.io.servo_map_named(stream) == gg.io.servo_map_named("x_frame")
    for stream in both("gaits = ['gait4']"):
        assert len(gg.study.read_study(stream)) == 1
    for stream in both("alpha1,alpha2,color\n0.4,-0.4,red\n1.1,-0.4,red\n"):
        assert gg.validate(stream, format="csv").rows == 2
    timed = PLAN.timed(samples=4)
    written, rows = StringIO(), StringIO()
    gg.certify(timed).write(written)
    timed.write(rows, format="csv")
    for stream in both(written.getvalue()):
        rows.seek(0)
        assert gg.certificates.verify(stream, rows, format="csv")
    moved = gg.transition("hover", gg.lift([(-0.4, 0.4)], "red"))
    table_written = BytesIO()
    moved.write(table_written, format="csv")
    table_written.seek(0)
    assert len(gg.read_table(table_written, format="csv")) == len(moved.table)


@pytest.mark.parametrize(
    "read",
    [
        gg.vehicle_named,
        gg.io.servo_map_named,
        gg.study.read_study,
        gg.certificates.verify,
        partial(gg.validate, format="csv"),
        partial(gg.export, gg.lift([(0.4, -0.4)], "red"), format="csv"),
    ],
)
def test_a_stream_that_is_broken_or_closed_is_one_line(read: Any) -> None:
    closed = StringIO()
    closed.close()
    with pytest.raises(gg.errors.FileProblem, match=r"(from|to) the stream: .*closed"):
        read(closed)
    if not isinstance(read, partial):
        with pytest.raises(gg.InputError, match="must be UTF-8 text, got other bytes"):
            read(BytesIO(b"\xff"))
        with pytest.raises(gg.InputError, match="it is not TOML|must be JSON"):
            read(StringIO("{"))


class Full(RawIOBase):
    """A stream that is open for writing, and takes nothing."""

    def writable(self) -> bool:
        return True

    def write(self, _: Any) -> int:
        return 0


class Answer:
    """What a web framework takes content with: it cannot be read."""

    def __init__(self) -> None:
        self.content = b""

    def write(self, piece: bytes) -> None:
        self.content += piece

    def flush(self) -> None:
        pass


def test_streams_that_take_nothing_or_are_written_to_alone(
    planned: TimedGait, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(gg.errors.FileProblem, match="stream: it takes nothing more"):
        planned.write(Full(), format="csv")  # type: ignore[arg-type]
    answer: Any = Answer()
    planned.write(answer, format="csv")
    assert answer.content.startswith(b"t,alpha1")
    Path("a.csv").write_bytes(answer.content)
    with Path("a.csv").open("rb") as wrong, pytest.raises(gg.errors.FileProblem) as no:
        planned.write(wrong, format="csv")
    assert str(no.value).endswith(
        "needs a stream that is open for writing, got another"
    )
    monkeypatch.setattr("tempfile.tempdir", "none")
    with pytest.raises(gg.errors.FileProblem, match="needs a temporary folder: No"):
        planned.write(BytesIO(), format="csv")


# What their own readers read ------------------------------------------------------------------------------------------


def test_numpy_reads_the_archive(planned: TimedGait) -> None:
    planned.write("gait.npz")
    with np.load("gait.npz", allow_pickle=False) as archive:
        assert [*archive] == [*planned.columns, "provenance"]
        for name, values in planned.columns.items():
            np.testing.assert_array_equal(archive[name], values)
        about = json.loads(archive["provenance"].item())["about"]
    assert about["period"] == 2.0
    times = {member.date_time for member in zipfile.ZipFile("gait.npz").infolist()}
    assert times == {(1980, 1, 1, 0, 0, 0)}


def test_scipy_reads_the_matlab_file(planned: TimedGait) -> None:
    planned.write("gait.mat")
    content = loadmat("gait.mat", squeeze_me=True, chars_as_strings=True)
    head = f"MATLAB 5.0 MAT-file, written by gaitgraph {gg.__version__}"
    start = Path("gait.mat").read_bytes()[:117].decode()
    assert start == head.ljust(116) + "\0"
    assert loadmat("gait.mat")["t"].shape == (13, 1)
    for name, values in planned.columns.items():
        stripped = [str(value).strip() for value in content[name].tolist()]
        assert stripped == [str(value) for value in values]
    matrices = [content[f"alpha{end}"] for end in ("", "_rate", "_acceleration")]
    np.testing.assert_array_equal(matrices, planned.at(planned.t))
    names, units = (np.char.strip(content[name]) for name in ("names", "units"))
    unit_of = dict(zip(names.tolist(), units.tolist(), strict=True))
    stated = [unit_of[name] for name in ("t", "alpha3", "alpha3_rate", "R")]
    assert stated == ["s", "rad", "rad/s", "1"]


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_parquet_is_exchanged_with(library: str, planned: TimedGait) -> None:
    frames = pytest.importorskip(library, reason=f"install {library}")
    expected = table_of(planned)
    planned.write("ours.parquet")
    schema = pq.ParquetFile("ours.parquet").schema_arrow
    assert schema.field("alpha2_acceleration").metadata[b"unit"] == b"rad/s^2"
    assert str(schema.field("t").type) == "double"
    assert str(schema.field("color").type).startswith("dictionary<values=string")
    frame = frames.read_parquet("ours.parquet")
    for name, values in expected.columns.items():
        assert [*frame[name]] == [*values]
    if library == "pandas":
        frame.to_parquet("theirs.parquet")
    else:
        frame.write_parquet("theirs.parquet")
    found = read_table("theirs.parquet")
    assert_same(found, expected)
    # What polars writes states nothing.
    assert found.about == (expected.about if library == "pandas" else {})


# What others write ----------------------------------------------------------------------------------------------------


def write_columns(suffix: str, columns: dict[str, Any], *, packed: bool = True) -> Path:
    path = Path(f"theirs{suffix}")
    if suffix == ".npz":
        savez(path, **columns)
    elif suffix == ".mat":
        savemat(path, columns, do_compression=packed, long_field_names=True)
    else:
        pq.write_table(pa.table(columns), path)
    return path


@pytest.mark.parametrize(
    ("suffix", "others"),
    [
        (".npz", {"note": np.zeros((2, 2))}),
        (".mat", {"fs": 1.0, "run": {"a": 1.0}}),
    ],
)
def test_arrays_of_other_kinds_are_read(suffix: str, others: Any) -> None:
    kinds: Any = (np.int8, ">f8", np.float32, np.float16)
    values = [[0, 1], [-1.0, -0.5], [0.5, 1.0], [-0.5, -1.0]]
    columns = {
        name: np.array(column, dtype=kind)
        for name, column, kind in zip(ANGLES, values, kinds, strict=True)
    }
    table = read_table(write_columns(suffix, columns | others | {"color": "red"}))
    assert table.alpha.T.tolist() == values
    assert table["color"] == ("red", "red")


@pytest.mark.parametrize("packed", [False, True])
def test_matlab_files_may_hold_one_matrix(packed: bool, planned: TimedGait) -> None:
    deep = {"inner": {"deeper": {"deepest": 1.0}}, "alpha1": 3.0}
    content = {"alpha": planned.alpha, "t": planned.t[:, None], "run7": deep}
    table = read_table(write_columns(".mat", content, packed=packed))
    assert table.alpha.tobytes() == planned.alpha.tobytes()
    assert table["t"].tobytes() == planned.t.tobytes()


CELLS = np.array([1, "a"], dtype=object)
NO_ALPHA1 = {name: values for name, values in ZEROS.items() if name != "alpha1"}


@pytest.mark.parametrize(
    ("suffixes", "columns", "message"),
    cases(r"""
.npz .mat | {"fs": 1.0, "signal": np.zeros(9)} | columns are 'fs', 'signal'
.npz .mat .parquet | NO_ALPHA1 | column 'alpha1' is missing
.mat | {**ZEROS, "alpha1": CELLS} | column 'alpha1' is missing
.mat | {**ZEROS, "alpha1": {"a": 1.0}} | column 'alpha1' is missing
.npz .mat | {**ZEROS, "alpha1": np.zeros(3) * 1j} | alpha1 must be a column .*complex
.npz .mat | {**ZEROS, "alpha1": np.zeros((3, 2))} | alpha1 must be a column .*3, 2
.npz .mat | {**ZEROS, "alpha1": np.zeros(4)} | same number of rows, got 3 to 4
.npz .parquet | {**ZEROS, "alpha1": [True] * 3} | alpha1 must be a column .*bool
.npz .mat .parquet | {**ZEROS, "alpha1": ["1", "2", "0x"]} | row 3: alpha1
.parquet | {**ZEROS, "alpha1": [[0.0]] * 3} | row 1: alpha1 .* got \[0.0\]
.parquet | {**ZEROS, "alpha1": [0.0, None, 0.0]} | row 2: alpha1
.parquet | {**ZEROS, "color": [1, 2, 3]} | row 1: color .*, got 1
.parquet | {**ZEROS, "color": ["red", None, "red"]} | row 2: color
.parquet | dict.fromkeys(ANGLES, np.zeros(0)) | at least one row
.npz | {**ZEROS, "t": np.zeros(3, "M8[s]")} | t must be .*datetime64
.npz | {**ZEROS, "alpha3": [0, 0, np.nan]} | row 3: alpha3
.mat | {"alpha": np.zeros((4, 9))} | matrix of 4 columns, .*\(4, 9\)
.mat | {"run7": {"alpha": np.zeros((9, 4))}} | save -struct writes
"""),
)
def test_files_with_something_else_are_refused(
    suffixes: str, columns: str, message: str
) -> None:
    for suffix in suffixes.split():
        assert re.search(message, refusal(write_columns(suffix, eval(columns))))


def test_json_of_rows_and_of_plans_is_read() -> None:
    row = [0.4, -0.4, 0.4, -0.4]
    rows = [dict(zip(ANGLES, row, strict=True))] * 2
    for content in (rows, {"path": [row] * 2, "colors": ["red"] * 2}):
        table = read_table(StringIO(json.dumps(content)), format="json")
        assert table.alpha.tolist() == [row] * 2


class Trap:
    """What must never be unpickled."""

    def __reduce__(self) -> Any:
        return pytest.fail, ("it was executed",)


def npy(header: str, content: bytes = b"") -> bytes:
    text = header.encode("latin-1")
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(text)) + text + content


NPY = "{'descr': '%s', 'fortran_order': False, 'shape': %s, }"
SHELL = NPY.replace("'%s'", "__import__('os').abort()")


@pytest.mark.parametrize(
    ("member", "message"),
    [
        (npy(NPY % ("<f8", "(3000000,)"), b"\0" * 24), "EOF"),
        (npy(NPY % ("|O", "(3,)"), pickle.dumps([Trap()] * 3)), "Object arrays"),
        (npy(SHELL % "(3,)"), "malformed"),
        (b"\x93NUMPY\2\0\xff\xff\xff\xff", "EOF"),
    ],
)
def test_hostile_arrays_are_refused_and_ignored_beside_columns(
    member: bytes, message: str
) -> None:
    for name in ("alpha3", "something"):
        path = write_columns(".npz", {k: v for k, v in ZEROS.items() if k != name})
        with zipfile.ZipFile(path, "a") as archive:
            archive.writestr(f"{name}.npy", member)
        if name == "alpha3":
            assert re.search(f"alpha3 must be a column .*{message}", refusal(path))
        else:
            assert len(read_table(path)) == 3


BROKEN = {
    ".npz": "it is not an archive that numpy.savez wrote",
    ".mat": "it is not a MAT-file|column 'alpha1' is missing",  # an older scipy reads zeros
    ".parquet": "it is not a Parquet file",
    ".mcap": "it is not a ROS 2 bag, or it is broken",
}
MATLAB_7 = b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + b"\0" * 384


@pytest.mark.parametrize("suffix", BROKEN)
def test_broken_files_are_refused(suffix: str, planned: TimedGait) -> None:
    planned.write(f"ours{suffix}")
    path = Path(f"ours{suffix}")
    path = next(path.glob("*.mcap")) if path.is_dir() else path
    whole = path.read_bytes()
    cut = [b"", whole[:4], whole[: len(whole) // 2], whole[:-20]]
    cut += [b"PAR1PAR1", b"\0" * 200, MATLAB_7]
    for content in cut:
        path.write_bytes(content)
        assert re.search(BROKEN[suffix], refusal(path))


def test_a_parquet_file_with_texts_that_are_none_is_refused() -> None:
    text = pa.array([b"\xff+,+)"], pa.binary()).view(pa.string())
    types = pa.DictionaryArray.from_arrays(pa.array([0, 0], pa.int32()), text)
    columns = dict.fromkeys(ANGLES, pa.array([0.1, 0.2]))
    pq.write_table(pa.table({**columns, "types": types}), "a.parquet")
    with pytest.raises(gg.InputError, match="it is not a Parquet file"):
        read_table("a.parquet")


def test_a_parquet_file_that_lies_about_its_size_or_is_encrypted_is_refused() -> None:
    path = write_columns(".parquet", ZEROS)
    whole = path.read_bytes()
    path.write_bytes(whole[:-8] + b"\xff\xff\xff\x7fPAR1")
    assert re.search(BROKEN[".parquet"], refusal(path))
    path.write_bytes(whole[:-4] + b"PARE")
    assert "encrypted" in refusal(path)


def test_what_made_a_file_is_checked() -> None:
    text = '{"format": "gaitgraph gait table"}'
    paths = [
        write_columns(".npz", ZEROS | {"provenance": text}),
        write_columns(".mat", ZEROS | {"provenance": text}),
        Path("a.parquet"),
    ]
    stated = pa.table(ZEROS).replace_schema_metadata({"gaitgraph": text})
    pq.write_table(stated, paths[2])
    for path in paths:
        assert "about must be an object, got None" in refusal(path)
    for other in ("measured on Monday", np.zeros(2), CELLS):
        path = write_columns(".npz", ZEROS | {"provenance": other})
        assert read_table(path).about == {}


@pytest.mark.filterwarnings("ignore::gaitgraph.errors.FileWarning")
@pytest.mark.parametrize("suffix", [*TABLES, ".mcap"])
def test_mutated_files_are_read_or_refused_in_one_line(
    suffix: str, planned: TimedGait
) -> None:
    planned.write(f"ours{suffix}")
    paths = [Path(f"ours{suffix}")]
    if suffix == ".mcap":
        paths = [*paths[0].glob("*.mcap")]
    if suffix == ".mat":
        # Wrong sizes in a file that is not compressed may end the process in scipy.
        content = {"alpha": planned.alpha, "t": planned.t, "color": "red"}
        paths.append(write_columns(suffix, content))
    for path in paths:
        assert check_mutations(path.read_bytes(), path, count=100) > 20


@pytest.mark.parametrize(
    ("suffix", "ours"),
    [
        *((suffix, "formats.table_of_columns") for suffix in BROKEN),
        (".npz", "binary_tables._about_of_array"),
        (".parquet", "binary_tables._about_of_parquet"),
    ],
)
@pytest.mark.parametrize("kind", [KeyError, MemoryError, ValueError])
def test_an_error_of_our_own_code_is_not_called_a_broken_file(
    suffix: str, ours: str, kind: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(*_: object, **__: object) -> None:
        raise kind("ours")

    PLAN.timed(samples=7).write(f"gait{suffix}")
    monkeypatch.setattr(f"gaitgraph.io.{ours}", wrong)
    with pytest.raises(kind, match="ours") as caught:
        read_table(f"gait{suffix}")
    assert type(caught.value) is kind


# Frames ---------------------------------------------------------------------------------------------------------------


def test_frames_of_pandas(planned: TimedGait) -> None:
    pd = pytest.importorskip("pandas", reason="install pandas")
    frame, expected = planned.to_pandas(), table_of(planned)
    for given in (frame, frame.set_index("t")):
        assert_same(table_from_frame(given), expected)
        assert table_from_frame(given).about == expected.about
    planned.write("read.csv")
    read = table_from_frame(pd.read_csv("read.csv"))
    assert read.about == expected.about  # by its column made_by
    twice = pd.concat([frame, frame[["alpha1"]]], axis=1)
    dates = frame.assign(t=pd.date_range("2020", periods=13))
    check_refused(frame.rename(columns={"alpha4": "alpha_4"}), "did you mean 'alpha4'")
    check_refused(twice, "got 'alpha1' 2 times")
    check_refused(frame.assign(alpha1=None), "row 1: alpha1 .* got no value")
    check_refused(dates, "t must .*datetime64")
    check_refused(frame.T, "column 'alpha1' is missing")
    check_refused(pd.Series(np.zeros(101)), "must be a Gait, .* data frame")
    about = {"format": "gaitgraph gait table", "about": {"a": object()}}
    frame.attrs["gaitgraph"] = about
    check_refused(frame, "attrs must be as gaitgraph left them")


def check_refused(frame: Any, message: str) -> None:
    with pytest.raises(gg.InputError, match=message):
        gg.validate(frame)


def test_frames_of_polars_and_pyarrow(planned: TimedGait) -> None:
    pl = pytest.importorskip("polars", reason="install polars")
    expected = table_of(planned)
    frame = pl.DataFrame(expected.columns)
    for given in (frame, frame.to_arrow()):
        assert_same(table_from_frame(given), expected)
    check_refused(frame.with_columns(pl.lit(None).alias("alpha2")), "row 1: alpha2")
    check_refused(frame.lazy(), "must be a Gait, .* data frame")
    check_refused(frame["alpha1"], "must be a Gait, .* data frame")


def test_mappings_are_frames() -> None:
    angles = {"alpha1": ["3pi/8", 1.0], "alpha2": ["-3pi/8", -0.5], "color": "red"}
    assert gg.validate(angles).flyable


@pytest.mark.parametrize(
    ("values", "message"),
    cases(r"""
[True] * 3 | row 1: alpha1 must be a finite number, .* got True
np.ones(3, dtype=bool) | alpha1 must be a column of numbers .*, got bool
np.full(3, np.nan) | row 1: alpha1 must be a finite number, .* got nan
np.zeros((3, 3)) | alpha1 must be a column .* of shape \(3, 3\)
3 | columns must have the same number of rows, got 1 to 3
"""),
)
def test_other_mappings_are_refused(values: str, message: str) -> None:
    check_refused(ZEROS | {"alpha1": eval(values)}, message)


def test_what_is_no_frame_is_refused() -> None:
    with pytest.raises(gg.InputError, match="frame must be a frame of pandas or pol"):
        table_from_frame(5)  # type: ignore[arg-type]


# Libraries ------------------------------------------------------------------------------------------------------------


def test_what_is_missing_is_named(
    planned: TimedGait, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(gg.InputError, match="with: pip install pandas$"):
        planned.to_pandas()
    monkeypatch.setattr("gaitgraph.io.formats.find_spec", lambda _: None)
    for path, library in (("a.parquet", "pyarrow"), ("a.mcap", "rosbags")):
        for ask in (read_table, planned.write):
            with pytest.raises(MissingExtra, match=f"needs {library}. Install it with"):
                ask(path)
    planned.write("a.yaml")  # needs none


def test_nothing_that_is_not_needed_is_loaded(planned: TimedGait) -> None:
    planned.write("a.npz")
    code = (
        "import sys, gaitgraph as gg\n"
        "gg.validate('a.npz')\n"
        "gg.export('a.npz', ['b.csv', 'b.json', 'b.h'])\n"
        "print(*{'pandas', 'polars', 'pyarrow', 'scipy.io', 'rosbags'} & {*sys.modules})"
    )
    out = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert out.strip() == ""


def test_the_page_lists_every_format() -> None:
    page = Path(__file__).parent.parent / "docs" / "guide" / "files.md"
    lines = [line for line in page.read_text().splitlines() if line.startswith("| `.")]
    cells = [re.split(r"\s*\|\s*", line) for line in lines]
    found = {row[1].strip("`"): row[2:5] for row in cells if len(row) == 7}
    assert [*found] == [*FORMATS]
    for suffix, form in FORMATS.items():
        extra = f"`{form.extra}`" if form.extra else "–"
        assert found[suffix] == [form.name, extra, "yes" if form.reads else "no"]
