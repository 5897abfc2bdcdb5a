"""The paper's experiments on the units, under the master: twelve runs of each.

Exciter -> HelicopterPlant -> AdaptiveIdentifier, on the plant of Table 2 with encoders on and no disturbance. The
pitch experiment drives v_f - v_r alone, and two identifiers receive the same voltages and encoder angles: one knows
theta0, the other estimates it. The joint experiment drives sum and difference at once, which elevation and travel need
(at rest in pitch a_lt is invisible and travel hardly driven), on a base voltage that keeps the arm turning.

Each of the twelve runs has its own pair of Omega(0) and Gamma(0), as in the paper, and its own start state, drawn
around the rest of the rig: no two runs of a real rig begin alike.
"""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.workbench.paper.published import TRUTH
from heli_plant.parameters import TABLE_2
from heli_plant.state import rest_state

if TYPE_CHECKING:
    from fmu_src import Scenario, Value

STEP = 0.01
"""Control and communication period [s]."""

_DENSE = 30.0
"""Time until which a run keeps ten times as many rows [s]."""

Progress = Callable[[int, int, str], None]
"""Called with the number done, the number in all, and what is counted."""

KNOWN, FREE = "known", "estimated"
"""Whether an identifier knows theta0 or estimates it; its unit has this name."""

INITIAL_ESTIMATES: dict[str, ModelParameters] = {
    "nothing": ModelParameters(),
    "low guess": ModelParameters(0.03, 0.3, 0.15, 0.0, 0.02, 1.5, 0.0, 0.0, 0.1, 0.05, -0.05),
    "high guess": ModelParameters(0.1, 1.0, 0.5, -0.2, 0.1, 4.0, -0.3, 0.1, 0.3, 0.2, -0.2),
}
"""Omega(0): zero, and about half and one and a half times the values of such a rig."""

INITIAL_GAINS = (1e3, 1e4, 1e5, 1e6)
"""Gamma(0) in units of I, from the paper's 1e3 up."""

_SCATTER = 0.1
"""Half width of the start states' scatter [rad, rad/s]."""


@dataclass(frozen=True)
class Start:
    """Start of one run.

    Attributes
    ----------
    number : int
        1 to 12.
    omega : str
        Key of :data:`INITIAL_ESTIMATES`.
    gain : float
        Gamma(0) / I.
    angles, rates : tuple of float
        Pitch, elevation, travel [rad] and their rates [rad/s], as they differ from the rig at rest.
    """

    number: int
    omega: str
    gain: float
    angles: tuple[float, float, float]
    rates: tuple[float, float, float]


@dataclass(frozen=True)
class Kind:
    """One kind of experiment.

    ``channel`` of the Exciter (0 both, 1 difference), ``base`` voltage [V], ``duration`` [s], and its ``identifiers``:
    :data:`KNOWN`, :data:`FREE` or both.
    """

    name: str
    channel: int
    base: float
    duration: float
    identifiers: tuple[str, ...]


PITCH_RUN = Kind("pitch", 1, 0.5, 200.0, (KNOWN, FREE))
JOINT_RUN = Kind("elevation and travel", 0, 2.0, 400.0, (FREE,))


@dataclass(frozen=True, eq=False)
class Run:
    """One run and its estimates: a row every tenth of a second at first, every second later, and one at the end.

    Attributes
    ----------
    kind : Kind
    experiment : int
        1 or 2.
    start : Start
    time : ndarray, shape (M,)
        [s].
    estimates : dict of ndarray, shape (M, 11)
        By :data:`KNOWN` and :data:`FREE`; columns are those of ModelParameters.
    sigma : ndarray, shape (M,)
        Adaptation error of the pitch [rad/s^2], of the first identifier.
    """

    kind: Kind
    experiment: int
    start: Start
    time: NDArray[np.float64]
    estimates: dict[str, NDArray[np.float64]]
    sigma: NDArray[np.float64]

    def final(self, rest_angle: str) -> ModelParameters:
        """Return the last estimate of the identifier :data:`KNOWN` or :data:`FREE`."""
        return ModelParameters(*self.estimates[rest_angle][-1].tolist())


def twelve_starts(experiment: int) -> tuple[Start, ...]:
    """Return the starts of the runs of ``experiment`` 1 or 2; the same on every machine."""
    random = np.random.default_rng(experiment)
    starts = []
    for number, (omega, gain) in enumerate(product(INITIAL_ESTIMATES, INITIAL_GAINS), start=1):
        drawn = random.uniform(-_SCATTER, _SCATTER, 6).tolist()
        starts.append(Start(number, omega, gain, tuple(drawn[:3]), tuple(drawn[3:])))
    return tuple(starts)


def _scenario(kind: Kind) -> "Scenario":
    """Return the open-loop identification with the identifiers of ``kind`` side by side."""
    from fmu_src import OPEN_LOOP, Connection, Scenario

    shared = [wire for wire in OPEN_LOOP.connections if wire.target_unit != "identifier"]
    heard = [wire for wire in OPEN_LOOP.connections if wire.target_unit == "identifier"]
    units = [(name, unit) for name, unit in OPEN_LOOP.units if name != "identifier"]
    for name in kind.identifiers:
        units.append((name, "AdaptiveIdentifier"))
        shared += [Connection(wire.source_unit, wire.source, name, wire.target) for wire in heard]
    return Scenario("paper", f"the paper's experiments: {kind.name}", tuple(units), tuple(shared))


def order_of(kind: Kind, experiment: int, start: Start) -> dict[str, "Value"]:
    """Return the parameters of the units for one run."""
    order: dict[str, Value] = {
        "exciter.excitation.experiment": experiment,
        "exciter.excitation.channel": kind.channel,
        "exciter.excitation.base": kind.base,
        "plant.encoder.enabled": True,
        "plant.initial.v_front": kind.base,
        "plant.initial.v_rear": kind.base,
    }
    rest = rest_state(TABLE_2, 2.0 * kind.base)
    for axis, angle, rate in zip(("pitch", "elevation", "travel"), start.angles, start.rates, strict=True):
        order[f"plant.initial.{axis}"] = getattr(rest, axis) + angle
        order[f"plant.initial.{axis}_rate"] = rate
    for unit in kind.identifiers:
        order[f"{unit}.pitch.rest_angle_known"] = unit == KNOWN
        order[f"{unit}.pitch.rest_angle"] = TRUTH.theta0
        order[f"{unit}.adaptation.initial_gain"] = start.gain
        order[f"{unit}.adaptation.gain_limit"] = start.gain
        for name, value in INITIAL_ESTIMATES[start.omega]._asdict().items():
            order[f"{unit}.initial.{name}"] = value
    return order


def run_once(kind: Kind, experiment: int, start: Start, fmus: dict[str, Path]) -> Run:
    """Run one experiment on built units, given by unit class, in a process of its own.

    Raises
    ------
    fmu_src.FmuError
        A unit could not be built or stepped.
    """
    from fmu_src.master import run_apart

    scenario = _scenario(kind)
    columns = {unit: [f"{unit}.{name}" for name in ModelParameters._fields] for unit in kind.identifiers}
    error = f"{kind.identifiers[0]}.sigma.pitch"
    result = run_apart(
        scenario,
        kind.duration,
        STEP,
        order_of(kind, experiment, start),
        {name: fmus[unit] for name, unit in scenario.units},
        record=[*(name for names in columns.values() for name in names), error],
    )
    rows = _kept_rows(len(result.time))
    estimates = {unit: result.columns(*names)[rows] for unit, names in columns.items()}
    return Run(kind, experiment, start, result.time[rows], estimates, result.column(error)[rows])


def _kept_rows(count: int) -> NDArray[np.int64]:
    """Return the rows of ``count`` that a run keeps: the estimates move most soon after the adaptation begins, 10 s."""
    late = min(round(_DENSE / STEP), count - 1)
    return np.concatenate(
        [np.arange(0, late, round(0.1 / STEP)), np.arange(late, count - 1, round(1.0 / STEP)), [count - 1]]
    )


def run_all(
    jobs: Iterable[tuple[Kind, int, Start]], fmus: dict[str, Path], progress: Progress | None = None
) -> list[Run]:
    """Run all jobs, one process per core at a time; the results are in the order of the jobs.

    Raises
    ------
    fmu_src.FmuError
        Of the first run that fails; the remaining runs are cancelled.
    """
    listed = list(jobs)
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        futures = [pool.submit(run_once, *job, fmus) for job in listed]
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                future.result()
                if progress is not None:
                    progress(done, len(listed), "runs of the units")
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [future.result() for future in futures]
