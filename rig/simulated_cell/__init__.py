"""A simulated rig in the cell of a proposal, with mounting errors and faults drawn by a seed."""
