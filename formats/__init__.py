"""Files and formats: reading, writing, exports, and their models."""
