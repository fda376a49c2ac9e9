"""Files of users and of results: their models, and what they hold as scenes, robots, setups and counts."""
