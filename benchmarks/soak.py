"""A day in closed loop: 8.64 million steps of four native units with every method of the identifier.

The loop is excited for 40 minutes of each hour. The plant jumps in the tenth minute, in turn: the gain of the thrust on
pitch and elevation by a fifth (the plant's unit is replaced by another one in the same state), and the mass by .15 m
along the arm, by its input. In the last 20 minutes of an hour nothing excites the loop. Encoders are on. Bars: Gamma
positive definite and at most 1 % above its limit, no sample lost, the periodic excitation the same after a day within
1e-9 V, 5 MB of memory, a quarter of a jump missing after 60 s.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness import Bar, apart, bar_table, resident_memory, section, table
from benchmarks.native_unit import identifier_state
from fmu_src import CLOSED_LOOP
from fmu_src.master.instance import Instance
from fmu_src.master.loop import Wired
from fmu_src.native import build_native
from heli_identifier.online.adaptation import gain_matrix
from heli_identifier.results import significant

HOURS = 24
STEP = 0.01
PERIOD = 20.0
"""Period of the multisines [s]; the exciter repeats itself to the last digits if time does not drift."""

GAIN_LIMIT = 1e3
ADAPTATION = "adaptation (7), omega_f = 3 rad/s, forgetting .1 1/s"
CASES: dict[str, dict[str, Any]] = {
    ADAPTATION: {"method": "adaptation", "filter.frequency": 3.0, "adaptation.forgetting": 0.1},
    "prediction errors, forgetting .3 1/s": {
        "method": "prediction_error", "motor.lag_known": True, "adaptation.forgetting": 0.3,
    },
    "prediction errors, lag estimated, forgetting .3 1/s": {
        "method": "prediction_error", "adaptation.forgetting": 0.3,
    },
}  # fmt: skip
"""Settings of the identifier. The default forgetting of .001 1/s forgets in a quarter of an hour. The adaptation's .1
is the least that follows on a flight with other excitation and jumps. Prediction errors are weighed by their variance,
which a jump of this plant without noise raises ten thousandfold, so that ln 1e4 time constants of forgetting pass
before new samples outweigh old ones; their .3 was found on this flight."""

EXCITER = {
    "excitation.experiment": 3, "excitation.base": 0.0, "multisine.period": PERIOD, "multisine.lowest": 0.1,
    "multisine.highest": 1.5, "multisine.rms_difference": 0.8, "multisine.rms_sum": 1.6,
}  # fmt: skip
ELEVATION, FACTOR, MASS = 0.25, 1.2, 0.15
"""Elevation held [rad], factor of the gains after a jump, way of the mass [m]."""

GAINS = {"pitch.gain": 0.293, "elevation.gain": 0.157}
TRUTH = {"k_x": 0.293, "k_z": 0.157, "a_e": 2.59}
OFFSET, STIFFNESS = 1.2, 4.0
"""What a metre of the mass' way adds to a_1 [rad/s^2/m] and a_e [1/s^2/m]."""

PLANT = {"encoder.enabled": True, "ado.offset_per_metre": OFFSET, "ado.stiffness_per_metre": STIFFNESS}

MOTION = ("pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate")
VOLTAGES = tuple(f"{unit}.v_{rotor}" for unit in ("controller", "exciter") for rotor in ("front", "rear"))
ESTIMATES = tuple(f"identifier.{name}" for name in ("k_x", "k_z", "a_e", "determined.k_x", "determined.k_z"))
RECORDED = (*(f"plant.{name}" for name in MOTION), *VOLTAGES, *ESTIMATES)


@dataclass
class Loop:
    """The units, wired with or without the exciter; what is not wired keeps the value that it was given last."""

    fmus: dict[str, Path]
    folder: Path
    units: dict[str, Instance] = field(default_factory=dict)
    built: int = 0

    def start(self, name: str, unit: str, parameters: dict[str, Any], time: float) -> None:
        """Put a new instance of a unit in its place."""
        if name in self.units:
            self.units[name].close()
        self.built += 1
        self.units[name] = Instance(name, self.fmus[unit], self.folder / f"{name}-{self.built}")
        self.units[name].initialise(parameters, time, 1e6)
        self.units[name].finish_initialisation(time)

    def set(self, unit: str, values: dict[str, float]) -> None:
        """Set inputs that are not wired."""
        one = self.units[unit]
        one.slave.setReal([one.variable(name).valueReference for name in values], list(values.values()))

    def connect(self, excited: bool) -> None:
        """Wire the units as they are."""
        to_excite = {"excitation_front": 0.0, "excitation_rear": 0.0}
        wires = tuple(wire for wire in CLOSED_LOOP.connections if excited or wire.target not in to_excite)
        if not excited:
            self.set("controller", to_excite)
        self.wired = Wired(replace(CLOSED_LOOP, connections=wires), self.units, STEP, RECORDED)
        self.wired.fetch(0.0)

    def shown(self, unit: str, *names: str) -> list[float]:
        """Return outputs as they are now."""
        return [float(self.wired.shown[self.wired.names.index(f"{unit}.{name}")]) for name in names]

    def replace_plant(self, parameters: dict[str, Any], time: float) -> None:
        """Go on with a plant that has other parameters and the motion of the old one; its motors have settled."""
        now = (*self.shown("plant", *MOTION), *self.shown("controller", "v_front", "v_rear"))
        initial = {f"initial.{name}": value for name, value in zip((*MOTION, "v_front", "v_rear"), now, strict=True)}
        self.start("plant", "HelicopterPlant", {**parameters, **initial}, time)

    def eigenvalues(self) -> NDArray[np.float64]:
        """Return the eigenvalues of the three Gammas."""
        axes = [axis.estimate for axis in identifier_state(self.units["identifier"]).axes]
        return np.concatenate([np.linalg.eigvalsh(gain_matrix(own.factor, len(own.omega))) for own in axes])


def run_day(case: str) -> dict[str, Any]:
    """Fly a day; return the figures."""
    given: dict[str, dict[str, Any]] = {
        "plant": {**PLANT, **GAINS},
        "controller": {"reference.elevation": ELEVATION, "travel.enabled": True},
        "exciter": EXCITER,
        "identifier": {"adaptation.gain_limit": GAIN_LIMIT, **CASES[case]},
    }
    with TemporaryDirectory(prefix="heli-soak-") as name:
        folder = Path(name)
        loop = Loop({unit: build_native(unit, folder) for _, unit in CLOSED_LOOP.units}, folder)
        for unit, kind in CLOSED_LOOP.units:
            loop.start(unit, kind, given[unit], 0.0)
        loop.connect(True)
        figures = flown(loop)
        for one in loop.units.values():
            one.close()
    return figures


def flown(loop: Loop) -> dict[str, Any]:
    """Take all steps, a minute at a time."""
    minute, period = round(60.0 / STEP), round(PERIOD / STEP)
    record = np.empty((minute, len(loop.wired.names)))
    at = {name: loop.wired.names.index(f"identifier.{name}") for name in ("k_x", "k_z", "a_e")}
    sure_at = {name: loop.wired.names.index(f"identifier.determined.{name}") for name in ("k_x", "k_z")}
    of_exciter = [loop.wired.names.index(f"exciter.v_{rotor}") for rotor in ("front", "rear")]
    truth, repeats, resident, eigenvalues, jumps = {**TRUTH}, 0.0, [], [], []
    sure, wrong = ({"excited": 0, "quiet": 0} for _ in range(2))
    for k in range(60 * HOURS):
        of_hour, hour = k % 60, k // 60
        if of_hour == 10:
            before, seen = dict(truth), []
            if hour % 2 == 0:
                factor = FACTOR if hour % 4 == 0 else 1.0
                changed = {name: factor * value for name, value in GAINS.items()}
                loop.replace_plant({**PLANT, **changed}, k * 60.0)
                truth |= {"k_x": changed["pitch.gain"], "k_z": changed["elevation.gain"]}
            else:
                place = MASS if hour % 4 == 1 else 0.0
                loop.set("plant", {"mass_position": place})
                truth["a_e"] = TRUTH["a_e"] + STIFFNESS * place
        if of_hour in (0, 10, 40):
            loop.connect(of_hour < 40)
        loop.wired.play(record, k * minute)
        if k == 0:
            first_period = record[:period, of_exciter]
        repeats = max(repeats, float(np.abs(record[:period, of_exciter] - first_period).max()))
        stage = "quiet" if of_hour >= 40 else "excited" if not 10 <= of_hour < 12 else ""
        for name, column in sure_at.items() if stage else ():
            determined = record[:, column] == 1.0
            off = np.abs(record[:, at[name]] - truth[name]) > 0.5 * truth[name]
            sure[stage] += int(determined.sum())
            wrong[stage] += int((determined & off).sum())
        if 10 <= of_hour < 14:
            seen.append(record[:, list(at.values())])
        if of_hour == 13:
            for name, own in zip(at, np.concatenate(seen).T, strict=True):
                jumps += [jump(before[name], truth[name], own)] if truth[name] != before[name] else []
        if of_hour in (39, 59):
            eigenvalues.append(loop.eigenvalues())
        if of_hour == 59:
            resident.append(resident_memory())
    steps = 60 * HOURS * minute
    return {
        "steps": steps, "lost": steps - 1 - identifier_state(loop.units["identifier"]).samples,
        "repeats": repeats, "jumps": jumps, "growth": resident[-1] - resident[0],
        "smallest": float(np.min(eigenvalues)), "largest": float(np.max(eigenvalues)), "sure": sure, "wrong": wrong,
    }  # fmt: skip


def jump(old: float, new: float, estimate: NDArray[np.float64]) -> tuple[float, float]:
    """Return the share of the jump that is missing after 60 s, and the time from which on a quarter is not [s]."""
    missing = np.abs(estimate - new) / abs(new - old)
    late = np.flatnonzero(missing > 0.25)
    return float(missing[round(60.0 / STEP)]), float(STEP * (late[-1] + 1)) if len(late) else 0.0


def soak() -> str:
    """Fly all cases, each in a process of its own."""
    days = {case: apart(run_day, case) for case in CASES}
    jumps = [one for day in days.values() for one in day["jumps"]]
    bars = [
        Bar("least eigenvalue of Gamma", min(day["smallest"] for day in days.values()), 0.0, "", True),
        Bar("largest eigenvalue of Gamma", max(day["largest"] for day in days.values()), 1.01 * GAIN_LIMIT, ""),
        Bar("samples lost or taken twice", max(abs(day["lost"]) for day in days.values()), 0.0, ""),
        Bar("change of the periodic excitation in a day", max(day["repeats"] for day in days.values()), 1e-9, "V"),
        Bar("growth of memory, first hour to last", max(day["growth"] for day in days.values()), 5.0, "MB"),
        Bar("of a jump missing after 60 s, worst", max(missing for missing, _ in jumps), 0.25, ""),
    ]
    head = (
        "method", "steps", "eigenvalues of Gamma", "samples lost", "repeats within [V]", "memory [MB]", "jumps",
        "missing after 60 s, worst", "determined but off by half, excited", "the same, not excited",
    )  # fmt: skip
    rows = [
        (case, f"{day['steps']:,}", f"{day['smallest']:.2g} to {day['largest']:.5g}", day["lost"],
         f"{day['repeats']:.1e}", f"{day['growth']:.1f}", len(day["jumps"]),
         f"{100.0 * max(missing for missing, _ in day['jumps']):.0f} %",
         *(f"{100.0 * day['wrong'][stage] / own:.1f} % of {own:,}" if own else "never determined"
           for stage, own in day["sure"].items()))
        for case, day in days.items()
    ]  # fmt: skip
    return section(
        "A day in closed loop",
        bar_table(bars),
        table(head, rows),
        "The loop of four native units at 100 Hz, encoders on, excited for 40 minutes of each hour. In the tenth "
        "minute the plant jumps: its thrust by a fifth, or the mass by .15 m. Gamma is read from the unit's serialised "
        "state before and after each stretch without excitation. The last time at which a quarter of a jump is "
        "missing, or an estimate of a short memory strays by as much, is "
        f"{significant(max(last for _, last in jumps))} s after it. The last columns count the samples of k_x and k_z "
        "that the unit calls determined while they are wrong by more than half, two minutes after a jump left out.",
        packages=("fmpy", "numba"),
    )
