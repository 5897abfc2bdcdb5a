"""The paper's experiments on the units: its Tables 1 and 2 and counterparts of its Figures 2 to 5, as CSV and SVG.

    python -m benchmarks paper --output paper

The paper's text is not at hand; its tables, signals and settings are those that the project restates. The contents of
the figures are inferred: 2 and 5 the histories of the estimates (pitch; elevation and travel), 3 plant and model in
open loop, 4 pitch steps in closed loop. Bars: every pitch run and the means of elevation and travel within .1 % of
Table 2.

Exciter -> HelicopterPlant -> AdaptiveIdentifier run on the plant of Table 2 with encoders on and no disturbance. The
pitch experiment drives v_f - v_r alone, and two identifiers receive the same voltages and angles: one knows theta0, the
other estimates it. The joint experiment drives sum and difference at once, on a base voltage that keeps the arm
turning. Each of the twelve runs of an experiment has its own Omega(0), Gamma(0) and start state.

An estimate keeps a share of Omega(0) of the order of 1 / (Gamma(0) int phi phi^T dt). With the paper's Gamma(0) = 1e3
that is some percent in the elevation of experiment 2, so the means of Table 2 are those from `CERTAIN` on.
"""

import csv
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness import options
from fmu_src import AXES, OPEN_LOOP, VOLTAGES, Connection, Scenario, Value, build
from fmu_src.master import run_apart
from heli_identifier.online import ModelParameters
from heli_identifier.results import Axes, figure, write_figure
from heli_identifier.tools.history import ROLES
from heli_plant.parameters import BY_FIELD, TABLE_2
from heli_plant.state import rest_state

EXPERIMENTS = (1, 2)
NAMES = ModelParameters._fields
TRUTH = ModelParameters(*(getattr(TABLE_2, name) for name in NAMES))
UNITS = {name: BY_FIELD[name].unit for name in NAMES}
OF_PITCH, OTHERS = NAMES[:4], NAMES[4:]
PITCH = ("a_wx", "a_th", "k_x")
"""Parameters of the paper's Table 1 [1/s, 1/s^2, rad/s^2/V]."""

TABLE_1 = {
    1: {"a_wx": (0.059, 0.062), "a_th": (0.658, 0.668), "k_x": (0.289, 0.298)},
    2: {"a_wx": (0.064, 0.068), "a_th": (0.595, 0.623), "k_x": (0.257, 0.269)},
}
"""Ranges of twelve estimates, as printed, by experiment."""

STEP = 0.01
"""Control and communication period [s]."""

KNOWN, FREE = "known", "estimated"
"""Whether an identifier knows theta0 or estimates it; its unit has this name."""

OMEGAS = {
    "nothing": ModelParameters(),
    "low guess": ModelParameters(0.03, 0.3, 0.15, 0.0, 0.02, 1.5, 0.0, 0.0, 0.1, 0.05, -0.05),
    "high guess": ModelParameters(0.1, 1.0, 0.5, -0.2, 0.1, 4.0, -0.3, 0.1, 0.3, 0.2, -0.2),
}
"""Omega(0): zero, and about half and one and a half times the values of such a rig."""

GAINS = (1e3, 1e4, 1e5, 1e6)
"""Gamma(0) in units of I, from the paper's 1e3 up."""

CERTAIN = 1e5
"""Smallest Gamma(0) from which Omega(0) is forgotten."""

SCATTER = 0.1
"""Half width of the start states' scatter [rad, rad/s]."""

PITCH_STEP, STEP_TIME, LOOP_DURATION = 0.3, 20.0, 40.0
"""Figure 4: step of the reference [rad], its time and the end [s]."""


@dataclass(frozen=True)
class Kind:
    """A kind of experiment: channel of the Exciter (0 both, 1 difference), base voltage [V], duration [s], units."""

    name: str
    channel: int
    base: float
    duration: float
    identifiers: tuple[str, ...]


PITCH_RUN = Kind("pitch", 1, 0.5, 200.0, (KNOWN, FREE))
JOINT_RUN = Kind("elevation and travel", 0, 2.0, 400.0, (FREE,))


@dataclass(frozen=True)
class Start:
    """Start of run ``number``, 1 to 12: key of `OMEGAS`, Gamma(0), angles [rad] and rates [rad/s] beside rest."""

    number: int
    omega: str
    gain: float
    angles: tuple[float, ...]
    rates: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Run:
    """Time (M,) [s] and estimates (M, 11) by `KNOWN` and `FREE`."""

    kind: Kind
    experiment: int
    start: Start
    time: NDArray[np.float64]
    estimates: dict[str, NDArray[np.float64]]

    def deviations(self, names: Sequence[str], rest_angle: str) -> NDArray[np.float64]:
        """Give the relative deviations of the last estimates from Table 2 [1]."""
        return np.array([self.final(rest_angle)[name] / getattr(TRUTH, name) - 1.0 for name in names])

    def final(self, rest_angle: str) -> dict[str, float]:
        """Give the last estimates by name."""
        return dict(zip(NAMES, self.estimates[rest_angle][-1].tolist(), strict=True))


def twelve_starts(experiment: int) -> list[Start]:
    """Give the starts of the runs of an experiment; the same on every machine."""
    random = np.random.default_rng(experiment)
    drawn = [random.uniform(-SCATTER, SCATTER, 6).tolist() for _ in range(len(OMEGAS) * len(GAINS))]
    pairs = zip(product(OMEGAS, GAINS), drawn, strict=True)
    return [Start(k, omega, gain, tuple(x[:3]), tuple(x[3:])) for k, ((omega, gain), x) in enumerate(pairs, start=1)]


def parameters_of(kind: Kind, experiment: int, start: Start) -> dict[str, Value]:
    """Give the parameters of exciter and plant for one run."""
    order: dict[str, Value] = {
        "exciter.excitation.experiment": experiment,
        "exciter.excitation.channel": kind.channel,
        "exciter.excitation.base": kind.base,
        "plant.encoder.enabled": True,
        "plant.initial.v_front": kind.base,
        "plant.initial.v_rear": kind.base,
    }
    rest = rest_state(TABLE_2, 2.0 * kind.base)
    for axis, angle, rate in zip(AXES, start.angles, start.rates, strict=True):
        order[f"plant.initial.{axis}"] = getattr(rest, axis) + angle
        order[f"plant.initial.{axis}_rate"] = rate
    return order


def run_once(kind: Kind, experiment: int, start: Start, fmus: dict[str, Path]) -> Run:
    """Run one experiment on built units, given by class, in a process of its own."""
    order = parameters_of(kind, experiment, start)
    heard = [wire for wire in OPEN_LOOP.connections if wire.target_unit == "identifier"]
    wires = [wire for wire in OPEN_LOOP.connections if wire.target_unit != "identifier"]
    units = [(name, unit) for name, unit in OPEN_LOOP.units if name != "identifier"]
    for unit in kind.identifiers:
        units.append((unit, "AdaptiveIdentifier"))
        wires += [Connection(wire.source_unit, wire.source, unit, wire.target) for wire in heard]
        order |= {
            f"{unit}.pitch.rest_angle_known": unit == KNOWN,
            f"{unit}.pitch.rest_angle": TRUTH.theta0,
            f"{unit}.adaptation.initial_gain": start.gain,
            f"{unit}.adaptation.gain_limit": start.gain,
            **{f"{unit}.initial.{name}": value for name, value in OMEGAS[start.omega]._asdict().items()},
        }
    scenario = Scenario("paper", f"the paper's experiments: {kind.name}", tuple(units), tuple(wires))
    columns = {unit: [f"{unit}.{name}" for name in NAMES] for unit in kind.identifiers}
    record = [name for names in columns.values() for name in names]
    files = {name: fmus[unit] for name, unit in units}
    result = run_apart(scenario, kind.duration, STEP, order, files, record=record)
    last = len(result.time) - 1
    late = min(round(30.0 / STEP), last)  # the estimates move most soon after the adaptation begins, at 10 s
    rows = np.concatenate([np.arange(0, late, 10), np.arange(late, last, 100), [last]])
    estimates = {unit: result.columns(*names)[rows] for unit, names in columns.items()}
    return Run(kind, experiment, start, result.time[rows], estimates)


def run_all(
    kinds: Iterable[Kind], fmus: dict[str, Path], numbers: Sequence[int] = range(1, 13)
) -> dict[str, list[Run]]:
    """Run all kinds in both experiments, a process a core at a time; give the runs by kind."""
    jobs = [
        (kind, experiment, start)
        for kind in kinds
        for experiment in EXPERIMENTS
        for start in twelve_starts(experiment)
        if start.number in numbers
    ]
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        runs = list(pool.map(lambda job: run_once(*(*job, fmus)), jobs))
    return {kind.name: [run for run in runs if run.kind == kind] for kind in kinds}


# --- tables ------------------------------------------------------------------------------------------------------


Line = tuple[NDArray[np.float64], NDArray[np.float64], str]
"""Time [s], values and name of a line."""


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV with one header; numbers have six significant digits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row] for row in rows)


def write_table_1(runs: Sequence[Run], folder: Path) -> None:
    """Write ranges beside the paper's."""
    rows = []
    for experiment, rest_angle in product(EXPERIMENTS, (KNOWN, FREE)):
        own = [run for run in runs if run.experiment == experiment]
        for name in OF_PITCH if rest_angle == FREE else PITCH:
            values = [run.final(rest_angle)[name] for run in own]
            worst = float(max(abs(run.deviations([name], rest_angle)[0]) for run in own))
            row = (experiment, rest_angle, name, UNITS[name], min(values), max(values), 100.0 * worst)
            rows.append((*row, getattr(TRUTH, name), *TABLE_1[experiment].get(name, ("", ""))))
    header = ("experiment", "theta0", "parameter", "unit", "lowest", "highest", "largest deviation [%]", "truth")
    write_table(folder / "table1.csv", (*header, "paper lowest", "paper highest"), rows)
    for rest_angle, names in ((KNOWN, PITCH), (FREE, OF_PITCH)):
        largest = max(float(np.abs(run.deviations(names, rest_angle)).max()) for run in runs)
        print(f"Table 1: all pitch runs end within {100.0 * largest:.2g} % of Table 2 with theta0 {rest_angle}.")


def write_table_2(runs: dict[str, list[Run]], folder: Path) -> None:
    """Write the mean of every parameter, and the largest deviation for each Gamma(0)."""
    rows: list[tuple[str, str, float, float, float, float, float]] = []
    recovery: dict[tuple[int, float], list[float]] = {}
    for kind, names in ((PITCH_RUN.name, OF_PITCH), (JOINT_RUN.name, OTHERS)):
        off = np.array([run.deviations(names, FREE) for run in runs[kind]])
        sure = off[[run.start.gain >= CERTAIN for run in runs[kind]]]
        for name, of_name in zip(names, sure.T, strict=True):
            true, mean, worst = getattr(TRUTH, name), float(of_name.mean()), float(np.abs(of_name).max())
            scatter = float(abs(true) * of_name.std(ddof=1))
            rows.append((name, UNITS[name], true, true * (1.0 + mean), scatter, 100.0 * mean, 100.0 * worst))
        for experiment, gain in product(EXPERIMENTS, sorted({run.start.gain for run in runs[kind]})):
            own = [(run.experiment, run.start.gain) == (experiment, gain) for run in runs[kind]]
            recovery.setdefault((experiment, gain), []).extend((100.0 * np.abs(off[own]).max(axis=0)).tolist())
    head = ("parameter", "unit", "truth", "mean", "scatter of a run", "deviation [%]", "worst run's deviation [%]")
    write_table(folder / "table2.csv", head, rows)
    header = ("experiment", "Gamma(0)", *(f"{name} worst deviation [%]" for name in NAMES))
    write_table(folder / "recovery.csv", header, ((*kept, *values) for kept, values in recovery.items()))
    print(f"Table 2: from Gamma(0) = {CERTAIN:g} on the means are within {max(abs(row[-2]) for row in rows):.2g} %, "
          f"single runs within {max(row[-1] for row in rows):.2g} %.")  # fmt: skip


# --- figures -----------------------------------------------------------------------------------------------------


def panels(labels: Sequence[str], lines: Sequence[Sequence[Line]], truths: Sequence[float] = ()) -> str:
    """Draw panels below each other on one time axis; lines of one name have one colour, a dashed line is the truth."""
    drawn = []
    for number, (label, own) in enumerate(zip(labels, lines, strict=True)):
        limits = sorted((0.5 * truths[number], 1.5 * truths[number])) if truths else None
        panel = Axes(label, 110.0, (limits[0], limits[1]) if limits else None)
        colours: dict[str, str] = {}
        for time, values, name in own:
            shown = "" if name in colours else name
            panel.line(time, values, colours.setdefault(name, ROLES[len(colours) % len(ROLES)]), shown, 0.9)
        if truths:
            panel.level(truths[number], "ink")
        drawn.append(panel)
    return figure(drawn, "time [s]", "Lines over time", 760.0, log_x=bool(truths))


def histories(runs: Sequence[Run], names: Sequence[str], rest_angle: str, number: int, folder: Path) -> None:
    """Write and draw the histories of ``names``."""
    columns = [NAMES.index(name) for name in names]
    labels = [f"{name} [{UNITS[name]}]" for name in names]
    write_table(
        folder / f"figure{number}.csv",
        ("experiment", "run", "Omega(0)", "Gamma(0)", "time [s]", *labels),
        (
            (run.experiment, run.start.number, run.start.omega, run.start.gain, *row)
            for run in runs
            for row in np.column_stack((run.time, run.estimates[rest_angle][:, columns])).tolist()
        ),
    )
    for experiment in EXPERIMENTS:
        own = [run for run in runs if run.experiment == experiment]
        lines = [[(run.time, run.estimates[rest_angle][:, column], f"Omega(0): {run.start.omega}") for run in own]
                 for column in columns]  # fmt: skip
        drawing = panels(labels, lines, [TRUTH[column] for column in columns])
        write_figure(drawing, folder / f"figure{number}_experiment{experiment}.svg")


def model_of(estimates: dict[str, float], unit: str) -> dict[str, Value]:
    """Give the pitch parameters of an estimate as those of the plant unit called ``unit``."""
    return {f"{unit}.{BY_FIELD[name].name}": estimates[name] for name in PITCH}


def side_by_side(best: Run, fmus: dict[str, Path], folder: Path) -> None:
    """Draw the plant and the model of a run of experiment 1 under experiment 2."""
    units = (("exciter", "Exciter"), ("plant", "HelicopterPlant"), ("model", "HelicopterPlant"))
    wires = tuple(Connection("exciter", v, unit, v) for unit in ("plant", "model") for v in VOLTAGES)
    order = parameters_of(best.kind, 2, best.start)
    order |= {f"model{name[5:]}": value for name, value in order.items() if name.startswith("plant.initial")}
    order |= model_of(best.final(KNOWN), "model")
    result = run_apart(
        Scenario("side_by_side", "plant and identified model side by side", units, wires), best.kind.duration, STEP,
        order, {name: fmus[unit] for name, unit in units}, record=("plant.pitch", "model.pitch"),
    )  # fmt: skip
    time, plant, model = result.time, result.column("plant.pitch"), result.column("model.pitch")
    header = ("time [s]", "plant pitch [rad]", "model pitch [rad]")
    write_table(folder / "figure3.csv", header, np.column_stack([time, plant, model])[::10].tolist())
    lines = [[(time, plant, "plant, encoder"), (time, model, "model")], [(time, 1e3 * (plant - model), "")]]
    write_figure(panels(("pitch [rad]", "difference [mrad]"), lines), folder / "figure3.svg")
    apart = float(np.sqrt(np.mean((plant - model) ** 2)))
    print(f"Figure 3: the model of experiment 1 follows experiment 2 to {1e3 * apart:.2f} mrad rms.")


def closed_loops(models: dict[str, dict[str, float]], fmus: dict[str, Path], folder: Path) -> None:
    """Draw pitch steps of the plant and of models, each under a PID."""
    rigs, units, wires = ("plant", *models), [], []
    order: dict[str, Value] = {}
    for rig in rigs:
        units += [(rig, "HelicopterPlant"), (pid := f"controller_{rig}", "PidController")]
        wires += [Connection(rig, axis, pid, axis) for axis in AXES] + [Connection(pid, v, rig, v) for v in VOLTAGES]
        order |= {f"{rig}.encoder.enabled": True, f"{pid}.reference.step_pitch": PITCH_STEP}
        order |= {f"{pid}.reference.step_time": STEP_TIME} | (model_of(models[rig], rig) if rig in models else {})
    scenario = Scenario("paper_closed_loop", "pitch steps in closed loop", tuple(units), tuple(wires))
    record = [f"{rig}.pitch" for rig in rigs]
    result = run_apart(scenario, LOOP_DURATION, STEP, order, {name: fmus[unit] for name, unit in units}, record=record)
    pitch = result.columns(*record)
    header = ("time [s]", *(f"{rig} pitch [rad]" for rig in rigs))
    write_table(folder / "figure4.csv", header, np.column_stack((result.time, pitch))[::5].tolist())
    off = 1e3 * (pitch - pitch[:, :1])
    lines = [[(result.time, values[:, k], rig) for k, rig in enumerate(rigs)] for values in (pitch, off)]
    write_figure(panels(("pitch [rad]", "model less plant [mrad]"), lines), folder / "figure4.svg")
    worst = ", ".join(f"{rig} {largest:.1f} mrad" for rig, largest in zip(rigs, np.abs(off).max(axis=0), strict=True))
    print(f"Figure 4: farthest from the plant in closed loop: {worst}.")


def reproduce(
    folder: Path, kinds: tuple[Kind, Kind] = (JOINT_RUN, PITCH_RUN), numbers: Sequence[int] = range(1, 13)
) -> None:
    """Run the paper's experiments and write tables and figures; print what they show."""
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as built:
        units = ("Exciter", "HelicopterPlant", "AdaptiveIdentifier", "PidController")
        fmus = {unit: build(unit, Path(built)) for unit in units}
        runs = run_all(kinds, fmus, numbers)
        of_pitch = runs[PITCH_RUN.name]
        write_table_1(of_pitch, folder)
        write_table_2(runs, folder)
        histories(of_pitch, PITCH, KNOWN, 2, folder)
        histories(runs[JOINT_RUN.name], OTHERS, FREE, 5, folder)
        best = max((run for run in of_pitch if run.experiment == 1), key=lambda run: run.start.gain)
        side_by_side(best, fmus, folder)
        middle = {
            f"paper_{experiment}": {name: float(np.mean(TABLE_1[experiment][name])) for name in PITCH}
            for experiment in EXPERIMENTS
        }
        closed_loops({"identified": best.final(KNOWN)} | middle, fmus, folder)


def paper(arguments: Sequence[str]) -> None:
    """Run the whole paper."""
    reproduce(options(arguments, "paper", __doc__, output=(Path("paper"), "folder of the tables and figures")).output)
