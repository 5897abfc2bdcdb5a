"""XML from strangers, parsed without a document type.

Only a document type can define entities, by which a few lines grow to gigabytes or name other files. Searching the
bytes for it misses a file in UTF-16, so the parser itself reports it.
"""

from typing import Any, NoReturn
from xml.etree.ElementTree import Element, TreeBuilder, XMLParser


class MarkupError(ValueError):
    """An XML text has a document type."""


class _Untyped(TreeBuilder):
    """Builds a tree, and refuses a document type where it begins."""

    def doctype(self, name: str, public: str | None, system: str | None) -> NoReturn:
        raise MarkupError("its XML has a document type, which may define entities; take it out")


def plain_xml(text: bytes) -> Element:
    """Parse an XML text that has no document type.

    Raises
    ------
    MarkupError
        It has one.
    xml.etree.ElementTree.ParseError, LookupError, ValueError
        It is no XML, or its encoding is unknown.
    """
    parser: Any = XMLParser(target=_Untyped())
    parser.feed(text)
    root: Element = parser.close()
    return root
