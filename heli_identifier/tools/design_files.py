"""A design as files: its page, tables and figures, and MATLAB files with the names of the course's script.

The page shows steps over the plants that the data allow, the margins of these plants, and the poles.

The course writes, with V_s = v_front + v_rear and V_d = v_front - v_rear about the hover V_s0,

    p'' = K_1 V_d,    e'' = K_2 V_s,    lambda'' = K_3 p
    K_1 = l_p K_f / J_p,    K_2 = l_h K_f / J_e,    K_3 = -l_h K_f V_s0 / J_lambda

The corrected script keeps the lengths and J_e of the student, and gives K_f, J_p and J_lambda the values with which
these equations have the identified gains: effective inertias, in which the slope of the thrust is contained.

Source: laboratory of TTK4115 Linear System Theory, NTNU, "Helicopter lab assignment", parts I to III.
"""

import ast
import math
import operator
import re
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heli_identifier.errors import ConfigurationError, refuse
from heli_identifier.files import read_limited
from heli_identifier.online import Estimate
from heli_identifier.provenance import provenance
from heli_identifier.results import Axes, ParameterSet, Table, figure, join_words, render, to_digits
from heli_identifier.tools.judging import CONFIDENCE, Design, Judged
from heli_identifier.tools.linearisation import STATES, LinearModel, OperatingPoint, linear_system
from heli_identifier.tools.margins import LOOPS
from heli_plant.geometry import Geometry
from heli_plant.state_feedback import FeedbackSettings

_SHOWN = 40.0  # largest pole [1/s] that is drawn: faster poles say nothing about the flight

LARGEST_MB = 1.0  # size of a script [MB]

_HOVER = re.compile(r"v_?s_?(0|star|eq|hover)|hover_voltage", re.IGNORECASE)
"""Names that scripts give to the sum of the voltages at the hover."""

_ASSIGNMENT = re.compile(r"(?:^|;)\s*([A-Za-z]\w*)\s*=(?!=)\s*([^;\n]*)", re.MULTILINE)
_OPERATORS: dict[type, Any] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
_FUNCTIONS = {name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "exp")} | {"_": float}
_FROM_ROTORS = np.array([[1.0, 1.0], [1.0, -1.0]])
"""(V_s, V_d) of (v_front, v_rear); half of it gives (v_front, v_rear) of (V_s, V_d)."""


def design_table(design: Design) -> Table:
    """Return margins, settling times and stable loops of both designs: of the estimated plant, and what plants keep."""
    titles = {"disk": "disk margin, both rotors"}
    for loop in LOOPS:
        titles |= {f"{loop}.gain": f"{loop} loop: gain margin", f"{loop}.phase": f"{loop} loop: phase margin [deg]"}
    titles |= {f"{axis}.settling": f"{axis}: settles in [s]" for axis in design.axes}
    rows = []
    for name, title in titles.items():
        figures = [judged.figures[name] for judged in design.by_name.values()]
        rows.append((title, *(_figure_text(value) for x in figures for value in (x.value, x.promised))))
        if name.endswith("settling"):
            slowest = title.replace("settles", "slowest plant settles")
            rows.append((slowest, *(text for x in figures for text in ("", _figure_text(x.worst)))))
    shares = (text for x in design.by_name.values() for text in ("", _figure_text(100.0 * x.stable_share)))
    rows.append(("plants with a stable loop [%]", *shares))
    what = f"what {100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants keep"
    title = f"{design.kind.upper()} of {join_words(design.axes)}: {what}"
    return Table(title, ("figure", *(head for name in design.by_name for head in (name, "kept"))), rows)


def _figure_text(value: float) -> str:
    return to_digits(value) if math.isfinite(value) else "none"


def margin_table(design: Design) -> Table:
    """Return the margins of the present and the retuned PID with their intervals over the plants, and their steps."""
    rows = []
    for name, judged in design.by_name.items():
        for step in judged.steps:
            gains = ", ".join(to_digits(gain, 4) for gain in getattr(judged.settings, step.axis))
            margins = []
            for margin_name, digits in (("gain", 2), ("phase", 0), ("sensitivity", 2)):
                margin = judged.figures[f"{step.axis}.{margin_name}"]
                value, low, high = (f"{x:.{digits}f}" for x in (margin.value, *margin.interval))
                margins.append(f"{value} ({low} to {high})".replace("inf", "∞"))
            settled = to_digits(step.settling_time, 2)
            rows.append((step.axis, name, gains, *margins, f"{100.0 * step.overshoot:.0f}", settled))
    columns = ("loop", "PID", "P, I, D", "gain margin", "phase [deg]", "sensitivity", "overshoot [%]", "settles [s]")
    return Table("Margins with their 95 % intervals over the plants that the data allow", columns, rows)


def controller_html(design: Design) -> str:
    """Return the text of design.html: steps, distribution of the disk margin, poles with the estimated plant."""
    promises = [f"{x.figures['disk'].promised:.2f} with the {name} design" for name, x in design.by_name.items()]
    margins, poles = Axes("plants [%]"), Axes("imaginary part [1/s]")
    for (name, judged), role in zip(design.by_name.items(), ("before", "after"), strict=False):
        disks, slow = np.sort(judged.disks), judged.poles[np.abs(judged.poles) < _SHOWN]
        margins.line(disks, 100.0 * np.arange(1, len(disks) + 1) / len(disks), role, name)
        poles.points(slow.real, slow.imag, role, name)
    return render(
        "design.html.j2",
        title=f"{design.kind.upper()} of {join_words(design.axes)}",
        provenance=provenance(),
        sentence=f"{100.0 * CONFIDENCE:.0f} % of {len(design.plants.drawn)} plants that the data allow keep a disk "
        f"margin of {join_words(promises)}.",
        design=design,
        table=design_table(design),
        steps=step_figure(design),
        margins=figure([margins], "disk margin of at most", "Distribution of the disk margin over the plants"),
        poles=figure([poles], "real part [1/s]", "Poles of the closed loops"),
    )


def step_figure(design: Design) -> str:
    """Draw the steps of all controllers, a panel per axis, over the band of 95 % of the plants with the last one."""
    *_, (last, judged) = design.by_name.items()
    panels = []
    for number, step in enumerate(judged.steps):
        low, high = step.size * judged.band[step.axis]
        panel = Axes(f"{step.axis} [rad]", limits=(-step.size, 2.5 * step.size))  # drawn plants may be unstable
        panel.band(np.arange(len(low)) * design.plants.model.sampled.dt, low, high, f"95 % of the plants, {last}")
        panel.level(step.size, "muted")
        for (name, controller), role in zip(design.by_name.items(), ("before", "after"), strict=False):
            panel.line(controller.steps[number].time, controller.steps[number].angle, role, name)
        panels.append(panel)
    names = " and ".join(design.by_name)
    return figure(panels, "time since the step of the reference [s]", f"Steps, {names}", 1100.0)


# --- the course's script ----------------------------------------------------------------------------------------------


def course_values(script: Path | None) -> dict[str, float]:
    """Read the numbers that a MATLAB script assigns; matrices and calls of other functions are left out.

    The script is not run. Numbers, names that were assigned before, ``+ - * / ^``, brackets and a few functions are
    evaluated. ConfigurationError if the file cannot be read or assigns no number, or a mass or length is none.
    """
    values: dict[str, float] = {}
    advice = "; give the course's init_heli.m"
    data = read_limited(script, LARGEST_MB, ConfigurationError, advice) if script else b""
    text = re.sub("%.*", "", data.decode("utf-8", errors="replace"))
    for match in _ASSIGNMENT.finditer(text):
        name, assigned = match[1], match[2].strip()
        marked = re.sub(r"(\^[\s+-]*)\(", r"\1_(", assigned)  # brackets after ^ become a call, so the tree shows them
        expression = marked.replace("^", "**").replace(".*", "*").replace("./", "/")
        try:
            value = _evaluate(ast.parse(expression, mode="eval").body, {**values, "pi": math.pi})
            if not math.isfinite(value):
                raise ValueError
            values[name] = value
        except (SyntaxError, ValueError, KeyError, TypeError, ArithmeticError, RecursionError) as error:
            if name in Geometry.__dataclass_fields__:
                line = text.count("\n", 0, match.start(1)) + 1
                raise ConfigurationError(
                    f"{script}, line {line}: {name} = {assigned} is no number; write one, as {name} = 0.5."
                ) from error
    refuse(script is not None and not values, f"{script} assigns no number{advice}.")
    return values


def _evaluate(node: ast.expr, known: Mapping[str, float]) -> float:
    """Evaluate an expression; anything but arithmetic raises KeyError or TypeError."""
    match node:
        case ast.Constant(int() | float() as number):
            return float(number)
        case ast.Name(name):
            return known[name]
        case ast.UnaryOp(operation, operand):
            return float(_OPERATORS[type(operation)](_evaluate(operand, known)))
        # MATLAB reads a^b^c, and a^-b^c, from the left, Python's ** from the right
        case ast.BinOp(a, ast.Pow() as power, ast.BinOp(b, ast.Pow(), c)):
            return _evaluate(ast.BinOp(ast.BinOp(a, power, b), power, c), known)
        case ast.BinOp(a, ast.Pow() as power, ast.UnaryOp(sign, ast.BinOp(b, ast.Pow(), c))):
            return _evaluate(ast.BinOp(ast.BinOp(a, power, ast.UnaryOp(sign, b)), power, c), known)
        case ast.BinOp(left, operation, right):
            return float(_OPERATORS[type(operation)](_evaluate(left, known), _evaluate(right, known)))
        case ast.Call(ast.Name(name), [argument]):
            return float(_FUNCTIONS[name](_evaluate(argument, known)))
    raise TypeError


def corrected_values(parameters: ParameterSet, model: LinearModel, geometry: Geometry) -> dict[str, Estimate]:
    """Return the course's quantities by the rig; force and inertias only if masses and lengths are known."""

    def times(x: Estimate, factor: float) -> Estimate:
        return Estimate(factor * x.value, x.standard_error and abs(factor) * x.standard_error, "")

    J, lift, l_h, l_p = geometry.inertias, model.point.lift, geometry.l_h, geometry.l_p
    A = linear_system(model.plant, model.point).A  # gains as slopes at the operating point; columns 6, 7: rotors
    slopes = (0.5 * (A[3, 6] - A[3, 7]), 0.5 * (A[4, 6] + A[4, 7]), A[5, 0])
    gains = (parameters.values[f"{axis}.gain"] for axis in ("pitch", "elevation", "travel"))
    K_1, K_2, K_3 = (times(gain, float(slope) / gain.value) for gain, slope in zip(gains, slopes, strict=True))
    values = {"K_1": K_1, "K_2": K_2, "K_3": K_3, "V_s0": Estimate(lift, None, "V")}
    if J is None or l_h is None or l_p is None:
        return values
    K_f = times(K_2, J["J_e"] / l_h)
    J_p, J_lambda = l_p * K_f.value / K_1.value, l_h * K_f.value * lift / abs(K_3.value)
    inertias = {"J_e": J["J_e"], "J_p": J_p, "J_lambda": J_lambda}
    return values | {"K_f": K_f} | {name: Estimate(inertia, None, "kg m^2") for name, inertia in inertias.items()}


def corrected_init(
    parameters: ParameterSet, model: LinearModel, values: Mapping[str, float], stated: Geometry, script: str | None
) -> str:
    """Return the text of init_heli_corrected.m for a plant and its linear model at the operating point.

    ``values`` are those of a ``script``, if there is one (:func:`course_values`). Masses, lengths and hover that the
    script does not assign are as ``stated`` by the rig's configuration; the course's equations give other values.
    """
    renamed = {"hover_voltage" if _HOVER.fullmatch(name) else name: value for name, value in values.items()}
    geometry = replace(stated, **{name: renamed[name] for name in asdict(stated) if name in renamed})
    V_s0, J, l_h, l_p = geometry.hover_voltage, geometry.inertias, geometry.l_h, geometry.l_p
    K_f = values.get("K_f", geometry.force_per_volt)
    nominal = {"V_s0": V_s0, "K_f": K_f, **(J or {})}
    if J and K_f is not None and l_p is not None and l_h is not None:
        nominal |= {"K_1": l_p * K_f / J["J_p"], "K_2": l_h * K_f / J["J_e"]}
        nominal["K_3"] = None if V_s0 is None else -l_h * K_f * V_s0 / J["J_lambda"]
    rig, rows = corrected_values(parameters, model, geometry), []
    for name, x in rig.items():
        value = values.get(name, nominal.get(name)) if name != "V_s0" else V_s0
        half_width = f" +- {to_digits(1.96 * x.standard_error, 2)}" if x.standard_error else ""
        difference = f"{100.0 * (x.value / value - 1.0):+.0f} %" if value else ""
        rows.append((name, "" if value is None else to_digits(value), f"{to_digits(x.value)}{half_width}", difference))
    point, system = model.point, linear_system(model.plant, model.point)
    return _script(
        "init_heli_corrected.m.j2",
        point,
        script=script,
        rig=rig,
        table=Table("", ("name", "your script says", "the rig says", "differs by"), rows),
        lengths={name: value for name, value in asdict(geometry).items() if value and name != "hover_voltage"},
        system=system,
        B=system.B @ (0.5 * _FROM_ROTORS),
        x0=[*point.state(model.plant)[:8], *[0.0] * (system.nstates - 8)],
        input_delay=model.plant.input_delay_rotors,
    )


def controller_m(design: Design) -> str:
    """Return the text of controller.m: the nominal design, whose names end with ``_nominal``, then the robust design.

    A state feedback has the course's inputs (V_s, V_d); it comes sampled and, with the same weights, continuous.
    """
    robust, designs = design.robust, list[tuple[Judged, str, str]]()
    for name, judged in design.by_name.items():
        delivered = replace(judged, settings=design.flown) if judged is robust else judged
        designs.append((delivered, name, "" if judged is robust else f"_{name}"))
    point = design.plants.model.point
    return _script("controller.m.j2", point, design=design, designs=designs, confidence=CONFIDENCE, matrices=_matrices)


def _script(template: str, point: OperatingPoint, **parts: Any) -> str:
    return render(template, point=point, held=_FROM_ROTORS @ (point.v_front, point.v_rear), states=STATES, **parts)


def _matrices(settings: FeedbackSettings) -> dict[str, NDArray[np.float64]]:
    """Return the matrices of a state feedback by the symbols of its equations, for the inputs (V_s, V_d)."""
    return {
        "K": _FROM_ROTORS @ np.array(settings.gain),
        "K_z": _FROM_ROTORS @ np.array(settings.integral),
        "N": _FROM_ROTORS @ np.array(settings.reference),
        "F": np.array(settings.transition),
        "G": np.array(settings.drive) @ (0.5 * _FROM_ROTORS),
        "L": np.array(settings.innovation),
    }
