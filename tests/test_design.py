"""Design of experiments: what an experiment would tell, rehearsed on the model."""

import json

import numpy as np
import pytest

from heli_identifier.errors import ConfigurationError
from heli_identifier.online.excitation import Excitation, Multisine
from heli_identifier.tools.experiment import (
    Limits,
    Outlook,
    Proposal,
    Sight,
    effects_named,
    outlook,
    proposals,
    ranked,
)
from heli_identifier.tools.flight import additions, flight_outlooks
from heli_plant.control import PidSettings
from heli_plant.effects import effect
from heli_plant.parameters import PlantParameters
from tests.commands import heli

PLANT = PlantParameters()
WIDE = Limits(pitch=10.0, elevation=10.0)


def multisines(base: float, strength: float) -> Proposal:
    return Proposal("", Excitation(base, Multisine(strength, 0.1, 1.2), Multisine(strength, 0.1, 1.0, seed=2)))


def seen(proposal, *effects):
    found = outlook(proposal, PLANT, effects, 40.0, WIDE)
    assert found is not None
    return found


def test_rotors_that_never_reverse_cannot_show_a_loss_of_reverse_thrust():
    entry = effect("reverse_thrust_loss", "rotors")
    forward, reversing = seen(multisines(3.0, 0.2), entry), seen(multisines(0.0, 0.6), entry)
    assert (forward.effects[0].visibility, forward.effects[0].standard_error) == (0.0, np.inf)
    assert reversing.effects[0].standard_error < 0.2  # a fifth of all reverse thrust is seen at one standard error


def test_a_stronger_excitation_shows_drag_with_a_smaller_error():
    weak, strong = (seen(multisines(1.5, rms), effect("quadratic_drag", "pitch")) for rms in (0.1, 0.4))
    # drag grows with the square of the amplitude; noise does not
    assert strong.effects[0].standard_error < weak.effects[0].standard_error / 4.0


def test_two_effects_that_look_alike_are_separated_with_larger_errors():
    found = seen(multisines(1.5, 0.5), *effects_named(("motor_lag", "input_delay")))
    assert found.correlation > 0.8  # a lag and a delay differ only in second order of the frequency
    for own in found.effects:
        # 1 / sqrt(1 - .8^2) = 1.67
        assert own.standard_error_separated == pytest.approx(own.standard_error / np.sqrt(1.0 - found.correlation**2))
    with pytest.raises(ConfigurationError, match="same effect"):
        effects_named(("motor_lag", "motor_lag"))


def expected(*errors):
    """An outlook whose effects have these standard errors if both are in question."""
    return Outlook("", 40.0, tuple(Sight("", "", 0.1, 1e-3, error, "1") for error in errors), 0.9, 0.5, 0.3)


def test_an_experiment_beyond_the_limits_is_not_proposed_and_voltages_keep_theirs_however_small():
    tight = Limits(pitch=0.05, elevation=0.05)
    assert outlook(multisines(1.5, 0.6), PLANT, (effect("dry_friction", "pitch"),), 40.0, tight) is None
    for limit in (0.5, 2.0):
        found = [np.abs(one.voltages(1.0)).max() for one in proposals(limit)]
        assert 9 <= len(found) and max(found) <= limit


def test_the_ranking_goes_by_the_effect_that_an_experiment_shows_worst():
    lopsided, fair, alike = expected(0.5, 4.0), expected(1.0, 1.0), expected(2.06, 2.06)
    # relative to the smallest errors .5 and 1: 4, 2 and 4.1
    assert ranked([alike, lopsided, fair]) == [fair, lopsided, alike]
    assert ranked([]) == []


def test_the_command_ranks_experiments_and_writes_the_voltages_of_the_best(tmp_path):
    file = tmp_path / "best.csv"
    words = ["design", "--show", "dry_friction:pitch", "--duration", "20", "--json", "--output", file]
    said = heli(*words)
    assert said.exit_code == 0, said.stderr
    errors = [one["effects"][0]["standard_error_separated"] for one in json.loads(said.stdout)]
    assert errors == sorted(errors)
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    assert table.shape == (2000, 3)
    assert np.abs(table[:, 1:]).max() <= 5.0


@pytest.mark.slow
def test_in_closed_loop_quiet_hover_hides_gain_and_stiffness_and_multisines_on_the_voltages_show_them():
    outlooks = flight_outlooks(PlantParameters(), PidSettings(), 0.15, 30.0, Limits(), lambda what, share: None)
    determined = {
        one.added: {name for name, error in one.relative_errors.items() if 1.96 * error <= 0.1} for one in outlooks
    }
    assert not determined["nothing"] & {"k_x", "k_z", "a_e"}
    strong = next(name for name in determined if name.startswith("multisines of 0.4 V"))
    assert determined[strong] >= {"k_x", "k_z", "a_e"}
    largest = [max(one.relative_errors.values()) for one in outlooks]
    assert largest == sorted(largest)


def test_in_closed_loop_no_proposal_departs_by_more_than_the_limits():
    limits = Limits(pitch=0.2, elevation=0.06)
    outlooks = flight_outlooks(PlantParameters(), PidSettings(), 0.15, 20.0, limits, lambda what, share: None)
    assert outlooks
    assert all(one.pitch_to_rad <= 0.2 and one.elevation_by_rad <= 0.06 for one in outlooks)
    assert len(outlooks) < len(list(additions()))  # steps of .2 and .1 rad go beyond
