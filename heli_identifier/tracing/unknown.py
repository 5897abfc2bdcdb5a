"""Effects that no catalogue names: a torque as a smooth function of one variable, or a line in time.

For every axis and every variable the unknown torque is a B-spline of that variable (de Boor 1978), its response in the
innovations that of the linearised observer. A line is a sine of one frequency with a free phase in each record.
Whether a variable explains the residual is judged by its gain in likelihood against chi-squared with as many degrees of
freedom as it has columns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.optimize import minimize_scalar
from scipy.special import gammaln
from scipy.stats import chi2

from heli_identifier.prediction.fit import Fit
from heli_identifier.prediction.problem import REDUCED_RATE, Problem
from heli_identifier.prediction.relinearised import Gain, linear_gain
from heli_identifier.prediction.torque import torque_responses
from heli_identifier.prediction.whitening import Whitener
from heli_identifier.tracing.scan import basis_of
from heli_plant.effects import AXES
from heli_plant.parameters import PlantParameters

VARIABLES = (
    "pitch", "elevation", "travel", "pitch_rate", "elevation_rate", "travel_rate", "mu_sum", "mu_diff", "time",
)  # fmt: skip
"""What an unknown torque may depend on."""

UNITS = {
    "pitch": "rad", "elevation": "rad", "travel": "rad", "pitch_rate": "rad/s", "elevation_rate": "rad/s",
    "travel_rate": "rad/s", "mu_sum": "V", "mu_diff": "V", "time": "s",
}  # fmt: skip

INTERVALS = 14
"""Knot intervals over the range that a variable visits."""

DEGREE = 3

HIGHEST_LINE = 3.0
"""Highest frequency [Hz] of a line: above it the pattern of an encoder's counts under steady motion passes for one."""

LINEAR_IN_MODEL = {
    ("pitch", "pitch"), ("pitch", "pitch_rate"), ("pitch", "mu_diff"), ("elevation", "elevation"),
    ("elevation", "elevation_rate"), ("elevation", "mu_sum"), ("travel", "travel_rate"), ("travel", "pitch"),
}  # fmt: skip
"""Axis and variable of the torques that the simplified model has a linear term for."""

LARGEST_SHARE = 5.0
"""A curve that explains this many times the residual's standard deviation is a difference of huge columns."""

LOWEST_LINE = 0.06
"""Lowest frequency [Hz] of a line: below it a record holds too few periods to tell a line from drift."""


@dataclass(frozen=True, eq=False)
class Unknown:
    """A torque of unknown origin on one axis.

    Attributes
    ----------
    axis : str
    variable : str
    frequency : float or None
        Of a line in time [Hz]; None for a curve.
    gain : Gain
    degrees : int
        Columns of its model.
    columns : list of NDArray, shape (n_i, 1, degrees)
        Their responses in the innovations of the axis.
    knots, projection : NDArray
        Of a curve's splines, empty for a line.
    """

    axis: str
    variable: str
    frequency: float | None
    gain: Gain
    degrees: int
    columns: list[NDArray[np.float64]]
    knots: NDArray[np.float64]
    projection: NDArray[np.float64]

    def curve(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Basis (len(x), degrees) of the torque at values ``x`` of its variable."""
        return curve_basis(x, self.axis, self.variable, self.knots, self.projection)

    @property
    def surplus(self) -> float:
        """Gain in log-likelihood beyond what as many columns of noise give, on chi-squared's one-degree scale."""
        return one_degree_equivalent(self.gain.value, self.degrees)


def one_degree_equivalent(gain: float, degrees: int) -> float:
    """Chi-squared of one degree of freedom that is as rare as ``gain`` is under ``degrees`` degrees of freedom."""
    if gain <= degrees:
        return 0.0
    tail = float(chi2.logsf(gain, degrees))
    if tail > -300.0:
        return float(chi2.isf(np.exp(tail), 1))
    # both tails by their leading terms: x/2 - (k/2 - 1) log(x/2) + log Gamma(k/2) is the same for either
    depth = gain / 2.0 - (degrees / 2.0 - 1.0) * np.log(gain / 2.0) + gammaln(degrees / 2.0)
    x = 2.0 * depth
    for _ in range(5):
        x = 2.0 * (depth - 0.5 * np.log(x / 2.0) - gammaln(0.5))
    return float(x)


def variables(fit: Fit) -> dict[str, list[NDArray[np.float64]]]:
    """Every variable on each record's grid, (N_i,), as the observer predicts it; the travel wrapped to one turn.

    A smoother that looks ahead would see the noise it is meant to explain and find every rate guilty.
    """
    columns: dict[str, list[NDArray[np.float64]]] = {name: [] for name in VARIABLES}
    for record, motion in zip(fit.problem.records, fit.problem.motion(fit.parameters), strict=True):
        front, rear = motion[:, 6], motion[:, 7]
        values = (
            motion[:, 0], motion[:, 1], np.mod(motion[:, 2], 2.0 * np.pi), motion[:, 3], motion[:, 4], motion[:, 5],
            front + rear, front - rear, np.arange(record.samples) * record.step,
        )  # fmt: skip
        for name, value in zip(VARIABLES, values, strict=True):
            columns[name].append(value)
    return columns


def spline_knots(values: list[NDArray[np.float64]], periodic: bool) -> NDArray[np.float64]:
    """Knots over the inner 99.8 % of a variable's values, or over one turn of a periodic one."""
    if periodic:
        low, high = 0.0, 2.0 * np.pi
    else:
        low, high = np.quantile(np.concatenate(values), (0.001, 0.999))
    inner = np.linspace(low, high, INTERVALS + 1)
    width = inner[1] - inner[0]
    before, after = low - width * np.arange(DEGREE, 0, -1), high + width * np.arange(1, DEGREE + 1)
    return np.concatenate((before, inner, after))


def spline_basis(x: NDArray[np.float64], knots: NDArray[np.float64], periodic: bool) -> NDArray[np.float64]:
    """B-splines of ``x`` (N,) on ``knots``, shape (N, k); a periodic basis is folded at one turn."""
    low, high = knots[DEGREE], knots[-DEGREE - 1]
    basis = BSpline.design_matrix(np.clip(x, low, high), knots, DEGREE).toarray()
    if periodic:
        basis[:, :DEGREE] += basis[:, -DEGREE:]
        basis = basis[:, :-DEGREE]
    return basis


def trend(x: NDArray[np.float64], axis: str, variable: str) -> NDArray[np.float64]:
    """Functions (N, 0 to 2) of a variable that the model holds itself: a constant torque, a term linear in it.

    They are taken out of the curve, which is defined only up to them; the travel has no constant torque of its own.
    """
    columns = [] if axis == "travel" else [np.ones_like(x)]
    if (axis, variable) in LINEAR_IN_MODEL:
        columns.append(x)
    return np.column_stack(columns) if columns else np.empty((len(x), 0))


def curve_basis(x: NDArray[np.float64], axis: str, variable: str, knots: NDArray, projection: NDArray) -> NDArray:
    """Splines (N, k) of a variable less the trend that ``projection`` (trends, splines) finds in them."""
    basis = spline_basis(x, knots, variable == "travel") - trend(x, axis, variable) @ projection
    return basis[:, : basis.shape[1] - len(projection)]


def curve_columns(
    fit: Fit, axis: int, variable: str, values: list[NDArray[np.float64]]
) -> tuple[list[NDArray[np.float64]], NDArray[np.float64], NDArray[np.float64]]:
    """Responses (n_i, 1, k) of the innovations of ``axis`` to the splines of ``variable``, knots and projection."""
    name, periodic = AXES[axis], variable == "travel"
    knots = spline_knots(values, periodic)
    pooled = np.concatenate(values)
    held = trend(pooled, name, variable)
    projection = np.linalg.lstsq(held, spline_basis(pooled, knots, periodic), rcond=None)[0]
    bases = [curve_basis(x, name, variable, knots, projection) for x in values]
    responses = torque_responses(fit.problem, axis, fit.parameters, bases)
    return [-r[:, None, :] for r in responses], knots, projection


def curve_of(fit: Fit, axis: int, variable: str, values: list[NDArray[np.float64]]) -> Unknown:
    """Fit an unknown torque of ``variable`` on ``axis``."""
    columns, knots, projection = curve_columns(fit, axis, variable, values)
    gain = linear_gain(fit, columns, (axis,))
    return Unknown(AXES[axis], variable, None, gain, columns[0].shape[2], columns, knots, projection)


def line_columns(
    problem: Problem, parameters: PlantParameters, axis: int, frequency: float
) -> list[NDArray[np.float64]]:
    """Responses to a cosine and a sine of ``frequency`` [Hz] in each record apart, (n_i, 1, 2 records)."""
    count = len(problem.records)
    accelerations = []
    for index, record in enumerate(problem.records):
        phase = 2.0 * np.pi * frequency * np.arange(record.samples) * record.step
        waves = np.zeros((record.samples, 2 * count))
        waves[:, 2 * index], waves[:, 2 * index + 1] = np.cos(phase), np.sin(phase)
        accelerations.append(waves)
    return [-r[:, None, :] for r in torque_responses(problem, axis, parameters, accelerations)]


def line_of(fit: Fit, axis: int, frequency: float) -> Unknown:
    """Fit a line of ``frequency`` [Hz] on ``axis``."""
    columns = line_columns(fit.problem, fit.parameters, axis, frequency)
    gain = linear_gain(fit, columns, (axis,))
    return Unknown(AXES[axis], "time", frequency, gain, columns[0].shape[2], columns, np.empty(0), np.empty(0))


def refined_line(fit: Fit, axis: int, frequency: float) -> Unknown:
    """Find the line of largest gain within one bin of ``frequency`` [Hz]."""
    bin_width = 1.0 / max(record.duration for record in fit.problem.records)
    found = minimize_scalar(
        lambda f: -line_of(fit, axis, float(f)).gain.value,
        bounds=(max(frequency - bin_width, 0.5 * bin_width), frequency + bin_width),
        method="bounded",
        options={"xatol": 0.02 * bin_width, "maxiter": 14},
    )
    return line_of(fit, axis, float(found.x))


def strongest_lines(fit: Fit, axis: int, count: int = 2) -> list[float]:
    """Frequencies [Hz] at which the innovations' periodogram, summed over records, stands out most.

    The innovations before whitening are looked at: an autoregression would have taken a strong line in.
    """
    size = 2 ** int(np.ceil(np.log2(max(fit.problem.lengths)) + 2))
    frequencies = np.fft.rfftfreq(size, 1.0 / REDUCED_RATE)
    power = np.zeros(len(frequencies))
    for residuals in fit.residuals:
        window = np.hanning(len(residuals))
        power += np.abs(np.fft.rfft(residuals[:, axis] * window, size)) ** 2 / (window @ window)
    background = _background(frequencies, power, 12.0 * REDUCED_RATE / max(fit.problem.lengths))
    inside = (frequencies > LOWEST_LINE) & (frequencies < HIGHEST_LINE)
    standing = np.where(inside, power / background, 0.0)
    found: list[float] = []
    width = 3.0 * REDUCED_RATE / max(fit.problem.lengths)
    for index in np.argsort(standing)[::-1]:
        if all(abs(frequencies[index] - f) > width for f in found):
            found.append(float(frequencies[index]))
        if len(found) == count:
            break
    return found


def _background(frequencies: NDArray[np.floating], power: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """Smooth level of a periodogram: its median over bands of a third of an octave, no narrower than ``least`` [Hz]."""
    edges = [LOWEST_LINE / 2.0]
    while edges[-1] < frequencies[-1]:
        edges.append(max(edges[-1] * 2.0 ** (1.0 / 3.0), edges[-1] + least))
    band = np.clip(np.searchsorted(edges, frequencies, side="right") - 1, 0, len(edges) - 2)
    used = np.unique(band)
    centres = [frequencies[band == i].mean() for i in used]
    levels = [np.median(power[band == i]) for i in used]
    return np.exp(np.interp(frequencies, centres, np.log(levels)))


def screened(
    fit: Fit, whitener: Whitener, values: dict[str, list[NDArray[np.float64]]], axis: int
) -> list[tuple[float, str]]:
    """Variables of one axis by the gain that their curve has under ``whitener``, largest first."""
    known = whitener.apply_axis(axis, [j[:, axis] for j in fit.raw_jacobian])
    basis = basis_of(known[:, np.linalg.norm(known, axis=0) > 0.0])
    white = whitener.apply_axis(axis, [r[:, axis] for r in fit.residuals])
    white = white - basis @ (basis.T @ white)
    found = []
    for variable in VARIABLES:
        columns, _, _ = curve_columns(fit, axis, variable, values[variable])
        whitened = whitener.apply_axis(axis, [c[:, 0, :] for c in columns])
        directions = basis_of(whitened - basis @ (basis.T @ whitened))
        found.append((float(((directions.T @ white) ** 2).sum()), variable))
    return sorted(found, reverse=True)


def search(fit: Fit, whitener: Whitener, shortlist: int = 2) -> list[Unknown]:
    """Unknown torques by falling surplus: per axis the best few curves and lines, found under ``whitener``."""
    values = variables(fit)
    found = []
    for axis in range(3):
        for _, variable in screened(fit, whitener, values, axis)[:shortlist]:
            found.append(curve_of(fit, axis, variable, values[variable]))
        found.extend(line_of(fit, axis, frequency) for frequency in strongest_lines(fit, axis))
    return sorted((u for u in found if is_sane(fit, u)), key=lambda unknown: -unknown.surplus)


def is_sane(fit: Fit, unknown: Unknown) -> bool:
    """Whether a curve is of the size of what it explains, and not a difference of huge columns."""
    axis = AXES.index(unknown.axis)
    explained = np.concatenate([c[:, 0] @ unknown.gain.coefficients for c in unknown.columns])
    residual = np.concatenate([r[:, axis] for r in fit.residuals])
    return float(explained.std()) <= LARGEST_SHARE * float(residual.std())
