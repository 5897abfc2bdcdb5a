"""An FMU file from anywhere, unpacked: what is no FMI 2.0 co-simulation unit is refused before its code is loaded.

Loading a unit runs its code with the rights of the user; nothing here can prevent that. What is prevented is that a
mere archive writes outside of its folder or fills the disk, and that its description reads other files.
"""

from __future__ import annotations

from errno import EINVAL, EISDIR, ENAMETOOLONG, ENOTDIR
from pathlib import Path
from typing import Any

import fmpy

from heli_identifier.archives import check_zip, plain_xml

from ..errors import MasterError

_DESCRIPTION = "modelDescription.xml"
_OF_THE_FILE = (None, EINVAL, EISDIR, ENOTDIR, ENAMETOOLONG)
"""Errors of the operating system that come from what the FMU holds: lxml's have no number, an entry's offset or name
may be impossible. All others, such as a full disk, come from the place that it is unpacked into."""


def unpacked(name: str, fmu: Path, folder: Path) -> Any:
    """Unpack an FMU into ``folder`` and return its model description, as fmpy reads it.

    Raises
    ------
    MasterError
        The file is no FMU that can be run; names unit and file.
    OSError
        There is no room for it.
    """
    try:
        check_zip(fmu)
        fmpy.extract(str(fmu), str(folder))
        plain_xml((folder / _DESCRIPTION).read_bytes())
        description = fmpy.read_model_description(str(folder))
    except FileNotFoundError as error:
        raise MasterError(f"the FMU of {name}, {fmu}, cannot be used: it holds no {_DESCRIPTION}") from error
    except Exception as error:  # fmpy raises whatever its parsers raise on damaged archives and descriptions
        if isinstance(error, OSError) and error.errno not in _OF_THE_FILE:
            raise OSError(error.errno, error.strerror, str(folder.parent)) from error
        said = " ".join(str(error).split()) or type(error).__name__
        raise MasterError(f"the FMU of {name}, {fmu}, cannot be used: {said[:300]}") from error
    if description.fmiVersion != "2.0" or description.coSimulation is None:
        kind = "co-simulation" if description.coSimulation is not None else "model exchange"
        raise MasterError(
            f"the FMU of {name}, {fmu}, cannot be used: it is for FMI {description.fmiVersion} {kind}, "
            "FMI 2.0 co-simulation is needed"
        )
    return description
