"""The whole loop as one value: fit, search, refit, validation on held-out logs."""
