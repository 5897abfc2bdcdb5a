"""Identification of the bench helicopter from logs, and tracing of what its model lacks.

    import heli_identifier as hi

    diagnosis = hi.diagnose(hi.read_logs(["run1.csv", "run2.csv"]), held_out=hi.read_log("run3.csv"))
    diagnosis.write("result")

The stub beside this file lists what the package offers; each name is loaded when it is first used (SPEC 1 of
Scientific Python), so that a command imports only what it needs.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
