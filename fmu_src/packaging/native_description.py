"""modelDescription.xml of a native unit: that of the pythonfmu unit with another tool, and its source files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element

from ..slave_base import SlaveBase
from ..variables import Value
from .model_description import VERSION, model_description


def native_model_description(
    unit: type[SlaveBase], start_values: Mapping[str, Value], token: str, sources: Sequence[str], fmi: int
) -> Element:
    """Return ``<fmiModelDescription>``; ``start_values`` override those of the unit's variables."""
    assert fmi == 2
    return model_description(unit, start_values, token, f"heli-twin {VERSION}", sources)
