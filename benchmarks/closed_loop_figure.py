"""Draw docs/figures/closed-loop-identifier.svg: both methods in the scenario closed_loop, one of them to wrong values.

    python -m benchmarks.closed_loop_figure

The units run in their FMUs: exciter on top of the PID, encoders on, the plant of Table 2.
"""

import numpy as np

from benchmarks.cost_figures import FOLDER
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR
from heli_identifier.results.style import AFTER, BEFORE, MUTED, canvas, key, styled, write_figure
from heli_plant.parameters import TABLE_2

DURATION, STEP = 120.0, 0.01

SHOWN = (("k_x", "rad/s²/V"), ("a_e", "1/s²"), ("k_z", "rad/s²/V"))

ORDER = {
    "plant.encoder.enabled": True,
    "exciter.excitation.experiment": 3,
    "exciter.multisine.rms_difference": 0.15,
    "exciter.multisine.rms_sum": 0.3,
    "controller.reference.elevation": 0.15,
}
"""A multisine of a quarter of a volt on top of the controller's voltages, the elevation held at .15 rad."""


def histories():
    """Run the scenario with both methods; give the time [s] and by method the columns of the identifier."""
    from fmu_src.master import run_apart

    names = [f"identifier.{kind}{name}" for name, _ in SHOWN for kind in ("", "standard_error.")]
    results = {
        method: run_apart("closed_loop", DURATION, STEP, {**ORDER, "identifier.method": method}, record=names)
        for method in (ADAPTATION, PREDICTION_ERROR)
    }
    time = next(iter(results.values())).time
    return time, {method: {name: result.column(name) for name in names} for method, result in results.items()}


@styled
def figure(time, columns):
    """Estimates over time with their 95 % bands; the truth as a line."""
    drawing, axes = canvas(7.0, 6.0, heights=[1.0] * len(SHOWN), space=0.25)
    from_second = time > 12.0
    for axis, (name, unit) in zip(axes, SHOWN, strict=True):
        for method, colour, label in (
            (ADAPTATION, BEFORE, "adaptation (7)"),
            (PREDICTION_ERROR, AFTER, "prediction errors"),
        ):
            value = columns[method][f"identifier.{name}"][from_second]
            half = 1.96 * columns[method][f"identifier.standard_error.{name}"][from_second]
            axis.fill_between(time[from_second], value - half, value + half, color=colour, alpha=0.18, linewidth=0)
            axis.plot(time[from_second], value, color=colour, linewidth=1.2, label=label)
        truth = getattr(TABLE_2, name)
        axis.axhline(truth, color=MUTED, linewidth=1.0, linestyle="--", label="truth")
        axis.set_ylabel(f"{name} [{unit}]")
        axis.set_ylim(min(-0.2 * abs(truth), 0.0), 1.8 * truth)
    axes[-1].set_xlabel("time [s]")
    key(axes[0], 3)
    return drawing


def main():
    time, columns = histories()
    every = slice(None, None, 50)
    thin = {method: {name: values[every] for name, values in one.items()} for method, one in columns.items()}
    write_figure(figure(np.asarray(time)[every], thin), FOLDER / "closed-loop-identifier.svg")
    for method, one in columns.items():
        found = ", ".join(
            f"{name} {one[f'identifier.{name}'][-1]:.3f} +- {1.96 * one[f'identifier.standard_error.{name}'][-1]:.3f}"
            for name, _ in SHOWN
        )
        print(f"{method}: {found}")


if __name__ == "__main__":
    main()
