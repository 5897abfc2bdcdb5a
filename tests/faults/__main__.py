"""Write docs/reliability.md."""

from tests.faults.page import main

main()
