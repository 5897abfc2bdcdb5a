"""Errors of the physics package."""


class PlantError(Exception):
    """Root of every error that ``heli_plant`` raises on purpose."""


class ParameterError(PlantError):
    """A parameter has an impossible value or a name that does not exist."""
