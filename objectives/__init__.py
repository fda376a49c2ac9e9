"""What a search maximises, what is allowed, and the exact coverage of a setup."""
