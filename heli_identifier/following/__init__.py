"""The twin that follows a rig in flight: notices that it no longer fits, says what changed, and corrects itself.

Pure steps, standard library only: the unit ``Corrector`` and ``heli follow`` run the same functions.
docs/explanation/following.md explains the method and names its sources.
"""

# ruff: noqa: F401 - the names are the subpackage's interface
from .corrector import correct, start_correcting
from .plan import SAMPLE_TIME, FollowPlan, FollowSettings
from .state import DIGITS, MODES, REASONS, WHAT, CorrectorState, Sample, TwinEvent
