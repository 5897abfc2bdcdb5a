"""The commented heli.toml that `heli init` writes: the defaults, and an example of every other key."""

import json
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from heli_identifier.errors import ConfigurationError, printable
from heli_identifier.files import write_atomically
from heli_identifier.records.configuration import CONTRACT, RigConfiguration
from heli_identifier.records.guess import Guess
from heli_identifier.records.units import ANGLES, NAMED, header, known_units


def _lines(entries: Sequence[tuple[str, object, str]]) -> str:
    """Align key, value and comment of each entry."""
    settings = [f"{key} = {value}" for key, value, _ in entries]
    width = max(map(len, settings))
    comments = [printable(comment) for _, _, comment in entries]
    return "\n".join(f"{setting:<{width}}  # {said}" for setting, said in zip(settings, comments, strict=True))


def _quoted(text: str) -> str:
    """Give a text as a string of TOML: JSON's, which lets the control character DEL stand."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def template_text(found: Guess | None = None) -> str:
    """Give a configuration with every key explained: of what was found in a log, else of the contract."""
    rig, form = RigConfiguration(), found.format if found else CONTRACT
    reasons = found.reasons if found else {}

    def entry(section: str, signal: str, example: str, given: object, comment: str) -> tuple[str, object, str]:
        if given is None:
            return f"# {signal}", example, comment
        text = reasons.get(f"{section}.{signal}", comment)
        return signal, _quoted(given) if isinstance(given, str) else given, text

    columns = _lines([entry("columns", s, json.dumps(header(s)), form.columns.get(s), _MEANINGS[s]) for s in NAMED])
    units = _lines(
        [entry("units", s, json.dumps(known_units(s)[1]), form.units.get(s), ", ".join(known_units(s))) for s in NAMED]
    )
    signs = _lines([entry("signs", s, "-1", form.signs.get(s), _SIGNS[s]) for s in NAMED[1:]])
    references = _lines(
        [
            entry("references", a, json.dumps(f"{a}_reference [rad]"), form.references.get(a), "asked for")
            for a in ANGLES
        ]
    )
    counts = _lines([(angle, form.counts_per_turn(angle), "counts per turn") for angle in ANGLES])
    start = f"start = {form.start}" if form.start is not None else "# start = 6.0"
    why = {key: f"\n# {key}: {printable(text)}" for key, text in reasons.items()}
    swap, clip = str(form.swap_rotors).lower(), str(form.clip).lower()
    guessed = (
        "# What `heli init` found in a log, each guess with its reason. Confirm every one of them.\n" if found else ""
    )
    guessed += "".join(f"# NOT CERTAIN: {printable(text)}.\n" for text in (found.doubts if found else ()))
    return f"""\
# Configuration of one rig. Every key may be left out; a line that begins with # is an example.
{guessed}\

[rig]
name = "{rig.name}"
motor_time_constant = {rig.motor_time_constant}  # lag of motor and propeller [s]; a wrong one shows as motor_lag
voltage_limit = {CONTRACT.voltage_limit}  # limit of the amplifiers [V]; a log that exceeds it is read with a note
# rest_pitch = -0.14  # pitch at which gravity exerts no torque [rad]; without it, it is estimated
# elevation_gain = 0.15  # elevation's acceleration per volt on both rotors' sum [rad/s^2/V], if geometry gives it
# horizontal = 0.52  # what the elevation's encoder reads where the arm is horizontal [rad]; without it, it is estimated

[rig.encoder_counts]
{counts}

# Effects that theory demands: the coefficient and its standard deviation. They belong to the model before.
[rig.effects]
# inertial_coupling_elevation = [1.0, 0.1]  # 1 is the torque of a rigid arm
# inertial_coupling_travel = [1.0, 0.1]

[log]
{start}  # first instant kept [s] in the file's own time, to cut off take-off; --from overrides it{why.get("start", "")}
# end = 60.0  # last instant kept [s] (--to overrides it)
decimal = "{form.decimal}"  # decimal mark; columns may be separated by comma, semicolon, tab or blanks
swap_rotors = {swap}  # true if what the file calls front is the rear rotor{why.get("swap_rotors", "")}
clip = {clip}  # true if the file holds voltages before the amplifiers limit them{why.get("clip", "")}
largest_file = {CONTRACT.largest_file}  # size up to which a file is read [MB]

# Header of each signal's column, where it is not the one shown here; "ans(4,:)" is row 4 of the matrix ans of a MATLAB
# file, "column 4" that of a text file without headers. `heli init LOG` looks into a log and fills this in.
[log.columns]
{columns}

# Unit of a column whose header states none, or a wrong one.
[log.units]
{units}

# Header of the column that holds what the pilot or a plan asked of an axis, if the log has it: references determine
# gains that a controller hides. Columns called pitch_reference [rad] and alike are found without an entry.
[log.references]
{references}

# -1 changes the sign, 1 keeps it. In the model a larger front voltage raises pitch, a larger sum raises elevation.
[log.signs]
{signs}
"""


_MEANINGS = {
    "time": "increases from row to row, 50 Hz to 2 kHz",
    "v_front": "voltage of the front motor",
    "v_rear": "voltage of the rear motor",
    "pitch": "rotation of the body about the arm",
    "elevation": "rotation of the arm up and down",
    "travel": "rotation of the arm about its post",
    "v_sum": "v_front + v_rear, in a log that holds these two in place of the voltages",
    "v_difference": "v_front - v_rear",
}
_SIGNS = {
    "v_front": "positive lifts",
    "v_rear": "positive lifts",
    "pitch": "positive when the front rotor is up",
    "elevation": "positive upwards",
    "travel": "a positive pitch with both rotors lifting makes it decrease",
    "v_sum": "positive lifts",
    "v_difference": "positive raises the front rotor",
}


def write_template(path: str | PathLike[str], found: Guess | None = None) -> Path:
    """Write the commented configuration.

    Parameters
    ----------
    path : str or PathLike
        File to make. Missing folders above it are made.
    found : Guess, optional
        What was found in a log; it is filled in, each entry with its reason.

    Raises
    ------
    ConfigurationError
        If the file exists already, since it may hold the user's work, or cannot be written.
    """
    if Path(path).is_file() or Path(path).is_dir():  # a device holds nobody's work
        raise ConfigurationError(f"{path} exists already; delete it or name another file.")
    try:
        return write_atomically(path, template_text(found))
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}.") from error
