"""The master's loop: set all inputs, step all units, get all outputs, at t_k = k H; once, or many times.

All inputs of all units lie in one array, all outputs in another, and the wiring table is one array of indices: a step
copies all connections at once and makes three calls a unit. A call through ctypes takes about 2 us, a step of a
native unit less than one. Therefore native units bring the same loop in C (``native/c/fmi2.c``), which calls the
functions of all of them by their addresses.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from ctypes import c_double, c_int64, c_size_t, c_void_p
from pathlib import Path
from time import perf_counter, sleep

import numpy as np

from heli_identifier.files import draft_folder
from heli_plant.errors import did_you_mean

from ..errors import MasterError, WiringError
from ..variables import Value
from ..wiring import Scenario, scenario, whole_steps
from .instance import Array, Instance, alive
from .result import Bands, Result

STRIDE = 1000  # steps after which a run says that it is alive
LONGEST_SLEEP = 1.0  # time after which a run in real time that waits for its next step says that it is alive [s]
SHARE = 0.95  # share of many runs inside of a band
_LOOP_TYPES = 2 * (c_void_p, c_size_t) + (c_void_p, c_void_p, c_size_t, c_void_p, c_int64, c_int64, c_double, c_void_p)
MOST_NUMBERS = 5e7  # numbers that are kept of many runs (400 MB); of longer ones every n-th instant is kept


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
    inputs: Mapping[str, Array] | None = None,
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
        Build units in C in place of units in Python.
    variations : sequence of mapping
        Parameters of further runs, on top of ``parameters``. Their units have to be native; they are loaded once and
        reset before every run. Of these runs bands are kept; one that a unit refuses is counted, and its reason kept.
    inputs : mapping, optional
        What inputs get that no output feeds (``plant.v_front``): the values of all steps.

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
    with instantiate_units(wiring, fmus or {}, native or bool(variations)) as units:
        in_python = [name for name, unit in units.items() if unit.play is None]
        if variations and in_python:
            raise MasterError(f"many runs need native units; {in_python[0]} is none, build it with --native")
        wired = Wired(wiring, units, step, record, inputs or {})
        values = np.empty((steps + 1, len(wired.names)))

        def fly(given: Mapping[str, Mapping[str, Value]]) -> float:
            """Fill ``values``; return the time that the steps take [s]."""
            values[0] = wired.start(given, steps * step)
            began, stride = perf_counter(), 1 if wiring.in_real_time else STRIDE
            for first in _count_steps(range(0, steps, stride), progress, wiring.title):
                if wiring.in_real_time:
                    _wait_until(began + first * step)
                alive()
                wired.play(values[first + 1 : first + 1 + stride], first)
            return perf_counter() - began

        seconds = fly(given)
        time, nominal, bands = np.arange(steps + 1, dtype=np.float64) * step, values, None
        if variations:
            stride = max(1, int(np.ceil((len(variations) + 1) * values.size / MOST_NUMBERS)))
            time, nominal = time[::stride], values[::stride].copy()
            kept, refused = np.empty((len(variations), *nominal.shape)), list[str]()
            for number, variation in enumerate(variations):
                for unit in units.values():
                    unit.reset()
                try:
                    seconds += fly(wiring.parameters_by_unit({**parameters, **variation}))
                    kept[number - len(refused)] = values[::stride]
                except MasterError as problem:
                    refused.append(str(problem))
            bands = _run_bands(kept[: len(variations) - len(refused)], tuple(refused))
    return Result(wired.names, wired.physical_units, time, nominal, seconds, bands)


def _run_bands(kept: Array, refused: tuple[str, ...]) -> Bands:
    """Return where :data:`SHARE` of the runs lie, shape (runs, N, M); they are sorted in place."""
    if len(kept) == 0:
        raise MasterError(f"every one of {len(refused)} varied runs was refused; the first: {refused[0]}")
    low, high = np.quantile(kept, (0.5 * (1.0 - SHARE), 0.5 * (1.0 + SHARE)), axis=0, overwrite_input=True)
    return Bands(low, high, len(kept), refused)


@contextmanager
def instantiate_units(wiring: Scenario, fmus: Mapping[str, str | Path], native: bool) -> Iterator[dict[str, Instance]]:
    """Instantiate every unit of a scenario; free them all at the end."""
    units = dict[str, Instance]()
    with draft_folder() as folder, ExitStack() as loaded:
        for name, file in wiring.unit_files(fmus, folder, native).items():
            units[name] = Instance(name, file, folder / f"{name}.unpacked")
            loaded.callback(units[name].close)
        yield units


class Wired:
    """The units of a scenario, by name, with their inputs and outputs in two arrays; ``step`` [s] is that of the run.

    ``names`` and ``physical_units`` are those of every output that is read, as ``unit.variable``: of ``record``, all by
    default, and of those that feed an input. ``shown`` has their values, ``told`` what ``inputs`` have for the step,
    ``fed`` the values of all connected inputs, and ``sources`` for each of these the place in ``shown`` and ``told`` of
    what feeds it. A name that is no output of its unit raises WiringError, one that is fed and no input MasterError.
    """

    def __init__(
        self, wiring: Scenario, units: dict[str, Instance], step: float, record: Collection[str] | None = None,
        inputs: Mapping[str, Array] = {},
    ) -> None:  # fmt: skip
        self.units, self.step, self.inputs = units, step, np.array([*inputs.values()], dtype=np.float64).T
        every = {f"{name}.{output.name}": output for name, unit in units.items() for output in unit.outputs}
        wires = {f"{own.target_unit}.{own.target}": f"{own.source_unit}.{own.source}" for own in wiring.connections}
        feeding = set(wires.values())
        for name in (*sorted(feeding), *(record or ())):
            if name not in every:
                raise WiringError(f"scenario {wiring.name} has no output {name!r}{did_you_mean(name, every)}")
        wanted = every.keys() if record is None else {*record, *feeding}
        self.names = tuple(name for name in every if name in wanted)
        self.physical_units = tuple(every[name].unit or "1" for name in self.names)
        place = {name: k for k, name in enumerate((*self.names, *inputs))}
        wires |= {name: name for name in inputs}
        targets = [[full for full in wires if full.partition(".")[0] == name] for name in units]
        read = [[full for full in self.names if full.partition(".")[0] == name] for name in units]
        self.sources = np.array([place[wires[full]] for own in targets for full in own], dtype=np.intp)
        self.values, self.fed = np.zeros(len(place)), np.zeros(len(self.sources))
        self.shown, self.told = np.split(self.values, [len(self.names)])
        fed, shown = (np.split(x, np.cumsum([*map(len, own)])) for x, own in ((self.fed, targets), (self.shown, read)))
        for k, unit in enumerate(units.values()):
            unit.connect(targets[k], fed[k], read[k], shown[k])
        loops = [unit.play for unit in units.values()]
        self._loop = loops[0] if all(loops) and not inputs else None
        self._rows = np.array([unit.row for unit in units.values()], dtype=np.uintp)

    def start(self, given: Mapping[str, Mapping[str, Value]], stop: float) -> Array:
        """Initialise all units with the parameters of each at t = 0; return the outputs then."""
        for name, unit in self.units.items():
            unit.initialise(given[name], 0.0, stop)
        self.fetch(0.0)
        self._feed(0)
        for unit in self.units.values():
            unit.put_inputs(0.0)
            unit.finish_initialisation(0.0)
            unit.get_outputs(0.0)
        return self.shown

    def fetch(self, time: float) -> None:
        """Get the outputs of all units at ``time`` [s]."""
        for unit in self.units.values():
            unit.get_outputs(time)

    def _feed(self, k: int) -> None:
        """Let the connected inputs have what feeds them in step ``k``."""
        if len(self.told):
            self.told[:] = self.inputs[k]
        self.values.take(self.sources, out=self.fed, mode="clip")

    def play(self, record: Array, first: int) -> None:
        """Take a step for each row of ``record``, from t = ``first`` H on; row k gets the outputs behind its step."""
        if self._loop is not None:
            refusal = np.full(3, -1, dtype=np.int64)
            self._loop.argtypes = _LOOP_TYPES
            status = self._loop(
                self._rows.ctypes.data, len(self._rows), self.sources.ctypes.data, len(self.fed), self.fed.ctypes.data,
                self.shown.ctypes.data, len(self.shown), record.ctypes.data, first, len(record), self.step,
                refusal.ctypes.data,
            )  # fmt: skip
            k, u, call = refusal.tolist()
            if k >= 0:
                list(self.units.values())[u].check(("setReal", "doStep", "getReal")[call], k * self.step, status)
            return
        for k, row in enumerate(record, first):
            self._feed(k)
            for unit in self.units.values():
                unit.put_inputs(k * self.step)
                unit.advance(k * self.step, self.step)
                unit.get_outputs(k * self.step)
            row[:] = self.shown


def _wait_until(due: float) -> None:
    """Wait until :func:`perf_counter` shows this time [s], if it has not passed."""
    while (ahead := due - perf_counter()) > 0.0:
        alive()
        sleep(min(ahead, LONGEST_SLEEP))


def _count_steps(steps: range, progress: bool, title: str) -> Iterable[int]:
    """Give each number of ``steps``, with a progress bar on the error stream if ``progress``."""
    if not progress:
        return steps
    from rich.console import Console
    from rich.progress import track

    return track(steps, title, console=Console(stderr=True))
