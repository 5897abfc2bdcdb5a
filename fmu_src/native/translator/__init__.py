"""A translator from the typed subset of Python in which the units are written to C99."""
