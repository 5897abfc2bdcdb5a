"""The readers of `tests.fuzzing` under atheris, a fuzzer that is guided by the coverage of the readers' own code.

`python -m tests.guided_fuzzing READER SECONDS FOLDER` runs one reader, named by a number of `READERS` (0, 1, ...), and
keeps the corpus that it grows and what it finds in FOLDER. A finding does not end the run; the same place in the code
is kept once. The last line counts the executions. Needs Python 3.11 and `pip install atheris`.
"""

import hashlib
import sys
import tempfile
import traceback
from pathlib import Path
from random import Random

import atheris

with atheris.instrument_imports(include=["heli_identifier", "fmu_src", "fmpy", "tomllib", "zipfile"]):
    import fmpy.model_description  # noqa: F401 - loaded here so that it is instrumented

    import heli_identifier.records.reading  # noqa: F401 - the doors are lazy
    from tests.fuzzing import READERS, TOKENS, complaint


def main(reader: str, seconds: str, folder: str) -> None:
    """Run one reader until the time is over."""
    name, _, seeds = READERS[tuple(READERS)[int(reader)]]
    corpus, findings = Path(folder) / "corpus" / reader, Path(folder) / "findings"
    for place in (corpus, findings):
        place.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        (corpus / hashlib.sha1(seed).hexdigest()).write_bytes(b"\0" + seed)
    words = Path(folder) / "words"
    words.write_text("".join('"' + "".join(f"\\x{byte:02x}" for byte in token) + '"\n' for token in TOKENS))
    path = Path(tempfile.mkdtemp(dir="/dev/shm")) / name
    known = set()

    def once(data: bytes) -> None:
        """Read the file; its first byte, which is no part of it, chooses among the reader's settings."""
        path.write_bytes(data[1:])
        found = complaint(tuple(READERS)[int(reader)], path, Random(data[0] if data else 0))
        if found is not None:
            place = str(traceback.extract_tb(found.__traceback__)[-1:] or found)
            if place not in known:
                known.add(place)
                (findings / f"{len(known)}-{reader}-{name}").write_bytes(data[1:])
                traceback.print_exception(found)

    limits = [f"-max_total_time={seconds}", "-max_len=20000", "-len_control=0", "-rss_limit_mb=4000", "-timeout=60"]
    # a crash of the forked process that reads a binary log first is an answer, and the fuzzer's handlers would take it
    limits += [f"-handle_{name}=0" for name in ("segv", "bus", "fpe", "abrt", "ill")]
    atheris.Setup([sys.argv[0], *limits, f"-dict={words}", "-print_final_stats=1", str(corpus)], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main(*sys.argv[1:])
