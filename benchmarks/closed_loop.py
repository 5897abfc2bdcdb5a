"""The on-line identifier in closed loop: generated rigs with truth, every method, and its own standard errors.

    python -m benchmarks.closed_loop            the rigs that figures are reported on
    python -m benchmarks.closed_loop --tuning   the rigs that the method and its constants were chosen on

Per setting (sampling rate, noise, motors' lag) twelve rigs (:mod:`benchmarks.closed_loop_rigs`), five logs each; the
logs of a rig are combined as `heli identify` does. Printed are, for each method, k_z, a_e and k_x over the truth in the
median with the range, the share of 95 % intervals that cover over the eight parameters, and the same over those that
the data determine by the method's own intervals (:func:`heli_identifier.online.determined`). With ``--single`` every
log is judged by itself.
"""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from benchmarks.closed_loop_methods import Axis, generalised, instrumental, named
from benchmarks.closed_loop_rigs import ClosedLoopRig, closed_loop_rigs
from benchmarks.native_identifier import Units, built_units
from benchmarks.tables import table
from fmu_src.variables import Value
from heli_identifier.online import ADAPTATION, PREDICTION_ERROR, Estimate, IdentifierSettings
from heli_identifier.records import RigConfiguration
from heli_identifier.tools.identification import begun_at, combined, identify_log, settings_for

JUDGED = ("a_wx", "a_th", "k_x", "a_wz", "a_e", "k_z", "a_wy", "k_y")
SHOWN = ("k_z", "a_e", "k_x")
REPORTED, TUNING = 2, 1
"""Seeds of the two halves of the rigs."""

SETTINGS = (
    ("100 Hz", {}),
    ("500 Hz", {"rate": 500.0}),
    ("100 Hz, noise x 3", {"noise": 3.0}),
    ("500 Hz, noise x 3", {"rate": 500.0, "noise": 3.0}),
    ("100 Hz, lag .12 s, .08 s assumed", {"lag": 0.12}),
)

Estimates = Mapping[str, Estimate]


def adaptation(frequency: float) -> Callable[[ClosedLoopRig], Estimates]:
    def found(rig: ClosedLoopRig) -> Estimates:
        histories = [
            identify_log(log, settings_for(log, RigConfiguration(), frequency, method=ADAPTATION)) for log in rig.logs
        ]
        return combined(histories).estimates

    return found


def prediction_error(rig: ClosedLoopRig) -> Estimates:
    """As `heli identify` does: two passes, the motors' lag estimated."""

    def settings(log) -> IdentifierSettings:
        return settings_for(log, RigConfiguration(), method=PREDICTION_ERROR)

    first = [identify_log(log, settings(log)) for log in rig.logs]
    return combined([identify_log(log, begun_at(settings(log), first)) for log in rig.logs]).estimates


def in_unit(units: Units, **parameters: Value) -> Callable[[ClosedLoopRig], Estimates]:
    """As the unit does, in its native twin: one pass."""

    def found(rig: ClosedLoopRig) -> Estimates:
        given = {"method": PREDICTION_ERROR, "report__interval": 0.5, **parameters}
        return _together([units.last(log, **given) for log in rig.logs])

    return found


def _together(results: list[dict[str, Estimate]]) -> Estimates:
    """Combine logs by the inverse squares of their standard errors, with the Birge ratio, as `heli identify` does."""
    found = {}
    for name in JUDGED:
        values = np.array([one[name].value for one in results])
        weights = np.array([one[name].standard_error for one in results], dtype=float) ** -2.0
        mean = float(weights @ values / weights.sum())
        ratio = float(np.sqrt(weights @ (values - mean) ** 2 / max(len(values) - 1, 1)))
        found[name] = Estimate(mean, float(weights.sum() ** -0.5) * max(1.0, ratio), "")
    return found


def _estimates(axes: list[Axis]) -> dict[str, Estimate]:
    values, errors = named(axes)
    return {name: Estimate(value, errors[name], "") for name, value in values.items()}


def gls(rig: ClosedLoopRig) -> Estimates:
    return _together([_estimates(generalised(log, 3.0, 10)) for log in rig.logs])


def iv(rig: ClosedLoopRig) -> Estimates:
    return _together([_estimates(instrumental(log, r)) for log, r in zip(rig.logs, rig.outside, strict=True)])


def methods(units: Units, only_unit: bool) -> dict[str, Callable[[ClosedLoopRig], Estimates]]:
    """Return the methods by their titles; with ``only_unit`` those of the unit's prediction errors."""
    own: dict[str, Callable[[ClosedLoopRig], Estimates]] = {
        "prediction errors, unit: one pass, lag given": in_unit(units, motor__lag_known=True),
        "prediction errors, unit: one pass, lag estimated": in_unit(units),
    }
    if only_unit:
        return own
    return {
        "adaptation (7), omega_f = 1 rad/s": adaptation(1.0),
        "adaptation (7), omega_f = 3 rad/s": adaptation(3.0),
        "least squares, autoregression of the residual": gls,
        "instrumental variables, joystick's part known": iv,
        **own,
        "prediction errors, `heli identify`": prediction_error,
    }


def judged(rigs: list[ClosedLoopRig], method: Callable[[ClosedLoopRig], Estimates]) -> tuple[str, ...]:
    """Cells of a row of the table."""
    shares: dict[str, list[float]] = {name: [] for name in SHOWN}
    covered, determined = [], []
    for rig in rigs:
        found = method(rig)
        for name in JUDGED:
            truth, estimate = getattr(rig.truth, name), found[name]
            low, high = estimate.interval
            covered.append(low <= truth <= high)
            if estimate.is_determined:
                determined.append(covered[-1])
                if name in SHOWN:
                    shares[name].append(estimate.value / truth)
    cells = [
        f"{np.median(shares[name]):.3f} ({min(shares[name]):.3f} to {max(shares[name]):.3f}), {len(shares[name])}"
        if shares[name]
        else "none"
        for name in SHOWN
    ]
    return (*cells, f"{100 * np.mean(covered):.0f} %", f"{100 * np.mean(determined):.0f} % of {len(determined)}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closed_loop")
    parser.add_argument("--tuning", action="store_true", help="the other half of the rigs")
    parser.add_argument("--setting", type=int, action="append", help="one of the settings, by number; repeatable")
    parser.add_argument("--unit", action="store_true", help="only the unit's prediction errors, in its native twin")
    parser.add_argument("--single", action="store_true", help="every log by itself, as if it were a rig's only one")
    chosen = parser.parse_args()
    with built_units() as units:
        _print(chosen, methods(units, chosen.unit))


def _print(chosen: argparse.Namespace, methods: Mapping[str, Callable[[ClosedLoopRig], Estimates]]) -> None:
    head = ("method", *(f"{name} over truth, rigs" for name in SHOWN), "covering", "covering where determined")
    for number, (title, settings) in enumerate(SETTINGS):
        if chosen.setting and number not in chosen.setting:
            continue
        rigs = closed_loop_rigs(TUNING if chosen.tuning else REPORTED, **settings)
        if chosen.single:
            rigs = [
                replace(rig, logs=(log,), outside=(own,))
                for rig in rigs
                for log, own in zip(rig.logs, rig.outside, strict=True)
            ]
        rows = [(name, *judged(rigs, method)) for name, method in methods.items()]
        print(f"{title}\n\n{table(head, rows)}\n", flush=True)


if __name__ == "__main__":
    main()
