"""A diagnosis made by hand, with every kind of verdict in it: the report is tested on it without a search."""

from dataclasses import replace

import numpy as np
from heli_identifier.tracing.diagnosis.result import DataEntry, EffectCurve, HeldOutSeries, PossibleEffect, RigVerdict
from heli_identifier.tracing.prediction.fit import BASE
from heli_identifier.tracing.prediction.observer import observer_start
from heli_identifier.tracing.search.found_effect import CurveShape, FoundEffect, NamedShape, PeriodicShape
from heli_identifier.tracing.search.verdict import CatalogueVerdict, Evidence, Verdict, Withdrawal
from heli_identifier.tracing.validation.figures import AxisError, AxisReport, ErrorFigure, NaiveError, rms_figures
from heli_identifier.tracing.validation.log_values import LogValues
from heli_identifier.tracing.validation.prediction import free_run, stable_axes

from heli_identifier.online.estimate import Estimate
from heli_identifier.online.excitation import paper_excitation, voltages
from heli_identifier.records import Log
from heli_identifier.workbench.interface.diagnosis import Diagnosis
from heli_plant.effects import AXES, CATALOGUE
from heli_plant.parameter_table import BY_FIELD
from heli_plant.parameters import TABLE_2
from heli_plant.simulation import simulate
from heli_plant.state import rest_state

H = 0.01
FRICTION = Estimate(0.025, 0.0006, "rad/s^2")
BEFORE = TABLE_2._replace(a_wx=0.2)
AFTER = TABLE_2._replace(dry_friction_pitch=FRICTION.value)
REDUCED = 0.04


def made_log(seconds=20.0, seed=0, parameters=AFTER, name="run"):
    """A log of a plant with dry friction: the paper's excitation, white noise of a quarter of a count."""
    count = round(seconds / H)
    held = np.array([voltages(k * H, paper_excitation(1)) for k in range(count)])
    _, angles = simulate(held, H, rest_state(parameters, 1.0), parameters)
    return Log(name, 1.0 / H, held, angles + np.random.default_rng(seed).normal(0.0, 4e-4, angles.shape))


def series_of(log, seed=1):
    """Its free runs, and residuals that are white after and correlated before."""
    random = np.random.default_rng(seed)
    after = random.normal(0.0, 5e-3, (int(log.duration / REDUCED) - 50, 3))
    before = after + 8e-3 * np.sin(0.25 * np.arange(len(after)))[:, None]
    runs = [free_run(log, p) for p in (BEFORE, AFTER)]
    start = observer_start(log)._asdict()
    white = (before[25:] / 5e-3, after[25:] / 5e-3)
    return HeldOutSeries(log, *runs, start, before, after, *white, REDUCED)


def figure(value):
    return ErrorFigure(value, 0.9 * value, 1.1 * value)


def axis_reports(series):
    """Reports whose free run after is that of the series; the other figures are made up."""
    errors = [s.log.angles - s.free_run_after for s in series]
    run = rms_figures(errors, H)
    stable = stable_axes(AFTER)
    reports = {}
    for index, axis in enumerate(AXES):
        after = AxisError(figure(2e-3), figure(4e-3), run[index] if stable[index] else None, figure(5e-3))
        before = AxisError(figure(5e-3), figure(1.3e-2), figure(3e-2) if stable[index] else None, figure(1.2e-2))
        floor = AxisError(figure(1.9e-3), figure(3.6e-3), None, figure(5e-3))
        naive = NaiveError(figure(0.15), figure(0.28)), NaiveError(figure(0.07), figure(0.24))
        tests = {"before": 1e-9, "after": 0.4}, {"before": 4.0, "after": 0.8}
        reports[axis] = AxisReport(before, after, after, after, floor, *tests, *naive)
    return reports


def estimates(parameters):
    """The simplified model's parameters with errors of a hundredth, and the lag, which is given."""
    found = {
        name: Estimate(getattr(parameters, name), 0.01 * abs(getattr(parameters, name)), BY_FIELD[name].unit)
        for name in BASE
    }
    return {**found, "T_m": Estimate(parameters.T_m, None, "s")}


def found_effects():
    """One shown, one ambiguous with a shape, one periodic torque, one unknown curve."""
    turns = np.linspace(0.0, 2.0 * np.pi, 20)
    wave = 0.01 * np.sin(turns)
    curve, band = np.column_stack((turns, wave)), np.column_stack((turns, wave - 1e-3, wave + 1e-3))
    bending = {"frequency": Estimate(3.1, 0.02, "Hz"), "damping": Estimate(0.05, None, "1")}
    return (
        FoundEffect(
            "dry_friction", "pitch", FRICTION, Verdict.SHOWN, (), NamedShape(), 41.0, {2.0: FRICTION, 8.0: FRICTION}
        ),
        FoundEffect(
            "arm_bending", "elevation", Estimate(2e-3, 1e-4, "rad/V"), Verdict.AMBIGUOUS,
            (("ground_effect", "elevation"),), NamedShape(bending), 20.0, {},
            "Excite the voltage sum with a chirp from 1 to 6 Hz.",
        ),
        FoundEffect(
            "unknown", "elevation", None, Verdict.UNKNOWN, (), PeriodicShape(0.7, 0.02, 1e-3, "a line at 0.7 Hz"), 9.0,
            in_plant=False,
        ),
        FoundEffect(
            "unknown", "travel", None, Verdict.UNKNOWN, (),
            CurveShape("travel", "rad", "periodic in the travel", curve, band), 8.0,
        ),
    )  # fmt: skip


def curves():
    x = np.linspace(-0.3, 0.3, 32)
    law = -FRICTION.value * np.sign(x)
    turns = np.linspace(0.0, 2.0 * np.pi, 20)
    wave = 0.01 * np.sin(turns)
    return (
        EffectCurve(
            "dry_friction", "pitch", "pitch rate", "rad/s", np.column_stack((x, law + 1e-3 * np.cos(40.0 * x))),
            np.column_stack((x, law, law - 1e-3, law + 1e-3)),
        ),
        EffectCurve(
            "unknown", "travel", "travel", "rad", np.empty((0, 2)),
            np.column_stack((turns, wave, wave - 1e-3, wave + 1e-3)),
        ),
    )  # fmt: skip


def catalogue():
    """Every entry: the shown one, two that are not testable, the others not shown."""
    verdicts = []
    for number, entry in enumerate(CATALOGUE):
        value = Estimate(1e-3, 1e-3, entry.unit)
        row = CatalogueVerdict(
            entry.name,
            entry.axis,
            Verdict.NOT_SHOWN,
            value,
            1.0,
            0.02 * (number + 1),
            3e-3,
            "score +1.0, 3.7 needed",
            "",
        )
        if (entry.name, entry.axis) == ("dry_friction", "pitch"):
            row = replace(row, verdict=Verdict.SHOWN, estimate=FRICTION, score=41.0)
        if entry.name == "inertial_coupling":
            row = replace(
                row, verdict=Verdict.NOT_TESTABLE, visibility=0.004, upper_bound=None, why="only 0.4 % is left",
                experiment="Turn the travel fast.", estimate=Estimate(0.0, float("inf"), entry.unit),
            )  # fmt: skip
        verdicts.append(row)
    return tuple(verdicts)


def example(logs=None):
    """The diagnosis of one or two held-out logs of twenty seconds."""
    logs = logs or [made_log()]
    series = tuple(series_of(log) for log in logs)
    names = tuple((entry.name, entry.axis) for entry in CATALOGUE)
    correlation = np.eye(len(names))
    correlation[3, 0] = correlation[0, 3] = 0.95
    correlation[7, 2] = correlation[2, 7] = -0.5
    return Diagnosis(
        verdict=RigVerdict.EFFECTS_SHOWN,
        effects=found_effects(),
        withdrawn=(Withdrawal("cable_stiffness", "travel", "the held-out logs are likelier without it"),),
        catalogue=catalogue(),
        parameters_before=estimates(BEFORE),
        parameters_after=estimates(AFTER),
        effects_after={"dry_friction_pitch": FRICTION},
        plant_before=BEFORE,
        plant_shown=AFTER,
        plant_after=AFTER,
        plant_everything=None,
        axes=axis_reports(series),
        series=series,
        curves=curves(),
        correlation_labels=names,
        correlation=correlation,
        data=(
            DataEntry("train <1>.csv", "ab" * 32, 9000, 100.0, "training", ("pitch converted from deg to rad",)),
            DataEntry("held.csv", "cd" * 32, 2000, 100.0, "held out"),
        ),
        settings={
            "filter_frequency_rad_s": 4.0, "agreement_frequencies_rad_s": [2.0, 8.0], "motor_time_constant_s": 0.08,
            "significance": 0.005, "threshold": 3.7, "hint": 3.1,
        },
        notes=("voltages reach 5.10 V",),
        seconds=12.3,
        predictive=(
            FoundEffect(
                "motor_lag", "rotors", Estimate(0.03, 2e-3, "s"), Verdict.NOT_SHOWN, (("input_delay", "rotors"),),
                NamedShape(), 15.0, evidence=Evidence.PREDICTIVE, stability=0.94, worth=0.12,
                by_likelihood=Estimate(0.028, 3e-3, "s"),
                together="lag and delay of the rotors together: 110 ms",
            ),
        ),
        possible=(PossibleEffect("dry_friction", "elevation", (("quadratic_drag", "elevation"),), 0.45, 0.06),),
        logs=tuple(
            LogValues(
                name, {"pitch_torque": Estimate(torque, 1e-3, "rad/s^2"), "pitch_zero": Estimate(1e-3, 1e-3, "rad")},
                Estimate(0.01, 3e-3, "1"), not why, why,
            )
            for name, torque, why in (("train <1>", 2e-3, ""), ("held", -1e-3, "the sign of its travel is flipped"))
        ),
    )  # fmt: skip


def adequate():
    """The same rig, found adequate."""
    whole = example()
    shown = tuple(replace(v, verdict=Verdict.NOT_SHOWN) if v.verdict == Verdict.SHOWN else v for v in whole.catalogue)
    return replace(
        whole, verdict=RigVerdict.MODEL_ADEQUATE, effects=(), withdrawn=(), curves=(), catalogue=shown,
        parameters_after=whole.parameters_before, effects_after={}, predictive=(), possible=(),
    )  # fmt: skip
