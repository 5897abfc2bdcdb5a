"""Fit and selection by multi-step prediction errors: what a plant is judged by, apart from the search by likelihood."""
