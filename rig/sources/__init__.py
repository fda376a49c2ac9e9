"""Joint states and ring readings from files: ROS 2 bags, MCAP and CSV."""
