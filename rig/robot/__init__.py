"""The robot by RTDE: its state, vetted as it comes, and slow moves that anything wrong stops."""
