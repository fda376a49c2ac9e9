"""Browser page that shows a setup and edits it."""
