"""
The robustness of a gait
========================

How far the vehicle can tilt in a gait before its decoupling matrix is singular, and what scaling the gait costs.
"""

import matplotlib.pyplot as plt
import numpy as np

import gaitgraph as gg
from gaitgraph import plots

gait = gg.plan_loop(
    [("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")]
).gait

# %%
# On the surfaces the margin is 90° in every direction, which is their purpose. Equations (12) to (15) of the paper
# scale α3 and α4 by η; the gait leaves the surfaces and its margin falls. An attitude is acceptable if it is
# connected with level flight by attitudes that are not singular at any time of the period.

report = gg.robustness_of(gait, bias=[0.9, 0.8])
print(report)

# %%
# The attitude nearest to level that is singular at some time, and the angles at that time.

worst = report.sweep[-1]
if worst.direction:
    roll, pitch = np.degrees(worst.direction)
    print(
        f"at {np.round(worst.where.alpha, 3)} towards roll {roll:.1f}°, pitch {pitch:.1f}°"
    )

# %%
# The roll–pitch diagram, as in Figures 18 to 22 of the paper: thin lines are singular attitudes at times of the period,
# the thick line borders the acceptable attitudes. The gait itself has no singular attitude within ±90°.

plots.roll_pitch_diagram(gait, bias=0.8)

# %%
# A sweep over η. The paper looks at 0.8 alone.

eta = np.linspace(0.5, 1.0, 11)
sweep = gg.robustness_of(gait, bias=eta, curves=0).sweep
margin = [np.degrees(one.tilt_margin or 0.0) for one in sweep]
part = [100 * one.acceptable.fraction for one in sweep]

figure, left = plt.subplots(figsize=(6, 3.5), layout="constrained")
left.plot(eta, margin, "o-", color="black", label="least tilt margin [°]")
left.plot(
    eta,
    part,
    "s--",
    color="tab:red",
    label="acceptable part of the roll–pitch diagram [%]",
)
left.set_xlabel("η")
left.set_ylim(0, 105)
left.legend()
