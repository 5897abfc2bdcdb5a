"""A unit's class driven as the binary drives it, by names."""


def initialised(kind, parameters=None):
    """A unit behind its initialisation, whether that went well or not."""
    unit = kind(instance_name="unit", resources="")
    for name, value in (parameters or {}).items():
        put(unit, name, value)
    unit.setup_experiment(0.0)
    unit.enter_initialization_mode()
    unit.exit_initialization_mode()
    return unit


def put(unit, name, value):
    reference = unit.references[name]
    getattr(unit, f"set_{unit.variables[reference].type.lower()}")([reference], [value])


def got(unit, *names):
    return unit.get_real([unit.references[name] for name in names])
