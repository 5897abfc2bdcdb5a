"""The units, one thin slave per file; their physics is in ``heli_plant``, their estimation in ``heli_identifier``."""
