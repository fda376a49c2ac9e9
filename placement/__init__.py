"""The search for placements, and for the best changes to mounted rings."""
