__all__ = [
    "CONSOLIDATED",
    "CONTROLLER",
    "Design",
    "Finding",
    "Identification",
    "Limits",
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
    "rig_folders",
    "rigs_below",
    "run_campaign",
    "source_digest",
    "split_logs",
    "step_figure",
    "summarised",
    "write_voltages",
]

from .campaign import CONSOLIDATED, Row, campaign_tables, diagnosed, run_campaign, summarised
from .controller import control_advice, design_controller, design_pid
from .design_files import (
    controller_html,
    controller_m,
    corrected_init,
    course_values,
    design_table,
    margin_table,
    step_figure,
)
from .experiment import Limits, designs, effects_named, experiment_table, write_voltages
from .fleet import Finding, diagnose_rigs, fleet_of
from .fleet_page import fleet_html, fleet_sentence, fleet_tables
from .flight import flight_outlooks, flight_table
from .identification import Identification, identify
from .judging import Design
from .linearisation import linearise
from .loop import CONTROLLER, closed_loop_check, controller_parameters, controller_settings
from .rigs import (
    SHORTEST_TO_SPLIT,
    Rig,
    Source,
    generated_rigs,
    rig_folders,
    rigs_below,
    source_digest,
    split_logs,
)
