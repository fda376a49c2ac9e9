"""Solids as implicit functions, and guaranteed bounds of their volume fraction in a cube."""
