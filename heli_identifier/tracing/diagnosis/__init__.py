"""The whole loop as one value: fit, residual, trace, refit, judge on held-out logs."""
