"""The twin that follows a rig in flight: notices that it no longer fits, says what changed, and corrects itself.

Pure steps, standard library only: the unit ``Corrector`` and ``heli follow`` run the same functions.
docs/explanation/following.md explains the method and names its sources.
"""

from .corrector import correct as correct
from .corrector import parameters_in_use as parameters_in_use
from .corrector import start_correcting as start_correcting
from .plan import FollowPlan as FollowPlan
from .plan import FollowSettings as FollowSettings
from .state import MODES as MODES
from .state import REASONS as REASONS
from .state import WHAT as WHAT
from .state import CorrectorState as CorrectorState
from .state import Event as Event
from .state import Sample as Sample
