"""A fixed set of questions, layouts that answer them, and the scorer."""
