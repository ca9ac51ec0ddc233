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
import threading
import time
import webbrowser
import zipfile
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, unquote
from urllib.request import Request, urlopen

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.explorer import queries, server
from gaitgraph.explorer.queries import DEFAULTS, LIMITS, map_answer, state_of
from gaitgraph.explorer.server import HEADERS, Refused, application
from gaitgraph.explorer.table_query import file_answer, formats_answer, table_answer
from gaitgraph.plots.vehicles import vehicle_view
from tests.published import GAITS

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    Pairs = Iterable[tuple[str, str]]

PORT, TOKEN = 8000, "a-token-of-some-length"
GAIT3 = GAITS[2]
ADDRESS = f"http://127.0.0.1:{PORT}"
JSON, BYTES = "application/json", "application/octet-stream"


@dataclass(frozen=True)
class Answer:
    status: int
    headers: dict[str, str]
    content: bytes

    def json(self) -> Any:
        return json.loads(self.content)


async def answer_to(
    app: Any, method: str, path: str, headers: Pairs, messages: list[dict[str, Any]] | None = None
) -> Answer:
    """Send a request to the application itself: the path as it stands, any headers, a body in any pieces."""
    sent: list[Any] = []
    waiting = list(messages or [])

    async def receive() -> Any:
        if not waiting:
            await asyncio.Event().wait()
        return waiting.pop(0)

    async def send(message: Any) -> None:
        sent.append(message)

    place, _, query = path.partition("?")
    stated = list(headers)
    if all(name != "host" for name, _ in stated):
        stated.append(("host", f"127.0.0.1:{PORT}"))
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": unquote(place),
        "raw_path": place.encode(),
        "query_string": query.encode(),
        "root_path": "",
        "headers": [(name.encode(), value.encode()) for name, value in stated],
        "client": ("127.0.0.1", 5000),
        "server": ("127.0.0.1", PORT),
    }
    await app(scope, receive, send)
    start = sent[0]
    found = {name.decode(): value.decode() for name, value in start["headers"]}
    return Answer(start["status"], found, b"".join(message.get("body", b"") for message in sent[1:]))


class Client:
    """Sends requests as the page does, or as nobody should."""

    def __init__(self) -> None:
        self.app = application(TOKEN, PORT)

    def send(self, method: str, path: str, headers: Pairs = (), body: bytes = b"") -> Answer:
        messages = [{"type": "http.request", "body": body, "more_body": False}]
        stated = [*headers, *([("content-length", str(len(body)))] if body else [])]
        return asyncio.run(answer_to(self.app, method, path, stated, messages))

    def get(self, name: str, headers: Pairs = ()) -> Answer:
        return self.send("GET", f"/{TOKEN}/{name}", headers)

    def post(self, name: str, content: Any) -> Answer:
        return self.raw(name, json.dumps(content).encode())

    def raw(self, name: str, body: bytes, kind: str = JSON) -> Answer:
        return self.send("POST", f"/{TOKEN}/api/{name}", [("content-type", kind)], body)

    def __call__(self, name: str, content: Any) -> Any:
        answer = self.post(name, content)
        assert answer.status == 200, answer.content[:500]
        return answer.json()

    def refused(self, name: str, content: Any) -> str:
        return message_of(self.post(name, content), 400)

    def table(self, name: str, content: bytes) -> Answer:
        return self.raw(f"table?name={quote(name)}", content, BYTES)

    def file(self, state: dict[str, Any], suffix: str) -> Answer:
        return self.post("download", {"state": state, "suffix": suffix})


@pytest.fixture(scope="module")
def client() -> Client:
    return Client()


def message_of(answer: Answer, status: int) -> str:
    """Return the one line of a refusal."""
    assert answer.status == status, (answer.status, answer.content[:300])
    content = answer.json()
    assert list(content) == ["error"]
    message = content["error"]
    assert isinstance(message, str)
    assert message
    assert "\n" not in message
    assert "Traceback" not in message
    return message


def of_gait(number: int) -> dict[str, Any]:
    gait = GAITS[number - 1]
    return {"waypoints": [list(point) for point in gait.angles], "color": gait.color, "sign": gait.sign}


class TestPlan:
    @pytest.mark.parametrize("number", [1, 2, 3, 4])
    def test_the_paper_gaits_are_what_plan_loop_returns(self, client: Client, number: int) -> None:
        state, gait = of_gait(number), GAITS[number - 1]
        answer, plan = client("plan", state), gg.plan_loop(gait.angles, color=gait.color, sign=gait.sign)
        assert plan.loop is not None
        assert answer["status"] == "planned"
        assert (answer["flyable"], answer["reachable_from_hover"]) == (gait.flyable, gait.reachable)
        assert answer["corners"] == plan.gait.alpha.tolist()
        assert answer["vertices"] == plan.gait.vertices().tolist()
        assert np.abs(np.array(answer["vertices"])[:, 2:] - gait.printed).max() < 1e-3
        assert answer["types"] == list(plan.gait.types)
        assert answer["length"] == plan.loop.length
        assert answer["reason"] == plan.reason
        assert (answer["reason"] is None) == gait.flyable
        assert np.allclose(answer["path"], [*gait.angles, gait.angles[0]], atol=1e-6)
        for check, shown in zip(plan.report.checks, answer["checks"], strict=True):
            assert (shown["name"], shown["ok"], shown["message"]) == (check.name, check.ok, check.message)
            assert shown["mark"] == {"ok": "ok", "NO": "no", "??": "undecided"}[check.mark]
            assert "_" not in shown["title"]
        worst = next(check for check in answer["checks"] if check["name"] == "least_singular_value")
        assert [worst["where"][f"alpha{k}"] for k in (1, 2, 3, 4)] == plan.report["least_singular_value"].where["alpha"]  # type: ignore[index]

    def test_the_series_is_the_table_and_the_scene_its_vehicle(self, client: Client) -> None:
        answer = client("plan", of_gait(3) | {"samples": 40, "period": 2.0, "law": "equal-time"})
        timed = gg.plan_loop(GAIT3.angles, period=2.0, law="equal-time").timed(samples=40)
        series = answer["series"]
        assert np.allclose(series["t"], timed.t)
        assert np.allclose(np.transpose(series["alpha"]), timed.alpha, atol=1e-6)
        assert np.allclose(np.transpose(series["rates"]), timed.rates, atol=1e-6)
        assert np.allclose(series["R"], timed.columns()["R"], atol=1e-6)
        assert np.allclose(
            series["least_singular_value"], gg.invertibility.least_singular_value(timed.alpha), atol=1e-6
        )
        assert np.allclose(
            np.transpose(series["hover_thrusts"]), gg.invertibility.hover_thrust_shares(timed.alpha), atol=1e-5
        )
        view = vehicle_view(timed.alpha).as_mapping(decimals=1)
        assert answer["scene"]["t"] == series["t"]
        assert answer["scene"]["rotors"] == view["rotors"]

    def test_blue_has_no_hover_thrusts_and_values_as_small_as_rounding(self, client: Client) -> None:
        series = client("plan", of_gait(1))["series"]
        assert {value for rotor in series["hover_thrusts"] for value in rotor} == {None}
        alpha = gg.plan_loop(GAITS[0].angles, color="blue", sign=GAITS[0].sign).timed(samples=100).alpha
        least = gg.invertibility.least_singular_value(alpha)
        assert least.max() < 1e-3
        assert np.allclose(series["least_singular_value"], least, rtol=0, atol=1e-10)
        assert np.allclose(
            series["R"],
            gg.invertibility.level_determinant(alpha, gg.invertibility.coefficients_of()),
            rtol=0,
            atol=1e-10,
        )

    def test_an_empty_and_an_infeasible_state_have_every_name(self, client: Client) -> None:
        planned, empty = client("plan", of_gait(3)), client("plan", {})
        none = client("plan", {"waypoints": [[0.5, 0.5]], "color": "red", "sign": "negative"})
        assert set(empty) == set(none) == set(planned)
        assert (empty["status"], none["status"]) == ("empty", "infeasible")
        assert "no closed loop" in none["reason"]
        assert none["obstacles"][0]["nearest"]
        assert empty["series"] is none["scene"] is None


class TestDiagram:
    def test_it_is_the_robustness_of_the_plan(self, client: Client) -> None:
        answer = client("diagram", of_gait(3) | {"eta": 0.9})
        found = gg.robustness_of(gg.plan_loop(GAIT3.angles).gait, bias=0.9, tolerance=1e-4, curves=2)
        assert answer["eta"] == 0.9
        assert answer["own"]["curves"] == []
        assert answer["own"]["tilt_margin_deg"] == 90.0
        biased = found.sweep[0]
        assert biased.tilt_margin is not None
        assert answer["biased"]["tilt_margin_deg"] == pytest.approx(math.degrees(biased.tilt_margin), abs=1e-3)
        assert answer["biased"]["acceptable_fraction"] == pytest.approx(biased.acceptable.fraction, abs=2e-4)
        assert len(answer["biased"]["curves"]) == 16
        assert np.abs(answer["biased"]["acceptable"]).max() <= math.pi / 2 + 1e-5


class TestMap:
    def test_the_shading_is_R_with_rows_of_constant_alpha2(self, client: Client) -> None:
        answer = client("map", {"shading": "R"})
        n = answer["n"]
        axis = np.linspace(-math.pi / 2, math.pi / 2, n)
        values = np.array(answer["values"]).reshape(n, n)
        for row, column in ((3, 100), (64, 64), (90, 17)):
            a1, a2 = axis[column], axis[row]
            expected = float(gg.invertibility.level_determinant([a1, a2, a1, a2], gg.invertibility.coefficients_of()))
            assert values[row, column] == pytest.approx(expected, rel=1e-4)
        assert answer["range"] == pytest.approx([values.min(), values.max()], rel=1e-4)
        assert answer["note"] is None

    def test_regions_are_those_of_the_package(self, client: Client) -> None:
        import shapely

        answer = client("map", {"vehicle": "beetle_omni"})
        assert answer["values"] is answer["range"] is None
        regions = {region["name"]: region for region in answer["regions"]}
        assert set(regions) == {"R>0", "R<0", "hover", "flyable"}
        flyable = gg.admissible_region(gg.vehicle_named("beetle_omni"))
        drawn = shapely.union_all([shapely.Polygon(ring) for ring in regions["flyable"]["polygons"]])
        assert drawn.area == pytest.approx(flyable.area, rel=5e-3)

    def test_types_are_those_of_the_graph(self, client: Client) -> None:
        answer = client("map", {"sheet": "blue"})
        assert "rounding" in answer["note"]
        codes = np.array(answer["types"]["codes"], dtype=object).reshape(17, 17)
        graph = gg.surface_graph("negative")
        k = 0
        for node, data in graph.nodes(data=True):
            i, j = node[:2]
            if data["color"] == "blue" and 0 < i < 16 and 0 < j < 16:
                assert codes[j, i] == data["types"], node
                k += 1
        assert k > 50

    @pytest.mark.parametrize(
        ("content", "named"),
        [
            ({"sheet": "green"}, "sheet"),
            ({"shading": 3}, "shading"),
            ({"shade": "R"}, "did you mean 'shading'"),
            ({"drag_ratio": 2}, "drag_ratio"),
            ({"vehicle": "beetle_omni", "coefficients": "published"}, "coefficients"),
            ([], "request"),
        ],
    )
    def test_wrong_questions(self, client: Client, content: Any, named: str) -> None:
        assert named in client.refused("map", content)


class TestTables:
    def gait3(self, tmp_path: Path, suffix: str = ".csv") -> bytes:
        path = tmp_path / f"gait{suffix}"
        plan = gg.plan_loop(GAIT3.angles)
        plan.timed(samples=40).write(path)
        return path.read_bytes()

    def test_a_good_table(self, client: Client, tmp_path: Path) -> None:
        answer = client.table("gait3.csv", self.gait3(tmp_path)).json()
        assert (answer["name"], answer["rows"], answer["valid"], answer["flyable"]) == ("gait3.csv", 41, True, True)
        assert answer["broken"] == []
        assert len(answer["path"]) == len(answer["series"]["t"]) == 41
        assert answer["path"][0] == answer["path"][-1]
        assert max(answer["series"]["R"]) < 0 < min(answer["series"]["least_singular_value"])
        assert answer["scene"]["t"] == answer["series"]["t"]
        assert np.abs(np.array(answer["corners"])[:, 2:] - GAIT3.printed).max() < 1e-3

    def test_each_run_of_broken_rows_is_marked_once(self, client: Client) -> None:
        t = np.arange(600) * 2 * math.pi / 600
        alpha = np.column_stack([0.8 + 0.1 * np.cos(t), -0.8 + 0.1 * np.sin(t)])
        alpha = np.hstack([alpha, alpha])
        alpha[100:130, 2] += 0.05
        alpha[117, 2] += 0.03
        alpha[300, 3] += 0.2
        alpha[400:402, 2] -= 0.1
        rows = [",".join(f"{x:.6f}" for x in row) for row in alpha]
        answer = client.table("x.csv", "\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]).encode()).json()
        runs = [one for one in answer["broken"] if one["message"].startswith("on surface broken")]
        assert [one["message"].partition(": ")[2] for one in runs] == [
            "rows 101 to 130, the worst row 118",
            next(one["message"].partition(": ")[2] for one in runs if "401" in one["message"]),
        ]
        assert runs[0]["alpha1"] == pytest.approx(alpha[117, 0], abs=1e-6)
        first = next(check for check in answer["checks"] if check["name"] == "on_surface")["where"]
        assert first["row"] in (300, 301)  # the third run has the check's own mark
        alpha[::5, 2] += 0.3
        rows = [",".join(f"{x:.6f}" for x in row) for row in alpha]
        many = client.table("x.csv", "\n".join(["alpha1,alpha2,alpha3,alpha4", *rows]).encode()).json()["broken"]
        assert 50 <= len(many) <= 60

    def test_rows_are_bounded(self, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(LIMITS, "rows", 10)
        rows = b"alpha1,alpha2,alpha3,alpha4\n" + b"1.1,-1.1,1.1,-1.1\n" * 11
        assert "at most 10 rows" in message_of(client.table("x.csv", rows), 400)
        assert client.table("x.csv", rows[:-18]).json()["rows"] == 10

    def test_the_request_of_a_downloaded_file_comes_back_as_a_state(self, client: Client) -> None:
        state = of_gait(4) | {
            "drag_ratio": 0.25,
            "samples": 60,
            "law": "equal-time",
            "keep_out": [[[1, 1], [1.2, 1], [1, 1.2]]],
        }
        found = client.table("x.json", client.file(state, ".json").content).json()["request"]
        assert {**DEFAULTS, **found} == {**DEFAULTS, **state, "coefficients": "exact"}
        answer, again = client("plan", state), client("plan", found)
        assert again["corners"] == answer["corners"]

    def test_a_request_that_the_page_cannot_show_is_left_out(self, client: Client) -> None:
        def found(**request: Any) -> Any:
            request = {"waypoints": [[1.0, -1.0]]} | request
            table = {"columns": {"alpha1": [1.0], "alpha2": [-1.0], "color": ["red"]}, "about": {"request": request}}
            return client.table("x.json", json.dumps(table).encode()).json()["request"]

        assert found(sheets="planes", law="equal-time") == {
            "waypoints": [[1.0, -1.0]],
            "law": "equal-time",
            "vehicle": "paper",
            "drag_ratio": None,
        }
        assert found(sheets="all") is None
        assert found(floor=0.2) is None
        assert found(vehicle={"drag_ratio": 0.2}) is None
        assert found(waypoints=[[1.0, -1.0]] * 65) is None
        assert found(accuracy=1e-9)["accuracy"] == 1e-5
        assert "divisions" not in found(method="exact", divisions=256)
        assert found(method="grid", divisions=256) is None
        assert found(color="green") is None

    def test_no_file_is_read_by_the_name_in_a_table(self, client: Client, tmp_path: Path) -> None:
        secret = tmp_path / "secret.toml"
        secret.write_text("drag_ratio = 0.123\n")
        for about in ({"vehicle": str(secret)}, {"request": {"waypoints": [[1.0, -1.0]], "vehicle": str(secret)}}):
            table = {"columns": {"alpha1": [1.0], "alpha2": [-1.0], "color": ["red"]}, "about": about}
            answer = client.table("x.json", json.dumps(table).encode())
            if "vehicle" in about:
                assert "vehicle must be one of paper" in message_of(answer, 400)
            else:
                assert answer.json()["request"] is None

    @pytest.mark.parametrize(
        ("name", "content", "part"),
        [
            ("gait.txt", b"alpha1\n", "suffix"),
            ("gait", b"alpha1\n", "suffix"),
            ("", b"alpha1\n", "name"),
            ("x.mcap", b"", "folder"),
            ("x.csv", b"", "empty"),
            ("x.csv", b"alpha1,alpha2\n1,2\n", "alpha3"),
            ("x.csv", b"\xff\xfe\x00", "UTF-8"),
            ("x.json", b"[" * 50_000, "nested"),
            ("x.npz", b"PK\x03\x04nonsense", "x.npz"),
            ("x.mat", b"MATLAB 5.0", "x.mat"),
        ],
    )
    def test_other_files_are_refused(self, client: Client, name: str, content: bytes, part: str) -> None:
        assert part in message_of(client.table(name, content), 400)


class TestDownload:
    @pytest.mark.parametrize("suffix", [".json", ".npz", ".h", ".mcap", ".gif"])
    def test_formats_come_as_files_and_folders_as_zips(self, client: Client, suffix: str) -> None:
        (listed,) = (one for one in formats_answer() if one["suffix"] == suffix)
        if not listed["available"]:
            pytest.skip(listed["why_not"])
        answer = client.file(of_gait(3) | {"samples": 8}, suffix)
        assert answer.status == 200, answer.content[:300]
        name = answer.headers["content-disposition"].partition("filename=")[2]
        assert name.endswith(f"gait{suffix}.zip" if suffix == ".mcap" else f"gait{suffix}")
        if suffix == ".mcap":
            with zipfile.ZipFile(BytesIO(answer.content)) as archive:
                assert archive.testzip() is None
                assert sum(one.endswith(suffix) for one in archive.namelist()) == 1


def test_setup_lists_what_the_page_offers(client: Client) -> None:
    setup = client.get("api/setup").json()
    assert setup["version"] == gg.__version__
    assert setup["defaults"] == DEFAULTS
    assert setup["limits"]["waypoints"] == 64
    assert [preset["name"] for preset in setup["presets"]] == gg.vehicle.preset_names()
    for published, listed_gait in zip(GAITS, setup["paper_gaits"], strict=True):
        assert listed_gait["color"] == published.color
        assert listed_gait["sign"] == published.sign
        assert np.allclose(listed_gait["waypoints"], published.angles)
    assert setup["ranges"]["samples"]["allowed"] == "a whole number from 1 to 10000"
    for name, one in setup["ranges"].items():
        assert state_of({name: one["high"], "method": "grid"}).empty
        if not one["above"]:
            assert state_of({name: one["low"], "method": "grid"}).empty
    assert state_of(setup["defaults"]).empty
    assert state_of(setup["defaults"] | {"view": {"anything": ["goes"]}}).empty


class TestPages:
    def test_the_page_and_its_files(self, client: Client) -> None:
        page = client.get("")
        assert page.status == 200
        assert page.headers["content-type"].startswith("text/html")
        for name, value in HEADERS.items():
            assert page.headers[name] == value
        assert "unsafe" not in HEADERS["content-security-policy"]
        named = re.findall(r'(?:src|href)="(page/[^"]+)"', page.content.decode())
        assert named
        for name in named:
            answer = client.get(name)
            assert answer.status == 200, name
            assert answer.headers["x-content-type-options"] == "nosniff"


class TestGuards:
    @pytest.mark.parametrize(
        ("headers", "status"),
        [
            ({"origin": ADDRESS}, 200),
            ({"origin": f"http://localhost:{PORT}", "host": f"localhost:{PORT}"}, 200),
            ({"host": f"rebound.example:{PORT}"}, 400),
            ({"host": f"127.0.0.1.example:{PORT}"}, 400),
            ({"origin": "http://elsewhere.example"}, 403),
            ({"origin": f"http://127.0.0.1:{PORT + 1}"}, 403),
            ({"origin": f"https://127.0.0.1:{PORT}"}, 403),
            ({"origin": "null"}, 403),
            ({"content-type": "text/plain"}, 415),
            ({"content-type": ""}, 415),
        ],
    )
    def test_a_request_from_elsewhere_is_refused(self, client: Client, headers: dict[str, str], status: int) -> None:
        stated = {"content-type": JSON} | headers
        messages = [{"type": "http.request", "body": b"{}", "more_body": False}]
        answer = asyncio.run(answer_to(client.app, "POST", f"/{TOKEN}/api/plan", stated.items(), messages))
        assert answer.status == status
        assert "access-control-allow-origin" not in answer.headers
        assert answer.headers["content-security-policy"]

    @pytest.mark.parametrize(
        "path",
        [
            "/", f"/{TOKEN}", f"/{TOKEN}x/", f"/{TOKEN[:-1]}/", "//", "/api/setup", f"/{TOKEN}/page/../state.py",
            f"/{TOKEN}/page/%2e%2e/server.py", f"/{TOKEN}/page//etc/passwd", f"/{TOKEN}/page/vendor",
            f"/{TOKEN}/api/nothing", f"/{TOKEN}/api/plan/",
        ],
    )  # fmt: skip
    def test_there_is_nothing_else(self, client: Client, path: str) -> None:
        answer = client.send("GET", path)
        assert message_of(answer, 404)
        assert answer.headers["content-security-policy"].startswith("default-src 'none'")

    def test_a_body_that_does_not_end_is_given_up(self, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(server, "LONGEST_BODY", 0.02)
        messages = [{"type": "http.request", "body": b"{", "more_body": True}]
        request = answer_to(client.app, "POST", f"/{TOKEN}/api/plan", [("content-type", JSON)], messages)
        answer = asyncio.run(asyncio.wait_for(request, 30))
        assert "0.02 s" in message_of(answer, 408)
        assert answer.headers["connection"] == "close"

    def test_bodies_are_counted_while_they_are_read(self, client: Client) -> None:
        piece = b" " * (64 << 10)
        messages: list[dict[str, Any]] = [{"type": "http.request", "body": piece, "more_body": True}] * 100
        path, headers = f"/{TOKEN}/api/plan", [("content-type", JSON)]
        answer = asyncio.run(answer_to(client.app, "POST", path, headers, messages))
        assert str(LIMITS["request_bytes"]) in message_of(answer, 413)


class TestBadQuestions:
    @pytest.mark.parametrize(
        ("body", "part"),
        [
            (b"{", "not JSON"),
            (b"\xff", "not JSON"),
            (b"null", "must be an object"),
            (b'{"waypoints": [[NaN, 0]]}', "nan"),
            (b'{"period": 1e999}', "period must be"),
            (b"[" * 100_000, "nested"),
            (b'{"period": ' + b"9" * 5000 + b"}", "not JSON"),
        ],
    )
    def test_malformed(self, client: Client, body: bytes, part: str) -> None:
        assert part in message_of(client.raw("plan", body), 400)

    @pytest.mark.parametrize(
        ("field", "value"),
        [
            ("waypoints", "0,0"),
            ("waypoints", [[0.1, 0.2]] * 65),
            ("waypoints", [[2, 0]]),
            ("color", "green"),
            ("method", ["grid"]),
            ("keep_out", [[[0, 0]] * 65]),
            ("keep_out", [[[0, 0], [0.1, 0], [0, 0.1]]] * 33),
            ("keep_in", [1]),
            ("vehicle", "/etc/vehicle.toml"),
            ("vehicle", {"drag_ratio": 0.1}),
            ("drag_ratio", 0.019),
            ("drag_ratio", True),
            ("coefficients", "rounded"),
            ("accuracy", 0.9e-5),
            ("period", None),
            ("samples", 10_001),
            ("samples", 1.5),
            ("eta", 0),
            ("eta", 1.1),
            ("nothing", 0),
        ],
    )
    def test_a_wrong_field_is_named(self, client: Client, field: str, value: Any) -> None:
        message = client.refused("plan", {field: value})
        assert field.removesuffix("s") in message


class TestJobs:
    def test_two_at_once(self, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
        lock, running, most = threading.Lock(), [0], [0]

        def slow(request: Any, progress: Any) -> Any:
            with lock:
                running[0] += 1
                most[0] = max(most[0], running[0])
            time.sleep(0.05)
            with lock:
                running[0] -= 1
            raise gg.InputError("done")

        monkeypatch.setattr(queries, "plan", slow)

        async def all_of_them() -> None:
            app = application(TOKEN, PORT)
            bodies = [json.dumps({"waypoints": [[0.3 + k / 100, -0.4]]}).encode() for k in range(6)]
            path, headers = f"/{TOKEN}/api/plan", [("content-type", JSON)]
            await asyncio.gather(
                *(answer_to(app, "POST", path, headers, [{"type": "http.request", "body": one}]) for one in bodies)
            )

        asyncio.run(all_of_them())
        assert most == [2]

    def test_work_is_stopped_when_it_takes_too_long(self, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
        def endless(request: Any, progress: Any) -> Any:
            while True:
                progress("still at it")

        monkeypatch.setattr(queries, "plan", endless)
        monkeypatch.setattr(server, "LONGEST_WORK", 0.05)
        answer = client.post("plan", {"waypoints": [[0.31, -0.41]]})
        assert "longer than 0.05 s" in message_of(answer, 503)

    def test_all_work_can_be_stopped(self) -> None:
        class Enough(Exception):
            pass

        def stop(*_: object) -> None:
            raise Enough

        rows = b"alpha1,alpha2,alpha3,alpha4\n" + b"1.1,-1.1,1.1,-1.1\n" * 3
        state = state_of({"waypoints": [[0.36, -0.46]]})
        for work in (
            lambda: queries.plan_answer(state, stop),
            lambda: queries.diagram_answer(state, stop),
            lambda: map_answer({}, stop),
            lambda: table_answer("x.csv", rows, stop),
            lambda: file_answer(state, ".csv", stop),
        ):
            with pytest.raises(Enough):
                work()
        queries.planned(state)  # what is known already is no excuse
        for work in (lambda: queries.diagram_answer(state, stop), lambda: file_answer(state, ".csv", stop)):
            with pytest.raises(Enough):
                work()

    def test_work_is_stopped_when_the_client_is_gone(self, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
        stopped: list[str] = []

        def endless(request: Any, progress: Any) -> Any:
            try:
                while True:
                    progress("still at it")
                    time.sleep(0.001)
            except Refused as error:
                stopped.append(str(error))
                raise

        monkeypatch.setattr(queries, "plan", endless)
        body = b'{"waypoints": [[0.32, -0.42]]}'
        messages: list[dict[str, Any]] = [{"type": "http.request", "body": body}, {"type": "http.disconnect"}]
        asyncio.run(answer_to(client.app, "POST", f"/{TOKEN}/api/plan", [("content-type", JSON)], messages))
        assert stopped == ["the client has left"]

    def test_an_unexpected_error_is_one_line_and_the_server_lives_on(
        self, client: Client, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        def broken(request: Any, progress: Any) -> Any:
            raise ZeroDivisionError("a\nb")

        with monkeypatch.context() as patch:
            patch.setattr(queries, "plan", broken)
            message = message_of(client.post("plan", {"waypoints": [[0.33, -0.43]]}), 500)
        assert "ZeroDivisionError: a b" in message
        assert capsys.readouterr().err == "gaitgraph: plan: ZeroDivisionError: a b\n"
        assert client("plan", {"waypoints": [[0.33, -0.43]]})["status"] == "planned"


class TestCommand:
    def test_a_real_server_is_asked_and_interrupted(self) -> None:
        command = [sys.executable, "-m", "gaitgraph", "explore", "--no-browser"]
        environment = os.environ | {"PYTHONUNBUFFERED": ""}
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
        ) as process:
            try:
                assert process.stdout is not None
                address = process.stdout.readline().strip()
                assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", address)
                with urlopen(address) as page:
                    assert b"<html" in page.read()
                body = json.dumps(of_gait(3)).encode()
                request = Request(f"{address}api/plan", body, {"Content-Type": "application/json"})
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
        assert "--port must be a free port, or 0 for any" in done.err
        assert done.err.count("\n") == 1

    def test_the_browser_is_opened_and_may_fail(self, run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        opened: list[str] = []
        called = threading.Event()

        def show(address: str) -> bool:
            opened.append(address)
            called.set()
            raise webbrowser.Error("no browser")

        monkeypatch.setattr(webbrowser, "open", show)
        monkeypatch.setattr(server.Server, "run", lambda self: called.wait(10))
        done = run("explore")
        assert done.code == 0
        assert opened == [done.out.strip()]
