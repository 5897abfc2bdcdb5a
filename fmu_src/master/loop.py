"""The master's loop: set all inputs, step all units, get all outputs, at t_k = k H.

All inputs of all units lie in one array, all outputs in another, and the wiring table becomes one array of indices. A
communication step therefore copies all connections at once and plays a tape of at most three calls per unit
(:mod:`.tape`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from time import monotonic, perf_counter, sleep

import numpy as np
from numpy.typing import NDArray

from heli_identifier.files import draft_folder

from ..builder import build, scenario_fmus
from ..native import build_native
from ..variables import Value
from ..wiring import Scenario, scenario, whole_steps
from .instance import Instance
from .layout import Layout, laid_out
from .result import Result
from .tape import Clock, Tape
from .unit_log import UnitLog

STRIDE = 1000
"""Steps after which a run says that it is alive."""

LONGEST_SLEEP = 1.0
"""Time after which a run in real time that waits for its next step says that it is alive [s]."""

WORTH_COMPILING = 100_000
"""Steps from which on loading the compiled loop (.5 s) takes less time than it saves (5 us a step of four units)."""


def run(
    scenario_name: str | Scenario,
    duration: float,
    step: float = 0.01,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    progress: bool = False,
    record: Collection[str] | None = None,
    native: bool = False,
    alive: Callable[[], None] = lambda: None,
) -> Result:
    """Run a scenario in this process.

    Parameters
    ----------
    scenario_name : str or Scenario
        A key of :data:`fmu_src.SCENARIOS`, or a scenario of your own.
    duration : float
        Length of the run, which starts at t = 0 [s]; a whole number of steps.
    step : float
        Communication step H [s].
    parameters : mapping, optional
        By unit and parameter (``plant.effects.dry_friction.pitch``); they prevail over those of the scenario.
    fmus : mapping, optional
        FMU file by unit name (``plant``); the other units are built from this project.
    progress : bool
        Show a progress bar.
    record : collection of str, optional
        Outputs to record (``identifier.a_wx``); outputs that feed an input are recorded as well. All by default.
    native : bool
        Build units in C in place of units in Python; runs of 100 000 steps and more take them in a compiled loop.
    alive : callable
        Called whenever the units have answered: at least once in :data:`STRIDE` steps, in the compiled loop once in
        :data:`WORTH_COMPILING`.

    Returns
    -------
    Result
        N = duration/step + 1 rows.

    Raises
    ------
    WiringError, MasterError, BuildError
        An unknown name, a value that a unit refuses, a status worse than a warning: with unit, call and time.
    """
    wiring = scenario(scenario_name)
    steps = whole_steps(duration, step)
    per_unit = wiring.parameters_by_unit(parameters or {})
    alarm: list[UnitLog] = []
    with instances(wiring, fmus or {}, alarm, alive, build_native if native else build) as units:
        layout = laid_out(wiring, {name: unit.outputs for name, unit in units.items()}, record)
        for name, unit in units.items():
            alive()
            unit.initialise(per_unit[name], 0.0, steps * step)
        wired = Wired(units, layout, step, alarm, alive)
        values = np.empty((steps + 1, len(layout.names)))
        values[0] = wired.start()
        began = perf_counter()
        if steps >= WORTH_COMPILING and all(unit.is_native for unit in units.values()):
            take = wired.compiled()
            began = perf_counter()
            for first in range(0, steps, WORTH_COMPILING):
                alive()
                take(values[first + 1 : first + 1 + WORTH_COMPILING], step, first)
        else:
            counted = _counted(steps, progress, wiring.title)
            wired.play(values[1:], _paced(counted, step, alive) if wiring.in_real_time else counted)
        seconds = perf_counter() - began
        time = np.arange(steps + 1, dtype=np.float64) * step
        return Result(layout.names, wired.physical_units(), time, values, seconds)


@contextmanager
def instances(
    wiring: Scenario,
    fmus: Mapping[str, str | Path],
    alarm: list[UnitLog],
    alive: Callable[[], None],
    builder: Callable[[str, str | Path], Path],
) -> Iterator[dict[str, Instance]]:
    """Instantiate every unit of a scenario; free them all at the end."""
    units: dict[str, Instance] = {}
    with draft_folder() as folder, ExitStack() as loaded:
        for name, file in scenario_fmus(wiring, fmus, folder, builder).items():
            alive()
            units[name] = Instance(name, file, folder / f"{name}.unpacked", alarm)
            loaded.callback(units[name].close)
        yield units


class Wired:
    """The units of a scenario with their inputs and outputs in two arrays.

    Parameters
    ----------
    units : dict
        Instances by name.
    layout : Layout
        Places in the arrays.
    step : float
        Communication step [s].
    alarm : list of UnitLog
        Shared by the instances.
    alive : callable
        Called whenever the units have answered.
    """

    def __init__(
        self,
        units: dict[str, Instance],
        layout: Layout,
        step: float,
        alarm: list[UnitLog],
        alive: Callable[[], None],
    ) -> None:
        self.units, self.layout, self.step, self.alarm, self.alive = units, layout, step, alarm, alive
        self.clock = Clock(step)
        self.shown, self.fed = np.zeros(len(layout.names)), np.zeros(len(layout.sources))
        first_in = first_out = 0
        for name, unit in units.items():
            inputs, outputs = layout.inputs[name], layout.outputs[name]
            beyond_in, beyond_out = first_in + len(inputs), first_out + len(outputs)
            unit.bind(inputs, outputs, self.fed[first_in:beyond_in], self.shown[first_out:beyond_out], self.clock)
            first_in, first_out = beyond_in, beyond_out
        self._copy_connections = partial(self.shown.take, layout.sources, None, self.fed, "clip")

    def start(self) -> NDArray[np.float64]:
        """Finish the initialisation of the units; return the outputs at t = 0."""
        everyone = list(self.units.values())
        Tape((call for unit in everyone for call in unit.fetches), self.clock, self.alarm).play(0.0)
        self._copy_connections()
        for unit in everyone:
            self.alive()
            Tape(unit.puts, self.clock, self.alarm).play(0.0)
            unit.finish_initialisation(0.0)
            Tape(unit.fetches, self.clock, self.alarm).play(0.0)
        return self.shown

    def play(self, values: NDArray[np.float64], counted: Iterator[int]) -> None:
        """Take a step for each number of ``counted``; row k of ``values`` receives the outputs behind step k."""
        everyone = self.units.values()
        calls = (call for unit in everyone for call in (*unit.puts, *unit.steps, *unit.fetches))
        tape = Tape(calls, self.clock, self.alarm)
        for k in counted:
            if k % STRIDE == 0:
                self.alive()
            self._copy_connections()
            tape.play(k * self.step)
            values[k] = self.shown

    def compiled(self) -> Callable[[NDArray[np.float64], float, int], None]:
        """Return the loop in machine code, for native units (:mod:`.compiled_loop`)."""
        from .compiled_loop import compiled_loop  # late: numba takes .5 s to import

        return compiled_loop(self.units, self.layout, self.fed, self.shown)

    def reset(self) -> None:
        """Set all units back to where they were when they were instantiated."""
        self.alarm.clear()
        for unit in self.units.values():
            unit.reset()

    def physical_units(self) -> tuple[str, ...]:
        """Return the physical unit of every output that is read."""
        return tuple(
            unit.variable(output).unit or "1"
            for name, unit in self.units.items()
            for output in self.layout.outputs[name]
        )


def _paced(counted: Iterator[int], step: float, alive: Callable[[], None]) -> Iterator[int]:
    """Give each number ``k`` of ``counted`` at the time k ``step`` [s] after the first one, or late."""
    began = monotonic()
    for k in counted:
        while (ahead := began + k * step - monotonic()) > 0.0:
            alive()
            sleep(min(ahead, LONGEST_SLEEP))
        yield k


def _counted(steps: int, progress: bool, title: str) -> Iterator[int]:
    """Count the steps, with a progress bar on the error stream if ``progress``; it moves a hundred times at most."""
    if not progress:
        yield from range(steps)
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task(title, total=steps)
        stride = max(steps // 100, 1)
        for k in range(steps):
            yield k
            if (k + 1) % stride == 0 or k + 1 == steps:
                bar.update(task, completed=k + 1)
