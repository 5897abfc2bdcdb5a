"""FMI 2.0 co-simulation units of the bench helicopter, their builder, wiring and master."""
