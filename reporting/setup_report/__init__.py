"""Report of a setup: the counts and the page."""
