"""
A gait for a microcontroller
============================

A C header with a table of the gait and a function that returns its angles at any time.
"""

from pathlib import Path

import gaitgraph as gg

gait = gg.lift(
    [(1.178, -1.178), (1.178, -0.393), (0.393, -0.393), (0.393, -1.178)], "red"
)

# %%
# Rows are joined by cubics. The header states the error, which helps to choose the number of rows.

for samples in (25, 40, 100):
    timed = gait.parametrize(period=1.0, samples=samples)
    timed.write("gait3.h", force=True)
    lines = Path("gait3.h").read_text().splitlines()
    (error,) = (line for line in lines if "off the gait by" in line)
    print(f"{samples} rows, {32 * samples} bytes:")
    print(f"    off the gait by {error.split('off the gait by ')[1]}")

# %%
# A program calls it like this::
#
#     #include "gait3.h"
#
#     float alpha[4];
#     gait3_at(t, alpha);

functions = [line for line in lines if line.startswith("static inline")]
print(*functions, sep="\n")
