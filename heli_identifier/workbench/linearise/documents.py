"""A control design as files: JSON, MATLAB, and a parameter set of the PidController."""

import io
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from scipy.io import savemat

from heli_identifier.online import Estimate
from heli_identifier.workbench.delivery.diagnosis_document import plain
from heli_identifier.workbench.delivery.parameter_set import ParameterSet
from heli_identifier.workbench.linearise.design import Design, Loop
from heli_identifier.workbench.linearise.margins import LOOPS

SCHEMA = "heli-linear-model/1"
CONTROLLER = "PidController"
_UNITS = {"proportional": "V/rad", "integral": "V/(rad s)", "derivative": "V s/rad"}


def design_document(made: Design, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of linear_model.json; null stands for an infinite value."""
    continuous, sampled = made.model.continuous, made.model.sampled
    return plain(
        {
            "schema": SCHEMA,
            "operating_point": asdict(made.model.point),
            "states": continuous.state_labels,
            "inputs": continuous.input_labels,
            "outputs": continuous.output_labels,
            "input_delay_s": made.model.input_delay,
            "continuous": {key: getattr(continuous, key) for key in "ABCD"},
            "intervals": {
                "A": {"low": made.A_interval[0], "high": made.A_interval[1]},
                "B": {"low": made.B_interval[0], "high": made.B_interval[1]},
            },
            "sampled": {"F": sampled.A, "G": sampled.B, "C": sampled.C, "D": sampled.D, "period_s": sampled.dt},
            "loops": {"before": _loop(made.before), "after": _loop(made.after)},
            "notes": made.notes,
            "provenance": provenance,
        }
    )


def _loop(loop: Loop) -> dict[str, Any]:
    return {
        "gains": {axis: getattr(loop.settings, axis)._asdict() for axis in LOOPS},
        "trim_V": loop.settings.trim,
        "stable_share": loop.stable,
        "margins": {
            name: {
                key: {"value": value, "interval": [getattr(loop.low[name], key), getattr(loop.high[name], key)]}
                for key, value in asdict(found).items()
            }
            for name, found in loop.margins.items()
        },
        "steps": {
            step.axis: {"size_rad": step.size, "overshoot": step.overshoot, "settling_time_s": step.settling_time}
            for step in loop.steps
        },
    }


def matlab_bytes(made: Design) -> bytes:
    """Return the matrices as a MATLAB file: A, B, C, D continuous, F, G sampled every ``period``, intervals."""
    model, continuous, sampled, out = made.model, made.model.continuous, made.model.sampled, io.BytesIO()
    savemat(
        out,
        {
            **{key: getattr(continuous, key) for key in "ABCD"}, "F": sampled.A, "G": sampled.B, "period": sampled.dt,
            "A_low": made.A_interval[0], "A_high": made.A_interval[1],
            "B_low": made.B_interval[0], "B_high": made.B_interval[1],
            "states": continuous.state_labels, "inputs": continuous.input_labels, "outputs": continuous.output_labels,
            "operating_point": asdict(model.point), "input_delay": model.input_delay,
        },
    )  # fmt: skip
    return out.getvalue()


def controller_parameters(made: Design, provenance: Mapping[str, Any]) -> ParameterSet:
    """Return the retuned PID as a parameter set that ``heli build PidController --parameters`` takes."""
    settings, point = made.after.settings, made.model.point
    values = {
        f"{axis}.{gain}": Estimate(getattr(getattr(settings, axis), gain), None, unit)
        for axis in LOOPS
        for gain, unit in _UNITS.items()
    }
    values["trim"] = Estimate(settings.trim, None, "V")
    values["reference.pitch"] = Estimate(point.pitch, None, "rad")
    values["reference.elevation"] = Estimate(point.elevation, None, "rad")
    return ParameterSet(CONTROLLER, values, provenance=provenance)
