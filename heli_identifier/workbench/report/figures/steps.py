"""Step responses of the closed loop before and after the PID was retuned."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from heli_identifier.workbench.linearise.step_response import StepResponse
from heli_identifier.workbench.report.figures.style import AFTER, BEFORE, MUTED, canvas, key, styled


@styled
def step_figure(before: Sequence[StepResponse], after: Sequence[StepResponse]) -> Figure:
    """Draw the responses of every axis, the present PID's and the retuned one's."""
    figure, axes = canvas(6.0, 0.8 + 2.0 * len(before), heights=[1.0] * len(before), space=0.22)
    for one, old, new in zip(axes, before, after, strict=True):
        one.axhline(old.size, color=MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
        one.plot(old.time, old.angle, color=BEFORE, label="present PID")
        one.plot(new.time, new.angle, color=AFTER, label="retuned PID")
        one.set_ylabel(f"{old.axis} [rad]")
    key(axes[0], 2)
    axes[-1].set_xlabel("time since the step of the reference [s]")
    axes[-1].margins(x=0.01)
    return figure
