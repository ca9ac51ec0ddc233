"""Gaits proven in flight: a vehicle in the physics engine MuJoCo, feedback linearisation, and what comes of it."""

from __future__ import annotations

from gaitgraph.flight.courses import Course, from_hover
from gaitgraph.flight.engine import Engine, engine_of
from gaitgraph.flight.records import Flight
from gaitgraph.flight.settings import REFERENCES, FlightSettings, settings_from_mapping
from gaitgraph.flight.simulation import Cockpit, fly

__all__ = [
    "REFERENCES",
    "Cockpit",
    "Course",
    "Engine",
    "Flight",
    "FlightSettings",
    "engine_of",
    "fly",
    "from_hover",
    "settings_from_mapping",
]
