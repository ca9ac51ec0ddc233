"""Array and table formats: read back bit for bit, by their own readers too; streamed; corrupt and hostile files."""

from __future__ import annotations

import io
import json
import pickle
import shutil
import struct
import subprocess
import sys
import tracemalloc
import weakref
import zipfile
import zlib
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from scipy.io import loadmat, savemat

import gaitgraph as gg
from gaitgraph import files
from gaitgraph.gait.gait import lift
from gaitgraph.gait.rows import completed_pieces
from gaitgraph.gait.table import ROWS_OF_A_PIECE, Table, merged, provenance_text
from gaitgraph.io import columns, json_reader as jsons, parquet, reading
from gaitgraph.io.formats import FORMATS
from gaitgraph.io.frames import table_from_frame
from gaitgraph.io.reading import read_pieces, read_table
from gaitgraph.io.writing import write_pieces, write_tables
from gaitgraph.planning.request import read_request
from gaitgraph.timing import exporting
from gaitgraph.timing.exporting import export
from gaitgraph.timing.timed_gait import pieces_of, table_of
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitgraph.timing.timed_gait import TimedGait

G1, _, G3, _ = GAITS
SUFFIXES = [".csv", ".json", ".npz", ".mat", ".parquet"]
BINARY = SUFFIXES[2:]
savez: Any = np.savez
savez_compressed: Any = np.savez_compressed


@pytest.fixture(scope="module")
def planned() -> TimedGait:
    return gg.plan_loop(G3.waypoints, period=2.0).timed(samples=12)


@pytest.fixture(scope="module")
def valid_files(planned: TimedGait, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[bytes]]:
    """Contents of good files of each format: as written here, and as other writers leave them."""
    folder = tmp_path_factory.mktemp("valid")
    planned.write(*(folder / f"ours{suffix}" for suffix in SUFFIXES))
    theirs = loadmat(folder / "ours.mat")
    savez_compressed(folder / "theirs.npz", **{name: np.array(v) for name, v in planned.columns().items()})
    savemat(folder / "theirs.mat", {"gait": theirs["gait"][0, 0]}, do_compression=True)
    savemat(folder / "more.mat", {"alpha": theirs["alpha"], "t": theirs["t"].T, "color": "red"}, do_compression=True)
    planned.to_polars().write_parquet(folder / "theirs.parquet")
    planned.to_pandas().to_parquet(folder / "more.parquet")
    return {suffix: [path.read_bytes() for path in sorted(folder.glob(f"*{suffix}"))] for suffix in SUFFIXES}


def assert_same(found: Table, expected: Table) -> None:
    assert list(found.columns) == list(expected.columns)
    for name, values in expected.columns.items():
        if isinstance(values, np.ndarray):
            assert found[name].tobytes() == values.tobytes(), name
        else:
            assert tuple(found[name]) == tuple(values), name


def cut(table: Table, places: tuple[int, ...]) -> list[Table]:
    """Return a table in pieces."""
    return [table.rows(*pair) for pair in pairwise(places)]


# Round trips ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_plan_is_read_back_bit_for_bit_with_what_made_it(suffix: str, planned: TimedGait, tmp_path: Path) -> None:
    path = tmp_path / f"gait{suffix}"
    planned.write(path)
    found, expected = read_table(path), table_of(planned)
    assert_same(found, expected)
    assert found.about == expected.about
    assert found.about["request"]["waypoints"]
    assert gg.validate(path).as_mapping() == gg.validate(tmp_path / f"gait{suffix}").as_mapping()
    request, sampling = read_request(path, {})
    again = gg.plan_loop(request.waypoints, period=request.period).timed(**sampling)
    assert_same(table_of(again), expected)


@pytest.mark.parametrize("suffix", BINARY)
@settings(deadline=None, max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_finite_values_survive(suffix: str, tmp_path: Path, data: st.DataObject) -> None:
    rows = data.draw(st.integers(1, 5))
    numbers = st.lists(st.floats(-1.5, 1.5), min_size=rows, max_size=rows)
    made: dict[str, Any] = {f"alpha{k}": np.array(data.draw(numbers)) for k in range(1, 5)}
    if data.draw(st.booleans()):
        made |= {
            "color": tuple(
                data.draw(st.lists(st.sampled_from(["red", "blue", "fiber1"]), min_size=rows, max_size=rows))
            )
        }
    made["R"] = np.array(data.draw(st.lists(st.floats(-1e11, 1e11), min_size=rows, max_size=rows)))
    about = data.draw(
        st.dictionaries(
            st.text(max_size=5), st.text(max_size=5) | st.floats(allow_nan=False, allow_infinity=False), max_size=3
        )
    )
    about.pop("servos", None)
    table = Table(columns=made, about=about)
    write_tables(table, [tmp_path / f"any{suffix}"], force=True)
    found = read_table(tmp_path / f"any{suffix}")
    assert_same(found, table)
    assert found.about == about


def test_the_same_gait_gives_the_same_bytes_through_every_format(planned: TimedGait, tmp_path: Path) -> None:
    planned.write(tmp_path / "a.csv")
    before = tmp_path / "a.csv"
    for suffix in [*BINARY, ".json", ".csv"]:
        one, two = tmp_path / f"b{suffix}", tmp_path / f"c{suffix}"
        export(before, [one])
        export(before, [two])
        assert one.read_bytes() == two.read_bytes()
        before = one
    assert before.read_bytes() == (tmp_path / "a.csv").read_bytes()


def test_numpy_reads_the_archive(planned: TimedGait, tmp_path: Path) -> None:
    path = tmp_path / "gait.npz"
    planned.write(path)
    with np.load(path, allow_pickle=False) as found:
        assert [*found] == [*planned.columns(), "provenance"]
        for name, values in planned.columns().items():
            np.testing.assert_array_equal(found[name], values)
            assert found[name].dtype == float or found[name].dtype.kind == "U"
        assert found["provenance"].shape == ()
        assert json.loads(found["provenance"].item())["about"]["period"] == 2.0
    assert {one.date_time for one in zipfile.ZipFile(path).infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_scipy_reads_the_matlab_file_as_struct_and_as_columns(planned: TimedGait, tmp_path: Path) -> None:
    path = tmp_path / "gait.mat"
    planned.write(path)
    found = loadmat(path, squeeze_me=True, struct_as_record=False)
    gait = found["gait"]
    assert path.read_bytes()[:116] == f"MATLAB 5.0 MAT-file, written by gaitgraph {gg.__version__}".ljust(116).encode()
    assert loadmat(path)["t"].shape == loadmat(path)["alpha1"].shape == (13, 1)
    for name, values in planned.columns().items():
        np.testing.assert_array_equal(np.char.strip(found[name]) if name in ("color", "types") else found[name], values)
    for group, values in zip(("alpha", "alpha_rate", "alpha_acceleration"), planned.at(planned.t), strict=True):
        np.testing.assert_array_equal(found[group], values)
        np.testing.assert_array_equal(getattr(gait, group), values)
    units = dict(zip(np.char.strip(gait.names).tolist(), np.char.strip(gait.units).tolist(), strict=True))
    assert (units["t"], units["alpha3"], units["alpha3_rate"], units["R"]) == ("s", "rad", "rad/s", "1")
    assert gait.provenance == provenance_text(table_of(planned))


def test_parquet_tells_units_and_what_made_it_and_is_read_by_pandas_and_polars(
    planned: TimedGait, tmp_path: Path
) -> None:
    path = tmp_path / "gait.parquet"
    planned.write(path)
    file = pq.ParquetFile(path)
    assert file.schema_arrow.field("alpha2_acceleration").metadata[b"unit"] == b"rad/s^2"
    assert str(file.schema_arrow.field("t").type) == "double"
    assert str(file.schema_arrow.field("color").type).startswith("dictionary<values=string")
    assert json.loads(file.schema_arrow.metadata[b"gaitgraph"])["version"] == gg.__version__
    pd.testing.assert_frame_equal(pd.read_parquet(path), planned.to_pandas())
    assert pl.read_parquet(path).equals(planned.to_polars())


def test_row_groups_do_not_depend_on_how_pieces_are_cut(tmp_path: Path) -> None:
    t = np.arange(ROWS_OF_A_PIECE + 1000.0)
    table = Table(columns={"t": t, **{f"alpha{k}": np.sin(t + k) for k in range(1, 5)}})
    for name, places in (("one", (0, len(table))), ("more", (0, 10, 60_000, 66_000, len(table)))):
        write_pieces(partial(cut, table, places), [tmp_path / f"{name}.parquet"])
    assert (tmp_path / "one.parquet").read_bytes() == (tmp_path / "more.parquet").read_bytes()
    groups = pq.ParquetFile(tmp_path / "one.parquet").metadata
    assert [groups.row_group(k).num_rows for k in range(groups.num_row_groups)] == [ROWS_OF_A_PIECE, 1000]
    assert_same(read_table(tmp_path / "more.parquet"), table)


# What others write ----------------------------------------------------------------------------------------------------


def test_arrays_of_other_kinds_are_read(tmp_path: Path) -> None:
    rows = {"alpha1": np.array([0, 1], dtype=np.int8), "alpha2": np.array([-1.0, -0.5], dtype=">f8")}
    rows |= {"alpha3": np.array([0.5, 1], dtype=np.float32), "alpha4": np.array([-0.5, -1], dtype=np.float16)}
    savez(tmp_path / "a.npz", **rows, color=np.array("red"), note=np.array([1, 2, 3]), deep=np.zeros((2, 2)))
    table = read_table(tmp_path / "a.npz")
    assert table["alpha1"].tolist() == [0, 1]
    assert table["alpha2"].tolist() == [-1, -0.5]
    assert table["color"] == ("red", "red")
    savemat(tmp_path / "a.mat", {**rows, "fs": 100.0, "cells": np.array([1, "a"], dtype=object), "color": "red"})
    found = read_table(tmp_path / "a.mat")
    assert found.alpha.tolist() == table.alpha.tolist()
    assert found["color"] == ("red", "red")


@pytest.mark.parametrize("packed", [False, True])
def test_matlab_files_with_arrays_alone_or_with_a_struct_alone(
    packed: bool, planned: TimedGait, tmp_path: Path
) -> None:
    alpha, t, path = planned.alpha, planned.t, tmp_path / "a.mat"
    parts = {f"alpha{k + 1}": alpha[:, k] for k in range(4)}
    for content in (
        {"alpha": alpha, "t": t, "fs": 5.0},
        {**parts, "t": t[:, None], "gait": {"note": 1.0}},
        {"gait": {"alpha": alpha, "t": t}, "other": {"alpha": 3.0}},
        {"run7": {**parts, "t": t, "inner": {"deeper": {"deepest": 1.0}}}},
        {"fs": 100.0, "run7": {"alpha": alpha, "t": t}},
    ):
        savemat(path, content, do_compression=packed)
        table = read_table(path)
        assert table.alpha.tobytes() == alpha.tobytes()
        assert table["t"].tobytes() == t.tobytes()


def test_a_file_in_the_other_byte_order_is_read(tmp_path: Path) -> None:
    def part(kind: int, content: bytes) -> bytes:
        return struct.pack(">II", kind, len(content)) + content + b"\0" * (-len(content) % 8)

    def array(name: str, values: list[float]) -> bytes:
        head = part(6, struct.pack(">II", 6, 0)) + part(5, struct.pack(">ii", len(values), 1)) + part(1, name.encode())
        return part(14, head + part(9, struct.pack(f">{len(values)}d", *values)))

    arrays = b"".join(array(f"alpha{k}", [0.25 * k, -0.25]) for k in range(1, 5))
    (tmp_path / "big.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\1\0MI" + arrays)
    assert read_table(tmp_path / "big.mat").alpha[0].tolist() == [0.25, 0.5, 0.75, 1.0]
    assert loadmat(tmp_path / "big.mat")["alpha3"].ravel().tolist() == [0.75, -0.25]


def test_what_pandas_writes_again_still_tells_what_made_it(planned: TimedGait, tmp_path: Path) -> None:
    planned.write(tmp_path / "a.parquet")
    pd.read_parquet(tmp_path / "a.parquet").to_parquet(tmp_path / "b.parquet")
    pl.read_parquet(tmp_path / "a.parquet").write_parquet(tmp_path / "c.parquet")
    for name, about in (("b", table_of(planned).about), ("c", {})):
        found = read_table(tmp_path / f"{name}.parquet")
        assert_same(found, table_of(planned))
        assert found.about == about


# The MATLAB function --------------------------------------------------------------------------------------------------


def test_the_matlab_function_tells_what_made_it(planned: TimedGait, tmp_path: Path) -> None:
    path = tmp_path / "gait3.m"
    planned.write(path)
    text = path.read_text(encoding="ascii")
    assert text.startswith("function answer = gait3(file)\n%gait3  Load")
    assert "<<" not in text
    assert reading.provenance_in(path) == table_of(planned).about
    assert read_request(path, {})[0].period == 2.0
    for name in ("3rd", "my-gait", "end", "a b"):
        with pytest.raises(gg.InputError, match="allowed for a MATLAB function are letters"):
            planned.write(tmp_path / f"{name}.m")
    for name in ("plot", "legend", "exist", "isfield", "vertcat", "on", "columns", "text_of", "alpha"):
        with pytest.raises(gg.InputError, match=f"{name} is a function that the script calls, or a variable of it"):
            planned.write(tmp_path / f"{name}.m")
    planned.write(tmp_path / "gait.m")
    (tmp_path / "gait.m").unlink()
    path.write_text("function x\nend\n")
    with pytest.raises(gg.InputError, match=r"gait3\.m': it has no line '% made by:'"):
        read_request(path, {})
    with pytest.raises(gg.InputError, match=r"allowed are the suffixes \.csv"):
        read_table(path)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["gait3.m"]


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="there is no Octave here")
@pytest.mark.parametrize("suffix", [".mat", ".csv", ".json"])
def test_octave_loads_the_file_beside_the_function(suffix: str, planned: TimedGait, tmp_path: Path) -> None:
    planned.write(tmp_path / "gait3.m", tmp_path / f"gait3{suffix}")
    say = "g = gait3; printf('%.17g ', g.alpha, g.alpha_rate, g.t)"
    done = subprocess.run(["octave-cli", "--eval", say], cwd=tmp_path, capture_output=True, text=True, check=True)
    angles, rates, _ = planned.at(planned.t)
    expected = np.concatenate([angles.T.ravel(), rates.T.ravel() + 0.0, planned.t])
    found = [float(text) for text in done.stdout.split()]
    np.testing.assert_allclose(found, expected, rtol=1e-15 if suffix == ".json" else 0)  # its jsondecode rounds


def test_a_script_alone_is_exported(planned: TimedGait, tmp_path: Path, run: Any) -> None:
    planned.write(tmp_path / "gait.csv")
    for count, force in ((13, []), (13, ["--force"]), (5, ["--force", "--samples", "4"])):
        done = run("export", "gait.csv", "z.m", *force, "--json")
        assert done.json["rows"] == count
    assert run("export", "gait.csv", "z.m", "--force").out.startswith("wrote z.m: a function that loads and plots")
    # Pieces that a format does not look at are counted all the same, and once.
    servos = gg.io.servo_map_from_mapping({"limits": [-1.0, 1.0], "clip": True})
    alone, beside = (
        export(tmp_path / "gait.csv", [tmp_path / name for name in names], force=True, servos=servos)
        for names in (["a.csv"], ["z.m", "a.csv"])
    )
    assert beside == alone
    assert alone.clipped["alpha1"] > 0
    assert not export(tmp_path / "gait.csv", [tmp_path / "z.m"], force=True, servos=servos).clipped


# Streaming ------------------------------------------------------------------------------------------------------------


def test_pieces_of_a_gait_are_its_table(planned: TimedGait) -> None:
    paced = gg.least_period(planned.gait, limits=gg.Limits(rate=3.0, acceleration=30.0)).timed
    assert paced is not None
    for timed in (planned, paced, lift(G1.angles, "blue").parametrize(3.0, law="equal-time", samples=50)):
        pieces = list(pieces_of(timed, {"a": 1}, rows=7))
        assert [len(piece) for piece in pieces[:-1]] == [7] * (len(pieces) - 1)
        assert_same(merged(pieces), table_of(timed))
        assert pieces[0].about == {**table_of(timed).about, "a": 1}


class Counted:
    """Pieces of a long table, and how many of them were alive at once."""

    def __init__(self, count: int, rows: int) -> None:
        self.count, self.rows, self.most = count, rows, 0
        self._alive: weakref.WeakSet[Any] = weakref.WeakSet()

    def __call__(self) -> Iterator[Table]:
        for k in range(self.count):
            t = np.arange(k * self.rows, (k + 1) * self.rows) / 1000.0
            first, second = 1.0 + 0.2 * np.cos(t), -0.5 + 0.2 * np.sin(t)
            made: dict[str, Any] = {"t": t, "alpha1": first, "alpha2": second, "alpha3": first, "alpha4": second}
            self._alive.add(_Token(made))
            self.most = max(self.most, len(self._alive))
            yield Table(columns=made)


class _Token(np.ndarray[Any, Any]):
    """An array that lives as long as its piece."""

    def __new__(cls, made: dict[str, Any]) -> _Token:
        made["t"] = made["t"].view(cls)
        token: _Token = made["t"]
        return token

    def __hash__(self) -> int:  # type: ignore[override]
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other


@pytest.mark.parametrize(("suffix", "rows"), [(".csv", 200), (".parquet", 40_000)])
def test_long_tables_are_written_piece_by_piece(suffix: str, rows: int, tmp_path: Path) -> None:
    pieces = Counted(12, rows)
    write_pieces(pieces, [tmp_path / f"long{suffix}"])
    assert pieces.most <= 4
    tracemalloc.start()
    assert sum(map(len, read_pieces(tmp_path / f"long{suffix}"))) == 12 * rows
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 14e6  # of 22e6 in the Parquet file


def test_a_long_table_is_completed_piece_by_piece() -> None:
    pieces = Counted(12, 200)
    again = completed_pieces(pieces)
    whole = merged(completed_pieces(lambda: [merged(Counted(12, 200)())])())
    rows = 0
    for piece in again():
        assert_same(piece, whole.rows(rows, rows + len(piece)))
        rows += len(piece)
    assert rows == len(whole) == 2401
    assert pieces.most <= 4
    assert whole["t"][-1] == pytest.approx(2.4)
    assert set(whole["color"]) == {"red"}


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("stated", ["", "color,types,R", "off"])
def test_cutting_changes_nothing(closed: bool, stated: str) -> None:
    timed = lift(G3.angles, "red").parametrize(samples=40, law="constant-speed")
    made = {name: values for name, values in table_of(timed).columns.items() if "_" not in name}
    for name in ("color", "types", "R"):
        if name not in stated:
            made.pop(name)
    if stated == "off":
        made["alpha4"] = made["alpha4"] + np.where(np.arange(41) == 25, 0.1, 0.0)
    table = Table(columns=made).rows(0, 41 if closed else 40)
    whole = merged(completed_pieces(lambda: [table])())
    assert len(whole) == 41
    assert ("color" in whole) == (stated != "off")
    for size in (1, 2, 7, 20):
        pieces = completed_pieces(partial(cut, table, (*range(0, len(table), size), len(table))))
        assert_same(merged(pieces()), whole)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_long_file_is_judged_and_exported_in_pieces(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    timed = lift(G3.angles, "red").parametrize(samples=300, law="constant-speed")
    path = tmp_path / f"long{suffix}"
    timed.write(path)
    report = gg.validate(path)
    export(path, [tmp_path / "whole.csv", tmp_path / "whole.parquet"])
    monkeypatch.setattr(files, "_BLOCK", 2000)
    for room in (columns, parquet):
        monkeypatch.setattr(room, "ROWS_OF_A_PIECE", 50)
    monkeypatch.setattr(exporting, "_ROWS_KEPT", 60)
    seen: list[float] = []
    count = len(list(read_pieces(path, progress=seen.append)))
    assert count == 1 if suffix == ".json" else count > 5
    assert seen == sorted(seen)
    assert suffix == ".json" or seen[-1] == 1.0
    assert gg.validate(path).as_mapping() == report.as_mapping()
    done: list[float] = []
    told = export(path, [tmp_path / "cut.csv", tmp_path / "cut.parquet"], progress=done.append)
    assert (told.rows, told.columns[0]) == (301, "t")
    assert done == sorted(done)
    assert done[-1] == 1.0
    assert (tmp_path / "cut.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert_same(read_table(tmp_path / "cut.parquet"), read_table(tmp_path / "whole.parquet"))


def test_a_new_clock_is_given_on_export(planned: TimedGait, tmp_path: Path) -> None:
    planned.write(tmp_path / "a.npz")
    told = export(tmp_path / "a.npz", [tmp_path / "b.mat", tmp_path / "b.m"], samples=30, period=4.0)
    assert told.rows == 31
    assert read_table(tmp_path / "b.mat")["t"][-1] == 4.0
    with pytest.raises(gg.errors.OutputExists):
        export(tmp_path / "a.npz", [tmp_path / "b.mat"])
    with pytest.raises(gg.errors.FileProblem, match="No such file"):
        export(tmp_path / "none.npz", [tmp_path / "c.mat"])


# Corrupt and hostile files --------------------------------------------------------------------------------------------


def refusal(path: Path) -> str:
    """Return the one line that a file is refused with, for little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(gg.InputError) as caught:
            read_table(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    message = str(caught.value)
    assert message.startswith(f"gait file {str(path)!r}: ")
    assert "\n" not in message
    assert peak < 40e6
    return message


FOUR: dict[str, Any] = {f"alpha{k}": np.zeros(3) for k in range(1, 5)}


class _Trap:
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
        (npy(NPY % ("<f8", "(3000000000,)"), b"\0" * 24), "alpha3: it claims 3000000000 values, and holds 24 bytes"),
        (npy(NPY % ("<f8", "(3,)"), b"\0" * 25), "alpha3: it claims 3 values, and holds 25 bytes"),
        (
            npy(NPY % ("<f8", "(3, 1)"), b"\0" * 24),
            r"alpha3: it is an array of shape \(3, 1\); allowed is one dimension",
        ),
        (npy(NPY % ("<f8", "()"), b"\0" * 8), r"alpha3: it is an array of shape \(\)"),
        (npy(NPY % ("<c16", "(3,)"), b"\0" * 48), "alpha3: its values are of a kind that is not read"),
        (npy(NPY % ("|b1", "(3,)"), b"\0" * 3), "alpha3: its values are of a kind"),
        (npy(NPY % ("<M8", "(3,)"), b"\0" * 24), "alpha3: its values are of a kind"),
        (npy(NPY % ("|O", "(3,)"), pickle.dumps([_Trap()] * 3)), "alpha3: its values are of a kind"),
        (
            npy("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (3,), }", b"\0" * 24),
            "alpha3: its values are",
        ),
        (npy("{'descr': __import__('os').abort(), 'fortran_order': False, 'shape': (3,), }"), "alpha3: its values are"),
        (npy("(" * 9000), "alpha3: its values are of a kind"),
        (npy(NPY % ("<f8", "(2,)"), b"\0" * 16), "columns have 2 to 3 rows; allowed are equally many"),
        (npy(NPY % ("<U1", "(3,)"), b"\0\0\0\x80" * 3), "alpha3: its texts have characters that do not exist"),
        (npy(NPY % ("<U3", "(3,)"), b"\0" * 36), "row 1: alpha3 is ''; allowed is a finite number"),
        (npy(NPY % ("<f8", "(3,)"), b"\0" * 16 + struct.pack("<d", np.nan)), "row 3: alpha3 is nan"),
        (b"", "alpha3: its values are of a kind that is not read"),
        (b"\x93NUMPY\2\0\xff\xff\xff\xff", "alpha3: its values are of a kind that is not read"),
    ],
)
def test_arrays_that_are_no_columns_are_refused(member: bytes, message: str, tmp_path: Path) -> None:
    path = npz_of(tmp_path / "bad.npz", alpha3=member)
    with pytest.raises(gg.InputError, match=message):
        read_table(path)
    refusal(path)
    fine = npz_of(tmp_path / "fine.npz", something=member)
    assert len(read_table(fine)) == 3  # what is no column of ours is passed over


def test_archives_that_are_broken_or_bombs_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = npz_of(tmp_path / "a.npz")
    whole = path.read_bytes()
    for content, message in (
        (b"", "File is not a zip file"),
        (b"PK\3\4 no zip", "File is not a zip file"),
        (whole[:-30], "File is not a zip file"),
        (whole[: len(whole) // 2] + whole[len(whole) // 2 + 9 :], "broken one"),
    ):
        path.write_bytes(content)
        assert message in refusal(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("alpha1.npy", b"")
    assert "is compressed by method 14" in refusal(path)
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(1001):
            archive.writestr(f"{k}.npy", b"")
    assert "it has 1001 members; allowed are 1000 at most" in refusal(path)
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(17):
            archive.writestr(zipfile.ZipInfo(f"{k}" + "x" * 65_000), b"")
    assert "its directory is longer than 1048576 bytes" in refusal(path)
    # A directory that says that an archive holds 4 GB, and an array that says so too.
    big = 500_000_000
    npz_of(path, alpha1=npy(NPY % ("<f8", f"({big},)"), b"\0" * 24))
    content = path.read_bytes()
    size = len(npy(NPY % ("<f8", f"({big},)"), b"\0" * 24))
    place = content.rindex(b"alpha1.npy") - 46 + 24
    assert content[place : place + 4] == struct.pack("<I", size)
    path.write_bytes(content[:place] + struct.pack("<I", size - 24 + 8 * big) + content[place + 4 :])
    monkeypatch.setattr(columns, "MOST_BYTES", 100)
    for name in list(FOUR):
        monkeypatch.setitem(FOUR, name, np.zeros(big, dtype=np.int8)[:0])
    assert "rows; allowed are equally many" in refusal(path)
    savez_compressed(path, **{f"alpha{k}": np.zeros(1000) for k in range(1, 5)})
    assert "its columns take 32000 bytes, and it has" in refusal(path)
    savez(path, **{f"alpha{k}": np.zeros(1000) for k in range(1, 5)})
    assert len(read_table(path)) == 1000


def mat_of(path: Path, content: dict[str, Any], *, packed: bool = False) -> Path:
    savemat(path, content, do_compression=packed, long_field_names=True)
    return path


def test_matlab_files_with_something_else_are_refused(tmp_path: Path) -> None:
    path, cells = tmp_path / "a.mat", np.array([1, "a"], dtype=object)
    three = {name: values for name, values in FOUR.items() if name != "alpha1"}
    for content, message in (
        ({"fs": 100.0, "signal": np.zeros(9)}, "column 'alpha1' is missing.*there are 'fs', 'signal'"),
        ({**three, "alphal": np.zeros(3)}, "column 'alpha1' is missing.*did you mean 'alphal'"),
        ({**three, "alpha1": cells}, "alpha1: it is a cell array; allowed is a column of real numbers"),
        ({**three, "alpha1": {"a": 1.0}}, "column 'alpha1' is missing"),
        ({**three, "alpha1": np.zeros(3) * 1j}, "alpha1: it is complex or logical, 1 by 3"),
        ({**three, "alpha1": np.zeros(3, dtype=bool)}, "alpha1: it is complex or logical"),
        ({**three, "alpha1": np.zeros((3, 2))}, "alpha1: it is 3 by 2; allowed is a column of real numbers"),
        ({**three, "alpha1": np.zeros((3, 2, 2))}, "alpha1: it is 3 by 2 by 2"),
        ({**three, "alpha1": np.zeros(4)}, "columns have 3 to 4 rows"),
        ({**three, "alpha1": "x" * 70}, "alpha1: it is a text of 70 characters"),
        ({**three, "alpha1": np.array(["0x", "1", "2"])}, "row 1: alpha1 is '0x'"),
        ({"alpha": np.zeros((4, 9)), "t": np.zeros(9)}, "alpha1: alpha is 4 by 9; allowed is a matrix of 4 columns"),
        ({"alpha": cells}, "alpha1: alpha is a cell array; allowed is a matrix of 4 columns"),
        ({"gait": [{"alpha": 1.0}, {"alpha": 2.0}]}, "column 'alpha1' is missing|array of structs"),
        ({**FOUR, "t": np.array([0, np.inf, 1])}, "row 2: t is inf; allowed is a finite number"),
        (
            {"a": {"alpha": 1.0}, "b": FOUR, "fs": 9.0},
            "it has 2 structs, 'a', 'b'; allowed is one, or one called 'gait'",
        ),
    ):
        for packed in (False, True):
            mat_of(path, content, packed=packed)
            with pytest.raises(gg.InputError, match=message):
                read_table(path)
            refusal(path)


@pytest.mark.parametrize("inside", [False, True])
def test_a_long_compressed_matlab_file_is_inflated_on_the_way(inside: bool, tmp_path: Path) -> None:
    rows, path = 200_000, tmp_path / "long.mat"
    alpha = np.round(np.sin(np.arange(4 * rows) * 1e-4), 3).reshape(4, rows).T
    content = {"alpha": alpha, "t": np.arange(rows) / 100.0, "R": np.zeros(rows)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gaitgraph.io.mat._SHORT", 1 << 18)
        mat_of(path, {"gait": content} if inside else content, packed=True)
        tracemalloc.start()
        try:
            start = 0
            for piece in read_pieces(path):
                assert (piece.alpha == alpha[start : start + len(piece)]).all()
                assert (piece["t"] == content["t"][start : start + len(piece)]).all()
                start += len(piece)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert start == rows
        assert peak < 3 * alpha.nbytes  # each of its four columns would hold it once
        if not inside:  # the last four bytes of a compressed variable are its checksum
            whole = path.read_bytes()
            place = 128 + 8 + struct.unpack_from("<I", whole, 132)[0] - 1
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
            assert "incorrect data check" in refusal(path)


def test_matlab_files_that_are_broken_or_bombs_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = mat_of(tmp_path / "a.mat", FOUR)
    whole = path.read_bytes()
    many = bytearray(whole)
    place = whole.index(b"alpha1")
    many[place + 12 : place + 16] = struct.pack("<I", 0xFFFFFFF0)  # bytes of the values
    shape = bytearray(whole)
    shape[place - 16 : place - 12] = struct.pack("<i", 2**31 - 1)
    hdf = b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + b"\0" * 384 + b"\x89HDF\r\n\x1a\n"
    for content, message in (
        (b"", "it is no MAT-file of level 5"),
        (b"\0" * 200, "it is no MAT-file of level 5"),
        (hdf, r"it is a MAT-file of version 7\.3 \(HDF5\); allowed is a MAT-file of level 5, as save -v7"),
        (whole[:-20], "a part claims more bytes than there are"),
        (whole[:140], "a part claims more bytes"),
        (bytes(many), "it is broken"),
        (bytes(shape), "alpha1: it is 2147483647 by 3"),
        (whole[:128] + struct.pack("<II", 15, 4) + b"\0\0\0\0", "it is broken"),
        (whole[:128] + struct.pack("<II", 9, 4) + b"\0\0\0\0", "a part that is no array where one belongs"),
        (whole[:128] + (struct.pack("<II", 14, 0)) * 1001, "it has more than 1000 variables"),
    ):
        path.write_bytes(content)
        with pytest.raises(gg.InputError, match=message):
            read_table(path)
        refusal(path)
    # Forty million zeros in forty thousand bytes, named alpha1: they are counted before they are inflated.
    packed = b"".join(_packed_zeros(name, 5_000_000) for name in FOUR)
    path.write_bytes(whole[:128] + packed)
    for room in (columns, sys.modules["gaitgraph.io.mat"]):
        monkeypatch.setattr(room, "MOST_BYTES", 10_000_000)
    assert f"its columns take 160000000 bytes, and it has {128 + len(packed)}" in refusal(path)
    path.write_bytes(whole[:128] + _packed_zeros("gait", 5_000_000, kind=2))
    assert "'gait' takes 4" in refusal(path)
    # Structs within structs, as deep as there is room: only the first level is looked at.
    inner = b""
    for _ in range(20_000):
        head = _part(6, struct.pack("<II", 2, 0)) + _part(5, struct.pack("<ii", 1, 1)) + _part(1, b"gait")
        inner = _part(14, head + _part(5, struct.pack("<i", 2)) + _part(1, b"a\0") + inner)
    path.write_bytes(whole[:128] + inner)
    assert "column 'alpha1' is missing" in refusal(path)


def _part(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def _packed_zeros(name: str, count: int, kind: int = 6) -> bytes:
    head = _part(6, struct.pack("<II", kind, 0)) + _part(5, struct.pack("<ii", count, 1)) + _part(1, name.encode())
    body = struct.pack("<II", 14, len(head) + 8 + 8 * count) + head + struct.pack("<II", 9, 8 * count)
    packed = zlib.compress(body + b"\0" * (8 * count), 1)
    return struct.pack("<II", 15, len(packed)) + packed


def test_parquet_files_with_something_else_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.parquet"
    for changed, message in (
        ({"alpha1": None}, "column 'alpha1' is missing"),
        ({"alpha1": pa.array([True] * 3)}, "column 'alpha1' holds bool; allowed are numbers"),
        ({"alpha1": pa.array(["0", "1", "2"])}, "column 'alpha1' holds string; allowed are numbers"),
        ({"alpha1": pa.array([[0.0]] * 3)}, "column 'alpha1' holds list<"),
        ({"t": pa.array([1, 2, 3], pa.timestamp("s"))}, r"column 't' holds timestamp\[.*\]; allowed are numbers"),
        ({"color": pa.array([1, 2, 3])}, "column 'color' holds int64; allowed are texts"),
        ({"color": pa.array(["red", None, "red"])}, "row 2: color is missing"),
        ({"alpha2": pa.array([0.0, None, 0.0])}, "row 2: alpha2 is missing; allowed is a finite number"),
        ({"alpha2": pa.array([0.0, 2.0, 0.0])}, "row 2: alpha2 is 2.0 rad"),
    ):
        content = {name: values for name, values in {**FOUR, **changed}.items() if values is not None}
        pq.write_table(pa.table(content), path)
        with pytest.raises(gg.InputError, match=message):
            read_table(path)
        refusal(path)
    pq.write_table(pa.table({**FOUR, "note": ["a", "b", "c"], "when": [[1], [2], [3]]}), path)
    assert len(read_table(path)) == 3
    pq.write_table(pa.table({name: values[:0] for name, values in FOUR.items()}), path)
    assert "it has no rows" in refusal(path)
    pq.write_table(pa.table({name: np.zeros(100_000) for name in FOUR}), path)
    assert len(read_table(path)) == 100_000
    monkeypatch.setattr(parquet, "_MOST_UNPACKED", 1 << 20)
    assert "its 100000 rows of 4 columns unpack to 3 MiB, and it has" in refusal(path)


def test_parquet_files_that_are_broken_are_refused(valid_files: dict[str, list[bytes]], tmp_path: Path) -> None:
    path, whole = tmp_path / "a.parquet", valid_files[".parquet"][1]
    for content in (
        b"",
        b"PAR1",
        b"PAR1PAR1",
        whole[:-1],
        whole[: len(whole) // 2],
        whole[:-8] + b"\xff\xff\xff\x7fPAR1",
    ):
        path.write_bytes(content)
        assert "it is no Parquet file, or a broken one" in refusal(path)
    path.write_bytes(whole[:-4] + b"PARE")
    assert "encrypted" in refusal(path)
    values = whole.index(np.float64(gg.angles.angle_from_text("3pi/8")).tobytes())
    path.write_bytes(whole[:values] + bytes([whole[values] ^ 1]) + whole[values + 1 :])
    assert "verify page integrity" in refusal(path)


def test_a_file_is_named_once_and_said_to_be_no_text(tmp_path: Path) -> None:
    for name in ("a.m", "a.csv", "a.json"):
        (tmp_path / name).write_bytes(b"\xff\xfe\0")
        with pytest.raises(gg.InputError) as problem:
            reading.provenance_in(tmp_path / name)
        told = str(problem.value)
        assert told.startswith(f"gait file '{tmp_path / name}': not UTF-8 text; allowed is ")
        assert told.endswith(", in UTF-8")
        assert told.count("gait file") == 1
        assert ".csv, " not in told


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".parquet", ".m"])
def test_files_that_cannot_be_read(suffix: str, tmp_path: Path) -> None:
    find = reading.provenance_in if suffix == ".m" else read_table
    with pytest.raises(gg.errors.FileProblem, match="No such file"):
        find(tmp_path / f"none{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(gg.errors.FileProblem, match="Is a directory"):
        find(tmp_path / f"folder{suffix}")


@pytest.mark.parametrize("suffix", BINARY)
@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_changed_bytes_are_read_or_refused_in_one_line(
    suffix: str, data: st.DataObject, valid_files: dict[str, list[bytes]], tmp_path: Path
) -> None:
    content = bytearray(data.draw(st.sampled_from(valid_files[suffix])))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, max(len(content) - 1, 0)))
        change = data.draw(st.sampled_from(["set", "cut", "put", "end"]))
        if change == "set":
            content[place : place + 1] = data.draw(st.binary(min_size=1, max_size=8))
        elif change == "cut":
            del content[place : place + data.draw(st.integers(1, 40))]
        elif change == "put":
            content[place:place] = data.draw(st.binary(min_size=1, max_size=8))
        else:
            del content[place:]
    path = tmp_path / f"fuzz{suffix}"
    path.write_bytes(content)
    try:
        table = read_table(path)
        assert np.isfinite(table["alpha1"]).all()
    except gg.GaitgraphError as error:
        assert "\n" not in str(error)
        assert str(path) in str(error)


def test_json_that_is_nested_or_wide_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.json"
    path.write_text("[" * 2_000_000)
    assert "nested too deeply" in refusal(path)
    path.write_text('{"about": ' + '{"a": ' * 300 + "1" + "}" * 300 + ', "alpha1": [0], "alpha2": [0], "color": "red"}')
    assert "about: it is nested too deeply" in refusal(path)
    path.write_text('{"alpha1": [' + "9" * 5000 + '], "alpha2": [0], "color": "red"}')
    assert "it is not JSON" in refusal(path)
    path.write_text('{"alpha1": [1' + "0" * 400 + '], "alpha2": [0], "color": "red"}')
    assert "row 1: alpha1 is 10000" in refusal(path)
    monkeypatch.setattr(jsons, "_MOST_BRACKETS", 1000)
    path.write_text("[" + "[]," * 1000 + "[]]")
    assert "it has more than 1000 lists and objects" in refusal(path)


def test_what_made_a_file_is_checked(tmp_path: Path) -> None:
    deep: Any = 1
    for _ in range(150):
        deep = [deep]
    for told, message in (
        ('{"format": "gaitgraph gait table", ', "is not JSON as gaitgraph writes it"),
        ('{"format": "gaitgraph gait table"}', "about must be an object, got None"),
        (json.dumps({"format": "gaitgraph gait table", "about": {"a": deep}}), "nested too deeply"),
    ):
        savez(tmp_path / "a.npz", **FOUR, provenance=np.array(told))
        savemat(tmp_path / "a.mat", {**FOUR, "provenance": told})
        pq.write_table(pa.table(FOUR).replace_schema_metadata({"gaitgraph": told}), tmp_path / "a.parquet")
        for suffix in (".npz", ".mat"):
            assert message in refusal(tmp_path / f"a{suffix}")
        if "is not JSON as gaitgraph writes it" not in message:
            assert message in refusal(tmp_path / "a.parquet")
    savez(tmp_path / "a.npz", **FOUR, provenance=np.array("measured on Monday"))
    assert read_table(tmp_path / "a.npz").about == {}


# Frames ---------------------------------------------------------------------------------------------------------------


def test_frames_are_given_and_taken(planned: TimedGait) -> None:
    frame, other, expected = planned.to_pandas(), planned.to_polars(), table_of(planned)
    assert_same(table_from_frame(frame), expected)
    assert table_from_frame(frame).about == expected.about
    assert frame.attrs["gaitgraph"]["about"]["request"]
    assert_same(table_from_frame(other), expected)
    assert_same(table_from_frame(other.to_arrow()), expected)
    assert_same(table_from_frame(frame.set_index("t")), Table(columns={**expected.columns}))
    whole = gg.validate(planned)
    for given_frame in (frame, other, expected.to_pandas()):
        assert gg.validate(given_frame).flyable == whole.flyable
        assert gg.gait_of(given_frame).color == "red"
    lifted = {"alpha1": ["3pi/8", 1.0], "alpha2": ["-3pi/8", -0.5], "color": "red"}
    assert gg.validate(lifted).flyable
    assert gg.retarget(frame).gait.color == "red"
    assert gg.robustness_of(other).gait.tilt == gg.robustness_of(expected).gait.tilt


def test_frames_that_are_no_tables_are_refused(planned: TimedGait) -> None:
    frame = planned.to_pandas()
    for wrong, message in (
        (frame.drop(columns="alpha4"), "column 'alpha4' is missing"),
        (frame.rename(columns={"alpha4": "alpha_4"}), "did you mean 'alpha_4'"),
        (pd.concat([frame, frame[["alpha1"]]], axis=1), "column 'alpha1' appears twice"),
        (frame.assign(alpha1=True), "alpha1: its values are of the type bool"),
        (frame.assign(alpha1="x"), "row 1: alpha1 is 'x'"),
        (frame.assign(alpha1=None), "row 1: alpha1 is"),
        (frame.assign(alpha1=np.nan), "row 1: alpha1 is nan"),
        (frame.assign(color="green"), "row 1: color is 'green'"),
        (frame.assign(t=pd.date_range("2020", periods=13)), "t: its values are of the type datetime64"),
        (frame.iloc[:0], "it has no rows"),
        (planned.to_polars().with_columns(pl.lit(None).alias("alpha2")), "row 1: alpha2 is"),
        (
            planned.to_polars().lazy(),
            r"frame: a LazyFrame; allowed is a frame whose rows are there: collect\(\) it first",
        ),
        ({}, "column 'alpha1' is missing"),
        ({**FOUR, "alpha1": np.zeros((3, 3))}, "alpha1: it has 2 dimensions"),
        ({**FOUR, "alpha1": 3}, "alpha1: it has 0 dimensions"),
    ):
        with pytest.raises(gg.InputError, match=message) as caught:
            gg.validate(wrong)
        assert "\n" not in str(caught.value)
    with pytest.raises(gg.InputError, match="allowed is a gait, a timed gait, a table, a frame or a file's path"):
        gg.validate(5)  # type: ignore[arg-type]
    with pytest.raises(gg.InputError, match="frame: 5; allowed is a frame of pandas or polars"):
        table_from_frame(5)
    with pytest.raises(gg.InputError, match="frame: a LazyFrame"):
        table_from_frame(planned.to_polars().lazy())
    frame.attrs["gaitgraph"] = {"format": "gaitgraph gait table", "about": {"a": object()}}
    with pytest.raises(gg.InputError, match="attrs: .*; allowed is what gaitgraph told there"):
        table_from_frame(frame)


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_missing_library_is_told(library: str, planned: TimedGait, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(gg.InputError, match=f"{library}: not installed, .* pip install {library}$"):
        getattr(planned, f"to_{library}")()


def test_a_missing_extra_is_told(planned: TimedGait, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planned.write(tmp_path / "a.parquet")
    monkeypatch.setattr("gaitgraph.io.formats.find_spec", lambda _: None)
    for ask in (lambda: read_table(tmp_path / "a.parquet"), lambda: planned.write(tmp_path / "b.parquet")):
        with pytest.raises(gg.InputError, match=r"pip install 'gaitgraph\[table\]'") as caught:
            ask()
        assert str(caught.value).startswith("pyarrow: not installed")
    assert "gaitgraph[table]" in (FORMATS[".parquet"].why_not() or "")


def test_nothing_that_is_not_needed_is_loaded(planned: TimedGait, tmp_path: Path) -> None:
    planned.write(tmp_path / "a.npz")
    code = (
        "import sys, gaitgraph as gg\n"
        "gg.validate('a.npz')\n"
        "from gaitgraph.timing.exporting import export\n"
        "export('a.npz', ['b.csv', 'b.json', 'b.m'])\n"
        "print(*{'pandas', 'polars', 'pyarrow', 'scipy.io', 'rosbags'} & {*sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_the_page_lists_every_format() -> None:
    page = (Path(__file__).parent.parent / "docs" / "formats.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line.startswith("| `.")
    ]
    found = {row[0].strip("`"): row[1:4] for row in rows if len(row) == 5}
    assert list(found) == list(FORMATS)
    for suffix, one in FORMATS.items():
        extra = f"`{one.extra}`" if one.extra else "–"
        assert found[suffix] == [one.name, extra, "yes" if one.reads else "`plan` only"]
