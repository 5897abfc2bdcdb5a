"""The units in C: which functions are translated for each of them, and which files are written by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from heli_identifier import online
from heli_identifier.online import excitation
from heli_plant import communication, control, laws, motor, plant, state, state_feedback
from heli_plant.parameters import PlantParameters

from .. import slave_base
from ..units import adaptive_identifier, controllers
from ..variables import Variable


@dataclass(frozen=True, eq=False)
class Definition:
    """A unit in C."""

    files: tuple[str, ...]  # in C; the first connects the translated functions with the unit's variables
    entries: tuple[Any, ...] = ()  # functions that it calls; in a tuple with types that replace or add annotations
    settings: type | None = None  # struct that is filled from the variables that name a field of it
    memory: Any = type(None)  # annotation of the unit's memory between steps
    externals: Mapping[Callable[..., Any], str] = field(default_factory=dict)  # names in C of functions by hand
    states: tuple[tuple[str, str, float], ...] = ()  # of Model Exchange: name, unit and nominal value of each

    @property
    def state_variables(self) -> tuple[Variable, ...]:
        """The states, which follow the unit's variables, and then their derivatives."""
        states = tuple(
            Variable(f"state.{name}", "local", f"continuous state: {name.replace('_', ' ')}", unit=unit, nominal=size)
            for name, unit, size in self.states
        )
        return states + tuple(  # rad/s becomes rad/s^2
            Variable(f"der({x.name})", "local", f"derivative of {x.name}", unit=f"{x.unit}/s".replace("/s/s", "/s^2"))
            for x in states
        )


_PARAMETERS = {"p": PlantParameters}
_PLANT = Definition(
    ("plant.c", "plant.h"),
    (
        communication.start_memory, communication.communicate, communication.is_finite, communication.read_sensors,
        state.start_state, (laws.motor_time_constant, _PARAMETERS), (laws.input_delay, _PARAMETERS),
        slave_base.check_substeps,
    ),
    PlantParameters,
    communication.PlantMemory,
)  # fmt: skip

DEFINITIONS = {
    "HelicopterPlant": _PLANT,
    "AdaptiveIdentifier": Definition(
        ("identifier.c",),
        (
            online.prepare, online.is_due, online.next_due, online.take_sample, online.begin_sampling,
            online.before_samples, online.default_settings, online.is_closed, adaptive_identifier.output_values,
            adaptive_identifier.check_estimate, slave_base.check_substeps,
            (online.IdentifierSettings.__post_init__, {"self": online.IdentifierSettings}),
        ),
        online.IdentifierSettings,
        online.Sampled | None,
    ),
    "PidController": Definition(
        ("pid.c",),
        (controllers.pid_voltages, motor.saturate),
        control.PidSettings,
        control.PidState | None,
    ),
    "StateFeedback": Definition(
        ("state_feedback.c",),
        (controllers.feedback_voltages, motor.saturate),
        state_feedback.FeedbackSettings,
        state_feedback.SampledFeedback | None,
    ),
    "Exciter": Definition(
        ("exciter.c", "mersenne.c"),
        (
            (excitation.SquareChirp.at, {"self": excitation.SquareChirp}), excitation.paper_channels,
            excitation.multisine_components, excitation.multisine_value, excitation.check_bounds, excitation.combine,
        ),
        externals={excitation.phases: "phases"},
    ),
    "LogPlayer": Definition(("player.c",), (slave_base.time_tolerance,)),  # its file is read in C
}  # fmt: skip
"""By the unit's name."""

MODEL_EXCHANGE = {
    "HelicopterPlant": replace(
        _PLANT,
        files=(*_PLANT.files, "plant_exchange.c"),
        entries=(*_PLANT.entries, plant.rates_of_change, (laws.next_step_time, {"time": float} | _PARAMETERS)),
        states=plant.STATES,
    ),
}
"""Units that have Model Exchange beside co-simulation; their last file connects states, rates and events."""
