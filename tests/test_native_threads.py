"""Several instances of native units step in several threads at once and show what they show alone."""

from concurrent.futures import ThreadPoolExecutor
from math import sin

import fmpy
import pytest
from fmpy.fmi2 import FMU2Slave

from fmu_src.native import build_native
from tests.native_builds import needs_a_compiler

STEPS, THREADS = 3000, 8


@pytest.mark.parametrize("unit", ["HelicopterPlant", "AdaptiveIdentifier", "PidController"])
def test_instances_in_threads_show_what_they_show_alone(tmp_path, unit):
    """The calls run outside of the interpreter's lock, so that steps of several instances overlap."""
    needs_a_compiler()
    path = build_native(unit, tmp_path)
    description, folder = fmpy.read_model_description(path), fmpy.extract(path)
    listed = {
        causality: [
            v.valueReference
            for v in description.modelVariables
            # corrections of .3 would take parameters out of their ranges
            if v.causality == causality and not v.name.startswith("correction.")
        ]
        for causality in ("input", "output")
    }

    def run(seed):
        slave = FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=unit, instanceName=str(seed))
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        shown = []
        for k in range(STEPS):
            fed = [0.3 * sin(0.01 * k * (i + 1) + seed) for i, _ in enumerate(listed["input"])]
            slave.setReal(listed["input"], fed)
            slave.doStep(0.01 * k, 0.01)
            if k % 100 == 0:
                shown.append(slave.getReal(listed["output"]))
        slave.terminate()
        slave.component = None  # the library stays loaded for the other threads
        return shown

    seeds = range(THREADS)
    alone = [run(seed) for seed in seeds]
    with ThreadPoolExecutor(THREADS) as pool:
        together = list(pool.map(run, seeds))
    assert together == alone
    assert len({tuple(map(tuple, shown)) for shown in alone}) == THREADS
