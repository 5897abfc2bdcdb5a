"""XML namespaces of SSP 1.0 and a shorthand for its tags."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, register_namespace

_BASE = "http://ssp-standard.org/SSP1/"
NAMESPACES = {
    "ssc": _BASE + "SystemStructureCommon",
    "ssd": _BASE + "SystemStructureDescription",
    "ssv": _BASE + "SystemStructureParameterValues",
}
for _prefix, _uri in NAMESPACES.items():
    register_namespace(_prefix, _uri)


def tag(name: str) -> str:
    """Return ``ssd:System`` as ElementTree wants it."""
    prefix, _, local = name.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


def child(parent: Element, name: str, /, **attributes: str) -> Element:
    """Append ``<name>`` to ``parent`` and return it."""
    return SubElement(parent, tag(name), attributes)


def units(parent: Element, name: str, unit_names: set[str]) -> None:
    """Append ``<name>`` (``ssd:Units`` or ``ssv:Units``) with the base units of each unit that occurs."""
    from ..packaging.unit_definitions import base_exponents

    listed = child(parent, name)
    for unit in sorted(unit_names):
        exponents = {base: str(power) for base, power in base_exponents(unit).items()}
        child(child(listed, "ssc:Unit", name=unit), "ssc:BaseUnit", **exponents)
