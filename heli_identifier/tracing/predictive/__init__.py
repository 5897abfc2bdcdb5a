"""Effects that improve predictions beyond those that are shown: a joint search by multi-step errors."""
