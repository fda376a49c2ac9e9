"""A simulated rig in the cell of a proposal, with errors of mounting and faults that a seed
draws.
"""
