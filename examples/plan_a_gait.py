"""Plan Gait 3 of the paper, look at its corners and checks, and write it as a table."""

import gaitgraph as gg

plan = gg.plan_loop([("3pi/8", "-3pi/8"), ("3pi/8", "-pi/8"), ("pi/8", "-pi/8"), ("pi/8", "-3pi/8")])
print(plan)

gait = plan.gait  # raises Infeasible, with the plan's reason, when there is none
timed = gait.parametrize(period=1.0, rate=50)
print(timed.vertices().round(3))  # the four vertices that the paper prints

timed.write("gait3.csv", "gait3.json", force=True)  # without force, files that exist are refused
