"""
A vehicle that is not symmetric
===============================

Its sheet is curved. A loop on it is planned, certified and flown, beside the gait of the symmetric formulas.
"""

import numpy as np

import gaitgraph as gg

# %%
# The places, spins and drag of the rotors are those of the KNR Tiltrotor of PX4 (PX4-Autopilot, commit 9befcba,
# ROMFS/px4fmu_common/init.d/airframes/13067_knr_tiltrotor), turned to our axes: front rotors are nearer to the centre of
# mass than rear ones, and below it. Its rotors tilt forward; here they tilt about their arms, as in the paper. The file
# states no mass and no inertia: these are assumed.

vehicle = gg.Vehicle(
    name="KNR Tiltrotor",
    rotor_positions=[
        [0.412, 0.4, -0.165],
        [-0.788, 0.4, 0.235],
        [-0.788, -0.4, 0.235],
        [0.412, -0.4, -0.165],
    ],
    first_rotor_spin="clockwise",
    drag_to_thrust=0.05,
    mass=6.0,
    inertia=[0.5, 0.9, 1.3],
    thrust_coefficient=2e-5,
)
print("not symmetric:", vehicle.asymmetry)

# %%
# A loop is planned as for any vehicle. The law ``smooth`` rests at its corners; between them α3 and α4 follow the sheet.

corners = [(-0.2, 0.3), (-0.4, 0.4), (-0.4, 0.9), (-0.2, 0.7)]
plan = gg.plan_loop(corners, vehicle=vehicle, period=4.0)
gait = plan.timed()
print(plan.report)
print(gg.certify(gait))

# %%
# The formulas of symmetric vehicles put the same loop on α3 = α1, α4 = α2. There this vehicle can hover too, but Rφ and
# Rθ are not zero: a fifth of the attitudes is lost, and errors of the servos of 4° take the thrust from a rotor.

plane = np.array(corners)[:, [0, 1, 0, 1]]
naive = gg.Gait(alpha=plane, vehicle=vehicle).parametrize(4.0)
for name, motion in (("on its sheet", gait), ("on the plane", naive)):
    answer = gg.robustness_of(motion, curves=0).as_mapping()
    print(
        f"{name}: tilt margin {answer['tilt_margin_deg']:.1f}°, "
        f"{100 * answer['acceptable_fraction']:.1f} % of attitudes acceptable, "
        f"servo errors up to {answer['servo_margin_deg']:.1f}°"
    )

# %%
# In the physics engine both gaits are flown from 81 attitudes, with roll and pitch up to 80°.

print(gg.fly(gait))
for name, motion in (("on its sheet", gait), ("on the plane", naive)):
    (basin,) = gg.basins_of(motion, bias=1.0, resolution=9, extent="80deg")
    print(f"{name}: {basin}")
