"""Following a rig while it runs: samples in, alarms and adoptions out, on disk as they come."""
