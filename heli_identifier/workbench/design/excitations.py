"""Excitations that a design chooses from: multisines of three bands, levels and strengths, and the paper's own."""

from collections.abc import Iterator
from dataclasses import dataclass

from heli_identifier.online.excitation import Excitation, Multisine, paper_excitation

BANDS = {"slow": (0.03, 0.4), "middle": (0.1, 1.2), "fast": (0.5, 3.0)}
"""Bands [Hz] of the multisines."""

BASES = (0.0, 0.6, 1.25, 2.5)
"""Base voltages of each rotor [V]; around zero the rotors reverse."""

STRENGTHS = (0.25, 0.6, 1.2)
"""Root-mean-square values [V] of the signals on the difference and on the sum."""


@dataclass(frozen=True)
class Proposal:
    """An excitation with the words that describe it."""

    name: str
    excitation: Excitation


def proposals(limit: float) -> Iterator[Proposal]:
    """Excitations within plus or minus ``limit`` [V]."""
    for experiment in (1, 2):
        yield Proposal(
            f"the paper's experiment {experiment} on both channels, base 1.5 V",
            paper_excitation(experiment, "both", base=1.5),
        )
    for base in BASES:
        for pitch_band in BANDS:
            for sum_band in BANDS:
                for strength in STRENGTHS:
                    yield Proposal(
                        f"multisines of {strength:g} V rms, {pitch_band} on v_f - v_r and {sum_band} on v_f + v_r, "
                        f"base {base:g} V",
                        Excitation(
                            base,
                            Multisine(strength, *BANDS[pitch_band], period=30.0, seed=1),
                            Multisine(strength, *BANDS[sum_band], period=45.0, seed=2),
                            limit,
                        ),
                    )
