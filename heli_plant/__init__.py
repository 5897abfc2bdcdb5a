"""Physics of the bench helicopter: parameters, plant, effects, sensors, control laws, simulation."""
