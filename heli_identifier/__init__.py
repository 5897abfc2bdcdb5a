"""Identification of the bench helicopter from logs, and tracing of what its model lacks."""
