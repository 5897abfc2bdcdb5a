"""Torques that no catalogue names: found on the right axis, by the right variable, and drawn as they are."""

from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from benchmarks.rigs import likelihood_of
from heli_identifier.tracing.fit import fit
from heli_identifier.tracing.result import Verdict
from heli_identifier.tracing.select import select
from heli_identifier.tracing.settings import UNKNOWN
from heli_identifier.tracing.unknown import Unknown, scan, search_unknown
from heli_plant.parameters import TABLE_2
from heli_plant.tabulated_torque import KNOTS, tabulated_torque
from tests.simulated import H, drive, noisy

SECONDS = 45.0
CENTRE, WIDTH, DEPTH = -0.1, 0.06, 0.06
FREQUENCY, AMPLITUDE = 0.37, 0.05
WAVES, SWING, PHASE = 2, 0.05, 0.3


def detent(pitch):
    """A notch that holds the pitch: outside of it nothing, ``DEPTH`` at one width from its middle [rad/s^2]."""
    x = (pitch - CENTRE) / WIDTH
    return -DEPTH * x * np.exp(0.5 - 0.5 * x * x)


LAWS = {
    "clean": None,
    "notched": lambda k, state: (detent(state.pitch), 0.0, 0.0),
    "humming": lambda k, state: (0.0, AMPLITUDE * np.sin(2.0 * np.pi * FREQUENCY * H * k + 1.0), 0.0),
    "sloping": lambda k, state: (0.0, 0.0, SWING * np.sin(WAVES * state.travel + PHASE)),
}


@cache
def searched(name):
    """What the catalogue says of a rig, the selection beside unknown torques, and these."""
    logs = [noisy(TABLE_2, drive(SECONDS, seed), seed, LAWS[name], name=f"log {seed}") for seed in (1, 2)]
    likelihood = likelihood_of(logs)
    before = select(fit(likelihood, likelihood.rig.base), likelihood.rig.candidates)
    return before, *search_unknown(before, likelihood.rig.candidates)


def without_line(x, y):
    """Deviation from the best straight line, which belongs to stiffness and rest angle of the model before."""
    return y - np.polyval(np.polyfit(x, y, 1), x)


def test_a_clean_rig_has_no_unknown_torque_and_none_is_tried():
    before, after, found = searched("clean")
    assert found == ()
    assert after is before
    assert scan(before.fit)[0].score < 0.5 * UNKNOWN


def test_a_notch_is_found_where_it_lies_and_drawn_within_its_band_and_the_plant_has_the_curve_as_its_table():
    _, after, found = searched("notched")
    assert [(f.axis, f.shape.variable, f.verdict) for f in found] == [("pitch", "pitch", Verdict.UNKNOWN)]
    words = found[0].shape.description
    assert "a notch near" in words
    # its two crests lie one width to either side; a table's spacing is about one width
    assert float(words.split("near ")[1].split(" rad")[0]) == pytest.approx(CENTRE, abs=WIDTH)
    shape = found[0].shape
    x, low, high = shape.band.T
    often = high - low < 0.5 * DEPTH
    assert often.mean() > 0.3
    error = without_line(x[often], shape.curve[often, 1] - detent(x[often]))
    # 95 % lie within half a band; a table rounds a notch of one spacing off by some tenth
    assert (np.abs(error) < 0.5 * (high - low)[often] + 0.1 * DEPTH).mean() > 0.9
    p, x = after.fit.parameters, found[0].shape.curve[:, 0]
    torques = tuple(getattr(p, f"table_torque_{k}_pitch") for k in range(1, KNOTS + 1))
    of_plant = [tabulated_torque(float(v), p.table_first_pitch, p.table_spacing_pitch, torques) for v in x]
    # the drawing takes the table's weights from the nearest fiftieth of a spacing: 2 % of a step between two torques
    step = np.abs(np.diff(torques)).max()
    assert p.table_variable_pitch == 1.0
    assert np.abs(without_line(x, np.array(of_plant)) - without_line(x, found[0].shape.curve[:, 1])).max() < 0.02 * step
    assert found[0].in_plant


def test_a_periodic_torque_is_found_at_its_frequency_with_its_amplitude():
    _, after, found = searched("humming")
    assert [(f.axis, f.shape.variable) for f in found] == [("elevation", "time")]
    shape = found[0].shape
    # a bin is 1/T; a line this strong is determined to a tenth of it
    assert shape.frequency_hz == pytest.approx(FREQUENCY, abs=0.1 / SECONDS)
    assert shape.amplitude == pytest.approx(AMPLITUDE, abs=4.0 * shape.amplitude_standard_error)
    assert shape.amplitude_standard_error < 0.1 * AMPLITUDE
    # its phase differs from log to log, so the plant cannot have it
    assert not found[0].in_plant
    assert after.fit.parameters.table_variable_elevation == 0.0
    assert [len(rows) for rows in after.fit.point.harmonics] == [1, 1]


def test_a_torque_by_the_travel_closes_after_a_turn_and_has_its_waves_counted():
    _, after, found = searched("sloping")
    assert [(f.axis, f.shape.variable) for f in found] == [("travel", "travel")]
    p = after.fit.parameters
    assert p.table_torque_1_travel == getattr(p, f"table_torque_{KNOTS}_travel")
    if len(found[0].shape.curve) > 115:  # the logs went all the way round
        assert f"periodic with {WAVES} waves per turn" in found[0].shape.description


@pytest.mark.parametrize("name", ["notched", "humming", "sloping"])
def test_beside_an_unknown_torque_nothing_false_is_named_and_the_air_is_calm_again(name):
    before, after, _ = searched(name)
    assert not [f.effect.field for f in after.findings if f.established]
    # the simulated air has .003 rad/s^2; before, it had to follow the torque
    assert after.fit.air()[0].max() < 0.006 < before.fit.air()[0].max()


def test_score_is_that_of_one_degree_of_freedom_as_rare():
    def unknown(nats, freedom):
        return Unknown("pitch", "pitch", 0.0, 1.0, np.empty(0), np.empty((0, 0)), nats, freedom)

    for nats, freedom in ((30.0, 19.0), (12.0, 7.0), (200.0, 21.0)):
        assert chi2.logsf(2.0 * unknown(nats, freedom).score, 1) == pytest.approx(
            chi2.logsf(2.0 * nats, freedom), rel=1e-6
        )
    # beyond the smallest number the tails' leading terms go on: right to the next term, k/2 of some hundred nats
    assert unknown(700.0, 20.0).score == pytest.approx(unknown(640.0, 20.0).score + 60.0, abs=2.0)
    assert unknown(5.0, 20.0).score == 0.0
