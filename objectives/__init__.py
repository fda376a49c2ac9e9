"""The criterion of a search, its constraints, and the exact coverage of a setup."""
