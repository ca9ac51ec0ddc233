"""The valid, flyable gait nearest to a table that is neither, and what was changed.

Rows move to the nearest points of one part of the flyable region; where a step between them leaves it, rows are added.
"""
