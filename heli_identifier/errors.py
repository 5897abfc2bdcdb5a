"""What can go wrong in identification, as one root with a few leaves.

Each message is one sentence for the person at the rig: which file or value, where, what it is, what bound
it breaks and what to do. The command line prints an `IdentifierError` as it stands and exits with 2.
"""


class IdentifierError(Exception):
    """Root of every error that this package raises on purpose."""


class LogError(IdentifierError):
    """A measured log cannot be read or cannot serve identification."""


class ConfigurationError(IdentifierError):
    """A rig's configuration says something that is unknown, of the wrong type or out of bounds."""
