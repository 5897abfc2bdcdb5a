"""What people do with logs and plants beside a diagnosis.

================  =====================================================================================
`identification`  the on-line identifier over whole logs; `history`: over one; `joint`: all together
`linearisation`   the plant at an operating point as a linear system
`loop`            a controller around the whole plant
`margins`         a controller around the linear plant: closed loop, margins
`synthesis`       gains of PID, LQR and LQI with a Kalman filter
`judging`         a controller around all plants that the data allow
`controller`      designs of a kind; `controller_page`, `course`: page and tables, MATLAB code
`closed_loop`     flights flown again from their references
`experiment`      the excitation that would show an effect, or separate two
`flight`          what to add to a flight under the controller
`fleet`           several rigs of one make together; `meta_analysis` has the mean, `fleet_page` the page
`campaign`        many diagnoses on many machines; `campaign_rows` has what is written
`rigs`            rigs of both, where their logs come from, and what is true of them
================  =====================================================================================

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
