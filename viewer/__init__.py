"""The viewer: a page in a browser on which a setup is looked at, changed, counted, searched on
from, and saved.
"""
