"""Errors of identification: one root with two leaves, and the checks of ranges that raise them.

A message is one sentence for the person at the rig: which file or setting, where, its value, the bound that it breaks,
and what to do. The command line prints an `IdentifierError` as it stands and exits with 2.
"""

from math import inf, isfinite

CONFIGURATION_NAME = "heli.toml"
"""The configuration of a rig."""

HELI_TOML = f"{CONFIGURATION_NAME} (written by `heli init`)"
"""The same, as messages name it."""


class IdentifierError(Exception):
    """Root of every error that this package raises on purpose; its text may go to a terminal as it stands."""

    def __str__(self) -> str:
        return printable(super().__str__())


class LogError(IdentifierError):
    """A measured log cannot be read or cannot serve identification."""


class ConfigurationError(IdentifierError):
    """A setting is unknown, of the wrong type or out of bounds."""


def refuse(wrong: bool, sentence: str) -> None:
    """Refuse what was given if that is wrong: a ConfigurationError says the sentence."""
    if wrong:
        raise ConfigurationError(sentence)


def printable(text: str) -> str:
    """Give a text without control characters, by which the name of a file could command a terminal."""
    return "".join(letter if letter.isprintable() else " " if letter.isspace() else "?" for letter in text)


def require_range(name: str, value: float, unit: str, lower: float = -inf, upper: float = inf) -> float:
    """Return ``value`` if it is finite and lower <= value <= upper, else a ConfigurationError names all of them."""
    if not isfinite(value) or not lower <= value <= upper:
        if unit == "1":  # units in C hold one text for each case
            raise ConfigurationError(f"{name} = {value!r} must lie in [{lower:g}, {upper:g}]")
        raise ConfigurationError(f"{name} = {value!r} {unit} must lie in [{lower:g}, {upper:g}] {unit}")
    return value


def require_positive(name: str, value: float, unit: str) -> float:
    """Return ``value`` if it is finite and positive, else a ConfigurationError names it."""
    if not isfinite(value) or value <= 0.0:
        if unit == "1":
            raise ConfigurationError(f"{name} = {value!r} must be positive and finite")
        raise ConfigurationError(f"{name} = {value!r} {unit} must be positive and finite")
    return value
