"""How well a model predicts logs that no fit has seen."""
