"""Constants of the tracer with their reasons. Numbers of one formula stand beside it."""

from itertools import product
from math import log

import numpy as np

from heli_identifier.chain import SETTLING as SETTLING

# --- the noise of the likelihood (noise.py) ---

NOISE_CENTRE = np.array([0.0, log(2.5), log(300.0), 0.0, 0.0])
"""Centres of ln rho over the usual level of an axis, ln c, ln f [1/s], artanh(sin(psi)^2), artanh(exp(-k h)): measured
rigs have torques that are correlated over .4 s, without an edge that logs resolve. The correlation exp(-k h) of an
encoder's error is over h = :data:`RECORD_STEP`; the error of an encoder that turns fast is white."""

NOISE_WIDTH = np.array([1.5, 0.7, 2.5, 0.8, 0.4])
"""Their widths: a factor of 4.5 in level, of 2 in rate, of 12 in smoothness; all shares sin(psi)^2 are about as
likely; an encoder that needs five records for a count, with a correlation of .8, lies three widths away."""

COLOURED = 0.9
"""Share of the encoder's variance that has the colour of k; a remainder of white noise keeps the filter regular."""

FARTHEST = 4.0
"""Widths from their centres that the air's coordinates may reach, rates of .15 to 40 1/s, and at which the logarithm of
a gain may begin, a factor of sixteen. A torque beyond them is not the air but something else that the model lacks, such
as an encoder that rests between its counts."""

LEAST_DAMPING = 0.2
"""Least damping ratio of air that swirls, which has died out after two turns: with less, a torque that is periodic in
time would pass for air."""

PER_LOG = (0.1, 0.003, 0.05, 0.03, 0.01)
"""Standard deviations of the parameters of one log before any log is seen: its constant torque [rad/s^2] (tape, cables,
a day's zero), which is also that of an unknown curve; the angle [rad] and the rate [rad/s] at its start off the lines
through its first .3 s, in the roughest air; the logarithm of its gains over the plant's (supply, warm motors, a new
belt: 1.5 to 6 % on measured rigs); the zero of its encoders [rad], as a rig that is switched on again comes to rest
within half a degree."""

FORCE = 10.0 * PER_LOG[0]
"""The same [rad/s^2] of a torque from outside the rig: of a hand, or a periodic one."""

PER_LOG_PRIOR = (2.0, 0.007, 0.007, 0.002)
"""Prior of the spread from log to log: degrees of freedom, and sizes for torques [rad/s^2], gains and zeros [rad]. A
good supply repeats itself to half of the least spread on measured rigs, an encoder left switched on to a count."""

RECORD_STEP = 0.01
"""Time [s] over which faster logs are averaged: a tenth of the motors' lag, so that nothing of the plant is lost, and
as long as encoders of benches need for a count."""

OUTLIER = 3.0
"""Standard deviations beyond which a value is not where it is expected: one in four hundred is by chance. The loss of
an innovation is linear beyond, so that one touch of a hand does not decide; it costs .3 % of a sample's information."""

# --- sensitivities (sensitivity.py) ---

SLOW_RATE = 25.0
"""Rate [Hz] of sensitivities to torques, of the search for unknown torques and of the instruments: ten times the
fastest motion of a bench. Innovations keep the rate of the records."""

BLOCK = 4.0
"""Length [s] of the blocks of a single log whose scores make a dispersion, of those of the instruments, and of the
segments of a bootstrap: ten times the correlation time of the air."""

DIFFERENCE = 0.02
"""Usual width of a finite difference, in coordinates whose priors are standard normal."""

# --- the fit (fit.py) ---

LARGEST_STEP = 1.5
"""Largest step of a coordinate in widths of its prior: the quadratic form is trusted no farther."""

CONVERGED, ROUGHLY = 0.01, 0.5
"""Fall of F [nats] in a step below which a fit has converged (a seventh of a standard error); and below which the
beginning of a fit has, and a fit of which the value of F alone is wanted."""

ITERATIONS, ROUNDS = 30, 8
"""Most Gauss-Newton steps of a fit; most halvings of one step, steps of a held-out log's own parameters, and turns in
which instruments find the motors' lag. Twice what was ever needed."""

AIRS = ((0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.5, -2.2, FARTHEST, 0.0))
"""Coordinates of the air from which a first fit begins: calm air, and air that swirls without torque at rest. Every
axis goes on from the likelier. Begun in calm air alone, three of four fits in swirling air stop 35 to 180 nats too
high: a wrong gain makes the voltages explain the swirl, and no other air at that gain is likelier."""

AIR_SCAN = (
    *((level / 1.5, rate / 0.7, 0.0, 0.0, 0.0) for level, rate in product((-2.2, -1.1, 0.0, 1.1), (-1.2, 0.0, 1.2))),
    *((0.0, 0.0, smoothness / 2.5, 0.0, 0.0) for smoothness in (-3.8, 3.8)),
    *((level / 1.5, 0.0, 0.0, 0.0, -FARTHEST) for level in (0.0, 1.1, 2.2)),
)
"""Moves of the air's coordinates that a fit tries from where it stopped: factors of 3 in level and rate, of 40 in
smoothness; and a rougher air whose encoder's error is white, since a fine encoder can be taken for one that turns
slowly. Gauss-Newton alone stays in local optima of the air on two thirds of the rigs in calm air, and on all with
encoders of 16 bits and more."""

FIRST_FLIGHT = 60.0
"""Length of flight [s] that the beginnings of a first fit look at: the air is the same in all logs."""

# --- the helicopter (helicopter.py) ---

TIMED = 0.5 * RECORD_STEP
"""Half a sample [s], as no log times its channels better. A motors' lag that differs by less from the given one is no
finding, no lag is shorter, and a channel that is late by less is on time."""

GAIN_WIDTH = log(2.0)
"""Width of the prior of the logarithm of a gain or of a scale: a factor of two is usual."""

CATALOGUE_WIDTHS = 3.0
"""Widths of an effect's prior between zero and the end of its plausible range; and between zero and c = 1 of a term of
rigid-body mechanics, as no mass is a point."""

WINDOW, MOTION_WINDOW = 0.6, 0.2
"""Lengths [s] of the local cubics that smooth a record: they keep .94 of an acceleration at .5 Hz and .99 of a rate at
2 Hz."""

# --- names (score.py, select.py) ---

KEPT = 3.0
"""Score [nats] at which an effect enters the model and below which it leaves: worth having, no more. Scores
that differ by less do not decide between two effects: the odds are below 20 to 1."""

ESTABLISHED = 8.0
"""Score [nats] from which an effect is established (`shown`, or `ambiguous`), a standard score of 4: chance reaches it
on one of 30 000 entries, so on one in 500 rigs over the whole catalogue."""

REFITTED = 6.0
"""Score [nats] that an effect needs in a refit as well to be shown, and from which one is shown that every rig has, as
only its size is open: chance reaches it on one of 3 500 entries, so on one in 100 rigs."""

SMOOTH_NATS = 2.0
"""Gain [nats] along the smoothed motion below which a law does not act there: along the true motion chance exceeds it
on one of twenty entries. Smoothing hides a part of a friction, .01 of .03 rad/s^2, so weak ones are missed."""

TIMED_OUTSIDE = 0.04
"""Half-width [s] of the interval of the motors' lag by references below which they can show a delay or a bending: half
of a usual lag. References that move the rig well time it to .003 to .023 s."""

# --- what the catalogue cannot name (unknown.py) ---

UNKNOWN = 22.0
"""Nats of an unknown torque, as of one degree of freedom: the search looks at some 24 curves and, on every axis, 600
frequencies. Chance reaches it on one of 100 000 rigs, and less is a ripple. What something else imitates needs as much:
a log that is read otherwise, as a mirror image or in another unit; a torque that steps at one instant, which drifting
air imitates with up to 15; under a controller a delay of the rotors or a bending arm, which its answers to an encoder
that does not shake imitate with up to 20."""
