"""What is known of a rig and its air before the first sample: prediction errors begin there, and return there.

Gamma is the covariance of Omega where innovations have the intensity 1 (:mod:`.prediction_error`), so that Gamma(0)
can say what can be built on a bench, and never needs to be 1e3. The widths are those of the tracer. Without them the
first seconds of a flight in wind give a pitch that falls over (a_th < 0) with five times the damping of any rig, and
the noise model follows.
"""

PITCH, PITCH_FREE = (0.5, 4.0, 1.2), (0.5, 4.0, 2.0, 1.2)
"""Standard deviations of Omega of the pitch, theta0 known or not: a motion does not die out much faster than in a
second [1/s]; g d / l^2 with the mass within 2 cm of its axis [1/s^2]; with theta0 within .5 rad; a gain [rad/s^2/V]
of twice that of a full thrust of 3 rad/s^2 at 5 V."""

ELEVATION = (0.5, 4.0, 3.0, 0.5, 0.4)
"""The same of the elevation: its period is longer than 3 s [1/s^2]; the weight that the counterweight leaves
[rad/s^2]; a_lt [1]; full thrust of 1 rad/s^2."""

TRAVEL = (0.5, 0.4)
"""The same of the travel."""

PITCH_LAG, ELEVATION_LAG = 0.03, 0.008
"""The same of k Delta [rad/s^2 s/V] (:mod:`.lag`): .04 s of lag, half of what is given, times usual gains."""
