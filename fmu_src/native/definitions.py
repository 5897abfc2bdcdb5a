"""The native twins of the units: which functions are translated and which variables they read."""

from __future__ import annotations

from heli_identifier.online import (
    WATCHABLE,
    Candidate,
    IdentifierSettings,
    ModelParameters,
    Sampled,
    before_samples,
    begin_sampling,
    candidate,
    default_settings,
    determined,
    is_closed,
    is_due,
    prepare,
    take_sample,
)
from heli_identifier.online.excitation import (
    SquareChirp,
    check_bounds,
    check_multisine,
    combined,
    multisine_components,
    multisine_value,
    paper_channels,
    phases,
)
from heli_plant import communication, continuous, control, correction, laws, motor, observer, plant, state
from heli_plant.encoders import EncoderCounts
from heli_plant.parameter_table import PARAMETERS
from heli_plant.parameters import PlantParameters

from ..variables import Variable
from .definition import Definition, Exchange
from .translator import choose


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
            correction.with_share,
            observer.observer_gains,
            observer.measured_against,
            observer.predicted,
        ),
        {
            PlantParameters: {row.field: row.name for row in PARAMETERS},
            EncoderCounts: {axis: f"encoder.counts_{axis}" for axis in EncoderCounts._fields},
            correction.Correction: {
                field: f"correction.{name}"
                for field, (name, _) in zip(correction.Correction._fields, correction.CORRECTED, strict=True)
            },
        },
        (communication.PlantMemory, observer.Torque),
        files=("plant.h",),
        exchange=plant_exchange(),
    )


def plant_exchange() -> Exchange:
    """HelicopterPlant as a differential equation, with slopes by its states and its continuous inputs."""
    states = tuple(
        Variable(f"state.{name}", "local", f"continuous state: {name.replace('_', ' ')}", unit=unit, nominal=nominal)
        for name, unit, nominal in continuous.STATES
    )
    return Exchange(
        "plant_exchange.c",
        (continuous.rates_of_change, (laws.next_step_time, float, PlantParameters)),
        {
            continuous.rates_of_change: (
                "th", "ep", "la", "w1", "w2", "w3", "nu_front", "nu_rear", "q", "w_q", "v_front", "v_rear",
                "mass_position",
            ),
            continuous.measured: ("th", "ep", "la", "w1", "w2", "w3", "q", "w_q"),
        },
        states,
    )  # fmt: skip


def identifier_twin() -> Definition:
    """AdaptiveIdentifier; the law of every effect that can be watched becomes a function of its own."""
    watchable = [candidate(name, axis) for axis, names in WATCHABLE.items() for name in names]
    functions = tuple(dict.fromkeys(one.law for one in watchable))
    choose(Candidate, "law", functions)
    rows = "\n".join(
        f'    {{"{one.name}", "{one.axis}", {functions.index(one.law)}, {_c(one.in_rotors)}, {_c(one.times_gain)}}},'
        for one in watchable
    )
    table = (
        "/* Effects that can be watched: name, axis, law, in_rotors, times_gain. */\n"
        "typedef struct {\n    const char *name, *axis;\n    int64_t law;\n    bool in_rotors, times_gain;\n"
        f"}} Watchable;\n\nstatic const Watchable CANDIDATES[] = {{\n{rows}\n}};\n"
    )
    settings = {
        "sample_time": "sample.time",
        "filter_frequency": "filter.frequency",
        "filter_damping": "filter.damping",
        "initial_gain": "adaptation.initial_gain",
        "gain_limit": "adaptation.gain_limit",
        "forgetting": "adaptation.forgetting",
        "motor_time_constant": "motor.time_constant",
        "lag_known": "motor.lag_known",
        "voltage_limit": "motor.voltage_limit",
        "excitation_window": "excitation.window",
        "report_interval": "report.interval",
        **{f"initial.{name}": f"initial.{name}" for name in ModelParameters._fields},
    }
    return Definition(
        "identifier.c",
        (
            is_due,
            take_sample,
            begin_sampling,
            before_samples,
            prepare,
            default_settings,
            determined,
            is_closed,
            (IdentifierSettings.__post_init__, IdentifierSettings),
        ),
        {IdentifierSettings: settings},
        (Sampled,),
        {candidate: "find_candidate"},
        table,
    )


def _c(value: bool) -> str:
    return "true" if value else "false"


def controller_twin() -> Definition:
    """PidController."""
    gains = {
        f"{axis}.{gain}": f"{axis}.{gain}"
        for axis in ("pitch", "elevation", "travel")
        for gain in control.AxisGains._fields
    }
    settings = {
        "travel_enabled": "travel.enabled",
        "trim": "trim",
        "pitch_limit": "travel.pitch_limit",
        "rate_time_constant": "rate.time_constant",
        "voltage_limit": "voltage_limit",
    }
    return Definition(
        "pid.c",
        (control.pid_step, control.start_pid, control.risen, motor.saturate),
        {control.PidSettings: {**gains, **settings}},
        (control.PidState,),
    )


def exciter_twin() -> Definition:
    """Exciter."""
    return Definition(
        "exciter.c",
        (
            (SquareChirp.at, SquareChirp),
            paper_channels,
            check_multisine,
            multisine_components,
            multisine_value,
            check_bounds,
            combined,
        ),
        externals={phases: "phases"},
        files=("mersenne.c",),
    )


def player_twin() -> Definition:
    """LogPlayer, whose file is read in C."""
    return Definition("player.c")


DEFINITIONS = {
    "HelicopterPlant": plant_twin,
    "AdaptiveIdentifier": identifier_twin,
    "PidController": controller_twin,
    "Exciter": exciter_twin,
    "LogPlayer": player_twin,
}
"""By the unit's name."""
