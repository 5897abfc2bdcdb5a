"""Machine code is kept in the folder of the user alone: numba itself would keep it beside the sources."""

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_no_function_is_cached_by_numba_itself():
    packages = ("heli_plant", "heli_identifier", "fmu_src")
    sources = [path for package in packages for path in (ROOT / package).rglob("*.py")]
    assert [str(path) for path in sources if re.search(r"cache\s*=\s*True", path.read_text(encoding="utf-8"))] == [
        str(path) for path in sources if path.name == "compiled.py" and "``cache=True``" in path.read_text()
    ]
