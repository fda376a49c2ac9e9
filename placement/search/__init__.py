"""The search: exchange, climbs from many starts, and the choice among the finalists."""
