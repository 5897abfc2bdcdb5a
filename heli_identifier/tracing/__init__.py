"""From logs to a diagnosis."""
