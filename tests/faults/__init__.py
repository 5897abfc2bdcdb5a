"""Faults, tried by the tests, and what the software says to each: docs/reliability.md is made of them.

`python -m tests.faults` tries all of them and writes the page.
"""
