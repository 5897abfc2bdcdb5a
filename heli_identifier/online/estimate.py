"""A value with its uncertainty: what every estimate of this package is handed on as."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error, both in ``unit``; an error of None means that the value was given."""

    value: float
    standard_error: float | None
    unit: str

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval."""
        half = 1.96 * (self.standard_error or 0.0)
        return self.value - half, self.value + half
