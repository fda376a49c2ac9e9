"""A simulated robot and its rings in a process of their own; the clients of a real rig connect to
it.
"""
