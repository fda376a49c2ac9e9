"""The search of placements, and the best changes to what is mounted."""
