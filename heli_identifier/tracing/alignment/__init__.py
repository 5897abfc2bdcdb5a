"""Zeros of encoders: a log whose elevation was zeroed elsewhere is shifted to that of the others."""
