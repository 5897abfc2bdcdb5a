"""The native twins of the units: which functions are translated, and which variables they read."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from heli_identifier import online
from heli_identifier.online import excitation
from heli_plant import communication, continuous, control, laws, motor, state, state_feedback
from heli_plant.parameters import PlantParameters

from ..errors import BuildError
from ..slave_base import SlaveBase
from ..units import adaptive_identifier, helicopter_plant, pid_controller
from ..units.state_feedback import StateFeedback
from ..variables import Variable
from .translator import choose


@dataclass(frozen=True)
class Exchange:
    """What Model Exchange adds to a unit.

    Attributes
    ----------
    adapter : str
        File in C that connects the translated functions with states, rates and slopes.
    entries : tuple
        Functions that it calls, as those of :class:`Definition`.
    differentiated : mapping
        Functions that are translated for dual numbers as well, and the parameters that are.
    states : tuple of Variable
        One per continuous state; they stand behind the unit's variables, their derivatives behind them.
    """

    adapter: str
    entries: tuple[Any, ...]
    differentiated: Mapping[Callable[..., Any], tuple[str, ...]]
    states: tuple[Variable, ...]

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The states and their derivatives."""
        rates = (
            Variable(f"der({x.name})", "local", f"derivative of {x.name}", unit=per_second(x.unit))
            for x in self.states
        )
        return (*self.states, *rates)


def per_second(unit: str | None) -> str:
    """Return the unit of a derivative: ``rad/s`` becomes ``rad/s^2``."""
    unit = unit or "1"
    return unit.removesuffix("/s") + ("/s^2" if unit.endswith("/s") else "/s")


@dataclass(frozen=True)
class Definition:
    """The native twin of a unit.

    Attributes
    ----------
    adapter : str
        File in C that connects the translated functions with the unit's variables.
    entries : tuple
        Functions that the adapter calls; one with unannotated parameters stands in a tuple with the types for them.
    settings : mapping
        Structs that are filled from variables: for each field, by its path, the variable's name.
    memory : tuple of annotations
        What the unit remembers between steps.
    externals : mapping
        Functions that have another definition: the name of one in C, or one in Python that is translated.
    more : str
        Further C text of the header.
    files : tuple of str
        Further files in C that the adapter needs.
    exchange : Exchange or None
        What Model Exchange adds, in units that have it.
    """

    adapter: str
    entries: tuple[Any, ...] = ()
    settings: Mapping[type, Mapping[str, str]] = field(default_factory=dict)
    memory: tuple[Any, ...] = ()
    externals: Mapping[Callable[..., Any], str | Callable[..., Any]] = field(default_factory=dict)
    more: str = ""
    files: tuple[str, ...] = ()
    exchange: Exchange | None = None


def reference(name: str) -> str:
    """Return the C name of a variable's value reference: ``score.pitch[1]`` is ``REF_score_pitch_1``."""
    return "REF_" + re.sub(r"\W+", "_", name).strip("_")


def paths(unit: type[SlaveBase]) -> dict[str, str]:
    """Return the variable that sets each field of a unit's settings."""
    return {variable.field: variable.name for variable in unit.variables if variable.field}


def plant_twin() -> Definition:
    """HelicopterPlant."""
    entries = (
        *(communication.begin, communication.communicate, communication.is_finite, communication.shown),
        *(state.start_state, (laws.motor_time_constant, PlantParameters), (laws.input_delay, PlantParameters)),
    )
    settings: dict[type, dict[str, str]] = {
        PlantParameters: paths(helicopter_plant.HelicopterPlant),
        communication.EncoderCounts: {axis: f"encoder.counts_{axis}" for axis in communication.EncoderCounts._fields},
    }
    return Definition(
        "plant.c", entries, settings, (communication.PlantMemory,), files=("plant.h",), exchange=plant_exchange()
    )


def plant_exchange() -> Exchange:
    """HelicopterPlant as a differential equation, with slopes by its states and its continuous inputs."""
    states = tuple(
        Variable(f"state.{name}", "local", f"continuous state: {name.replace('_', ' ')}", unit=unit, nominal=nominal)
        for name, unit, nominal in continuous.STATES
    )
    motion = ("th", "ep", "la", "w1", "w2", "w3")
    rotors = ("nu_front", "nu_rear", "q", "w_q", "v_front", "v_rear", "mass_position")
    slopes: dict[Callable[..., Any], tuple[str, ...]] = {
        continuous.rates_of_change: (*motion, *rotors),
        continuous.measured: (*motion, "q", "w_q"),
    }
    entries = (continuous.rates_of_change, (laws.next_step_time, float, PlantParameters))
    return Exchange("plant_exchange.c", entries, slopes, states)


_WATCHABLE = tuple(
    (axis, tuple(online.candidate(name, axis) for name in names)) for axis, names in online.WATCHABLE.items()
)


def find_candidate(name: str, axis: str) -> online.Candidate:
    """Return what :func:`candidate` does, by comparison with all effects that can be watched."""
    for own, candidates in _WATCHABLE:
        if axis == own:
            for one in candidates:
                if name == one.name:
                    return one
            names = ", ".join(one.name for one in candidates)
            raise BuildError(f"effect {name!r} cannot be watched on {axis}; choose of {names}")
    raise BuildError(f"watched axis {axis!r} must be one of {', '.join(own for own, _ in _WATCHABLE)}")


def identifier_twin() -> Definition:
    """AdaptiveIdentifier; the law of every effect that can be watched becomes a function of its own."""
    laws_alone = [one.law for _, candidates in _WATCHABLE for one in candidates]
    choose(online.Candidate, "law", tuple(dict.fromkeys(laws_alone)))
    entries = (
        *(online.is_due, online.take_sample, online.begin_sampling, online.before_samples),
        *(online.prepare, online.default_settings, online.is_closed, adaptive_identifier.shown),
        (online.IdentifierSettings.__post_init__, online.IdentifierSettings),
    )
    settings: dict[type, dict[str, str]] = {online.IdentifierSettings: paths(adaptive_identifier.AdaptiveIdentifier)}
    return Definition("identifier.c", entries, settings, (online.Sampled | None,), {online.candidate: find_candidate})


def controller_twin() -> Definition:
    """PidController."""
    entries = (control.pid_step, control.start_pid, control.risen, motor.saturate)
    settings: dict[type, dict[str, str]] = {control.PidSettings: paths(pid_controller.PidController)}
    return Definition("pid.c", entries, settings, (control.PidState | None,))


def state_feedback_twin() -> Definition:
    """StateFeedback."""
    entries = (state_feedback.hold, state_feedback.start_holding, control.risen, motor.saturate)
    more = f"static const double SAMPLE_EARLY = {state_feedback.EARLY!r};\n"
    settings: dict[type, dict[str, str]] = {state_feedback.FeedbackSettings: paths(StateFeedback)}
    return Definition("state_feedback.c", entries, settings, (state_feedback.Held | None,), more=more)


def exciter_twin() -> Definition:
    """Exciter."""
    entries = (
        (excitation.SquareChirp.at, excitation.SquareChirp),
        *(excitation.paper_channels, excitation.multisine_components, excitation.multisine_value),
        *(excitation.check_bounds, excitation.combined),
    )
    return Definition("exciter.c", entries, externals={excitation.phases: "phases"}, files=("mersenne.c",))


DEFINITIONS: dict[str, Callable[[], Definition]] = {
    "HelicopterPlant": plant_twin,
    "AdaptiveIdentifier": identifier_twin,
    "PidController": controller_twin,
    "StateFeedback": state_feedback_twin,
    "Exciter": exciter_twin,
    "LogPlayer": lambda: Definition("player.c"),  # its file is read in C
}
"""By the unit's name."""
