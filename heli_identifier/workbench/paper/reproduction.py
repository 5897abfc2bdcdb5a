"""Make the paper's tables and figures from the units and write them into a folder.

Tables 1 and 2 and Figures 2 to 5 come from the FMUs under the master; the search for what makes the paper's two
experiments differ runs the compiled twins of the same plant and identifier.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

from heli_identifier.workbench.delivery.staging import whole_folder
from heli_identifier.workbench.paper.closed_loop import closed_loop
from heli_identifier.workbench.paper.findings import Findings, sentences
from heli_identifier.workbench.paper.histories import histories
from heli_identifier.workbench.paper.open_loop import open_loop
from heli_identifier.workbench.paper.pitch_experiment import identify_pitch
from heli_identifier.workbench.paper.published import EXPERIMENTS
from heli_identifier.workbench.paper.runs import JOINT_RUN, KNOWN, PITCH_RUN, Kind, Progress, Run, run_all
from heli_identifier.workbench.paper.search import search
from heli_identifier.workbench.paper.spread import candidates
from heli_identifier.workbench.paper.spread_tables import write_spread, write_within
from heli_identifier.workbench.paper.starts import twelve_starts
from heli_identifier.workbench.paper.table1 import write_table_1
from heli_identifier.workbench.paper.table2 import write_table_2
from heli_identifier.workbench.paper.within import CORRELATION_TIMES, matched_torque
from heli_identifier.workbench.report.figures.style import figure_text
from heli_plant.effects import Effect

UNITS = ("Exciter", "HelicopterPlant", "AdaptiveIdentifier", "PidController")


@dataclass(frozen=True)
class Extent:
    """How much is run; the default is the whole paper.

    Attributes
    ----------
    pitch, joint : Kind
        The two kinds of runs.
    starts : tuple of int
        Which of the twelve starts.
    effects : tuple of Effect
        Which entries of the catalogue are tried on the paper's spread.
    correlation_times : tuple of float
        Of the random torques [s].
    """

    pitch: Kind = PITCH_RUN
    joint: Kind = JOINT_RUN
    starts: tuple[int, ...] = tuple(range(1, 13))
    effects: tuple[Effect, ...] = field(default_factory=candidates)
    correlation_times: tuple[float, ...] = CORRELATION_TIMES


@dataclass(frozen=True)
class Reproduction:
    """What was made.

    Attributes
    ----------
    files : tuple of Path
        Tables as CSV, figures as SVG with their data as CSV.
    sentences : tuple of str
        What the tables say, for the person who ran the command.
    seconds : float
        Time that it took.
    """

    files: tuple[Path, ...]
    sentences: tuple[str, ...]
    seconds: float


def reproduce(output: Path, progress: Progress | None = None, extent: Extent | None = None) -> Reproduction:
    """Run the paper and write its tables and figures into ``output``, all or nothing.

    Parameters
    ----------
    output : Path
        Folder; made if it does not exist.
    progress : callable, optional
        Called with what is done, what there is to do, and its name; each name counts for itself.
    extent : Extent, optional
        Less than the whole paper.

    Returns
    -------
    Reproduction

    Raises
    ------
    ConfigurationError
        The folder cannot be written to.
    fmu_src.FmuError
        A unit could not be built or stepped.
    """
    from fmu_src import build

    began = time.monotonic()
    extent = extent or Extent()
    with whole_folder(output) as folder, TemporaryDirectory(prefix="heli-paper-") as built:
        fmus = {unit: build(unit, built) for unit in UNITS}
        pitch_runs, joint_runs = _runs(extent, fmus, progress)
        write_table_1(pitch_runs, folder)
        write_table_2(pitch_runs, joint_runs, folder)
        figures = histories(pitch_runs, joint_runs, folder)
        drawn, pair = open_loop(pitch_runs, fmus, folder)
        figures |= drawn
        best = max((run for run in pitch_runs if run.experiment == 1), key=lambda run: run.start.gain)
        drawn, differences = closed_loop(best.final(KNOWN), fmus, folder)
        figures |= drawn
        explained = search(identify_pitch, extent.effects, progress)
        spreads = [matched_torque(correlation_time) for correlation_time in extent.correlation_times]
        write_spread(explained, folder / "spread.csv")
        write_within(pitch_runs, spreads, folder / "within.csv")
        _write_figures(figures, folder)
        files = tuple(Path(output) / file.name for file in sorted(folder.iterdir()))
    said = sentences(Findings(pitch_runs, joint_runs, pair, differences, explained, spreads))
    return Reproduction(files, said, time.monotonic() - began)


def _runs(extent: Extent, fmus: dict[str, Path], progress: Progress | None) -> tuple[list[Run], list[Run]]:
    """Pitch runs and joint runs of both experiments."""
    jobs = [
        (kind, experiment, start)
        for kind in (extent.joint, extent.pitch)  # the long ones first, so that no core waits at the end
        for experiment in EXPERIMENTS
        for start in twelve_starts(experiment)
        if start.number in extent.starts
    ]
    runs = run_all(jobs, fmus, progress)
    return [run for run in runs if run.kind == extent.pitch], [run for run in runs if run.kind == extent.joint]


def _write_figures(figures: dict[str, Figure], folder: Path) -> None:
    """Write each figure as SVG on white."""
    for name, figure in figures.items():
        figure.patch.set_visible(True)
        figure.patch.set_facecolor("white")
        (folder / f"{name}.svg").write_text(figure_text(figure), encoding="utf-8")
