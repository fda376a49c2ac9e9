"""Pictures, tables and pages of what was counted, and the terminal that lines are said in."""
