"""Where a robot can stand clear of itself and of the cell, and the routes between."""
