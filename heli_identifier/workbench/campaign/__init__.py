"""Campaigns: many diagnoses on Dask, one result row per rig, restarted where they stopped.

==============  ==========================================================================================
`rig`           one rig: logs, and the truth where its maker knows it
`sources`       where rigs come from: sub-folders of a folder, or a generator and its seeds
`key`           names a result by everything it depends on
`row`           one diagnosis as one flat row
`results`       the folder of rows, one small Parquet file each
`work`          what a worker does with one rig
`cluster`       a cluster of processes on this machine, or a scheduler of many machines
`run`           the campaign itself
`against_truth` a row judged: named first, false, unknown, covered
`summary`       the figures of all rows
==============  ==========================================================================================

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
