"""Smooth gaits that pass discs in order and are best in their worst case, or least in effort.

The best worst case is bracketed by the parts of level sets; the form of the loop is a local optimum of effort.
"""
