"""What goes into an FMU's zip: vendored sources, model description, documentation, icon."""
