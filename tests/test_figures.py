"""The figures of the paper: what is on them, how they are named and written, and the command that does it."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.testing.compare import compare_images
from matplotlib.text import Text

import gaitgraph as gg
from gaitgraph.gait.gait import printed_gait
from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value
from gaitgraph.plots.axes import FORMATS, paper_style, picture_bytes
from gaitgraph.plots.figures import FIGURES, draw, write_figures
from gaitgraph.plots.gaits import draw_sheet
from gaitgraph.timing.timed_gait import table_of, timed_gait_of
from tests.published import GAITS
from tests.samples import BEETLE, PUBLISHED, gait_of_paper

ROOT = Path(__file__).parent.parent

GAIT4 = gg.lift(GAITS[3].angles, "red")


@cache
def drawn(name: str, vehicle: gg.Vehicle = gg.PAPER) -> Any:
    """Return a figure that tests look at and leave as it is."""
    return draw(name, vehicle=vehicle)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def legend_of(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


def verdicts(figure: Any) -> list[list[str]]:
    return [ax.get_title().split("\n") for ax in figure.axes]


# The table, and names


def test_every_figure_of_the_paper_is_there_and_two_more() -> None:
    assert tuple(FIGURES) == (
        *(str(number) for number in range(1, 23)),
        "18b",
        "19b",
        "22b",
        "regions",
        "set",
    )
    assert [FIGURES[name].stem for name in ("1", "16", "18b", "regions")] == [
        *("figure_01", "figure_16", "figure_18b", "figure_regions")
    ]
    assert all(figure.title for figure in FIGURES.values())


def test_names_of_figures() -> None:
    for name in ("0", "23", "9-11", "", True, "gait"):
        with pytest.raises(gg.InputError, match=r"^only must be one of 1, 2, .*, got "):
            write_figures("out", only=["3", name])
    with pytest.raises(
        gg.InputError, match=r"^name must be one of 1, 2, .*, got '3,4'"
    ):
        draw("3,4")


def test_the_waypoints_and_vertices_are_the_printed_ones() -> None:
    for known in GAITS:
        gait = gait_of_paper(known.number)
        np.testing.assert_allclose(gait.alpha[:, :2], known.angles)
        assert gait.color == known.color
        printed = printed_gait(known.number, PUBLISHED).alpha
        np.testing.assert_allclose(
            printed, np.column_stack([known.angles, known.printed])
        )


# Every figure


@pytest.mark.parametrize(
    ("name", "vehicle"),
    [
        *(
            (name, gg.PAPER)
            for name in ("1", "2", "7", "11", "12", "15", "16", "17", "20", "regions")
        ),
        *(
            pytest.param(name, gg.PAPER, marks=pytest.mark.slow)
            for name in ("10", "14", "18", "19", "21", "22")
        ),
        *(
            pytest.param(name, BEETLE, marks=pytest.mark.slow)
            for name in ("1", "9", "12", "16", "17", "18", "regions")
        ),
    ],
)
def test_figures_fit_a_page_and_no_text_lies_on_another(
    name: str, vehicle: gg.Vehicle
) -> None:
    before = dict(mpl.rcParams)
    figure = drawn(name, vehicle=vehicle)
    assert round(figure.get_figwidth() * 25.4, 6) in (85.0, 170.0)
    assert figure.get_figheight() * 25.4 < 230
    with paper_style():
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        texts: list[Any] = [text for text in figure.findobj(Text) if text.get_visible()]
        boxes = {
            text: text.get_window_extent(canvas.get_renderer())
            for text in texts
            if text.get_text().strip()
        }
    page = (
        figure.bbox
    )  # ticks outside the range of their axis have labels too, which are not drawn
    boxes = {text: box for text, box in boxes.items() if box.overlaps(page)}
    for (one, p), (other, q) in combinations(boxes.items(), 2):
        common = min(p.x1, q.x1) - max(p.x0, q.x0), min(p.y1, q.y1) - max(p.y0, q.y0)
        assert min(common) <= 1, (one.get_text(), other.get_text())
    for text, box in boxes.items():
        assert page.x0 <= box.x0 <= box.x1 <= page.x1, text
        assert page.y0 <= box.y0 <= box.y1 <= page.y1, text
    assert pyplot.get_fignums() == []
    assert dict(mpl.rcParams) == before


def test_figure_17_holds_three_loops() -> None:
    (ax,) = draw(17).axes
    for known in GAITS[:3]:
        (line,) = (
            one
            for one in ax.lines
            if one.get_label() == f"Gait {known.number}: {known.color}"
        )
        np.testing.assert_allclose(np.asarray(line.get_xydata())[:4], known.angles)
    mirrored = draw(17, vehicle=BEETLE).axes[0]
    np.testing.assert_allclose(
        np.asarray(mirrored.lines[0].get_xydata())[:4], -np.array(GAITS[0].angles)
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "margins"),
    [
        pytest.param(
            "18",
            [
                "90.0°, biased 0.0°",
                "none, biased 0.0°",
                "43.7°, biased 0.0°",
                "0.0°, biased 0.0°",
            ],
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(
                "19",
                [
                    "90.0°, biased 41.8°",
                    "none, biased 41.7°",
                    "41.5°, biased 41.7°",
                    "41.5°, biased 41.7°",
                ],
            ),
            marks=pytest.mark.slow,
        ),
        (
            "22",
            [
                "90.0°, biased 45.0°",
                "none, biased 45.0°",
                "41.5°, biased 45.0°",
                "41.5°, biased 45.0°",
            ],
        ),
    ],
)
def test_blue_gaits_have_one_panel_and_three_more_readings(
    name: str, margins: list[str]
) -> None:
    found = [*verdicts(drawn(name)), *verdicts(drawn(f"{name}b"))]
    readings = [
        "exact coefficients",
        "four-digit angles, exact formula",
        "printed vertices, exact formula",
    ]
    lead = f"Gait {1 if name == '18' else 2}: printed coefficients"
    assert found == [
        [title, f"tilt margin {text}"]
        for title, text in zip([lead, *readings], margins, strict=True)
    ]


def test_red_gaits_and_those_of_another_vehicle_have_one_reading() -> None:
    for name, number, margin in (("20", 3, "74.5"), ("21", 4, "61.7")):
        lines = [
            f"Gait {number}: printed coefficients",
            f"tilt margin 90.0°, biased {margin}°",
        ]
        assert verdicts(drawn(name)) == [lines]
    assert legend_of(drawn("20"))[1].endswith("85.15 % acceptable")
    for name in ("18", "20", "22b"):
        ((title, margin),) = verdicts(draw(name, vehicle=BEETLE))
        assert title.endswith("exact coefficients")
        assert margin.startswith("tilt margin ")


def test_a_gait_has_a_set_of_its_own(run: Any, folder: Path) -> None:
    result = run("figures", "gait4", "--format", "png")
    assert (result.code, result.out.strip()) == (
        0,
        f"wrote {Path('figures', 'figure_set.png')}: The set of a gait",
    )
    axes: Any = draw("set", gait="gait4").axes
    loop, _, thrusts, attitudes, value = axes
    assert loop.get_title() == "Gait 4: loop on the map"
    shares = np.array([line.get_ydata() for line in thrusts.get_lines()[:4]])
    assert shares.max() == pytest.approx(0.6533, rel=1e-3)
    assert "no singular attitude" in attitudes.get_legend().get_texts()[0].get_text()
    assert np.min(value.get_lines()[0].get_ydata()) == pytest.approx(0.3208, rel=1e-3)
    timed = GAIT4.parametrize(2.0, law="equal-time", samples=20)
    time: Any = draw("set", gait=table_of(timed)).axes[1]
    assert time.get_xlim() == (0.0, 2.0)
    np.testing.assert_allclose(
        time.lines[1].get_ydata(), timed.at(time.lines[1].get_xdata()).alpha[:, 1]
    )
    blue: Any = draw("set", gait="gait1").axes
    assert [text.get_text() for text in blue[2].texts] == ["singular in level flight"]
    assert (
        "singular at every attitude" in blue[3].get_legend().get_texts()[0].get_text()
    )
    assert (
        draw("set", gait=table_of(GAIT4.biased(0.8).parametrize()))
        .axes[0]
        .get_title()
        .startswith("Gait 4 biased by 0.8:")
    )


# The same bytes


@pytest.mark.slow
def test_the_same_bytes_whatever_was_drawn_before_and_in_every_process(
    folder: Path,
) -> None:
    """In any order of formats, in any style, and in a process whose hashes are other ones."""
    for name in ("15", "9", "20"):
        kinds = FORMATS if name == "15" else FORMATS[:2]
        found: list[dict[str, bytes]] = []
        for order, width in ((kinds, 1.0), (kinds[::-1], 7.0)):
            with mpl.rc_context({"lines.linewidth": width, "axes.grid": width > 1}):
                figure = draw(name)
                found.append({kind: picture_bytes(figure, kind) for kind in order})
        assert found[0] == found[1]
        assert not re.search(
            rb"CreationDate|Matplotlib v|<dc:date>", b"".join(found[0].values())
        )
    seed = "1" if os.environ.get("PYTHONHASHSEED") != "1" else "2"
    command = [
        sys.executable,
        "-m",
        "gaitgraph",
        "figures",
        "--output",
        "1",
        "--only",
        "2",
        "--only",
        "9",
    ]
    own = {
        name: value for name, value in os.environ.items() if not name.startswith("COV")
    }
    # The backend of a notebook, which may be missing here, does not matter to the command.
    env = own | {"PYTHONHASHSEED": seed, "MPLBACKEND": "module://no.such.backend"}
    subprocess.run(command, check=True, capture_output=True, env=env)
    for path in write_figures("2", only=["2", "9"]):
        assert path.read_bytes() == Path("1", path.name).read_bytes()


# Files


def test_files_are_written_whole_and_kept_without_force(folder: Path) -> None:
    seen: list[str] = []
    written = write_figures(
        "new/deep", only=["15", 2], formats=["svg", "png", "svg"], progress=seen.append
    )
    names = ["figure_02.svg", "figure_02.png", "figure_15.svg", "figure_15.png"]
    assert written == [Path("new/deep", name) for name in names]
    assert [path.read_bytes()[:4] for path in written] == [b"<?xm", b"\x89PNG"] * 2
    assert seen == ["drawing figure_02", "drawing figure_15"]
    Path("new/deep/figure_15.svg").write_text("mine")
    with pytest.raises(gg.errors.OutputExists, match=r"figure_15.svg' exists"):
        write_figures("new/deep", only=["15"], formats=["svg"])
    write_figures("new/deep", only=["15"], formats=["svg"], force=True)
    assert Path("new/deep/figure_15.svg").read_text() != "mine"


def test_robustness_draws_its_picture(run: Any, folder: Path) -> None:
    given = ("robustness", "gait4", "--bias", "0.8", "--output", "r.png")
    done = run(*given, "--output", "r.svg")
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith("wrote r.png\nwrote r.svg\n")
    drawn = Path("r.svg").read_text()
    assert 'id="singular"' in drawn
    assert 'id="acceptable"' in drawn
    first = Path("r.png").read_bytes()
    again = run(*given)
    assert (again.code, again.out) == (2, "")
    assert "exists; overwrite it with --force" in again.err
    assert run(*given, "--force", "--json").json["outputs"] == ["r.png"]
    assert Path("r.png").read_bytes() == first
    assert run("robustness", "gait4", "--json").json["outputs"] == []


def test_compare_puts_two_gaits_side_by_side(run: Any, folder: Path) -> None:
    """Against samples of Gait 3, whose extremes are at its corners, and the numbers of the paper's rectangles."""
    gait = gg.lift(GAITS[2].angles, "red")
    gait.parametrize(law="constant-speed").write("gait3.csv")
    given = ("compare", "gait1", "gait3.csv", "--period", "2")
    result = run(*given, "--output", "both.png", "--json")
    assert (result.code, result.err, result.json["outputs"]) == (0, "", ["both.png"])
    blue, red = result.json["gaits"]
    alpha = (
        gg.plan_loop(GAITS[2].angles, color="red")
        .gait.parametrize(2.0, law="constant-speed")
        .at(np.arange(0, 2, 1 / 64))
        .alpha
    )
    shares, least = hover_thrust_shares(alpha), least_singular_value(alpha)
    corners = gg.gait_of("gait3").alpha
    servo = gg.robustness.servo_margin(np.vstack([corners, corners[:1]]))
    expected = {
        "gait": "gait3.csv", "flyable": True, "valid": True, "reachable_from_hover": False,
        "not_judged": ["thrust_limit", "tilt_range", "tilt_rate", "tilt_acceleration"], "reason": "",
        "vehicle": "paper", "color": "red",
        "length": math.pi, "period": 2.0, "least_singular_value": least.min(), "tilt_margin_deg": 90.0,
        "acceptable_fraction": 1.0, "servo_margin_deg": math.degrees(servo.proven), "drag_margin": 1.0,
        "least_hover_thrust": shares.min(), "largest_hover_thrust": shares.max(),
        "hover_power": 2 * (shares**1.5).sum(axis=1).mean(),
        "peak_rate": math.pi / 2, "peak_acceleration": None,
    }  # fmt: skip
    assert list(blue) == list(red) == list(expected)
    for name, value in expected.items():
        assert red[name] == (
            pytest.approx(value, abs=5e-4) if isinstance(value, float) else value
        ), name
    names = (
        "flyable",
        "valid",
        "tilt_margin_deg",
        "acceptable_fraction",
        "least_hover_thrust",
        "largest_hover_thrust",
    )
    assert [blue[name] for name in names] == [False, True, None, 0.0, None, None]
    assert Path("both.png").stat().st_size > 10_000
    timed = [
        timed_gait_of(gait, period=2.0)
        for gait in ("gait3", gg.lift([(0.2, -0.2), (1.4, -1.4)], "red"))
    ]
    draw_sheet(figure := Figure(), timed, ("A", "B"))
    limits = [ax.get_ylim() for ax in figure.axes]
    assert limits[:5] == limits[5:]
    for (low, high), ax in zip(limits, figure.axes, strict=True):
        curves = [
            line.get_ydata() for line in ax.lines if np.size(line.get_ydata()) > 2
        ]
        assert all(low <= np.min(curve) <= np.max(curve) <= high for curve in curves)
    assert "'both.png' exists" in run(*given, "--output", "both.png").err
    lines = run(*given).out.splitlines()
    assert lines[1].split() == ["flyable", "no", "yes"]
    assert lines[-1].startswith("gait1 is not flyable: least singular value")


def test_places_and_settings_that_are_refused(folder: Path) -> None:
    Path("file").write_text("mine")
    Path("link").symlink_to("nowhere")
    for out in ("file", "file/inside", "nul\0", "x" * 300, "link"):
        with pytest.raises(gg.GaitgraphError, match=r"^output must be .*$"):
            write_figures(out, only=["15"], formats=["svg"])
    for formats in (["tiff"], [], "gif", [1]):
        with pytest.raises(
            gg.InputError, match=r"^format must be one of png, svg, pdf, got "
        ):
            write_figures("out", only=["2"], formats=formats)  # type: ignore[arg-type]
    with pytest.raises(
        gg.InputError,
        match="gait has an effect on the figure set only, and only selects 2",
    ):
        write_figures("out", only=["2"], gait=GAIT4)
    assert sorted(path.name for path in folder.iterdir()) == ["file", "link"]


# The command


def test_command(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    result = run("figures", "--only", "15", "--only", "2", "--format", "svg")
    assert (result.code, result.err) == (0, "")
    stems = {name: Path("figures", f"{FIGURES[name].stem}.svg") for name in ("2", "15")}
    assert result.out.splitlines() == [
        f"wrote {stem}: {FIGURES[name].title}" for name, stem in stems.items()
    ]
    result = run(
        "figures",
        "--only",
        "15",
        "--force",
        "--json",
        "--format",
        "PDF",
        "--vehicle",
        "beetle_omni",
    )
    (row,) = result.json["files"]
    assert (result.code, row["file"], row["figure"]) == (
        0,
        str(Path("figures", "figure_15.pdf")),
        "15",
    )
    assert row["title"] == FIGURES["15"].title
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = run("figures", "--output", "new")
    assert (result.code, result.out, result.err.count("\n"), Path("new").exists()) == (
        2,
        "",
        1,
        False,
    )
    assert "pip install 'gaitgraph[plot]'" in result.err


@pytest.mark.parametrize(
    ("page", "name"), [("README.md", "gait3"), ("docs/index.md", "plan")]
)
def test_the_pictures_of_a_quick_start_are_made_by_its_lines(
    page: str, name: str, folder: Path
) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = [
        block
        for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        if "savefig" in block
    ]
    exec("\n".join(blocks), {})
    found: Any = compare_images(
        str(ROOT / "docs" / "images" / f"{name}.png"), f"{name}.png", tol=8.0
    )
    assert found is None
    assert f"images/{name}.png" in text


def test_the_diagram_of_the_guide_is_of_this_code(tmp_path: Path) -> None:
    made = tmp_path / "21.png"
    made.write_bytes(picture_bytes(draw("21"), "png"))
    found: Any = compare_images(
        str(ROOT / "docs" / "images" / "roll_pitch.png"), str(made), tol=8.0
    )
    assert found is None
