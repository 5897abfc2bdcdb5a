"""The on-line identifier run over whole logs."""
