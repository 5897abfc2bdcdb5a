"""A translator from the typed subset of Python in which the units are written to C99.

    translation = Translation()
    entry = translation.entry(function)                 refuses with file, line and reason what it does not know
    header(translation), source(translation)            text

One definition per equation stays: the functions are read from the project's own sources, also those that
:mod:`heli_plant.laws` composes of the effects' laws.
"""
