"""Several rigs of one make diagnosed together: which effects repeat, and which are one rig's own.

================  =============================================================================
`rig_folders`     the folders of logs, one for each rig
`meta_analysis`   the random-effects mean of one coefficient over the rigs
`spread`          the spread between the rigs, and what to expect of a further one
`fleet`           all coefficients over all rigs, and what is said of each
`forest`          a coefficient over the rigs as a figure
`page`            fleet.html
`document`        fleet.json
================  =============================================================================
"""

from heli_identifier.workbench.fleet.fleet import Coefficient, Finding, Fleet, RigEstimate, fleet_of
from heli_identifier.workbench.fleet.meta_analysis import Pooled, pooled
from heli_identifier.workbench.fleet.rig_folders import RigFolder, rig_folder, rig_folders

__all__ = [
    "Coefficient",
    "Finding",
    "Fleet",
    "Pooled",
    "RigEstimate",
    "RigFolder",
    "fleet_of",
    "pooled",
    "rig_folder",
    "rig_folders",
]
