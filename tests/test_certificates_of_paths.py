"""Certificates of paths that are run once, from rest to rest."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.certificates import check, verify
from gaitgraph.certificates.open_paths import pieces_along
from gaitgraph.certificates.verifying import note_on_certificate
from gaitgraph.timing.polynomials import values_of
from gaitgraph.timing.timed_gait import TimedPath

if TYPE_CHECKING:
    from pathlib import Path

LOOP = [(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)]


def mission_of(law: Any) -> Any:
    return gg.mission(gg.lift(LOOP, "red").parametrize(2.0, law=law), periods=2)


@pytest.mark.parametrize("law", ["smooth", "constant-speed"])
def test_the_pieces_are_the_path(law: str) -> None:
    path = mission_of(law)
    pieces, off = pieces_along(path)
    assert off < 5e-12
    begin, share = 0.0, np.linspace(0.01, 0.99, 9)
    for piece in pieces:
        width = float(piece["duration"])
        curve = np.zeros((6, 4))
        for joint, angles in enumerate((piece["alpha"] * 2)[:4]):
            curve[-len(angles) :, joint] = [float(a) for a in angles[::-1]]
        exact = path.at(begin + share * width).alpha
        assert np.abs(values_of(curve[:, None], share) - exact).max() < 2e-11
        begin += width
    assert begin == pytest.approx(path.period, rel=1e-12)


def test_a_run_up_passes_its_corners_at_its_corner_times() -> None:
    for section in mission_of("constant-speed").sections:
        if section.phase not in ("run-up", "run-down"):
            continue
        times = section.corner_times
        corners = np.tile(section.gait.alpha, (section.periods, 1))
        corners = np.vstack([corners, corners[:1]])
        assert (times[0], times[-1]) == (0.0, section.period)
        assert section.at(times).alpha == pytest.approx(corners, abs=1e-8)


def test_a_mission_is_certified_and_compared_with_its_table(tmp_path: Path) -> None:
    path, table = tmp_path / "flight.cert.json", tmp_path / "flight.json"
    mission = gg.mission(gg.lift(LOOP[:2], "red").parametrize(2.0), periods=1)
    mission.write(table)
    gg.certify(table).write(path)
    verified = verify(path)
    assert verified.flyable
    assert (verified.found["path"], verified.rows) == ("open", len(mission.t))
    rows = gg.read_table(table)
    assert note_on_certificate(table, rows, gg.PAPER) == ""
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, "path": "closed"}))
    assert "its motion is run once, and the path" in verify(path).as_mapping()["off"]
    assert "its motion is run once" in note_on_certificate(table, rows, gg.PAPER)


def test_a_path_that_moves_at_an_end_has_none() -> None:
    loop = gg.lift(LOOP[:2], "red").parametrize(2.0, law="constant-speed")
    with pytest.raises(gg.Infeasible, match="not at rest at both ends"):
        gg.certify(TimedPath.of(loop))
    smooth = TimedPath.of(gg.lift(LOOP[:2], "red").parametrize(2.0))
    assert check.check(gg.certify(smooth).text)["flyable"]
