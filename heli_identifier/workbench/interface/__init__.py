"""What ``import heli_identifier as hi`` offers beside the values of the other rooms, one file per function.

Every result is a frozen value with ``summary()``, ``to_dict()``, a short ``repr`` and HTML for notebooks. The commands
of the command line call the same functions.
"""

from collections.abc import Sequence

from heli_identifier.records import Log


def several(logs: Log | Sequence[Log]) -> tuple[Log, ...]:
    """Give one log or several, as every function takes them, as a tuple."""
    return (logs,) if isinstance(logs, Log) else tuple(logs)
