"""Design of experiments: what an experiment would tell, rehearsed on the model."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from typer.testing import CliRunner

from heli_identifier.errors import ConfigurationError
from heli_identifier.online.excitation.multisine import Multisine
from heli_identifier.online.excitation.voltages import Excitation
from heli_identifier.workbench.commands.app import app
from heli_identifier.workbench.design import separation
from heli_identifier.workbench.design.excitations import Proposal, proposals
from heli_identifier.workbench.design.naming import effects_named
from heli_identifier.workbench.design.rehearsal import Room, rehearsed, rehearsed_voltages
from heli_identifier.workbench.design.separation import Limits, Outlook, outlook
from heli_plant.effects import effect
from heli_plant.parameters import PlantParameters

PLANT = PlantParameters()
WIDE = Limits(pitch=10.0, elevation=10.0)


def multisines(base: float, strength: float) -> Proposal:
    return Proposal("", Excitation(base, Multisine(strength, 0.1, 1.2), Multisine(strength, 0.1, 1.0, seed=2)))


def test_rotors_that_never_reverse_cannot_show_a_loss_of_reverse_thrust():
    entry = effect("reverse_thrust_loss", "rotors")
    forward = outlook(multisines(3.0, 0.2), PLANT, (entry,), 40.0, WIDE, Room())
    reversing = outlook(multisines(0.0, 0.6), PLANT, (entry,), 40.0, WIDE, Room())
    assert forward is not None
    assert reversing is not None
    assert forward.visibility == (0.0,)
    assert forward.standard_errors == (np.inf,)
    assert reversing.standard_errors[0] < 0.2  # a fifth of all reverse thrust is seen at one standard error


def test_a_stronger_excitation_shows_drag_with_a_smaller_error():
    entry = effect("quadratic_drag", "pitch")
    weak, strong = (outlook(multisines(1.5, s), PLANT, (entry,), 40.0, WIDE, Room()) for s in (0.1, 0.4))
    assert weak is not None
    assert strong is not None
    # drag grows with the square of the amplitude; noise does not
    assert strong.standard_errors[0] < weak.standard_errors[0] / 4.0


def test_two_effects_that_look_alike_are_told_apart_with_larger_errors():
    pair = effects_named(("motor_lag", "input_delay"))
    found = outlook(multisines(1.5, 0.5), PLANT, pair, 40.0, WIDE, Room())
    assert found is not None
    assert found.correlation > 0.8  # a lag and a delay differ only in second order of the frequency
    for alone, apart in zip(found.standard_errors, found.separated_errors, strict=True):
        assert apart > 1.5 * alone


@pytest.mark.parametrize(("least", "said"), [(0.97, True), (0.9, False)])
def test_experiments_that_all_leave_two_effects_alike_are_said_to_separate_nothing(monkeypatch, least, said):
    """The signature's rest is sqrt(1 - .97^2) = .243 of it, so that errors are 4 times as large."""
    alike = Outlook(multisines(1.5, 0.5), 40.0, (0.1, 0.1), (1e-3, 2e-3), 0.99, 0.5, 0.3)
    ranked = [alike, replace(alike, correlation=least)]
    monkeypatch.setattr(separation, "designs", lambda *_arguments, **_options: ranked)
    words = ["design", "--separate", "motor_lag", "input_delay"]
    sentence = "none of these experiments separates motor_lag from input_delay"
    for options in ([], ["--json"]):
        shown = CliRunner().invoke(app, [*words, *options])
        assert shown.exit_code == 0
        assert (sentence in shown.stderr) is said
        assert "0.99" in shown.stdout
    assert ("correlate by 0.970 at the least" in shown.stderr and "4 times" in shown.stderr) is said


def test_an_experiment_beyond_the_limits_is_not_proposed():
    tight = Limits(pitch=0.05, elevation=0.05)
    assert outlook(multisines(1.5, 0.6), PLANT, (effect("dry_friction", "pitch"),), 40.0, tight, Room()) is None


def test_the_ranking_puts_the_smallest_error_first(monkeypatch):
    monkeypatch.setattr(separation, "proposals", lambda limit: islice(proposals(limit), 2, 8))
    ranked = separation.designs(PLANT, (effect("dry_friction", "pitch"),), 40.0, WIDE)
    errors = [one.separated_errors[0] for one in ranked]
    assert errors == sorted(errors)


def test_a_rehearsal_in_a_quiet_room_is_the_simulation_on_the_encoders_grid():
    signal = rehearsed_voltages(multisines(1.0, 0.3).excitation, 20.0)
    quiet = rehearsed(PLANT, signal, Room(torque=0.0))
    counts = quiet[:, 0] / (2.0 * np.pi / 4096)
    # rounding of a double at a few hundred counts is far below this
    assert np.abs(counts - np.round(counts)).max() < 1e-9


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("dry_frictoin",), "dry_friction"),
        (("dry_friction",), "dry_friction:pitch"),
        (("motor_lag", "motor_lag"), "same effect"),
    ],
)
def test_a_name_that_cannot_be_meant_is_refused_with_advice(words, part):
    with pytest.raises(ConfigurationError, match=part):
        effects_named(words)
