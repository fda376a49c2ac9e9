"""The paper measured anew."""
