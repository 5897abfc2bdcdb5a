"""Faults, tried by the tests, and what the software says to each: tries all of them and writes docs/reliability.md."""

from tests.faults.page import main

main()
