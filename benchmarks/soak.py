"""A day in closed loop: 8.64 million steps of four native units with every method of the identifier.

The loop is excited for 40 minutes of each hour. The plant jumps in the tenth minute, in turn: the gain of the thrust on
pitch and elevation by a fifth (the plant's unit is replaced by another one in the same state), and the mass by .15 m
along the arm, by its input. In the last 20 minutes of an hour nothing excites the loop. Encoders are on. Bars: Gamma
positive definite and at most 1 % above its limit, no sample lost, 5 MB of memory, a quarter of a jump missing after
60 s.
"""

import struct
import types
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness import Bar, apart, bar_table, resident_memory, section, table
from fmu_src import CLOSED_LOOP, build
from fmu_src.master.instance import Instance
from fmu_src.master.loop import Wired
from heli_identifier.online import IdentifierState, Sampled
from heli_identifier.online.adaptation import gain_matrix
from heli_identifier.results import significant

HOURS = 24
STEP = 0.01
MINUTE = round(60.0 / STEP)
"""Steps of a minute."""

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
    "excitation.experiment": 3, "excitation.base": 0.0, "multisine.period": 20.0, "multisine.lowest": 0.1,
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
JUDGED = ("k_x", "k_z", "a_e")
RECORDED = (*(f"plant.{name}" for name in MOTION), "controller.v_front", "controller.v_rear",
            "exciter.v_front", "exciter.v_rear", *(f"identifier.{name}" for name in JUDGED))  # fmt: skip


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

    def give(self, unit: str, values: dict[str, float]) -> None:
        """Set inputs that are not wired."""
        one = self.units[unit]
        one.slave.setReal([one.variable(name).valueReference for name in values], list(values.values()))

    def connect(self, excited: bool) -> None:
        """Wire the units as they are."""
        to_excite = {"excitation_front": 0.0, "excitation_rear": 0.0}
        wires = tuple(wire for wire in CLOSED_LOOP.connections if excited or wire.target not in to_excite)
        if not excited:
            self.give("controller", to_excite)
        self.wired = Wired(replace(CLOSED_LOOP, connections=wires), self.units, STEP, RECORDED)
        self.wired.fetch(0.0)

    def column(self, name: str) -> int:
        """Return the column of a variable in the record and in what is shown."""
        return self.wired.names.index(name)

    def replace_plant(self, parameters: dict[str, Any], time: float) -> None:
        """Go on with a plant that has other parameters and the motion of the old one; its motors have settled."""
        initial = {name.partition(".")[2]: float(self.wired.shown[self.column(name)]) for name in RECORDED[:8]}
        given = {f"initial.{name}": value for name, value in initial.items()}
        self.start("plant", "HelicopterPlant", {**parameters, **given}, time)

    def eigenvalues(self) -> NDArray[np.float64]:
        """Return the eigenvalues of the three Gammas."""
        axes = [axis.estimate for axis in identifier_state(self.units["identifier"]).axes]
        return np.concatenate([np.linalg.eigvalsh(gain_matrix(own.factor, len(own.omega))) for own in axes])


def run_day(case: str) -> dict[str, Any]:
    """Fly a day, a minute at a time; return the figures."""
    given: dict[str, dict[str, Any]] = {
        "plant": {**PLANT, **GAINS},
        "controller": {"reference.elevation": ELEVATION, "travel.enabled": True},
        "exciter": EXCITER,
        "identifier": {"adaptation.gain_limit": GAIN_LIMIT, **CASES[case]},
    }
    truth, resident, eigenvalues, jumps = {**TRUTH}, [], [], []
    with TemporaryDirectory(prefix="heli-soak-") as name:
        folder = Path(name)
        loop = Loop({unit: build(unit, folder, native=True) for _, unit in CLOSED_LOOP.units}, folder)
        for unit, kind in CLOSED_LOOP.units:
            loop.start(unit, kind, given[unit], 0.0)
        loop.connect(True)
        record = np.empty((MINUTE, len(loop.wired.names)))
        estimates = [loop.column(f"identifier.{name}") for name in JUDGED]
        for k in range(60 * HOURS):
            hour, minute = divmod(k, 60)
            if minute == 10:
                before, seen = dict(truth), []
                if hour % 2 == 0:
                    changed = {name: (FACTOR if hour % 4 == 0 else 1.0) * value for name, value in GAINS.items()}
                    loop.replace_plant({**PLANT, **changed}, k * 60.0)
                    truth |= {"k_x": changed["pitch.gain"], "k_z": changed["elevation.gain"]}
                else:
                    place = MASS if hour % 4 == 1 else 0.0
                    loop.give("plant", {"mass_position": place})
                    truth["a_e"] = TRUTH["a_e"] + STIFFNESS * place
            if minute in (0, 10, 40):
                loop.connect(minute < 40)
            loop.wired.play(record, k * MINUTE)
            if 10 <= minute < 14:
                seen.append(record[:, estimates])
            if minute == 13:
                for name, own in zip(JUDGED, np.concatenate(seen).T, strict=True):
                    jumps += [jump(before[name], truth[name], own)] if truth[name] != before[name] else []
            if minute in (39, 59):
                eigenvalues.append(loop.eigenvalues())
            if minute == 59:
                resident.append(resident_memory())
        samples = identifier_state(loop.units["identifier"]).samples
        for one in loop.units.values():
            one.close()
    return {
        "steps": 60 * HOURS * MINUTE, "lost": abs(60 * HOURS * MINUTE - 1 - samples), "jumps": jumps,
        "growth": resident[-1] - resident[0],
        "least": float(np.min(eigenvalues)), "largest": float(np.max(eigenvalues)),
    }  # fmt: skip


def identifier_state(unit: Instance) -> IdentifierState:
    """Return what a native AdaptiveIdentifier remembers; it has taken at least one sample.

    Its serialised state holds its variables, then its memory: the fields of the identifier's NamedTuples in their
    order, a float as a C double, an int as eight bytes, a list behind its length, an optional value behind a flag.
    """
    state = unit.slave.getFMUState()
    data = bytes(unit.slave.serializeFMUstate(state))
    unit.slave.freeFMUState(state)
    # token, sum, whether it has Model Exchange, phase, failure, whether initialised, two times
    at = data.index(b"\0") + 1 + 8 + 1 + 8 + 8 + 1 + 1 + 8 + 8

    def take(kind: str) -> Any:
        nonlocal at
        at += struct.calcsize(f"<{kind}")
        return struct.unpack_from(f"<{kind}", data, at - struct.calcsize(f"<{kind}"))[0]

    def value(kind: Any) -> Any:
        if kind in (float, int, bool):
            return take({float: "d", int: "q", bool: "?"}[kind])
        if get_origin(kind) in (Union, types.UnionType):
            (inner,) = [one for one in get_args(kind) if one is not type(None)]
            return value(inner) if take("?") else None
        if get_origin(kind) is tuple:
            kinds = get_args(kind)
            return tuple(value(one) for one in (kinds[:1] * take("q") if kinds[-1] is Ellipsis else kinds))
        return kind(*(value(inner) for inner in get_type_hints(kind).values()))

    for variable in unit.description.modelVariables:
        at += 8 + 1 + 8
        if variable.type == "String":
            length = take("q")
            at += length
    take("?")  # whether it has warned
    sampled: Sampled | None = value(Sampled | None)
    if sampled is None or at != len(data):
        raise ValueError(f"{len(data) - at} bytes are left of the state")
    return sampled.state


def jump(old: float, new: float, estimate: NDArray[np.float64]) -> tuple[float, float]:
    """Return the share of the jump that is missing after 60 s, and the time from which on a quarter is not [s]."""
    missing = np.abs(estimate - new) / abs(new - old)
    late = np.flatnonzero(missing > 0.25)
    return float(missing[MINUTE]), float(STEP * (late[-1] + 1)) if len(late) else 0.0


def soak() -> str:
    """Fly all cases, each in a process of its own."""
    days = {case: apart(run_day, case) for case in CASES}

    def worst(name: str) -> float:
        return max(day[name] for day in days.values())

    missing, late = (max(own) for own in zip(*(one for day in days.values() for one in day["jumps"]), strict=True))
    bars = [
        Bar("least eigenvalue of Gamma", min(day["least"] for day in days.values()), 0.0, "", True),
        Bar("largest eigenvalue of Gamma", worst("largest"), 1.01 * GAIN_LIMIT, ""),
        Bar("samples lost or taken twice", worst("lost"), 0.0, ""),
        Bar("growth of memory, first hour to last", worst("growth"), 5.0, "MB"),
        Bar("of a jump missing after 60 s, worst", missing, 0.25, ""),
    ]
    rows = [
        (case, f"{day['steps']:,}", f"{day['least']:.2g} to {day['largest']:.5g}", f"{day['growth']:.1f}",
         len(day["jumps"]), f"{100.0 * max(day['jumps'])[0]:.0f} %")
        for case, day in days.items()
    ]  # fmt: skip
    return section(
        "A day in closed loop",
        bar_table(bars),
        table(("method", "steps", "eigenvalues of Gamma", "memory [MB]", "jumps", "missing after 60 s, worst"), rows),
        "The loop of four native units at 100 Hz, encoders on, excited for 40 minutes of each hour. In the tenth "
        "minute the plant jumps: its thrust by a fifth, or the mass by .15 m. Gamma is read from the unit's serialised "
        "state before and after each stretch without excitation. The last time at which a quarter of a jump is "
        f"missing, or an estimate of a short memory strays by as much, is {significant(late)} s after it.",
        packages=("fmpy", "numba"),
    )
