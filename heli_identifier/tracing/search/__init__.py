"""Tracing of a residual to the physical effect that the model lacks, over the whole catalogue and beyond it."""
