"""Everything that is read from a file or written to one; ``loader`` is the one door for users'
files.
"""
