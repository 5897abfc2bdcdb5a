"""Design of an experiment that would show an effect, or separate two."""
