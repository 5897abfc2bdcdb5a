"""Identification of the bench helicopter from logs, and tracing of what its model lacks.

    import heli_identifier as hi

    diagnosis = hi.diagnose(hi.read_logs(["run1.csv", "run2.csv"]), validate=hi.read_log("run3.csv"))
    hi.write_results(diagnosis, "result")

What `import heli_identifier` offers is loaded when it is first used: an FMU carries parts of this package into hosts
that have the standard library alone.
"""

from importlib import import_module

_HOMES = {
    "Diagnosis": ".diagnosis.result",
    "DiagnosisSettings": ".diagnosis.settings",
    "Log": ".records",
    "LogFormat": ".records",
    "RigConfiguration": ".records",
    "demo_logs": ".records",
    "diagnose": ".interface",
    "read_configuration": ".records",
    "read_data_set": ".records",
    "read_log": ".records",
    "read_logs": ".records",
    "write_results": ".interface",
}
"""Modules of the public names."""

__all__ = list(_HOMES)


def __getattr__(name: str) -> object:
    """Load a public name from the module that defines it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
