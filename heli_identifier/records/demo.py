"""The logs of three rigs that come with the package, so that the loop can be tried without a rig."""

from pathlib import Path

from heli_identifier.errors import LogError

_FOLDER = Path(__file__).resolve().parent.parent / "demo_logs"
DEMO_RIGS = ("rig-a", "rig-b", "rig-c")


def demo_logs(rig: str) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Give the files of a demonstration rig.

    Parameters
    ----------
    rig : str
        One of `DEMO_RIGS`; what each holds stands in the README.md beside the files.

    Returns
    -------
    tuple
        Training logs and held-out logs.

    Raises
    ------
    LogError
        If there is no such rig, or its files were lost in installation.
    """
    if rig not in DEMO_RIGS:
        raise LogError(f"there is no demonstration rig {rig!r}, choose one of {', '.join(DEMO_RIGS)}.")
    training = tuple(sorted((_FOLDER / rig).glob("train*.csv")))
    held_out = tuple(sorted((_FOLDER / rig).glob("held*.csv")))
    if not training or not held_out:
        raise LogError(f"the demonstration logs are missing from {_FOLDER / rig}; install the package again.")
    return training, held_out
