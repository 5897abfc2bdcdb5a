"""Errors of identification: a base class and two kinds of it, and the checks that raise them.

A message is one sentence for the person at the rig: which file or setting, where, its value, the bound that it breaks,
and what to do. The command line prints the text of an `IdentifierError` unchanged and exits with 2.
"""

from math import inf, isfinite

CONFIGURATION_NAME = "heli.toml"
"""The configuration of a rig."""

HELI_TOML = f"{CONFIGURATION_NAME} (written by `heli init`)"
"""The same file, as messages name it."""


class IdentifierError(Exception):
    """Base of every error that this package raises on purpose; its text is safe to print on a terminal."""

    def __str__(self) -> str:
        return printable(super().__str__())


class LogError(IdentifierError):
    """A measured log cannot be read or cannot serve identification."""


class ConfigurationError(IdentifierError):
    """A setting is unknown, of the wrong type or out of bounds."""


def refuse(wrong: bool, sentence: str) -> None:
    """Raise a ConfigurationError with the sentence if the condition ``wrong`` holds."""
    if wrong:
        raise ConfigurationError(sentence)


def printable(text: str) -> str:
    """Replace control characters in a text, by which the name of a file could control a terminal."""
    return "".join(letter if letter.isprintable() else " " if letter.isspace() else "?" for letter in text)


def require_range(name: str, value: float, unit: str, lower: float = -inf, upper: float = inf) -> float:
    """Return ``value`` if it is finite and lower <= value <= upper; else raise a ConfigurationError that names them."""
    if not isfinite(value) or not lower <= value <= upper:
        if unit == "1":  # the units in C have one message for each case
            raise ConfigurationError(f"{name} = {value!r} must lie in [{lower:g}, {upper:g}]")
        raise ConfigurationError(f"{name} = {value!r} {unit} must lie in [{lower:g}, {upper:g}] {unit}")
    return value


def require_positive(name: str, value: float, unit: str) -> float:
    """Return ``value`` if it is finite and positive; else raise a ConfigurationError that names it."""
    if not isfinite(value) or value <= 0.0:
        if unit == "1":
            raise ConfigurationError(f"{name} = {value!r} must be positive and finite")
        raise ConfigurationError(f"{name} = {value!r} {unit} must be positive and finite")
    return value
