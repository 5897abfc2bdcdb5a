"""Pictures of the documentation, drawn again by ``make docs``: ``python -m benchmarks figures [NAME...]``.

They go to docs/figures: the two methods of the identifier in the scenario closed_loop, which is run; the report of
rig-a as Chromium shows it, where there is one; and from the tables in docs/results, which ``python -m benchmarks
measured --csv``, ``windy --csv`` and ``windy`` and ``blind --strength`` write: errors before and after a diagnosis on
measured rigs, gains over the truth, and the share of effects that are shown against what a fit that is told the
structure gains by them.
"""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas

from benchmarks.harness import ROOT, Words, share
from benchmarks.rigs import DETECTABLE
from fmu_src.master import run_apart
from heli_identifier.files import write_atomically
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR
from heli_identifier.records import demo_files
from heli_identifier.results import Axes, diagnose, figure, figure_file
from heli_identifier.results.report import report_page
from heli_plant.parameters import TABLE_2

TABLES, FIGURES = ROOT / "docs" / "results", ROOT / "docs" / "figures"

SHOWN = (("k_x", "rad/s²/V"), ("a_e", "1/s²"), ("k_z", "rad/s²/V"))

ORDER = {
    "plant.encoder.enabled": True,
    "exciter.excitation.experiment": 3,
    "exciter.multisine.rms_difference": 0.15,
    "exciter.multisine.rms_sum": 0.3,
    "controller.reference.elevation": 0.15,
}
"""A multisine of a quarter of a volt on top of the controller's voltages, the elevation held at .15 rad."""

BINS = (-np.inf, 3.0, 6.0, 8.0, 11.0, 16.0, 32.0, 64.0, np.inf)
"""Bounds of the bins of told scores [nats]; scores below 1 or above 128 are drawn at these limits."""


def identifier() -> str:
    """Draw estimates of both methods over time [s] with their 95 % bands; the truth as a line."""
    names = [f"identifier.{kind}{name}" for name, _ in SHOWN for kind in ("", "standard_error.")]
    methods = ((ADAPTATION, "before", "adaptation (7)"), (PREDICTION_ERROR, "after", "prediction errors"))
    runs = {method: run_apart("closed_loop", 120.0, 0.01, {**ORDER, "identifier.method": method}, record=names)
            for method, *_ in methods}  # fmt: skip
    panels = []
    for name, unit in SHOWN:
        truth = getattr(TABLE_2, name)
        panel = Axes(f"{name} [{unit}]", limits=(min(-0.2 * abs(truth), 0.0), 1.8 * truth))
        for method, role, label in methods:
            run = runs[method]
            late = np.flatnonzero(run.time > 12.0)[::50]
            value, half = (run.column(f"identifier.{kind}{name}")[late] for kind in ("", "standard_error."))
            panel.band(run.time[late], value - 1.96 * half, value + 1.96 * half, role=role)
            panel.line(run.time[late], value, role, label, 1.2)
        panel.level(truth, "muted", "truth")
        panels.append(panel)
    return figure(panels, "time [s]", "Estimates of both methods over time", 640.0)


def before_after(rows: pandas.DataFrame) -> str:
    """Draw errors .2 s ahead on held-out logs by axis: before, after, noise floor."""
    panels = []
    for axis, of_axis in rows[rows.error == ".2 s ahead"].groupby("axis", sort=False):
        rigs = [rig.removeprefix("ntnu-") for rig in of_axis.rig]
        names = [f"{axis}, {rig} {half}" for rig, half in zip(rigs, of_axis.half, strict=True)]
        panel = Axes("", 16.0 * len(of_axis), names=names)
        for role, column in (("before", "before"), ("after", "after"), ("measured", "floor")):
            known = of_axis[column].notna()
            panel.points(of_axis[column][known], np.flatnonzero(known), role, column)
        panels.append(panel)
    return figure(panels, "error .2 s ahead [mrad]", "Errors before and after a diagnosis", 640.0, (0.2, 40.0), True)


def gains(rows: pandas.DataFrame) -> str:
    """Draw gains over the truth with their 95 % intervals, a panel for each kind of rig."""
    panels = []
    for kind, of_kind in rows.groupby("kind", sort=False):
        panel = Axes(f"over the truth, {kind}", 150.0)
        panel.level(1.0, "muted")
        for number, (gain, role) in enumerate((("k_x", "before"), ("k_z", "after"), ("k_y", "measured"))):
            of_gain = of_kind[of_kind.gain == gain]
            places = np.arange(len(of_gain)) + 1.0 + 0.25 * (number - 1)
            for place, ratio, half in zip(places, of_gain.ratio, of_gain.half_width, strict=True):
                panel.line((place, place), (ratio - half, ratio + half), role, width=1.0)
            panel.points(places, of_gain.ratio, role, gain)
        panels.append(panel)
    return figure(panels, "half of the logs of a rig", "Gains of windy rigs with their intervals", 760.0)


def detection(rows: pandas.DataFrame) -> str:
    """Draw the share of effects that are shown, with its 95 % interval, over their told score, in `BINS`."""
    panel = Axes("share shown", limits=(-0.05, 1.05))
    panel.line((DETECTABLE, DETECTABLE), (0.0, 1.0), "muted", width=1.0)
    for battery, role, label, shift in (("blind", "before", "open loop", 0.97), ("windy", "after", "windy air", 1.03)):
        effects = rows[rows.battery == battery]
        for _, in_bin in effects.groupby(pandas.cut(effects.told, BINS), observed=True):
            place = shift * np.exp(np.log(in_bin.told.clip(1.0, 128.0)).mean())
            shown, low, high = share([*in_bin.shown])
            panel.line((place, place), (low, high), role, width=1.0)
            panel.points((place,), (shown,), role, label)
    description = "Share of effects that are shown against the score that a fit gives them which is told the structure"
    return figure([panel], "score of a fit that is told the structure [nats]", description, 640.0, (0.9, 140.0), True)


def report() -> bytes:
    """Return the first screen of the report that `heli demo` writes of rig-a; LookupError without Chromium."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        raise LookupError("Chromium is not installed")
    with TemporaryDirectory() as folder:
        page, picture = Path(folder, "report.html"), Path(folder, "report.png")
        training, held_out = demo_files("rig-a")
        page.write_text(report_page(diagnose(training, held_out=held_out), "rig-a"), encoding="utf-8")
        flags = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--user-data-dir={folder}/own")
        screenshot = (f"--screenshot={picture}", "--window-size=1160,940", page.as_uri())
        subprocess.run([browser, *flags, *screenshot], capture_output=True, check=True)
        return picture.read_bytes()


def from_tables(draw: Callable[[pandas.DataFrame], str], *names: str) -> str:
    """Draw the rows of some tables of docs/results."""
    return figure_file(draw(pandas.concat([pandas.read_csv(TABLES / f"{name}.csv") for name in names])))


DRAWN: dict[str, Callable[[], str | bytes]] = {
    "closed-loop-identifier.svg": lambda: figure_file(identifier()),
    "detection.svg": lambda: from_tables(detection, "strength-windy", "strength-blind"),
    "measured.svg": lambda: from_tables(before_after, "measured"),
    "report.png": report,
    "windy.svg": lambda: from_tables(gains, "windy"),
}
"""Functions that draw the pictures."""


def figures(names: Words) -> None:
    """Draw all pictures, or those that are named."""
    for name in names or DRAWN:
        try:
            write_atomically(FIGURES / name, DRAWN[name]())
        except LookupError as error:
            print(f"{name} is not drawn again: {error}", file=sys.stderr)
