"""Campaigns: where rigs come from, one row per rig whatever is killed, and what the rows say together."""

import io
import json
import os
import signal
from collections import Counter
from functools import partial
from importlib import import_module
from types import SimpleNamespace

import pandas as pd
import pytest

import heli_identifier
from heli_identifier import tools
from heli_identifier.errors import ConfigurationError
from heli_identifier.tools.campaign import parquet_bytes


def test_every_sub_folder_with_a_log_is_a_rig_whose_content_follows_every_byte_that_a_diagnosis_reads(tmp_path):
    files = "b/run1.mat b/run2.csv a/train.csv a/held1.csv a/heli.toml a/notes.txt notes/readme.txt other.csv lab.toml"
    for path in map(tmp_path.joinpath, files.split()):
        path.parent.mkdir(exist_ok=True)
        path.write_text(path.name)
    sources, empty = tools.find_rigs(tmp_path, tmp_path / "lab.toml")
    assert ([source.rig for source in sources], empty) == (["a", "b"], ["notes"])
    for source, own in zip(sources, (("train.csv", "held1.csv", "heli.toml"), ("run1.mat", "run2.csv")), strict=True):
        seen = {source.content()}
        (tmp_path / "a" / "notes.txt").write_text("nothing that a diagnosis reads")
        assert source.content() in seen
        for name in (*(f"{source.rig}/{file}" for file in own), *(("lab.toml",) if source.rig == "b" else ())):
            (tmp_path / name).write_text("other")
            assert source.content() not in seen
            seen.add(source.content())


# What a worker does here in place of a diagnosis: it notes who begins and ends what, and takes its time.
MODULE = """
import os, time
from pathlib import Path

def work(source):
    seed, folder, seconds, first = source.load()
    if not list(Path(folder).glob(f"began.{seed}.*")):
        seconds = first
    mark = f"{seed}.{os.getpid()}.{time.time_ns()}"
    (Path(folder) / f"began.{mark}").touch()
    if seed < 0:
        os.kill(os.getpid(), 9)
    time.sleep(seconds)
    (Path(folder) / f"ended.{mark}").touch()
    return {"rig": source.rig, "verdict": "model adequate", "effects": [], "seconds": seconds}
"""


def test_a_folder_that_is_none_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigurationError, match="file is a file, a folder is needed there"):
        tools.run_campaign([], tmp_path / "file")


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Run campaigns of work that takes some seconds, and tell (event, seed, process) of all that the workers noted."""
    name = f"made_{tmp_path.name}"  # another module for every test
    (tmp_path / f"{name}.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "marks").mkdir()
    marks, folder, work = str(tmp_path / "marks"), tmp_path / "results", import_module(name).work

    def run(seeds, seconds=0.0, first=None, **options):
        """Rigs that take some seconds, the first time as many as ``first`` says of a seed."""
        rigs = [(seed, marks, seconds, (first or {}).get(seed, seconds)) for seed in seeds]
        sources = [tools.Source(f"rig {own[0]}", partial(tuple, own), str) for own in rigs]
        return tools.run_campaign(sources, folder, work=work, **options)

    def noted(event):
        files = sorted((tmp_path / "marks").glob(f"{event}.*"), key=lambda path: path.name.split(".")[3])
        return [(int(seed), int(process)) for _, seed, process, _ in (path.name.split(".") for path in files)]

    return SimpleNamespace(run=run, noted=noted, folder=folder)


@pytest.mark.slow
def test_killed_worker_costs_its_rig_alone_and_a_restart_makes_only_what_is_missing(stand_in):
    told = []

    def kill_the_one_at_work(what, share):
        told.append(what)
        if what == "3 of 8 rigs diagnosed":
            ((_, process),) = {own for own in stand_in.noted("began") if own[0] == 0}  # it takes a minute at first
            os.kill(process, signal.SIGKILL)

    rows = stand_in.run(range(8), 0.2, {0: 60.0}, workers=2, progress=kill_the_one_at_work)
    failed, *others = ((row["rig"], row["error"]) for row in rows)
    assert failed[0] == "rig 0" and "its process was ended by signal 9 (Killed)" in failed[1]
    assert others == [(f"rig {seed}", None) for seed in range(1, 8)] and told[-1] == "7 of 8 rigs diagnosed, 1 failed"
    assert sorted(path.name for path in (stand_in.folder / "rows").iterdir()) == [
        f"rig {seed}.json" for seed in range(8)
    ]
    assert list(pd.read_parquet(stand_in.folder / tools.CONSOLIDATED)["rig"]) == [row["rig"] for row in rows]
    (stand_in.folder / "rows" / "rig 1.json").unlink()
    (stand_in.folder / "rows" / "rig 2.json").write_text("torn")
    told.clear()
    again = stand_in.run(range(9), workers=1, progress=lambda what, share: told.append(what))
    assert again[3:8] == rows[3:] and not any(row["error"] for row in again)
    assert Counter(seed for seed, _ in stand_in.noted("ended")) == Counter([1, 2, *range(9)])
    assert told == [f"{done} of 9 rigs diagnosed" for done in (5, 6, 7, 8, 9)]
    # with nothing left to do no cluster is asked: this scheduler is not there
    assert stand_in.run(range(9), scheduler="tcp://127.0.0.1:1") == again


@pytest.mark.slow
def test_scheduler_that_runs_already_is_used_and_left_running_but_not_one_of_another_version(stand_in, monkeypatch):
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as machines:
        address = machines.scheduler_address
        assert [row["verdict"] for row in stand_in.run(range(2), scheduler=address)] == ["model adequate"] * 2
        with Client(machines) as still:
            assert len(still.nthreads()) == 1
        # A worker digests its own packages.
        monkeypatch.setattr(tools.campaign, "heli_plant", heli_identifier)
        with pytest.raises(ConfigurationError, match="another version of this software"):
            stand_in.run((5,), scheduler=address)


def test_what_ends_before_the_first_result_leaves_no_folder(stand_in):
    def ended(what, share):
        raise KeyboardInterrupt

    for seeds, options, kind, said in (
        ((1,), {"progress": ended}, KeyboardInterrupt, None),
        ((1,), {"scheduler": "nonsense"}, ConfigurationError, "no Dask scheduler answers at nonsense"),
    ):
        with pytest.raises(kind, match=said):
            stand_in.run(seeds, **options)
    assert not stand_in.folder.exists()


def test_missing_package_is_told_with_the_command_that_installs_it(monkeypatch, tmp_path):
    monkeypatch.setattr(tools.campaign, "find_spec", lambda name: None if name == "distributed" else name)
    with pytest.raises(ConfigurationError, match=r"package distributed: .*heli-twin\[cluster\]"):
        tools.run_campaign([], tmp_path, scheduler="tcp://lab:8786")


FRICTION = {"name": "dry_friction", "axis": "pitch", "coefficient": {"value": 0.02, "standard_error": 0.001}}
LAG = {"name": "motor_lag", "axis": "rotors", "coefficient": None}
BAD = {"rig": "bad", "error": "unreadable", "seconds": 0.1}


def row(*effects, verdict="effects shown", **columns):
    return {"rig": "r", "error": None, "verdict": verdict, "effects": list(effects), "seconds": 2.0, **columns}


def test_the_table_has_every_column_whatever_the_rows_lack():
    whole = row(FRICTION, parameters_after={"a_wx": {"value": 0.061, "standard_error": 0.001, "unit": "1/s"}})
    rows = [whole, BAD, row()]
    table = pd.read_parquet(io.BytesIO(parquet_bytes(rows)))
    known = table["parameters_after_a_wx_value"]
    assert known[0] == 0.061 and known.isna()[1] and table["error"][1] == "unreadable"
    assert json.loads(table["effects"][0])[0]["name"] == "dry_friction"
    assert [*pd.read_parquet(io.BytesIO(parquet_bytes([row()])))][:3] == ["rig", "error", "verdict"]


def test_the_printed_table_counts_verdicts_and_effects():
    table = tools.campaign_table([row(FRICTION), row(LAG), row(LAG), row(verdict="model adequate"), BAD])
    counts = [("effects shown", "3"), ("model adequate", "1"), ("motor_lag rotors", "2"), ("dry_friction pitch", "1")]
    assert table.rows == counts and table.title == "4 of 5 rigs were diagnosed"
