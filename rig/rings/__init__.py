"""The rings: the frames they send, their decoders, their serial ports, and what happens to their
lines.
"""
