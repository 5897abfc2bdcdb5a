"""The parts of an FMU's zip: vendored sources, model description, documentation, icon."""

from .contents import icon, index_html, zip_bytes
from .description import (
    AUTHOR,
    DATE,
    LICENSE,
    TOOL,
    base_exponents,
    model_description,
    unit_definitions,
    value_text,
    xml_text,
)
from .sources import content_hash, needed_sources, renamed, slave_script

__all__ = [
    "AUTHOR",
    "DATE",
    "LICENSE",
    "TOOL",
    "base_exponents",
    "content_hash",
    "icon",
    "index_html",
    "model_description",
    "needed_sources",
    "renamed",
    "slave_script",
    "unit_definitions",
    "value_text",
    "xml_text",
    "zip_bytes",
]
