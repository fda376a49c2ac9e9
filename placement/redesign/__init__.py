"""The best changes to what is mounted: one ring, two, three."""
