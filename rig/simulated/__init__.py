"""A robot and its rings in a process of their own, spoken to by the very clients that a real rig
is.
"""
