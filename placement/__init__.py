"""Search for ring placements, and redesign of mounted rings in few changes."""
