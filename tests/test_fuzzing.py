"""Files with random damage, given to every reader: each answers with a value or with one sentence. Findings of longer
runs, `HELI_FUZZ=FILES HELI_FUZZ_SEED=NUMBER`, stay in tests/corpus."""

import gzip
import io
import json
import os
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import openpyxl
import pytest
from scipy.io import savemat

from fmu_src import build
from fmu_src.errors import FmuError
from fmu_src.master.instance import unpack
from heli_identifier.errors import IdentifierError
from heli_identifier.records import LogFormat, guess, read_configuration, read_log
from heli_identifier.records.heli_toml import TEMPLATE
from heli_identifier.records.units import SIGNALS
from heli_identifier.results.parameters import read_parameters
from tests.faults.material import HEADER, ROWS, as_struct, columns, document
from tests.faults.units import archive
from tests.units import read_archive

LOG = "\n".join([HEADER, *ROWS[:540:2], ""]).encode()
"""5.4 seconds at 50 Hz: a fuzzer reads a small file often."""
_NUMBERED = {name: f"column {i}" for i, name in enumerate(SIGNALS, 1)}
_UNITS = {"time": "s", "v_front": "V", "v_rear": "V", "pitch": "rad", "elevation": "deg", "travel": "rad"}
_FORMATS = (LogFormat(), LogFormat(columns=_NUMBERED, units=_UNITS))
TOKENS = (
    b"nan", b"inf", b"-", b"1e308", b"1e-320", b"9" * 30, b"\0", b"\xff", b",", b";", b"\t", b"\n", b"\r", b'"', b"[",
    b"]", b"(", b"#", b"deg", b"pitch", b"time", b" ", b"2026-01-01T00:00:00", b"true", b"{", b"}", b"=", b"'", b"\\",
    b"<", b"&a;",
)  # fmt: skip


def _logged(path: Path, random: Random) -> None:
    """Read a log; what is read has to be a record that a rig can give."""
    log = read_log(path, random.choice(_FORMATS), *random.choice(((None, None), (1.0, None), (None, 4.0))))
    assert np.isfinite(log.voltages).all() and np.abs(log.voltages).max() <= 100.0
    assert np.isfinite(log.angles).all() and len(log.angles) == len(log.voltages)


def _unit(path: Path, random: Random) -> None:
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        unpack("plant", path, Path(folder))


def _description(path: Path, random: Random) -> None:
    archive(**{"modelDescription.xml": path.read_bytes()})(path.parent)
    _unit(path.parent / "it.fmu", random)


def _written(write: Callable[[io.BytesIO], object]) -> bytes:
    data = io.BytesIO()
    write(data)
    return data.getvalue()


def _spreadsheet(data: io.BytesIO) -> None:
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet()
    for line in (HEADER, *ROWS[:540:2]):
        sheet.append([cell if cell.endswith("]") else float(cell) for cell in line.split(",")])
    book.save(data)


def _unit_and_description() -> tuple[bytes, bytes]:
    """Give an FMU without its binaries, and its description."""
    with tempfile.TemporaryDirectory() as folder:
        whole = read_archive(build("HelicopterPlant", folder))
        found = {name: data for name, data in whole.items() if name.endswith((".xml", ".txt"))}
        archive(**found)(Path(folder))
        return (Path(folder) / "it.fmu").read_bytes(), found["modelDescription.xml"]


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
FMU, DESCRIPTION = _unit_and_description()
MATLAB = ({name: values[:540:2] for name, values in as_struct().items()}, {"ans": columns()[:, :540:2]})
READERS: dict[str, tuple[str, Callable[[Path, Random], object], tuple[bytes, ...]]] = {
    "a text log": ("log.csv", _logged, TEXTS),
    "a text log that is looked into": ("log.csv", lambda path, _: guess(path), TEXTS),
    "a spreadsheet": ("log.xlsx", _logged, (_written(_spreadsheet),)),
    "a packed log": ("log.csv.gz", _logged, (gzip.compress(LOG),)),
    "a MATLAB log": ("log.mat", _logged, tuple(_written(lambda data, v=v: savemat(data, v)) for v in MATLAB)),
    "heli.toml": ("heli.toml", lambda path, _: read_configuration(path), (TEMPLATE.read_bytes(),)),
    "parameters.json": ("p.json", lambda path, _: read_parameters(path), (json.dumps(document()).encode(),)),
    "an FMU": ("it.fmu", _unit, (FMU,)),
    "a model description": ("d.xml", _description, (DESCRIPTION,)),
}
"""Name of the file, what reads it, and good files."""


def damaged(data: bytes, random: Random) -> bytes:
    """Change some bytes, put tokens in, take pieces out, or copy them to other places; most at the beginning."""
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 3, 8, 30))):
        kind, size = random.random(), len(out)
        at = random.randrange(max(1, size if random.random() < 0.4 else min(size, 400)))
        token = random.choice(TOKENS)
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


def complaint(reader: str, path: Path, random: Random) -> Exception | None:
    """Read a file; give what was raised if the answer is neither a value nor one sentence."""
    try:
        READERS[reader][1](path, random)
    except (IdentifierError, FmuError) as problem:
        return problem if "\n" in str(problem).strip() else None
    except Exception as problem:
        return problem
    return None


def tried(reader: str, folder: Path, random: Random) -> bytes | None:
    """Damage a file and read it; give its bytes if the answer is neither a value nor one sentence."""
    name, _, seeds = READERS[reader]
    data = damaged(random.choice(seeds), random)
    (folder / name).write_bytes(data)
    problem = complaint(reader, folder / name, random)
    if problem is None:
        return None
    traceback.print_exception(problem)
    return data


TRIED, SEED = int(os.environ.get("HELI_FUZZ", 150)), int(os.environ.get("HELI_FUZZ_SEED", 16))
"""Files for each reader, and the seed of their damage."""

APART = ("a MATLAB log", "a spreadsheet")  # each file is read by a process of its own, which takes a second


@pytest.mark.parametrize("reader", [pytest.param(r, marks=[pytest.mark.slow] * (r in APART)) for r in READERS])
def test_a_damaged_file_is_read_or_refused_in_one_sentence(tmp_path, reader):
    random = Random(SEED)
    assert [found for _ in range(TRIED) if (found := tried(reader, tmp_path, random)) is not None] == []


CORPUS = sorted((Path(__file__).parent / "corpus").glob("*/*"))
"""Small files of long runs, by reader: ``found`` ones broke it, ``covered`` ones reach what no other file does."""


@pytest.mark.parametrize("file", CORPUS, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_a_file_of_the_corpus_is_read_or_refused_in_one_sentence(tmp_path, file):
    (reader,) = [name for name in READERS if name.replace(" ", "-") == file.parent.name]
    path = tmp_path / READERS[reader][0]
    path.write_bytes(file.read_bytes())
    for seed in range(6):
        assert complaint(reader, path, Random(seed)) is None
