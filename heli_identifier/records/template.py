"""The commented configuration that `heli init` writes: it says what the defaults say, and shows what can be said."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError
from heli_identifier.records.configuration import RigConfiguration
from heli_identifier.records.format import CONTRACT
from heli_identifier.records.units import ANGLES, SIGNALS, header, known_units
from heli_identifier.records.writing import write_whole


def _lines(entries: Sequence[tuple[str, object, str]]) -> str:
    """Align key, value and comment of each entry."""
    settings = [f"{key} = {value}" for key, value, _ in entries]
    width = max(map(len, settings))
    return "\n".join(
        f"{setting:<{width}}  # {comment}" for setting, (_, _, comment) in zip(settings, entries, strict=True)
    )


def _choice(signal: str) -> str:
    return " or ".join(known_units(signal))


def template_text() -> str:
    """Give the configuration of a rig that writes its logs as the contract says, every key explained."""
    rig = RigConfiguration()
    columns = _lines([(f"# {signal}", f'"{header(signal)}"', _MEANINGS[signal]) for signal in SIGNALS])
    units = _lines([(f"# {signal}", f'"{known_units(signal)[1]}"', _choice(signal)) for signal in SIGNALS])
    signs = _lines([(f"# {signal}", -1, _SIGNS[signal]) for signal in SIGNALS[1:]])
    counts = _lines([(angle, CONTRACT.counts_per_turn(angle), "counts per turn") for angle in ANGLES])
    return f"""\
# Configuration of one rig. Every key may be left out; a line that begins with # shows what could be said.

[rig]
name = "{rig.name}"
motor_time_constant = {rig.motor_time_constant}  # lag of motor and propeller [s]; a wrong one shows as motor_lag
voltage_limit = {CONTRACT.voltage_limit}  # the amplifiers saturate here [V]; a log beyond it is read, and it is said
# rest_pitch = -0.14  # pitch at which gravity pulls neither way [rad]; left out, it is estimated

[rig.encoder_counts]
{counts}

[log]
# start = 6.0  # first instant kept [s] in the file's own time, to cut take-off away (--from outranks it)
# end = 60.0  # last instant kept [s] (--to outranks it)
decimal = "{CONTRACT.decimal}"  # decimal mark; columns may be separated by comma, semicolon or tab
swap_rotors = {str(CONTRACT.swap_rotors).lower()}  # true: what the file calls front is the rear rotor

# Header of each signal's column, where it is not the one shown here.
[log.columns]
{columns}

# Unit of a column whose header states none, or a wrong one.
[log.units]
{units}

# -1 flips a signal, 1 keeps it. The model wants: a larger front voltage raises pitch, a larger sum raises elevation.
[log.signs]
{signs}
"""


_MEANINGS = {
    "time": "grows from row to row, 50 Hz to 2 kHz",
    "v_front": "voltage of the front motor",
    "v_rear": "voltage of the rear motor",
    "pitch": "rotation of the body about the arm",
    "elevation": "the arm up and down",
    "travel": "the arm round its post",
}
_SIGNS = {
    "v_front": "positive lifts",
    "v_rear": "positive lifts",
    "pitch": "positive when the front rotor is up",
    "elevation": "positive upwards",
    "travel": "a positive pitch with both rotors lifting makes it fall",
}


def write_template(path: str | PathLike[str]) -> Path:
    """Write the commented configuration.

    Parameters
    ----------
    path : str or PathLike
        File to make, with the folders above it.

    Raises
    ------
    ConfigurationError
        If the file exists already (it may hold the user's work) or cannot be written.
    """
    if Path(path).exists():
        raise ConfigurationError(f"{path} exists already; delete it or name another file.")
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        return write_whole(path, template_text())
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}.") from error
