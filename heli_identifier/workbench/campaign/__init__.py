"""Campaigns: many diagnoses on Dask, one result row per rig, restarted where they stopped.

===========  ======================================================================
`rig`        one rig: its logs, and the truth where its maker knows it
`sources`    where rigs come from: sub-folders, or a generator and its seeds
`key`        the name of a result, by everything that it depends on
`row`        one rig diagnosed on a worker, as one flat row
`results`    the folder of rows, one Parquet file each
`cluster`    processes on this machine, or a scheduler of many machines
`run`        the campaign itself
`progress`   its progress on the error stream
`summary`    rows judged against the truth, and the figures of all rows
===========  ======================================================================

Dask and pyarrow are optional (``pip install 'heli-twin[cluster]'``); modules import them inside functions.
"""

from heli_identifier.workbench.campaign.rig import Rig, TrueEffect, TrueUnknown, Truth
from heli_identifier.workbench.campaign.sources import FolderRig, GeneratedRig, folder_rigs, generated_rigs

__all__ = [
    "FolderRig",
    "GeneratedRig",
    "Rig",
    "TrueEffect",
    "TrueUnknown",
    "Truth",
    "folder_rigs",
    "generated_rigs",
]
