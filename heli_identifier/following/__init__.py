"""The twin that follows a rig in flight: notices that it no longer fits, says what changed, and corrects itself.

Pure steps, standard library only: units carry them (``Corrector``), and ``heli follow`` runs the same.
"""

from .corrector import (
    Follower,
    FollowState,
    correct,
    follow,
    parameters_in_use,
    prepare_follower,
    start_correcting,
    start_following,
)
from .plan import DEFAULT_EFFECTS, FollowPlan, FollowSettings, prepare_following
from .state import HEARD, MODES, REASONS, WHAT, CorrectorState, Event, IdentifierReport, Sample

__all__ = [
    "DEFAULT_EFFECTS",
    "HEARD",
    "MODES",
    "REASONS",
    "WHAT",
    "CorrectorState",
    "Event",
    "FollowPlan",
    "FollowSettings",
    "FollowState",
    "Follower",
    "IdentifierReport",
    "Sample",
    "correct",
    "follow",
    "parameters_in_use",
    "prepare_follower",
    "prepare_following",
    "start_correcting",
    "start_following",
]
