"""What people do with logs and plants beside a diagnosis: identify, linearise, control, design experiments, many rigs.

The stub beside this file lists what other rooms may use; each name is loaded when it is first used.
"""

from typing import Any

import lazy_loader

from heli_identifier.errors import ConfigurationError

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

EXTRAS = {"dask": "cluster", "distributed": "cluster", "pyarrow": "cluster"}
"""Packages that are not installed with the others, and the extra that has them."""


def __getattr__(name: str) -> Any:
    try:
        return _load(name)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        raise ConfigurationError(
            f"this needs the package {package}; install it with pip install 'heli-twin[{EXTRAS[package]}]'."
        ) from error
