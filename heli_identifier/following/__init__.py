"""The twin that follows a rig in flight: notices that it no longer fits, says what changed, and corrects itself.

Pure steps, standard library only: units carry them (``Corrector``), and ``heli follow`` runs the same.
"""

from .changes import Change, changes
from .corrector import correct, start_correcting
from .events import WHAT, WHY, Event, event_document
from .follower import (
    Follower,
    FollowOutput,
    FollowState,
    follow,
    identifier_settings,
    parameters_in_use,
    prepare_follower,
    shares_in_use,
    standard_errors_in_use,
    start_following,
)
from .hearing import HEARD
from .plan import FollowPlan, parameters_of, prepare_following
from .saving import frozen_state, thawed_state
from .settings import DEFAULT_EFFECTS, FollowSettings
from .state import MODES, CorrectorOutput, CorrectorState, Sample, Told

__all__ = [
    "DEFAULT_EFFECTS",
    "HEARD",
    "MODES",
    "WHAT",
    "WHY",
    "Change",
    "CorrectorOutput",
    "CorrectorState",
    "Event",
    "FollowOutput",
    "FollowPlan",
    "FollowSettings",
    "FollowState",
    "Follower",
    "Sample",
    "Told",
    "changes",
    "correct",
    "event_document",
    "follow",
    "frozen_state",
    "identifier_settings",
    "parameters_in_use",
    "parameters_of",
    "prepare_follower",
    "prepare_following",
    "shares_in_use",
    "standard_errors_in_use",
    "start_correcting",
    "start_following",
    "thawed_state",
]
