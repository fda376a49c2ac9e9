"""The rings: their frames, decoders, serial ports, and the events of their lines."""
