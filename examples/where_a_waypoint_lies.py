"""
Where a waypoint lies
=====================

The admissible regions of the red sheet are polygons whose borders come from closed forms. They show in which
component a waypoint lies, whether two can be joined, why one cannot be used, and which usable point is nearest.
"""

import math

import gaitgraph as gg

# %%
# R = 0 divides the sheet into seven components, which differ in the signs of the three factors of R.

for sign in ("positive", "negative"):
    for part in gg.surface.sign_region(sign).components:
        inside = part.representative_point()
        print(
            f"R {sign}, signs {gg.surface.red_label(inside.x, inside.y)}, area {part.area:.4f} rad²"
        )

# %%
# The flyable region: R has one sign, the least singular value is above its floor, all rotors push up in hover, and a
# keep-out polygon is left out.

zones = gg.surface.Zones(
    keep_out=[[(0.5, -1.0), (0.8, -1.0), (0.8, -0.7), (0.5, -0.7)]]
)
region = gg.admissible_region(gg.PAPER, zones=zones)
print(
    "\n".join(
        f"component {k}: {part.area:.4f} rad²"
        for k, part in enumerate(region.components)
    )
)

# %%
# Two waypoints can be joined if one component holds both, around the keep-out if need be.

here, there, other = (0.4, -0.9), (1.0, -0.9), (-0.4, 0.4)
print("joined:", region.joined(here, there), region.joined(here, other))

# %%
# Waypoints that cannot be used: the reason, and the nearest point that can.

for point in ((0.6, -0.9), (0.1, -0.4), (0.17, -0.16)):
    found = region.nearest(point)
    assert found is not None
    assert region.contains(found)[0]
    print(
        f"{point}: {region.why_not(point)}; {math.dist(point, found):.4f} rad away is ({found[0]:.4f}, {found[1]:.4f})"
    )
