"""Upper bounds on every layout of a budget, beside the best known one."""
