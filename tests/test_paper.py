"""The paper's experiments in small: the units recover Table 2."""

import pandas
import pytest

from benchmarks import paper


@pytest.mark.slow
def test_runs_of_forty_seconds_recover_the_pitch(tmp_path):
    """Two starts, Gamma(0) = 1e5 and 1e6."""
    kinds = [kind._replace(duration=40.0) for kind in (paper.JOINT_RUN, paper.PITCH_RUN)]
    paper.reproduce(tmp_path / "new", kinds, (3, 12))
    found = pandas.read_csv(tmp_path / "new" / "estimates.csv")
    # Thirty seconds of adaptation hold a seventh of the information of two hundred, which leave some .05 %: .35 %,
    # and a margin for the chance of two starts.
    assert found.off[found.kind == "pitch"].abs().max() < 1.0
