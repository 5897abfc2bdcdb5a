"""Effects by their names on a command line: NAME, or NAME:AXIS for an effect that the catalogue has on several axes."""

from collections.abc import Sequence

from heli_identifier.errors import ConfigurationError
from heli_plant.effects import CATALOGUE, Effect
from heli_plant.errors import did_you_mean


def effects_named(words: Sequence[str]) -> tuple[Effect, ...]:
    """Return the catalogue's entries for ``words``.

    Raises
    ------
    ConfigurationError
        A name is unknown (the nearest is proposed), or stands for several axes.
    """
    found = tuple(_entry(word) for word in words)
    if len(found) == 2 and found[0] == found[1]:
        raise ConfigurationError(f"{words[0]} and {words[1]} are the same effect; two different ones are needed.")
    return found


def _entry(word: str) -> Effect:
    name, _, axis = word.partition(":")
    of_name = [entry for entry in CATALOGUE if entry.name == name]
    if not of_name:
        hint = did_you_mean(name, {entry.name for entry in CATALOGUE}) or "; `heli effects` lists them."
        raise ConfigurationError(f"no effect is called {name!r}{hint}")
    fitting = [entry for entry in of_name if axis in ("", entry.axis)]
    if len(fitting) != 1:
        choices = ", ".join(f"{name}:{entry.axis}" for entry in of_name)
        raise ConfigurationError(f"{word!r} is not one entry of the catalogue; choose one of {choices}.")
    return fitting[0]
