"""Files with random damage, given to every reader: each answers with a value or with one sentence.

`python -m tests.fuzzing SECONDS [SEED]` runs on as long as is wanted and prints what was found.
"""

import gzip
import io
import json
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from random import Random

from scipy.io import savemat

from fmu_src.errors import FmuError
from fmu_src.ssp import read_parameter_set, write_parameter_set
from heli_identifier.errors import IdentifierError
from heli_identifier.records import LogFormat, guess, read_configuration, read_log
from heli_identifier.records.template import template_text
from heli_identifier.workbench.delivery.parameter_file import read_parameters
from tests.faults.material import HEADER, ROWS, as_struct, columns, document

LOG = "\n".join([HEADER, *ROWS[:600], ""]).encode()
_NUMBERED = {
    name: f"column {i}" for i, name in enumerate(("time", "v_front", "v_rear", "pitch", "elevation", "travel"), 1)
}
_UNITS = {"time": "s", "v_front": "V", "v_rear": "V", "pitch": "rad", "elevation": "deg", "travel": "rad"}
_FORMATS = (LogFormat(), LogFormat(decimal=","), LogFormat(columns=_NUMBERED, units=_UNITS))
_TOKENS = (
    b"nan", b"inf", b"-", b"1e308", b"1e-320", b"9" * 30, b"\0", b"\xff", b",", b";", b"\t", b"\n", b"\r", b'"', b"[",
    b"]", b"(", b"#", b"deg", b"pitch", b"time", b" ", b"2026-01-01T00:00:00", b"true", b"{", b"}", b"=", b"'", b"\\",
    b"<", b"&a;",
)  # fmt: skip


def _logged(path: Path, random: Random) -> None:
    read_log(path, random.choice(_FORMATS), *random.choice(((None, None), (1.0, None), (None, 4.0))))


def _guessed(path: Path, random: Random) -> None:
    guess(path)


def _matlab(variables: dict) -> bytes:
    data = io.BytesIO()
    savemat(data, variables)
    return data.getvalue()


def _parameter_set() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return write_parameter_set("HelicopterPlant", {}, Path(folder) / "set.ssv").read_bytes()


Reader = tuple[str, Callable[[Path, Random], object], tuple[bytes, ...]]
TEXTS = (
    LOG,
    LOG.replace(b",", b";"),
    LOG.replace(b",", b" "),
    b"# comment\n" + LOG,
    b"sep=,\n" + LOG,
    LOG.replace(b"\n", b"\r"),
    LOG.partition(b"\n")[2],
    LOG.decode().encode("utf-16"),
    b"LabVIEW Measurement\t\n***End_of_Header***\n" + LOG.replace(b",", b"\t"),
    b"time,v_front,v_rear,pitch,elevation,travel\ns,V,V,rad,rad,rad\n" + LOG.partition(b"\n")[2],
)
READERS: dict[str, Reader] = {
    "a text log": ("log.csv", _logged, TEXTS),
    "a text log that is looked into": ("log.csv", _guessed, TEXTS),
    "a packed log": ("log.csv.gz", _logged, (gzip.compress(LOG),)),
    "a MATLAB log": ("log.mat", _logged, (_matlab(as_struct()), _matlab({"ans": columns()[:, :600]}))),
    "heli.toml": ("heli.toml", lambda path, _: read_configuration(path), (template_text().encode(),)),
    "parameters.json": ("p.json", lambda path, _: read_parameters(path), (json.dumps(document()).encode(),)),
    "a parameter set of SSP": ("set.ssv", lambda path, _: read_parameter_set(path), (_parameter_set(),)),
}


def damaged(data: bytes, random: Random) -> bytes:
    """Change some bytes, put tokens in, take pieces out, or copy them to other places; most at the beginning."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 3, 8, 30))):
        kind, size = random.random(), len(out)
        at = random.randrange(max(1, size if random.random() < 0.4 else min(size, 400)))
        token = random.choice(_TOKENS)
        if kind < 0.25 and size:
            out[at] = random.randrange(256)
        elif kind < 0.5:
            out[at:at] = token
        elif kind < 0.65:
            del out[at : at + random.choice((1, 2, 10, 100, 1000, size))]
        elif kind < 0.8:
            out[at : at + len(token)] = token
        else:
            source, length = random.randrange(size + 1), random.choice((4, 30, 200))
            out[at : at + (length if kind < 0.9 else 0)] = out[source : source + length]
    return bytes(out)


def tried(reader: str, folder: Path, random: Random) -> bytes | None:
    """Damage a file and read it; give its bytes if the answer is neither a value nor one sentence."""
    name, read, seeds = READERS[reader]
    data = damaged(random.choice(seeds), random)
    path = folder / name
    path.write_bytes(data)
    try:
        read(path, random)
    except (IdentifierError, FmuError) as problem:
        return data if "\n" in str(problem).strip() else None
    except Exception:
        traceback.print_exc()
        return data
    return None


def main(seconds: float, seed: int) -> None:
    """Try until the time is over; keep what was found in the folder ``findings``."""
    random, ends, count = Random(seed), time.monotonic() + seconds, 0
    with tempfile.TemporaryDirectory() as folder:
        while time.monotonic() < ends:
            reader = random.choice(tuple(READERS))
            found = tried(reader, Path(folder), random)
            count += 1
            if found is not None:
                Path("findings").mkdir(exist_ok=True)
                (Path("findings") / f"{count}-{READERS[reader][0]}").write_bytes(found)
    print(f"{count} files tried")


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
