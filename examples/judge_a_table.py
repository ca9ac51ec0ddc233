"""Judge a table that somebody else made: one angle is off, and the report says which, where, and what would help."""

from pathlib import Path

import gaitgraph as gg

rows = """t,alpha1,alpha2,alpha3,alpha4
0.00,1.178,-1.178,1.178,-1.178
0.25,1.178,-0.393,1.278,-0.393
0.50,0.393,-0.393,0.393,-0.393
0.75,0.393,-1.178,0.393,-1.178
1.00,1.178,-1.178,1.178,-1.178
"""
Path("broken.csv").write_text(rows)
report = gg.validate("broken.csv")
print(report)
print("first reason:", report.reason)

red = gg.roots(1.178, -0.393, gg.coefficients_of())[0]
print(f"the {red.color} root of row 2: ({red.alpha3:.3f}, {red.alpha4:.3f})")
Path("mended.csv").write_text(rows.replace("1.278", f"{red.alpha3:.3f}"))
print("mended: flyable", gg.validate("mended.csv").flyable)
