"""Mount check: its stops, the wiring, the mounting errors of the rings, and the setup as built."""
