"""The result of a run: the recorded outputs of all units at every communication point, and the bands of many runs."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heli_identifier.files import write_atomically
from heli_plant.errors import did_you_mean

from ..errors import WiringError


class Bands(NamedTuple):
    """The bands that contain 95 % of the varied runs at every recorded instant."""

    low: NDArray[np.float64]  # lower ends of the band of each output, shape (N, M)
    high: NDArray[np.float64]
    runs: int  # varied runs that were completed
    refused: tuple[str, ...]  # one sentence per run that a unit refused


@dataclass(frozen=True, eq=False)
class Result:
    """Outputs of a run."""

    names: tuple[str, ...]
    """``unit.variable``, with the unit's name in the scenario."""
    units: tuple[str, ...]
    """Physical unit of each, ``1`` where it has none."""
    time: NDArray[np.float64]
    """Communication points k H [s], shape (N,)."""
    values: NDArray[np.float64]
    """Row k holds the outputs at ``time[k]``, shape (N, M)."""
    seconds: float = 0.0
    """Wall time of the steps alone of all runs, without building, loading and initialising the units [s]."""
    bands: Bands | None = None
    """Of varied runs; then the values are those of the run that is not varied."""

    def column(self, name: str) -> NDArray[np.float64]:
        """Return one output, shape (N,), or raise WiringError if none has this name."""
        if name not in self.names:
            raise WiringError(f"the run has no output {name!r}{did_you_mean(name, self.names)}")
        return self.values[:, self.names.index(name)]

    def columns(self, *names: str) -> NDArray[np.float64]:
        """Return several outputs side by side, shape (N, len(names))."""
        return np.column_stack([self.column(name) for name in names])

    def write_csv(self, path: str | Path) -> Path:
        """Write time, outputs and the ends of bands as CSV, complete or not at all; numbers read back to the bit."""
        blocks = [("", self.values)]
        if self.bands is not None:
            blocks += [(" low", self.bands.low), (" high", self.bands.high)]
        pairs = tuple(zip(self.names, self.units, strict=True))
        headers = ["time [s]", *(f"{name}{end} [{unit}]" for end, _ in blocks for name, unit in pairs)]
        rows = np.column_stack([self.time, *(values for _, values in blocks)]).tolist()
        text = StringIO()
        csv.writer(text, lineterminator="\n").writerows([headers, *rows])  # a name of another FMU may hold a comma
        return write_atomically(Path(path), text.getvalue().encode())
