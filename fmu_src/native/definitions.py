"""The native twins of the units: which functions are translated and which variables they read."""

from __future__ import annotations

from heli_plant import communication, laws, plant, state
from heli_plant.encoders import EncoderCounts
from heli_plant.parameters import PARAMETERS, PlantParameters

from .definition import Definition


def plant_twin() -> Definition:
    """HelicopterPlant."""
    return Definition(
        "plant.c",
        (
            communication.begin,
            (communication.communicate, plant.step, plant.arriving),
            communication.is_finite,
            communication.shown,
            state.start_state,
            (laws.motor_time_constant, PlantParameters),
            (laws.input_delay, PlantParameters),
        ),
        {
            PlantParameters: {row.field: row.name for row in PARAMETERS},
            EncoderCounts: {axis: f"encoder.counts_{axis}" for axis in EncoderCounts._fields},
        },
        (communication.PlantMemory,),
    )


DEFINITIONS = {"HelicopterPlant": plant_twin}
"""By the unit's name."""
