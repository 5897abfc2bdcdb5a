"""The identified plant as a control engineer needs it: linear models with intervals, margins, a retuned PID."""

from heli_identifier.workbench.linearise.linear_model import LinearModel, linear_model
from heli_identifier.workbench.linearise.loop import margins
from heli_identifier.workbench.linearise.margins import Margins
from heli_identifier.workbench.linearise.operating_point import OperatingPoint, operating_point
from heli_identifier.workbench.linearise.retuning import retuned
from heli_identifier.workbench.linearise.uncertainty import drawn_plants

__all__ = [
    "LinearModel",
    "Margins",
    "OperatingPoint",
    "drawn_plants",
    "linear_model",
    "margins",
    "operating_point",
    "retuned",
]
