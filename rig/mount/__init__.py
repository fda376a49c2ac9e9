"""The mount check: where to stand, which sensor is which, how the rings are mounted, and the setup
as built.
"""
