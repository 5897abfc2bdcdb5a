"""Public logs are fetched as they were cited, whole or not at all, and become logs of the contract."""

from dataclasses import replace
from hashlib import sha256
from io import BytesIO

import numpy as np
import pytest
from scipy.io import savemat

from benchmarks import measured
from benchmarks.measured import LAYOUTS, DownloadError, Source, converted, download, fetched


def hosted(folder, content):
    """Write what each source holds where it is published; gives the template of the addresses."""
    for source, data in content.items():
        path = folder / source.repository / source.commit / source.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return f"{folder.as_uri()}/{{repository}}/{{commit}}/{{path}}"


def matrix(rows=11, samples=3000):
    """A file as the rigs' owners upload them: time in row 0, other rows noise."""
    values = np.random.default_rng(0).normal(0.0, 0.5, (rows, samples))
    values[0] = np.arange(samples) / 500.0
    file = BytesIO()
    savemat(file, {"SimData": values})
    return values, file.getvalue()


def cited(content, rig="ntnu-05", path="lab 3/log, final.mat"):
    return Source(len(content), rig, "01", "somebody/helicopter", "c" * 40, path, sha256(content).hexdigest())


@pytest.mark.parametrize("changed", [b"<html>please log in</html>", b"longer than what was cited" * 9])
def test_a_file_that_is_not_the_one_cited_is_refused(tmp_path, changed):
    source = cited(b"what was cited")
    with pytest.raises(DownloadError, match=source.sha256):
        fetched(source, hosted(tmp_path, {source: changed}))


def test_what_was_fetched_is_kept_and_what_is_wrong_leaves_nothing(tmp_path, monkeypatch):
    content = matrix()[1]
    good = cited(content)
    bad = replace(good, log="02", path="other.mat", sha256="0" * 64)
    monkeypatch.setattr(measured, "sources", lambda: (good, bad))
    host, logs = tmp_path / "host", tmp_path / "logs"
    address = hosted(host, {good: content, bad: content})
    kept = logs / "raw" / "ntnu-05-01.mat"
    with pytest.raises(DownloadError, match=r"other\.mat is not the file"):
        download(logs, address)
    assert sorted(path for path in logs.rglob("*") if path.is_file()) == [logs / "ntnu-05" / "01.csv", kept]
    published = next(host.rglob("log, final.mat")).rename(host / "moved")
    with pytest.raises(DownloadError, match=r"other\.mat is not the file"):  # the first is not fetched again
        download(logs, address)
    kept.write_bytes(content[:-1])
    with pytest.raises(DownloadError, match="final.mat cannot be fetched"):  # spoilt on the disk: fetched again
        download(logs, address)
    hosted(host, {good: published.read_bytes()})
    with pytest.raises(DownloadError, match=r"other\.mat is not the file"):
        download(logs, address)
    assert kept.read_bytes() == content


@pytest.mark.parametrize("rig", LAYOUTS)
def test_rows_become_the_signals_of_the_contract(rig):
    values, content = matrix()
    layout = LAYOUTS[rig]
    values[layout.sum] += 9.0  # some commands lie beyond the converter's range
    file = BytesIO()
    savemat(file, {"any": values})
    log = converted(file.getvalue(), cited(content, rig))
    unit = np.pi / 180.0 if rig == "ntnu-08a" else 1.0
    sign = -1.0 if rig == "ntnu-01b" else 1.0
    front, rear = log.voltages.T
    assert (log.rate_hz, log.samples) == (500.0, 3000)
    assert np.abs(log.voltages).max() == 5.0
    free = (np.abs(log.voltages) < 5.0).all(axis=1)
    assert 100 < free.sum() < 2900
    assert (front + rear)[free] == pytest.approx(values[layout.sum][free])
    # what a rig calls pitch changes its sign together with the difference of the voltages that turns it
    assert (front - rear)[free] == pytest.approx(sign * values[layout.difference][free])
    assert log.angles[:, 0] == pytest.approx(sign * unit * values[3])
    assert log.angles[:, 1] == pytest.approx(unit * values[5])
    assert log.angles[:, 2] == pytest.approx(unit * values[1])
