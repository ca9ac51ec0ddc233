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
from urllib.parse import unquote
from urllib.request import Request, urlopen

import numpy as np
import pytest
import shapely
from starlette.exceptions import HTTPException

import gaitgraph as gg
from gaitgraph.certificates import verify
from gaitgraph.explorer import map_query, queries, server, table_query
from gaitgraph.explorer.map_query import map_answer
from gaitgraph.explorer.queries import diagram_answer, plan_answer
from gaitgraph.explorer.server import HEADERS, application, setup_answer
from gaitgraph.explorer.state import DEFAULTS, state_of
from gaitgraph.explorer.table_query import file_answer, formats_answer, table_answer
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.error_margins import servo_margins_found
from gaitgraph.invertibility.forms import rotors_of
from gaitgraph.surface.curved import sheet_of
from gaitgraph.surface.curved_region import sheet_region
from gaitgraph.surface.sheets import SIGNS
from gaitgraph.tolerances import DEFAULT_FLOOR
from gaitgraph.vehicle import vehicle_named
from tests.published import GAITS
from tests.samples import LEANING, ODD, cases, on_red

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

PORT, TOKEN = 8000, "a-token-of-some-length"
SERVED = f"127.0.0.1:{PORT}"
JSON = "application/json"
PLAN = f"/{TOKEN}/api/plan"
DELTA = 2 * coefficients_of().delta  # between the sheets
REFUSED = {"waypoints": [[0.5, 0.5]], "color": "red", "sign": "negative"}
HEAD = b"alpha1,alpha2,alpha3,alpha4\n"
AXIS = np.linspace(-math.pi / 2, math.pi / 2, 129)
matrices = gg.invertibility


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
    ) -> tuple[int, dict[str, str], bytes]:
        """Return status, headers and content of the answer to a request: the path as it stands, a body in pieces."""
        sent: list[Any] = []
        waiting = [{"type": "http.request"} | message for message in messages]

        async def receive() -> Any:
            return waiting.pop(0) if waiting else await asyncio.Event().wait()

        async def send(message: Any) -> None:
            sent.append(message)

        place, _, query = path.partition("?")
        stated = {"host": SERVED} | headers
        scope = {
            "type": "http",
            "method": method,
            "scheme": "http",
            "path": unquote(place),
            "raw_path": place.encode(),
            "query_string": query.encode(),
            "headers": [(key.encode(), stated[key].encode()) for key in stated],
        }
        await self.app(scope, receive, send)
        answered = {key.decode(): value.decode() for key, value in sent[0]["headers"]}
        content = b"".join(message.get("body", b"") for message in sent[1:])
        return sent[0]["status"], answered, content

    def post(
        self, name: str, *pieces: Any, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """Return status, headers and content of the answer to a query, whose body comes in pieces."""
        stated = {"content-type": JSON} | headers
        request = self.sent("POST", f"/{TOKEN}/api/{name}", stated, pieces)
        status, answered, content = asyncio.run(asyncio.wait_for(request, 60))
        assert answered.items() >= HEADERS.items()
        return status, answered, content

    def ask(self, body: bytes, *pieces: Any) -> tuple[int, str]:
        """Return the status of a query for a plan, and the line that refuses it."""
        status, _, content = self.post("plan", {"body": body}, *pieces)
        message = json.loads(content).get("error", "")
        assert re.fullmatch(r"(?!.*Traceback)[^\n]*", message)
        return status, message

    def get(self, path: str) -> tuple[int, dict[str, str], bytes]:
        return asyncio.run(self.sent("GET", path, {}, [{}]))


@pytest.fixture(scope="module")
def client() -> Client:
    return Client()


def of_gait(number: int, **others: Any) -> dict[str, Any]:
    gait = GAITS[number - 1]
    return {
        "waypoints": [list(point) for point in gait.angles],
        "color": gait.color,
        "sign": gait.sign,
        "require": "flyable" if gait.flyable else "valid",
        **others,
    }


# Plans


@pytest.mark.parametrize("number", [1, 3])
def test_a_plan_is_what_plan_loop_returns(number: int) -> None:
    """Blue has no hover thrusts, and values as small as rounding."""
    state = of_gait(number, period=2.0, law="equal-time")
    answer = plan_answer(state | {"samples": 40})
    plan = gg.plan_loop(**state)
    expected = plan.as_mapping()
    del expected["request"]  # of another accuracy
    assert plan.report is not None
    assert json.dumps(answer, allow_nan=False)
    assert {name: answer[name] for name in expected} == expected
    assert answer["types"] == list(plan.gait.types)
    assert answer["colors"] == list(plan.gait.colors)
    assert answer["verdict"] == plan.report.in_words
    assert plan.report.verdict.endswith(answer["caveat"])
    assert answer["surface"].startswith(f"{GAITS[number - 1].color}, R ")

    series, timed = answer["series"], plan.timed(samples=40)
    least = matrices.least_singular_value(timed.alpha)
    shares = matrices.hover_thrust_shares(timed.alpha).T
    assert series["t"] == pytest.approx(timed.t)
    assert series["alpha"] == pytest.approx(timed.alpha.T, abs=1e-6)
    assert series["rates"] == pytest.approx(timed.rates.T, abs=1e-6)
    assert series["R"] == pytest.approx(timed.columns["R"], abs=1e-10)
    assert series["least_singular_value"] == pytest.approx(least, abs=1e-9)
    if number == 1:
        assert series["hover_thrusts"] == [[None] * 41] * 4
    else:
        assert series["hover_thrusts"] == pytest.approx(shares, abs=1e-5)


def test_a_long_series_is_as_fine_as_a_chart() -> None:
    series = plan_answer(of_gait(3, samples=1000))["series"]
    assert series["t"] == pytest.approx(np.linspace(0, 1, 401))


def test_a_vehicle_that_is_not_symmetric_is_planned_and_drawn() -> None:
    corners = [[-0.8, 0.8], [-0.8, 0.7], [-0.9, 0.8]]
    state = {"vehicle": LEANING.as_mapping(), "waypoints": corners}
    answer = plan_answer(state)
    assert json.dumps(answer, allow_nan=False)
    assert (answer["status"], answer["flyable"]) == ("planned", True)
    assert (answer["types"], answer["colors"]) == ([], [])
    series = np.array(answer["series"]["alpha"])
    others = sheet_of(rotors_of(LEANING)).angles(*series[:2])
    assert series[2:] == pytest.approx(others.T, abs=2e-6)
    tilt_axes, thrust_axes = LEANING.axes
    frames = np.array(answer["vehicle_view"]["frames"])
    assert frames[:, :, 0] == pytest.approx(tilt_axes, abs=1e-6)
    assert frames[:, :, 2] == pytest.approx(thrust_axes, abs=1e-6)
    assert np.linalg.det(frames) == pytest.approx(1, abs=1e-5)
    assert diagram_answer(state)["biased"]["verdict"]
    assert plan_answer(state | {"color": "blue"})["status"] == "infeasible"


def test_an_empty_and_an_infeasible_state_have_every_name() -> None:
    planned = plan_answer(of_gait(3))
    empty = plan_answer({})
    none = plan_answer(REFUSED)
    assert set(empty) == set(none) == set(planned)
    assert (empty["status"], none["status"]) == ("empty", "infeasible")
    assert none["refusals"][0]["nearest"]
    assert empty["series"] is none["series"] is planned["posture"] is None
    for state in ({}, REFUSED):
        diagram = diagram_answer(state)
        assert diagram["own"] is None
        assert diagram["reason"]


@pytest.mark.parametrize(
    ("waypoints", "color", "alpha"),
    [
        ([], "auto", [0, 0, 0, 0]),
        ([[0.5, 0.5], [-0.7, 0.7]], "red", [0.5, 0.5, 0.5, 0.5]),
        ([[0.3, -0.2]], "blue", [0.3, -0.2, DELTA - 0.3, 0.2 - DELTA]),
    ],
)
def test_without_a_gait_the_vehicle_stands_as_at_the_first_waypoint(
    waypoints: Any, color: str, alpha: Any
) -> None:
    state = {"waypoints": waypoints, "color": color, "sign": "negative"}
    posture = plan_answer(state)["posture"]
    assert posture["alpha"] == pytest.approx(alpha, abs=1e-4)
    shares = matrices.hover_thrust_shares(alpha)
    expected = [None] * 4 if color == "blue" else pytest.approx(shares, abs=1e-5)
    assert posture["shares"] == expected


def test_the_diagram_is_the_robustness_of_the_plan() -> None:
    answer = diagram_answer(of_gait(3, eta=0.9))
    gait = gg.plan_loop(**of_gait(3)).gait
    expected = gg.robustness_of(gait, bias=0.9, curves=2).sweep[0]
    own, biased = answer["own"], answer["biased"]
    margin = math.degrees(expected.tilt_margin or 0)
    assert (answer["eta"], own["curves"], own["tilt_margin_deg"]) == (0.9, [], 90.0)
    assert biased["tilt_margin_deg"] == pytest.approx(margin, abs=1e-3)
    assert biased["acceptable_fraction"] == expected.acceptable.fraction
    assert biased["verdict"] == expected.verdict
    assert len(biased["curves"]) == 16
    area = shapely.Polygon(biased["acceptable"]).area / math.pi**2
    assert area == pytest.approx(expected.acceptable.fraction, abs=1e-3)


# The map


def test_the_shading_is_of_the_red_sheet_with_rows_of_constant_alpha2(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    functions: dict[str, Any] = {
        "R": lambda alpha: matrices.level_determinant(alpha, coefficients_of()),
        "least_singular_value": matrices.least_singular_value,
        "servo_margin": lambda alpha: np.degrees(
            servo_margins_found(alpha, gg.PAPER, DEFAULT_FLOOR)
        ),
    }
    monkeypatch.setattr(map_query, "_POINTS", {"servo_margin": 9})
    monkeypatch.setattr(map_query, "_shading", map_query._shading.__wrapped__)
    for shading, function in functions.items():
        answer = map_answer({"shading": shading})
        axis = np.linspace(-math.pi / 2, math.pi / 2, answer["n"])
        alpha = on_red(*np.meshgrid(axis, axis)).reshape(-1, 4)
        close = 0.1 if shading == "servo_margin" else 1e-12
        assert answer["values"] == pytest.approx(function(alpha), rel=1e-4, abs=close)
        assert answer["note"] is None


def area_of(rings: Any) -> float:
    return sum(shapely.Polygon(ring).area for ring in rings)


def test_the_map_of_a_curved_sheet_has_one_region_and_no_types() -> None:
    question = {"vehicle": ODD.as_mapping(), "shading": "R"}
    answer = map_answer(question)
    (region,) = answer["regions"]
    proven = sum(sheet_region(ODD, sign=sign).area for sign in SIGNS)
    assert area_of(region["polygons"]) == pytest.approx(proven, rel=1e-3)
    assert answer["curved"]
    assert "curved: it has no colors and no plane types" in answer["note"]
    assert set(answer["types"]["codes"]) == {None}
    assert map_answer({**question, "sheet": "blue"}) == answer
    others = sheet_of(rotors_of(ODD)).angles(AXIS[[30]], AXIS[[90]])
    R = matrices.level_determinant([AXIS[30], AXIS[90], *others[0]], vehicle=ODD)
    assert answer["values"][90 * 129 + 30] == pytest.approx(float(R), rel=1e-4)


@pytest.mark.parametrize("vehicle", ["paper", "beetle_omni"])
def test_regions_are_those_of_the_package(vehicle: str) -> None:
    answer = map_answer({"vehicle": vehicle})
    rings = {region["name"]: region["polygons"] for region in answer["regions"]}
    expected = {
        "R>0": gg.surface.sign_region("positive", vehicle),
        "R<0": gg.surface.sign_region("negative", vehicle),
        "hover": gg.surface.hover_region(vehicle),
        "flyable": gg.admissible_region(vehicle),
    }
    assert rings.keys() == expected.keys()
    for name, region in expected.items():
        assert area_of(rings[name]) == pytest.approx(region.area, rel=5e-3)
    assert answer.get("raised", False) == (vehicle == "beetle_omni")


def test_a_region_that_needs_a_missing_constant_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unknown = gg.Vehicle(drag_ratio=0.17, max_thrust=12)  # N, without a mass
    monkeypatch.setattr(map_query, "vehicle_of", lambda *_: unknown)
    answer = map_answer({})
    names = [region["name"] for region in answer["regions"]]
    assert names == ["R>0", "R<0", "hover"]
    assert answer["note"].startswith("The region flyable")


def test_blue_has_the_types_of_the_graph_and_no_shading() -> None:
    answer = map_answer({"sheet": "blue", "shading": "R"})
    assert answer["types"]["n"] == 17
    codes = np.reshape(answer["types"]["codes"], (17, 17))
    compared = 0
    for node, data in gg.surface_graph("negative").nodes(data=True):
        i, j = int(node[:3]), int(node[4:7])
        if data["color"] == "blue" and 0 < min(i, j) and max(i, j) < 16:
            compared += 1
            assert codes[j, i] == data["types"]
    assert compared > 50
    assert answer["values"] is None
    assert "rounding" in answer["note"]
    exact = map_answer({"sheet": "blue", "coefficients": "exact"})
    assert (exact["regions"], exact["note"][:5]) == ([], "R = 0")


# Tables and files


def table_of_state(suffix: str, **others: Any) -> bytes:
    state = of_gait(3, samples=40, **others)
    return file_answer({"state": state, "suffix": suffix})[1]


def json_table(**about: Any) -> bytes:
    """Return a gait file of one row, and what it states of its making."""
    columns = {"t": [0.0], "alpha1": [1.0], "alpha2": [-1.0], "color": ["red"]}
    return json.dumps({"columns": columns, "about": about}).encode()


def test_a_good_table() -> None:
    answer = table_answer("C:\\gaits\\gait3.csv", table_of_state(".csv"))
    series = answer["series"]
    assert json.dumps(answer, allow_nan=False)
    assert (answer["name"], answer["verdict"]) == ("gait3.csv", "flyable")
    assert (series["rows"][0], series["rows"][-1], series["t"][-1]) == (1, 41, 1)
    planned = plan_answer(of_gait(3))
    assert np.allclose(answer["corners"], planned["corners"], atol=1e-6)
    for name in ("color", "colors", "types"):
        assert answer[name] == planned[name]
    assert answer["diagram"]["own"] == diagram_answer(of_gait(3))["own"]
    judged = {"vehicle": "paper", "drag_ratio": None, "coefficients": "published"}
    assert answer["map"] == judged


def test_between_rows_without_times_the_motion_is_straight() -> None:
    corners = np.array(GAITS[2].angles)[:, [0, 1, 0, 1]]
    lines = [",".join(map(repr, row)).encode() for row in corners.tolist()]
    series = table_answer("corners.csv", HEAD + b"\n".join(lines))["series"]
    rows = np.array(series["rows"])
    closed = np.vstack([corners, corners[:1]])
    places = np.array([np.interp(rows, range(1, 6), column) for column in closed.T])
    assert (rows[0], rows[-1], len(rows)) == (1, 5, 401)
    assert series["alpha"] == pytest.approx(places, abs=1e-6)


def test_corners_whose_attitudes_are_drawn_are_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(table_query, "_MOST_CORNERS", 0)
    diagram = table_answer("x.csv", HEAD + b"1.1,-1.1,1.1,-1.1\n")["diagram"]
    assert diagram["own"] is None
    assert diagram["reason"].startswith("At most 0 corners are drawn here, got 1.")


def test_of_a_path_only_the_way_out_is_shown() -> None:
    moved = gg.transition("hover", gg.lift([(-0.4, 0.4)], "red"))
    content = BytesIO()
    moved.write(content, format="csv")
    series = table_answer("path.csv", content.getvalue())["series"]
    assert series["t"][-1] == pytest.approx(moved.table["t"][-1])
    last = [column[-1] for column in series["alpha"]]
    assert last == pytest.approx([-0.4, 0.4] * 2, abs=1e-6)


def test_the_request_of_a_downloaded_file_comes_back_as_a_state() -> None:
    others: dict[str, Any] = {"drag_ratio": 0.25, "law": "equal-time"}
    others["keep_out"] = [[[1, 1], [1.2, 1], [1, 1.2]]]
    request = table_answer("x.json", table_of_state(".json", **others))["request"]
    state = of_gait(3, samples=40, coefficients="exact", **others)
    assert DEFAULTS | request == DEFAULTS | state


@pytest.mark.parametrize(
    ("request_of_file", "shown"),
    cases("""
"law": "equal-time" | "law": "equal-time"
"accuracy": 1e-9 | "accuracy": 1e-5
"method": "exact", "divisions": 256 | "method": "exact"
"method": "grid", "divisions": 65 | nothing
"floor": 0.2 | nothing
"vehicle": "/etc/vehicle.toml" | nothing
"""),
)
def test_a_request_that_the_page_cannot_show_is_left_out(
    request_of_file: str, shown: str
) -> None:
    stated = '{"waypoints": [[1.0, -1.0]], '
    request = json.loads(f"{stated}{request_of_file}}}")
    answered = table_answer("x.json", json_table(request=request))["request"]
    if shown == "nothing":
        assert answered is None
    else:
        vehicle = {"vehicle": "paper", "drag_ratio": None}
        assert answered == json.loads(f"{stated}{shown}}}") | vehicle


@pytest.mark.parametrize(
    ("name", "content", "part"),
    [
        ("x.mcap", b"", "folder"),
        ("x.csv", b"\xff\xfe\x00", "UTF-8"),
        ("x.json", json_table(vehicle="/etc/vehicle.toml"), "must be a preset"),
    ],
)
def test_other_files_are_refused(name: str, content: bytes, part: str) -> None:
    with pytest.raises(gg.GaitgraphError, match=part) as caught:
        table_answer(name, content)
    assert "stream" not in str(caught.value)


@pytest.mark.parametrize("suffix", [".h", ".gif"])
def test_downloads_are_files(suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaitgraph.plots.films._FEWEST", 2)
    state = of_gait(3, samples=8, period=0.08)
    name, content = file_answer({"state": state, "suffix": suffix})
    assert name == f"gait{suffix}"
    assert len(content) > 500


def test_the_download_of_a_folder_is_a_zip() -> None:
    missing = {form["suffix"]: form["why_not"] for form in formats_answer()}
    if missing[".mcap"]:
        pytest.skip(missing[".mcap"])
    name, content = file_answer({"state": of_gait(3), "suffix": ".mcap"})
    assert name == "gait.mcap.zip"
    with zipfile.ZipFile(BytesIO(content)) as archive:
        assert any(inner.endswith(".mcap") for inner in archive.namelist())


def test_a_certificate_of_the_downloaded_rows_is_offered_or_refused(
    tmp_path: Path,
) -> None:
    for suffix in (".csv", ".cert.json"):
        (tmp_path / f"gait{suffix}").write_bytes(table_of_state(suffix))
    assert verify(tmp_path / "gait.cert.json", tmp_path / "gait.csv")
    with pytest.raises(gg.GaitgraphError, match="not flyable"):
        file_answer({"state": of_gait(1), "suffix": ".cert.json"})
    for state in ({}, REFUSED):
        with pytest.raises(gg.InputError):
            file_answer({"state": state})


def test_files_travel_through_the_server(client: Client) -> None:
    query = json.dumps({"state": of_gait(3), "suffix": ".csv"}).encode()
    status, headers, content = client.post("download", {"body": query})
    assert status == 200
    assert headers["content-disposition"] == "attachment; filename=gait.csv"
    kind = {"content-type": "application/octet-stream"}
    table = client.post("table?name=my%20gait.csv", {"body": content}, **kind)
    answer = json.loads(table[2])
    assert (answer["name"], answer["flyable"]) == ("my gait.csv", True)


# What the page starts from


def test_setup_lists_what_the_page_offers() -> None:
    setup = setup_answer()
    names = [preset["name"] for preset in setup["presets"]]
    assert names == gg.vehicle.preset_names()
    assert {"objective", "method", "require", "law"} <= setup["words"].keys()
    for gait, published in zip(setup["paper_gaits"], GAITS, strict=True):
        assert (gait["color"], gait["sign"]) == (published.color, published.sign)
        assert np.allclose(gait["waypoints"], published.angles)
    for name, allowed in setup["ranges"].items():
        ends = [allowed["low"], allowed["high"]]
        words = re.findall(r"\d[\d.e-]*", allowed["allowed"])
        assert [float(word) for word in words] == ends
        for end in ends:
            state_of({name: end, "method": "grid", "view": {"anything": ["goes"]}})


def test_a_page_may_begin_with_another_vehicle() -> None:
    setup = setup_answer(LEANING)
    own = setup["presets"][-1]
    assert (own["name"], own["vehicle"]) == ("leaning", LEANING.as_mapping())
    assert state_of(setup["defaults"]).request.vehicle == LEANING
    preset = setup_answer(vehicle_named("beetle_omni"))
    assert preset["defaults"]["vehicle"] == "beetle_omni"
    assert len(preset["presets"]) == len(setup["presets"]) - 1


def test_the_page_its_files_and_their_licences(client: Client) -> None:
    status, headers, content = client.get(f"/{TOKEN}/")
    assert status == 200
    assert headers.items() >= HEADERS.items()
    assert "unsafe" not in HEADERS["content-security-policy"]
    named = re.findall(r'(?:src|href)="(page/[^"]+)"', content.decode())
    assert named
    for name in [*named, "api/setup"]:
        assert client.get(f"/{TOKEN}/{name}")[0] == 200
    for name in ("uPlot", "three"):
        licence = client.get(f"/{TOKEN}/page/vendor/LICENSE-{name}")[2]
        assert b"MIT License" in licence


# Guards


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"origin": f"http://{SERVED}"}, 200),
        ({"host": f"127.0.0.1.example:{PORT}"}, 400),
        ({"origin": "http://127.0.0.1:8001"}, 403),
        ({"origin": "null"}, 403),
        ({"content-type": "text/plain"}, 415),
    ],
)
def test_a_request_from_elsewhere_is_refused(
    client: Client, headers: dict[str, str], status: int
) -> None:
    answered = client.post("plan", {"body": b"{}"}, **headers)
    assert answered[0] == status
    assert "access-control-allow-origin" not in answered[1]


@pytest.mark.parametrize(
    "path",
    ["", "TOKEN", "TOKE/", "TOKEN/page/%2e%2e/server.py", "TOKEN/api/plan/"],
)
def test_there_is_nothing_else(client: Client, path: str) -> None:
    path = path.replace("TOKEN", TOKEN).replace("TOKE/", f"{TOKEN[:-1]}/")
    assert client.get(f"/{path}")[0] == 404


def test_a_body_that_is_too_large_is_given_up(client: Client) -> None:
    piece = {"body": b" " * (64 << 10), "more_body": True}
    status, headers, content = client.post("plan", *[piece] * 200)
    assert (status, headers["connection"]) == (413, "close")
    assert str(server.MOST_BYTES).encode() in content


@pytest.mark.parametrize(
    ("body", "part"), [(b"{", "not JSON"), (b"null", "a table of values")]
)
def test_a_body_that_is_no_state_is_refused(
    client: Client, body: bytes, part: str
) -> None:
    status, message = client.ask(body)
    assert status == 400
    assert part in message


@pytest.mark.parametrize(
    ("name", "value"),
    cases("""
sheet | "green"
shading | 3
waypoints | [[0.1, 0.2]] * 1001
keep_out | [[[0, 0]] * 65]
keep_in | [1]
period | None
vehicle | "/etc/vehicle.toml"
drag_ratio | 0.019
accuracy | 0.9e-5
samples | 1.5
eta | 1.1
nothing | 0
"""),
)
def test_wrong_fields_are_named(name: str, value: str) -> None:
    answer = map_answer if name in ("sheet", "shading") else plan_answer
    with pytest.raises(gg.GaitgraphError, match=name.removesuffix("s")):
        answer({name: eval(value)})


# Work


def test_two_requests_are_worked_on_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    running: list[object] = []
    most: list[int] = []

    def slow(request: Any, progress: Any) -> Any:
        running.append(request)
        most.append(len(running))
        time.sleep(0.05)
        running.remove(request)
        raise gg.InputError("done")

    async def all_of_them() -> None:
        other = Client()
        stated = {"content-type": JSON}
        bodies = [f'{{"waypoints": [[0.3{k}, -0.4]]}}'.encode() for k in range(6)]
        requests = [
            other.sent("POST", PLAN, stated, [{"body": body}]) for body in bodies
        ]
        await asyncio.gather(*requests)

    monkeypatch.setattr(queries, "plan", slow)
    asyncio.run(all_of_them())
    assert max(most) == 2


def test_work_is_stopped_when_it_takes_too_long_or_the_client_is_gone(
    client: Client, monkeypatch: pytest.MonkeyPatch
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
    body = b'{"waypoints": [[0.32, -0.42]]}'
    client.ask(body, {"type": "http.disconnect"})
    assert stopped == ["the client disconnected"]
    monkeypatch.setattr(server, "LONGEST_WORK", 0.05)
    status, message = client.ask(body)
    assert status == 503
    assert "longer than 0.05 s" in message


class Enough(Exception):
    pass


STATE = {"waypoints": [[0.36, -0.46]]}


@pytest.mark.parametrize(
    ("work", "values"),
    [
        (plan_answer, [STATE]),
        (diagram_answer, [STATE]),
        (file_answer, [{"state": STATE}]),
        (map_answer, [{}]),
        (table_answer, ["x.csv", HEAD + b"1.1,-1.1,1.1,-1.1\n" * 3]),
    ],
)
def test_all_work_can_be_stopped(
    work: Any, values: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is known already is no excuse."""

    def stop(*_: object) -> None:
        raise Enough

    monkeypatch.setattr(queries, "_plans", {})
    if work is not plan_answer:
        queries.planned(state_of(STATE))
    with pytest.raises(Enough):
        work(*values, stop)


def test_the_last_plans_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def plan(request: Any, progress: Any) -> Any:
        asked.append(request)
        return request

    monkeypatch.setattr(queries, "_plans", {})
    monkeypatch.setattr(queries, "plan", plan)
    states = [state_of({"period": 1 + k}) for k in range(17)]
    for state in [*states[:16], states[0], states[16], states[0], states[1]]:
        queries.planned(state)
    assert len(asked) == 18  # the second was the oldest


def test_an_unexpected_error_is_one_line_and_the_server_lives_on(
    client: Client, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(request: Any, progress: Any) -> Any:
        raise ZeroDivisionError("a\nb")

    body = b'{"waypoints": [[0.33, -0.43]]}'
    with monkeypatch.context() as patch:
        patch.setattr(queries, "plan", broken)
        status, message = client.ask(body)
    assert status == 500
    assert "ZeroDivisionError: a b" in message
    assert capsys.readouterr().err == "gaitgraph: plan: ZeroDivisionError: a b\n"
    assert client.ask(body)[0] == 200


# The command


def test_a_real_server_is_asked_and_interrupted() -> None:
    command = [sys.executable, "-m", "gaitgraph", "explore", "--no-browser"]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    environment = os.environ | {"PYTHONUNBUFFERED": ""}
    with subprocess.Popen(command, env=environment, text=True, **pipes) as process:
        try:
            assert process.stdout is not None
            address = process.stdout.readline().strip()
            assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", address)
            body = json.dumps(of_gait(3)).encode()
            request = Request(f"{address}api/plan", body, {"Content-Type": JSON})
            with urlopen(request) as answer:
                assert json.load(answer)["flyable"] is True
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 130
    assert (out, err) == ("", "gaitgraph: interrupted\n")


def test_without_its_libraries_it_says_what_to_install(
    run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, server.__name__)
    monkeypatch.setitem(sys.modules, "starlette.applications", None)
    done = run("explore")
    assert done.code == 2
    assert "The explorer needs starlette" in done.err
    assert "gaitgraph[explore]" in done.err


def test_a_port_that_is_taken(run: Any) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        done = run("explore", "--no-browser", "--port", taken.getsockname()[1])
    assert done.code == 2
    assert "port must be a free port, or 0 for any" in done.err


def test_the_browser_is_opened_and_may_fail(
    run: Any, monkeypatch: pytest.MonkeyPatch
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
