"""A log of more rows than are read at once: nothing shows where the pieces meet."""

import gzip
import hashlib
import tracemalloc

import numpy as np
import pytest

from heli_identifier.errors import LogError
from heli_identifier.records import read_log

ROWS, RATE = 130_000, 200.0
HEADER = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]"


@pytest.fixture(scope="module")
def lines():
    t = np.arange(ROWS) / RATE
    columns = (t, 1.0 + 0.5 * np.sin(3 * t), 1.0 + 0.5 * np.sin(2 * t), 0.2 * np.sin(t), 0.1 * np.cos(t), 0.1 * t)
    return [HEADER, *(",".join(f"{x:.5f}" for x in row) for row in zip(*(c.tolist() for c in columns), strict=True))]


def written(folder, lines):
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_all_rows_are_read_in_order(tmp_path, lines):
    log = read_log(written(tmp_path, lines))
    assert log.samples == ROWS
    # the file has five decimals
    np.testing.assert_allclose(log.angles[:, 2], 0.1 * np.arange(ROWS) / RATE, rtol=0.0, atol=6e-6)


@pytest.mark.parametrize(
    ("cell", "said"), [("x", "row 120001, column 'pitch"), ("1,2,3", "row 120001: 8 cells stand under 6 headers")]
)
def test_a_mistake_in_a_later_piece_is_named_by_its_row(tmp_path, lines, cell, said):
    changed = list(lines)
    cells = changed[120_000].split(",")
    changed[120_000] = ",".join((*cells[:3], cell, *cells[4:]))
    with pytest.raises(LogError, match=said):
        read_log(written(tmp_path, changed))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_an_encoding_is_understood(tmp_path, lines, encoding):
    text = "\n".join([lines[0] + ",Ort", *(f"{line},Köln" for line in lines[1:1501])])
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode(encoding))
    log = read_log(path)
    assert log.samples == 1500
    assert log.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_log_packed_in_several_members_is_read_whole(tmp_path, lines):
    data = "\n".join(lines[:3000]).encode()
    members = gzip.compress(data[:1000]) + gzip.compress(data[1000:])  # as `cat a.gz b.gz` makes them
    (tmp_path / "log.csv.gz").write_bytes(members)
    log = read_log(tmp_path / "log.csv.gz")
    assert (log.samples, log.sha256) == (2999, hashlib.sha256(members).hexdigest())


def test_reading_takes_little_more_memory_than_the_arrays(tmp_path, lines):
    path = written(tmp_path, lines)
    read_log(path)  # what the first reading imports and keeps is not the log's
    tracemalloc.start()
    log = read_log(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # the six columns, half of them a second time while they are put side by side, and the piece that pandas reads:
    # 600 000 cells with its own copies, some 20 MB
    assert peak < 1.6 * 48 * log.samples + 25e6
    assert peak < 4 * path.stat().st_size
