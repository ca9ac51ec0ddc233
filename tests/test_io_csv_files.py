"""Reading CSV files in blocks: rows and lines are counted through, quotation marks and separators are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import gaitgraph as gg
from gaitgraph import files
from gaitgraph.gait.gait import lift
from gaitgraph.io import text_files as csvs
from gaitgraph.io.formats import read_pieces, read_table
from tests.published import GAITS

if TYPE_CHECKING:
    from pathlib import Path

G3 = GAITS[2]


class TestFiles:
    """Files are read in pieces; what is said does not depend on where they end."""

    @pytest.fixture(params=[60, 200, 1 << 22], autouse=True)
    def blocks(self, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(files, "_BLOCK", request.param)

    @pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
    def test_the_same_table_comes_back(self, tmp_path: Path, end: str) -> None:
        path = tmp_path / "gait.csv"
        lift(G3.angles, "red").parametrize(samples=30).write(path)
        whole = read_table(path)
        changed = tmp_path / "changed.csv"
        changed.write_bytes(b"\xef\xbb\xbf" + path.read_text().replace("\n", end).encode())
        again = read_table(changed)
        for name, values in whole.columns.items():
            assert np.array_equal(values, again[name]), name
        assert sum(len(piece) for piece in read_pieces(changed)) == 31

    def test_rows_and_lines_are_counted_through(self, tmp_path: Path) -> None:
        path = tmp_path / "gait.csv"
        lines = ["", "alpha1,alpha2,alpha3,alpha4", ""] + ["0.4,-0.4,0.4,-0.4"] * 40
        for text, message in (
            ("0.4,-0.4,x,-0.4", r"row 21: alpha3 is 'x'; allowed is a finite number"),
            ("0.4,-0.4,0.4", r"line 24 has 3 fields; allowed are 4, as in the header"),
            ("0.4,1.6,0.4,0.1", r"row 21: alpha2 is 1.6 rad; allowed is −π/2 to π/2"),
            ('0.4,"0.4,0.4,0.1', r"line .*allowed is comma-separated text"),
        ):
            path.write_text("\n".join([*lines[:23], text, *lines[24:]]))
            with pytest.raises(gg.InputError, match=message):
                gg.validate(path)

    def test_times_that_do_not_increase_across_pieces(self, tmp_path: Path) -> None:
        path = tmp_path / "gait.csv"
        times = [*range(20), 19, *range(21, 30)]
        path.write_text("t,alpha1,alpha2,alpha3,alpha4\n" + "".join(f"{t},0.4,-0.4,0.4,-0.4\n" for t in times))
        with pytest.raises(gg.InputError, match=r"row 21: t = 19.0 does not increase"):
            gg.validate(path)


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(
        st.lists(
            st.one_of(
                st.floats(-2, 2).map(repr),
                st.sampled_from(["", " 0.1 ", '"0.1"', "1_0", "nan", "1e-400", "-inf", "0x1p-3", "１", "#", "1e5"]),
            ),
            min_size=3,
            max_size=5,
        ),
        max_size=4,
    )
)
def test_the_fast_and_the_careful_reader_agree(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: list[list[str]]
) -> None:
    path = tmp_path / "gait.csv"
    path.write_text("alpha1,alpha2,alpha3,alpha4\n" + "\n".join(map(",".join, rows)) + "\n")

    def read() -> Any:
        try:
            return read_table(path).alpha.tolist()
        except gg.InputError as error:
            return str(error)

    fast = read()
    with monkeypatch.context() as careful:
        careful.setattr(csvs, "_numeric_columns", lambda *_: None)
        assert read() == fast


@pytest.mark.parametrize("row", [0, 5, 1500, 2999])
def test_an_open_quotation_mark_swallows_nothing(tmp_path: Path, row: int) -> None:
    path = tmp_path / "gait.csv"
    lines = ["note,alpha1,alpha2,alpha3,alpha4"] + ["x,0.4,-0.4,0.4,-0.4"] * 3000
    lines[row + 1] = '"x' + lines[row + 1][1:]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(gg.InputError, match="allowed is comma-separated text"):
        gg.validate(path)
    lines[row + 1] = '"x\n' + lines[row + 1][2:].replace(",", '",', 1)
    path.write_text("\n".join(lines) + "\n")
    assert gg.validate(path).rows == 3000  # a line break in quotation marks is no row


def test_the_line_that_is_no_csv_is_named(tmp_path: Path) -> None:
    path = tmp_path / "gait.csv"
    path.write_text('note,alpha1,alpha2,alpha3,alpha4\nx,0,0,0,0\n"a"b,0,0,0,0\nx,0,0,0,0\n')
    with pytest.raises(gg.InputError, match="line 3: "):
        gg.validate(path)
