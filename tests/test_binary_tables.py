"""NPZ, MAT and Parquet: read by their own readers, files from elsewhere, broken and hostile files."""

from __future__ import annotations

import io
import json
import pickle
import re
import struct
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import loadmat, savemat

import gaitgraph as gg
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.io.formats import read_table, write_tables
from gaitgraph.timing.timed_gait import table_of
from tests.mutated import check_mutations, refusal
from tests.test_formats import ZEROS as FOUR, assert_same

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.timing.timed_gait import TimedGait

SUFFIXES = [".npz", ".mat", ".parquet"]
savez: Any = np.savez
savez_compressed: Any = np.savez_compressed


# What is written ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".csv", ".json", *SUFFIXES])
def test_any_finite_values_survive(suffix: str, tmp_path: Path) -> None:
    values = np.array([0.0, -0.0, 5e-324, 0.1 + 0.2, -1.5])
    made: dict[str, Any] = {f"alpha{k}": np.roll(values, k) for k in range(1, 5)}
    about = {"": "ü\n\0\r", "'\"{},;": 1.7e308, "\U0001f681": -0.0}
    for rows, colors in ((5, {}), (1, {"color": ("red",) * 5})):
        table = Table(columns=made | colors | {"R": 1e11 * values}, about=about).rows(
            0, rows
        )
        write_tables(table, [tmp_path / f"any{suffix}"], force=True)
        found = read_table(tmp_path / f"any{suffix}")
        assert_same(found, table)
        assert found.about == about


def test_numpy_reads_the_archive(planned: TimedGait, tmp_path: Path) -> None:
    path = tmp_path / "gait.npz"
    planned.write(path)
    with np.load(path, allow_pickle=False) as found:
        assert [*found] == [*planned.columns, "provenance"]
        for name, values in planned.columns.items():
            np.testing.assert_array_equal(found[name], values)
            assert found[name].dtype == float or found[name].dtype.kind == "U"
        assert found["provenance"].shape == ()
        assert json.loads(found["provenance"].item())["about"]["period"] == 2.0
    assert {one.date_time for one in zipfile.ZipFile(path).infolist()} == {
        (1980, 1, 1, 0, 0, 0)
    }


def test_scipy_reads_the_matlab_file(planned: TimedGait, tmp_path: Path) -> None:
    path = tmp_path / "gait.mat"
    planned.write(path)
    found = loadmat(path, squeeze_me=True)
    assert (
        path.read_bytes()[:116]
        == f"MATLAB 5.0 MAT-file, written by gaitgraph {gg.__version__}".ljust(
            116
        ).encode()
    )
    assert loadmat(path)["t"].shape == loadmat(path)["alpha1"].shape == (13, 1)
    for name, values in planned.columns.items():
        np.testing.assert_array_equal(
            np.char.strip(found[name]) if name in ("color", "types") else found[name],
            values,
        )
    for group, values in zip(
        ("alpha", "alpha_rate", "alpha_acceleration"),
        planned.at(planned.t),
        strict=True,
    ):
        np.testing.assert_array_equal(found[group], values)
    units = dict(
        zip(
            np.char.strip(found["names"]).tolist(),
            np.char.strip(found["units"]).tolist(),
            strict=True,
        )
    )
    assert (units["t"], units["alpha3"], units["alpha3_rate"], units["R"]) == (
        "s",
        "rad",
        "rad/s",
        "1",
    )
    assert found["provenance"] == provenance_text(table_of(planned))


@pytest.mark.parametrize(("library", "stated"), [("pandas", True), ("polars", False)])
def test_parquet_is_exchanged_with(
    library: str, stated: bool, planned: TimedGait, tmp_path: Path
) -> None:
    frames = pytest.importorskip(library, reason=f"install {library}")
    ours, theirs = tmp_path / "a.parquet", tmp_path / "b.parquet"
    planned.write(ours)
    schema = pq.ParquetFile(ours).schema_arrow
    assert schema.field("alpha2_acceleration").metadata[b"unit"] == b"rad/s^2"
    assert [str(schema.field(name).type)[:24] for name in ("t", "color")] == [
        "double",
        "dictionary<values=string",
    ]
    assert json.loads(schema.metadata[b"gaitgraph"])["version"] == gg.__version__
    frame = frames.read_parquet(ours)
    assert {name: list(frame[name]) for name in frame.columns} == {
        name: list(values) for name, values in table_of(planned).columns.items()
    }
    (frame.to_parquet if stated else frame.write_parquet)(theirs)
    found = read_table(theirs)
    assert_same(found, table_of(planned))
    assert found.about == (
        table_of(planned).about if stated else {}
    )  # what polars writes states nothing
    assert check_mutations(theirs.read_bytes(), theirs, count=75) > 20


# What others write ----------------------------------------------------------------------------------------------------


def test_arrays_of_other_kinds_are_read(tmp_path: Path) -> None:
    rows = {
        "alpha1": np.array([0, 1], dtype=np.int8),
        "alpha2": np.array([-1.0, -0.5], dtype=">f8"),
    }
    rows |= {
        "alpha3": np.array([0.5, 1], dtype=np.float32),
        "alpha4": np.array([-0.5, -1], dtype=np.float16),
    }
    savez(
        tmp_path / "a.npz",
        **rows,
        color=np.array("red"),
        note=np.array([1, 2, 3]),
        deep=np.zeros((2, 2)),
    )
    table = read_table(tmp_path / "a.npz")
    assert table["alpha1"].tolist() == [0, 1]
    assert table["alpha2"].tolist() == [-1, -0.5]
    assert table["color"] == ("red", "red")
    savemat(
        tmp_path / "a.mat",
        {
            **rows,
            "fs": 100.0,
            "cells": np.array([1, "a"], dtype=object),
            "color": "red",
        },
    )
    found = read_table(tmp_path / "a.mat")
    assert found.alpha.tolist() == table.alpha.tolist()
    assert found["color"] == ("red", "red")


@pytest.mark.parametrize("packed", [False, True])
def test_matlab_files_may_hold_more_than_arrays(
    packed: bool, planned: TimedGait, tmp_path: Path
) -> None:
    alpha, t, path = planned.alpha, planned.t, tmp_path / "a.mat"
    parts = {f"alpha{k + 1}": alpha[:, k] for k in range(4)}
    for content in (
        {"alpha": alpha, "t": t, "fs": 5.0},
        {**parts, "t": t[:, None], "gait": {"note": 1.0}},
        {
            "alpha": alpha,
            "t": t,
            "run7": {"alpha1": 3.0, "inner": {"deeper": {"deepest": 1.0}}},
        },
    ):
        savemat(path, content, do_compression=packed)
        table = read_table(path)
        assert table.alpha.tobytes() == alpha.tobytes()
        assert table["t"].tobytes() == t.tobytes()


# What is refused ------------------------------------------------------------------------------------------------------


class Trap:
    """What must never be unpickled."""

    def __reduce__(self) -> Any:
        return pytest.fail, ("it was executed",)


def npy(header: str, content: bytes = b"") -> bytes:
    text = header.encode("latin-1")
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(text)) + text + content


def npz_of(path: Path, **members: bytes) -> Path:
    plain = {}
    for name, values in FOUR.items():
        stream = io.BytesIO()
        np.save(stream, values)
        plain[name] = stream.getvalue()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {**plain, **members}.items():
            archive.writestr(f"{name}.npy", content)
    return path


NPY = "{'descr': '%s', 'fortran_order': False, 'shape': %s, }"


@pytest.mark.parametrize(
    ("member", "message"),
    [
        (npy(NPY % ("<f8", "(3000000,)"), b"\0" * 24), "alpha3 must be a column .*EOF"),
        (
            npy(NPY % ("<f8", "(3, 2)"), b"\0" * 48),
            r"alpha3 must be a column .*shape \(3, 2\)",
        ),
        (
            npy(NPY % ("<c16", "(3,)"), b"\0" * 48),
            "alpha3 must be a column of numbers .*complex128",
        ),
        (
            npy(NPY % ("|b1", "(3,)"), b"\0" * 3),
            "alpha3 must be a column of numbers .*bool",
        ),
        (
            npy(NPY % ("<M8[s]", "(3,)"), b"\0" * 24),
            "alpha3 must be a column of numbers .*datetime",
        ),
        (
            npy(NPY % ("|O", "(3,)"), pickle.dumps([Trap()] * 3)),
            "alpha3 must be .*Object arrays cannot be loaded",
        ),
        (
            npy(
                "{'descr': __import__('os').abort(), 'fortran_order': False, 'shape': (3,), }"
            ),
            "alpha3 .*malformed",
        ),
        (
            npy(NPY % ("<f8", "(2,)"), b"\0" * 16),
            "columns must have equally many rows, got 2 to 3",
        ),
        (
            npy(NPY % ("<f8", "(3,)"), b"\0" * 16 + struct.pack("<d", np.nan)),
            "row 3: alpha3",
        ),
        (b"\x93NUMPY\2\0\xff\xff\xff\xff", "alpha3 must be .*EOF"),
    ],
)
def test_arrays_that_are_no_columns_are_refused(
    member: bytes, message: str, tmp_path: Path
) -> None:
    path = npz_of(tmp_path / "bad.npz", alpha3=member)
    assert re.search(message, refusal(path))
    fine = npz_of(tmp_path / "fine.npz", something=member)
    assert len(read_table(fine)) == 3  # what is no column of ours is ignored


def test_archives_that_are_broken_are_refused(tmp_path: Path) -> None:
    path = npz_of(tmp_path / "a.npz")
    whole = path.read_bytes()
    middle = len(whole) // 2
    for content in (
        b"",
        b"PK\3\4 no zip",
        whole[:-30],
        whole[:middle] + whole[middle + 9 :],
        b"\x93NUMPY\1\0",
    ):
        path.write_bytes(content)
        assert "it is not an archive that numpy.savez wrote" in refusal(path)


def test_matlab_files_with_something_else_are_refused(tmp_path: Path) -> None:
    path, cells = tmp_path / "a.mat", np.array([1, "a"], dtype=object)
    three = {name: values for name, values in FOUR.items() if name != "alpha1"}
    for content, message in (
        (
            {"fs": 100.0, "signal": np.zeros(9)},
            "column 'alpha1' is missing.*other columns are 'fs', 'signal'",
        ),
        ({**three, "alpha1": cells}, "column 'alpha1' is missing"),
        ({**three, "alpha1": {"a": 1.0}}, "column 'alpha1' is missing"),
        (
            {**three, "alpha1": np.zeros(3) * 1j},
            "alpha1 must be a column of numbers .*complex",
        ),
        (
            {**three, "alpha1": np.zeros((3, 2))},
            r"alpha1 must be a column .*shape \(3, 2\)",
        ),
        (
            {**three, "alpha1": np.zeros(4)},
            "columns must have equally many rows, got 3 to 4",
        ),
        ({**three, "alpha1": np.array(["0x", "1", "2"])}, "row 1: alpha1 .*'0x'"),
        (
            {"alpha": np.zeros((4, 9)), "t": np.zeros(9)},
            r"alpha must be a matrix of 4 columns, .*\(4, 9\)",
        ),
        (
            {"run7": {"alpha": np.zeros((9, 4))}},
            "it must have variables of numbers; save -struct writes",
        ),
    ):
        for packed in (False, True):
            savemat(path, content, do_compression=packed, long_field_names=True)
            assert re.search(message, refusal(path))


def test_matlab_files_that_are_broken_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, FOUR)
    whole = path.read_bytes()
    for content in (
        b"",
        b"\0" * 200,
        b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + b"\0" * 384,
        whole[:-20],
        whole[:130],
    ):
        path.write_bytes(content)
        # Older versions of scipy read a file of zeros as one without variables.
        said = refusal(path)
        assert "it is not a MAT-file" in said or "column 'alpha1' is missing" in said


def test_parquet_files_with_something_else_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    for changed, message in (
        (
            {"alpha1": pa.array([True] * 3)},
            "alpha1 must be a column of numbers .*, got bool",
        ),
        (
            {"alpha1": pa.array(["0", "1", "x"])},
            "row 3: alpha1 must be a finite number, got 'x'",
        ),
        (
            {"alpha1": pa.array([[0.0]] * 3)},
            r"row 1: alpha1 must be a finite number, got \[0.0\]",
        ),
        (
            {"t": pa.array([1, 2, 3], pa.timestamp("s"))},
            "t must be a column of numbers .*, got datetime64",
        ),
        ({"color": pa.array([1, 2, 3])}, "row 1: color must be one of .*, got 1"),
        ({"color": pa.array(["red", None, "red"])}, "row 2: color"),
        ({"alpha2": pa.array([0.0, None, 0.0])}, "row 2: alpha2"),
    ):
        pq.write_table(pa.table({**FOUR, **changed}), path)
        assert re.search(message, refusal(path))
    pq.write_table(
        pa.table({**FOUR, "note": ["a", "b", "c"], "when": [[1], [2], [3]]}), path
    )
    assert len(read_table(path)) == 3
    pq.write_table(pa.table({name: values[:0] for name, values in FOUR.items()}), path)
    assert "must have at least one row" in refusal(path)


def test_parquet_files_that_are_broken_are_refused(
    planned: TimedGait, tmp_path: Path
) -> None:
    path = tmp_path / "a.parquet"
    planned.write(path)
    whole = path.read_bytes()
    huge = whole[:-8] + b"\xff\xff\xff\x7fPAR1"
    for content in (
        b"",
        b"PAR1",
        b"PAR1PAR1",
        whole[:-1],
        whole[: len(whole) // 2],
        huge,
    ):
        path.write_bytes(content)
        assert "it is not a Parquet file" in refusal(path)
    path.write_bytes(whole[:-4] + b"PARE")
    assert "encrypted" in refusal(path)


def test_what_made_a_file_is_checked(tmp_path: Path) -> None:
    text = '{"format": "gaitgraph gait table"}'
    savez(tmp_path / "a.npz", **FOUR, provenance=np.array(text))
    savemat(tmp_path / "a.mat", {**FOUR, "provenance": text})
    pq.write_table(
        pa.table(FOUR).replace_schema_metadata({"gaitgraph": text}),
        tmp_path / "a.parquet",
    )
    for suffix in SUFFIXES:
        assert "about must be an object, got None" in refusal(tmp_path / f"a{suffix}")
    for other in (
        np.array("measured on Monday"),
        np.zeros(2),
        np.array([1, "a"], dtype=object),
    ):
        savez(tmp_path / "a.npz", **FOUR, provenance=other)
        assert read_table(tmp_path / "a.npz").about == {}


@pytest.mark.parametrize("suffix", [".csv", ".json", *SUFFIXES])
def test_mutated_files_are_read_or_refused_in_one_line(
    suffix: str, planned: TimedGait, tmp_path: Path
) -> None:
    ours, theirs, more = (
        tmp_path / f"{name}{suffix}" for name in ("ours", "theirs", "more")
    )
    planned.write(ours)
    if suffix == ".npz":
        savez_compressed(
            theirs, **{name: np.array(v) for name, v in planned.columns.items()}
        )
    elif suffix == ".mat":
        found = loadmat(ours)
        savemat(
            theirs,
            {"alpha": found["alpha"], "provenance": found["provenance"]},
            do_compression=True,
        )
        # Wrong sizes in a file that is not compressed may end the process in scipy.
        parts = {"alpha": found["alpha"], "t": found["t"].T, "color": "red"}
        savemat(more, parts, do_compression=True)
    for path in (ours, theirs, more):
        if path.exists():
            assert check_mutations(path.read_bytes(), path, count=60) > 15
