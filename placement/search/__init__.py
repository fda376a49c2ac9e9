"""The search: coordinate exchange, and the exact choice of a finalist."""
