"""From hover into a gait: the way to Gait 4 as a table, and the proof that there is none to Gait 3."""

from math import pi

import gaitgraph as gg

gait = gg.lift([(-pi / 8, pi / 8), (-pi / 8, 3 * pi / 8), (-3 * pi / 8, 3 * pi / 8), (-3 * pi / 8, pi / 8)], "red")
entry = gg.transition("hover", gait, duration=1.5, samples=150)
print(entry)
entry.write("entry.csv", force=True)
table = gg.read_table("entry.csv")
print(f"entry.csv: {len(table)} rows, to {table.alpha[-1].round(3)} at t = {table['t'][-1]:g} s")

corner = entry.corners[1] or 0  # where it joins; the gait goes on from there
print("and on from there:", gait.started_at(corner).parametrize(period=2.0).alpha[0].round(3))

third = gg.lift([(3 * pi / 8, -3 * pi / 8), (3 * pi / 8, -pi / 8), (pi / 8, -pi / 8), (pi / 8, -3 * pi / 8)], "red")
refused = gg.transition("hover", third)
print(refused)
if refused.proof:
    print(refused.proof["statement"])
