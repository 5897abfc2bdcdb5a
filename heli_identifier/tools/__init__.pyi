__all__ = [
    "CONSOLIDATED",
    "CONTROLLER",
    "ControllerDesign",
    "FEEDBACK",
    "KINDS",
    "OTHERS",
    "Advice",
    "Coefficient",
    "EstimateHistory",
    "Finding",
    "Fleet",
    "GeneratedRig",
    "Identification",
    "Limits",
    "Progress",
    "Rig",
    "RigFolder",
    "Row",
    "SHORTEST_TO_SPLIT",
    "Source",
    "StepResponse",
    "Summary",
    "Together",
    "TrueEffect",
    "TrueUnknown",
    "Truth",
    "control_advice",
    "design_controller",
    "design_pid",
    "designs",
    "diagnose_rigs",
    "effects_named",
    "experiment_table",
    "feedback_settings",
    "fleet_html",
    "fleet_of",
    "fleet_sentence",
    "fleet_tables",
    "flight_outlooks",
    "flight_table",
    "generated_rigs",
    "identify",
    "linearise",
    "pid_settings",
    "read_rows",
    "read_split",
    "require_packages",
    "rig_folder",
    "rig_folders",
    "rigs_below",
    "run_campaign",
    "separation_warning",
    "step_figure",
    "summarised",
    "write_rows",
]

from .campaign import CONSOLIDATED, Progress, require_packages, run_campaign
from .campaign_rows import Row, Summary, read_rows, summarised, write_rows
from .controller import FEEDBACK, KINDS, OTHERS, ControllerDesign, design_controller, feedback_settings
from .experiment import Limits, designs, effects_named, experiment_table, separation_warning
from .figures import step_figure
from .fleet import Coefficient, Finding, Fleet, diagnose_rigs, fleet_of
from .fleet_page import fleet_html, fleet_sentence, fleet_tables
from .flight import flight_outlooks, flight_table
from .identification import EstimateHistory, Identification, Together, identify
from .linearisation import linearise
from .loop import StepResponse, pid_settings
from .pid import CONTROLLER, Advice, control_advice, design_pid
from .rigs import (
    SHORTEST_TO_SPLIT,
    GeneratedRig,
    Rig,
    RigFolder,
    Source,
    TrueEffect,
    TrueUnknown,
    Truth,
    generated_rigs,
    read_split,
    rig_folder,
    rig_folders,
    rigs_below,
)
