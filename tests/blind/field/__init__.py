"""Synthetic logs of field-like rigs: flown in closed loop by a person, with all that varies from log to log.

The battery beside it excites a rig in open loop for 90 s. A laboratory's logs look different: a controller holds the
rig, a joystick moves its references, encoder zeros and voltage gains change from flight to flight, the rotors stir the
air, the motor is slower than assumed, several effects act at once, and now and then a hand touches the rig. The
physics are those of the blind plant, and nothing is shared with the packages that are judged.

==============  =======================================================================
`truth`         what a field rig is: base model, effects, nuisances, controller, touches
`strengths`     which effects a field rig may hold, and how strong they are
`draw`          how a field rig is drawn
`references`    what a person does with a joystick
`control`       the controller that the flight is flown by
`flight`        the closed loop, stepped in time
`generator`     logs of a field rig
==============  =======================================================================
"""
