"""Upper bounds on the best layout, compared with the search."""
