"""Studies into a folder: their cells are measured once, by one process or by many."""
