"""A day in closed loop: 8.64 million steps of four native units with every method of the identifier.

The loop is excited for 40 minutes of each hour. The plant jumps in the tenth minute, in turn: the gain of the thrust on
pitch and elevation by a fifth, by its tunable parameters, and the mass by .15 m along the arm, by its input. In the
last 20 minutes of an hour nothing excites the loop. Encoders are on. Bars: Gamma positive definite and at most 1 %
above its limit, no sample lost, 5 MB of memory, a quarter of a jump missing after 60 s.
"""

import struct
import types
from dataclasses import replace
from io import SEEK_CUR, BytesIO
from typing import Any, get_args, get_type_hints

import numpy as np
import pandas
from numpy.typing import NDArray

from benchmarks.harness import Bar, Row, bar_table, call_in_process, resident_memory, section, table
from fmu_src import CLOSED_LOOP
from fmu_src.master.instance import Instance
from fmu_src.master.loop import Wired, instantiate_units
from heli_identifier.online import IdentifierState, Sampled
from heli_identifier.online.adaptation import gain_matrix
from heli_plant.parameters import TABLE_2

HOURS, STEP = 24, 0.01  # [h], [s]
MINUTE = round(60.0 / STEP)  # steps
GAIN_LIMIT = 1e3
PREDICTING = {"method": "prediction_error", "adaptation.forgetting": 0.3}
CASES: dict[str, dict[str, Any]] = {
    "adaptation (7), omega_f = 3 rad/s, forgetting .1 1/s": {"filter.frequency": 3.0, "adaptation.forgetting": 0.1},
    "prediction errors, forgetting .3 1/s": {"motor.lag_known": True, **PREDICTING},
    "prediction errors, lag estimated, forgetting .3 1/s": PREDICTING,
}  # fmt: skip
"""Settings of the identifier. The adaptation's .1 is the least that follows on a flight with other excitation and
jumps. A jump of this plant without noise raises the variance that weighs prediction errors ten thousandfold: new
samples outweigh old ones after ln 1e4 time constants of forgetting. The .3 of prediction errors was chosen on this
flight."""

TRUTH = {"k_x": TABLE_2.k_x, "k_z": TABLE_2.k_z, "a_e": TABLE_2.a_e}
FACTOR, MASS, STIFFNESS = 1.2, 0.15, 4.0
"""Factor of the gains after a jump, displacement of the mass [m], and its effect on a_e [1/s^2/m]."""

PARAMETERS: dict[str, dict[str, Any]] = {
    "plant": {"encoder.enabled": True, "ado.offset_per_metre": 1.2, "ado.stiffness_per_metre": STIFFNESS},
    "controller": {"reference.elevation": 0.25, "travel.enabled": True},
    "exciter": {
        "excitation.experiment": 3, "excitation.base": 0.0, "multisine.period": 20.0, "multisine.lowest": 0.1,
        "multisine.highest": 1.5, "multisine.rms_difference": 0.8, "multisine.rms_sum": 1.6,
    },
}  # fmt: skip
RECORDED = (*(f"identifier.{name}" for name in TRUTH), "exciter.v_front", "exciter.v_rear")


def set_reals(unit: Instance, values: dict[str, float]) -> None:
    """Set inputs that are not wired, or tunable parameters."""
    unit.slave.setReal([unit.variable(name).valueReference for name in values], list(values.values()))


def run_day(case: str) -> Row:
    """Fly a day, hour by hour; return the figures, of each jump the share that is missing after 60 s."""
    truth, memory, eigenvalues, jumps, first = {**TRUTH}, [], [], [], 0
    with instantiate_units(CLOSED_LOOP, {}, native=True) as units:

        def wire_units(excited: bool) -> Wired:
            """Wire the units with or without the exciter; inputs that are not wired keep their last value."""
            unwired = {} if excited else {"excitation_front": 0.0, "excitation_rear": 0.0}
            set_reals(units["controller"], unwired)
            wires = {fed: out for fed, out in CLOSED_LOOP.connections.items() if fed.partition(".")[2] not in unwired}
            return Wired(replace(CLOSED_LOOP, connections=wires), units, STEP, RECORDED)

        def fly(minutes: int) -> NDArray[np.float64]:
            """Take the steps of some minutes; return the estimates after each step."""
            nonlocal first
            loop.play(rows := record[: minutes * MINUTE], first)
            first += len(rows)
            return rows[:, [loop.names.index(name) for name in RECORDED[: len(TRUTH)]]]

        loop = wire_units(True)
        record = np.empty((26 * MINUTE, len(loop.names)))
        loop.start({**PARAMETERS, "identifier": {"adaptation.gain_limit": GAIN_LIMIT, **CASES[case]}}, 1e6)
        for hour in range(HOURS):
            if hour > 0:
                loop = wire_units(True)
                loop.fetch(STEP * first)
            fly(10)
            before = {**truth}
            if hour % 2 == 0:
                truth |= {name: (FACTOR if hour % 4 == 0 else 1.0) * TRUTH[name] for name in ("k_x", "k_z")}
                set_reals(units["plant"], {"pitch.gain": truth["k_x"], "elevation.gain": truth["k_z"]})
            else:
                position = MASS if hour % 4 == 1 else 0.0
                set_reals(units["plant"], {"mass_position": position})
                truth["a_e"] = TRUTH["a_e"] + STIFFNESS * position
            for name, estimate in zip(TRUTH, fly(4).T, strict=True):
                if truth[name] != before[name]:
                    jumps.append(float(abs((estimate[MINUTE] - truth[name]) / (truth[name] - before[name]))))
            fly(26)
            eigenvalues.append(gamma_eigenvalues(units["identifier"]))
            loop = wire_units(False)
            loop.fetch(STEP * first)
            fly(20)
            eigenvalues.append(gamma_eigenvalues(units["identifier"]))
            memory.append(resident_memory())
        lost = abs(first - 1 - identifier_state(units["identifier"]).samples)
    return {"steps": first, "lost": float(lost), "jumps": jumps, "growth": memory[-1] - memory[0],
            "least": float(np.min(eigenvalues)), "largest": float(np.max(eigenvalues))}  # fmt: skip


def gamma_eigenvalues(identifier: Instance) -> NDArray[np.float64]:
    """Return the eigenvalues of the three Gammas."""
    estimates = [axis.estimate for axis in identifier_state(identifier).axes]
    return np.concatenate([np.linalg.eigvalsh(gain_matrix(x.factor, len(x.omega))) for x in estimates])


def identifier_state(unit: Instance) -> IdentifierState:
    """Return the memory of a native AdaptiveIdentifier that has taken at least one sample.

    Its serialised state holds its variables, then its memory: the fields of the identifier's NamedTuples in their
    order, a float as a C double, an int as eight bytes, a list after its length, an optional value after a flag.
    """
    state = unit.slave.getFMUState()
    data = BytesIO(unit.slave.serializeFMUstate(state))
    unit.slave.freeFMUState(state)

    def read(code: str) -> Any:
        return struct.unpack(f"<{code}", data.read(struct.calcsize(f"<{code}")))[0]

    def read_value(kind: Any) -> Any:
        if kind in (float, int, bool):
            return read({float: "d", int: "q", bool: "?"}[kind])
        parts = get_args(kind)
        if types.NoneType in parts:
            return read_value(parts[0]) if read("?") else None
        if parts:
            return tuple(map(read_value, parts[:1] * read("q") if parts[-1] is Ellipsis else parts))
        return kind(*map(read_value, get_type_hints(kind).values()))

    # token, sum, whether it has Model Exchange, phase, failure, whether initialised, two times
    data.seek(data.getvalue().index(b"\0") + 1 + 8 + 1 + 8 + 8 + 1 + 1 + 8 + 8)
    for variable in unit.description.modelVariables:
        data.seek(8 + 1 + 8, SEEK_CUR)
        if variable.type == "String":
            data.seek(read("q"), SEEK_CUR)
    read("?")  # whether it has warned
    sampled: Sampled | None = read_value(Sampled | None)
    if sampled is None or data.read():
        raise ValueError("the state is not read to its end")
    return sampled.state


def soak() -> str:
    """Fly all cases, each in a separate process."""
    days = {case: call_in_process(run_day, case) for case in CASES}
    frame = pandas.DataFrame(days.values())
    bars = [
        Bar("least eigenvalue of Gamma", frame.least.min(), least=0.0),
        Bar("largest eigenvalue of Gamma", frame.largest.max(), 1.01 * GAIN_LIMIT),
        Bar("samples lost or taken twice", frame.lost.max(), 0.0),
        Bar("growth of memory, first hour to last", frame.growth.max(), 5.0, "MB"),
        Bar("of a jump missing after 60 s, worst", float(frame.jumps.explode().max()), 0.25),
    ]
    rows = [
        (case, f"{day['steps']:,}", f"{day['least']:.2g} to {day['largest']:.5g}", f"{day['growth']:.1f}",
         len(day["jumps"]), f"{100.0 * max(day['jumps']):.0f} %")
        for case, day in days.items()
    ]  # fmt: skip
    return section(
        "A day in closed loop",
        bar_table(bars),
        table(("method", "steps", "eigenvalues of Gamma", "memory [MB]", "jumps", "missing after 60 s, worst"), rows),
        "Four native units at 100 Hz, encoders on, excited for 40 minutes of each hour. In the tenth minute the plant "
        "jumps: its thrust by a fifth, or the mass by .15 m. Gamma is that before and after each stretch without "
        "excitation.",
        packages=("fmpy", "numba"),
    )
