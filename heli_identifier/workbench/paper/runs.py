"""The paper's experiments on the units, under the master.

Exciter -> HelicopterPlant -> AdaptiveIdentifier, on the plant of Table 2 with encoders on and no disturbance. The
pitch experiment drives v_f - v_r alone, and two identifiers hear the same voltages and encoder angles: one is told
theta0, the other estimates it. The joint experiment drives sum and difference at once, which elevation and travel
need (at rest in pitch a_lt is invisible and travel hardly driven), on a base voltage that keeps the arm turning.
"""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from heli_identifier.online import ModelParameters
from heli_identifier.workbench.paper.published import TRUTH
from heli_identifier.workbench.paper.starts import INITIAL_ESTIMATES, Start
from heli_plant.parameters import TABLE_2
from heli_plant.state import rest_state

if TYPE_CHECKING:
    from fmu_src import Scenario, Value

STEP = 0.01
"""Control and communication period [s]."""

_LIVELY = 30.0
"""Until then the histories are kept ten times as densely [s]."""

Progress = Callable[[int, int, str], None]
"""Called with what is done, what there is to do, and its name."""

KNOWN, FREE = "known", "estimated"
"""How an identifier takes theta0; its unit bears this name."""


@dataclass(frozen=True)
class Kind:
    """What kind of experiment.

    ``channel`` of the Exciter (0 both, 1 difference), ``base`` voltage [V], ``duration`` [s], and how its
    ``identifiers`` take theta0.
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
    """One run and its estimates, a row every tenth of a second at first, every second later, and one at the end.

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
        """Return the last estimate, theta0 ``known`` or ``estimated``."""
        return ModelParameters(*self.estimates[rest_angle][-1].tolist())


def _scenario(kind: Kind) -> "Scenario":
    """Open-loop identification with the identifiers of ``kind`` beside each other."""
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
    """Run one experiment on built units (``fmus`` by unit class), in a process of its own.

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
    """Rows of ``count`` that a run keeps: most happens soon after the adaptation begins at 10 s."""
    late = min(round(_LIVELY / STEP), count - 1)
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
        Of the first run that fails; the others are not begun.
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
