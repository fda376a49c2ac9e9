"""Check a rig: plans, actors, procedure, and the assessment of the rig."""
