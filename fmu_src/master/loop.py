"""The master's loop: set all inputs, step all units, get all outputs, at t_k = k H; once, or many times.

All inputs of all units are in one array, all outputs in another, and the wiring table is one array of indices. A step
copies all connections at once and makes three calls per unit. A call through ctypes takes about 2 us, a step of a
native unit less than one. Therefore native units contain the same loop in C (``native/c/fmi2.c``), which calls the
functions of all units by their addresses.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from ctypes import c_double, c_int64, c_size_t, c_void_p
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from heli_identifier import processes
from heli_identifier.files import draft_folder
from heli_plant.errors import did_you_mean

from ..errors import MasterError, WiringError, check_mapping
from ..variables import Value
from ..wiring import Scenario, scenario, whole_steps
from .instance import WARNING, Array, Instance
from .result import Bands, Result

STRIDE = 1000  # steps between two restarts of the watchdog
SHARE = 0.95  # share of many runs inside a band
_LOOP_TYPES = 2 * (c_void_p, c_size_t) + (c_void_p, c_void_p, c_size_t, c_void_p, c_int64, c_int64, c_double, c_void_p)
MOST_NUMBERS = 5e7  # most values stored of many runs (400 MB); of longer runs only every n-th instant is stored


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
        By unit and parameter (``plant.effects.dry_friction.pitch``); they replace those of the scenario.
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
        reset before every run. The result has bands of these runs, and the reasons of refused ones.
    inputs : mapping, optional
        Values of unconnected inputs (``plant.v_front``), one for every step.

    Returns
    -------
    Result
        N = duration/step + 1 rows. WiringError or BuildError names an argument that does not fit, MasterError a unit
        that refuses a call, with call and time.
    """
    wiring = scenario(scenario_name)
    steps, parameters = whole_steps(duration, step), parameters or {}
    by_unit = wiring.parameters_by_unit(parameters)
    check_mapping("inputs", inputs or {})
    for name, given in {"record": record or (), "variations": variations}.items():
        if not isinstance(given, Collection):
            raise WiringError(f"{name} = {given!r} must be a list")
    varied_by_unit = [wiring.parameters_by_unit(parameters, variation) for variation in variations]
    inputs = {target: _as_column(target, values, steps) for target, values in (inputs or {}).items()}
    with instantiate_units(wiring, fmus or {}, native or bool(variations)) as units:
        in_python = [name for name, unit in units.items() if unit.play is None]
        if variations and in_python:
            raise MasterError(f"many runs need native units; {in_python[0]} is none, build it with --native")
        wired = Wired(wiring, units, step, record, inputs)
        values = np.empty((steps + 1, len(wired.names)))

        def run_once(by_unit: Mapping[str, Mapping[str, Value]]) -> float:
            """Fill ``values``; return the wall time of the steps [s]."""
            values[0] = wired.start(by_unit, steps * step)
            start_time, stride = perf_counter(), 1 if wiring.in_real_time else STRIDE
            blocks = range(0, steps, stride)
            for first in track(blocks, wiring.title, console=Console(stderr=True)) if progress else blocks:
                if wiring.in_real_time:
                    sleep(max(0.0, start_time + first * step - perf_counter()))
                processes.restart_watchdog()
                wired.play(values[first + 1 : first + 1 + stride], first)
            return perf_counter() - start_time

        seconds = run_once(by_unit)
        time, nominal, bands = np.arange(steps + 1, dtype=np.float64) * step, values, None
        if variations:
            stride = max(1, int(np.ceil((len(variations) + 1) * values.size / MOST_NUMBERS)))
            time, nominal = time[::stride], values[::stride].copy()
            varied, refused = np.empty((len(variations), *nominal.shape)), list[str]()
            for number, variation in enumerate(varied_by_unit):
                for unit in units.values():
                    unit.reset()
                try:
                    seconds += run_once(variation)
                    varied[number - len(refused)] = values[::stride]
                except MasterError as problem:
                    refused.append(str(problem))
            bands = _run_bands(varied[: len(variations) - len(refused)], tuple(refused))
    return Result(wired.names, wired.physical_units, time, nominal, seconds, bands)


def _as_column(target: str, values: Any, steps: int) -> Array:
    """Return the values of an input as an array, one for each step."""
    try:
        column = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        column = np.empty(0)
    if column.ndim != 1 or len(column) < steps:
        raise WiringError(f"inputs: {target} has {np.size(values)} values, {steps} steps need as many numbers in a row")
    return column[:steps]


def _run_bands(runs: Array, refused: tuple[str, ...]) -> Bands:
    """Return the bands that contain :data:`SHARE` of the runs, shape (runs, N, M), which are sorted in place."""
    if len(runs) == 0:
        raise MasterError(f"every one of {len(refused)} varied runs was refused; the first: {refused[0]}")
    low, high = np.quantile(runs, (0.5 * (1.0 - SHARE), 0.5 * (1.0 + SHARE)), axis=0, overwrite_input=True)
    return Bands(low, high, len(runs), refused)


@contextmanager
def instantiate_units(wiring: Scenario, fmus: Mapping[str, str | Path], native: bool) -> Iterator[dict[str, Instance]]:
    """Instantiate every unit of a scenario; free all of them at the end."""
    units = dict[str, Instance]()
    with draft_folder() as folder, ExitStack() as stack:
        for name, file in wiring.unit_files(fmus, folder, native).items():
            units[name] = Instance(name, file, folder / f"{name}.unpacked")
            stack.callback(units[name].close)
        yield units


class Wired:
    """The units of a scenario, by name, with their inputs and outputs in two arrays; ``step`` [s] is that of the run.

    ``names`` and ``physical_units`` are those of every output that is read, as ``unit.variable``: the outputs in
    ``record`` (all by default) and those that feed an input. ``values`` holds the ``outputs`` followed by the
    values of ``inputs`` in the present step, ``fed`` the values of all connected inputs, and ``sources`` the index in
    ``values`` of each input's source. WiringError: a name is no output of its unit, or one of
    ``inputs`` is connected or of no unit; MasterError: a target is no input.
    """

    def __init__(
        self, wiring: Scenario, units: dict[str, Instance], step: float, record: Collection[str] | None = None,
        inputs: Mapping[str, Array] = {},
    ) -> None:  # fmt: skip
        self.units, self.step, self.inputs = units, step, np.array([*inputs.values()], dtype=np.float64).T
        all_outputs = {f"{name}.{output.name}": output for name, unit in units.items() for output in unit.outputs}
        wires = dict(wiring.connections)
        source_names = set(wires.values())
        for name in (*sorted(source_names), *(record or ())):
            if not isinstance(name, str) or name not in all_outputs:
                hint = did_you_mean(str(name), all_outputs)
                raise WiringError(f"scenario {wiring.name} has no output {name!r}{hint}")
        for name in inputs:
            wiring.check_unit(name.partition(".")[0])
            if name in wires:
                raise WiringError(f"inputs: {name} is connected to {wires[name]} in {wiring.name}; take a free input")
        read = all_outputs.keys() if record is None else {*record, *source_names}
        self.names = tuple(name for name in all_outputs if name in read)
        self.physical_units = tuple(all_outputs[name].unit or "1" for name in self.names)
        index = {name: k for k, name in enumerate((*self.names, *inputs))}
        wires |= {name: name for name in inputs}
        targets = [[target for target in wires if target.partition(".")[0] == unit] for unit in units]
        outputs = [[output for output in self.names if output.partition(".")[0] == unit] for unit in units]
        self.sources = np.array([index[wires[target]] for of_unit in targets for target in of_unit], dtype=np.intp)
        self.values, self.fed, self._time = np.zeros(len(index)), np.zeros(len(self.sources)), c_double(0.0)
        self.outputs, self.input_values = np.split(self.values, [len(self.names)])
        fed = np.split(self.fed, np.cumsum([*map(len, targets)]))
        shown = np.split(self.outputs, np.cumsum([*map(len, outputs)]))
        for k, unit in enumerate(units.values()):
            unit.connect(targets[k], fed[k], outputs[k], shown[k], self._time, c_double(step))
        loops = [unit.play for unit in units.values()]
        self._loop = loops[0] if all(loops) and not inputs else None
        self._rows = np.array([unit.loop_row for unit in units.values()], dtype=np.uintp)
        self._calls = [(unit, *call) for unit in units.values() for call in unit.calls]
        self._sets, self._gets = ([call for call in self._calls if call[1] == name] for name in ("setReal", "getReal"))

    def start(self, parameters: Mapping[str, Mapping[str, Value]], stop: float) -> Array:
        """Initialise all units with their parameters at t = 0; return the outputs at that time."""
        for name, unit in self.units.items():
            unit.initialise(parameters[name], 0.0, stop)
        self.fetch(0.0)
        self._feed(0)
        self._run(self._sets, 0.0)
        for unit in self.units.values():
            unit.finish_initialisation(0.0)
        self.fetch(0.0)
        return self.outputs

    def fetch(self, time: float) -> None:
        """Get the outputs of all units at ``time`` [s]."""
        self._run(self._gets, time)

    def _run(self, calls: list[tuple[Any, ...]], time: float) -> None:
        """Make calls at ``time`` [s]."""
        self._time.value = time
        for unit, call, function, arguments in calls:
            status = function(*arguments)
            if status > WARNING or unit.worst.value > WARNING:
                unit.check(call, time, status)

    def _feed(self, k: int) -> None:
        """Copy the values of the sources in step ``k`` to the connected inputs."""
        if len(self.input_values):
            self.input_values[:] = self.inputs[k]
        self.values.take(self.sources, out=self.fed, mode="clip")

    def play(self, record: Array, first: int) -> None:
        """Take a step for each row of ``record``, from t = ``first`` H on; row k gets the outputs after its step."""
        if self._loop is not None:
            refusal = np.full(3, -1, dtype=np.int64)
            self._loop.argtypes = _LOOP_TYPES
            status = self._loop(
                self._rows.ctypes.data, len(self._rows), self.sources.ctypes.data, len(self.fed), self.fed.ctypes.data,
                self.outputs.ctypes.data, len(self.outputs), record.ctypes.data, first, len(record), self.step,
                refusal.ctypes.data,
            )  # fmt: skip
            k, number, call = refusal.tolist()
            if k >= 0:
                list(self.units.values())[number].check(("setReal", "doStep", "getReal")[call], k * self.step, status)
            return
        for k, row in enumerate(record, first):
            self._feed(k)
            self._run(self._calls, k * self.step)
            row[:] = self.outputs
