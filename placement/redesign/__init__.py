"""The best changes of one, two, three rings to a mounted setup."""
