"""A voltage whose column has another scale than that of its twin: the log has v / (1 + size)."""

from .fault import Array, Fault


def correction(v: Array, h: float, size: float) -> Array:
    """Size times v."""
    return size * v


FAULTS = (
    Fault(
        "scale", "v_front", "v / (1 + size)", "1", -0.5, 0.5, 0.02, correction,
        "Measure both voltages at the motors with a meter while the log runs, and mend the factor of the column.",
    ),
)  # fmt: skip
