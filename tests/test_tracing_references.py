"""References: logged ones by test, rebuilt ones through the controller, and open loop recognised."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from heli_identifier.records import Log
from heli_identifier.tracing.references import controllers_of, feedback, find_references, refusal

RATE, POLE, GAINS = 100.0, 12.0, (8.0, 5.0, 4.0, 6.0)
COUNT = 2 * np.pi / 4096


def smoothed_steps(rng, samples, size):
    """Steps every 3 to 6 s through a lag of rate 3.3 1/s."""
    level = np.repeat(rng.normal(0.0, size, samples), rng.integers(300, 600, samples))[:samples]
    kept = np.exp(-3.3 / RATE)
    return lfilter([1.0 - kept], [1.0, -kept], level)


def flight(seed, *, closed=True, integral=0.0, limit=np.inf, seconds=30):
    """Two double integrators with damping in coloured air, flown by proportional, derivative and integral terms."""
    rng, h, n = np.random.default_rng(seed), 1.0 / RATE, round(seconds * RATE)
    kept = np.exp(-2.5 * h)
    air = lfilter([1.0], [1.0, -kept], rng.normal(0.0, np.sqrt(1.0 - kept**2), (n, 2)), axis=0) * (0.12, 0.04)
    asked = np.column_stack([smoothed_steps(rng, n, 0.1), smoothed_steps(rng, n, 0.1)])
    stirred = np.column_stack([smoothed_steps(rng, n, 1.0), smoothed_steps(rng, n, 1.0)])
    angles, voltages = np.zeros((n, 3)), np.zeros((n, 2))
    x, rate, slow, summed, nu = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    for k in range(n):
        y = COUNT * np.round(x / COUNT)
        angles[k, :2] = y
        slow = slow + POLE * h * (y - slow)
        summed = summed + h * (asked[k] - y)
        v = stirred[k]
        if closed:
            v = np.array(GAINS[::2]) * (asked[k] - y) - np.array(GAINS[1::2]) * POLE * (y - slow)
            v = v + integral * np.array([0.0, 1.0]) * summed
        sides = np.clip([(v[1] + v[0]) / 2, (v[1] - v[0]) / 2], -limit, limit)
        voltages[k] = sides
        nu = nu + h / 0.08 * (np.array([sides[0] - sides[1], sides[0] + sides[1]]) - nu)
        rate = rate + h * (-0.1 * rate - np.array([0.6, 2.0]) * x + np.array([0.3, 0.16]) * nu + air[k])
        x = x + h * rate
    asked_for = {"pitch": asked[:, 0], "elevation": asked[:, 1]}
    return Log(f"log {seed}", RATE, voltages, angles, references=asked_for)


def test_what_the_pilot_asked_for_is_accepted_in_nine_of_ten_logs():
    """Few steps per log: by chance one in a hundred is refused (the scale is the largest of 99 shifts)."""
    logs = [flight(seed) for seed in range(10)]
    refused = [refusal(log.references["pitch"], log.angles, RATE) for log in logs]
    assert refusal(np.full(len(logs[0].angles), 0.3), logs[0].angles, RATE) == "it never moves"
    assert sum(reason is not None for reason in refused) <= 1


def test_feedback_in_disguise_is_refused():
    """Voltages and rates are never still; state feedback that is held in steps is told by the outputs' past."""
    for log in map(flight, range(4)):
        assert refusal(log.voltages[:, 0] - log.voltages[:, 1], log.angles, RATE)
        assert refusal(np.gradient(log.angles[:, 0]), log.angles, RATE)
        held = np.repeat((2.0 * log.angles[:, 0] + np.gradient(log.angles[:, 0], 1 / RATE))[::25], 25)
        assert "feedback" in refusal(held, log.angles, RATE, steps=False)


@pytest.mark.parametrize("integral", [0.0, 1.5])
def test_references_are_rebuilt_because_a_controller_adds_no_noise(integral):
    """The law is linear in what is logged, hence exact: its answer to 1 %, the reference to a correlation of .99."""
    logs = [flight(seed, integral=integral) for seed in (1, 2)]
    found = find_references(logs)  # those that are logged are taken before rebuilt ones
    assert (found.origin, found.names) == ("logged", ("pitch", "elevation"))
    found, controllers = find_references([replace(log, references={}) for log in logs]), controllers_of(logs)
    assert found.closed_loop
    assert found.origin == "rebuilt"
    for log, signals, laws in zip(logs, found.signals, controllers, strict=True):
        for i, (law, axis) in enumerate(zip(laws, ("pitch", "elevation"), strict=True)):
            y, (proportional, rate) = log.angles[:, i], GAINS[2 * i : 2 * i + 2]
            slow = lfilter([POLE / RATE], [1.0, POLE / RATE - 1.0], y)
            wanted = -proportional * y - rate * POLE * (y - slow) - integral * i * np.cumsum(y) / RATE
            np.testing.assert_allclose(law.answer(log.angles, 1.0 / RATE), wanted, atol=0.01 * np.ptp(wanted))
            rebuilt = signals[:, found.names.index(law.channel)]
            assert np.corrcoef(rebuilt, log.references[axis])[0, 1] > (0.99 if axis == "pitch" else 0.9)


def test_open_loop_is_told_from_closed_loop_and_its_voltages_are_the_references():
    logs = [flight(seed, closed=False) for seed in range(6)]
    assert [feedback(log) for log in logs] == [False] * 6
    assert all(feedback(flight(seed)) for seed in range(6))
    found = find_references(logs[:2])
    assert not found.closed_loop
    assert found.origin == "voltages"
    np.testing.assert_array_equal(found.signals[0][:, 0], logs[0].voltages[:, 0] - logs[0].voltages[:, 1])


def test_saturated_voltages_are_refused_with_the_share_and_the_limit():
    log = replace(flight(3, limit=0.2), references={})
    found = find_references([log])
    assert found.origin == "none"
    assert found.signals[0].shape == (len(log.angles), 0)
    assert any("at the limit of 0.20 V" in note for note in found.notes)
