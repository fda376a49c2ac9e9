"""The search: coordinate exchange, multi-start local search, and the exact choice of a finalist."""
