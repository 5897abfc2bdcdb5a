"""Many runs of one scenario with varied parameters: native units, loaded once and reset before every run.

The first run is the nominal one. Of the others only bands are kept, at every recorded instant the range in which 95 %
of the runs lie. A run that a unit refuses is counted and its reason kept; the others go on.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from time import perf_counter

import numpy as np

from ..errors import MasterError
from ..native import build_native
from ..variables import Value
from ..wiring import Scenario, scenario, whole_steps
from .layout import laid_out
from .loop import Wired, instances
from .result import Bands, Result
from .unit_log import UnitLog

SHARE = 0.95
"""Share of the runs inside of a band."""

MOST_NUMBERS = 5e7
"""Numbers that are kept of all runs (400 MB); of longer ones every n-th instant is kept."""


def run_many(
    scenario_name: str | Scenario,
    duration: float,
    step: float,
    parameters: Mapping[str, Value],
    variations: Sequence[Mapping[str, Value]],
    fmus: Mapping[str, str | Path] | None = None,
    record: Collection[str] | None = None,
    alive: Callable[[], None] = lambda: None,
) -> Bands:
    """Run a scenario once with ``parameters`` and once more with each of ``variations`` on top of them.

    The other parameters are those of :func:`fmu_src.master.run`; units that are not given as files are built in C.

    Raises
    ------
    WiringError, MasterError, BuildError
        As ``run``, for the nominal run; MasterError also if a unit is not native, or every varied run is refused.
    """
    wiring = scenario(scenario_name)
    steps = whole_steps(duration, step)
    nominal = wiring.parameters_by_unit(parameters)
    alarm: list[UnitLog] = []
    with instances(wiring, fmus or {}, alarm, alive, build_native) as units:
        for name, unit in units.items():
            if not unit.is_native:
                raise MasterError(f"many runs need native units; {name} is none, build it with --native")
        layout = laid_out(wiring, {name: unit.outputs for name, unit in units.items()}, record)
        wired = Wired(units, layout, step, alarm, alive)
        take = wired.compiled()
        width = len(layout.names)
        stride = max(1, int(np.ceil((len(variations) + 1) * (steps + 1) * width / MOST_NUMBERS)))
        values = np.empty((steps + 1, width))
        kept = np.empty((len(variations), len(values[::stride]), width))
        began = perf_counter()

        def once(given: Mapping[str, Mapping[str, Value]]) -> None:
            for name, unit in units.items():
                unit.initialise(given[name], 0.0, steps * step)
            values[0] = wired.start()
            take(values[1:], step, 0)

        once(nominal)
        first, done, refused = values[::stride].copy(), 0, []
        for variation in variations:
            alive()
            wired.reset()
            try:
                once(wiring.parameters_by_unit({**parameters, **variation}))
            except MasterError as problem:
                refused.append(str(problem))
                continue
            kept[done] = values[::stride]
            done += 1
        seconds = perf_counter() - began
        physical = wired.physical_units()
    if done == 0:
        raise MasterError(f"every one of {len(variations)} varied runs was refused; the first: {refused[0]}")
    ends = 0.5 * (1.0 - SHARE), 0.5 * (1.0 + SHARE)
    low, high = np.quantile(kept[:done], ends, axis=0, overwrite_input=True)
    time = np.arange(steps + 1, dtype=np.float64)[::stride] * step
    result = Result(layout.names, physical, time, first, seconds)
    return Bands(result, low, high, done, tuple(refused))
