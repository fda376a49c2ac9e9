"""The robot over RTDE: validated states, and slow motions that stop on any fault."""
