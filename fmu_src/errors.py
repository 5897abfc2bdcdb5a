"""Errors of the FMI layer."""


class FmuError(Exception):
    """Root of every error that ``fmu_src`` raises on purpose."""


class Refusal(FmuError):
    """A unit declines a call: bad value, bad time, bad file. The host sees fmi2Discard and the reason in its log."""


class BuildError(FmuError):
    """A unit cannot be built as asked: unknown name, value out of range, a source that an FMU must not hold."""


class WiringError(FmuError):
    """A scenario, unit or variable that the wiring table does not hold."""


class MasterError(FmuError):
    """A unit answered a call of the master with anything but fmi2OK."""
