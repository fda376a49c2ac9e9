"""Import of mounted sensors from lists, JSON and URDF frames as rings."""
