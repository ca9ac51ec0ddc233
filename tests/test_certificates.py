"""Certificates: every flyable gait gets one that the checker alone proves, and files and commands hold to it."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import gaitgraph as gg
from gaitgraph.certificates import check
from gaitgraph.certificates.making import stated_vehicle
from gaitgraph.errors import Infeasible, InputError
from gaitgraph.gait.table import ANGLES
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
from tests.samples import symmetric_vehicle, table_from

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.certificates.making import Certified

LOOP = [(0.4, -1.2), (0.4, -0.4), (1.2, -0.4)]


def unproved(document: dict[str, Any]) -> list[str]:
    places = check.check(json.dumps(document))["claims"]
    return [name for name, place in places.items() if place]


def assert_proved_and_true(
    certified: Certified, alpha: Any, vehicle: gg.Vehicle
) -> None:
    """The checker proves all claims, and samples of the gait keep within them, near their bounds."""
    document = certified.document
    assert unproved(document) == []
    claims = document["claims"]
    shares = hover_thrust_shares(alpha, vehicle)
    thrust = claims["hover_thrust"]
    low, high = (float(Fraction(thrust[end])) for end in ("at_least", "at_most"))
    assert shares.min() > low > 0.95 * shares.min()
    assert shares.max() < high < 1.05 * shares.max()
    least = float(Fraction(claims["least_singular_value"]["at_least"]))
    value = float(least_singular_value(alpha, vehicle).min())
    assert value > least > 0.97 * value
    sign = {"positive": 1, "negative": -1}[claims["sign_of_R"]["sign"]]
    R = level_determinant(alpha, coefficients_of(vehicle, "exact"))
    assert (sign * R > 0).all()


# -- Made


def random_plan(rng: np.random.Generator) -> gg.Plan:
    while True:
        limits: dict[str, Any] = {"max_tilt": rng.uniform(0.9, 1.5, 4).tolist()}
        limits |= {"max_thrust": rng.uniform(2.0, 9.0)}
        kept = {name: value for name, value in limits.items() if rng.random() < 0.3}
        vehicle = symmetric_vehicle(rng).replace(**kept)
        side = -1 if rng.random() < 0.7 else 1
        side *= 1 if vehicle.signed_drag_ratio > 0 else -1
        points = side * rng.uniform(0, 1.2, (int(rng.integers(1, 6)), 2)) * [1, -1]
        law: Any = str(rng.choice(["smooth", "constant-speed"]))
        plan = gg.plan_loop(points, vehicle=vehicle, law=law)
        if plan:
            return plan


@pytest.mark.parametrize("count", [2, pytest.param(30, marks=pytest.mark.slow)])
def test_every_flyable_plan_gets_a_certificate(count: int) -> None:
    assert float(check.FLYABLE["least_singular_value"]) == DEFAULT_FLOOR
    rng = np.random.default_rng(count)
    for _ in range(count):
        plan = random_plan(rng)
        timed = plan.timed(samples=200)
        assert_proved_and_true(gg.certify(plan), timed.alpha, timed.gait.vehicle)


def curve_of(name: str) -> Any:
    gait = gg.lift(LOOP, "red")
    rates = {"max_tilt_rate": 2.0, "max_tilt_acceleration": 20.0}
    limited = gg.lift(LOOP, "red", vehicle=gg.PAPER.replace(**rates))
    makers: dict[str, Any] = {
        "untimed": lambda: gait,
        "posture": lambda: gg.lift(LOOP[:1], "red").parametrize(),
        "constant speed": lambda: gait.parametrize(2.0, law="constant-speed"),
        "rows": lambda: gait.parametrize(2.0).alpha,
        "within limits": lambda: limited.parametrize(2.7),
        "optimal": lambda: gg.optimal_gait(LOOP),
        "least period": lambda: gg.least_period(limited, limits_of(limited.vehicle)),
    }
    return makers[name]()


@pytest.mark.parametrize(
    "name", ["untimed", "posture", "constant speed", "rows", "within limits"]
)
def test_every_kind_of_gait_is_proved_with_rates_if_it_has_times(name: str) -> None:
    document = gg.certify(curve_of(name)).document
    assert unproved(document) == []
    assert ("rate" in document["claims"]) == (name not in ("untimed", "rows"))


@pytest.mark.parametrize("name", ["within limits", "optimal", "least period"])
def test_the_curve_is_that_of_the_gait(name: str) -> None:
    gait = curve_of(name)
    document = gg.certify(gait).document
    assert unproved(document) == []
    timed = gait
    if not isinstance(gait, gg.TimedGait):
        timed = gait.timed() if name == "optimal" else gait.timed
    start = 0.0
    for piece in document["pieces"][:10]:
        duration = float(Fraction(piece["duration"]))
        for share in (0.0, 0.3, 0.9):
            curves = (piece["alpha"] * 2)[:4]
            angles = [np.polyval(list(map(float, a[::-1])), share) for a in curves]
            expected = timed.at(start + share * duration).alpha
            np.testing.assert_allclose(angles, expected, rtol=0, atol=1e-9)
        start += duration


def test_claims_of_each_servo_are_its_limits_where_they_are_reached() -> None:
    limits = {"min_tilt": [0.4, -1.3, 0.0, -1.2], "max_tilt": [1.2, 0.0, 1.5, -0.4]}
    vehicle = gg.PAPER.replace(
        rotor_height=0.05, max_tilt_rate=[4.28, 9.0, 30.0, 4.3], **limits
    )
    gait = gg.lift(LOOP, "red", vehicle=vehicle).parametrize(1.2)
    document = gg.certify(gait, tilt="5deg").document
    assert unproved(document) == []
    tilt = document["claims"]["tilt"]
    for side, ends in (
        ("at_least", [0.4, -1.200001, 0.399999, -1.2]),
        ("at_most", [1.2, -0.399999, 1.200001, -0.4]),
    ):
        angles = list(map(float, tilt[side]))
        np.testing.assert_allclose(angles, ends, rtol=0, atol=2e-9)
    assert document["claims"]["rate"]["at_most"] == ["4.28", "4.4", "4.4", "4.3"]


@pytest.mark.parametrize("spin", ["clockwise", "counterclockwise"])
def test_however_small_the_drag_the_sign_of_R_has_that_of_the_spin(spin: Any) -> None:
    """With a height the force 2κR is not small where κ is."""
    vehicle = gg.PAPER.replace(
        rotor_height=0.05, drag_ratio=1e-9, first_rotor_spin=spin
    )
    document = gg.certify(
        gg.lift(LOOP, "red", vehicle=gg.PAPER.replace(rotor_height=0.05))
    ).document
    tiny = changed(document, "vehicle", "drag_to_thrust", to=["1/1" + "0" * 50] * 4)
    tiny = changed(tiny, "vehicle", "first_rotor_spin", to=spin)
    R = level_determinant(gg.lift(LOOP, "red").alpha, coefficients_of(vehicle))
    for sign, holds in (("positive", R > 0), ("negative", R < 0)):
        claim = {"sign": sign, "cover": [[f"{k}/64" for k in range(65)]] * 3}
        claims = {"joints": document["claims"]["joints"], "sign_of_R": claim}
        assert (unproved({**tiny, "claims": claims}) == []) == holds.all()


# -- Refused


def test_what_cannot_be_proved_is_refused_with_the_reason() -> None:
    vehicle = gg.PAPER.replace(max_tilt_acceleration=1e4)
    limited = gg.lift(LOOP, "red", vehicle=vehicle)
    sampled = table_of(limited.parametrize(2.0))
    some = {name: sampled[name][:95:7] for name in ("t", *ANGLES)}
    for gait, options, reason in (
        ("gait2", {}, "least singular value"),
        (limited.parametrize(2.0, law="constant-speed"), {}, "infinite"),
        (some, {"vehicle": vehicle}, "timing=False"),
    ):
        with pytest.raises(Infeasible, match=reason):
            gg.certify(gait, **options)  # type: ignore[arg-type]
    untimed = gg.certify(some, vehicle=vehicle, timing=False)
    assert "rate" not in untimed.document["claims"]
    rows = {name: sampled[name] for name in ("t", *ANGLES)}
    assert gg.certify(rows).document["pieces"]
    rates = {f"{name}_rate": sampled[f"{name}_rate"] for name in ANGLES}
    with pytest.raises(Infeasible, match="cubics through their rates"):
        gg.certify(rows | rates)


def test_angles_and_tilts_that_are_too_large_are_refused() -> None:
    turned = np.array([[0.4, -0.4, 0.4, -0.4], [0.5, -0.5, 0.5, -0.5]]) + 2 * math.pi
    with pytest.raises(InputError, match="at most 3.9 rad"):
        gg.certify(gg.Gait(alpha=turned, colors=("red", "red")))
    with pytest.raises(InputError, match="tilt"):
        gg.certify("gait3", tilt="90deg")


def test_jumps_of_rates_are_claimed_to_three_digits() -> None:
    timed = gg.lift(LOOP, "red").parametrize(1.0, law="constant-speed")
    ahead = np.roll(timed.gait.alpha, -1, axis=0) - timed.gait.alpha
    rates = ahead / np.diff(timed.corner_times)[:, None]
    largest = np.abs(rates - np.roll(rates, 1, axis=0)).max()
    joints = gg.certify(timed).document["claims"]["joints"]
    assert largest <= float(joints["rate_jump"]) <= largest * 1.01


def test_equal_arms_with_axes_of_their_own_stay_where_they_are() -> None:
    leaning = gg.PAPER.replace(tilt_axes=gg.PAPER.axes[0] + [0.0, 0.0, 0.1])
    places = np.array(stated_vehicle(leaning)["rotor_positions"], dtype=float)
    arm: Any = leaning.arm_length
    np.testing.assert_allclose(places, arm * np.array(leaning.scaled_positions))


# -- Commands


PLAN = (
    "plan --waypoint pi/8,-pi/8 --waypoint 3pi/8,-3pi/8 --waypoint 3pi/8,-pi/8".split()
)


@pytest.fixture
def planned(run: Any, tmp_path: Path) -> Path:
    answer = run(*PLAN, "--output", "q.csv", "--certify")
    assert answer.out.endswith("wrote q.csv\nwrote q.cert.json\n")
    return tmp_path


def shown(answer: Any) -> str:
    return " ".join(answer.out.split())


def test_a_certificate_is_verified_and_says_what_it_proves(
    planned: Path, run: Any
) -> None:
    answer = run("verify", "q.cert.json", "--json").json
    assert (answer["flyable"], answer["vehicle"]["name"]) == (True, "paper")
    assert answer["values"]["sign_of_R"] == {"sign": "negative"}
    assert {*answer["claims"].values()} == {""}
    assert run("certify", "q.csv", "--output", "again.json").code == 0
    text = (planned / "q.cert.json").read_text()
    assert (planned / "again.json").read_text() == text
    document = json.loads(text)
    wrong = changed(document, "claims", "sign_of_R", "sign", to="positive")
    (planned / "wrong.json").write_text(json.dumps(wrong))
    answer = run("verify", "wrong.json")
    assert (answer.code, "NOT proved: sign_of_R" in answer.out) == (1, True)
    huge = changed(document, "pieces", 0, "alpha", 0, to=["9" * 400])
    (planned / "huge.json").write_text(json.dumps(huge))
    answer = run("verify", "huge.json")
    assert (answer.code, len(answer.err.splitlines())) == (2, 1)
    less = changed(document, "claims", to={"joints": document["claims"]["joints"]})
    (planned / "less.json").write_text(json.dumps(less), encoding="utf-8-sig")
    answer = run("verify", "less.json")
    assert (answer.code, "not proved flyable" in answer.out) == (0, True)


def test_the_certificate_beside_a_table_belongs_to_its_rows_and_vehicle(
    planned: Path, run: Any
) -> None:
    assert "certificate" not in run("validate", "q.csv").out
    other = f"drag_ratio = {gg.PAPER.drag_ratio + 0.01!r}\n"
    (planned / "other.toml").write_text(other)
    beside, text = planned / "q.cert.json", (planned / "q.cert.json").read_text()
    twice = text.replace('"made_by":"', '"made_by":"", "made_by":"')
    for content, options, reason in (
        (text, ("--vehicle", "other.toml"), "moments of rotors differ by up to 0.01 "),
        ("x" + text, (), "is no certificate"),
        (twice, (), "is no certificate"),
    ):
        beside.write_text(content)
        answer = shown(run("validate", "q.csv", *options))
        assert "q.cert.json" in answer
        assert reason in answer
    beside.write_text(text)
    table = planned / "q.csv"
    table.write_text(table.read_text().replace("0.03,", "0.031,", 1))
    assert "does not belong to these rows" in shown(run("validate", "q.csv"))


def test_stamps_of_a_bag_are_whole_nanoseconds(planned: Path) -> None:
    """Between them the angles of a row go farther than certificate and curve are apart, but not a microradian."""
    pytest.importorskip("rosbags", reason="install gaitgraph[ros]")
    gait = gg.lift(LOOP, "red")
    closed = [*gait.alpha, gait.alpha[0]]
    uneven = table_from(closed, t=[0.0, 1 / 3, 10 / 3, 11 / 3])
    gg.io.write_tables(uneven, [planned / "q.mcap"])
    (alone,) = (planned / "q.mcap").glob("*.mcap")
    assert gg.certificates.verify(gg.certify(uneven), alone)
    certificate = gg.certify(gait.parametrize(1.0))
    late = gait.parametrize(1.0 + 3e-7, samples=7)
    late.write(planned / "late.mcap")
    found = gg.certificates.verify(certificate, planned / "late.mcap")
    assert found.off.startswith("row 2, t = 0.142857")


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("t,alpha1,alpha2,alpha3,alpha4\n0,0.4,-1.2,0.4,x\n", "alpha4"),
        ("alpha1,alpha2,alpha3,alpha4\n0.4,-1.2,0.4,-1.2\n", None),
        ("t,alpha1,alpha2,color\n0,0.4,-1.2,red\n1,0.4,-1.2,red\n", None),
    ],
)
def test_a_table_must_have_what_is_compared(
    planned: Path, text: str, field: str | None
) -> None:
    (planned / "x.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        gg.certificates.verify(planned / "q.cert.json", planned / "x.csv")
    assert caught.value.field == field
    back = "t,alpha1,alpha2,alpha3,alpha4\n1,0.4,-1.2,0.4,-1.2\n0,0.4,-1.2,0.4,-1.2\n"
    (planned / "back.csv").write_text(back)
    found = gg.certificates.verify(planned / "q.cert.json", planned / "back.csv")
    assert not found
    assert "row 2: t must be at least 1e-09 s after the row before" in found.off


def test_a_pace_at_its_limits_is_certified_by_the_command(
    planned: Path, run: Any
) -> None:
    (planned / "limited.toml").write_text(
        'preset = "paper"\nmax_tilt_acceleration = 50\n'
    )
    paced = ("pace", "q.csv", "--vehicle", "limited.toml", "--output", "paced.csv")
    assert run(*paced, "--certify").code == 0
    document = json.loads((planned / "paced.cert.json").read_text())
    bounds = document["claims"]["acceleration"]["at_most"]
    assert max(map(float, bounds)) <= 50 * (1 + 1e-9)


REFUSED = [
    ("certify gait1", 1, "not flyable"),
    ("certify gait3 --output q.cert.json", 2, "exists"),
    ("certify gait3 --tilt 2", 2, "tilt must be"),
    ("certify q.csv --output other.csv", 2, "must end in .json"),
    ("certify r.json --output ./r.json --force", 2, "another file than the gait"),
    ("verify q.csv", 2, "certificate 'q.csv'"),
    ("verify none.json", 2, "cannot be read"),
    (" ".join([*PLAN, "--certify"]), 2, "--certify must"),
    (
        " ".join([*PLAN, "--certify --output n.csv --output n.cert.json"]),
        2,
        "got 'n.cert.json' twice",
    ),
]


@pytest.mark.usefixtures("planned")
def test_commands_refuse_in_one_line(run: Any) -> None:
    for words, code, message in REFUSED:
        answer = run(*words.split())
        assert (answer.code, len(answer.err.splitlines())) == (code, 1), words
        assert message in answer.err
