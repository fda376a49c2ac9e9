"""Which sensors disturb each other, and when each of them fires."""
