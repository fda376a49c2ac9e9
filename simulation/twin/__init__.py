"""Twin of a setup in MuJoCo: what its sensors report as the robot and its surroundings move."""
