"""What a worker does with one rig: load, diagnose, measure, and give back one row.

A rig that cannot be read or diagnosed gives a row with the error's text: one bad rig must not end the campaign. The
truth is set beside the result only after the diagnosis has ended.
"""

import os
import sys
import traceback
from time import perf_counter

from heli_identifier.errors import IdentifierError
from heli_identifier.tracing import DiagnosisSettings, diagnose, use_threads
from heli_identifier.workbench.campaign.rig import Rig
from heli_identifier.workbench.campaign.row import Row, diagnosis_columns, truth_columns
from heli_identifier.workbench.campaign.sources import Source, named_function


def diagnosed(source: Source, settings: DiagnosisSettings, measure: str | None = None) -> Row:
    """Diagnose one rig.

    Parameters
    ----------
    source : Source
    settings : DiagnosisSettings
        What a rig's own configuration states comes before what they give: motor, voltages, rest pitch.
    measure : str, optional
        "module:function" that is given the rig, truth included, and its diagnosis, and returns further figures by
        name: a mapping of str to float for the column ``measures``.

    Returns
    -------
    dict
        The row without its key; ``error`` tells why there is no result.
    """
    use_threads(1)  # a cluster has a worker for each core: threads of theirs would only take turns
    began = perf_counter()
    row: Row = {"rig": source.rig}
    try:
        rig = source.load()
        row |= truth_columns(rig.truth)
        diagnosis = diagnose(rig.training, held_out=rig.held_out, settings=_of_rig(settings, rig))
        row |= diagnosis_columns(diagnosis)
        if measure:
            row["measures"] = dict(named_function(measure)(rig, diagnosis))
    except Exception as error:
        row |= {"error": _told(error), "seconds": perf_counter() - began}
    return row


def _of_rig(settings: DiagnosisSettings, rig: Rig) -> DiagnosisSettings:
    own = rig.configuration
    if own is None:
        return settings
    return DiagnosisSettings.from_rig(own, settings.bandwidth, settings.agreement)


def _told(error: Exception) -> str:
    """Give an error's text; with the place where it arose if it was not raised on purpose."""
    if isinstance(error, IdentifierError):
        return str(error)
    place = traceback.extract_tb(sys.exc_info()[2])[-1]
    return f"{type(error).__name__}: {error} (in {place.name}, {os.path.basename(place.filename)} line {place.lineno})"
