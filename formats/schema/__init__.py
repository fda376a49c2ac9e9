"""The models of users' files and of what commands print for scripts."""
