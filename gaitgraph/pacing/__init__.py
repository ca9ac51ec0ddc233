"""Laws of time under limits of tilt rate, acceleration and jerk, closed at the seam and certified between samples.

The fastest law along a gait or a curve, a law for a given period, or which limit forbids one; and what a servo that
lags behind makes of it.
"""
