__all__ = [
    "CONSOLIDATED",
    "CONTROLLER",
    "Design",
    "Finding",
    "Identification",
    "Limits",
    "Progress",
    "Rig",
    "Row",
    "SHORTEST_TO_SPLIT",
    "Source",
    "campaign_tables",
    "closed_loop_check",
    "control_advice",
    "controller_parameters",
    "controller_settings",
    "controller_html",
    "controller_m",
    "corrected_init",
    "course_values",
    "design_controller",
    "design_table",
    "design_pid",
    "designs",
    "diagnose_rigs",
    "diagnosed",
    "effects_named",
    "experiment_table",
    "fleet_html",
    "fleet_of",
    "fleet_sentence",
    "fleet_tables",
    "flight_outlooks",
    "flight_table",
    "generated_rigs",
    "identify",
    "linearise",
    "margin_table",
    "read_split",
    "rig_folders",
    "rigs_below",
    "run_campaign",
    "source_digest",
    "step_figure",
    "summarised",
    "write_voltages",
]

from .campaign import CONSOLIDATED, Progress, Row, campaign_tables, diagnosed, run_campaign, summarised
from .controller import Design, control_advice, design_controller, design_pid
from .controller_page import controller_html, design_table, margin_table, step_figure
from .course import controller_m, corrected_init, course_values
from .experiment import Limits, designs, effects_named, experiment_table, write_voltages
from .fleet import Finding, diagnose_rigs, fleet_of
from .fleet_page import fleet_html, fleet_sentence, fleet_tables
from .flight import flight_outlooks, flight_table
from .identification import Identification, identify
from .linearisation import linearise
from .loop import CONTROLLER, closed_loop_check, controller_parameters, controller_settings
from .rigs import (
    SHORTEST_TO_SPLIT,
    Rig,
    Source,
    generated_rigs,
    read_split,
    rig_folders,
    rigs_below,
    source_digest,
)
