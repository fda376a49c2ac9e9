"""The report of a setup: what is counted for it, and its page."""
