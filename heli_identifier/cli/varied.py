"""``heli simulate --runs``: which parameters are varied, and what is said of the bands."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from heli_identifier.errors import ConfigurationError


def variations(
    scenario: str, file: Path | None, given: Mapping[str, Any], count: int, seed: int
) -> list[dict[str, float]]:
    """Draw the plant's parameters of a parameters.json by their standard errors, by unit name in a scenario.

    Parameters
    ----------
    scenario : str
    file : Path or None
        The parameters.json.
    given : mapping
        What ``--set`` says: these parameters stay.
    count, seed : int

    Raises
    ------
    ConfigurationError
        There is no file, the scenario has no plant, or the file states no standard error of what is not given.
    """
    from fmu_src import scenario as wiring
    from heli_identifier.cli.terminal import note
    from heli_identifier.results import PLANT, drawn_values, read_parameters

    if file is None:
        raise ConfigurationError(
            "--runs varies parameters by their standard errors; name the parameters.json of a diagnosis: --parameters."
        )
    plants = [name for name, unit in wiring(scenario).units if unit == PLANT]
    if not plants:
        raise ConfigurationError(f"--runs varies the {PLANT}, which scenario {scenario} does not have.")
    drawn = [
        {f"{plant}.{name}": value for plant in plants for name, value in draw.items() if f"{plant}.{name}" not in given}
        for draw in drawn_values(read_parameters(file), count, seed)
    ]
    if not drawn[0]:
        raise ConfigurationError(
            f"{file} states no standard error of a parameter that --set leaves free, so there is nothing to vary; "
            "the parameters.json of `heli diagnose` has them."
        )
    note(
        f"{len(drawn[0])} parameters are drawn independently by their standard errors (seed {seed}); parameters.json "
        "holds no correlations."
    )
    return drawn


def say_bands(bands: Any, json: bool, everything: bool) -> None:
    """Print last values of the nominal run and the range of 95 % of the runs: ``bands`` of the master."""
    import numpy as np

    from heli_identifier.cli.terminal import print_json, print_table, warn
    from heli_identifier.results import significant, unit_text

    if bands.refused:
        warn(f"{len(bands.refused)} of {bands.runs + len(bands.refused)} runs were refused; first: {bands.refused[0]}")
    nominal = bands.nominal
    widest = (bands.high - bands.low).max(axis=0)
    rows = np.column_stack([nominal.values[-1], bands.low[-1], bands.high[-1], widest]).tolist()
    if json:
        keys = ("name", "unit", "last", "last_low", "last_high", "widest")
        outputs = [
            dict(zip(keys, (name, unit, *row), strict=True))
            for name, unit, row in zip(nominal.names, nominal.units, rows, strict=True)
        ]
        print_json({"runs": bands.runs, "refused": len(bands.refused), "outputs": outputs})
        return
    print_table(
        f"{bands.runs} runs of {nominal.time[-1]:g} s; 95 % of them lie between low and high",
        ("output", "last >", "low >", "high >", "widest band >", "unit"),
        [
            (name, *(significant(value, 4) for value in row), unit_text(unit))
            for name, unit, row in zip(nominal.names, nominal.units, rows, strict=True)
            if everything or name.count(".") == 1
        ],
    )
