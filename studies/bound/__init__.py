"""How far from the best the search may be."""
