"""Pictures, tables, pages, and text in the terminal."""
