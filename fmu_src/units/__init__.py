"""The units, one thin slave per file: physics is in ``heli_plant``, estimation in ``heli_identifier.online``."""
