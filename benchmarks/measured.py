"""Diagnoses of rigs whose truth is not known: verdicts, effects with intervals, errors before and after.

Usage: python -m benchmarks.measured --name rigs FOLDER...        each folder a rig, as for heli fleet
       python -m benchmarks.measured --name ntnu --each-in-turn --from 6 LOG...   each log held out once
       python -m benchmarks.measured --name ctu --voltage-limit 6 --hold-out LAST.csv LOG...
       python -m benchmarks.measured --name fleet --from 6 --download    public logs of three rigs of one make

The figures go into docs/results.md, into a section of the given name; behind those of a download stands what repeats
from rig to rig.
"""

import argparse
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.measured_download import PUBLIC, DownloadError, download
from benchmarks.page import PAGE, ROOT, write_section
from benchmarks.tables import table
from heli_identifier.records import read_logs
from heli_identifier.results.words import is_known
from heli_identifier.tools import Fleet, fleet_of, fleet_sentence, rig_folder
from heli_identifier.tools import fleet_tables as fleet_tables_of
from heli_identifier.tracing import Diagnosis, DiagnosisSettings, FoundEffect, NamedShape, diagnose
from heli_plant.effects import AXES

PLACES = ("--source", "--folder", "--page")
"""Options whose values are places."""

HEAD = (
    "| held out | verdict | found | possible | nats | pitch [mrad] | elevation [mrad] | travel [mrad] |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- |"
)


def main(arguments: Sequence[str]) -> None:
    asked = _parsed(arguments)
    if asked.download:
        try:
            asked.paths = download(asked.folder, asked.source)
        except DownloadError as error:
            sys.exit(str(error))
    rows, diagnoses = [], {}
    for title, training, held in _cases(asked):
        settings = DiagnosisSettings(voltage_limit=asked.voltage_limit)
        logs = [read_logs(paths, start=asked.start) for paths in (training, held)]
        diagnoses[title] = diagnose(logs[0], held_out=logs[1], settings=settings)
        rows.append(row(title, diagnoses[title]))
        print(rows[-1], flush=True)
    over_rigs = fleet_tables(fleet_of(diagnoses)) if asked.download else ""
    command = shlex.join(["python", "-m", "benchmarks.measured", *_without_places(arguments)])
    write_section(
        asked.page,
        asked.name,
        f"### {asked.title or asked.name}\n\n`{command}`\n\n{EXPLANATION}\n\n{HEAD}\n" + "\n".join(rows) + over_rigs,
    )


EXPLANATION = (
    "Coefficients with 95 % intervals. *Nats*: what the held-out log gains by the correction. The errors are root mean "
    "squares of the prediction 1 s ahead on the held-out log under the measured voltages, before and after, with the "
    "noise floor in brackets. A dash means that no noise floor can be computed, because the model runs away from the "
    "rig within seconds even on its own data."
)


def fleet_tables(fleet: Fleet) -> str:
    """Give what repeats over the rigs, what differs and what is one rig's own, and the parameters, as two tables."""
    tables = fleet_tables_of(fleet)
    parts = [fleet_sentence(fleet), *(table(_plain(columns), rows) for _, columns, rows in tables)]
    return "\n\n" + "\n\n".join(parts)


def _plain(columns: Sequence[str]) -> tuple[str, ...]:
    return tuple(column.removesuffix(" >") for column in columns)


def row(title: str, found: Diagnosis) -> str:
    """One diagnosis as a row of the table."""
    effects, possible = ("; ".join(map(effect_text, own)) or "nothing" for own in (found.effects, found.possible))
    cells = [title, found.verdict, effects, possible, f"{found.held_out.gain.value:.0f}"]
    for axis in AXES:
        report = found.axes[axis]
        before, after = (1e3 * error.prediction_1s.value for error in (report.before, report.after))
        floor = report.noise_floor.prediction_1s
        known = f"{1e3 * floor.value:.3g}" if is_known(floor) else "–"
        cells.append(f"{before:.3g}, {after:.3g} ({known})")
    return f"| {' | '.join(cells)} |"


def effect_text(effect: FoundEffect) -> str:
    """Describe one effect for a cell of the table."""
    c = effect.coefficient
    if c is None or not isinstance(effect.shape, NamedShape):
        return f"unknown on {effect.axis}: {effect.shape.to_dict()['description']}"
    text = f"{effect.name} on {effect.axis} {c.value:.3g} +- {1.96 * (c.standard_error or 0.0):.2g} {c.unit}"
    shapes = [
        f"{name} {s.value:.4g} {s.unit}" for name, s in effect.shape.parameters.items() if s.standard_error is not None
    ]
    if shapes:
        text += f" ({', '.join(shapes)})"
    if effect.alternatives:
        text += " (ambiguous with " + ", ".join(name for name, _ in effect.alternatives) + ")"
    return text


def _cases(asked: argparse.Namespace) -> Iterator[tuple[str, list[Path], list[Path]]]:
    """Title, training logs and held-out logs of every diagnosis."""
    if asked.each_in_turn:
        for held in asked.paths:
            yield held.stem, [path for path in asked.paths if path != held], [held]
    elif asked.hold_out is not None:
        yield asked.hold_out.stem, list(asked.paths), [asked.hold_out]
    else:
        for folder in asked.paths:
            rig = rig_folder(folder, folder.name)
            if rig.held_out:
                yield rig.rig, list(rig.training), list(rig.held_out)
            else:
                yield rig.rig, list(rig.training[:-1]), [rig.training[-1]]


def _without_places(arguments: Sequence[str]) -> Iterator[str]:
    """Give the arguments without options that say where files lie, and paths by their last part: that says nothing."""
    words = iter(arguments)
    for word in words:
        if word in PLACES:
            next(words)
        else:
            yield Path(word).name if "/" in word else word


def _parsed(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measured", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("paths", nargs="*", type=Path)
    parser.add_argument("--download", action="store_true", help="fetch public logs, in place of paths")
    parser.add_argument("--source", default=PUBLIC, metavar="URL", help="where from; default: %(default)s")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "measured", help="where to")
    parser.add_argument("--name", required=True, help="of the section")
    parser.add_argument("--title", help="heading of the section")
    parser.add_argument("--each-in-turn", action="store_true", help="hold out each log once")
    parser.add_argument("--hold-out", type=Path, help="the log to hold out")
    parser.add_argument("--from", dest="start", type=float, help="first second used of every log")
    parser.add_argument("--voltage-limit", type=float, default=5.0)
    parser.add_argument("--page", type=Path, default=PAGE)
    asked = parser.parse_args(arguments)
    if bool(asked.paths) == asked.download:
        parser.error("name paths, or --download without any")
    return asked


if __name__ == "__main__":
    with threadpool_limits(1):
        main(sys.argv[1:])
