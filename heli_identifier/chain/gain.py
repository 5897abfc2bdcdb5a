"""A voltage whose column has another scale than that of its twin: the log has v / (1 + size)."""

from .fault import Array, Fault


def undo(logged: Array, predicted: Array, h: float, size: float) -> Array:
    """Multiply by 1 + size."""
    return (1.0 + size) * logged


FAULTS: tuple[Fault, ...] = (
    Fault(
        "scale", "v_front", "v / (1 + size)", "1", -0.5, 0.5, 0.02, undo,
        "Measure both voltages at the motors with a meter while the log runs, and mend the factor of the column.",
    ),
)  # fmt: skip
