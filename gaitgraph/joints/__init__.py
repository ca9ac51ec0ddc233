"""From tilt angles to the joints of a real vehicle and back: order, sign, zero, and units down to pulse widths.

A map says how four joints, one on each rotor, are told in a table; it is a preset, or comes from plain values or a TOML
file, and turns a gait table into a servo table. The inverse reads one, whoever wrote it.
"""
