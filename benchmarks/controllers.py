"""Designs on identified plants, judged on the true plant.

Every windy rig is identified from five logs under its student's controller. An LQI of elevation and pitch is then
designed on the corrected plant, on the model before and on the published one of the paper, and each is put around the
true plant, which no design has seen. A promise holds where the true plant has the disk margin and settles within
the time that 95 % of the drawn plants keep; ``--plants`` are drawn. The model before is drawn with its own standard
errors; of the published one none are known, its promise is its own figure.

Transfer: the step responses of elevation and pitch that each model predicts for the controller designed on the
corrected plant, against those of the true plant; the corrected plant's error over another's, median of the rigs.
"""

from functools import partial
from itertools import product

import numpy as np

from benchmarks.harness import Bar, Row, bar_table, count, parse_range, run_jobs, table
from benchmarks.rigs import windy_logs, windy_plant
from heli_identifier.errors import ConfigurationError, IdentifierError
from heli_identifier.records import ControllerConfiguration
from heli_identifier.results import PLANT, ParameterSet, corrected_parameters, diagnose, plant_values
from heli_identifier.tools import Design, design_controller, judging, linearisation, loop
from heli_identifier.tools.plants import Plants
from heli_plant.parameters import TABLE_2, PlantParameters
from tests.blind.air import COLOURS
from tests.blind.windy import windy_rig

AIM = ControllerConfiguration()
MODELS = ("corrected", "before", "published")
KEPT = ("stable", "keeps the margin", "settles in time", "keeps both")


def linear_model(plant: PlantParameters, design: Design) -> linearisation.LinearModel:
    """Linearise a plant at its equilibrium at the design's pitch and elevation."""
    point = design.plants.model.point
    return linearisation.linear_model(plant, point.pitch, point.elevation, AIM.period)


def check_promises(truth: PlantParameters, design: Design) -> dict[str, bool]:
    """Return which of :data:`KEPT` hold for a design around the true plant."""
    model, promised = linear_model(truth, design), design.delivered.figures
    judged = judging.judge_controller(Plants(model, (model,), ()), design.delivered.settings, design.axes)
    if not judged.is_stable:
        return dict.fromkeys(KEPT, False)
    margin = judged.figures["disk"].value >= promised["disk"].promised - 1e-3
    # with a tolerance of 2 % and a period: the response crosses the 5 % band between two samples
    settles = all(judged.figures[name].value <= 1.02 * promised[name].promised + AIM.period
                  for name in (f"{axis}.settling" for axis in design.axes))  # fmt: skip
    return dict(zip(KEPT, (True, margin, settles, margin and settles), strict=True))


def predicted_steps(plant: PlantParameters, design: Design) -> np.ndarray:
    """Return the step responses of the whole plant [rad], one axis after the other."""
    model, settings = linear_model(plant, design), design.delivered.settings
    return np.concatenate([loop.step_response(model, settings, axis, 0.1, 8.0) for axis in design.axes])


def judge_designs(plants: int, colour: str, seed: int) -> list[Row]:
    """Identify a rig, design on each model, and judge on the truth; return a row for each design."""
    rig, name = windy_rig(seed, colour, counts={"a": 5, "t": 2}), f"{colour} {seed}"
    truth, rows, first = windy_plant(rig), list[Row](), None
    try:
        diagnosis = diagnose(windy_logs(rig, "a"), held_out=windy_logs(rig, "t"))
    except IdentifierError as error:
        return [{"rig": name, "design": model, "refused": True, "line": f"{name}: {error}"} for model in MODELS]
    sets = (
        corrected_parameters(diagnosis),
        ParameterSet(PLANT, plant_values(diagnosis.plant_before, diagnosis.parameters_before)),
        ParameterSet(PLANT, plant_values(TABLE_2, {})),
    )
    for model, parameters in zip(MODELS, sets, strict=True):
        row: Row = {"rig": name, "design": model, "refused": False}
        try:
            drawn = 20 if model == "published" else plants
            design = design_controller(parameters, "lqi", "pitch", 0.0, aim=AIM, draws=drawn)
            first = first or design
            expected, true = (predicted_steps(plant, first) for plant in (parameters.plant(), truth))
            row |= {**check_promises(truth, design), "transfer": float(np.linalg.norm(expected - true))}
            text = "holds" if row[KEPT[-1]] else "fails"
        except ConfigurationError as error:
            row["refused"], text = True, str(error)
        rows.append(row | {"line": f"{name}, {model}: {text}"})
    return rows


def controllers(seeds: str = "1:25:2", colours: str = ",".join(COLOURS), plants: int = 300, workers: int = 2) -> None:
    """Print a table of the promises that the designs keep."""
    cases = product(parse_range(seeds), colours.split(","))
    jobs = [partial(judge_designs, plants, colour, seed) for seed, colour in cases]
    rows = run_jobs(jobs, workers)
    designed = rows[~rows.refused]
    lines = [(name, group.refused.sum(), *(count(group[promise][~group.refused]) for promise in KEPT))
             for name, group in rows.groupby("design", sort=False)]  # fmt: skip
    print(table(("design on", "refused", *KEPT), lines))
    wide = designed.pivot(index="rig", columns="design", values="transfer").reindex(columns=MODELS)
    both = designed[KEPT[-1]][designed.design == MODELS[0]]
    transfer_bars = [Bar(f"step responses: error over that of {name}", (wide.corrected / wide[name]).median())
                     for name in MODELS[1:]]  # fmt: skip
    print(bar_table([Bar("promises on the corrected plant hold", both, least=95.0), *transfer_bars]))
