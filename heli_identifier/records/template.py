"""The commented heli.toml that `heli init` writes: the defaults, and an example of every other key."""

import json
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from string import Template

from heli_identifier.errors import ConfigurationError, printable
from heli_identifier.files import write_atomically
from heli_identifier.records.configuration import CONTRACT, RigConfiguration
from heli_identifier.records.guess import Guess
from heli_identifier.records.units import ANGLES, NAMED, header, known_units

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
_EXPLAINED = ("start", "swap_rotors", "clip")


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


def template_text(found: Guess | None = None) -> str:
    """Give a configuration with every key explained: of what was found in a log, else of the contract."""
    form, reasons = (found.format, found.reasons) if found else (CONTRACT, {})
    form_of = {"columns": form.columns, "units": form.units, "references": form.references, "signs": form.signs}

    def section(name: str, keys: Sequence[str], examples: Sequence[object], comments: Sequence[str]) -> str:
        entries = []
        for key, example, comment in zip(keys, examples, comments, strict=True):
            given = form_of[name].get(key)
            value = _quoted(example if given is None else given)
            said = comment if given is None else reasons.get(f"{name}.{key}", comment)
            entries.append((f"{'# ' if given is None else ''}{key} = {value}", printable(said)))
        return _aligned(entries)

    doubts = [f"# NOT CERTAIN: {printable(text)}.\n" for text in (found.doubts if found else ())]
    guessed = "# What `heli init` found in a log, each guess with its reason. Confirm every one of them.\n"
    why = {f"why_{key}": f"\n# {key}: {printable(reasons[key])}" if key in reasons else "" for key in _EXPLAINED}
    counts = [(f"{angle} = {form.counts_per_turn(angle)}", "counts per turn") for angle in ANGLES]
    return Template(Path(__file__).with_name("heli.toml.template").read_text("utf-8")).substitute(
        why,
        guessed="".join((guessed, *doubts)) if found else "",
        name=RigConfiguration.name,
        motor_time_constant=RigConfiguration.motor_time_constant,
        voltage_limit=CONTRACT.voltage_limit,
        counts=_aligned(counts),
        start=f"start = {form.start}" if form.start is not None else "# start = 6.0",
        decimal=form.decimal,
        swap_rotors=str(form.swap_rotors).lower(),
        clip=str(form.clip).lower(),
        largest_file=CONTRACT.largest_file,
        columns=section("columns", NAMED, [header(s) for s in NAMED], [_MEANINGS[s] for s in NAMED]),
        units=section("units", NAMED, [known_units(s)[1] for s in NAMED], [", ".join(known_units(s)) for s in NAMED]),
        references=section("references", ANGLES, [f"{a}_reference [rad]" for a in ANGLES], ["asked for"] * 3),
        signs=section("signs", NAMED[1:], [-1] * 7, [_SIGNS[s] for s in NAMED[1:]]),
    )


def _aligned(entries: Sequence[tuple[str, str]]) -> str:
    width = max(len(setting) for setting, _ in entries)
    return "\n".join(f"{setting:<{width}}  # {comment}" for setting, comment in entries)


def _quoted(value: object) -> str:
    """Give a value of TOML: a text is that of JSON, which lets the control character DEL stand."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
