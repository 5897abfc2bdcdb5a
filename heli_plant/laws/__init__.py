"""Laws of the effects that the simplified model neglects: one scalar function each, ``math`` only.

Every law takes plain floats, its coefficient last but for shape parameters, and returns the angular
acceleration [rad/s^2] that the effect adds, or the changed voltage [V] where it acts on a rotor.
A coefficient of zero switches the effect off exactly.
"""
