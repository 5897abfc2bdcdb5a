"""Designs on identified plants, judged on the true plant.

    python -m benchmarks controllers [--seeds 1:25:2] [--colours ou,slow,swirl] [--plants N] [--workers N]

Every windy rig is identified from five logs under its student's controller. An LQI of elevation and pitch is then
designed on the corrected plant, on the model before and on the published one of the paper, and each is put around the
true plant, which no design has seen. A promise holds where the true plant has the disk margin and settles within
the time that 95 % of the drawn plants keep. The model before is drawn with its own standard errors; of the published
one none are known, its promise is its own figure. Bar: the promises on the corrected plant hold on the truth in 95 %
of the rigs.

Transfer: the step responses of elevation and pitch that each model predicts for the controller designed on the
corrected plant, against those of the true plant; the corrected plant's error over another's, median of the rigs.
"""

from functools import partial
from typing import Any

import numpy as np
import pandas

from benchmarks.harness import count, in_parallel, span, table
from benchmarks.rigs import windy_logs, windy_plant
from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import PLANT, ParameterSet, corrected_parameters, plant_values, significant
from heli_identifier.tools import Design, design_controller
from heli_identifier.tools.judging import Judged, judge
from heli_identifier.tools.linearisation import linear_model
from heli_identifier.tools.loop import step_response
from heli_identifier.tools.margins import Plants, frequencies, plant_response
from heli_identifier.tracing import diagnose
from heli_plant.parameters import TABLE_2, PlantParameters
from tests.blind.air import COLOURS
from tests.blind.windy import windy_rig

AIM = ControllerConfiguration()
MODELS = ("corrected", "before", "published")
KEPT = ("stable", "keeps the margin", "settles in time", "keeps both")
LOGS = {"a": 5, "t": 2}

CHANCE = 0.02
"""A settling time may be missed by this share: the response crosses the 5 % band between two samples."""


def kept(truth: PlantParameters, design: Design, judged: Judged) -> dict[str, bool]:
    """Say what a design keeps around the true plant, linearised where the true plant is in equilibrium."""
    point, omega = design.plants.model.point, frequencies(AIM.period)
    model = linear_model(truth, point.pitch, point.elevation, AIM.period)
    responses = plant_response(model, omega)[None].repeat(2, axis=0)
    found = judge(Plants(model, (model,), omega, responses, ()), judged.settings, design.axes)
    if not found.is_stable:
        return dict.fromkeys(KEPT, False)
    margin = found.figures["disk"].value >= judged.figures["disk"].promised - 1e-3
    settles = all(found.figures[name].value <= judged.figures[name].promised * (1.0 + CHANCE) + AIM.period
                  for name in (f"{axis}.settling" for axis in design.axes))  # fmt: skip
    return dict(zip(KEPT, (True, margin, settles, margin and settles), strict=True))


def predicted_steps(plant: PlantParameters, judged: Judged, design: Design) -> np.ndarray:
    """Step responses of the whole plant, both axes one behind the other [rad]."""
    point = design.plants.model.point
    model = linear_model(plant, point.pitch, point.elevation, AIM.period)
    return np.concatenate([step_response(model, judged.settings, axis, 0.1, 8.0).angle for axis in design.axes])


def of_rig(plants: int, job: tuple[str, int]) -> list[dict[str, Any]]:
    """Identify a rig, design on each model, and judge on the truth; give a row for each design."""
    colour, seed = job
    rig = windy_rig(seed, colour, counts=LOGS)
    truth = windy_plant(rig)
    row = {"rig": f"{colour} {seed}", "refused": "", "transfer": np.nan, **dict.fromkeys(KEPT, False)}
    try:
        diagnosis = diagnose(windy_logs(rig, "a"), held_out=windy_logs(rig, "t"))
    except IdentifierError as error:
        return [{**row, "design": name, "refused": str(error)} for name in MODELS]
    sets = {
        "corrected": corrected_parameters(diagnosis),
        "before": ParameterSet(PLANT, plant_values(diagnosis.plant_before, diagnosis.parameters_before)),
        "published": ParameterSet(PLANT, plant_values(TABLE_2, {})),
    }
    rows: list[dict[str, Any]] = []
    first: Design | None = None
    for name, parameters in sets.items():
        drawn = 20 if name == "published" else plants
        try:
            design = design_controller(parameters, "lqi", "pitch", 0.0, aim=AIM, draws=drawn)
            first = first or design
            expected, true = (predicted_steps(plant, first.robust, first) for plant in (parameters.plant(), truth))
            transfer = float(np.linalg.norm(expected - true))
            for ending, own in (("", design.robust), (", nominal", design.baseline)):
                rows.append({**row, "design": name + ending, "transfer": transfer, **kept(truth, design, own)})
        except ConfigurationError as problem:
            rows.append({**row, "design": name, "refused": str(problem)})
    return rows


def controllers(
    seeds: str = "1:25:2", colours: str = ",".join(COLOURS), plants: int = 300, workers: int = 2
) -> None:
    """Print a table of designs against what they keep."""
    jobs = [(colour, seed) for seed in span(seeds) for colour in colours.split(",")]
    done: list[dict[str, Any]] = []
    for rows in in_parallel(partial(of_rig, plants), jobs, workers):
        done += rows
        said = (f"{row['design']}: {row['refused'] or ('holds' if row[KEPT[-1]] else 'fails')}" for row in rows)
        print(rows[0]["rig"], "; ".join(said), flush=True)
    found = pandas.DataFrame(done)
    lines = []
    for name, own in found.groupby("design", sort=False):
        made = own[own.refused == ""]
        lines.append((name, len(own) - len(made), *(count(made[what]) for what in KEPT)))
    print(table(("design on", "refused", *KEPT), lines))
    wide = found[found.refused == ""].pivot(index="rig", columns="design", values="transfer")
    for name in MODELS[1:]:
        if {"corrected", name} <= {*wide} and len(ratios := (wide.corrected / wide[name]).dropna()):
            print(f"step responses: error over that of {name}, median of {len(ratios)}: {significant(ratios.median())}")
