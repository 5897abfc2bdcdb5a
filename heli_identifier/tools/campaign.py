"""Campaigns: Dask diagnoses every rig of a list once, even if workers die or the campaign is started again.

The name of a result is a digest of everything that it depends on: the rig's name and content, the settings, and the
source of the code. A campaign that is started again skips the rigs that have a result of this name, and tries rigs that
failed again. Only the client writes results, each as it arrives. A worker that dies loses at most the rig that it was
diagnosing; Dask gives this rig to another worker.

Each worker diagnoses one rig at a time on one core: rigs are independent, so more rigs at once use the cores better
than more threads per rig. Dask and pyarrow are optional (``pip install 'heli-twin[cluster]'``).

A row holds plain values by key; it travels between processes and is stored as a JSON file.
"""

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from logging import CRITICAL
from pathlib import Path
from time import perf_counter
from typing import Any

import pandas as pd

from heli_identifier.errors import ConfigurationError, refuse, require_range
from heli_identifier.files import draft_folder, write_atomically
from heli_identifier.results import RigVerdict, Table, document_text, write_whole_folder
from heli_identifier.tools.rigs import Source, error_text, source_digest, summarise_diagnosis
from heli_identifier.tracing import DiagnosisSettings, Progress

try:
    import dask
    import pyarrow  # noqa: F401, writes the table at the end; if it is missing, the error comes before the first rig
    from distributed import Client, as_completed
except ModuleNotFoundError as error:
    raise ConfigurationError(
        f"a campaign needs the package {error.name}; install it with pip install 'heli-twin[cluster]'."
    ) from error

CONSOLIDATED = "campaign.parquet"

CODE = ("heli_plant", "heli_identifier.online", "heli_identifier.records", "heli_identifier.tracing")
"""Packages that a diagnosis runs."""

LOCAL = {
    # environment of a worker, which linear-algebra libraries read once, when they are loaded
    "distributed.nanny.pre-spawn-environ": {
        f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA")
    },
    # One rig at a time: when a worker dies, Dask suspects every rig that it held, and gives up a rig after four deaths.
    "distributed.scheduler.worker-saturation": 1.0,
    # On a busy machine a worker takes long to restart after its death, and Dask would not wait for it.
    "distributed.deploy.lost-worker-timeout": "1 day",
    # Without a worker a campaign would never end: rigs that wait longer than this fail, and their rows say so.
    "distributed.scheduler.no-workers-timeout": "10 minutes",
}
"""Settings of Dask for workers on this machine."""

CONNECTING = 60.0  # time limit [s] for a scheduler to answer, and then for its first worker

Row = dict[str, Any]  # what :func:`.rigs.summarise_diagnosis` returns, or the text of an ``error``, with the key
KEYS = ("rig", "key", "error", "verdict", "effects", "parameters_after", "seconds")
"""Keys of every complete row; a missing value is None."""


def diagnose_source(source: Source, settings: DiagnosisSettings) -> Row:
    """Load and diagnose one rig, whose own configuration overrides the settings.

    A rig that cannot be read or diagnosed gives a row with the text of its ``error``: one bad rig does not end the
    campaign.
    """
    start = perf_counter()
    try:
        return summarise_diagnosis(source.rig, source.load().diagnose(settings))
    except Exception as error:
        return {"rig": source.rig, "error": error_text(error), "seconds": perf_counter() - start}


def run_campaign(
    sources: Sequence[Source],
    folder: str | Path,
    settings: DiagnosisSettings | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress = lambda what, share: None,
    work: Callable[..., Row] = diagnose_source,
) -> list[Row]:
    """Diagnose every rig that has no result yet; return one row per source, in their order.

    The ``folder`` holds ``rows/<key>.json``, one row each, and ``campaign.parquet`` with all rows; each file is written
    completely or not at all. ``scheduler`` is the address of a running scheduler, "tcp://host:8786"; without it
    ``workers`` processes are started on this machine, by default one per core. A worker calls ``work`` with a rig and
    the settings.

    ConfigurationError if two rigs have the same name, no scheduler answers, the scheduler has no worker, its workers
    run another version of this software, or the folder cannot be used.
    """
    both = workers is not None and scheduler is not None
    refuse(both, f"workers = {workers} is for processes on this machine; {scheduler} has its own.")
    if workers is not None:
        require_range("workers", workers, "1", 1, 1000)
    for name, count in Counter(source.rig for source in sources).most_common(1):
        refuse(count > 1, f"two rigs are called {name!r}; every rig needs its own name.")
    settings, failed = settings or DiagnosisSettings(), 0
    with write_whole_folder(folder) as draft, ExitStack() as stack:
        code = code_digest() + source_digest((work.__module__,))
        by_key = {dask.base.tokenize(source.rig, source.content(), settings, code): source for source in sources}
        files = {key: Path(folder) / "rows" / f"{key}.json" for key in by_key}
        earlier = {key: read_row(file) for key, file in files.items() if file.exists()}
        done = {key: row for key, row in earlier.items() if row["error"] is None}
        progress(f"{len(done)} of {len(by_key)} rigs done", len(done) / max(len(by_key), 1))
        if waiting := {key: source for key, source in by_key.items() if key not in done}:
            client = _connect_workers(scheduler, stack) if scheduler is not None else _start_workers(workers, stack)
            for row in _collect_rows(client, waiting, work, settings):
                write_atomically(files[row["key"]], document_text(row))
                done[row["key"]] = row
                failed += row["error"] is not None
                text = f"{len(done)} of {len(by_key)} rigs done" + (f", {failed} failed" if failed else "")
                progress(text, len(done) / len(by_key))
        rows = [done[key] for key in by_key]
        write_atomically(draft / CONSOLIDATED, parquet_bytes(rows))
    return rows


def code_digest() -> str:
    """Return the digest of :data:`CODE` in the process that calls this: a worker has its own list and its own files."""
    return source_digest(CODE)


def _start_workers(workers: int | None, stack: ExitStack) -> Client:
    """Start workers on this machine, which end with the stack. No memory limit: a paused diagnosis frees nothing."""
    scratch = stack.enter_context(draft_folder())
    stack.enter_context(dask.config.set({**LOCAL, "temporary-directory": str(scratch)}))
    return stack.enter_context(
        Client(
            n_workers=workers or os.cpu_count() or 1,
            threads_per_worker=1,
            memory_limit=0,
            dashboard_address=":0",  # any free port, as two campaigns may run at once
            silence_logs=CRITICAL,
        )
    )


def _connect_workers(scheduler: str, stack: ExitStack) -> Client:
    """Connect to a scheduler whose workers run the same code as this process: other code gives other results."""
    try:
        client = stack.enter_context(Client(scheduler, timeout=CONNECTING))
        client.wait_for_workers(1, timeout=CONNECTING)
        digests = client.run(code_digest)
    except (OSError, ValueError, ImportError) as error:
        raise ConfigurationError(
            f"no Dask scheduler answers at {scheduler} with a worker that has this software; start `dask "
            f"scheduler`, and `dask worker {scheduler} --nthreads 1 --nworkers -1` on every machine."
        ) from error
    advice = "install the same one on every machine."
    differs = any(digest != code_digest() for digest in digests.values())
    refuse(differs, f"workers of {scheduler} run another version of this software; {advice}")
    return client


def _collect_rows(
    client: Client, waiting: Mapping[str, Source], work: Callable[..., Row], settings: DiagnosisSettings
) -> Iterator[Row]:
    """Return all rigs to the workers, and yield each row as it arrives."""
    futures = [client.submit(work, source, settings, key=key, pure=False) for key, source in waiting.items()]
    for future in as_completed(futures):
        advice = "the results so far are kept, and the same command continues from there."
        refuse(future.cancelled(), f"the scheduler went away; {advice}")
        try:
            row = future.result()
        except Exception as error:
            row = {"rig": waiting[future.key].rig, "error": f"{type(error).__name__}: {error}"}
        # While this process holds a future, Dask would compute its result again after the death of a worker.
        future.release()
        yield dict.fromkeys(KEYS) | row | {"key": future.key}


# --- rows ------------------------------------------------------------------------------------------------------------


def read_row(path: Path) -> Row:
    """Read a row of a campaign; ConfigurationError if the file holds no row."""
    try:
        return dict.fromkeys(KEYS) | json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(f"{path} is not a result of a campaign: {error}; move it away.") from error


def parquet_bytes(rows: Sequence[Row]) -> bytes:
    """Return rows as a Parquet file, a column for every plain value: ``axes_pitch_use`` of ``axes``."""
    without_none = [{key: value for key, value in row.items() if value is not None} for row in rows]
    table = pd.json_normalize(without_none, sep="_")
    return table.reindex(columns=[*dict.fromkeys((*KEYS[:4], *table.columns))]).to_parquet()


def summarise_rows(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of a campaign.

    ``rigs``: number of diagnosed rigs, ``verdicts``: of these by verdict. ``effects``: entries "name axis" and the
    number of rigs on which each was found, most frequent first. ``failures``: rig and error text.
    """
    diagnosed = [row for row in rows if row["error"] is None]
    verdicts = Counter(row["verdict"] for row in diagnosed)
    found = Counter(f"{effect['name']} {effect['axis']}" for row in diagnosed for effect in row["effects"])
    return {
        "rigs": len(diagnosed),
        "verdicts": {str(verdict): verdicts[verdict] for verdict in RigVerdict},
        "effects": found.most_common(),
        "failures": [(row["rig"], row["error"]) for row in rows if row["error"] is not None],
    }


def campaign_tables(summary: dict[str, Any]) -> tuple[list[Table], list[str]]:
    """Return tables and sentences of a summary: what was found, and what failed."""
    counts = {"rigs": summary["rigs"], **summary["verdicts"]}
    tables = [Table("Campaign", [*counts], [[str(count) for count in counts.values()]])]
    if summary["effects"]:
        effects = [(name, str(count)) for name, count in summary["effects"]]
        tables.append(Table("Effects found", ("effect", "rigs"), effects))
    return tables, [f"failed: {rig}: {error}" for rig, error in summary["failures"]]
