"""Upper bounds on the coverage of every layout within a budget."""
