"""Campaigns: every rig of a list diagnosed once on Dask, whatever happens to workers or to the campaign itself.

A result is called by a digest of everything that it depends on: the rig's name and content, the settings, and the
source of all code that takes part. A campaign that is started again skips the rigs that have a result of this name;
rigs that failed are tried again. Only the client writes results, each as it arrives. A worker that dies loses at most
the rig that it was diagnosing, which Dask gives to another worker.

Each worker diagnoses one rig at a time on one core: rigs are independent, so more rigs at once use the cores better
than more threads per rig. Dask and pyarrow are optional (``pip install 'heli-twin[cluster]'``).

A row holds plain values by key, which travel between processes and stand in a JSON file. The diagnosis never sees the
truth of a generated rig; rows are judged against it afterwards. An effect is called "name axis" there. One that acts on
several axes is true on each of them, and named if it is found on any. *Covered*: the 95 % interval of a parameter or
coefficient holds the true value.
"""

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from logging import CRITICAL
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from heli_identifier.errors import ConfigurationError, refuse, require_range
from heli_identifier.files import draft_folder, write_atomically
from heli_identifier.online import Estimate, ModelParameters
from heli_identifier.results import RigVerdict, Table, document_text, whole_folder
from heli_identifier.tools.rigs import Source, error_text, source_digest, summary_of
from heli_identifier.tracing import DiagnosisSettings, Progress

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

Row = dict[str, Any]
"""What :func:`.rigs.summary_of` gives of a diagnosis, or the text of an ``error``, with the key and the truth."""

KEYS = ("rig", "key", "error", "verdict", "effects", "parameters", "seconds", "truth")
"""Keys of every row; the value of one that a row lacks is None."""


def diagnose_source(source: Source, settings: DiagnosisSettings) -> Row:
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
    progress: Progress = lambda what, share: None,
    work: Callable[..., Row] = diagnose_source,
) -> list[Row]:
    """Diagnose every rig that has no result yet; return one row per source, in their order.

    The ``folder`` holds ``rows/<key>.json``, one row each, and ``campaign.parquet`` of them all; a file appears
    whole or not at all. ``scheduler`` is the address of a running one, "tcp://host:8786"; without it ``workers``
    processes are started on this machine, by default one per core. ``work`` is what a worker does with a rig and the
    settings.

    ConfigurationError if two rigs have the same name, no scheduler answers, it has no worker or its workers run another
    version of this software, or the folder cannot be used.
    """
    both = workers is not None and scheduler is not None
    refuse(both, f"workers = {workers} is for processes on this machine; {scheduler} has its own.")
    if workers is not None:
        require_range("workers", workers, "1", 1, 1000)
    for name, count in Counter(source.rig for source in sources).most_common(1):
        refuse(count > 1, f"two rigs are called {name!r}; every rig needs its own name.")
    settings, failed = settings or DiagnosisSettings(), 0
    with whole_folder(folder) as draft, ExitStack() as stack:
        code = code_digest() + source_digest((work.__module__,))
        by_key = {dask.base.tokenize(own.rig, own.content(), settings, code): own for own in sources}
        files = {key: Path(folder) / "rows" / f"{key}.json" for key in by_key}
        kept = {key: read_row(file) for key, file in files.items() if file.exists()}
        known = {key: row for key, row in kept.items() if row["error"] is None}
        progress(f"{len(known)} of {len(by_key)} rigs done", len(known) / max(len(by_key), 1))
        if waiting := {key: source for key, source in by_key.items() if key not in known}:
            client = _connect_workers(scheduler, stack) if scheduler is not None else _start_workers(workers, stack)
            for row in _collect_rows(client, waiting, work, settings):
                write_atomically(files[row["key"]], document_text(row))
                known[row["key"]] = complete_row(row)
                failed += row.get("error") is not None
                said = f"{len(known)} of {len(by_key)} rigs done" + (f", {failed} failed" if failed else "")
                progress(said, len(known) / len(by_key))
        found = [known[key] for key in by_key]
        write_atomically(draft / CONSOLIDATED, parquet_bytes(found))
    return found


def code_digest() -> str:
    """Return the digest of the source of every package that a diagnosis runs."""
    return source_digest(CODE)


def _start_workers(workers: int | None, stack: ExitStack) -> Client:
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


def _connect_workers(scheduler: str, stack: ExitStack) -> Client:
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
    advice = "install the same one on every machine."
    other = any(digest != code_digest() for digest in digests.values())
    refuse(other, f"workers of {scheduler} run another version of this software; {advice}")
    return client


def _collect_rows(
    client: Client, waiting: Mapping[str, Source], work: Callable[..., Row], settings: DiagnosisSettings
) -> Iterator[Row]:
    """Give all rigs to the workers, and yield each row as it arrives."""
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
        yield row | {"key": future.key}


# --- rows ------------------------------------------------------------------------------------------------------------


def complete_row(row: Row) -> Row:
    """Return a row with every key."""
    return dict.fromkeys(KEYS) | row


def read_row(path: Path) -> Row:
    """Read a row of a campaign; ConfigurationError if the file is none."""
    try:
        return complete_row(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(f"{path} is not a result of a campaign: {error}; move it away.") from error


def parquet_bytes(rows: Sequence[Row]) -> bytes:
    """Return rows as a Parquet file, a column for every plain value: ``parameters_k_x_value`` of ``parameters``."""
    known = [{key: value for key, value in row.items() if value is not None} for row in rows]
    table = pd.json_normalize(known, sep="_")
    return table.reindex(columns=[*dict.fromkeys((*KEYS[:4], *table.columns))]).to_parquet()


class Judgement(NamedTuple):
    """What of a row is true: entries "name axis" that were ``found``, strongest evidence first, and those ``false``.

    ``all_named`` says whether every effect of the rig is named; ``covered`` has every parameter and coefficient of
    known value.
    """

    found: tuple[str, ...]
    false: tuple[str, ...]
    all_named: bool
    covered: dict[str, bool]


def judge_row(row: Row) -> Judgement:
    """Judge a row against the truth."""
    true = {own["name"]: own["value"] for own in row["truth"] or ()}
    effects = [(f"{own['name']} {own['axis']}", own) for own in row["effects"] or ()]
    found = tuple(entry for entry, _ in effects)
    wanted = {entry.partition(" ")[0] for entry in true if entry not in ModelParameters._fields}
    covered = {}
    for name, own in (*(row["parameters"] or {}).items(), *((entry, own["coefficient"]) for entry, own in effects)):
        if own and own["standard_error"] is not None and (truth := true.get(name)) is not None:
            low, high = Estimate(**own).interval
            covered[name] = low <= truth <= high
    named = {entry.partition(" ")[0] for entry in found if entry in true}
    return Judgement(found, tuple(entry for entry in found if entry not in true), named == wanted, covered)


def summarise_rows(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of rows.

    ``rigs`` that were diagnosed, and by verdict; of those whose truth is ``known``, how many have all effects
    ``named``, and how many have a ``false`` one. ``effects``: entries "name axis" and the number of rigs on which each
    was found, most frequent first. ``failures``: rig and error text. ``coverage``: share of ``intervals`` of
    known true value that hold it. ``seconds``: median, 95 % quantile and largest of the times of one
    diagnosis [s], or None.
    """
    done = [(row, judge_row(row)) for row in rows if row["error"] is None]
    known, verdicts = [own for row, own in done if row["truth"] is not None], Counter(row["verdict"] for row, _ in done)
    held = [hit for own in known for hit in own.covered.values()]
    return {
        "rigs": len(done),
        "verdicts": {str(verdict): verdicts[verdict] for verdict in RigVerdict},
        "known": len(known),
        "named": sum(own.all_named for own in known),
        "false": sum(bool(own.false) for own in known),
        "effects": Counter(entry for _, own in done for entry in own.found).most_common(),
        "failures": [(row["rig"], row["error"]) for row in rows if row["error"] is not None],
        "intervals": len(held),
        "coverage": sum(held) / len(held) if held else None,
        "seconds": np.quantile([row["seconds"] for row, _ in done], (0.5, 0.95, 1.0)).tolist() if done else None,
    }


def campaign_tables(summary: dict[str, Any]) -> tuple[list[Table], list[str]]:
    """Give tables and sentences of a summary: what was found, and how much of it is true where that is known."""
    counts, said = {"rigs": summary["rigs"], **summary["verdicts"]}, []
    tables = [Table("Campaign", [*counts], [[str(count) for count in counts.values()]])]
    if summary["effects"]:
        found = [(name, str(count)) for name, count in summary["effects"]]
        tables.append(Table("Effects found", ("effect", "rigs"), found))
    if known := summary["known"]:
        truths = f"of {known} rigs whose truth is known {summary['named']} have all effects named"
        said.append(f"{truths}, {summary['false']} have a false one")
    if summary["coverage"] is not None:
        share = f"{100.0 * summary['coverage']:.1f} %"
        said.append(f"{share} of {summary['intervals']} intervals of 95 % hold the true value")
    if summary["seconds"] is not None:
        times = "one diagnosis on one core: median {:.1f} s, 95 % quantile {:.1f} s, longest {:.1f} s"
        said.append(times.format(*summary["seconds"]))
    return tables, [*said, *(f"failed: {rig}: {error}" for rig, error in summary["failures"])]
