"""The page in a browser that shows a setup and changes it."""
