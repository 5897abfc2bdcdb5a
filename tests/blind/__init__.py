"""Synthetic measured logs of a bench helicopter that holds an effect nobody declares.

The generator judges the tracer, so it shares no code with the packages it judges: its own physics, its own
integrator (Moreau's midpoint rule at 1 ms), set-valued friction that really sticks, its own random torque,
encoders and excitation. The laws were written from the catalogue's table of names, axes and laws, which is
the only thing the two sides have in common.

==================  ====================================================================
`coefficients`      every number that a rig depends on
`plant`             its laws, a controller, and the loop that steps them in time
`signals`           voltages of the four logs of a rig, and what a pilot asks for
`rigs`              the truth of one rig, the kinds there are, and how one is drawn
`generator`         logs of a rig in open loop, and the battery
`air`               torque of the air of measured rigs, in four colours
`flown`             rigs in calm flight, which may change
`windy`             rigs flown in that air, stirred or quiet, by two controllers
`damage`            what goes wrong between a rig and its log
==================  ====================================================================
"""
