"""Physics of the bench helicopter: parameters, models, effects, sensors, control law, simulation."""
