"""Campaigns: each rig of a list is diagnosed once, even if the campaign is killed and started again.

A row holds the diagnosis of a rig, or the text of its ``error``; it travels between processes and is stored as a JSON
file, as soon as it arrives. Its ``key`` is a digest of everything that it depends on: the content of the logs and of
the configuration, and the source of this program. A campaign that is started again skips the rigs that have a row with
this key, and tries rigs that failed again.

Rigs are independent, so more rigs at once use cores better than more threads per rig. On this machine every rig has a
process to itself: if it is killed, another one begins the rig again; if that ends as well, this rig fails alone. On a
cluster Dask gives the rig of a dead worker to another one.
"""

import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib.util import find_spec
from json import dumps, loads
from pathlib import Path
from typing import Any

import pandas as pd

import heli_identifier
import heli_plant
from heli_identifier.errors import ConfigurationError, IdentifierError, refuse
from heli_identifier.files import draft_folder, write_atomically
from heli_identifier.processes import NoAnswer, call_apart
from heli_identifier.results import Table, document_text, write_whole_folder
from heli_identifier.tools.rigs import Source, digest_files, error_text
from heli_identifier.tracing import Progress

CONSOLIDATED = "campaign.parquet"
CONNECTING = 60.0  # time limit [s] for a scheduler to answer, and then for its first worker
PATIENCE = 6 * 3600.0  # a process that works on one rig for longer [s] hangs

Row = dict[str, Any]
"""The ``rig``, the ``error``, the keys of diagnosis.json if there is none, and the ``key``."""


def diagnose_source(source: Source) -> Row:
    """Load and diagnose one rig; the row of one that cannot be read or diagnosed has the text of its ``error``."""
    try:
        return source.load().diagnose().to_dict()
    except Exception as error:
        return {"error": error_text(error)}


Work = Callable[[Source], Row]


def run_campaign(
    sources: Sequence[Source],
    folder: str | Path,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress = lambda what, share: None,
    work: Work = diagnose_source,
) -> list[Row]:
    """Diagnose every rig that has no row yet; return one row per source, in their order.

    The ``folder`` holds ``rows/RIG.json`` and ``campaign.parquet`` with all rows; each file is written completely or
    not at all. ``scheduler`` is the address of a running Dask scheduler, "tcp://host:8786"; without it ``workers``
    processes run on this machine, by default one per core. A worker calls ``work`` with a rig.

    ConfigurationError if no scheduler answers, it has no worker, its workers run another version of this software, or
    the folder cannot be used.
    """
    for package in ("pyarrow", *(["distributed"] if scheduler else [])):
        missing = find_spec(package) is None
        refuse(missing, f"this campaign needs the package {package}: pip install 'heli-twin[cluster]'.")
    stored = Path(folder) / "rows"
    with write_whole_folder(folder) as draft:
        software = software_digest()
        keys = {x.rig: sha256((x.content() + software).encode()).hexdigest() for x in sources}
        rows = {rig: row for rig, key in keys.items() if (row := _read_row(stored / f"{rig}.json", key))}

        def report() -> None:
            failed = sum(row["error"] is not None for row in rows.values())
            text = f"{len(rows) - failed} of {len(keys)} rigs diagnosed" + (f", {failed} failed" if failed else "")
            progress(text, len(rows) / max(len(keys), 1))

        report()
        if waiting := [source for source in sources if source.rig not in rows]:
            with _start_workers(scheduler, workers) as submit:
                futures = {submit(work, source): source.rig for source in waiting}
                for future in as_completed(futures):
                    rig = futures.pop(future)  # while it is held, Dask would repeat it if its worker died
                    try:
                        row = future.result()
                    except Exception as error:
                        row = {"error": f"{type(error).__name__}: {error}"}
                    rows[rig] = {"rig": rig, "error": None} | row | {"key": keys[rig]}
                    write_atomically(stored / f"{rig}.json", document_text(rows[rig]))
                    report()
        in_order = [rows[source.rig] for source in sources]
        write_atomically(draft / CONSOLIDATED, parquet_bytes(in_order))
    return in_order


def _read_row(file: Path, key: str) -> Row | None:
    """Read the row of a rig; None without one, or if its key is another one, or if the rig failed."""
    with suppress(OSError, ValueError, LookupError, TypeError):
        row: Row = loads(file.read_text(encoding="utf-8"))
        return row if row["key"] == key and row["error"] is None else None
    return None


def software_digest() -> str:
    """Return the digest of the source of this program in the process that calls this, which may be a worker's."""
    folders = (Path(str(package.__file__)).parent for package in (heli_identifier, heli_plant))
    return digest_files(file for folder in folders for file in sorted(folder.rglob("*.py")))


@contextmanager
def _start_workers(scheduler: str | None, workers: int | None) -> Iterator[Callable[..., "Future[Row]"]]:
    """Return a function that gives work to a worker, here or on a cluster; what waits at the end is dropped."""
    if scheduler is None:
        threads = ThreadPoolExecutor(workers or os.cpu_count())
        try:
            yield lambda *order: threads.submit(_work_apart, *order)
        finally:
            threads.shutdown(cancel_futures=True)
        return
    from distributed import Client

    try:
        client = Client(scheduler, timeout=CONNECTING)
        client.wait_for_workers(1, timeout=CONNECTING)
        digests = client.run(software_digest)
    except (OSError, ValueError, ImportError) as error:
        raise ConfigurationError(
            f"no Dask scheduler answers at {scheduler} with a worker that has this software; start `dask "
            f"scheduler`, and `dask worker {scheduler} --nthreads 1 --nworkers -1` on every machine."
        ) from error
    with client:
        differs = any(digest != software_digest() for digest in digests.values())
        advice = "install the same one on every machine."
        refuse(differs, f"workers of {scheduler} run another version of this software; {advice}")
        yield client.get_executor(pure=False).submit


def _work_apart(work: Work, source: Source) -> Row:
    """Work on a rig in a process of its own, and in another one if this is killed; the second end gives an error."""
    for _ in range(2):
        with draft_folder() as folder:
            try:
                return call_apart(folder, work, source, error=IdentifierError, patience=PATIENCE)
            except NoAnswer as error:
                row = {"error": "its process {}: {}".format(*error.args)}
    return row


def parquet_bytes(rows: Sequence[Row]) -> bytes:
    """Return rows as a Parquet file, a column for every plain value: ``axes_pitch_use`` of ``axes``; lists are JSON."""
    table = pd.json_normalize([*rows], sep="_")
    return table.map(lambda cell: dumps(cell) if isinstance(cell, list) else cell).to_parquet()


def campaign_table(rows: Sequence[Row]) -> Table:
    """Return the numbers of rigs by verdict, and by effect that was found."""
    diagnosed = [row for row in rows if row["error"] is None]
    verdicts = Counter(str(row["verdict"]) for row in diagnosed)
    effects = Counter(f"{effect['name']} {effect['axis']}" for row in diagnosed for effect in row["effects"])
    counts = [(name, str(count)) for found in (verdicts, effects) for name, count in found.most_common()]
    return Table(f"{len(diagnosed)} of {len(rows)} rigs were diagnosed", ("verdict, or effect", "rigs"), counts)
