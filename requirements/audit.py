"""Known vulnerabilities of the pinned packages, by pip-audit: ``python requirements/audit.py``.

pip-audit says "No known vulnerabilities found", with exit code 0, of packages of which its database knows nothing, as
behind a mirror that holds files and no advisories. Here a package that no database answers for is a failure of its own:

| exit code | means |
|---|---|
| 0 | a database answered for every package and knows of no vulnerability |
| 1 | some package has a known vulnerability |
| 2 | none is known, but some packages could not be audited |

PyPI is asked first, and then OSV for what is left; the environment variable ``OSV_URL`` names a copy of its interface.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

PINNED = Path(__file__).parent / "demo.txt"
SERVICES = {"pypi": "pypi.org", "osv": "api.osv.dev"}


def asked(service: str, pinned: Path) -> list[dict[str, Any]]:
    """Ask a database; give what pip-audit says of every package, or nothing if the database cannot be reached."""
    command = [sys.executable, "-m", "pip_audit", "--requirement", str(pinned), "--require-hashes", "--disable-pip",
               "--vulnerability-service", service, "--format", "json", "--progress-spinner", "off"]  # fmt: skip
    if service == "osv" and "OSV_URL" in os.environ:
        command += ["--osv-url", os.environ["OSV_URL"]]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        return json.loads(done.stdout)["dependencies"]
    except ValueError:
        reason = done.stderr.strip().splitlines() or ["no reason given"]
        print(f"{SERVICES[service]} gives no answer: {reason[-1][:200]}", file=sys.stderr)
        return []


def verdict(answers: dict[str, list[dict[str, Any]]]) -> tuple[int, str]:
    """Give exit code and sentences from what each database said; a package counts where any of them answered."""
    names = {one["name"] for found in answers.values() for one in found}
    answered = {one["name"]: one["vulns"] for found in answers.values() for one in found if "vulns" in one}
    known = [
        f"{name}: {bug['id']}, mended in {', '.join(bug['fix_versions']) or 'no version yet'}"
        for name, bugs in sorted(answered.items())
        for bug in bugs
    ]
    open_ = sorted(names - answered.keys())
    lines = [f"{len(answered)} packages audited, {len(known)} known vulnerabilities", *known]
    if open_ or not names:
        lines.append(
            f"NOT AUDITED: {', '.join(open_) or 'every package'}. No advisory database that can be reached from here "
            f"({', '.join(SERVICES.values())}) knows these versions. Run this where one of them can be reached, or set "
            "OSV_URL to a copy of OSV's interface."
        )
    return 1 if known else 2 if open_ or not names else 0, "\n".join(lines)


def main() -> int:
    """Audit the pinned packages."""
    answers: dict[str, list[dict[str, Any]]] = {}
    for service in SERVICES:
        answers[service] = asked(service, PINNED)
        code, text = verdict(answers)
        if code != 2:
            break
    print(text)
    return code


if __name__ == "__main__":
    sys.exit(main())
