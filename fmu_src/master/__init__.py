"""The master: it runs a scenario of the wiring table on built units.

``run`` steps the units in this process, ``run_apart`` in a separate one. Callers should prefer the latter
(:mod:`fmu_src.master.process` says why); it loads no FMI tools into their process.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
