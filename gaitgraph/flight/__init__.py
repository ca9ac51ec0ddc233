"""Flight in the physics engine MuJoCo: vehicle, controller, servos, references, records, basins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gaitgraph._lazy import lazy_names

if TYPE_CHECKING:
    from gaitgraph.flight.basins import Basin as Basin, basins_of as basins_of
    from gaitgraph.flight.course import from_hover as from_hover
    from gaitgraph.flight.engine import Engine as Engine
    from gaitgraph.flight.flight import (
        OUTCOMES as OUTCOMES,
        REFERENCES as REFERENCES,
        Flight as Flight,
        FlightSettings as FlightSettings,
        settings_from_mapping as settings_from_mapping,
    )
    from gaitgraph.flight.simulation import Simulation as Simulation, fly as fly
    from gaitgraph.timing.joining import Course as Course
else:
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "gaitgraph.flight.basins": ["Basin", "basins_of"],
            "gaitgraph.flight.course": ["from_hover"],
            "gaitgraph.flight.engine": ["Engine"],
            "gaitgraph.flight.flight": [
                "OUTCOMES",
                "REFERENCES",
                "Flight",
                "FlightSettings",
                "settings_from_mapping",
            ],
            "gaitgraph.flight.simulation": ["Simulation", "fly"],
            "gaitgraph.timing.joining": ["Course"],
        },
    )
