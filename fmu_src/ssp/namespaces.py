"""XML namespaces of SSP 1.0, and elements in them."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, register_namespace

from ..packaging import base_exponents

_BASE = "http://ssp-standard.org/SSP1/"
NAMESPACES = {
    "ssc": _BASE + "SystemStructureCommon",
    "ssd": _BASE + "SystemStructureDescription",
    "ssv": _BASE + "SystemStructureParameterValues",
}
for _prefix, _uri in NAMESPACES.items():
    register_namespace(_prefix, _uri)


def tag(name: str) -> str:
    """Return a tag such as ``ssd:System`` in ElementTree's notation."""
    prefix, _, local = name.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


def child(parent: Element, name: str, /, **attributes: str) -> Element:
    """Append ``<name>`` to ``parent`` and return it."""
    return SubElement(parent, tag(name), attributes)


def units(parent: Element, name: str, unit_names: set[str]) -> None:
    """Append ``<name>`` (``ssd:Units`` or ``ssv:Units``) with the base units of each unit name."""
    listed = child(parent, name)
    for unit in sorted(unit_names):
        exponents = {base: str(power) for base, power in base_exponents(unit).items()}
        child(child(listed, "ssc:Unit", name=unit), "ssc:BaseUnit", **exponents)
