"""The paper's tables and figures, made from the units and written into a folder.

Tables 1 and 2 and Figures 2 to 5 come from the FMUs under the master; the search for what makes the paper's two
experiments differ runs the compiled twins of the same plant and identifier.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path

from heli_identifier.drafts import draft_folder
from heli_identifier.results import figure_text, whole_folder
from heli_identifier.workbench.paper.closed_loop import closed_loop
from heli_identifier.workbench.paper.findings import sentences
from heli_identifier.workbench.paper.histories import histories
from heli_identifier.workbench.paper.open_loop import open_loop
from heli_identifier.workbench.paper.pitch_experiment import identify_pitch
from heli_identifier.workbench.paper.published import EXPERIMENTS
from heli_identifier.workbench.paper.runs import (
    JOINT_RUN,
    KNOWN,
    PITCH_RUN,
    Kind,
    Progress,
    Run,
    run_all,
    twelve_starts,
)
from heli_identifier.workbench.paper.spread import candidates, search, write_spread
from heli_identifier.workbench.paper.tables import write_table_1, write_table_2
from heli_identifier.workbench.paper.within import CORRELATION_TIMES, matched_torque, write_within
from heli_plant.effects import Effect

UNITS = ("Exciter", "HelicopterPlant", "AdaptiveIdentifier", "PidController")


@dataclass(frozen=True)
class Extent:
    """The runs to make; the default is the whole paper.

    Attributes
    ----------
    pitch, joint : Kind
        The two kinds of runs.
    starts : tuple of int
        Numbers of the starts, of twelve.
    effects : tuple of Effect
        Entries of the catalogue that are tried as causes of the paper's spread.
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
        The results in words.
    seconds : float
        Duration [s] of the reproduction.
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
        Called with the number done, the number in all, and what is counted; there are several counts.
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
    with whole_folder(output) as folder, draft_folder() as built:
        fmus = {unit: build(unit, built) for unit in UNITS}
        pitch_runs, joint_runs = _runs(extent, fmus, progress)
        write_table_1(pitch_runs, folder)
        write_table_2(pitch_runs, joint_runs, folder)
        figures = histories(pitch_runs, joint_runs, folder)
        figures["figure3"], pair = open_loop(pitch_runs, fmus, folder)
        best = max((run for run in pitch_runs if run.experiment == 1), key=lambda run: run.start.gain)
        figures["figure4"], differences = closed_loop(best.final(KNOWN), fmus, folder)
        explained = search(identify_pitch, extent.effects, progress)
        spreads = [matched_torque(correlation_time) for correlation_time in extent.correlation_times]
        write_spread(explained, folder / "spread.csv")
        write_within(pitch_runs, spreads, folder / "within.csv")
        for name, figure in figures.items():
            figure.patch.set_visible(True)
            figure.patch.set_facecolor("white")
            (folder / f"{name}.svg").write_text(figure_text(figure), encoding="utf-8")
        files = tuple(Path(output) / file.name for file in sorted(folder.iterdir()))
    said = sentences(pitch_runs, joint_runs, pair, differences, explained, spreads)
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
