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
from heli_identifier.workbench.linearise.linear_model import INPUTS
from heli_plant.effects import AXES

SCHEMA = "heli-linear-model/1"
CONTROLLER = "PidController"
_UNITS = {
    "pitch": ("V/rad", "V/(rad s)", "V s/rad"),
    "elevation": ("V/rad", "V/(rad s)", "V s/rad"),
}
_GAINS = ("proportional", "integral", "derivative")


def design_document(made: Design, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Give the content of linear_model.json; null stands for what is infinite."""
    model = made.model
    return plain(
        {
            "schema": SCHEMA,
            "operating_point": asdict(model.point),
            "states": model.states,
            "inputs": INPUTS,
            "outputs": AXES,
            "input_delay_s": model.input_delay,
            "continuous": {"A": model.A, "B": model.B, "C": model.C, "D": model.D},
            "intervals": {
                "A": {"low": made.A_interval[0], "high": made.A_interval[1]},
                "B": {"low": made.B_interval[0], "high": made.B_interval[1]},
            },
            "sampled": {"F": model.F, "G": model.G, "C": model.C, "D": model.D, "period_s": model.period},
            "loops": {"before": _loop(made.before), "after": _loop(made.after)},
            "notes": made.notes,
            "provenance": provenance,
        }
    )


def _loop(loop: Loop) -> dict[str, Any]:
    return {
        "gains": {axis: getattr(loop.settings, axis)._asdict() for axis in _UNITS},
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
    """Give the matrices as a MATLAB file: A, B, C, D continuous, F, G sampled every ``period``, intervals."""
    model, out = made.model, io.BytesIO()
    savemat(
        out,
        {
            "A": model.A, "B": model.B, "C": model.C, "D": model.D, "F": model.F, "G": model.G, "period": model.period,
            "A_low": made.A_interval[0], "A_high": made.A_interval[1],
            "B_low": made.B_interval[0], "B_high": made.B_interval[1],
            "states": list(model.states), "inputs": list(INPUTS), "outputs": list(AXES),
            "operating_point": asdict(model.point), "input_delay": model.input_delay,
        },
    )  # fmt: skip
    return out.getvalue()


def controller_parameters(made: Design, provenance: Mapping[str, Any]) -> ParameterSet:
    """Give the retuned PID as a parameter set that ``heli build PidController --parameters`` takes."""
    settings, point = made.after.settings, made.model.point
    values = {
        f"{axis}.{gain}": Estimate(getattr(getattr(settings, axis), gain), None, unit)
        for axis, units in _UNITS.items()
        for gain, unit in zip(_GAINS, units, strict=True)
    }
    values["trim"] = Estimate(settings.trim, None, "V")
    values["reference.pitch"] = Estimate(point.pitch, None, "rad")
    values["reference.elevation"] = Estimate(point.elevation, None, "rad")
    return ParameterSet(CONTROLLER, values, provenance=provenance)
