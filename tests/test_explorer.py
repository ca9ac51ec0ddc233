"""The explorer's server: every answer against the package, and everything that it must refuse."""

from __future__ import annotations

import asyncio
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import time
import webbrowser
import zipfile
from io import BytesIO
from queue import Queue
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote
from urllib.request import Request, urlopen

import numpy as np
import pytest
from starlette.exceptions import HTTPException

import gaitgraph as gg
from gaitgraph.angles import percent
from gaitgraph.certificates import verify
from gaitgraph.certificates.check import check as checked
from gaitgraph.errors import FileWarning
from gaitgraph.explorer import map_query, queries, server, table_query
from gaitgraph.explorer.map_query import map_answer
from gaitgraph.explorer.server import HEADERS, application
from gaitgraph.explorer.state import DEFAULTS, LIMITS, state_of
from gaitgraph.explorer.table_query import file_answer, formats_answer, table_answer
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.surface.sheets import RELATION
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

PORT, TOKEN = 8000, "a-token-of-some-length"
GAIT3 = GAITS[2]
JSON = "application/json"
Answer = tuple[int, dict[str, str], bytes]  # status, headers, content
matrices = gg.invertibility
DELTA = 2 * coefficients_of().delta  # between the sheets


class Client:
    """Sends requests as the page does, or as nobody should, to the application itself."""

    def __init__(self) -> None:
        self.app = application(TOKEN, PORT)

    async def sent(
        self,
        method: str,
        path: str,
        headers: dict[str, str],
        messages: Iterable[dict[str, Any]],
    ) -> Answer:
        """Return status, headers and content of the answer to a request: the path as it stands, a body in pieces."""
        sent: list[Any] = []
        waiting = [{"type": "http.request"} | message for message in messages]

        async def receive() -> Any:
            return waiting.pop(0) if waiting else await asyncio.Event().wait()

        async def send(message: Any) -> None:
            sent.append(message)

        place, _, query = path.partition("?")
        stated = {"host": f"127.0.0.1:{PORT}"} | headers
        scope = {
            "type": "http", "http_version": "1.1", "method": method, "scheme": "http", "path": unquote(place),
            "raw_path": place.encode(), "query_string": query.encode(), "root_path": "",
            "headers": [(name.encode(), value.encode()) for name, value in stated.items()],
        }  # fmt: skip
        await self.app(scope, receive, send)
        found = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
        return (
            sent[0]["status"],
            found,
            b"".join(message.get("body", b"") for message in sent[1:]),
        )

    def ask(
        self, name: str, content: Any, *pieces: dict[str, Any], **headers: str
    ) -> Answer:
        """Post bytes, or an object as JSON, to a query, and further pieces of the request."""
        body = content if isinstance(content, bytes) else json.dumps(content).encode()
        stated = {"content-type": JSON} | {
            key.replace("_", "-"): value for key, value in headers.items()
        }
        path = f"/{TOKEN}/api/{name}"
        return asyncio.run(
            asyncio.wait_for(
                self.sent("POST", path, stated, [{"body": body}, *pieces]), 60
            )
        )

    def get(self, path: str) -> Answer:
        return asyncio.run(self.sent("GET", path, {}, [{}]))

    def __call__(self, name: str, content: Any) -> Any:
        status, _, answer = self.ask(name, content)
        assert status == 200, answer[:500]
        return json.loads(answer)

    def refused(self, name: str, content: Any, status: int = 400) -> str:
        return message_of(self.ask(name, content), status)

    def table(self, name: str, content: bytes, status: int = 200) -> Any:
        """Return what is known of a file, or the line that refuses it."""
        answer = self.ask(
            f"table?name={quote(name)}",
            content,
            content_type="application/octet-stream",
        )
        assert answer[0] == status, answer[2][:300]
        return json.loads(answer[2]) if status == 200 else message_of(answer, status)

    def file(self, state: dict[str, Any], suffix: str) -> tuple[str, bytes]:
        status, headers, content = self.ask(
            "download", {"state": state, "suffix": suffix}
        )
        assert status == 200, content[:300]
        return headers["content-disposition"].partition("filename=")[2], content


def message_of(answer: Answer, expected: int) -> str:
    status, headers, content = answer
    assert status == expected, content[:300]
    assert headers["content-security-policy"].startswith("default-src 'none'")
    ((name, message),) = json.loads(content).items()
    assert name == "error"
    assert re.fullmatch(r"(?!.*Traceback)[^\n]+", message)
    return str(message)


@pytest.fixture(scope="module")
def client() -> Client:
    return Client()


def of_gait(number: int) -> dict[str, Any]:
    gait = GAITS[number - 1]
    shared = {
        "color": gait.color,
        "sign": gait.sign,
        "require": "flyable" if gait.flyable else "valid",
    }
    return {"waypoints": [list(point) for point in gait.angles], **shared}


class TestPlan:
    @pytest.mark.parametrize("number", [1, 4])
    def test_the_paper_gaits_are_what_plan_loop_returns(
        self, client: Client, number: int
    ) -> None:
        state, gait = of_gait(number), GAITS[number - 1]
        answer, plan = client("plan", state), gg.plan_loop(**state)
        assert plan.loop is not None
        stated = plan.as_mapping() | {
            "types": list(plan.gait.types),
            "colors": list(plan.gait.colors),
        }
        expected = json.loads(json.dumps(stated))
        expected["request"] = answer["request"]  # of another accuracy
        assert {name: answer[name] for name in expected} == expected
        assert (answer["flyable"], answer["reachable_from_hover"]) == (
            gait.flyable,
            gait.reachable,
        )
        assert answer["surface"] == f"{gait.color}, {RELATION[gait.sign]}"
        assert answer["verdict"] == plan.report.in_words
        assert plan.report.verdict.endswith(answer["caveat"])
        assert "No limit stated of thrust" in answer["caveat"]
        assert np.abs(np.array(answer["vertices"])[:, 2:] - gait.printed).max() < 1e-3

    def test_the_series_is_the_table_and_the_view_its_vehicle(
        self, client: Client
    ) -> None:
        answer = client(
            "plan", of_gait(3) | {"samples": 40, "period": 2.0, "law": "equal-time"}
        )
        timed = gg.plan_loop(GAIT3.angles, period=2.0, law="equal-time").timed(
            samples=40
        )
        series, alpha = answer["series"], timed.alpha
        for name, values, error in (
            ("t", timed.t, 1e-9), ("alpha", alpha.T, 1e-6), ("rates", timed.rates.T, 1e-6),
            ("R", timed.columns["R"], 1e-10), ("least_singular_value", matrices.least_singular_value(alpha), 1e-9),
            ("hover_thrusts", matrices.hover_thrust_shares(alpha).T, 1e-5),
        ):  # fmt: skip
            assert np.allclose(series[name], values, rtol=0, atol=error), name
        bearings = pytest.approx([0, math.pi / 2, math.pi, 3 * math.pi / 2], abs=1e-6)
        assert answer["vehicle_view"] == {
            "bearings": bearings,
            "clockwise": [True, False, True, False],
            "height": 0.0,
        }

    def test_blue_has_no_hover_thrusts_and_values_as_small_as_rounding(
        self, client: Client
    ) -> None:
        series = client("plan", of_gait(1))["series"]
        assert {value for rotor in series["hover_thrusts"] for value in rotor} == {None}
        alpha = gg.plan_loop(**of_gait(1)).timed(samples=100).alpha
        least, R = (
            matrices.least_singular_value(alpha),
            matrices.level_determinant(alpha, coefficients_of()),
        )
        assert least.max() < 1e-3
        assert np.allclose(
            [series["least_singular_value"], series["R"]],
            [least, R],
            rtol=0,
            atol=1e-10,
        )

    def test_an_empty_and_an_infeasible_state_have_every_name(
        self, client: Client
    ) -> None:
        planned, empty = client("plan", of_gait(3)), client("plan", {})
        none = client(
            "plan", {"waypoints": [[0.5, 0.5]], "color": "red", "sign": "negative"}
        )
        assert set(empty) == set(none) == set(planned)
        assert (empty["status"], none["status"]) == ("empty", "infeasible")
        assert "no flyable loop" in none["reason"]
        assert none["refusals"][0]["nearest"]
        assert empty["series"] is none["series"] is planned["posture"] is None

    @pytest.mark.parametrize(
        ("waypoint", "color", "alpha", "holds"),
        [
            (None, "auto", [0, 0, 0, 0], True),
            ([0.5, 0.5], "red", [0.5, 0.5, 0.5, 0.5], True),
            ([0.3, -0.2], "blue", [0.3, -0.2, DELTA - 0.3, 0.2 - DELTA], False),
        ],
    )  # fmt: skip
    def test_without_a_gait_the_vehicle_stands_as_at_the_first_waypoint(
        self, client: Client, waypoint: Any, color: str, alpha: list[float], holds: bool
    ) -> None:
        asked = (
            {"waypoints": [waypoint, [-0.7, 0.7]], "color": color, "sign": "negative"}
            if waypoint
            else {}
        )
        answer = client("plan", asked)
        posture = answer["posture"]
        assert np.allclose(posture["alpha"], alpha, rtol=0, atol=1e-4)
        if holds:
            assert np.allclose(
                posture["shares"],
                matrices.hover_thrust_shares(alpha),
                rtol=0,
                atol=1e-5,
            )
        else:
            assert posture["shares"] == [None] * 4


def test_the_diagram_is_the_robustness_of_the_plan(client: Client) -> None:
    answer = client("diagram", of_gait(3) | {"eta": 0.9})
    expected = gg.robustness_of(
        gg.plan_loop(GAIT3.angles).gait, bias=0.9, curves=2
    ).sweep[0]
    own, biased = answer["own"], answer["biased"]
    assert (answer["eta"], own["curves"], own["tilt_margin_deg"]) == (0.9, [], 90.0)
    assert math.radians(biased["tilt_margin_deg"]) == pytest.approx(
        expected.tilt_margin, abs=2e-5
    )
    assert biased["acceptable_fraction"] == expected.acceptable.fraction
    assert biased["acceptable_percent"] == percent(expected.acceptable.fraction)
    assert len(biased["curves"]) == 16
    assert np.abs(biased["acceptable"]).max() <= math.pi / 2 + 1e-5


class TestMap:
    def test_the_shading_is_R_with_rows_of_constant_alpha2(
        self, client: Client
    ) -> None:
        answer = client("map", {"shading": "R"})
        axis = np.linspace(-math.pi / 2, math.pi / 2, answer["n"])
        values = np.array(answer["values"]).reshape(len(axis), len(axis))
        for row, column in ((3, 100), (64, 64), (90, 17)):
            a1, a2 = axis[column], axis[row]
            expected = float(
                matrices.level_determinant([a1, a2, a1, a2], coefficients_of())
            )
            assert values[row, column] == pytest.approx(expected, rel=1e-4)
        assert answer["note"] is None

    def test_regions_are_those_of_the_package(self, client: Client) -> None:
        import shapely

        answer = client("map", {"vehicle": "beetle_omni"})
        assert answer["values"] is None
        regions = {region["name"]: region for region in answer["regions"]}
        assert set(regions) == {"R>0", "R<0", "hover", "flyable"}
        flyable = gg.admissible_region(gg.vehicle_named("beetle_omni"))
        drawn = shapely.union_all(
            [shapely.Polygon(ring) for ring in regions["flyable"]["polygons"]]
        )
        assert drawn.area == pytest.approx(flyable.area, rel=5e-3)

    def test_a_region_that_needs_a_missing_constant_is_named(
        self, client: Client, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        unknown = gg.Vehicle(drag_ratio=0.17, max_thrust=12)  # N, without a mass
        monkeypatch.setattr(map_query, "vehicle_of", lambda *_: unknown)
        answer = client("map", {})
        assert [region["name"] for region in answer["regions"]] == [
            "R>0",
            "R<0",
            "hover",
        ]
        assert answer["note"].startswith("The region flyable")
        assert "mass" in answer["note"]

    def test_types_are_those_of_the_graph(self, client: Client) -> None:
        answer = client("map", {"sheet": "blue", "shading": "R"})
        assert "rounding" in answer["note"]
        assert answer["values"] is None  # noise is not shaded
        codes = np.array(answer["types"]["codes"], dtype=object).reshape(17, 17)
        graph = gg.surface_graph("negative")
        blue = {
            (int(node[4:7]), int(node[:3])): data["types"]
            for node, data in graph.nodes(data=True)
            if data["color"] == "blue"
        }
        inside = {
            at: types for at, types in blue.items() if 0 < min(at) and max(at) < 16
        }
        assert len(inside) > 50
        assert {at: codes[at] for at in inside} == inside

    def test_wrong_queries(self, client: Client) -> None:
        for content, named in (
            ({"sheet": "green"}, "sheet"), ({"shading": 3}, "shading"), ({"shade": "R"}, "did you mean 'shading'"),
            ({"drag_ratio": 2}, "drag_ratio"), ([], "request"),
            ({"vehicle": "beetle_omni", "coefficients": "published"}, "coefficients"),
        ):  # fmt: skip
            assert named in client.refused("map", content)


def json_table(**about: Any) -> bytes:
    """Return a gait file of one row, and what it states of its making."""
    columns = {"alpha1": [1.0], "alpha2": [-1.0], "color": ["red"]}
    return json.dumps({"columns": columns, "about": about}).encode()


class TestTables:
    def test_a_good_table(self, client: Client) -> None:
        answer = client.table(
            "gait3.csv", client.file(of_gait(3) | {"samples": 40}, ".csv")[1]
        )
        assert (answer["name"], answer["rows"], answer["valid"], answer["flyable"]) == (
            "gait3.csv",
            41,
            True,
            True,
        )
        assert len(answer["series"]["t"]) == 41
        assert (
            max(answer["series"]["R"])
            < 0
            < min(answer["series"]["least_singular_value"])
        )
        assert answer["verdict"] == "flyable"
        assert np.abs(np.array(answer["corners"])[:, 2:] - GAIT3.printed).max() < 1e-3
        assert (answer["color"], answer["colors"], answer["types"]) == (
            "red",
            ["red"] * 4,
            ["(+,+)"] * 4,
        )
        assert answer["diagram"]["own"] == client("diagram", of_gait(3))["own"]

    def test_a_dropped_statement_is_one_warning(self, client: Client) -> None:
        file = json.loads(client.file(of_gait(3), ".json")[1])
        file["columns"]["alpha1"][20] += 0.1
        with pytest.warns(FileWarning, match="row 21 has alpha1"):
            answer = table_answer("a.json", json.dumps(file).encode())
        told = [one for one in answer["warnings"] if "the stated motion has" in one]
        assert len(told) == 1

    @pytest.mark.parametrize("law", ["smooth", "constant-speed"])
    def test_a_path_is_shown_once_from_its_first_row_to_its_last(
        self, client: Client, tmp_path: Path, law: Any
    ) -> None:
        gait = gg.lift([(-0.4, 0.4), (-0.4, 1.2), (-1.2, 1.2)], "red")
        entry = gg.transition("hover", gait.parametrize(1.0, law=law), samples=30)
        entry.write(tmp_path / "entry.json")
        answer = client.table("entry.json", (tmp_path / "entry.json").read_bytes())
        series, table = answer["series"], entry.table
        assert not any("row" in warning for warning in answer["warnings"])
        assert (series["rows"][0], series["rows"][-1]) == (1, 31)
        np.testing.assert_allclose(series["t"], table["t"], atol=1e-9)
        np.testing.assert_allclose(
            np.transpose(series["alpha"]), table.alpha, atol=1e-6
        )

    def test_between_rows_without_times_the_motion_is_straight(
        self, client: Client
    ) -> None:
        corners = np.array(GAIT3.angles)[:, [0, 1, 0, 1]]
        content = "\n".join(
            [
                "alpha1,alpha2,alpha3,alpha4",
                *(",".join(map(repr, row)) for row in corners.tolist()),
            ]
        )
        answer = client.table("corners.csv", content.encode())
        series, legs = answer["series"], np.vstack([corners, corners[:1]])
        assert (series["rows"][0], series["rows"][-1]) == (1, 5)
        places = np.array(
            [np.interp(series["rows"], range(1, 6), column) for column in legs.T]
        )
        assert np.allclose(series["alpha"], places, rtol=0, atol=1e-6)
        least = matrices.least_singular_value(places.T)
        assert np.allclose(series["least_singular_value"], least, rtol=0, atol=1e-6)
        judged = {"vehicle": "paper", "drag_ratio": None, "coefficients": "published"}
        assert (answer["vehicle"], answer["map"]) == ("paper", judged)

    def test_corners_whose_attitudes_are_drawn_are_bounded(
        self, client: Client, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        rows = b"alpha1,alpha2,alpha3,alpha4\n" + b"1.1,-1.1,1.1,-1.1\n" * 10
        monkeypatch.setattr(table_query, "_MOST_CORNERS", 0)
        diagram = client.table("x.csv", rows)["diagram"]
        assert diagram == {"own": None, "reason": diagram["reason"]}
        assert (
            "got 1. For longer tables: gaitgraph robustness FILE" in diagram["reason"]
        )

    def test_the_request_of_a_downloaded_file_comes_back_as_a_state(
        self, client: Client
    ) -> None:
        state = of_gait(4) | {"drag_ratio": 0.25, "samples": 60, "law": "equal-time"}
        state["keep_out"] = [[[1, 1], [1.2, 1], [1, 1.2]]]
        found = client.table("x.json", client.file(state, ".json")[1])["request"]
        assert {**DEFAULTS, **found} == {**DEFAULTS, **state, "coefficients": "exact"}
        assert client("plan", found)["corners"] == client("plan", state)["corners"]

    def test_a_request_that_the_page_cannot_show_is_left_out(
        self, client: Client
    ) -> None:
        def found(**request: Any) -> Any:
            return client.table(
                "x.json", json_table(request={"waypoints": [[1.0, -1.0]]} | request)
            )["request"]

        shown = {
            "waypoints": [[1.0, -1.0]],
            "law": "equal-time",
            "vehicle": "paper",
            "drag_ratio": None,
        }
        assert found(law="equal-time") == shown
        others: list[dict[str, Any]] = [
            {"floor": 0.2},
            {"vehicle": {"drag_ratio": 0.2}},
        ]
        others += [
            {"waypoints": [[1.0, -1.0]] * 65},
            {"method": "grid", "divisions": 256},
            {"color": "green"},
        ]
        assert [found(**other) for other in others] == [None] * len(others)
        assert found(accuracy=1e-9)["accuracy"] == 1e-5
        assert "divisions" not in found(method="exact", divisions=256)

    def test_no_file_is_read_by_the_name_in_a_table(
        self, client: Client, tmp_path: Path
    ) -> None:
        secret = tmp_path / "secret.toml"
        secret.write_text("drag_ratio = 0.123\n")
        assert "vehicle must be a preset (paper, " in client.table(
            "x.json", json_table(vehicle=str(secret)), 400
        )
        request = {"waypoints": [[1.0, -1.0]], "vehicle": str(secret)}
        assert client.table("x.json", json_table(request=request))["request"] is None

    def test_other_files_are_refused(self, client: Client) -> None:
        for name, content, part in (
            ("gait.txt", b"alpha1\n", "suffix"), ("", b"alpha1\n", "suffix"), ("x.mcap", b"", "folder"),
            ("x.csv", b"\xff\xfe\x00", "UTF-8"), ("x.json", b"[" * 50_000, "nested"),
        ):  # fmt: skip
            assert part in client.table(name, content, 400)


def test_a_certificate_of_the_downloaded_rows_is_offered_or_refused_with_the_reason(
    client: Client, tmp_path: Path
) -> None:
    reasons = {one["suffix"]: one["why_not"] for one in formats_answer()}
    assert reasons[".cert.json"] is None
    for suffix in (".csv", ".cert.json"):
        name, content = client.file(of_gait(3) | {"samples": 8}, suffix)
        assert name == f"gait{suffix}"
        (tmp_path / name).write_bytes(content)
    found = checked(content.decode())["claims"]
    assert {"rate", "hover_thrust"} <= {
        name for name, place in found.items() if not place
    }
    assert verify(tmp_path / "gait.cert.json", tmp_path / "gait.csv")
    refused = client.refused("download", {"state": of_gait(1), "suffix": ".cert.json"})
    assert "not flyable: least singular value" in refused


@pytest.mark.parametrize("suffix", [".json", ".npz", ".h", ".mcap", ".gif"])
def test_downloads_are_files_and_folders_are_zips(
    client: Client, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitgraph.plots.films._FEWEST", 2)
    (listed,) = (one for one in formats_answer() if one["suffix"] == suffix)
    if listed["why_not"]:
        pytest.skip(listed["why_not"])
    name, content = client.file(of_gait(3) | {"samples": 8, "period": 0.2}, suffix)
    assert name.endswith(f"gait{suffix}.zip" if suffix == ".mcap" else f"gait{suffix}")
    if suffix == ".mcap":
        with zipfile.ZipFile(BytesIO(content)) as archive:
            assert archive.testzip() is None
            assert sum(one.endswith(suffix) for one in archive.namelist()) == 1


def test_setup_lists_what_the_page_offers(client: Client) -> None:
    setup = json.loads(client.get(f"/{TOKEN}/api/setup")[2])
    assert setup["version"] == gg.__version__
    assert setup["defaults"] == DEFAULTS
    assert setup["limits"]["waypoints"] == 64
    for command_words in ("objective", "method", "require", "law"):
        assert command_words in setup["words"]
    assert [preset["name"] for preset in setup["presets"]] == gg.vehicle.preset_names()
    for published, gait in zip(GAITS, setup["paper_gaits"], strict=True):
        assert (gait["color"], gait["sign"]) == (published.color, published.sign)
        assert np.allclose(gait["waypoints"], published.angles)
    assert setup["ranges"]["samples"]["allowed"] == "a whole number from 1 to 10000"
    for name, one in setup["ranges"].items():
        for end in (one["low"], one["high"]):
            state_of({name: end, "method": "grid"})
    assert state_of(setup["defaults"] | {"view": {"anything": ["goes"]}}) == state_of(
        {}
    )


def test_the_page_and_its_files(client: Client) -> None:
    status, headers, content = client.get(f"/{TOKEN}/")
    assert status == 200
    assert headers["content-type"].startswith("text/html")
    assert headers.items() >= HEADERS.items()
    assert "unsafe" not in HEADERS["content-security-policy"]
    named = re.findall(r'(?:src|href)="(page/[^"]+)"', content.decode())
    assert named
    for name in named:
        status, headers, _ = client.get(f"/{TOKEN}/{name}")
        assert status == 200, name
        assert headers["x-content-type-options"] == "nosniff"


def test_what_the_page_uses_of_others_has_its_licence_beside_it(client: Client) -> None:
    for name, owner in (("uPlot", "Leon Sorokin"), ("three", "three.js authors")):
        status, _, content = client.get(f"/{TOKEN}/page/vendor/LICENSE-{name}")
        assert status == 200
        assert "MIT License" in content.decode()
        assert owner in content.decode()


class TestGuards:
    def test_a_request_from_elsewhere_is_refused(self, client: Client) -> None:
        for headers, status in (
            ({"origin": f"http://127.0.0.1:{PORT}"}, 200),
            ({"origin": f"http://localhost:{PORT}", "host": f"localhost:{PORT}"}, 200),
            ({"host": f"rebound.example:{PORT}"}, 400), ({"host": f"127.0.0.1.example:{PORT}"}, 400),
            ({"origin": "http://elsewhere.example"}, 403), ({"origin": f"http://127.0.0.1:{PORT + 1}"}, 403),
            ({"origin": f"https://127.0.0.1:{PORT}"}, 403), ({"origin": "null"}, 403),
            ({"content_type": "text/plain"}, 415), ({"content_type": ""}, 415),
        ):  # fmt: skip
            found, answered, _ = client.ask("plan", {}, **headers)
            assert found == status, headers
            assert "access-control-allow-origin" not in answered
            assert answered["content-security-policy"]

    def test_there_is_nothing_else(self, client: Client) -> None:
        for path in (
            "/", f"/{TOKEN}", f"/{TOKEN}x/", f"/{TOKEN[:-1]}/", "//", "/api/setup", f"/{TOKEN}/page/../state.py",
            f"/{TOKEN}/page/%2e%2e/server.py", f"/{TOKEN}/page//etc/passwd", f"/{TOKEN}/page/vendor",
            f"/{TOKEN}/api/nothing", f"/{TOKEN}/api/plan/",
        ):  # fmt: skip
            assert message_of(client.get(path), 404)

    def test_a_body_that_does_not_end_or_is_too_large_is_given_up(
        self, client: Client, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def answered(piece: bytes, count: int) -> Answer:
            pieces = [{"body": piece, "more_body": True}] * count
            request = client.sent(
                "POST", f"/{TOKEN}/api/plan", {"content-type": JSON}, pieces
            )
            return asyncio.run(asyncio.wait_for(request, 30))

        answer = answered(b" " * (64 << 10), 200)
        assert str(LIMITS["bytes"]) in message_of(answer, 413)
        assert answer[1]["connection"] == "close"


@pytest.mark.parametrize(
    ("body", "part"),
    [
        (b"{", "not JSON"), (b"\xff", "not JSON"), (b"null", "a table of values"), (b'{"period": 1e999}', "period"),
        (b'{"waypoints": [[NaN, 0]]}', "NaN"), (b"[" * 100_000, "nested"),
        (b'{"period": ' + b"9" * 5000 + b"}", "not JSON"),
        *((json.dumps({field: value}).encode(), field.removesuffix("s")) for field, value in (
            ("waypoints", "0,0"), ("waypoints", [[0.1, 0.2]] * 65), ("waypoints", [[2, 0]]), ("color", "green"),
            ("method", ["grid"]), ("keep_out", [[[0, 0]] * 65]), ("keep_in", [1]), ("period", None),
            ("keep_out", [[[0, 0], [0.1, 0], [0, 0.1]]] * 33), ("vehicle", "/etc/vehicle.toml"), ("samples", 10_001),
            ("vehicle", {"drag_ratio": 0.1}), ("drag_ratio", 0.019), ("drag_ratio", True), ("accuracy", 0.9e-5),
            ("coefficients", "rounded"), ("samples", 1.5), ("eta", 0), ("eta", 1.1), ("nothing", 0),
        )),
    ],
    ids=lambda value: str(value)[:30],
)  # fmt: skip
def test_malformed_states_and_wrong_fields_are_named(
    client: Client, body: bytes, part: str
) -> None:
    assert part in client.refused("plan", body)


class TestJobs:
    def test_two_at_once(self, monkeypatch: pytest.MonkeyPatch) -> None:
        running: list[object] = []
        most: list[int] = []

        def slow(request: Any, progress: Any) -> Any:
            running.append(request)
            most.append(len(running))
            time.sleep(0.05)
            running.remove(request)
            raise gg.InputError("done")

        monkeypatch.setattr(queries, "plan", slow)

        async def all_of_them() -> None:
            other = Client()
            bodies = [
                json.dumps({"waypoints": [[0.3 + k / 100, -0.4]]}).encode()
                for k in range(6)
            ]
            path, headers = f"/{TOKEN}/api/plan", {"content-type": JSON}
            await asyncio.gather(
                *(other.sent("POST", path, headers, [{"body": one}]) for one in bodies)
            )

        asyncio.run(all_of_them())
        assert max(most) == 2

    def test_work_is_stopped_when_it_takes_too_long_or_the_client_is_gone(
        self, client: Client, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        stopped: list[str] = []

        def endless(request: Any, progress: Any) -> Any:
            try:
                while True:
                    progress("still at it")
                    time.sleep(0.001)
            except HTTPException as error:
                stopped.append(error.detail)
                raise

        monkeypatch.setattr(queries, "plan", endless)
        client.ask("plan", {"waypoints": [[0.32, -0.42]]}, {"type": "http.disconnect"})
        assert stopped == ["the client disconnected"]
        monkeypatch.setattr(server, "LONGEST_WORK", 0.05)
        assert "longer than 0.05 s" in client.refused(
            "plan", {"waypoints": [[0.31, -0.41]]}, 503
        )

    def test_all_work_can_be_stopped(self) -> None:
        class Enough(Exception):
            pass

        def stop(*_: object) -> None:
            raise Enough

        rows = b"alpha1,alpha2,alpha3,alpha4\n" + b"1.1,-1.1,1.1,-1.1\n" * 3
        state = {"waypoints": [[0.36, -0.46]]}
        known: list[tuple[Any, ...]] = [
            (queries.diagram_answer, state),
            (file_answer, {"state": state, "suffix": ".csv"}),
        ]
        others: list[tuple[Any, ...]] = [
            (queries.plan_answer, state),
            (map_answer, {}),
            (table_answer, "x.csv", rows),
        ]
        for calls in (known + others, known):
            for work, *values in calls:
                with pytest.raises(Enough):
                    work(*values, stop)
            queries.planned(state_of(state))  # what is known already is no excuse

    def test_an_unexpected_error_is_one_line_and_the_server_lives_on(
        self,
        client: Client,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        def broken(request: Any, progress: Any) -> Any:
            raise ZeroDivisionError("a\nb")

        with monkeypatch.context() as patch:
            patch.setattr(queries, "plan", broken)
            assert "ZeroDivisionError: a b" in client.refused(
                "plan", {"waypoints": [[0.33, -0.43]]}, 500
            )
        assert capsys.readouterr().err == "gaitgraph: plan: ZeroDivisionError: a b\n"
        assert client("plan", {"waypoints": [[0.33, -0.43]]})["status"] == "planned"


class TestCommand:
    def test_a_real_server_is_asked_and_interrupted(self) -> None:
        command = [sys.executable, "-m", "gaitgraph", "explore", "--no-browser"]
        pipes: dict[str, Any] = {
            "stdout": subprocess.PIPE,
            "stderr": subprocess.PIPE,
            "text": True,
        }
        with subprocess.Popen(
            command, env=os.environ | {"PYTHONUNBUFFERED": ""}, **pipes
        ) as process:
            try:
                assert process.stdout is not None
                address = process.stdout.readline().strip()
                assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", address)
                with urlopen(address) as page:
                    assert b"<html" in page.read()
                body = json.dumps(of_gait(3)).encode()
                request = Request(
                    f"{address}api/plan", body, {"Content-Type": "application/json"}
                )
                with urlopen(request) as answer:
                    assert json.load(answer)["flyable"] is True
                process.send_signal(signal.SIGINT)
                out, err = process.communicate(timeout=60)
            finally:
                process.kill()
        assert process.returncode == 130
        assert (out, err) == ("", "gaitgraph: interrupted\n")

    def test_a_port_that_is_taken(self, run: Any) -> None:
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            done = run("explore", "--no-browser", "--port", taken.getsockname()[1])
        assert (done.code, done.out) == (2, "")
        assert "port must be a free port, or 0 for any" in done.err
        assert done.err.count("\n") == 1

    def test_the_browser_is_opened_and_may_fail(
        self, run: Any, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        opened: Queue[str] = Queue()

        def show(address: str) -> bool:
            opened.put(address)
            raise webbrowser.Error("no browser")

        monkeypatch.setattr(webbrowser, "open", show)
        monkeypatch.setattr(server.Server, "run", lambda self: None)
        done = run("explore")
        assert done.code == 0
        assert opened.get(timeout=10) == done.out.strip()
