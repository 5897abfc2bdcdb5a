"""Synthetic measured logs of a bench helicopter that holds an effect nobody declares.

The generator judges the tracer, so it shares no code with the packages it judges: its own physics, its own
integrator (Moreau's midpoint rule at 1 ms), set-valued friction that really sticks, its own random torque,
encoders and excitation. The laws were written from the catalogue's table of names, axes and laws, which is
the only thing the two sides have in common.

==================  ====================================================================
`signals`           excitation voltages of the four logs of a rig
`friction`          dry friction as a set-valued law; the bristles before it slips
`rotors`            from a voltage to the thrust of one rotor
`torques`           smooth angular accelerations of the three axes, effects included
`unknown`           torques that no catalogue names
`integration`       the time-stepping loop
`encoders`          counts
`rigs`              the truth of one rig, and how it is drawn
`kinds`             the kinds of rig that the battery holds, with their strengths
`generator`         logs in memory or as CSV files
`battery`           which kinds, how many rigs of each, at which scale
`field`             rigs flown in closed loop, as laboratories log them, and their battery
`air`               torque of the air of measured rigs, in three colours
`windy`             rigs flown in that air, stirred or quiet, by two controllers
==================  ====================================================================
"""
