"""The master's loop: set all inputs, step all units, get all outputs, at t_k = k H; once, or many times.

All inputs of all units lie in one array, all outputs in another, and the wiring table becomes one array of indices. A
communication step therefore copies all connections at once and makes at most three prepared calls per unit.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from ctypes import c_double
from functools import partial
from pathlib import Path
from time import monotonic, perf_counter, sleep

import numpy as np
from numpy.typing import NDArray

from heli_identifier.files import draft_folder
from heli_plant.errors import did_you_mean

from ..builder import build, scenario_fmus
from ..errors import MasterError, WiringError
from ..native import build_native
from ..variables import Value
from ..wiring import Scenario, scenario, whole_steps
from .instance import WARNING, Call, Instance, Place, alive
from .result import Bands, Result

STRIDE = 1000
"""Steps after which a run says that it is alive."""

LONGEST_SLEEP = 1.0
"""Time after which a run in real time that waits for its next step says that it is alive [s]."""

WORTH_COMPILING = 100_000
"""Steps from which on loading the compiled loop (.5 s) takes less time than it saves (5 us a step of four units)."""

SHARE = 0.95
"""Share of many runs inside of a band."""

MOST_NUMBERS = 5e7
"""Numbers that are kept of many runs (400 MB); of longer ones every n-th instant is kept."""


def run(
    scenario_name: str | Scenario,
    duration: float,
    step: float = 0.01,
    parameters: Mapping[str, Value] | None = None,
    fmus: Mapping[str, str | Path] | None = None,
    progress: bool = False,
    record: Collection[str] | None = None,
    native: bool = False,
    variations: Sequence[Mapping[str, Value]] = (),
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
    variations : sequence of mapping
        Parameters of further runs, on top of ``parameters``. Their units have to be native; they are loaded once and
        reset before every run. Of these runs bands are kept; one that a unit refuses is counted, and its reason kept.

    Returns
    -------
    Result
        N = duration/step + 1 rows.

    Raises
    ------
    WiringError, MasterError, BuildError
        An unknown name, a value that a unit refuses, a status worse than a warning: with unit, call and time; every
        varied run is refused.
    """
    wiring = scenario(scenario_name)
    steps, parameters = whole_steps(duration, step), parameters or {}
    given = wiring.parameters_by_unit(parameters)
    with instances(wiring, fmus or {}, build_native if native or variations else build) as units:
        in_python = [name for name, unit in units.items() if not unit.is_native]
        if variations and in_python:
            raise MasterError(f"many runs need native units; {in_python[0]} is none, build it with --native")
        wired = Wired(wiring, units, step, record)
        values = np.empty((steps + 1, len(wired.names)))
        compiled = not in_python and (variations or steps >= WORTH_COMPILING)
        take = wired.compiled() if compiled else None

        def fly(given: Mapping[str, Mapping[str, Value]]) -> float:
            """Fill ``values``; return the time that the steps take [s]."""
            values[0] = wired.start(given, steps * step)
            began = perf_counter()
            if take is not None:
                for first in range(0, steps, WORTH_COMPILING):
                    alive()
                    take(values[first + 1 : first + 1 + WORTH_COMPILING], first)
            else:
                counted = _counted(steps, progress, wiring.title)
                wired.play(values[1:], _paced(counted, step) if wiring.in_real_time else counted)
            return perf_counter() - began

        seconds = fly(given)
        time, nominal, bands = np.arange(steps + 1, dtype=np.float64) * step, values, None
        if variations:
            stride = max(1, int(np.ceil((len(variations) + 1) * values.size / MOST_NUMBERS)))
            time, nominal = time[::stride], values[::stride].copy()
            kept, refused = np.empty((len(variations), *nominal.shape)), list[str]()
            for number, variation in enumerate(variations):
                wired.reset()
                try:
                    seconds += fly(wiring.parameters_by_unit({**parameters, **variation}))
                    kept[number - len(refused)] = values[::stride]
                except MasterError as problem:
                    refused.append(str(problem))
            bands = _bands(kept[: len(variations) - len(refused)], tuple(refused))
    return Result(wired.names, wired.physical_units, time, nominal, seconds, bands)


def _bands(kept: NDArray[np.float64], refused: tuple[str, ...]) -> Bands:
    """Return where :data:`SHARE` of the runs lie, shape (runs, N, M); they are sorted in place."""
    if len(kept) == 0:
        raise MasterError(f"every one of {len(refused)} varied runs was refused; the first: {refused[0]}")
    low, high = np.quantile(kept, (0.5 * (1.0 - SHARE), 0.5 * (1.0 + SHARE)), axis=0, overwrite_input=True)
    return Bands(low, high, len(kept), refused)


@contextmanager
def instances(
    wiring: Scenario, fmus: Mapping[str, str | Path], builder: Callable[[str, str | Path], Path]
) -> Iterator[dict[str, Instance]]:
    """Instantiate every unit of a scenario; free them all at the end."""
    units: dict[str, Instance] = {}
    with draft_folder() as folder, ExitStack() as loaded:
        for name, file in scenario_fmus(wiring, fmus, folder, builder).items():
            units[name] = Instance(name, file, folder / f"{name}.unpacked")
            loaded.callback(units[name].close)
        yield units


class Wired:
    """The units of a scenario, by name, with their inputs and outputs in two arrays; ``step`` [s] is that of the run.

    ``names`` and ``physical_units`` are those of every output that is read, as ``unit.variable``: of ``record``, all by
    default, and of those that feed an input. ``shown`` has their values, ``fed`` those of all connected inputs, and
    ``sources`` for each input the place of the output that feeds it. A name that is no output of its unit raises
    WiringError, one that is fed and no input MasterError.
    """

    def __init__(
        self, wiring: Scenario, units: dict[str, Instance], step: float, record: Collection[str] | None = None
    ) -> None:
        self.units, self.step = units, step
        every = [f"{name}.{output}" for name, unit in units.items() for output in unit.outputs]
        feeding = {f"{wire.source_unit}.{wire.source}" for wire in wiring.connections}
        for name in (*sorted(feeding), *(record or ())):
            if name not in every:
                raise WiringError(f"scenario {wiring.name} has no output {name!r}{did_you_mean(name, every)}")
        wanted = set(every) if record is None else {*record, *feeding}
        self.names = tuple(name for name in every if name in wanted)
        inputs = {name: [wire for wire in wiring.connections if wire.target_unit == name] for name in units}
        place = {name: k for k, name in enumerate(self.names)}
        sources = [place[f"{wire.source_unit}.{wire.source}"] for own in inputs.values() for wire in own]
        self.sources = np.array(sources, dtype=np.intp)
        self.shown, self.fed = np.zeros(len(self.names)), np.zeros(len(sources))
        self.places: list[Place] = []
        physical, first_in, first_out = [], 0, 0
        for name, unit in units.items():
            put = [unit.variable(wire.target, "input").name for wire in inputs[name]]
            get = [output for output in unit.outputs if f"{name}.{output}" in place]
            physical += [unit.variable(output).unit or "1" for output in get]
            fed = (c_double * len(put)).from_buffer(self.fed.data, first_in * self.fed.itemsize)
            shown = (c_double * len(get)).from_buffer(self.shown.data, first_out * self.shown.itemsize)
            self.places.append(Place(unit, unit.references(put), fed, unit.references(get), shown))
            first_in, first_out = first_in + len(put), first_out + len(get)
        self.physical_units = tuple(physical)
        self._time, self._step = c_double(0.0), c_double(step)
        self._copy_connections = partial(self.shown.take, self.sources, None, self.fed, "clip")
        self._puts = [place.unit.transfer("setReal", place.inputs, place.fed) for place in self.places]
        self._gets = [place.unit.transfer("getReal", place.outputs, place.shown) for place in self.places]

    def start(self, given: Mapping[str, Mapping[str, Value]], stop: float) -> NDArray[np.float64]:
        """Initialise all units with the parameters of each at t = 0; return the outputs then."""
        for name, unit in self.units.items():
            unit.initialise(given[name], 0.0, stop)
        self.fetch(0.0)
        self._copy_connections()
        for unit, put, get in zip(self.units.values(), self._puts, self._gets, strict=True):
            self._make(0.0, put)
            unit.finish_initialisation(0.0)
            self._make(0.0, get)
        return self.shown

    def fetch(self, time: float) -> None:
        """Get the outputs of all units at ``time`` [s]."""
        self._make(time, [call for get in self._gets for call in get])

    def _make(self, time: float, calls: Iterable[Call]) -> None:
        """Make prepared calls at ``time`` [s]; an answer worse than a warning, or a refusal in a log, is an error."""
        self._time.value = time
        for run, unit, name in calls:
            if (status := run()) > WARNING or unit.worst > WARNING:
                unit.check(name, time, status)

    def play(self, values: NDArray[np.float64], counted: Iterable[int]) -> None:
        """Take a step for each number of ``counted``; row k of ``values`` receives the outputs behind step k."""
        calls: list[Call] = []
        for unit, put, get in zip(self.units.values(), self._puts, self._gets, strict=True):
            calls += [*put, unit.do_step(self._time, self._step), *get]
        for k in counted:
            if k % STRIDE == 0:
                alive()
            self._copy_connections()
            self._make(k * self.step, calls)
            values[k] = self.shown

    def compiled(self) -> Callable[[NDArray[np.float64], int], None]:
        """Return the loop in machine code, for native units (:mod:`.compiled_loop`)."""
        from .compiled_loop import compiled_loop  # late: numba takes .5 s to import

        return compiled_loop(self.places, self.sources, self.fed, self.shown, self.step)

    def reset(self) -> None:
        """Set all units back to where they were when they were instantiated."""
        for unit in self.units.values():
            unit.reset()


def _paced(counted: Iterable[int], step: float) -> Iterator[int]:
    """Give each number ``k`` of ``counted`` at the time k ``step`` [s] after the first one, or late."""
    began = monotonic()
    for k in counted:
        while (ahead := began + k * step - monotonic()) > 0.0:
            alive()
            sleep(min(ahead, LONGEST_SLEEP))
        yield k


def _counted(steps: int, progress: bool, title: str) -> Iterable[int]:
    """Count the steps, with a progress bar on the error stream if ``progress``."""
    if not progress:
        return range(steps)
    from rich.console import Console
    from rich.progress import track

    return track(range(steps), title, console=Console(stderr=True))
