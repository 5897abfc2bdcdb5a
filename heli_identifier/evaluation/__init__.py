"""How well a model predicts logs that it never saw."""
