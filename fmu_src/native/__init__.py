"""Native twins: the units translated from the same Python source to C, which needs no Python on the host."""
