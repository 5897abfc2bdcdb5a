"""What to measure so that an effect becomes visible, or two effects can be told apart."""

from heli_plant.effects import CATALOGUE

EXPERIMENTS = {entry.name: entry.experiment for entry in CATALOGUE}
"""One sentence by effect name."""


def experiment_for(name: str) -> str:
    """Return the sentence for an effect of the catalogue."""
    return EXPERIMENTS[name]


def separating(first: str, second: str) -> str:
    """Return sentences on how to tell two effects apart."""
    return f"Measure what shows either alone. For {first}: {EXPERIMENTS[first]} For {second}: {EXPERIMENTS[second]}"
