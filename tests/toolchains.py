"""Write the matrix of docs/toolchains.md from what the tests of the native units really ran.

Usage: python -m tests.toolchains. It runs those tests and takes their outcomes; a cell says why a test was skipped.
"""

import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.harness import write_section
from fmu_src import UNITS

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "toolchains.md"

HOSTS = "native_hosts"
PAIRS = PLAIN = VERSION_3 = "native_units"
COLUMNS = (
    ("linux64: C host", 2, HOSTS, "test_a_c_host_runs_a_native_unit_without_python"),
    ("-O0 and -O3, same bits", 2, HOSTS, "test_every_optimisation_gives_the_same_bits"),
    ("sanitizers", 2, HOSTS, "test_the_sanitizers_find_nothing"),
    ("win64: C host under Wine", 2, HOSTS, "test_the_windows_binary_runs_under_wine"),
    ("arm64: C host under qemu", 2, HOSTS, "test_the_binary_for_arm_gives_the_bits_of_that_for_x86"),
    ("fmpy: bits and refusals of pythonfmu", 2, PAIRS, "test_random_calls_allowed_and_not_find_no_difference"),
    ("fmpy: bits of FMI 2.0", 3, VERSION_3, "test_both_versions_of_fmi_show_the_same_bits"),
    ("fmpy validate", 2, PLAIN, "test_fmpy_finds_no_problem_in_a_native_unit"),
    ("fmpy validate", 3, VERSION_3, "test_fmpy_finds_no_problem_in_a_unit_of_fmi_3"),
    ("fmpy compile", 2, "native_importers", "test_fmpy_compiles_a_unit_from_its_sources[2]"),
    ("fmpy compile", 3, "native_importers", "test_fmpy_compiles_a_unit_from_its_sources[3]"),
    ("Model Exchange in fmpy", 2, "native_exchange", "FMI 2.0"),
    ("Model Exchange in fmpy", 3, "native_exchange", "FMI 3.0"),
)
"""Column, version of FMI, file of the tests, and what the names of its tests contain."""

IMPORTER = "test_an_importer_agrees_with_the_master_over_10000_steps"


class Outcomes:
    """Outcomes of tests by their names: passed, failed, or the reason for which one was skipped."""

    def __init__(self) -> None:
        self.found: dict[str, str] = {}
        self.printed: dict[str, str] = {}

    def pytest_runtest_logreport(self, report) -> None:
        if report.when == "call" or report.outcome != "passed":
            said = report.outcome
            if report.skipped:
                said = str(report.longrepr[2]).removeprefix("Skipped: ")
            self.found[report.nodeid] = said
            self.printed[report.nodeid] = report.capstdout

    def cell(self, file: str, test: str, unit: str) -> str:
        """Outcome of the tests of a cell; those that name no unit were run with the plant."""
        own = [
            said
            for name, said in self.found.items()
            if f"test_{file}.py" in name and test in name and (_unit(name) or "HelicopterPlant") == unit
        ]
        if not own:
            return ""
        if "failed" in own:
            return "**failed**"
        skipped = [said for said in own if said != "passed"]
        return f"not run: {skipped[0]}" if skipped else "yes"


def _unit(name: str) -> str | None:
    return next((unit for unit in UNITS if re.search(rf"\[(.*-)?{unit}\b", name)), None)


def matrix(outcomes: Outcomes) -> str:
    """Table of units and versions against platforms and hosts."""
    titles = list(dict.fromkeys(title for title, *_ in COLUMNS))
    rows = [f"| unit | FMI | {' | '.join(titles)} |", "|---" * (len(titles) + 2) + "|"]
    for unit in UNITS:
        for version in (2, 3):
            cells = {title: outcomes.cell(file, test, unit) for title, fmi, file, test in COLUMNS if fmi == version}
            rows.append(f"| {unit} | {version}.0 | {' | '.join(cells.get(title, '') for title in titles)} |")
    return "\n".join(rows)


def importers(outcomes: Outcomes) -> str:
    """Table of the importers that ran the four-unit loop, with their largest difference from the master."""
    rows = ["| importer | largest difference over 10 000 steps |", "|---|---|"]
    for name, said in outcomes.found.items():
        if IMPORTER in name:
            differences = re.findall(r"largest difference ([\d.e+-]+)", outcomes.printed[name])
            host = name.partition("[")[2].partition("-")[0]
            rows.append(f"| {host} | {differences[0] if differences else said} |")
    return "\n".join(rows)


def machine() -> str:
    """What the tests ran on."""
    compiler = shutil.which("gcc")
    gcc = "no gcc"
    if compiler:
        gcc = subprocess.run([compiler, "-dumpfullversion"], capture_output=True, text=True, check=False).stdout.strip()
    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}, gcc {gcc}"


def main() -> int:
    """Run the tests and write the section."""
    outcomes = Outcomes()
    files = sorted({file for _, _, file, _ in COLUMNS})
    chosen = " or ".join(sorted({re.sub(r"\W.*", "", test) for _, _, _, test in COLUMNS} | {IMPORTER, "exchange"}))
    code = pytest.main(
        ["-q", "-p", "no:cacheprovider", "-k", chosen, *(str(ROOT / "tests" / f"test_{file}.py") for file in files)],
        plugins=[outcomes],
    )
    text = (
        f"Written by `python -m tests.toolchains` on {machine()}; *yes*: the test ran and passed.\n\n"
        f"{matrix(outcomes)}\n\nThe four-unit loop of native units in other importers:\n\n{importers(outcomes)}"
    )
    write_section(PAGE, "native", text)
    return int(code)


if __name__ == "__main__":
    sys.exit(main())
