"""One report for a gait and its biased gaits: numbers, places, what does not exist, and every form of gait."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely

import gaitgraph as gg
from gaitgraph.errors import InputError
from gaitgraph.gait.gait import Gait, lift
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.matrices import (
    determinant,
    least_singular_value,
    level_determinant,
)
from gaitgraph.invertibility.tilt_margins import (
    least_singular_value_within,
    tilt_margin,
)
from gaitgraph.robustness.biased import Robustness, robustness_of
from gaitgraph.timing.timed_gait import table_of
from tests.published import GAITS, PublishedGait
from tests.samples import EXACT, along, table_from

if TYPE_CHECKING:
    from pathlib import Path

    from gaitgraph.robustness.biased import RobustnessReport

G1, G2, G3, G4 = GAITS
KEYS = {
    "tilt_margin_deg",
    "acceptable_fraction",
    "singular_curves",
    "tilt_margin_reason",
    "acceptable_reason",
}


def red(gait: PublishedGait) -> Gait:
    return lift(gait.angles, "red")


POINT = table_from([[0.3, -0.3, 0.1, -0.2]])


def report_of(gait: Any, **options: Any) -> RobustnessReport:
    """Return a report without curves, its acceptable attitudes to within a thousandth."""
    return robustness_of(gait, **{"curves": 0, "tolerance": 1e-3, **options})


def quick(gait: Any, **options: Any) -> Robustness:
    return report_of(gait, **options).gait


@pytest.fixture(scope="module")
def report_of_3() -> RobustnessReport:
    return robustness_of(red(G3), bias=[1.0, 0.9, 0.8], scale=[0.5], curves=3)


@pytest.fixture(scope="module")
def report_of_2() -> RobustnessReport:
    gait = lift(G2.angles, "blue", coefficients=EXACT)
    return report_of(gait, bias=[0.99, 0.8, 1.0], curves=2)


class TestThePaper:
    def test_the_sweep_of_gait_3(self, report_of_3: RobustnessReport) -> None:
        plain, same, mild, biased, scaled = (report_of_3.gait, *report_of_3.sweep)
        assert plain.tilt_margin == same.tilt_margin == math.pi / 2
        assert math.degrees(biased.tilt_margin or 0.0) == pytest.approx(
            74.46, abs=5.1e-3
        )
        assert (
            plain.acceptable.fraction
            == 1.0
            > mild.acceptable.fraction
            > biased.acceptable.fraction
        )
        assert biased.acceptable.fraction == pytest.approx(0.85154, abs=5e-5)
        assert (
            plain.singular_value[1]
            > mild.singular_value[1]
            > biased.singular_value[1]
            > 0
        )
        assert scaled.tilt_margin == math.pi / 2
        names = [one.name for one in report_of_3.sweep]
        assert names == [
            "biased by 1",
            "biased by 0.9",
            "biased by 0.8",
            "scaled by 0.5",
        ]
        assert plain.direction is None
        assert [curve.kind for _, curve in plain.curves + biased.curves] == [
            "none"
        ] * 3 + ["curve"] * 3

    def test_gaits_1_and_2_have_no_margin(self, report_of_2: RobustnessReport) -> None:
        published = quick(lift(G2.angles, "blue"), curves=2)
        for none in (report_of_2.gait, report_of_2.sweep[2], published):
            assert (none.tilt_margin, none.direction, none.acceptable.fraction) == (
                None,
                None,
                0.0,
            )
            assert none.singular_value == (0.0, 0.0)
            assert "singular at every attitude" in none.margin.reason
            assert {curve.kind for _, curve in none.curves} == {"everywhere"}
        first = report_of(lift(G1.angles, "blue", coefficients=EXACT), bias=0.8)
        assert first.gait.tilt_margin is None
        assert first.sweep[0].tilt_margin == 0.0
        assert first.sweep[0].margin.reason == "R changes its sign"
        assert abs(level_determinant(first.sweep[0].where.alpha, EXACT)) < 1e-12

    def test_printed_digits_make_no_margin(self, tmp_path: Path) -> None:
        """Three digits of a blue gait leave up to 44° of noise: as a gait, a table and a file they say none."""
        rows = np.column_stack([np.round(G2.angles, 3), G2.printed])
        path = tmp_path / "printed.csv"
        lines = "\n".join(",".join(f"{angle:.3f}" for angle in row) for row in rows)
        path.write_text(f"alpha1,alpha2,alpha3,alpha4\n{lines}\n")
        assert (quick(path, angle_rounding=0.0).tilt_margin or 0) > 0.5
        for form in (path, table_from(rows), Gait(alpha=rows, colors=("blue",) * 4)):
            found = quick(form)
            assert found.tilt_margin is None
            assert "singular at every attitude" in found.margin.reason
            assert found.acceptable.polygon.is_empty
        # Three digits of red lose nothing.
        assert (
            quick(table_from(np.hstack([G3.printed, G3.printed]))).tilt_margin
            == math.pi / 2
        )

    def test_published_coefficients_on_request(self) -> None:
        biased = red(G3).biased(0.8)
        exact, published = (
            report_of(biased, coefficients=kind, tolerance=0.1)
            for kind in ("exact", "published")
        )
        assert (exact.coefficients.kind, published.coefficients.kind) == (
            "exact",
            "published",
        )
        assert exact.gait.tilt_margin != published.gait.tilt_margin
        assert exact.gait.tilt_margin == pytest.approx(
            published.gait.tilt_margin, abs=1e-3
        )

    def test_printed_digits_as_they_stand(self) -> None:
        """Figures 18, 19 and 22: with the printed numbers Gaits 1 and 2 are never singular, in the physics always."""
        for gait, eta, biased in ((G1, 0.8, 0.0), (G2, 0.99, 41.85), (G2, 0.8, 44.99)):
            for kind in ("published", "printed"):
                report = report_of(
                    lift(gait.angles, "blue", coefficients=coefficients_of(kind=kind)),
                    bias=eta,
                    coefficients="printed",
                )
                assert report.coefficients.kind == "printed"
                assert report.gait.tilt_margin == math.pi / 2
                assert report.gait.verdict == "no singular attitude"
                margin = math.degrees(report.sweep[0].tilt_margin or 0.0)
                assert margin == pytest.approx(biased, abs=5e-3)
        # The physics of the same angles, and of those of other digits, is as before.
        four = lift(G2.angles, "blue", coefficients=coefficients_of(kind="printed"))
        assert quick(four).tilt_margin is None
        exact = lift(G2.angles, "blue", coefficients=EXACT)
        assert quick(exact, coefficients="printed").tilt_margin is None
        assert (quick(four, angle_rounding=0.0).tilt_margin or 0.0) > 0.7


class TestAgainstSampling:
    @pytest.mark.parametrize("number", range(6))
    def test_random_gaits(self, number: int) -> None:
        random = np.random.default_rng(number)
        points = random.uniform(-0.5, 0.5, 4) + random.uniform(
            -0.3, 0.3, (random.integers(2, 5), 4)
        )
        if number % 2:
            points[:, 2:] = points[:, :2] + random.normal(0, 0.05, 2)
        tilt = (0.0, 0.2, 0.5)[number % 3]
        found = quick(table_from(points), tilt=tilt)
        alpha = along(points, 200)
        R, margin = level_determinant(alpha, EXACT), tilt_margin(alpha, EXACT)
        if R.min() * R.max() < 0:
            assert (found.tilt_margin, found.singular_value) == (0.0, (0.0, 0.0))
            assert abs(level_determinant(found.where.alpha, EXACT)) < 1e-12
            return
        assert found.margin.lower <= margin.min() + 1e-12
        assert found.tilt_margin == pytest.approx(
            tilt_margin(found.where.alpha, EXACT), abs=1e-12
        )
        assert found.direction is not None
        assert abs(determinant(found.where.alpha, EXACT, *found.direction)) < 1e-7
        if found.margin.upper > tilt:
            dense = least_singular_value_within(alpha, tilt)[0].min()
            lower, upper = found.singular_value
            assert upper - 5.01e-4 <= lower <= dense + 1e-12
            assert upper <= dense + 5.01e-4
            at = least_singular_value(
                found.singular_where.alpha, gg.PAPER, *found.singular_attitude
            )
            assert at == pytest.approx(upper, abs=1e-12)

    def test_a_long_table_is_searched_like_a_short_one(self) -> None:
        """Rows far from the least are left out, none that matters."""
        rows = along(red(G4).biased(0.9).alpha, 201) + np.random.default_rng(1).normal(
            0, 2e-4, (4 * 201, 4)
        )
        found = quick(table_from(rows), tolerance=1e-2)
        dense = least_singular_value_within(rows, math.radians(30))[0].min()
        assert found.singular_value[0] <= dense <= found.singular_value[1] + 5e-4
        assert found.singular_value[1] <= dense + 1e-12
        assert found.tilt_margin == pytest.approx(
            tilt_margin(rows, EXACT).min(), abs=1e-6
        )


class TestForms:
    def test_one_answer(self, tmp_path: Path) -> None:
        gait = red(G3).biased(0.9)
        timed = gait.parametrize(samples=40)
        timed.write(tmp_path / "gait.csv", tmp_path / "gait.json")
        forms = [
            gait,
            timed,
            table_of(timed),
            tmp_path / "gait.csv",
            str(tmp_path / "gait.json"),
        ]
        found = [quick(form) for form in forms]
        for one in found:
            assert one.tilt_margin == pytest.approx(found[0].tilt_margin, abs=1e-6)
            assert one.acceptable.fraction == pytest.approx(
                found[0].acceptable.fraction, abs=2e-3
            )
            assert one.singular_value[1] == pytest.approx(
                found[0].singular_value[1], abs=5e-4
            )
            assert one.where.noun == "corner"
        rows = table_from(timed.alpha, t=timed.t)
        assert (quick(rows).where.noun, quick(rows).where.t) == ("row", 0.0)

    def test_a_point(self) -> None:
        found = quick(POINT, curves=5)
        assert found.tilt_margin == pytest.approx(
            tilt_margin(POINT.alpha[0], EXACT), abs=1e-12
        )
        assert len(found.curves) == 1
        again = quick(table_from([*POINT.alpha] * 3))
        assert again.tilt_margin == found.tilt_margin
        assert again.singular_value == pytest.approx(found.singular_value)
        assert (
            quick(
                table_from(lift([(0.4, 0.5)], "blue", coefficients=EXACT).alpha)
            ).tilt_margin
            is None
        )

    def test_another_vehicle(self) -> None:
        rows = red(G3).alpha * [1, 1, 0.9, 0.9]
        vehicle = gg.Vehicle(
            name="mine",
            drag_ratio=0.3,
            first_arm_angle=0.4,
            first_rotor_spin="counterclockwise",
        )
        report = report_of(table_from(rows), vehicle=vehicle)
        assert report.vehicle.name == "mine"
        margin = tilt_margin(along(rows, 500), coefficients_of(vehicle, "exact")).min()
        assert report.gait.margin.upper == pytest.approx(margin, abs=1e-4)
        with pytest.raises(InputError, match="vehicle"):
            robustness_of(red(G3), vehicle=vehicle)

    def test_curves_are_spread_over_the_gait(self) -> None:
        gait = red(G3).biased(0.8)
        curves = report_of(gait, curves=40).gait.curves
        places = np.array([place.alpha for place, _ in curves])
        steps = np.linalg.norm(np.diff(np.vstack([places, places[:1]]), axis=0), axis=1)
        assert (
            steps.max()
            <= np.linalg.norm(gait.ends - gait.alpha, axis=1).sum() / 40 + 1e-9
        )
        for place, curve in curves:
            np.testing.assert_allclose(
                determinant(np.array(place.alpha), EXACT, *curve.points(9).T),
                0.0,
                atol=1e-6,
            )
        assert robustness_of(gait, curves=0).gait.curves == ()


class TestAnswers:
    @pytest.mark.parametrize("bias", [[], np.array([0.8]), [0.9, 0.8]], ids=len)
    def test_plain_values(self, bias: Any) -> None:
        """JSON that any reader takes: no NaN, the keys of the design, null with a reason."""
        for gait in (red(G3), lift(G2.angles, "blue")):
            data = report_of(gait, bias=bias, curves=2, tolerance=0.1).as_mapping()
            assert json.loads(json.dumps(data, allow_nan=False)) == data
            assert set(data) >= KEYS | {"least_singular_value", "tilt_margin_where"}
            assert len(data["singular_curves"]) == 2
            assert data["biased"] == (data["sweep"][0] if len(bias) == 1 else None)
            assert [one["eta"] for one in data["sweep"]] == list(bias)
            assert all(set(one) >= KEYS | {"scaling"} for one in data["sweep"])
            assert (data["tilt_margin_deg"] is None) == (gait.colors[0] == "blue")
            assert (data["tilt_margin_reason"] is None) == (gait.colors[0] == "red")

    def test_curves_as_plain_values(self, report_of_3: RobustnessReport) -> None:
        assert all(
            not curve["branches"]
            for curve in report_of_3.gait.as_mapping()["singular_curves"]
        )
        biased = report_of_3.sweep[2].as_mapping()
        for curve in biased["singular_curves"]:
            (branch,) = curve["branches"]
            size = math.hypot(curve["R_theta"], curve["R_phi"], curve["R"])
            for roll, pitch in branch:
                across = curve["R_theta"] * math.sin(pitch) + curve["R_phi"] * math.sin(
                    roll
                ) * math.cos(pitch)
                assert (
                    abs(across + curve["R"] * math.cos(roll) * math.cos(pitch))
                    < 1e-7 * size
                )
        outline = shapely.Polygon(biased["acceptable_outline"])
        assert outline.is_valid
        assert outline.area == pytest.approx(biased["acceptable_area"], abs=2e-2)

    def test_for_people(
        self, report_of_3: RobustnessReport, report_of_2: RobustnessReport
    ) -> None:
        text, plain = str(report_of_3), report_of_3.gait
        assert all(
            part in text
            for part in (
                "90° in every direction",
                "74.46°",
                "% of attitudes (error below ",
            )
        )
        assert "singular at every attitude" in str(report_of_2)
        assert "R changes its sign" in str(report_of(lift(G1.angles, "blue"), bias=0.8))
        unmet = str(
            report_of(
                table_from([[0.1, 0.2, 0.3, 0.4], [0.2, 0.3, 0.1, 0.1]]),
                tolerance=1e-12,
            )
        )
        assert "the requested 1e-10 % is not reached" in unmet
        for error, part in (
            (1.99e-3, "0.2"),
            (2.01e-3, "0.3"),
            (9.9e-3, "1"),
            (0.0251, "3"),
        ):
            bounded = replace(
                report_of_3,
                gait=replace(plain, acceptable=replace(plain.acceptable, error=error)),
            )
            assert (
                f"(error below {part} %; the requested 0.001 % is not reached)"
                in str(bounded)
            )


def test_nothing_is_acceptable_where_R_changes_its_sign_between_rows() -> None:
    loop = [
        [
            -1.1346735319611052,
            0.1449422531604418,
            -1.1910614840086144,
            0.08960440017776716,
        ],
        [
            -1.2671181809544736,
            0.8419998156504404,
            -1.29683224287851,
            0.8392708910702916,
        ],
        [
            -0.7317355063348563,
            0.9174112579075016,
            -0.7844483238485845,
            0.8870348582299663,
        ],
    ]
    kappa = 1.261899036411297
    found = robustness_of(
        loop, bias=0.4937052482867178, vehicle=gg.Vehicle(drag_ratio=kappa)
    )
    biased = found.sweep[0]
    assert biased.tilt_margin == 0
    assert biased.acceptable.fraction == 0
    assert biased.acceptable.reason.startswith("R changes its sign")
