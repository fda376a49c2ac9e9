"""A check of a rig: its plans, who acts, what is done, and what that says of the rig."""
