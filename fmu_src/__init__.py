"""FMI 2.0 co-simulation units of the bench helicopter, their builder, wiring table, master and SSP files.

The stub next to this file lists the public names; each is loaded when it is first used. `fmu_src.master` runs
the units, `fmu_src.ssp` writes SSP files.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
