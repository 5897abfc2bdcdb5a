"""Structure selection over the catalogue beside pysindy's and SysIdentPy's stepwise selections, on the same matrices.

Every method gets the same whitened columns and residuals of nine rigs and returns the columns that it selects. The
whole search of the tracer is timed as well: it makes the columns by simulation, refits the plant with every candidate
that could win, and tests for unknown torques. No other method does this, so the other rows of the table leave it out.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import fmean
from tempfile import TemporaryDirectory

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks import selection_peers
from benchmarks.machine import measured_at
from benchmarks.page import ROOT
from benchmarks.selection_rigs import Entries, Matrix, chosen, matrices
from benchmarks.tables import Bar, bar_table, figure, seconds, table
from benchmarks.timing import Times, ratio, seconds_of
from heli_identifier.tracing.search.expected import null_model
from heli_identifier.tracing.search.selection import select

ROUNDS = 2
ONCE = {"whole", "sysidentpy"}
"""Run in the first round alone: they take minutes."""

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}
"""The same for every method: on two cores a second thread of the linear algebra slows all of them down."""

OURS = {
    "tracer": "the tracer's scores and thresholds, columns projected out",
    "whole": "the tracer's whole search: simulated columns, refits of the plant, unknown torques",
}


@dataclass(frozen=True)
class Tally:
    """Selections of one method over all rigs.

    Attributes
    ----------
    found, true : int
        True effects that were selected, and all true effects.
    false : int
        Effects that were selected and are not there.
    right, rigs : int
        Rigs whose effects were selected and no other, and all rigs.
    """

    found: int
    true: int
    false: int
    right: int
    rigs: int


def tally(selected: Sequence[Entries], true: Sequence[Entries]) -> Tally:
    """Count correct and false selections over the rigs."""
    pairs = list(zip(selected, true, strict=True))
    return Tally(
        sum(len(own & real) for own, real in pairs),
        sum(len(real) for _, real in pairs),
        sum(len(own - real) for own, real in pairs),
        sum(own == real for own, real in pairs),
        len(pairs),
    )


Answer = tuple[float, list[Entries]]
"""Mean seconds a rig, and the entries selected on every rig."""


def own_answer(rigs: Sequence[Matrix]) -> Answer:
    """Select from the matrices with the tracer's functions."""
    selected: list[Entries] = []

    def choose(rig: Matrix) -> None:
        selected.append(rig.entries(chosen(rig.scanned)))

    with threadpool_limits(1):
        return fmean([seconds_of(partial(choose, rig)) for rig in rigs]), selected


def whole_answer(rigs: Sequence[Matrix]) -> Answer:
    """Search as a diagnosis does."""
    selected: list[Entries] = []

    def search(rig: Matrix) -> None:
        model = select(null_model(rig.problem, rig.start)).model
        unknown = [("unknown", unknown.axis) for unknown in model.unknowns]
        selected.append(frozenset([*((effect.name, effect.axis) for effect in model.effects), *unknown]))

    with threadpool_limits(1):
        return fmean([seconds_of(partial(search, rig)) for rig in rigs]), selected


def peer_answer(method: str, rigs: Sequence[Matrix], files: Sequence[Path]) -> Answer | None:
    """Let a peer select in a process of its own; None where its package is missing.

    Raises
    ------
    RuntimeError
        If it fails otherwise.
    """
    script = Path(selection_peers.__file__)
    command = [peer_python(method), str(script), method, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **ONE_THREAD})
    if "ModuleNotFoundError" in done.stderr:
        return None
    if done.returncode:
        raise RuntimeError(f"{method} failed: {done.stderr[-1500:]}")
    answers = json.loads(done.stdout)
    selected = [rig.entries(answer["chosen"]) for rig, answer in zip(rigs, answers, strict=True)]
    return fmean(answer["seconds"] for answer in answers), selected


def peer_python(method: str) -> str:
    """Interpreter that has a method's package: SysIdentPy bounds numpy's version and has an environment of its own."""
    own = Path(sys.prefix) / "sysidentpy" / "bin" / "python"
    return str(own) if method.startswith("sysidentpy") and own.exists() else sys.executable


def measured(rigs: Sequence[Matrix]) -> dict[str, tuple[Times, list[Entries]]]:
    """Run all methods in turn; those whose package is missing are left out."""
    with TemporaryDirectory() as folder:
        files = [Path(folder) / f"{number}.npz" for number in range(len(rigs))]
        for file, rig in zip(files, rigs, strict=True):
            np.savez(file, X=rig.scanned.directions, y=-rig.scanned.white)
        contenders: dict[str, Callable[[], Answer | None]] = {
            "tracer": lambda: own_answer(rigs),
            **{name: partial(peer_answer, name, rigs, files) for name in selection_peers.METHODS},
            "whole": lambda: whole_answer(rigs),
        }
        times: dict[str, list[float]] = {}
        selected: dict[str, list[Entries]] = {}
        for round_ in range(ROUNDS):
            for name, answer in contenders.items():
                if (round_ == 0 or name not in ONCE) and (given := answer()) is not None:
                    times.setdefault(name, []).append(given[0])
                    selected[name] = given[1]
    return {name: (Times(tuple(times[name])), selected[name]) for name in times}


def section(load: float) -> str:
    rigs = list(matrices())
    own_answer(rigs[:1])
    found = measured(rigs)
    true = [rig.true for rig in rigs]
    tallies = {name: tally(selected, true) for name, (_, selected) in found.items()}
    own = found["tracer"][0]
    sizes = [rig.scanned.directions.shape for rig in rigs]
    return "\n\n".join(
        [
            "## Structure selection over the catalogue",
            bar_table(_bars(found, own)),
            table(
                ("method", "median a rig", "least", "times as long", "true found", "false", "rigs right"),
                [_row(name, times, tallies[name], own) for name, (times, _) in found.items()],
            ),
            f"{len(rigs)} rigs: the three demonstration rigs, and the first of each of the blind battery's "
            f"{len(rigs) - 3} kinds of pairs. Every method selects from the same matrices, {sizes[0][0]} rows by "
            f"{min(k for _, k in sizes)} to {max(k for _, k in sizes)} columns: the catalogue's whitened columns "
            "after the projection that removes the rig's own parameters, of unit length. Times are those of the "
            "selection alone; only the whole search also makes its columns, refits the plant and searches for unknown "
            f"torques. Every method uses one thread of the linear algebra. {ROUNDS} rounds; "
            f"{' and '.join(sorted(ONCE))} run once. *True found*: true effects that were selected; "
            "*false*: selected effects that the rig lacks; *rigs right*: the truth and nothing else was selected. "
            "pysindy's MIOSR needs a licence for Gurobi and was not run.",
            table(("rig", "truth", "tracer, matrix alone", "whole search"), _choices(rigs, found)),
            measured_at(("numpy", "scipy", "pysindy"), load).removesuffix(".") + f", {_sysidentpy_version()}.",
        ]
    )


def _bars(found: Mapping[str, tuple[Times, list[Entries]]], own: Times) -> list[Bar]:
    """Compare with the fastest way to run each peer."""
    bars = []
    for title, names in (
        ("pysindy SSR", ("ssr", "ssr_tuned")),
        ("pysindy FROLS", ("frols", "frols_tuned")),
        ("SysIdentPy FROLS", ("sysidentpy", "sysidentpy_tuned")),
    ):
        for name in names:
            if name in found:
                how = "tuned" if name.endswith("tuned") else "as it comes"
                bars.append(Bar(f"against {title}, {how}", ratio(found[name][0], own), 5.0, "times faster", True))
    return bars


def _row(name: str, times: Times, counted: Tally, own: Times) -> tuple[str, ...]:
    how = (selection_peers.METHODS[name].__doc__ or "") if name in selection_peers.METHODS else ""
    documented = OURS.get(name) or how.removeprefix("Run ").rstrip(".")
    return (
        documented,
        seconds(times.median),
        seconds(times.least),
        figure(ratio(times, own)),
        f"{counted.found} of {counted.true}",
        str(counted.false),
        f"{counted.right} of {counted.rigs}",
    )


def _choices(rigs: Sequence[Matrix], found: Mapping[str, tuple[Times, list[Entries]]]) -> list[tuple[str, ...]]:
    return [
        (rig.rig, *(_named(entries) for entries in (rig.true, found["tracer"][1][i], found["whole"][1][i])))
        for i, rig in enumerate(rigs)
    ]


def _named(entries: Entries) -> str:
    return ", ".join(f"{name} {axis}" for name, axis in sorted(entries)) or "nothing"


def _sysidentpy_version() -> str:
    ask = "from importlib.metadata import version as v; print('sysidentpy', v('sysidentpy'), 'on numpy', v('numpy'))"
    done = subprocess.run([peer_python("sysidentpy"), "-c", ask], capture_output=True, text=True, check=False, cwd=ROOT)
    return done.stdout.strip() or "sysidentpy not installed"
