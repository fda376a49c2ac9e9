"""Published layouts of sensors, scored under the same rules."""
