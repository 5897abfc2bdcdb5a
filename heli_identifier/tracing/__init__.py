"""From logs to a diagnosis: one likelihood for fit, names, comparison and delivery; instruments judge it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
