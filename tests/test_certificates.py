"""Certificates: what is made is proved by the checker alone; what is false, or no certificate, is not."""

from __future__ import annotations

import ast
import json
import math
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.certificates import check
from gaitgraph.errors import Infeasible, InputError
from gaitgraph.gait.gait import paper_gait
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    hover_thrust_shares,
    least_singular_value,
    level_determinant,
)
from gaitgraph.timing.limits import limits_of
from gaitgraph.timing.timed_gait import table_of
from gaitgraph.tolerances import DEFAULT_FLOOR
from tests.mutated import changed

CHECKER = Path(check.__file__)
LOOP = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]


@pytest.fixture(scope="module")
def gait3() -> dict[str, Any]:
    gait = paper_gait(3, gg.PAPER, coefficients_of())
    document: dict[str, Any] = gg.certify(gait.parametrize(), tilt="60deg").document
    return document


def proved(document: dict[str, Any]) -> dict[str, bool]:
    return {
        name: not place
        for name, place in check.check(json.dumps(document))["claims"].items()
    }


def test_the_checker_stands_alone() -> None:
    source = CHECKER.read_text(encoding="utf-8")
    modules = {
        node.module
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
    }
    modules |= {
        one.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Import)
        for one in node.names
    }
    assert modules <= {*sys.stdlib_module_names}
    assert not {"random", "math", "decimal"} & modules - {"math"}


@pytest.mark.parametrize("number", [3, 4])
def test_gaits_of_the_paper(number: int) -> None:
    timed = paper_gait(number, gg.PAPER, coefficients_of()).parametrize()
    found = gg.certify(timed, tilt="60deg")
    assert all(proved(found.document).values())
    assert proved(found.document).keys() == check.CLAIMS.keys() - {"jerk"}
    floor = check.FLYABLE["least_singular_value"]  # the checker imports nothing of ours
    assert float(floor) == DEFAULT_FLOOR
    assert max(found.intervals.values()) <= 110
    assert len(found.text) <= 100_000
    least = Fraction(found.document["claims"]["least_singular_value"]["at_least"])
    assert (
        0.98
        <= float(least) / (timed.check()["least_singular_value"].value or 0.0)
        < 1.0
    )


def random_plans(seed: int, count: int) -> list[gg.Plan]:
    rng = np.random.default_rng(seed)
    plans: list[gg.Plan] = []
    while len(plans) < count:
        limits: dict[str, Any] = {
            "max_tilt": rng.uniform(0.9, 1.5, 4).tolist(),
            "max_thrust": rng.uniform(2.0, 9.0),
        }
        limits |= {"rotor_height": rng.uniform(-0.06, 0.06)}
        limits = {"arm_length": 0.2} | {
            name: value for name, value in limits.items() if rng.random() < 0.3
        }
        spin = str(rng.choice(["clockwise", "counterclockwise"]))
        vehicle = gg.Vehicle(
            drag_ratio=10 ** rng.uniform(-1.2, 0.2),
            mass=1.0,
            first_rotor_spin=spin,
            **limits,
        )
        side = rng.choice([-1, 1])
        points = side * rng.uniform(0, 1.5, (int(rng.integers(1, 6)), 2)) * [1, -1]
        law: Any = str(rng.choice(["smooth", "constant-speed"]))
        plan = gg.plan_loop(points, vehicle=vehicle, law=law)
        plans += [plan] * bool(plan)
    return plans


@pytest.mark.parametrize("count", [3, pytest.param(30, marks=pytest.mark.slow)])
def test_every_flyable_plan_gets_a_certificate(count: int) -> None:
    for plan in random_plans(count, count):
        found = gg.certify(plan)
        assert all(proved(found.document).values())
        claims, alpha = found.document["claims"], plan.timed(samples=200).alpha
        vehicle, exact = plan.gait.vehicle, coefficients_of(plan.gait.vehicle, "exact")
        low, high = (
            float(Fraction(claims["hover_thrust"][key]))
            for key in ("at_least", "at_most")
        )
        shares = hover_thrust_shares(alpha, vehicle)
        assert low < shares.min()
        assert shares.max() < high
        assert np.min(least_singular_value(alpha, vehicle)) > float(
            Fraction(claims["least_singular_value"]["at_least"])
        )
        sign = 1.0 if claims["sign_of_R"]["sign"] == "positive" else -1.0
        assert (sign * level_determinant(alpha, exact) > 0).all()


def curves() -> dict[str, Any]:
    gait = gg.lift(LOOP, "red")
    limited = gg.lift(
        LOOP,
        "red",
        vehicle=gg.PAPER.replace(max_tilt_rate=2.0, max_tilt_acceleration=20.0),
    )
    return {
        "untimed": gait,
        "posture": gg.lift(LOOP[:1], "red").parametrize(),
        "constant speed": gait.parametrize(2.0, law="constant-speed"),
        "rows": gait.parametrize(2.0).alpha,
        "within limits": limited.parametrize(2.7),
        "optimal": gg.optimal_gait(LOOP),
        "least period": gg.least_period(limited, limits_of(limited.vehicle)),
    }


def test_every_kind_of_gait() -> None:
    for name, gait in curves().items():
        found = gg.certify(gait)
        assert all(proved(found.document).values()), name
        rates = "rate" in found.document["claims"]
        assert rates == (name not in ("untimed", "rows")), name


def test_the_curve_is_that_of_the_gait() -> None:
    for name in ("within limits", "optimal", "least period"):
        gait = curves()[name]
        timed = (
            gait
            if isinstance(gait, gg.TimedGait)
            else gait.timed()
            if name == "optimal"
            else gait.timed
        )
        document = gg.certify(gait).document
        start = 0.0
        for piece in document["pieces"][:10]:
            for share in (0.0, 0.3, 0.9):
                angles = [
                    sum(float(a) * share**k for k, a in enumerate(one))
                    for one in piece["alpha"]
                ] * 2
                angles = angles[:4]
                at = timed.at(start + share * float(Fraction(piece["duration"]))).alpha
                assert np.allclose(angles, at, rtol=0, atol=1e-9), name
            start += float(Fraction(piece["duration"]))


FALSE = [
    (("least_singular_value", "at_least"), "0.4538"),
    (("sign_of_R", "sign"), "positive"),
    (("hover_thrust", "at_least"), "0.1288"),
    (("hover_thrust", "at_most"), "0.6532"),
    (("tilt", "at_most"), ["1.17", "1.2", "1.2", "1.2"]),
    (("rate", "at_most"), ["5.89"] * 4),
    (("acceleration", "at_least"), ["-72.5"] * 4),
]


@pytest.mark.parametrize(("path", "value"), FALSE)
def test_what_is_false_is_not_proved(
    gait3: dict[str, Any], path: tuple[str, str], value: Any
) -> None:
    fine = [str(Fraction(k, 64)) for k in range(65)]
    document = changed(
        changed(gait3, "claims", *path, to=value),
        "claims",
        path[0],
        "cover",
        to=[fine] * 4,
    )
    found = proved(document)
    assert not found.pop(path[0])
    assert all(found.values())


def test_a_raised_vehicle_whose_servos_differ() -> None:
    tilts = {"min_tilt": [0.4, -1.3, 0.0, -1.2], "max_tilt": [1.2, 0.0, 1.5, -0.4]}
    vehicle = gg.PAPER.replace(
        rotor_height=0.05, max_tilt_rate=[4.28, 9.0, 30.0, 4.3], **tilts
    )
    document = gg.certify(
        gg.lift(LOOP, "red", vehicle=vehicle).parametrize(1.2), tilt="5deg"
    ).document
    assert all(proved(document).values())
    tilt = document["claims"]["tilt"]
    for side, at in (
        ("at_least", [0.4, -1.200001, 0.399999, -1.2]),
        ("at_most", [1.2, -0.399999, 1.200001, -0.4]),
    ):
        assert np.allclose(list(map(float, tilt[side])), at, rtol=0, atol=2e-9)
    assert document["claims"]["rate"]["at_most"] == ["4.28", "4.4", "4.4", "4.3"]
    # At H ≠ 0 the force 2κR is not small where κ is: the sign of R follows from it and the spin, however small κ is.
    tiny = changed(document, "vehicle", "drag_to_thrust", to=["1/1" + "0" * 50] * 4)
    fine = [[f"{k}/64" for k in range(65)]] * len(document["pieces"])
    tiny = changed(tiny, "claims", "sign_of_R", "cover", to=fine)
    spins = ("clockwise", "counterclockwise")
    truths = []
    for spin in spins:
        turned = changed(tiny, "vehicle", "first_rotor_spin", to=spin)
        signs = [
            proved(changed(turned, "claims", "sign_of_R", "sign", to=sign))["sign_of_R"]
            for sign in ("positive", "negative")
        ]
        truths.append(signs)
        made = vehicle.replace(drag_ratio=1e-9, first_rotor_spin=spin)
        R = level_determinant(gg.lift(LOOP, "red").alpha, coefficients_of(made))
        assert signs == [(R > 0).all(), (R < 0).all()]
    assert truths[0] == truths[1][::-1]


def test_jumps_are_not_proved(gait3: dict[str, Any]) -> None:
    for path, value in (
        (("pieces", 1, "alpha", 0, 0), "1.178"),
        (("pieces", 1, "alpha", 0, 1), "0.1"),
        (("pieces", 1, "alpha", 0), ["0.5"]),
    ):
        assert not proved(changed(gait3, *path, to=value))["joints"]


MALFORMED = [
    (("format",), "gaitgraph certificate 1"),
    (("vehicle", "drag_to_thrust", 0), "0.000"),
    (("vehicle", "drag_to_thrust", 0), 0.1785),
    (("vehicle", "rotor_positions", 0, 2), "1e-1"),
    (("vehicle",), {"name": "x", "first_rotor_spin": "clockwise"}),
    (("vehicle", "first_rotor_spin"), "left"),
    (("law",), ["0", "1"]),
    (("pieces", 0, "alpha"), [["0"]] * 3),
    (("pieces",), []),
    (("pieces", 0), {"alpha": []}),
    (("pieces", 0, "duration"), "-1"),
    (("pieces", 0, "alpha", 0, 0), "1e3"),
    (("pieces", 0, "alpha", 0, 0), "1/0"),
    (("pieces", 0, "alpha", 0, 0), "٣"),
    (("pieces", 0, "alpha", 0, 0), "9" * 50),
    (("pieces", 0, "alpha", 0, 0), math.nan),
    (("pieces", 0, "alpha", 0, 0), True),
    (("pieces", 0, "alpha", 0, 0), "1\n"),
    (("claims",), {}),
    (("claims", "more"), {"at_most": "1"}),
    (("claims", "rate", "at_most"), ["1"] * 3),
    (("claims", "tilt", "cover"), [["0", "1"]] * 3),
    (("claims", "tilt", "cover"), [["0", "1"]] * 4 + [["0", "2"]]),
    (("claims", "tilt", "cover", 2), ["0", "1/2"]),
    (("claims", "tilt", "cover", 2), ["1/2", "1"]),
    (("claims", "tilt", "cover", 2), ["0", "2/3", "1/3", "1"]),
    (("claims", "tilt", "cover", 2), ["0", "1/2", "1/2", "1"]),
    (("claims", "tilt", "cover", 2), ["-1", "0", "1", "2"]),
    (("claims", "least_singular_value", "at_least"), "-0.4"),
]


@pytest.mark.parametrize(("path", "value"), MALFORMED)
def test_what_is_no_certificate_is_refused(
    gait3: dict[str, Any], path: tuple[Any, ...], value: Any
) -> None:
    with pytest.raises(ValueError, match=r"must .*, got "):
        check.check(json.dumps(changed(gait3, *path, to=value)))


def test_other_documents_are_refused(gait3: dict[str, Any]) -> None:
    text = json.dumps(gait3)
    twice = text.replace('"made_by": ', '"made_by": "", "made_by": ', 1)
    for other in (
        "",
        "[]",
        "{}",
        "null",
        "1",
        '"a"',
        text[:-9],
        "[" * 10**5,
        twice,
        "1" * 5000,
    ):
        with pytest.raises((ValueError, RecursionError)):
            check.check(other)


def test_mutated_certificates_are_proved_only_if_true(gait3: dict[str, Any]) -> None:
    rng, vehicle = np.random.default_rng(3), gg.PAPER
    for _ in range(60):
        piece, joint, term = (int(rng.integers(n)) for n in (4, 2, 2))
        size = 10 ** rng.uniform(-6, 0.3) * rng.choice([-1, 1])
        text = gait3["pieces"][piece]["alpha"][joint]
        value = f"{float(text[term % len(text)]) + size:.9f}"
        document = changed(
            gait3, "pieces", piece, "alpha", joint, term % len(text), to=value
        )
        found, claims = proved(document), gait3["claims"]
        share = np.linspace(0, 1, 50)
        alpha = np.stack(
            [
                np.polyval([float(a) for a in one[::-1]], share)
                for one in document["pieces"][piece]["alpha"] * 2
            ],
            axis=-1,
        )
        shares = hover_thrust_shares(alpha, vehicle)
        if found["least_singular_value"]:
            assert np.min(least_singular_value(alpha, vehicle)) > float(
                claims["least_singular_value"]["at_least"]
            )
        if found["hover_thrust"]:
            assert shares.min() > float(claims["hover_thrust"]["at_least"])
            assert shares.max() < float(claims["hover_thrust"]["at_most"])
        if found["tilt"]:
            assert (alpha <= [float(one) for one in claims["tilt"]["at_most"]]).all()


def test_what_cannot_be_proved_is_refused() -> None:
    limited = gg.lift(LOOP, "red", vehicle=gg.PAPER.replace(max_tilt_acceleration=1e4))
    rows = np.column_stack([limited.parametrize(2.0).t, limited.parametrize(2.0).alpha])
    table = dict(
        zip(("t", "alpha1", "alpha2", "alpha3", "alpha4"), rows[:95:7].T, strict=True)
    )
    for gait, options, reason in (
        ("gait2", {}, "least singular value"),
        (limited.parametrize(2.0, law="constant-speed"), {}, "infinite"),
        (table, {"vehicle": limited.vehicle}, "timing=False"),
    ):
        with pytest.raises(Infeasible, match=reason):
            gg.certify(gait, **options)  # type: ignore[arg-type]
    assert (
        "rate"
        not in gg.certify(table, vehicle=limited.vehicle, timing=False).document[
            "claims"
        ]
    )
    turned = np.array([[0.4, -0.4, 0.4, -0.4], [0.5, -0.5, 0.5, -0.5]]) + 2 * math.pi
    with pytest.raises(InputError, match="at most 3.9 rad"):
        gg.certify(gg.Gait(alpha=turned, colors=("red", "red")))
    with pytest.raises(InputError, match="tilt"):
        gg.certify("gait3", tilt="90deg")


def test_rows_that_are_played_as_cubics_and_state_no_law_are_refused() -> None:
    table = gg.lift([(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)], "red").parametrize(1.0)
    names = ["t", *(f"alpha{k}" for k in range(1, 5))]
    rates = [f"alpha{k}_rate" for k in range(1, 5)]
    sampled = table_of(table)
    rows = {name: sampled[name] for name in names}
    assert gg.certify(rows).document["pieces"]
    with pytest.raises(Infeasible, match="cubics through their rates"):
        gg.certify(rows | {name: sampled[name] for name in rates})


def test_the_checker_as_a_program(gait3: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "gait.cert.json"
    wrong = changed(gait3, "claims", "sign_of_R", "sign", to="positive")
    short = json.dumps(changed(gait3, "pieces", 0, "alpha", to=[["0"]] * 3))
    for text, arguments, code, said in (
        (json.dumps(gait3), [path], 0, 'proved: sign_of_R {"sign": "negative"}\n'),
        ("\ufeff" + json.dumps(gait3), [path], 0, 'vehicle {"name": "paper", '),
        (
            json.dumps(wrong),
            [path],
            1,
            'NOT proved: sign_of_R {"sign": "positive"} on piece 0 from 0 to 1',
        ),
        ("{}", [path], 2, "the document must be an object with the names format, "),
        (
            json.dumps(changed(gait3, "pieces", 0, "duration", to="-1")),
            [path],
            2,
            "must be a positive exact number",
        ),
        (
            json.dumps(changed(gait3, "claims", "tilt", "cover", 2, to=["0", "1/2"])),
            [path],
            2,
            "1 on piece 2, got",
        ),
        (short, [path], 2, "alpha must be a list of 2 or 4 values"),
        ("", [], 2, "usage: python check.py"),
    ):
        path.write_text(text, encoding="utf-8")
        command = [sys.executable, "-I", str(CHECKER), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == code
        assert said in done.stdout + done.stderr
        assert (len(done.stderr.splitlines()), bool(done.stdout)) == (
            (1, False) if code == 2 else (0, True)
        )


def test_commands(run: Any, tmp_path: Path) -> None:
    sent = (
        "plan",
        "--waypoint",
        "pi/8,-pi/8",
        "--waypoint",
        "3pi/8,-3pi/8",
        "--waypoint",
        "3pi/8,-pi/8",
    )
    assert run(*sent, "--output", "q.csv", "--certify").out.endswith(
        "wrote q.csv\nwrote q.cert.json\n"
    )
    assert all(
        json.loads(run("verify", "q.cert.json", "--json").out)["claims"][name] == ""
        for name in ("rate", "tilt")
    )
    assert "certificate" not in run("validate", "q.csv").out
    (tmp_path / "limited.toml").write_text(
        'preset = "paper"\nmax_tilt_acceleration = 50\n'
    )
    assert (
        run(
            "pace",
            "q.csv",
            "--vehicle",
            "limited.toml",
            "--output",
            "paced.csv",
            "--certify",
        ).code
        == 0
    )
    bounds = json.loads((tmp_path / "paced.cert.json").read_text())["claims"][
        "acceleration"
    ]["at_most"]
    assert all(float(bound) <= 50 * (1 + 1e-9) for bound in bounds)
    assert "belong" not in run("validate", "paced.csv").out
    (tmp_path / "low.toml").write_text("drag_ratio = 0.026\n")
    (tmp_path / "near_singular.toml").write_text(
        'waypoints = [[1.57, -0.814]]\nvehicle = "low.toml"\nfloor = 0.01\n'
    )
    low = ("plan", "near_singular.toml")
    assert run(*low, "--output", "low.csv", "--certify").code == 0
    assert run("certify", "low.csv", "--floor", "0.01").code == 0
    near = (
        "plan",
        "--waypoint=-0.1,0.1",
        "--waypoint=-0.2,0.1",
        "--sign",
        "positive",
        "--output",
        "near.csv",
    )
    assert run(*near).code == 0
    assert run("transition", "hover", "near.csv", "--output", "there.csv").code == 0
    assert run("certify", "there.csv", "--output", "there.cert.json").code == 0
    assert "all 101 rows are on" in run("verify", "there.cert.json").out
    assert run("certify", "q.csv", "--output", "again.json").code == 0
    assert (tmp_path / "again.json").read_text() == (
        tmp_path / "q.cert.json"
    ).read_text()
    rows = (tmp_path / "q.csv").read_text().replace("0.03,", "0.031,", 1)
    (tmp_path / "q.csv").write_text(rows)
    assert "the certificate 'q.cert.json' does not belong to these rows" in " ".join(
        run("validate", "q.csv").out.split()
    )
    (tmp_path / "again.csv").write_text(rows.replace("0.031,", "0.03,", 1))
    again = (tmp_path / "again.json").read_text()
    for text, options, why in (
        (again, (), ""),
        (
            again,
            ("--vehicle", "beetle_omni"),
            "is of another vehicle: moments of rotors",
        ),
        ("x" + again, (), "is no certificate"),
        (
            again.replace('"made_by":"', '"made_by":"", "made_by":"'),
            (),
            "is no certificate",
        ),
    ):
        (tmp_path / "again.cert.json").write_text(text)
        said = " ".join(run("validate", "again.csv", *options).out.split())
        assert ("again.cert.json" in said, why in said) == (bool(why), True)
    wrong = json.loads((tmp_path / "q.cert.json").read_text())
    wrong["claims"]["sign_of_R"]["sign"] = "positive"
    (tmp_path / "wrong.json").write_text(json.dumps(wrong))
    found = run("verify", "wrong.json")
    assert found.code == 1
    assert (
        'NOT proved: sign_of_R {"sign": "positive"} on piece 0 from 0 to 1' in found.out
    )
    assert 'vehicle {"name": "paper", ' in found.out
    known = json.loads(run("verify", "q.cert.json", "--json").out)
    assert (known["flyable"], known["vehicle"]["name"]) == (True, "paper")
    assert known["values"]["sign_of_R"] == {"sign": "negative"}
    document = json.loads((tmp_path / "q.cert.json").read_text())
    for claims in (
        {"joints": document["claims"]["joints"]},
        changed(document["claims"], "hover_thrust", "at_least", to="-9"),
    ):
        (tmp_path / "less.json").write_text(
            json.dumps({**document, "claims": claims}), encoding="utf-8-sig"
        )
        found = run("verify", "less.json")
        assert (found.code, "not proved flyable" in found.out) == (0, True)
        assert not json.loads(run("verify", "less.json", "--json").out)["flyable"]
    for args, code, message in (
        (("certify", "gait1"), 1, "not flyable"),
        (("certify", "gait3", "--output", "wrong.json"), 2, "exists"),
        (("certify", "gait3", "--tilt", "2"), 2, "tilt must be"),
        (("certify", "q.csv", "--output", "other.csv"), 2, "must end in .json"),
        (
            ("certify", "request.json", "--output", "./request.json", "--force"),
            2,
            "another file than the gait",
        ),
        (
            (*sent, "--certify", "--output", "n.csv", "--output", "n.cert.json"),
            2,
            "got 'n.cert.json' twice",
        ),
        (("certify", "low.csv"), 1, "floor 0.05"),
        (("verify", "q.csv"), 2, "certificate 'q.csv'"),
        (("verify", "none.json"), 2, "cannot be read"),
        ((*sent, "--certify"), 2, "--certify must"),
    ):
        found = run(*args)
        assert (found.code, len(found.err.splitlines())) == (code, 1), args
        assert message in found.err
