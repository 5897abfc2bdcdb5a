"""Computing time against the length of a log, the number of logs and the number of effects that are switched on.

The blind generator makes the logs, of a rig with dry friction in its pitch bearing, so that a diagnosis finds and
checks an effect. A length is left out if its diagnosis would take longer than :data:`LIMIT`; the growth of the times
over the shorter lengths predicts it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np

from benchmarks.cost_figures import FOLDER, by_effects, by_logs, by_samples
from benchmarks.machine import measured_at
from benchmarks.replay import replay
from benchmarks.tables import figure, seconds, table
from benchmarks.timing import in_turn
from heli_identifier.online import IdentifierSettings
from heli_identifier.records import Log
from heli_identifier.results.style import write_figure
from heli_identifier.tracing import diagnose
from heli_plant.effects import CATALOGUE
from heli_plant.parameters import TABLE_2, PlantParameters
from heli_plant.plant import step
from heli_plant.simulation import simulate
from heli_plant.state import PlantState, rest_state
from tests.blind.generator import simulate_log
from tests.blind.kinds import draw_rig
from tests.blind.signals import multisines

H, RATE = 0.01, 100.0
SAMPLES = (10_000, 30_000, 100_000, 300_000, 1_000_000)
LOGS = (1, 2, 4, 8)
LOG_SECONDS = 90.0
LIMIT = 400.0
"""Longest diagnosis [s] that is started."""

ROUNDS, STEP_ROUNDS, STEPS = 3, 15, 500
FLYING = PlantState(0.1, 0.05, 0.2, 0.1, 0.05, -0.2, 1.2, 1.1)
RIG = draw_rig(np.random.SeedSequence(7), "dry_friction:pitch")


def log(duration: float, number: int) -> Log:
    """Make a log of some seconds."""
    samples = simulate_log(RIG, multisines(duration, np.random.default_rng(number)), number)
    return Log(f"log{number}", RATE, samples[:, 1:3], samples[:, 3:])


def effects_on(count: int) -> PlantParameters:
    """Switch on the first ``count`` entries of the catalogue, each by a thousandth of its range."""
    small = {e.field: 1e-3 * min(e.upper, 1.0) for e in CATALOGUE[:count]}
    return TABLE_2._replace(**small)


@dataclass(frozen=True)
class Run:
    """One diagnosis: its duration [s], and the number of effects found, all of which are refitted and checked."""

    seconds: float
    found: int


def run(logs: Sequence[Log], held_out: Log) -> Run:
    """Diagnose once, without report and unit."""
    began = perf_counter()
    diagnosis = diagnose(logs, held_out=held_out)
    return Run(perf_counter() - began, len(diagnosis.effects))


def length_costs(held_out: Log) -> list[tuple[int, float, float, Run | None]]:
    """Give number of samples, seconds of simulation and replay, and the diagnosis, or None where it was left out."""
    rows: list[tuple[int, float, float, Run | None]] = []
    diagnosed: list[tuple[int, float]] = []
    for count in SAMPLES:
        one = log(count * H, count)
        start = rest_state(TABLE_2, float(one.voltages[0].sum()))
        times = in_turn(
            {
                "simulation": partial(simulate, one.voltages, H, start, TABLE_2),
                "replay": partial(replay, one.voltages, one.angles, IdentifierSettings()),
            },
            ROUNDS,
        )
        diagnosis = None
        if expected(diagnosed, count) <= LIMIT:
            diagnosis = run([one], held_out)
            diagnosed.append((count, diagnosis.seconds))
        rows.append((count, times["simulation"].median, times["replay"].median, diagnosis))
    return rows


def expected(done: Sequence[tuple[int, float]], count: int) -> float:
    """Predict the seconds for ``count`` samples: in proportion, or with the power of the last growth if that is more.

    A power above one, for example because memory becomes short, thus shows before the length is ten times as large.
    """
    if not done:
        return 0.0
    last, time = done[-1]
    power = log_ratio(time, done[-2][1]) / log_ratio(last, done[-2][0]) if len(done) > 1 else 1.0
    return float(time * (count / last) ** max(power, 1.0))


def log_ratio(value: float, other: float) -> float:
    """Logarithm of a ratio."""
    return float(np.log(value / other))


def log_costs(held_out: Log) -> list[tuple[int, Run]]:
    """Give numbers of logs, each with the diagnosis of so many logs."""
    logs = [log(LOG_SECONDS, number) for number in range(1, max(LOGS) + 1)]
    return [(count, run(logs[:count], held_out)) for count in LOGS]


def effect_costs() -> list[tuple[int, float, float]]:
    """Give numbers of effects that are on, each with the microseconds of a step, compiled and interpreted."""
    counts = [*range(0, len(CATALOGUE) - 2, 5), len(CATALOGUE)]
    voltages = multisines(LOG_SECONDS, np.random.default_rng(1))
    start = rest_state(TABLE_2, float(voltages[0].sum()))
    sets = {count: effects_on(count) for count in counts}
    times = in_turn(
        {
            **{f"compiled {n}": partial(simulate, voltages, H, start, p) for n, p in sets.items()},
            **{f"interpreted {n}": partial(interpreted_steps, p) for n, p in sets.items()},
        },
        STEP_ROUNDS,
    )
    return [
        (n, 1e6 * times[f"compiled {n}"].median / len(voltages), 1e6 * times[f"interpreted {n}"].median / STEPS)
        for n in counts
    ]


def interpreted_steps(parameters: PlantParameters) -> None:
    """Step as a unit does, :data:`STEPS` times from one state."""
    for k in range(STEPS):
        step(FLYING, 1.5, 1.0, 0.0, k * H, H, parameters)


def section(load: float) -> str:
    held_out = log(LOG_SECONDS, 100)
    diagnose(log(LOG_SECONDS, 101), held_out=held_out)
    lengths, logs, effects = length_costs(held_out), log_costs(held_out), effect_costs()
    for name, drawn in (
        ("cost-samples", by_samples([(n, s, r, d.seconds if d else None) for n, s, r, d in lengths])),
        ("cost-logs", by_logs([(n, d.seconds) for n, d in logs])),
        ("cost-effects", by_effects(effects)),
    ):
        write_figure(drawn, FOLDER / f"{name}.svg")
    return "\n\n".join(
        [
            "## Cost",
            "### Length of a log",
            "![Seconds against samples](figures/cost-samples.svg)",
            table(
                ("samples", "simulation", "replay of (7)", "diagnosis", "a sample", "effects found"),
                [_length_row(*row) for row in lengths],
            ),
            f"Sampled at {RATE:g} Hz; one log to fit, one of {LOG_SECONDS:g} s held out. Simulation and replay: median "
            f"of {ROUNDS} rounds. Diagnosis: one run, without report and unit{_left_out(lengths)}.",
            "### Number of logs",
            "![Seconds against logs](figures/cost-logs.svg)",
            table(
                ("logs to fit", "diagnosis", "a log", "effects found"),
                [(str(n), *_run_cells(d, n)) for n, d in logs],
            ),
            f"Logs of {LOG_SECONDS:g} s each, one more held out; one run each.",
            "### Number of effects switched on",
            "![Microseconds a step against effects](figures/cost-effects.svg)",
            table(
                ("effects on", "compiled", "interpreted"),
                [(str(n), f"{figure(fast)} us a step", f"{figure(slow)} us a step") for n, fast, slow in effects],
            ),
            f"The catalogue's entries in its order, {len(CATALOGUE)} in all. Compiled: simulation of {LOG_SECONDS:g} "
            f"s. Interpreted: {STEPS} steps, as a unit runs them. Median of {STEP_ROUNDS} rounds in turn.",
            measured_at(("numpy", "numba", "scipy"), load),
        ]
    )


def _length_row(count: int, simulation: float, replayed: float, diagnosis: Run | None) -> tuple[str, ...]:
    judged = _run_cells(diagnosis, count) if diagnosis is not None else ("", "", "")
    return f"{count:,}", seconds(simulation), seconds(replayed), *judged


def _run_cells(diagnosis: Run, count: int) -> tuple[str, str, str]:
    return seconds(diagnosis.seconds), seconds(diagnosis.seconds / count), str(diagnosis.found)


def _left_out(rows: Sequence[tuple[int, float, float, Run | None]]) -> str:
    missing = [f"{count:,}" for count, *_, diagnosis in rows if diagnosis is None]
    return f", left out at {' and '.join(missing)} samples, where it would take over {LIMIT:g} s" if missing else ""
