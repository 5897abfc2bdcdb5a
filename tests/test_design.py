"""Excitation: the paper's signals, multisines, how they reach the rotors; what an experiment of them would tell."""

from math import isclose, nan, pi, sqrt

import numpy as np
import pytest
import scipy.signal

from heli_identifier.errors import ConfigurationError
from heli_identifier.online import IdentifierSettings, ModelParameters, excitation
from heli_identifier.online.excitation import Excitation, Multisine
from heli_identifier.records import demo_files, read_log
from heli_identifier.tools import experiment
from heli_identifier.tools.experiment import Limits, Proposal
from heli_identifier.tools.flight import list_additions, rank_flights
from heli_plant.control import PidSettings
from heli_plant.effects import effect
from heli_plant.parameters import PlantParameters
from tests.commands import heli, heli_json

PLANT = PlantParameters()


def multisines(base: float, strength: float) -> Proposal:
    return Proposal("", Excitation(base, Multisine(strength, 0.1, 1.2), Multisine(strength, 0.1, 1.0, seed=2)))


def seen(proposal, *effects):
    found = experiment.fly_proposal(proposal, PLANT, effects, 40.0, Limits(pitch=10.0, elevation=10.0))
    assert found is not None
    return found


def test_rotors_that_never_reverse_show_no_loss_of_reverse_thrust_and_a_stronger_excitation_shows_more_drag():
    entry = effect("reverse_thrust_loss", "rotors")
    forward, reversing = seen(multisines(3.0, 0.2), entry), seen(multisines(0.0, 0.6), entry)
    assert (forward.effects[0].visibility, forward.effects[0].standard_error) == (0.0, np.inf)
    assert reversing.effects[0].standard_error < 0.2  # a fifth of all reverse thrust is seen at one standard error
    weak, strong = (seen(multisines(1.5, rms), effect("quadratic_drag", "pitch")) for rms in (0.1, 0.4))
    # drag grows with the square of the amplitude; noise does not
    assert strong.effects[0].standard_error < weak.effects[0].standard_error / 4.0


def test_two_effects_that_look_alike_are_separated_with_larger_errors():
    found = seen(multisines(1.5, 0.5), *experiment.find_effects(("motor_lag", "input_delay")))
    assert found.correlation > 0.8  # a lag and a delay differ only in second order of the frequency
    entries = effect("dry_friction", "pitch"), effect("quadratic_drag", "pitch")
    found = seen(multisines(1.5, 0.5), *entries)
    for entry, own in zip(entries, found.effects, strict=True):
        (alone,) = seen(multisines(1.5, 0.5), entry).effects
        assert own.standard_error == pytest.approx(alone.standard_error / np.sqrt(1.0 - found.correlation**2))
    with pytest.raises(ConfigurationError, match="same effect"):
        experiment.find_effects(("motor_lag", "motor_lag"))


def expected(*errors):
    """A result whose effects have these standard errors if both are in question."""
    estimates = tuple(experiment.ExpectedEstimate("", "", 0.1, error, "1") for error in errors)
    return experiment.ExpectedResult("", estimates, 0.9, 0.5, 0.3)


def ranked(*expected):
    proposals = [Proposal(str(number)) for number in range(len(expected))]
    return [*experiment.rank_results(dict(zip(proposals, expected, strict=True))).values()]


def test_an_experiment_beyond_the_limits_is_not_proposed_in_open_or_closed_loop_and_voltages_keep_theirs():
    tight = Limits(pitch=0.05, elevation=0.05)
    assert experiment.fly_proposal(multisines(1.5, 0.6), PLANT, (effect("dry_friction", "pitch"),), 40.0, tight) is None
    for limit in (0.5, 2.0):
        found = [np.abs(one.voltages(1.0)).max() for one in experiment.list_proposals(limit, PLANT)]
        assert 9 <= len(found) and max(found) <= limit
    hovering = PLANT._replace(a_1=1.1, a_e=0.05, k_z=0.157)  # at 3.5 V; any other base voltage lifts it by a radian
    names = [one.name for one in experiment.list_proposals(5.0, hovering)]
    assert sum("base 3.5 V" in name for name in names) == 27
    limits = Limits(pitch=0.2, elevation=0.06)
    expected = rank_flights(PlantParameters(), PidSettings(), 0.15, 20.0, limits, lambda what, share: None)
    assert expected
    assert all(one.largest_pitch_rad <= 0.2 and one.largest_elevation_rad <= 0.06 for one in expected)
    assert len(expected) < len(list(list_additions()))  # steps of .2 and .1 rad go beyond


def test_the_ranking_goes_by_the_effect_that_an_experiment_shows_worst():
    lopsided, fair, alike = expected(0.5, 4.0), expected(1.0, 1.0), expected(2.06, 2.06)
    # relative to the smallest errors .5 and 1: 4, 2 and 4.1
    assert ranked(alike, lopsided, fair) == [fair, lopsided, alike]
    never, shown = expected(np.inf, 2.0), expected(np.inf, 1.0)  # nothing shows the first effect: the second decides
    assert ranked(never, shown) == [shown, never]
    assert ranked() == []


def test_the_command_ranks_experiments_and_writes_the_voltages_of_the_best(tmp_path):
    file = tmp_path / "best.csv"
    ranked = heli_json("design", "dry_friction:pitch", "--duration", 20, "--output", file)
    errors = [one["effects"][0]["standard_error"] for one in ranked]
    assert errors == sorted(errors)
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    assert table.shape == (2000, 3) and np.abs(table[:, 1:]).max() <= 5.0
    for option, absurd in (("--pitch-limit", "inf"), ("--elevation-limit", "nan"), ("--voltage-limit", "1e6")):
        refused = heli("design", "dry_friction:pitch", option, absurd)
        assert refused.exit_code == 2 and option in refused.stderr


@pytest.mark.slow
def test_in_closed_loop_quiet_hover_hides_gain_and_stiffness_and_multisines_on_the_voltages_show_them():
    expected = rank_flights(PlantParameters(), PidSettings(), 0.15, 30.0, Limits(), lambda what, share: None)
    determined = {
        one.added: {name for name, error in one.relative_errors.items() if 1.96 * error <= 0.1} for one in expected
    }
    assert not determined["nothing"] & {"k_x", "k_z", "a_e"}
    strong = next(name for name in determined if name.startswith("multisines of 0.4 V"))
    assert determined[strong] >= {"k_x", "k_z", "a_e"}
    largest = [max(one.relative_errors.values()) for one in expected]
    assert largest == sorted(largest)


H = 0.01


def sampled(signal, seconds):
    return np.array([signal.at(k * H) for k in range(round(seconds / H))])


def test_the_difference_drives_pitch_and_the_total_drives_elevation():
    pitch = Excitation(1.5, *excitation.paper_channels(1, "difference"))
    elevation = Excitation(0.5, *excitation.paper_channels(1, "total"))
    for t in (0.0, 3.3, 12.7, 25.0):
        front, rear = excitation.voltages(t, pitch)
        assert isclose(front - rear, excitation.SquareChirp().at(t), abs_tol=1e-15)
        assert isclose(front + rear, 3.0)
        front, rear = excitation.voltages(t, elevation)
        assert front == rear and isclose(front + rear, 1.0 + 2.0 * excitation.SquareChirp().at(t))
    strong = excitation.Excitation(base=4.9, difference=excitation.SquareChirp(), total=excitation.SquareChirp())
    assert excitation.voltages(0.0, strong) == (5.0, 4.9)  # the amplifiers' limit


def test_the_chirp_is_the_linear_chirp_of_scipy_and_a_log_of_square_and_chirp_is_reproduced():
    """A training log of 90 s, printed to 1e-5 V."""
    signal, t = excitation.SquareChirp(low=0.0, high=0.0, chirp_amplitude=0.2), np.arange(1000) * H
    reference = 0.2 * scipy.signal.chirp(t, 2.0, 10.0, 0.5, phi=-90)
    # Both evaluate one sine of at most 80 rad: rounding only.
    np.testing.assert_allclose(sampled(signal, 10.0), reference, atol=1e-13)
    square = excitation.SquareChirp(-0.5, 0.5, 15.4, chirp_amplitude=0.0)  # runs 3.7 s ahead
    chirp = excitation.SquareChirp(0.0, 0.0, 15.4, 0.25, 1.5, 0.3, 13.0)
    total = excitation.SquareChirp(0.5, 2.0, 20.0, 0.4, 2.0, 0.5, 10.0)
    log = read_log(demo_files("rig-c")[0][0])
    found = [excitation.combine(0.5, square.at(t + 3.7) + chirp.at(t), total.at(t), 5.0) for t in log.time]
    off = np.abs(found - log.voltages).max(1) > 1.5e-5
    assert off.sum() < 5  # edges that fall on a sample, which belongs to either side by rounding


def test_a_multisine_has_its_rms_and_only_its_tones_and_a_seed_fixes_it():
    signal = excitation.Multisine(rms=0.45, lowest=1 / 30, highest=2.5, tones=12, period=90.0)
    values = sampled(signal, 90.0)
    spectrum = 2.0 * np.abs(np.fft.rfft(values)) / len(values)
    lines = np.flatnonzero(spectrum > 1e-9)
    # All tones are harmonics of 1/90 Hz, so that a whole period leaks nothing (rounding alone remains).
    assert len(lines) == 12
    np.testing.assert_allclose(lines[[0, -1]] / 90.0, [1 / 30, 2.5])
    np.testing.assert_allclose(spectrum[lines], 0.45 * sqrt(2 / 12), rtol=1e-9)
    assert isclose(float(np.sqrt(np.mean(values**2))), 0.45, rel_tol=1e-9)
    assert excitation.Multisine(seed=3).components == excitation.Multisine(seed=3).components
    assert excitation.Multisine(seed=3).components != excitation.Multisine(seed=4).components
    # Drawn once from Python's Mersenne twister, whose sequence the language guarantees.
    assert isclose(excitation.phases(3, 1)[0], 2 * pi * 0.23796462709189137)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: excitation.Multisine(highest=0.01), "multisine.highest = 0.01 Hz must lie in"),
    (lambda: excitation.Excitation(base=6.0), "excitation.base = 6.0 V must lie in"),
    (lambda: IdentifierSettings(filter_frequency=20.1), "filter.frequency = 20.1 rad/s must lie in [0.001, 20] rad/s"),
    (lambda: IdentifierSettings(gain_limit=nan), "adaptation.gain_limit = nan must be positive"),
    (lambda: IdentifierSettings(initial=ModelParameters(k_x=nan)), "initial.k_x = nan"),
])  # fmt: skip
def test_impossible_settings_are_refused_with_name_value_and_bound(make, message):
    with pytest.raises(ConfigurationError, match=message.replace("[", r"\[")):
        make()
    assert [IdentifierSettings(filter_damping=bound).filter_damping for bound in (0.1, 10.0)] == [0.1, 10.0]
