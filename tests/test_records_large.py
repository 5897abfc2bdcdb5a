"""A log of more rows than are read at once: nothing shows where the pieces meet."""

import numpy as np
import pytest

from heli_identifier.errors import LogError
from heli_identifier.records import read_log

ROWS, RATE = 130_000, 2000.0
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
