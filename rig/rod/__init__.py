"""The coverage check: a test rod, where to put it, the printed plan, and what its trials say."""
