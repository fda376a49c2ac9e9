"""Detection: would a sensor notice a test piece at a place?"""
