"""Solids as implicit functions, and guaranteed bounds of their share of a cube."""
