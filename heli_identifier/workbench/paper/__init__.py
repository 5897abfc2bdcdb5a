"""The paper reproduced: Tables 1 and 2 and Figures 2 to 5 from the units, and possible causes of the paper's spread.

The paper's text is not at hand; its tables, signals and settings are those that the project's design restates. The
contents of the figures are inferred: 2 the histories of the pitch estimates, 3 plant and model in open loop with the
adaptation error, 4 the pitch steps in closed loop, 5 the histories of elevation and travel.
"""

from .reproduction import Extent, Reproduction, reproduce

__all__ = ["Extent", "Reproduction", "reproduce"]
