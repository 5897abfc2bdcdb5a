"""Events: passages of a log in which something outside the plant acts on it, found, listed and cut out."""
