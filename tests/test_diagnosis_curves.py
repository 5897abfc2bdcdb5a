"""What a found effect is drawn against."""

from heli_identifier.tracing.diagnosis.curves import VARIABLE
from heli_plant.effects import CATALOGUE

NOT_DRAWN = {"arm_bending"}
"""The bending mode acts through no torque: what it adds is seen in the encoder alone."""


def test_every_effect_of_the_catalogue_has_a_variable_to_be_drawn_against_but_for_the_bending_mode():
    assert set(VARIABLE) == {effect.name for effect in CATALOGUE} - NOT_DRAWN
