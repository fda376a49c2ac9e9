"""Pydantic models of all files, and their mapping to domain objects."""
