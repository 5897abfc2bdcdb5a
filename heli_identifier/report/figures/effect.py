"""A found effect as a picture: the torque that the model leaves, against the variable that it follows."""

from matplotlib.figure import Figure

from heli_identifier.diagnosis.result import EffectCurve
from heli_identifier.report.figures.style import AFTER, BAND, MEASURED, canvas, key, styled
from heli_identifier.report.rounding import unit_text
from heli_identifier.report.sentences import variable_name


@styled
def effect_figure(curve: EffectCurve) -> Figure:
    """Draw the partial residual torque with the fitted law and its 95 % band."""
    figure, (axes,) = canvas(5.2, 3.3)
    x, y, low, high = curve.curve.T
    axes.fill_between(x, low, high, color=BAND, alpha=0.7, linewidth=0, label="95 % band")
    law = "fitted curve" if curve.name == "unknown" else curve.name.replace("_", " ")
    axes.plot(x, y, color=AFTER, linewidth=2.0, label=law)
    if len(curve.points):
        axes.plot(*curve.points.T, "o", color=MEASURED, markersize=4.5, label="data")
    axes.set_xlabel(f"{variable_name(curve.variable)} [{unit_text(curve.unit) or '1'}]")
    axes.set_ylabel("torque per inertia [rad/s²]")
    key(axes, 3)
    return figure
