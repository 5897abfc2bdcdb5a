"""From logs to a diagnosis: prediction errors and fit, search, validation on held-out logs, the diagnosis itself.

The stub beside this file is the room's door: it lists what other rooms may use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
