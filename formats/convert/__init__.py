"""Between the models of files and what they stand for in code."""
