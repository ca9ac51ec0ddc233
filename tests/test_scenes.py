"""The vehicle on a screen, and the animated pictures made of it."""

from __future__ import annotations

import json
import math
import re
import sys
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import GifImagePlugin, Image

import gaitgraph as gg
from gaitgraph.gait.table import Table, provenance_text
from gaitgraph.io.reading import provenance_in
from gaitgraph.io.writing import write_tables
from gaitgraph.plots.film_settings import MOST_FRAMES
from gaitgraph.plots.gif_films import frame_delays, provenance_of_gif
from gaitgraph.plots.scenes import ROTOR_COLORS, Scene, scene_of
from gaitgraph.plots.svg_films import provenance_of_svg
from gaitgraph.timing.timed_gait import table_of

if TYPE_CHECKING:
    from pathlib import Path

X_FRAME = gg.Vehicle(
    name="an <X> & more", drag_ratio=0.12, first_arm_angle=math.pi / 4, first_rotor_spin="counterclockwise"
)
ABOVE, BEHIND, RIGHT = (math.pi, math.pi / 2), (math.pi, 0.0), (-math.pi / 2, 0.0)
SVG = "{http://www.w3.org/2000/svg}"


def in_space(alpha: Any, vehicle: gg.Vehicle) -> tuple[Any, Any, Any]:
    """Return the discs' two axes and the thrusts in body axes, in arm lengths, from three views put together."""
    seen = {view: scene_of(alpha, vehicle, size=(300, 300), view=view) for view in (ABOVE, BEHIND, RIGHT)}

    def vectors(of: Any) -> Any:
        # From above the screen's right is −y and its down −x; from behind right is −y, down −z; from the right x, −z.
        above, behind, right = (of(seen[view]) / seen[view].scale for view in (ABOVE, BEHIND, RIGHT))
        x, y, z = -above[..., 1], -above[..., 0], -behind[..., 1]
        assert np.allclose(-behind[..., 0], y)
        assert np.allclose(right, np.stack([x, -z], axis=-1))
        return np.stack([x, y, z], axis=-1)

    return (
        vectors(lambda scene: scene.discs[..., 0:2]),
        vectors(lambda scene: scene.discs[..., 2:4]),
        vectors(lambda scene: scene.thrusts - scene.discs[..., 4:6]),
    )


@pytest.mark.parametrize("vehicle", [gg.PAPER, X_FRAME], ids=["paper", "x_frame"])
def test_discs_face_along_the_forces_of_the_rotors(vehicle: gg.Vehicle) -> None:
    alpha = np.random.default_rng(6).uniform(-math.pi, math.pi, (40, 4))
    across, along, thrust = in_space(alpha, vehicle)
    # One unit of thrust pushing away from the body, with any coefficients: only the direction counts.
    whole = vehicle.replace(
        thrust_coefficient=1.0, arm_length=1.0, drag_ratio=vehicle.drag_ratio, drag_coefficient=None
    )
    force = gg.invertibility.control_force_matrix(alpha, whole)
    force = np.swapaxes(force * np.sign(gg.invertibility.control_force_matrix(np.zeros(4), whole)[2]), -1, -2)
    assert np.allclose(thrust / np.linalg.norm(thrust, axis=-1, keepdims=True), force)
    normal = np.cross(across, along)
    assert np.allclose(normal / np.linalg.norm(normal, axis=-1, keepdims=True), force)
    # A disc is round, and turns about its arm.
    assert np.allclose((across * along).sum(axis=-1), 0.0)
    assert np.allclose(np.linalg.norm(across, axis=-1), np.linalg.norm(along, axis=-1))
    assert np.allclose(across, across[:1])
    angles = vehicle.first_arm_angle + np.arange(4) * math.pi / 2
    assert np.allclose(across[0], 0.5 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1))


def test_a_scene_stays_in_its_picture_from_everywhere() -> None:
    alpha = np.random.default_rng(7).uniform(-math.pi, math.pi, (200, 4))
    around = np.linspace(0, math.tau, 60)
    circle = np.stack([np.cos(around), np.sin(around)])
    for view in ((0.3, 0.5), (2.0, -1.2), ABOVE, BEHIND, (-2.7, 0.6)):
        scene = scene_of(alpha, X_FRAME, size=(200, 120), view=view)
        rims = np.moveaxis(scene.discs[..., :4].reshape(-1, 4, 2, 2), -1, -2) @ circle
        rims = np.moveaxis(rims, -1, -2) + scene.discs[..., None, 4:]
        for places in (rims, scene.thrusts, scene.labels, scene.arms, scene.nose, scene.hub):
            assert places.min() >= 0
            assert places[..., 0].max() <= 200
            assert places[..., 1].max() <= 120


def test_a_scene_seen_from_above_and_from_below() -> None:
    above = scene_of([0.0, 0.0, 0.0, 0.0], view=ABOVE, size=(200, 200))
    assert above.facing.all()
    assert above.clockwise == (True, False, True, False)
    assert above.arms[0][1] < above.hub[1]  # forward is up
    assert above.arms[1][0] < above.hub[0]  # left is left
    assert np.allclose(above.nose - above.hub, (0.34 * (above.arms[0] - above.hub)))
    assert not scene_of([0.0, 0.0, 0.0, 0.0], view=(0.0, -1.0)).facing.any()
    behind = scene_of([0.0, 0.0, 0.0, 0.0], view=(math.pi, 0.5))
    assert behind.order[0] == 0  # the forward rotor is farthest
    assert behind.order[-1] == 2
    with pytest.raises(ValueError, match="read-only"):
        above.discs[0] = 0


def test_a_scene_as_plain_values() -> None:
    told = json.loads(json.dumps(scene_of(np.zeros((3, 4)), size=(100, 80)).as_mapping(), allow_nan=False))
    assert told["frames"] == 3
    assert told["size"] == [100, 80]
    assert [len(rotor["disc"]) for rotor in told["rotors"]] == [3] * 4
    assert [rotor["color"] for rotor in told["rotors"]] == list(ROTOR_COLORS)
    assert told["rotors"][0]["arm"][:2] == told["hub"]


@pytest.mark.parametrize(
    ("alpha", "options", "message"),
    [
        ([0.0, 0.0], {}, r"alpha: an array of shape \(2,\)"),
        ([[0.0, math.nan, 0.0, 0.0]], {}, "alpha: nan"),
        ([0.0] * 4, {"view": (0.0, 2.0)}, "view: elevation 2.0"),
        ([0.0] * 4, {"view": 3}, "view: 3; allowed are azimuth and elevation"),
        ([0.0] * 4, {"size": (0, 100)}, r"size: \(0, 100\); allowed"),
        ([0.0] * 4, {"size": ("a", 100)}, r"size: \('a', 100\); allowed"),
    ],
)
def test_a_scene_refuses_what_it_cannot_draw(alpha: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(gg.InputError, match=message):
        scene_of(alpha, **options)


@pytest.fixture(scope="module")
def table() -> Table:
    waypoints = [("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
    plan = gg.plan_loop(waypoints)
    made = table_of(plan.gait.parametrize(period=0.6, samples=300), {"request": plan.request.as_mapping()})
    return Table(columns=made.columns, about=made.about)


@pytest.fixture(scope="module")
def pictures(table: Table, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pictures")
    write_tables(table, [folder / "gait.svg", folder / "gait.gif", folder / "again.svg", folder / "again.gif"])
    return folder


def test_pictures_are_the_same_each_time_and_tell_what_made_them(pictures: Path, table: Table) -> None:
    for suffix, told_by in ((".svg", provenance_of_svg), (".gif", provenance_of_gif)):
        path = pictures / f"gait{suffix}"
        assert path.read_bytes() == (pictures / f"again{suffix}").read_bytes()
        assert told_by(path) == provenance_text(table)
        assert provenance_in(path) == table.about


def test_a_gif_plays_one_period_for_ever(pictures: Path, table: Table) -> None:
    with Image.open(pictures / "gait.gif") as image:
        assert isinstance(image, GifImagePlugin.GifImageFile)
        assert image.info["loop"] == 0
        assert image.info["comment"].decode() == provenance_text(table)
        assert image.n_frames == 15
        delays = []
        for k in range(image.n_frames):
            image.seek(k)
            delays.append(image.info["duration"])
        assert sum(delays) == 600  # ms
        # Where discs are, their colors are, up to what is in front of them: rotor 1 leans most at the start.
        image.seek(0)
        pixels = np.asarray(image.convert("RGB")).astype(int)
    scene = scene_of(table.alpha[:1], size=(480, 272))
    for rotor in (1, 3):
        disc = scene.discs[0, rotor]
        spot = disc[4:] + 0.6 * disc[:2] * (1 if rotor == 1 else 0.9)
        shown = pixels[round(spot[1]) + 36, round(spot[0])]
        color = np.array([int(ROTOR_COLORS[rotor][k : k + 2], 16) for k in (1, 3, 5)])
        if not scene.facing[0, rotor]:
            color = (color * 11 + np.array([0x23, 0x26, 0x2B]) * 9) // 20
        assert np.abs(shown - color).max() <= 8, (rotor, shown, color)


@pytest.mark.parametrize(
    ("period", "frames", "total"),
    [(1e-6, 10, 20), (0.2, 10, 20), (0.123456, 10, 20), (1.0, 25, 100), (1.237, 31, 124), (4.0, 100, 400),
     (3600.0, 100, 360_000), (1e9, 100, 6_553_500)],
)  # fmt: skip
def test_frames_last_as_long_as_the_period_where_the_format_can(period: float, frames: int, total: int) -> None:
    delays = frame_delays(period)
    assert len(delays) == frames <= MOST_FRAMES
    assert sum(delays) == total
    assert min(delays) >= 2  # browsers take less for a tenth of a second
    assert max(delays) <= 65535
    assert max(delays) - min(delays) <= 1


def values_of(animations: Any, kind: str) -> Any:
    text = next(one.get("values") for one in animations if one.get("type") == kind)
    return np.array([[float(part) for part in row.split(",")] for row in text.split(";")])


def test_an_svg_moves_the_discs_as_the_scene_says(pictures: Path, table: Table) -> None:
    """Fixed axes times scaling times skew, as a browser puts them together, are the affine maps of the scene."""
    root = ET.fromstring((pictures / "gait.svg").read_text())
    t = np.linspace(0, 1, MOST_FRAMES + 1) * 0.6
    alpha = np.stack([np.interp(t, table["t"], column) for column in table.alpha.T], axis=-1)
    scene = scene_of(alpha, size=(480, 272))
    drawn = [node for node in root.iter(f"{SVG}g") if (node.get("transform") or "").startswith("matrix")]
    assert len(drawn) == 4
    moves = [node for node in root.iter(f"{SVG}g") if any(child.get("type") == "translate" for child in node)]
    for rotor, node, mover in zip(scene.order, drawn, moves, strict=True):
        a, b, c, d, _, _ = (float(part) for part in (node.get("transform") or "")[7:-1].split(","))
        scale, skew = (values_of(node.iter(f"{SVG}animateTransform"), kind) for kind in ("scale", "skewX"))
        moved = values_of(mover, "translate")
        tangent = np.tan(np.radians(skew[:, 0]))
        along = np.stack([a * tangent + c * scale[:, 1], b * tangent + d * scale[:, 1]], axis=-1)
        assert np.allclose((a, b), scene.discs[0, rotor, :2], atol=1e-3)
        # On edge a disc is still a line of three hundredths.
        allowed = np.where(np.abs(scale[:, 1:]) > 0.03, 0.12, 0.03 * 2 * math.hypot(a, b))  # pixels
        assert (np.abs(along - scene.discs[:, rotor, 2:4]) <= allowed).all()
        assert np.allclose(moved, scene.discs[:, rotor, 4:6], atol=0.06)


def test_an_svg_is_small_stands_alone_and_runs_nothing(pictures: Path) -> None:
    text = (pictures / "gait.svg").read_text()
    root = ET.fromstring(text)
    assert len(text) < 60_000
    animations = [node for node in root.iter() if node.tag.startswith(f"{SVG}animate")]
    assert {node.get("dur") for node in animations} == {"0.6s"}
    assert {node.get("repeatCount") for node in animations} == {"indefinite"}
    assert not [node for node in root.iter() if node.tag in (f"{SVG}script", f"{SVG}image", f"{SVG}foreignObject")]
    assert not re.search(r"href|on\w+=|https?://(?!www\.w3\.org/2000/svg)", text)
    assert root.get("role") == "img"
    assert root.findtext(f"{SVG}title") == "Vehicle paper · T = 0.6 s · smooth"


def test_pictures_of_other_tables(tmp_path: Path) -> None:
    """Names are escaped, uneven times kept, edges drawn, and a table without a clock lasts a second."""
    s = np.linspace(0, 1, 30) ** 2
    columns = {f"alpha{k + 1}": np.linspace(-2, 2, 30) * (-1) ** k for k in range(4)}
    about = {"vehicle": X_FRAME.as_mapping(), "coefficients": "exact"}
    write_tables(Table(columns={"t": 1e-3 * s, **columns}, about=about), [tmp_path / "a.svg", tmp_path / "a.gif"])
    root = ET.fromstring((tmp_path / "a.svg").read_text())
    assert root.findtext(f"{SVG}title") == "Vehicle an <X> & more · T = 0.001 s (shown slower: 0.2 s)"
    switched = [node.get("values") for node in root.iter(f"{SVG}animate") if node.get("calcMode") == "discrete"]
    assert "visible;hidden;visible" in switched or "hidden;visible" in switched
    with Image.open(tmp_path / "a.gif") as image:
        assert isinstance(image, GifImagePlugin.GifImageFile)
        assert image.n_frames == 10
    write_tables(Table(columns={name: values[:1] for name, values in columns.items()}), [tmp_path / "b.svg"])
    assert "T = 1 s" in (tmp_path / "b.svg").read_text()


def test_a_gif_needs_the_extra_for_plots(table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(gg.GaitgraphError, match=r"matplotlib: not installed.*pip install 'gaitgraph\[plot\]'"):
        write_tables(table, [tmp_path / "a.gif"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", ["svg", "gif"])
def test_pictures_that_are_not_whole_are_refused(kind: str, pictures: Path, tmp_path: Path) -> None:
    content = (pictures / f"gait.{kind}").read_bytes()
    path = tmp_path / f"gait.{kind}"
    end = content.index(b"</metadata>") if kind == "svg" else 800
    for cut in (0, 1, 10, 20, 300, end - 1):
        path.write_bytes(content[:cut])
        with pytest.raises(gg.InputError, match=re.escape(f"gait file {str(path)!r}: it ")):
            provenance_in(path)
    path.write_bytes(content.replace(b"gaitgraph gait table", b"somebody elses table"))
    with pytest.raises(gg.InputError, match="not told by gaitgraph"):
        provenance_in(path)
    with pytest.raises(gg.errors.FileProblem, match="cannot read"):
        provenance_in(tmp_path / f"none.{kind}")


def test_pictures_from_elsewhere_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.svg"
    path.write_text("<svg/>")
    with pytest.raises(gg.InputError, match="it does not tell what made it"):
        provenance_in(path)
    path.write_text('<!DOCTYPE svg [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;">]><svg><metadata>&b;</metadata></svg>')
    with pytest.raises(gg.InputError, match="it declares a document type"):
        provenance_in(path)
    path.write_text("<svg>" * 100_000)
    with pytest.raises(gg.InputError, match="it is not whole XML"):
        provenance_in(path)
    plain = tmp_path / "a.gif"
    Image.new("L", (4, 4)).save(plain)
    with pytest.raises(gg.InputError, match="it does not tell what made it"):
        provenance_in(plain)


def test_a_scene_is_its_own() -> None:
    scene = scene_of(np.zeros((2, 4)))
    assert isinstance(scene, Scene)
    assert len(scene) == 2
