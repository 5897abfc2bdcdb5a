"""A found effect as a picture: the torque that the model leaves, against the variable that it follows, or its line."""

from matplotlib.figure import Figure

from heli_identifier.results.figure_held_out import power_density
from heli_identifier.results.style import AFTER, BAND, MEASURED, canvas, key, styled
from heli_identifier.results.words import power_text, significant, unit_text, variable_name
from heli_identifier.tracing import EffectCurve, HeldOutSeries
from heli_plant.effects import AXES


@styled
def effect_figure(curve: EffectCurve) -> Figure:
    """Draw the partial residual torque with the fitted law and its 95 % band."""
    figure, (axes,) = canvas(5.2, 3.3)
    x, y, low, high = curve.curve.T
    axes.fill_between(x, low, high, color=BAND, alpha=0.7, linewidth=0, label="95 % band")
    law = curve.name.replace("_", " ") if len(curve.points) else "fitted curve"
    axes.plot(x, y, color=AFTER, linewidth=2.0, label=law)
    if len(curve.points):
        axes.plot(*curve.points.T, "o", color=MEASURED, markersize=4.5, label="data")
    axes.set_xlabel(f"{variable_name(curve.variable)} [{unit_text(curve.unit) or '1'}]")
    axes.set_ylabel("torque per inertia [rad/s²]")
    key(axes, 3)
    return figure


@styled
def line_figure(series: HeldOutSeries, axis: str, frequency: float) -> Figure:
    """Draw the spectrum of an axis's residual on a held-out log around a periodic torque of ``frequency`` [Hz]."""
    residual = series.residual_after[:, AXES.index(axis)]
    found, power = power_density(residual, series.residual_step, len(residual))
    near = (found >= 0.1 * frequency) & (found <= 10.0 * frequency)
    figure, (axes,) = canvas(5.2, 3.3)
    axes.axvline(frequency, color=BAND, linewidth=5.0, label=f"{significant(frequency)} Hz")
    axes.semilogy(found[near], power[near], color=AFTER, linewidth=1.0, label="innovations")
    axes.yaxis.set_major_formatter(power_text)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("innovations, standardised [1/Hz]")
    key(axes, 2)
    return figure
