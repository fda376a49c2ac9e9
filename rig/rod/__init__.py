"""Coverage check: the test rod, its trial points, the printed plan, and the estimated coverage."""
