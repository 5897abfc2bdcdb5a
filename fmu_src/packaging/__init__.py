"""The parts of an FMU's zip: vendored sources, model description, documentation, icon."""

from .archive import zip_bytes
from .described import AUTHOR, DATE, LICENSE, value_text
from .documentation import index_html
from .icon import icon
from .model_description import model_description, xml_text
from .native_description import native_model_description
from .sources import content_hash, needed_sources, renamed, slave_script
from .unit_definitions import base_exponents, unit_definitions

__all__ = [
    "AUTHOR",
    "DATE",
    "LICENSE",
    "base_exponents",
    "content_hash",
    "icon",
    "index_html",
    "model_description",
    "native_model_description",
    "needed_sources",
    "renamed",
    "slave_script",
    "unit_definitions",
    "value_text",
    "xml_text",
    "zip_bytes",
]
