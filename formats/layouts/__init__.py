"""Published layouts: files that say where sensors are, with the source of it."""
