"""Rotors above or below the centre of mass: the matrices and their closed forms, bounds, regions, gaits and flights."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from scipy.ndimage import label

import gaitgraph as gg
from gaitgraph.errors import InputError
from gaitgraph.explorer.map_query import map_answer
from gaitgraph.invertibility import matrices, segment_bounds as bounds, tilt_margins
from gaitgraph.invertibility.coefficients import coefficients_of
from gaitgraph.invertibility.forms import Bends
from gaitgraph.plots.axes import blank_figure
from gaitgraph.plots.planes import draw_zeros_of_R
from gaitgraph.plots.vehicles import vehicle_view
from gaitgraph.surface import sign_region, singular_value_region
from gaitgraph.surface.sheets import red_label, separating_factor
from gaitgraph.vehicle import PAPER, Vehicle

FloatArray = npt.NDArray[np.float64]
RAISED = PAPER.replace(name="raised", rotor_height=0.15 * 0.1785)
CORNERS = np.array([(3, -3), (3, -1), (1, -1), (1, -3)]) * math.pi / 8


def drawn(rng: np.random.Generator, height: float | None = None) -> Vehicle:
    spin = "clockwise" if rng.random() < 0.5 else "counterclockwise"
    height = rng.uniform(-2, 2) if height is None else height
    kappa = 10 ** rng.uniform(-1.5, 0.3)
    return Vehicle(
        drag_ratio=kappa, arm_length=1.0, rotor_height=height, first_rotor_spin=spin
    )


def raised_matrix(alpha: FloatArray, vehicle: Vehicle, up: FloatArray) -> FloatArray:
    """Return the scaled matrix from F and τ without a height, τ′ = τ + H ẑ × F, of one configuration."""
    force, moment = matrices.rotor_directions(alpha, vehicle.replace(rotor_height=0.0))
    return np.vstack(
        [
            moment + vehicle.height_ratio * np.cross([0, 0, 1.0], force, axis=0),
            up @ force,
        ]
    )


def test_sympy_proves_the_formulas() -> None:
    """The minors of τ′, the lean of N, both blocks on red, R on red and fibres, and [Fx; Fy] on ker τ of blue."""
    sympy = pytest.importorskip("sympy")
    a1, a2, a3, a4, H, delta = sympy.symbols("a1 a2 a3 a4 H delta", real=True)
    kappa, alpha = sympy.tan(delta), (a1, a2, a3, a4)
    s, c = [sympy.sin(a) for a in alpha], [sympy.cos(a) for a in alpha]
    lift = sympy.diag(-1, 1, -1, 1)  # from thrusts to rotor inputs and back
    force = (
        sympy.Matrix(
            [[0, s[1], 0, -s[3]], [s[0], 0, -s[2], 0], [-c[0], c[1], -c[2], c[3]]]
        )
        * lift
    )
    rows = [
        [0, c[1] - kappa * s[1], 0, -c[3] + kappa * s[3]],
        [c[0] + kappa * s[0], 0, -c[2] - kappa * s[2], 0],
    ]
    rows += [
        [
            s[0] - kappa * c[0],
            -s[1] - kappa * c[1],
            s[2] - kappa * c[2],
            -s[3] - kappa * c[3],
        ]
    ]
    torque = sympy.Matrix(rows) * lift + H * sympy.Matrix.vstack(
        -force[1, :], force[0, :], sympy.zeros(1, 4)
    )

    angles = (*alpha, delta)
    of_sine, of_cosine = sympy.symbols("s1:5 sd"), sympy.symbols("c1:5 cd")
    circles = [
        one**2 + other**2 - 1 for one, other in zip(of_sine, of_cosine, strict=True)
    ]
    plain = {sympy.sin(a): one for a, one in zip(angles, of_sine, strict=True)}
    plain |= {sympy.cos(a): one for a, one in zip(angles, of_cosine, strict=True)}

    def vanishes(expression: Any) -> bool:
        """Return whether the remainder of the numerator modulo sin² + cos² = 1 is zero."""
        for one in sympy.Matrix([expression]):
            expanded = sympy.expand_trig(
                one.subs(sympy.tan(delta), sympy.sin(delta) / sympy.cos(delta))
            )
            numerator = sympy.numer(sympy.together(expanded.subs(plain)))
            if (
                sympy.reduced(sympy.expand(numerator), circles, *of_sine, *of_cosine)[1]
                != 0
            ):
                return False
        return True

    x, y, u, v = a1 + a3 - 2 * delta, a2 + a4 + 2 * delta, a1 - a3, a2 - a4
    E = 2 * s[0] * s[2] - kappa * sympy.sin(a1 + a3)
    E2 = 2 * s[1] * s[3] + kappa * sympy.sin(a2 + a4)
    lean, rise = H * sympy.cos(delta) ** 2, H**2 * sympy.cos(delta) ** 3
    b1, b2, b3, b4 = a1 - delta, a2 + delta, a3 - delta, a4 + delta
    sine, cosine = sympy.sin, sympy.cos
    inputs = sympy.Matrix(
        [
            -sine(y) * cosine(b3) + lean * sine(b3) * sine(v) - rise * s[2] * E2,
            sine(x) * cosine(b4) + lean * sine(b4) * sine(u) + rise * s[3] * E,
            -sine(y) * cosine(b1) - lean * sine(b1) * sine(v) - rise * s[0] * E2,
            sine(x) * cosine(b2) - lean * sine(b2) * sine(u) + rise * s[1] * E,
        ]
    )
    last = torque[:, :3].det()
    assert vanishes(last + inputs[3] / cosine(delta) ** 3)
    assert vanishes(torque * inputs)
    direction = force * inputs
    assert vanishes(
        direction[0]
        - cosine(delta) * sine(x) * sine(v)
        - lean * sine(u) * E2 * cosine(delta)
    )
    assert vanishes(
        direction[1]
        - cosine(delta) * sine(y) * sine(u)
        - lean * -sine(v) * E * cosine(delta)
    )
    # On red the two blocks, and hover thrusts in the ratio of H = 0.
    red = {a3: a1, a4: a2}
    P = (c[0] + kappa * s[0]) * (c[1] - kappa * s[1]) + H**2 * s[0] * s[1]
    D = 2 * kappa * c[0] * c[1] - sine(a1 - a2)
    assert vanishes(
        inputs.subs(red)
        - 2 * cosine(delta) ** 2 * P * sympy.Matrix([-sine(b2), sine(b1)] * 2)
    )
    whole = torque.col_join(force[2, :]).subs(red)
    assert vanishes(whole.det() - 4 * P * D)
    mix = sympy.Matrix([[1, 0, 1, 0], [0, 1, 0, 1], [-1, 0, 1, 0], [0, -1, 0, 1]])
    split = whole * mix.T
    assert vanishes(split[:2, :2])
    assert vanishes(split[2:, 2:])
    # On the fibres E or E′ vanishes, and R gains H²·sin 2δ times the other over 2κ.
    first, second = {a1: delta, a3: delta}, {a2: -delta, a4: -delta}
    assert vanishes(E.subs(first))
    assert vanishes(E2.subs(second))
    gained = H**2 * sine(2 * delta)
    full = torque.col_join(force[2, :]).det()
    assert vanishes(full.subs(first) - 2 * sine(y) / cosine(delta) ** 2 - gained * E2)
    assert vanishes(full.subs(second) + 2 * sine(x) / cosine(delta) ** 2 - gained * E)
    # Of the pairs of thrusts that make no torque on blue, and on the copy of the first fibre, for H = 0.
    blue = {a3: 2 * delta - a1, a4: -2 * delta - a2}
    pairs = sympy.Matrix([[1, 0, 1, 0], [0, 1, 0, 1]]).T
    assert vanishes((torque.subs(H, 0) * pairs).subs(blue))
    lateral = (force[:2, :] * pairs).subs(blue)
    assert vanishes(lateral.det() - 4 * cosine(delta) ** 2 * sine(b1) * sine(b2))
    copy = {a1: delta + sympy.pi / 2, a3: delta + sympy.pi / 2}
    free = sympy.Matrix(
        [[1, 0, -1, 0], [-sine(y) / 2, cosine(b4), -sine(y) / 2, cosine(b2)]]
    ).T
    assert vanishes((torque.subs(H, 0) * free).subs(copy))
    assert vanishes(
        (force[:2, :] * free).subs(copy).det() - 2 * cosine(delta) ** 2 * sine(v)
    )


def test_random_configurations_against_determinants_and_decompositions() -> None:
    rng = np.random.default_rng(1)
    for _ in range(25):
        vehicle = drawn(rng).replace(first_arm_angle=rng.uniform(-3, 3))
        exact, size = (
            coefficients_of(vehicle),
            1 + abs(vehicle.height_ratio) ** 2 + 1 / vehicle.drag_ratio,
        )
        alpha, attitude = (
            rng.uniform(-math.pi, math.pi, (50, 4)),
            rng.uniform(-1.4, 1.4, (2, 50)),
        )
        up = matrices.body_vertical(*attitude)
        whole = np.array(
            [raised_matrix(one, vehicle, n) for one, n in zip(alpha, up, strict=True)]
        )
        np.testing.assert_allclose(
            matrices.scaled_decoupling_matrix(alpha, vehicle, *attitude),
            whole,
            atol=1e-14,
        )
        found = (
            2
            * vehicle.signed_drag_ratio
            * matrices.determinant(alpha, exact, *attitude)
        )
        np.testing.assert_allclose(found, np.linalg.det(whole), atol=1e-12 * size)
        inputs = matrices.zero_moment_inputs(alpha, vehicle)
        assert (
            np.abs(np.einsum("kij,kj->ki", whole[:, :3], inputs)).max()
            < 1e-11 * size**2
        )
        level = np.linalg.svd(
            matrices.scaled_decoupling_matrix(alpha, vehicle), compute_uv=False
        )
        assert level[:, 3].max() <= matrices.largest_least_singular_value(vehicle)
        on_red = alpha[:, [0, 1, 0, 1]]
        closed = matrices.least_singular_value_on_red(alpha[:, 0], alpha[:, 1], vehicle)
        np.testing.assert_allclose(
            closed, matrices.least_singular_value(on_red, vehicle), atol=1e-13 * size
        )
        flat = vehicle.replace(rotor_height=0.0)
        shares = [matrices.hover_thrust_shares(on_red, one) for one in (vehicle, flat)]
        tame = np.abs(matrices.level_determinant(on_red, coefficients_of(flat))) > 0.1
        tame &= np.abs(matrices.level_determinant(on_red, exact)) > 0.1
        np.testing.assert_allclose(shares[0][tame], shares[1][tame], rtol=1e-9)


def test_bounds_hold_on_random_segments() -> None:
    rng = np.random.default_rng(2)
    s = np.linspace(0, 1, 201)[:, None]
    for _ in range(10):
        vehicle = drawn(rng)
        exact = coefficients_of(vehicle)
        start, step = rng.uniform(-1.5, 1.5, (40, 4)), rng.normal(0, 0.5, (40, 4))
        start[:15, 2:], step[:15, 2:] = start[:15, :2], step[:15, :2]  # red
        turned = np.array([2, -2]) * exact.delta
        start[15:20, 2:], step[15:20, 2:] = (
            turned - start[15:20, :2],
            -step[15:20, :2],
        )  # blue
        start[20:25, ::2], step[20:25, ::2] = exact.delta, 0.0  # the first fibre
        alpha, end, small = (
            start[:, None] + s * step[:, None],
            start + step,
            1e-5 * (1 + 1 / vehicle.drag_ratio),
        )
        v = matrices.attitude_sensitivities(alpha, exact)
        roll, pitch, R = v[..., 1], -v[..., 0], v[..., 2]
        bends = Bends(exact.form).along(step)
        second = np.abs(np.diff(v, 2, axis=1)).max(axis=1) * 200**2
        assert (second <= bends.T + small).all()
        values = np.linalg.svd(
            matrices.scaled_decoupling_matrix(alpha, vehicle), compute_uv=False
        )
        moved = np.abs(np.diff(values, axis=1)).max(axis=(1, 2)) * 200
        assert (
            moved
            <= matrices.singular_value_rate(vehicle) * np.linalg.norm(step, axis=1)
            + 1e-9
        ).all()
        for part in (slice(0, 15), slice(15, 40)):
            p, q, least = start[part], end[part], values[part, :, 3].min(axis=1)
            found = bounds.least_singular_value_along(p, q, vehicle, each=True)
            assert (found.lower <= least + 1e-12).all()
            assert (found.upper <= least + 1e-4).all()
            assert (found.upper - found.lower <= 1.01e-4).all()
            clear = np.abs(least - (floor := float(np.median(least)))) > 2e-3
            kept = bounds.keeps_singular_value_above(p, q, floor, vehicle)
            assert (kept == (least > floor))[clear].all()
            shares = matrices.hover_thrust_shares(alpha[part], vehicle)
            inside = (np.abs(alpha[part]) <= math.pi / 2).all(axis=(1, 2))
            upward, low, high = bounds.thrust_shares_along(p, q, vehicle, each=True)
            # Not the shares alone: they keep their sign where all thrusts vanish together, at R = 0.
            thrusts = matrices.thrust_signs(vehicle) * matrices.zero_moment_inputs(
                alpha[part], vehicle
            )
            push, barely = (
                inside
                & (
                    (thrusts > least_thrust).all(axis=(1, 2))
                    | (thrusts < -least_thrust).all(axis=(1, 2))
                )
                for least_thrust in (1e-4, 0.0)
            )
            assert (upward >= push).all()
            assert (upward <= barely).all()
            assert (low.lower[upward] <= shares[upward].min(axis=(1, 2)) + 1e-12).all()
            assert (low.upper[upward] <= shares[upward].min(axis=(1, 2)) + 1e-3).all()
            assert (
                -high.lower[upward] >= shares[upward].max(axis=(1, 2)) - 1e-12
            ).all()
        residual = bounds.largest_residual(start, end, exact, tolerance=1e-4, each=True)
        true = np.maximum(np.abs(roll), np.abs(pitch)).max(axis=1)
        assert (-residual.lower >= true - 1e-12).all()
        assert (-residual.lower <= true + 100 * small).all()
        assert true[:15].max() < small * 1e-6 > true[20:25].max()
        for k in np.flatnonzero(np.abs(R).min(axis=1) > 0.1 * np.abs(R).max(axis=1))[
            :6
        ]:
            margin = tilt_margins.least_tilt_margin([start[k], end[k]], exact)
            sampled = tilt_margins.tilt_margin(alpha[k], exact).min()
            assert margin.lower <= sampled + 1e-9
            assert (
                margin.upper <= sampled + 1e-3
                if k >= 15
                else margin.lower > math.pi / 2 - 1e-6
            )


def test_a_height_of_zero_changes_nothing() -> None:
    alpha = np.random.default_rng(3).uniform(-3, 3, (5000, 4))
    kappa, first, second = PAPER.drag_ratio, alpha[:, 0], alpha[:, 1]
    a, b = (
        np.cos(second) - kappa * np.sin(second),
        np.cos(first) + kappa * np.sin(first),
    )
    alone = math.sqrt(2.0) * np.minimum(np.abs(a), np.abs(b))
    angles = np.array([first, second])
    on_red = angles[[0, 1, 0, 1]].T
    values = np.linalg.svd(matrices.scaled_decoupling_matrix(on_red), compute_uv=False)
    off = np.abs(values - alone[:, None]).min(axis=1)
    assert off.max() < 1e-14  # one of the singular values
    assert matrices.singular_value_rate(PAPER) == pytest.approx(math.sqrt(2 + kappa**2))
    largest = matrices.largest_least_singular_value(PAPER)
    assert largest == pytest.approx(2 * math.sqrt((1 + kappa**2) / 3))


@pytest.mark.parametrize(
    ("kappa", "height"),
    [
        (0.168666, 0.15),
        (1.4, -2.8),
        (1.2, math.sqrt(2.44)),
        (0.06, 10.0),
    ],
)
def test_regions_and_labels(kappa: float, height: float) -> None:
    rng = np.random.default_rng(4)
    spin = "clockwise" if height > 0 else "counterclockwise"
    vehicle = Vehicle(
        drag_ratio=kappa, arm_length=1.0, rotor_height=height, first_rotor_spin=spin
    )
    points = rng.uniform(-math.pi / 2, math.pi / 2, (1000, 2))
    alpha, exact = np.hstack([points, points]), coefficients_of(vehicle)
    R, least = (
        matrices.level_determinant(alpha, exact),
        matrices.least_singular_value(alpha, vehicle),
    )
    assert (
        np.sign(R) == red_label(points[:, 0], points[:, 1], vehicle).prod(axis=1)
    ).all()
    assert red_label(0.0, 0.0, vehicle).tolist() == [1, 1, 1]
    # Each label is of one component, up to a few nodes beside a border.
    axis = np.linspace(-math.pi / 2, math.pi / 2, 603)[1:-1]
    codes = red_label(axis[:, None], axis[None, :], vehicle) @ [9, 3, 1]
    for code in np.unique(codes):
        parts = np.sort(np.bincount(label(codes == code)[0].ravel())[1:])[::-1]
        assert (parts[1:] <= 12).all()
    asked = shapely.points(points)
    regions = [
        (sign_region("positive", vehicle), R),
        (sign_region("negative", vehicle, least=0.05), -R - 0.05),
    ]
    regions += [
        (singular_value_region(floor, vehicle, accuracy=1e-5), least - floor)
        for floor in (0.05, 0.4)
    ]
    for region, above in regions:
        inner = region.contains(points)
        assert (above[inner] >= 0).all()
        assert (above[~shapely.covers(region.outer, asked)] < 0).all()
        clear = np.abs(above) > 1e-3
        assert (inner == (above > 0))[clear].all()


class TestGaits:
    def test_red_ones_are_planned_reachable_and_settle(self) -> None:
        for height in (0.15, -0.15):
            vehicle = PAPER.replace(rotor_height=height * 0.1785)
            for corners, hover in ((CORNERS, False), (-CORNERS, True)):
                plan = gg.plan_loop(corners, vehicle=vehicle)
                assert plan.loop is not None
                gait, flat = plan.loop.gait, gg.plan_loop(corners).loop
                report = gait.check()
                assert (bool(report.flyable), report.reachable_from_hover) == (
                    True,
                    hover,
                )
                assert flat is not None
                shares = [
                    one.check()["hover_thrust"].value for one in (gait, flat.gait)
                ]
                assert shares[0] == pytest.approx(shares[1], abs=2e-4)
                assert gg.robustness_of(gait).gait.tilt_margin == pytest.approx(
                    math.pi / 2, abs=1e-6
                )
                if corners is CORNERS:
                    pytest.importorskip("mujoco")
                    assert gg.fly(gait.parametrize(1.0)).settled

    def test_blue_is_judged_by_physics(self) -> None:
        """Level flight is invertible but the gait is not robust; with rotors high enough it flies."""
        corners = [(0.9, -0.9), (0.9, -0.4), (0.4, -0.4)]
        low, high = (
            gg.lift(corners, "blue", vehicle=PAPER.replace(rotor_height=h))
            for h in (0.01, 0.1)
        )
        reports = [gait.check() for gait in (low, high)]
        assert not any(report.valid for report in reports)
        assert (
            "on blue the zero-moment direction leans"
            in reports[0]["on_surface"].message
        )
        assert [report["least_singular_value"].ok for report in reports] == [
            False,
            True,
        ]
        assert all(
            report[name].ok for report in reports for name in ("R_sign", "hover_thrust")
        )
        assert all(
            (gg.robustness_of(gait).gait.tilt_margin or 0.0) < 1.2
            for gait in (low, high)
        )
        pytest.importorskip("mujoco")
        assert "least singular value" in gg.fly(low.parametrize(1.0)).reason
        assert gg.fly(high.parametrize(1.0)).settled
        flat = gg.lift(corners, "blue", coefficients="exact")
        assert "rank two on blue" in flat.check()["hover_thrust"].message

    def test_one_color_is_left(self) -> None:
        exact = coefficients_of(RAISED)
        assert [root.color for root in gg.roots(0.3, 0.1, coefficients=exact)] == [
            "red",
            "none",
        ]
        fiber = gg.roots(exact.delta, 0.1, coefficients=exact).fibers
        assert [one.name for one in fiber] == ["first"]
        assert gg.surface_graph("positive", vehicle=RAISED).number_of_nodes() > 0
        assert {
            data["color"]
            for _, data in gg.surface_graph("positive", vehicle=RAISED).nodes(data=True)
        } == {"red"}
        for require in ("valid", "flyable"):
            plan = gg.plan_loop(CORNERS, vehicle=RAISED, color="blue", require=require)
            assert (
                "blue: no gait surface (use red), since its zero-moment direction leans"
                in str(plan.reason)
            )
        assert sign_region("positive", RAISED, color="blue").area == 0
        with pytest.raises(
            InputError, match=r"rotor height 0\.026775 m\), got 'published'"
        ):
            coefficients_of(RAISED, "published")
        names = (
            separating_factor((0, 0), (1.2, -1.2), RAISED),
            separating_factor((0, 0), (-1.55, 0.0), RAISED),
        )
        assert "tan α1 − tan α2 = 2κ" in str(names[0])
        assert str(names[1]).count("H = 0.15") == 1


def test_the_vehicle_and_its_singular_curves_are_drawn() -> None:
    flat, high = (
        vehicle_view(np.zeros(4), one, view=(0.0, 0.0)) for one in (PAPER, RAISED)
    )
    np.testing.assert_allclose(
        high.arms - flat.arms, np.tile([0.0, 0.15], (4, 1)), atol=1e-12
    )
    np.testing.assert_allclose(high.hub, [0.0, 0.15], atol=1e-12)
    ax = blank_figure(80, 80).add_subplot()
    draw_zeros_of_R(ax, RAISED)
    points = np.concatenate([np.column_stack(line.get_data()) for line in ax.lines])
    points = points[np.isfinite(points).all(axis=1)]
    R = matrices.level_determinant(points[:, [0, 1, 0, 1]], coefficients_of(RAISED))
    assert len(points) > 390
    assert np.abs(R).max() < 1e-12
    assert "raised" not in map_answer(
        {"vehicle": "paper", "sheet": "blue", "shading": "R"}
    )


def test_rotors_follow_with_their_lag() -> None:
    pytest.importorskip("mujoco")
    gait = gg.lift(
        [(-0.4, 0.4)], "red", vehicle=PAPER.replace(rotor_lag=0.02)
    ).parametrize(1.0)
    lagging, prompt = (
        gg.fly(gait),
        gg.fly(gg.lift([(-0.4, 0.4)], "red").parametrize(1.0)),
    )
    assert lagging.settled
    # The controller inverts the lag: the thrusts are late by a control step.
    assert np.abs(lagging.column("roll") - prompt.column("roll")).max() < 3e-3
    # The commands lead the thrusts that the rotors reach.
    reached = prompt.thrusts + 0.02 * np.gradient(prompt.thrusts, 1e-3, axis=0)
    assert np.abs(lagging.thrusts - reached)[5:].max() < 0.02
    assert np.abs(lagging.thrusts - prompt.thrusts).max() > 0.05


@pytest.mark.parametrize("name", ["beetle_omni", "beetle_art"])
def test_presets_whose_rotors_lag_settle_at_2_s(name: str) -> None:
    pytest.importorskip("mujoco")
    vehicle = gg.vehicle_named(name)
    assert vehicle.rotor_lag == 0.0942
    gait = gg.lift(
        [(-0.3, 0.8), (-0.8, 0.8), (-0.8, 0.3)], "red", vehicle=vehicle
    ).parametrize(2.0)
    flight = gg.fly(gait)
    assert flight.settled
    assert flight.gait_errors is not None
    assert flight.gait_errors["yaw"] < 2e-3


def test_a_rotor_that_only_pushes_falls_no_faster_than_its_lag() -> None:
    pytest.importorskip("mujoco")
    # The hover thrusts of Gait 3 fall with a time constant of 84 ms.
    slow = gg.gait_of("gait3", vehicle=PAPER.replace(rotor_lag=0.15)).parametrize(1.0)
    flight = gg.fly(slow, attitude=(0.0, 0.0))
    assert not flight.settled
    assert flight.saturated_fraction is not None
    assert flight.saturated_fraction > 0.3


@pytest.mark.parametrize("height", [0.03, -0.08])
@pytest.mark.parametrize("pair", [(0.4, -0.9), (-1.2, 0.7), (1.0, 1.1), (-0.3, -0.2)])
def test_the_second_root_beside_red_is_singular_at_every_attitude(
    height: float, pair: tuple[float, float]
) -> None:
    vehicle = PAPER.replace(rotor_height=height)
    found = gg.roots(*pair, coefficients=coefficients_of(vehicle))
    assert [root.color for root in found] == ["red", "none"]
    second = found[1]
    assert max(abs(second.R), abs(second.R_phi), abs(second.R_theta)) < 1e-12
    for roll, pitch in [(0.0, 0.0), (0.3, -0.5), (-0.9, 0.2)]:
        least = gg.invertibility.least_singular_value(
            second.alpha, vehicle, roll, pitch
        )
        assert least < 1e-12
    # The red root is not singular, and the two are all: a fine search finds no other.
    third = np.linspace(-np.pi / 2, np.pi / 2, 601, endpoint=False)
    grid = np.stack(np.meshgrid(third, third, indexing="ij"), axis=-1)
    alpha = np.concatenate([np.broadcast_to(pair, grid.shape), grid], axis=-1)
    v = matrices.attitude_sensitivities(alpha, coefficients_of(vehicle))
    size = np.hypot(v[..., 0], v[..., 1])
    near = grid[size < 1e-2]
    assert len(near) > 0
    for place in near:
        distances = [
            np.abs((place - root.alpha[2:] + np.pi / 2) % np.pi - np.pi / 2).max()
            for root in found
        ]
        assert min(distances) < 0.15
