"""A diagnosis made by hand, with every kind of verdict in it: the report is tested on it without a search."""

from dataclasses import replace

import numpy as np

from heli_identifier import results
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.online.excitation import Excitation, paper_channels
from heli_identifier.provenance import provenance
from heli_identifier.records import Log
from heli_identifier.results import PLANT, ParameterSet, Verdict, plant_values, statements
from heli_identifier.results.running import start_of
from heli_plant.effects import AXES, CATALOGUE
from heli_plant.parameters import BY_FIELD, TABLE_2
from heli_plant.simulation import simulate
from tests.simulated import H, simulate_record

FRICTION = Estimate(0.025, 0.0006, "rad/s^2")
BEFORE = TABLE_2._replace(a_wx=0.2)
AFTER = TABLE_2._replace(dry_friction_pitch=FRICTION.value)


def simulated_log(seconds=20.0, seed=0, parameters=AFTER, name="run"):
    """A log of a plant with dry friction: the paper's excitation, white noise of a quarter of a count."""
    held, angles, _ = simulate_record(seconds, Excitation(0.5, *paper_channels(1, "both")), parameters, encoders=False)
    return Log(name, 1.0 / H, held, angles + np.random.default_rng(seed).normal(0.0, 4e-4, angles.shape))


def held_out_series(log, seed=1):
    """Its free runs, and innovations that are white after and correlated before."""
    random = np.random.default_rng(seed)
    after = random.normal(0.0, 1.0, (log.samples, 3))
    before = after + 1.6 * np.sin(0.06 * np.arange(len(after)))[:, None]
    start = start_of(log)
    runs = {name: simulate(log.voltages, H, start, p)[1] for name, p in (("before", BEFORE), ("after", AFTER))}
    return results.HeldOutSeries(log, runs, start._asdict(), {"before": before, "after": after}, H)


def figure(value):
    return results.ErrorFigure(value, 0.9 * value, 1.1 * value)


def axis_reports(series):
    """Reports whose free run after is that of the series; the other figures are made up."""
    squares = np.concatenate([(s.log.angles - s.free_runs["after"]) ** 2 for s in series])
    better = results.ErrorFigure(-0.6, -0.65, -0.55)
    change = {"ahead_200ms": results.ErrorFigure(0.0, -0.02, 0.02), "prediction_1s": better}
    reports = {}
    for axis, column in zip(AXES, squares.T, strict=True):
        stable = axis != "travel"  # nothing pulls it back
        near, run = (figure(6e-4), figure(7e-4)), figure(float(np.sqrt(column.mean())))
        reports[axis] = results.AxisReport(
            before=results.AxisError(*near, figure(5e-3), figure(1.3e-2), figure(3e-2) if stable else None),
            after=results.AxisError(*near, figure(2e-3), figure(4e-3), run if stable else None),
            noise_floor=results.AxisError(*near, figure(1.9e-3), figure(3.6e-3)), angle_stays=figure(0.15),
            rate_stays=figure(0.07), whiteness_p={"before": 1e-9, "after": 0.4}, air=3e-3, air_rate=2.5,
            encoder_noise=6e-4, use=results.Use.CONTROL if stable else results.Use.PREDICTION, change=change,
            why="references agree" if stable else "k_y is not determined: its interval is ± .1",
        )  # fmt: skip
    return reports


def estimate(parameters, name, error=0.01):
    """A parameter with a relative error."""
    value = getattr(parameters, name)
    return Estimate(value, error * abs(value), BY_FIELD[name].unit)


def parameter_set(error=0.03, names=("a_wx", "a_th", "k_x", "a_wz", "a_e", "a_1", "k_z", "a_wy", "k_y"), plant=TABLE_2):
    """A plant's parameters as a file states them, some with a relative error."""
    return ParameterSet(PLANT, plant_values(plant, {name: estimate(plant, name, error) for name in names}))


def determinations(parameters):
    """What the gains rest on: two from outside, one not determined."""
    sure, rest = (statements.Determination.OUTSIDE, 0.8), ((0.1, 1.0), "references alone give the same")
    found = {name: estimate(parameters, name) for name in ("k_x", "k_z", "k_y")}
    reports = {name: statements.ParameterReport(value, *sure, value, False, *rest) for name, value in found.items()}
    reports["k_y"] = statements.ParameterReport(
        found["k_y"], statements.Determination.NOT_DETERMINED, 0.0, None, False, (0.1, 1.0), "its interval is ± .1",
        "Lean the pitch by 10 degrees for 5 s either way.",
    )  # fmt: skip
    return reports


def estimates(parameters):
    """The simplified model's parameters with their errors, and the lag, which is given."""
    found = {name: estimate(parameters, name) for name in ModelParameters._fields}
    return {**found, "T_m": Estimate(parameters.T_m, None, "s")}


TURNS = np.linspace(0.0, 2.0 * np.pi, 20)
WAVE = 0.01 * np.sin(TURNS)
"""A torque that is periodic in the travel."""


def found_effects():
    """One shown, one ambiguous with a shape, one periodic torque, one unknown curve."""
    curve, band = np.column_stack((TURNS, WAVE)), np.column_stack((TURNS, WAVE - 1e-3, WAVE + 1e-3))
    bending = {"frequency": Estimate(3.1, 0.02, "Hz"), "damping": Estimate(0.05, None, "1")}
    return (
        statements.FoundEffect(
            "dry_friction", "pitch", FRICTION, Verdict.SHOWN, "friction of the pitch", (), statements.NamedShape(), 41.0
        ),
        statements.FoundEffect(
            "arm_bending", "elevation", Estimate(2e-3, 1e-4, "rad/V"), Verdict.AMBIGUOUS,
            "arm bending of the elevation", (("ground_effect", "elevation"),), statements.NamedShape(bending), 20.0,
            "Excite the voltage sum with a chirp from 1 to 6 Hz.",
        ),
        statements.FoundEffect(
            "unknown", "elevation", None, Verdict.UNKNOWN, "unknown torque of the elevation", (),
            statements.PeriodicShape(0.7, 0.02, 1e-3, "a line at 0.7 Hz"), 9.0, in_plant=False,
        ),
        statements.FoundEffect(
            "unknown", "travel", None, Verdict.UNKNOWN, "unknown torque of the travel", (),
            statements.CurveShape("travel", "rad", "periodic in the travel", curve, band), 8.0,
        ),
    )  # fmt: skip


def curves():
    x = np.linspace(-0.3, 0.3, 32)
    law = -FRICTION.value * np.sign(x)
    return (
        statements.EffectCurve(
            "dry_friction", "pitch", "pitch rate", "rad/s", np.column_stack((x, law + 1e-3 * np.cos(40.0 * x))),
            np.column_stack((x, law, law - 1e-3, law + 1e-3)),
        ),
        statements.EffectCurve(
            "unknown", "travel", "travel", "rad", np.empty((0, 2)),
            np.column_stack((TURNS, WAVE, WAVE - 1e-3, WAVE + 1e-3)),
        ),
    )  # fmt: skip


def catalogue():
    """Every entry: the shown one, two that are not testable, the others not shown."""
    verdicts = []
    for number, entry in enumerate(CATALOGUE):
        row = statements.CatalogueVerdict(
            entry.name, entry.axis, Verdict.NOT_SHOWN, Estimate(1e-3, 1e-3, entry.unit), 1.0, 0.02 * (number + 1), 3e-3,
            "score 1.0 nats, 8 needed", "",
        )  # fmt: skip
        if (entry.name, entry.axis) == ("dry_friction", "pitch"):
            row = replace(row, verdict=Verdict.SHOWN, estimate=FRICTION, score=41.0)
        if entry.name == "inertial_coupling":
            row = replace(
                row, verdict=Verdict.NOT_TESTABLE, visibility=0.004, upper_bound=None, why="only 0.4 % is left",
                experiment="Turn the travel fast.", estimate=Estimate(0.0, float("inf"), entry.unit),
            )  # fmt: skip
        verdicts.append(row)
    return tuple(verdicts)


def example_diagnosis(logs=None):
    """The diagnosis of one or two held-out logs of twenty seconds."""
    logs = logs or [simulated_log()]
    series = tuple(held_out_series(log) for log in logs)
    gain = results.ErrorFigure(70.0, 50.0, 90.0)
    return results.Diagnosis(
        verdict=results.RigVerdict.EFFECTS_SHOWN, effects=found_effects(),
        possible=(
            statements.FoundEffect(
                "motor_lag", "rotors", Estimate(0.03, 2e-3, "s"), Verdict.POSSIBLE, "lag or delay of the rotors",
                (("input_delay", "rotors"),), statements.NamedShape(), 5.0, "Step both voltages.", True, 2.5,
                "lag and delay of the rotors together: 110 ms",
            ),
        ),
        catalogue=catalogue(), parameters_before=estimates(BEFORE), parameters_after=estimates(AFTER),
        effects_after={"dry_friction_pitch": FRICTION}, parameters=determinations(AFTER), covariance=np.diag([1e-4]),
        covariance_fields=("k_x",), plant_before=BEFORE, plant_after=AFTER, axes=axis_reports(series),
        held_out=results.HeldOutLikelihood(20.0, 1800.0, 1803.5, gain), closed_loop=False,
        references="voltages", agreement=statements.Agreement(0.8, 0.9, 3), series=series, curves=curves(),
        data=(
            results.DataEntry("train <1>.csv", "ab" * 32, 9000, 100.0, "training", ("pitch in degrees",)),
            results.DataEntry("held.csv", "cd" * 32, 2000, 100.0, "held out"),
        ),
        settings={
            "motor_time_constant": 0.08, "voltage_limit": 5.0, "rest_pitch": None, "keep_events": False,
            "score_needed": 8.0, "score_needed_certain": 6.0, "operating_point": 1.25,
        },
        notes=("voltages reach 5.10 V",), seconds=12.3,
        provenance={**provenance(), "command": "heli diagnose 'a b.csv'", "date": "2026-03-01 12:00 UTC"},
    )  # fmt: skip


def adequate_diagnosis():
    """The same rig, found adequate."""
    base = example_diagnosis()
    shown = tuple(replace(v, verdict=Verdict.NOT_SHOWN) if v.verdict == Verdict.SHOWN else v for v in base.catalogue)
    return replace(
        base, verdict=results.RigVerdict.MODEL_ADEQUATE, effects=(), curves=(), catalogue=shown,
        parameters_after=base.parameters_before, effects_after={}, possible=(),
    )  # fmt: skip
