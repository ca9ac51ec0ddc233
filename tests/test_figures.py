"""The figures of the paper: what is on them, how they are named and written, and the commands that draw."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from dataclasses import replace
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
from gaitgraph.invertibility.matrices import hover_thrust_shares, least_singular_value
from gaitgraph.plots.axes import FORMATS, paper_style, picture_bytes
from gaitgraph.plots.figures import FIGURES, draw, write_figures
from gaitgraph.plots.gaits import draw_sheet
from gaitgraph.timing.timed_gait import table_of
from tests.published import GAITS
from tests.samples import BEETLE, cases, table_from

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
GAIT4 = gg.lift(GAITS[3].angles, "red")
SLOW = pytest.mark.slow


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def legend_of(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_every_figure_of_the_paper_is_there_and_some_more() -> None:
    numbers = [str(number) for number in range(1, 23)]
    assert list(FIGURES) == [*numbers, "18b", "19b", "22b", "regions", "margins", "set"]
    assert FIGURES["1"].stem == "figure_01"
    assert FIGURES["18b"].stem == "figure_18b"


@pytest.mark.parametrize(
    ("names", "vehicle"),
    [
        ("1 12 15 regions", gg.PAPER),
        pytest.param("2 7 10 11 14 16 17 18 19 20 21 22", gg.PAPER, marks=SLOW),
        pytest.param("1 9 12 17 18 regions", BEETLE, marks=SLOW),
    ],
)
def test_figures_fit_a_page_and_no_text_lies_on_another(
    names: str, vehicle: gg.Vehicle
) -> None:
    before = dict(mpl.rcParams)
    for name in names.split():
        figure = draw(name, vehicle=vehicle)
        assert round(figure.get_figwidth() * 25.4, 6) in (85.0, 170.0)
        assert figure.get_figheight() * 25.4 < 230
        boxes = boxes_of_texts(figure)
        for p, q in combinations(boxes, 2):
            across = min(p.x1, q.x1) - max(p.x0, q.x0)
            upward = min(p.y1, q.y1) - max(p.y0, q.y0)
            assert min(across, upward) <= 1, name
        page = figure.bbox
        for box in boxes:
            assert page.x0 <= box.x0 <= box.x1 <= page.x1, name
            assert page.y0 <= box.y0 <= box.y1 <= page.y1, name
    assert pyplot.get_fignums() == []
    assert dict(mpl.rcParams) == before


def boxes_of_texts(figure: Figure) -> list[Any]:
    boxes = []
    with paper_style():
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        for text in figure.findobj(Text):
            box = text.get_window_extent(canvas.get_renderer())
            is_shown = text.get_visible() and text.get_text().strip()
            # Ticks outside the range of their axis have labels too, which are not drawn.
            if is_shown and box.overlaps(figure.bbox):
                boxes.append(box)
    return boxes


def test_figure_17_holds_three_loops() -> None:
    """Mirrored for a vehicle whose spins are opposite."""
    for vehicle, sign in ((gg.PAPER, 1), (BEETLE, -1)):
        (ax,) = draw(17, vehicle=vehicle).axes
        lines = {str(line.get_label()): line for line in ax.lines}
        for known in GAITS[:3]:
            line = lines[f"Gait {known.number}: {known.color}"]
            points = sign * np.array(known.angles)
            assert np.asarray(line.get_xydata())[:4] == pytest.approx(points)


def test_a_gait_has_a_set_of_its_own(run: Any, folder: Path) -> None:
    result = run("figures", "gait4", "--format", "svg")
    stated = f"wrote {Path('figures', 'figure_set.svg')}: The set of a gait"
    assert result.out.strip() == stated
    timed = GAIT4.parametrize(2.0, law="equal-time", samples=20)
    loop, angles, thrusts, attitudes, value = draw("set", gait=table_of(timed)).axes
    assert loop.get_title() == "Gait 4: loop on the map"
    assert angles.get_xlim() == (0.0, 2.0)
    alpha = timed.at(angles.lines[1].get_xdata()).alpha
    assert angles.lines[1].get_ydata() == pytest.approx(alpha[:, 1])
    shares = hover_thrust_shares(alpha)[:, 0]
    assert thrusts.lines[0].get_ydata() == pytest.approx(shares)
    least = least_singular_value(alpha)
    assert value.lines[0].get_ydata() == pytest.approx(least)
    assert "no singular attitude" in legend_of(attitudes)[0]
    blue = draw("set", gait=gg.gait_of("gait1").biased(0.8)).axes
    assert blue[0].get_title().startswith("Gait 1 biased by 0.8:")


def test_what_is_singular_has_no_thrusts_to_draw() -> None:
    thrusts = draw("set", gait="gait1").axes[2]
    assert thrusts.texts[0].get_text() == "singular in level flight"


# The same bytes


@SLOW
def test_the_same_bytes_whatever_was_drawn_before_and_in_every_process(
    folder: Path,
) -> None:
    """In any order of formats, in any style, and in a process whose hashes are other ones."""
    for name in ("15", "9", "20"):
        contents: list[dict[str, bytes]] = []
        for order, width in ((FORMATS, 1.0), (FORMATS[::-1], 7.0)):
            with mpl.rc_context({"lines.linewidth": width, "axes.grid": width > 1}):
                figure = draw(name)
                contents.append({kind: picture_bytes(figure, kind) for kind in order})
        assert contents[0] == contents[1]
        stamps = rb"CreationDate|Matplotlib v|<dc:date>"
        assert not re.search(stamps, b"".join(contents[0].values()))
    command = [sys.executable, "-m", "gaitgraph", "figures", "--only", "9"]
    # The backend of a notebook, which may be missing here, does not matter to the command.
    seed = {"PYTHONHASHSEED": "1", "MPLBACKEND": "module://no.such.backend"}
    subprocess.run(command, check=True, capture_output=True, env=os.environ | seed)
    for path in write_figures("2", only=["9"]):
        assert path.read_bytes() == Path("figures", path.name).read_bytes()


# Files


def test_files_are_written_whole_and_kept_without_force(folder: Path) -> None:
    seen: list[str] = []
    formats: Any = ["svg", "png", "svg"]
    written = write_figures(
        "new/deep", only=["15", 2], formats=formats, progress=seen.append
    )
    names = ["figure_02.svg", "figure_02.png", "figure_15.svg", "figure_15.png"]
    assert written == [Path("new/deep", name) for name in names]
    assert [path.read_bytes()[:4] for path in written] == [b"<?xm", b"\x89PNG"] * 2
    assert seen == ["drawing figure_02", "drawing figure_15"]
    mine = written[2]
    mine.write_text("mine")
    with pytest.raises(gg.errors.OutputExists, match=r"figure_15.svg' exists"):
        write_figures("new/deep", only=["15"], formats=["svg"])
    write_figures("new/deep", only=["15"], formats=["svg"], force=True)
    assert mine.read_text() != "mine"


@pytest.mark.parametrize("out", ["file", "file/inside", "nul\0", "x" * 300, "link"])
def test_places_that_are_refused(folder: Path, out: str) -> None:
    Path("file").write_text("mine")
    Path("link").symlink_to("nowhere")
    with pytest.raises(gg.GaitgraphError, match=r"^output must be .*$"):
        write_figures(out, only=["15"], formats=["svg"])
    assert sorted(path.name for path in folder.iterdir()) == ["file", "link"]


@pytest.mark.parametrize(
    ("call", "said"),
    cases("""
write_figures("out", formats=["tiff"]) | format must be one of png, svg, pdf
write_figures("out", formats=[]) | format must be one of
write_figures("out", only=["3", "23"]) | only must be one of 1, 2,
write_figures("out", only=["2"], gait=GAIT4) | gait must be omitted unless the figure set is drawn
draw("3,4") | name must be one of
"""),
)
def test_settings_that_are_refused(folder: Path, call: str, said: str) -> None:
    with pytest.raises(gg.InputError, match=f"^{said}"):
        eval(call)
    assert not [*folder.iterdir()]


# Commands


def test_robustness_draws_its_picture(run: Any, folder: Path) -> None:
    Path("side.csv").write_text("alpha1,alpha2,color\n-0.4,0.4,red\n-0.4,1.2,red\n")
    done = run("robustness", "side.csv", "--bias", "0.8", "--output", "r.svg")
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith("wrote r.svg\n")
    assert 'id="singular"' in Path("r.svg").read_text()


def test_compare_puts_two_gaits_side_by_side(run: Any, folder: Path) -> None:
    """Against samples of Gait 3, whose extremes are at its corners."""
    gait = gg.lift(GAITS[2].angles, "red")
    gait.parametrize(law="constant-speed", samples=16).write("gait3.csv")
    command = ("compare", "gait1", "gait3.csv", "--period", "2")
    result = run(*command, "--output", "both.svg", "--json")
    assert (result.code, result.err, result.json["outputs"]) == (0, "", ["both.svg"])
    blue, red = result.json["gaits"]
    timed = gait.parametrize(2.0, law="constant-speed")
    alpha = timed.at(np.arange(0, 2, 1 / 64)).alpha
    shares = hover_thrust_shares(alpha)
    corners = np.vstack([gait.alpha, gait.alpha[:1]])
    servo = gg.robustness.servo_margin(corners).proven
    numbers = {
        "length": math.pi,
        "period": 2.0,
        "least_singular_value": least_singular_value(alpha).min(),
        "tilt_margin_deg": 90.0,
        "acceptable_fraction": 1.0,
        "servo_margin_deg": math.degrees(servo),
        "drag_margin": 1.0,
        "least_hover_thrust": shares.min(),
        "largest_hover_thrust": shares.max(),
        "hover_power": 2 * (shares**1.5).sum(axis=1).mean(),
        "peak_rate": math.pi / 2,
    }
    assert {name: red[name] for name in numbers} == pytest.approx(numbers, abs=5e-4)
    assert (red["gait"], red["flyable"], red["color"]) == ("gait3.csv", True, "red")
    assert (red["reachable_from_hover"], red["peak_acceleration"]) == (False, None)
    assert (blue["flyable"], blue["valid"]) == (False, True)
    assert blue["tilt_margin_deg"] is blue["least_hover_thrust"] is None


def test_a_path_beside_a_gait_has_its_own_length() -> None:
    alpha = gg.lift(GAITS[2].angles, "red").alpha
    path = replace(table_from(alpha, t=range(4)), about={"repeats": False})
    compared = gg.robustness.comparison_of([path, "gait3"])
    length = np.linalg.norm(np.diff(alpha[:, :2], axis=0), axis=1).sum()
    assert compared.rows[0]["length"] == pytest.approx(length)
    lines = str(compared).splitlines()
    assert len({line.rindex("  ") for line in lines}) == 1  # the columns are aligned


def test_the_scales_of_gaits_that_are_compared_are_the_same() -> None:
    other = gg.lift([(0.2, -0.2), (1.4, -1.4)], "red")
    gaits = [gg.gait_of("gait3").parametrize(2.0), other.parametrize(2.0)]
    figure = Figure()
    draw_sheet(figure, gaits, ("A", "B"))
    limits = [ax.get_ylim() for ax in figure.axes]
    assert limits[:5] == limits[5:]
    for (low, high), ax in zip(limits, figure.axes, strict=True):
        curves = [
            line.get_ydata() for line in ax.lines if np.size(line.get_ydata()) > 2
        ]
        assert all(low <= np.min(curve) <= np.max(curve) <= high for curve in curves)


def test_the_command_draws_figures(run: Any) -> None:
    result = run("figures", "--only", "15", "--format", "svg")
    assert (result.code, result.err) == (0, "")
    stated = f"wrote {Path('figures', 'figure_15.svg')}: {FIGURES['15'].title}\n"
    assert result.out == stated
    options = ("--format", "PDF", "--vehicle", "beetle_omni")
    (row,) = run("figures", "--only", "15", "--json", *options).json["files"]
    assert (row["figure"], row["title"]) == ("15", FIGURES["15"].title)
    assert Path(row["file"]).read_bytes().startswith(b"%PDF")


def test_without_matplotlib_the_command_says_what_to_install(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = run("figures", "--output", "new")
    assert (result.code, result.out, Path("new").exists()) == (2, "", False)
    assert "pip install 'gaitgraph[plot]'" in result.err


# Pictures of the docs


@pytest.mark.parametrize(
    ("page", "name"), [("README.md", "gait3"), ("docs/index.md", "plan")]
)
def test_the_pictures_of_a_quick_start_are_made_by_its_lines(
    page: str, name: str, folder: Path
) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec("\n".join(block for block in blocks if "savefig" in block), {})
    made = f"{name}.png"
    assert f"images/{made}" in text
    assert compare_images(str(IMAGES / made), made, tol=8.0) is None


def test_the_diagram_of_the_guide_is_of_this_code(folder: Path) -> None:
    Path("21.png").write_bytes(picture_bytes(draw("21"), "png"))
    assert compare_images(str(IMAGES / "roll_pitch.png"), "21.png", tol=8.0) is None
