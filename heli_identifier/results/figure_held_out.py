"""Before and after on a held-out log: free run, residual, its spectrum and its autocorrelation."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.mlab import psd
from numpy.typing import NDArray

from heli_identifier.results.style import (
    AFTER,
    BAND,
    BEFORE,
    MEASURED,
    MUTED,
    canvas,
    key,
    styled,
    thinned,
)
from heli_identifier.results.words import power_text
from heli_identifier.tracing import HeldOutSeries
from heli_plant.effects import AXES

LAGS = 50
"""Lags of the autocorrelation: half a second at 100 Hz."""

FARTHEST = 1.0
"""Ranges of the measurement by which a free run is followed beyond it."""

SEGMENT = 1024
"""Samples of a segment of the spectrum: .1 Hz of resolution at 100 Hz."""


@styled
def free_run_figure(series: HeldOutSeries, axis: str) -> Figure:
    """Draw what was measured, what the plant before and after makes of the same voltages, and events as bands."""
    index = AXES.index(axis)
    time, measured = series.log.time, series.log.angles[:, index]
    figure, (above, below) = canvas(heights=(1.6, 1.0))
    above.plot(*thinned(time, measured), color=MEASURED, linewidth=2.4, label="measured")
    for run, colour, label in _pair(series.free_run_before, series.free_run_after):
        above.plot(*thinned(time, run[:, index]), color=colour, linewidth=1.0, label=f"free run {label}")
        below.plot(*thinned(time, 1e3 * (measured - run[:, index])), color=colour, linewidth=0.9)
    for event in series.events:
        if event.axis == axis:
            start, end = (at - series.log.start for at in (event.start_in_file, event.end_in_file))
            for axes in (above, below):
                axes.axvspan(start, end, color=BAND, alpha=0.6)  # the outline shows a slip, which lasts one sample
    low, high = float(measured.min()), float(measured.max())
    span = max(high - low, 1e-3)
    _bounded(above, low - FARTHEST * span, high + FARTHEST * span)
    _bounded(below, -1e3 * FARTHEST * span, 1e3 * FARTHEST * span)
    above.set_ylabel(f"{axis} [rad]")
    below.set_ylabel("error [mrad]")
    below.set_xlabel("time [s]")
    below.margins(x=0.01)
    key(above, 3)
    figure.align_ylabels()
    return figure


@styled
def residual_figure(series: HeldOutSeries, axis: str) -> Figure:
    """Draw the innovations of the axis before and after."""
    index = AXES.index(axis)
    figure, (axes,) = canvas()
    for values, colour, label in _pair(series.residual_before, series.residual_after):
        time = np.arange(len(values)) * series.residual_step
        axes.plot(*thinned(time, values[:, index]), color=colour, linewidth=0.9, label=label)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("innovations, standardised")
    axes.margins(x=0.01)
    key(axes, 2)
    return figure


@styled
def spectrum_figure(series: HeldOutSeries, axis: str) -> Figure:
    """Draw the power spectral density of the innovations (Welch 1967)."""
    index = AXES.index(axis)
    figure, (axes,) = canvas()
    for values, colour, label in _pair(series.residual_before, series.residual_after):
        frequency, power = power_density(values[:, index], series.residual_step, SEGMENT)
        axes.loglog(frequency[1:], power[1:], color=colour, label=label)
    axes.xaxis.set_major_formatter(power_text)
    axes.yaxis.set_major_formatter(power_text)
    axes.minorticks_off()
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("innovations, standardised [1/Hz]")
    key(axes, 2)
    return figure


@styled
def autocorrelation_figure(series: HeldOutSeries, axis: str) -> Figure:
    """Draw the autocorrelation of the innovations with the bounds that white noise keeps in 95 of 100 lags."""
    index = AXES.index(axis)
    figure, (axes,) = canvas()
    bound = 1.96 / np.sqrt(len(series.residual_after))
    axes.axhspan(-bound, bound, color=BAND, alpha=0.6, linewidth=0, label="95 % bounds")
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    for k, (values, colour, label) in enumerate(_pair(series.residual_before, series.residual_after)):
        lags = np.arange(1, LAGS + 1) + 0.3 * (k - 0.5)
        correlation = autocorrelation(values[:, index], LAGS)
        axes.vlines(lags * series.residual_step, 0.0, correlation, color=colour, linewidth=1.3, label=label)
    axes.set_xlabel("lag [s]")
    axes.set_ylabel("autocorrelation")
    axes.margins(x=0.01)
    key(axes, 3)
    return figure


def autocorrelation(values: NDArray[np.float64], lags: int) -> NDArray[np.float64]:
    """Autocorrelation of ``values`` (N,) at lags 1 to ``lags``, shape (lags,)."""
    centred = values - values.mean()
    power = max(float(centred @ centred), 1e-300)
    return np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in range(1, lags + 1)])


def power_density(
    values: NDArray[np.float64], step: float, segment: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One-sided power spectral density by averaged periodograms, under Hann windows (Welch 1967).

    Parameters
    ----------
    values : NDArray, shape (N,)
    step : float
        Sampling period [s].
    segment : int
        Samples of a segment; half of it overlaps the next. At most N are taken.

    Returns
    -------
    frequency : NDArray, shape (F,)
        [Hz].
    power : NDArray, shape (F,)
        Square of the unit of ``values`` per Hz.
    """
    # matplotlib's own rather than scipy's: a process that only draws need not load all of scipy.signal
    size = min(segment, len(values))
    power, frequency = psd(values, NFFT=size, Fs=1.0 / step, noverlap=size // 2, detrend="mean")
    return np.asarray(frequency), np.asarray(power)


def _bounded(axes: Axes, low: float, high: float) -> None:
    """Keep the ordinate inside a range: a free run that runs away would press everything else flat."""
    bottom, top = axes.get_ylim()
    if not (bottom >= low and top <= high):
        axes.set_ylim(max(bottom, low) if np.isfinite(bottom) else low, min(top, high) if np.isfinite(top) else high)


def _pair(before: NDArray[np.float64], after: NDArray[np.float64]) -> tuple[tuple[NDArray[np.float64], str, str], ...]:
    return (before, BEFORE, "before"), (after, AFTER, "after")
