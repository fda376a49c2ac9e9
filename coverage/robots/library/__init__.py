"""The robots that are built in."""
