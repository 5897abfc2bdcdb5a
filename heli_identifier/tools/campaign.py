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
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from itertools import islice
from logging import CRITICAL
from pathlib import Path
from time import perf_counter

import dask
from distributed import Client, LocalCluster, as_completed

from heli_identifier.errors import ConfigurationError, require_range
from heli_identifier.files import draft_folder
from heli_identifier.results import whole_folder
from heli_identifier.tools import campaign_rows
from heli_identifier.tools.campaign_rows import Row
from heli_identifier.tools.rigs import Source, error_text, source_digest
from heli_identifier.tracing import DiagnosisSettings

CONSOLIDATED = "campaign.parquet"

CODE = ("heli_plant", "heli_identifier.online", "heli_identifier.records", "heli_identifier.tracing")
"""Packages that a diagnosis runs."""

LOCAL = {
    # environment of a worker, which linear-algebra libraries read once, when they are loaded
    "distributed.nanny.pre-spawn-environ": {
        f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA")
    },
    # Dask looks 15 s after the death of a worker whether there is one, and otherwise gives its place up for good. On a
    # busy machine, where a start takes seconds, it may find it between two deaths; without a worker a campaign would
    # never end. Should there be none for a long time all the same, the rigs that wait fail, with a row that says so.
    "distributed.deploy.lost-worker-timeout": "1 day",
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
        row |= campaign_rows.truth_columns(rig.truth)
        row |= campaign_rows.diagnosis_columns(rig.diagnose(settings))
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

    The ``folder`` holds ``rows/<key>.parquet``, one row each, and ``campaign.parquet`` of them all; a file appears
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
    with whole_folder(folder) as draft:
        code = code_digest() + source_digest((work.__module__,))
        by_key = {result_key(own.rig, own.content(), settings, code): own for own in sources}
        files = {key: Path(folder) / "rows" / f"{key}.parquet" for key in by_key}
        rows = (row for file in files.values() if file.exists() for row in campaign_rows.read_rows(file))
        known = {row["key"]: row for row in rows if row["error"] is None}
        progress(len(known), len(by_key), None)
        if waiting := {key: source for key, source in by_key.items() if key not in known}:
            with connected(scheduler, workers) as client:
                for row in _arriving(client, waiting, partial(work, settings=settings)):
                    campaign_rows.write_rows([row], files[row["key"]])
                    known[row["key"]] = campaign_rows.complete(row)
                    progress(len(known), len(by_key), row)
        found = [known[key] for key in by_key]
        campaign_rows.write_rows(found, draft / CONSOLIDATED)
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


@contextmanager
def connected(scheduler: str | None = None, workers: int | None = None) -> Iterator[Client]:
    """Yield a Dask client of a scheduler, or of processes on this machine that are closed at the end."""
    if scheduler is None:
        # The scheduler makes its folder, too. No memory limit: pausing a diagnosis would not reduce the memory that it
        # needs. Any free port for Dask's own pages: two campaigns may run at once.
        with (
            draft_folder() as scratch,
            dask.config.set({**LOCAL, "temporary-directory": str(scratch)}),
            LocalCluster(
                n_workers=workers or os.cpu_count() or 1, threads_per_worker=1, memory_limit=0, dashboard_address=":0",
                silence_logs=CRITICAL, local_directory=str(scratch),
            ) as cluster,
            Client(cluster) as client,
        ):  # fmt: skip
            yield client
        return
    try:
        client = Client(scheduler, timeout=CONNECTING)
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            f"no Dask scheduler answers at {scheduler}; start one with `dask scheduler` and give its tcp:// address."
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECTING)
            digests = client.run(code_digest)
        except TimeoutError:
            raise ConfigurationError(
                f"the scheduler at {scheduler} has no worker; start some with "
                f"`dask worker {scheduler} --nthreads 1 --nworkers -1`."
            ) from None
        except ImportError as error:
            raise ConfigurationError(
                f"a worker cannot import {error.name}; install this software, with its cluster extra, on every machine."
            ) from error
        # The rows of workers whose code differs would be taken for results of this version.
        if others := sorted(worker for worker, digest in digests.items() if digest != code_digest()):
            raise ConfigurationError(
                f"the worker at {others[0]} runs another version of this software ({len(others)} of {len(digests)} "
                "do); install the same one on every machine."
            )
        yield client


def _arriving(client: Client, waiting: Mapping[str, Source], work: Callable[[Source], Row]) -> Iterator[Row]:
    """Yield each row as it arrives.

    A worker gets one rig at a time: when a worker dies, Dask suspects every rig that it held, and gives up a rig that
    it has suspected four times.
    """
    left, at_work = iter(waiting.items()), as_completed()

    def supply() -> None:
        free = max(1, len(client.nthreads())) - at_work.count()
        for key, source in islice(left, max(0, free)):
            at_work.add(client.submit(work, source, key=key, pure=False))

    supply()
    for future in at_work:
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
        supply()
        yield row | {"key": future.key}
