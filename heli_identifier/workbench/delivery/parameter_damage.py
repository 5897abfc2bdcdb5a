"""What is wrong with the content of a parameters.json, in words: the first entry missing or of the wrong kind."""

from collections.abc import Mapping
from reprlib import repr
from sys import float_info
from typing import Any

from heli_plant.effects import AXES

_SECTIONS = {"unit": str, "values": dict, "expected": dict, "provenance": dict}
_KINDS = {str: "a text", dict: "an object", list: "a list", bool: "true or false", type(None): "null"}
LARGEST = float_info.max
"""JSON has integers beyond any float."""

_AGAIN = "; write it again with `heli diagnose` or `heli identify`"


def damage(content: object, schema: str) -> str | None:
    """Say what is wrong with a document, to be read behind the name of its file; None if it is whole.

    Parameters
    ----------
    content : object
        What the JSON holds.
    schema : str
        That the document must state.
    """
    if not isinstance(content, dict):
        return f"must hold an object of schema {schema!r}, it holds {_KINDS.get(type(content), 'a number')}{_AGAIN}"
    if content.get("schema") != schema:
        return f"must be of schema {schema!r}, its schema is {repr(content.get('schema'))}"
    for section, kind in _SECTIONS.items():
        if section not in content:
            return f"lacks {section!r}{_AGAIN}"
        if not isinstance(content[section], kind):
            return f"is damaged: {section} must be {_KINDS[kind]}, it is {repr(content[section])}"
    for name, entry in content["values"].items():
        if found := _damaged_value(f"values.{name}", entry):
            return f"is damaged: {found}"
    for axis, entry in content["expected"].items():
        if axis not in AXES:
            return f"is damaged: expected.{axis} is of no axis; there are {', '.join(AXES)}"
        if found := _damaged_expectation(f"expected.{axis}", entry):
            return f"is damaged: {found}"
    return None


def _damaged_value(place: str, entry: Any) -> str | None:
    if found := _missing(place, entry, ("value", "standard_error", "unit")) or _no_number(place, entry, ("value",)):
        return found
    error = entry["standard_error"]
    if error is not None and (found := _no_number(place, entry, ("standard_error",))):
        return found
    if error is not None and error < 0.0:
        return f"{place}.standard_error = {error!r} must not be negative"
    if not isinstance(entry["unit"], str):
        return f"{place}.unit = {repr(entry['unit'])} must be a text"
    return None


def _damaged_expectation(place: str, entry: Any) -> str | None:
    keys = ("prediction_1s_rad", "noise_floor_rad")
    if found := _missing(place, entry, keys) or _no_number(place, entry, keys[1:]):
        return found
    place, figure, keys_of_figure = f"{place}.prediction_1s_rad", entry["prediction_1s_rad"], ("value", "low", "high")
    return _missing(place, figure, keys_of_figure) or _no_number(place, figure, keys_of_figure)


def _missing(place: str, entry: Any, keys: tuple[str, ...]) -> str | None:
    if not isinstance(entry, dict):
        return f"{place} must be an object with {', '.join(keys)}, it is {repr(entry)}"
    lost = [key for key in keys if key not in entry]
    return f"{place} lacks {', '.join(lost)}" if lost else None


def _no_number(place: str, entry: Mapping[str, Any], keys: tuple[str, ...]) -> str | None:
    """Name the first of ``keys`` that holds no finite number; what Python reads as JSON may hold NaN and Infinity."""
    for key in keys:
        value = entry[key]
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"{place}.{key} = {repr(value)} must be a number"
        if not -LARGEST <= value <= LARGEST:
            return f"{place}.{key} = {repr(value)} must be a finite number"
    return None
