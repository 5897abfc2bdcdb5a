"""Checks of a setting against its bounds, with one wording for the message."""

from math import inf, isfinite

from .errors import ConfigurationError


def require_range(name: str, value: float, unit: str, lower: float = -inf, upper: float = inf) -> float:
    """Return ``value`` if it is finite and lower <= value <= upper.

    Raises
    ------
    ConfigurationError
        Names the setting, its value, its bounds and unit.
    """
    if not isfinite(value) or not lower <= value <= upper:
        raise ConfigurationError(f"{name} = {value!r} {unit} must lie in [{lower:g}, {upper:g}] {unit}")
    return value


def require_positive(name: str, value: float, unit: str) -> float:
    """Return ``value`` if it is finite and positive.

    Raises
    ------
    ConfigurationError
        Names the setting, its value and unit.
    """
    if not isfinite(value) or value <= 0.0:
        raise ConfigurationError(f"{name} = {value!r} {unit} must be positive and finite")
    return value
