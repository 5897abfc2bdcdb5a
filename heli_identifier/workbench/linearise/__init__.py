"""The identified plant for control design: linear models with intervals, margins, a retuned PID."""
