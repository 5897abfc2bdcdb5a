"""The outcome of a check as JUnit XML, which CI systems show test by test."""

from collections.abc import Sequence
from xml.etree import ElementTree

from heli_identifier.tracing import Outcome


def junit_text(suite: str, outcomes: Sequence[Outcome]) -> str:
    """Give a test suite with one case per log and axis."""
    failures = sum(not outcome.passed for outcome in outcomes)
    root = ElementTree.Element(
        "testsuite", name=suite, tests=str(len(outcomes)), failures=str(failures), errors="0", skipped="0"
    )
    for outcome in outcomes:
        case = ElementTree.SubElement(root, "testcase", classname=outcome.log, name=f"{outcome.axis} 1 s prediction")
        figures = f"error {1e3 * outcome.error.value:.4g} mrad, limit {1e3 * outcome.limit:.4g} mrad"
        if not outcome.passed:
            ElementTree.SubElement(case, "failure", message=figures)
        ElementTree.SubElement(case, "system-out").text = figures
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
