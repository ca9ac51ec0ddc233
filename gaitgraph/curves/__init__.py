"""Smooth closed curves of tilt angles on a sheet, and polylines with their corners rounded.

A curve is a piecewise polynomial in (α1, α2), lifted exactly; what is said about it holds along all of it, by bounds.
"""
