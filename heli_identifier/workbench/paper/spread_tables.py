"""The paper's spread as tables: between its experiments (``spread.csv``) and within each (``within.csv``)."""

from collections.abc import Sequence
from pathlib import Path

from heli_identifier.workbench.paper.published import EXPERIMENTS, PITCH, TABLE_1
from heli_identifier.workbench.paper.runs import KNOWN, Run
from heli_identifier.workbench.paper.spread import Explanation
from heli_identifier.workbench.paper.table1 import found_range
from heli_identifier.workbench.paper.table_text import Cell, write_table
from heli_identifier.workbench.paper.within import TorqueSpread

_COLUMNS = tuple(f"{name} in experiment {experiment}" for experiment in EXPERIMENTS for name in PITCH)
_MOST_EFFECTS = 2
_NOTHING = 1e-9
"""Coefficients below this share of the catalogue's bound are zeros that the fit has not quite reached."""


def write_spread(found: Sequence[Explanation], path: Path) -> None:
    """Write the explanations, the best first, below the midpoints that they were to repeat."""
    middles = [TABLE_1[experiment][name].middle for experiment in EXPERIMENTS for name in PITCH]
    before = 4 * _MOST_EFFECTS
    rows: list[list[Cell]] = [["the paper's midpoints", *[""] * (before - 1), "", "", *[""] * len(PITCH), *middles]]
    for one in found:
        row: list[Cell] = []
        for effect, c in zip(one.effects, one.coefficients, strict=True):
            row += [effect.name, effect.axis, c if abs(c) > _NOTHING * effect.upper else 0, effect.unit]
        row = (row or ["no effect"]) + [""] * before
        rows.append([*row[:before], one.misfit, one.inside, *one.own, *map(float, one.estimates.ravel())])
    write_table(
        path,
        (
            *("effect", "axis", "coefficient", "unit"),
            *("second effect", "its axis", "its coefficient", "its unit"),
            *("misfit", "estimates inside the paper's ranges"),
            *(f"plant's own {name}" for name in PITCH),
            *_COLUMNS,
        ),
        rows,
    )


def write_within(runs: Sequence[Run], spreads: Sequence[TorqueSpread], path: Path) -> None:
    """Write the width of the ranges: the paper's, those of the units with encoders alone, those under torques."""
    printed = [2.0 * TABLE_1[experiment][name].half_width for experiment in EXPERIMENTS for name in PITCH]
    of_units = [found_range(runs, experiment, name, KNOWN) for experiment in EXPERIMENTS for name in PITCH]
    rows: list[tuple[Cell, ...]] = [
        ("the paper", "", "", *printed),
        ("units: encoders and starts alone", "", "", *(found.highest - found.lowest for found in of_units)),
    ]
    for spread in spreads:
        torque = (spread.correlation_time, spread.deviation)
        rows.append(("random torque: width", *torque, *map(float, spread.widths.ravel())))
        rows.append(("random torque: mean", *torque, *map(float, spread.means.ravel())))
    write_table(path, ("what", "correlation time [s]", "standard deviation [rad/s^2]", *_COLUMNS), rows)
