"""Work with logs and plants other than a diagnosis: identify, linearise, control, design experiments, many rigs.

The stub beside this file lists what other subpackages may use; each name is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
