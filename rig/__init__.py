"""The real robot and its rings: links to both, their recording, the simulated rig, the check."""
