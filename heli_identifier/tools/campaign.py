"""Campaigns: every rig of a list diagnosed once on Dask, whatever happens to workers or to the campaign itself.

A result is called by a digest of everything that it depends on: the rig's name and content, the settings, and the
source of all code that takes part. A campaign that is started again skips the rigs that have a result of this name;
rigs that failed are tried again. Only the client writes results, each as it arrives. A worker that dies loses at most
the rig that it was diagnosing, which Dask gives to another worker.

Each worker diagnoses one rig at a time on one core: rigs are independent, so more rigs at once use the cores better
than more threads per rig. Dask and pyarrow are optional (``pip install 'heli-twin[cluster]'``).
"""

import hashlib
import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from logging import CRITICAL
from pathlib import Path
from time import perf_counter

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.files import draft_folder, write_atomically
from heli_identifier.results import document_text, whole_folder
from heli_identifier.tools import campaign_rows
from heli_identifier.tools.campaign_rows import Row
from heli_identifier.tools.rigs import Source, error_text, source_digest, summary_of
from heli_identifier.tracing import DiagnosisSettings

try:
    import dask
    import pyarrow  # noqa: F401, writes the table at the end; where it is missing, that is said before the first rig
    from distributed import Client, as_completed
except ModuleNotFoundError as error:
    said = f"a campaign needs the package {error.name}; install it with pip install 'heli-twin[cluster]'."
    raise ConfigurationError(said) from error

CONSOLIDATED = "campaign.parquet"

CODE = ("heli_plant", "heli_identifier.online", "heli_identifier.records", "heli_identifier.tracing")
"""Packages that a diagnosis runs."""

LOCAL = {
    # environment of a worker, which linear-algebra libraries read once, when they are loaded
    "distributed.nanny.pre-spawn-environ": {
        f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA")
    },
    # One rig at a time: when a worker dies, Dask suspects every rig that it held, and gives up one after four deaths.
    "distributed.scheduler.worker-saturation": 1.0,
    # On a busy machine a worker takes long to come back after its death, and Dask would give its place up for good.
    "distributed.deploy.lost-worker-timeout": "1 day",
    # Without a worker a campaign would never end: rigs that wait so long fail, with a row that says so.
    "distributed.scheduler.no-workers-timeout": "10 minutes",
}
"""Settings of Dask for workers on this machine."""

CONNECTING = 60.0  # time limit [s] for a scheduler to answer, and then for its first worker

Progress = Callable[[int, int, Row | None], None]
"""Called with the number of rigs done, the number in all, and the row that has just arrived, if any."""


def diagnosed(source: Source, settings: DiagnosisSettings) -> Row:
    """Load and diagnose one rig, whose own configuration overrides the settings.

    A rig that cannot be read or diagnosed gives a row with the text of its ``error``: one bad rig does not end the
    campaign.
    """
    began = perf_counter()
    row: Row = {"rig": source.rig}
    try:
        rig = source.load()
        row["truth"] = None if rig.truth is None else [{"name": n, "value": v} for n, v in rig.truth.items()]
        row |= summary_of(source.rig, rig.diagnose(settings))
    except Exception as error:
        row |= {"error": error_text(error), "seconds": perf_counter() - began}
    return row


def run_campaign(
    sources: Sequence[Source],
    folder: str | Path,
    settings: DiagnosisSettings | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress = lambda done, total, row: None,
    work: Callable[..., Row] = diagnosed,
) -> list[Row]:
    """Diagnose every rig that has no result yet; return one row per source, in their order.

    The ``folder`` holds ``rows/<key>.json``, one row each, and ``campaign.parquet`` of them all; a file appears
    whole or not at all. ``scheduler`` is the address of a running one, "tcp://host:8786"; without it ``workers``
    processes are started on this machine, by default one per core. ``work`` is what a worker does with a rig and the
    settings.

    ConfigurationError if two rigs have the same name, no scheduler answers, it has no worker or its workers run another
    version of this software, or the folder cannot be used.
    """
    if workers is not None and scheduler is not None:
        raise ConfigurationError(f"workers = {workers} is for processes on this machine; {scheduler} has its own.")
    if workers is not None:
        require_range("workers", workers, "1", 1, 1000)
    for name, count in Counter(source.rig for source in sources).most_common(1):
        if count > 1:
            raise ConfigurationError(f"two rigs are called {name!r}; every rig needs its own name.")
    settings = settings or DiagnosisSettings()
    with whole_folder(folder) as draft, ExitStack() as stack:
        code = code_digest() + source_digest((work.__module__,))
        by_key = {result_key(own.rig, own.content(), settings, code): own for own in sources}
        files = {key: Path(folder) / "rows" / f"{key}.json" for key in by_key}
        rows = {key: campaign_rows.read_row(file) for key, file in files.items() if file.exists()}
        known = {key: row for key, row in rows.items() if row["error"] is None}
        progress(len(known), len(by_key), None)
        if waiting := {key: source for key, source in by_key.items() if key not in known}:
            client = _remote(scheduler, stack) if scheduler is not None else _local(workers, stack)
            for row in _arriving(client, waiting, work, settings):
                write_atomically(files[row["key"]], document_text(row))
                known[row["key"]] = campaign_rows.complete(row)
                progress(len(known), len(by_key), row)
        found = [known[key] for key in by_key]
        write_atomically(draft / CONSOLIDATED, campaign_rows.parquet_bytes(found))
    return found


def code_digest() -> str:
    """Return the digest of the source of every package that a diagnosis runs."""
    return source_digest(CODE)


def result_key(rig: str, content: str, settings: DiagnosisSettings, code: str) -> str:
    """Return the name of a result by the rig's name, the digests of its logs and of the code, and the settings.

    It has 96 bits, with which no two of a billion results share one.
    """
    parts = [rig, content, json.dumps(asdict(settings), sort_keys=True), code]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:24]


def _local(workers: int | None, stack: ExitStack) -> Client:
    """Start processes on this machine, which end with the stack. No memory limit: a paused diagnosis frees nothing."""
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


def _remote(scheduler: str, stack: ExitStack) -> Client:
    """Connect to a scheduler whose workers run the code of this process: results of other code are not its own."""
    try:
        client = stack.enter_context(Client(scheduler, timeout=CONNECTING))
        client.wait_for_workers(1, timeout=CONNECTING)
        digests = client.run(code_digest)
    except (OSError, ValueError, ImportError) as error:
        raise ConfigurationError(
            f"no Dask scheduler answers at {scheduler} with a worker that has this software; start `dask "
            f"scheduler`, and `dask worker {scheduler} --nthreads 1 --nworkers -1` on every machine."
        ) from error
    if any(digest != code_digest() for digest in digests.values()):
        raise ConfigurationError(
            f"workers of {scheduler} run another version of this software; install the same one on every machine."
        )
    return client


def _arriving(
    client: Client, waiting: Mapping[str, Source], work: Callable[..., Row], settings: DiagnosisSettings
) -> Iterator[Row]:
    """Give all rigs to the workers, and yield each row as it arrives."""
    futures = [client.submit(work, source, settings, key=key, pure=False) for key, source in waiting.items()]
    for future in as_completed(futures):
        if future.cancelled():
            raise ConfigurationError(
                "the scheduler went away; the results so far are kept, and the same command continues from there."
            )
        try:
            row = future.result()
        except Exception as error:
            row = {"rig": waiting[future.key].rig, "error": f"{type(error).__name__}: {error}"}
        # While this process holds a future, Dask would compute its result again after the death of a worker.
        future.release()
        yield row | {"key": future.key}
