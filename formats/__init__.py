"""Files: schemas, reading, writing, robots, exports, rings to print."""
