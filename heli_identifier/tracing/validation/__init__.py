"""How well a model predicts logs that it was not fitted to."""
